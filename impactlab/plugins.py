"""The registry of parts: names from entry points, without imports until a part is loaded.

Built-in parts are registered in the same groups of entry points as plugins, so that their mechanism is always tested.
"""

from __future__ import annotations

import contextlib
import dataclasses
import inspect
import re
import sys
from collections.abc import Callable, Iterable
from functools import cache
from importlib import import_module
from importlib.metadata import distributions
from typing import Any, NamedTuple

from impactlab.errors import PluginError, closest
from impactlab.startup.wall_time import LOADING, spent_on


class Group(NamedTuple):
    """A kind of part: its entry-point group, its name in messages, its class or function."""

    name: str
    noun: str
    base: str = ""  # module:class from which it must derive
    arguments: tuple[str, ...] = ()  # of a part that is a function


MODELS = Group("impactlab.models", "a model", "impactlab.models.base:AbstractRodModel")
BASES = Group("impactlab.bases", "a basis", "impactlab.bases.base:AbstractBasis")
LAWS = Group("impactlab.contact_laws", "a contact law", "impactlab.contact.base:AbstractContactLaw")
INTEGRATORS = Group("impactlab.integrators", "an integrator", "impactlab.integrators.base:AbstractScheme")
MECHANISMS = Group("impactlab.mechanisms", "a mechanism", "impactlab.mechanisms.base:AbstractMechanism")
METRICS = Group("impactlab.metrics", "a metric", arguments=("history", "reference", "scene"))
QUANTITIES = Group("impactlab.quantities", "a quantity", arguments=("scene", "history"))
GROUPS = (MODELS, BASES, LAWS, INTEGRATORS, MECHANISMS, METRICS, QUANTITIES)


class Entry(NamedTuple):
    """One registered name: where the part is and which distribution brings it."""

    group: str
    name: str
    value: str  # module:attribute
    distribution: str


def installed_entries() -> tuple[Entry, ...]:
    """Return the entries of the installed distributions in our groups; nothing is imported."""
    groups = {group.name for group in GROUPS}
    found: dict[Entry, None] = {}
    for distribution in distributions():
        points = [point for point in distribution.entry_points if point.group in groups]
        if points:
            name = distribution.metadata["Name"] or "unnamed distribution"  # the whole file is read at each question
            found |= {Entry(point.group, point.name, point.value, name): None for point in points}
    return tuple(found)


_names: dict[Any, str] = {}  # parts that were loaded, and the name of each in cases


def snake_case(part: type[Any] | Callable[..., Any]) -> str:
    """Return the name of a class in snake case: ``crush_box`` of ``CrushBox``."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", part.__name__).lower()


def name_of(part: type[Any]) -> str:
    """Return the registered name of a class, else its name in snake case."""
    return _names.get(part) or snake_case(part)


def kind_of(part: object) -> str:
    """Return the name by which a case file names the class of a part."""
    return name_of(type(part))


class Registry:
    """The parts that may be named in a case.

    Parameters
    ----------
    entries : iterable of Entry
        The registered parts. Tests and authors may give their own; `registry()` holds the installed ones.
    """

    def __init__(self, entries: Iterable[Entry]) -> None:
        self.entries = tuple(entries)
        self._loaded: dict[tuple[str, str], Any] = {}  # parts by group and name: each case names its parts again

    def names(self, group: Group) -> tuple[str, ...]:
        """Return the sorted names of a group, without importing anything."""
        return tuple(sorted({entry.name for entry in self.entries if entry.group == group.name}))

    def only(self, distribution: str) -> Registry:
        """Return the registry of the parts of one distribution."""
        return Registry(entry for entry in self.entries if entry.distribution == distribution)

    def load(self, group: Group, name: str) -> type[Any]:
        """Return the part of a name: a frozen dataclass whose fields are its parameters.

        A metric is a function instead.

        Raises
        ------
        PluginError
            If no part, or more than one, has this name, or if it cannot be used; the text names it and the reason.
        """
        known: type[Any] | None = self._loaded.get((group.name, name))
        if known is not None:
            return known
        entries = [entry for entry in self.entries if entry.group == group.name and entry.name == name]
        if not entries:
            text, installed = self._unknown(group, name), self._installed(group)
            hint = "" if "Did you mean" in text or ": it is" in text else " If a plugin has it, install the plugin."
            raise PluginError(text, remedy=installed + hint)
        if len(entries) > 1:
            homes = sorted(f"{entry.distribution} ({entry.value})" for entry in entries)
            others = sorted({entry.distribution for entry in entries} - {"impactlab"})
            advice = (
                f"Uninstall {others[0]}, or give its part"
                if len(others) < len(entries)
                else "Uninstall one, or give it"
            )
            raise PluginError(
                f"{name!r} is {group.noun} in more than one distribution: {' and '.join(homes)}",
                remedy=f"{advice} another name in its pyproject.toml: cases that name {name!r} are refused until then.",
            )
        entry = entries[0]
        part: type[Any] = _import(entry, group)
        try:
            fault = fault_of(part, group)
        except Exception as error:  # noqa: BLE001 - attributes of a plugin's class may raise anything
            fault = f"it cannot be examined: {type(error).__name__}: {str(error)[:200]}"
        if fault:
            raise PluginError(
                f"{name!r} of {entry.distribution} ({entry.value}) cannot be used as {group.noun}: {fault}",
                remedy="Fix the plugin (see `impactlab plugins`), or uninstall it.",
            )
        if _names.get(part) != snake_case(part):
            _names[part] = name
        self._loaded[group.name, name] = part
        return part

    def _unknown(self, group: Group, name: str) -> str:
        for other in (MODELS, BASES, LAWS, INTEGRATORS):
            if other is not group and name in self.names(other):
                return f"{name[:80]!r} is not {group.noun}: it is {other.noun}."
        return f"{name[:80]!r} is not {group.noun}.{closest(name, self.names(group))}"

    def _installed(self, group: Group) -> str:
        names = ", ".join(self.names(group))
        if not names:
            is_complete = any(entry.distribution == "impactlab" for entry in self.entries)
            missing = "the plugin that has it" if is_complete else "impactlab itself (pip install .)"
            return f"None is installed: install {missing}, then see `impactlab plugins`."
        return f"Installed: {names} (see `impactlab plugins`)."


@cache
def registry() -> Registry:
    """Return the parts that are installed; `registry.cache_clear()` looks again."""
    return Registry(installed_entries())


def describe(part: type[Any] | Callable[..., Any]) -> str:
    """Return the first line of a part's own docstring, empty without one."""
    written = vars(part).get("__doc__") if inspect.isclass(part) else part.__doc__
    text = inspect.cleandoc(written or "")
    line = "" if text.startswith(f"{part.__name__}(") else text.partition("\n")[0]  # text that dataclass generates
    given = line.removeprefix("Return ").removeprefix("the ")  # of a function, in a list of parts
    return line if given == line else given[:1].upper() + given[1:]


