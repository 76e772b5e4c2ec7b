"""`impactlab plugins --check`: a sound part passes, each kind of fault is found and told in a line."""

from __future__ import annotations

import dataclasses
import json
import re
import sys
import types
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from impactlab import PairingError, PluginError, StepError, plugins
from impactlab.cli import app
from impactlab.contact.base import AbstractContactLaw
from impactlab.integrators.base import AbstractIntegrator, Step
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.numerics.banded import full
from impactlab.plugins import INTEGRATORS, LAWS, MODELS, Entry, Group, Registry, installed_entries, kind_of
from impactlab.scene import Mass, Wall
from impactlab.scene.method import StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import in_a_row, mass_on_rod
from impactlab.testing.verdict import Verdict, find, verdict
from impactlab.types import Level, Port, Reply, Start, option


@dataclasses.dataclass(frozen=True)
class Spring(AbstractContactLaw):
    """A spring that acts at once, and may pull, remember or grumble."""

    needs = frozenset({Level.POSITION})
    citations = ("Goldsmith1960",)
    compiled = False

    stiffness: float = option(unit="N/m", at_least=1e6, at_most=3e6, description="spring")

    def begin(self, left: Any, right: Any, dt: float) -> Start:
        return Start(parameters=(self.stiffness,))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        if port.gap < 0.0:
            reply.force = reply.trial = -port.parameters[0] * port.gap
            reply.in_contact = 1.0
            reply.stored = 0.5 * port.parameters[0] * port.gap**2


@dataclasses.dataclass(frozen=True)
class Glue(Spring):
    """A spring that pulls."""

    citations = ("Nobody2031",)

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        reply.force = reply.trial = -port.parameters[0] * port.gap


@dataclasses.dataclass(frozen=True)
class Silent(Spring):
    """A spring that never reports its contact."""

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        Spring.respond(port, reply)
        reply.in_contact = 0.0


@dataclasses.dataclass(frozen=True)
class Needless(AbstractContactLaw):
    """A law that does not say which compliances it uses."""

    citations = ("own",)

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        reply.force = 0.0


@dataclasses.dataclass(frozen=True)
class Unused(AbstractContactLaw):
    """A law whose option never reaches its respond."""

    needs = frozenset({Level.POSITION})
    citations = ("own",)
    stiffness: float = option(1e9, unit="N/m", description="spring")

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        reply.force = max(0.0, -port.parameters[0] * port.gap)


@dataclasses.dataclass(frozen=True)
class Forgets(Spring):
    """A law whose begin returns nothing."""

    def begin(self, left: Any, right: Any, dt: float) -> Any:
        """Return nothing."""


@dataclasses.dataclass(frozen=True)
class Returns(Spring):
    """A law that returns its force."""

    compiled = True

    @staticmethod
    def respond(port: Port, reply: Reply) -> Any:
        return max(0.0, -port.parameters[0] * port.gap)


@dataclasses.dataclass(frozen=True)
class Raises(Spring):
    """A law that raises an error."""

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        raise ValueError("no answer to this gap")


@dataclasses.dataclass(frozen=True)
class Misnomer(Spring):
    """A spring that is registered under another name."""


@dataclasses.dataclass(frozen=True)
class Beyond(Spring):
    """A spring that counts its steps of contact in the wrong place, far beyond its memory."""

    compiled = True

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        if port.gap < 0.0:
            reply.force = reply.trial = -port.parameters[0] * port.gap
            reply.in_contact = 1.0
            reply.stored = 0.5 * port.parameters[0] * port.gap**2
            reply.memory[0] = port.memory[0] + 1.0
            if port.memory[0] > 3.0:
                reply.memory[1_000_000_000 * int(port.memory[0])] = 1.0


@dataclasses.dataclass(frozen=True)
class Generous(Spring):
    """A spring that replies losses below zero, and a force to match them."""

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        Spring.respond(port, reply)
        reply.dissipated = -1e-3 * reply.stored


@dataclasses.dataclass(frozen=True)
class Overstated(AbstractIntegrator):
    """A scheme of order two that says it has order three, and a limit that is too long."""

    citations = ("Bathe1982",)
    order = 3
    needs_modes = True
    gains_energy = 0.0

    def limit(self, system: Any) -> float:
        return float("inf")

    def step(self, system: Any, dt: float) -> Step:
        step = ExactModal().step(system, dt)
        return step._replace(force=lambda jump: 1.001 * np.hstack((0.5 * dt**2 * jump, dt * jump)))


@dataclasses.dataclass(frozen=True)
class Soft(AbstractRodModel):
    """A rod that is softer than it should be."""

    citations = ("Bathe1982",)
    elements: int = option(40, at_least=1, description="elements")
    has_mesh = True

    def element_length(self, body: Any) -> float:
        return float(body.length / self.elements)

    def build(self, rod: Any, gravity: float, faces: Any = ()) -> Any:
        softer = tuple(dataclasses.replace(piece, young=0.9 * piece.young) for piece in rod.segments)
        return FiniteElement(self.elements).build(dataclasses.replace(rod, segments=softer), gravity)


