"""Records of the bodies of a stepped run: addresses and ranges, dashpots, loads, phases."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.numerics.addresses import COLUMNS, DERIVE, FREE, MEASURE, RETIME, kernel_address
from impactlab.numerics.ahead import Kernel, ahead
from impactlab.numerics.records import records
from impactlab.simulate.stepping.arrays import (
    CHANGE,
    DAMPING,
    BodyRecord,
    DamperRecord,
    LoadRecord,
    PhaseRecord,
)
from impactlab.simulate.stepping.setup.flat_arrays import dashpots, flat
from impactlab.simulate.stepping.setup.layout import Layout
from impactlab.types import Array


class Loads(NamedTuple):
    """Loads of all bodies, and the samples of their forces.

    ``loads`` has fields by name; ``for_loop`` is the same for the loop.
    """

    loads: Sequence[LoadRecord]
    for_loop: Sequence[LoadRecord]
    times: Array
    forces: Array


def body_records(layout: Layout, starts: list[list[int]]) -> Sequence[BodyRecord]:
    """Return the bodies, with the starts of their parameters, jumps and responses."""
    by_name, bodies = records(BodyRecord, len(layout.built))
    parameters, jumps, responses = starts
    with ahead(lambda: kernels_of(layout)):
        for body, stepper in zip(by_name, layout.steppers.values(), strict=True):
            if stepper.state.size == 0:  # it is not called
                continue
            body.free, body.measure = kernel_address(stepper.free, FREE), kernel_address(stepper.measure, MEASURE)
            body.retime, body.derive = kernel_address(stepper.retime, RETIME), kernel_address(stepper.derive, DERIVE)
            body.columns = kernel_address(stepper.columns, COLUMNS)
    for number, (body, (name, stepper)) in enumerate(zip(by_name, layout.steppers.items(), strict=True)):
        body.parameter_start, body.parameter_end = parameters[number : number + 2]
        body.state_start, body.state_end = layout.shift[name], layout.shift[name] + stepper.state.size
        body.n_dof, body.n_ports = stepper.jump.shape[1], len(stepper.jump)
        body.jump_start, body.loads_end = jumps[number : number + 2]
        body.jump_end = body.jump_start + stepper.jump.size
        body.load_at = stepper.load.start if stepper.load else 0
        body.response_start = responses[number]
    return bodies


def kernels_of(layout: Layout) -> list[Kernel]:
    """Return the kernels of all bodies."""
    found = {}
    for stepper in layout.steppers.values():
        if stepper.state.size == 0:
            continue
        kernels = (
            (stepper.measure, MEASURE), (stepper.columns, COLUMNS), (stepper.free, FREE), (stepper.derive, DERIVE),
            (stepper.retime, RETIME),
        )  # fmt: skip
        found.update({function: signature for function, signature in kernels if function is not None})
    return [Kernel(*each) for each in found.items()]


def damper_records(
    layout: Layout, integrator: AbstractIntegrator, state: Array
) -> tuple[Sequence[DamperRecord], Array]:
    """Return the groups of dashpots of all bodies, and the values of each dashpot."""
    found = [(name, each) for name, body in layout.built.items() for each in dashpots(body.system)]
    by_name, dampers = records(DamperRecord, len(found))
    values, first = np.zeros((5, sum(each.damping.size for _, each in found))), 0
    for damper, (name, each) in zip(by_name, found, strict=True):
        shift, n_dof, count = layout.shift[name], layout.n_dof(name), each.damping.size
        damper.first, damper.count = first, count
        damper.index, damper.other = shift + each.first, shift + each.other if each.other >= 0 else -1
        damper.inside, damper.straddles = int(each.inside), int(integrator.velocity_point < 1.0)
        if (losses := layout.steppers[name].losses) is not None:
            damper.rates = n_dof
            damper.gamma, damper.kappa, damper.lag, damper.am = losses
        rates = state[shift + n_dof : shift + 2 * n_dof]
        rate = rates[each.first :][:count] - (rates[each.other :][:count] if each.other >= 0 else 0.0)
        values[DAMPING, first : first + count] = each.damping
        values[CHANGE, first : first + count] = layout.dt * rate if losses is None else 0.0
        first += count
    return dampers, values


def phase_records(layout: Layout) -> tuple[Sequence[PhaseRecord], Array]:
    """Return the bodies with phases, and the maps between their coordinates."""
    phased = {name: body.system.phases for name, body in layout.built.items() if body.system.phases is not None}
    by_name, phases = records(PhaseRecord, len(phased))
    if not phased:
        return phases, np.zeros(0)
    maps, starts = flat([np.concatenate((each.closing, each.opening)) for each in phased.values()])
    for phase, (name, each), start in zip(by_name, phased.items(), starts, strict=False):
        phase.contact, phase.body, phase.map_start = layout.places[each.contact], layout.body_numbers[name], start
    return phases, maps


def load_records(layout: Layout, integrator: AbstractIntegrator) -> Loads:
    """Return the loads of all bodies and their samples.

    The ports of a body end with its loads.
    """
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
        record.table_start, record.table_end = starts[number : number + 2]
        record.point = 0.5 if own else integrator.load_point
        record.before = float(found[number][1].at(np.zeros(1))[0])
    return Loads(by_name, loads, times, flat([table[1] for table in tables])[0])
