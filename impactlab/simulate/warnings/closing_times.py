"""Warnings from errors of closing times, by the run alone.

A closing time is known to within the time resolution of a method, and its error shifts the motion after it. Warnings of
the run alone, without a reference: many contacts in a row, faces displaced by contacts that come too late, and contacts
that are themselves not resolved.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from impactlab.history.base import ContactSpan, Warned
from impactlab.history.frame import frames, in_frame, touched_in
from impactlab.metrics.norms import midpoints
from impactlab.scene.facts import moving_faces, round_trips_of
from impactlab.scene.problem import Contact
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.warnings.mesh_dispersion import airy_scale
from impactlab.simulate.warnings.resolvability import COARSE_WARN, finer_by
from impactlab.types import Array

MIN_OPENING = 0.1  # round trips that faces are apart before a contact counts: a contact that chatters is one
SHIFT_WARN = 0.2  # round trips by which the contacts of a run may have shifted the motion after them
MIN_RESOLUTIONS = 3.0  # time resolutions: a contact or opening that is shorter may be of the mesh, without a shape
MOVED_WARN = 2.0  # square mean displacements of a face, by impulses of contacts that are not resolved
MIN_MOTION = 0.05  # of the motion of the body's other faces: a face that moves less is at rest
INSTANTS = 2000  # of the displacement of a face, at most
MIN_INSTANTS = 200


def unplaced(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield the warnings of contacts that shift, displace or move the faces after them."""
    scene = history.scene
    trips = {name: trip.time for name, trip in round_trips_of(scene, scene.contacts).items()}
    if not trips:
        return
    resolutions = {contact.name: history.facts_of(contact).resolution for contact in scene.contacts}
    periods = {contact.name: _periods(history, contact, trips[contact.name]) for contact in scene.contacts}
    dispersed = {contact.name: _dispersed(history, contact, resolutions[contact.name]) for contact in scene.contacts}
    yield from _shifted(history, dispersed, periods, trips)
    late, doubtful = _late(history, resolutions, periods), _doubtful(history, resolutions)
    if not late and not doubtful.passed:  # so it is of most runs: no displacement is read
        return
    faces = [(point.body, name) for point in scene.faces for name in moving_faces(scene, point)]
    t = midpoints(history.duration, _instants(history, [name for _, name in faces]))
    found = frames(scene, touched_in(history))
    motions: dict[str, dict[str, Array]] = {}  # m, of each body by channel, in the frame of the bodies that interact
    for body, name in faces:
        motions.setdefault(body, {})[name] = in_frame(found, name, t, history.evaluate(t, name))
    yield from _displaced(history, late, motions)
    yield from _chattering(doubtful, motions)


def _dispersed(history: AbstractRecordedHistory, contact: Contact, resolution: float) -> float:
    """Return the error of the times of a contact [s].

    It is the time resolution, or the time in which a front passes that a mesh has dispersed since the first touch.
    """
    rods = [body for point in contact.faces if (body := history.scene.bodies[point.body].elastic) is not None]
    last = max((span.until(history.duration) for span in _spans(history, contact)), default=0.0)
    return max(resolution, airy_scale(history, rods, last))


def _instants(history: AbstractRecordedHistory, faces: Iterable[str]) -> int:
    """Return the number of instants at which face displacements are read, no more than a short run has records."""
    records = max((history.recorded[name].times.size for name in faces if name in history.recorded), default=0)
    return min(INSTANTS, max(records, MIN_INSTANTS))


def _periods(history: AbstractRecordedHistory, contact: Contact, trip: float) -> list[tuple[float, float | None]]:
    """Return start and end [s] of the periods of a contact.

    Periods that chatter count as one; an impulse law has none. ``trip`` is the round trip of the contact [s].
    """
    periods: list[tuple[float, float | None]] = []
    for span in _spans(history, contact):
        last = periods[-1][1] if periods else -math.inf
        if last is None or span.start - last <= MIN_OPENING * trip:
            periods[-1] = periods[-1][0], span.end
        else:
            periods.append((span.start, span.end))
    return periods


def _spans(history: AbstractRecordedHistory, contact: Contact) -> list[ContactSpan]:
    return [span for span in history.spans(contact.name) if span.kicks is None]


def _shifted(
    history: AbstractRecordedHistory,
    resolutions: Mapping[str, float],
    periods: Mapping[str, Sequence[tuple[float, float | None]]],
    trips: Mapping[str, float],
) -> Iterator[Warned]:
    """Warn of many contacts in a row, whose errors of time add up, each in round trips of its own bodies."""
    count = sum(len(found) for found in periods.values())
    shift = math.fsum(len(found) * resolutions[name] for name, found in periods.items())
    in_trips = math.fsum(len(found) * resolutions[name] / trips[name] for name, found in periods.items())
    if in_trips > SHIFT_WARN:
        text = (
            f"the times of {count} contacts are uncertain by {shift / count:.3g} s each: later ones "
            f"may be shifted by up to {in_trips:.2g} round trips of their bodies; give "
            f"{finer_by(history, history.scene.bodies)}"
        )
        yield Warned("drift", text)


def _shares(faces: Mapping[str, Array], displaced: float) -> Iterator[tuple[float, str]]:
    """Yield ratios of a displacement to those of faces, and their channels.

    The displacement [m] is divided by the square mean of the face's. A face that is all but at rest, as one that is
    pressed against a wall, is left out.
    """
    sizes = {name: _mean(moved) for name, moved in faces.items()}
    for name, size in sizes.items():
        if size > MIN_MOTION * max(sizes.values()):
            yield displaced / size, name


