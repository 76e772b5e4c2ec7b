"""Scenes of one pattern marched in one memory, with integrated signals, compiled.

For fits: a trial changes numbers of the scene alone. The march is `impactlab.exact.march.advance`, which single runs
use; the energy balance of a trial is not checked, that of the run with the fitted numbers is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from impactlab.errors import CaseError
from impactlab.exact import march
from impactlab.exact.arrays import CLOSE, DONE, MORE_EVENTS, MORE_POOL, MORE_RECORDS, MarchArrays
from impactlab.exact.batch.marcher import MAX_POOL, Built, prepared
from impactlab.exact.batch.pattern import Pattern
from impactlab.exact.batch.points import MAX_INTERVALS
from impactlab.exact.batch.writing import write
from impactlab.exact.kernel import MAX_DEPTH, integrate, value
from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.results.signals import AbstractSignals
from impactlab.exact.setup.network import Place, grown
from impactlab.numerics.addresses import entered
from impactlab.numerics.compiling import EXACT_ENTRY
from impactlab.types import Array

SUMMED = {"velocity", "strain", "stress", "force"}  # quantities at a place of a rod with exact integrals

Integral = Callable[[Array, bool], Array]
"""The integral of a channel from t = 0 to increasing times (n,), or, where the flag is not set, its values."""


@EXACT_ENTRY
def write_network(m: MarchArrays, q: Pattern, p: Array, places: Array, speeds: Array, most: int) -> bool:
    """Write the network of a vector as `writing.write`; return whether it has the pattern."""
    return bool(write(m, q, p, places, speeds, most))


@EXACT_ENTRY
def read_row(m: MarchArrays, j: int, row: int, times: Array, summed: bool, out: Array) -> None:
    """Write a row of junction j's records at increasing times, or its integral.

    The integral is from the first piece on.
    """
    junction, tolerance = m.junctions[j], m.state[0].tolerance
    room = len(m.pieces) // len(m.junctions)
    given, series = m.stack[MAX_DEPTH - 1], m.stack[MAX_DEPTH]
    total, i = 0.0, 0
    for r in range(junction.records):
        piece = m.pieces[room * j + r]
        n, width = piece.size, piece.stop - piece.start
        at = piece.offset + row * n
        for k in range(n):
            given[k] = m.pool[at + k]
        if summed:
            integrate(given, n, 0.5 * width, total, series)
            n += 1
        else:
            for k in range(n):
                series[k] = given[k]
        last = r == junction.records - 1
        while i < len(times) and (last or times[i] + tolerance < piece.stop):
            out[i] = value(series, n, (2.0 * times[i] - piece.start - piece.stop) / width)
            i += 1
        total = value(series, n, 1.0)


class Rows(AbstractSignals[tuple[int, int]]):
    """The junction and the row of every signal."""

    def _read(self, j: int, row: int) -> tuple[int, int]:
        return j, row


class Single:
    """A memory in which scenes of one pattern march one after the other."""

    def __init__(self, made: Built, base: ContinuousHistory) -> None:
        self.log, self.pattern, self.base = prepared(made.log, made.pattern), made.pattern, base
        self._room = np.zeros(len(made.pattern.cuts)), np.zeros(len(made.log.ends))
        self._written = np.zeros(0)
        self._done = False

    def march(self, vector: Array) -> bool:
        """March the scene of a vector; return whether its march ended.

        Nothing is done if memory holds it. The result is False where there is no such scene, too.
        """
        if not np.array_equal(vector, self._written):
            self._written = vector.copy()
            self._done = self._marched(vector)
        return self._done

    def _marched(self, vector: Array) -> bool:
        while True:
            if not entered(write_network, self.log.memory, self.pattern, vector, *self._room, MAX_INTERVALS):
                return False
            status = march.march(self.log)
            if status not in (MORE_RECORDS, MORE_POOL, MORE_EVENTS) or 2 * len(self.log.pool) > MAX_POOL:
                return status == DONE
            self.log = grown(self.log, status)

    @property
    def duration(self) -> float:
        """Duration of the scene that was marched last [s]."""
        return float(self.log.state["duration"])

    @property
    def closings(self) -> tuple[str, ...]:
        """Names of the contacts that closed in the scene that was marched last, in order."""
        events = self.log.events[: int(self.log.state["events"])]
        closed = np.sort(events[(events["kind"] == CLOSE) & (events["time"] <= self.duration)], order="time")
        places = self.base.layout.places[closed["contact"]]
        return tuple(self.base.scene.contacts[place].name for place in places.tolist())

    def row(self, j: int, row: int, times: Array, summed: bool) -> Array:
        """Return a row of junction j's records at increasing times (n,).

        If ``summed``, return its integral from its first piece.
        """
        out = np.empty(len(times))
        entered(read_row, self.log.memory, j, row, times, summed, out)
        return out

    def reader(self, channel: str, lengths: bool) -> Integral | None:
        """Return the integral of a channel of the last scene marched.

        None where there is none. ``lengths``: whether lengths of rods may differ from those of the first scene.
        """
        base = self.base
        quantity, _, rest = channel.partition(":")
        names = [base.scene.contacts[place].name for place in base.layout.places.tolist()]
        if quantity == "force" and rest in names:
            return self._force(names.index(rest))
        name, at, _ = rest.rpartition("@")
        body = base.scene.bodies.get(name if at else rest)
        if at and name in base.layout.links and quantity in SUMMED and self._is_plain(name, quantity):
            place = base.place(channel)
            moved = lengths and (place.link.x > 0.0 or place.way == place.link.transit)
            return None if moved else self._on_rod(quantity, place)
        if quantity == "velocity" and body is not None and rest in base.layout.nodes and rest not in base.layout.links:
            return self._mass(base.layout.nodes[rest][0])
        return None

    def _is_plain(self, name: str, quantity: str) -> bool:
        """Return whether a quantity is that of a rod itself.

        No number of the scene scales it.
        """
        body = self.base.scene.bodies[name]
        return quantity in body.quantities and body.reading(quantity) == (quantity, 1.0)

    def _force(self, contact: int) -> Integral:
        row = Rows(self.log).force(contact)

        def force(times: Array, summed: bool) -> Array:
            found = self.row(*row, np.concatenate([[0.0], times]), summed)
            return found[1:] - found[0] if summed else found[1:]

        return force

    def _mass(self, node: int) -> Integral:
        rows = Rows(self.log)
        rate, moved = rows.velocity(node), rows.displacement(node)

        def velocity(times: Array, summed: bool) -> Array:
            if not summed:
                return self.row(*rate, times, False)
            found = self.row(*moved, np.concatenate([[0.0], times]), False)
            return np.asarray(found[1:] - found[0])

        return velocity

    def _on_rod(self, quantity: str, place: Place) -> Integral:
        link, x = place.link, place.way * place.link.segment.wave_speed
        at_end = place.way == link.transit
        rows, sent = Rows(self.log), (link.left_end, link.right_end)
        waves, carried = [rows.wave(end) for end in sent], [rows.carried(end) for end in sent]
        of_links: np.ndarray[Any, Any] = np.asarray(self.pattern.links)
        first = int(of_links["segment"][of_links["left_end"] == link.left_end][0])

        def on_rod(times: Array, summed: bool) -> Array:
            _, area, young, density = self._written[first : first + 4].tolist()
            speed, transit = float(np.sqrt(young / density)), float(self.log.ends["transit"][link.left_end])
            way = transit if at_end else x / speed
            if way > transit:
                text = f"the place x = {x:.6g} m lies beyond the end of the rod, {speed * transit:.6g} m"
                raise CaseError(text, remedy="Give a longer rod, or another place.")
            g = float(self.log.state["gravity"])
            sides = []
            for row, lag in zip(carried if summed else waves, (way, transit - way), strict=True):
                found = self.row(*row, np.concatenate([[0.0], times]) - lag, False)
                gained = 0.5 * g * lag
                sides.append(found[1:] - found[0] + gained * times if summed else found[1:] + gained)
            right, left = sides
            if quantity == "velocity":
                return right + left
            factor = 1.0 / speed if quantity == "strain" else density * speed * (area if quantity == "force" else 1.0)
            return np.asarray(factor * (right - left))

        return on_rod
