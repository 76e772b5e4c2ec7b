"""Assembly: the arrays of the step loop, from models, steppers and laws in the order of a layout."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any, final

import numpy as np

from impactlab.integrators.base import AbstractIntegrator
from impactlab.numerics.addresses import COMPILED, LawAddress, entered
from impactlab.numerics.ahead import ahead
from impactlab.numerics.records import copied, copied_records, on_lines, records
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
from impactlab.simulate.stepping.bead_rows import no_beads, packed
from impactlab.simulate.stepping.body_records import (
    body_records,
    damper_records,
    kernels_of,
    load_records,
    phase_records,
)
from impactlab.simulate.stepping.contact_records import contact_records, face_records, read_on, reading_records
from impactlab.simulate.stepping.coordinates import both_phases
from impactlab.simulate.stepping.layout import Layout
from impactlab.simulate.stepping.pairs import arranged, find_pairs
from impactlab.simulate.stepping.pieces import fill_pieces
from impactlab.simulate.stepping.response_ranges import describe, write_ranges
from impactlab.simulate.stepping.unfilled import addresses_without
from impactlab.types import Array, Port, Reply

MANY = 100  # contacts, from which the room for events is that of a few steps
MIN_EVENTS = 512  # room for events between two returns of the loop
MAX_COPIED = 2e6  # bytes of the arrays of an assembly that is kept for the next run
COPIED: Mapping[str, type[Any]] = {
    "faces": FaceRecord, "contacts": ContactRecord, "ports": Port, "replies": Reply, "snapshots": SnapshotRecord,
    "loads": LoadRecord,
}  # fmt: skip
"""Records that are also read and written by name, and hold more than zeros before a run."""
WRITTEN = ("record", "sample", "snapshot_state")
"""Arrays that a run writes to, zero before it."""
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
        built, steppers, n_contacts = layout.built, layout.steppers, len(layout.solved)
        laws = laws_of(scene, plan.acting)
        with ahead(lambda: kernels_of(layout)):
            self.laws = [LawAddress(laws[number].respond, laws[number].compiled) for number in layout.solved]
        state = layout.state()
        values, row_start, row_index, row_value, other_state = both_phases(layout, integrator, dt)
        phases, maps = phase_records(layout)
        self.ports, self.contacts, self.replies, (ports, contacts, replies) = contact_records(
            layout, integrator, self.laws
        )
        self.snapshots, snapshots = records(SnapshotRecord, len(scene.field_times))
        for snapshot, time in zip(self.snapshots, scene.field_times, strict=True):
            snapshot.time = time
        (self.clock,), clock = records(ClockRecord, 1)
        self.clock.timed, self.clock.steps = dt, plan.steps
        self.clock.changes = int(any(stepper.columns is not None for stepper in steppers.values()))
        located = plan.method.events == "located"
        per_contact = 1024 if located else 256 if len(scene.contacts) <= MANY else 16
        self.events, events = records(EventRecord, max(MIN_EVENTS, per_contact * len(scene.contacts)))
        self.faces, faces, pushes = face_records(layout)
        self.loads, loads, load_times, load_forces = load_records(layout, integrator)
        bodies = body_records(layout, values.starts)
        dampers, dashpots = damper_records(layout, integrator, state)
        phased = np.array([body.system.phases is not None for body in built.values()], np.int64)
        rows = row_start, row_index, row_value
        readings = reading_records(layout)
        probe_at = np.full(layout.n_columns - layout.first_probe, -1)
        first_probe = 2 * len(faces) + len(readings)
        entered(describe, bodies, faces, phased, values.momentum, values.responses, *rows, probe_at, first_probe)
        for moved in (pushes, loads):
            if len(moved):
                entered(write_ranges, moved, 1, bodies, phased, values.responses)
        read = read_on(layout, row_start, row_index) if n_contacts > 1 else {}
        candidates = find_pairs(self.faces, self.contacts, layout.pushes, read)
        beads = packed(layout.rows, plan, dt, layout.pushed_bodies()) if layout.rows.rows else no_beads()
        self.slots = beads.slots  # of the contacts of rows of beads
        self.clock.bead_columns = layout.first_probe - layout.first_bead_force
        order, self.clock.reach = arranged(self.contacts, candidates)
        unknowns = 2 * n_contacts if n_contacts > 1 else 0
        room = (4 if located else 1) * (plan.steps // self.stride + 8) + 256
        self.memory = StepArrays(
            clock=clock,
            bodies=bodies,
            faces=faces,
            contacts=contacts,
            ports=ports,
            replies=replies,
            readings=readings,
            pushes=pushes,
            loads=loads,
            phases=phases,
            dampers=dampers,
            dashpots=dashpots,
            bead_rows=beads.rows,
            events=events,
            snapshots=snapshots,
            beads=beads.beads,
            bead_contacts=beads.contacts,
            shared=beads.shared,
            called=np.arange(layout.n_beads, len(built), dtype=np.int64),
            parameters=values.parameters,
            state=state,
            backup=np.zeros(state.size),
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
            probe_at=probe_at,
            load_times=load_times,
            load_forces=load_forces,
            left_out=values.left_out,
            record=np.zeros((room, layout.n_columns)),
            sample=np.zeros((plan.steps // self.sample_stride + 8, SAMPLED + 3 * len(built))),
            snapshot_state=np.zeros((len(scene.field_times), 2, state.size)),
            scratch=np.zeros(4),
            pieces=np.array(addresses_without(), np.int64),
            order=order,
            system=np.zeros((unknowns, min(unknowns, 6 * self.clock.reach + 4) + 2)),
            other_state=other_state,
            maps=maps,
        )
        m = self.memory
        self.clock.rare = int(any(map(len, (m.readings, m.pushes, m.loads, m.dampers))))
        others = n_contacts + self.clock.rare + len(phases)
        self.clock.only_beads = int(others == 0 and state.size == 2 * layout.n_beads > 0)
        fill_pieces(m, self.clock)
        arrays: Any = self.memory if COMPILED else ()
        small = COMPILED and sum([each.nbytes for each in arrays]) <= MAX_COPIED
        self.can_repeat = small and all(law.compiled for law in laws_of(scene, plan.acting))  # whether `again` serves

    def again(self, **given: Array) -> Assembly:
        """Return an assembly for another run of the same plan, with arrays of its own; this one must not have run.

        ``given`` are arrays of other sizes in place of new ones.
        """
        other, old = copy.copy(self), self.memory._asdict()
        arrays: dict[str, Any] = {"state": self.layout.state(), **given}
        (other.clock,), arrays["clock"] = copied_records(ClockRecord, old["clock"])
        other.events, arrays["events"] = records(EventRecord, old["events"].size)
        for name, kind in COPIED.items():
            by_name, arrays[name] = copied_records(kind, old[name])
            setattr(other, name, by_name)
        for name in ON_LINES:
            if old[name].size:
                arrays[name] = on_lines(old[name].size).reshape(old[name].shape)
                arrays[name][:] = old[name]
        for name, array in old.items():
            if name not in arrays:  # those without entries serve all runs
                written = name in WRITTEN and array.size
                arrays[name] = np.zeros(array.shape) if written else copied(array) if array.size else array
        other.memory = StepArrays(**arrays)
        return other

    def grow(self) -> None:
        """Double the room for records and samples; those written stay."""
        record, sample = self.memory.record, self.memory.sample
        self.memory = self.memory._replace(
            record=np.concatenate([record, np.zeros_like(record)]),
            sample=np.concatenate([sample, np.zeros_like(sample)]),
        )
