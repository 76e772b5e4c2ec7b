"""Stored and lost energy, and permanent sets, of contacts with branches."""

from __future__ import annotations

import numpy as np

from impactlab.exact.results.signals import Signals, clenshaw, gauss, sizes_of
from impactlab.exact.setup.branch_tables import ACTS, DAMPING, STIFFNESS
from impactlab.types import Array, Ints


class BranchContact:
    """The states of a contact with branches over time, with its energies.

    A state begins with a change of branch; between two of them the static force is linear in the approach.
    """

    def __init__(self, signals: Signals, contact: int) -> None:
        log = signals.log
        begin, events = log.begins[contact], log.events[: log.state["events"]]
        found = events[(events["contact"] == contact) & (events["branch"] >= 0)]
        self.number, left, right = contact, int(begin["left"]), int(begin["right"])
        self.gap, self.elastic, self.kept = (float(begin[name]) for name in ("gap", "elastic", "kept"))
        self.places = signals.displacement(left), signals.displacement(right)
        self.rates = signals.velocity(left), signals.velocity(right)
        self.begin = max(0.0, float(self.rates[0].start[0]))  # s; the log of a long run begins later
        self.time = np.concatenate([[self.begin], found["time"]])  # (states,) s, at which each begins
        self.branch, self.constant, self.set = (
            np.concatenate([[begin[name]], found[name]]) for name in ("branch", "constant", "set")
        )
        table = log.memory.stack[self.branch]
        self.stiffness, self.damping, self.acts = table[:, STIFFNESS], table[:, DAMPING], table[:, ACTS] == 1.0
        self.yields = self.acts & (self.stiffness != self.elastic)
        self.follows = ~self.acts & (self.stiffness == self.elastic)  # unloaded by its dashpot, which takes its energy

    def states(self, t: Array) -> Ints:
        """Return the number of the state at every time, that after a change."""
        return np.maximum(np.searchsorted(self.time, t + self.rates[0].tolerance, side="right") - 1, 0)

    def at(self, state: Ints, t: Array) -> tuple[Array, Array]:
        """Return static force [N] and set [m] of states at times, shape of both."""
        approach = self.places[0](t) - self.places[1](t) - self.gap
        force = self.constant[state] + self.stiffness[state] * approach
        return force, np.where(self.yields[state], approach - force / self.elastic, self.set[state])

    def sets(self, t: Array) -> Array:
        """Return the set [m], shape of t."""
        return self.at(self.states(t), t)[1]

    def _held(self, force: Array, at: Array) -> Array:
        return np.asarray(0.5 * force * force / self.elastic + 0.5 * self.kept * at * at)

    def held(self, t: Array) -> Array:
        """Return the energy of the spring [J], shape of t."""
        return self._held(*self.at(self.states(t), t))

    def _slid(self, state: Ints, t: Array) -> Array:
        """Return the loss of the slider within states [J].

        It is from the start of each state to a time in it, shape of both. Force and set are linear in the approach, so
        its work is the mean of two forces times the way of the slider.
        """
        f0, s0 = self.at(state, self.time[state])
        f1, s1 = self.at(state, t)
        slid = 0.5 * (f0 + f1) * (s1 - s0) - 0.5 * self.kept * (s1 * s1 - s0 * s0)
        relaxed = self._held(f0, s0) - self._held(f1, s1)
        return np.asarray(np.where(self.yields[state], slid, np.where(self.follows[state], relaxed, 0.0)))

    def _damped(self, piece: Ints, until: Array, size: int | None = None) -> Array:
        """Return the loss of the dashpot within pieces [J].

        It is from the start of each piece to a time in it, shape of both (n,).
        """
        left, right = self.rates
        x, w = gauss((size or max(len(left.table), len(right.table))) + 1)
        begin = np.maximum(left.start[piece], self.begin)
        state = self.states(0.5 * (left.start[piece] + left.stop[piece]))
        half = 0.5 * (until - begin)
        at = begin[:, None] + half[:, None] * (x + 1.0)
        start, stop = left.start[piece][:, None], left.stop[piece][:, None]
        y = (2.0 * at - start - stop) / (stop - start)
        wide = piece[:, None]
        rate = clenshaw(left.table[:size], wide, y) - clenshaw(right.table[:size], wide, y)
        return np.asarray(np.where(self.acts[state], self.damping[state], 0.0) * ((rate * rate) @ w) * half)

    def lost(self, t: Array) -> Array:
        """Return the loss so far [J], shape of t (n,)."""
        every = np.arange(len(self.time))
        whole = np.zeros(len(every))
        if len(every) > 1:
            whole[1:] = np.cumsum(self._slid(every[:-1], self.time[1:]))
        state = self.states(t)
        total = whole[state] + self._slid(state, t)
        if np.any(self.damping > 0.0):
            stops = self.rates[0].stop
            each, sizes = np.zeros(len(stops)), sizes_of(self.rates[0].table, self.rates[1].table)
            for size in np.unique(sizes).tolist():
                pieces = np.flatnonzero((sizes == size) & (stops > self.begin))
                each[pieces] = self._damped(pieces, stops[pieces], size)
            piece = self.rates[0].pieces(t)
            begin = np.maximum(self.rates[0].start, self.begin)
            total = total + np.concatenate([[0.0], np.cumsum(each)])[piece]
            total = total + self._damped(piece, np.maximum(t, begin[piece]))
        return np.asarray(total)
