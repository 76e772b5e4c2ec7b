"""Readout of a stepped run: links, impulses, memories, contacts in progress.

Contacts are numbered as in the scene.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from impactlab.history.base import ContactSpan, LinkResult
from impactlab.numerics.interpolation import between, cubic
from impactlab.scene.method import laws_of
from impactlab.simulate.channels import Channel
from impactlab.simulate.planning.forces_at_start import forces_at_start
from impactlab.simulate.stepping.arrays import COUNT, GAP, PEAK, RECENT, SPAN, TOTAL, U, V
from impactlab.simulate.stepping.event_times import CLOSE, OPEN
from impactlab.simulate.stepping.results.rounding_touches import RawEvent
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.types import MEMORY, Array

TOGETHER = 64  # columns of a record that are read at once


def bead_gaps(assembly: Assembly, record: Array) -> Array:
    """Return the gaps of bead contacts at the instants of a record [m], (n_bead_contacts, n_records)."""
    first, layout = assembly.layout.first_bead, assembly.layout
    gaps = across_beads(assembly, rows_of_columns(record, first, layout.n_beads))
    gaps += assembly.memory.bead_contacts[GAP, assembly.slots][:, None]
    return gaps


def bead_gaps_at_end(assembly: Assembly, record: Array, known: Array, t: float) -> Array:
    """Return the gaps of bead contacts at the end t [s] of a run [m], (n_bead_contacts,), from its last records."""
    last, layout = record[-3:], assembly.layout
    at = between(np.array(t), last[:, 0])
    gaps = bead_gaps(assembly, last)
    if layout.stride > 1 and layout.smooth_beads.issuperset(layout.rows.beads):
        return cubic(at, gaps, across_beads(assembly, bead_rates(assembly, last, known[-3:])))
    return np.asarray(gaps[:, at.before] + at.share * (gaps[:, at.before + 1] - gaps[:, at.before]))


def across_beads(assembly: Assembly, moved: Array) -> Array:
    """Return the differences of a motion (n_beads, n) across contacts of beads, (n_bead_contacts, n)."""
    layout = assembly.layout
    rows, at_rest = layout.rows, np.zeros(moved.shape[1])  # at_rest: of a wall
    places = {name: place for place, name in enumerate(rows.beads)}
    found = np.empty((len(rows.contacts), moved.shape[1]))
    for place, number in enumerate(rows.contacts):
        contact = layout.scene.contacts[number]
        left, right = (
            moved[places[point.body]] if point.body in places else at_rest for point in (contact.left, contact.right)
        )
        np.subtract(right, left, out=found[place])
    return found


def rows_of_columns(record: Array, first: int, count: int) -> Array:
    """Return ``count`` columns of a record (n_records, n_columns) from ``first`` on as rows, (count, n_records).

    Some at a time: one by one, each would read a line of memory per record.
    """
    found = np.empty((count, len(record)))
    for place in range(0, count, TOGETHER):
        found[place : place + TOGETHER] = record[:, first + place : first + min(place + TOGETHER, count)].T
    return found


def bead_rates(assembly: Assembly, record: Array, known: Array) -> Array:
    """Return the velocities of beads at the instants of a record [m/s], (n_beads, n_records).

    Those in the record are ``known`` (n_records,) [s] a part of a step earlier.
    """
    layout = assembly.layout
    found, late = rows_of_columns(record, layout.first_bead + layout.n_beads, layout.n_beads), record[:, 0] - known
    for place in range(0, layout.n_beads, TOGETHER):
        rates = found[place : place + TOGETHER]
        rates += late * np.gradient(rates, known, axis=1)
    return found


def links(assembly: Assembly, recorded: Mapping[str, Channel]) -> Iterator[LinkResult]:
    """Yield the results of each link whose force is ``recorded``.

    Links of one name give one result. Forces of steps are means: with that at t = 0, a force that rises or falls from
    there has its first value, too.
    """
    solved, plan = assembly.layout.solved, assembly.layout.plan
    names = [assembly.scene.contacts[number].name for number in solved]
    own: dict[str, list[int]] = {}
    for place, record in enumerate(assembly.contacts):
        if record.joined:
            contact = assembly.scene.contacts[solved[place]]
            own.setdefault(contact.shared_name, []).append(place)
    joined = [solved[place] for places in own.values() for place in places]
    laws_in_order = laws_of(assembly.scene, assembly.acting)
    first = forces_at_start(assembly.scene, laws_in_order, plan.starts, plan.built, assembly.dt, joined)
    for name, places in own.items():
        laws = [assembly.acting.laws[names[place]] for place in places]
        sets = [law.set_of([*assembly.ports[place].memory]) for law, place in zip(laws, places, strict=True)]
        most = max((each for each in sets if each is not None), default=None, key=abs)
        records = [assembly.contacts[place] for place in places]
        forces = [records[0].largest, records[0].smallest] if len(places) == 1 else recorded[f"force:{name}"].values[1:]
        if all(law.acts_at_start for law in laws):
            forces = np.append(forces, sum(first.get(solved[place], 0.0) for place in places))
        known = np.extract(np.isfinite(forces), forces) if np.any(np.isfinite(forces)) else np.zeros(1)
        loss = sum(record.lost for record in records)
        yield LinkResult(name, len(places), most, float(known.max()), float(known.min()), loss, tuple(sets))


def opened_in_first_step(assembly: Assembly, raw: Sequence[Any], acts: float) -> Iterator[RawEvent]:
    """Yield the events of contacts with a force at t = 0 and none at the end of the first step.

    A scheme whose forces act at the ends of steps has no step with the force at t = 0, which ``acts`` for a part of the
    first one [s]. The law may have released the faces by then, as one whose damping exceeds the force of the spring.
    """
    starts, layout = assembly.layout.plan.start_forces, assembly.layout
    if acts <= 0.0:
        return
    early = {int(place) for each in raw for place in each["contact"][each["time"] < acts]}
    for number, force in starts.items():
        place, law = layout.places[number], assembly.acting.laws[layout.scene.contacts[number].name]
        if force > 0.0 and place not in early and not law.two_sided:
            yield 0.0, place, CLOSE, 0.0, 0.0, 0.0
            yield acts, place, OPEN, 0.0, 0.0, force


def with_forces_at_start(assembly: Assembly, spans: Sequence[ContactSpan]) -> list[ContactSpan]:
    """Return periods of contact whose peaks include the force at t = 0, which no step has as its mean."""
    started = {span.contact for span in spans if span.start == 0.0 and span.peak_force is not None}
    if not started:
        return [*spans]
    scene, plan = assembly.scene, assembly.layout.plan
    numbers = [number for number, contact in enumerate(scene.contacts) if contact.name in started]
    laws = laws_of(scene, assembly.acting)
    found = forces_at_start(scene, laws, plan.starts, plan.built, assembly.dt, numbers)
    first = {scene.contacts[number].name: force for number, force in found.items()}
    return [
        span._replace(peak_force=max(span.peak_force, first[span.contact]))
        if span.start == 0.0 and span.peak_force is not None and span.contact in first
        else span
        for span in spans
    ]


def span_of(assembly: Assembly, number: int) -> tuple[float, float, float]:
    """Return impulse [N s], last force and peak [N] of an unfinished contact.

    ``number`` is that of the contact in the scene.
    """
    layout, dt = assembly.layout, assembly.dt
    place = layout.places[number] - len(layout.solved)
    if place < 0:
        kept = assembly.contacts[layout.places[number]]
        return kept.span_impulse, kept.force, kept.span_peak
    slot, power = assembly.slots[place], layout.rows.forces[number]
    found, (u, v) = assembly.memory.bead_contacts[:, slot], assembly.memory.beads[U : V + 1]
    # Where the beads were at the start of the last step.
    overlap = float(u[slot] - u[slot + 1] - found[GAP] - dt * (v[slot] - v[slot + 1]))
    force = power.stiffness * max(0.0, overlap) ** power.exponent
    return float(found[SPAN] + found[RECENT]) * dt, force, float(found[PEAK])


def failed(assembly: Assembly) -> list[int]:
    """Return the numbers in the scene of the contacts whose laws failed."""
    layout, bead = assembly.layout, assembly.clock.failed_bead
    found = [number for number, reply in zip(layout.solved, assembly.replies, strict=True) if reply.failed]
    return found + ([layout.rows.contacts[bead - 1]] if bead else [])


def impulses(assembly: Assembly) -> list[float]:
    """Return the impulses of all contacts of the scene since t = 0 [N s].

    Forces times time are included.
    """
    numbers, given = assembly.layout.numbers, [contact.total for contact in assembly.contacts]
    found = [0.0] * len(numbers)
    if assembly.layout.rows.contacts:
        of_beads = assembly.memory.bead_contacts[:, assembly.slots]
        given += (assembly.dt * (of_beads[TOTAL] + of_beads[RECENT])).tolist()
    for number, each in zip(numbers, given, strict=True):
        found[number] = each
    return found


def losses(assembly: Assembly, booked: float) -> dict[str, float]:
    """Return the energy lost in each contact that lost any [J], by name.

    All together they have ``booked`` so much up to the end of the run: of the losses of the last step its share counts.
    """
    lost = np.array([contact.lost for contact in assembly.contacts])
    last = np.array([reply.dissipated for reply in assembly.replies])
    beyond = float(lost.sum()) - booked
    if last.sum() > 0.0 and beyond > 0.0:
        lost = lost - beyond * last / last.sum()
    contacts = assembly.layout.contacts
    return {contacts[place].name: float(lost[place]) for place in np.flatnonzero(lost).tolist()}


def load_impulses(assembly: Assembly) -> dict[str, float]:
    """Return the impulses of loads by body, as the steps took them [N s]."""
    found: dict[str, float] = {}
    names = [*assembly.layout.built]
    for load in assembly.loads:
        name = names[load.body]
        found[name] = found.get(name, 0.0) + load.impulse
    return found


def memories(assembly: Assembly) -> list[Sequence[float]]:
    """Return the memory of every law of the scene.

    Contacts of beads have none: theirs holds the count of warnings.
    """
    layout = assembly.layout
    found: list[Sequence[float]] = [()] * len(layout.numbers)
    for number, port in zip(layout.solved, assembly.ports, strict=True):
        found[number] = port.memory[:]
    for place, number in enumerate(layout.rows.contacts):
        counted, memory = layout.rows.forces[number].counted, [0.0] * MEMORY
        if counted is not None:
            memory[counted.slot] = float(assembly.memory.bead_contacts[COUNT, assembly.slots[place]])
        found[number] = memory
    return found
