"""The run: resolve the step, check the pairs, walk the loop in chunks, hand over the history."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from impactlab.errors import CaseError
from impactlab.history.base import AbstractHistory, Warned
from impactlab.integrators.base import AbstractAdaptive, AbstractIntegrator, Stepper
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.plugins import kind_of
from impactlab.scene.bodies import ElasticBody
from impactlab.scene.precision import beyond, in_precision
from impactlab.scene.problem import Scene
from impactlab.scene.ranges import PERIODS_IN_A_STEP
from impactlab.scene.sizes import check_bodies, check_fields, check_records
from impactlab.simulate.checks import check_gain, raise_failure, warn
from impactlab.simulate.pairing import (
    check_continuous,
    check_events,
    check_heavy_faces,
    check_law,
    check_ordinary,
    check_smooth,
    check_system,
    constraint_gains,
    on_continuous_beam,
)
from impactlab.simulate.stepping.assembly import Assembly
from impactlab.simulate.stepping.closed_limit import check_closed
from impactlab.simulate.stepping.messengers import check_messengers
from impactlab.simulate.stepping.preparation import (
    BuiltBody,
    acting_laws,
    build_bodies,
    check_explicit_spring,
    facts_of,
    prepare_steppers,
    pushes_of,
    self_stepping,
    start_laws,
)
from impactlab.types import Start

if TYPE_CHECKING:
    from impactlab.simulate.adaptive.march import March
    from impactlab.simulate.stepping.history import RecordedHistory

CHUNK_SECONDS = 0.1  # between two looks at progress and interrupts
MOST_STEPS = 2_000_000_000
NOTED_MISFIT = 2e-3  # of the length of a body, by which its contacts and ends together give way to a grid
UNUSED = Warned("integrator_unused", "the continuous model needs no integrator; solve.integrator is ignored")

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Plan:
    """What was decided before the first step."""

    scene: Scene  # with the laws that act
    dt: float | None  # s; None for a run without steps
    steps: int
    built: dict[str, BuiltBody]
    steppers: dict[str, Stepper]
    starts: tuple[Start, ...]
    integrator: AbstractIntegrator | None
    warnings: tuple[Warned, ...]
    march: March | None = None  # of an adaptive run


def is_exact(scene: Scene) -> bool:
    """Return whether a scene is solved from event to event: all rods continuous, all laws hard or constant springs."""
    elastic = [body for body in scene.bodies.values() if isinstance(body, ElasticBody)]
    continuous = bool(elastic) and all(
        body.waves is not None and body.model is not None and body.model.exact for body in elastic
    )
    return continuous and all(
        (contact.law.hard and contact.law.answers_force) or contact.law.is_spring for contact in scene.contacts
    )


def resolve_step(scene: Scene, built: dict[str, BuiltBody]) -> float:
    """Return dt [s] by the scene's rule."""
    rule = scene.step
    if rule.dt is not None:
        return rule.dt
    if rule.courant is not None:
        lengths = []
        for name, body in scene.bodies.items():
            if isinstance(body, ElasticBody) and body.model is not None:
                if not body.model.has_mesh:
                    raise CaseError(
                        f"courant needs a mesh, and '{name}' has analytic modes",
                        remedy="Give points_per_period or dt, or modal with elements.",
                        path="solve.step",
                    )
                h = body.model.element_length(body)
                lengths += [h / segment.wave_speed for segment in body.segments]
        if not lengths:
            raise CaseError("courant needs a rod with a mesh", remedy="Give dt.", path="solve.step")
        return rule.courant * min(lengths)
    highest = max((body.system.rule_frequency for body in built.values()), default=0.0)
    if highest == 0.0:
        raise CaseError("points_per_period needs a body that vibrates", remedy="Give dt.", path="solve.step")
    return 2.0 * math.pi / highest / (rule.points_per_period or 10.0)


def fitted_step(dt: float, built: dict[str, BuiltBody]) -> float:
    """Return the step [s] at which bodies that step by themselves give way least; the longest of equally good ones."""
    own = [body.model for body in built.values() if isinstance(body.model, AbstractSelfStepping)]
    steps = sorted({float(step) for model in own for step in model.fitting(dt)} | {dt}, reverse=True)
    return min(steps, key=lambda step: sum(model.misfit(step) for model in own))


