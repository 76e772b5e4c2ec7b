"""The least and the largest value of a channel over a run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from impactlab.scene.problem import Scene
from impactlab.types import Array

POINTS = 6001  # equal instants of a run at which extremes are sought, besides those of the history
PER_CONTACT = 257  # instants of a period of contact, which may be shorter than those are apart
MAX_IN_CONTACT = 20_000  # of all periods


class Period(Protocol):
    """A period of contact."""

    @property
    def start(self) -> float:
        """Its start [s]."""

    @property
    def peak_force(self) -> float | None:
        """Its largest force [N]; None where the law has no force."""

    def until(self, duration: float) -> float:
        """Return its end [s]."""


class Link(Protocol):
    """The extreme forces of a link [N]."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def largest(self) -> float:
        """The largest."""

    @property
    def smallest(self) -> float:
        """The smallest."""


class Run(Protocol):
    """The parts of a history that extremes are read from."""

    scene: Scene
    duration: float  # s
    dt: float | None  # s

    @property
    def links(self) -> Sequence[Link]:
        """Results of links."""

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        """Return a channel at times [s]."""

    def turning_times(self, channel: str) -> Array:
        """Return instants at which a channel may be largest or least [s]."""

    def spans(self, contact: str) -> Sequence[Period]:
        """Return the periods of a contact."""

    def spans_of(self, contacts: Iterable[str]) -> Sequence[Period]:
        """Return the periods of several contacts."""


def extremes(history: Run, channel: str) -> tuple[float, float]:
    """Return the least and the largest value of a channel, in SI units.

    They are sought at equal instants, at those at which the channel jumps, has a kink, or was recorded, and within the
    periods of contact of its contact or body. The peaks of periods of contact, and of links, count for their forces.
    """
    times = (np.linspace(0.0, history.duration, POINTS), history.turning_times(channel), _in_contact(history, channel))
    values = np.append(history.evaluate(np.concatenate(times), channel), _peaks(history, channel))
    return float(values.min()), float(values.max())


def _in_contact(history: Run, channel: str) -> Array:
    """Return instants of periods of contact that move a channel, (n,) [s].

    They are those of an exact run. A run by steps is known at its records, which are among its turning times.
    """
    _, named, rest = channel.partition(":")
    if history.dt is not None or not named:
        return np.zeros(0)
    scene = history.scene
    own = [contact.name for contact in scene.contacts if rest in (contact.name, contact.group)]
    body = rest if rest in scene.bodies else rest.rpartition("@")[0]
    spans = history.spans_of(own or [contact.name for _, contact in scene.met_by(body)])
    if not spans:
        return np.zeros(0)
    share = np.linspace(0.0, 1.0, min(PER_CONTACT, max(3, MAX_IN_CONTACT // len(spans))))
    starts, ends = np.array([(span.start, span.until(history.duration)) for span in spans]).T
    return np.asarray((starts[:, None] + (ends - starts)[:, None] * share).ravel())


def _peaks(history: Run, channel: str) -> list[float]:
    """Return the extreme forces of a contact's periods, or of a link [N].

    A run finds them as it goes.
    """
    quantity, _, name = channel.partition(":")
    if quantity != "force":
        return []
    if name in history.scene.contact_names:
        peaks = [span.peak_force for span in history.spans(name) if span.peak_force is not None]
        if peaks:
            return peaks
    return [force for link in history.links if link.name == name for force in (link.smallest, link.largest)]
