"""The page docs/how-to-add-a-body-kind.md runs as it stands: its body under every model, and its block of a case."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from impactlab.contact.wave_identification import WaveIdentification
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import Probe
from impactlab.scene.method import Simulation
from impactlab.scene.ranges import SOLID, odd_speeds
from impactlab.simulate.driver import run
from impactlab.testing.scenes import CLAMPED, FREE
from impactlab.testing.scenes import struck as struck_body

PAGE = (Path(__file__).parents[2] / "docs" / "how-to-add-a-body-kind.md").read_text(encoding="utf-8")
LENGTH, AREA, DENSITY, TENSION = 0.8, 1.0e-6, 7850.0, 200.0
SPEED, IMPEDANCE = math.sqrt(TENSION / (DENSITY * AREA)), math.sqrt(TENSION * DENSITY * AREA)


@pytest.fixture(scope="module")
def page() -> dict[str, Any]:
    names: dict[str, Any] = {"__name__": "impactlab.scene.bodies.string"}
    for text in re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL):
        exec(compile(text, "how-to-add-a-body-kind.md", "exec", dont_inherit=True), names)
    return names


def struck(page: dict[str, Any], model: AbstractRodModel) -> Simulation:
    piece = page["string_segment"](LENGTH, AREA, DENSITY, TENSION)
    string = page["String"]("string", (piece,), FREE, CLAMPED)
    probes = (Probe("string", LENGTH, "force"),)
    return struck_body(string, model, WaveIdentification(), Newmark(), mass=0.005, round_trips=1.0, probes=probes)


@pytest.mark.parametrize("model", [Continuous(), Modal(60, 40), FiniteElement(60)])
def test_a_ball_meets_the_impedance_of_the_string(page: dict[str, Any], model: AbstractRodModel) -> None:
    """Until the wave is back a ball of mass m slows down as exp(-Z t/m)."""
    history = run(*struck(page, model))
    t = np.linspace(0.1, 0.9, 9) * history.duration
    within = 1e-12 if isinstance(model, Continuous) else 0.02
    assert history.evaluate(t, "velocity:hammer") == pytest.approx(np.exp(-IMPEDANCE * t / 0.005), rel=within)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 0.05


def test_its_frequencies_are_those_of_its_tension(page: dict[str, Any]) -> None:
    body = struck(page, Modal(None, 4)).scene.elastic["string"]
    found = Modal(None, 4).build(body.waves, 0.0).operators().stiffness[0]  # type: ignore[arg-type]
    exact = (2.0 * np.arange(1, 5) - 1.0) * math.pi * SPEED / (2.0 * LENGTH)
    assert np.sqrt(found[:4]) == pytest.approx(exact, rel=1e-12)


def test_its_block_gives_the_body(page: dict[str, Any]) -> None:
    given = {"kind": "string", "length": LENGTH, "area": AREA, "density": DENSITY, "tension": "200 N"}
    block = page["StringBlock"](**given, ends={"right": "clamped"})
    body = block.body("string", 1.0)
    assert body.segments == (page["string_segment"](LENGTH, AREA, DENSITY, TENSION),)
    assert body.round_trip == pytest.approx(2.0 * LENGTH / SPEED, rel=1e-12)
    assert (body.left, body.right) == (FREE, CLAMPED)
    described = block.described(body)
    assert described.pop("ends") == {"left": "free", "right": "clamped"}
    assert page["StringBlock"](**described).body("string", 1.0).segments == body.segments  # it reads what it writes
    assert described["tension"] == TENSION


def test_a_string_has_no_usual_wave_speed(page: dict[str, Any]) -> None:
    """A hint asked for the unit of a material, which the block of a string does not have."""
    assert SOLID.least > SPEED
    assert not list(odd_speeds(struck(page, Continuous()).scene))
