"""Contacts at inner points, a mass between two rods, and runs that have no end."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.contact.penalty import Penalty
from impactlab.errors import StepError
from impactlab.exact import march
from impactlab.exact import solve as solver
from impactlab.exact.setup.build import build
from impactlab.exact.solve import solve
from impactlab.numerics.addresses import COMPILED
from impactlab.scene import Mass, Point
from tests.reference.exact_scenes import CLAMPED, HARD, point, rod, scene, struck
from tests.solving import run_case

AT = 0.3  # m, where the rod is struck


def struck_inside(direction, mass=0.7, z=1.3, law=None):
    """A mass of velocity 1 that pushes a free rod at an inner point towards +x or -x."""
    bar, hammer = rod(z=z), Mass("hammer", mass, direction)
    faces = [point(hammer), Point("rod", AT, f"rod@{AT}")]
    faces = faces if direction > 0.0 else faces[::-1]
    return scene([bar, hammer], [(*faces, 0.0, law if law is not None else HARD)], 4.0)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_mass_that_strikes_inside_pushes_both_ways(direction):
    # both parts of the rod resist with Z until the first end answers after 2 x/c: m v' = -2 Z v
    mass, z = 0.7, 1.3
    history = solve(*struck_inside(direction, mass, z))
    force = next(name for name in history.channels() if name.startswith("force:"))
    t = np.linspace(0.0, 2.0 * AT - 1e-9, 25)
    v = np.exp(-2.0 * z * t / mass)
    assert float(history.evaluate(0.0, force)) == pytest.approx(2.0 * z, abs=1e-14)
    assert history.evaluate(t, force) == pytest.approx(2.0 * z * v, abs=1e-13)
    assert history.evaluate(t, "velocity:hammer") == pytest.approx(direction * v, abs=1e-13)
    moved = direction * mass / (2.0 * z) * (1.0 - v)
    assert history.evaluate(t, "position:hammer") == pytest.approx(moved, abs=1e-13)
    assert history.evaluate(t, f"displacement:rod@{AT}") == pytest.approx(moved, abs=1e-13)
    # compression (positive) ahead, tension behind, each half as strong as the contact was when the wave left
    way = 0.2
    later = np.linspace(way + 1e-6, 2.0 * AT - way - 1e-6, 9)
    wave = z * np.exp(-2.0 * z * (later - way) / mass)
    for side in (1.0, -1.0):
        seen = history.evaluate(later, f"force:rod@{AT + side * way}")
        assert seen == pytest.approx(side * direction * wave, abs=1e-12)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("law", [HARD, Penalty(4.0, 0.5)])
def test_struck_inside_keeps_momentum_and_energy(direction, law):
    history = solve(*struck_inside(direction, law=law))
    t = np.linspace(0.0, 4.0, 41)
    whole = history.evaluate(t, "momentum:hammer") + history.evaluate(t, "momentum:rod")
    assert whole == pytest.approx(0.7 * direction, abs=1e-12)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def mass_between(v_left, v_mass, v_right, law, gap=0.0):
    a, b = rod("a", velocity=v_left), rod("b", velocity=v_right)
    ball = Mass("ball", 0.8, v_mass)
    contacts = [(point(a, "right"), point(ball), gap, law), (point(ball), point(b, "left"), gap, law)]
    return scene([a, ball, b], contacts, 8.0)


@pytest.mark.parametrize("law", [HARD, Penalty(6.0), Penalty(6.0, 0.4)])
@pytest.mark.parametrize("velocities", [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.2, -0.5), (0.6, -1.0, -0.6)])
@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_a_mass_between_two_rods_keeps_momentum_and_energy(law, velocities, gap):
    history = solve(*mass_between(*velocities, law, gap))
    t = np.linspace(0.0, 8.0, 81)
    whole = sum(history.evaluate(t, f"momentum:{name}") for name in ("a", "ball", "b"))
    assert whole == pytest.approx(velocities[0] + 0.8 * velocities[1] + velocities[2], abs=1e-12)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12
    for span in history.contacts:
        assert span.impulse >= 0.0


@pytest.mark.parametrize("law", [HARD, Penalty(6.0, 0.4)])
def test_a_mass_squeezed_from_both_sides_stays(law):
    history = solve(*mass_between(1.0, 0.0, -1.0, law))
    t = np.linspace(0.0, 8.0, 161)
    assert history.evaluate(t, "position:ball") == pytest.approx(0.0, abs=1e-14)
    left, right = (history.evaluate(t, f"force:{name}") for name in ("a.right|ball", "ball|b.left"))
    assert left == pytest.approx(right, abs=1e-13)
    there, here = history.evaluate(t, "displacement:a@0.25"), history.evaluate(t, "displacement:b@0.75")
    assert there == pytest.approx(-here, abs=1e-13)
    if law.hard:  # each rod is stopped by a wall that stands still: Z v for two transits
        times = {(event.contact, event.kind): event.time for event in history.events}
        assert times["a.right|ball", "open"] == pytest.approx(2.0, abs=1e-13)
        assert left[1:39] == pytest.approx(1.0, abs=1e-13)


@pytest.mark.parametrize("law", [HARD, Penalty(6.0, 0.4)])
def test_mirrored_mass_between_two_rods(law):
    one, other = solve(*mass_between(1.0, 0.2, -0.5, law)), solve(*mass_between(0.5, -0.2, -1.0, law))
    t = np.linspace(0.0, 8.0, 97)
    assert one.evaluate(t, "position:ball") == pytest.approx(-other.evaluate(t, "position:ball"), abs=1e-12)
    there, here = one.evaluate(t, "displacement:a@0.25"), other.evaluate(t, "displacement:b@0.75")
    assert there == pytest.approx(-here, abs=1e-12)


def test_intervals_without_end_stop_the_run_with_the_history_so_far(monkeypatch):
    struck_rod = struck(1.0, 6.0, CLAMPED)
    whole = solve(*struck_rod)

    def nearly_spent(*scene):
        layout, log = build(*scene)
        log.state["intervals"] = solver.MAX_INTERVALS - 9
        return layout, log

    monkeypatch.setattr(solver, "network", nearly_spent)
    monkeypatch.setattr(solver, "INTERVALS_PER_CHECK", 9)
    with pytest.raises(StepError, match="needs more than") as caught:
        solve(*struck_rod)
    error = caught.value
    assert 0.0 < error.time < 6.0
    assert error.step == solver.MAX_INTERVALS
    t = np.linspace(0.0, error.time, 50, endpoint=False)
    for channel in ("position:hammer", "velocity:hammer", "stress:rod@0"):
        assert error.history.evaluate(t, channel) == pytest.approx(whole.evaluate(t, channel), abs=1e-13)


@pytest.mark.skipif(not COMPILED, reason="writes into the memory of the compiled march")
def test_events_without_end_stop_the_run(monkeypatch):
    def busy(*scene):
        layout, log = build(*scene)
        log.junctions["burst"] = 0.0
        log.junctions["bursts"] = march.MAX_BURST
        return layout, log

    monkeypatch.setattr(solver, "network", busy)
    with pytest.raises(StepError, match="opens and closes more than") as caught:
        solve(*struck(1.0, 6.0, CLAMPED))
    assert caught.value.time == 0.0
    assert caught.value.history is None


def test_a_rod_in_two_equal_pieces_is_the_rod_in_one() -> None:
    steel = {"young": 2e11, "density": 8000}

    def run(*lengths: float) -> Any:
        first = [{"length": length, "area": 1e-4, "material": steel} for length in lengths]
        rod = il.Rod(segments=[*first, {"length": 0.2, "area": 2e-4, "material": steel}])
        other = il.Rod(length=0.4, area=2e-4, material="steel")
        law = {"kind": "penalty", "stiffness": 1e8}
        return run_case(
            bodies={"ball": il.Mass(0.3, velocity=2.0), "rod": rod, "other": other},
            contacts=[
                il.Contact("ball", "rod.left", {"kind": "addition_deletion"}),
                il.Contact("rod.right", "other.left", law, gap=1e-5),
            ],
            solve={"duration": 1.5e-3, "model": {"kind": "continuous"}},
            probes=[{"body": "rod", "at": 0.2, "quantity": "stress"}],
        )

    one, three = run(0.3), run(0.1, 0.13, 0.07)
    times = np.linspace(0.0, one.duration, 1000)
    for channel in one.channels():
        expected = one.evaluate(times, channel)
        assert np.abs(three.evaluate(times, channel) - expected).max() <= 1e-11 * np.abs(expected).max(), channel
    assert three.cost.steps < 1.5 * one.cost.steps  # without waves that the boundaries do not reflect


def test_a_sweep_of_one_of_two_equal_pieces_is_that_of_single_runs() -> None:
    pieces = [{"length": length, "area": 1e-4, "material": "steel"} for length in (0.1, 0.2)]
    rod = il.Rod(segments=pieces, displacement={"x": [0.0, 0.3], "u": [0.0, 1e-6]})
    case = il.Case(
        bodies={"ball": il.Mass(0.3, velocity=2.0), "rod": rod},
        contacts=[il.Contact("ball", "rod.left", {"kind": "addition_deletion"})],
        solve={"duration": 3e-4, "model": {"kind": "continuous"}},
    )
    plain = case.with_("bodies.rod.displacement", None)
    areas = np.linspace(0.9e-4, 1.1e-4, 251)  # as many as a batch has; one of them is that of the other piece
    found = il.sweep(plain, {"bodies.rod.segments.1.area": areas}, quantities=["impulse"]).impulse.to_numpy().ravel()
    for place in (0, 125, 250):
        history = il.run(plain.with_("bodies.rod.segments.1.area", float(areas[place])))
        assert found[place] == pytest.approx(history.impulse_of("ball|rod.left"), rel=1e-12)
    assert il.run(case).energy.final_error < 1e-9  # 0.1 m and 0.2 m are 0.30000000000000004 m: no fault of the table
