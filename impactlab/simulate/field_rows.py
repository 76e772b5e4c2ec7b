"""Rows over the coordinates of a body by which fields along it are read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from impactlab.types import Array


class Rows(NamedTuple):
    """Rows over the coordinates of a body, without their zeros."""

    rows: int
    row: NDArray[np.int64]  # (entries,) number of the row
    column: NDArray[np.int64]  # (entries,)
    value: Array  # (entries,)

    def times(self, motion: Array) -> Array:
        """Return the rows times the coordinates, shape (rows,)."""
        return np.asarray(np.bincount(self.row, self.value * motion[self.column], self.rows), float)


class FieldRows(NamedTuple):
    """Rows with which a field of a quantity is read."""

    places: Array  # (n,) m
    rows: Rows  # of the quantity at each place
    delays: Array | None  # (n,) s, by which it follows its rate too (`Body.retardation`); None: nowhere


def rows_of(dense: Sequence[Array]) -> Rows:
    """Return dense rows, shape (n_dof,) each, without their zeros."""
    entries = [np.flatnonzero(row) for row in dense]
    number = np.repeat(np.arange(len(dense)), [each.size for each in entries])
    values = [row[at] for row, at in zip(dense, entries, strict=True)]
    return Rows(len(dense), number, np.concatenate([np.zeros(0, np.int64), *entries]), np.concatenate([[], *values]))