def misfit_warnings(built: dict[str, BuiltBody], dt: float) -> Iterator[Warned]:
    """Give a warning for each body that must give way to fit the step."""
    for name, body in built.items():
        if isinstance(body.model, AbstractSelfStepping) and (misfit := body.model.misfit(dt)) > NOTED_MISFIT:
            text = f"'{name}': at this step places move to the grid, or the grid to the ends, by {100 * misfit:.2g} % "
            yield Warned("misfit", text + "of the length; give a smaller step, or another place")


def is_stepped(scene: Scene, own: Collection[str]) -> bool:
    """Return whether an integrator steps anything but rigid masses beside bodies that step by themselves (``own``)."""
    elastic = [name for name, body in scene.bodies.items() if isinstance(body, ElasticBody)]
    return not elastic or any(name not in own for name in elastic)


def _by_default(scene: Scene) -> bool:
    """Return whether the integrator may be the one that a case file has unless it says otherwise."""
    models = [body.model for body in scene.bodies.values() if isinstance(body, ElasticBody)]
    return scene.integrator == Newmark() and not all(model is not None and model.exact for model in models)


def _chosen_step(scene: Scene, built: dict[str, BuiltBody]) -> tuple[float, float]:
    """Return the step [s] and how many there are in the run; raise `CaseError` where it is no positive number."""
    with in_precision("the step", "solve.step"):
        dt = fitted_step(resolve_step(scene, built), built)
        count = scene.duration / dt
    if not 0.0 < dt < math.inf:
        raise beyond("the step", "solve.step")
    return dt, count


def check_step(scene: Scene, built: dict[str, BuiltBody], dt: float) -> None:
    """Raise `CaseError` where a step is too long for the matrices of a body, or too short for the run."""
    for name, body in built.items():
        if body.system.highest_frequency * dt > PERIODS_IN_A_STEP:
            raise CaseError(
                f"a step of {dt:.3g} s is {body.system.highest_frequency * dt:.3g} times 1/omega of the highest "
                f"frequency of '{name}'. Allowed: up to {PERIODS_IN_A_STEP:g}",
                remedy="Give a smaller step, or fewer elements or modes.",
                path="solve.step",
            )
    if not scene.duration / dt <= MOST_STEPS:
        raise CaseError(
            f"{scene.duration / dt:.3g} steps of {dt:.3g} s are too many. Allowed: {MOST_STEPS}",
            remedy="Give a longer step or a shorter duration.",
            path="solve.step",
        )


