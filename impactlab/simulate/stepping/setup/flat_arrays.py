"""Matrices and rows as the flat arrays and records that the loop walks over."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy import bool_
from numpy.typing import NDArray

from impactlab.integrators.base import loads_of
from impactlab.models.base import Operators
from impactlab.stepper import Stepper
from impactlab.types import Array, Ints


def flat(arrays: list[Array]) -> tuple[Array, list[int]]:
    """Return arrays in a row, and where each starts.

    The starts include the end: n + 1 in all.
    """
    starts = [0, *itertools.accumulate([array.size for array in arrays])]
    return np.concatenate([array.ravel() for array in arrays]) if arrays else np.zeros(0), starts


class Dashpots(NamedTuple):
    """Dashpots side by side: first coordinates at both ends, damping [N s/m].

    ``other`` is -1 for the ground.
    """

    first: int
    other: int
    damping: Array
    inside: bool  # of the body, not at its ends


def dashpots(system: Operators) -> list[Dashpots]:
    """Return the damping of a body as dashpots, grouped where their coordinates follow each other.

    v C v is the sum of c (v_i - v_j)^2 over the pairs, with c = -C_ij, and of the row sums times v_i^2. Of these row
    sums the dashpots at the ends are a part, the rest acts inside the body.
    """
    if not np.count_nonzero(system.damping):
        return []
    ground, ends, found = system.dashpots_inside(), system.dashpots_at_ends(), []
    n_dof = ends.size
    for offset in range(1, system.damping.shape[0]):
        couplings = -system.damping[offset, : n_dof - offset]
        found += [Dashpots(offset + first, first, values, True) for first, values in groups(couplings)]
    for values, inside in ((ground, True), (ends, False)):
        found += [Dashpots(first, -1, group, inside) for first, group in groups(values)]
    return found


def groups(values: Array) -> list[tuple[int, Array]]:
    """Return the groups of values without a zero between them, each with its first index."""
    kept = values.nonzero()[0]
    parts = np.split(kept, (np.diff(kept) != 1).nonzero()[0] + 1) if kept.size else []
    return [(int(part[0]), values[part]) for part in parts]


def sparse(rows: list[tuple[int, Array]], pattern: list[NDArray[bool_]] | None = None) -> tuple[Ints, Ints, Array]:
    """Return rows without zeros: starts, indices, values.

    Each row is given as a shift into the state and a dense row.
    """
    if not rows:
        return np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros(0)
    whole, starts = flat([row for _, row in rows])
    first = np.array(starts, np.int64)
    kept = (whole if pattern is None else np.concatenate(pattern)).nonzero()[0]
    begins = kept.searchsorted(first)
    shifts = np.array([shift for shift, _ in rows], np.int64) - first[:-1]
    return begins, kept + shifts.repeat(begins[1:] - begins[:-1]), whole[kept]


def responses_of(stepper: Stepper) -> tuple[Array, Array, Array]:
    """Return the responses of a body's ports to forces, impulses and projections, (n_ports, n_state) each."""
    return stepper.force_response, stepper.impulse_response, stepper.projection_response


def jumps_and_loads(stepper: Stepper) -> Array:
    """Return velocities per impulse, and loads of ports, as a flat array.

    Loads are there where a step may be cut.
    """
    if stepper.load is None:
        return stepper.jump
    return np.concatenate((stepper.jump.ravel(), loads_of(stepper.load, stepper.face_rows)))
