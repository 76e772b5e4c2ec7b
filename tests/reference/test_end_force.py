"""A force that acts on an end from t = 0 on: closed forms for the exact solver, and the stepped models against it.

Units of the exact scenes: c = Z = L = 1, so T = 2. A force F > 0 points along +x and sends a wave F/Z.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from impactlab import metrics
from impactlab.contact.nitsche import Nitsche
from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import PairingError
from impactlab.exact.solve import solve
from impactlab.integrators.adaptive import Adaptive
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.newmark import Newmark
from impactlab.metrics.impact import momentum_error
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import End, Mass, Rayleigh, Rod, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare, run
from impactlab.testing.scenes import STEEL, mass_on_rod, simulation
from impactlab.testing.strategies import in_other_units, mirrored
from tests.reference.exact_scenes import CLAMPED, FREE, HARD, point, rod, scene
from tests.reference.test_delay_line import SPRING, Asked

F = 0.8
T = 2.0


def pushed(right: End, left: End | None = None, duration: float = 6 * T) -> Any:
    """The exact history of a rod under F at its left end."""
    return solve(*scene([rod(left=left or End("free", force=F), right=right)], [], duration))


def test_step_loaded_clamped_rod() -> None:
    """The end moves between 0 and F T/Z = 2 F L/EA, twice the static shortening; the clamp feels 0 or 2 F."""
    history = pushed(CLAMPED)
    t = np.linspace(0.0, 6 * T, 49)
    triangle = T - np.abs(np.mod(t, 2 * T) - T)
    assert history.evaluate(t, "displacement:rod@0") == pytest.approx(F * triangle, abs=1e-13)
    late = np.array([0.1, 0.4, 0.6, 1.4, 1.6, 2.4, 2.6, 3.4]) * T
    assert history.evaluate(late, "force:rod@1") == pytest.approx(F * np.array([0, 0, 2, 2, 0, 0, 2, 2]), abs=1e-13)
    book = history.energy
    assert max(book.largest_gain, book.largest_loss) < 1e-12
    assert np.max(book.work) == pytest.approx(F * F * T, rel=1e-12)
    assert history.channels()[0] == "displacement:rod@0", "a loaded end is recorded without a probe"


def test_step_loaded_free_rod() -> None:
    """The end moves with F/Z (1 + 2 n) after n round trips; the momentum is F t."""
    history = pushed(FREE)
    t = np.array([0.3, 0.8, 1.3, 2.7, 5.5]) * T
    assert history.evaluate(t, "velocity:rod@0") == pytest.approx(F * (1 + 2 * np.floor(t / T)), rel=1e-13)
    assert history.evaluate(t, "momentum:rod") == pytest.approx(F * t, rel=1e-13)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def test_a_matched_dashpot_takes_the_wave() -> None:
    """F/Z without end; from T/2 on the dashpot loses F^2/Z in each unit of time."""
    history = pushed(End("dashpot", 1.0))
    assert history.evaluate([0.1, 3.0, 11.0], "velocity:rod@0") == pytest.approx([F] * 3, rel=1e-13)
    assert history.energy.booked["ends"][-1] == pytest.approx(F * F * (6 * T - T / 2), rel=1e-12)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


@pytest.mark.parametrize("kind", ["mass", "spring", "dashpot"])
def test_supports_of_the_end_share_the_force(kind: str) -> None:
    """Until T the rod is a dashpot Z: m v' + (Z + d) v + k u = F."""
    history = pushed(CLAMPED, End(kind, 0.7, F), duration=0.99 * T)  # type: ignore[arg-type]
    t = np.linspace(0.0, 0.95 * T, 11)
    expected = {
        "mass": F * (1.0 - np.exp(-t / 0.7)),
        "spring": F * np.exp(-0.7 * t),
        "dashpot": np.full_like(t, F / 1.7),
    }[kind]
    assert history.evaluate(t, "velocity:rod@0") == pytest.approx(expected, abs=1e-13)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def test_a_rod_pressed_against_a_wall() -> None:
    """At rest, touching: the wall feels nothing until T/2, then 2 F for T, and again; it never pulls."""
    bar, stop = rod(left=End("free", force=F)), Wall("stop")
    history = solve(*scene([bar, stop], [(point(bar, "right"), point(stop), 0.0, HARD)], 4 * T))
    assert [e.time / T for e in history.events] == pytest.approx([0.5, 1.5, 2.5, 3.5], abs=1e-12)
    assert [span.impulse for span in history.contacts] == pytest.approx([2 * F * T] * 2, rel=1e-12)


