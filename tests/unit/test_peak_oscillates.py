"""Largest forces that last less than a method resolves carry a warning, others none."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.special import airy

import impactlab as il
from impactlab.history.base import AbstractHistory
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.warnings.mesh_dispersion import LOBES, RISE, airy_scale
from impactlab.simulate.warnings.peaks import largest_mean

LARGEST = 78276.57  # N, (2 + e^-2) Z v of the case axial_impact


def warned(history: AbstractHistory) -> list[str]:
    """Return the texts of the warnings."""
    return [each.text for each in history.warnings if each.code == "peak_oscillates"]


def test_mean_of_a_half_sine() -> None:
    # Over a window w in its middle, a half sine of duration 1 has the mean sin(pi w/2)/(pi w/2).
    times = np.linspace(0.0, 1.0, 4001)
    impulse = (1.0 - np.cos(np.pi * times)) / np.pi
    means = np.append(0.0, np.diff(impulse) / np.diff(times))
    for window in (0.1, 0.25, 0.5):
        half = 0.5 * np.pi * window
        assert largest_mean(times, means, window) == pytest.approx(np.sin(half) / half, rel=1e-5)


def test_mean_over_more_than_the_records_counts_no_force_outside() -> None:
    assert largest_mean(np.array([0.0, 1.0]), np.array([0.0, 6.0]), 3.0) == pytest.approx(2.0)


@pytest.mark.parametrize("method", ["base", "penalty"])
def test_overshoot_at_a_front_is_named(method: str) -> None:
    # Two equal rods in hard contact have the force Z v/2, and no more; modes and a stiff spring overshoot it.
    case = il.load_case("two_rods")
    exact = il.run(case.with_("solve.model", kind="continuous"))
    run = il.run(case.method(method))
    peak, right = (max(span.peak_force or 0.0 for span in each.contacts) for each in (run, exact))
    assert peak > 1.3 * right
    [text] = warned(run)
    mean = float(text.split("this mean, ")[1].split(" N")[0])
    assert mean == pytest.approx(right, rel=0.1)


def test_contact_that_opens_at_every_step_is_named() -> None:
    run = il.run(il.load_case("all_methods").method("energy_conserving"))
    assert max(span.peak_force or 0.0 for span in run.contacts) > 3.0 * LARGEST
    assert len(warned(run)) == 1


def test_mesh_at_courant_1_has_no_such_peak() -> None:
    run = il.run(il.load_case("axial_impact").method("finite_element").with_("solve.step", {"courant": 1.0}))
    assert largest(run) == pytest.approx(LARGEST, rel=0.02)
    assert not warned(run)


def test_overshoot_of_a_front_that_a_mesh_dispersed_is_named() -> None:
    # The front has crossed 200 elements: its first lobe lasts longer than three time resolutions.
    run = il.run(il.load_case("axial_impact").method("finite_element"))  # at courant 0.9
    assert largest(run) > 1.13 * LARGEST
    [text] = warned(run)
    assert "one oscillation of a front on this mesh" in text
    assert float(text.split("this mean, ")[1].split(" N")[0]) == pytest.approx(LARGEST, rel=0.05)


@pytest.mark.parametrize("elements", [50, 200])
@pytest.mark.parametrize(
    ("law", "integrator"), [("addition_deletion", "contact_stabilised_newmark"), ("nitsche", "midpoint")]
)
def test_rise_ahead_of_a_front_that_unloads_is_named(elements: int, law: str, integrator: str) -> None:
    # Consistent masses: the force Z v of a rod on a wall rises ahead of the front that ends it, for any mesh.
    rod = il.Rod(length=1.0, area=1e-4, material={"young": 2e11, "density": 8000.0}, velocity=1.0)
    model = {"kind": "finite_element", "elements": elements}
    run = il.run(
        il.Case(
            bodies={"rod": rod, "wall": il.Wall()},
            contacts=[il.Contact("rod.right", "wall", {"kind": law})],
            solve={"duration": 6e-4, "model": model, "integrator": {"kind": integrator}, "step": {"courant": 0.3}},
        )
    )
    assert largest(run) > 1.5 * 4000.0
    [text] = warned(run)
    assert float(text.split("this mean, ")[1].split(" N")[0]) == pytest.approx(4000.0, rel=0.15)


def test_airy_function_over_its_first_lobe_and_trough() -> None:
    z = np.linspace(-40.0, 8.0, 48_001)
    step = np.cumsum(airy(z)[0][::-1])[::-1] * (z[1] - z[0])
    sums = np.append(0.0, step.cumsum())
    count = round(LOBES / (z[1] - z[0]))
    assert float((sums[count:] - sums[:-count]).max()) / count == pytest.approx(1.044, abs=2e-3)
    assert float(step.max()) == pytest.approx(1.274, abs=1e-3)
    assert z[step.argmax()] == pytest.approx(-RISE, abs=2e-3)


@pytest.mark.parametrize(
    ("mass", "integrator", "courant"),
    [("lumped", "central_difference", 0.6), ("lumped", "midpoint", 0.6), ("consistent", "midpoint", 0.3)],
)
def test_time_scale_of_a_front_follows_from_the_dispersion_relation(mass: str, integrator: str, courant: float) -> None:
    wave = 0.05  # k h: long beside the elements
    stiff = 2.0 * math.sin(0.5 * wave)  # omega h/c of the mesh with lumped masses
    omega = stiff if mass == "lumped" else stiff / math.sqrt(1.0 - stiff * stiff / 6.0)
    half = 0.5 * courant * omega  # of a step
    omega = 2.0 / courant * (math.asin(half) if integrator == "central_difference" else math.atan(half))
    slower = (1.0 - omega / wave) / wave**2
    law = {"kind": "penalty", "stiffness": 1e6}
    case = il.Case.from_dict(ball(1e6, 50)).with_("solve.model.mass", mass).with_("contacts.0.law", law)
    run = il.run(case.with_("solve.integrator", {"kind": integrator}).with_("solve.step", {"courant": courant}))
    assert isinstance(run, AbstractRecordedHistory)
    rod = run.scene.elastic["rod"]
    transit, time = 0.5 * rod.round_trip / 50, 2e-4
    wanted = transit * (3.0 * abs(slower) * time / transit) ** (1.0 / 3.0)
    assert airy_scale(run, [rod], time) == pytest.approx(wanted, rel=1e-2)


def ball(stiffness: float, elements: int) -> dict[str, Any]:
    """Return a ball on a steel rod through a spring."""
    return {
        "schema_version": 1,
        "bodies": {
            "ball": {"kind": "mass", "mass": 0.01, "velocity": 1.0},
            "rod": {"kind": "rod", "length": 1.0, "diameter": 0.02, "material": "steel"},
        },
        "contacts": [{"between": ["ball", "rod.left"], "law": {"kind": "penalty", "stiffness": stiffness}}],
        "solve": {
            "duration": 3e-4,
            "model": {"kind": "finite_element", "elements": elements},
            "integrator": {"kind": "newmark"},
            "step": {"courant": 0.5},
        },
    }


@pytest.mark.parametrize("elements", [40, 160])
def test_short_contact_that_is_resolved_is_not_named(elements: int) -> None:
    # The spring swings in 2 pi sqrt(m/k) = 0.2 ms: a smooth pulse, shorter than the wave's round trip.
    run = il.run(il.Case.from_dict(ball(1e7, elements)))
    assert not warned(run)


def ball_on_beam(law: dict[str, Any], theory: str = "timoshenko", **solve: Any) -> il.Case:
    """Return a ball that strikes the middle of a pinned beam."""
    beam = {"kind": "beam", "length": 0.5, "section": {"width": 0.04, "height": 0.04}, "material": "steel"}
    method = {"model": {"kind": "finite_element", "elements": 20}, "step": {"dt": 1e-6}, **solve}
    return il.Case.from_dict(
        {
            "schema_version": 1,
            "bodies": {
                "ball": {"kind": "mass", "mass": 0.5, "velocity": 1.0},
                "beam": {**beam, "theory": theory, "ends": {"left": "pinned", "right": "pinned"}},
            },
            "contacts": [{"between": ["ball", "beam.at(0.25)"], "law": law}],
            "solve": {"duration": 6e-4, **method},
        }
    )


def largest(run: AbstractHistory) -> float:
    """Return the largest contact force of a run [N]."""
    return max(span.peak_force or 0.0 for span in run.contacts)


def test_hard_contact_on_a_timoshenko_beam_is_named() -> None:
    # Each closing stops the mass of the face in a step, with a force that grows as 1/dt.
    hard = {"kind": "addition_deletion"}
    run = il.run(ball_on_beam(hard, integrator={"kind": "moreau_jean"}))
    waves = il.run(ball_on_beam(hard, model={"kind": "continuous"}, step={"dt": 2e-7}))
    assert largest(run) > 3.0 * largest(waves)
    assert len(warned(run)) == 1


@pytest.mark.parametrize("theory", ["timoshenko", "euler_bernoulli"])
@pytest.mark.parametrize("stiffness", [1e7, 1e8])
def test_soft_contact_on_a_beam_is_not_named(theory: str, stiffness: float) -> None:
    law = {"kind": "penalty", "stiffness": stiffness}
    run = il.run(ball_on_beam(law, theory, integrator={"kind": "newmark"}))
    assert not warned(run)


def test_overshoots_at_fronts_in_a_row_are_named() -> None:
    # Fronts pass one joint after another: each adds its overshoot, and a window of three resolutions holds part of it.
    run = il.run(il.load_case("chain_of_bars"))
    exact = il.run(il.load_case("chain_of_bars").with_("solve.model", kind="continuous"))
    assert largest(run) > 1.4 * largest(exact)
    assert any(text.startswith("first.right|second.left") for text in warned(run))


def test_records_of_several_resolutions_are_enough() -> None:
    # Of three times 400 steps 100 are kept: each record is longer than a time resolution, 3.1 steps.
    case = il.load_case("two_rods").method("penalty")
    [before] = warned(il.run(case))
    duration = 3.0 * il.run(case).duration
    [text] = warned(il.run(case.with_settings({"solve.duration": duration, "solve.records": 100})))
    assert "that the records of this long run show" in text
    assert text.split(" is ")[0] == before.split(" is ")[0]
