"""Coordinates of a stepped run: parameters, momenta, responses and rows of all bodies, flat."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.base import AbstractDiscreteModel
from impactlab.simulate.channels import Probed
from impactlab.simulate.planning.model_shapes import checked_row
from impactlab.simulate.planning.preparation import (
    BuiltBody,
    check_phases,
    face_read,
    left_out_per_force,
    prepare_steppers,
    reading_place,
)
from impactlab.simulate.stepping.setup.flat_arrays import flat, jumps_and_loads, responses_of, sparse
from impactlab.simulate.stepping.setup.layout import MOTION, Layout
from impactlab.stepper import Stepper
from impactlab.types import Array, Arriving, Ints, Quantity

Models = Mapping[str, AbstractDiscreteModel]  # by name of the body
Steppers = Mapping[str, Stepper]


class Values(NamedTuple):
    """Numbers of the bodies in one set of coordinates, in the layout of `StepArrays`."""

    parameters: Array
    momentum: Array
    jump: Array
    responses: Array
    starts: list[list[int]]  # of parameters, jumps and responses, body by body


class Coordinates(NamedTuple):
    """Values that belong to one set of bodies' coordinates, and their rows."""

    values: Values
    rows: list[tuple[int, Array]]  # each a shift into the whole state and its values
    left_out: Array


class BothPhases(NamedTuple):
    """Coordinates of a run and their rows without zeros, for both phases.

    ``other_state`` is that of bodies with phases while these are closed.
    """

    values: Values
    left_out: Array
    row_start: Ints
    row_index: Ints
    row_value: Array
    other_state: Array


def both_phases(layout: Layout, integrator: AbstractIntegrator, dt: float) -> BothPhases:
    """Return the coordinates of a run."""
    built, steppers = layout.built, layout.steppers
    models = {name: body.model for name, body in built.items()}
    values, rows, left_out = coordinates(layout, models, steppers)
    phased = {name: body.system.phases for name, body in built.items() if body.system.phases is not None}
    if not phased:
        return BothPhases(values, left_out, *sparse(rows), np.zeros(0))
    check_phases(phased, built, steppers)
    closed = {name: BuiltBody(built[name].body, each.closed, each.closed.operators()) for name, each in phased.items()}
    others = dict(steppers) | prepare_steppers(layout.scene, closed, integrator, dt, layout.plan.pushes)
    closed_models = models | {name: body.model for name, body in closed.items()}
    other, other_rows, other_left_out = coordinates(layout, closed_models, others)
    # The same entries in both phases, so that only values are exchanged.
    pattern = [(a != 0.0) | (b != 0.0) for (_, a), (_, b) in zip(rows, other_rows, strict=True)]
    kept = other.parameters, other.momentum, other.jump, other.responses
    other_state = np.concatenate((*kept, sparse(other_rows, pattern)[2], other_left_out.ravel()))
    return BothPhases(values, left_out, *sparse(rows, pattern), other_state)


def coordinates(layout: Layout, models: Models, steppers: Steppers) -> Coordinates:
    """Return the values of one set of coordinates, and the rows over it."""
    return Coordinates(values_of(layout, models, steppers), *_rows(layout, models))


def values_of(layout: Layout, models: Models, steppers: Steppers) -> Values:
    """Return the numbers of the bodies in one set of coordinates."""
    momentum = np.zeros(layout.n_state)
    for name, model in models.items():
        row = checked_row(name, model.momentum_row(), layout.built[name].system.load.size, "momentum_row")
        start = layout.shift[name] + row.size
        if not steppers[name].whole_momentum:
            momentum[start : start + row.size] = row
    each = list(steppers.values())
    parameters, of_parameters = flat([stepper.parameters for stepper in each])
    jump, of_jumps = flat([jumps_and_loads(stepper) for stepper in each])
    responses, of_responses = flat([response for stepper in each for response in responses_of(stepper)])
    starts = [of_parameters, of_jumps, of_responses[::3]]
    return Values(parameters, momentum, jump, responses, starts)


def _rows(layout: Layout, models: Models) -> tuple[list[tuple[int, Array]], Array]:
    """Return all rows, and the static responses of modes left out.

    Rows are in the order that `StepArrays` states. The latter are those at each reading per force of each contact.
    """

    def row(body: str, x: float, quantity: Quantity, factor: float = 1.0) -> tuple[int, Array]:
        values = models[body].row(x, quantity)
        if quantity != "moment":  # of the drive of a mechanism it is over its whole state
            checked_row(body, values, layout.built[body].system.load.size)
        values = values if factor == 1.0 else factor * values
        return layout.shift[body] + (values.size if quantity == "velocity" else 0), values

    def recorded(each: Probed) -> tuple[int, Array]:
        """Return the row of a probe, with the viscous part of internal forces.

        Such a row is over displacements and velocities.
        """
        shift, values = row(each.body, each.x, each.quantity, each.factor)
        elastic = layout.scene.bodies[each.body].elastic
        delay = 0.0 if elastic is None else elastic.retardation(each.x, each.quantity)
        return shift, np.concatenate([values, delay * values]) if delay > 0.0 else values

    contacts = layout.contacts
    starts = [layout.plan.starts[number] for number in layout.solved]
    rows = [row(point.body, point.x, "displacement") for point in layout.points]
    rows += [(shift + values.size, values) for shift, values in rows]  # of velocities: the same values
    left_out: list[list[float]] = []
    for contact, start in zip(contacts, starts, strict=True):
        for reading in start.readings:
            left_out.append([0.0] * len(contacts))
            if isinstance(reading, Arriving):
                point = face_read(contact, reading)
                whole = models[point.body].arriving(point.x, reading.delay, reading.speed)
                rows.append((layout.shift[point.body], whole))  # over displacements and velocities
                continue
            point, x = reading_place(contact, reading)
            rows.append(row(point.body, x, reading.quantity))
            if reading.left_out:
                model = models[point.body]
                left_out[-1] = [left_out_per_force(model, other, point.body, x, reading.quantity) for other in contacts]
    rows += [recorded(each) for each in (*layout.probes, *layout.far_ends)]
    rows += [(layout.shift[name], values) for name, values in layout.sent]
    loaded = [(name, x) for name, body in layout.built.items() for x, _ in body.body.loads]
    rows += [row(name, x, quantity) for name, x in loaded for quantity in MOTION]
    rows += [row(push.body, push.x, push.quantity) for push in layout.pushes]
    return rows, np.array(left_out, float).reshape(len(left_out), len(contacts))