def prepare(scene: Scene) -> Plan:
    """Return what a run will do, or raise the error that stops it before its first step.

    Of a scene with a tolerance: what it would do first, by prediction alone.
    """
    if scene.tolerance is not None:
        from impactlab.refine.search import first_guess

        with in_precision("the first guess of a description", "solve.tolerance"):
            guess = first_guess(scene)
        return prepare(guess)
    if is_exact(scene):
        from impactlab.exact.contact_kinds import check

        check_records(scene, scene.records)
        with in_precision("the contacts of the scene", "contacts"):
            check(scene)
        return Plan(scene, None, 0, {}, {}, (), None, () if scene.integrator is None else (UNUSED,))
    check_bodies(scene)
    built = build_bodies(scene)
    own = self_stepping(built)
    stepped = is_stepped(scene, own)
    if isinstance(scene.integrator, AbstractAdaptive) and stepped:
        return prepare_adaptive(scene, scene.integrator, built)
    integrator: AbstractIntegrator = scene.integrator if isinstance(scene.integrator, AbstractIntegrator) else Newmark()
    warnings = []
    if not stepped:
        # Only rigid masses are left to an integrator, and their motion under a constant force is known.
        if scene.integrator is not None and not _by_default(scene):
            warnings.append(UNUSED)
        integrator = ExactModal()
    for number, contact in enumerate(scene.contacts):
        check_law(contact.law, integrator, f"contacts.{number}.law")
        if contact.left.body in own or contact.right.body in own:
            check_continuous(contact.law, f"contacts.{number}.law", on_continuous_beam(scene, contact, own))
    check_events(scene, integrator, own)
    limits = {}
    for name, body in built.items():
        if isinstance(body.model, AbstractSelfStepping):
            limits[name] = body.model.longest_step
        else:
            check_system(integrator, name, body.system)
            with in_precision(f"the longest stable step of '{name}'", f"bodies.{name}", body.body):
                limits[name] = integrator.limit(body.system)
    dt, count = _chosen_step(scene, built)
    name = min(limits, key=lambda key: limits[key])
    if dt > limits[name] * (1.0 + 1e-9):
        raise CaseError(
            f"a step of {dt:.6g} s is beyond the stability limit {limits[name]:.6g} s of integrator "
            f"'{kind_of(integrator)}' for body '{name}'",
            remedy=f"Give dt: {limits[name]:.6g} or less, fewer elements or modes, or integrator newmark.",
            path="solve.step",
        )
    check_step(scene, built, dt)
    steps = math.ceil(count - 1e-9)
    check_records(scene, steps)
    steppers = prepare_steppers(scene, built, integrator, dt)
    unknowns = {name: body.system.load.size for name, body in built.items()}
    check_fields(scene, sum(stepper.state.size for stepper in steppers.values()), unknowns)
    facts = facts_of(scene, built, steppers)
    scene = acting_laws(scene, facts)
    check_explicit_spring(scene, facts, steppers, integrator, dt)
    starts = start_laws(scene, facts, dt)
    warnings += check_messengers(scene, built, starts)
    pushes = pushes_of(scene, built, starts)
    check_closed(scene, built, starts, pushes, integrator, dt)
    if pushes:
        steppers = prepare_steppers(scene, built, integrator, dt, pushes)
    warnings += constraint_warnings(scene, integrator, own) + list(misfit_warnings(built, dt))
    return Plan(scene, dt, max(steps, 1), built, steppers, starts, integrator, tuple(warnings))


def constraint_warnings(scene: Scene, integrator: AbstractIntegrator, own: Collection[str]) -> list[Warned]:
    """Return warnings of position constraints under a scheme; raise `PairingError` where one cannot work.

    ``own`` are the names of bodies that step by themselves.
    """
    warnings = []
    for contact in scene.contacts:
        if constraint_gains(scene, contact, integrator, own):
            text = f"{contact.name}: a hard position constraint under '{kind_of(integrator)}' is known to gain energy"
            warnings.append(Warned("constraint_energy", text))
    for name in check_heavy_faces(scene, integrator, own):
        text = f"{name}: both faces have mass; how they part depends on where in the step they meet"
        warnings.append(Warned("heavy_faces", text + "; velocity_complementarity has a restitution"))
    return warnings


def prepare_adaptive(scene: Scene, integrator: AbstractAdaptive, unordered: dict[str, BuiltBody]) -> Plan:
    """Return what an adaptive run will do; a step given as dt or courant is the longest it may take."""
    from impactlab.simulate.adaptive.march import March
    from impactlab.simulate.adaptive.system import System

    check_smooth(scene, integrator, self_stepping(unordered))
    check_records(scene, scene.records)
    built = {name: unordered[name] for name in scene.in_order}
    for name, body in built.items():
        check_ordinary(integrator, name, body.system)
    unknowns = {name: body.system.load.size for name, body in built.items()}
    check_fields(scene, 2 * sum(unknowns.values()), unknowns)
    given = scene.step.dt is not None or scene.step.courant is not None
    with in_precision("the system of equations", "solve.integrator"):
        march = March(System(scene, built), integrator, resolve_step(scene, built) if given else None)
    return Plan(scene, None, 0, built, {}, (), None, (), march)


def run_adaptive(march: March, progress: Progress | None, began: float) -> AbstractHistory:
    """Return the history of an adaptive run; raises `StepError` as `run` does."""
    scene, set_up = march.system.scene, clock.perf_counter()
    history = march.run(progress)
    solved = clock.perf_counter()
    warn(scene, [contact.port for contact in march.system.contacts], march.system.built, history)
    cost = history.cost
    cost.setup_s, cost.solve_s, cost.checks_s = set_up - began, solved - set_up, clock.perf_counter() - solved
    cost.unknowns = march.system.n_dof
    bound = march.integrator.gains_energy + sum(contact.law.gains_energy for contact in scene.contacts)
    check_gain(history, bound, march.time, march.steps, "Give a smaller relative_tolerance.")
    return history


