"""Peak contact forces, with the neighbourhood of jumps of the force left out."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.power_law import AbstractHystereticLaw
from impactlab.history.base import AbstractHistory, Event
from impactlab.metrics.fronts import MIN_JUMP, Samples, jumps_at, returns
from impactlab.metrics.norms import NEAR_JUMP, largest, midpoints
from impactlab.scene.problem import Contact, Scene
from impactlab.types import Array

GRID = 2000  # equal cells of the run on which a peak is searched, besides the instants below
MAX_SPANS = 20  # periods of contact, those of the largest impulse, that are searched in a grid of their own
PER_SPAN = 200  # cells of that grid
MAX_MAXIMA = 16  # of these samples, around which the peak of a force that is known at any time is sought further
FINER, REFINEMENTS = 10, 8  # cells of a finer grid between two samples; grids in each other, to 5^-8 of a cell
MIN_PEAK = 1e-9  # of the largest peak: smaller ones, as ahead of a wave in a chain, are rounding
MAX_ECHOES = 1000  # round trips after a touch whose fronts are left out
MAX_FURTHER, MAX_SUMS = 200, 5000  # echoes from joints and through contacts, beyond which none of these is left out

Laws = Mapping[str, AbstractContactLaw]  # by name of the contact


def peak_force(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> float | None:
    """Return the relative error of the peak force of a contact, the largest over contacts.

    As in `force_away_from_jumps`, 0.05 T on either side of each jump of the reference's force is left out; 0.05 of the
    longest period of contact in a scene without a rod or beam, which has no T. Peaks below `MIN_PEAK` of the largest
    are left out. None where a law gives impulses alone.
    """
    peaks = []
    laws = history.method.laws
    for contact in scene.contacts:
        if not laws[contact.name].answers_force:
            return None
        away = near_jumps(reference, scene, laws, contact)
        law = laws[contact.name]
        peak = _compared_peak(history, scene, contact, law, away)
        wanted = peak if history is reference else _compared_peak(reference, scene, contact, law, away)
        peaks.append((peak, wanted))
    least = MIN_PEAK * max((wanted for _, wanted in peaks), default=0.0)
    return largest([abs(peak - wanted) / wanted if wanted > least else None for peak, wanted in peaks])


def _compared_peak(
    history: AbstractHistory, scene: Scene, contact: Contact, law: AbstractContactLaw, left_out: Array
) -> float:
    """Return the largest force of a contact outside intervals (k, 2) [s], that of all steps where it is the peak."""
    if history.dt is not None and has_largest_step(scene, law, left_out):
        return largest_step(history, contact)
    return find_peak(history, contact, left_out, law.hard).force


def has_largest_step(scene: Scene, law: AbstractContactLaw, left_out: Array) -> bool:
    """Return whether the peak of a contact of a stepped run is the largest force of all its steps.

    It is so between rigid bodies. Beside elements and modes forces oscillate from step to step, and links have no
    periods of contact.
    """
    return not left_out.size and not law.two_sided and not scene.elastic


def largest_step(history: AbstractHistory, contact: Contact) -> float:
    """Return the largest force of all steps of a run [N], also of those between records."""
    return max((span.peak_force or 0.0 for span in history.spans(contact.name)), default=0.0)


class Peak(NamedTuple):
    """The largest force of a contact, and its time."""

    time: float  # s
    force: float  # N


def find_peak(
    history: AbstractHistory, contact: Contact, left_out: Array, hard: bool, cells: int = GRID, per_span: int = PER_SPAN
) -> Peak:
    """Return the largest force of a contact outside intervals (k, 2) [s]; see `smooth_force`.

    It is sought in the middles of steps, and in so many equal cells of the run and of each period of contact; that of a
    run without steps of its own also between these.
    """
    name = f"force:{contact.name}"
    spans = sorted(history.spans(contact.name), key=lambda each: -each.impulse)
    # First of all the middles of steps: of all places in a step with the largest force, its middle is the peak.
    ends = np.append(np.ravel(left_out), history.duration)
    grids = [_instants(history, name), midpoints(history.duration, cells), ends]
    for span in spans[:MAX_SPANS]:
        grids.append(span.start + midpoints(span.until(history.duration) - span.start, per_span))
    t = np.concatenate(grids)
    t = t[(t >= 0.0) & (t <= history.duration)]
    t = outside(t, left_out)
    if not t.size:
        return Peak(0.0, 0.0)
    values = smooth_force(history, t, contact, hard)
    at = int(np.argmax(values))
    peak = Peak(float(t[at]), max(0.0, float(values[at])))
    return peak if history.dt is not None else _refined(history, name, t, values, left_out, peak)


def outside(t: Array, intervals: Array) -> Array:
    """Return those of times (n,) that lie in none of several intervals (k, 2) [s], or at their ends."""
    if not intervals.size:
        return t
    starts, ends = intervals[np.argsort(intervals[:, 0], kind="stable")].T
    begun = np.searchsorted(starts, t)  # that begin before each time: the latest end of these decides
    latest = np.append(-math.inf, np.maximum.accumulate(ends))
    return t[latest[begun] <= t]


def _refined(history: AbstractHistory, name: str, t: Array, values: Array, left_out: Array, peak: Peak) -> Peak:
    """Return the largest force between samples, for a force known at any time.

    The largest local maxima of the samples are sought again in ever finer grids between their neighbours: a kink, where
    a wave arrives, lies up to half a cell from the nearest sample, and the force there differs by its slope times that.
    """
    order = np.argsort(t, kind="stable")
    t, values = t[order], values[order]
    before, after = np.append(t[0], t[:-1]), np.append(t[1:], t[-1])
    if left_out.size:  # the last end up to a time, the first start from it on
        starts, ends = np.sort(left_out, axis=0).T
        before = np.maximum(before, np.append(-math.inf, ends)[np.searchsorted(ends, t, "right")])
        after = np.minimum(after, np.append(starts, math.inf)[np.searchsorted(starts, t)])
    rising, falling = np.append(-math.inf, values[:-1]), np.append(values[1:], -math.inf)
    maxima = np.flatnonzero((values > 0.0) & (values >= rising) & (values >= falling))
    maxima = maxima[np.argsort(-values[maxima], kind="stable")[:MAX_MAXIMA]]
    low, high, rows = before[maxima], after[maxima], np.arange(maxima.size)
    for _ in range(REFINEMENTS if maxima.size else 0):
        grids = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, FINER + 1)
        forces = history.evaluate(grids.ravel(), name).reshape(grids.shape)
        best = np.argmax(forces, axis=1)
        row = int(np.argmax(forces[rows, best]))
        peak = max(peak, Peak(float(grids[row, best[row]]), float(forces[row, best[row]])), key=lambda each: each.force)
        low, high = grids[rows, np.maximum(best - 1, 0)], grids[rows, np.minimum(best + 1, FINER)]
    return peak


def _instants(history: AbstractHistory, name: str) -> Array:
    """Return the middles of steps or the jumps of a force, (n,) [s].

    A stepped force has steps; any other has jumps.
    """
    ends = history.jumps(name)
    return ends if history.dt is None else np.minimum(0.5 * (ends[1:] + ends[:-1]), history.duration)


def smooth_force(history: AbstractHistory, t: Array, contact: Contact, hard: bool) -> Array:
    """Return a contact force [N], of hard contacts linear between middles of steps."""
    name = f"force:{contact.name}"
    middles = _instants(history, name)
    if history.dt is None or not hard or middles.size < 2:
        return history.evaluate(t, name)
    return np.interp(t, middles, history.evaluate(middles, name))


def near_jumps(
    history: AbstractHistory,
    scene: Scene,
    laws: Laws,
    contact: Contact,
    least: float = MIN_JUMP,
    samples: Samples | None = None,
) -> Array:
    """Return the intervals around jumps of a contact's force, shape (k, 2) [s].

    They are joined where they overlap. The jumps of an exact history are known. Those of a stepped force are smeared
    over steps: they are supposed to be where faces touch whose law makes the force jump, and after each round trip of
    the bodies behind the faces; where an end force or a held end starts a front at t = 0, where that arrives. Of these
    instants those count at which the force is seen to jump (`impactlab.metrics.fronts.jumps_at`): a front may be spent,
    or have met another one, and an end force may begin softly. A touch within 0.05 T of the opening before it does not
    count: faces that chatter touch so often that no force would be left to compare. The intervals of a stepped force
    are shorter at either end by a step, to which its touches are known: what rings just outside the intervals of the
    exact force is compared, too.

    Parameters
    ----------
    history, scene, laws, contact
        The run, its scene, the laws by name of the contact, and the contact.
    least : float
        Share of the largest force below which a supposed jump does not count.
    samples : Samples, optional
        Force of a stepped run in the middles of its steps; read from ``history`` if not given.
    """
    unit = scene.round_trip if math.isfinite(scene.round_trip) else longest_contact(history, contact)
    if history.dt is None and history.cost.rhs_evaluations is None:
        return _around(history.jumps(f"force:{contact.name}"), NEAR_JUMP * unit)
    reach, law = NEAR_JUMP * unit, laws[contact.name]
    follows = isinstance(law, AbstractHystereticLaw)  # jumps of others' fronts
    touches = _lasting(history, laws, reach) if law.force_jumps or follows else []
    by_fronts = follows and (touches or scene.fronts_at_start)
    if not law.force_jumps and not by_fronts:
        return np.zeros((0, 2))
    if samples is None:
        samples = _samples(history, f"force:{contact.name}")
    plain, further = _fronts(history, scene, touches, contact), _echoes(history, scene, touches, contact)
    at = np.concatenate((plain, further))
    jumps, seen = jumps_at(samples, at, reach, least)
    counts = jumps | ~seen & (np.arange(at.size) < plain.size)
    return _around(np.sort(at[counts]), max(reach - (history.dt or 0.0), 0.5 * reach))


def _samples(history: AbstractHistory, name: str) -> Samples:
    """Return a force in the middles of steps; none of a run without any."""
    t = np.zeros(0) if history.dt is None else _instants(history, name)
    return Samples(t, history.evaluate(t, name) if t.size else t)


def _around(at: Array, reach: float) -> Array:
    """Return intervals (k, 2) [s] of a length [s] on either side of instants."""
    return _joined(np.column_stack((at - reach, at + reach)))


def _lasting(history: AbstractHistory, laws: Laws, least: float) -> list[Event]:
    """Return the touches that make a force jump, without those of chatter.

    A touch within ``least`` [s] after the contact's opening is left out.
    """
    found, opened = [], dict[str, float]()
    for event in history.events:
        if event.kind == "open":
            opened[event.contact] = event.time
            continue
        lasts = event.time - opened.get(event.contact, -math.inf) > least
        if event.kind == "close" and laws[event.contact].force_jumps and lasts:
            found.append(event)
    return found


def _fronts(history: AbstractHistory, scene: Scene, touches: Sequence[Event], contact: Contact) -> Array:
    """Return the instants of touches of a contact and of echoes, (k,), rising [s].

    Echoes come after round trips. With them those of fronts that come from the other ends of the two bodies.
    """
    here, away = _starts(scene, touches, contact)
    found = set(here)
    for trip in (sum(near) for near in _trips(scene, contact)):
        for start in (*here, *(start + 0.5 * trip for start in away)):
            count = min(int((history.duration - start) / trip), MAX_ECHOES)
            found |= {start + number * trip for number in range(count + 1)}
    return np.array(sorted(found))


def _echoes(history: AbstractHistory, scene: Scene, touches: Sequence[Event], contact: Contact) -> Array:
    """Return the instants at which further echoes may arrive, (k,) [s].

    They come from joints or out of one body into the other. It is empty where they are too many to be distinguished.
    """
    here, away = _starts(scene, touches, contact)
    trips = _trips(scene, contact)
    starts = [(start, [(near, False) for near in trips]) for start in here]
    for own, start in itertools.product(range(len(trips)), away):
        through = [(near, place == own) for place, near in enumerate(trips)]
        starts.append((start + 0.5 * sum(trips[own]), through))
    found = list[float]()
    for start, bodies in starts:
        left = history.duration - start
        if left < 0.0:
            continue
        if math.prod(left / trip + 1.0 for near, _ in bodies for trip in near) > MAX_SUMS:
            return np.zeros(0)
        sums = itertools.product(*(returns(near, left, through) for near, through in bodies))
        found += [start + total for total in map(sum, sums) if total <= left]
        if len(found) > MAX_FURTHER:
            return np.zeros(0)
    return np.unique(found)


def _starts(scene: Scene, touches: Sequence[Event], contact: Contact) -> tuple[set[float], set[float]]:
    """Return the instants of fronts at a contact and at its bodies' other ends [s]."""
    here = {event.time for event in touches if event.contact == contact.name}
    away = {event.time for event in touches} - here
    return here, away | {0.0} if scene.fronts_at_start else away


def _trips(scene: Scene, contact: Contact) -> list[list[float]]:
    """Return round-trip times [s] of the segments of both bodies that have waves, nearest first."""
    found = []
    for point in contact.faces:
        body = scene.bodies[point.body].waves
        if body is not None:
            near = [2.0 * segment.length / segment.wave_speed for segment in body.segments]
            found.append(near[::-1] if point.x > 0.5 * body.length else near)
    return found


def longest_contact(history: AbstractHistory, contact: Contact) -> float:
    """Return the length of the longest period of contact [s]; 0 without one."""
    lengths = (span.until(history.duration) - span.start for span in history.spans(contact.name))
    return max(lengths, default=0.0)


def _joined(intervals: Array) -> Array:
    """Return rising intervals, shape (n, 2), with those that overlap made one."""
    joined: list[list[float]] = []
    for start, end in intervals:
        if joined and start <= joined[-1][1]:
            joined[-1][1] = end
        else:
            joined.append([start, end])
    return np.array(joined).reshape(-1, 2)