def _mean(values: Array) -> float:
    """Return the square mean of values, divided by a power of two before: squares of 1e154 m overflow."""
    _, power = math.frexp(max(float(values.max()), -float(values.min())))
    scaled = np.ldexp(values, -power)
    return math.ldexp(math.sqrt(float(scaled @ scaled) / values.size), power)


def _late(
    history: AbstractRecordedHistory,
    resolutions: Mapping[str, float],
    periods: Mapping[str, Sequence[tuple[float, float | None]]],
) -> dict[str, list[float]]:
    """Return the errors of the closing times by body [s].

    Bodies without any are left out.
    """
    late: dict[str, list[float]] = {}
    for contact in history.scene.contacts:
        if not history.method.laws[contact.name].force_jumps:
            continue  # next to no force acts around a closing whose time is in doubt
        found = [end for period in periods[contact.name] for end in period if end]  # that at t = 0 is given
        if found:
            for point in contact.faces:
                late.setdefault(point.body, []).extend([resolutions[contact.name]] * len(found))
    return late


def _displaced(
    history: AbstractRecordedHistory, late: Mapping[str, Sequence[float]], motions: Mapping[str, Mapping[str, Array]]
) -> Iterator[Warned]:
    """Warn where a face moves little beside its body.

    The displacement of the face is then not large beside that of its body in the error of a closing time.

    A closing or opening that comes too late by a time s leaves the faces of its body displaced by its speed times s;
    those of several, of either sign, add up in squares. So a face that is brought back to where it was, or moves little
    beside the others of its body, has the largest relative error. Displacements and speeds are square means over the
    run. Contacts whose force grows from zero have no such instant. ``late`` are errors of closing times by body [s].
    """
    worst = (0.0, "")
    for body, faces in motions.items():
        doubt = math.hypot(*late.get(body, ()))
        if doubt == 0.0:
            continue
        cell = max(history.duration / moved.size for moved in faces.values())
        speed = max(_mean(moved[2:] - moved[:-2]) for moved in faces.values()) / (2.0 * cell)
        worst = max([worst, *_shares(faces, speed * doubt)])
    share, name = worst
    if share > COARSE_WARN:
        text = (
            f"{name}: the times of closings and openings are uncertain by half the shortest period or a step, "
            f"which may change it by {100.0 * share:.3g} %; give {finer_by(history, late)}"
        )
        yield Warned("drift", text)


class UnresolvedClosings(NamedTuple):
    """Touches that a method cannot resolve, by body."""

    passed: dict[str, list[float]]  # m, square means of its displacements by them; bodies without any are left out
    counts: dict[str, tuple[int, int]]  # how many of its contacts


def _doubtful(history: AbstractRecordedHistory, resolutions: Mapping[str, float]) -> UnresolvedClosings:
    """Return the displacements by contacts that a method cannot resolve.

    The impulse J of a contact that is short, or that follows a short opening, may belong to the contact before or after
    it, or to none. That changes the velocity of a free body of mass M by J/M from there on; of one that is held, for
    half a round trip. Several add up in squares.
    """
    scene = history.scene
    passed, counts = dict[str, list[float]](), dict[str, tuple[int, int]]()
    for contact in scene.contacts:
        spans = _spans(history, contact)
        found = list(
            _unresolved(spans, MIN_RESOLUTIONS * (resolutions[contact.name] + history.facts_of(contact).delay))
        )
        for point in contact.faces:
            body = scene.bodies[point.body]
            if not body.moves:
                continue
            unresolved, of = counts.get(point.body, (0, 0))
            counts[point.body] = unresolved + len(found), of + len(spans)
            for start, impulse in found:
                left = max(0.0, scene.duration - start)
                trip = math.inf if body.elastic is None else body.elastic.round_trip
                lasts = left / math.sqrt(3.0) if body.is_free else min(left, 0.5 * trip)
                moved = impulse / body.moving_mass * lasts * math.sqrt(left / scene.duration)
                passed.setdefault(point.body, []).append(moved)
    return UnresolvedClosings(passed, counts)


def _chattering(doubtful: UnresolvedClosings, motions: Mapping[str, Mapping[str, Array]]) -> Iterator[Warned]:
    """Yield a warning where unresolved contacts change a face's motion.

    Their impulses may move it by more than its whole motion.
    """
    worst = (0.0, "", "")
    for body_name, moved_by in doubtful.passed.items():
        shares = _shares(motions[body_name], math.hypot(*moved_by))
        worst = max([worst, *((share, name, body_name) for share, name in shares)])
    share, name, body_name = worst
    if share > MOVED_WARN:
        unresolved, of = doubtful.counts[body_name]
        text = (
            f"{name}: {unresolved} of {of} contacts of this body, or openings before them, are not "
            f"resolved, and their impulses may change it by {share:.2g} times its size. Their number "
            "depends on the mesh and the step: compare two resolutions or models"
        )
        yield Warned("chatter", text)


def _unresolved(spans: Sequence[ContactSpan], limit: float) -> Iterator[tuple[float, float]]:
    """Yield start [s] and impulse [N s] of unresolved contacts.

    They are shorter than a limit [s], or follow a shorter opening. Of the two contacts beside a short opening the
    smaller impulse is in doubt.
    """
    for before, span in zip((None, *spans), spans, strict=False):
        if span.end is not None and span.end - span.start < limit:
            yield span.start, abs(span.impulse)
        elif before is not None and before.end is not None and span.start - before.end < limit:
            yield span.start, min(abs(span.impulse), abs(before.impulse))
