"""Collisions: groups of the contacts (sub-impacts) between two bodies that follow each other closely.

Two bodies that vibrate may part and meet again while both still vibrate from the first meeting: a sphere on a long beam
strikes three times. Contacts between the same two bodies are one collision as long as the openings between them are no
longer than the slowest period of the bodies, taken as if each were clamped at one end and free at the other (rods
4 L/c, beams 1.787 L2 sqrt(rho A/EI)): until then a body may still be on its way back from the contact before. A later
contact is another collision, and so is each contact of bodies that do not vibrate.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from impactlab.history.base import AbstractHistory, ContactSpan
from impactlab.metrics.body_motion import BodyMotion
from impactlab.metrics.third_bodies import Others
from impactlab.printing import counted
from impactlab.scene.problem import Scene

MIN_APPROACH = 1e-9  # of the fastest body or of the exit speed: a slower approach is the rounding of mean speeds
MAX_PAIRS = 6  # of bodies whose counts by several methods are texts of their own: a row of beads has many
MAX_SAMPLES = 64  # of a gap in each opening
MAX_ALL_SAMPLES = 100_000  # of the gaps of a collision
MIN_GAP = 1e-12  # m, below which a gap between sub-impacts is rounding


@dataclass(frozen=True)
class Collision:
    """One collision of two bodies; values that do not apply are None.

    The speeds are the mean ones of the striker relative to that of the other body, 0 of a wall and of a held body:
    positive when they approach. The energies are those of the whole bodies, so they include the work of other contacts
    and loads in that time.
    """

    bodies: str  # left|right, as in the contacts
    sub_impacts: int  # contacts, of a law of impulses kicks
    start: float  # s, of the first
    end: float | None  # s, of the last; None while still closed at the end of the run
    duration: float  # s, from start to end, or to the end of the run
    in_contact: float  # s, the sum of the sub-impacts
    impulse: float  # N s, the sum of the sub-impacts
    peak_force: float | None  # N, of the largest
    largest_gap: float | None  # m, between sub-impacts
    longest_opening: float | None  # s, between sub-impacts
    striker: str  # the rigid body, else the one that moved at the start
    approach_speed: float | None  # m/s, 0 where it is rounding: see `MIN_APPROACH`
    exit_speed: float | None  # m/s, positive when they part; while still closed that at the end of the run
    restitution: float | None  # exit over approach speed, of a meeting of these two bodies alone up to their parting
    energy_lost: float | None  # J, by the striker
    energy_given: float | None  # J, to the other body
    no_restitution: str | None  # why there is none, in words; None where there is one


def collisions(history: AbstractHistory, *, whole: bool = True) -> tuple[Collision, ...]:
    """Return the collisions of a run, in order of their starts.

    With ``whole=False`` their energies and gaps are not computed.
    """
    scene = history.scene
    channels = frozenset(history.channels())  # once: a chain has thousands
    motions = {name: BodyMotion(history, name, channels) for name in scene.bodies}
    others = Others(history)  # once: a pair may collide thousands of times
    between: dict[tuple[str, str], list[str]] = {}
    for contact in scene.contacts:
        between.setdefault((contact.left.body, contact.right.body), []).append(contact.name)
    groups = [(pair, group) for pair, names in between.items() for group in _groups(history, pair, names)]
    periods: dict[str, list[tuple[float, float]]] = {}
    for pair, group in groups:
        for name in pair:
            periods.setdefault(name, []).append(_instants(group, history.duration))
    for name, own in periods.items():
        motions[name].read_ahead(own, energies=whole)
    found = [_collision(motions, others, pair, group, whole) for pair, group in groups]
    return tuple(sorted(found, key=lambda each: each.start))


def _groups(history: AbstractHistory, pair: Sequence[str], names: Sequence[str]) -> Iterator[list[ContactSpan]]:
    """Yield the periods of contact of each collision of two bodies, in order of their starts."""
    longest, group, until = memory(history.scene, pair), list[ContactSpan](), -math.inf
    for span in sorted(history.spans_of(names), key=lambda span: span.start):
        if group and span.start - until > longest:
            yield group
            group = []
        group.append(span)
        until = max(until, span.until(math.inf))
    if group:
        yield group


def _instants(spans: Sequence[ContactSpan], last: float) -> tuple[float, float]:
    """Return the instants just before a collision and at its end, or at that of the run [s]."""
    return float(np.nextafter(spans[0].start, -1.0)), max(span.until(last) for span in spans)


def memory(scene: Scene, pair: Sequence[str]) -> float:
    """Return the longest opening inside a collision [s], the slowest period of the bodies."""
    return max(scene.bodies[name].slowest_period for name in pair)


def _collision(
    motions: Mapping[str, BodyMotion], others: Others, pair: tuple[str, str], spans: list[ContactSpan], whole: bool
) -> Collision:
    scene, history = others.scene, others.history
    start, last = spans[0].start, history.duration
    closed = any(span.end is None for span in spans)
    before, until = _instants(spans, last)
    openings = [(a.end, b.start) for a, b in itertools.pairwise(spans) if a.end is not None and b.start > a.end]
    forces = [span.peak_force for span in spans if span.peak_force is not None]
    striker, other = _roles(scene, pair)
    sign = 1.0 if striker == pair[0] else -1.0  # the left body approaches with a positive velocity
    speeds = [motions[name].speed(before) for name in (striker, other)]
    approach = _difference(speeds, sign)
    leaves = _difference([motions[name].speed(until) for name in (other, striker)], sign)
    rounding = MIN_APPROACH * max(scene.fastest, abs(leaves or 0.0))
    if approach is not None and abs(approach) <= rounding:
        approach = 0.0
    lost = given = None
    if whole:
        lost, given = (motions[name].energy_change(before, until) for name in (striker, other))
    why = "they are still in contact at the end of the run" if closed else None
    turning = next((name for name in pair if scene.bodies[name].changes), None)
    if why is None and turning is not None:
        faces = next(contact.faces for contact in scene.contacts if contact.name == spans[0].contact)
        face = next(point.label for point in faces if point.body == turning)
        why = f"'{turning}' is a mechanism; the speed of its face is the channel velocity:{face}"
    why = why or others.part_in(pair, (start, until), sum(span.impulse for span in spans))
    if why is None and (approach is None or leaves is None):
        why = f"the speed of '{striker if speeds[0] is None else other}' is not known at that time"
    # A third body that still drives the other one into the striker makes the approach: its speed is of an instant.
    at_first = scene.bodies[other].velocity  # speeds relative to it are those of any frame
    driven = why is None and abs((speeds[1] or 0.0) - at_first) > abs((speeds[0] or 0.0) - at_first)
    if driven and (third := others.touched(other, pair, before, start)):
        why = f"'{third}' drives '{other}' into '{striker}'"
    if why is None and approach is not None and leaves is not None:
        why = _no_approach(approach, leaves, rounding)
    return Collision(
        bodies="|".join(pair),
        sub_impacts=sum(1 if span.kicks is None else span.kicks for span in spans),
        start=start,
        end=None if closed else until,
        duration=until - start,
        in_contact=sum(span.until(last) - span.start for span in spans),
        impulse=sum(span.impulse for span in spans),
        peak_force=max(forces, default=None),
        largest_gap=_largest_gap(history, spans[0].contact, openings) if openings and whole else None,
        longest_opening=max((b - a for a, b in openings), default=None),
        striker=striker,
        approach_speed=approach,
        exit_speed=leaves,
        restitution=leaves / approach if why is None and leaves is not None and approach is not None else None,
        energy_lost=None if lost is None else -lost,
        energy_given=given,
        no_restitution=why,
    )


def _no_approach(approach: float, leaves: float, rounding: float) -> str | None:
    """Return the reason for no restitution at these speeds [m/s], else None."""
    if approach <= rounding:
        return "their mean speeds do not approach each other"
    return "their mean speeds still approach each other after the last contact" if leaves < -rounding else None


def _difference(values: Sequence[float | None], factor: float) -> float | None:
    """Return a factor times the first value less the second; None where one is missing."""
    first, second = values
    return None if first is None or second is None else factor * (first - second)


def _roles(scene: Scene, pair: tuple[str, str]) -> tuple[str, str]:
    """Return the striker of two bodies, and the other.

    The striker is a mass, else an elastic body that moved or is free.
    """

    def rank(name: str) -> tuple[bool, bool, bool]:
        body = scene.bodies[name]
        return (body.moves, body.elastic is None and body.moves, body.velocity != 0.0)

    left, right = pair
    return (left, right) if rank(left) >= rank(right) else (right, left)


def _largest_gap(history: AbstractHistory, contact: str, openings: Sequence[tuple[float, float]]) -> float:
    samples = max(3, min(MAX_SAMPLES, MAX_ALL_SAMPLES // len(openings)))
    t = np.concatenate([np.linspace(a, b, samples) for a, b in openings])
    return max(0.0, float(np.max(history.evaluate(t, f"gap:{contact}"))))


def agreements(rows: Iterable[tuple[str, Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """Return the sub-impacts of each pair of bodies in several summaries, by method.

    The count is resolved where all methods find the same number in the same number of collisions. Laws of impulses give
    a number of kicks and are left out. Each entry has ``bodies``, ``counts`` by method, ``resolved``,
    ``impulses_within`` (the largest difference of a method's impulse of a pair from that of the first, as a share; None
    where not resolved) and ``text``.
    """
    found: dict[str, dict[str, list[Mapping[str, Any]]]] = {}
    for name, summary in rows:
        if summary.get("status") not in ("completed", "tolerance_not_met") or any(
            span.get("kicks") for span in summary["contacts"]
        ):
            continue
        for each in summary.get("collisions", ()):
            found.setdefault(each["bodies"], {}).setdefault(name, []).append(each)
    return [_agreement(bodies, by_name) for bodies, by_name in found.items() if len(by_name) > 1]


def agreement_texts(entries: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the texts of `agreements`, at most `MAX_PAIRS` of each kind.

    One kind is of pairs of bodies that agree, the other of pairs that do not.
    """
    texts: list[str] = []
    for resolved, verdict in ((True, "methods agree"), (False, "methods disagree")):
        pairs = [each for each in entries if each["resolved"] is resolved]
        texts += [str(each["text"]) for each in pairs[:MAX_PAIRS]]
        if rest := pairs[MAX_PAIRS:]:
            text = f"{counted(len(rest), 'more pair')} of bodies: {verdict} on the number of sub-impacts"
            if resolved:
                text += f", impulses within {100.0 * max(each['impulses_within'] for each in rest):.2g} %"
            texts.append(text + " (each of them: --json)")
    return texts


def _agreement(bodies: str, by_name: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, Any]:
    counts = {name: sum(int(each["sub_impacts"]) for each in group) for name, group in by_name.items()}
    resolved = len(set(counts.values())) == 1 and len({len(group) for group in by_name.values()}) == 1
    within = None
    if resolved:
        sums = [sum(float(each["impulse"]) for each in group) for group in by_name.values()]
        within = max(abs(each - sums[0]) for each in sums) / abs(sums[0]) if sums[0] else 0.0
        found = counted(next(iter(counts.values())), "sub-impact")
        text = f"{bodies}: {found} by all {len(counts)} methods, impulses differ by at most {100.0 * within:.2g} %"
    else:
        listed = ", ".join(f"{count} by {name}" for name, count in counts.items())
        text = f"{bodies}: methods disagree on the number of sub-impacts: {listed}"
    return {"bodies": bodies, "counts": counts, "resolved": resolved, "impulses_within": within, "text": text}
