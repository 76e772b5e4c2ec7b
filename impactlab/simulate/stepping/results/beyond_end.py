"""Steps beyond the end of a run, in arrays of their own.

With them, values at the end lie on a line that no kick crosses. Leapfrog keeps velocities of the middle of each step,
and a step with a kick has two, before and after it. A step beyond the last one gives a further point of the line; where
the end lies before the instant of the last step, the steps before that, which are kept, give it. Faces that touch
beyond the end of the run are kept apart, and the force of their touch is taken out of the last step.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from impactlab.integrators.base import AbstractIntegrator
from impactlab.numerics.addresses import COMPILED
from impactlab.numerics.raised import keep_raised
from impactlab.simulate.stepping import event_times
from impactlab.simulate.stepping.arrays import StepArrays, U, V
from impactlab.simulate.stepping.end_loads import ON_GRID
from impactlab.simulate.stepping.loop import DONE, advance_dated
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.types import Array

ON_STEP = 1e-9  # of a step: a run that ends this close to the end of a step ends there
OUT_OF_REACH = 1e3  # of the lengths of a scene, by which faces that are apart stay apart after the end of the run
KEPT = 3  # instants of the run that may be read: the end of a run may lie before the last but one sum of forces
ROOM = 8  # records and samples of the steps after the end: the loop wants some to spare


class RecordsAround(NamedTuple):
    """Records and samples around the end of a run; see `StepArrays`.

    They are a step apart, and there is no kick between them.
    """

    time: float  # s, end of the step of the first
    done: int  # how many of them are of steps of the run
    dt: float  # s
    record: Array  # (2 to 4, n_columns)
    sample: Array  # (2 to 4, n_sampled)
    impulses: Array  # (2 to 4, n_loads) N s, of loads over time so far
    replaced: bool = False  # whether the values of the last step of the run are the means of those beside it

    def at(self, time: float, rows: Array, early: float, at_start: Array | float | None = None) -> Array:
        """Return values at a time [s] from rows of records.

        Rows belong to instants ``early`` [s] before the end of their steps. Before the instant of the first sample, at
        ``-early``, they lie on a line from those ``at_start``, at t = 0.
        """
        shares = (time - (self.time - early)) / self.dt
        if shares < 0.0 and self.time == 0.0 and early < 0.0 and at_start is not None:
            return np.asarray(at_start + time / -early * (rows[0] - at_start))
        pair = min(max(math.floor(shares), 0), len(rows) - 2)
        return np.asarray(rows[pair] + (shares - pair) * (rows[pair + 1] - rows[pair]))

    def impulse(self, time: float, column: int, given: float, early: float, at_start: float) -> float:
        """Return the impulse of a contact up to a time [N s].

        ``given`` is the impulse of all steps of the run. It lies on the line on which momenta lie, which belong
        ``early`` [s] before the end of their steps. At t = 0 it is that of the force ``at_start`` [N] over this time,
        which the steps do not count.
        """
        forces = self.record[:, column]
        sums = np.cumsum(forces) * self.dt
        totals = given + sums - (sums[self.done - 1] if self.done else 0.0)
        if self.replaced:
            totals[self.done - 1] = 0.5 * (totals[self.done - 2] + totals[self.done])
        return float(self.at(time, totals, early, early * at_start))


class LateClosings(NamedTuple):
    """Contacts that change velocities at once in the last step, or touch after the end of the run."""

    kicks: bool  # whether any change them at once before the end
    late: frozenset[int]  # those that touch after the end of the run: the last step holds their forces
    kicks_before: bool = False  # whether any changed velocities at once in the step before the last one

    @property
    def crossed(self) -> bool:
        """Whether a line across the last step is a mixture of the motions before and after a kick or a touch."""
        return self.kicks or bool(self.late)


def _struck(assembly: Assembly, place: int) -> bool:
    """Return whether a hard contact in leapfrog began in the last step.

    Its force there holds the jump of its closing.
    """
    contact = assembly.contacts[place]
    given = contact.force * assembly.dt + contact.impulse
    hard = assembly.acting.laws[assembly.layout.contacts[place].name].hard
    return hard and contact.force != 0.0 and contact.span_impulse == given


def late_closings(
    assembly: Assembly, integrator: AbstractIntegrator, raw: Sequence[Any], duration: float
) -> LateClosings:
    """Return the kicks and late touches in the last step of a run.

    The run ends inside that step, or the momenta at its end belong to an instant inside it.
    """
    clock, dt = assembly.clock, assembly.dt
    late, ends_inside = set[int](), duration < clock.time - ON_STEP * dt
    kicks_before = False
    if ends_inside:
        for events in reversed(raw):
            near = events[events["time"] >= clock.time - 3.0 * dt]  # events of one step are not in order
            for time, place, kind, *_ in near.tolist():
                if kind == event_times.CLOSE and time > duration and _may_be_taken_back(assembly, place):
                    late.add(place)
                # An impulse acts at the start of its step.
                kicks_before |= kind == event_times.IMPULSE and abs(time - clock.time + 2.0 * dt) < ON_STEP * dt
            if not near.size:
                break
    others = [place for place in range(len(assembly.contacts)) if place not in late]
    kicks = False
    if ends_inside or integrator.momentum_early != 0.0:
        kicks = any(assembly.contacts[place].impulse != 0.0 for place in others)
    if integrator.velocity_point < 1.0:
        kicks = kicks or any(_struck(assembly, place) for place in others)
    return LateClosings(kicks, frozenset(late), kicks_before)


def _may_be_taken_back(assembly: Assembly, place: int) -> bool:
    """Return whether the force of a touch that comes after the end of the run is known apart from the last step.

    That of beads is not. Forces of compliant laws are not, either, beside pushes or where faces change their
    coordinates as they touch: there the step holds them.
    """
    layout = assembly.layout
    if place >= len(layout.solved):
        return False
    alone = not (len(assembly.memory.pushes) or len(assembly.memory.phases))
    return alone or assembly.acting.laws[layout.contacts[place].name].hard


def around_end(assembly: Assembly, touches: LateClosings) -> RecordsAround | None:
    """Return the records around the end of a run.

    None where the loop does not go on from there. Faces without a force in the last step stay apart: their touch comes
    after it, or their force does, as in leapfrog that of a touch in this step.
    """
    if assembly.clock.step != assembly.steps or assembly.method.events == "located":  # located steps end with the run
        return None
    late, clock, memory, dt = touches.late, assembly.clock, assembly.memory, assembly.dt
    if late and (len(memory.pushes) or len(memory.phases)):
        return None
    other = _copied(assembly)
    for place in late:
        _take_back(other, place)
    reach = OUT_OF_REACH * max(1.0, *(body.length for body in assembly.scene.bodies.values()))
    for place, (contact, port) in enumerate(zip(other.contacts, other.ports, strict=True)):
        law = assembly.acting.laws[assembly.layout.contacts[place].name]
        touching = law.answers_force and (port.in_contact > 0.0 or contact.force != 0.0 or contact.impulse != 0.0)
        if not contact.joined and (place in late or not touching):
            contact.initial_gap += reach
    own = memory.record[: clock.n_records], memory.sample[: clock.n_samples]
    last_before = not touches.kicks and all(_keeps(rows, 1, clock.time, dt) for rows in own)
    steps = 2 if late and not last_before else 1
    with keep_raised(other.fail_all) as raised:
        status = advance_dated(other.memory, dt, assembly.steps + steps, 1, 1)
    if status != DONE or raised.first is not None:
        return None
    record, sample = other.memory.record[:steps], other.memory.sample[:steps]
    for place in late:  # it was let go of, which books the energy that a law has stored
        sample[:, 2] -= other.replies[place].dissipated
        sample[:, 5] -= other.replies[place].unresolved
    impulses = np.array([[load.impulse - before * load.force for load in other.loads] for before in (dt, 0.0)])
    if late and not last_before:
        return RecordsAround(clock.time + dt, 0, dt, record, sample, impulses)
    done, most = 1, 1 if touches.kicks else 2 if touches.kicks_before else KEPT
    while done < most and all(_keeps(rows, done, clock.time, dt) for rows in own):
        before = impulses[0] - dt * np.array([_force_before(assembly, load, done) for load in assembly.loads])
        impulses = np.vstack((before, impulses))
        done += 1
    record, sample = (np.vstack((rows[-done:], after)) for rows, after in zip(own, (record, sample), strict=True))
    if late:  # the last step holds their forces: without them, its end lies between its start and the next one's end
        forces = [assembly.layout.column_of(number) for number in assembly.layout.numbers]
        given = record[done - 1, forces]
        for rows in (record, sample, impulses):
            rows[done - 1] = 0.5 * (rows[done - 2] + rows[done])
        record[done - 1, forces] = given
    return RecordsAround(clock.time - (done - 1) * dt, done, dt, record, sample, impulses, bool(late))


def _keeps(rows: Array, steps: int, time: float, dt: float) -> bool:
    """Return whether rows of a run hold the instant some steps before the last one, at a time [s]."""
    return len(rows) > steps and abs(time - rows[-1 - steps, 0] - steps * dt) < ON_STEP * dt


def _force_before(assembly: Assembly, load: Any, steps: int) -> float:
    """Return the force of a load in the last step, 1, or in the one before it, 2 [N]; see `force_over`."""
    if steps == 1:
        return float(load.force)
    samples = slice(load.table_start, load.table_end)
    times, forces, dt = assembly.memory.load_times[samples], assembly.memory.load_forces[samples], assembly.dt
    instant = assembly.clock.time - (steps - load.point) * dt
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


def _take_back(assembly: Assembly, place: int) -> None:
    """Remove a contact's force and impulse in the last step from the state, and its losses from those booked."""
    m, contact, reply = assembly.memory, assembly.contacts[place], assembly.replies[place]
    assembly.clock.lost_contact -= reply.dissipated
    assembly.clock.lost_unresolved -= reply.unresolved
    bodies: Any = np.asarray(m.bodies)
    given = contact.force, contact.impulse, contact.projection
    moved = set[int]()
    for face in assembly.faces[2 * place : 2 * place + 2]:
        if face.moves:
            body = bodies[face.body]
            size, state = int(body["state_end"] - body["state_start"]), m.state[body["state_start"] : body["state_end"]]
            for kind, each in enumerate(given):
                at = int(body["response_start"]) + (kind * int(body["n_ports"]) + face.place) * size
                state -= face.sign * each * m.responses[at : at + size]
            moved.add(face.body)
    for at, entry in m.shared.reshape(-1, 2).tolist():  # beads in rows have their motion in arrays of their own, too
        m.beads[U, entry], m.beads[V, entry] = m.state[at], m.state[at + 1]
    for number, face in enumerate(assembly.faces):
        if face.body in moved and face.moves:
            face.u, face.v = row_of(m, number, m.state), row_of(m, len(assembly.faces) + number, m.state)
    contact.force = contact.impulse = contact.projection = 0.0
    assembly.ports[place].in_contact = 0.0  # a law may give a force to closed faces, whatever their gap


def row_of(m: StepArrays, number: int, state: Array) -> float:
    """Return a row of `StepArrays` times a state."""
    entries = slice(m.row_start[number], m.row_start[number + 1])
    return float(m.row_value[entries] @ state[m.row_index[entries]])
