"""The quadratised power law keeps the contract of laws, keeps energy, and meets Hertz's collision."""

from __future__ import annotations

import math

import numpy as np
import pytest
from impactlab_quadratised_collision.law import QuadratisedPowerLaw

from impactlab import plugins, simulate
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import Contact, End, Mass, Point, Rod, Segment, Wall
from impactlab.scene.method import StepRule
from impactlab.testing.contracts import ContactLawContract
from impactlab.testing.scenes import simulation
from impactlab.testing.trace import trace

STIFFNESS = 1.0e6
BALLS = {"ball": Mass("ball", 1.0, 1.0), "wall": Wall("wall")}
DEEPEST = (5.0 / (4.0 * STIFFNESS)) ** 0.4  # m, of 1 kg at 1 m/s by Hertz: m v0^2/2 = 2 K d^(5/2)/5


def contact_time(exponent: float) -> float:
    """Return the contact time of 1 kg at 1 m/s, by Euler's beta.

    It is 2 d_max times the integral of (1 - x^(a+1))^(-1/2) over 0..1.
    """
    share = 1.0 / (exponent + 1.0)
    deepest = (0.5 * (exponent + 1.0) / STIFFNESS) ** share
    return 2.0 * deepest * math.sqrt(math.pi) * math.gamma(1.0 + share) / math.gamma(0.5 + share)


DURATION = contact_time(1.5)  # s


class TestHertzLike(ContactLawContract):
    part = QuadratisedPowerLaw()


class TestLinear(ContactLawContract):
    part = QuadratisedPowerLaw(1e8, 1.0)


class TestSteep(ContactLawContract):
    part = QuadratisedPowerLaw(1e12, 2.5)


def bounced(steps: int, integrator: AbstractIntegrator, exponent: float = 1.5) -> AbstractHistory:
    """Return the history of a ball thrown at a wall.

    Its contact has so many steps, and the touch is within a step.
    """
    dt = contact_time(exponent) / steps
    law = QuadratisedPowerLaw(STIFFNESS, exponent)
    contact = Contact(Point("ball", 0.0, "ball"), Point("wall", 0.0, "wall"), 3.3 * dt)
    return simulate.run(
        *simulation("ball", BALLS, (contact,), (2 * steps + 6) * dt, integrator, StepRule(dt=dt), law=law)
    )


def test_the_exact_duration_is_hertz_s() -> None:
    assert pytest.approx(2.9432751843 * DEEPEST, rel=1e-10) == DURATION


def test_it_is_registered() -> None:
    assert plugins.registry().load(plugins.LAWS, "quadratised_power_law") is QuadratisedPowerLaw


@pytest.mark.parametrize("integrator", [Newmark(), CentralDifference(), ExactModal()])
@pytest.mark.parametrize("exponent", [1.0, 1.5, 3.0])
def test_a_bounce_keeps_energy_to_rounding_at_any_step(integrator: AbstractIntegrator, exponent: float) -> None:
    for steps in (3, 10, 100):
        history = bounced(steps, integrator, exponent)
        # A hundred steps, each with a few roundings of the energy; nothing is left in the open contact.
        assert history.energy.largest_gain < 1e-13
        assert history.energy.largest_loss < 1e-13
        assert float(history.evaluate(history.duration, "velocity:ball")) == pytest.approx(-1.0, abs=1e-13)


def test_it_converges_to_the_duration_and_force_of_hertz_with_order_two() -> None:
    errors, peaks = [], []
    for steps in (100, 200, 400, 800):
        history = bounced(steps, Newmark())
        [contact] = history.contacts
        assert contact.end is not None
        errors.append(abs((contact.end - contact.start) / DURATION - 1.0))
        assert contact.peak_force is not None
        peaks.append(abs(contact.peak_force / (STIFFNESS * DEEPEST**1.5) - 1.0))
    # The place of the touch in its step makes the error uneven from one step size to the next; over three halvings it
    # falls by 2^6, here asked to be within a factor of four of that.
    assert errors[-1] < errors[0] / 16.0, errors
    assert errors[-1] < 2e-5
    assert peaks[-1] < 1e-4


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.5])
def test_its_depth_error_falls_with_the_square_of_the_step(exponent: float) -> None:
    # Compression alone, to before the deepest point: smooth in time after the touch; against the finest run.
    law, end = QuadratisedPowerLaw(STIFFNESS, exponent), 0.4 * contact_time(exponent)
    found = []
    for steps in (50, 100, 200, 3200):
        contact = Contact(Point("ball", 0.0, "ball"), Point("wall", 0.0, "wall"), 0.0)
        history = simulate.run(
            *simulation("ball", BALLS, (contact,), end, Newmark(), StepRule(dt=end / steps), law=law)
        )
        found.append(float(history.evaluate(end, "position:ball")))
    errors = np.abs(np.array(found[:3]) - found[3])
    # The finest is 256 times better than the third; exponents above one start with a singular second derivative.
    assert math.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.25), errors


@pytest.mark.parametrize(
    ("model", "integrator"),
    [(FiniteElement(40), Newmark()), (FiniteElement(40, "lumped"), CentralDifference()), (Modal(None, 40), Newmark())],
)
def test_a_struck_rod_keeps_energy_to_rounding(model: AbstractRodModel, integrator: AbstractIntegrator) -> None:
    piece = Segment(0.3, 9e-4, 2.1e11, 7900.0)
    rod = Rod("rod", (piece,), End("free"), End("clamped"))
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), 0.0)
    bodies = {"hammer": Mass("hammer", piece.mass, 1.0), "rod": rod}
    history = simulate.run(
        *simulation(
            "struck",
            bodies,
            (contact,),
            3.0 * rod.round_trip,
            integrator,
            StepRule(points_per_period=10.0),
            model=model,
            law=QuadratisedPowerLaw(3e11, 1.5),
        )
    )
    # Some thousand steps of forty coordinates: random sums of roundings.
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-11


def test_faces_that_overlap_from_the_start_feel_the_whole_force() -> None:
    contact = Contact(Point("ball", 0.0, "ball"), Point("wall", 0.0, "wall"), -1e-3)
    bodies = {"ball": Mass("ball", 1.0, 0.0), "wall": Wall("wall")}
    traced = trace(
        simulation("pressed", bodies, (contact,), 0.1, Newmark(), StepRule(dt=1e-5), law=QuadratisedPowerLaw(STIFFNESS))
    )
    # All of 2 K d^(5/2)/5 becomes motion.
    expected = -math.sqrt(2.0 * 0.4 * STIFFNESS * 1e-3**2.5)
    assert traced.velocities("ball")[-1, 0] == pytest.approx(expected, rel=1e-9)
