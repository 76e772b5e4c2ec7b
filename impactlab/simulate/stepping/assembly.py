"""Assembly: from models, steppers and laws to the arrays of the step loop."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from impactlab.errors import PairingError
from impactlab.integrators.base import AbstractIntegrator, Stepper, loads_of
from impactlab.models.base import AbstractDiscreteModel, Phases
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.numerics.addresses import DERIVE, FREE, MEASURE, RETIME, LawAddress, kernel_address
from impactlab.numerics.records import records
from impactlab.scene.method import laws_of
from impactlab.scene.problem import Contact
from impactlab.simulate.plan import Plan
from impactlab.simulate.stepping.arrays import (
    LAYERS,
    SAMPLED,
    SAMPLES,
    BodyRecord,
    ClockRecord,
    ContactRecord,
    DamperRecord,
    EventRecord,
    FaceRecord,
    Floats,
    Ints,
    PhaseRecord,
    PushRecord,
    ReadingRecord,
    SnapshotRecord,
    StepArrays,
)
from impactlab.simulate.stepping.packing import dashpots, flat, sparse
from impactlab.simulate.stepping.preparation import (
    BuiltBody,
    Push,
    face_read,
    prepare_stepper,
    pushes_of,
    reading_place,
)
from impactlab.types import Array, Arriving, Port, Quantity, Reply, Start

RESPONSE_TOL = 1e-20  # of a response's largest entry: smaller entries at its ends are far below rounding
MIN_EVENTS = 4096  # room for events between two returns of the loop


class Assembly:
    """The arrays of one run, and the names of their rows and columns."""

    def __init__(
        self,
        plan: Plan,
        integrator: AbstractIntegrator,
        dt: float,
    ) -> None:
        scene, built, steppers, starts, steps = plan.scene, plan.built, plan.steppers, plan.starts, plan.steps
        self.scene, self.method, self.acting, self.built = scene, plan.method, plan.acting, built
        self.integrator, self.dt, self.steps = integrator, dt, steps
        laws = laws_of(scene, plan.acting)
        self.stride, self.sample_stride = math.ceil(steps / scene.records), math.ceil(steps / SAMPLES)
        self.laws = [LawAddress(law.respond, law.compiled) for law in laws]
        names, each = list(built), list(steppers.values())
        pushed = pushes_of(scene, built, starts)
        flats = [
            flat([stepper.parameters for stepper in each]),
            flat([stepper.state for stepper in each]),
            flat([pushed_by(stepper) for stepper in each]),
            self._responses(each),
        ]
        parameters, state, jump, responses = (values for values, _ in flats)
        self._shift = dict(zip(names, flats[1][1].tolist(), strict=False))  # the last start is the end
        ports, contacts, replies = self._contacts(starts)
        n_contacts = len(scene.contacts)
        models = {name: body.model for name, body in built.items()}
        self.probe_channels = self._probe_channels()
        rows, left_out = self._rows(models, starts, pushed)
        row_start, row_index, row_value = sparse(rows)
        momentum = self._momentum(models, state)
        phased = {name: body.system.phases for name, body in built.items() if body.system.phases is not None}
        phases, maps = self._phases(names, phased)
        other_state = np.zeros(0)
        if phased:
            check_phases(phased, built, steppers)
            closed = {name: phased[name].closed if name in phased else model for name, model in models.items()}
            others = self._other_steppers(phased, steppers, pushed)
            # The same entries in both phases, so that only values are exchanged.
            closed_rows, closed_left_out = self._rows(closed, starts, pushed)
            pattern = [(a != 0.0) | (b != 0.0) for (_, a), (_, b) in zip(rows, closed_rows, strict=True)]
            row_start, row_index, row_value = sparse(rows, pattern)
            other_state = np.concatenate(
                (
                    flat([stepper.parameters for stepper in others])[0],
                    self._momentum(closed, state),
                    flat([pushed_by(stepper) for stepper in others])[0],
                    self._responses(others)[0],
                    sparse(closed_rows, pattern)[2],
                    closed_left_out.ravel(),
                )
            )
        room = (4 if plan.method.events == "located" else 1) * (steps // self.stride + 8) + 256
        self.snapshots, snapshots = records(SnapshotRecord, len(scene.snapshots))
        for snapshot, time in zip(self.snapshots, sorted(scene.snapshots), strict=True):
            snapshot.time = time
        (self.clock,), clock = records(ClockRecord, 1)
        self.clock.timed, self.clock.steps = dt, steps
        coupled = 2 * n_contacts if n_contacts > 1 else 0
        self.memory = StepArrays(
            clock=clock,
            bodies=self._bodies(steppers, [begins.tolist() for _, begins in flats]),
            faces=self._faces(names, steppers),
            contacts=contacts,
            ports=ports,
            replies=replies,
            readings=self._readings(names, starts),
            pushes=self._pushes(names, steppers, pushed),
            phases=phases,
            dampers=self._dampers(state),
            events=self._events(),
            snapshots=snapshots,
            parameters=parameters,
            state=state,
            backup=np.zeros_like(state),
            momentum=momentum,
            jump=jump,
            responses=responses,
            influence=np.zeros((LAYERS, 3 * n_contacts, n_contacts)),
            row_start=row_start,
            row_index=row_index,
            row_value=row_value,
            left_out=left_out,
            record=np.zeros((room, 1 + 6 * n_contacts + len(self.probe_channels))),
            sample=np.zeros((steps // self.sample_stride + 8, SAMPLED + 3 * len(names))),
            snapshot_state=np.zeros((len(scene.snapshots), 2, state.size)),
            scratch=np.zeros(4),
            coupled=np.zeros((coupled, coupled + 3)),
            other_state=other_state,
            maps=maps,
        )

    def _bodies(self, steppers: dict[str, Stepper], begins: list[list[int]]) -> Sequence[BodyRecord]:
        """Return the bodies; ``begins`` are the starts of their parameters, states, jumps and responses."""
        by_name, bodies = records(BodyRecord, len(steppers))
        parameters, states, jumps, responses = begins
        for number, (body, (name, stepper)) in enumerate(zip(by_name, steppers.items(), strict=True)):
            body.free, body.measure = kernel_address(stepper.free, FREE), kernel_address(stepper.measure, MEASURE)
            body.retime, body.derive = kernel_address(stepper.retime, RETIME), kernel_address(stepper.derive, DERIVE)
            body.parameter_start, body.parameter_end = parameters[number : number + 2]
            body.state_start, body.state_end = states[number : number + 2]
            body.n_dof, body.n_ports = self.built[name].system.load.size, len(stepper.jump)
            body.jump_start, body.loads_end = jumps[number : number + 2]
            body.jump_end = body.jump_start + stepper.jump.size
            body.load_at = stepper.load.start if stepper.load else 0
            body.force_start, body.impulse_start, body.projection_start = responses[number :: len(steppers)][:3]
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

    def _readings(self, names: list[str], starts: tuple[Start, ...]) -> Sequence[ReadingRecord]:
        by_name, readings = records(ReadingRecord, sum(len(start.readings) for start in starts))
        wanted = iter(by_name)
        for number, (contact, start) in enumerate(zip(self.scene.contacts, starts, strict=True)):
            for slot, reading in enumerate(start.readings):
                record = next(wanted)
                record.body, record.contact = names.index(face_read(contact, reading).body), number
                record.slot = slot
        return readings

    def _other_steppers(
        self, phased: dict[str, Phases], steppers: dict[str, Stepper], pushed: tuple[Push, ...]
    ) -> list[Stepper]:
        """Return the steppers while the contacts of bodies with phases are closed."""
        models = {name: phase.closed for name, phase in phased.items()}
        return [
            prepare_stepper(self.scene, name, models[name], models[name].operators(), self.integrator, self.dt, pushed)
            if name in models
            else stepper
            for name, stepper in steppers.items()
        ]

    def state_of(self, body: str, state: Array, velocities: bool = False) -> Array:
        """Return a body's displacements or velocities in a whole state, shape (n_dof,)."""
        n_dof = self.built[body].system.load.size
        start = self._shift[body] + (n_dof if velocities else 0)
        return state[start : start + n_dof]

    def grow(self) -> None:
        """Double the room for records and samples; what was written stays."""
        record, sample = self.memory.record, self.memory.sample
        self.memory = self.memory._replace(
            record=np.concatenate([record, np.zeros_like(record)]),
            sample=np.concatenate([sample, np.zeros_like(sample)]),
        )

    def _rows(
        self, models: dict[str, AbstractDiscreteModel], starts: tuple[Start, ...], pushed: tuple[Push, ...]
    ) -> tuple[list[tuple[int, Array]], Floats]:
        """Return all rows, each a shift into the whole state and its values, in the order that `StepArrays` states.

        Also the static responses of the modes left out at each reading per force of each contact.
        """

        def row(body: str, x: float, quantity: Quantity, factor: float = 1.0) -> tuple[int, Array]:
            values = factor * models[body].row(x, quantity)
            return self._shift[body] + (values.size if quantity == "velocity" else 0), values

        contacts = self.scene.contacts
        points = [point for contact in contacts for point in (contact.left, contact.right)]
        rows = [row(point.body, point.x, "displacement") for point in points]
        rows += [row(point.body, point.x, "velocity") for point in points]
        left_out: list[list[float]] = []
        for contact, start in zip(contacts, starts, strict=True):
            for reading in start.readings:
                if isinstance(reading, Arriving):
                    point = face_read(contact, reading)
                    whole = models[point.body].arriving(point.x, reading.delay, reading.speed)
                    rows.append((self._shift[point.body], whole))  # over displacements and velocities
                    left_out.append([0.0] * len(contacts))
                    continue
                point, x = reading_place(contact, reading)
                model = models[point.body]
                rows.append(row(point.body, x, reading.quantity))
                answers = [left_out_per_force(model, other, point.body, x, reading.quantity) for other in contacts]
                left_out.append(answers if reading.left_out else [0.0] * len(contacts))
        rows += [row(body, x, quantity, factor) for _, body, x, quantity, factor in self._probes()]
        rows += [row(push.body, push.x, push.quantity) for push in pushed]
        return rows, np.array(left_out, float).reshape(len(left_out), len(contacts))

    def _responses(self, steppers: list[Stepper]) -> tuple[Floats, Ints]:
        return flat(
            [stepper.force_response for stepper in steppers]
            + [stepper.impulse_response for stepper in steppers]
            + [stepper.projection_response for stepper in steppers]
        )

    def _momentum(self, models: dict[str, AbstractDiscreteModel], state: Array) -> Floats:
        momentum = np.zeros_like(state)
        for name, model in models.items():
            row = model.momentum_row()
            start = self._shift[name] + row.size
            momentum[start : start + row.size] = row
        return momentum

    def _phases(self, names: list[str], phased: dict[str, Phases]) -> tuple[Sequence[PhaseRecord], Floats]:
        by_name, phases = records(PhaseRecord, len(phased))
        maps, map_start = flat([np.concatenate((each.closing, each.opening)) for each in phased.values()])
        for number, (name, each) in enumerate(phased.items()):
            phase = by_name[number]
            phase.contact, phase.body, phase.map_start = each.contact, names.index(name), int(map_start[number])
        return phases, maps

    def _pushes(self, names: list[str], steppers: dict[str, Stepper], pushed: tuple[Push, ...]) -> Sequence[PushRecord]:
        by_name, pushes = records(PushRecord, len(pushed))
        of_body = {name: sum(push.body == name for push in pushed) for name in names}
        seen = {name: len(steppers[name].jump) - of_body[name] for name in names}
        for number, push in enumerate(pushed):
            record = by_name[number]
            record.contact, record.body = push.contact, names.index(push.body)
            record.place, record.weight = seen[push.body], push.weight
            stepper = steppers[push.body]
            self._ranges(record, push.body, stepper, stepper.force_response[seen[push.body]], 0)
            seen[push.body] += 1
        return pushes

    def _events(self) -> Sequence[EventRecord]:
        self.events, events = records(EventRecord, max(MIN_EVENTS, 1024 * len(self.scene.contacts)))
        return events

    def _probes(self) -> list[tuple[str, str, float, Quantity, float]]:
        """Return channel, body, x, quantity and factor of the probes, those of masses and loaded ends included."""
        asked = [
            (probe.channel, probe.body, probe.x, *self.scene.bodies[probe.body].reading(probe.quantity))
            for probe in (*self.scene.probes, *self.scene.loaded_ends)
        ]
        for name, body in self.scene.bodies.items():
            asked += [(f"{own}:{name}", name, 0.0, quantity, 1.0) for own, quantity in body.own_channels]
        return asked

    def _probe_channels(self) -> list[tuple[str, Quantity]]:
        return [(channel, quantity) for channel, _, _, quantity, _ in self._probes()]

    def _faces(self, names: list[str], steppers: dict[str, Stepper]) -> Sequence[FaceRecord]:
        by_name, faces = records(FaceRecord, 2 * len(self.scene.contacts))
        seen = dict.fromkeys(names, 0)
        for number, contact in enumerate(self.scene.contacts):
            for side, point in enumerate((contact.left, contact.right)):
                place = seen[point.body]
                seen[point.body] += 1
                face = by_name[2 * number + side]
                face.body, face.place, face.sign = names.index(point.body), place, (-1.0, 1.0)[side]
                stepper = steppers[point.body]
                responses = (stepper.force_response, stepper.impulse_response, stepper.projection_response)
                for kind, response in enumerate(responses):
                    self._ranges(face, point.body, stepper, response[place], 3 * kind)
        return faces

    def _ranges(self, record: FaceRecord | PushRecord, body: str, stepper: Stepper, response: Array, at: int) -> None:
        """Write the ranges of a body's displacements, velocities and other state with nonzero response."""
        n_dof = stepper.jump.shape[1]
        for part, first in enumerate((0, n_dof, 2 * n_dof)):
            answer = np.abs(response[first : response.size if part == 2 else first + n_dof])
            if self.built[body].system.phases is None:
                moved = (answer > RESPONSE_TOL * answer.max(initial=0.0)).nonzero()[0]
            else:
                moved = np.arange(answer.size)
            if moved.size:
                record.low[at + part], record.high[at + part] = first + int(moved[0]), first + int(moved[-1]) + 1

    def _contacts(self, starts: tuple[Start, ...]) -> tuple[Sequence[Port], Sequence[ContactRecord], Sequence[Reply]]:
        scene, n_contacts = self.scene, len(self.scene.contacts)
        self.ports, ports = records(Port, n_contacts)
        self.contacts, contacts = records(ContactRecord, n_contacts)
        self.replies, replies = records(Reply, n_contacts)
        for number, (contact, law, given) in enumerate(
            zip(scene.contacts, laws_of(scene, self.acting), starts, strict=True)
        ):
            port = self.ports[number]
            port.parameters[: len(given.parameters)] = list(given.parameters)
            port.memory[: len(given.memory)] = list(given.memory)
            # The face of a continuous body has no mass that takes an impulse: a force closes the contact.
            own = any(
                isinstance(self.built[point.body].model, AbstractSelfStepping)
                for point in (contact.left, contact.right)
            )
            port.jump_in_force = float(self.integrator.jump_in_force or own)
            static = [self._static_compliance(point.body, point.x) for point in (contact.left, contact.right)]
            record = self.contacts[number]
            record.law = self.laws[number].value
            record.dates, record.smooth = int(law.answers_force), int(law.smooth)
            record.projects_first, record.load_point = int(self.integrator.projects_first), self.integrator.load_point
            record.trial_point = 1.0 if law.trial_at_end else self.integrator.load_point
            record.initial_gap = record.old_gap = contact.gap
            record.left_share = static[0] / sum(static) if sum(static) > 0.0 else 0.0
        return ports, contacts, replies

    def _static_compliance(self, body: str, x: float) -> float:
        """Return how much a face static statically beyond what its coordinates show [m/N]."""
        built = self.built[body]
        return max(0.0, dict(built.system.massless).get(x, 0.0) or built.model.left_out(x, "displacement", x))


