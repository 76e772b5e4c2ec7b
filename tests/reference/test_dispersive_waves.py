"""Dispersive waves at a contact: the general law against closed forms, and what the sketch of the source gives."""

from __future__ import annotations

import ctypes
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import erfcx, sici

from impactlab import simulate
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.dispersive_identification import DispersiveIdentification
from impactlab.contact.modal_messengers import ModalMessengers
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import PairingError
from impactlab.exact.solve import solve
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.newmark import Newmark
from impactlab.metrics import midpoints, relative_l2
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.messengers import arriving_row, miss, wave_numbers, waves_at
from impactlab.models.modal import Modal
from impactlab.scene import Beam, BeamSegment, ElasticBody, End, Rod
from impactlab.scene.method import StepRule
from impactlab.testing.scenes import STEEL, mass_on_rod
from impactlab.testing.scenes import struck as struck_body
from impactlab.types import Array, Port, Quantity, Reply, SideFacts

AREA, INERTIA, YOUNG, DENSITY = 1e-4, 1e-8 / 12.0, 2.157463e11, 7960.0
SLENDER = BeamSegment(2.0, AREA, YOUNG, DENSITY, inertia=INERTIA)
SHEARED = replace(SLENDER, shear_stiffness=5.0 / 6.0 * AREA * YOUNG / 2.6, rotary_inertia=DENSITY * INERTIA)


def rod(far: Any = "clamped") -> Rod:
    return Rod("rod", (STEEL,), End("free"), End(far))


def beam(segment: BeamSegment, left: Any, right: Any) -> Beam:
    theory = "timoshenko" if math.isfinite(segment.shear_stiffness) else "euler_bernoulli"
    return Beam("beam", (segment,), End(left), End(right), theory=theory)  # type: ignore[arg-type]


def struck(
    body: tuple[ElasticBody, AbstractRodModel],
    law: AbstractContactLaw,
    mass: float,
    duration: float,
    x: float = 0.0,
    step: StepRule = StepRule(points_per_period=10.0),  # noqa: B008
    integrator: AbstractIntegrator = ExactModal(),  # noqa: B008
) -> AbstractHistory:
    """Return the history of a mass of 1 m/s that strikes a body from its left, or from below."""
    elastic, model = body
    return simulate.run(*struck_body(elastic, model, law, integrator, step, mass=mass, x=x, duration=duration))


# Messengers of single modes.


def test_the_messengers_of_a_uniform_rod_give_its_free_motion() -> None:
    for far, x in (("clamped", 0.0), ("free", 0.0), ("free", 0.3), ("clamped", 0.11)):
        body = Modal(None, 30).build(rod(far), 0.0)
        frequencies = np.sqrt(body.operators().stiffness[0])
        dt = 2.0 * np.pi / frequencies[-1] / 10.0
        # Rounding of sines of arguments up to 30 pi.
        assert miss(body.arriving(x, dt, "phase"), body.row(x, "displacement"), frequencies, dt) < 1e-12


def sines(quantity: Quantity, x: float, count: int, segment: BeamSegment) -> Array:
    """Return the quantities of the modes sin(n pi x/L) of a pinned beam without shear."""
    k = np.arange(1, count + 1) * np.pi / segment.length
    if quantity in ("displacement", "velocity"):
        return np.asarray(np.sin(k * x))
    return np.asarray(k * np.cos(k * x) if quantity == "rotation" else segment.bending_stiffness * k**3 * np.cos(k * x))


@pytest.mark.parametrize("tension", [0.0, 2e3])
def test_messengers_on_both_sides_of_a_pinned_beam_give_its_free_motion(tension: float) -> None:
    # Each mode is one standing wave without a near field; by symmetry the slopes on both sides cancel.
    held = replace(beam(SLENDER, "pinned", "pinned"), tension=tension)
    k = np.arange(1, 25) * np.pi / SLENDER.length
    squared = (SLENDER.bending_stiffness * k**4 + tension * k**2) / (DENSITY * AREA)
    frequencies = np.asarray(np.sqrt(squared))
    dt, face = 2.0 * np.pi / frequencies[-1] / 10.0, 0.7

    def row(x: float, quantity: Quantity) -> Array:
        return sines(quantity, x, 24, SLENDER)

    waves = waves_at(held, face, frequencies)
    assert np.allclose(waves.phase_speed, frequencies / k, rtol=1e-12)
    read = arriving_row(held, waves, row, face, dt, "phase")
    assert miss(read, row(face, "displacement"), frequencies, dt) < 1e-10
    # Group speeds are another reading, and not the free motion.
    group = arriving_row(held, waves, row, face, dt, "group")
    assert miss(group, row(face, "displacement"), frequencies, dt) > 0.3


