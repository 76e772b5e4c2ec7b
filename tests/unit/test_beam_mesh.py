"""Meshes of beams: statics, frequencies, waves; their leapfrog steps, node by node, against matrix products."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

from impactlab import simulate
from impactlab.errors import CaseError, PairingError
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import Face
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.beams import BeamMesh
from impactlab.models.modal import Modal
from impactlab.numerics.banded import full, solve
from impactlab.scene import Beam, BeamSegment, End, Probe, Rayleigh, Rotation
from impactlab.scene.method import StepRule
from impactlab.testing.scenes import simulation
from tests.reference.beam_scenes import STEEL, sheared, sphere_on_beam

FREE, CLAMPED, PINNED = End("free"), End("clamped"), End("pinned")
UNIT = BeamSegment(1.0, 1.0, 1.0, 1.0, inertia=1.0)  # beta L = sqrt(w)
EI, LENGTH = STEEL.bending_stiffness, STEEL.length
LINE_MASS = STEEL.density * STEEL.area


def mesh(left, right, segments=(STEEL,), elements=10, mass="consistent", gravity=0.0, **given):
    return BeamMesh(Beam("beam", segments, left, right, **given), elements, mass, gravity)


def frequencies(body):
    return np.sqrt(np.abs(eigh(full(body.stiffness), full(body.mass), eigvals_only=True)))


@pytest.mark.parametrize("elements", [1, 3, 20])
def test_springs_at_the_root_add_their_flexibility(elements):
    segment, k, turning = sheared(STEEL), 2e6, 5e3
    body = mesh(End("spring", k, rotational=turning), FREE, (segment,), elements)
    tip = body.static_compliance(LENGTH, "displacement", LENGTH)
    exact = LENGTH**3 / (3.0 * EI) + LENGTH / segment.shear_stiffness + 1.0 / k + LENGTH**2 / turning
    # Condition of up to twenty elements, times rounding.
    assert tip == pytest.approx(exact, rel=1e-9)
    assert body.static_compliance(0.0, "bending_moment", LENGTH) == pytest.approx(LENGTH, rel=1e-9)
    assert body.static_compliance(0.0, "shear_force", LENGTH) == pytest.approx(1.0, rel=1e-9)


def test_a_stepped_cantilever_bends_by_castigliano_s_theorem():
    root, tip = replace(STEEL, length=0.1), replace(STEEL, length=0.06, young=7e10, inertia=3e-10)
    body = mesh(CLAMPED, FREE, (root, tip), 9)
    whole = root.length + tip.length
    exact = (whole**3 - tip.length**3) / (3.0 * EI) + tip.length**3 / (3.0 * tip.bending_stiffness)
    assert body.static_compliance(whole, "displacement", whole) == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("elements", [2, 6])
def test_a_slender_beam_that_shears_does_not_lock(elements):
    slender = replace(STEEL, length=100.0 * STEEL.height)
    for segment in (sheared(slender), replace(slender, shear_stiffness=1e9 * slender.bending_stiffness)):
        one, other = (mesh(CLAMPED, FREE, (each,), elements) for each in (slender, segment))
        # Shear and rotary inertia: (1 + E/kG) r2/L2 times (beta L)^2/2 and more in the second mode.
        assert frequencies(other)[:2] == pytest.approx(frequencies(one)[:2], rel=2e-3)
        tips = [
            body.static_compliance(100.0 * STEEL.height, "displacement", 100.0 * STEEL.height) for body in (one, other)
        ]
        assert tips[1] == pytest.approx(tips[0], rel=1e-3)


@pytest.mark.parametrize("ratio", [0.1, 1.0, 10.0])
def test_a_mass_at_the_tip(ratio):
    body = mesh(CLAMPED, End("mass", ratio), (UNIT,), 20)
    beta = brentq(lambda b: char(b) + ratio * b * pull(b), 0.3, 1.9, xtol=1e-14)
    # (beta h)^4/720 in the frequency, beta h = 0.09.
    assert math.sqrt(frequencies(body)[0]) == pytest.approx(beta, rel=1e-6)


@pytest.mark.parametrize("stiffness", [0.5, 5.0, 50.0])
def test_a_spring_at_the_tip(stiffness):
    body = mesh(CLAMPED, End("spring", stiffness), (UNIT,), 20)
    beta = brentq(lambda b: char(b) - stiffness / b**3 * pull(b), 1.8, 3.95, xtol=1e-14)
    assert math.sqrt(frequencies(body)[0]) == pytest.approx(beta, rel=1e-6)


def char(b):
    return 1.0 + math.cos(b) * math.cosh(b)


def pull(b):
    return math.cos(b) * math.sinh(b) - math.sin(b) * math.cosh(b)


@pytest.mark.parametrize("of_euler", [-0.9, 1.0, 1e4])
def test_frequencies_under_an_axial_preload(of_euler):
    number = np.pi * np.arange(1, 4) / LENGTH
    tension = of_euler * EI * number[0] ** 2
    exact = np.sqrt((EI * number**4 + tension * number**2) / LINE_MASS)
    found = frequencies(mesh(PINNED, PINNED, (STEEL,), 60, tension=tension))[:3]
    # Fourth order in the mesh, ten times weaker springs near the Euler load; a string: (k h)^4/720 and the like.
    assert found == pytest.approx(exact, rel=2e-5)


def test_the_euler_load_is_the_limit_of_compression():
    euler = EI * (np.pi / LENGTH) ** 2
    mesh(PINNED, PINNED, (STEEL,), 20, tension=-0.9999 * euler)
    with pytest.raises(CaseError, match="buckles 'beam'") as error:
        mesh(PINNED, PINNED, (STEEL,), 20, tension=-1.0001 * euler)
    assert error.value.remedy
    # A free end and a clamp: a quarter of it.
    mesh(CLAMPED, FREE, (STEEL,), 20, tension=-0.2499 * euler)
    with pytest.raises(CaseError, match="buckles"):
        mesh(CLAMPED, FREE, (STEEL,), 20, tension=-0.2501 * euler)


@pytest.mark.parametrize("segment", [STEEL, sheared(STEEL)], ids=["euler_bernoulli", "timoshenko"])
@pytest.mark.parametrize(("left", "right"), [(FREE, FREE), (CLAMPED, FREE), (PINNED, PINNED)])
def test_leapfrog_is_stable_up_to_its_limit(segment, left, right):
    body = mesh(left, right, (segment,), 12, "lumped")
    system = body.operators()
    highest = frequencies(body)[-1]
    assert highest <= system.highest_frequency <= 1.6 * highest
    growth = {}
    for share in (CentralDifference().limit(system) * highest * 0.999, 2.002):
        stepper = CentralDifference().prepare(system, np.zeros((0, system.load.size)), share / highest)
        state = stepper.state.copy()
        state[: system.load.size] = 1e-6 * np.sin(np.arange(system.load.size) ** 1.5)
        for _ in range(2000):
            stepper.free(stepper.parameters, state)
        growth[share] = np.abs(state[: system.load.size]).max()
    stable, unstable = growth.values()
    assert stable < 1e-3
    assert unstable > 1.0 or not np.isfinite(unstable)


def history_of(beam, model, integrator, duration, steps, gravity=0.0):
    scene = simulation(
        "vibrating", {"beam": beam}, (), duration, integrator, StepRule(dt=duration / steps), model=model,
        gravity=gravity, round_trip=beam.round_trip, probes=(Probe("beam", 0.5 * LENGTH, "displacement"),),
    )  # fmt: skip
    history = simulate.run(*scene)
    times = np.linspace(0.0, duration, 200)
    return times, history.evaluate(times, scene.scene.probes[0].channel)


@pytest.mark.parametrize(
    ("model", "integrator"),
    [(FiniteElement(30), Newmark()), (Modal(30, 10), Newmark()), (Modal(None, 5), Newmark())],
    ids=["finite_element", "modal", "analytic"],
)
@pytest.mark.parametrize(
    "damping", [Rayleigh(mass=400.0), Rayleigh(stiffness=2e-5), None], ids=["mass", "K", "viscous"]
)
def test_a_damped_beam_decays_as_its_mode(model, integrator, damping):
    number = np.pi / LENGTH
    natural = math.sqrt(EI / LINE_MASS) * number**2
    if damping is None:
        segment, rate = replace(STEEL, viscosity=2e-5 * STEEL.young), 0.5 * 2e-5 * natural**2
        beam = Beam("beam", (segment,), PINNED, PINNED, displacement=lambda x: 1e-5 * np.sin(number * x))
    else:
        rate = 0.5 * (damping.mass + damping.stiffness * natural**2)
        beam = Beam("beam", (STEEL,), PINNED, PINNED, displacement=lambda x: 1e-5 * np.sin(number * x), damping=damping)
    duration = 3.0 * 2.0 * math.pi / natural
    times, found = history_of(beam, model, integrator, duration, 3000)
    turning = math.sqrt(natural**2 - rate**2)
    exact = 1e-5 * np.exp(-rate * times) * (np.cos(turning * times) + rate / turning * np.sin(turning * times))
    # Newmark's period error, (w dt)^2/12 = 3e-6, over three periods; straight lines between steps.
    assert np.abs(found - exact).max() < 2e-4 * 1e-5
    assert math.exp(-rate * duration) < 0.6


@pytest.mark.parametrize("elements", [1, 7])
def test_an_initial_deflection_has_its_slope_at_the_ends_too(elements):
    """A parabola, of which differences of second order are exact: to the left of an end there is no value to take."""
    beam = Beam("beam", (STEEL,), End("free"), End("free"), displacement=lambda x: 1e-3 * (x / LENGTH - 0.3) ** 2)
    mesh = BeamMesh(beam, elements, "consistent", 0.0)
    found = mesh.coordinates(beam.displacement)
    slopes = 2e-3 * (mesh.nodes / LENGTH - 0.3) / LENGTH
    assert found[1::2] == pytest.approx(slopes, rel=1e-10, abs=1e-10 * np.abs(slopes).max())


def test_viscosity_damps_the_bending_of_a_beam_under_tension_and_not_its_tension():
    """Modes took the tension for a part of the material, and the rate of decay was 4 times too large here."""
    number, tension = np.pi / LENGTH, 3.0 * EI * (np.pi / LENGTH) ** 2  # twice the frequency of the beam alone
    bending = math.sqrt(EI / LINE_MASS) * number**2
    natural, rate = 2.0 * bending, 0.5 * 2e-5 * bending**2
    segment = replace(STEEL, viscosity=2e-5 * STEEL.young)
    shape = {"tension": tension, "displacement": lambda x: 1e-5 * np.sin(number * x)}
    beam = Beam("beam", (segment,), PINNED, PINNED, **shape)
    times, found = history_of(beam, FiniteElement(30), Newmark(), 3.0 * 2.0 * math.pi / natural, 3000)
    turning = math.sqrt(natural**2 - rate**2)
    exact = 1e-5 * np.exp(-rate * times) * (np.cos(turning * times) + rate / turning * np.sin(turning * times))
    assert np.abs(found - exact).max() < 2e-4 * 1e-5
    with pytest.raises(PairingError, match="beside a tension without viscosity, it couples the modes"):
        Modal(30, 10).build_beam(beam, 0.0)


def test_under_gravity_it_comes_to_rest_in_its_static_sag():
    natural = math.sqrt(EI / LINE_MASS) * (np.pi / LENGTH) ** 2
    beam = Beam("beam", (STEEL,), PINNED, PINNED, damping=Rayleigh(mass=1.5 * natural))
    sag = -5.0 * LINE_MASS * 9.81 * LENGTH**4 / (384.0 * EI)
    body = BeamMesh(beam, 10, "consistent", -9.81)
    still = solve(body.stiffness, body.operators().load)
    assert float(body.row(0.5 * LENGTH, "displacement") @ still) == pytest.approx(sag, rel=1e-9)
    for model, integrator in ((FiniteElement(10), Newmark()), (Modal(None, 9), Newmark())):
        _, found = history_of(beam, model, integrator, 30.0 / natural, 2000, -9.81)
        # exp(-0.75 x 30) of it is left; nine modes hold 1 - 1e-5 of the sag, as k^-5.
        assert found[-1] == pytest.approx(sag, rel=2e-5)


@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
@pytest.mark.parametrize("elements", [64, None], ids=["mesh", "analytic"])
def test_modal_models_become_the_whole_mesh(theory, elements):
    segment = STEEL if theory == "euler_bernoulli" else sheared(STEEL)
    channel = "position:sphere"
    times = np.linspace(0.0, 2e-4, 100)
    whole = simulate.run(*sphere_on_beam(FiniteElement(64), Newmark(), 5e-8, segment=segment)).evaluate(times, channel)
    size, gaps = np.abs(whole).max(), []
    for modes in (1, 3, 9, 40):
        history = simulate.run(*sphere_on_beam(Modal(elements, modes), ExactModal(), 5e-8, segment=segment))
        gaps.append(np.abs(history.evaluate(times, channel) - whole).max() / size)
    assert gaps[0] > gaps[1] > gaps[2]
    # The rest is due to the scheme, and with shear the flexibility of the modes left out, which falls as their
    # number: 2/(40 pi^2) of L/4 kGA, that itself being 12 EI/(kGA L2) = 2 % of that in bending.
    assert gaps[3] < {"euler_bernoulli": 1e-4, "timoshenko": 1e-3}[theory]


ENDS = {"free": End("free"), "clamped": End("clamped"), "pinned": End("pinned"), "mass": End("mass", 0.2),
        "spring": End("spring", 3e5, rotational=2e3)}  # fmt: skip
TWO = (sheared(STEEL), replace(STEEL, length=0.07, young=7e10, inertia=4e-10))


def stepped_mesh(left, right, segments, tension=0.0, mass="lumped", damping=0.0, rotation=None):
    beam = Beam(
        "beam", segments, ENDS[left], ENDS[right], tension=tension, damping=Rayleigh(mass=damping), rotation=rotation
    )
    return BeamMesh(beam, 12, mass, 9.81)


@pytest.mark.parametrize("segments", [(STEEL,), TWO], ids=["one", "two"])
@pytest.mark.parametrize("tension", [0.0, 2e5])
@pytest.mark.parametrize(("left", "right"), zip(ENDS, [*ENDS][1:] + [*ENDS][:1], strict=True))
def test_a_leapfrog_step_is_the_matrix_product(left, right, tension, segments):
    system = stepped_mesh(left, right, segments, tension, damping=30.0).operators()
    assert len(system.beam_elements.runs) == len(segments)
    check_leapfrog(system)


HELD = [ends for ends in product(ENDS, ENDS) if "clamped" in ends or (ends == ("pinned", "spring"))]


@pytest.mark.parametrize(("plane", "damping"), [("chord", 0.0), ("flap", 30.0)])
@pytest.mark.parametrize(("left", "right"), HELD)
def test_a_leapfrog_step_of_a_beam_that_turns_is_the_matrix_product(left, right, plane, damping):
    """Of slender segments and sheared ones, far enough from the axis that the centrifugal part is a large one."""
    rotation = Rotation(2000.0, 0.25 if right == "clamped" else 0.01, plane)
    system = stepped_mesh(left, right, TWO, damping=damping, rotation=rotation).operators()
    assert len(system.beam_elements.each) > 0
    still = stepped_mesh(left, right, TWO, damping=damping).operators()
    assert np.abs(system.stiffness - still.stiffness).max() > 1e-4 * np.abs(still.stiffness).max()
    check_leapfrog(system)


def check_leapfrog(system):
    n, dt = system.load.size, 0.3 / system.highest_frequency
    stepper = CentralDifference().prepare(system, np.eye(n)[:1], dt)
    u, v = np.sin(1.0 + np.arange(n) ** 1.2), np.cos(np.arange(n) ** 1.3) / dt
    state = np.concatenate((u, v))
    stepper.free(stepper.parameters, state)
    half = 0.5 * dt * system.damping[0] / system.mass[0]
    push = dt / system.mass[0] * (system.load - full(system.stiffness) @ u)
    wanted = (v * (1.0 - half) + push) / (1.0 + half)
    # Rounding of a few products; elements are taken out of the sums of a stiffness.
    size = np.abs(v) + dt / system.mass[0] * (np.abs(full(system.stiffness)) @ np.abs(u))
    assert np.all(np.abs(state[n:] - wanted) <= 1e-13 * size)
    assert np.all(np.abs(state[:n] - u - dt * state[n:]) <= 1e-15 * (np.abs(u) + dt * np.abs(state[n:])))
    out, old = np.zeros(3), state[:n] - dt * state[n:]
    stepper.measure(stepper.parameters, state, out)
    motion = 0.5 * system.mass[0] @ state[n:] ** 2
    strain = 0.5 * old @ full(system.stiffness) @ state[:n]
    scale = motion + 0.5 * np.abs(old) @ np.abs(full(system.stiffness)) @ np.abs(state[:n])
    assert abs(out[0] - motion - strain) < 1e-13 * scale


def test_the_rounding_of_a_beam_far_from_its_start_is_little():
    body = stepped_mesh("free", "free", (STEEL,))
    system = body.operators()
    n, dt = system.load.size, 0.3 / system.highest_frequency
    still = replace_load(system)
    stepper = CentralDifference().prepare(still, np.zeros((0, n)), dt)
    away = body.coordinates(lambda x: np.full_like(x, 3.0))
    state = np.concatenate((away, np.zeros(n)))
    stepper.free(stepper.parameters, state)
    assert np.all(state[n:] == 0.0)


def replace_load(system):
    return system._replace(load=np.zeros_like(system.load))


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
@pytest.mark.parametrize(("left", "right"), [("free", "free"), ("pinned", "clamped")])
def test_a_newmark_step_solves_its_equation(left, right, mass):
    system = stepped_mesh(left, right, TWO, mass=mass).operators()
    n, dt = system.load.size, 30.0 / system.highest_frequency
    stepper = Newmark().prepare(system, np.eye(n)[:1], dt)
    mass_of, stiffness = full(system.mass), full(system.stiffness)
    u, v = 1e-3 * np.sin(1.0 + np.arange(n) ** 1.2), np.cos(np.arange(n) ** 1.3)
    state = np.concatenate((u, v))
    stepper.free(stepper.parameters, state)
    new_u, new_v = state.reshape(2, n)
    # The average acceleration is that at the mean displacement, and the one that the velocities show.
    mean, found = 0.5 * (u + new_u), (new_v - v) / dt
    left_over = mass_of @ found + stiffness @ mean - system.load
    size = np.abs(stiffness) @ np.abs(mean) + np.abs(mass_of) @ np.abs(found)
    # The condition of the matrix that is solved, 1 + (30/2)^2, times rounding.
    assert np.abs(left_over).max() < 1e-12 * size.max()
    assert new_u == pytest.approx(u + 0.5 * dt * (v + new_v), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
def test_the_shear_force_of_a_load_along_the_beam_is_right_everywhere(theory):
    """It is constant in an element, so that at a clamped end under weight it lacked half the weight of an element."""
    section = (STEEL,) if theory == "euler_bernoulli" else (sheared(STEEL),)
    body = BeamMesh(Beam("beam", section, CLAMPED, FREE, theory=theory), 10, "consistent", -9.81)
    sag = body.static(body.operators().load)
    whole = section[0].length
    weight = 9.81 * section[0].density * section[0].area
    for x in np.array([0.0, 0.02, 0.3, 0.37, 0.58, 0.96, 1.0]) * whole:
        # The part on the right of a section pulls the part on its left down by its weight.
        known = -weight * (whole - x)
        assert body.row(x, "shear_force") @ sag == pytest.approx(known, rel=1e-6, abs=1e-6 * weight * whole)


def test_the_shear_force_beside_a_contact_or_a_joint_is_that_of_its_own_side():
    """A force at an inner node makes it jump there: nothing is taken from beyond the jump."""
    face = 0.5 * LENGTH
    body = BeamMesh(Beam("beam", (STEEL,), CLAMPED, FREE), 10, "consistent", 0.0, faces=(Face(face, 0, math.inf),))
    pressed, h = body.static(body.row(face, "displacement")), LENGTH / 10
    for x, known in ((0.0, 1.0), (face - 0.1 * h, 1.0), (face, 0.0), (face + 0.1 * h, 0.0), (LENGTH, 0.0)):
        assert body.row(x, "shear_force") @ pressed == pytest.approx(known, abs=1e-9)
    joined = BeamMesh(Beam("beam", TWO, CLAMPED, FREE), 20, "consistent", 0.0)
    pressed = joined.static(joined.row(LENGTH + 0.07, "displacement"))
    for x in (0.0, 0.99 * LENGTH, LENGTH, 1.01 * LENGTH, LENGTH + 0.07):
        assert joined.row(x, "shear_force") @ pressed == pytest.approx(1.0, abs=1e-8)
