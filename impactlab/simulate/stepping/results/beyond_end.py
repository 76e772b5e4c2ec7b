"""Values at the end of a run, from the records of its last steps and of a step beyond it.

A step spreads its forces over its length, and a value inside it lies on a line between both ends. Three changes are no
part of such a line:

- an impulse at the start of the step (a *kick*) is in the run as a whole;
- so is the impulse of faces that part before the end of the run;
- the force of faces that touch after the end of the run is not in it at all.

The changes of the first two kinds, at once, are known from the responses of the bodies. They are taken out of the end
of their step, the line is drawn, and they are added as a whole: with q before the step, q' after it and a change j,

    q(t) = q + s (q' - j - q) + j

at the share s of the step. The same sum gives momenta and impulses, so that they agree to rounding. Where faces touch
after the end of the run, the last step is left out, and the line goes on from the steps before it; a run of one step is
taken again with these faces apart. Leapfrog keeps velocities of the middle of each step, and free ends of delay lines
their means over it: for these the loop takes one step beyond the end, in arrays of its own.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.numerics.addresses import COMPILED, entered_with_table
from impactlab.numerics.raised import keep_raised
from impactlab.simulate.stepping import event_times, loop
from impactlab.simulate.stepping.arrays import GAP, PEAK, SAMPLED, StepArrays
from impactlab.simulate.stepping.end_loads import ON_GRID
from impactlab.simulate.stepping.loop import DONE, advance_dated
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.simulate.stepping.setup.layout import PER_CONTACT
from impactlab.types import Array

ON_STEP = 1e-9  # of a step: a run that ends this close to the end of a step ends there
OUT_OF_REACH = 1e3  # of the lengths of a scene, by which faces that are apart stay apart after the end of the run
KEPT = 3  # instants of the run that may be read: momenta of generalised-alpha belong to later ones than their steps
ROOM = 8  # records and samples of the steps after the end: the loop wants some to spare
STORED, LOST_CONTACT, LOST_UNRESOLVED = 1, 2, 5  # columns of a sample
BODY_COLUMNS, MOMENTUM = 3, 2  # columns of a body in a sample, and which its momentum is
BEFORE, LAST = 0, 1  # rows of `LastSteps`: the step before the last one, and the last one


class RecordsAround(NamedTuple):
    """Records and samples around the end of a run, a step apart; see `StepArrays`.

    Rows of changes go on to the last step of the run, also where its record is left out.
    """

    time: float  # s, end of the step of the first
    done: int  # how many rows of changes are of steps of the run
    dt: float  # s
    record: Array  # (2 to 4, n_columns)
    sample: Array  # (2 to 4, n_sampled)
    impulses: Array  # (2 to 4, n_loads) N s, of loads over time so far
    record_changes: Array  # (n, n_columns) changes at once in each step, in records and in samples
    sample_changes: Array  # (n, n_sampled)
    kicks: Array  # (n, n_contacts) N s, of each step
    at_once: Array  # (n, n_contacts) N s, the same with the impulses of forces that are in the run as a whole

    def at(
        self,
        time: float,
        rows: Array,
        early: float,
        changes: Array | None = None,
        at_start: Array | float | None = None,
    ) -> Array:
        """Return values at a time [s] from rows of records.

        Rows belong to instants ``early`` [s] before the end of their steps; of their ``changes`` at once those of steps
        of the run are in the value as a whole. Before the instant of the first sample, at ``-early``, values lie on a
        line from those ``at_start``, at t = 0.
        """
        moved = np.zeros((self.done + 1, *rows.shape[1:])) if changes is None else changes
        shares = (time - (self.time - early)) / self.dt
        if shares < 0.0 and self.time == 0.0 and early < 0.0 and at_start is not None:
            return np.asarray(at_start + time / -early * (rows[0] - at_start) + moved[1 : self.done].sum(axis=0))
        pair = min(max(math.floor(shares), 0), len(rows) - 2)
        line = rows[pair] + (shares - pair) * (rows[pair + 1] - moved[pair + 1] - rows[pair])
        return np.asarray(line + moved[pair + 1 : self.done].sum(axis=0))

    def impulse(
        self, time: float, column: int, place: int | None, before: float, early: float, at_start: float
    ) -> float:
        """Return the impulse of a contact up to a time [N s].

        ``before`` is the impulse of all steps of the run except the last one. It lies on the line on which momenta lie,
        which belong ``early`` [s] before the end of their steps. At t = 0 it is that of the force ``at_start`` [N] over
        this time, which the steps do not count. ``place`` is that of the contact in the changes, None of beads.
        """
        rows, none = len(self.record), np.zeros(len(self.kicks))
        kicks, at_once = (none, none) if place is None else (self.kicks[:, place], self.at_once[:, place])
        sums = np.cumsum(self.record[:, column] * self.dt + kicks[:rows])
        totals = before + sums - sums[self.done - 2]
        return float(self.at(time, totals, early, at_once, early * at_start))


class LastSteps(NamedTuple):
    """Contacts in the last two steps of a run, and the impulses there that are in the run as a whole."""

    late: frozenset[int]  # contacts that touch after the end of the run
    pressed: bool  # whether the last step holds a force of one of them
    kicks: Array  # (2, n_contacts) N s, impulses at once of the step before the last one and of the last one
    jumps: Array  # the same of forces that hold the jump of a closing, in leapfrog
    parted: Array  # the same of forces of faces that part before the end of the run

    @property
    def crossed(self) -> bool:
        """Whether a line across the last step is a mixture of the motions before and after a kick or a touch."""
        return self.pressed or any(bool(np.count_nonzero(each)) for each in (self.kicks, self.jumps, self.parted))


def last_steps(assembly: Assembly, integrator: AbstractIntegrator, raw: Sequence[Any], duration: float) -> LastSteps:
    """Return the kicks, partings and late touches in the last steps of a run.

    There are none where values at its end need no line: it ends with a step, and momenta belong to the same instant.
    """
    clock, dt, number = assembly.clock, assembly.dt, len(assembly.contacts)
    kicks, jumps, parted = np.zeros((3, 2, number))
    ends_inside = duration < clock.time - ON_STEP * dt
    if not number or not (ends_inside or integrator.momentum_early != 0.0):
        return LastSteps(frozenset(), False, kicks, jumps, parted)
    kicks[LAST] = [contact.impulse for contact in assembly.contacts]
    late = _late_touches(raw, clock.time, dt, duration, kicks[BEFORE])
    before = assembly.memory.record[clock.n_records - 2] if clock.step > 1 else None
    for place, (contact, port) in enumerate(zip(assembly.contacts, assembly.ports, strict=True)):
        forces = 0.0 if before is None else before[1 + PER_CONTACT * place] * dt, contact.force * dt
        if not contact.dates or contact.joined or not any(forces):
            continue
        given = forces[LAST] + contact.impulse
        began = contact.span_impulse == given  # the contact under way, or the one that ended, in the last step
        goes_on = port.in_contact > 0.0 or contact.last_event > duration
        jumps_in_force = integrator.velocity_point < 1.0 and assembly.acting.laws[_name(assembly, place)].hard
        if not goes_on:
            parted[:, place] = forces
        elif began:
            parted[BEFORE, place] = forces[BEFORE]
            jumps[LAST, place] = forces[LAST] if jumps_in_force else 0.0
        elif jumps_in_force and contact.span_impulse == given + forces[BEFORE]:
            jumps[BEFORE, place] = forces[BEFORE]
    if late:
        for each in (kicks, jumps, parted):
            each[LAST, [*late]] = 0.0
    pressed = any(np.any(_given(assembly, place)) for place in late)
    return LastSteps(late, pressed, kicks, jumps, parted)


def _late_touches(raw: Sequence[Any], end: float, dt: float, duration: float, kicks: Array) -> frozenset[int]:
    """Return the contacts that touch after the end of a run, in its last step; write the kicks of the step before it.

    Contacts of beads are not among them: their forces begin in the step after the touch. The last step ends at ``end``.
    """
    late, slack = set[int](), ON_STEP * dt
    for events in reversed(raw):
        near = events[events["time"] >= end - 3.0 * dt]  # events of one step are not in order
        for time, place, kind, impulse, *_ in near[near["contact"] < kicks.size].tolist():
            if kind == event_times.CLOSE and time > duration:
                late.add(place)
            elif kind == event_times.IMPULSE and end - 2.0 * dt - slack < time < end - dt - slack:
                kicks[place] = impulse
        if not near.size:
            break
    return frozenset(late)


def _name(assembly: Assembly, place: int) -> str:
    return assembly.layout.contacts[place].name


def _given(assembly: Assembly, place: int) -> Array:
    """Return force [N], impulse [N s] and projection [kg m] of a contact in the last step."""
    contact = assembly.contacts[place]
    return np.array([contact.force, contact.impulse, contact.projection])


def around_end(assembly: Assembly, integrator: AbstractIntegrator, last: LastSteps) -> RecordsAround | None:
    """Return the records around the end of a run.

    None of a run that failed, or whose steps are cut at events: these end with the run.
    """
    if assembly.clock.step != assembly.steps or assembly.method.events == "located":
        return None
    if last.pressed and assembly.steps == 1:
        other = _first_step(assembly, integrator, last.late)
        return None if other is None else around_end(other, integrator, _again(last, other))
    clock, memory, dt = assembly.clock, assembly.memory, assembly.dt
    own, done = (memory.record[: clock.n_records], memory.sample[: clock.n_samples]), 1
    while done < KEPT and all(_keeps(rows, done, clock.time, dt) for rows in own):
        done += 1
    record, sample = (rows[-done:] for rows in own)
    impulses = [np.array([load.impulse for load in assembly.loads])]
    for steps in range(done - 1):
        before = np.array([_force_before(assembly, load, steps) for load in assembly.loads])
        impulses.insert(0, impulses[0] - dt * before)
    kicks, at_once = np.zeros((2, done + 1, len(assembly.contacts)))
    changes = np.zeros((done + 1, record.shape[1])), np.zeros((done + 1, sample.shape[1]))
    for step, row in ((LAST, done - 1), (BEFORE, done - 2)):
        if row > 0 and last.crossed:
            kicks[row], at_once[row] = last.kicks[step], last.kicks[step] + last.jumps[step] + last.parted[step]
            changes[0][row], changes[1][row] = _changes(assembly, last, step, record[row - 1])
    if last.pressed:
        record, sample, impulses = record[:-1], sample[:-1], impulses[:-1]
    elif (beyond := _beyond(assembly, integrator, last)) is not None:
        record = np.vstack((record, beyond.memory.record[:1]))
        sample = np.vstack((sample, beyond.memory.sample[:1]))
        impulses.append(np.array([load.impulse for load in beyond.loads]))
        kicks[-1] = [contact.impulse for contact in beyond.contacts]
    begin = clock.time - (done - 1) * dt
    return RecordsAround(begin, done, dt, record, sample, np.array(impulses), *changes, kicks, at_once)


def _changes(assembly: Assembly, last: LastSteps, step: int, before: Array) -> tuple[Array, Array]:
    """Return the changes at once in a step, of a record and of a sample.

    ``before`` is the record at its start. An impulse J at a point with the velocity v does the work J v + J dv/2, with
    its jump dv. Energies change by kicks and by closing jumps alone: those of a force that ends in the step lie on the
    line, with the energy that its contact stores.
    """
    m, n_faces = assembly.memory, len(assembly.faces)
    bodies: Any = np.asarray(m.bodies)
    record, sample = np.zeros(before.size), np.zeros(m.sample.shape[1])
    jumped, pushed = np.zeros((2, m.state.size))
    at_once, parted = last.kicks[step] + last.jumps[step], last.parted[step]
    models = [built.model for built in assembly.layout.built.values()]
    acting = [number for number in range(n_faces) if at_once[number // 2] != 0.0 or parted[number // 2] != 0.0]
    moving = [number for number in acting if assembly.faces[number].moves]
    for number in moving:
        face, place = assembly.faces[number], number // 2
        body, own = bodies[face.body], SAMPLED + BODY_COLUMNS * face.body
        first, size, n_dof = (int(body[key]) for key in ("state_start", "state_end", "n_dof"))
        size -= first
        velocities = slice(first + n_dof, first + 2 * n_dof)
        at = int(body["jump_start"]) + face.place * n_dof
        jump = m.jump[at : at + n_dof]
        jumped[velocities] += face.sign * at_once[place] * jump
        at = int(body["response_start"]) + face.place * size
        pushed[first : first + size] += face.sign * parted[place] / assembly.dt * m.responses[at : at + size]
        share = 1.0 if isinstance(models[face.body], AbstractSelfStepping) else float(m.momentum[velocities] @ jump)
        sample[own + MOMENTUM] += face.sign * (at_once[place] + parted[place]) * share
        sample[own] += face.sign * at_once[place] * before[_velocity_column(number)]
    for number in moving:
        face = assembly.faces[number]
        change = row_of(m, n_faces + number, jumped)
        sample[SAMPLED + BODY_COLUMNS * face.body] += 0.5 * face.sign * at_once[number // 2] * change
    changed, layout = jumped + pushed, assembly.layout
    for number in range(n_faces):
        record[_velocity_column(number)] = row_of(m, n_faces + number, changed)
    beads = layout.first_bead + layout.n_beads
    record[beads : beads + layout.n_beads] = changed[1 : 2 * layout.n_beads : 2]
    for number in range(len(m.probe_at)):
        record[layout.first_probe + number] = row_of(m, 2 * n_faces + len(m.readings) + number, changed)
    if step == LAST:
        for place in np.flatnonzero(at_once).tolist():
            reply = assembly.replies[place]
            sample[LOST_CONTACT] += reply.dissipated
            sample[LOST_UNRESOLVED] += reply.unresolved
            sample[STORED] += reply.stored if last.jumps[LAST, place] != 0.0 else 0.0
    return record, sample


def _velocity_column(face: int) -> int:
    """Return the column of a record with the velocity of a face."""
    return 1 + PER_CONTACT * (face // 2) + 3 + 2 * (face % 2)


def _first_step(assembly: Assembly, integrator: AbstractIntegrator, late: frozenset[int]) -> Assembly | None:
    """Return a run of one step with some faces kept apart; None where it fails."""
    other = Assembly(assembly.layout.plan, integrator, assembly.dt)
    _keep_apart(other, late)
    entered_with_table(loop.start, other.memory, other.dt)
    return other if _advanced(other, 1) else None


def _again(last: LastSteps, other: Assembly) -> LastSteps:
    """Return the changes at once in a first step that was taken again without the late touches."""
    kicks, jumps, parted = (each.copy() for each in (last.kicks, last.jumps, last.parted))
    for place, contact in enumerate(other.contacts):
        kicks[LAST, place] = contact.impulse
        for each in (jumps, parted):
            each[LAST, place] = contact.force * other.dt if each[LAST, place] else 0.0
    return last._replace(pressed=False, kicks=kicks, jumps=jumps, parted=parted)


def _beyond(assembly: Assembly, integrator: AbstractIntegrator, last: LastSteps) -> Assembly | None:
    """Return arrays after a step beyond the end of a run; None where no values need it, or it fails.

    Faces without a force in the last step stay apart: their touch comes after it, or their force does, as in leapfrog
    that of a touch in this step.
    """
    of_steps = any(isinstance(built.model, AbstractSelfStepping) for built in assembly.layout.built.values())
    if integrator.velocity_point == 1.0 and not of_steps:
        return None
    other, apart = _copied(assembly), set(last.late)
    for place, (contact, port) in enumerate(zip(other.contacts, other.ports, strict=True)):
        law = assembly.acting.laws[_name(assembly, place)]
        touching = law.answers_force and (port.in_contact > 0.0 or contact.force != 0.0 or contact.impulse != 0.0)
        if not contact.joined and (not touching or last.parted[LAST, place] != 0.0):
            apart.add(place)
    _keep_apart(other, apart)
    apart_beads = assembly.slots[other.memory.bead_contacts[PEAK, assembly.slots] == 0.0]  # 0 of open contacts
    other.memory.bead_contacts[GAP, apart_beads] += _out_of_reach(assembly)
    if not _advanced(other, assembly.steps + 1):
        return None
    for place in last.late:  # it was let go of, which books the energy that a law has stored
        other.memory.sample[0, LOST_CONTACT] -= other.replies[place].dissipated
        other.memory.sample[0, LOST_UNRESOLVED] -= other.replies[place].unresolved
    return other


def _keep_apart(assembly: Assembly, places: Iterable[int]) -> None:
    """Open the gaps of contacts so far that they cannot touch."""
    apart = _out_of_reach(assembly)
    for place in places:
        assembly.contacts[place].initial_gap += apart


def _out_of_reach(assembly: Assembly) -> float:
    """Return how far faces are set apart that are not to touch [m]."""
    return OUT_OF_REACH * max(1.0, *(body.length for body in assembly.scene.bodies.values()))


def _advanced(assembly: Assembly, step: int) -> bool:
    """Take steps up to one; return whether none failed."""
    with keep_raised(assembly.fail_all) as raised:
        status = advance_dated(assembly.memory, assembly.dt, step, 1, 1)
    return status == DONE and raised.first is None


def _keeps(rows: Array, steps: int, time: float, dt: float) -> bool:
    """Return whether rows of a run hold the instant some steps before the last one, at a time [s]."""
    return len(rows) > steps and abs(time - rows[-1 - steps, 0] - steps * dt) < ON_STEP * dt


def _force_before(assembly: Assembly, load: Any, steps: int) -> float:
    """Return the force of a load ``steps`` steps before the last one [N]; see `force_over`."""
    if steps == 0:
        return float(load.force)
    samples = slice(load.table_start, load.table_end)
    times, forces, dt = assembly.memory.load_times[samples], assembly.memory.load_forces[samples], assembly.dt
    instant = assembly.clock.time - (1 + steps - load.point) * dt
    low, high = instant - 0.5 * dt, instant + 0.5 * dt
    within = times[(times > low) & (times < high)]
    if load.point != 0.5 and len(within) == 1 and abs(within[0] - instant) <= ON_GRID * dt:
        return float(np.interp(instant, times, forces))
    edges = np.concatenate(([low], within, [high]))
    return float(np.diff(edges) @ np.interp(0.5 * (edges[1:] + edges[:-1]), times, forces)) / dt


def _copied(assembly: Assembly) -> Assembly:
    """Return an assembly that goes on where another one ended, without touching its arrays."""
    memory = assembly.memory
    room: dict[str, Any] = {name: np.zeros((ROOM, getattr(memory, name).shape[1])) for name in ("record", "sample")}
    if COMPILED:
        other = assembly.again(state=memory.state.copy(), **room)
    else:
        other = copy.copy(assembly)
        kept = memory._replace(**room, snapshots=memory.snapshots, snapshot_state=np.zeros((0, 2, 0)))
        other.memory = copy.deepcopy(kept)
        other.contacts, other.ports, other.faces = other.memory.contacts, other.memory.ports, other.memory.faces
        other.replies, other.events, other.loads = other.memory.replies, other.memory.events, other.memory.loads
        other.clock = other.memory.clock[0]
    other.clock.n_records = other.clock.n_samples = other.clock.n_events = 0
    return other


def row_of(m: StepArrays, number: int, state: Array) -> float:
    """Return a row of `StepArrays` times a state."""
    entries = slice(m.row_start[number], m.row_start[number + 1])
    return float(m.row_value[entries] @ state[m.row_index[entries]])
