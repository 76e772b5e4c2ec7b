"""Every field of every registered part, just outside each of its limits and of every wrong type, in the paper's case.

What is wrong follows from the option of the field, so that a new part joins by itself. Each message names the line and
the path of the field, what was given and what is allowed.
"""

from __future__ import annotations

import dataclasses
import json
import math
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

import impactlab as il
from impactlab.casefile.parts import group_of, plain_value
from impactlab.casefile.values.units import takes_texts
from impactlab.errors import ImpactlabError, PluginError
from impactlab.plugins import BASES, INTEGRATORS, LAWS, MODELS, Group, registry
from impactlab.types import Relative
from tests.unit.case_texts import PAPER

# Each key on a line of its own; the block of the part under test comes at its end.
TOP = PAPER[: PAPER.index("contacts:")]
CONTACT = "contacts:\n  - between: [hammer, rod.left]\n    law: {kind: wave_identification}\n"
SOLVE = "solve:\n  duration: {round_trips: 3}\n  step: {points_per_period: 10}\n"
MODEL = "  model: {kind: modal, elements: 100, modes: 40}\n"
INTEGRATOR = "  integrator: {kind: newmark}\n"
# Path of the part, what stands before its keys, and how far these are indented.
PLACES: dict[Group, tuple[str, str, int]] = {
    LAWS: (
        "contacts.0.law",
        f"{TOP}{SOLVE}{MODEL}{INTEGRATOR}contacts:\n  - between: [hammer, rod.left]\n    law:\n",
        6,
    ),
    MODELS: ("solve.model", f"{TOP}{CONTACT}{SOLVE}{INTEGRATOR}  model:\n", 4),
    INTEGRATORS: ("solve.integrator", f"{TOP}{CONTACT}{SOLVE}{MODEL}  integrator:\n", 4),
    BASES: (
        "solve.model.basis",
        f"{TOP}{CONTACT}{SOLVE}{INTEGRATOR}  model:\n    kind: modal\n    elements: 100\n    modes: 40\n    basis:\n",
        6,
    ),
}
OURS = registry().only("impactlab")
PARTS = [(group, name) for group in PLACES for name in OURS.names(group)]
BOUNDS = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}


class Fault(NamedTuple):
    """A value that a field cannot hold, as the file gives it, and what the message must hold."""

    value: str
    texts: tuple[str, ...]
    inside: str = ""  # of a block that the field holds: the key that the path goes on with


class Holds(NamedTuple):
    """The values that a field may hold, read off its type and its option."""

    members: tuple[Any, ...]
    words: tuple[str, ...]
    bounds: dict[str, float]
    unit: str

    @property
    def numbers(self) -> bool:
        return float in self.members or int in self.members

    @property
    def allowed(self) -> tuple[str, ...]:
        """All that a message must name as allowed."""
        limits = tuple(f"{BOUNDS[key]} {limit:g}" for key, limit in self.bounds.items()) if self.numbers else ()
        named = {Relative: "{relative: number}", bool: "true or false", types.NoneType: "null"}
        return (*self.words, *limits, *(text for member, text in named.items() if member in self.members))


def holds(part: type[Any], field: dataclasses.Field[Any]) -> Holds:
    hint = typing.get_type_hints(part)[field.name]
    members = typing.get_args(hint) if typing.get_origin(hint) in (typing.Union, types.UnionType) else (hint,)
    literals = [member for member in members if typing.get_origin(member) is typing.Literal]
    words = tuple(str(word) for literal in literals for word in typing.get_args(literal))
    return Holds(members, words, field.metadata["limits"], field.metadata["unit"])


def misspelt(word: str) -> str:
    """Return a word with its second letter twice."""
    return word[:2] + word[1:]


def beyond(key: str, limit: float, whole: bool) -> list[float]:
    """Return numbers just outside a limit, and further out."""
    out = -1.0 if key in ("gt", "ge") else 1.0
    nearest = [limit] if key in ("gt", "lt") else [] if whole else [math.nextafter(limit, out * math.inf)]
    return [*nearest, limit + out]


