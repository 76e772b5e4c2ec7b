"""What touches leave unsure of all that comes after them: each is known to within a time that a method tells apart."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from impactlab.history.base import AbstractHistory, ContactSpan, Warned
from impactlab.metrics.norms import midpoints
from impactlab.scene.facts import impedance_of, moving_faces
from impactlab.scene.frame import drift, touched_in
from impactlab.scene.method import Method, is_relative, stiffness_of
from impactlab.scene.problem import Contact, Scene
from impactlab.simulate.resolvability import COARSE, apart
from impactlab.simulate.stepping.preparation import BuiltBody
from impactlab.types import Array

LASTING = 0.1  # round trips that faces are apart before a touch counts: a contact that chatters is one
DRIFTED = 0.2  # round trips: from here on the contacts of a run may have shifted what comes later by as much
RESOLVED = 3.0  # times what a method tells apart: a touch or an opening that is shorter may be one of the mesh
MOVED = 2.0  # ways of a face: from here on what unresolved touches passed on is more than what is left of its motion
AT_REST = 0.05  # of the way of the body's other faces: a face that moves less has no way to speak of
LOOKS = 2000  # at the displacement of a face


def unplaced(history: AbstractHistory, built: Mapping[str, BuiltBody], dt: float) -> Iterator[Warned]:
    """Give the warnings of touches that shift, displace or move what comes after them, all from the run itself.

    Parameters
    ----------
    history : AbstractHistory
        The run, with its scene and method.
    built : mapping
        Bodies in their coordinates.
    dt : float
        Step [s]; 0 where it is chosen by an error estimate.
    """
    scene, method = history.scene, history.method
    if not 0.0 < scene.round_trip < math.inf:
        return
    tells = {contact.name: apart(scene, built, contact, dt) for contact in scene.contacts}
    touches = {contact.name: _touches(scene, contact, history) for contact in scene.contacts}
    yield from _shifted(scene, tells, touches)
    ways = _ways(scene, history)
    yield from _displaced(scene, method, tells, touches, ways)
    yield from _chattering(history, tells, ways)


def _touches(scene: Scene, contact: Contact, history: AbstractHistory) -> list[tuple[float, float | None]]:
    """Return start and end [s] of the touches of a contact, those that chatter as one; none of a law of kicks."""
    touches: list[tuple[float, float | None]] = []
    for span in _spans(contact, history):
        last = touches[-1][1] if touches else -math.inf
        if last is None or span.start - last <= LASTING * scene.round_trip:
            touches[-1] = touches[-1][0], span.end
        else:
            touches.append((span.start, span.end))
    return touches


def _spans(contact: Contact, history: AbstractHistory) -> list[ContactSpan]:
    return [span for span in history.contacts if span.contact == contact.name and span.kicks is None]


def _shifted(
    scene: Scene, tells: Mapping[str, float], touches: Mapping[str, Sequence[tuple[float, float | None]]]
) -> Iterator[Warned]:
    """Warn of many contacts in a row: each is told to within what the method tells apart, and shifts what follows."""
    count = sum(len(found) for found in touches.values())
    shift = sum(len(found) * tells[name] for name, found in touches.items())
    if shift > DRIFTED * scene.round_trip:
        text = (
            f"{count} contacts, each told to within {shift / count:.3g} s: later ones may be shifted by up to "
            f"{shift / scene.round_trip:.2g} round trips; give more elements or modes, and a smaller step"
        )
        yield Warned("drift", text)


def _ways(scene: Scene, history: AbstractHistory) -> dict[str, dict[str, Array]]:
    """Return by body and channel how far each face moved [m] at equal times, in the frame of what interacts."""
    t, touched = midpoints(history.duration, LOOKS), touched_in(history)
    ways: dict[str, dict[str, Array]] = {}
    for contact in scene.contacts:
        for point in (contact.left, contact.right):
            for name in moving_faces(scene, point):
                moved = history.evaluate(t, name) - drift(scene, name, t, touched)
                ways.setdefault(point.body, {})[name] = moved
    return ways


def _shares(faces: Mapping[str, Array], displaced: float) -> Iterator[tuple[float, str]]:
    """Give a displacement [m] as a share of the way of each face of a body, and the channel of the face.

    The way of a face that is all but at rest, as of one that is pressed against a wall, is no measure.
    """
    sizes = {name: _mean(moved) for name, moved in faces.items()}
    for name, size in sizes.items():
        if size > AT_REST * max(sizes.values()):
            yield displaced / size, name


def _mean(values: Array) -> float:
    """Return the square mean of values."""
    return float(np.sqrt(np.mean(np.square(values))))


def _displaced(
    scene: Scene,
    method: Method,
    tells: Mapping[str, float],
    touches: Mapping[str, Sequence[tuple[float, float | None]]],
    ways: Mapping[str, Mapping[str, Array]],
) -> Iterator[Warned]:
    """Warn where the way of a face is not long beside what its body moves in the times that are not told apart.

    A touch or parting that comes too late by a time s leaves the faces of its body displaced by its speed times s;
    those of several, of either sign, add up in squares. So a face that is brought back to where it was, or moves little
    beside the others of its body, is known worst. Displacements and speeds are square means over the run. Touches whose
    force grows from nothing have no such instant.
    """
    late: dict[str, list[float]] = {}  # of each body: to within which time its touches and partings are known [s]
    for contact in scene.contacts:
        if not method.laws[contact.name].force_jumps:
            continue  # next to no force acts around a touch whose time is in doubt
        for point in (contact.left, contact.right):
            found = [end for touch in touches[contact.name] for end in touch if end]  # that at t = 0 is given
            late.setdefault(point.body, []).extend([tells[contact.name]] * len(found))
    worst = (0.0, "")
    for body, faces in ways.items():
        speed = max(_mean(np.gradient(moved)) for moved in faces.values()) / (scene.duration / LOOKS)
        worst = max([worst, *_shares(faces, speed * math.hypot(*late.get(body, ())))])
    share, name = worst
    if share > COARSE:
        text = (
            f"{name}: touches and partings, each told to within half the shortest period or a step, may displace it by "
            f"{100.0 * share:.3g} % of its way; give more elements or modes, and a smaller step"
        )
        yield Warned("drift", text)


def _chattering(
    history: AbstractHistory, tells: Mapping[str, float], ways: Mapping[str, Mapping[str, Array]]
) -> Iterator[Warned]:
    """Warn where touches that a method cannot resolve pass on more than what is left of the motion of a face.

    The impulse J of a touch that is short, or that follows on a short opening, may go to the touch before or after or
    be none at all. That changes the velocity of a free body of mass M by J/M from there on; of one that is held, for
    half a round trip. Several add up in squares.
    """
    scene = history.scene
    passed: dict[str, list[float]] = {}  # of each body: square means of what the touches displace it by [m]
    counts: dict[str, tuple[int, int]] = {}
    for contact in scene.contacts:
        spans = _spans(contact, history)
        found = list(_unresolved(spans, RESOLVED * (tells[contact.name] + _delay(scene, history.method, contact))))
        for point in (contact.left, contact.right):
            body = scene.bodies[point.body]
            if not body.moves:
                continue
            unresolved, of = counts.get(point.body, (0, 0))
            counts[point.body] = unresolved + len(found), of + len(spans)
            for start, impulse in found:
                left = max(0.0, scene.duration - start)
                lasts = left / math.sqrt(3.0) if body.is_free else min(left, 0.5 * scene.round_trip)
                moved = impulse / body.moving_mass * lasts * math.sqrt(left / scene.duration)
                passed.setdefault(point.body, []).append(moved)
    worst = (0.0, "", "")
    for body_name, moved_by in passed.items():
        shares = _shares(ways[body_name], math.hypot(*moved_by))
        worst = max([worst, *((share, name, body_name) for share, name in shares)])
    share, name, body_name = worst
    if share > MOVED:
        unresolved, of = counts[body_name]
        text = (
            f"{name}: {unresolved} of {of} touches of this body, or openings before them, are not resolved, "
            f"and what they pass on moves it by {share:.2g} times its way; their number follows the mesh and the step: "
            "compare two resolutions or models"
        )
        yield Warned("chatter", text)


def _delay(scene: Scene, method: Method, contact: Contact) -> float:
    """Return the time [s] by which a spring that stands for a hard contact delays its force: impedance over stiffness.

    A spring that is physics, given in N/m, delays what it should.
    """
    stiffness, impedance = stiffness_of(scene, method, contact), impedance_of(scene, contact)
    relative = is_relative(method.laws[contact.name])
    return impedance / stiffness if stiffness and impedance < math.inf and relative else 0.0


def _unresolved(spans: Sequence[ContactSpan], limit: float) -> Iterator[tuple[float, float]]:
    """Give start [s] and impulse [N s] of touches shorter than a limit [s], or that follow on a shorter opening.

    Of the two touches beside a short opening the smaller impulse is in doubt.
    """
    for before, span in zip((None, *spans), spans, strict=False):
        if span.end is not None and span.end - span.start < limit:
            yield span.start, abs(span.impulse)
        elif before is not None and before.end is not None and span.start - before.end < limit:
            yield span.start, min(abs(span.impulse), abs(before.impulse))
