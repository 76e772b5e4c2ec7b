"""Love's rod: contract of models, frequencies of its theory, lag of short waves."""

from __future__ import annotations

import dataclasses
import math

import mpmath
import numpy as np
import pytest
from impactlab_love_rod.model import LoveRod
from scipy.linalg import eigh

import impactlab as il
from impactlab import plugins, simulate
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.dispersive_identification import DispersiveIdentification
from impactlab.contact.modal_messengers import ModalMessengers
from impactlab.errors import PairingError
from impactlab.history import AbstractHistory
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.measurement import dispersion
from impactlab.models.base import AbstractRodModel, Face
from impactlab.models.finite_element import FiniteElement
from impactlab.numerics.banded import full, solve
from impactlab.scene import Contact, End, Mass, Point, Probe, Rayleigh, Rod, Segment
from impactlab.scene.method import Simulation, StepRule
from impactlab.testing.contracts import RodModelContract
from impactlab.testing.scenes import simulation

PIECE = Segment(0.3, 9e-4, 2.1e11, 7900.0)


class TestLoveRod(RodModelContract):
    part = LoveRod(60)
    complete = True


class TestWithoutLateralInertia(RodModelContract):
    part = LoveRod(60, 0.0)
    complete = True


class TestModes(RodModelContract):
    part = LoveRod(modes=20)


def rod(model: AbstractRodModel, right: str = "clamped", **more: object) -> Rod:
    return Rod("rod", (PIECE,), End("free"), End(right), **more)  # type: ignore[arg-type]


def frequencies(model: AbstractRodModel, right: str = "clamped") -> np.ndarray:
    system = model.build(rod(model, right), 0.0).operators()
    return np.sqrt(np.abs(eigh(full(system.stiffness), full(system.mass), eigvals_only=True)))


def test_it_is_registered() -> None:
    assert plugins.registry().load(plugins.MODELS, "love_rod") is LoveRod


@pytest.mark.parametrize("mode", [1, 3, 6])
def test_frequencies_of_a_clamped_rod_are_love_s_with_order_two(mode: int) -> None:
    number = (mode - 0.5) * np.pi / PIECE.length
    exact = PIECE.wave_speed * number / math.sqrt(1.0 + 0.09 * PIECE.area / (2.0 * np.pi) * number**2)
    errors = [frequencies(LoveRod(n))[mode - 1] / exact - 1.0 for n in (40, 80)]
    # The next term of the error, (k h)^2 of the first, is below a hundredth at sixth mode and 40 elements.
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.02)
    # A mesh of bars makes wave numbers (k h)^2/24 too large in frequency; lateral inertia weakens that.
    assert 0.0 < errors[1] <= (number * PIECE.length / 80) ** 2 / 24.0