def shown(number: float, key: str, limit: float) -> str:
    """Return how a message shows a number: in six digits, where these do not make it look allowed."""
    six = float(f"{number:g}")
    outside = {"gt": six <= limit, "ge": six < limit, "lt": six >= limit, "le": six > limit}[key]
    return f"{number:g}" if outside else repr(number)


def number_faults(field: Holds) -> Iterator[Fault]:
    """Give what is wrong in a field of numbers: limits, more than it holds, other kinds of number."""
    whole = float not in field.members
    for key, limit in field.bounds.items():
        for number in beyond(key, limit, whole):
            given = repr(int(number)) if whole else repr(number)
            unit = "" if field.unit == "1" else f" {field.unit}"
            texts = (f"{shown(number, key, limit)}{unit} is out of range. Allowed: ", *field.allowed)
            yield Fault(given, texts)
            if Relative in field.members:
                yield Fault(f"{{relative: {given}}}", texts)
            if takes_texts(field.unit):
                yield Fault(f"'{given} {field.unit}'", texts)
    if whole:
        yield Fault("7.5", ("7.5 is not allowed here. Allowed: a whole number", *field.allowed))
    for given in (".nan", ".inf", "-.inf"):
        yield Fault(given, (f"{given} is not a finite number",))
        if Relative in field.members:
            yield Fault(f"{{relative: {given}}}", (f"{given} is not a finite number",), ".relative")
    yield Fault("1e999", ("is beyond any number",))
    if takes_texts(field.unit):
        yield Fault("3 candela", ("'3 candela'", f"allowed: a number in {field.unit}"))


def faults(field: Holds) -> Iterator[Fault]:
    """Give all that is wrong in a field of plain values."""
    yield Fault("[1, 2]", ("a list of 2 is not allowed here. Allowed: ", *field.allowed))
    yield Fault("{absolute: 1}", ("{absolute: ...} is not allowed here. Allowed: ", *field.allowed))
    if field.numbers:
        yield from number_faults(field)
    else:
        yield Fault("7.5", ("7.5 is not allowed here. Allowed: ", *field.allowed))
    if Relative in field.members:
        yield Fault("{relative: much}", ("{relative: ...} is not allowed here. Allowed: ", *field.allowed))
    else:
        yield Fault("{relative: 1}", ("{relative: ...} is not allowed here. Allowed: ", *field.allowed))
    if bool not in field.members:
        yield Fault("true", ("true is not allowed here. Allowed: ", *field.allowed))
    if types.NoneType not in field.members:
        yield Fault("null", ("nothing is not allowed here. Allowed: ", *field.allowed))
    if field.words:
        word = max(field.words, key=len)
        hint = f" Did you mean '{word}'?" if len(word) > 2 else ""
        yield Fault(misspelt(word) + "q", (f"'{misspelt(word)}q' is not allowed here.{hint}", *field.allowed))
    else:
        yield Fault("plenty", ("'plenty' is", "llowed: "))


def block(group: Group, name: str, given: dict[str, str]) -> str:
    """Return the paper's case with a part in its place, one key of the part to a line."""
    _, text, indent = PLACES[group]
    return text + "".join(f"{' ' * indent}{key}: {value}\n" for key, value in {"kind": name, **given}.items())


def good(group: Group, name: str) -> dict[str, str]:
    """Return the parameters of a part's first example, as a case gives them."""
    part = OURS.load(group, name)
    return {key: json.dumps(plain_value(value)) for key, value in part.examples[0].items()}


def refused(file: Path, text: str) -> ImpactlabError:
    """Return the error of a case that must be refused as it is loaded."""
    file.write_text(text)
    with pytest.raises(ImpactlabError) as caught:
        il.load_case(file).scene()
    return caught.value


@pytest.fixture(params=PARTS, ids=[f"{group.name.rpartition('.')[2]}-{name}" for group, name in PARTS])
def chosen(request: pytest.FixtureRequest) -> tuple[Group, str]:
    group, name = request.param
    return group, name