def test_wave_numbers_follow_the_dispersion_relations() -> None:
    k, tension = np.geomspace(0.5, 400.0, 12), 3e3
    area_mass, rotary = DENSITY * AREA, SHEARED.rotary_inertia
    slender = np.sqrt((SLENDER.bending_stiffness * k**4 + tension * k**2) / area_mass)
    assert np.allclose(wave_numbers(SLENDER, tension, slender), k, rtol=1e-10)
    # Timoshenko: the determinant of (S + T) k^2 - m w^2, i S k; -i S k, E I k^2 + S - J w^2; its lower branch.
    shear, bending = SHEARED.shear_stiffness, SHEARED.bending_stiffness
    a = area_mass * rotary
    b = -((shear + tension) * k**2 * rotary + area_mass * (bending * k**2 + shear))
    c = (shear + tension) * k**2 * (bending * k**2 + shear) - shear**2 * k**2
    lower = np.sqrt(2.0 * c / (-b + np.sqrt(b * b - 4.0 * a * c)))
    # The root is a difference of squares that agree to (k h)^2/12 at the longest waves: five digits are lost there.
    assert np.allclose(wave_numbers(SHEARED, tension, lower), k, rtol=1e-7)


@pytest.mark.parametrize("points", [10.0, 40.0])
@pytest.mark.parametrize("segment", [SLENDER, SHEARED], ids=["slender", "sheared"])
def test_at_the_tip_of_a_beam_the_messengers_miss_whatever_the_step(segment: BeamSegment, points: float) -> None:
    short = replace(segment, length=0.3)
    body = Modal(300, 10).build_beam(beam(short, "clamped", "free"), 0.0)
    frequencies = np.sqrt(body.operators().stiffness[0])
    dt = 2.0 * np.pi / frequencies[-1] / points
    # To first order in the step the reading is off by the slope of the tip times c dt, the change by w dt: their ratio,
    # phi'/(k phi), is 0.73 for the first mode of a slender cantilever and 1 for the others.
    assert 0.6 < miss(body.arriving(0.3, dt, "phase"), body.row(0.3, "displacement"), frequencies, dt) < 1.5


# The laws.


def test_a_mode_s_messenger_and_its_free_motion_are_one_law() -> None:
    # On a rod the sketch is the general form without residual: 1e-12 a step, of some hundred.
    end = 3.0 * rod().round_trip
    one, other = (
        struck((rod(), Modal(None, 20)), law, STEEL.mass, end)
        for law in (ModalMessengers(), DispersiveIdentification(residual=False))
    )
    t = midpoints(end)
    for channel in ("position:hammer", "force:hammer|rod.left"):
        a, b = one.evaluate(t, channel), other.evaluate(t, channel)
        assert np.max(np.abs(a - b)) < 1e-9 * np.max(np.abs(b)), channel


def test_the_response_of_all_modes_to_a_force_is_that_of_the_impedance() -> None:
    # Sum of phi^2 sin(w dt)/w over d modes is (2/pi) Si(w_max dt) of 1/Z, by a midpoint rule of d cells.
    d = 200
    body = Modal(None, d).build(rod(), 0.0)
    frequencies, phi = np.sqrt(body.operators().stiffness[0]), body.row(0.0, "displacement")
    highest = frequencies[-1] + 0.5 * (frequencies[1] - frequencies[0])
    for turn in (0.628, 1.9, 12.0):
        dt = turn / highest
        answered = STEEL.impedance * float(np.sum(phi**2 * np.sin(frequencies * dt) / frequencies))
        assert answered == pytest.approx(2.0 / np.pi * sici(turn)[0], abs=0.01)


