"""Mean velocity and energy of a body in a run, from the impulses that it was given and from the record."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence

import numpy as np

from impactlab.history.base import AbstractHistory

MAX_BESIDE = 0.02  # of a time span, by which instants of a recorded energy may lie beside it where others act meanwhile
MAX_CHANGE = 0.2  # of the largest relative velocity, over two intervals of the record: between them it is not known
MIN_CHANGE = 1e-11  # of the energy of a body: a smaller change is rounding


class BodyMotion:
    """The motion of a body as a whole, and the impulses of its contacts in order of their starts.

    Parameters
    ----------
    channels : frozenset of str
        Channels of the history; found once for all bodies, as a chain has thousands.
    """

    def __init__(self, history: AbstractHistory, name: str, channels: frozenset[str]) -> None:
        self.scene, self.history, self.name = history.scene, history, name
        self.body = self.scene.bodies[name]
        own = [each for _, each in self.scene.met_by(name)]
        signs = {each.name: float(each.right.body == name) - float(each.left.body == name) for each in own}
        signs = {contact: sign for contact, sign in signs.items() if sign != 0.0}
        # Contacts that may pull have no periods; the sign is that of their force.
        self.links = {link: sign for link, sign in signs.items() if history.method.laws[link].two_sided}
        spans = sorted(history.spans_of(list(signs)), key=lambda span: span.start)
        self.starts = np.array([span.start for span in spans])  # s
        # s, latest end so far; inf while one is closed at the end of the run
        self.ends = np.maximum.accumulate([span.until(math.inf) for span in spans] or [0.0])
        # N s, sum so far, positive to the right; of no contact first
        self.impulses = np.array([0.0, *itertools.accumulate(signs[span.contact] * span.impulse for span in spans)])
        self._velocities: dict[float, float | None] = {}  # m/s, by time: a collision reads each twice
        self._read: dict[str, dict[float, float]] = {}  # values of the record by quantity and time
        self.recorded = frozenset(each for each in ("momentum", "energy", "velocity") if f"{each}:{name}" in channels)

    def read_ahead(self, periods: Iterable[tuple[float, float]], *, energies: bool) -> None:
        """Read the record for the speeds, and energies, at both ends of many periods [s] at once."""
        wanted: dict[str, dict[float, None]] = {}
        for period in periods if self.body.moves and not self.body.changes else ():
            found: list[tuple[str, tuple[float, ...]] | None] = [
                self._record_for(time) for time in period if not self.body.is_held and self._needs_record(time)
            ]
            # Not of exact runs: their quadratures over many intervals at once round in another order.
            if energies and self.history.dt is not None and "energy" in self.recorded and self.body.elastic is not None:
                start, end = max(0.0, period[0]), period[1]
                found.append(("energy", self.history.recorded_around(f"energy:{self.name}", start, end)))
            for quantity, instants in (each for each in found if each is not None):
                wanted.setdefault(quantity, {}).update(dict.fromkeys(instants))
        for quantity, times in wanted.items():
            self._values(quantity, list(times))

    def _values(self, quantity: str, times: Sequence[float]) -> list[float]:
        """Return a recorded quantity of the body at some times [s]."""
        known = self._read.setdefault(quantity, {})
        missing = [time for time in times if time not in known]
        if missing:
            values = self.history.evaluate(missing, f"{quantity}:{self.name}").tolist()
            known.update(zip(missing, values, strict=True))
        return [known[time] for time in times]

    def speed(self, time: float) -> float | None:
        """Return the speed in a collision [m/s].

        It is 0 for a held body, which rests except for its vibration. It is None for a mechanism, whose links move in
        different directions.
        """
        if self.body.changes:
            return None
        return 0.0 if self.body.is_held else self.mean_velocity(time)

    def mean_velocity(self, time: float) -> float | None:
        """Return the momentum over the mass [m/s], None where unknown.

        Of a free body it is the sum of the impulses of contacts, links and loads until then, where those of contacts
        are exact; inside a contact it is that of the record, which is kept at fewer instants, and unknown where it
        changes much between two of them.
        """
        if time not in self._velocities:
            self._velocities[time] = self._mean_velocity(time)
        return self._velocities[time]

    def _mean_velocity(self, time: float) -> float | None:
        body, history = self.body, self.history
        if not body.moves:
            return 0.0
        mass = body.moving_mass
        if not self._needs_record(time):
            begun = int(np.searchsorted(self.starts, time, side="right"))
            impulse = ((mass * self.scene.gravity if body.falls else 0.0) + body.end_force) * time
            impulse += sum(float(load.sampled(self.scene.duration).impulse(np.array(time))) for _, load in body.loads)
            impulse += sum(sign * history.impulse_until(link, time) for link, sign in self.links.items())
            return body.velocity + (float(self.impulses[begun]) + impulse) / mass
        found = self._record_for(time)
        if found is None:
            return None
        quantity, instants = found
        values = self._values(quantity, instants)
        if quantity == "velocity":
            return None if self._changes(values) else values[0]
        now, *around = (momentum / mass for momentum in values)
        return None if self._changes(around) else now

    def _needs_record(self, time: float) -> bool:
        """Return whether the impulses until a time [s] do not give the momentum of a body that moves."""
        begun = int(np.searchsorted(self.starts, time, side="right"))
        if not self.body.is_free or (begun > 0 and bool(self.ends[begun - 1] > time)):
            return True
        return bool(self.links) and time >= self.history.duration and "momentum" in self.recorded

    def _record_for(self, time: float) -> tuple[str, tuple[float, float, float]] | None:
        """Return the quantity of the record that gives a mean velocity, with the time and those around it [s]."""
        history = self.history
        # The velocity of a rigid mass is recorded at more instants than its momentum, of which the last one is known.
        if "velocity" in self.recorded and self.body.elastic is None and time < history.duration:
            rate, last = history.record_rate, history.duration
            apart = 1.0 / rate if rate > 0.0 else 0.0
            before, now, after = (min(max(0.0, t), last) for t in (time - apart, time, time + apart))
            return "velocity", (now, before, after)
        if "momentum" not in self.recorded:
            return None
        around = (
            history.recorded_around(f"momentum:{self.name}", time, time) if time < history.duration else (time,) * 2
        )
        return "momentum", (time, *around)

    def _changes(self, around: Sequence[float]) -> bool:
        """Return whether a velocity [m/s] changes too much between records to be known.

        It is measured against relative velocities: all bodies may move together.
        """
        largest = max(self.scene.fastest_relative, *(abs(each - self.body.velocity) for each in around))
        return max(around) - min(around) > MAX_CHANGE * largest

    def energy_change(self, start: float, end: float) -> float | None:
        """Return the growth of the energy between two times [J].

        The energy of an elastic body is recorded at few instants: it is that of the last one before and the first one
        after. None where something may change it between these and the two times.
        """
        if not self.body.moves:
            return 0.0
        if math.isfinite(self.body.rigid_mass):
            after, before = self.mean_velocity(end), self.mean_velocity(start)
            if after is None or before is None:
                return None
            half = 0.5 * self.body.moving_mass
            return _without_rounding(half * after**2, half * before**2)
        if "energy" not in self.recorded:
            return None
        start, energy = max(0.0, start), f"energy:{self.name}"
        before, after = self.history.recorded_around(energy, start, end)
        if max(start - before, after - end) > MAX_BESIDE * (end - start) and not (
            self._keeps_energy() and self._is_quiet(before, start) and self._is_quiet(end, after)
        ):
            return None
        first, last = self._values("energy", (before, after))
        return _without_rounding(last, first)

    def _keeps_energy(self) -> bool:
        """Return whether only contacts change the energy."""
        body, elastic = self.body, self.body.elastic
        if elastic is None or elastic.is_damped or body.rotation is not None or self.links:
            return False
        pulled = self.scene.gravity != 0.0 and body.falls
        return not pulled and not any(end.kind == "dashpot" or end.is_loaded for _, end in body.ends)

    def _is_quiet(self, start: float, end: float) -> bool:
        """Return whether no contact is closed between two times [s]."""
        begun = int(np.searchsorted(self.starts, end))  # one that closes at the end is not
        return begun == 0 or bool(self.ends[begun - 1] <= start)


def _without_rounding(after: float, before: float) -> float:
    """Return the growth of an energy [J]; 0 where it is rounding."""
    growth = after - before
    return growth if abs(growth) > MIN_CHANGE * max(abs(after), abs(before)) else 0.0
