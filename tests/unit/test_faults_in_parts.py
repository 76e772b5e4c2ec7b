"""A fault in the code of a part is told with its file and line."""

from __future__ import annotations

import dataclasses
import math
import sys
from dataclasses import dataclass

import pytest

from impactlab.casefile.values.units import is_si
from impactlab.cite import OWN, bibtex
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.power_law import Hertz
from impactlab.errors import PluginError, StepError, raised_at
from impactlab.integrators.adaptive import Adaptive
from impactlab.integrators.newmark import Newmark
from impactlab.numerics.law_address import LawAddress
from impactlab.numerics.raised import keep_raised
from impactlab.scene import Mass, Wall
from impactlab.scene.method import StepRule
from impactlab.simulate import run
from impactlab.testing.contracts.common import at_most, described
from impactlab.testing.scenes import in_a_row
from impactlab.types import Level, Port, Reply, SideFacts, Start, option


def misspelt(port, reply):
    reply.force = -port.gaap


def undefined(port, reply):
    reply.force = no_such_name * port.gap  # noqa: F821


@pytest.mark.parametrize(
    ("respond", "text"),
    [(misspelt, "no field 'gaap'. Did you mean 'gap'?"), (undefined, "name 'no_such_name' is not defined")],
)
def test_code_that_cannot_be_compiled(respond, text):
    with pytest.raises(PluginError) as raised:
        LawAddress(respond, as_compiled=True)
    assert text in str(raised.value)
    assert f"{__file__}, line {respond.__code__.co_firstlineno}" in str(raised.value).replace(
        f"line {respond.__code__.co_firstlineno + 1}", f"line {respond.__code__.co_firstlineno}"
    )


def test_an_exception_is_reported_with_file_and_line():
    with pytest.raises(ValueError, match="math") as raised:
        math.sqrt(-1.0)
    line = raised.value.__traceback__.tb_lineno
    assert raised_at(raised.value) == f"ValueError: {raised.value} ({__file__}, line {line})"


@dataclass(frozen=True)
class Raising(AbstractContactLaw):
    """Raises in a step."""

    needs = frozenset({Level.POSITION})
    compiled = False
    smooth = True

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        raise KeyError("gaap")


@dataclass(frozen=True)
class RaisingAtStart(Raising):
    """Raises before the run."""

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        raise ValueError("no answer")


@pytest.mark.parametrize("integrator", [Newmark(), Adaptive()])
@pytest.mark.parametrize(
    ("law", "text"),
    [
        (Raising(), "law 'raising' of contact m|wall raised KeyError: 'gaap' ("),
        (RaisingAtStart(), "law 'raising_at_start' of contact m|wall raised ValueError: no answer ("),
    ],
)
def test_a_law_that_raises_is_named_with_its_contact(law, text, integrator):
    """'a contact law raised', or the bare exception."""
    step = StepRule(dt=1e-3) if isinstance(integrator, Newmark) else StepRule()
    bodies = Mass("far", 1.0, 1.0), Mass("m", 1.0, 1.0), Wall("wall")
    laws, gaps = (Hertz(1e3), law), (9.0, 0.1)
    with pytest.raises(StepError) as raised:
        run(*in_a_row(bodies, None, laws, integrator, step, gaps=gaps, duration=1.0))
    assert text in raised.value.text
    assert __file__ in raised.value.text
    assert isinstance(raised.value.__cause__, (KeyError, ValueError))


def test_an_unpublished_part_is_cited_as_such():
    found = bibtex([OWN, "Goldsmith1960"])
    assert found.keys == ("Goldsmith1960",)
    assert "unpublished" in found.bibtex


@dataclass(frozen=True)
class RaisingCompiled(AbstractContactLaw):
    """Spring that raises beyond a depth, in compiled code."""

    needs = frozenset({Level.POSITION})

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        if port.gap < -0.02:
            raise ValueError("too deep")
        reply.force = reply.trial = max(0.0, -1e3 * port.gap)
        reply.in_contact = 1.0 if reply.force > 0.0 else 0.0


