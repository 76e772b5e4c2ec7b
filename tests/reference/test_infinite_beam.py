"""The infinite Euler-Bernoulli beam against closed forms, and against a finite beam that nothing comes back in."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import erfcx

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.dispersive_identification import DispersiveIdentification
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.power_law import Hertz
from impactlab.errors import ImpactlabError
from impactlab.models.base import Face
from impactlab.models.continuous import Continuous
from impactlab.models.continuous.infinite_beam import InfiniteBeam
from impactlab.models.finite_element import FiniteElement
from impactlab.scene import Beam, BeamSegment, End, Probe, Rayleigh
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare, run
from impactlab.testing.scenes import struck

INFINITE, FREE = End("infinite"), End("free")
SEGMENT = BeamSegment(2.0, 1e-4, 2.1e11, 7900.0, inertia=1e-8 / 12.0)
EI, RHO_A = 175.0, 0.79
K = math.sqrt(8.0) * EI**0.25 * RHO_A**0.75
KAPPA = 100.0


def scene(law: AbstractContactLaw, dt: float, duration: float, **changes: Any) -> Simulation:
    given = {"left": INFINITE, "right": INFINITE, "model": Continuous(), "resistance": K, "x": 1.0, **changes}
    mass, x, model = given.pop("resistance") / KAPPA, given.pop("x"), given.pop("model")
    beam = Beam("beam", (SEGMENT,), **given)
    return struck(beam, model, law, None, StepRule(dt=dt), mass=mass, x=x, duration=duration)


@pytest.mark.parametrize(
    ("law", "within"), [(AdditionDeletion(), 1e-6), (DispersiveIdentification(), 1e-3)], ids=["positions", "velocities"]
)
@pytest.mark.parametrize("tip", [False, True])
def test_a_hard_mass_slows_down_by_the_closed_form(tip: bool, law: AbstractContactLaw, within: float) -> None:
    """v/v0 = e^(kappa^2 t) erfc(kappa sqrt t); at a free tip of a beam that goes on one way K is a quarter of it."""
    changes = {"left": FREE, "x": 0.0, "resistance": 0.25 * K} if tip else {}
    history = run(*scene(law, 1e-8, 1e-3, **changes))
    known = (0.896457, 0.723578, 0.427584, 0.170578)
    for t, value in zip((1e-6, 1e-5, 1e-4, 1e-3), known, strict=True):
        assert erfcx(KAPPA * math.sqrt(t)) == pytest.approx(value, abs=5e-7)
        exact = erfcx(KAPPA * math.sqrt(t))
        assert history.evaluate([t], "velocity:hammer")[0] == pytest.approx(exact, abs=within)
    # The force falls from infinity: K v0/sqrt(pi t) less what the mass has lost by then, 2 % at kappa^2 t = 1e-4.
    force = history.evaluate([1e-8 * 100.5], f"force:{history.scene.contacts[0].name}")[0]
    assert force == pytest.approx(0.25**tip * K / math.sqrt(math.pi * 1e-6), rel=0.2)


@pytest.mark.parametrize(
    ("law", "order", "slack"), [(AdditionDeletion(), 2.0, 0.4), (DispersiveIdentification(), 1.0, 0.1)]
)
def test_orders_of_a_hard_contact(law: AbstractContactLaw, order: float, slack: float) -> None:
    """Second where the law holds positions, first where it holds velocities: the force is singular at t = 0."""
    exact = erfcx(KAPPA * math.sqrt(1e-5))
    steps = (1e-6, 5e-7, 2.5e-7)
    errors = [run(*scene(law, dt, 1e-5)).evaluate([1e-5], "velocity:hammer")[0] - exact for dt in steps]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(slopes - order) < slack)


def built(left: End = INFINITE, dt: float = 1e-7) -> tuple[InfiniteBeam, Any]:
    beam = Beam("beam", (SEGMENT,), left, INFINITE)
    model = InfiniteBeam(beam, 0.0, (Face(0.0, 0, math.nan),))
    return model, model.stepper(np.ones((1, 1)), dt)


def test_a_constant_force_is_answered_exactly_over_decades() -> None:
    """v = 2 F sqrt(t/pi)/K, u its integral: the trapezoidal rule in ln p with spacing 1/2 errs by 1e-8."""
    dt, count = 1e-7, 20_000
    _, stepper = built(dt=dt)
    state, answer = stepper.state.copy(), stepper.force_response[0]
    for step in range(1, count + 1):
        stepper.free(stepper.parameters, state)
        state += 3.0 * answer
        if step in (1, 2, 10, 1000, count):
            t = step * dt
            assert state[1] == pytest.approx(6.0 * math.sqrt(t / math.pi) / K, rel=1e-7)
            # The modes that fade faster than a thousandth of a step give nothing back: 3e-5 of the first step.
            assert state[0] == pytest.approx(4.0 * t * math.sqrt(t / math.pi) / K, rel=1e-4 / step + 1e-7)


def test_it_gives_back_no_more_than_it_was_given() -> None:
    """Whatever the forces: the work done on it is never negative, and at least what its memory holds."""
    rng = np.random.default_rng(3)
    _, stepper = built()
    n = int(stepper.parameters[0])
    weight = stepper.parameters[5 : 5 + n]
    for rough in (0.0, 0.9, 0.999):
        state, force, out = stepper.state.copy(), 0.0, np.zeros(4)
        for _ in range(2000):
            stepper.free(stepper.parameters, state)
            force = rough * force + rng.normal()
            state += force * stepper.force_response[0]
            stepper.measure(stepper.parameters, state, out)
            held = 0.5 * float(weight @ state[8:] ** 2) / K  # masses K/w with momenta q
            assert out[0] >= held * (1.0 - 1e-9) > 0.0


def test_a_long_finite_beam_gives_the_same_until_something_comes_back() -> None:
    """Hertz contact: its force holds frequencies up to 1e5 rad/s, whose waves need 1 ms for 2 m: 250 us are free."""
    law = Hertz(stiffness=1.58e10)
    infinite = run(*scene(law, 2.5e-7, 2.5e-4))
    ends = {"left": FREE, "right": FREE, "model": FiniteElement(elements=800)}
    finite = run(*scene(law, 2.5e-7, 2.5e-4, **ends))
    t = np.linspace(0.0, 2.5e-4, 300)
    # Steps of 1/600 of the contact: (w dt)^2/12 of both schemes, and h^4 of the mesh, stay below 1e-3.
    for channel in ("velocity:hammer", "displacement:beam@1"):
        one, other = infinite.evaluate(t, channel), finite.evaluate(t, channel)
        assert_allclose(one, other, atol=1e-3 * float(np.max(np.abs(other))))
    assert infinite.contacts[0].peak_force == pytest.approx(finite.contacts[0].peak_force, rel=1e-3)
    # All that left the mass is in the beam, and its momentum is what the contact gave.
    book = infinite.energy
    assert max(book.largest_gain, book.largest_loss) < 1e-9
    momentum = infinite.evaluate([2.5e-4], "momentum:beam")[0]
    assert momentum == pytest.approx(sum(span.impulse for span in infinite.contacts), rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"left": End("pinned")}, "the ends of 'beam' are pinned and infinite"),
        ({"left": FREE}, "struck at 1 m; its motion is known at its free tip, 0 m"),
        ({"segments": (SEGMENT, SEGMENT)}, "serves no second segment"),
        ({"tension": 10.0}, "serves no tension"),
        ({"damping": Rayleigh(1.0)}, "serves no damping"),
        ({"displacement": np.sin}, "serves no displacement at t = 0"),
    ],
)
def test_what_it_does_not_know_is_refused(changes: dict[str, Any], told: str) -> None:
    case = scene(DispersiveIdentification(), 1e-7, 1e-5)
    beam = dataclasses.replace(case.scene.bodies["beam"], **changes)
    with pytest.raises(ImpactlabError, match=told) as caught:
        prepare(*case.but(bodies={**case.scene.bodies, "beam": beam}))
    assert caught.value.remedy


def test_other_places_gravity_and_impulses_are_refused() -> None:
    case = scene(DispersiveIdentification(), 1e-7, 1e-5)
    with pytest.raises(ImpactlabError, match="serves no gravity"):
        prepare(*case.but(gravity=-9.81))
    with pytest.raises(ImpactlabError, match=r"not by displacement at 0\.7 m"):
        run(*case.but(probes=(Probe("beam", 0.7, "displacement"),)))
    with pytest.raises(ImpactlabError, match="strike on a continuous beam is zero"):
        prepare(*scene(ImpulseMomentum(), 1e-7, 1e-5))
