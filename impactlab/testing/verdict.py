"""The verdict on one part: its contract suite, costs and accuracy.

The suite runs outside of pytest.

`impactlab plugins --check NAME` prints it; a plugin author may call `verdict` from a notebook.
"""

from __future__ import annotations

import dataclasses
import linecache
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from impactlab.casefile.parts import describe_part, plain_value, read_part
from impactlab.contact.base import AbstractContactLaw
from impactlab.errors import CaseError, ImpactlabError, PairingError, PluginError, StepError, closest
from impactlab.plugins import GROUPS, LAWS, Group, Registry, describe, kind_of
from impactlab.testing.contracts import SUITES, suite_of
from impactlab.testing.measures import MEASURES, Measured, partners, struck, walked

WITHIN = "it reads and writes within its memory"


class Property(NamedTuple):
    """One property of a part: text, tried options, and why it does not hold."""

    text: str
    options: dict[str, Any]
    reason: str  # empty where it holds


class Verdict(NamedTuple):
    """All that a check found."""

    group: Group
    name: str
    distribution: str
    description: str
    properties: tuple[Property, ...]
    measured: tuple[Measured, ...]

    @property
    def ok(self) -> bool:
        """Whether every property holds and everything could be measured."""
        return not any(found.reason for found in self.properties) and all(found.ok for found in self.measured)

    def document(self) -> dict[str, Any]:
        """Return plain values, for ``--json``."""
        return {
            "schema_version": 1,
            "part": {
                "group": self.group.name,
                "name": self.name,
                "distribution": self.distribution,
                "description": self.description,
            },
            "status": "ok" if self.ok else "failed",
            "properties": [
                {"property": text, "options": options, "ok": not reason, "reason": reason}
                for text, options, reason in self.properties
            ],
            "measured": [found._asdict() for found in self.measured],
        }


def find(name: str, registry: Registry) -> tuple[Group, str]:
    """Return group and name of a part given as ``NAME`` or ``law:NAME``.

    Raises
    ------
    PluginError
        If no part, or parts of several groups, have this name.
    """
    wanted, _, plain = name.rpartition(":")
    groups = [group for group in GROUPS if wanted in ("", word(group), group.name, group.name.rpartition(".")[2])]
    found = [group for group in groups if plain in registry.names(group)]
    if len(found) == 1:
        return found[0], plain
    if found:
        choices = ", ".join(f"{word(group)}:{plain}" for group in found)
        raise PluginError(f"{plain!r} is the name of several parts", remedy=f"Give one of {choices}.")
    known = sorted({other for group in groups for other in registry.names(group)})
    listed = "`impactlab plugins` lists the installed parts."
    if len(groups) < len(GROUPS):  # a kind was given
        listed = f"Installed: {', '.join(known) or 'none of this kind'}."
    raise PluginError(
        f"{name[:80]!r} is not the name of a part.{closest(plain, known)}",
        remedy=f"Install a part of your own first: pip install -e FOLDER. {listed}",
    )


def word(group: Group) -> str:
    """Return the last word of the noun of a group: model, basis, law, integrator, metric."""
    return group.noun.rpartition(" ")[2]


def verdict(name: str, registry: Registry) -> Verdict:
    """Return the result of a check of a part; see `find` for the name."""
    group, name = find(name, registry)
    kind = registry.load(group, name)
    home = next(entry.distribution for entry in registry.entries if (entry.group, entry.name) == (group.name, name))
    if group not in SUITES:
        raise PluginError(f"there is no contract suite for {group.name}", remedy="Only its listing can be checked.")
    if not __debug__:
        raise PluginError("python -O takes the assertions out of the suites", remedy="Run python without -O.")
    properties: list[Property] = []
    measured: tuple[Measured, ...] = ()
    if group.arguments:  # a function: it has no options, and no case names it
        return Verdict(group, name, home, describe(kind), tuple(tried(kind, group)), ())
    for number, options in enumerate(options_to_try(kind)):
        shown = {key: plain_value(value) for key, value in options.items()}
        try:
            part = kind(**options)
        except Exception as error:  # noqa: BLE001 - a stranger's class
            properties.append(Property("it can be made with its options", shown, reason_of(error)))
            continue
        properties += [found._replace(options=shown) for found in properties_of(part, group, name, registry)]
        if number == 0 and not any(found.text == WITHIN and found.reason for found in properties):
            measured = tuple(MEASURES[group](part)) if group in MEASURES else ()
    return Verdict(group, name, home, describe(kind), tuple(properties), measured)


