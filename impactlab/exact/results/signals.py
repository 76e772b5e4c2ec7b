"""Signals of a solved network at any time: rows of Chebyshev pieces and their integrals."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cache
from typing import Generic, TypeVar

import numpy as np

from impactlab.exact.setup.network import Log
from impactlab.types import Array, Ints

MAX_BREAKS = 5000  # of a signal, at which its extremes are sought
MIN_GROUPED = 1000  # coefficients of a signal, from which on integrals take pieces of few coefficients apart


@cache
def gauss(points: int) -> tuple[Array, Array]:
    """Return places in [-1, 1] and weights of Gauss quadrature, shape (points,) each."""
    places, weights = np.polynomial.legendre.leggauss(points)
    return np.asarray(places), np.asarray(weights)


def clenshaw(table: Array, piece: Ints, y: Array) -> Array:
    """Return the series table[:, piece] at y, shape of y.

    ``table`` is (coefficients, pieces); ``piece`` broadcasts to y.
    """
    b1, b2, room = np.zeros((3, *y.shape))
    twice = 2.0 * y
    for k in range(len(table) - 1, 0, -1):
        np.multiply(twice, b1, out=room)
        room -= b2
        room += table[k][piece]
        b1, b2, room = room, b1, b2
    return np.asarray(y * b1 - b2 + table[0][piece])


@cache
def _signs(count: int) -> Array:
    """Return so many signs, 1, -1, 1 ...: Chebyshev polynomials at -1."""
    return np.where(np.arange(count) % 2 == 0, 1.0, -1.0)


def turning_times(breaks: Array, tolerance: float, duration: float) -> Array:
    """Return both sides of a signal's breaks, and places between [s].

    There are three or more places between two breaks; the shape is (n,), all within a run.
    """
    inside = np.unique(breaks[(breaks > 0.0) & (breaks < duration)])
    ends = np.concatenate([[0.0], inside[:: len(inside) // MAX_BREAKS + 1], [duration]])
    count = max(3, MAX_BREAKS // len(ends))
    between = ends[:-1, None] + np.diff(ends)[:, None] * (np.arange(1, count + 1) / (count + 1))
    return np.concatenate([ends, np.maximum(ends - 2.0 * tolerance, 0.0), between.ravel()])


SIZES = (1, 2, 3, 4, 6, 8, 12, 18, 24, 36)  # coefficients of pieces that are taken together, and all more


def sizes_of(*tables: Array) -> Ints:
    """Return how many coefficients each piece needs, (pieces,).

    It is the number needed in all of the tables, rounded up to one of few numbers. Many pieces are short, between
    events, and few are long: with all coefficients of the longest, quadrature of them all would take a hundred times as
    long.
    """
    needed = np.ones(tables[0].shape[1], np.int64)
    for table in tables:
        for k in range(1, len(table)):
            needed[table[k] != 0.0] = np.maximum(needed[table[k] != 0.0], k + 1)
    most = int(needed.max())
    bounds = np.array([size for size in SIZES if size < most] + [most])
    return np.asarray(bounds[np.searchsorted(bounds, needed)])


class Signal:
    """One row of a junction's records: a function of time in pieces."""

    def __init__(self, start: Array, stop: Array, table: Array, tolerance: float) -> None:
        self.start = start  # (pieces,) s
        self.stop = stop  # (pieces,) s
        self.width = stop - start  # (pieces,) s
        self.table = table  # (coefficients, pieces)
        self.tolerance = tolerance  # s; a time this near below a break counts as after it
        self.grouped = table.size >= MIN_GROUPED
        self._sizes: Ints | None = None
        self._kept: dict[bool, tuple[Array, Array]] = {}

    def pieces(self, t: Array) -> Ints:
        """Return the number of the piece of every time."""
        return np.minimum(np.searchsorted(self.stop, t + self.tolerance, side="right"), len(self.stop) - 1)

    def places(self, piece: Ints, t: Array) -> Array:
        """Return the places of times in their pieces, in [-1, 1] (see `impactlab.exact.kernel.within`)."""
        return np.clip((2.0 * t - self.start[piece] - self.stop[piece]) / self.width[piece], -1.0, 1.0)

    def __call__(self, t: Array) -> Array:
        """Return the values at t [s], any shape; at a jump the value after it."""
        piece = self.pieces(t)
        return clenshaw(self.table, piece, self.places(piece, t))

    def jumps(self, floor: float) -> Array:
        """Return the breaks at which the signal jumps by more than the floor [s]."""
        after = np.sum(self.table[:, 1:] * _signs(len(self.table))[:, None], axis=0)
        before = np.sum(self.table[:, :-1], axis=0)
        return np.asarray(self.start[1:][np.abs(after - before) > floor])

    def _gauss(self, piece: Ints, y: Array, square: bool, size: int | None = None) -> Array:
        """Return the integral from the start of the piece to y.

        It is that of the signal or its square, with the shape of y.
        """
        if self.grouped and size is None:
            if self._sizes is None:
                self._sizes = sizes_of(self.table)
            found, own = np.zeros_like(y), self._sizes[piece]
            for each in np.unique(own).tolist():
                among = own == each
                found[among] = self._gauss(piece[among], y[among], square, each)
            return found
        table = self.table[:size]
        points = len(table) + 1 if square else len(table) // 2 + 2
        x, w = gauss(points)
        half = 0.5 * (y + 1.0)
        at = half[:, None] * (x + 1.0) - 1.0
        values = clenshaw(table, piece[:, None], at)
        total = (values * values if square else values) @ w
        return np.asarray(total * half * 0.5 * self.width[piece])

    def integral(self, t: Array, square: bool) -> Array:
        """Return the integral of the signal from the first piece on.

        With ``square`` it is that of its square; the shape is that of t (n,).
        """
        _, whole = self._wholes(square)
        piece = self.pieces(t)
        return np.asarray(whole[piece] + self._gauss(piece, self.places(piece, t), square))

    def between(self, t0: Array, t1: Array) -> Array:
        """Return the integrals of the square from t0 to t1, shape of both (n,).

        Whole pieces are added for each: the difference of two integrals from the start would lose the digits that a
        long run has more than its windows.
        """
        first, last = self.pieces(t0), self.pieces(t1)
        each, _ = self._wholes(True)  # up to the last end: the sum of all that follow would be of no use
        ends = np.stack([first, np.maximum(last, first + 1)], axis=1).ravel()
        sums = np.add.reduceat(each[: int(ends.max()) + 1], ends)[::2]
        sums = np.where(last > first, sums, 0.0)
        y0, y1 = self.places(first, t0), self.places(last, t1)
        return np.asarray(sums - self._gauss(first, y0, True) + self._gauss(last, y1, True))

    def _wholes(self, square: bool) -> tuple[Array, Array]:
        """Return the integral of a signal or its square over each piece and 0 at the end, and the sums before.

        The shape of each is (pieces + 1,).
        """
        if square not in self._kept:
            every = np.arange(len(self.stop))
            each = self._gauss(every, np.ones(len(every)), square)
            self._kept[square] = np.append(each, 0.0), np.concatenate([[0.0], np.cumsum(each)])
        return self._kept[square]


