"""The warning of a beam that gravity swings about its static sag, and the start that it proposes."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.history.base import AbstractHistory
from tests.solving import in_steps

SECTION = {"width": 0.02, "height": 0.005}
MATERIAL = {"young": 2.0e11, "density": 8000, "poisson": 0.3}
WEIGHT, EI = 9.81 * 8000 * 1e-4, 2.0e11 * 0.02 * 0.005**3 / 12.0  # N/m, N m2
MODES = {"model": {"kind": "modal", "elements": 40, "modes": 10}, "integrator": {"kind": "exact_modal"}}
MESH = {"model": {"kind": "finite_element", "elements": 40}, "integrator": {"kind": "newmark"}}
# Deflection in the middle of a beam of 1 m over q/EI, from tables.
ENDS = {
    ("pinned", "pinned"): 5.0 / 384.0,
    ("clamped", "clamped"): 1.0 / 384.0,
    ("clamped", "pinned"): 1.0 / 192.0,
    ("pinned", "clamped"): 1.0 / 192.0,
    ("clamped", "free"): 17.0 / 384.0,
    ("free", "clamped"): 17.0 / 384.0,
}


def struck(
    ends: tuple[str, str] = ("pinned", "pinned"), solve: dict[str, Any] = MODES, **changes: Any
) -> AbstractHistory:
    """A mass of 0.1 kg strikes the middle of a beam from below."""
    given = {"gravity": -9.81, "velocity": 0.1, "gap": 1e-3, "duration": 0.05, "striker": True, **changes}
    more = {key: given[key] for key in ("displacement", "theory", "tension") if key in given}
    supports = {"left": ends[0], "right": ends[1]}
    bodies: dict[str, Any] = {
        "beam": il.Beam(length=1.0, section=SECTION, material=MATERIAL, ends=supports, **more),
        "mass": il.Mass(0.1, velocity=given["velocity"]) if given["striker"] else il.Wall(),
    }
    contact = il.Contact("mass", "beam.at(0.5)", {"kind": "hertz", "stiffness": 1e8}, gap=given["gap"])
    case = il.Case(
        bodies=bodies,
        contacts=[contact],
        gravity=given["gravity"],
        solve={"duration": given["duration"], "step": {"dt": 2e-5}, **solve},
    )
    return il.run(case)


def texts(history: AbstractHistory) -> list[str]:
    return [warned.text for warned in history.warnings if warned.code == "static_sag"]


@pytest.mark.parametrize("solve", [MODES, MESH], ids=["modes", "mesh"])
@pytest.mark.parametrize("ends", list(ENDS), ids="-".join)
def test_a_beam_that_swings_about_its_sag_is_warned_of(ends: tuple[str, str], solve: dict[str, Any]) -> None:
    (text,) = texts(struck(ends, solve))
    sag = re.search(r"its static sag, (\S+) m at 0.5 m", text)
    assert sag is not None
    assert float(sag[1]) == pytest.approx(-WEIGHT / EI * ENDS[ends], rel=2e-3)  # printed to three digits
    formula = re.search(r"displacement: (\S.*?) \(gaps", text)
    assert formula is not None
    at_rest = struck(ends, solve, displacement=formula[1], gap=1.0, velocity=0.0)
    moved = at_rest.evaluate(np.linspace(0.0, 0.05, 1000), "displacement:beam@0.5")
    assert moved[0] == pytest.approx(-WEIGHT / EI * ENDS[ends], rel=1e-4)
    assert np.ptp(moved) < 1e-8 * abs(moved[0])
    assert not texts(at_rest)


def test_the_swing_is_that_of_the_run() -> None:
    """Until a run ends its beam has fallen by g t2/2 at most, and by twice its sag at most."""
    for duration, known in ((1e-3, 0.5 * 9.81e-6), (0.2, 2.0 * WEIGHT / EI * 5.0 / 384.0)):
        (text,) = texts(struck(duration=duration, gap=0.0))
        swing = re.search(r"by up to (\S+) m within the run", text)
        assert swing is not None
        assert float(swing[1]) == pytest.approx(known, rel=2e-3)


def test_no_warning_where_the_sag_does_not_matter() -> None:
    assert not texts(struck(gravity=0.0))
    assert not texts(struck(duration=1e-3, velocity=10.0, gap=0.0))  # too short for a swing
    assert not texts(struck(("free", "pinned")))  # it falls, and has no sag
    assert not texts(struck(striker=False))  # held straight and let go: nothing else moves
    assert not texts(struck(displacement="-1e-3*sin(pi*x)"))  # as the case wants it


def test_a_sag_without_a_formula_is_warned_of() -> None:
    (text,) = texts(struck(tension=10.0))
    assert "start from the sag by its displacement at t = 0" in text
    assert "leave gravity out" in text


def held_arm(gravity: float, rate: float = 0.0) -> AbstractHistory:
    """A mass of 0.1 kg strikes from below the tip of an arm, which the drive of its hub holds level."""
    drive = {"rate": rate, "within": 0.3} if rate else {"rate": 0.0}
    arm = il.Beam(length=1.0, section=SECTION, material=MATERIAL)
    case = il.Case(
        bodies={"arm": arm, "mass": il.Mass(0.1, velocity=0.1)},
        mechanisms={"robot": il.Mechanism([il.Joint("arm", joint="clamped", end_mass=0.2, drive=drive)])},
        contacts=[il.Contact("mass", "arm.right", {"kind": "hertz", "stiffness": 1e6}, gap=1e-3, along="y")],
        gravity=[0.0, gravity],
        solve=in_steps(0.3, "midpoint", {"kind": "modal", "elements": 40, "modes": 4}, dt=5e-5),
    )
    return il.run(case)


def test_a_held_link_that_swings_about_its_sag_is_warned_of() -> None:
    """Its sag at the tip is q L^4/(8 EI) + m g L^3/(3 EI), and it swings twice as far."""
    (text,) = texts(held_arm(-9.81))
    sag = (WEIGHT / 8.0 + 0.2 * 9.81 / 3.0) / EI
    found = re.search(r"its static sag, (\S+) m at 1 m, by up to (\S+) m", text)
    assert found is not None
    assert float(found[1]) == pytest.approx(-sag, rel=5e-3)
    assert float(found[2]) == pytest.approx(2.0 * sag, rel=5e-3)


@pytest.mark.parametrize(("gravity", "rate"), [(0.0, 0.0), (-0.01, 1.0)])
def test_a_link_without_weight_or_with_a_wide_motion_is_not_warned_of(gravity: float, rate: float) -> None:
    assert not texts(held_arm(gravity, rate))