def run(scene: Scene, progress: Progress | None = None, told: bool = True) -> AbstractHistory:
    """Return the history of a scene; without the warnings that `tell` adds where it is not to be told.

    Raises
    ------
    CaseError, PairingError
        Before the first step.
    StepError
        When a law fails, a number is not finite, or energy grows beyond the declared bound; carries what was reached.
    """
    from impactlab.simulate.stepping.history import RecordedHistory

    if scene.tolerance is not None:
        from impactlab.refine.search import run as run_chosen

        return run_chosen(scene, progress)
    began = clock.perf_counter()
    plan = prepare(scene)
    if plan.march is not None:
        return run_adaptive(plan.march, progress, began)
    if plan.dt is None or plan.integrator is None:
        from impactlab.exact.solve import solve

        exact = solve(scene)
        exact.warnings.extend(plan.warnings)
        exact.integrator_used = False
        exact.cost.setup_s = clock.perf_counter() - began - exact.cost.solve_s
        return exact
    if progress is not None:
        progress(0.0)
    from impactlab.numerics.addresses import entered
    from impactlab.simulate.stepping import loop

    assembly = Assembly(plan.scene, plan.built, plan.steppers, plan.starts, plan.integrator, plan.dt, plan.steps)
    history = RecordedHistory(assembly, plan.integrator)
    history.warnings.extend(plan.warnings)
    history.integrator_used = is_stepped(plan.scene, self_stepping(plan.built))
    entered(loop.start, assembly.memory)
    # Compiled here, so that the first run's solve time is that of the steps.
    entered(advance_of(scene), assembly.memory, assembly.dt, 0, assembly.stride, assembly.sample_stride)
    history.cost.setup_s = clock.perf_counter() - began
    began = clock.perf_counter()
    status = walk(assembly, history, progress)
    history.finish()
    solved = clock.perf_counter()
    if told:
        tell(scene, history)
    history.cost.solve_s, history.cost.checks_s = solved - began, clock.perf_counter() - solved
    history.cost.steps = assembly.clock.step
    history.cost.unknowns = sum(body.system.load.size for body in plan.built.values())
    raise_failure(status, assembly, history)
    return history


def tell(scene: Scene, history: AbstractHistory) -> None:
    """Add the warnings that only a finished run can tell: of one that steps, the others have theirs."""
    from impactlab.simulate.stepping.history import RecordedHistory

    if isinstance(history, RecordedHistory):
        assembly = history.assembly
        warn(scene, assembly.ports, assembly.built, history, assembly.dt)


def advance_of(scene: Scene) -> Callable[..., int]:
    """Return the loop that takes the steps of a scene: whole, or cut at events."""
    if scene.events == "located" and scene.contacts:
        from impactlab.simulate.stepping.located import advance_located

        located: Callable[..., int] = advance_located
        return located
    from impactlab.simulate.stepping.loop import advance_dated

    dated: Callable[..., int] = advance_dated
    return dated


def walk(assembly: Assembly, history: RecordedHistory, progress: Progress | None) -> int:
    """Run the loop in chunks of about a tenth of a second; return why it ended. No bit depends on the chunks."""
    from impactlab.simulate.stepping import loop

    chunk = 256
    advance = advance_of(assembly.scene)
    while True:
        first = assembly.clock.step
        began = clock.perf_counter()
        last = min(first + chunk, assembly.steps)
        status = advance(assembly.memory, assembly.dt, last, assembly.stride, assembly.sample_stride)
        spent = clock.perf_counter() - began
        history.drain()
        if status in (loop.LAW_FAILED, loop.NOT_FINITE):
            return int(status)
        if status == loop.RECORDS_FULL:
            assembly.grow()
        done = assembly.clock.step
        if progress is not None:
            progress(done / assembly.steps)
        if done >= assembly.steps:
            return int(status)
        if spent < 0.5 * CHUNK_SECONDS:
            chunk *= 2
        elif spent > CHUNK_SECONDS:
            chunk = max(1, chunk // 2)