@dataclasses.dataclass(frozen=True)
class Empty(Soft):
    """A rod whose build returns nothing."""

    def build(self, rod: Any, gravity: float, faces: Any = ()) -> Any:
        """Return nothing."""


@dataclasses.dataclass(frozen=True)
class Full(Soft):
    """A rod whose mass matrix is full."""

    def build(self, rod: Any, gravity: float, faces: Any = ()) -> Any:
        body = FiniteElement(self.elements).build(rod, gravity)
        system = body.operators()
        body.operators = lambda: system._replace(mass=full(system.mass))  # type: ignore[method-assign]
        return body


PARTS: dict[str, tuple[Group, type[Any]]] = {
    "spring": (LAWS, Spring),
    "glue": (LAWS, Glue),
    "silent": (LAWS, Silent),
    "needless": (LAWS, Needless),
    "unused": (LAWS, Unused),
    "forgets": (LAWS, Forgets),
    "returns": (LAWS, Returns),
    "raises": (LAWS, Raises),
    "overstated": (INTEGRATORS, Overstated),
    "soft": (MODELS, Soft),
    "empty": (MODELS, Empty),
    "full": (MODELS, Full),
    "misnamed": (LAWS, Misnomer),
    "beyond": (LAWS, Beyond),
    "generous": (LAWS, Generous),
}


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch) -> Registry:
    module = types.ModuleType("parts_to_check")
    entries = []
    for name, (group, kind) in PARTS.items():
        setattr(module, kind.__name__, kind)
        entries.append(Entry(group.name, name, f"parts_to_check:{kind.__name__}", "stand-in"))
    monkeypatch.setitem(sys.modules, "parts_to_check", module)
    return Registry([*installed_entries(), *entries])


def failed(result: Verdict) -> dict[str, str]:
    """Return the failed properties with their reasons."""
    wrong = {one.text: one.reason for one in result.properties if one.reason}
    return wrong | {one.name: one.remark for one in result.measured if not one.ok}


def test_a_law_that_acts_at_once_passes_and_its_required_field_is_filled_in(found):
    result = verdict("spring", found)
    # Its own gains are the matter of an explicit spring: the suite finds nothing wrong, the impact shows the gain.
    assert set(failed(result)) <= {"largest gain of energy", "largest loss of energy"}
    assert result.properties[0].options == {"stiffness": 2e6}


def test_a_law_that_pulls_is_found(found):
    wrong = failed(verdict("glue", found))
    assert wrong["it never pulls and never books a negative loss"].startswith("it pulls: its force is -")
    assert "far apart its reply is zero" in wrong
    assert wrong["it has a description and a source"] == "no entry in citations.bib for Nobody2031"


@pytest.mark.parametrize("law", ["spring", "silent"])
def test_a_law_that_never_sets_in_contact_is_found_and_its_run_warns(found, law):
    """The run reported a contact in each of its steps, without a word."""
    wrong = failed(verdict(law, found))
    assert ("it reports the contact of faces that it presses" in wrong) == (law == "silent")
    bodies, part = (Mass("ball", 1.0, 1.0), Wall("wall")), found.load(LAWS, law)(2e6)
    history = run(*in_a_row(bodies, None, part, CentralDifference(), StepRule(dt=1e-5), duration=5e-3))
    warned = [each.text for each in history.warnings if each.code == "chatter"]
    assert len(warned) == (law == "silent")
    assert all("Law 'silent' must set reply.in_contact to 1.0" in text for text in warned)


def test_a_law_that_gains_more_than_it_declares_is_refused_with_the_bound_to_declare(found):
    """Its run asked for a smaller step alone."""
    bodies, law = (Mass("ball", 1.0, 1.0), Wall("wall")), found.load(LAWS, "spring")(2e6)
    with pytest.raises(StepError, match="energy grew") as failed_run:
        run(*in_a_row(bodies, None, law, ExactModal(), StepRule(dt=1e-5), duration=5e-3))
    assert "Law 'spring' must report the energy that it stores as `stored`, and declare" in failed_run.value.remedy


def test_mistakes_of_a_first_law_are_named(found):
    """They were an AttributeError of impactlab's own code, a line of numba's, or options without effect."""
    with pytest.raises(PluginError, match=r"write needs = frozenset\(\{Level.POSITION\}\)"):
        verdict("needless", found)
    reason = failed(verdict("unused", found))["its facts have the right types"]
    assert reason.startswith("it has options (stiffness) and no `begin`")
    bodies = Mass("ball", 1.0, 1.0), Wall("wall")
    for name, text in (("forgets", "`begin` of the law returned None"), ("returns", "it returns a value; it must")):
        assert any(text in reason for reason in failed(verdict(name, found)).values())
        with pytest.raises((PairingError, PluginError), match=text):
            run(*in_a_row(bodies, None, found.load(LAWS, name)(2e6), ExactModal(), StepRule(dt=1e-5), duration=5e-3))


