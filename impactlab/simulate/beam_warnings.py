"""What a finished run on beams is warned of: a theory beyond its range, a force without a bound, a count unknown."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from impactlab.history.base import AbstractHistory, ContactSpan, Warned
from impactlab.metrics.collisions import memory
from impactlab.scene.bodies import Beam, BeamSegment
from impactlab.scene.problem import Contact, Scene
from impactlab.simulate.resolvability import apart
from impactlab.simulate.stepping.preparation import BuiltBody

SLENDER = 10.0  # length over height, from which on shear hardly matters to the slowest motion
SHORT_WAVES = 0.15  # radius of gyration times wave number: there waves run 4 to 5 % too fast without shear and rotation
RESOLVED = 3.0  # times what a method tells apart: a contact that is shorter has no shape and no impulse of its own


def warnings(scene: Scene, built: Mapping[str, BuiltBody], history: AbstractHistory, dt: float) -> Iterator[Warned]:
    """Give the warnings of a finished run that concern its beams; arguments as of `resolution.unresolved`."""
    for name, body in scene.bodies.items():
        if isinstance(body, Beam) and body.theory == "euler_bernoulli":
            yield from _stocky(body, _shortest(scene, history, name))
    for contact in scene.contacts:
        beams = [body for body in _sides(scene, contact) if isinstance(body, Beam)]
        spans = [span for span in history.contacts if span.contact == contact.name]
        if beams and spans:
            yield from _singular(contact, beams, spans)
            yield from _too_short(scene, built, contact, spans, dt)


def _sides(scene: Scene, contact: Contact) -> list[object]:
    return [scene.bodies[point.body] for point in (contact.left, contact.right)]


def gyration(segment: BeamSegment) -> float:
    """Return the radius of gyration sqrt(I/A) of a cross section [m]."""
    return math.sqrt(segment.inertia / segment.area)


def _shortest(scene: Scene, history: AbstractHistory, name: str) -> tuple[str, float]:
    """Return the shortest contact of a soft law on a body and how long it lasted [s]; inf without one."""
    soft = {
        contact.name
        for contact in scene.contacts
        if name in (contact.left.body, contact.right.body) and not contact.law.hard
    }
    lasted = [(s.end - s.start, s.contact) for s in history.contacts if s.contact in soft and s.end is not None]
    time, contact = min(((time, contact) for time, contact in lasted if time > 0.0), default=(math.inf, ""))
    return contact, time


def _stocky(beam: Beam, shortest: tuple[str, float]) -> Iterator[Warned]:
    """Warn of Euler and Bernoulli's theory on a beam that is not slender, as a body or for what excites it."""
    segment = max(beam.segments, key=gyration)
    radius = gyration(segment)
    height = segment.height if segment.height > 0.0 else math.sqrt(12.0) * radius  # that of a rectangle with this I/A
    slender = beam.length / height
    contact, time = shortest
    wave = math.sqrt(math.pi / time / (segment.wave_speed * radius))  # of half a period in the contact: w = c r k2
    reasons = []
    if slender < SLENDER:
        given = "" if segment.height > 0.0 else ", the height taken as sqrt(12 I/A)"
        reasons.append(f"it is {slender:.3g} times as long as high (slender from {SLENDER:g} on{given})")
    if radius * wave > SHORT_WAVES:
        reasons.append(
            f"{contact} lasts {time:.3g} s and excites waves with r k = {radius * wave:.2g} (allowed: {SHORT_WAVES:g}; "
            f"r = {radius:.3g} m)"
        )
    if reasons:
        text = f"'{beam.name}' has theory euler_bernoulli, and {' and '.join(reasons)}; use theory: timoshenko"
        yield Warned("stocky_beam", text)


def _singular(contact: Contact, beams: Sequence[Beam], spans: Sequence[ContactSpan]) -> Iterator[Warned]:
    """Warn of a hard contact on a beam that does not shear: its force starts without bound, as t^-1/2."""
    if not contact.law.hard or all(beam.theory != "euler_bernoulli" for beam in beams):
        return
    peak = max((span.peak_force or 0.0 for span in spans), default=0.0)
    said = f"the largest force here, {peak:.4g} N," if peak > 0.0 else "its size here"
    text = (
        f"{contact.name}: a hard contact on an Euler-Bernoulli beam has no finite first force (it goes as t^-1/2); "
        f"{said} and the number of contacts depend on the modes or elements kept and on the step; give the contact a "
        "stiffness, or theory: timoshenko"
    )
    yield Warned("singular_force", text)


def _half_periods(scene: Scene, built: Mapping[str, BuiltBody], contact: Contact) -> list[float]:
    """Return half the shortest period of the coordinates of each beam of a contact [s], at least one number."""
    names = [point.body for point in (contact.left, contact.right) if isinstance(scene.bodies[point.body], Beam)]
    highest = [built[name].system.highest_frequency for name in names if name in built]
    return [0.0, *(math.pi / frequency for frequency in highest if frequency > 0.0)]


def _too_short(
    scene: Scene, built: Mapping[str, BuiltBody], contact: Contact, spans: Sequence[ContactSpan], dt: float
) -> Iterator[Warned]:
    """Warn of contacts in one collision that are shorter than what the method tells apart."""
    limit = RESOLVED * max(apart(scene, built, contact, dt), *_half_periods(scene, built, contact))
    together = memory(scene, (contact.left.body, contact.right.body))
    short, of = 0, 0
    for number, span in enumerate(spans):
        if span.end is None or span.kicks is not None:
            continue
        openings = [after.start - span.end for after in spans[number + 1 : number + 2]]
        openings += [span.start - before.end for before in spans[max(0, number - 1) : number] if before.end is not None]
        if not any(opening <= together for opening in openings):
            continue  # a contact of its own
        of += 1
        short += min(span.end - span.start, *openings) < limit
    if short:
        text = (
            f"{contact.name}: {short} of {of} sub-impacts, or openings beside them, are shorter than {limit:.3g} s, "
            "three times what this method tells apart: their number is not resolved; compare two resolutions or models"
        )
        yield Warned("sub_impacts", text)