def check(error: ImpactlabError, text: str, key: str, path: str, fault: Fault) -> None:
    """Check where a message says the fault is, and all that it says of it."""
    line = next(i for i, each in enumerate(text.splitlines(), 1) if each.strip() == f"{key}: {fault.value}")
    message = str(error)
    assert type(error).__name__ == "CaseError", message
    assert (error.line, error.path) == (line, path + fault.inside), message
    for words in fault.texts:
        assert words in message, (fault, message)
    assert error.remedy, message
    assert len(message) < 900, message


def test_the_case_with_the_part_as_it_should_be_is_read(tmp_path: Path, chosen: tuple[Group, str]) -> None:
    file = tmp_path / "good.yaml"
    file.write_text(block(*chosen, good(*chosen)))
    il.load_case(file).scene()


def test_every_field_refuses_values_of_another_type(tmp_path: Path, chosen: tuple[Group, str]) -> None:
    group, name = chosen
    part, file = OURS.load(group, name), tmp_path / "bad.yaml"
    for field in dataclasses.fields(part):
        if not field.init or group_of(field) is not None or field.metadata["records"]:
            continue
        path = f"{PLACES[group][0]}.{field.name}"
        for fault in faults(holds(part, field)):
            text = block(group, name, {**good(group, name), field.name: fault.value})
            check(refused(file, text), text, field.name, path, fault)
        if field.default is dataclasses.MISSING:
            given = {key: value for key, value in good(group, name).items() if key != field.name}
            message = str(refused(file, block(group, name, given)))
            assert f"{path}: this key is missing" in message


def test_every_field_misspelt_is_refused_with_its_name(tmp_path: Path, chosen: tuple[Group, str]) -> None:
    group, name = chosen
    part, file = OURS.load(group, name), tmp_path / "bad.yaml"
    names = [field.name for field in dataclasses.fields(part) if field.init]
    for right in names:
        wrong = misspelt(right)
        text = block(group, name, {**good(group, name), wrong: "1"})
        texts = (f"the key '{wrong}' is not known here. Did you mean '{right}'?", *names)
        check(refused(file, text), text, wrong, f"{PLACES[group][0]}.{wrong}", Fault("1", texts))
    text = block(group, name, {**good(group, name), "zzz": "1"})
    texts = tuple(names) if names else ("This block takes no parameters: remove the key.",)
    check(
        refused(file, text), text, "zzz", f"{PLACES[group][0]}.zzz", Fault("1", ("the key 'zzz' is not known", *texts))
    )


def test_every_field_that_holds_a_part_refuses_other_values(tmp_path: Path, chosen: tuple[Group, str]) -> None:
    group, name = chosen
    part, file = OURS.load(group, name), tmp_path / "bad.yaml"
    for field in dataclasses.fields(part):
        inside = group_of(field)
        if not field.init or inside is None:
            continue
        path, names = f"{PLACES[group][0]}.{field.name}", OURS.names(inside)
        wrong = [("7.5", "7.5"), ("[1, 2]", "a list of 2"), ("true", "true"), ("{relative: 1}", "{relative: ...}")]
        for given, words in wrong:
            text = block(group, name, {**good(group, name), field.name: given})
            needed = f"{words} is given where {inside.noun} is needed"
            check(refused(file, text), text, field.name, path, Fault(given, (needed, *names)))
        for given in (misspelt(names[0]), f"{{kind: {misspelt(names[0])}}}"):
            error = refused(file, block(group, name, {**good(group, name), field.name: given}))
            assert f"'{misspelt(names[0])}' is not {inside.noun}. Did you mean '{names[0]}'?" in str(error)
            assert error.path == f"{path}.kind"


def test_every_name_misspelt_is_refused_with_the_right_one(tmp_path: Path, chosen: tuple[Group, str]) -> None:
    group, name = chosen
    text = block(group, misspelt(name), {})
    error = refused(tmp_path / "bad.yaml", text)
    assert isinstance(error, PluginError)
    assert error.path == f"{PLACES[group][0]}.kind"
    assert error.line == len(text.splitlines())
    assert f"'{misspelt(name)}' is not {group.noun}. Did you mean '{name}'?" in str(error)
