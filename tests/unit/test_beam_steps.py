"""The leapfrog step of beams, node by node, against matrix products."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.newmark import Newmark
from impactlab.models.mesh.beams import BeamMesh
from impactlab.numerics.banded import full
from impactlab.scene import Beam, End, Rayleigh
from tests.reference.beam_scenes import STEEL, sheared

ENDS = {"free": End("free"), "clamped": End("clamped"), "pinned": End("pinned"), "mass": End("mass", 0.2),
        "spring": End("spring", 3e5, rotational=2e3)}  # fmt: skip
TWO = (sheared(STEEL), replace(STEEL, length=0.07, young=7e10, inertia=4e-10))


def mesh(left, right, segments, tension=0.0, mass="lumped", damping=0.0):
    beam = Beam("beam", segments, ENDS[left], ENDS[right], tension=tension, damping=Rayleigh(mass=damping))
    return BeamMesh(beam, 12, mass, 9.81)


@pytest.mark.parametrize("segments", [(STEEL,), TWO], ids=["one", "two"])
@pytest.mark.parametrize("tension", [0.0, 2e5])
@pytest.mark.parametrize(("left", "right"), list(product(ENDS, ENDS)))
def test_a_leapfrog_step_is_the_matrix_product(left, right, tension, segments):
    system = mesh(left, right, segments, tension, damping=30.0).operators()
    assert len(system.beam_elements.runs) == len(segments)
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


def test_far_from_where_it_began_a_beam_feels_little_rounding():
    body = mesh("free", "free", (STEEL,))
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
    system = mesh(left, right, TWO, mass=mass).operators()
    n, dt = system.load.size, 30.0 / system.highest_frequency
    stepper = Newmark().prepare(system, np.eye(n)[:1], dt)
    mass_of, stiffness = full(system.mass), full(system.stiffness)
    u, v = 1e-3 * np.sin(1.0 + np.arange(n) ** 1.2), np.cos(np.arange(n) ** 1.3)
    a = np.linalg.solve(mass_of, system.load - stiffness @ u)
    state = np.concatenate((u, v, a))
    stepper.free(stepper.parameters, state)
    new_u, new_v, new_a = state.reshape(3, n)
    left_over = mass_of @ new_a + stiffness @ new_u - system.load
    size = np.abs(stiffness) @ np.abs(new_u) + np.abs(mass_of) @ np.abs(new_a)
    # The condition of the matrix that is solved, 1 + (30/2)^2, times rounding.
    assert np.abs(left_over).max() < 1e-12 * size.max()
    assert new_u == pytest.approx(u + dt * v + 0.25 * dt**2 * (a + new_a), rel=1e-12, abs=1e-15)
    assert new_v == pytest.approx(v + 0.5 * dt * (a + new_a), rel=1e-12, abs=1e-9)
