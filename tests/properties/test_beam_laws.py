"""Conservation laws of struck beams: energy, momentum, angular momentum, reciprocity, symmetry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from impactlab import simulate
from impactlab.bases.craig_bampton import CraigBampton
from impactlab.bases.ritz import Ritz
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.power_law import Hertz
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.newmark import Newmark
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.numerics.banded import multiply
from impactlab.scene import Beam, End
from impactlab.testing.trace import run_sampled, trace
from tests.reference.beam_scenes import FLAT, STEEL, sheared, sphere_on_beam

SEGMENTS = {"euler_bernoulli": STEEL, "timoshenko": sheared(STEEL)}
METHODS = {
    "finite_element, newmark": (FiniteElement(24), Newmark(), 2e-7),
    "finite_element, midpoint": (FiniteElement(17), Midpoint(), 2e-7),
    # A quarter of the stable step of equal elements: a contact may halve one.
    "lumped, central_difference": (FiniteElement(24, "lumped"), CentralDifference(), 5e-8),
    "modal": (Modal(24, 20), ExactModal(), 2e-7),
    "analytic": (Modal(None, 20), ExactModal(), 2e-7),
    "craig_bampton": (Modal(24, 20, basis=CraigBampton()), ExactModal(), 2e-7),
    "ritz": (Modal(24, 12, basis=Ritz()), ExactModal(), 2e-7),
}
KINDS = ("free", "pinned", "clamped")
LAWS = {"hertz": Hertz(FLAT), "hard": AdditionDeletion()}
chosen = {
    "theory": st.sampled_from(sorted(SEGMENTS)),
    "method": st.sampled_from(sorted(METHODS)),
    "at": st.floats(0.02, 0.98),
}


def scene_of(theory, method, at, ends, law="hertz", duration=1e-4):
    model, integrator, dt = METHODS[method]
    steps = {"ends": ends, "at": at, "law": LAWS[law], "duration": duration}
    return sphere_on_beam(model, integrator, dt, segment=SEGMENTS[theory], **steps)


@settings(max_examples=25, deadline=None)
@given(ends=st.tuples(st.sampled_from(KINDS), st.sampled_from(KINDS)), **chosen)
def test_energy_of_a_sphere_and_a_beam_is_kept(theory, method, at, ends):
    traced = trace(scene_of(theory, method, at, ends))
    book = traced.history.energy
    # The schemes keep the energy of a linear body; Hertz's spring is read at the ends of steps of 1/300 of its contact,
    # so that a force that rises by a share of its step is misjudged by its square, (pi/300)^2 of the whole.
    assert book.largest_gain < 1e-3
    assert book.largest_loss < 1e-3


@settings(max_examples=25, deadline=None)
@given(law=st.sampled_from(sorted(LAWS)), **chosen)
def test_free_beam_and_sphere_keep_momentum_and_angular_momentum(theory, method, at, law):
    scene = scene_of(theory, method, at, ("free", "free"), law)
    traced = trace(scene)
    mass = traced.plan.built["beam"].system.mass
    # Momentum of the beam along its two rigid motions, 1 and x, each as a row over the velocities of its coordinates.
    rows = []
    for motion in (np.ones_like, lambda x: x / STEEL.length):
        bodies = {**scene.scene.bodies, "beam": replace(scene.scene.bodies["beam"], displacement=motion)}
        displaced = simulate.prepare(*scene.but(bodies=bodies)).built["beam"].system.displacement
        rows.append(multiply(mass, displaced))
    sphere = scene.scene.bodies["sphere"].mass * traced.velocities("sphere")[:, 0]
    beam = traced.velocities("beam") @ np.array(rows).T
    given_to = np.column_stack((sphere, at * sphere))
    total = beam + given_to
    # A velocity is rounded once a step, over two thousand steps at most; a moment of momentum is that of coordinates
    # whose rigid motions are exact to 1e-11.
    assert np.abs(total - total[0]).max() < 1e-9 * np.abs(total[0]).max()
    assert np.abs(given_to - given_to[0]).max() > 0.1 * np.abs(given_to[0]).max()


@settings(max_examples=25, deadline=None)
@given(other=st.floats(0.02, 0.98), ends=st.tuples(st.sampled_from(KINDS), st.sampled_from(KINDS)), **chosen)
def test_responses_of_two_places_are_reciprocal(theory, method, at, other, ends):
    model, integrator, dt = METHODS[method]
    beam = Beam("beam", (SEGMENTS[theory],), End(ends[0]), End(ends[1]), theory=theory)
    if method in ("craig_bampton", "ritz"):
        model = Modal(24, 20)  # these are made for one place
    body = model.build_beam(beam, 0.0)
    system = body.operators()._replace(momentum=body.momentum_row())
    places = np.array([at, other]) * STEEL.length
    ports = np.array([body.row(float(x), "displacement") for x in places])
    stepper = integrator.prepare(system, ports, dt)
    n = system.load.size
    moved = ports @ stepper.force_response[:, :n].T
    assert moved[0, 1] == pytest.approx(moved[1, 0], rel=1e-9, abs=1e-9 * abs(moved).max())
    # Eighty free steps on, after a push in the first.
    later = []
    for response in stepper.force_response:
        state = response.copy()
        for _ in range(80):
            stepper.free(stepper.parameters, state)
        later.append(ports @ state[:n])
    assert later[0][1] == pytest.approx(later[1][0], rel=1e-7, abs=1e-9 * np.abs(later).max())


@settings(max_examples=20, deadline=None)
@given(ends=st.tuples(st.sampled_from(KINDS), st.sampled_from(KINDS)), **chosen)
def test_the_mirrored_beam_gives_the_mirrored_solution(theory, method, at, ends):
    one = run_sampled(scene_of(theory, method, at, ends))
    other = run_sampled(scene_of(theory, method, 1.0 - at, ends[::-1]))
    times = np.linspace(0.0, one.duration, 200)
    name, mirrored = (next(c for c in history.channels() if c.startswith("force")) for history in (one, other))
    force, image = one.evaluate(times, name), other.evaluate(times, mirrored)
    # Rounding alone, which a stiff spring between the same two bodies does not let grow.
    assert np.abs(force - image).max() < 1e-6 * np.abs(force).max()


@settings(max_examples=20, deadline=None)
@given(theory=st.sampled_from(sorted(SEGMENTS)), method=st.sampled_from(sorted(METHODS)), tilt=st.floats(-1.0, 1.0))
def test_a_beam_displaced_and_turned_as_a_whole_stays_so(theory, method, tilt):
    model, integrator, dt = METHODS[method]
    beam = Beam(
        "beam", (SEGMENTS[theory],), End("free"), End("free"), theory=theory,
        displacement=lambda x: 1e-3 * (1.0 + tilt * x / STEEL.length),
    )  # fmt: skip
    body = model.build_beam(beam, 0.0, ()) if method != "ritz" else Modal(24, 12).build_beam(beam, 0.0)
    system = body.operators()._replace(momentum=body.momentum_row())
    stepper = integrator.prepare(system, np.zeros((0, system.load.size)), dt)
    state = stepper.state.copy()
    for _ in range(200):
        stepper.free(stepper.parameters, state)
    for x in np.linspace(0.0, 1.0, 5) * STEEL.length:
        there = float(body.row(float(x), "displacement") @ state[: system.load.size])
        # Rounding of slopes by differences, and of elements 12 EI/h^3 stiff over two hundred steps.
        assert there == pytest.approx(1e-3 * (1.0 + tilt * x / STEEL.length), abs=1e-10)


def test_a_moving_frame_changes_nothing():
    still = scene_of("timoshenko", "finite_element, newmark", 0.3, ("free", "free"))
    bodies = dict(still.scene.bodies)
    bodies["beam"] = replace(bodies["beam"], velocity=0.5)
    bodies["sphere"] = replace(bodies["sphere"], velocity=bodies["sphere"].velocity + 0.5)
    one, other = trace(still), trace(still.but(bodies=bodies))
    # The travel, 5e-5 m, is a hundred times the indentation, and rounds it as much more.
    assert np.abs(one.forces - other.forces).max() < 1e-8 * np.abs(one.forces).max()
