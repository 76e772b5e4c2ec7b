"""Axes of a sweep: paths of the case with their checked values.

They are read and checked before the first run.
"""

from __future__ import annotations

import contextlib
import csv
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from impactlab.casefile import Case
from impactlab.casefile.document import parse_value
from impactlab.casefile.edit import check_name, is_named, numbered, plain, refuse_unknown_body
from impactlab.casefile.text.words import shown
from impactlab.casefile.values.units import to_si
from impactlab.errors import CaseError, ImpactlabError, unreadable
from impactlab.sweeps.given_twice import refuse_removed, refuse_twice
from impactlab.types import Array

BY, BY_DRAWING = "the sweep", "the distribution"  # that give the values of a point, in messages
METHOD = "method"  # path of an axis whose values are names of methods of the case
MAX_POINTS = 10_000_000
MAX_RANGE = 1_000_000  # values of one range
MAX_CHECKED = 200  # numbers of an axis that are checked one by one, some milliseconds each
MAX_KEPT_BODIES = 2000  # of all cases of an axis that are kept for its points, some 10 kB each
SPREAD_NUMBERS = 12  # numbers of a longer axis that are, evenly from the least to the largest
HALF_RANGE = re.compile(r"[-+]?[0-9.][^:,\[\]{}]*:[-+]?[0-9.][^:,\[\]{}]*")
BAD_COUNT = re.compile(r"(?P<ends>[-+]?[0-9.][^:,\[\]{}]*:[-+]?[0-9.][^:,\[\]{}]*):(?P<count>[^:,\[\]{}]*)")
RANGE = re.compile(r"(?P<first>[^:]+):(?P<last>[^:]+):(?P<count>[0-9]{1,9})(?P<log>log)?")


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
        """Return path and value of each axis at a point.

        Points are numbered with the last axis running fastest.
        """
        if self.listed:
            return {axis.path: axis.values[number] for axis in self.axes}
        found: dict[str, Any] = {}
        for axis in reversed(self.axes):
            number, place = divmod(number, len(axis.values))
            found[axis.path] = axis.values[place]
        return dict(reversed(found.items()))

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

    The method is chosen first, then the values are given ``by`` these words.
    """
    settings = dict(settings)
    method = settings.pop(METHOD, None)
    case = case if method is None else case.method(method)
    return case.with_settings(settings.items(), by=by) if settings else case


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
    return Points(_checked(case, given, known), listed=True)


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
    every = values.tolist() if isinstance(values, np.ndarray) else values
    given = tuple(
        value if type(value) is float else plain(value.item() if isinstance(value, np.generic) else value, path)
        for value in every
    )
    if not given:
        raise CaseError("an axis without values", remedy="Give at least one.", path=path)
    return given


def _refuse_many(values: Iterable[Sequence[Any]]) -> None:
    shape = [len(each) for each in values]
    if not shape:
        raise CaseError("a sweep without an axis", remedy="Give a path of the case and its values.")
    if (count := math.prod(shape)) > MAX_POINTS:
        text = f"{' x '.join(map(str, shape))} = {count:.3g} points; allowed: {MAX_POINTS:.3g}"
        raise CaseError(text, remedy="Give fewer values.")


def _checked(case: Case, given: Mapping[str, tuple[Any, ...]], known: Known | None) -> tuple[Axis, ...]:
    refuse_twice(case, list(given))
    for path, values in given.items():
        if path != METHOD:
            refuse_removed(case, path, values)
    return tuple(read_axis(case, path, values, (known or {}).get(path)) for path, values in given.items())


def read_axis(case: Case, path: str, given: tuple[Any, ...], known: Mapping[str, Any] | None = None) -> Axis:
    """Return an axis with its values in SI units, checked by the case.

    Values that are ``known`` are not checked again.

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
    unit = case.unit_of(path)
    if len(given) > MAX_CHECKED and all(type(value) is float for value in given) and _span_is_si(case, path, given):
        return Axis(path, given, given, unit)
    distinct = {repr(value): value for value in given}
    keeps = len(distinct) * len(case.scene().bodies) <= MAX_KEPT_BODIES
    cases: dict[str, Case] = {}
    in_si: dict[str, Any] = {}
    for key, value in distinct.items():
        changed = _with_value(case, path, value)
        in_si[key] = _value_in_si(case, changed, path, value)
        if keeps:
            cases[key] = changed
    return Axis(path, given, tuple(in_si[repr(value)] for value in given), unit, (case, cases))


def takes_whole(case: Case, path: str) -> bool:
    """Return whether a path of a case allows only whole numbers."""
    try:
        case.with_(path, 0.5)
    except ImpactlabError as error:
        own = numbered(case.document.data, path)
        return any("a whole number" in each.text for each in (error, *error.others) if each.path in (path, own))
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
        raise CaseError("an axis with a number that is not finite", path=path, remedy="Give finite values.")
    return all(_in_si(case, path, given[place]) == given[place] for place in spread(numbers))


