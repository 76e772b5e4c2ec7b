"""Chebyshev pieces: each helper against mathematics that does not use it."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from numpy.polynomial import chebyshev

from impactlab.exact import kernel, linear
from impactlab.numerics.addresses import COMPILED
from impactlab.numerics.linear import solve_bordered


def entry(part):
    """A part of the compiled march, callable from Python."""
    return numba.njit(error_model="numpy")(part.py_func) if COMPILED else part


integrate, relax, restrict, fall = map(entry, (kernel.integrate, kernel.relax, kernel.restrict, kernel.first_crossing))
eliminate, system, recurrence = map(entry, (solve_bordered, linear.system, linear.recurrence))


def series(function, n=40):
    """Chebyshev coefficients of a function on [-1, 1], padded to the room of a piece."""
    padded = np.zeros(kernel.ROOM)
    padded[:n] = chebyshev.chebinterpolate(function, n - 1)
    return padded, n


def first_fall(f, n, floor=1e-12):
    return fall(f, n, floor, np.zeros((kernel.MAX_DEPTH, kernel.WIDTH)))


@pytest.mark.parametrize(("low", "high"), [(-1.0, 1.0), (-0.3, 0.8), (-1.0, -0.999), (0.5, 0.5 + 1e-9)])
def test_restriction_is_the_same_function(low, high):
    a, n = series(lambda x: np.exp(2 * x) * np.sin(5 * x))
    out = np.zeros(kernel.ROOM)
    m = restrict(a, n, low, high, out)
    y = np.linspace(-1, 1, 31)
    x = 0.5 * (low + high) + 0.5 * (high - low) * y
    # rounding of the summation: eps n sum |a_k|
    assert chebyshev.chebval(y, out[:m]) == pytest.approx(np.exp(2 * x) * np.sin(5 * x), abs=1e-13)


def test_integral_starts_at_its_constant_and_has_the_right_slope():
    a, n = series(np.cos)
    out = np.zeros(kernel.ROOM)
    integrate(a, n, 3.0, 0.25, out)
    x = np.linspace(-1, 1, 21)
    assert chebyshev.chebval(x, out[: n + 1]) == pytest.approx(0.25 + 3.0 * (np.sin(x) + np.sin(1.0)), abs=1e-14)


@pytest.mark.parametrize("rate", [0.0, 1e-3, 1.0, 10.0, 25.0])
def test_relaxation_towards_a_moving_load(rate):
    # y' = -rate y + rate sin(3x) + 3 cos(3x) has the solution sin(3x) + C exp(-rate (x + 1))
    b, _ = series(lambda x: rate * np.sin(3 * x) + 3 * np.cos(3 * x))
    y = np.zeros(kernel.ROOM)
    relax(rate, b, np.sin(-3.0) + 2.0, kernel.ORDER, y, np.zeros((2, kernel.ROOM)))
    x = np.linspace(-1, 1, 41)
    expected = np.sin(3 * x) + 2.0 * np.exp(-rate * (x + 1))
    assert chebyshev.chebval(x, y[: kernel.ORDER]) == pytest.approx(expected, abs=5e-15 * (1 + rate))


@pytest.mark.parametrize("omega", [0.5, 5.0, 12.0])
def test_coupled_system_swings(omega):
    # x'' = -omega^2 x as a system; x(-1) = 1, x'(-1) = 0
    a = np.array([[0.0, omega], [-omega, 0.0]])
    y = np.zeros((2, kernel.ORDER))
    system(a, np.zeros((2, kernel.ORDER)), 2, np.array([1.0, 0.0]), kernel.ORDER, y)
    x = np.linspace(-1, 1, 33)
    assert chebyshev.chebval(x, y[0]) == pytest.approx(np.cos(omega * (x + 1)), abs=2e-13)


@pytest.mark.parametrize("rate", [0.0, 1.0, 25.0])
@pytest.mark.parametrize("omega", [0.5, 1.5])
def test_the_recurrence_solves_a_damped_swing_under_a_load(rate, omega):
    # y' = a y + b with y = (cos(2x), sin(5x)) + what dies out as exp(-rate t) while it turns with omega
    a = np.array([[-rate, omega], [-omega, -rate]])

    def load(x, i):
        y = np.array([np.cos(2 * x), np.sin(5 * x)])
        rates = np.array([-2 * np.sin(2 * x), 5 * np.cos(5 * x)])
        return rates[i] - a[i] @ y

    b = np.array([series(lambda x, i=i: load(x, i))[0][: kernel.ORDER] for i in range(2)])
    first = np.array([np.cos(2.0) + 1.0, np.sin(-5.0)])
    y = np.zeros((2, kernel.ORDER))
    assert recurrence(a, b, 2, first, kernel.ORDER, y)
    x = np.linspace(-1, 1, 33)
    t = x + 1
    dying = np.exp(-rate * t) * np.array([np.cos(omega * t), -np.sin(omega * t)])
    for i, steady in enumerate((np.cos(2 * x), np.sin(5 * x))):
        # blocks of entries up to 8 may cost a digit; the load holds rate times what remains
        assert chebyshev.chebval(x, y[i]) == pytest.approx(steady + dying[i], abs=1e-14 * (1 + rate))


@pytest.mark.parametrize("swing", [2.404825557695773, 5.520078110286311])
def test_the_recurrence_is_left_where_it_would_lose_digits(swing):
    """Of exp(i swing x) the coefficient of T0 is J0(swing), which is zero there: no other can be told by it."""
    a = np.array([[0.0, swing], [-swing, 0.0]])
    y = np.zeros((2, kernel.ORDER))
    assert not recurrence(a, np.zeros((2, kernel.ORDER)), 2, np.array([1.0, 0.0]), kernel.ORDER, y)


def test_first_of_many_zeros_is_found():
    f, n = series(lambda x: np.cos(9 * (x + 1)), 60)
    assert first_fall(f, n) == pytest.approx(np.pi / 18 - 1, abs=1e-14)


def test_two_zeros_closer_than_any_sampling():
    # a dip of depth 1e-10 over a width of 2e-5: sampling on any usual grid misses it
    f, n = series(lambda x: (x - 0.31) ** 2 - 1e-10, 5)
    assert first_fall(f, n) == pytest.approx(0.31 - 1e-5, abs=1e-9)


def test_grazing_minimum_above_zero_is_no_fall():
    f, n = series(lambda x: (x - 0.31) ** 2 + 1e-10, 5)
    assert first_fall(f, n) == 2.0


def test_noise_is_no_fall_but_a_real_fall_from_zero_starts_at_once():
    f, n = series(lambda x: -1e-13 * np.cos(7 * x))
    assert first_fall(f, n) == 2.0
    f, n = series(lambda x: -(x + 1.0))
    assert first_fall(f, n) == pytest.approx(-1.0, abs=1e-12)


def test_rise_from_zero_then_fall():
    # a cubic start, as a gap has after an opening
    f, n = series(lambda x: (x + 1) ** 3 * (0.5 - x))
    assert first_fall(f, n) == pytest.approx(0.5, abs=1e-14)


def test_elimination_with_full_last_rows():
    rng = np.random.default_rng(1)
    size, band = 12, 3
    matrix = np.zeros((size, size))
    for i in range(size - 2):
        for k in range(max(0, i - band), min(size, i + band + 1)):
            matrix[i, k] = rng.normal()
    matrix[-2:] = rng.normal(size=(2, size))
    right = rng.normal(size=(size, 2))
    w = np.hstack([matrix, right])
    eliminate(w, size, size + 2, band + 1, 2)
    assert matrix @ w[:, size:] == pytest.approx(right, abs=1e-11)