def options_to_try(kind: type[Any]) -> tuple[dict[str, Any], ...]:
    """Return a part's ``examples``, required fields filled in from their limits."""
    return tuple(required(kind) | dict(options) for options in kind.examples)


def required(kind: type[Any]) -> dict[str, Any]:
    """Return values for the fields that have no default, inside their limits."""
    return {
        field.name: inside(field.metadata["limits"], whole=str(field.type) == "int")
        for field in dataclasses.fields(kind)
        if field.init and field.default is dataclasses.MISSING
    }


def inside(limits: dict[str, float], whole: bool) -> float:
    """Return a value within limits."""
    low, high = limits.get("ge", limits.get("gt")), limits.get("le", limits.get("lt"))
    if low is not None and high is not None:
        value = 0.5 * (low + high)
    elif low is not None:
        value = low + 1.0
    else:
        value = 1.0 if high is None else high - 1.0
    return int(value) if whole else value


def properties_of(part: Any, group: Group, name: str, registry: Registry) -> Iterator[Property]:
    """Yield each property of a part with its result."""
    checks: list[tuple[str, Callable[[], None]]] = [
        ("it goes by the name of its class", lambda: _named(part, name)),
        ("a case file can give its options", lambda: _given(part, group, name, registry)),
    ]
    if group is LAWS:
        checks.append((WITHIN, lambda: _within_its_memory(part)))
    return tried(part, group, checks)


def tried(part: Any, group: Group, first: Iterable[tuple[str, Callable[[], None]]] = ()) -> Iterator[Property]:
    """Yield each property that the suite of a group tests, after those given."""
    kind, kept = (part, staticmethod(part)) if group.arguments else (type(part), part)
    suite = type(f"Suite{kind.__name__}", (suite_of(group, kind),), {"part": kept})()
    checks = list(first)
    methods = [method for method in dir(suite) if method.startswith("test_")]
    line = {method: getattr(type(suite), method).__code__.co_firstlineno for method in methods}
    for method in sorted(methods, key=lambda each: line[each]):
        checks.append((method.removeprefix("test_").replace("_", " "), getattr(suite, method)))
    for text, check in checks:
        try:
            with np.errstate(all="ignore"):  # steps beyond the limit are meant to diverge
                check()
        except Exception as error:  # noqa: BLE001 - a failed property, or a part that raises
            yield Property(text, {}, reason_of(error))
        else:
            yield Property(text, {}, "")


def reason_of(error: Exception) -> str:
    """Return the reason of an error in one line.

    It is the text of the error, else the code's line, with the place for a fault in code.
    """
    kind = "" if isinstance(error, AssertionError) else f"{type(error).__name__}: "
    lines = [" ".join(line.split()) for line in str(error).splitlines() if line.strip()]
    text = " ".join([*(line if line.endswith((".", ":")) else f"{line}." for line in lines[:-1]), *lines[-1:]])
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    if not text and trace is not None:
        text = linecache.getline(trace.tb_frame.f_code.co_filename, trace.tb_lineno).strip()
    reason = (kind + text)[:300] or type(error).__name__
    if trace is None or isinstance(error, (AssertionError, ImpactlabError)):
        return reason
    return f"{reason} ({trace.tb_frame.f_code.co_filename}, line {trace.tb_lineno})"


def _named(part: Any, name: str) -> None:
    assert kind_of(part) == name, f"the class name makes {kind_of(part)!r} in summaries, and cases name {name!r}"


def _within_its_memory(law: AbstractContactLaw) -> None:
    """Check every index of a law in a whole impact, uncompiled.

    Compiled, one beyond its records would end the process.
    """
    kind: Any = type(law)
    facts = {"compiled": False, "__module__": kind.__module__, "__doc__": kind.__doc__}
    plain: Any = type(kind.__name__, (kind,), facts)
    options = {field.name: getattr(law, field.name) for field in dataclasses.fields(kind) if field.init}
    try:
        integrator, model = partners(law)
        walked(struck(model, plain(**options), integrator))
    except (PairingError, CaseError):
        return  # no scene to try it in; the figures say why
    except StepError as error:
        if isinstance(error.__cause__, IndexError):
            raise IndexError(f"beyond the records of a law: {error.__cause__}") from error


def _given(part: Any, group: Group, name: str, registry: Registry) -> None:
    again = read_part(describe_part(part, name), "", group, registry)
    assert again == part, f"a case makes {again!r} of it"