def test_an_exception_of_a_law_is_reported(found):
    """File and line were given in runs only, and the measured figures asked for a smaller step."""
    asked = verdict("raises", found)
    assert re.fullmatch(
        r"ValueError: no answer to this gap \(.*\.py, line \d+\)", failed(asked)["far apart its reply is zero"]
    )
    gain = next(each.remark for each in asked.measured if each.name == "largest gain of energy")
    assert "ValueError: no answer to this gap" in gain
    assert "did not return a force" not in gain


def test_an_integrator_s_false_order_is_found(found):
    wrong = failed(verdict("overstated", found))
    assert "measured order" in wrong["its order is the declared one"]
    assert "force response is that of a load" in wrong
    assert "order on a smooth problem" in wrong


def test_a_model_that_is_too_soft_is_found(found):
    wrong = failed(verdict("soft", found))
    assert set(wrong) == {
        "pushed slowly it carries the force to its clamp",
        "its lowest frequencies are those of the rod",
    }


def test_mistakes_of_a_first_model_are_named(found):
    """They were an AttributeError of impactlab's own code and matrices that are not positive definite."""
    assert "`build` returned None, and no AbstractDiscreteModel" in failed(verdict("empty", found)).values()
    with pytest.raises(PluginError, match="`build` of model 'empty' returned None"):
        run(*mass_on_rod(found.load(MODELS, "empty")(), Spring(2e6), ExactModal(), StepRule(dt=1e-6)))
    reason = failed(verdict("full", found))["its matrices are bands and its rows fit them"]
    assert reason.startswith("mass has the shape (41, 41), and must be lower bands (bandwidth + 1, 41)")


def test_a_part_under_another_name_than_its_class_is_reported_under_a_name_that_no_case_can_load(found):
    assert kind_of(found.load(LAWS, "misnamed")(2e6)) == "misnamed"
    assert "it goes by the name of its class" not in failed(verdict("misnamed", found))


def test_a_law_that_writes_beyond_its_memory_ends_the_process(found):
    result = verdict("beyond", found)
    assert "beyond the records of a law" in failed(result)["it reads and writes within its memory"]
    assert result.measured == ()


def test_a_law_with_losses_below_zero_passes_its_check_and_its_runs(found):
    assert (
        "J, and may not be negative"
        in failed(verdict("generous", found))["it never pulls and never books a negative loss"]
    )
    bodies, law = (Mass("ball", 1.0, 1.0), Wall("wall")), found.load(LAWS, "generous")(2e6)
    scene = in_a_row(bodies, None, law, ExactModal(), StepRule(dt=1e-5), duration=5e-3)
    with pytest.raises(StepError, match=r"ball\|wall: law 'generous' returned losses of -\S+ J, below zero"):
        run(*scene)


def test_names_of_several_kinds_need_a_prefix(found):
    both = Registry([*found.entries, Entry(MODELS.name, "spring", "parts_to_check:Soft", "stand-in")])
    with pytest.raises(PluginError, match=r"Give one of model:spring, law:spring"):
        find("spring", both)
    assert find("law:spring", both) == (LAWS, "spring")
    assert find("contact_laws:spring", both) == (LAWS, "spring")
    assert find("impactlab.models:spring", both) == (MODELS, "spring")
    with pytest.raises(PluginError, match=r"'nothing' is not the name of a part"):
        find("nothing", both)
    with pytest.raises(PluginError, match="is not the name of a part"):
        find("integrator:spring", both)


def invoke(*arguments: str):
    return CliRunner().invoke(app, ["plugins", "--check", *arguments])


def test_the_command_leaves_with_0_1_or_2(found, monkeypatch):
    monkeypatch.setattr(plugins, "registry", lambda: found)
    good = invoke("exact_modal")
    assert good.exit_code == 0, good.stderr
    assert "  ok      its order is the declared one" in good.stdout
    assert good.stdout.endswith("\nok\n")
    bad = invoke("glue")
    assert bad.exit_code == 1
    assert "  FAILED  it never pulls and never books a negative loss\n          it pulls: its force is -" in bad.stdout
    unknown = invoke("hertzz")
    assert unknown.exit_code == 2
    assert "'hertzz' is not the name of a part" in unknown.stderr


def test_json_is_one_document(found, monkeypatch):
    monkeypatch.setattr(plugins, "registry", lambda: found)
    result = invoke("glue", "--json")
    document = json.loads(result.stdout)
    assert document["status"] == "failed"
    assert document["part"] == {
        "group": "impactlab.contact_laws",
        "name": "glue",
        "distribution": "stand-in",
        "description": "A spring that pulls.",
    }
    assert {one["property"] for one in document["properties"] if not one["ok"]} >= {"far apart its reply is zero"}
    assert {one["name"] for one in document["measured"]} >= {"cost per step", "largest gain of energy"}
