"""The leapfrog step of a chain in one pass: runs of equal nodes against the same step node by node, and its energy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from impactlab.integrators import central_difference
from impactlab.integrators.chain_steps import measure_chain, runs_of, step_chain
from impactlab.numerics.compiling import ENTRY

Step, Measure = Callable[..., None], Callable[..., tuple[float, float]]
PIECES = st.lists(
    st.tuples(st.integers(1, 30), st.floats(0.5, 2.0), st.floats(0.5, 2.0)), min_size=1, max_size=4
)  # elements, stiffness, mass


@ENTRY
def step_compiled(runs, gain, chain, dt, u, v):  # type: ignore[no-untyped-def]
    """Call the compiled step, which compiled code alone calls: from Python it is a plain function."""
    step_chain(runs, gain, chain, dt, u, v)


@ENTRY
def measure_compiled(runs, mass, chain, dt, u, v):  # type: ignore[no-untyped-def]
    """Return the energy and momentum that compiled code finds."""
    return measure_chain(runs, mass, chain, dt, u, v)


def chain_of(pieces: list[tuple[int, float, float]], seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return lumped masses (n,) and springs (n + 1,), those to the ground first and last."""
    springs = np.concatenate([np.full(count, k) for count, k, _ in pieces])
    masses = np.zeros(springs.size + 1)
    each = np.concatenate([np.full(count, m) for count, _, m in pieces])
    masses[:-1] += 0.5 * each
    masses[1:] += 0.5 * each
    ends = np.random.default_rng(seed).choice([0.0, 1.0], 2)
    return masses, np.concatenate((ends[:1], springs, ends[1:]))


@pytest.mark.parametrize(
    ("step", "measure"), [(step_chain, measure_chain), (step_compiled, measure_compiled)], ids=["plain", "compiled"]
)
@given(pieces=PIECES, seed=st.integers(0, 2**31))
def test_one_pass_is_the_step_of_the_matrix(
    step: Step, measure: Measure, pieces: list[tuple[int, float, float]], seed: int
) -> None:
    mass, chain = chain_of(pieces, seed)
    generator, dt = np.random.default_rng(seed), 0.3
    u, v = generator.standard_normal((2, mass.size))
    stiffness = np.diag(chain[:-1] + chain[1:]) - np.diag(chain[1:-1], 1) - np.diag(chain[1:-1], -1)
    rate = v - dt / mass * (stiffness @ u)
    moved = u + dt * rate
    step(runs_of(dt / mass, chain, mass), dt / mass, chain, dt, x := u.copy(), y := v.copy())
    assert np.allclose(y, rate, rtol=0.0, atol=1e-13)
    assert np.allclose(x, moved, rtol=0.0, atol=1e-13)
    energy, momentum = measure(runs_of(dt / mass, chain, mass), mass, chain, dt, x, y)
    assert energy == pytest.approx(float(y @ (mass * y) + u @ stiffness @ x), rel=1e-12, abs=1e-12)
    assert momentum == pytest.approx(float(mass @ y), rel=1e-12, abs=1e-12)


def test_a_uniform_rod_is_one_run() -> None:
    mass = np.full(40, 2.0)
    mass[0] = mass[-1] = 1.0
    chain = np.concatenate(([0.0], np.full(39, 3.0), [0.0]))
    runs = runs_of(0.1 / mass, chain, mass)
    assert runs.tolist() == pytest.approx([38.0, 0.15])


def test_a_change_of_section_at_equal_wave_speed_ends_a_run() -> None:
    mass, chain = chain_of([(20, 1.0, 1.0), (20, 3.0, 3.0)], 0)
    runs = runs_of(0.1 / mass, chain, mass).reshape(-1, 2)
    assert runs[:, 0].sum() == mass.size - 2
    assert (runs[:, 1] != 0.0).sum() == 2
    assert runs[1].tolist() == [1.0, 0.0]  # the node between


@given(velocity=st.floats(-5.0, 5.0), load=st.floats(-50.0, 50.0), mass=st.floats(0.1, 10.0), dt=st.floats(1e-6, 1e-2))
def test_a_rigid_body_steps_as_a_mesh_of_one_node(velocity: float, load: float, mass: float, dt: float) -> None:
    scheme = central_difference
    header = np.zeros(scheme.LOAD)
    header[[scheme.N, scheme.DT, scheme.LUMPED, scheme.LOADED]] = 1.0, dt, 1.0, float(load != 0.0)
    parameters = np.concatenate((header, [load, dt / mass], np.zeros(2), [1.0, 0.0, mass]))
    states = np.array([[0.2, velocity], [0.2, velocity]])
    energies = np.zeros((2, 3))
    for state, out, free, measure in (
        (states[0], energies[0], scheme.free, scheme.measure),
        (states[1], energies[1], scheme.free_rigid, scheme.measure_rigid),
    ):
        for _ in range(3):
            free(parameters, state)
        measure(parameters, state, out)
    assert states[1] == pytest.approx(states[0], rel=1e-14, abs=1e-14)
    assert energies[1] == pytest.approx(energies[0], rel=1e-14, abs=1e-14)
    assert states[1, 1] == pytest.approx(velocity + 3.0 * dt * load / mass, rel=1e-13, abs=1e-13)
