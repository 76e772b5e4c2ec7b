"""The two travelling waves of a chain of delays.

They follow from the waves that its nodes sent, and give any quantity at any place and time. Between two nodes with P
and Q the time integrals of the velocities that the left one sends to the right and the right one to the left, the
displacement is u(x, t) = C + P(t - s) + Q(t - r), with s and r the times of waves from the left and the right node;
under gravity each wave gains g/2 in a unit of time, and u is larger by (g/2) ((s + r) t + s r). P and Q are recorded,
straight lines within a step as the step loop takes them, so that displacements of nodes come back to rounding.
Velocities are straight lines between the middles of steps.
"""

from __future__ import annotations

import numpy as np
from numpy import int64
from numpy.typing import NDArray

from impactlab.history.base import FIELD_POINTS
from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.simulate.stepping.results.delay_waves import beyond
from impactlab.types import Array


def field_places(length: float, model: object) -> Array:
    """Return the places of a field along a delay line [m].

    Of a chain of delays both sides of its nodes are among them.
    """
    places = np.linspace(0.0, length, FIELD_POINTS)
    if not isinstance(model, DelayChain):
        return places
    return np.union1d([x for x in places if model.node_at(x) is None], model.grid())


class ChainWaves:
    """The waves of a rod, piece by piece.

    Parameters
    ----------
    chain : DelayChain
        The rod.
    times : Array
        Recorded instants, from 0 on, rising, shape (n,) [s].
    sent : Array
        Time integrals of the velocities that the nodes send at them, in the order of `DelayChain.sent`, shape
        (2 pieces, n) [m].
    dt : float
        The step [s], in which the waves that are on their way at t = 0 are resolved.
    """

    def __init__(self, chain: DelayChain, times: Array, sent: Array, dt: float) -> None:
        pieces = chain.pieces(dt)
        self.length = chain.places[-1]
        self.starts = np.array([piece.start for piece in pieces])
        self.lengths = np.array([piece.length for piece in pieces])
        self.transits = dt * np.array([piece.cells for piece in pieces])
        self._gains = np.array([piece.gain for piece in pieces]) / dt  # m/s2, of either wave on its way
        self.factors = {
            each: np.array([piece.segment.per_velocity(each) for piece in pieces])
            for each in ("strain", "stress", "force")
        }
        longest = max(piece.cells for piece in pieces) + 1
        self.times = np.concatenate([-dt * np.arange(longest, 0, -1), times])
        self._steps, self._middles = np.diff(self.times), 0.5 * (self.times[1:] + self.times[:-1])
        self.moved = np.zeros((2, len(pieces), self.times.size))
        for number, piece in enumerate(pieces):
            for side, waves in enumerate(chain.before(piece, dt)):
                before = np.append(waves, np.full(longest - waves.size, waves[-1]))
                self.moved[side, number, :longest] = -dt * np.cumsum(before)[::-1]
                self.moved[side, number, longest:] = sent[2 * number + side]
        # At t = 0 the right node stands where its own wave and the one that reaches it put it.
        arriving = self.moved[0, np.arange(len(pieces)), longest - np.array([piece.cells for piece in pieces])]
        self.offset = chain.operators().displacement[4::3] - arriving

    def velocities(self, x: Array, t: Array) -> tuple[Array, Array]:
        """Return the velocities of both waves at places and times [m/s].

        The wave to the right comes first; x is in m, t in s.
        """
        piece, onward, back = self._left_at(x, t)
        late = beyond(self._middles[-1], onward, back)
        onward, back = onward - late, back - late
        gain, instants = self._gains[piece], np.asarray(t, float) - late
        right = self._velocity(0, piece, onward) + gain * (instants - onward)
        return right, self._velocity(1, piece, back) + gain * (instants - back)

    def at(self, quantity: str, x: Array, t: Array) -> Array:
        """Return a quantity at places x [m] and times t [s].

        These are broadcast against each other.
        """
        piece, onward, back = self._left_at(x, t)
        if quantity == "displacement":
            moved = self._displacement(0, piece, onward) + self._displacement(1, piece, back)
            on_way, left = np.asarray(t, float) - onward, np.asarray(t, float) - back
            fallen = self._gains[piece] * (self.transits[piece] * np.asarray(t, float) + on_way * left)
            return np.asarray(self.offset[piece] + moved + fallen)
        to_right, to_left = self.velocities(x, t)
        if quantity == "velocity":
            return to_right + to_left
        return np.asarray(self.factors[quantity][piece] * (to_right - to_left))

    def _left_at(self, x: Array, t: Array) -> tuple[NDArray[int64], Array, Array]:
        """Return pieces of places, and times when waves left their nodes [s].

        At a node the piece is the right one.
        """
        places, instants = np.broadcast_arrays(np.asarray(x, float), np.asarray(t, float))
        slack = 1e-12 * self.length
        piece = np.clip(np.searchsorted(self.starts, places + slack, side="right") - 1, 0, self.starts.size - 1)
        share = np.clip((places - self.starts[piece]) / self.lengths[piece], 0.0, 1.0)
        transit = self.transits[piece]
        return piece, instants - share * transit, instants - (1.0 - share) * transit

    def _displacement(self, side: int, piece: NDArray[int64], t: Array) -> Array:
        at = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, self.times.size - 2)
        low, high, moved = self.times[at], self.times[at + 1], self.moved[side]
        share = np.clip((t - low) / (high - low), 0.0, 1.0)
        return np.asarray((1.0 - share) * moved[piece, at] + share * moved[piece, at + 1])

    def _velocity(self, side: int, piece: NDArray[int64], t: Array) -> Array:
        """Return straight lines between the mean velocities at the middles of steps."""
        middles, lengths, moved = self._middles, self._steps, self.moved[side]
        at = np.clip(np.searchsorted(middles, t, side="right") - 1, 0, middles.size - 2)
        share = np.clip((t - middles[at]) / (middles[at + 1] - middles[at]), 0.0, 1.0)
        low = (moved[piece, at + 1] - moved[piece, at]) / lengths[at]
        high = (moved[piece, at + 2] - moved[piece, at + 1]) / lengths[at + 1]
        return np.asarray((1.0 - share) * low + share * high)
