"""Matrices and rows as the flat arrays and records that the loop walks over."""

from __future__ import annotations

import numpy as np
from numpy import bool_
from numpy.typing import NDArray

from impactlab.models.base import Operators
from impactlab.simulate.stepping.arrays import Floats, Ints
from impactlab.types import Array


def flat(arrays: list[Array]) -> tuple[Floats, Ints]:
    """Return arrays in a row and where each starts, with the end, shape (n + 1,)."""
    starts = np.concatenate(([0], np.cumsum([array.size for array in arrays]))).astype(np.int64)
    return np.concatenate([array.ravel() for array in arrays] or [np.zeros(0)]), starts


def dashpots(system: Operators) -> list[tuple[int, int, float, bool]]:
    """Return the damping of a body as dashpots: coordinate, other one (-1: the ground), damping [N s/m], inside or not.

    v C v is the sum of c (v_i - v_j)^2 over the pairs, with c = -C_ij, and of the row sums times v_i^2. Of these row
    sums the dashpots at the ends (`Operators.end_dashpots`) are a part, the rest acts inside the body.
    """
    damping, ends = system.damping, end_dashpots(system)
    n_dof = damping.shape[1]
    ground, found = damping[0] - ends, []
    for offset in range(1, damping.shape[0]):
        for i in np.flatnonzero(damping[offset, : n_dof - offset]):
            coupling = float(damping[offset, i])
            found.append((int(i) + offset, int(i), -coupling, True))
            ground[i] += coupling
            ground[i + offset] += coupling
    ground[np.abs(ground) <= 1e-13 * np.abs(damping[0])] = 0.0
    found += [(int(i), -1, float(ground[i]), True) for i in np.flatnonzero(ground)]
    return found + [(int(i), -1, float(ends[i]), False) for i in np.flatnonzero(ends)]


def end_dashpots(system: Operators) -> Array:
    """Return the damping of dashpots at the ends of a body, shape (n_dof,) [N s/m].

    Of a model that does not state them, one or two entries on the diagonal of an uncoupled matrix count as such.
    """
    if system.end_dashpots is not None:
        return system.end_dashpots
    coupled = bool(np.any(system.damping[1:])) or np.count_nonzero(system.damping[0]) > 2
    return np.zeros(system.load.size) if coupled else np.array(system.damping[0])


def sparse(rows: list[tuple[int, Array]], pattern: list[NDArray[bool_]] | None = None) -> tuple[Ints, Ints, Floats]:
    """Return rows, each a shift into the state and a dense row, as starts, indices, values; without zeros."""
    starts, indices, values = [0], [np.zeros(0, np.int64)], [np.zeros(0)]
    for number, (shift, row) in enumerate(rows):
        kept = np.flatnonzero(row if pattern is None else pattern[number])
        indices.append(kept + shift)
        values.append(row[kept])
        starts.append(starts[-1] + kept.size)
    return np.array(starts, np.int64), np.concatenate(indices), np.concatenate(values)
