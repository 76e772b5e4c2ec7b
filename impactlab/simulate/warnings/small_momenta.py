"""Warnings of rods whose final momentum is a small difference of large impulses under soft contacts.

A rod that is squeezed between a heavy body and a wall receives nearly the same impulse from both sides. The waves in it
swing its momentum to and fro once per round trip, by about its mass times the speed of the impact. Its final momentum
is that of the instant of this swing at which its contacts open.

The half swing of a mass M on a compliance C lasts pi sqrt(M C). A spring of compliance c in place of a hard contact
makes it longer by c/(2 C) of this time. A compliance of 1 % is small beside that of the rod; the shift is not small
beside a round trip, where M is a hundred times the mass of the rod and the half swing lasts 16 round trips.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from impactlab.history.base import Warned
from impactlab.scene.bodies import ElasticBody
from impactlab.scene.problem import Contact
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.types import Array

MIN_IMPULSES = 10.0  # momenta at the end: a rod that rebounds a few times receives less, and no small difference
MIN_SHARE_OF_SPEED = 0.1  # of the rod's momentum at the fastest speed: between equal bodies it has none but rounding
MIN_SHARE = 0.5  # of the largest momentum in the run: the scale of a rod that comes to rest is no smaller
# Of the final momentum, and the error from which hard cases must carry a warning. Of 154 random runs above it (two
# bodies of 2 to 200 masses of the rod, 10 to 100 elements) the momentum was wrong by 5 % or more in 128; of those with
# springs below it, by 20 % or more in 6, all with other warnings.
CHANGE_WARN = 0.2
MAX_SHIFT = 0.5  # round trips: in half of one the momentum has swung from one extreme to the other
INSTANTS = 256  # of the last round trip before the last opening


def warnings(history: AbstractRecordedHistory, softer: Collection[str]) -> Iterator[Warned]:
    """Yield a warning for each free rod whose final momentum follows the springs at its contacts.

    Rods at the contacts ``softer``, by name, have a warning of these springs already.
    """
    scene, laws = history.scene, history.method.laws
    if len(scene.contacts) < 2 or not any(history.facts_of(each).is_relative for each in scene.contacts):
        return
    for rod in scene.wave_bodies:
        contacts = [each for each in scene.contacts if rod.name in (each.left.body, each.right.body)]
        names = {each.name for each in contacts}
        if rod.is_free and len(contacts) > 1 and not names & set(softer) and all(laws[n].answers_force for n in names):
            yield from _shifted(history, rod, contacts)


def _shifted(history: AbstractRecordedHistory, rod: ElasticBody, contacts: Sequence[Contact]) -> Iterator[Warned]:
    """Yield a warning where the shift of the last openings changes the final momentum of a rod."""
    spans = history.spans_of(each.name for each in contacts)
    ends = [span.end for span in spans if span.end is not None]
    shift = min(later_openings(history, contacts), MAX_SHIFT * rod.round_trip)
    if not ends or len(ends) < len(spans) or shift == 0.0:
        return  # one is closed, and the momentum is not the final one
    channel = f"momentum:{rod.name}"
    final = history.at_end(channel)
    largest = float(np.abs(history.recorded[channel].values).max())
    scale = max(abs(final), MIN_SHARE * largest, MIN_SHARE_OF_SPEED * rod.moving_mass * history.scene.fastest)
    impulses = sum(abs(span.impulse) for span in spans)
    if impulses < MIN_IMPULSES * scale:
        return
    last = max(ends)
    before = np.linspace(max(0.0, last - rod.round_trip - shift), last, INSTANTS)
    given = sum(_given(history, rod, each, before + shift) - _given(history, rod, each, before) for each in contacts)
    change = float(np.abs(given).max())
    if change > CHANGE_WARN * scale:
        unit = "N s" if "strain" in rod.quantities else "N m s"
        text = (
            f"{rod.name}: its final momentum, {final:.3g} {unit}, is a small difference of impulses that add up to "
            f"{impulses:.3g} {unit}. The springs in place of hard contacts delay its last openings by about "
            f"{shift:.2g} s, in which the contact forces change its momentum by up to {change:.2g} {unit}; give a "
            "larger relative stiffness, more elements, or a law of hard contact"
        )
        yield Warned("soft_contact", text)


def later_openings(history: AbstractRecordedHistory, contacts: Sequence[Contact]) -> float:
    """Return the time by which springs in place of hard contacts delay the last openings of a rod [s].

    Each delays the force of a wave by impedance over stiffness, and makes the longest contact longer by half its
    compliance over that of the bodies.
    """
    spans = history.spans_of(each.name for each in contacts)
    longest = max((span.until(history.duration) - span.start for span in spans), default=0.0)
    delay = 0.0
    for contact in contacts:
        facts = history.facts_of(contact)
        compliance = sum(history.scene.bodies[point.body].static_compliance for point in contact.faces)
        if facts.is_relative and facts.stiffness and compliance > 0.0:
            delay += facts.delay + 0.5 * longest / (facts.stiffness * compliance)
    return delay


def _given(history: AbstractRecordedHistory, rod: ElasticBody, contact: Contact, times: Array) -> Array:
    """Return the impulse of a contact on a rod up to times (n,) [N s]."""
    instants, means = history.force_means(contact)
    impulse = np.append(0.0, np.cumsum(means[1:] * np.diff(instants)))
    found: Array = np.interp(times, instants, impulse)
    return found if contact.right.body == rod.name else -found
