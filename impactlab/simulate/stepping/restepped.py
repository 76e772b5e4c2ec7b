"""The same bodies and laws under another step, where a step changes more than constants: delay lines, and Newmark's.

Of a run that is known, the bodies in their coordinates, the laws with their constants and all checks of the scene
serve a second one that differs in its step alone; steppers and arrays are made for the new step.
"""

from __future__ import annotations

import math
from dataclasses import replace

from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from impactlab.scene.sizes import check_fields, check_records
from impactlab.simulate.plan import Plan, chosen_step, misfit_warnings
from impactlab.simulate.stepping.opposed_faces import check_faces
from impactlab.simulate.stepping.preparation import prepare_steppers


def restepped(plan: Plan, scene: Scene, method: Method) -> Plan | None:
    """Return the plan of a run that differs from a known one in its step alone; None where it needs one of its own.

    Parameters
    ----------
    plan : Plan
        Of the run that is known; `impactlab.simulate.stepping.retimed.is_alike` holds.
    scene, method : Scene, Method
        Of the run that is sought.

    Raises
    ------
    CaseError
        Where the step is too long for a body, or too short for the run.
    """
    integrator, built = plan.integrator, plan.built
    if integrator is None or integrator.load_point == 0.0 or plan.pressed:
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
