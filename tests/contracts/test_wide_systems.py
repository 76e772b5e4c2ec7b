"""The contract of integrators on bodies whose mass and stiffness couple more than neighbours."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from scipy.linalg import eigh

from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.bathe import Bathe
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.hht_alpha import HhtAlpha
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import Operators
from impactlab.numerics.banded import full
from impactlab.testing.contracts import IntegratorContract


class WideSystem:
    """For a contract on a rod of four elements with three nodes each: bandwidth 2, mass consistent or lumped."""

    part: ClassVar[AbstractIntegrator]

    def system(self) -> Operators:
        n, lumped = 9, self.part.needs_diagonal_mass
        stiffness, mass = np.zeros((3, n)), np.zeros((3, n))
        of_element = np.array([[7.0, -8.0, 1.0], [-8.0, 16.0, -8.0], [1.0, -8.0, 7.0]]) / 3.0 * 4e8
        heavy = np.array([[4.0, 2.0, -1.0], [2.0, 16.0, 2.0], [-1.0, 2.0, 4.0]]) / 30.0 * 0.5
        heavy = np.diag(heavy.sum(axis=1)) if lumped else heavy
        for first in range(0, n - 1, 2):
            for k in range(3):
                for i in range(3 - k):
                    stiffness[k, first + i] += of_element[i + k, i]
                    mass[k, first + i] += heavy[i + k, i]
        stiffness[0, -1] += 1e8  # a spring holds its end
        none = np.zeros(n)
        system = Operators(mass, np.zeros((1, n)), stiffness, none, none, none, 0.0, 0.0, lumped, False)
        highest = float(np.sqrt(eigh(full(stiffness), full(mass), eigvals_only=True)[-1]))
        return system._replace(highest_frequency=highest, rule_frequency=highest, mass=mass[:1] if lumped else mass)


class TestWideNewmark(WideSystem, IntegratorContract):
    part = Newmark()


class TestWideCentralDifference(WideSystem, IntegratorContract):
    part = CentralDifference()


class TestWideMidpoint(WideSystem, IntegratorContract):
    part = Midpoint()


class TestWideHhtAlpha(WideSystem, IntegratorContract):
    part = HhtAlpha()


class TestWideBathe(WideSystem, IntegratorContract):
    part = Bathe()
