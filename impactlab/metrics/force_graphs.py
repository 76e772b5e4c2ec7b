"""Hausdorff distances between the graphs of contact forces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.metrics.norms import CELLS, force_channels, largest, midpoints
from impactlab.scene.problem import Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from scipy.spatial import KDTree

COLUMNS = 2000  # of the graphs
GRAPH_POINTS = 400_000  # most points of one graph; only a force that chatters wildly needs more
STRIDE = 16  # points of a graph between two of the first search


def force_graph(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> float | None:
    """Return the Hausdorff distance between the force graphs in (t/T, F/peak).

    The peak is that of the exact force. A jump belongs to its graph as a vertical line, so a small shift of a jump
    costs its shift and not its height. Before t = 0 there is no force: a contact that starts closed begins with a jump
    like any other. See `graph` for the accuracy. None in a scene without a rod, which has no T.
    """
    if not np.isfinite(scene.round_trip):
        return None
    return largest(_graph_distance(history, reference, scene, name) for name in force_channels(scene))


def _graph_distance(history: AbstractHistory, reference: AbstractHistory, scene: Scene, name: str) -> float | None:
    if history is reference:
        peak = _peak(history, scene, name)
        return None if peak == 0.0 else 0.0 * peak  # NaN where the force is not known
    exact = _graph_of_reference(reference, scene, name)
    if exact is None:
        return None
    one = graph(history, name, scene.duration, (scene.round_trip, exact.peak), before=0.0)
    if not np.all(np.isfinite(one)):
        return float("nan")
    if np.array_equal(one, exact.points):
        return 0.0
    return max(_farthest(one, exact.tree), _farthest(exact.points, _tree(one)))


@dataclass
class _Graph:
    """The graph of an exact force."""

    peak: float  # N
    points: Array  # (n, 2)

    @cached_property
    def tree(self) -> KDTree:
        return _tree(self.points)


_known: WeakKeyDictionary[AbstractHistory, dict[tuple[str, float, float], _Graph | None]] = WeakKeyDictionary()


def _graph_of_reference(reference: AbstractHistory, scene: Scene, name: str) -> _Graph | None:
    """Return the graph of a force of a reference, which all runs beside it share; None of a force of zero."""
    known, key = _known.setdefault(reference, {}), (name, scene.duration, scene.round_trip)
    if key not in known:
        known[key], peak = None, _peak(reference, scene, name)
        if peak != 0.0:
            points = graph(reference, name, scene.duration, (scene.round_trip, peak), before=0.0)
            known[key] = _Graph(peak, points)
    return known[key]


def _peak(history: AbstractHistory, scene: Scene, name: str) -> float:
    """Return the largest size of a force [N], at the middles of cells."""
    return float(np.max(np.abs(history.evaluate(midpoints(scene.duration), name))))


def _tree(points: Array) -> KDTree:
    from scipy.spatial import KDTree

    return KDTree(points, balanced_tree=False, compact_nodes=False)


def _farthest(points: Array, tree: KDTree) -> float:
    """Return the largest distance of points (n, 2) from the nearest one of a tree.

    The distances of two points differ by no more than the points are apart: the search begins with every sixteenth, and
    of the rest takes only those that may be farther than the farthest of these. The result is that of all points.
    """
    first = points[::STRIDE]
    known = tree.query(first)[0]
    farthest = float(known.max())
    away = points - np.repeat(first, STRIDE, axis=0)[: len(points)]
    left = points[np.repeat(known, STRIDE)[: len(points)] + np.hypot(away[:, 0], away[:, 1]) > farthest]
    return max(farthest, float(tree.query(left)[0].max())) if len(left) else farthest


def graph(
    history: AbstractHistory, channel: str, duration: float, units: tuple[float, float], before: float | None = None
) -> Array:
    """Return points (n, 2) of the graph of a channel, its jumps as vertical lines.

    The graph is connected, so over a narrow column of time it takes every value between its least and its largest:
    each of the 2000 columns becomes a vertical line of points as far apart as the column is wide. A Hausdorff distance
    between two such clouds is right to one width, duration/2000 in units of T (0.0015 for 3 T). Only where that would
    need more than 400 000 points, a force that chatters over its whole range, are the points further apart.

    Parameters
    ----------
    units : (float, float)
        Scales of time [s] and value [unit of the channel].
    before : float, optional
        Value before t = 0; if given, the jump from it at t = 0 belongs to the graph.
    """
    per_column = max(CELLS // COLUMNS, -(-2 * history.cost.steps // COLUMNS))  # no step of a stepped force is missed
    t = midpoints(duration, per_column * COLUMNS)
    jumps = history.jumps(channel)
    jumps = jumps[(jumps > 0.0) & (jumps < duration)]
    t = np.sort(np.concatenate((t, jumps, np.nextafter(jumps, 0.0))), kind="stable")  # quick: three sorted runs
    values = history.evaluate(t, channel) / units[1]
    column = np.minimum((t / duration * COLUMNS).astype(int), COLUMNS - 1)
    first = np.searchsorted(column, np.arange(COLUMNS))
    low, high = np.minimum.reduceat(values, first), np.maximum.reduceat(values, first)
    last = values[first[1:] - 1]  # ties each column to the one before it
    low[1:], high[1:] = np.minimum(low[1:], last), np.maximum(high[1:], last)
    if before is not None:
        low[0], high[0] = min(low[0], before), max(high[0], before)
    if not np.all(np.isfinite(low + high)):
        return np.full((1, 2), np.nan)
    width = duration / COLUMNS / units[0]
    spacing = max(width, float(np.sum(high - low)) / GRAPH_POINTS)
    counts = np.ceil((high - low) / spacing).astype(int) + 1
    owner = np.repeat(np.arange(COLUMNS), counts)
    rank = np.arange(owner.size) - np.repeat(np.cumsum(counts) - counts, counts)
    share = rank / np.maximum(counts[owner] - 1, 1)
    return np.column_stack(((owner + 0.5) * width, low[owner] + share * (high - low)[owner]))