@pytest.mark.parametrize("force", [-0.3, 0.3])
@pytest.mark.parametrize("law", [HARD, Penalty(1e5)], ids=["hard", "stiff spring"])
def test_a_mass_strikes_a_loaded_end(force: float, law: Any) -> None:
    """Contact force Z v - F; so v' = -(v - F)/M: v = F + (1 - F) exp(-t/M), force (1 - F) exp(-t/M)."""
    bar, hammer = rod(left=End("free", force=force), right=CLAMPED), Mass("hammer", 2.0, 1.0)
    history = solve(*scene([hammer, bar], [(point(hammer), point(bar, "left"), 0.0, law)], 0.99 * T))
    t = np.linspace(0.01, 0.95 * T, 9)
    decay = np.exp(-t / 2.0)
    # the spring lags behind by Z/k = 1e-5, times up to 1.3
    within = 1e-13 if law is HARD else 2e-5
    assert history.evaluate(t, "velocity:hammer") == pytest.approx(force + (1.0 - force) * decay, abs=within)
    assert history.evaluate(t, "force:hammer|rod.left") == pytest.approx((1.0 - force) * decay, abs=within)


# The stepped models: a steel rod.
LOAD = 1.0e4
TRIP = 2.0 * STEEL.length / STEEL.wave_speed
WAYS: dict[str, tuple[Any, Any, StepRule]] = {
    "newmark": (FiniteElement(100), Newmark(), StepRule(points_per_period=10)),
    "central difference": (FiniteElement(100, "lumped"), CentralDifference(), StepRule(courant=0.9)),
    "eigenvectors": (Modal(elements=100, modes=40), Newmark(), StepRule(points_per_period=10)),
    "exact modal": (Modal(elements=60), ExactModal(), StepRule(points_per_period=10)),
    "midpoint": (FiniteElement(50, order=2), Midpoint(), StepRule(points_per_period=10)),
    "adaptive": (FiniteElement(40), Adaptive(), StepRule(points_per_period=10)),
}


def stepped(way: tuple[Any, Any, StepRule], left: End, right: End, trips: float = 3.0) -> Simulation:
    bar = Rod("rod", (STEEL,), left, right)
    return simulation("x", {"rod": bar}, (), trips * TRIP, way[1], way[2], round_trip=TRIP, model=way[0])


ENDS = [CLAMPED, FREE, End("mass", 1.0), End("spring", 1e8, -2e3)]


# Adaptive steps, which take a second, have the equations of the mesh: one end.
@pytest.mark.parametrize(
    ("way", "right"),
    [(way, end) for way in WAYS for end in ENDS if way != "adaptive" or end.kind == "mass"],
    ids=lambda each: each if isinstance(each, str) else each.kind,
)
def test_stepped_models_tend_to_the_exact_solution(way: str, right: End) -> None:
    given = stepped(WAYS[way], End("free", force=LOAD), right)
    history = run(*given)
    # The velocity of the end jumps, so its displacement is of first order: mesh and modes resolve L/40 at least.
    error = metrics.face_displacement(history, solve(*given), given.scene)
    assert error is not None
    assert error < 1.0 / 40.0
    # All schemes here keep the energy of a linear system under a constant load; the adaptive one to its tolerance.
    within = 1e-6 if way == "adaptive" else 1e-11
    assert max(history.energy.largest_gain, history.energy.largest_loss) < within
    if right.kind in ("free", "mass"):
        # momentum F t; leapfrog velocities stand half a step early
        early = 0.5 * (history.dt or 0.0)
        momentum = float(history.evaluate(history.duration, "momentum:rod"))
        assert momentum == pytest.approx(LOAD * history.duration, rel=1e-9, abs=1.01 * LOAD * early)


@pytest.mark.parametrize("right", [CLAMPED, FREE], ids=["clamped", "free"])
def test_analytic_modes_leave_out_their_residual_flexibility(right: End) -> None:
    """Each mode left out swings between 0 and twice its static answer; the steps themselves are exact."""
    given = stepped((Modal(modes=40), ExactModal(), StepRule(points_per_period=10)), End("free", force=LOAD), right)
    history, exact = run(*given), solve(*given)
    bar = given.scene.bodies["rod"]
    assert isinstance(bar, Rod)
    missing = Modal(modes=40).build(bar, 0.0).left_out(0.0, "displacement", 0.0)
    t = history.dt * np.arange(int(given.scene.duration / history.dt)) if history.dt else np.zeros(0)
    away = history.evaluate(t, "displacement:rod@0") - exact.evaluate(t, "displacement:rod@0")
    assert np.max(away) < 1e-9 * LOAD * missing
    assert np.min(away) > -2.0 * LOAD * missing * (1.0 + 1e-9)


def test_energy_and_momentum_are_reported() -> None:
    from impactlab.report.summary import summarise

    given = stepped(WAYS["newmark"], End("free", force=LOAD), FREE)
    summary = summarise("x", run(*given), ("exact", solve(*given)))
    assert summary["energy"]["initial"] == 0.0
    assert summary["energy"]["work"] == pytest.approx(summary["energy"]["final"], rel=1e-12)
    assert summary["errors"]["face_displacement"] < 0.01
    assert summary["final"]["bodies"]["rod"]["momentum"] == pytest.approx(LOAD * given.scene.duration, rel=1e-9)


