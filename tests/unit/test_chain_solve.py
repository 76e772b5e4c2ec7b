"""Tridiagonal systems solved eight rows at a time, against a dense solve; their runs, and forces along these."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from impactlab.numerics import chain_solve, lanes
from impactlab.numerics.banded import full
from impactlab.numerics.banded_kernels import factorise, solve
from impactlab.numerics.chain_forces import write_chain_forces
from impactlab.numerics.compiling import plain
from impactlab.types import Array

PIECES = st.lists(
    st.tuples(st.integers(1, 90), st.floats(0.5, 2.0), st.floats(0.5, 2.0)), min_size=1, max_size=4
)  # elements, stiffness, mass
STEPS = st.sampled_from([0.1, 1.0, 10.0, 300.0])  # over the time of a wave through one element


def rod(pieces: list[tuple[int, float, float]], ground: float) -> tuple[Array, Array]:
    """Return lumped masses (n,) and springs to the ground, then bands (2 n,); the last node may be tied."""
    each = np.concatenate([np.full(count, k) for count, k, _ in pieces])
    masses = np.concatenate([np.full(count, 0.5 * m) for count, _, m in pieces])
    mass = np.append(masses, 0.0) + np.append(0.0, masses)
    return mass, np.concatenate((np.zeros(each.size), [ground], -each, [0.0]))


def matrix_of(mass: Array, springs: Array, dt: float) -> Array:
    """Return M + dt^2 K/4, lower banded."""
    n = mass.size
    stiffness = springs[:n] - springs[n:]
    stiffness[1:] -= springs[n:-1]
    return np.array((mass + 0.25 * dt**2 * stiffness, 0.25 * dt**2 * springs[n:]))


def factors_of(banded: Array, springs: Array) -> Array:
    found = np.concatenate((banded.ravel(), np.zeros(banded.shape[1])))
    factorise(banded.shape[1], 1, found, springs)
    return found


@given(PIECES, STEPS, st.integers(0, 2**31), st.sampled_from([0.0, 1.0]))
def test_a_chain_is_solved_as_the_dense_matrix(
    pieces: list[tuple[int, float, float]], dt: float, seed: int, ground: float
) -> None:
    mass, springs = rod(pieces, ground)
    banded = matrix_of(mass, springs, dt)
    given_x = np.random.default_rng(seed).standard_normal(mass.size)
    solve(mass.size, 1, factors_of(banded, springs), x := given_x.copy())
    size = np.abs(full(banded)).max() * np.abs(x).max()
    assert np.abs(full(banded) @ x - given_x).max() <= 2e-15 * size * np.sqrt(mass.size)


@given(PIECES, st.integers(0, 2**31))
def test_forces_along_the_runs_are_those_of_the_matrix(pieces: list[tuple[int, float, float]], seed: int) -> None:
    mass, springs = rod(pieces, 1.0)
    n = mass.size
    factors, u = factors_of(matrix_of(mass, springs, 1.0), springs), np.random.default_rng(seed).standard_normal(n)
    force = np.full(n, np.nan)
    write_chain_forces(springs, factors[2 * n :].copy(), u, force)
    stiffness = matrix_of(np.zeros(n), springs, 2.0)
    assert np.abs(force + full(stiffness) @ u).max() <= 1e-14
    write_chain_forces(springs, factors[2 * n :].copy(), np.full(n, 1e9), force)
    assert np.abs(force[:-1]).max() == 0.0  # travel alone stretches no spring


def test_a_uniform_rod_is_one_run_of_equal_rows_between_its_ends() -> None:
    mass, springs = rod([(400, 1.0, 1.0)], 1.0)
    runs = factors_of(matrix_of(mass, springs, 1.0), springs)[2 * mass.size :]
    count = int(runs[0])
    assert runs[1 : 1 + count].tolist() == [-11.0, 389.0, -1.0]


def test_a_step_in_the_section_ends_a_run_and_no_row_is_lost() -> None:
    mass, springs = rod([(200, 1.0, 1.0), (200, 3.0, 3.0), (20, 1.0, 1.0)], 0.0)
    runs = factors_of(matrix_of(mass, springs, 1.0), springs)[2 * mass.size :]
    rows = runs[1 : 1 + int(runs[0])]
    assert np.abs(rows).sum() == mass.size
    assert (rows > 0.0).sum() == 2
    assert (rows[::2] < 0.0).all()


def test_equal_factors_over_springs_that_differ_are_no_run() -> None:
    mass, springs = rod([(400, 1.0, 1.0)], 1.0)
    banded, uneven = matrix_of(mass, springs, 1.0), springs.copy()
    uneven[200] = 1e-3
    runs = factors_of(banded, uneven)[2 * mass.size :]
    assert (runs[1 : 1 + int(runs[0])] > 0.0).sum() == 2


@pytest.mark.parametrize("n", [2, 3, 8, 9, 10, 17, 60])
def test_plain_python_solves_as_the_compiled_code_does(n: int) -> None:
    mass, springs = rod([(n - 1, 1.0, 1.0)], 1.0)
    factors, x = factors_of(matrix_of(mass, springs, 1.0), springs), np.linspace(-1.0, 2.0, n)
    pivot, lower = factors[:n].copy(), factors[n : 2 * n].copy()
    chain_solve.solve_chain(pivot, lower, factors[2 * n :].copy(), compiled := x.copy())
    after, before = x.copy(), x.copy()
    plain(chain_solve.forward_each)(n - 1, lower, before[0], before[1:])
    plain(chain_solve.back_each)(n, lower, pivot, 0.0, before)
    assert before == pytest.approx(compiled, rel=1e-14)
    plain(chain_solve.forward_even)(n, 0.2, 0.5, after)
    value, even = 0.5, []
    for each in x:
        value = each + 0.2 * value
        even.append(value)
    assert after == pytest.approx(even, rel=1e-14)


def test_lanes_in_plain_python_are_eight_values() -> None:
    values = np.arange(10.0)
    one = lanes.lanes_at(values, 1)
    assert lanes.later_two(one).tolist() == [0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert lanes.earlier_four(one).tolist() == [5.0, 6.0, 7.0, 8.0, 0.0, 0.0, 0.0, 0.0]
    assert (lanes.first_lane(lanes.all_last(one)), lanes.first_lane(lanes.all_first(one))) == (8.0, 1.0)
    assert lanes.swapped(one).tolist() == [2.0, 1.0, 4.0, 3.0, 6.0, 5.0, 8.0, 7.0]
    assert lanes.before_first(one, lanes.all_lanes(9.0)).tolist() == [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]
    assert lanes.larger_lanes(one, lanes.all_lanes(4.0)).tolist() == [4.0, 4.0, 4.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    assert lanes.lanes_above(one, lanes.all_lanes(6.0)) == 64 + 128
    assert lanes.roots_of_lanes(lanes.all_lanes(9.0)).tolist() == 8 * [3.0]
    assert lanes.lanes_of_pairs(1.0, 2.0).tolist() == 4 * [1.0, 2.0]
    lanes.put_lanes(values, 2, lanes.all_lanes(7.0))
    assert values.tolist() == [0.0, 1.0] + 8 * [7.0]