def pushed_by(stepper: Stepper) -> Array:
    """Return velocities per impulse and, where a step may be cut, loads of a body's ports, flat: see `Memory.jump`."""
    loads = np.zeros(0) if stepper.load is None else loads_of(stepper.load, stepper.face_rows)
    return np.concatenate((stepper.jump.ravel(), loads))


def left_out_per_force(
    model: AbstractDiscreteModel, contact: Contact, body: str, x: float, quantity: Quantity
) -> float:
    """Return the static response at x of the modes left out per unit force of a contact."""
    total = 0.0
    for point, sign in ((contact.left, -1.0), (contact.right, 1.0)):
        if point.body == body:
            total += sign * model.left_out(x, quantity, point.x)
    return total


def check_phases(phased: dict[str, Phases], built: dict[str, BuiltBody], steppers: dict[str, Stepper]) -> None:
    """Raise `PairingError` where a scheme or a body cannot change its coordinates within a run."""
    for name in phased:
        stepper, system = steppers[name], built[name].system
        if np.any(system.damping):
            raise PairingError(
                f"'{name}' changes its coordinates with its contact, which serves undamped rods only",
                remedy="Leave the damping out, or use another basis.",
                path="solve.model",
            )
        if stepper.state.size > 3 * system.load.size:
            raise PairingError(
                f"'{name}' changes its coordinates with its contact, and this integrator keeps more than displacements "
                "and velocities",
                remedy="Use newmark, midpoint or exact_modal.",
                path="solve.integrator",
            )
