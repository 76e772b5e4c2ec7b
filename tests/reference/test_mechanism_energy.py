"""The leading term of the energy that a step of a mechanism adds, as docs/mechanisms.md derives it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from impactlab.mechanisms.model import stepper_of
from impactlab.numerics.addresses import DERIVE, FREE, MEASURE, entered, kernel_address
from impactlab.testing.contracts import EquationsContract
from impactlab.testing.contracts.mechanisms import GRAVITY, moved
from tests.contracts import test_mechanisms as chains

POINTS = 7  # of the polynomial through the terms along the path of a step
REACH = 20.0  # steps to either side, so that third derivatives are far above rounding
CASES = [
    (chains.TestRigidLinks, 0.3),
    (chains.TestRigidLinksOnASlide, 0.1),
    (chains.TestABeamOnAHubAndALinkClampedToIt, 0.01),
]


def derivatives(contract: EquationsContract, p: np.ndarray, v: np.ndarray, a: np.ndarray, h: float) -> np.ndarray:
    """Return a M' a, v M'' a, v M''' v and W''', primes along the path p + s v [W]."""
    motion, x = contract.motion(), np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
    found = [contract.taken(motion, p + REACH * h * each * v, v) for each in x]
    values = [(a @ each.mass @ a, v @ each.mass @ a, v @ each.mass @ v, each.values[-1]) for each in found]
    powers = np.linalg.solve(np.vander(x, POINTS, increasing=True), np.array(values))
    orders = np.array([1, 2, 3, 3])
    factors = np.array([math.factorial(order) for order in orders]) / (REACH * h) ** orders
    return np.array(powers[orders, np.arange(4)] * factors)


def errors(contract: EquationsContract, duration: float, steps: int) -> tuple[float, float]:
    """Return the energy that free motion gains [J], and the largest difference of it from the leading term."""
    motion, h = contract.motion(), duration / steps
    n, r = motion.position.size, len(contract.part.readings)
    stepper = stepper_of(contract.part, motion, np.zeros((0, 0)), h)
    addresses = [kernel_address(*each) for each in ((stepper.free, FREE), (stepper.derive, DERIVE))]
    addresses.append(kernel_address(stepper.measure, MEASURE))
    state, book = stepper.state, np.zeros((1, 3))
    gained, expected, worst, start = 0.0, 0.0, 0.0, math.nan
    for step in range(steps):
        before, rates = state[:n].copy(), state[n + r : 2 * n + r].copy()
        entered(moved, *addresses, stepper.parameters, state, book)
        after, faster = state[:n], state[n + r : 2 * n + r]
        if step == 0:  # energy is known from its end on
            start = book[0, 0] - book[0, 1]
            continue
        slopes = derivatives(contract, 0.5 * (before + after), 0.5 * (rates + faster), (faster - rates) / h, h)
        expected += h**3 * float(slopes @ (1.0 / 8.0, 1.0 / 8.0, 1.0 / 48.0, -1.0 / 24.0))
        gained = book[0, 0] - book[0, 1] - start
        worst = max(worst, abs(gained - expected))
    return gained, worst


@pytest.mark.parametrize(("contract", "duration"), CASES, ids=lambda each: getattr(each, "__name__", None))
def test_a_step_adds_the_energy_of_its_leading_term(contract: type[EquationsContract], duration: float) -> None:
    """Of second order in the step over a motion; the rest, of the predicted middles, is of third."""
    assert any(GRAVITY)
    (coarse, rest), (fine, finer) = (errors(contract(), duration, steps) for steps in (200, 400))
    assert coarse / fine == pytest.approx(4.0, rel=0.15)
    assert rest / finer == pytest.approx(8.0, rel=0.05)
    assert finer < 0.15 * abs(fine)
