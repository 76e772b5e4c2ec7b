"""Axes of a sweep: paths of the case with their values, read and checked before the first run."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from impactlab.casefile import Case
from impactlab.casefile.edit import check_name, in_order, is_named, numbered, plain, refuse_unknown_body
from impactlab.casefile.text.words import shown
from impactlab.casefile.values.units import to_si
from impactlab.errors import WHOLE, CaseError, ImpactlabError
from impactlab.sweeps.given_twice import refuse_removed, refuse_twice
from impactlab.types import Array

BY, BY_DRAWING = "the sweep", "the distribution"  # that give the values of a point, in messages
METHOD = "method"  # path of an axis whose values are names of methods of the case
MAX_POINTS = 10_000_000
MAX_CHECKED = 200  # numbers of an axis that are checked one by one, some milliseconds each
MAX_KEPT_BODIES = 2000  # of all cases of an axis that are kept for its points, some 10 kB each
SPREAD_NUMBERS = 12  # numbers of a longer axis that are, evenly from the least to the largest


@dataclass(frozen=True)
class Axis:
    """A path of the case with its values."""

    path: str  # dotted path of the case, or `METHOD`
    values: tuple[Any, ...]  # as a case file holds them
    si: tuple[Any, ...]  # the same in SI; words and blocks as they are
    unit: str  # of the numbers; empty of words
    # The case that it is of and the cases of its values, by their `repr`, if their check has built few.
    checked: tuple[Case, Mapping[str, Case]] | None = field(default=None, repr=False, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields of a copy for another process, which builds its own cases."""
        return vars(self) | {"checked": None}

    def case(self, case: Case, value: Any) -> Case | None:
        """Return a case with one value alone, as checked, or None if not kept."""
        return self.checked[1].get(repr(value)) if self.checked is not None and self.checked[0] is case else None

    @property
    def is_numeric(self) -> bool:
        """Whether all values are numbers."""
        return all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in self.si)


