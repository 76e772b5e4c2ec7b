"""Errors fall as declared: with the step, the mesh, the modes, and wherever in a step a dashpot is touched."""

from __future__ import annotations

import math

import numpy as np
import pytest

from impactlab import simulate
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.khulief_shabana import KhuliefShabana
from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import Mass, Probe, Rod, Wall
from impactlab.scene.method import StepRule
from impactlab.testing.scenes import CLAMPED, FREE, STEEL, in_a_row, mass_on_rod, simulation


def swinging(model: AbstractRodModel, integrator: AbstractIntegrator, dt: float, mode: int = 1) -> AbstractHistory:
    """A clamped rod let go from one of its modes: u = cos(k x) cos(k c t), k = (mode - 1/2) pi/L."""
    number = (mode - 0.5) * np.pi / STEEL.length
    rod = Rod("rod", (STEEL,), FREE, CLAMPED, displacement=lambda x: 1e-6 * np.cos(number * x))
    probe = Probe("rod", 0.0, "displacement")
    duration = 0.8 * 2.0 * np.pi / (number * STEEL.wave_speed)
    return simulate.run(
        *simulation("swing", {"rod": rod}, (), duration, integrator, StepRule(dt=dt), probes=(probe,), model=model)
    )


def error_of_swing(model: AbstractRodModel, integrator: AbstractIntegrator, steps: int, mode: int = 1) -> float:
    number = (mode - 0.5) * np.pi / STEEL.length
    turn = number * STEEL.wave_speed
    dt = 0.8 * 2.0 * np.pi / turn / steps
    history = swinging(model, integrator, dt, mode)
    times = dt * np.arange(steps + 1)
    return float(np.max(np.abs(history.evaluate(times, "displacement:rod@0") / 1e-6 - np.cos(turn * times))))


@pytest.mark.parametrize("integrator", [Newmark(), Newmark(1.0 / 6.0), CentralDifference(), Newmark(0.3025, 0.6)])
def test_error_of_a_swinging_rod_falls_with_the_step_as_declared(integrator: AbstractIntegrator) -> None:
    # One analytic mode: no error of space. Steps of a fiftieth and a hundredth of the time: the next term is below 1 %.
    coarse, fine = (error_of_swing(Modal(None, 1), integrator, steps) for steps in (100, 200))
    measured = math.log2(coarse / fine)
    declared = 1 if isinstance(integrator, Newmark) and integrator.gamma > 0.5 else integrator.order
    assert measured == pytest.approx(declared, abs=0.06)


def test_exact_modal_has_no_error_of_time_in_free_motion() -> None:
    # Rounding of 37 turns, each by a rounded angle.
    assert error_of_swing(Modal(None, 3), ExactModal(), 37, mode=3) < 1e-12


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
@pytest.mark.parametrize("mode", [1, 3])
def test_frequencies_of_a_mesh_converge_with_its_square(mass: str, mode: int) -> None:
    exact = (mode - 0.5) * np.pi * STEEL.wave_speed / STEEL.length
    errors = []
    for n in (20, 40):
        rod = Rod("rod", (STEEL,), FREE, CLAMPED)
        system = Modal(n, None, mass).build(rod, 0.0).operators()  # type: ignore[arg-type]
        errors.append(math.sqrt(system.stiffness[0, mode - 1]) / exact - 1.0)
    # A consistent mass is too fast, a lumped one too slow, both by (k h)^2/24.
    size = ((mode - 0.5) * np.pi / 40) ** 2 / 24.0
    assert errors[1] == pytest.approx(size if mass == "consistent" else -size, rel=0.02)
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.02)


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_error_of_a_swinging_mesh_falls_with_its_square(mass: str) -> None:
    # Step and mesh halved together.
    coarse, fine = (
        error_of_swing(FiniteElement(n, mass), Newmark(), 4 * n)
        for n in (20, 40)  # type: ignore[arg-type]
    )
    assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.05)


