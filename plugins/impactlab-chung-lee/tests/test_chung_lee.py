"""The scheme of Chung and Lee: contract of integrators, characteristic cubic."""

from __future__ import annotations

import math

import numpy as np
import pytest
from impactlab_chung_lee.integrator import MOST_BETA, ChungLee

from impactlab import plugins, simulate
from impactlab.contact.penalty import Penalty
from impactlab.errors import CaseError, PairingError
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractIntegrator, Stepper
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.models.base import Operators
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import Contact, End, Mass, Point, Probe, Rod, Segment
from impactlab.scene.method import StepRule
from impactlab.testing.contracts import IntegratorContract
from impactlab.testing.scenes import simulation
from impactlab.types import Array

PIECE = Segment(0.3, 9e-4, 2.1e11, 7900.0)
TURN = 3.0  # rad/s


class TestMostDamping(IntegratorContract):
    part = ChungLee()


class TestNoDamping(IntegratorContract):
    part = ChungLee(1.0)


class TestSomeDamping(IntegratorContract):
    part = ChungLee(1.01)


class TestSpectralElements(IntegratorContract):
    part = ChungLee()

    def system(self) -> Operators:
        rod = Rod("rod", (PIECE,), End("free"), End("clamped"))
        return FiniteElement(2, "lumped", 4).build(rod, 0.0).operators()


def test_it_is_registered() -> None:
    assert plugins.registry().load(plugins.INTEGRATORS, "chung_lee") is ChungLee


def oscillator(beta: float, dt: float) -> Stepper:
    """One unit mass that turns with TURN, let go from 1 m."""
    one = np.ones((1, 1))
    system = Operators(one, 0.0 * one, TURN**2 * one, np.zeros(1), np.ones(1), np.zeros(1), TURN, TURN, True, True)
    return ChungLee(beta).prepare(system, np.zeros((0, 1)), dt)


def walked(stepper: Stepper, steps: int) -> Array:
    states = [stepper.state.copy()]
    for _ in range(steps):
        state = states[-1].copy()
        stepper.free(stepper.parameters, state)
        states.append(state)
    return np.array(states)


@pytest.mark.parametrize("beta", [1.0, 1.01, MOST_BETA])
@pytest.mark.parametrize("angle", [0.1, 1.0, 1.8])
def test_displacements_follow_the_characteristic_cubic(beta: float, angle: float) -> None:
    u = walked(oscillator(beta, angle / TURN), 60)[:, 0]
    square = angle**2
    # u'' of three steps: u+ - 2 u + u- = -W (u + (beta - 1)(u - 2 u- + u--)), W = (w dt)^2.
    left = u[3:] - 2.0 * u[2:-1] + u[1:-2]
    right = -square * (u[2:-1] + (beta - 1.0) * (u[2:-1] - 2.0 * u[1:-2] + u[:-3]))
    assert np.max(np.abs(left - right)) < 1e-14 * np.max(np.abs(u)) * 20.0


@pytest.mark.parametrize("beta", [1.005, MOST_BETA])
def test_the_energy_falls_by_exactly_the_amount_of_the_docstring(beta: float) -> None:
    dt = 1.2 / TURN
    stepper = oscillator(beta, dt)
    states, out, energies = walked(stepper, 50), np.zeros(2), []
    for state in states:
        stepper.measure(stepper.parameters, state.copy(), out)
        energies.append(out[0])
    ahead = np.diff(states[:, 0])  # D of state i is u(i + 1) - u(i)
    fall = 0.25 * (beta - 1.0) * TURN**2 * (ahead[2:] - ahead[:-2]) ** 2
    assert np.allclose(np.diff(energies)[1 : 1 + fall.size], -fall, rtol=0.0, atol=1e-14 * energies[0])


