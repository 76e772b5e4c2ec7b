"""The motion of bodies at the snapshots of a stepped run."""

from __future__ import annotations

from typing import Any

import numpy as np

from impactlab.integrators.base import AbstractIntegrator
from impactlab.numerics.records import dtype_of
from impactlab.simulate.stepping.arrays import SnapshotRecord
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.types import Array, Ints


def motions(assembly: Assembly, integrator: AbstractIntegrator, numbers: Ints, body: str, velocities: bool) -> Array:
    """Return displacements or velocities of a body's coordinates at snapshots, (n, n_dof).

    They lie on a line between the states at both ends of a step. A body with phases has its coordinates while open,
    then those while closed.

    Parameters
    ----------
    numbers : array of int
        Of the instants in the scene, (n,).
    """
    layout, taken = assembly.layout, assembly.clock.n_snapshots
    own, places = (np.asarray(assembly.shown[kind], np.int64)[numbers] for kind in (0, velocities))
    places = np.where(places < taken, places, own)  # of a run that ended early
    structures: Any = assembly.snapshots
    kept = np.frombuffer(structures, dtype_of(SnapshotRecord))[places]
    length = kept["after"] - kept["before"]
    # Leapfrog velocities belong to the middle of their step.
    late = (1.0 - integrator.velocity_point) * length if velocities else 0.0
    passed = np.asarray(layout.scene.field_times)[numbers] - kept["before"] + late
    share = np.divide(passed, length, out=np.ones(length.size), where=length > 0.0)[:, None]
    states = layout.state_of(body, assembly.memory.snapshot_state, velocities)[places]
    one, other = (1.0 - share) * states[:, 0], share * states[:, 1]
    if layout.built[body].system.phases is None:
        return np.asarray(one + other)
    bit = [name for name, each in layout.built.items() if each.system.phases is not None].index(body)
    both, every = np.zeros((length.size, 2, one.shape[1])), np.arange(length.size)
    both[every, kept["closed_before"] >> bit & 1] += one
    both[every, kept["closed_after"] >> bit & 1] += other
    return both.reshape(length.size, -1)
