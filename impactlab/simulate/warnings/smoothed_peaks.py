"""Warnings of largest contact forces that a method lowers because it smooths the front that they follow.

A mass m that strikes a clamped rod of impedance Z feels a front come back from the clamped end after a round trip. The
force of a hard contact jumps there and decays as exp(-Z t/m): its largest value lasts no time. Elements and modes
disperse the front, so that the force rises for a time, in which that of the waves has decayed already.

A mesh delays fronts more, the further they travelled (`mesh_dispersion`). Where its short waves are fast, as with
consistent masses, they arrive ahead of a front and part the faces, unless the force on them is large. The front
then meets open faces: it moves the end of the rod at up to twice the speed until they meet again.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from impactlab.history.base import Warned
from impactlab.scene.bodies import ElasticBody
from impactlab.scene.problem import Contact
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.planning.contact_facts import ContactFacts
from impactlab.simulate.warnings.mesh_dispersion import RISE, airy_scale
from impactlab.simulate.warnings.peaks import keeps_waves, lobes_of

DECAY_WARN = 0.15  # decay times m/Z in which the force rises: it decays by 14 % in them, as of `peaks.RATIO_WARN`
LOSS_WARN = 0.08  # of the largest force, that a front may have lost while the mesh let it rise
PARTED_WARN = 0.04  # of a force before which the faces part: once to twice this was lost in random runs
# Of the largest force, by one that follows an opening shorter than the oscillations of a front. Of 126 largest forces
# too small by 5 % or more in random hard cases that did not oscillate, 89 are named by this and LOSS_WARN, of 157 right
# ones 6.
MIN_PARTED = 0.7
MIN_TRAVEL, LATE = 0.6, 0.9  # round trips after the first touch, from which fronts come back; fronts of other contacts
BEFORE = 1.2  # oscillations before a largest force, in which its front began to arrive
MAX_DECAYS = 1.0  # in a rise: a longer one says no more than that the force is not resolved
MAX_RISE = 0.25  # round trips: a largest force later than that after a front does not belong to it


def smoothed(history: AbstractRecordedHistory, contact: Contact, facts: ContactFacts, advice: str) -> Iterator[Warned]:
    """Yield a warning where the force rises too slowly behind a front; ``advice`` is how to resolve shorter times."""
    law = history.method.laws[contact.name]
    if law.two_sided or not law.answers_force or not facts.striker < math.inf or not facts.impedance < math.inf:
        return
    spans = history.spans(contact.name)
    if not spans or (facts.stiffness != math.inf and not facts.is_relative):
        return
    found = _behind_first(history, contact, facts, advice) or _dispersed(history, contact, facts, advice)
    if found is not None:
        yield found


def _dispersed(history: AbstractRecordedHistory, contact: Contact, facts: ContactFacts, advice: str) -> Warned | None:
    """Return a warning where a mesh disperses fronts for so long that the force behind one is too small."""
    bodies = [history.scene.bodies[point.body].elastic for point in contact.faces]
    rods = [body for body in bodies if body is not None]
    if any(end.kind == "spring" for rod in rods for _, end in rod.ends):  # rounds fronts
        return None
    if any(keeps_waves(history, rod) for rod in rods) or lobes_of(history, rods, history.duration) == 0.0:
        return None
    peak = max(span.peak_force or 0.0 for span in history.spans(contact.name))
    found = _parted(history, contact, facts, rods, peak) or _decayed(history, contact, rods, peak)
    if found is None:
        return None
    text = f"{found}; give {advice}, or a lumped mesh at courant 1, or model continuous"
    return Warned("peak_smoothed", text, contact.name)


def _parted(
    history: AbstractRecordedHistory, contact: Contact, facts: ContactFacts, rods: Sequence[ElasticBody], peak: float
) -> str | None:
    """Return the text of a warning where faces part ahead of a front.

    The mass has then no force while the front passes; by the waves that decays as exp(-Z t/m) from its arrival on.
    """
    spans = history.spans(contact.name)
    back = spans[0].start + MIN_TRAVEL * min(rod.round_trip for rod in rods)
    longest = lobes_of(history, rods, history.duration)
    for before, span in itertools.pairwise(spans):
        opening = span.start - before.until(span.start)
        force = span.peak_force or 0.0
        if span.start < back or force <= MIN_PARTED * peak or opening >= longest:
            continue
        takes = lobes_of(history, rods, span.start)
        lost = -math.expm1(-takes * facts.impedance / facts.striker)
        if opening < takes and lost > PARTED_WARN:
            return (
                f"{contact.name}: the faces part for {opening:.3g} s before the contact at {span.start:.4g} s with a "
                f"force of up to {force:.4g} N. A front takes {takes:.2g} s to pass on this mesh, and its ripples part "
                f"the faces ahead of it: the force behind it is too small by about {100.0 * lost:.2g} %, within a "
                "factor of two"
            )
    return None


def _decayed(
    history: AbstractRecordedHistory, contact: Contact, rods: Sequence[ElasticBody], peak: float
) -> str | None:
    """Return the text of a warning where the force of the waves decays while a mesh lets it rise.

    The largest force of the run is looked at, and the largest after a round trip, that of the waves may be larger.
    A wave from another mass on the rod decays as fast as the force there.
    """
    met = {other.name: history.facts_of(other) for rod in rods for _, other in history.scene.met_by(rod.name)}
    rate = sum(each.impedance / each.striker for each in met.values() if each.impedance < math.inf)
    times, means = history.force_means(contact)
    later = history.spans(contact.name)[0].start + LATE * min(rod.round_trip for rod in rods)
    for first in (0, int(np.searchsorted(times, later))):
        if first == times.size:
            return None
        at = first + int(means[first:].argmax())
        time, force = float(times[at]), float(means[at])
        begin = int(np.searchsorted(times, time - BEFORE * lobes_of(history, rods, time)))
        jump = force - float(means[begin : at + 1].min())
        rise = RISE * airy_scale(history, rods, time)
        decays = min(rise * rate, MAX_DECAYS)
        if force + jump * math.expm1(decays) > (1.0 + LOSS_WARN) * peak:
            return (
                f"{contact.name}: the force of {force:.4g} N at {time:.4g} s follows a front, which takes {rise:.2g} s "
                f"to pass on this mesh. In this time the force of the waves decays by "
                f"{100.0 * -math.expm1(-decays):.2g} %: it is too small by about as much, within a factor of two"
            )
    return None


def _behind_first(
    history: AbstractRecordedHistory, contact: Contact, facts: ContactFacts, advice: str
) -> Warned | None:
    """Return a warning where the force rises too slowly behind the first front that comes back.

    Only uniform rods that nothing else has touched are checked, whose front comes after a round trip.
    """
    rod = _struck_rod(history, contact)
    spans = history.spans(contact.name)
    if rod is None or any(span.peak_force is None for span in spans):
        return None
    times, means = history.force_means(contact)
    at = float(times[int(means.argmax())])
    rise = at - spans[0].start - rod.round_trip
    decays = rise * facts.impedance / facts.striker
    if decays <= DECAY_WARN or rise >= MAX_RISE * rod.round_trip or _touched(history, contact, rod, at):
        return None
    peak = max(span.peak_force or 0.0 for span in spans)
    text = (
        f"{contact.name}: the largest force, {peak:.4g} N, follows the front that comes back from the clamped end "
        f"of '{rod.name}'. With this method it rises for {rise:.3g} s, in which the force of the waves decays by "
        f"{100.0 * -math.expm1(-decays):.2g} %: it is too small by about as much, within a factor of two; give "
        f"{advice}, or model continuous"
    )
    return Warned("peak_smoothed", text, contact.name)


def _struck_rod(history: AbstractRecordedHistory, contact: Contact) -> ElasticBody | None:
    """Return the undamped uniform rod, clamped at one end, whose other end a rigid body strikes; None for others."""
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
