"""The noise floor of contacts: touches by rounding, or before any wave, are not events.

Faces that rest on each other with a gap of zero touch by rounding, and meshes and modes move them before a wave has
arrived. Such touches are left out of events and spans, and a span that began too early begins with
the wave. Impulses are counted to the span of their contact that follows, or else to the one before, so that sums stay
those of the run. Waves that arrive together, except for rounding, may part the faces for as long as they differ: a
span that closes again so soon goes on.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple, TypeVar

from impactlab.history.arrivals import first_arrivals
from impactlab.history.base import ContactSpan, Event
from impactlab.history.frame import Group, groups
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene

MIN_SHARE = 1e-11  # of the largest force and impulse among the bodies that interact: a touch below it is rounding
MAX_SHARE = 1e-8  # the same, at most, however many steps a run takes
GAP_ROUNDINGS = 8.0  # of a gap, each eps times a displacement: four sums of displacements and rates in two faces
MIN_EARLY_SHARE = 1e-3  # of the largest impulse: below it a touch before any wave is dropped where no later one follows
MIN_OPENING = 1e-11  # of the instant: faces that close again sooner were parted by rounding of the times of waves
MAX_EARLY = 1e-3  # of the time a wave takes: touches by no more than this too early are dated so by their step

T = TypeVar("T", ContactSpan, Event)
Found = tuple[tuple[Event, ...], tuple[ContactSpan, ...]]
Key = tuple[str, float, float | None]  # contact, start, end of a span


class Floor(NamedTuple):
    """The least force and impulse of a touch of one contact, and the earliest time."""

    force: float  # N
    impulse: float  # N s
    early_impulse: float  # N s, before a wave arrives
    arrival: float  # s, before which the contact cannot close


class InteractingGroups(NamedTuple):
    """Groups of interacting bodies and first arrivals of waves: known before a run."""

    groups: dict[str, int]  # number of the group of bodies that a contact is in
    arrivals: dict[str, float]  # s, before which nothing can have reached a contact


def reach_of(scene: Scene, method: Method) -> InteractingGroups:
    """Return groups and first arrivals of contacts, which runs of one scene share."""
    # No other fact of a method matters.
    key = "reach", tuple(name for name, model in method.models.items() if model.theory), bool(method.links)
    if key not in scene.derived:
        scene.derived[key] = InteractingGroups(_groups_of(scene, groups(scene)), first_arrivals(scene, method))
    found: InteractingGroups = scene.derived[key]
    return found


def share_of(steps: float) -> float:
    """Return the rounding of a force over the largest one, by number of steps.

    A gap is rounded by eps times the displacements, which grow with the duration; a force follows from the displacement
    in one step. So the force by a rounded gap is eps times the number of steps, over the largest.
    """
    return min(MAX_SHARE, max(MIN_SHARE, GAP_ROUNDINGS * sys.float_info.epsilon * steps))


def above_noise(
    scene: Scene,
    method: Method,
    events: Sequence[Event],
    spans: Sequence[ContactSpan],
    steps: float = 0.0,
    reached: float | None = None,
) -> Found:
    """Return events and spans of a run without noise, in order of time.

    Parameters
    ----------
    scene : Scene
        The scene of the run.
    method : Method
        Its models, as theories of their own have no fronts, and its laws.
    events, spans : sequence
        All that were found, in order of time; a span begins and ends with the events of its contact.
    steps : float, optional
        How many steps the duration has; 0 where there are none.
    reached : float, optional
        End of a run that may have stopped early [s]; the duration of the scene if not given.
    """
    if not spans and not events:
        return (), ()
    reach = reach_of(scene, method)
    if len(spans) == 1 and spans[0].kicks is None and all(event.kind != "impulse" for event in events):
        (span,) = spans  # the largest of all
        if span.impulse != 0.0 and reach.arrivals[span.contact] == 0.0:
            return tuple(sorted(events, key=lambda event: event.time)), (span,)
    events, spans = _without_brief_openings(events, spans)
    floors = _floors(spans, share_of(steps), reach)
    if not _any_noise(events, spans, floors):
        return tuple(sorted(events, key=lambda event: event.time)), tuple(sorted(spans, key=lambda span: span.start))
    until = scene.duration if reached is None else reached
    kept: list[ContactSpan] = []
    begins: dict[Key, float | None] = {}  # where spans begin; None of one that is noise
    kicks = _of_contacts(event for event in events if event.kind == "impulse")
    for name, found in _of_contacts(sorted(spans, key=lambda each: each.start)).items():
        floor = floors[name]
        real = _real(found, floor, until)
        begins.update((_key(span), None) for span in found)
        begins.update((_key(span), max(span.start, min(floor.arrival, span.until(until)))) for span in real)
        own = kicks.get(name, ())
        kept += [_without_small_kicks(span, own, floor) for span in _with_impulses(found, real, begins)]
    left = tuple(event for *_, event in sorted(_events(events, begins, floors), key=lambda found: found[:2]))
    return left, tuple(sorted(kept, key=lambda span: span.start))


def _without_brief_openings(
    events: Sequence[Event], spans: Sequence[ContactSpan]
) -> tuple[Sequence[Event], Sequence[ContactSpan]]:
    """Return events and spans without openings by rounding, the spans beside them joined."""
    whole: list[ContactSpan] = []
    last: dict[str, int] = {}  # place of the last span of each contact in `whole`
    # Openings and closings between joined spans, counted: a touch without length has its last opening there, too.
    brief: Counter[tuple[str, float, str]] = Counter()
    for span in sorted(spans, key=lambda each: each.start):
        at = last.setdefault(span.contact, len(whole))
        before = whole[at] if at < len(whole) else None
        if before is None:
            whole.append(span)
        elif span.kicks is None and before.end is not None and span.start - before.end <= MIN_OPENING * span.start:
            brief.update(((span.contact, before.end, "open"), (span.contact, span.start, "close")))
            peaks = [each.peak_force for each in (before, span) if each.peak_force is not None]
            impulse = before.impulse + span.impulse
            whole[at] = before._replace(end=span.end, impulse=impulse, peak_force=max(peaks, default=None))
        else:
            last[span.contact] = len(whole)
            whole.append(span)
    if not brief:
        return events, spans
    left: list[Event] = []
    for event in events:
        key = event.contact, event.time, event.kind
        if brief[key]:
            brief[key] -= 1
        else:
            left.append(event)
    return left, whole


def _of_contacts(found: Iterable[T]) -> dict[str, list[T]]:
    """Return spans or events by contact, in one pass.

    A chain has as many contacts as bodies.
    """
    parts: dict[str, list[T]] = {}
    for each in found:
        parts.setdefault(each.contact, []).append(each)
    return parts


def _key(span: ContactSpan) -> Key:
    return span.contact, span.start, span.end


def _is_noise(span: ContactSpan, floor: Floor) -> bool:
    return abs(span.impulse) <= floor.impulse and (span.peak_force is None or span.peak_force <= floor.force)


def _any_noise(events: Sequence[Event], spans: Sequence[ContactSpan], floors: Mapping[str, Floor]) -> bool:
    """Return whether an event or a span may be noise; of most runs none is."""
    if any(span.start < floors[span.contact].arrival or _is_noise(span, floors[span.contact]) for span in spans):
        return True
    kicks = ((event, floors[event.contact]) for event in events if event.kind == "impulse")
    return any(event.time < floor.arrival or not _is_kick(event, floor) for event, floor in kicks)


def _real(found: Sequence[ContactSpan], floor: Floor, duration: float) -> list[ContactSpan]:
    """Return the spans of a contact above its noise, none before a wave arrives."""
    loud = [span for span in found if not _is_noise(span, floor)]
    late = [span for span in loud if span.until(duration) >= floor.arrival]
    if late:
        return late
    # No later span can take over their impulses: only those with small ones are left out.
    return [span for span in loud if abs(span.impulse) > floor.early_impulse]


def _with_impulses(
    own: Sequence[ContactSpan], real: Sequence[ContactSpan], begins: Mapping[Key, float | None]
) -> list[ContactSpan]:
    """Return the real spans of a contact, with the impulses of the others between."""
    impulses = [span.impulse for span in real]
    following = 0
    for span in own:
        if following < len(real) and span is real[following]:
            following += 1
        elif real:
            impulses[min(following, len(real) - 1)] += span.impulse
    return [
        span._replace(start=begins[_key(span)] or 0.0, impulse=impulse)
        for span, impulse in zip(real, impulses, strict=True)
    ]


def _without_small_kicks(span: ContactSpan, impulses: Sequence[Event], floor: Floor) -> ContactSpan:
    """Return a span of kicks without those below the noise.

    The others count and date it.
    """
    if span.kicks is None:
        return span
    kicks = [each for each in impulses if _is_kick(each, floor)]
    if not kicks:
        return span
    return span._replace(start=kicks[0].time, end=kicks[-1].time, first_impulse=kicks[0].impulse, kicks=len(kicks))


def _is_kick(event: Event, floor: Floor) -> bool:
    return event.kind == "impulse" and abs(event.impulse or 0.0) > floor.impulse


def _events(
    events: Sequence[Event], begins: Mapping[Key, float | None], floors: Mapping[str, Floor]
) -> Iterator[tuple[float, int, Event]]:
    """Yield (time, number, event) of the events above the noise.

    A closing and the opening after it are kept or dropped with their span.
    """
    closed: dict[str, tuple[int, Event]] = {}
    late = {name for (name, *_), begin in begins.items() if begin is not None and begin >= floors[name].arrival}
    for number, event in enumerate(events):
        if event.kind == "impulse":
            floor = floors[event.contact]
            if _is_kick(event, floor) and (event.time >= floor.arrival or event.contact not in late):
                yield event.time, number, event
        elif event.kind == "close":
            closed[event.contact] = number, event
        else:
            first, close = closed.pop(event.contact, (number, None))
            start = 0.0 if close is None else close.time
            begin = begins.get((event.contact, start, event.time), start)
            if begin is not None:
                if close is not None:
                    yield begin, first, close._replace(time=begin)
                yield event.time, number, event
    for number, close in closed.values():
        begin = begins.get((close.contact, close.time, None), close.time)
        if begin is not None:
            yield begin, number, close._replace(time=begin)


def _floors(spans: Sequence[ContactSpan], share: float, reach: InteractingGroups) -> dict[str, Floor]:
    """Return the floor of each contact.

    They are shares of the largest force and impulse among the bodies that it joins.
    """
    forces, impulses = dict[int, float](), dict[int, float]()
    for span in spans:
        at = reach.groups[span.contact]
        forces[at] = max(forces.get(at, 0.0), span.peak_force or 0.0)
        impulses[at] = max(impulses.get(at, 0.0), abs(span.impulse))
    return {
        name: Floor(
            share * forces.get(at, 0.0),
            share * impulses.get(at, 0.0),
            MIN_EARLY_SHARE * impulses.get(at, 0.0),
            (1.0 - MAX_EARLY) * reach.arrivals[name],
        )
        for name, at in reach.groups.items()
    }


def _groups_of(scene: Scene, joined: Sequence[Group]) -> dict[str, int]:
    """Return the number of the group of bodies that each contact is in."""
    group_of = {name: number for number, group in enumerate(joined) for name in group.bodies}
    return {
        contact.name: max((group_of[p.body] for p in contact.faces if scene.bodies[p.body].moves), default=-1)
        for contact in scene.contacts
    }