@pytest.mark.parametrize("right", [FREE, End("mass", 2.0, force=-0.4 * LOAD)])
def test_a_load_is_no_error_of_the_momentum(right: End) -> None:
    """A free rod gains F t: left out of the balance, it is half of the momentum in play."""
    given = stepped(WAYS["newmark"], End("free", force=LOAD), right)
    for history in (run(*given), solve(*given)):
        error = momentum_error(history, history, given.scene)
        assert error is not None
        assert error < 1e-9  # as the momentum itself, above


def test_momentum_that_damping_takes_is_no_error() -> None:
    given = stepped(WAYS["newmark"], End("free", force=LOAD), FREE)
    bar = given.scene.bodies["rod"]
    assert isinstance(bar, Rod)
    held = given.but(bodies={"rod": dataclasses.replace(bar, damping=Rayleigh(mass=500.0))})
    history = run(*held)
    assert momentum_error(history, history, held.scene) is None


def pressed(law: Any, model: Any, far: End, near: End = FREE, integrator: Any = None) -> Simulation:
    """A mass of the rod's weight strikes the left end."""
    return mass_on_rod(model, law, integrator, left=near, right=far)


@pytest.mark.parametrize("near", [FREE, End("free", force=5e3)], ids=["far end loaded", "both ends loaded"])
def test_the_stepped_delay_line_serves_end_forces(near: End) -> None:
    """As without force: first order at least, fronts smear over one step at each reflection."""
    errors = []
    for points in (4, 64):
        given = pressed(Asked(), Continuous(), End("spring", 1e9, -LOAD), near)
        given = given.but(step=StepRule(points_per_period=points))
        exact = solve(*given.but(law=SPRING))
        history = run(*given)
        assert max(history.energy.largest_gain, history.energy.largest_loss) < 0.01
        errors.append(metrics.face_displacement(history, exact, given.scene) or 0.0)
    assert errors[1] < errors[0] / 8.0
    assert errors[1] < 1e-4


@pytest.mark.parametrize("law", [HARD, Penalty(stiffness=2e10)], ids=["multiplier", "penalty"])
def test_stepped_contact_at_a_loaded_end(law: Any) -> None:
    given = pressed(law, FiniteElement(200, "lumped"), CLAMPED, End("free", force=-LOAD), CentralDifference())
    given = given.but(step=StepRule(courant=0.5))
    exact = solve(*given)
    measured = metrics.errors(run(*given), "exact", exact, given.scene)
    # as without a load: the mesh resolves L/200, the impulse is what the mass lost
    assert measured["mass_displacement"] < 0.01  # type: ignore[operator]
    assert measured["face_displacement"] < 0.02  # type: ignore[operator]
    assert measured["impulse"] < 0.01  # type: ignore[operator]


@pytest.mark.parametrize(
    ("law", "integrator", "says"),
    [(WaveIdentification(), Newmark(), "has a force"), (Nitsche(), Midpoint(), "another force acts at")],
    ids=["wave_identification", "nitsche"],
)
def test_laws_that_take_the_stress_at_the_face_for_their_own_refuse_a_loaded_face(
    law: Any, integrator: Any, says: str
) -> None:
    with pytest.raises(PairingError, match=says) as refused:
        prepare(*pressed(law, FiniteElement(40), CLAMPED, End("free", force=LOAD), integrator))
    assert "addition_deletion" in refused.value.remedy


def test_a_far_load_is_no_matter_to_wave_identification() -> None:
    given = pressed(WaveIdentification(), FiniteElement(100), End("dashpot", 4e4, -LOAD), FREE, Newmark())
    measured = metrics.errors(run(*given), "exact", solve(*given), given.scene)
    assert measured["mass_displacement"] < 0.01  # type: ignore[operator]


@pytest.mark.parametrize("model", [Continuous(), FiniteElement(16)], ids=["exact", "newmark"])
def test_mirrored_and_in_other_units(model: Any) -> None:
    """A force turns with the scene, and scales as mass times length over time squared."""
    way = (model, Newmark(), StepRule(dt=TRIP / 64))
    given = stepped(way, End("mass", 0.5, LOAD), End("free", force=-0.3 * LOAD), 2.0)
    history, turned, scaled = (run(*each) for each in (given, mirrored(given), in_other_units(given, 4.0, 16.0, 0.25)))
    t = np.linspace(0.0, given.scene.duration, 65)
    here = history.evaluate(t, "displacement:rod@0")
    size = float(np.max(np.abs(here)))
    assert turned.evaluate(t, "displacement:rod@0.3") == pytest.approx(-here, abs=1e-12 * size)
    assert scaled.evaluate(0.25 * t, "displacement:rod@0") == pytest.approx(16.0 * here, abs=1e-12 * size)
    assert math.isclose(scaled.energy.work[-1], 4.0 * (16.0 / 0.25) ** 2 * history.energy.work[-1], rel_tol=1e-12)