def citations_of(part: object) -> tuple[str, ...]:
    """Return the citation keys of a part; empty where it names none."""
    return tuple(getattr(part, "citations", ()))


def parts_inside(part: Any) -> tuple[Any, ...]:
    """Return the parts that the fields of a part hold."""
    kind: Any = type(part)
    inside = (getattr(part, name) for name in _holders(kind))
    return tuple(value for value in inside if value is not None)


@cache
def _holders(kind: Any) -> tuple[str, ...]:
    """Return the names of the fields of a part in which other parts stand."""
    return tuple(field.name for field in dataclasses.fields(kind) if field.metadata.get("group"))


def fault_of(part: Any, group: Group) -> str:
    """Return why an object is not a part of the group, or an empty text."""
    if group.arguments:
        return _fault_of_function(part, group)
    if not inspect.isclass(part):
        return f"it is not a class but {type(part).__name__!r}"
    if group.base:
        base = _attribute(group.base)
        if not issubclass(part, base):
            return f"it does not derive from {group.base.replace(':', '.')}"
    if inspect.isabstract(part):
        missing = sorted(vars(part)["__abstractmethods__"])
        words = [f"{name} ({(inspect.getdoc(getattr(part, name)) or '').partition('.')[0]})" for name in missing]
        return f"it does not define {', '.join(words)}"
    if group is LAWS and not isinstance(getattr(part, "needs", None), frozenset):
        return "its class has no frozenset `needs`: write needs = frozenset({Level.POSITION}), for example"
    if unset := _unset(part):
        return f"its class does not set {', '.join(unset)}"
    if not dataclasses.is_dataclass(part) or not part.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        return "it is not a frozen dataclass (write @dataclass(frozen=True) above it)"
    for field in dataclasses.fields(part):
        if field.init and "description" not in field.metadata:
            return f"its field {field.name!r} is not made by impactlab.types.option"
        if field.name == "kind":
            return "its field 'kind' has a name that cases use for the part itself"
    return "" if describe(part) else "its class has no docstring, whose first line a listing shows"


def _unset(part: type[Any]) -> list[str]:
    """Return the class facts that a base class declares and that have no value."""
    declared = [(name, kind) for base in part.__mro__ for name, kind in vars(base).get("__annotations__", {}).items()]
    return [name for name, kind in declared if "ClassVar" in str(kind) and not hasattr(part, name)]


def _fault_of_function(part: Any, group: Group) -> str:
    """Return why a function does not fit its group, or an empty text."""
    if not inspect.isfunction(part):
        return f"it is not a function but {type(part).__name__!r}"
    try:
        inspect.signature(part).bind(*group.arguments)
    except TypeError as error:
        return f"it cannot be called as {group.noun.split()[-1]}({', '.join(group.arguments)}): {error}"
    return "" if describe(part) else "it has no docstring, whose first line a listing shows"


def _import(entry: Entry, group: Group) -> Any:
    try:
        with contextlib.redirect_stdout(sys.stderr):  # its output may not get into a JSON document
            return _attribute(entry.value)
    except (Exception, SystemExit) as error:  # a stranger's module may raise anything, or try to leave
        raise PluginError(
            f"{entry.name!r} of {entry.distribution} ({entry.value}) could not be imported as {group.noun}: "
            f"{type(error).__name__}: {str(error)[:200]}",
            remedy="Fix or reinstall that distribution (see `impactlab plugins`).",
        ) from error


def _attribute(value: str) -> Any:
    module, _, name = value.partition(":")
    with spent_on(LOADING):  # the first model loads the library that compiles
        found: Any = import_module(module.strip())
    for part in name.strip().split("."):
        found = getattr(found, part)
    return found
