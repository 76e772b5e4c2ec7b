"""Rods that turn: frequencies in closed form, and a struck rod against the Laplace inversion of its exact transform.

The rod is clamped at the axis, r0 = L tan(w)/w the radius of its tip, w = Omega L/c. While its own mass, arriving
inwards at v0, presses on the tip, the mass has moved inwards by d(t) with the transform

    D(s) = (v0 - Omega^2 r0/s)/(s^2 - Omega^2 + (Z/M) kap coth(kap L/c)),  kap = sqrt(s^2 - Omega^2),

and the force is Z kap coth(kap L/c) D. Its waves arrive after each round trip: with e = exp(-2 kap L/c) the quotient is
a series in e, whose terms are inverted apart, each from its own front on.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from impactlab.bases.analytic import AnalyticBasis
from impactlab.bases.eigenvectors import Eigenvectors
from impactlab.bases.reduced import ReducedMesh
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.history import AbstractHistory
from impactlab.integrators.adaptive import Adaptive
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.newmark import Newmark
from impactlab.metrics.peaks import peak_force
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.bars import Mesh
from impactlab.models.modal import Modal
from impactlab.scene.bodies import End, Mass, Rayleigh, Rod, Rotation, Segment
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import in_a_row, simulation

STEEL = Segment(0.3, 9e-4, 2.1e11, 7900.0)
C, Z, M, L = STEEL.wave_speed, STEEL.impedance, 2.133, 0.3
T = 2.0 * L / C
CLAMPED, FREE = End("clamped"), End("free")
CONTACT = "rod.right|hammer"


def turning(rate: float, left: End = CLAMPED, right: End = FREE, axis: float = 0.0) -> Rod:
    return Rod("rod", (STEEL,), left, right, rotation=Rotation(rate, axis))


def struck(rate: float, model: Any, integrator: Any, step: StepRule, law: Any = None, **others: Any) -> Simulation:
    """The rod, struck at its tip by its own mass, inwards at 1 m/s."""
    rod = turning(rate)
    hammer = Mass("hammer", M, -1.0, rotation=Rotation(rate, -rod.steady.radii[1]))
    return in_a_row([rod, hammer], model, law or AdditionDeletion(), integrator, step, **{"round_trips": 4.0, **others})


def on_lumped_mesh(rate: float, elements: int = 1000) -> AbstractHistory:
    return run(*struck(rate, FiniteElement(elements, "lumped"), CentralDifference(), StepRule(courant=1.0)))


# --- frequencies


@pytest.mark.parametrize(("mass", "order"), [("consistent", 1), ("lumped", 1), ("consistent", 3), ("lumped", 4)])
@pytest.mark.parametrize("rate", [100.0, 20_000.0])
def test_mesh_frequencies_converge_to_the_closed_form(mass: Any, order: int, rate: float) -> None:
    """sqrt(((2n - 1) pi c/2L)^2 - Omega^2), from above (consistent) or below, at order 2p of p-th order elements."""
    exact = np.sqrt(((2.0 * np.arange(1, 5) - 1.0) * np.pi * C / (2.0 * L)) ** 2 - rate**2)
    errors = []
    for elements in (24, 48) if order == 1 else (6, 12):
        mesh = Mesh(turning(rate), elements, mass, 0.0, order)
        found = ReducedMesh(mesh, Eigenvectors().span(mesh, 4, ()).shapes, True).frequencies
        errors.append(np.abs(found / exact - 1.0))
    assert_allclose(np.log2(errors[0] / errors[1])[-2:], 2.0 * order, atol=0.25)


def test_analytic_modes_have_the_closed_form_and_its_statics() -> None:
    for ends, less in (((CLAMPED, FREE), 0.5), ((FREE, CLAMPED), 0.5), ((CLAMPED, CLAMPED), 0.0)):
        rate, rod = 15_000.0, turning(15_000.0, *ends)
        basis, mesh = AnalyticBasis(rod, 3), Mesh(rod, 20, "consistent", 0.0, 8)
        wanted = [math.sqrt(((n - less) * math.pi * C / L) ** 2 - rate**2) for n in (1, 2, 3)]
        assert_allclose(basis.frequencies, wanted, rtol=1e-14)
        for face, x in ((0.15, 0.045), (0.15, 0.21), (0.15, 0.15)):
            for quantity in ("displacement", "force", "stress", "strain"):
                if x == face and quantity != "displacement":
                    continue  # it jumps there
                found, meshed = basis.static(x, quantity, face), mesh.static_compliance(x, quantity, face)
                assert found == pytest.approx(meshed, rel=1e-7), (ends, quantity, x)


def test_low_frequencies_of_fine_meshes_are_not_lost() -> None:
    """Just below the limit rate the first one is a small difference."""
    limit = turning(1.0).limit_rate
    rate = limit * math.sqrt(1.0 - 1e-4)
    mesh = Mesh(turning(rate), 300, "consistent", 0.0, 2)
    found = ReducedMesh(mesh, Eigenvectors().span(mesh, 2, ()).shapes, True).frequencies
    assert found[0] == pytest.approx(limit * 1e-2, rel=1e-6)


# --- the struck rod


def inverted(term: Callable[[Any], Any], fronts: int, rate: float, t: float) -> float:
    """Return the inverse at t [s] of a term times e^fronts, e = exp(-2 kap L/c)."""
    trip = 2 * mp.mpf(L) / C
    after = mp.mpf(t) - fronts * trip
    if after <= 0:
        return 0.0
    late = lambda s: term(s) * mp.exp(-fronts * trip * (mp.sqrt(s * s - rate**2) - s))  # noqa: E731
    return float(mp.invertlaplace(late, after, method="dehoog", degree=36))


def transform(rate: float, t: float, force: bool) -> float:
    """Return the inward displacement [m] of the mass, or the force [N], at t < 2T [s]."""
    w, mu = rate * mp.mpf(L) / C, mp.mpf(Z) / M
    radius = L * mp.tan(w) / w

    def term(fronts: int) -> Callable[[Any], Any]:
        def value(s: Any) -> Any:
            kap = mp.sqrt(s * s - rate**2)
            q, start = (kap - mu) / (kap + mu), 1 - rate**2 * radius / s
            if force:
                return Z * start / (kap + mu) * (1 if fronts == 0 else 1 + q)
            return start / (kap * (kap + mu)) * (1 if fronts == 0 else q - 1)

        return value

    with mp.workdps(24):
        return inverted(term(0), 0, rate, t) + inverted(term(1), 1, rate, t)


@pytest.mark.parametrize(("rate", "opening", "velocity"), [(60.0, 1.466688, 0.710192), (100.0, 0.953207, 0.0)])
def test_a_struck_rod_follows_its_exact_transform(rate: float, opening: float, velocity: float) -> None:
    """Up to the first opening: displacement, force, and the opening itself, where the force is zero."""
    history = on_lumped_mesh(rate)
    for share in (0.1, 0.35, 0.6, 0.9):
        t = share * opening * T
        assert -history.evaluate([t], "position:hammer")[0] == pytest.approx(transform(rate, t, False), rel=1e-6)
        assert history.evaluate([t], f"force:{CONTACT}")[0] == pytest.approx(transform(rate, t, True), rel=3e-3)
    assert abs(transform(rate, opening * T, True)) < 1e-5 * Z
    assert history.contacts[0].end / T == pytest.approx(opening, abs=1e-6)
    assert history.evaluate([history.contacts[0].end], "velocity:hammer")[0] == pytest.approx(velocity, abs=2e-4)


@pytest.mark.parametrize("rate", [10.0, 60.0, 100.0])
def test_the_first_force_is_that_of_a_rod_at_rest(rate: float) -> None:
    """Z v0: the front is not dispersed."""
    assert transform(rate, 1e-9 * T, True) == pytest.approx(Z, rel=1e-7)
    made = struck(
        rate, Modal(elements=100, modes=100), Newmark(), StepRule(points_per_period=10.0), WaveIdentification()
    )
    history = run(*made)
    dt, radius = history.dt, turning(rate).steady.radii[1]
    approach = 1.0 - rate**2 * radius * dt  # at the end of the first step
    force = Z * approach / (1.0 + Z / M * dt)
    assert history.evaluate([0.5 * dt], f"force:{CONTACT}")[0] == pytest.approx(force, rel=1e-5)


def test_at_60_rad_s_there_is_one_contact() -> None:
    """Impulse 1.525873 M v0; then the mass flies outwards under the centrifugal force alone."""
    history = on_lumped_mesh(60.0)
    assert len(history.contacts) == 1
    assert history.contacts[0].impulse / M == pytest.approx(1.525873, abs=1e-6)
    flown = 4.0 * T - history.contacts[0].end
    radius = turning(60.0).steady.radii[1] + history.evaluate([history.contacts[0].end], "position:hammer")[0]
    speed = 0.7101924 * math.cosh(60.0 * flown) + 60.0 * radius * math.sinh(60.0 * flown)
    assert speed == pytest.approx(1.028695, abs=2e-6)
    moved = radius * math.cosh(60.0 * flown) + 0.7101924 / 60.0 * math.sinh(60.0 * flown)
    end = turning(60.0).steady.radii[1] + history.evaluate([4.0 * T], "position:hammer")[0]
    assert end == pytest.approx(moved, abs=1e-9)


def test_at_100_rad_s_the_centrifugal_force_makes_a_second_contact() -> None:
    """The striker is at rest as it parts; from 1.0002 to 1.3801 T it is struck again by the rod."""
    history = on_lumped_mesh(100.0)
    first, second = history.contacts
    assert (second.start / T, second.end / T) == pytest.approx((1.0002, 1.3801), abs=5e-5)
    assert (first.impulse + second.impulse) / M == pytest.approx(1.2675, abs=5e-5)
    assert history.evaluate([4.0 * T], "velocity:hammer")[0] == pytest.approx(1.664431, abs=2e-6)


def test_independent_descriptions_agree_on_the_second_contact() -> None:
    """A consistent mesh under the midpoint rule, whose velocities belong to whole steps."""
    history = run(*struck(100.0, FiniteElement(1000), Midpoint(), StepRule(courant=0.5)))
    assert sum(span.impulse for span in history.contacts) / M == pytest.approx(1.26754, abs=2e-4)
    assert history.evaluate([4.0 * T], "velocity:hammer")[0] == pytest.approx(1.664431, abs=2e-4)


def test_a_penalty_contact_agrees_between_modes_mesh_and_adaptive_steps() -> None:
    """One physics in four descriptions: closed-form modes, mesh, and a system of first order."""
    law = Penalty(1e9)
    runs = [
        run(*struck(100.0, model, integrator, StepRule(dt=dt), law, round_trips=1.0))
        for model, integrator, dt in (
            (Modal(modes=300), ExactModal(), 2e-8),
            (FiniteElement(300), Midpoint(), 2e-8),
            (FiniteElement(300, "lumped"), CentralDifference(), 2e-8),
            (FiniteElement(6, order=6), Adaptive(relative_tolerance=1e-7), 2e-7),
        )
    ]
    wanted = runs[-1].contacts[0].impulse  # so far: it is still closed
    for history, within in zip(runs, (1e-3, 1e-4, 1e-4), strict=False):
        assert history.contacts[0].impulse == pytest.approx(wanted, rel=within)
        assert history.energy.largest_gain < 1e-4


# --- masses


FLIGHTS = [(ExactModal(), 1e-13), (Newmark(), 2e-7), (CentralDifference(), 2e-7)]


@pytest.mark.parametrize(("integrator", "within"), FLIGHTS)
def test_a_free_mass_flies_out_by_hyperbolic_functions(integrator: Any, within: float) -> None:
    """r(t) = r0 cosh(Omega t) + v0/Omega sinh(Omega t)."""
    rate, radius, speed, duration = 30.0, 0.2, -1.0, 0.1
    mass = Mass("mass", 2.0, speed, rotation=Rotation(rate, -radius))
    history = run(*simulation("flight", {"mass": mass}, (), duration, integrator, StepRule(dt=2e-5)))
    t = np.linspace(0.0, duration, 11)
    wanted = radius * np.cosh(rate * t) + speed / rate * np.sinh(rate * t) - radius
    assert_allclose(history.evaluate(t, "position:mass"), wanted, atol=within * np.abs(wanted).max())
    assert history.energy.final_error < 1e-10


@pytest.mark.parametrize(("integrator", "order"), [(Midpoint(), 2.0), (Newmark(), 2.0), (CentralDifference(), 2.0)])
def test_schemes_keep_their_order_in_the_turning_frame(integrator: Any, order: float) -> None:
    law = Penalty(1e8)
    exact = run(*struck(3000.0, Modal(modes=1), ExactModal(), StepRule(dt=1e-8), law, round_trips=20.0))
    wanted, errors = exact.evaluate([exact.duration], "position:hammer")[0], []
    for dt in (2e-6, 1e-6):
        found = run(*struck(3000.0, Modal(modes=1), integrator, StepRule(dt=dt), law, round_trips=20.0))
        errors.append(abs(found.evaluate([exact.duration], "position:hammer")[0] - wanted))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


# --- symmetry and units


def test_a_mirrored_scene_gives_the_mirrored_solution() -> None:
    here = run(*struck(100.0, FiniteElement(60), Midpoint(), StepRule(courant=0.5), Penalty(1e9)))
    rod = turning(100.0, FREE, CLAMPED, L)
    hammer = Mass("hammer", M, 1.0, rotation=Rotation(100.0, -rod.steady.radii[0]))
    made = in_a_row([hammer, rod], FiniteElement(60), Penalty(1e9), Midpoint(), StepRule(courant=0.5), round_trips=4.0)
    there = run(*made)
    t = np.linspace(0.0, here.duration, 101)
    moved = here.evaluate(t, "position:hammer")
    assert_allclose(there.evaluate(t, "position:hammer"), -moved, atol=1e-9 * np.abs(moved).max())


def test_results_scale_with_units() -> None:
    """Lengths in mm and times in ms: rates 1000 times smaller, speeds the same."""
    here = struck(100.0, FiniteElement(40), Newmark(), StepRule(courant=0.5), Penalty(1e9))
    piece = replace(STEEL, length=300.0, area=9e2, young=2.1e2, density=7.9e-6)  # mm, mm2, kg/(mm ms2), kg/mm3
    rod = Rod("rod", (piece,), CLAMPED, FREE, rotation=Rotation(0.1))
    hammer = Mass("hammer", M, -1.0, rotation=Rotation(0.1, -rod.steady.radii[1]))
    there = in_a_row([rod, hammer], FiniteElement(40), Penalty(1e3), Newmark(), StepRule(courant=0.5), round_trips=4.0)
    one, other = run(*here), run(*there)
    t = np.linspace(0.0, one.duration, 51)
    moved = one.evaluate(t, "position:hammer")
    assert_allclose(other.evaluate(1e3 * t, "position:hammer"), 1e3 * moved, atol=1e-8 * np.abs(moved).max() * 1e3)


# --- damping and condensed faces


def coasting(model: Any, integrator: Any, rate: float, **given: Any) -> AbstractHistory:
    """A rod of viscous steel that swings freely while it turns, let go stretched."""
    piece = replace(STEEL, viscosity=given.pop("viscosity", 0.0))
    rod = Rod(
        "rod", (piece,), CLAMPED, FREE, displacement=lambda x: 1e-5 * x / L, rotation=Rotation(rate) if rate else None,
        **given,
    )  # fmt: skip
    made = simulation("coasting", {"rod": rod}, (), 4.0 * T, integrator, StepRule(dt=T / 2000.0), model=model)
    return run(*made)


@pytest.mark.parametrize(
    "damping", [{"viscosity": 4e5}, {"damping": Rayleigh(800.0, 2e-6)}], ids=["viscous", "rayleigh"]
)
def test_damping_of_meshes_and_modes_is_the_same_in_the_turning_frame(damping: dict[str, Any]) -> None:
    """At a rate near the limit, where the stiffness of the turning frame and the elastic one are far apart."""
    mesh = coasting(FiniteElement(60), Newmark(), 20_000.0, **dict(damping))
    modes = coasting(Modal(elements=60), Newmark(), 20_000.0, **dict(damping))
    analytic = coasting(Modal(modes=40), Newmark(), 20_000.0, **dict(damping))
    for other, within in ((modes, 1e-6), (analytic, 2e-3)):
        assert other.energy.bodies["rod"][-1] == pytest.approx(mesh.energy.bodies["rod"][-1], rel=within)
    still = coasting(FiniteElement(60), Newmark(), 0.0, **dict(damping))
    shares = [h.energy.bodies["rod"][-1] / h.energy.bodies["rod"][0] for h in (mesh, still)]
    assert abs(shares[0] - shares[1]) > 1e-3  # the rotation matters


@pytest.mark.parametrize("elements", [60, 240])
def test_a_massless_face_of_a_rod_that_turns_follows_without_inertia(elements: int) -> None:
    made = struck(100.0, FiniteElement(elements, "redistributed"), Newmark(), StepRule(courant=0.5), Penalty(1e9))
    plain = struck(100.0, FiniteElement(elements, "lumped"), Newmark(), StepRule(courant=0.5), Penalty(1e9))
    one, other = run(*made), run(*plain)
    assert one.contacts[0].impulse == pytest.approx(other.contacts[0].impulse, rel=0.2 / elements)
    assert one.energy.largest_gain < 1e-6


@given(
    rate=st.floats(1.0, 5e3), axis=st.floats(-1.0, 0.2), ratio=st.floats(0.1, 10.0), stiffness=st.floats(1e6, 1e10)
)  # fmt: skip
@settings(max_examples=12)
def test_energy_of_the_turning_frame_stays_within_the_bound(
    rate: float, axis: float, ratio: float, stiffness: float
) -> None:
    """Whatever rate, hub, striker and stiffness: relative kinetic and elastic energy, less the centrifugal part."""
    rod = turning(rate, axis=axis)
    hammer = Mass("hammer", ratio * M, -1.0, rotation=Rotation(rate, -rod.steady.radii[1]))
    for model, integrator in ((FiniteElement(20), Midpoint()), (Modal(elements=20), ExactModal())):
        made = in_a_row([rod, hammer], model, Penalty(stiffness), integrator, StepRule(courant=0.2), round_trips=2.0)
        history = run(*made)
        assert history.energy.largest_gain < 1e-6
        assert history.energy.largest_loss < 1e-6


# --- a mass that the centrifugal force presses on a rod


@pytest.mark.parametrize(
    ("integrator", "dt"), [(ExactModal(), 1e-6), (Adaptive(relative_tolerance=1e-9), 1e-5)], ids=["modes", "adaptive"]
)
def test_a_mass_is_pressed_on_by_the_centrifugal_force_alone(integrator: Any, dt: float) -> None:
    """A rod held at the rim points inwards; a mass that rests on its tip is let go, and bounces on a soft spring.

    With stiffness k and Omega^2 << k/m it sinks by 2 m Omega^2 r/k at most, in half a period; the rod hardly moves.
    """
    rate, stiffness, mass = 200.0, 1e5, 0.1
    rod = Rod("rod", (STEEL,), FREE, CLAMPED, rotation=Rotation(rate, -0.2))
    radius = rod.steady.radii[0]
    hammer = Mass("hammer", mass, 0.0, rotation=Rotation(rate, -radius))
    made = in_a_row([hammer, rod], Modal(elements=10), Penalty(stiffness), integrator, StepRule(dt=dt), duration=1.2e-2)
    history = run(*made)
    t = np.linspace(0.0, history.duration, 400)
    squared = stiffness / mass - rate**2
    wanted = rate**2 * radius / squared * (1.0 - np.cos(np.sqrt(squared) * t))
    assert_allclose(history.evaluate(t, "position:hammer"), wanted, atol=1e-3 * wanted.max())
    assert history.contacts[0].start == pytest.approx(0.0, abs=1e-6)


def test_the_error_of_a_peak_beside_a_front_is_of_second_order() -> None:
    """The force is a mean over each step: read as stairs, its value beside a front would be wrong by half a step."""
    scene = struck(60.0, FiniteElement(50, "lumped"), CentralDifference(), StepRule(courant=1.0)).scene
    exact = on_lumped_mesh(60.0, 4000)
    errors = [peak_force(on_lumped_mesh(60.0, elements), exact, scene) or 0.0 for elements in (50, 100, 200)]
    assert errors[0] < 1e-3
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]