def test_without_poisson_s_ratio_it_is_the_finite_element_rod() -> None:
    assert np.allclose(frequencies(LoveRod(30, 0.0)), frequencies(FiniteElement(30)), rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("poisson", [0.1, 0.3, 0.49])
def test_its_bound_of_the_highest_frequency_is_one_and_close(poisson: float) -> None:
    for right, end in (("free", End("free")), ("spring", End("spring", 1e11)), ("mass", End("mass", 1.0))):
        system = LoveRod(25, poisson).build(Rod("rod", (PIECE,), End("free"), end), 0.0).operators()
        highest = math.sqrt(eigh(full(system.stiffness), full(system.mass), eigvals_only=True)[-1])
        assert highest <= system.highest_frequency * (1.0 + 1e-12)
        if right == "free":
            assert highest > 0.99 * system.highest_frequency


def test_short_waves_lag() -> None:
    # Let go from its fifth mode, a rod swings with Love's frequency: after ten turns of the bar it is behind by
    # 10 (1 - w/w_bar) of a turn.
    number = 4.5 * np.pi / PIECE.length
    model = LoveRod(300)
    turn = float(model.exact_frequencies(rod(model), 5)[4])
    duration = 10.0 * 2.0 * np.pi / (number * PIECE.wave_speed)
    dt = duration / 4000
    shaped = rod(model, displacement=lambda x: 1e-6 * np.cos(number * x))
    history = simulate.run(
        *simulation(
            "swing",
            {"rod": shaped},
            (),
            duration,
            Newmark(),
            StepRule(dt=dt),
            probes=(Probe("rod", 0.0, "displacement"),),
            model=model,
        )
    )
    times = dt * np.arange(4001)
    seen = history.evaluate(times, "displacement:rod@0") / 1e-6
    # Phase errors over the run: of the mesh w t (k h)^2/24 = 63 x 9e-5, of the step w t (w dt)^2/12 = 63 x 2e-5.
    assert np.max(np.abs(seen - np.cos(turn * times))) < 0.008
    lag = 10.0 * (1.0 - turn / (number * PIECE.wave_speed))
    assert lag > 0.1, "the case shows dispersion"
    assert np.max(np.abs(seen - np.cos(number * PIECE.wave_speed * times))) > 0.5


def test_it_keeps_energy_under_newmark() -> None:
    moving = rod(LoveRod(50), right="free", velocity=0.3, displacement=lambda x: 1e-6 * np.cos(9.0 * x))
    history = simulate.run(
        *simulation("free", {"rod": moving}, (), 1e-3, Newmark(), StepRule(points_per_period=10.0), model=LoveRod(50))
    )
    # Rounding of some thousand steps.
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-10


def test_a_scheme_for_diagonal_masses_is_refused() -> None:
    scene = simulation(
        "refused", {"rod": rod(LoveRod(20))}, (), 1e-4, CentralDifference(), StepRule(courant=0.5), model=LoveRod(20)
    )
    with pytest.raises(PairingError, match="needs a diagonal mass"):
        simulate.run(*scene)


def test_rayleigh_s_mass_damping_is_that_of_the_whole_mass() -> None:
    system = LoveRod(10).build(rod(LoveRod(10), damping=Rayleigh(mass=3.0)), 0.0).operators()
    assert np.allclose(full(system.damping), 3.0 * full(system.mass), rtol=1e-14, atol=0.0)


@pytest.mark.parametrize("right", ["clamped", "free"])
def test_modes_in_closed_form_are_those_of_a_fine_mesh(right: str) -> None:
    exact = LoveRod(modes=6).build(rod(LoveRod(modes=6), right), 0.0)
    own = np.sqrt(exact.operators().stiffness[0])
    mesh = frequencies(LoveRod(400), right)[: own.size]
    # A mesh of bars: (k h)^2/24 too high, 1e-4 at the sixth mode; a free rod's rigid motion is zero to rounding.
    assert np.allclose(own[1:], mesh[1:], rtol=2e-4)
    assert np.allclose(own[1:], LoveRod().exact_frequencies(rod(LoveRod(), right), 6)[-own.size + 1 :], rtol=1e-12)
    # Unit modal mass: the momentum of a uniform motion, sum of squares, tends to the mass of the rod.
    many = LoveRod(modes=400).build(rod(LoveRod(modes=400), right), 0.0)
    assert many.row(0.1, "displacement") @ many.momentum_row() == pytest.approx(1.0, abs=5e-3)


def struck(law: AbstractContactLaw, modes: int, duration: float) -> AbstractHistory:
    """Return the history of a mass that strikes the rod's free end.

    It weighs as much as the rod, and moves at 1 m/s.
    """
    model = LoveRod(modes=modes, radius_of_gyration=RADIUS)
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), 0.0)
    bodies = {"hammer": Mass("hammer", PIECE.mass, 1.0), "rod": rod(model)}
    return simulate.run(
        *simulation("struck", bodies, (contact,), duration, ExactModal(), StepRule(dt=3e-7), model=model, law=law)
    )


RADIUS = 0.03  # m: its lateral inertia is felt by waves of nu r = 9 mm


def slowed(time: float) -> float:
    """Return the velocity of a mass on the clamped rod, by inverse Laplace transform.

    The end of the rod resists with Z(s) = rho A sqrt(c^2 + a^2 s^2) coth(s L/sqrt(c^2 + a^2 s^2)), a = nu r.
    """
    a, c, line = 0.3 * RADIUS, PIECE.wave_speed, PIECE.density * PIECE.area

    def transform(s: mpmath.mpc) -> mpmath.mpc:
        root = mpmath.sqrt(c * c + a * a * s * s)
        return PIECE.mass / (PIECE.mass * s + line * root * mpmath.coth(s * PIECE.length / root))

    return float(mpmath.invertlaplace(transform, time, method="talbot", degree=60))


