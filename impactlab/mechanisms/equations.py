"""Accelerations of a mechanism with drives held, M p'' = force + rows^T F, by Cholesky factors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

import numpy as np

from impactlab.mechanisms.layout import add, dot, times
from impactlab.mechanisms.steps import (
    DRIVE,
    Middle,
    driven,
    driven_acceleration,
    evaluate,
    factorise,
    middle_of,
    moment_of,
    solve,
)
from impactlab.models.equations import AbstractEquations, Balance
from impactlab.numerics.addresses import entered
from impactlab.numerics.compiling import ENTRY, PART
from impactlab.numerics.windows import window
from impactlab.types import Array

STRIDE = 1e-6  # s, of a central difference in time, of rates below 1/s; shorter of faster ones


@PART
def accelerate(m: Middle, time: float, forces: Array, moments: Array) -> None:
    """Write the accelerations into ``m.a`` and the moments of drives.

    ``forces`` are those on the coordinates, then those on readings.
    """
    n = m.force.size
    for i in range(n):
        m.y[i] = forces[i]
    for k in range(m.rates.size):
        if forces[n + k] != 0.0:
            add(m.y, forces[n + k], window(m.rows, k * n, n))
    for i in range(n):
        m.a[i] = m.y[i]
    for number in range(moments.size):
        d = driven(m.drives, number)
        add(m.a, -driven_acceleration(m.drives, number, time), window(m.mass, d * n, n))
    for number in range(moments.size):
        m.a[driven(m.drives, number)] = driven_acceleration(m.drives, number, time)
    factorise(m, m.bare, 0.0)
    solve(m.bare, m.a)
    for number in range(moments.size):
        d = driven(m.drives, number)
        moments[number] = moment_of(m, d, 0.0, m.a) - m.y[d]


@ENTRY
def begin(P: Array, time: float, p: Array, v: Array, displacement: Array, velocity: Array, forces: Array) -> None:
    """Take the terms at a state; write displacements, velocities and the forces along them."""
    m = middle_of(P)
    evaluate(P, m, time, p, v, True)
    write_motion(m, p, v, displacement, velocity)
    for i in range(forces.size):
        forces[i] = m.force[i] if i < m.force.size else 0.0


@PART
def write_motion(m: Middle, p: Array, v: Array, displacement: Array, velocity: Array) -> None:
    """Write coordinates, then readings, and the rates of both."""
    n = p.size
    for i in range(n):
        displacement[i], velocity[i] = p[i], v[i]
    for k in range(m.rates.size):
        displacement[n + k], velocity[n + k] = m.values[k], m.rates[k]


@ENTRY
def end(P: Array, time: float, v: Array, forces: Array, a: Array, moments: Array) -> float:
    """Write accelerations and moments of drives after `begin`; return the power of the drives [W]."""
    m = middle_of(P)
    accelerate(m, time, forces, moments)
    power = 0.0
    for i in range(a.size):
        a[i] = m.a[i]
    for number in range(moments.size):
        power += moments[number] * v[driven(m.drives, number)]
    return power


@ENTRY
def move(P: Array, p: Array, v: Array, displacement: Array, velocity: Array) -> None:
    """Write displacements and velocities at states, a row each."""
    m = middle_of(P)
    for k in range(len(p)):
        evaluate(P, m, 0.0, p[k], v[k], False)  # readings follow from the position alone
        write_motion(m, p[k], v[k], displacement[k], velocity[k])


@ENTRY
def drive(P: Array, instants: Array, p: Array, v: Array, forces: Array, moments: Array) -> None:
    """Write the moments of drives at states under forces, a row each."""
    m = middle_of(P)
    for k in range(instants.size):
        evaluate(P, m, instants[k], p[k], v[k], True)
        for i in range(p.shape[1]):
            forces[k, i] += m.force[i]
        accelerate(m, instants[k], forces[k], moments[k])


@ENTRY
def book(P: Array, p: Array, v: Array, out: Array) -> None:
    """Write energy and work of loads [J] at a state; neither follows from the time."""
    m = middle_of(P)
    evaluate(P, m, 0.0, p, v, True)
    times(m.mass, v, m.x)
    times(m.stiffness, p, m.y)
    out[0], out[1] = 0.5 * (dot(v, m.x) + dot(p, m.y)), m.values[m.rates.size]


@final
class MechanismEquations(AbstractEquations):
    """A mechanism: its displacements are its coordinates, then its readings.

    The power beside its accelerations is that of its drives. ``parameters`` are as `steps.middle_of` reads them.
    """

    def __init__(self, name: str, parameters: Array, position: Array, velocity: Array) -> None:
        self.parameters, self.position, self.velocity = parameters, position, velocity
        self._middle: Middle = middle_of(parameters)
        self._name, self._n, self._drives = name, position.size, self._middle.drives.reshape(-1, DRIVE)
        self.n_dof = self._n + self._middle.rates.size
        self.parts = {name: slice(0, self.n_dof)}
        self.powers = min(1, len(self._drives))

    def at(self, time: float, p: Array, v: Array) -> tuple[Array, Array, Array]:
        displacement, velocity, forces = np.empty((3, self.n_dof))
        entered(begin, self.parameters, time, *contiguous(p, v), displacement, velocity, forces)
        return displacement, velocity, forces

    def accelerations(self, time: float, v: Array, forces: Array) -> tuple[Array, Array]:
        a, moments = np.empty(self._n), np.empty(len(self._drives))
        power = entered(end, self.parameters, time, *contiguous(v, forces), a, moments)
        return a, np.full(self.powers, power)

    def motion(self, p: Array, v: Array) -> tuple[Array, Array]:
        states = contiguous(np.atleast_2d(p.T), np.atleast_2d(v.T))
        out = np.empty((2, len(states[0]), self.n_dof))
        entered(move, self.parameters, *states, *out)
        return (out[0, 0], out[1, 0]) if p.ndim == 1 else (out[0].T, out[1].T)

    def second_rates(self, p: Array, v: Array, a: Array) -> Array:
        stride = STRIDE / max(1.0, float(np.abs(v).max()))
        (_, before), (_, after) = (self.motion(p + way * v, v + way * a) for way in (-stride, stride))
        return (after - before) / (2.0 * stride)

    def balance(self, p: Array, v: Array, integrals: Array) -> Balance:
        out = np.empty(2)
        entered(book, self.parameters, *contiguous(p, v), out)
        return Balance(out[:1], np.zeros(1), float(out[1] + integrals.sum()))

    def placed(self) -> Array:
        return self.motion(self.position, self.velocity)[0]

    def shares(self, masses: Mapping[str, float]) -> Array:
        """Return the rate of each coordinate per speed of the whole.

        At this rate it has the energy of the whole by itself.
        """
        return np.sqrt(masses[self._name] / np.diag(self._mass_at_start()[0]))

    def speed(self, masses: Mapping[str, float], duration: float) -> float:
        """Return the speed that drives and loads give to the mechanism [m/s].

        It stands as it is, its shapes at rest.
        """
        mass, force = self._mass_at_start()
        held = self._drives[:, 0].astype(int)
        free = np.setdiff1d(np.arange(self._n), held)
        rates = np.zeros(self._n)
        rates[held] = self._drives[:, 1]
        stiff = (mass + duration**2 * self._middle.stiffness.reshape(mass.shape))[np.ix_(free, free)]
        rates[free] = np.linalg.solve(stiff, (duration * force - mass @ rates)[free])
        return float(np.sqrt(rates @ mass @ rates / masses[self._name]))

    def _mass_at_start(self) -> tuple[Array, Array]:
        """Return mass matrix and force of the mechanism at rest at t = 0."""
        forces = self.at(0.0, self.position, 0.0 * self.velocity)[2]
        return self._middle.mass.reshape(self._n, self._n).copy(), forces[: self._n]

    def moments(self, times: Array, p: Array, v: Array, forces: Array) -> dict[str, Array]:
        out = np.empty((times.size, len(self._drives)))
        entered(drive, self.parameters, *contiguous(times, p.T, v.T), np.array(forces.T, order="C"), out)
        return {self._name: out.T}


def contiguous(*arrays: Array) -> tuple[Array, ...]:
    """Return arrays as compiled functions take them."""
    return tuple(np.ascontiguousarray(each) for each in arrays)