Of = TypeVar("Of")
"""How a signal is represented."""


class AbstractSignals(ABC, Generic[Of]):
    """All signals of a solved network, rows in the records of junctions, made when first used."""

    def __init__(self, log: Log) -> None:
        self.log = log
        self._made: dict[tuple[int, int], Of] = {}
        names = ("nodes", "ends", "first_node", "first_end", "first_contact")
        self._junctions = list(zip(*(log.junctions[name].tolist() for name in names), strict=True))
        self._of_nodes, self._of_ends = log.nodes["junction"].tolist(), log.ends["junction"].tolist()

    @abstractmethod
    def _read(self, j: int, row: int) -> Of:
        """Return the signal in a row of the records of junction j."""

    def _signal(self, j: int, row: int) -> Of:
        key = (j, row)
        if key not in self._made:
            self._made[key] = self._read(j, row)
        return self._made[key]

    def velocity(self, node: int) -> Of:
        """Return the velocity of a node [m/s]."""
        j = self._of_nodes[node]
        return self._signal(j, node - self._junctions[j][2])

    def displacement(self, node: int) -> Of:
        """Return the displacement of a node [m]."""
        j = self._of_nodes[node]
        nodes, _, first, _, _ = self._junctions[j]
        return self._signal(j, nodes + node - first)

    def wave(self, end: int) -> Of:
        """Return the wave emitted by an end [m/s], from one transit before t = 0 on."""
        j = self._of_ends[end]
        nodes, _, _, first, _ = self._junctions[j]
        return self._signal(j, 2 * nodes + end - first)

    def carried(self, end: int) -> Of:
        """Return the time integral of the wave of an end [m].

        It is that of the emitted wave, 0 at t = 0.
        """
        j = self._of_ends[end]
        nodes, ends, _, first, _ = self._junctions[j]
        return self._signal(j, 2 * nodes + ends + end - first)

    def force(self, contact: int) -> Of:
        """Return the force of a contact of the network [N]."""
        j = self._of_nodes[self.log.contacts["left"][contact]]
        nodes, ends, _, _, first = self._junctions[j]
        return self._signal(j, 2 * nodes + 2 * ends + contact - first)


class Signals(AbstractSignals[Signal]):
    """All signals of a solved network, to be evaluated at any time."""

    def __init__(self, log: Log) -> None:
        super().__init__(log)
        self.gravity = float(log.state["gravity"])  # m/s2, along +x
        self._pieces: dict[int, tuple[Array, Array, Ints, Ints]] = {}  # start, stop, size, offset by junction

    def _read(self, j: int, row: int) -> Signal:
        log = self.log
        if j not in self._pieces:
            pieces = log.pieces[j, : log.junctions["records"][j]]
            start, stop, sizes, offsets = (pieces[name].copy() for name in ("start", "stop", "size", "offset"))
            self._pieces[j] = start, stop, sizes, offsets
        start, stop, sizes, offsets = self._pieces[j]
        order = np.arange(int(sizes.max()))[:, None]
        there = order < sizes
        table = np.zeros(there.shape)
        table[there] = log.pool[(offsets + row * sizes + order)[there]]
        keep = np.flatnonzero(np.any(table != 0.0, axis=1))
        table = table[: keep[-1] + 1 if len(keep) else 1]
        return Signal(start, stop, table, float(log.state["tolerance"]))

    def travel(self, node: int, t: Array) -> Array:
        """Return the displacement of a node since t[0] [m], shape of t (n,)."""
        displacement = self.displacement(node)
        return displacement(t) - displacement(t[:1])
