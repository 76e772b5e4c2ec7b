"""Influence of other bodies, links and end forces on a collision of two bodies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.types import Array

MAX_SHARE = 0.05  # of the impulse of a collision, given by others: a restitution changes by up to twice as much
PUSH_SAMPLES = 1001  # of an end force in a collision


class Periods(NamedTuple):
    """Periods of one contact in order, shape (n,); they do not overlap."""

    starts: Array  # s
    ends: Array  # s; inf of one that is closed at the end of the run
    given: Array  # (n + 1,) N s, sums of the sizes of the impulses before each

    def given_in(self, start: float, end: float) -> float:
        """Return the sum of impulse sizes of periods that reach into a time [N s]."""
        first, last = np.searchsorted(self.ends, start, "right"), np.searchsorted(self.starts, end)
        return float(self.given[last] - self.given[first]) if last > first else 0.0


class Others:
    """All that acts on bodies of a run beside the contacts of a pair."""

    def __init__(self, history: AbstractHistory) -> None:
        self.scene, self.history = history.scene, history
        self._links = {link.name for link in history.links}
        self._known: dict[str, Periods] = {}  # by contact

    def part_in(self, pair: tuple[str, str], times: tuple[float, float], impulse: float) -> str | None:
        """Return the text that names the other body or force that acts in a collision, or None.

        Parts of less than `MAX_SHARE` of the impulse of their collision [N s] do not count.
        """
        for name in pair:
            body, least = self.scene.bodies[name], MAX_SHARE * abs(impulse)
            if not body.moves:
                continue
            if third := self.touched(name, pair, *times, least):
                return f"'{name}' also touches '{third}' meanwhile"
            pushed = sum(abs(end.force) for _, end in body.ends) * (times[1] - times[0])
            for _, load in body.loads:
                instants = np.linspace(*times, PUSH_SAMPLES)
                pushed += float(np.mean(np.abs(load.at(instants)))) * (times[1] - times[0])
            if pushed > least:
                return f"an end force acts on '{name}' meanwhile"
        return None

    def touched(self, name: str, pair: Sequence[str], start: float, end: float, least: float = 0.0) -> str | None:
        """Return the third body of largest impulse on a body, or None.

        It is None if all others give at most ``least``. Impulses are sums of sizes [N s]. Of contacts that reach beyond
        the time, their whole impulse counts.
        """
        given: dict[str, float] = {}
        for _, contact in self.scene.met_by(name):
            bodies = contact.left.body, contact.right.body
            if {*bodies} == {*pair}:
                continue
            if contact.shared_name in self._links:
                before, after = (self.history.impulse_until(contact.name, time) for time in (start, end))
                met = abs(after - before)
            else:
                met = self._periods(contact.name).given_in(start, end)
            third = bodies[1] if bodies[0] == name else bodies[0]
            given[third] = given.get(third, 0.0) + met
        return max(given, key=lambda third: given[third]) if sum(given.values()) > least else None

    def _periods(self, contact: str) -> Periods:
        if contact not in self._known:
            spans = sorted(self.history.spans(contact), key=lambda span: span.start)
            self._known[contact] = Periods(
                starts=np.array([span.start for span in spans]),
                ends=np.array([span.until(math.inf) for span in spans]),
                given=np.cumsum([0.0, *(abs(span.impulse) for span in spans)]),
            )
        return self._known[contact]
