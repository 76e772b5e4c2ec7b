"""Warnings of a run on beams: theory beyond its range, unbounded force, unresolved sub-impacts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from impactlab.history.base import ContactSpan, Warned
from impactlab.metrics.collisions import memory
from impactlab.scene.bodies import Body
from impactlab.scene.problem import Contact
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.warnings.closing_times import MIN_RESOLUTIONS
from impactlab.simulate.warnings.static_sag import warnings as sagging


def warnings(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield the warnings of a finished run that concern its beams."""
    scene, laws = history.scene, history.method.laws
    if not any(body.bends for body in scene.bodies.values()):
        return
    for name, body in scene.bodies.items():
        if body.elastic is not None and (doubts := body.theory_doubts(*_shortest(history, name))):
            text = f"'{name}' has theory euler_bernoulli, and {' and '.join(doubts)}; use theory: timoshenko"
            yield Warned("stocky_beam", text)
    yield from sagging(history)
    for contact in scene.contacts:
        beams = [body for body in (scene.bodies[point.body] for point in contact.faces) if body.bends]
        spans = history.spans(contact.name)
        if beams and spans:
            if laws[contact.name].hard:
                yield from _singular(contact, beams, spans)
            yield from _too_short(history, contact, spans)


def _shortest(history: AbstractRecordedHistory, name: str) -> tuple[str, float]:
    """Return the shortest contact of a soft law and its length [s].

    The length is inf without such a contact on the body.
    """
    soft = {
        contact.name: None for _, contact in history.scene.met_by(name) if not history.method.laws[contact.name].hard
    }
    spans = [span for contact in soft for span in history.spans(contact)]
    lasted = [(s.end - s.start, s.contact) for s in spans if s.end is not None]
    time, contact = min(((time, contact) for time, contact in lasted if time > 0.0), default=(math.inf, ""))
    return contact, time


def _singular(contact: Contact, beams: Sequence[Body], spans: Sequence[ContactSpan]) -> Iterator[Warned]:
    """Yield a warning of hard contact on an Euler-Bernoulli beam: force as t^-1/2 at first."""
    if not any(beam.unbounded_first_force for beam in beams):
        return
    peak = max((span.peak_force or 0.0 for span in spans), default=0.0)
    size = f"the largest force here, {peak:.4g} N," if peak > 0.0 else "its size here"
    text = (
        f"{contact.name}: a hard contact on an Euler-Bernoulli beam has no finite first force (it goes as t^-1/2); "
        f"{size} and the number of contacts depend on the modes or elements kept and on the step; give the contact a "
        "stiffness, or theory: timoshenko"
    )
    yield Warned("singular_force", text, contact.name)


def _too_short(history: AbstractRecordedHistory, contact: Contact, spans: Sequence[ContactSpan]) -> Iterator[Warned]:
    """Warn of contacts in one collision that are shorter than a few time resolutions."""
    limit = MIN_RESOLUTIONS * history.facts_of(contact).resolution_of_all
    together = memory(history.scene, (contact.left.body, contact.right.body))
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
            f"{contact.name}: {short} of {of} sub-impacts, or the openings next to them, are shorter "
            f"than {limit:.3g} s, three times the time resolution of this method, which does not "
            "resolve their number; compare two resolutions or models"
        )
        yield Warned("sub_impacts", text, contact.name)