@dataclass(frozen=True)
class Points:
    """The points of a sweep: a grid of several axes, or listed ones.

    In listed points the values of all axes go together.
    """

    axes: tuple[Axis, ...]
    listed: bool = False
    design: Mapping[str, Any] = field(default_factory=dict)  # how listed points were drawn, as attributes of the result

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each dimension of the result."""
        return (len(self.axes[0].values),) if self.listed else tuple(len(axis.values) for axis in self.axes)

    @property
    def count(self) -> int:
        """Number of points."""
        return math.prod(self.shape)

    def settings(self, number: int) -> dict[str, Any]:
        """Return path and value of each axis at a point, the last axis running fastest."""
        if self.listed:
            return {axis.path: axis.values[number] for axis in self.axes}
        found: dict[str, Any] = {}
        for axis in reversed(self.axes):
            number, place = divmod(number, len(axis.values))
            found[axis.path] = axis.values[place]
        return dict(reversed(found.items()))

    def first_with(self, axis: Axis, value: Any) -> dict[str, Any]:
        """Return path and value of each axis at the first point with a value of an axis."""
        if self.listed:
            return self.settings(axis.values.index(value))
        return {**self.settings(0), axis.path: value}

    def case(self, case: Case, number: int) -> Case:
        """Return the case of a point; raises the errors of the case there."""
        settings = self.settings(number)
        if len(self.axes) == 1 and not self.design:
            (axis,) = self.axes
            known = axis.case(case, settings[axis.path])
            if known is not None:
                return known
        return at_point(case, settings, BY_DRAWING if self.design else BY)


def at_point(case: Case, settings: Mapping[str, Any], by: str = BY) -> Case:
    """Return a case with the values of a point.

    The method is chosen first, then the values are given ``by`` these words, a kind before the keys of its block.
    """
    settings = dict(settings)
    method = settings.pop(METHOD, None)
    case = case if method is None else case.method(method)
    kinds = any(path.endswith(".kind") for path in settings)
    pairs = in_order(settings.items(), case.document.data) if kinds else settings.items()
    return case.with_settings(pairs, by=by) if settings else case


Known = Mapping[str, Mapping[str, Any]]
"""Axes that were checked before, as the folder of a sweep holds them, by path."""


def grid(case: Case, over: Mapping[str, Iterable[Any]], known: Known | None = None) -> Points:
    """Return the grid of several axes, with every value checked by the case.

    ``over`` maps paths to values.

    Raises
    ------
    CaseError, PairingError, PluginError
        If a path or a value is wrong, or there are too many points.
    """
    given = {path: _values(path, values) for path, values in _columns(over, "over")}
    _refuse_many(given.values())
    return Points(_checked(case, given, known))


def listed(case: Case, columns: Mapping[str, Iterable[Any]], known: Known | None = None) -> Points:
    """Return listed points, path to one value per point each; raises as `grid` does."""
    given = {path: _values(path, values) for path, values in _columns(columns, "points")}
    lengths = {path: len(values) for path, values in given.items()}
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{path} {length}" for path, length in lengths.items())
        raise CaseError(f"columns of different lengths: {counts}", remedy="Give one value of each path per point.")
    _refuse_many(list(given.values())[:1])
    return Points(_checked(case, given, known, are_listed=True), listed=True)


def _columns(given: Any, name: str) -> Iterable[tuple[str, Iterable[Any]]]:
    """Return paths with their values, of a mapping or of a table of pandas."""
    if not hasattr(given, "items"):
        raise CaseError(
            f"{name} is a {type(given).__name__}, not paths with values",
            remedy=f"Write {name}={{'bodies.hammer.mass': [1.0, 2.0]}}; a table of pandas serves as well.",
        )
    pairs: Iterable[tuple[str, Iterable[Any]]] = given.items()
    return pairs


def _values(path: str, values: Iterable[Any]) -> tuple[Any, ...]:
    if isinstance(values, (str, int, float)):
        values = [values]
    if not isinstance(values, Iterable):
        raise CaseError(f"{shown(values)} is no value of an axis", remedy="Give a list of numbers or texts.", path=path)
    every = np.atleast_1d(values).tolist() if isinstance(values, np.ndarray) else values
    given = tuple(
        value if type(value) is float else plain(value.item() if isinstance(value, np.generic) else value, path)
        for value in every
    )
    if not given:
        raise CaseError("this axis has no values", remedy="Give at least one, as in [1.0, 2.0].", path=path)
    return given


def _refuse_many(values: Iterable[Sequence[Any]]) -> None:
    shape = [len(each) for each in values]
    if not shape:
        raise CaseError("a sweep without an axis", remedy="Give a path of the case and its values.")
    if (count := math.prod(shape)) > MAX_POINTS:
        text = f"{' x '.join(map(str, shape))} = {count:.3g} points; allowed: {MAX_POINTS:.3g}"
        raise CaseError(text, remedy="Give fewer values.")


def _checked(
    case: Case, given: Mapping[str, tuple[Any, ...]], known: Known | None, are_listed: bool = False
) -> tuple[Axis, ...]:
    refuse_twice(case, list(given))
    for path, values in given.items():
        if path != METHOD:
            refuse_removed(case, path, values)
    return tuple(
        read_axis(case, path, values, (known or {}).get(path), _beside(case, path, given, are_listed))
        for path, values in given.items()
    )


def _beside(
    case: Case, path: str, given: Mapping[str, tuple[Any, ...]], are_listed: bool
) -> tuple[Mapping[str, Any], ...]:
    """Return the values that other axes give to the block of an axis whose kind is an axis.

    A kind alone may lack keys, and a key may belong to one kind only. They are those of each point that is listed, and
    of a grid the first ones with each of the kinds.
    """
    names = {each: numbered(case.document.data, each) for each in given if each != METHOD}
    blocks = [name.removesuffix("kind") for name in names.values() if name.endswith(".kind")]
    own = [block for block in blocks if names.get(path, "").startswith(block)]
    others = [each for each in names if each != path and any(names[each].startswith(block) for block in own)]
    if not others:
        return ()
    if are_listed:
        return tuple({each: given[each][place] for each in others} for place in range(len(given[path])))
    firsts = {each: given[each][0] for each in others}
    return (firsts, *({**firsts, each: kind} for each in others if each.endswith(".kind") for kind in given[each][1:]))


def read_axis(
    case: Case,
    path: str,
    given: tuple[Any, ...],
    known: Mapping[str, Any] | None = None,
    beside: Sequence[Mapping[str, Any]] = (),
) -> Axis:
    """Return an axis with its values in SI units, checked by the case.

    Values that are ``known`` are not checked again. Each value is checked with those ``beside`` it, of each point or of
    all.

    Raises
    ------
    CaseError, PairingError, PluginError
        If there is no such path, or a value is not allowed there; the error names path and value.
    """
    if known is not None and list(given) == known["values"]:
        return Axis(path, given, tuple(known["si"]), known["unit"])
    if path == METHOD:
        for name in given:
            check_name("method", str(name), case.method_names[1:], case.file)
        if case.method_name != "base":
            text = f"an axis of methods of a case whose method is chosen: {case.method_name}"
            raise CaseError(text, path=path, remedy="Leave out one of the two.")
        return Axis(path, given, given, "")
    if is_named(path):
        raise CaseError(
            "a value inside a method or variant has no effect: the values of a point are set after "
            "method and variant are chosen",
            remedy=f"Name the value itself, such as {'.'.join(path.split('.')[2:]) or 'solve.step.courant'}.",
            path=path,
        )
    refuse_unknown_body(case.document.data, path)
    unit = _unit(case, path, given[0], beside)
    is_long = not beside and len(given) > MAX_CHECKED and all(type(value) is float for value in given)
    if is_long and _span_is_si(case, path, given):
        return Axis(path, given, given, unit)
    distinct = {repr(value): place for place, value in reversed([*enumerate(given)])}
    keeps = not beside and len(distinct) * len(case.scene().bodies) <= MAX_KEPT_BODIES
    cases: dict[str, Case] = {}
    numbers: dict[str, Any] = {}
    for key, place in distinct.items():
        value = given[place]
        changed = _with_value(case, path, value, beside[place % len(beside)] if beside else {})
        numbers[key] = _value_in_si(case, changed, path, value)
        if keeps:
            cases[key] = changed
    return Axis(path, given, tuple(numbers[repr(value)] for value in given), unit, (case, cases))


def _unit(case: Case, path: str, first: Any, beside: Sequence[Mapping[str, Any]]) -> str:
    """Return the unit of an axis; empty where it differs with the kinds beside it."""
    kinds = {repr([value for each, value in other.items() if each.endswith(".kind")]): other for other in beside}
    found = {_with_value(case, path, first, other).unit_of(path) for other in kinds.values()}
    return found.pop() if len(found) == 1 else "" if found else case.unit_of(path)


def takes_whole(case: Case, path: str) -> bool:
    """Return whether a path of a case allows only whole numbers."""
    try:
        case.with_(path, 0.5)
    except ImpactlabError as error:
        own = numbered(case.document.data, path)
        return any(each.needs == WHOLE for each in (error, *error.others) if each.path in (path, own))
    return False


def spread(numbers: Array) -> list[int]:
    """Return places of extremes, of numbers nearest to zero on each side, and between."""
    order = np.argsort(numbers, kind="stable")
    chosen = {int(order[round(k)]) for k in np.linspace(0, len(numbers) - 1, min(SPREAD_NUMBERS, len(numbers)))}
    for side in (numbers < 0.0, numbers == 0.0, numbers > 0.0):
        there = np.flatnonzero(side)
        if len(there):
            chosen.add(int(there[np.argmin(np.abs(numbers[there]))]))
    return sorted(chosen)


def _span_is_si(case: Case, path: str, given: Sequence[float]) -> bool:
    """Return whether numbers are in SI as they are given; raises as `read_axis`.

    The case allows intervals of numbers, so its checks are made at the ends of the span and at some between.
    """
    numbers = np.array(given)
    if not np.all(np.isfinite(numbers)):
        wrong = int(np.flatnonzero(~np.isfinite(numbers))[0])
        text = f"value {wrong + 1} of this axis is {numbers[wrong]}, which is not finite"
        raise CaseError(text, path=path, remedy="Give finite values.")
    return all(in_si(case, path, given[place]) == given[place] for place in spread(numbers))


def _with_value(case: Case, path: str, value: Any, beside: Mapping[str, Any] = MappingProxyType({})) -> Case:
    """Return the case with a value of a path and those beside it, which passes its checks."""
    if isinstance(value, float) and not math.isfinite(value):
        raise CaseError(f"{value} is not a finite number", path=path, remedy="Give finite values.")
    with _named(path):
        return at_point(case, {path: value, **beside})


@contextlib.contextmanager
def _named(path: str) -> Iterator[None]:
    """Give errors without a path that of an axis."""
    try:
        yield
    except ImpactlabError as error:
        error.path = error.path or path
        raise


def in_si(case: Case, path: str, value: Any) -> Any:
    """Return a value of a path in SI, as the case reads it."""
    return _value_in_si(case, _with_value(case, path, value), path, value)


def _value_in_si(case: Case, changed: Case, path: str, value: Any) -> Any:
    """Return a value of a path in SI units, as the ``changed`` case reads it."""
    with _named(path):
        resolved: Any = changed.resolved()
    for key in numbered(case.document.data, path).split("."):
        if isinstance(resolved, list) and key.isdecimal():
            resolved = resolved[int(key)]
        elif isinstance(resolved, dict) and key in resolved:
            resolved = resolved[key]
        else:  # a key that the case turns into others, as a diameter into an area
            return _with_unit(value, case.unit_of(path))
    return value if isinstance(resolved, (dict, list)) else resolved


def _with_unit(value: Any, unit: str) -> Any:
    """Return a text with a unit in SI; any other value as it is."""
    if not isinstance(value, str) or not unit:
        return value
    try:
        return to_si(value, unit)
    except ValueError:
        return value
