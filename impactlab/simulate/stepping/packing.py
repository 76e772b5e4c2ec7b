"""Matrices and rows as the flat arrays and records that the loop walks over."""

from __future__ import annotations

import numpy as np
from numpy import bool_
from numpy.typing import NDArray

from impactlab.integrators.base import Stepper, loads_of
from impactlab.models.base import Operators
from impactlab.simulate.stepping.arrays import Floats, Ints
from impactlab.types import Array


def flat(arrays: list[Array]) -> tuple[Floats, Ints]:
    """Return arrays in a row and where each starts, with the end, shape (n + 1,)."""
    starts = [0]
    for array in arrays:
        starts.append(starts[-1] + array.size)
    joined = np.concatenate([array.ravel() for array in arrays]) if arrays else np.zeros(0)
    return joined, np.array(starts, np.int64)


def dashpots(system: Operators) -> list[tuple[int, int, float, bool]]:
    """Return the damping of a body as dashpots: coordinate, other one (-1: the ground), damping [N s/m], inside or not.

    v C v is the sum of c (v_i - v_j)^2 over the pairs, with c = -C_ij, and of the row sums times v_i^2. Of these row
    sums the dashpots at the ends are a part, the rest acts inside the body.
    """
    if not system.damping.any():
        return []
    ground, ends, found = system.dashpots_inside(), system.dashpots_at_ends(), []
    n_dof = ends.size
    for offset in range(1, system.damping.shape[0]):
        couplings = system.damping[offset, : n_dof - offset]
        found += [(int(i) + offset, int(i), -float(couplings[i]), True) for i in np.flatnonzero(couplings)]
    found += [(int(i), -1, float(ground[i]), True) for i in np.flatnonzero(ground)]
    return found + [(int(i), -1, float(ends[i]), False) for i in np.flatnonzero(ends)]


def sparse(rows: list[tuple[int, Array]], pattern: list[NDArray[bool_]] | None = None) -> tuple[Ints, Ints, Floats]:
    """Return rows, each a shift into the state and a dense row, as starts, indices, values; without zeros."""
    if not rows:
        return np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros(0)
    whole, first = flat([row for _, row in rows])
    kept = (whole if pattern is None else np.concatenate(pattern)).nonzero()[0]
    starts = kept.searchsorted(first)
    shifts = np.array([shift for shift, _ in rows], np.int64) - first[:-1]
    return starts, kept + shifts.repeat(starts[1:] - starts[:-1]), whole[kept]


def alone(starts: Ints, indices: Ints, values: Floats) -> Ints:
    """Return, of sparse rows, which entry of the state each is; -1 where it is more than that entry, or none."""
    entries = np.full(starts.size - 1, -1)
    single = (starts[1:] - starts[:-1] == 1).nonzero()[0]
    first = starts[single]
    plain = values[first] == 1.0
    entries[single[plain]] = indices[first[plain]]
    return entries


def responses_of(stepper: Stepper) -> tuple[Array, Array, Array]:
    """Return the responses of a body's ports to forces, impulses and projections, (n_ports, n_state) each."""
    return stepper.force_response, stepper.impulse_response, stepper.projection_response


def jumps_and_loads(stepper: Stepper) -> Array:
    """Return velocities per impulse and, where a step may be cut, loads of a body's ports, flat."""
    loads = np.zeros(0) if stepper.load is None else loads_of(stepper.load, stepper.face_rows)
    return np.concatenate((stepper.jump.ravel(), loads))
