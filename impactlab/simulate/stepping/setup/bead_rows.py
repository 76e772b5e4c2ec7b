"""Rows of beads in a scene.

They are rigid masses, each in contact with the next by a law that is a power of the overlap.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from impactlab.models.rigid import RigidBody
from impactlab.numerics.lanes import LANES
from impactlab.numerics.records import on_lines, records
from impactlab.scene.method import laws_of
from impactlab.simulate.plan import Plan
from impactlab.simulate.stepping.arrays import (
    COARSE,
    COMPLIANCE,
    GAP,
    KICK,
    LOAD,
    MASS,
    MOST,
    REST,
    STIFFNESS,
    BeadRowRecord,
    U,
    V,
)
from impactlab.simulate.stepping.beads import BLOCK
from impactlab.startup.cached import cached_property
from impactlab.types import Array, Ints, PowerForce


class BeadRow(NamedTuple):
    """Beads from left to right, and the contacts between them.

    Contacts are numbered as in the scene; those with walls are at the ends.
    """

    beads: list[str]
    contacts: list[int]
    left_wall: bool
    right_wall: bool


@dataclass(frozen=True)
class BeadRows:
    """All rows of a scene, and their contacts' forces by number of the contact."""

    rows: list[BeadRow]
    forces: Mapping[int, PowerForce]

    @cached_property
    def beads(self) -> list[str]:
        """Names of all beads, row after row."""
        return [name for row in self.rows for name in row.beads]

    @cached_property
    def contacts(self) -> list[int]:
        """Numbers of all contacts in rows, in the order of the loop."""
        return [number for row in self.rows for number in row.contacts]


def bead_rows(plan: Plan) -> BeadRows:
    """Return the rows of beads of a plan.

    There are none under a scheme that does not kick first, or where steps are cut. A bead has at most one contact of a
    row on either side, the first of the scene, and all laws of a row have the same exponent; other contacts are solved
    as on any body.
    """
    scene, scheme = plan.scene, plan.integrator
    if scheme is None or not scheme.kicks_then_drifts or plan.method.events == "located":
        return BeadRows([], {})
    elastic = scene.elastic
    if all(contact.left.body in elastic or contact.right.body in elastic for contact in scene.contacts):
        return BeadRows([], {})
    forces: dict[int, PowerForce] = {}
    on_right: dict[str, int] = {}  # of a bead: its contact of a row
    on_left: dict[str, int] = {}
    walls = {name for name, body in scene.bodies.items() if not body.moves}
    beads = {name for name in scene.bodies if name not in walls and _is_bead(plan, name)}
    rigid = beads | walls
    for number, (contact, law, start) in enumerate(
        zip(scene.contacts, laws_of(scene, plan.acting), plan.starts, strict=True)
    ):
        left, right = contact.left.body, contact.right.body
        if left not in rigid or right not in rigid or left in on_right or right in on_left:
            continue
        force = law.power_force(start)
        met = [each[name] for each, name in ((on_left, left), (on_right, right)) if name in each]
        if force is None or any(forces[other].exponent != force.exponent for other in met):
            continue
        forces[number] = force
        if left in beads:
            on_right[left] = number
        if right in beads:
            on_left[right] = number
    rows, taken = [], set()
    for name in scene.bodies:
        if name in on_left and scene.contacts[on_left[name]].left.body in beads:
            continue  # not the first of its row
        if name in beads and (name in on_left or name in on_right):
            rows.append(_row_from(plan, name, on_right, on_left, walls))
            taken.update(rows[-1].beads)
    for name in scene.bodies:
        if name in on_right and name not in taken:  # a ring is cut at its first contact
            ring = _row_from(plan, name, on_right, {}, walls)
            place = ring.contacts.index(min(ring.contacts))
            turned = ring.beads[place + 1 :] + ring.beads[: place + 1]
            rows.append(BeadRow(turned, ring.contacts[place + 1 :] + ring.contacts[:place], False, False))
            taken.update(turned)
    rows.sort(key=lambda row: row.contacts[0])
    return BeadRows(rows, forces)


def _is_bead(plan: Plan, name: str) -> bool:
    """Return whether a body is a mass that nothing but contacts, loads and gravity moves."""
    model, system = plan.built[name].model, plan.built[name].system
    if not isinstance(model, RigidBody) or system.load.size != 1 or np.count_nonzero(system.stiffness):
        return False
    return bool(system.load[0] == system.mass[0, 0] * plan.scene.gravity)


def _row_from(plan: Plan, name: str, on_right: dict[str, int], on_left: dict[str, int], walls: set[str]) -> BeadRow:
    """Return the row that begins with a bead, of a ring all of it."""
    first = name
    beads, contacts = [name], [on_left[name]] if name in on_left else []
    left_wall, right_wall = bool(contacts), False
    while name in on_right:
        contacts.append(on_right[name])
        name = plan.scene.contacts[on_right[name]].right.body
        right_wall = name in walls
        if right_wall or name == first:
            break
        beads.append(name)
    return BeadRow(beads, contacts, left_wall, right_wall)


