"""Whether a method can resolve a contact at all: its own times against those of the contact, before any error shows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from impactlab.contact_facts import impedance_of, moving_faces, stiffness_at, stiffness_of, striker_of
from impactlab.frame import drift, touched_in
from impactlab.history import AbstractHistory, Warned
from impactlab.metrics import midpoints
from impactlab.scene import Contact, Mass, Rod, Scene, Wall
from impactlab.stepping.preparation import BuiltBody
from impactlab.types import Array

COARSE = 0.25  # of a contact's time: a position is then known to about a quarter of what the contact moves
SOFT = 0.05  # of the bodies' own compliance: displacements then answer a force by 5 % more than they should
LASTING = 0.1  # round trips that faces are apart before a touch counts: a contact that chatters is one
DRIFTED = 0.2  # round trips: from here on the contacts of a run may have shifted what comes later by as much
DISPLACED = 0.2  # of the way of a face: from here on touches and partings may have displaced it by as much
AT_REST = 0.05  # of the way of the body's other faces: a face that moves less has no way to speak of
LOOKS = 2001  # at the gap of a run
LOADED = 0.01  # of the energy, a tenth of its speeds: from here on what an initial overlap holds is worth resolving


def unresolved(scene: Scene, built: Mapping[str, BuiltBody], history: AbstractHistory, dt: float) -> Iterator[Warned]:
    """Give the warnings of contacts that happened and that the method cannot resolve.

    Parameters
    ----------
    scene : Scene
        With the laws that acted.
    built : mapping
        Its bodies in their coordinates.
    history : AbstractHistory
        What came of it.
    dt : float
        Step [s]; 0 where it is chosen by an error estimate.
    """
    touched = {event.contact for event in history.events}
    for contact in scene.contacts:
        if contact.name in touched:
            yield from _too_coarse(scene, built, contact, history, dt)
            yield from _too_soft(scene, contact)
    yield from _drifted(scene, built, history, dt)


def apart(scene: Scene, built: Mapping[str, BuiltBody], contact: Contact, dt: float) -> float:
    """Return the shortest time that a method tells apart at a contact [s]: its step, or half its shortest period."""
    times = [dt]
    for point in (contact.left, contact.right):
        if isinstance(scene.bodies[point.body], Rod) and built[point.body].system.highest_frequency > 0.0:
            times.append(math.pi / built[point.body].system.highest_frequency)
    return max(times)


def _too_coarse(
    scene: Scene, built: Mapping[str, BuiltBody], contact: Contact, history: AbstractHistory, dt: float
) -> Iterator[Warned]:
    stiffness = _stiffness(scene, contact, history)
    impedance, mass = impedance_of(scene, contact), striker_of(scene, contact)
    if not stiffness:
        return
    # A mass m on a rod of impedance Z loses its speed in m/Z; a spring k between them lets both swing with sqrt(m/k).
    time = max(mass / impedance, math.sqrt(mass / stiffness)) if mass < math.inf else math.inf
    words = "the speed of what strikes"
    if contact.gap < 0.0 and 0.0 < stiffness < math.inf:
        at_start = float(history.energy.stored[0])
        if at_start > LOADED * float(history.energy.total[0]):
            # What is pressed together at the start relaxes as fast as the spring lets it.
            time = min(impedance / stiffness, math.sqrt(mass / stiffness))
            words = "the overlap at the start"
    if scene.duration < time:
        time, words = scene.duration, "all that happens in this run"
    tells = apart(scene, built, contact, dt)
    if tells > COARSE * time > 0.0:
        text = (
            f"{contact.name}: {words} changes within {time:.3g} s, and this method tells no less than {tells:.3g} s "
            "apart; give more elements or modes, and a smaller step"
        )
        yield Warned("coarse_contact", text)


def _stiffness(scene: Scene, contact: Contact, history: AbstractHistory) -> float | None:
    """Return the stiffness of a contact [N/m]; of a law that stiffens, that at its deepest overlap in the run."""
    known = stiffness_of(scene, contact)
    if known is not None:
        return known
    gap = history.evaluate(np.linspace(0.0, history.duration, LOOKS), f"gap:{contact.name}")
    return stiffness_at(scene, contact, max(0.0, -contact.gap, -float(np.min(gap))))


def _drifted(scene: Scene, built: Mapping[str, BuiltBody], history: AbstractHistory, dt: float) -> Iterator[Warned]:
    """Warn of many contacts in a row: each is told to within `apart`, and shifts all that comes after it."""
    if not scene.round_trip > 0.0:
        return
    shift, count = 0.0, 0
    ends: dict[str, list[float]] = {}  # of each body: to within which time its touches and partings are known [s]
    faces: dict[str, list[str]] = {}
    for contact in scene.contacts:
        tells = apart(scene, built, contact, dt)
        touches = _touches(scene, contact, history)
        shift, count = shift + len(touches) * tells, count + len(touches)
        for point in (contact.left, contact.right):
            ends.setdefault(point.body, []).extend(tells for touch in touches for end in touch if end)  # 0: is given
            faces.setdefault(point.body, []).extend(moving_faces(scene, point))
    if shift > DRIFTED * scene.round_trip:
        text = (
            f"{count} contacts, each told to within {shift / count:.3g} s: later ones may be shifted by up to "
            f"{shift / scene.round_trip:.2g} round trips; give more elements or modes, and a smaller step"
        )
        yield Warned("drift", text)
    shifts = {body: math.hypot(*tells) for body, tells in ends.items()}
    yield from _displaced(scene, history, {tuple(faces[body]): time for body, time in shifts.items() if time > 0.0})


def _touches(scene: Scene, contact: Contact, history: AbstractHistory) -> list[tuple[float, float | None]]:
    """Return start and end [s] of the touches of a contact, those that chatter as one; none of a law of kicks."""
    touches: list[tuple[float, float | None]] = []
    for span in history.contacts:
        if span.contact != contact.name or span.kicks is not None:
            continue
        last = touches[-1][1] if touches else -math.inf
        if last is None or span.start - last <= LASTING * scene.round_trip:
            touches[-1] = touches[-1][0], span.end
        else:
            touches.append((span.start, span.end))
    return touches


def _displaced(scene: Scene, history: AbstractHistory, shifts: Mapping[tuple[str, ...], float]) -> Iterator[Warned]:
    """Warn where the way of a face is not long beside what its body moves in the times that are not told apart.

    A touch or parting that comes too late by a time s leaves the faces of its body displaced by its speed times s;
    those of several, of either sign, add up in squares. So a face that is brought back to where it was, or moves little
    beside the others of its body, is known worst. Displacements and speeds are square means over the run, in the frame
    of the bodies that interact. ``shifts`` holds the sum [s] by the displacement channels of each body.
    """
    t, touched = midpoints(history.duration, LOOKS), touched_in(history)
    worst = (0.0, "")
    for names, shift in shifts.items():
        within = {name: history.evaluate(t, name) - drift(scene, name, t, touched) for name in names}
        ways = {name: _mean(u) for name, u in within.items()}
        displaced = shift * max((_mean(np.gradient(u, t)) for u in within.values()), default=0.0)
        # The way of a face that is all but at rest, as one that is pressed against a wall, is no measure.
        moving = [(displaced / way, name) for name, way in ways.items() if way > AT_REST * max(ways.values())]
        worst = max([worst, *moving])
    share, name = worst
    if share > DISPLACED:
        text = (
            f"{name}: touches and partings, each told to within half the shortest period or a step, may displace it by "
            f"{100.0 * share:.3g} % of its way; give more elements or modes, and a smaller step"
        )
        yield Warned("drift", text)


def _mean(values: Array) -> float:
    """Return the square mean of values."""
    return float(np.sqrt(np.mean(np.square(values))))


def _too_soft(scene: Scene, contact: Contact) -> Iterator[Warned]:
    """Warn of a spring that stands for a hard contact, its stiffness taken from a mesh, and gives way like a body."""
    from impactlab.described import is_relative

    stiffness = stiffness_of(scene, contact)
    if stiffness is None or not is_relative(contact):
        return
    pliancy = 0.0
    for point in (contact.left, contact.right):
        body = scene.bodies[point.body]
        if isinstance(body, Rod):
            pliancy += sum(each.length / (each.young * each.area) for each in body.segments)
        elif not isinstance(body, (Mass, Wall)):
            return
    if pliancy > 0.0 and 1.0 / stiffness > SOFT * pliancy * (1.0 + 1e-9):
        text = (
            f"{contact.name}: the spring of {stiffness:.3g} N/m gives way by {100.0 / (stiffness * pliancy):.2g} % of "
            "what the rods do; give a larger relative stiffness, or more elements"
        )
        yield Warned("soft_contact", text)