def error_of_impact(
    model: AbstractRodModel, law: AbstractContactLaw, integrator: AbstractIntegrator, step: StepRule
) -> float:
    """Relative L2 error of the mass's displacement against the exact answer of the same contact."""
    history = simulate.run(*mass_on_rod(model, law, integrator, step))
    exact = simulate.run(*mass_on_rod(Continuous(), AdditionDeletion()))
    times = (np.arange(6000) + 0.5) * history.duration / 6000
    one, other = (each.evaluate(times, "position:hammer") for each in (history, exact))
    return float(np.linalg.norm(one - other) / np.linalg.norm(other))


@pytest.mark.parametrize(
    ("law", "integrator", "models", "step", "fall"),
    [
        # Ten times finer, in three stages; measured falls are 4.1, 11, 120 and 15.
        (WaveIdentification(), Newmark(), [Modal(n, n) for n in (10, 30, 100)], StepRule(points_per_period=10.0), 3.0),
        (
            WaveIdentification(),
            ExactModal(),
            [Modal(None, n) for n in (10, 30, 100)],
            StepRule(points_per_period=10.0),
            6.0,
        ),
        (
            AdditionDeletion(),
            CentralDifference(),
            [FiniteElement(n, "lumped") for n in (10, 30, 100)],
            StepRule(courant=1.0),
            20.0,
        ),
        (Penalty(), Newmark(), [FiniteElement(n) for n in (10, 30, 100)], StepRule(points_per_period=10.0), 6.0),
    ],
)
def test_error_of_an_impact_falls_with_mesh_and_step(
    law: AbstractContactLaw, integrator: AbstractIntegrator, models: list[AbstractRodModel], step: StepRule, fall: float
) -> None:
    errors = [error_of_impact(model, law, integrator, step) for model in models]
    assert errors[0] > errors[1] > errors[2]
    assert errors[0] / errors[2] > fall, errors


def test_relative_penalty_converges_to_hard_contact_with_the_mesh() -> None:
    # Its stiffness is that of an element: EA/h grows as the mesh is refined.
    assert error_of_impact(FiniteElement(200), Penalty(), Newmark(), StepRule(points_per_period=10.0)) < 5e-3


K, M, ZETA = 1e6, 1.0, 0.6
SPAN = 3e-3  # s: the contact ends 2 acos(zeta)/w_d = 2.32 ms after the touch, at the latest 0.1 ms after the start
RESTITUTION = math.exp(-2.0 * ZETA * math.acos(ZETA) / math.sqrt(1.0 - ZETA**2))
LAWS = {"penalty": Penalty(K, 2.0 * ZETA * math.sqrt(K * M)), "khulief_shabana": KhuliefShabana(K, RESTITUTION)}
PHASES = (0.0, 0.13, 0.37, 0.5, 0.71, 0.94)


def worst(law, integrator, dt):
    """The largest error of the exit speed over touches at several places in a step; F = k d + c d', never pulling."""
    errors = []
    for phase in PHASES:
        bodies, gap = (Mass("ball", M, 1.0), Wall("wall")), (2.0 + phase) * dt
        history = simulate.run(*in_a_row(bodies, None, law, integrator, StepRule(dt=dt), gaps=gap, duration=SPAN))
        errors.append(abs(float(history.evaluate([SPAN], "velocity:ball")[0]) + RESTITUTION))
    return max(errors)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize(
    "integrator",
    [ExactModal(), Midpoint(), Newmark(), CentralDifference(), GeneralisedAlpha()],
    ids=lambda each: type(each).__name__,
)
def test_a_dashpot_is_of_second_order_wherever_in_a_step_it_is_touched(law, integrator):
    coarse, fine = worst(law, integrator, 2e-5), worst(law, integrator, 2.5e-6)
    assert fine < 2e-6
    assert math.log(coarse / fine) / math.log(8.0) > 1.8
