"""Warnings of largest contact forces that a method lowers because it smooths the front that they follow.

A mass m that strikes a clamped rod of impedance Z feels a front come back from the clamped end after a round trip. The
force of a hard contact jumps there and decays as exp(-Z t/m): its largest value lasts no time. Elements and modes
disperse the front, so that the force rises for a time, in which that of the waves has decayed already.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from impactlab.history.base import Warned
from impactlab.scene.bodies import ElasticBody
from impactlab.scene.problem import Contact
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.planning.contact_facts import ContactFacts

DECAY_WARN = 0.15  # decay times m/Z in which the force rises: it decays by 14 % in them, as of `peaks.RATIO_WARN`
MAX_RISE = 0.25  # round trips: a largest force later than that after a front does not belong to it


def smoothed(history: AbstractRecordedHistory, contact: Contact, facts: ContactFacts, advice: str) -> Iterator[Warned]:
    """Yield a warning where the force rises too slowly behind the first front that comes back.

    Only uniform rods that nothing else has touched are checked, whose front comes after a round trip; ``advice`` is
    how to resolve shorter times.
    """
    rod = _struck_rod(history, contact, facts)
    if rod is None or (facts.stiffness != math.inf and not facts.is_relative):
        return
    spans = history.spans(contact.name)
    if not spans or any(span.peak_force is None for span in spans):
        return
    times, means = history.force_means(contact)
    at = float(times[int(means.argmax())])
    rise = at - spans[0].start - rod.round_trip
    decays = rise * facts.impedance / facts.striker
    if decays <= DECAY_WARN or rise >= MAX_RISE * rod.round_trip or _touched(history, contact, rod, at):
        return
    peak = max(span.peak_force or 0.0 for span in spans)
    text = (
        f"{contact.name}: the largest force, {peak:.4g} N, follows the front that comes back from the clamped end "
        f"of '{rod.name}'. With this method it rises for {rise:.3g} s, in which the force of the waves decays by "
        f"{100.0 * -math.expm1(-decays):.2g} %: it is too small by about as much, within a factor of two; give "
        f"{advice}, or model continuous"
    )
    yield Warned("peak_smoothed", text, contact.name)


def _struck_rod(history: AbstractRecordedHistory, contact: Contact, facts: ContactFacts) -> ElasticBody | None:
    """Return the undamped uniform rod, clamped at one end, whose other end a rigid body strikes; None for others."""
    law = history.method.laws[contact.name]
    if law.two_sided or not law.answers_force or not facts.striker < math.inf:
        return None
    elastic = [(body, point.x) for point in contact.faces if (body := history.scene.bodies[point.body].elastic)]
    if len(elastic) != 1:
        return None
    rod, x = elastic[0]
    others = {rod.length: rod.left, 0.0: rod.right}
    if x not in others or others[x].kind != "clamped":  # springs and masses there round or change the front
        return None
    uniform = rod.waves is not None and rod.has_fronts and len(rod.segments) == 1
    return rod if uniform else None


def _touched(history: AbstractRecordedHistory, contact: Contact, rod: ElasticBody, until: float) -> bool:
    """Return whether another contact has acted on a rod before a time [s]."""
    others = [each.name for each in history.scene.contacts if each is not contact and rod.name in _bodies(each)]
    return any(span.start < until for span in history.spans_of(others))


def _bodies(contact: Contact) -> tuple[str, ...]:
    return tuple(point.body for point in contact.faces)
