"""The same bodies and laws with new steppers for another step.

They serve where a step changes more than constants: in delay lines and in Newmark's schemes. Of a run that is known,
the bodies in their coordinates, the laws with their constants and all checks of the scene serve a second one that
differs in its step alone. Steppers are made for the new step; of the arrays of the loop those of bodies are new, and
the entries of the state that rows read move with the state of their body.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.numerics.records import copied_records
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from impactlab.scene.sizes import check_fields, check_records
from impactlab.simulate.plan import Plan, chosen_step, misfit_warnings
from impactlab.simulate.planning.opposed_faces import check_faces
from impactlab.simulate.planning.preparation import prepare_steppers
from impactlab.simulate.stepping.arrays import BodyRecord
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.simulate.stepping.setup.body_records import damper_records
from impactlab.simulate.stepping.setup.flat_arrays import flat, jumps_and_loads, responses_of
from impactlab.simulate.stepping.setup.same_structure import with_numbers


def restepped(plan: Plan, scene: Scene, method: Method) -> Plan | None:
    """Return the plan of a run that differs from a known one in its step.

    None where it needs a plan of its own.

    Parameters
    ----------
    plan : Plan
        Of the run that is known; `impactlab.simulate.stepping.setup.retimed.is_alike` holds.
    scene, method : Scene, Method
        Of the run that is sought.

    Raises
    ------
    CaseError
        Where the step is too long for a body, or too short for the run.
    """
    integrator, built = plan.integrator, plan.built
    if integrator is None or integrator.load_point == 0.0 or plan.start_forces:
        return None  # an explicit step, or a force at t = 0, whose size the step sets
    if any(isinstance(body.model, DelayChain) for body in built.values()):
        return None
    dt = chosen_step(scene, method, integrator, built)
    steps = math.ceil(scene.duration / dt - 1e-9)
    check_records(scene, steps)
    steppers = prepare_steppers(scene, built, integrator, dt)
    state = sum(stepper.state.size for stepper in steppers.values())
    check_fields(scene, state, {name: body.system.load.size for name, body in built.items()})
    if any(misfit_warnings(built, dt)) or check_faces(scene, plan.acting.laws, built, steppers, integrator, dt):
        return None
    acting = method if plan.acting is plan.method else replace(plan.acting, step=method.step)
    return replace(plan, scene=scene, method=method, acting=acting, dt=dt, steps=max(steps, 1), steppers=steppers)


def arrays_of(plan: Plan, dt: float, known: Assembly) -> Assembly:
    """Return the arrays of a `restepped` plan.

    They are those of the known run, which has not begun, and new ones of the bodies. Where other contacts may act on
    each other within a step, all are made again.
    """
    m, layout = known.memory, known.layout.restepped(plan, dt)
    steppers = [*layout.steppers.values()]
    parameters, of_parameters = flat([stepper.parameters for stepper in steppers])
    jump, of_jumps = flat([jumps_and_loads(stepper) for stepper in steppers])
    responses, of_responses = flat([response for stepper in steppers for response in responses_of(stepper)])
    # Entries of the state keep their places in the state of their body.
    first = np.array([*known.layout.shift.values()])
    moved = np.array([*layout.shift.values()]) - first
    read, entries = np.asarray(m.row_index), m.momentum.nonzero()[0]
    row_index = read + moved[first.searchsorted(read, side="right") - 1]
    momentum = np.zeros(layout.n_state)
    momentum[entries + moved[first.searchsorted(entries, side="right") - 1]] = m.momentum[entries]
    by_name, bodies = copied_records(BodyRecord, m.bodies)
    for number, (body, (name, stepper)) in enumerate(zip(by_name, layout.steppers.items(), strict=True)):
        body.parameter_start, body.parameter_end = of_parameters[number : number + 2]
        body.state_start, body.state_end = layout.shift[name], layout.shift[name] + stepper.state.size
        body.jump_start, body.loads_end = of_jumps[number : number + 2]
        body.jump_end = body.jump_start + stepper.jump.size
        body.response_start = of_responses[3 * number]
    state = layout.state()
    given: dict[str, Any] = {
        "state": state,
        "parameters": parameters,
        "jump": jump,
        "responses": responses,
        "momentum": momentum,
        "bodies": bodies,
        "row_index": row_index,
        "backup": np.zeros(layout.n_state),
    }
    if len(m.dampers):
        dampers, dashpots = damper_records(layout, known.integrator, state)
        given |= {"dampers": dampers, "dashpots": dashpots}
    other = with_numbers(known, layout, known.integrator, given)
    if other is None:
        return Assembly(plan, known.integrator, dt)
    other.can_repeat = False
    return other
