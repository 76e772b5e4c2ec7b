"""Records of the bodies of a stepped run: addresses and ranges, dashpots, loads, phases."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.numerics.addresses import COLUMNS, DERIVE, FREE, MEASURE, RETIME, kernel_address
from impactlab.numerics.records import records
from impactlab.simulate.stepping.arrays import (
    BodyRecord,
    DamperRecord,
    FaceRecord,
    Floats,
    LoadRecord,
    PhaseRecord,
    PushRecord,
)
from impactlab.simulate.stepping.layout import Layout
from impactlab.simulate.stepping.packing import dashpots, flat
from impactlab.types import Array

FEW = 8  # entries of a response, of which plain Python finds the ranges sooner
MIN_EVEN = 16  # coordinates: a shorter momentum row is soon read
SAME_TOL = 4.0 * float(np.finfo(float).eps)  # of an entry of the momentum row: others differ by rounding
RESPONSE_TOL = 1e-20  # of a response's largest entry: smaller entries at its ends are far below rounding


class Loads(NamedTuple):
    """Loads of all bodies by name of their fields, the same for the loop, and the samples of their forces."""

    by_name: Sequence[LoadRecord]
    records: Sequence[LoadRecord]
    times: Floats
    forces: Floats


def body_records(layout: Layout, momentum: Floats, starts: list[list[int]]) -> Sequence[BodyRecord]:
    """Return the bodies, with their momentum row and the starts of their parameters, jumps and responses."""
    by_name, bodies = records(BodyRecord, len(layout.built))
    parameters, jumps, responses = starts
    for number, (body, (name, stepper)) in enumerate(zip(by_name, layout.steppers.items(), strict=True)):
        body.free, body.measure = kernel_address(stepper.free, FREE), kernel_address(stepper.measure, MEASURE)
        body.retime, body.derive = kernel_address(stepper.retime, RETIME), kernel_address(stepper.derive, DERIVE)
        body.columns = kernel_address(stepper.columns, COLUMNS)
        body.parameter_start, body.parameter_end = parameters[number : number + 2]
        body.state_start, body.state_end = layout.shift[name], layout.shift[name] + stepper.state.size
        body.n_dof, body.n_ports = stepper.jump.shape[1], len(stepper.jump)
        body.jump_start, body.loads_end = jumps[number : number + 2]
        body.jump_end = body.jump_start + stepper.jump.size
        body.load_at = stepper.load.start if stepper.load else 0
        body.response_start = responses[number]
        if body.n_dof >= MIN_EVEN and layout.built[name].system.phases is None:
            inner = momentum[body.state_start + body.n_dof + 1 : body.state_start + 2 * body.n_dof - 1]
            body.even = inner[0] if np.abs(inner - inner[0]).max() <= SAME_TOL * abs(inner[0]) else 0.0
    return bodies


def damper_records(layout: Layout, integrator: AbstractIntegrator, state: Floats) -> Sequence[DamperRecord]:
    """Return the dashpots of all bodies."""
    found = [(name, *each) for name, body in layout.built.items() for each in dashpots(body.system)]
    by_name, dampers = records(DamperRecord, len(found))
    for damper, (name, i, j, damping, inside) in zip(by_name, found, strict=True):
        shift, n_dof = layout.shift[name], layout.n_dof(name)
        damper.index, damper.other = shift + i, shift + j if j >= 0 else -1
        damper.damping, damper.inside = damping, int(inside)
        damper.straddles = float(integrator.velocity_point < 1.0)
        rate = state[damper.index + n_dof] - (state[damper.other + n_dof] if j >= 0 else 0.0)
        damper.before = layout.dt * rate
    return dampers


def phase_records(layout: Layout) -> tuple[Sequence[PhaseRecord], Floats]:
    """Return the bodies with phases, and the maps between their coordinates."""
    phased = {name: body.system.phases for name, body in layout.built.items() if body.system.phases is not None}
    by_name, phases = records(PhaseRecord, len(phased))
    if not phased:
        return phases, np.zeros(0)
    maps, starts = flat([np.concatenate((each.closing, each.opening)) for each in phased.values()])
    for phase, (name, each), start in zip(by_name, phased.items(), starts.tolist(), strict=False):
        phase.contact, phase.body, phase.map_start = layout.places[each.contact], layout.body_numbers[name], start
    return phases, maps


def load_records(layout: Layout, integrator: AbstractIntegrator) -> Loads:
    """Return the loads of all bodies and their samples; the ports of a body end with its loads."""
    found = [(name, load) for name, body in layout.built.items() for _, load in body.body.loads]
    by_name, loads = records(LoadRecord, len(found))
    if not found:
        return Loads(by_name, loads, np.zeros(0), np.zeros(0))
    tables = [load.table(layout.steps * layout.dt, layout.steps) for _, load in found]
    times, starts = flat([table[0] for table in tables])
    names = [name for name, _ in found]
    for number, (record, name) in enumerate(zip(by_name, names, strict=True)):
        stepper = layout.steppers[name]
        own = isinstance(layout.built[name].model, AbstractSelfStepping)
        record.body, record.piece = layout.body_numbers[name], -1
        record.place = len(stepper.jump) - names[number:].count(name)
        record.table_start, record.table_end = starts[number : number + 2].tolist()
        record.point = 0.5 if own else integrator.load_point
        record.before = float(found[number][1].at(np.zeros(1))[0])
        write_ranges(layout, record, name, stepper.force_response[record.place], 0)
    return Loads(by_name, loads, times, flat([table[1] for table in tables])[0])


def write_ranges(
    layout: Layout, record: FaceRecord | LoadRecord | PushRecord, body: str, response: Array, at: int
) -> None:
    """Write the ranges of a body's displacements, velocities and other state with nonzero response."""
    system = layout.built[body].system
    n_dof = system.load.size
    # In a body with phases, and in a mechanism, the response changes within the run.
    changes = system.phases is not None or layout.steppers[body].columns is not None
    entries = response.nonzero()[0]
    if entries.size <= FEW and not changes:
        _write_few(record, dict(zip(entries.tolist(), response[entries].tolist(), strict=True)), n_dof, at)
        return
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


def _write_few(record: FaceRecord | LoadRecord | PushRecord, response: dict[int, float], n_dof: int, at: int) -> None:
    """Write the same ranges of a response with few entries, which are given by their places."""
    own: list[list[int]] = [[], [], []]
    for place in response:
        own[min(place // n_dof, 2)].append(place)
    for part, places in enumerate(own):
        if places:
            least = RESPONSE_TOL * max(abs(response[place]) for place in places)
            moved = [place for place in places if abs(response[place]) > least]
            record.low[at + part], record.high[at + part] = moved[0], moved[-1] + 1
