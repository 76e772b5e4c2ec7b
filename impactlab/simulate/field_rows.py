"""Rows over the coordinates of a body, and snapshots of these, by which fields along it are read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.types import Array, Ints

MAX_LISTED = 12  # times in a message


class Rows(NamedTuple):
    """Rows over the coordinates of a body, without their zeros."""

    rows: int
    row: Ints  # (entries,) number of the row
    column: Ints  # (entries,)
    value: Array  # (entries,)

    def times(self, motions: Array) -> Array:
        """Return the rows times coordinates (n, n_dof), shape (n, rows)."""
        count = len(motions)
        places = np.arange(count)[:, None] * self.rows + self.row
        summed = np.bincount(places.ravel(), (self.value * motions[:, self.column]).ravel(), count * self.rows)
        return np.asarray(summed, float).reshape(count, self.rows)


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


def snapshots_at(times: Array, kept: Array, slack: float) -> Ints:
    """Return the numbers of the snapshots at times, which may lie beside them by a slack [s]; ``kept`` rises.

    Raises
    ------
    ImpactlabError
        If there is no snapshot at a time.
    """
    numbers = np.minimum(np.searchsorted(kept, times - slack), max(0, kept.size - 1))
    without = times if kept.size == 0 else times[np.abs(kept[numbers] - times) > slack]
    if without.size:
        text = f"no snapshot at t = {without[0]:.6g} s; snapshots: {_listed(kept)}"
        raise ImpactlabError(text, remedy=_to_have(float(without[0]), kept), path="snapshots")
    return np.asarray(numbers)


def _to_have(time: float, times: Array) -> str:
    """Return the remedy for a field at a time without a snapshot.

    Of many snapshots the nearest one is named.
    """
    if len(times) <= MAX_LISTED:
        return "Add the time to 'snapshots', or give equal ones: snapshots: {count: 200}."
    nearest = float(times[np.argmin(np.abs(times - time))])
    return f"Take the nearest, {nearest:.6g} s, add the time to 'snapshots', or read all: history.to_xarray()."


def _listed(times: Array) -> str:
    """Return times for people: the first and last of many."""
    texts = [f"{time:.6g}" for time in times]
    return ", ".join(texts if len(texts) <= MAX_LISTED else [*texts[:3], "...", texts[-1]]) or "none"