def test_damping_is_of_third_order_at_low_frequencies_and_strong_at_high_ones() -> None:
    def loss(angle: float) -> float:
        square, share = angle**2, MOST_BETA - 1.0
        roots = np.roots([1.0, square * MOST_BETA - 2.0, 1.0 - 2.0 * share * square, share * square])
        return float(-np.log(np.max(np.abs(roots))))

    assert math.log2(loss(0.02) / loss(0.01)) == pytest.approx(4.0, abs=0.05)  # per step; third order per time
    # At beta = 28/27 and (w dt)^2 = 27/8 the cubic is (z + 1/2)^3: its roots, found to the cube root of rounding.
    roots = np.roots([1.0, 27.0 / 8.0 * MOST_BETA - 2.0, 1.0 - 0.25, 0.125])
    assert np.max(np.abs(roots + 0.5)) < 1e-4
    u = walked(oscillator(MOST_BETA, math.sqrt(27.0 / 8.0) / TURN), 60)[:, 0]
    assert abs(u[-1]) < 60.0**2 * 2.0**-60 * 10.0  # n^2 2^-n


@pytest.mark.parametrize("order", [1, 4])
def test_with_beta_one_it_is_central_difference(order: int) -> None:
    def displaced(integrator: AbstractIntegrator) -> AbstractHistory:
        number = 0.5 * np.pi / PIECE.length
        rod = Rod(
            "rod", (PIECE,), End("free"), End("clamped"),
            displacement=lambda x: 1e-6 * np.cos(number * x),
        )  # fmt: skip
        probe = Probe("rod", 0.0, "displacement")
        return simulate.run(
            *simulation(
                "swing",
                {"rod": rod},
                (),
                3e-4,
                integrator,
                StepRule(courant=0.8),
                probes=(probe,),
                model=FiniteElement(20 // order, "lumped", order),
            )
        )

    one, other = displaced(ChungLee(1.0)), displaced(CentralDifference())
    times = np.linspace(0.0, 3e-4, 200)
    difference = one.evaluate(times, "displacement:rod@0") - other.evaluate(times, "displacement:rod@0")
    assert np.max(np.abs(difference)) < 1e-12 * 1e-6


def struck(integrator: AbstractIntegrator, points: float) -> AbstractHistory:
    rod = Rod("rod", (PIECE,), End("free"), End("clamped"))
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), 0.0)
    bodies = {"hammer": Mass("hammer", PIECE.mass, 1.0), "rod": rod}
    duration = 1.2 * rod.round_trip
    return simulate.run(
        *simulation(
            "struck",
            bodies,
            (contact,),
            duration,
            integrator,
            StepRule(points_per_period=points),
            model=Modal(None, 12),
            law=Penalty(2e8, 0.0),
        )
    )


def test_an_impact_converges_to_the_exact_steps_with_order_two() -> None:
    fine = struck(ExactModal(), 1600.0)
    times = np.linspace(0.0, fine.duration, 400)
    errors = []
    for points in (20.0, 40.0, 80.0):
        history = struck(ChungLee(), points)
        errors.append(
            float(np.max(np.abs(history.evaluate(times, "position:hammer") - fine.evaluate(times, "position:hammer"))))
        )
    assert math.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.3), errors


@pytest.mark.parametrize("points", [3.6, 6.0, 10.0])
def test_an_impact_gains_less_energy_than_declared(points: float) -> None:
    # 3.6 points per period are w dt = 1.745, near the limit of 1.866. The momentum is checked by every run.
    assert struck(ChungLee(), points).energy.largest_gain <= ChungLee.gains_energy


MESH = FiniteElement(20, "lumped")


def test_it_refuses_dampers_and_steps_beyond_its_limit() -> None:
    viscous = Rod("rod", (PIECE,), End("free"), End("dashpot", 1.0))
    with pytest.raises(PairingError, match="supports bodies without dampers only"):
        simulate.run(*simulation("viscous", {"rod": viscous}, (), 1e-4, ChungLee(), StepRule(courant=0.5), model=MESH))
    plain = Rod("rod", (PIECE,), End("free"), End("clamped"))
    # A lumped mesh allows c dt/h up to 1 for beta = 1, so up to 1/sqrt(31/27) = 0.933.
    with pytest.raises(CaseError, match="beyond the stability limit"):
        simulate.run(*simulation("long", {"rod": plain}, (), 1e-4, ChungLee(), StepRule(courant=0.95), model=MESH))
