"""Assembly: from models, steppers and laws to the arrays of the step loop."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from impactlab.errors import CaseError
from impactlab.integrators.base import AbstractIntegrator, Stepper
from impactlab.models.base import AbstractDiscreteModel, Phases
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.models.continuous.delay_line import DelayLine
from impactlab.numerics.addresses import COLUMNS, COMPILED, DERIVE, FREE, MEASURE, RETIME, LawAddress, kernel_address
from impactlab.numerics.records import copied, records, structures
from impactlab.scene.method import laws_of
from impactlab.scene.problem import Contact, Point
from impactlab.scene.sizes import kept_of_rows
from impactlab.simulate.channels import Probed, probed
from impactlab.simulate.plan import Plan
from impactlab.simulate.stepping.arrays import (
    COUNT,
    GAP,
    LAYERS,
    PEAK,
    RECENT,
    SAMPLED,
    SAMPLES,
    SPAN,
    TOTAL,
    BodyRecord,
    ClockRecord,
    ContactRecord,
    DamperRecord,
    EventRecord,
    FaceRecord,
    Floats,
    Ints,
    LoadRecord,
    PhaseRecord,
    PushRecord,
    ReadingRecord,
    SnapshotRecord,
    StepArrays,
)
from impactlab.simulate.stepping.bead_rows import BeadRows, bead_rows, packed
from impactlab.simulate.stepping.packing import (
    Coordinates,
    alone,
    dashpots,
    flat,
    jumps_and_loads,
    responses_of,
    sparse,
)
from impactlab.simulate.stepping.pairs import arranged, find_pairs
from impactlab.simulate.stepping.preparation import (
    BuiltBody,
    check_phases,
    face_read,
    left_out_per_force,
    prepare_steppers,
    reading_place,
)
from impactlab.types import MEMORY, Array, Arriving, Port, Quantity, Reply

RESPONSE_TOL = 1e-20  # of a response's largest entry: smaller entries at its ends are far below rounding
MOTION: tuple[Quantity, ...] = ("displacement", "velocity")
MIN_SAMPLES, MOST_SAMPLED = 64, 2**17  # energies taken of scenes of many bodies; numbers in all of them
MANY = 100  # contacts, from which the room for events is that of a few steps
MIN_EVENTS = 4096  # room for events between two returns of the loop
MAX_COPIED = 2e6  # bytes of the arrays of an assembly that is kept for the next run
NAMED: Mapping[str, type[Any]] = {
    "events": EventRecord, "faces": FaceRecord, "contacts": ContactRecord, "ports": Port, "replies": Reply,
    "snapshots": SnapshotRecord, "loads": LoadRecord,
}  # fmt: skip
"""Records that are also read and written by name."""
WRITTEN = ("events", "record", "sample", "snapshot_state")
"""Arrays that are room for what a run writes."""
Models = Mapping[str, AbstractDiscreteModel]  # by name of the body
Steppers = Mapping[str, Stepper]


left_of, right_of = attrgetter("left"), attrgetter("right")


def faces_of_contact(contact: Contact) -> tuple[Point, Point]:
    """Return the left and the right face of a contact."""
    return contact.left, contact.right


def steps_per_sample(steps: int, bodies: int) -> int:
    """Return how many steps lie between two samples of the energies; scenes of many bodies have fewer samples."""
    return math.ceil(steps / min(SAMPLES, max(MIN_SAMPLES, MOST_SAMPLED // (3 * bodies))))


class Assembly:
    """The arrays of one run, and the names of their rows and columns."""

    def __init__(self, plan: Plan, integrator: AbstractIntegrator, dt: float, with_beads: bool = True) -> None:
        scene = plan.scene
        self.rows = bead_rows(plan) if with_beads else BeadRows([], {})
        in_rows = set(self.rows.contacts)
        self.solved = [number for number in range(len(scene.contacts)) if number not in in_rows]
        self.numbers = [*self.solved, *self.rows.contacts]  # of the contacts of the loop, in the scene
        self._places = {number: place for place, number in enumerate(self.numbers)}
        names = dict.fromkeys((*self.rows.beads, *plan.built))  # beads first
        built = {name: plan.built[name] for name in names}
        steppers = {name: plan.steppers[name] for name in names}
        self.scene, self.method, self.acting, self.built, self.steppers = (
            scene,
            plan.method,
            plan.acting,
            built,
            steppers,
        )
        self.integrator, self.dt, self.steps = integrator, dt, plan.steps
        self.stride = math.ceil(plan.steps / self._kept_records())
        self.sample_stride = steps_per_sample(plan.steps, len(built))
        laws = laws_of(scene, plan.acting)
        self.laws = [LawAddress(laws[number].respond, laws[number].compiled) for number in self.solved]
        self._plan, self._pushes = plan, [push._replace(contact=self._places[push.contact]) for push in plan.pushes]
        self._read_probes()
        self._numbers = {name: number for number, name in enumerate(built)}
        self._points = [point for number in self.solved for point in faces_of_contact(scene.contacts[number])]
        state, starts = flat([stepper.state for stepper in steppers.values()])
        self._shift = dict(zip(built, starts.tolist(), strict=False))  # the last start is the end
        models = {name: body.model for name, body in built.items()}
        values = self._coordinates(models, steppers)
        row_start, row_index, row_value = sparse(values.rows)
        phased = {name: body.system.phases for name, body in built.items() if body.system.phases is not None}
        other_state = np.zeros(0)
        if phased:
            check_phases(phased, built, steppers)
            closed = {
                name: BuiltBody(built[name].body, each.closed, each.closed.operators()) for name, each in phased.items()
            }
            others = dict(steppers) | prepare_steppers(scene, closed, integrator, dt, plan.pushes)
            other = self._coordinates(models | {name: body.model for name, body in closed.items()}, others)
            # The same entries in both phases, so that only values are exchanged.
            pattern = [(a != 0.0) | (b != 0.0) for (_, a), (_, b) in zip(values.rows, other.rows, strict=True)]
            row_start, row_index, row_value = sparse(values.rows, pattern)
            kept = other.parameters, other.momentum, other.jump, other.responses
            other_state = np.concatenate((*kept, sparse(other.rows, pattern)[2], other.left_out.ravel()))
        phases, maps = self._phases(phased)
        ports, contacts, replies = self._contacts()
        self.snapshots, snapshots = records(SnapshotRecord, len(scene.field_times))
        for snapshot, time in zip(self.snapshots, scene.field_times, strict=True):
            snapshot.time = time
        (self.clock,), clock = records(ClockRecord, 1)
        self.clock.timed, self.clock.steps = dt, plan.steps
        self.clock.changes = int(any(stepper.columns is not None for stepper in steppers.values()))
        located = plan.method.events == "located"
        per_contact = 1024 if located or len(scene.contacts) <= MANY else 16
        self.events, events = records(EventRecord, max(MIN_EVENTS, per_contact * len(scene.contacts)))
        faces, pushes = self._faces_and_pushes()
        entries = alone(row_start, row_index, row_value)[: 2 * len(self.faces)].reshape(2, -1)
        for face, u_at, v_at in zip(self.faces, *entries.tolist(), strict=True):
            face.u_at, face.v_at = (-1, -1) if phased or min(u_at, v_at) < 0 else (u_at, v_at)
        loads, load_times, load_forces = self._loads()
        candidates = find_pairs(self.faces, self.contacts, self._pushes, self._read_on(steppers, row_start, row_index))
        n_contacts = len(self.solved)
        beads = packed(self.rows, plan, dt)
        self.first_bead_force = 1 + 6 * n_contacts  # column of the record
        self.first_probe = self.first_bead_force + len(self.rows.contacts) + 2 * beads.beads.shape[1]
        order, self.clock.reach = arranged(self.contacts, candidates)
        unknowns = 2 * n_contacts if n_contacts > 1 else 0
        room = (4 if plan.method.events == "located" else 1) * (plan.steps // self.stride + 8) + 256
        self.memory = StepArrays(
            clock=clock,
            bodies=self._bodies(values.starts),
            faces=faces,
            contacts=contacts,
            ports=ports,
            replies=replies,
            readings=self._readings(),
            pushes=pushes,
            loads=loads,
            phases=phases,
            dampers=self._dampers(state),
            bead_rows=beads.rows,
            events=events,
            snapshots=snapshots,
            beads=beads.beads,
            bead_contacts=beads.contacts,
            noticed=np.zeros((beads.contacts.shape[1], 3)),
            called=np.arange(beads.beads.shape[1], len(built), dtype=np.int64),
            parameters=values.parameters,
            state=state,
            backup=np.zeros_like(state),
            momentum=values.momentum,
            jump=values.jump,
            responses=values.responses,
            candidates=candidates,
            coupled=candidates.copy(),
            influence=np.zeros((candidates.size, 3, LAYERS)),
            own_influence=np.zeros((3, LAYERS)),
            row_start=row_start,
            row_index=row_index,
            row_value=row_value,
            load_times=load_times,
            load_forces=load_forces,
            left_out=values.left_out,
            record=np.zeros((room, self.first_probe + len(self.probes) + len(self.far_ends) + len(self.sent))),
            sample=np.zeros((plan.steps // self.sample_stride + 8, SAMPLED + 3 * len(built))),
            snapshot_state=np.zeros((len(scene.field_times), 2, state.size)),
            scratch=np.zeros(4),
            order=order,
            system=np.zeros((unknowns, min(unknowns, 6 * self.clock.reach + 4) + 2)),
            other_state=other_state,
            maps=maps,
        )
        m = self.memory
        self.clock.rare = int(any(map(len, (m.readings, m.pushes, m.loads, m.dampers))))
        arrays: Any = self.memory if COMPILED else ()
        small = COMPILED and sum(each.nbytes for each in arrays) <= MAX_COPIED
        self.can_repeat = small and all(law.compiled for law in laws_of(scene, plan.acting))  # whether `again` serves

    def again(self) -> Assembly:
        """Return an assembly for another run of the same plan, with arrays of its own; this one must not have run."""
        other = copy.copy(self)
        arrays: list[Any] = [
            np.zeros(old.shape, old.dtype) if name in WRITTEN else copied(old)
            for name, old in self.memory._asdict().items()
        ]
        memory: Any = StepArrays(*arrays)
        other.memory = memory
        (other.clock,) = structures(ClockRecord, memory.clock)
        for name, kind in NAMED.items():
            setattr(other, name, structures(kind, getattr(memory, name)))
        return other

    def _kept_records(self) -> int:
        """Return how many instants are kept at most."""
        columns = len(self.rows.contacts) + 2 * len(self.rows.beads)
        return kept_of_rows(self.scene, self.steps, columns) if columns else self.scene.records

    def _read_probes(self) -> None:
        """Tell probes that are rows over the state from those that the waves of a delay line give after the run.

        For these the displacements of the ends that no contact records are recorded, too; of a chain of delays the
        waves that its nodes send.
        """
        lines = {name: body.model for name, body in self.built.items() if isinstance(body.model, DelayLine)}
        chains = {name: body.model for name, body in self.built.items() if isinstance(body.model, DelayChain)}
        asked = list(probed(self.scene))
        self.in_waves = [
            each
            for each in asked
            if (
                each.body in lines
                and (each.quantity not in MOTION or each.x not in (0.0, self.scene.bodies[each.body].length))
            )
            or (each.body in chains and (each.quantity not in MOTION or chains[each.body].node_at(each.x) is None))
        ]
        beads = set(self.rows.beads)
        waves = set(self.in_waves)
        self.recorded = [each for each in asked if each not in waves]
        self.probes = [each for each in self.recorded if each.body not in beads]
        self._probe_places = {each: place for place, each in enumerate(self.probes)}
        self.sent = [(name, row) for name, chain in chains.items() for row in chain.sent()]
        points = [point for contact in self.scene.contacts for point in (contact.left, contact.right)]
        touched = {(point.body, point.x) for point in points}
        ends = [(name, x) for name in lines for x in (0.0, self.scene.bodies[name].length)]
        self.far_ends = [Probed("", name, x, "displacement", 1.0) for name, x in ends if (name, x) not in touched]
        spacing = self.stride * self.dt
        for each in self.in_waves:
            if spacing > 0.5 * (lines | chains)[each.body].transit:
                raise CaseError(
                    f"records {spacing:.3g} s apart do not resolve the waves of '{each.body}'",
                    remedy="Give more records, or a shorter duration.",
                    path="solve.records",
                )

    def state_of(self, body: str, state: Array, velocities: bool = False) -> Array:
        """Return a body's displacements or velocities in a whole state, shape (n_dof,)."""
        n_dof = self.built[body].system.load.size
        start = self._shift[body] + (n_dof if velocities else 0)
        return state[start : start + n_dof]

    @property
    def bead_contacts(self) -> Floats:
        """The contacts of rows of beads, as in `StepArrays`."""
        return self.memory.bead_contacts

    def column_of(self, number: int) -> int:
        """Return the column of the record with the force of a contact of the scene."""
        place = self._places[number]
        return 1 + 6 * place if place < len(self.solved) else self.first_bead_force + place - len(self.solved)

    def probe_column(self, probe: Probed) -> int:
        """Return the column of the record with a probe."""
        if probe not in self._probe_places:
            return self.bead_column(probe.body, probe.quantity)
        return int(self.first_probe + self._probe_places[probe])

    def bead_column(self, body: str, quantity: Quantity) -> int:
        """Return the column of the record with the displacement or velocity of a bead."""
        at = self.first_bead_force + self.bead_contacts.shape[1]
        return int(at + self._shift[body] + (quantity == "velocity"))

    def bead_gaps(self, record: Array) -> Array:
        """Return the gaps of bead contacts at the instants of a record [m], (n_bead_contacts, n_records)."""
        first = self.first_bead_force + len(self.rows.contacts)
        moved = np.vstack((record[:, first : self.first_probe : 2].T, np.zeros(len(record))))  # of a wall: the last row
        contacts = [self.scene.contacts[number] for number in self.rows.contacts]
        places = {name: place for place, name in enumerate(self.rows.beads)}
        left, right = ([places.get(face(each).body, -1) for each in contacts] for face in (left_of, right_of))
        return np.asarray(self.bead_contacts[GAP][:, None] + moved[right] - moved[left])

    def span_of(self, number: int) -> tuple[float, float, float]:
        """Return impulse [N s], last force [N] and peak [N] of the contact under way, by its number in the scene."""
        place = self._places[number] - len(self.solved)
        if place < 0:
            kept = self.contacts[self._places[number]]
            return kept.span_impulse, kept.force, kept.span_peak
        contact, found, dt = self.scene.contacts[number], self.bead_contacts[:, place], self.dt
        gap, power = contact.gap, self.rows.forces[number]
        for point, sign in ((contact.left, -1.0), (contact.right, 1.0)):
            if self.steppers[point.body].state.size:  # where it was at the start of the last step
                u, v = self.memory.state[self._shift[point.body] :][:2]
                gap += sign * (u - dt * v)
        force = power.stiffness * max(0.0, -gap) ** power.exponent
        return float(found[SPAN] + found[RECENT]) * dt, float(force), float(found[PEAK])

    def failed(self) -> list[int]:
        """Return the numbers in the scene of the contacts whose laws failed."""
        found = [number for number, reply in zip(self.solved, self.replies, strict=True) if reply.failed]
        return found + ([self.rows.contacts[self.clock.failed_bead - 1]] if self.clock.failed_bead else [])

    def impulses(self) -> list[float]:
        """Return the forces times time and impulses of all contacts of the scene since t = 0 [N s]."""
        found = [0.0] * len(self.numbers)
        of_rows = self.dt * (self.bead_contacts[TOTAL] + self.bead_contacts[RECENT])
        given = [*(contact.total for contact in self.contacts), *of_rows.tolist()]
        for number, each in zip(self.numbers, given, strict=True):
            found[number] = each
        return found

    def memories(self) -> list[Sequence[float]]:
        """Return the memory of every law of the scene; of contacts of beads, which have none, the count of warnings."""
        found: list[Sequence[float]] = [()] * len(self.numbers)
        for number, port in zip(self.solved, self.ports, strict=True):
            found[number] = port.memory[:]
        for place, number in enumerate(self.rows.contacts):
            counted, memory = self.rows.forces[number].counted, [0.0] * MEMORY
            if counted is not None:
                memory[counted.slot] = float(self.bead_contacts[COUNT, place])
            found[number] = memory
        return found

    def grow(self) -> None:
        """Double the room for records and samples; those written stay."""
        record, sample = self.memory.record, self.memory.sample
        self.memory = self.memory._replace(
            record=np.concatenate([record, np.zeros_like(record)]),
            sample=np.concatenate([sample, np.zeros_like(sample)]),
        )

    def _coordinates(self, models: Models, steppers: Steppers) -> Coordinates:
        momentum = np.zeros(sum(stepper.state.size for stepper in steppers.values()))
        for name, model in models.items():
            row = model.momentum_row()
            start = self._shift[name] + row.size
            momentum[start : start + row.size] = row
        each = list(steppers.values())
        parameters, of_parameters = flat([stepper.parameters for stepper in each])
        jump, of_jumps = flat([jumps_and_loads(stepper) for stepper in each])
        responses, of_responses = flat([response for stepper in each for response in responses_of(stepper)])
        starts = [of_parameters.tolist(), of_jumps.tolist(), of_responses[::3].tolist()]
        return Coordinates(parameters, momentum, jump, responses, *self._rows(models), starts)

    def _rows(self, models: Models) -> tuple[list[tuple[int, Array]], Floats]:
        """Return all rows in the order that `StepArrays` states, and the static responses of modes left out.

        The latter are those at each reading per force of each contact.
        """

        def row(body: str, x: float, quantity: Quantity, factor: float = 1.0) -> tuple[int, Array]:
            values = factor * models[body].row(x, quantity)
            return self._shift[body] + (values.size if quantity == "velocity" else 0), values

        contacts = [self.scene.contacts[number] for number in self.solved]
        starts = [self._plan.starts[number] for number in self.solved]
        rows = [row(point.body, point.x, "displacement") for point in self._points]
        rows += [row(point.body, point.x, "velocity") for point in self._points]
        left_out: list[list[float]] = []
        for contact, start in zip(contacts, starts, strict=True):
            for reading in start.readings:
                left_out.append([0.0] * len(contacts))
                if isinstance(reading, Arriving):
                    point = face_read(contact, reading)
                    whole = models[point.body].arriving(point.x, reading.delay, reading.speed)
                    rows.append((self._shift[point.body], whole))  # over displacements and velocities
                    continue
                point, x = reading_place(contact, reading)
                rows.append(row(point.body, x, reading.quantity))
                if reading.left_out:
                    model = models[point.body]
                    left_out[-1] = [
                        left_out_per_force(model, other, point.body, x, reading.quantity) for other in contacts
                    ]
        rows += [row(each.body, each.x, each.quantity, each.factor) for each in (*self.probes, *self.far_ends)]
        rows += [(self._shift[name], values) for name, values in self.sent]
        loaded = [(name, x) for name, body in self.built.items() for x, _ in body.body.loads]
        rows += [row(name, x, quantity) for name, x in loaded for quantity in MOTION]
        rows += [row(push.body, push.x, push.quantity) for push in self._pushes]
        return rows, np.array(left_out, float).reshape(len(left_out), len(contacts))

    def _bodies(self, starts: list[list[int]]) -> Sequence[BodyRecord]:
        by_name, bodies = records(BodyRecord, len(self.built))
        parameters, jumps, responses = starts
        for number, (body, (name, stepper)) in enumerate(zip(by_name, self.steppers.items(), strict=True)):
            body.free, body.measure = kernel_address(stepper.free, FREE), kernel_address(stepper.measure, MEASURE)
            body.retime, body.derive = kernel_address(stepper.retime, RETIME), kernel_address(stepper.derive, DERIVE)
            body.columns = kernel_address(stepper.columns, COLUMNS)
            body.parameter_start, body.parameter_end = parameters[number : number + 2]
            body.state_start, body.state_end = self._shift[name], self._shift[name] + stepper.state.size
            body.n_dof, body.n_ports = stepper.jump.shape[1], len(stepper.jump)
            body.jump_start, body.loads_end = jumps[number : number + 2]
            body.jump_end = body.jump_start + stepper.jump.size
            body.load_at = stepper.load.start if stepper.load else 0
            body.response_start = responses[number]
        return bodies

    def _dampers(self, state: Floats) -> Sequence[DamperRecord]:
        found = [(name, *each) for name, body in self.built.items() for each in dashpots(body.system)]
        by_name, dampers = records(DamperRecord, len(found))
        for damper, (name, i, j, damping, inside) in zip(by_name, found, strict=True):
            shift, n_dof = self._shift[name], self.built[name].system.load.size
            damper.index, damper.other = shift + i, shift + j if j >= 0 else -1
            damper.damping, damper.inside = damping, int(inside)
            damper.straddles = float(self.integrator.velocity_point < 1.0)
            rate = state[damper.index + n_dof] - (state[damper.other + n_dof] if j >= 0 else 0.0)
            damper.before = self.dt * rate
        return dampers

    def _readings(self) -> Sequence[ReadingRecord]:
        numbers = self._numbers
        wanted = [
            (numbers[face_read(self.scene.contacts[number], reading).body], place, slot)
            for place, number in enumerate(self.solved)
            for slot, reading in enumerate(self._plan.starts[number].readings)
        ]
        by_name, readings = records(ReadingRecord, len(wanted))
        for record, each in zip(by_name, wanted, strict=True):
            record.body, record.contact, record.slot = each
        return readings

    def _phases(self, phased: Mapping[str, Phases]) -> tuple[Sequence[PhaseRecord], Floats]:
        by_name, phases = records(PhaseRecord, len(phased))
        maps, starts = flat([np.concatenate((each.closing, each.opening)) for each in phased.values()])
        for phase, (name, each), start in zip(by_name, phased.items(), starts.tolist(), strict=False):
            phase.contact, phase.body, phase.map_start = self._places[each.contact], self._numbers[name], start
        return phases, maps

    def _faces_and_pushes(self) -> tuple[Sequence[FaceRecord], Sequence[PushRecord]]:
        """Return faces and pushed rows; the ports of a body are its faces in their order, then its pushed rows."""
        pushed, names = self._pushes, self._numbers
        self.faces, faces = records(FaceRecord, len(self._points))
        push_by_name, pushes = records(PushRecord, len(pushed))
        taken = dict.fromkeys(names, 0)
        by_name = iter(self.faces)
        for number, contact in enumerate(self.scene.contacts):
            for point, sign in zip(faces_of_contact(contact), (-1.0, 1.0), strict=True):
                if self._places[number] < len(self.solved):
                    face, stepper = next(by_name), self.steppers[point.body]
                    face.body, face.place, face.sign = names[point.body], taken[point.body], sign
                    face.moves = int(stepper.state.size > 0)
                    for kind, each in enumerate(responses_of(stepper)):
                        self._write_ranges(face, point.body, each[face.place], 3 * kind)
                taken[point.body] += 1
        for record, push in zip(push_by_name, pushed, strict=True):
            record.contact, record.body, record.weight = push.contact, names[push.body], push.weight
            record.place = taken[push.body]
            self._write_ranges(record, push.body, self.steppers[push.body].force_response[record.place], 0)
            taken[push.body] += 1
        return faces, pushes

    def load_impulses(self, beyond: float = 0.0) -> dict[str, float]:
        """Return the impulses of loads so far [N s], by body, without the last ``beyond`` [s]."""
        found: dict[str, float] = {}
        names = [*self.built]
        for load in self.loads:
            name = names[load.body]
            found[name] = found.get(name, 0.0) + load.impulse - beyond * load.force
        return found

    def _read_on(self, steppers: Steppers, row_start: Ints, row_index: Ints) -> dict[str, dict[int, list[Ints]]]:
        """Return where the state of each body that moves is read for displacement and velocity of its faces."""
        found: dict[str, dict[int, list[Ints]]] = {}
        for number, point in enumerate(self._points):
            if steppers[point.body].state.size:
                rows = (number, len(self._points) + number)
                entries = [row_index[row_start[row] : row_start[row + 1]] - self._shift[point.body] for row in rows]
                found.setdefault(point.body, {})[number] = entries
        return found

    def _loads(self) -> tuple[Sequence[LoadRecord], Floats, Floats]:
        """Return the loads of all bodies and their samples; the ports of a body end with its loads."""
        found = [(name, load) for name, body in self.built.items() for _, load in body.body.loads]
        self.loads, loads = records(LoadRecord, len(found))
        tables = [load.table(self.steps * self.dt, self.steps) for _, load in found]
        times, starts = flat([table[0] for table in tables])
        names = [name for name, _ in found]
        for number, (record, name) in enumerate(zip(self.loads, names, strict=True)):
            stepper = self.steppers[name]
            own = isinstance(self.built[name].model, AbstractSelfStepping)
            record.body, record.piece = self._numbers[name], -1
            record.place = len(stepper.jump) - names[number:].count(name)
            record.table_start, record.table_end = starts[number : number + 2].tolist()
            record.point = 0.5 if own else self.integrator.load_point
            record.before = float(found[number][1].at(np.zeros(1))[0])
            self._write_ranges(record, name, stepper.force_response[record.place], 0)
        return loads, times, flat([table[1] for table in tables])[0]

    def _write_ranges(self, record: FaceRecord | LoadRecord | PushRecord, body: str, response: Array, at: int) -> None:
        """Write the ranges of a body's displacements, velocities and other state with nonzero response."""
        system = self.built[body].system
        n_dof = system.load.size
        # In a body with phases, and in a mechanism, the response changes within the run.
        changes = system.phases is not None or self.steppers[body].columns is not None
        for part, first in enumerate((0, n_dof, 2 * n_dof)):
            end = response.size if part == 2 else first + n_dof
            if end - first <= 1:  # of a mass: the one entry is the largest
                if end > first and (changes or response[first] != 0.0):
                    record.low[at + part], record.high[at + part] = first, end
                continue
            size = np.abs(response[first:end])
            least = -1.0 if changes else RESPONSE_TOL * size.max(initial=0.0)
            moved = (size > least).nonzero()[0]
            if moved.size:
                record.low[at + part], record.high[at + part] = first + int(moved[0]), first + int(moved[-1]) + 1

    def _contacts(self) -> tuple[Sequence[Port], Sequence[ContactRecord], Sequence[Reply]]:
        scene, n_contacts = self.scene, len(self.solved)
        self.ports, ports = records(Port, n_contacts)
        self.contacts, contacts = records(ContactRecord, n_contacts)
        self.replies, replies = records(Reply, n_contacts)
        for place, number in enumerate(self.solved):
            contact, start = scene.contacts[number], self._plan.starts[number]
            law = self.acting.laws[contact.name]
            port, record, points = self.ports[place], self.contacts[place], faces_of_contact(contact)
            port.parameters[: len(start.parameters)] = list(start.parameters)
            port.memory[: len(start.memory)] = list(start.memory)
            # The face of a continuous body has no mass that takes an impulse: a force closes the contact.
            own = any(isinstance(self.built[point.body].model, AbstractSelfStepping) for point in points)
            port.jump_in_force = float(self.integrator.jump_in_force or own)
            static = [self._static_compliance(point.body, point.x) for point in points]
            record.law = self.laws[place].value
            record.dates, record.smooth = int(law.answers_force and not law.two_sided), int(law.smooth)
            record.joined = int(law.two_sided)
            record.projects_first, record.load_point = int(self.integrator.projects_first), self.integrator.load_point
            record.trial_point = 1.0 if law.trial_at_end else self.integrator.load_point
            record.initial_gap = contact.gap - self._placed(contact.right) + self._placed(contact.left)
            record.old_gap = contact.gap
            record.left_share = static[0] / sum(static) if sum(static) > 0.0 else 0.0
        return ports, contacts, replies

    def _placed(self, point: Point) -> float:
        """Return where a face of a mechanism is at t = 0 [m]; 0 of other bodies, whose faces count from there."""
        stepper, row = self.steppers[point.body], self.built[point.body].model.row(point.x, "displacement")
        return 0.0 if stepper.columns is None else float(row @ stepper.state[: row.size])

    def _static_compliance(self, body: str, x: float) -> float:
        """Return the static compliance of a face beyond that of its coordinates [m/N]."""
        built = self.built[body]
        return max(0.0, dict(built.system.massless).get(x, 0.0) or built.model.left_out(x, "displacement", x))
