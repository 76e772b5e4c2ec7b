"""Factors of the leapfrog step in compiled code: bit by bit those of the formulas in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from impactlab.integrators.central_difference import CentralDifference, split
from impactlab.integrators.chain_steps import MIN_RUN, runs_of
from impactlab.integrators.leapfrog_factors import DAMPED, GROUNDED, LOAD, LOADED, RARE
from impactlab.models.base import Operators
from impactlab.numerics.banded import multiply
from impactlab.numerics.chain_solve import SAME_TOL


def body_of(n: int, bands: int, seed: int, damped: bool, loaded: bool, bent: bool) -> Operators:
    """Return a body of lumped mass with a stiffness of some bands below its diagonal."""
    draw = np.random.default_rng(seed)
    stiffness = np.zeros((bands + 1, n))
    for offset in range(1, bands + 1):
        stiffness[offset, : max(0, n - offset)] = -draw.random(max(0, n - offset))
    ground = draw.choice([0.0, 0.3], n)
    stiffness[0] = ground - multiply(np.vstack((np.zeros(n), stiffness[1:])), np.ones(n)) if n > 1 else ground
    return Operators(
        mass=1.0 + draw.random((1, n)),
        damping=0.1 * draw.random((1, n)) if damped else np.zeros((1, n)),
        stiffness=stiffness,
        load=draw.random(n) if loaded else np.zeros(n),
        displacement=draw.random(n) if bent else np.zeros(n),
        velocity=draw.random(n),
        highest_frequency=2.0,
        rule_frequency=2.0,
        diagonal_mass=True,
        modes=False,
        ground_springs=ground,
    )


@pytest.mark.parametrize(("n", "bands"), [(1, 0), (1, 1), (2, 1), (9, 1), (40, 1), (9, 3)])
@pytest.mark.parametrize("damped", [False, True])
@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize("bent", [False, True])
def test_parameters_and_state_are_those_of_the_formulas(
    n: int, bands: int, damped: bool, loaded: bool, bent: bool
) -> None:
    system, dt = body_of(n, bands, 7, damped, loaded, bent), 0.37
    step = CentralDifference().step(system, dt)
    mass, damping = system.mass[0], system.damping[0]
    half = 0.5 * dt * damping / mass
    gain, keep = (dt / mass / (1.0 + half), (1.0 - half) / (1.0 + half)) if damped else (dt / mass, np.ones(n))
    force = system.load - damping * system.velocity if damped else system.load
    force = force - multiply(system.stiffness, system.displacement) if bent else force
    velocity = system.velocity - 0.5 * dt * force / mass
    assert step.state.tobytes() == np.concatenate((system.displacement, velocity)).tobytes()
    load, found_gain, chain, found_keep, ground, found_mass, rest = split(step.parameters)
    pairs = ((load, system.load), (found_gain, gain), (found_keep, keep), (found_mass, mass))
    assert all(found.tobytes() == each.tobytes() for found, each in pairs)
    assert system.ground_springs is not None
    if bands == 1 and n > 1:
        ends = system.ground_springs[[0, -1]]
        assert chain.tolist() == [ends[0], *(-system.stiffness[1, :-1]), ends[1]]
        assert ground.tolist() == [0.0, *system.ground_springs[1:-1], 0.0]
        assert rest.tolist() == runs_of(gain, chain, mass).tolist()
    else:
        assert ground.tolist() == system.ground_springs.tolist()
        assert rest.tolist() == system.stiffness[1:].ravel().tolist()
    grounded = bool(ground.any())
    assert step.parameters[[DAMPED, GROUNDED, RARE, LOADED]].tolist() == [damped, grounded, damped or grounded, loaded]
    assert step.load == slice(LOADED, LOAD + n)


def runs_by_numpy(gain: np.ndarray, chain: np.ndarray, mass: np.ndarray) -> list[list[float]]:
    """Return the runs of a chain: neighbours with equal factor and mass, up to rounding, belong to one."""
    left, right = (gain * chain[:-1])[1:-1], (gain * chain[1:])[1:-1]
    even = np.abs(right - left) <= SAME_TOL * np.abs(left)
    joins = even[1:] & even[:-1] & (np.abs(np.diff(left)) <= SAME_TOL * np.abs(left[1:]))
    joins &= np.abs(np.diff(mass[1:-1])) <= SAME_TOL * mass[2:-1]
    found: list[list[float]] = []
    for part in np.split(np.arange(left.size), np.flatnonzero(~joins) + 1):
        factor = float(left[part[0]]) if part.size >= MIN_RUN else 0.0
        if factor == 0.0 and found and found[-1][1] == 0.0:
            found[-1][0] += part.size
        else:
            found.append([part.size, factor])
    return found


@given(
    st.lists(st.tuples(st.integers(1, 20), st.sampled_from([0.0, 1.0, 3.0])), min_size=1, max_size=6),
    st.lists(st.tuples(st.integers(1, 20), st.sampled_from([1.0, 1.0 + 2.0**-52, 2.0])), min_size=1, max_size=6),
)
def test_runs_are_those_found_by_comparing_arrays(
    springs: list[tuple[int, float]], masses: list[tuple[int, float]]
) -> None:
    chain = np.concatenate([np.full(count, value) for count, value in springs])
    mass = np.concatenate([np.full(count, value) for count, value in masses])
    n = min(chain.size - 1, mass.size)
    if n < 3:
        return
    chain, mass = chain[: n + 1], mass[:n]
    assert runs_of(0.1 / mass, chain, mass).reshape(-1, 2).tolist() == runs_by_numpy(0.1 / mass, chain, mass)


def test_a_chain_of_two_nodes_has_no_runs() -> None:
    assert runs_of(np.ones(2), np.ones(3), np.ones(2)).size == 0
