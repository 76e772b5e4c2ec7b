"""Derivatives of an exact run's signals, and of their times, by one parameter."""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import chebyshev

from impactlab.exact.results.signals import AbstractSignals, clenshaw, gauss
from impactlab.exact.tangents.run import Solved
from impactlab.startup.cached import cached_property
from impactlab.types import Array, Ints

SAME_PEAK = 1.0e-12  # of a peak: values nearer to it are peaks, too


class MovingSignal:
    """One row of a junction's records, with its derivative at fixed places of the pieces."""

    def __init__(self, solved: Solved, parameter: int, j: int, row: int) -> None:
        log, tangents = solved.log, solved.tangents
        count, rows = int(log.junctions["records"][j]), int(log.junctions["rows"][j])
        first = log.pieces.shape[1] * j
        pieces = log.pieces[j, :count]
        self.tolerance, self.scale = float(log.state["tolerance"]), float(tangents.scale[parameter])
        self.start, self.stop = pieces["start"].copy(), pieces["stop"].copy()
        self.width = self.stop - self.start
        self.moves = tangents.moves[first : first + count, :, parameter]  # (pieces, 2)
        sizes = tangents.size[first : first + count]
        self.table, self.tangent = np.zeros((2, int(sizes.max()), count))
        for piece, (n, at, size, begin) in enumerate(
            zip(pieces["size"], pieces["offset"], sizes, tangents.offset[first : first + count], strict=True)
        ):
            self.table[:n, piece] = log.pool[at + row * n : at + (row + 1) * n]
            begin += (parameter * rows + row) * size
            self.tangent[:size, piece] = tangents.pool[begin : begin + size]

    @cached_property
    def slope(self) -> Array:
        """Derivative of the series in their places, (coefficients, pieces)."""
        return np.asarray(chebyshev.chebder(self.table)) if len(self.table) > 1 else np.zeros((1, len(self.stop)))

    def places(self, t: Array) -> tuple[Ints, Array]:
        """Return the piece of each time, and the place in it."""
        piece = np.minimum(np.searchsorted(self.stop, t + self.tolerance, side="right"), len(self.stop) - 1)
        return piece, np.clip((2.0 * t - self.start[piece] - self.stop[piece]) / self.width[piece], -1.0, 1.0)

    def label(self, piece: Ints, y: Array) -> Array:
        """Return the derivative of the time at a place of a piece."""
        moves = self.moves[piece]
        return np.asarray(0.5 * ((1.0 - y) * moves[:, 0] + (1.0 + y) * moves[:, 1]))

    def value(self, t: Array) -> Array:
        """Return the signal at times t, (n,)."""
        return clenshaw(self.table, *self.places(t))

    def derivative(self, t: Array, later: Array) -> Array:
        """Return the derivative at times t, (n,), that themselves have the derivatives ``later``.

        NaN where a break lies that moves otherwise than the time: a front may pass.
        """
        piece, y = self.places(t)
        rate = clenshaw(self.slope, piece, y) * 2.0 / self.width[piece]
        found = clenshaw(self.tangent, piece, y) + rate * (later - self.label(piece, y))
        return np.asarray(np.where(self._passed(t, later), np.nan, found))

    def _passed(self, t: Array, later: Array) -> Array:
        """Return whether a break with a jump passes each time."""
        near = np.searchsorted(self.stop, t - 2.0 * self.tolerance)
        near = np.minimum(near, len(self.stop) - 1)
        at_break = np.abs(self.stop[near] - t) <= 2.0 * self.tolerance
        passes = at_break & (np.abs(self.moves[near, 1] - later) > 1e-12 * (np.abs(later) + 1e-300))
        after = np.minimum(near + 1, len(self.stop) - 1)
        ones = np.ones(len(t))
        jump = np.abs(clenshaw(self.table, after, -ones) - clenshaw(self.table, near, ones))
        unknown = near == len(self.stop) - 1  # after the end of the run nothing is known
        return np.asarray(passes & (unknown | (jump > 1e-12 * np.max(np.abs(self.table)))))

    def integral(self, first: float, last: float) -> float:
        """Return the derivative of the integral over the pieces that lie between two breaks."""
        inside = (self.start >= first - self.tolerance) & (self.stop <= last + self.tolerance)
        k = np.arange(0, len(self.table), 2)
        weights = 1.0 / (1.0 - k * k)
        wider = self.moves[inside, 1] - self.moves[inside, 0]
        return float(
            np.sum(weights @ self.tangent[::2, inside] * self.width[inside])
            + np.sum(weights @ self.table[::2, inside] * wider)
        )

    def peak(self, first: float, last: float) -> float:
        """Return the derivative of the largest value between two breaks.

        NaN where several peaks are equal. A constant value is such: where its derivative varies along it, the peak
        moves to one of its ends.
        """
        inside = np.flatnonzero((self.start >= first - self.tolerance) & (self.stop <= last + self.tolerance))
        found = [self._top(int(piece)) for piece in inside]
        best = max((value for value, _ in found), default=0.0)
        if best <= 0.0:
            return 0.0
        tops = [slope for value, slopes in found if value >= best * (1.0 - SAME_PEAK) for slope in slopes]
        rounding = max(1e-9 * max(map(abs, tops)), 1e-11 * best / self.scale)
        return tops[0] if max(tops) - min(tops) <= rounding else math.nan

    def _top(self, piece: int) -> tuple[float, list[float]]:
        """Return the largest value of a piece, and the derivatives there and at equal values."""
        f = self.table[:, piece]
        grid = np.cos(np.pi * np.arange(4 * len(f), -1, -1) / (4 * len(f)))
        values = chebyshev.chebval(grid, f)
        i = int(np.argmax(values))
        y = float(grid[i])
        if len(f) > 2:
            low, high = float(grid[max(0, i - 1)]), float(grid[min(i + 1, len(grid) - 1)])  # an end may have it beside
            slope = chebyshev.chebder(f)
            bend = chebyshev.chebder(slope)
            for _ in range(6):
                curved = float(chebyshev.chebval(y, bend))
                if curved >= 0.0:
                    break
                y = min(max(y - float(chebyshev.chebval(y, slope)) / curved, low), high)
        top = float(chebyshev.chebval(y, f))
        places = np.append(y, grid[values >= top * (1.0 - SAME_PEAK)])
        return top, chebyshev.chebval(places, self.tangent[:, piece]).tolist()

    def square(self, first: float, last: float, of_first: float, of_last: float) -> float:
        """Return the derivative of the integral of the square from one moving time to another."""
        x, w = gauss(len(self.table) + 1)
        every = np.flatnonzero((self.stop > first) & (self.start < last))
        low = np.maximum(-1.0, (2.0 * first - self.start[every] - self.stop[every]) / self.width[every])
        high = np.minimum(1.0, (2.0 * last - self.start[every] - self.stop[every]) / self.width[every])
        at = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * x
        wide = every[:, None]
        f, tangent = clenshaw(self.table, wide, at), clenshaw(self.tangent, wide, at)
        wider = self.moves[every, 1] - self.moves[every, 0]
        inner = 0.5 * wider[:, None] * f * f + self.width[every][:, None] * f * tangent
        total = float(np.sum((inner @ w) * 0.5 * (high - low)))
        for time, later, sign in ((first, of_first, -1.0), (last, of_last, 1.0)):
            piece, y = self.places(np.array([time]))
            value = float(clenshaw(self.table, piece, y)[0])
            total += sign * value * value * float(later - self.label(piece, y)[0])
            if bool(self._passed(np.array([time]), np.array([later]))[0]):
                return math.nan
        return total


class MovingSignals(AbstractSignals[MovingSignal]):
    """All signals of an exact run, with their derivatives by one parameter."""

    def __init__(self, solved: Solved, parameter: int) -> None:
        super().__init__(solved.log)
        self.solved, self.parameter = solved, parameter

    def _read(self, j: int, row: int) -> MovingSignal:
        return MovingSignal(self.solved, self.parameter, j, row)
