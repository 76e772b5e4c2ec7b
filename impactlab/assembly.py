"""From a scene to the arrays that the loop walks over."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from impactlab.errors import CaseError, PairingError
from impactlab.integrators.base import AbstractIntegrator, Stepper
from impactlab.loop import Bodies, Contacts, Floats, Ints, Record, Rows, compliances
from impactlab.models.base import AbstractDiscreteModel, Operators
from impactlab.models.rigid import RigidBody
from impactlab.pointers import FREE, MEASURE, RETIME, LawAddress, kernel_address, records
from impactlab.scene import Body, Contact, Mass, Point, Rod, Scene, Wall
from impactlab.types import MEMORY, PARAMETERS, READINGS, Array, Port, Quantity, Reply, SideFacts, Start

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
            model = body.model.build(body, scene.gravity)
        elif isinstance(body, Mass):
            model = RigidBody(body.mass, body.velocity, scene.gravity)
        else:
            model = RigidBody(None, 0.0, 0.0)
        built[name] = BuiltBody(body, model, model.operators())
    return built


def side_facts(body: Body, point: Point, scene: Scene) -> SideFacts:
    """Return what a law may know of one side of a contact."""
    if isinstance(body, Rod):
        assert body.model is not None
        inner = 0.0 < point.x < body.length
        segment = body.segments[0] if point.x < 0.5 * body.length else body.segments[-1]
        stiffness = segment.young * segment.area / body.model.element_length(body)
        room = math.nan if inner else segment.length
        impedance = math.nan if inner else segment.impedance
        return SideFacts(
            "rod", impedance, segment.wave_speed, segment.area, stiffness, room, body.mass, scene.gravity
        )
    mass = math.inf if isinstance(body, Wall) else body.mass
    kind = "wall" if isinstance(body, Wall) else "mass"
    return SideFacts(kind, math.nan, math.nan, math.nan, math.nan, math.nan, mass, scene.gravity)


def start_law(scene: Scene, number: int, dt: float) -> Start:
    """Return what the law of a contact asks for; errors name the contact."""
    contact = scene.contacts[number]
    facts = [side_facts(scene.bodies[point.body], point, scene) for point in (contact.left, contact.right)]
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


def sparse(rows: list[tuple[int, Array]]) -> Rows:
    """Return rows, each a shift into the state and a dense row, without their zeros."""
    starts, indices, values = [0], [np.zeros(0, np.int64)], [np.zeros(0)]
    for shift, row in rows:
        nonzero = np.flatnonzero(row)
        indices.append(nonzero + shift)
        values.append(row[nonzero])
        starts.append(starts[-1] + nonzero.size)
    return Rows(np.array(starts, np.int64), np.concatenate(indices), np.concatenate(values))


class Assembly:
    """All arrays of one run, and the names to read them by."""

    def __init__(
        self, scene: Scene, built: dict[str, BuiltBody], integrator: AbstractIntegrator, dt: float, steps: int
    ) -> None:
        self.scene, self.built, self.integrator, self.dt, self.steps = scene, built, integrator, dt, steps
        names = list(built)
        points = [point for contact in scene.contacts for point in (contact.left, contact.right)]
        self.port_rows = {
            name: [built[name].model.row(point.x, "displacement") for point in points if point.body == name]
            for name in names
        }
        self.steppers: dict[str, Stepper] = {}
        for name in names:
            n_dof = built[name].system.load.size
            rows = np.array(self.port_rows[name]).reshape(-1, n_dof)
            self.steppers[name] = integrator.prepare(built[name].system, rows, dt)
        self._index = {name: number for number, name in enumerate(names)}
        self.laws: list[LawAddress] = []
        self.bodies, self.shift = self._bodies(names)
        self.contacts = self._contacts(names, points)
        self.record = self._record(names)
        self.clock = np.zeros(12)

    def _row(self, body: str, x: float, quantity: Quantity) -> tuple[int, Array]:
        """Return a quantity as a shift into the whole state and a row."""
        row = self.built[body].model.row(x, quantity)
        shift = self.shift[body]
        return (shift + row.size if quantity == "velocity" else shift), row

    def _bodies(self, names: list[str]) -> tuple[Bodies, dict[str, int]]:
        steppers = [self.steppers[name] for name in names]
        parameters, parameter_start = flat([stepper.parameters for stepper in steppers])
        state, state_start = flat([stepper.state for stepper in steppers])
        momentum = np.zeros_like(state)
        dampers: list[tuple[int, float]] = []
        for name, start in zip(names, state_start[:-1], strict=True):
            row = self.built[name].model.momentum_row()
            momentum[start + row.size : start + 2 * row.size] = row
            dampers += [(int(start) + i, value) for i, value in enumerate(self.built[name].system.damping[0]) if value]
        bodies = Bodies(
            free=np.array([kernel_address(stepper.free, FREE) for stepper in steppers], np.int64),
            measure=np.array([kernel_address(stepper.measure, MEASURE) for stepper in steppers], np.int64),
            retime=np.array([kernel_address(stepper.retime, RETIME) for stepper in steppers], np.int64),
            parameters=parameters,
            parameter_start=parameter_start,
            state=state,
            state_start=state_start,
            n_dof=np.array([self.built[name].system.load.size for name in names], np.int64),
            backup=np.zeros_like(state),
            momentum=momentum,
            damper_index=np.array([index for index, _ in dampers], np.int64),
            damper_value=np.array([value for _, value in dampers], float),
            damper_old=np.zeros(len(dampers)),
        )
        return bodies, {name: int(start) for name, start in zip(names, state_start[:-1], strict=True)}

    def _contacts(self, names: list[str], points: list[Point]) -> Contacts:
        scene, n_contacts, n_ports = self.scene, len(self.scene.contacts), len(points)
        steppers = [self.steppers[name] for name in names]
        jump, jump_start = flat([stepper.jump for stepper in steppers])
        responses, starts = flat(
            [stepper.force_response for stepper in steppers] + [stepper.impulse_response for stepper in steppers]
        )
        number_in_body, low, high = [], [], []
        for port, point in enumerate(points):
            number = sum(other.body == point.body for other in points[:port])
            number_in_body.append(number)
            nonzero = np.flatnonzero(self.steppers[point.body].force_response[number])
            low.append(int(nonzero[0]) if nonzero.size else 0)
            high.append(int(nonzero[-1]) + 1 if nonzero.size else 0)
        self.ports, ports = records(Port, n_contacts)
        _, replies = records(Reply, n_contacts)
        readings: list[tuple[int, Array]] = []
        reading_port, reading_slot, left_out = [], [], []
        for number, contact in enumerate(scene.contacts):
            start = start_law(scene, number, self.dt)
            self.laws.append(LawAddress(contact.law.respond, contact.law.compiled))
            port = self.ports[number]
            port.parameters[: len(start.parameters)] = start.parameters
            port.memory[: len(start.memory)] = start.memory
            port.load_point = self.integrator.load_point
            port.jump_in_force = float(self.integrator.jump_in_force)
            for slot, reading in enumerate(start.readings):
                point = contact.left if reading.side == "left" else contact.right
                x = point.x + (-reading.distance if reading.side == "left" else reading.distance)
                readings.append(self._row(point.body, x, reading.quantity))
                reading_port.append(2 * number + (reading.side == "right"))
                reading_slot.append(slot)
                left_out.append(
                    [self._left_out(other, point.body, x, reading.quantity) for other in scene.contacts]
                    if reading.left_out
                    else [0.0] * n_contacts
                )
        contacts = Contacts(
            law=np.array([law.value for law in self.laws], np.int64),
            ports=ports,
            replies=replies,
            body=np.array([self._index[point.body] for point in points], np.int64),
            sign=np.tile([-1.0, 1.0], n_contacts),
            initial_gap=np.array([contact.gap for contact in scene.contacts], float),
            displacement=sparse([self._row(point.body, point.x, "displacement") for point in points]),
            velocity=sparse([self._row(point.body, point.x, "velocity") for point in points]),
            readings=sparse(readings),
            reading_port=np.array(reading_port, np.int64),
            reading_slot=np.array(reading_slot, np.int64),
            reading_left_out=np.array(left_out, float).reshape(len(readings), n_contacts),
            force_low=np.array(low, np.int64),
            force_high=np.array(high, np.int64),
            jump=jump,
            jump_start=jump_start,
            responses=responses,
            force_start=starts[: len(names) + 1].copy(),
            impulse_start=starts[len(names) :].copy(),
            port_in_body=np.array(number_in_body, np.int64),
            ports_of_body=np.array([len(self.port_rows[name]) for name in names], np.int64),
            u_force=np.zeros((n_ports, n_contacts)),
            v_force=np.zeros((n_ports, n_contacts)),
            u_impulse=np.zeros((n_ports, n_contacts)),
            v_impulse=np.zeros((n_ports, n_contacts)),
            v_jump=np.zeros((n_ports, n_contacts)),
            u=np.zeros(n_ports),
            v=np.zeros(n_ports),
            free_u=np.zeros(n_ports),
            free_v=np.zeros(n_ports),
            force=np.zeros(n_contacts),
            impulse=np.zeros(n_contacts),
            old_gap=np.array([contact.gap for contact in scene.contacts], float),
            old_trial=np.zeros(n_contacts),
            touching=np.zeros(n_contacts),
            span=np.zeros((n_contacts, 2)),
            last_event=np.zeros(n_contacts),
            dates=np.array([contact.law.answers_force for contact in scene.contacts], np.int64),
        )
        compliances(self.bodies, contacts)
        return contacts

    def _left_out(self, contact: Contact, body: str, x: float, quantity: Quantity) -> float:
        """Return the answer at x of the modes left out per unit force of a contact, which pushes left then right."""
        total = 0.0
        for point, sign in ((contact.left, -1.0), (contact.right, 1.0)):
            if point.body == body:
                total += sign * self.built[body].model.left_out(x, quantity, point.x)
        return total

    def _record(self, names: list[str]) -> Record:
        scene, n_contacts, n_state = self.scene, len(self.scene.contacts), self.bodies.state.size
        self.stride = math.ceil(self.steps / RECORDS)
        self.sample_stride = math.ceil(self.steps / SAMPLES)
        located = 4 if scene.events == "located" else 1
        capacity = located * (self.steps // self.stride + 8) + 256
        samples = self.steps // self.sample_stride + 8
        probes = [(probe.channel, probe.body, probe.x, probe.quantity) for probe in scene.probes]
        for name, body in scene.bodies.items():
            if isinstance(body, Mass):
                probes.append((f"position:{name}", name, 0.0, "displacement"))
                probes.append((f"velocity:{name}", name, 0.0, "velocity"))
        self.probe_channels = [(channel, quantity) for channel, _, _, quantity in probes]
        snapshots = np.sort(np.array(scene.snapshots, float))
        return Record(
            probes=sparse([self._row(body, x, quantity) for _, body, x, quantity in probes]),
            time=np.zeros(capacity),
            contact=np.zeros((capacity, n_contacts, 2)),
            port=np.zeros((capacity, 2 * n_contacts, 2)),
            probe=np.zeros((capacity, len(probes))),
            sum_force=np.zeros(n_contacts),
            sample_time=np.zeros(samples),
            sample_body=np.zeros((samples, len(names), 3)),
            sample_book=np.zeros((samples, 3)),
            event=np.zeros((EVENTS, 6)),
            snapshot_time=snapshots,
            snapshot_at=np.zeros((snapshots.size, 2)),
            snapshot_state=np.zeros((snapshots.size, 2, n_state)),
            scratch=np.zeros(4),
        )

    def grow(self) -> None:
        """Double the room for records and samples; what was written stays."""
        names = ("time", "contact", "port", "probe", "sample_time", "sample_body", "sample_book")
        now = self.record._asdict()
        self.record = self.record._replace(**{name: np.concatenate([now[name], np.zeros_like(now[name])]) for name in names})
