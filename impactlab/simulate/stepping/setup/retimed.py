"""The arrays of a known run with constants for another step.

A run and a second one that differs in its step alone share bodies, modes, rows and laws. Only data of
the step are rewritten, as where events are located, in a tenth of the time of a set-up.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np

from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import AbstractHystereticLaw, Hertz
from impactlab.integrators.exact_modal import ExactModal
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.numerics.addresses import entered_with_table
from impactlab.numerics.compiling import ENTRY
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from impactlab.scene.ranges import PERIODS_IN_A_STEP
from impactlab.scene.sizes import check_records
from impactlab.simulate.plan import Plan
from impactlab.simulate.stepping.arrays import SAMPLED, StepArrays
from impactlab.simulate.stepping.retiming import retime
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.simulate.stepping.setup.layout import steps_per_sample

FREE_OF_STEP = (Penalty, Hertz, AbstractHystereticLaw)  # laws whose constants do not depend on the step
OF_SCENE = tuple(field.name for field in fields(Scene) if field.name != "records")


@ENTRY
def rewrite(m: StepArrays, dt: float) -> None:
    """Write the constants of all bodies and the influence coefficients for another step length."""
    retime(m, dt)


def is_alike(plan: Plan, assembly: Assembly, scene: Scene, method: Method) -> bool:
    """Return whether a run differs from a known one in the step alone.

    Its laws must be independent of the step.
    """
    known = plan.scene
    if method.step.dt is None or plan.dt is None or not assembly.can_repeat:
        return False
    alike = (
        method.integrator == plan.method.integrator
        and method.events == plan.method.events == "dated"
        and replace(method.step, dt=plan.method.step.dt) == plan.method.step
        and _same(method.models, plan.method.models)
        and _same(method.laws, plan.method.laws)
        and (scene is known or all(_same(getattr(scene, name), getattr(known, name)) for name in OF_SCENE))
    )
    if not alike or plan.pushes or plan.warnings:
        return False
    memory = assembly.memory
    if any(map(len, (memory.loads, memory.phases, memory.bead_rows, memory.snapshots))):
        return False
    if any(body.body.changes for body in plan.built.values()):
        return False
    return all(isinstance(law, FREE_OF_STEP) for law in plan.acting.laws.values()) and all(
        contact.joined == 0 and contact.initial_gap >= 0.0 for contact in assembly.contacts
    )


def serves(plan: Plan, assembly: Assembly, scene: Scene, method: Method) -> bool:
    """Return whether arrays may be rewritten for a scene and a method.

    The plan may differ from these in the step alone.
    """
    return is_alike(plan, assembly, scene, method) and may_be_rewritten(plan, assembly, method)


def may_be_rewritten(plan: Plan, assembly: Assembly, method: Method) -> bool:
    """Return whether a run's arrays serve another step with constants rewritten.

    The run must be alike.
    """
    dt, given = method.step.dt, plan.integrator
    if dt is None or plan.dt is None or not isinstance(given, ExactModal) or method.integrator != given:
        return False
    if dt > plan.dt and any(body.system.highest_frequency * dt > PERIODS_IN_A_STEP for body in plan.built.values()):
        return False
    own = any(isinstance(body.model, AbstractSelfStepping) for body in plan.built.values())
    return not own and not len(assembly.memory.dampers)


def _same(one: Any, other: Any) -> bool:
    return one is other or bool(one == other)


def retimed(plan: Plan, assembly: Assembly, scene: Scene, method: Method) -> Assembly:
    """Return the arrays of a run that `serves`, with another step.

    Raises `CaseError` where its records take too much memory.

    Parameters
    ----------
    plan, assembly : Plan, Assembly
        Of the run that is known; they stay as they are.
    scene, method : Scene, Method
        Of the run that is sought.
    """
    assert method.step.dt is not None  # noqa: S101 - as `serves` has seen
    dt, steps = method.step.dt, max(math.ceil(scene.duration / method.step.dt - 1e-9), 1)
    check_records(scene, steps)
    layout = assembly.layout.copied()
    layout.plan = replace(plan, scene=scene, method=method, dt=dt, steps=steps)
    layout.scene, layout.dt, layout.steps = scene, dt, steps
    layout.stride = math.ceil(steps / scene.records)
    layout.sample_stride = steps_per_sample(steps, len(layout.built))
    other = assembly.again(
        record=np.zeros((steps // layout.stride + 8 + 256, layout.n_columns)),
        sample=np.zeros((steps // layout.sample_stride + 8, SAMPLED + 3 * len(layout.built))),
    )
    other.layout, other.scene, other.method, other.dt, other.steps = layout, scene, method, dt, steps
    other.stride, other.sample_stride = layout.stride, layout.sample_stride
    other.can_repeat = False
    other.clock.steps = steps
    entered_with_table(rewrite, other.memory, dt)
    return other