@dataclass(frozen=True)
class DividingByZero(RaisingCompiled):
    """Divides by zero, in compiled code."""

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        reply.force = 1.0 / (port.memory[0] - port.memory[0])


@pytest.mark.parametrize(
    ("law", "text", "step"),
    [
        (RaisingCompiled(), "law 'raising_compiled' of contact m|wall raised ValueError: too deep (", 121),
        (DividingByZero(), "law 'dividing_by_zero' of contact m|wall raised ZeroDivisionError: float division", 0),
    ],
)
def test_an_exception_in_compiled_code_ends_the_run(law, text, step, capfd):
    """Numba prints it and goes on: the force was zero, and the run completed."""
    bodies = Mass("far", 1.0, 1.0), Mass("m", 1.0, 1.0), Wall("wall")
    scene = in_a_row(bodies, None, (Hertz(1e3), law), Newmark(), StepRule(dt=1e-3), gaps=(9.0, 0.1), duration=1.0)
    for _ in range(2):
        with pytest.raises(StepError) as raised:
            run(*scene)
        assert text in raised.value.text
        assert __file__ in raised.value.text
        assert raised.value.step == pytest.approx(step, abs=2)  # at speed 1 the mass is 0.02 deep after 120 ms
        assert raised.value.path == "contacts.1.law"
    assert capfd.readouterr().err == ""


class RaisingAtItsEnd:
    def __del__(self):
        raise ValueError("at its end")


def test_other_exceptions_that_cannot_be_raised_keep_their_hook(monkeypatch):
    seen = []
    monkeypatch.setattr(sys, "unraisablehook", lambda unraisable: seen.append(str(unraisable.exc_value)))
    before = sys.unraisablehook
    with keep_raised(lambda: None) as outer, keep_raised(lambda: None) as inner:
        RaisingAtItsEnd()
    assert outer.first is inner.first is None
    assert seen == ["at its end"]
    assert sys.unraisablehook is before


def without_reply(port):
    pass


def test_a_law_with_another_number_of_arguments_is_refused_with_its_signature():
    """'Signature mismatch: 2 argument types given, but function takes 1 arguments'."""
    with pytest.raises(PluginError, match="takes 1 arguments, and is called with two, port and reply"):
        LawAddress(without_reply, as_compiled=True)


@pytest.mark.parametrize("unit", ["1", "m", "kg", "N/m^1.5", "N/m^n", "N/m^exponent", "N s/m", "rad/s", "kg/m3", "1/s"])
def test_units_of_options_are_those_of_the_si(unit):
    assert is_si(unit)


@pytest.mark.parametrize("unit", ["quux", "N/mm^1.5", "GPa", "mm", "us", "in", "m +", "()"])
def test_other_units_of_options_fail_the_check(unit):
    """A plain number of a case is in SI: an option in mm would take it for mm."""
    assert not is_si(unit)
    part = dataclasses.make_dataclass(
        "Part",
        [("size", float, option(1.0, unit=unit, description="size"))],
        frozen=True,
        namespace={"__doc__": "Part.", "citations": (OWN,)},
    )
    with pytest.raises(AssertionError, match="option 'size' is in"):
        described(part())


def test_citations_given_as_a_text_are_named():
    part = dataclasses.make_dataclass("Part", [], frozen=True, namespace={"__doc__": "Part.", "citations": OWN})
    with pytest.raises(AssertionError, match="must be a tuple"):
        described(part())


def test_a_number_beyond_its_limit_is_given_with_the_limit():
    at_most(2e-3, 2e-3, "the rise [J]")
    for value, shown in ((0.25, "0.25"), (float("nan"), "nan")):
        with pytest.raises(AssertionError, match=rf"^the rise \[J\] is {shown}, and may be at most 0.002$"):
            at_most(value, 2e-3, "the rise [J]")
