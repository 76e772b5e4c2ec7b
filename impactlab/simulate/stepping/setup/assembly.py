"""Assembly: the arrays of the step loop, in the order of a layout.

They are filled from models, steppers and laws.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, final

import numpy as np

from impactlab.integrators.base import AbstractIntegrator
from impactlab.numerics.addresses import COMPILED, entered
from impactlab.numerics.ahead import ahead
from impactlab.numerics.law_address import LawAddress
from impactlab.numerics.records import copied, copied_on_lines, copied_records, records
from impactlab.scene.method import laws_of
from impactlab.simulate.plan import Plan
from impactlab.simulate.stepping.arrays import (
    LAYERS,
    SAMPLED,
    ClockRecord,
    ContactRecord,
    EventRecord,
    FaceRecord,
    LoadRecord,
    SnapshotRecord,
    StepArrays,
)
from impactlab.simulate.stepping.pieces import fill_pieces
from impactlab.simulate.stepping.setup.bead_rows import no_beads, packed
from impactlab.simulate.stepping.setup.body_records import (
    body_records,
    damper_records,
    kernels_of,
    load_records,
    phase_records,
)
from impactlab.simulate.stepping.setup.contact_records import contact_records, face_records, read_on, reading_records
from impactlab.simulate.stepping.setup.coordinates import BothPhases, both_phases
from impactlab.simulate.stepping.setup.layout import Layout
from impactlab.simulate.stepping.setup.pairs import arranged, find_pairs
from impactlab.simulate.stepping.setup.response_ranges import describe, write_ranges
from impactlab.simulate.stepping.unfilled import addresses_without
from impactlab.startup.cached import cached_property
from impactlab.types import Array, Ints, Port, Reply

MANY_CONTACTS = 100  # contacts, from which the room for events is that of a few steps
MIN_EVENTS = 512  # room for events between two returns of the loop
MAX_COPIED = 2e6  # bytes of the arrays of an assembly that is kept for the next run
COPIED: Mapping[str, type[Any]] = {
    "faces": FaceRecord, "contacts": ContactRecord, "ports": Port, "replies": Reply, "snapshots": SnapshotRecord,
    "loads": LoadRecord,
}  # fmt: skip
"""Records that are also read and written by name, and hold more than zeros before a run."""
WRITTEN = ("record", "sample", "snapshot_state")
"""Arrays that a run writes to, zero before it."""
READ_ONLY = ("bodies", "probe_at", "row_start", "row_index", "called", "candidates", "order", "pieces")
"""Arrays that no run writes to: all runs of a plan share them."""
READ_IN_ONE_PHASE = ("momentum", "row_value", "left_out")
"""The same where no body changes its coordinates with its contact."""
PLACE = {name: place for place, name in enumerate(StepArrays._fields)}
"""Number of each array."""
ON_LINES = ("beads", "bead_contacts")
"""Arrays whose parts begin with a line of memory."""


@final
class Assembly:
    """The arrays of one run, and its records by name of their fields."""

    def __init__(self, plan: Plan, integrator: AbstractIntegrator, dt: float, with_beads: bool = True) -> None:
        scene, layout = plan.scene, Layout(plan, dt, with_beads)
        self.layout, self.scene, self.method, self.acting = layout, scene, plan.method, plan.acting
        self.integrator, self.dt, self.steps = integrator, dt, plan.steps
        self.stride, self.sample_stride = layout.stride, layout.sample_stride
        self.failed_at: tuple[float, int] | None = None  # time [s] and step at which compiled code first raised
        with ahead(lambda: kernels_of(layout)):
            self.laws = self.laws_at(layout)
        state = layout.state()
        coordinates = both_phases(layout, integrator, dt)
        contacts, bodies = self._contacts(), self._bodies(coordinates, state)
        contacts["probe_at"] = self._described(coordinates, contacts, bodies)
        beads = packed(layout.rows, plan, dt, layout.pushed_bodies()) if layout.rows.rows else no_beads()
        self.slots = beads.slots  # of the contacts of rows of beads
        self.memory = StepArrays(
            **contacts,
            **bodies,
            **self._results(state.size),
            **self._pairs(coordinates),
            bead_rows=beads.rows,
            beads=beads.beads,
            bead_contacts=beads.contacts,
            shared=beads.shared,
            state=state,
            backup=np.zeros(state.size),
            scratch=np.zeros(4),
            pieces=np.array(addresses_without(), np.int64),
        )
        m = self.memory
        self.clock.rare = int(any(map(len, (m.readings, m.pushes, m.loads, m.dampers))))
        others = len(layout.solved) + self.clock.rare + len(m.phases)
        self.clock.only_beads = int(others == 0 and state.size == 2 * layout.n_beads > 0)
        fill_pieces(m, self.clock)
        # Whether `again` serves.
        self.can_repeat = self.is_small() and all(law.compiled for law in plan.acting.laws.values())

    def laws_at(self, layout: Layout) -> list[LawAddress]:
        """Return the addresses of the laws of the contacts that are solved."""
        laws = laws_of(layout.scene, layout.plan.acting)
        return [LawAddress(laws[number].respond, laws[number].compiled) for number in layout.solved]

    def is_small(self) -> bool:
        """Return whether the arrays are few enough to be kept for the next run."""
        arrays: Any = self.memory if COMPILED else ()
        return COMPILED and sum([each.nbytes for each in arrays]) <= MAX_COPIED

    def fail_all(self) -> None:
        """Mark the replies of all laws as failed, and keep the step.

        The loop stops where it reads one of them.
        """
        self.failed_at = self.failed_at or (float(self.clock.time), int(self.clock.step))
        for reply in self.replies:
            reply.failed = 1.0

    def _contacts(self) -> dict[str, Any]:
        """Return the arrays of the contacts and of their points on bodies.

        Points are faces, readings and pushed rows.
        """
        solved, faces = contact_records(self.layout, self.integrator, self.laws), face_records(self.layout)
        self.ports, self.contacts, self.replies, self.faces = solved.ports, solved.contacts, solved.replies, faces.faces
        ports, contacts, replies = solved.for_loop
        return {
            "ports": ports, "contacts": contacts, "replies": replies,
            "faces": faces.for_loop, "pushes": faces.pushes, "readings": reading_records(self.layout),
        }  # fmt: skip

    def _bodies(self, coordinates: BothPhases, state: Array) -> dict[str, Any]:
        """Return the arrays of the bodies, of their loads and of their dashpots."""
        layout, values = self.layout, coordinates.values
        phases, maps = phase_records(layout)
        loads = load_records(layout, self.integrator)
        self.loads = loads.loads
        dampers, dashpots = damper_records(layout, self.integrator, state)
        return {
            "bodies": body_records(layout, values.starts),
            "called": np.array(layout.called(), np.int64),
            "parameters": values.parameters, "momentum": values.momentum, "jump": values.jump,
            "responses": values.responses, "left_out": coordinates.left_out,
            "row_start": coordinates.row_start, "row_index": coordinates.row_index,
            "row_value": coordinates.row_value, "other_state": coordinates.other_state,
            "phases": phases, "maps": maps, "dampers": dampers, "dashpots": dashpots,
            "loads": loads.for_loop, "load_times": loads.times, "load_forces": loads.forces,
        }  # fmt: skip

    def _described(self, coordinates: BothPhases, contacts: dict[str, Any], bodies: dict[str, Any]) -> Ints:
        """Write the entries of the state that faces, pushes and loads touch.

        Return those that the probes read.
        """
        layout, values = self.layout, coordinates.values
        of_bodies, faces = bodies["bodies"], contacts["faces"]
        phased = np.array([body.system.phases is not None for body in layout.built.values()], np.int64)
        rows = coordinates.row_start, coordinates.row_index, coordinates.row_value
        probe_at = np.full(layout.n_columns - layout.first_probe, -1)
        first_probe = 2 * len(faces) + len(contacts["readings"])
        entered(describe, of_bodies, faces, phased, values.momentum, values.responses, *rows, probe_at, first_probe)
        for moved in (contacts["pushes"], bodies["loads"]):
            if len(moved):
                entered(write_ranges, moved, 1, of_bodies, phased, values.responses)
        return probe_at

    def _results(self, size: int) -> dict[str, Any]:
        """Return the clock and the arrays that a run writes.

        ``size`` is that of the state.
        """
        scene, layout, per_run = self.scene, self.layout, self.steps // self.stride
        times = self._shown_at()
        self.snapshots, snapshots = records(SnapshotRecord, len(times))
        for snapshot, time in zip(self.snapshots, times, strict=True):
            snapshot.time = time
        (self.clock,), clock = records(ClockRecord, 1)
        self.clock.timed, self.clock.steps, self.clock.ends = self.dt, self.steps, scene.duration
        self.clock.changes = int(any(stepper.columns is not None for stepper in layout.steppers.values()))
        self.clock.bead_columns = layout.first_probe - layout.first_bead_force
        located = self.method.events == "located"
        per_contact = 1024 if located else 256 if len(scene.contacts) <= MANY_CONTACTS else 16
        self.events, events = records(EventRecord, max(MIN_EVENTS, per_contact * len(scene.contacts)))
        room = (4 if located else 1) * (per_run + 8) + 256
        samples = self.steps // self.sample_stride + 8
        return {
            "clock": clock, "events": events, "snapshots": snapshots,
            "record": np.zeros((room, layout.n_columns)),
            "sample": np.zeros((samples, SAMPLED + 3 * len(layout.built))),
            "snapshot_state": np.zeros((len(snapshots), 2, size)),
        }  # fmt: skip

    def _shown_at(self) -> tuple[float, ...]:
        """Return the times of snapshots, rising [s], and note their fields.

        Displacements and velocities may use different snapshots. Leapfrog keeps the velocities of the middle of each
        step. Those on both sides of an instant are at the ends of the step that holds the instant half a step later, if
        the run has it.
        """
        times, early = self.scene.field_times, (1.0 - self.integrator.velocity_point) * self.dt
        numbers = tuple(range(len(times)))
        self.shown = numbers, numbers
        if early == 0.0 or not times:
            return times
        later = [time + early for time in times if time + early <= self.steps * self.dt]
        order = np.argsort([*times, *later], kind="stable")
        places = np.argsort(order).tolist()
        own, velocities = places[: len(times)], places[len(times) :]
        self.shown = tuple(own), (*velocities, *own[len(velocities) :])
        return tuple(np.array([*times, *later])[order].tolist())

    def _pairs(self, coordinates: BothPhases) -> dict[str, Any]:
        """Return which contacts act on each other, and the room to solve them together."""
        layout, number = self.layout, len(self.contacts)
        read = read_on(layout, coordinates.row_start, coordinates.row_index) if number > 1 else {}
        candidates = find_pairs(self.faces, self.contacts, layout.pushes, read)
        order, self.clock.reach = arranged(self.contacts, candidates)
        unknowns = 2 * number if number > 1 else 0
        return {
            "candidates": candidates, "coupled": candidates.copy(), "order": order,
            "influence": np.zeros((candidates.size, 3, LAYERS)), "own_influence": np.zeros((3, LAYERS)),
            "system": np.zeros((unknowns, min(unknowns, 6 * self.clock.reach + 4) + 2)),
        }  # fmt: skip

    def again(self, **given: Array) -> Assembly:
        """Return an assembly for another run of the same plan.

        It has arrays of its own; this one must not have run. ``given`` are arrays in place of new ones. With the state
        of one that has run, the copy goes on from there.
        """
        other, m = object.__new__(Assembly), self.memory
        by_name = other.__dict__
        by_name.update(self.__dict__)
        by_name.pop("_others", None)  # arrays of its own
        arrays: list[Any] = [*m]  # those without entries serve all runs
        (other.clock,), arrays[PLACE["clock"]] = copied_records(ClockRecord, m.clock)
        other.events, arrays[PLACE["events"]] = records(EventRecord, len(m.events))
        for name, kind in COPIED.items():
            by_name[name], arrays[PLACE[name]] = copied_records(kind, arrays[PLACE[name]])
        for name, make in self._others:
            if name not in given:
                arrays[PLACE[name]] = make()
        for name, array in given.items():
            arrays[PLACE[name]] = array
        other.memory = StepArrays._make(arrays)
        return other

    @cached_property
    def _others(self) -> list[tuple[str, Callable[[], Any]]]:
        """Name the remaining arrays of another run, and functions that make them.

        They are those that are neither shared nor in `COPIED`.
        """
        made: list[tuple[str, Callable[[], Any]]] = [("state", partial(copied_on_lines, self.memory.state))]
        apart = {"state", "clock", "events", *COPIED, *READ_ONLY}
        apart |= set() if len(self.memory.phases) else set(READ_IN_ONE_PHASE)
        for name, array in self.memory._asdict().items():
            if not array.size or name in apart:
                continue
            make: Callable[[], Any]
            if name in WRITTEN:
                make = partial(np.zeros, array.shape)
            elif name in ON_LINES:
                make = partial(copied_on_lines, array)
            else:
                make = partial(copied, array) if array.dtype.names else array.copy
            made.append((name, make))
        return made

    def grow(self) -> None:
        """Double the room for records and samples; those written stay."""
        record, sample = self.memory.record, self.memory.sample
        self.memory = self.memory._replace(
            record=np.concatenate([record, np.zeros_like(record)]),
            sample=np.concatenate([sample, np.zeros_like(sample)]),
        )