class PackedRows(NamedTuple):
    """Rows of beads as the arrays of the loop."""

    rows: Sequence[BeadRowRecord]
    beads: Array  # as in `StepArrays`
    contacts: Array
    shared: Ints
    slots: Ints  # (n_contacts,) slot of each contact


@cache
def no_beads() -> PackedRows:
    """Return the result of `packed` for a scene without rows."""
    none = np.zeros(0, np.int64)
    return PackedRows(records(BeadRowRecord, 0)[1], np.zeros((V + 1, 0)), np.zeros((REST + 1, 0)), none, none)


def packed(found: BeadRows, plan: Plan, dt: float, shared: set[str]) -> PackedRows:
    """Return rows of beads as the arrays of `StepArrays`.

    ``shared`` are beads on which other contacts or loads act, too. Beads are the first bodies, in the order of their
    rows. A row has an entry for each bead and for the ghosts at both of its ends, and behind them some that are empty;
    before the first row there are some, too. Eight entries that are stepped at once stand in one line of memory.
    """
    n_entries = LANES + sum(_room(row) for row in found.rows)
    beads = on_lines((V + 1) * n_entries).reshape(V + 1, n_entries)
    contacts = on_lines((REST + 1) * n_entries).reshape(REST + 1, n_entries)
    contacts[GAP] = np.inf
    by_name, rows = records(BeadRowRecord, len(found.rows))
    entries: list[Ints] = []
    slots: list[Ints] = []
    body, done, first = 0, 0, LANES
    for record, row in zip(by_name, found.rows, strict=True):
        count, forces = len(row.beads), [found.forces[number] for number in row.contacts]
        record.body, record.count, record.first, record.contact = body, count, first, done
        record.left_wall, record.right_wall = int(row.left_wall), int(row.right_wall)
        record.exponent, record.gained = forces[0].exponent, dt * plan.scene.gravity
        entries.append(np.arange(first + 1, first + 1 + count))
        slots.append(first + 1 - record.left_wall + np.arange(len(forces)))
        masses = np.array([plan.built[name].system.mass[0, 0] for name in row.beads])
        at = entries[-1]
        beads[KICK, at], beads[MASS, at] = dt / masses, masses
        beads[LOAD, at] = [plan.built[name].system.load[0] for name in row.beads]
        beads[U : V + 1, at] = np.array([plan.steppers[name].state for name in row.beads]).T
        own = np.zeros((REST + 1, len(forces)))
        own[GAP] = [plan.scene.contacts[number].gap for number in row.contacts]
        given = np.array([(each.stiffness, each.coarse, each.most) for each in forces])
        own[STIFFNESS], own[COARSE], own[MOST] = given.T
        own[COMPLIANCE] = dt * (beads[KICK, slots[-1]] + beads[KICK, slots[-1] + 1])
        contacts[:, slots[-1]] = own
        record.watched = float(np.min(_watched(own, record.exponent)))
        body, done, first = body + count, done + len(forces), first + _room(row)
    both = [
        (2 * place, entry)
        for place, (name, entry) in enumerate(zip(found.beads, _joined(entries).tolist(), strict=True))
        if name in shared
    ]
    pairs = np.array(both, np.int64).reshape(-1, 2)
    for record in by_name:
        _find_rest(record, beads, contacts, pairs[:, 1])
    return PackedRows(rows, beads, contacts, pairs.ravel(), _joined(slots))


def _room(row: BeadRow) -> int:
    """Return the number of entries of a row, in whole lines of memory.

    They are beads, two ghosts, and entries that are read behind them.
    """
    return LANES * -(-(len(row.beads) + 2 + 2 * LANES) // LANES)


def _joined(parts: list[Ints]) -> Ints:
    return np.concatenate([np.zeros(0, np.int64), *parts])


def _find_rest(row: BeadRowRecord, beads: Array, contacts: Array, shared: Ints) -> None:
    """Mark the blocks of a row that are at rest.

    No bead moves there or is moved by another contact or load, and no contact is closed.
    """
    for start in range(0, row.count + 1, BLOCK):
        at = row.first + np.arange(start, min(start + BLOCK, row.count + 1))
        closed = beads[U, at] - beads[U, at + 1] > contacts[GAP, at]
        moves = row.gained != 0.0 or np.any(beads[V, at]) or np.any((at[0] <= shared) & (shared <= at[-1]))
        contacts[REST, at[0]] = float(not moves and not np.any(closed))


def _watched(contacts: Array, exponent: float) -> Array:
    """Return the forces at which a contact's step becomes coarse [N].

    There the tangent stiffness n K d^(n-1), times the compliance, reaches its limit.
    """
    steep = contacts[COARSE] / (exponent * contacts[STIFFNESS] * contacts[COMPLIANCE])  # d^(n-1)
    if exponent == 1.0:  # coarse at any overlap, or at none
        return np.where(steep <= 1.0, 0.0, np.inf)
    return np.asarray(contacts[STIFFNESS] * steep ** (exponent / (exponent - 1.0)))
