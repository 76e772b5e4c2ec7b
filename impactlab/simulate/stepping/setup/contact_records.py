"""Records of contacts: laws and their ports, faces, pushed rows, readings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.numerics.law_address import LawAddress
from impactlab.numerics.records import records
from impactlab.scene.problem import Point
from impactlab.simulate.planning.preparation import face_read
from impactlab.simulate.stepping.arrays import ContactRecord, FaceRecord, PushRecord, ReadingRecord
from impactlab.simulate.stepping.setup.layout import Layout
from impactlab.types import Ints, Port, Reply


class Contacts(NamedTuple):
    """Contacts that are solved, by name of their fields, and the same for the loop."""

    ports: Sequence[Port]
    contacts: Sequence[ContactRecord]
    replies: Sequence[Reply]
    for_loop: tuple[Sequence[Port], Sequence[ContactRecord], Sequence[Reply]]


class Faces(NamedTuple):
    """Faces by name of their fields; faces and pushed rows for the loop."""

    faces: Sequence[FaceRecord]
    for_loop: Sequence[FaceRecord]
    pushes: Sequence[PushRecord]


def contact_records(layout: Layout, integrator: AbstractIntegrator, addresses: Sequence[LawAddress]) -> Contacts:
    """Return the contacts that are solved, with the addresses of their laws."""
    n_contacts = len(layout.solved)
    ports, ports_for_loop = records(Port, n_contacts)
    contacts, contacts_for_loop = records(ContactRecord, n_contacts)
    replies, replies_for_loop = records(Reply, n_contacts)
    write_contacts(layout, integrator, addresses, ports, contacts)
    return Contacts(ports, contacts, replies, (ports_for_loop, contacts_for_loop, replies_for_loop))


def write_contacts(
    layout: Layout,
    integrator: AbstractIntegrator,
    addresses: Sequence[LawAddress],
    ports: Sequence[Port],
    contacts: Sequence[ContactRecord],
) -> None:
    """Write the laws and initial gaps into the records of contacts.

    Of the laws, these are their addresses and constants.
    """
    for place, (number, contact) in enumerate(zip(layout.solved, layout.contacts, strict=True)):
        start, law = layout.plan.starts[number], layout.plan.acting.laws[contact.name]
        port, record, points = ports[place], contacts[place], contact.faces
        port.parameters[: len(start.parameters)] = [*start.parameters]
        if start.memory:
            port.memory[: len(start.memory)] = [*start.memory]
        # The face of a continuous body has no mass that takes an impulse: a force closes the contact.
        own = any(isinstance(layout.built[point.body].model, AbstractSelfStepping) for point in points)
        port.jump_in_force = float(integrator.jump_in_force or own)
        static = [_static_compliance(layout, point) for point in points]
        record.law = addresses[place].value
        record.dates = int(law.answers_force and not law.two_sided)
        record.compliant = int(law.answers_force and not law.hard)
        record.joined = int(law.two_sided)
        record.largest, record.smallest = -math.inf, math.inf
        # Located events need the trial force of every step. A predictor may overlap where the free step ends apart.
        located = layout.plan.method.events == "located"
        record.zero_apart = int(law.zero_apart and not located and not integrator.projects_first)
        record.projects_first, record.load_point = int(integrator.projects_first), integrator.load_point
        record.trial_point = 1.0 if law.trial_at_end else integrator.load_point
        record.initial_gap = contact.gap - _placed(layout, contact.right) + _placed(layout, contact.left)
        record.old_gap = contact.gap
        record.left_share = static[0] / sum(static) if sum(static) > 0.0 else 0.0


def _placed(layout: Layout, point: Point) -> float:
    """Return the position of a mechanism's face at t = 0 [m].

    It is 0 for other bodies, whose faces count from there.
    """
    stepper = layout.steppers[point.body]
    if stepper.columns is None:
        return 0.0
    row = layout.built[point.body].model.row(point.x, "displacement")
    return float(row @ stepper.state[: row.size])


def _static_compliance(layout: Layout, point: Point) -> float:
    """Return the static compliance of a face beyond that of its coordinates [m/N]."""
    built = layout.built[point.body]
    massless = dict(built.system.massless).get(point.x, 0.0) if built.system.massless else 0.0
    return max(0.0, massless or built.model.left_out(point.x, "displacement", point.x))


def face_records(layout: Layout) -> Faces:
    """Return faces and pushed rows.

    The ports of a body are its faces in their order, then its pushed rows.
    """
    pushed, names = layout.pushes, layout.body_numbers
    found, faces = records(FaceRecord, len(layout.points))
    push_by_name, pushes = records(PushRecord, len(pushed))
    taken = dict.fromkeys(names, 0)
    by_name = iter(found)
    for number, contact in enumerate(layout.scene.contacts):
        for point, sign in zip(contact.faces, (-1.0, 1.0), strict=True):
            if layout.places[number] < len(layout.solved):
                face, stepper = next(by_name), layout.steppers[point.body]
                face.body, face.place, face.sign = names[point.body], taken[point.body], sign
                face.moves = int(stepper.state.size > 0)
            taken[point.body] += 1
    for record, push in zip(push_by_name, pushed, strict=True):
        record.contact, record.body, record.weight = push.contact, names[push.body], push.weight
        record.place = taken[push.body]
        taken[push.body] += 1
    return Faces(found, faces, pushes)


def read_on(layout: Layout, row_start: Ints, row_index: Ints) -> dict[str, dict[int, list[Ints]]]:
    """Return the entries of bodies' states that their faces read.

    They are those of the displacement and the velocity of each face, of bodies that move.
    """
    found: dict[str, dict[int, list[Ints]]] = {}
    for number, point in enumerate(layout.points):
        if layout.steppers[point.body].state.size:
            rows = (number, len(layout.points) + number)
            entries = [row_index[row_start[row] : row_start[row + 1]] - layout.shift[point.body] for row in rows]
            found.setdefault(point.body, {})[number] = entries
    return found


def reading_records(layout: Layout) -> Sequence[ReadingRecord]:
    """Return the readings of all laws, contact by contact."""
    numbers = layout.body_numbers
    wanted = [
        (numbers[face_read(layout.contacts[place], reading).body], place, slot)
        for place, number in enumerate(layout.solved)
        for slot, reading in enumerate(layout.plan.starts[number].readings)
    ]
    by_name, readings = records(ReadingRecord, len(wanted))
    for record, each in zip(by_name, wanted, strict=True):
        record.body, record.contact, record.slot = each
    return readings