def test_where_the_face_responds_by_its_impedance_both_laws_give_the_same_force() -> None:
    # The law of the source divides by 1/Z and reads v - s/(rho c); given both, the general form is the same number.
    dt, rng = 1e-7, np.random.default_rng(0)
    nothing, z = math.nan, STEEL.impedance
    hammer = SideFacts("mass", nothing, nothing, nothing, nothing, nothing, 1.0, 0.0, dt)
    face = SideFacts("rod", z, STEEL.wave_speed, STEEL.area, 1e9, 0.3, 1.0, 0.0, 0.7 / z)
    for _ in range(50):
        stress, speed, free = rng.normal(0.0, 4e7), rng.normal(), rng.normal() + 1.0
        port, replies = Port(), []
        port.dt, port.gap = dt, -1e-9
        port.left.free_velocity, port.left.velocity_per_force = free, dt
        port.right.free_velocity = speed - stress * STEEL.area / z
        port.free_gap_rate, port.rate_per_force = port.right.free_velocity - free, dt + 1.0 / z
        port.readings[0], port.readings[1] = speed, stress
        for law in (WaveIdentification(residual=False), DispersiveIdentification(residual=False)):
            start = law.begin(hammer, face, dt)
            ctypes.memset(ctypes.byref(port.parameters), 0, ctypes.sizeof(port.parameters))
            port.parameters[: len(start.parameters)] = start.parameters
            reply = Reply()
            type(law).respond(port, reply)
            replies.append(reply.trial)
        assert replies[0] == pytest.approx(replies[1], rel=1e-12, abs=1e-9)


@pytest.mark.parametrize(("modes", "bound"), [(10, 0.02), (40, 0.006), (100, 0.002)])
def test_on_the_rod_of_the_source_it_is_as_near_as_the_law_of_the_source(modes: int, bound: float) -> None:
    end = 3.0 * rod().round_trip
    seen = struck((rod(), Modal(None, modes)), DispersiveIdentification(), STEEL.mass, end)
    exact = solve(*mass_on_rod(None, WaveIdentification()))
    t = midpoints(end)
    error = relative_l2(seen.evaluate(t, "position:hammer"), exact.evaluate(t, "position:hammer"))
    # A force of N modes is first order in the step, which is 1/(10 N) of a round trip: the error goes as 1/N.
    assert error is not None
    assert error < bound
    impulse = [sum(span.impulse for span in history.contacts) for history in (seen, exact)]
    assert impulse[0] == pytest.approx(impulse[1], rel=2e-3)


@pytest.mark.parametrize(
    ("left", "right", "x", "share"), [("pinned", "pinned", 1.0, 1.0), ("clamped", "free", 2.0, 0.25)]
)
def test_a_mass_on_a_long_slender_beam_slows_as_erfcx(left: str, right: str, x: float, share: float) -> None:
    # M v' = -K times the half derivative of v gives v/v0 = erfcx(kappa sqrt t) with kappa = K/M, and
    # K = 2 sqrt2 (E I)^(1/4) (rho A)^(3/4) at an inner point, a quarter of that at a free tip.
    mass = 0.05 * SLENDER.mass
    resistance = share * 2.0 * math.sqrt(2.0) * SLENDER.bending_stiffness**0.25 * (DENSITY * AREA) ** 0.75
    kappa = resistance / mass
    held = beam(SLENDER, left, right), Modal(200, 200)
    seen = struck(held, DispersiveIdentification(), mass, kappa**-2, x)
    for place in (0.1, 0.5, 1.0):
        t = place / kappa**2
        # The shortest wave kept has 20 nodes of 2 L/200 a period; the mass crosses such a wave's period in t = 0.01.
        assert float(seen.evaluate(t, "velocity:hammer")) == pytest.approx(erfcx(kappa * math.sqrt(t)), abs=4e-3)


