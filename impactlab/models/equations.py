"""Equations of motion of bodies at one instant, as an adaptive scheme integrates them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import NamedTuple, final

import numpy as np

from impactlab.types import Array


class Balance(NamedTuple):
    """Energies and momenta of bodies at one instant, in the order of their parts."""

    energies: Array  # (n_bodies,) J
    momenta: Array  # (n_bodies,) N s
    work: float  # J so far, of loads and drives
    lost: tuple[float, float] = (0.0, 0.0)  # J so far, in dashpots at ends and inside bodies


class AbstractEquations(ABC):
    """Equations of motion of one or more bodies, for adaptive schemes.

    They give the accelerations that follow from a state, and powers beside them. The state is the position p and its
    rates v, (n,) each. Rows of faces and probes are over the displacements, which follow from the position. To write
    one, supply the methods without a default here.
    """

    parts: Mapping[str, slice]  # of each body, in the displacements
    n_dof: int  # displacements
    position: Array  # (n,) at t = 0
    velocity: Array  # (n,) at t = 0
    powers: int = 0  # numbers beside the accelerations; `balance` takes their integrals

    @abstractmethod
    def at(self, time: float, p: Array, v: Array) -> tuple[Array, Array, Array]:
        """Return displacements, velocities and forces along the displacements, (n_dof,) each, at an instant.

        The caller adds the forces of contacts to the last of these before `accelerations`.
        """

    @abstractmethod
    def accelerations(self, time: float, v: Array, forces: Array) -> tuple[Array, Array]:
        """Return accelerations (n,) and powers [W] at the instant of the last `at`."""

    @abstractmethod
    def motion(self, p: Array, v: Array) -> tuple[Array, Array]:
        """Return displacements and velocities, (n_dof,) or (n_dof, n_times), of states (n,) or (n, n_times)."""

    @abstractmethod
    def balance(self, p: Array, v: Array, integrals: Array) -> Balance:
        """Return energies and momenta of a state.

        ``integrals`` are those of the powers so far [J].
        """

    @abstractmethod
    def shares(self, masses: Mapping[str, float]) -> Array:
        """Return the rate of each coordinate per speed of its body, (n,).

        ``masses`` are those of moving bodies [kg].
        """

    def placed(self) -> Array:
        """Return the displacements (n_dof,) at t = 0 from which gaps are counted: zero."""
        return np.zeros(self.n_dof)

    def second_rates(self, p: Array, v: Array, a: Array) -> Array:
        """Return the second time derivatives of the displacements (n_dof,), of accelerations: these, as here."""
        return a

    def speed(self, masses: Mapping[str, float], duration: float) -> float:
        """Return the speed [m/s] that own loads and drives give in a time: 0.

        ``duration`` is that time [s].
        """
        return 0.0

    def moments(self, times: Array, p: Array, v: Array, forces: Array) -> dict[str, Array]:
        """Return the moments of drives by body, (n_drives, n_times) [N m].

        ``forces`` are those of contacts, (n_dof, n_times) [N].
        """
        return {}


class EquationRange(NamedTuple):
    """Where one of several equations stands."""

    state: slice  # in positions and their rates
    moved: slice  # in the displacements
    powers: slice


@final
class SeveralEquations(AbstractEquations):
    """Equations of bodies that only contacts couple, one after the other."""

    def __init__(self, each: Sequence[AbstractEquations]) -> None:
        self._each: list[tuple[AbstractEquations, EquationRange]] = []
        self.parts = {}
        n = self.n_dof = self.powers = 0
        for one in each:
            to = n + one.position.size, self.n_dof + one.n_dof, self.powers + one.powers
            place = EquationRange(slice(n, to[0]), slice(self.n_dof, to[1]), slice(self.powers, to[2]))
            shift = self.n_dof
            self.parts |= {name: slice(shift + part.start, shift + part.stop) for name, part in one.parts.items()}
            self._each.append((one, place))
            n, self.n_dof, self.powers = to
        self.position = np.concatenate([one.position for one in each])
        self.velocity = np.concatenate([one.velocity for one in each])

    def at(self, time: float, p: Array, v: Array) -> tuple[Array, Array, Array]:
        found = [one.at(time, p[place.state], v[place.state]) for one, place in self._each]
        displacement, velocity, forces = (np.concatenate(column) for column in zip(*found, strict=True))
        return displacement, velocity, forces

    def accelerations(self, time: float, v: Array, forces: Array) -> tuple[Array, Array]:
        found = [one.accelerations(time, v[place.state], forces[place.moved]) for one, place in self._each]
        return np.concatenate([a for a, _ in found]), np.concatenate([powers for _, powers in found])

    def motion(self, p: Array, v: Array) -> tuple[Array, Array]:
        found = [one.motion(p[place.state], v[place.state]) for one, place in self._each]
        return np.concatenate([u for u, _ in found]), np.concatenate([rates for _, rates in found])

    def balance(self, p: Array, v: Array, integrals: Array) -> Balance:
        found = [one.balance(p[at.state], v[at.state], integrals[at.powers]) for one, at in self._each]
        return Balance(
            np.concatenate([each.energies for each in found]),
            np.concatenate([each.momenta for each in found]),
            sum(each.work for each in found),
            (sum(each.lost[0] for each in found), sum(each.lost[1] for each in found)),
        )

    def shares(self, masses: Mapping[str, float]) -> Array:
        return np.concatenate([one.shares(masses) for one, _ in self._each])

    def placed(self) -> Array:
        return np.concatenate([one.placed() for one, _ in self._each])

    def second_rates(self, p: Array, v: Array, a: Array) -> Array:
        states = ((one, place.state) for one, place in self._each)
        return np.concatenate([one.second_rates(p[state], v[state], a[state]) for one, state in states])

    def speed(self, masses: Mapping[str, float], duration: float) -> float:
        return max(one.speed(masses, duration) for one, _ in self._each)

    def moments(self, times: Array, p: Array, v: Array, forces: Array) -> dict[str, Array]:
        found: dict[str, Array] = {}
        for one, place in self._each:
            found |= one.moments(times, p[place.state], v[place.state], forces[place.moved])
        return found
