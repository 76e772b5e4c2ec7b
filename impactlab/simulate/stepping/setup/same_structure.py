"""Arrays of a plan from those of another one of the same structure.

Rows and places are kept, all numbers are written. Scenes of a sweep differ in a mass, a velocity, a gap or a number of
a law. Their bodies and contacts stand at the same places in the arrays of the loop, and are read by the same rows.
Numbers are written by the functions that write them into new arrays.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.rigid import RigidBody
from impactlab.numerics.addresses import entered
from impactlab.numerics.records import copied
from impactlab.simulate.plan import Plan
from impactlab.simulate.stepping.arrays import SAMPLED
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.simulate.stepping.setup.contact_records import read_on, write_contacts
from impactlab.simulate.stepping.setup.coordinates import values_of
from impactlab.simulate.stepping.setup.layout import Layout
from impactlab.simulate.stepping.setup.pairs import find_pairs
from impactlab.simulate.stepping.setup.response_ranges import describe


def is_alike(plan: Plan, known: Plan) -> bool:
    """Return whether two plans have the same structure.

    Their bodies, contacts and probes stand at the same places. Their bodies are the same or rigid, without loads over
    time. No law reads its bodies beside the faces.
    """
    scene, other = plan.scene, known.scene
    return (
        plan.method.events == known.method.events == "dated"
        and not (scene.field_times or other.field_times or plan.pushes or known.pushes)
        and [*plan.built] == [*known.built]
        and all(_is_alike(plan, known, name) for name in plan.built)
        and [contact.faces for contact in scene.contacts] == [contact.faces for contact in other.contacts]
        and scene.recorded_probes == other.recorded_probes
        and all(
            not start.readings
            and not before.readings
            and len(start.parameters) == len(before.parameters)
            and len(start.memory) == len(before.memory)
            for start, before in zip(plan.starts, known.starts, strict=True)
        )
    )


def _is_alike(plan: Plan, known: Plan, name: str) -> bool:
    """Return whether a body has the same rows and steps in two plans.

    Of its steps, functions and sizes must agree.
    """
    (body, model, system), other = plan.built[name], known.built[name].model
    one, before = plan.steppers[name], known.steppers[name]
    return (
        (model is other or (type(model) is type(other) is RigidBody))
        and system.phases is None
        and not body.changes
        and not body.loads
        and (one.free, one.measure, one.derive, one.retime)
        == (before.free, before.measure, before.derive, before.retime)
        and one.load == before.load
        and one.columns is before.columns is None
        and (one.parameters.size, one.state.size, one.jump.shape)
        == (before.parameters.size, before.state.size, before.jump.shape)
    )


def has_structure(made: Assembly) -> bool:
    """Return whether `renumbered` may serve other plans with some arrays."""
    plan = made.layout.plan
    return not len(made.memory.bead_rows) and not len(made.memory.dampers) and is_alike(plan, plan)


def renumbered(known: Assembly, plan: Plan, integrator: AbstractIntegrator, dt: float) -> Assembly | None:
    """Return the arrays of a plan from those of one alike.

    No run has written into the known ones. For these `has_structure` holds. None where the structures differ.
    """
    m = known.memory
    if not is_alike(plan, known.layout.plan):
        return None
    layout = Layout(plan, dt)
    if layout.rows.rows:
        return None
    models = {name: body.model for name, body in layout.built.items()}
    values = values_of(layout, models, layout.steppers)
    given = {
        "bodies": copied(m.bodies),
        "state": layout.state(),
        "parameters": values.parameters,
        "momentum": values.momentum,
        "jump": values.jump,
        "responses": values.responses,
    }
    other = with_numbers(known, layout, integrator, given)
    if other is None:
        return None
    other.laws = other.laws_at(layout)
    write_contacts(layout, integrator, other.laws, other.ports, other.contacts)
    other.clock.ends = plan.scene.duration
    other.can_repeat = other.is_small() and all(law.compiled for law in plan.acting.laws.values())
    return other


def with_numbers(
    known: Assembly, layout: Layout, integrator: AbstractIntegrator, given: dict[str, Any]
) -> Assembly | None:
    """Return the arrays of a layout from others of its structure.

    The ``given`` ones take the place of theirs. Ranges of the state that forces change follow from the responses given.
    None where other contacts may act on each other within a step.
    """
    m, plan, dt = known.memory, layout.plan, layout.dt
    other = known.again(
        **given,
        probe_at=np.full(m.probe_at.size, -1),
        record=np.zeros((plan.steps // layout.stride + 8 + 256, layout.n_columns)),
        sample=np.zeros((plan.steps // layout.sample_stride + 8, SAMPLED + 3 * len(layout.built))),
    )
    made = other.memory
    faces: Any = made.faces
    faces["low"], faces["high"] = 0, 0
    none_phased, first_probe = np.zeros(len(layout.built), np.int64), 2 * len(faces) + len(m.readings)
    rows = made.row_start, made.row_index, made.row_value
    entered(describe, made.bodies, faces, none_phased, made.momentum, made.responses, *rows, made.probe_at, first_probe)
    if len(other.contacts) > 1:
        pairs = find_pairs(other.faces, other.contacts, (), read_on(layout, made.row_start, made.row_index))
        if not np.array_equal(pairs, m.candidates):
            return None
    other.layout, other.scene, other.method, other.acting = layout, plan.scene, plan.method, plan.acting
    other.integrator, other.dt, other.steps = integrator, dt, plan.steps
    other.stride, other.sample_stride = layout.stride, layout.sample_stride
    other.clock.timed, other.clock.steps = dt, plan.steps
    return other
