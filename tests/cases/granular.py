"""Chains of beads by scipy alone: the equations of motion of the beads, with nothing of impactlab."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

from impactlab.casefile import Case
from impactlab.types import Array


class March(NamedTuple):
    """Velocities at the end [m/s], and largest forces of the contacts [N]."""

    velocities: Array
    forces: Array


def marched(masses: Array, stiffnesses: Array, velocities: Array, duration: float, tolerance: float = 1e-12) -> March:
    """Return the answer for masses in a row with F = k d^1.5 between neighbours that just touch at rest."""
    n = len(masses)

    def rates(_: float, state: Array) -> Array:
        overlap = np.maximum(state[: n - 1] - state[1:n], 0.0)
        force = stiffnesses * overlap**1.5
        pushed = np.zeros(n)
        pushed[:-1] -= force
        pushed[1:] += force
        return np.concatenate((state[n:], pushed / masses))

    solver = DOP853(
        rates, 0.0, np.concatenate((np.zeros(n), velocities)), duration, rtol=tolerance, atol=1e-17, max_step=1e-6
    )
    forces = np.zeros(n - 1)
    while solver.status == "running":
        solver.step()
        dense = solver.dense_output()
        for t in np.linspace(solver.t_old, solver.t, 9)[1:]:
            u = dense(t)[:n]
            forces = np.maximum(forces, stiffnesses * np.maximum(u[:-1] - u[1:], 0.0) ** 1.5)
    return March(solver.y[n:], forces)


def chain_of(case: Case) -> tuple[Array, Array, Array]:
    """Return masses [kg], stiffnesses [N/m^1.5] and velocities at t = 0 [m/s] of a case of masses in a row."""
    scene, method = case.simulation()
    bodies = scene.bodies.values()
    laws = [method.laws[contact.name] for contact in scene.contacts]
    return (
        np.array([body.rigid_mass for body in bodies]),
        np.array([law.stiffness for law in laws]),  # type: ignore[attr-defined] # Hertz
        np.array([body.velocity for body in bodies]),
    )