@pytest.mark.parametrize("law", [DispersiveIdentification(), ModalMessengers()], ids=["general", "sketch"])
def test_a_mass_on_love_s_rod_slows_as_its_transform(law: AbstractContactLaw) -> None:
    trip = 2.0 * PIECE.length / PIECE.wave_speed
    seen = struck(law, 150, 1.2 * trip)
    # At once the face of a Love rod has the mass rho A nu r, which the first step gives the velocity of the hammer.
    at_once = 1.0 / (1.0 + 0.3 * RADIUS / PIECE.length)
    assert slowed(1e-3 * trip) == pytest.approx(at_once, abs=5e-3)
    for place in (0.1, 0.5, 0.9, 1.05):
        # First order in a step of trip/400 and in the modes left out.
        assert float(seen.evaluate(place * trip, "velocity:hammer")) == pytest.approx(slowed(place * trip), abs=4e-3)


def test_each_mode_s_messenger_gives_its_free_motion() -> None:
    t = np.linspace(0.0, 2e-4, 400)
    one, other = struck(ModalMessengers(), 30, 2e-4), struck(DispersiveIdentification(residual=False), 30, 2e-4)
    apart = one.evaluate(t, "position:hammer") - other.evaluate(t, "position:hammer")
    assert np.max(np.abs(apart)) < 1e-15  # m, of 1e-5: rounding of seven hundred steps


def test_the_general_law_serves_the_mesh_too() -> None:
    # Without modes nor messengers: the law asks the scheme. 300 bars, against the transform, as above.
    trip = 2.0 * PIECE.length / PIECE.wave_speed
    model = LoveRod(300, radius_of_gyration=RADIUS)
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), 0.0)
    bodies = {"hammer": Mass("hammer", PIECE.mass, 1.0), "rod": rod(model)}
    seen = simulate.run(
        *simulation(
            "struck",
            bodies,
            (contact,),
            trip,
            Newmark(),
            StepRule(dt=3e-7),
            model=model,
            law=DispersiveIdentification(),
        )
    )
    for place in (0.1, 0.5, 0.9):
        assert float(seen.evaluate(place * trip, "velocity:hammer")) == pytest.approx(slowed(place * trip), abs=4e-3)


def test_a_signal_of_the_rod_moves_with_its_own_dispersion() -> None:
    """A gauge signal moved along a 2 m rod fits Love's dispersion.

    A ball strikes the rod. The signal at 0.3 m is moved to 1.5 m plainly and with Love's speeds.
    """
    case = il.Case(
        bodies={
            "ball": il.Mass(0.02, velocity=5.0),
            "rod": il.Rod(length=2.0, diameter=0.02, material={"young": 2e11, "density": 8000.0}),
        },
        contacts=[il.Contact("ball", "rod.left", law={"kind": "penalty", "stiffness": 2e9})],
        solve={
            "duration": 490e-6,  # the far end is heard at 1.5 m after 500 us
            "model": {"kind": "finite_element", "elements": 10},
            "integrator": {"kind": "exact_modal"},
            "step": {"dt": 1e-7},
        },
        probes=[{"body": "rod", "at": x, "quantity": "strain"} for x in (0.3, 1.5)],
    )
    scene, method = case.simulation()
    history = il.run(Simulation(scene, dataclasses.replace(method, models={"rod": LoveRod(modes=800)})))
    times = 0.25e-6 * np.arange(1960)
    near, far = (history.evaluate(times, f"strain:rod@{x:g}") for x in (0.3, 1.5))
    missed = [
        np.linalg.norm(dispersion.shift(near, 0.25e-6, 1.2, dispersion.Bar(0.02, 5000.0, 8000.0, 0.3, theory)) - far)
        for theory in ("none", "love")
    ] / np.linalg.norm(far)
    assert missed[0] == pytest.approx(0.81, abs=0.01)
    assert missed[1] < 0.03


def test_a_contact_inside_an_element_yields_as_in_statics() -> None:
    rod = Rod("rod", (Segment(0.6, 6.0e-4, 2.1e11, 7850.0),), End("clamped"), End("free"))
    body = LoveRod(elements=7).build(rod, 0.0, (Face(0.21, 0, 1.0),))
    row = body.row(0.21, "displacement")
    compliance = row @ solve(body.operators().stiffness, row)
    assert compliance == pytest.approx(0.21 / (2.1e11 * 6.0e-4), rel=1e-11)
