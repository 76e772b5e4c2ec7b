"""From a scene to the arrays that the loop walks over."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from impactlab.errors import CaseError, PairingError
from impactlab.integrators.base import AbstractIntegrator, Stepper
from impactlab.memory import (
    INTEGER,
    BodyRecord,
    ClockRecord,
    ContactRecord,
    DamperRecord,
    EventRecord,
    FaceRecord,
    Floats,
    Ints,
    Memory,
    MessengerRecord,
    SnapshotRecord,
)
from impactlab.models.base import AbstractDiscreteModel, Face, Operators
from impactlab.models.delay_line import DelayLine
from impactlab.models.rigid import RigidBody
from impactlab.pointers import FREE, MEASURE, RETIME, LawAddress, kernel_address, records
from impactlab.scene import Body, Contact, Mass, Rod, Scene, Wall
from impactlab.sides import side_facts
from impactlab.types import MEMORY, PARAMETERS, READINGS, Array, Port, Quantity, Reply, Start

RECORDS = 20_000  # steps kept one by one; longer runs are decimated
SAMPLES = 256  # energies taken over a run
EVENTS = 4096  # events between two returns of the loop


@dataclass(frozen=True)
class BuiltBody:
    """A body of the scene with its coordinates."""

    body: Body
    model: AbstractDiscreteModel
    system: Operators


def build_bodies(scene: Scene) -> dict[str, BuiltBody]:
    """Return every body in its coordinates; raises `CaseError` where a model cannot serve one."""
    built = {}
    for name, body in scene.bodies.items():
        model: AbstractDiscreteModel
        if isinstance(body, Rod):
            if body.model is None:
                raise CaseError(f"'{name}' has no model", path="solve.model", remedy="Give solve.model.")
            steps = body.model.steps
            model = (
                body.model.build(body, scene.gravity, faces_of(scene, name))
                if steps
                else DelayLine(body, scene.gravity)
            )
        elif isinstance(body, Mass):
            model = RigidBody(body.mass, body.velocity, scene.gravity)
        else:
            model = RigidBody(None, 0.0, 0.0)
        built[name] = BuiltBody(body, model, model.operators())
    return built


def faces_of(scene: Scene, body: str) -> tuple[Face, ...]:
    """Return where a body is struck and by what, contact by contact."""
    faces = []
    for number, contact in enumerate(scene.contacts):
        for point, other in ((contact.left, contact.right), (contact.right, contact.left)):
            if point.body == body:
                partner = scene.bodies[other.body]
                mass = math.inf if isinstance(partner, Wall) else math.nan
                faces.append(Face(point.x, number, partner.mass if isinstance(partner, Mass) else mass))
    return tuple(faces)


def prepare_steppers(
    scene: Scene, built: dict[str, BuiltBody], integrator: AbstractIntegrator, dt: float
) -> dict[str, Stepper]:
    """Return the stepper of every body, its faces in the order of the contacts."""
    points = [point for contact in scene.contacts for point in (contact.left, contact.right)]
    steppers = {}
    for name, body in built.items():
        rows = [body.model.row(point.x, "displacement") for point in points if point.body == name]
        faces = np.array(rows).reshape(len(rows), body.system.load.size)
        steppers[name] = (
            body.model.stepper(faces, dt)
            if isinstance(body.model, DelayLine)
            else integrator.prepare(body.system, faces, dt)
        )
    return steppers


def face_velocity_per_force(scene: Scene, steppers: dict[str, Stepper], number: int, side: int) -> float:
    """Return how fast a face (0 left, 1 right of a contact) moves after a step per unit force [m/(N s)]."""
    points = [point for contact in scene.contacts for point in (contact.left, contact.right)]
    body = points[2 * number + side].body
    place = sum(other.body == body for other in points[: 2 * number + side])
    stepper = steppers[body]
    n_dof = stepper.jump.shape[1]
    return float(stepper.force_response[place, n_dof : 2 * n_dof] @ stepper.face_rows[place])


def check_explicit_spring(
    scene: Scene, steppers: dict[str, Stepper], integrator: AbstractIntegrator, dt: float
) -> None:
    """Raise `CaseError` where a contact spring is too stiff for a force that acts at the start of the step.

    Two bodies and the spring between them swing with w^2 = k (yields of both faces); leapfrog is stable up to w dt = 2.
    """
    if integrator.load_point > 0.0:
        return
    for number, contact in enumerate(scene.contacts):
        sides = [side_facts(scene, point) for point in (contact.left, contact.right)]
        spring = contact.law.spring(sides[0], sides[1], dt)
        pliancy = dt * sum(face_velocity_per_force(scene, steppers, number, side) for side in (0, 1))
        if spring is not None and spring[0] * pliancy > 4.0:
            stable = dt * 2.0 / math.sqrt(spring[0] * pliancy)
            raise CaseError(
                f"the contact spring of {spring[0]:.6g} N/m is too stiff for an explicit step of {dt:.6g} s between "
                f"these faces; the limit is {4.0 / pliancy:.6g} N/m",
                remedy=f"Give a step of {stable:.6g} s or less, or integrator newmark.",
                path=f"contacts.{number}.law",
            )


def start_law(scene: Scene, steppers: dict[str, Stepper], number: int, dt: float) -> Start:
    """Return what the law of a contact asks for; errors name the contact."""
    contact = scene.contacts[number]
    facts = [
        side_facts(scene, point, face_velocity_per_force(scene, steppers, number, side))
        for side, point in enumerate((contact.left, contact.right))
    ]
    path = f"contacts.{number}.law"
    try:
        start = contact.law.begin(facts[0], facts[1], dt)
    except (PairingError, CaseError) as error:
        if not error.path:
            error.path = path
        elif not error.path.startswith("solve"):
            error.path = f"{path}.{error.path}"
        raise
    for what, given, room in (
        ("parameters", start.parameters, PARAMETERS),
        ("memory", start.memory, MEMORY),
        ("readings", start.readings, READINGS),
    ):
        if len(given) > room:
            raise PairingError(f"the law asks for {len(given)} {what}; there is room for {room}", path=path)
    return start


def flat(arrays: list[Array]) -> tuple[Floats, Ints]:
    """Return arrays in a row and where each starts, with the end, shape (n + 1,)."""
    starts = np.concatenate(([0], np.cumsum([array.size for array in arrays]))).astype(np.int64)
    return np.concatenate([array.ravel() for array in arrays] or [np.zeros(0)]), starts


class Assembly:
    """The memory of one run, and the names to read it by."""

    def __init__(
        self,
        scene: Scene,
        built: dict[str, BuiltBody],
        steppers: dict[str, Stepper],
        integrator: AbstractIntegrator,
        dt: float,
        steps: int,
    ) -> None:
        self.scene, self.built, self.integrator, self.dt, self.steps = scene, built, integrator, dt, steps
        self.stride, self.sample_stride = math.ceil(steps / RECORDS), math.ceil(steps / SAMPLES)
        self.laws = [LawAddress(contact.law.respond, contact.law.compiled) for contact in scene.contacts]
        names, each = list(built), list(steppers.values())
        parameters, parameter_start = flat([stepper.parameters for stepper in each])
        state, state_start = flat([stepper.state for stepper in each])
        jump, jump_start = flat([stepper.jump for stepper in each])
        responses, response_start = flat(
            [stepper.force_response for stepper in each] + [stepper.impulse_response for stepper in each]
        )
        bodies_by_name, bodies = records(BodyRecord, len(names))
        self._shift: dict[str, int] = {}
        momentum = np.zeros_like(state)
        dampers: list[tuple[int, float, int]] = []
        for number, (name, stepper) in enumerate(steppers.items()):
            n_dof, shift = built[name].system.load.size, int(state_start[number])
            self._shift[name] = shift
            momentum[shift + n_dof : shift + 2 * n_dof] = built[name].model.momentum_row()
            dampers += [(shift + i, value, n_dof) for i, value in enumerate(built[name].system.damping[0]) if value]
            fill(
                bodies_by_name[number],
                free=kernel_address(stepper.free, FREE),
                measure=kernel_address(stepper.measure, MEASURE),
                retime=kernel_address(stepper.retime, RETIME),
                parameter_start=parameter_start[number],
                parameter_end=parameter_start[number + 1],
                state_start=shift,
                state_end=state_start[number + 1],
                n_dof=n_dof,
                n_faces=len(stepper.jump),
                jump_start=jump_start[number],
                force_start=response_start[number],
                impulse_start=response_start[len(names) + number],
            )
        dampers_by_name, damper_records = records(DamperRecord, len(dampers))
        for number, (index, damping, n) in enumerate(dampers):
            straddles = float(integrator.velocity_point < 1.0)
            fill(
                dampers_by_name[number], index=index, damping=damping, straddles=straddles, before=dt * state[index + n]
            )
        faces = self._faces(names, steppers)
        ports, contacts, replies, messengers, readings, left_out = self._contacts(steppers)
        self.probe_channels, probes = self._probes()
        points = [point for contact in scene.contacts for point in (contact.left, contact.right)]
        rows = [self._row(point.body, point.x, "displacement") for point in points]
        rows += [self._row(point.body, point.x, "velocity") for point in points]
        rows += readings + probes
        row_start, row_index, row_value = sparse(rows)
        room = (4 if scene.events == "located" else 1) * (steps // self.stride + 8) + 256
        snapshots_by_name, snapshots = records(SnapshotRecord, len(scene.snapshots))
        for number, time in enumerate(sorted(scene.snapshots)):
            snapshots_by_name[number].time = time
        n_contacts = len(scene.contacts)
        clocks, clock = records(ClockRecord, 1)
        self.clock = clocks[0]
        self.clock.timed, self.clock.steps = dt, steps
        self.snapshots = snapshots_by_name
        self.memory = Memory(
            clock=clock,
            bodies=bodies,
            faces=faces,
            contacts=contacts,
            ports=ports,
            replies=replies,
            messengers=messengers,
            dampers=damper_records,
            events=self._events(),
            snapshots=snapshots,
            parameters=parameters,
            state=state,
            backup=np.zeros_like(state),
            momentum=momentum,
            jump=jump,
            responses=responses,
            answers=np.zeros((5, 2 * n_contacts, n_contacts)),
            row_start=row_start,
            row_index=row_index,
            row_value=row_value,
            left_out=left_out,
            record=np.zeros((room, 1 + 6 * n_contacts + len(probes))),
            sample=np.zeros((steps // self.sample_stride + 8, 4 + 3 * len(names))),
            snapshot_state=np.zeros((len(scene.snapshots), 2, state.size)),
            scratch=np.zeros(4),
        )

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

    def _row(self, body: str, x: float, quantity: Quantity) -> tuple[int, Array]:
        """Return a quantity as a shift into the whole state and a row."""
        row = self.built[body].model.row(x, quantity)
        shift = self._shift[body]
        return (shift + row.size if quantity == "velocity" else shift), row

    def _events(self) -> Any:
        self.events, events = records(EventRecord, max(EVENTS, 1024 * len(self.scene.contacts)))
        return events

    def _probes(self) -> tuple[list[tuple[str, Quantity]], list[tuple[int, Array]]]:
        """Return the channels of the probes, those of every mass included, and their rows."""
        asked = [(probe.channel, probe.body, probe.x, probe.quantity) for probe in self.scene.probes]
        for name, body in self.scene.bodies.items():
            if isinstance(body, Mass):
                asked += [(f"position:{name}", name, 0.0, "displacement"), (f"velocity:{name}", name, 0.0, "velocity")]
        return [(channel, quantity) for channel, _, _, quantity in asked], [
            self._row(body, x, quantity) for _, body, x, quantity in asked
        ]

    def _faces(self, names: list[str], steppers: dict[str, Stepper]) -> Any:
        by_name, faces = records(FaceRecord, 2 * len(self.scene.contacts))
        seen = dict.fromkeys(names, 0)
        for number, contact in enumerate(self.scene.contacts):
            for side, point in enumerate((contact.left, contact.right)):
                place = seen[point.body]
                seen[point.body] += 1
                face = by_name[2 * number + side]
                fill(face, body=names.index(point.body), place=place, sign=(-1.0, 1.0)[side])
                response = steppers[point.body].force_response[place]
                n_dof = steppers[point.body].jump.shape[1]
                for part, first in enumerate((0, n_dof, 2 * n_dof)):
                    last = response.size if part == 2 else first + n_dof
                    moved = np.flatnonzero(response[first:last])
                    if moved.size:
                        face.low[part], face.high[part] = first + int(moved[0]), first + int(moved[-1]) + 1
        return faces

    def _contacts(self, steppers: dict[str, Stepper]) -> tuple[Any, Any, Any, Any, list[tuple[int, Array]], Floats]:
        scene, n_contacts = self.scene, len(self.scene.contacts)
        self._ports, ports = records(Port, n_contacts)
        self.contacts, contacts = records(ContactRecord, n_contacts)
        _, replies = records(Reply, n_contacts)
        readings: list[tuple[int, Array]] = []
        wanted: list[tuple[int, int]] = []
        left_out: list[list[float]] = []
        for number, contact in enumerate(scene.contacts):
            given = start_law(scene, steppers, number, self.dt)
            port = self._ports[number]
            port.parameters[: len(given.parameters)] = given.parameters
            port.memory[: len(given.memory)] = given.memory
            port.load_point = self.integrator.load_point
            port.jump_in_force = float(self.integrator.jump_in_force)
            fill(
                self.contacts[number],
                law=self.laws[number].value,
                dates=int(contact.law.answers_force),
                trial_point=1.0 if contact.law.trial_at_end else self.integrator.load_point,
                initial_gap=contact.gap,
                old_gap=contact.gap,
            )
            for slot, reading in enumerate(given.readings):
                point = contact.left if reading.side == "left" else contact.right
                x = point.x + (-reading.distance if reading.side == "left" else reading.distance)
                readings.append(self._row(point.body, x, reading.quantity))
                wanted.append((number, slot))
                answers = [self._left_out(other, point.body, x, reading.quantity) for other in scene.contacts]
                left_out.append(answers if reading.left_out else [0.0] * n_contacts)
        by_name, messengers = records(MessengerRecord, len(wanted))
        for number, (owner, slot) in enumerate(wanted):
            fill(by_name[number], contact=owner, slot=slot)
        return (
            ports,
            contacts,
            replies,
            messengers,
            readings,
            np.array(left_out, float).reshape(len(wanted), n_contacts),
        )

    def _left_out(self, contact: Contact, body: str, x: float, quantity: Quantity) -> float:
        """Return the answer at x of the modes left out per unit force of a contact, which pushes left then right."""
        total = 0.0
        for point, sign in ((contact.left, -1.0), (contact.right, 1.0)):
            if point.body == body:
                total += sign * self.built[body].model.left_out(x, quantity, point.x)
        return total


def sparse(rows: list[tuple[int, Array]]) -> tuple[Ints, Ints, Floats]:
    """Return rows, each a shift into the state and a dense row, without their zeros: starts, indices, values."""
    starts, indices, values = [0], [np.zeros(0, np.int64)], [np.zeros(0)]
    for shift, row in rows:
        nonzero = np.flatnonzero(row)
        indices.append(nonzero + shift)
        values.append(row[nonzero])
        starts.append(starts[-1] + nonzero.size)
    return np.array(starts, np.int64), np.concatenate(indices), np.concatenate(values)


def fill(record: Any, **values: Any) -> None:
    """Set the named fields of a record."""
    kinds = dict(record._fields_)
    for name, value in values.items():
        setattr(record, name, int(value) if kinds[name] is INTEGER else float(value))