def _with_value(case: Case, path: str, value: Any) -> Case:
    """Return the case with a value of a path, which passes its checks."""
    if isinstance(value, float) and not math.isfinite(value):
        raise CaseError(f"{value} is not a finite number", path=path, remedy="Give finite values.")
    with _named(path):
        return at_point(case, {path: value})


@contextlib.contextmanager
def _named(path: str) -> Iterator[None]:
    """Give errors without a path that of an axis."""
    try:
        yield
    except ImpactlabError as error:
        error.path = error.path or path
        raise


def _in_si(case: Case, path: str, value: Any) -> Any:
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


def read_over(case: Case, text: str) -> tuple[str, list[Any]]:
    """Return path and values of an axis of the command line.

    ``PATH=A,B,C`` lists values, ``PATH=FIRST:LAST:COUNT`` gives equal steps, ``PATH=FIRST:LAST:COUNTlog`` equal ratios.
    """
    path, equals, values = (part.strip() for part in text.partition("="))
    if not equals or not path or not values:
        raise CaseError(f"--over {shown(text)} is not PATH=VALUES", remedy="Write PATH=A,B,C or PATH=FIRST:LAST:COUNT.")
    found = RANGE.fullmatch(values)
    if found is None and (counted := BAD_COUNT.fullmatch(values)):
        text = f"--over {shown(text)} gives a range of {shown(counted['count'])} values; allowed: 2 to {MAX_RANGE}"
        raise CaseError(text, remedy=f"Write {path}=FIRST:LAST:COUNT, as in {counted['ends']}:11.", path=path)
    if found is None and HALF_RANGE.fullmatch(values):
        text = f"--over {shown(text)} gives a range without its number of values"
        raise CaseError(text, remedy=f"Write {path}=FIRST:LAST:COUNT, as in {path}={values}:11.", path=path)
    if found is None and (ends := values.split(":"))[2:] and HALF_RANGE.fullmatch(":".join(ends[:2])):
        text = f"--over {shown(text)}: {shown(':'.join(ends[2:]))} is not a number of values"
        raise CaseError(text, remedy=f"Write a whole number, as in {path}={ends[0]}:{ends[1]}:11, or 11log.", path=path)
    if found is None:
        return path, [_parsed(value, path) for value in _split(values)]
    first, last = (_in_si(case, path, _parsed(found[name], path)) for name in ("first", "last"))
    count = int(found["count"])
    for end in (first, last):
        if not isinstance(end, (int, float)) or isinstance(end, bool):
            text = f"{shown(end)} is not a number and cannot begin or end a range"
            raise CaseError(text, path=path, remedy="List the values.")
    if not 2 <= count <= MAX_RANGE:
        text = f"a range of {count} values; allowed: 2 to {MAX_RANGE}"
        raise CaseError(text, remedy="Give another number of values.", path=path)
    if found["log"] and not first * last > 0.0:
        raise CaseError(
            f"equal ratios from {first:g} to {last:g} pass through zero", path=path, remedy="Leave out log."
        )
    return path, (np.geomspace if found["log"] else np.linspace)(first, last, count).tolist()


def _parsed(text: str, path: str) -> Any:
    """Return the value of a text of an axis, read as in a case file."""
    if not text.strip():
        raise CaseError("a value is missing", path=path, remedy="Write PATH=A,B,C with a value at each place.")
    try:
        return parse_value(text.strip())
    except CaseError as error:
        error.path, error.given_by = error.path or path, "--over"
        raise


def _split(values: str) -> list[str]:
    """Return the parts between commas outside brackets."""
    parts, depth = [""], 0
    for letter in values:
        depth += (letter in "[{") - (letter in "]}")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def read_points(file: Path) -> dict[str, list[Any]]:
    """Return the columns of a CSV file of points.

    A column is headed by a path, with a unit in brackets or none.
    """
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            header, *rows = [row for row in csv.reader(stream) if row]
    except (OSError, ValueError, csv.Error) as error:
        raise CaseError(
            f"the points cannot be read: {unreadable(file, error)}", file=str(file), remedy="Give a CSV file."
        ) from None
    columns: dict[str, list[Any]] = {}
    for number, heading in enumerate(header):
        named = re.fullmatch(r"\s*([^\s\[]+)\s*(?:\[([^\]]*)\])?\s*", heading)
        if named is None or named[1] in columns:
            raise CaseError(f"{shown(heading)} is not a valid column heading, or appears twice", file=str(file),
                            remedy="Write a path of the case, as in: bodies.hammer.mass [kg].")  # fmt: skip
        columns[named[1]] = [_cell(file, line, row, number, named[2] or "") for line, row in enumerate(rows, start=2)]
    return columns


def _cell(file: Path, line: int, row: Sequence[str], number: int, unit: str) -> Any:
    if len(row) <= number or not row[number].strip():
        raise CaseError("a value is missing", file=str(file), line=line, remedy="Give a value in each column.")
    value = parse_value(row[number].strip())
    return f"{row[number].strip()} {unit}" if unit and isinstance(value, (int, float)) else value