@pytest.mark.parametrize("integrator", [Newmark(), Midpoint(), CentralDifference()], ids=["newmark", "midpoint", "cd"])
@pytest.mark.parametrize("mass", [0.1, 1.0, 30.0])
def test_without_residual_it_books_all_it_takes(integrator: AbstractIntegrator, mass: float) -> None:
    lumped = rod("free"), FiniteElement(20, "lumped")
    seen = struck(
        lumped, DispersiveIdentification(residual=False), mass, 3.0 * lumped[0].round_trip, integrator=integrator
    )
    # From the second step of a contact on both faces have one velocity, so that the force does no work on them; the
    # way within the step in which they separate remains, at most the change of velocity of one step.
    assert seen.energy.largest_gain < 5e-3
    assert seen.energy.largest_loss < 5e-3


def test_with_residual_the_unresolved_energy_is_booked_and_never_negative() -> None:
    body = rod()
    seen = struck((body, Modal(None, 20)), DispersiveIdentification(), STEEL.mass, 3.0 * body.round_trip)
    assert 0.0 < seen.energy.booked["unresolved"][-1] < 0.05 * seen.energy.scale
    assert np.all(np.diff(seen.energy.booked["unresolved"]) >= 0.0)
    assert np.all(np.diff(seen.energy.booked["contact"]) >= 0.0)
    # Steps in which the force works the other way are not booked back: the balance may end above, not below.
    assert seen.energy.largest_gain < 0.02
    assert seen.energy.largest_loss < 1e-9


# Refusals.


def refused(
    body: tuple[ElasticBody, AbstractRodModel], law: AbstractContactLaw, x: float = 0.0, dt: float = 1e-7
) -> str:
    integrator: AbstractIntegrator = ExactModal() if isinstance(body[1], Modal) else Newmark()
    with pytest.raises(PairingError) as raised:
        struck(body, law, 1.0, 1e-5, x, StepRule(dt=dt), integrator)
    return str(raised.value)


def test_the_law_of_the_source_is_not_used_for_a_beam_under_its_name() -> None:
    said = refused((beam(SLENDER, "pinned", "pinned"), Modal(50, 10)), WaveIdentification(), 1.0)
    assert "on the beam 'beam' every" in said
    assert "dispersive_identification" in said
    assert "modal_messengers" in said


def test_the_sketch_is_refused_at_a_tip_with_its_number() -> None:
    tip = beam(replace(SLENDER, length=0.3), "clamped", "free"), Modal(300, 10)
    said = refused(tip, ModalMessengers(), 0.3, 1e-6)
    share = float(said.split(" with an error of ")[1].split(" %")[0])
    assert 60.0 < share < 150.0
    seen = struck(tip, ModalMessengers(accept=2.0), 0.1, 1e-4, 0.3, StepRule(dt=1e-6))
    assert any(warned.code == "messengers_apart" for warned in seen.warnings)


@pytest.mark.parametrize(
    ("body", "law", "x", "dt", "words"),
    [
        ((rod(), FiniteElement(20)), ModalMessengers(), 0.0, 1e-7, "needs a body in modes"),
        ((rod(), Modal(None, 40)), ModalMessengers(balance="impedance"), 0.0, 1e-7, "give 0.137/Z in this step"),
        ((rod(), Modal(None, 5)), ModalMessengers(), 0.0, 7e-5, "beyond the body (0.3 m)"),
        ((rod(), Modal(None, 5)), ModalMessengers(), 0.05, 1.2e-5, "beyond the body (0.05 m)"),
        (
            (beam(SLENDER, "pinned", "pinned"), Modal(50, 10)),
            ModalMessengers(balance="impedance"),
            1.0,
            1e-6,
            "none here",
        ),
        (
            (Rod("rod", (STEEL,), End("free", force=1.0), End("clamped")), Modal(None, 40)),
            ModalMessengers(),
            0.0,
            1e-7,
            "an end force also acts on the face of 'rod'",
        ),
    ],
)
def test_where_the_sketch_cannot_serve_it_gives_the_reason(
    body: tuple[ElasticBody, AbstractRodModel], law: AbstractContactLaw, x: float, dt: float, words: str
) -> None:
    assert words in refused(body, law, x, dt)
