"""The plan of a run: models, pairs, step and laws, checked before the first step."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from impactlab.contact.base import AbstractContactLaw
from impactlab.errors import CaseError
from impactlab.history.base import Warned
from impactlab.integrators.base import AbstractAdaptive, AbstractIntegrator
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.mechanisms.model import MechanismModel, kernels_of
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.numerics.ahead import Kernel, ahead
from impactlab.plugins import kind_of
from impactlab.printing import at_most
from impactlab.scene.method import Method, is_exact, laws_of, modelled, models_of
from impactlab.scene.precision import beyond, in_precision, quietly
from impactlab.scene.problem import Scene
from impactlab.scene.ranges import PERIODS_IN_A_STEP
from impactlab.scene.sizes import check_fields, check_records, with_room
from impactlab.simulate import exact_run
from impactlab.simulate.planning.body_sizes import check_bodies
from impactlab.simulate.planning.closed_limit import check_closed
from impactlab.simulate.planning.contact_facts import ContactFacts
from impactlab.simulate.planning.forces_at_start import forces_at_start
from impactlab.simulate.planning.known_bodies import MAX_COMPARED, KnownBodies
from impactlab.simulate.planning.messenger_errors import check_messengers, check_step_of_face
from impactlab.simulate.planning.opposed_faces import check_faces
from impactlab.simulate.planning.pairing import (
    check_ordinary,
    check_pairs,
    check_smooth,
    check_system,
    constraint_warnings,
    energy_bound,
)
from impactlab.simulate.planning.preparation import (
    BuiltBody,
    Push,
    build_bodies,
    check_explicit_spring,
    faces_of,
    facts_of,
    placed_at,
    prepare_steppers,
    pushes_of,
    self_stepping,
    start_law,
)
from impactlab.simulate.warnings import ends, probes, sawtooth
from impactlab.startup.cached import cached_property
from impactlab.startup.lazy import lazy
from impactlab.stepper import Stepper
from impactlab.types import Level, Start

if TYPE_CHECKING:
    from impactlab.simulate.adaptive import march as adaptive
    from impactlab.simulate.adaptive import system
else:  # needed only under adaptive steps
    adaptive = lazy("impactlab.simulate.adaptive.march")
    system = lazy("impactlab.simulate.adaptive.system")

MAX_STEPS = 2_000_000_000
MISFIT_WARN = 2e-3  # of the length of a body, by which its contacts and ends together are moved to a grid
MAX_KEPT = 2.5e6  # numbers of bodies that are kept for the next plan, 20 MB


@dataclass(frozen=True)
class Plan:
    """Models, laws, steppers and step of a run."""

    scene: Scene
    method: Method
    acting: Method  # with the laws that act: on a massless face, the reduction of a law
    dt: float | None  # s; None for a run without steps
    steps: int
    built: dict[str, BuiltBody]
    steppers: dict[str, Stepper]
    starts: tuple[Start, ...]
    pushes: tuple[Push, ...]
    integrator: AbstractIntegrator | None
    warnings: tuple[Warned, ...]
    march: adaptive.March | None = None  # of an adaptive run
    # Contact forces at t = 0 [N] by number of the contact, of schemes whose forces act at an instant.
    start_forces: Mapping[int, float] = field(default_factory=dict)

    body_numbers: float = 0.0  # that its bodies take in memory, about

    @property
    def known_bodies(self) -> KnownBodies | None:
        """Its bodies for plans of other scenes; None where they are large.

        Other plans take over those that are the same.
        """
        if not 0 < len(self.built) <= MAX_COMPARED or self.body_numbers > MAX_KEPT:
            return None
        steppers = {} if self.pushes or self.start_forces else self.steppers
        return KnownBodies(self.scene, self.method.models, self.built, self.integrator, self.dt, steppers)

    @cached_property
    def facts(self) -> dict[str, ContactFacts]:
        """Facts of contacts by name, that the checks of its runs have read so far."""
        return {}

    @cached_property
    def own(self) -> frozenset[str]:
        """Names of the bodies that step by themselves."""
        return self_stepping(self.built)

    @cached_property
    def is_stepped(self) -> bool:
        """Whether an integrator steps anything but rigid masses beside bodies that step by themselves."""
        return is_stepped(self.scene, self.own)

    @cached_property
    def energy_bound(self) -> float:
        """Largest energy gain that its parts declare, over the initial energy."""
        assert self.integrator is not None  # noqa: S101 - asked of runs in steps alone
        return energy_bound(self.scene, self.acting, self.integrator, self.own)


def resolve_step(scene: Scene, method: Method, built: dict[str, BuiltBody]) -> float:
    """Return dt [s] by the rule of the method."""
    rule = method.step
    if rule.dt is not None:
        return rule.dt
    if rule.courant is not None:
        transits = []
        for body, model in modelled(scene, method):
            if not model.has_mesh:
                raise CaseError(
                    f"courant needs a mesh, and model {kind_of(model)!r} of '{body.name}' has none",
                    remedy="Give points_per_period or dt, or modal with elements.",
                    path="solve.step",
                )
            transits.append(model.shortest_transit(model.meshed(body, faces_of(scene, body.name))))
        if not transits:
            raise CaseError(
                "courant needs a rod with a mesh", remedy="Give solve.step: {dt: ...} in seconds.", path="solve.step"
            )
        return rule.courant * min(transits)
    highest = max((body.system.rule_frequency for body in built.values()), default=0.0)
    if highest == 0.0:
        text = "no dt is given, and no body has a shortest period from which points_per_period could set the step"
        raise CaseError(text, remedy="Give solve.step: {dt: ...} in seconds.", path="solve.step")
    return 2.0 * math.pi / highest / (rule.points_per_period or 10.0)


def checked_step(dt: float) -> float:
    """Return a step [s]; raise `CaseError` where it is not finite and above 0."""
    if not 0.0 < dt < math.inf:
        raise beyond("the step", "solve.step")
    return dt


def fitted_step(dt: float, built: dict[str, BuiltBody]) -> float:
    """Return the longest step with the least misfit of self-stepping bodies [s].

    If several have the least misfit, it is one that breaks few waves.
    """
    own = [body.model for body in built.values() if isinstance(body.model, AbstractSelfStepping)]
    if not own:
        return dt
    steps = sorted({float(step) for model in own for step in model.fitting(dt)} | {dt}, reverse=True)
    if len(steps) == 1:
        return steps[0]
    misfits = sum((model.misfits(np.array(steps)) for model in own), np.zeros(len(steps)))
    fitting = [steps[each] for each in np.flatnonzero(misfits == misfits.min()).tolist()]
    return min(fitting, key=lambda step: sum(model.broken(step) for model in own))


def misfit_warnings(built: dict[str, BuiltBody], dt: float) -> Iterator[Warned]:
    """Give a warning for each body with places beside the step's grid."""
    for name, body in built.items():
        if isinstance(body.model, AbstractSelfStepping) and (misfit := body.model.misfit(dt)) > MISFIT_WARN:
            text = f"'{name}': to fit the grid of this step, contacts or ends are moved by {100 * misfit:.2g} % "
            yield Warned("misfit", text + "of the length; give a smaller step, or another place")


def is_stepped(scene: Scene, own: Collection[str]) -> bool:
    """Return whether an integrator steps more than rigid masses.

    Bodies in ``own`` step by themselves.
    """
    turning = any(body.changes for body in scene.bodies.values())
    return turning or not scene.elastic or any(name not in own for name in scene.elastic)


def _by_default(scene: Scene, method: Method) -> bool:
    """Return whether the integrator may be the default of a case file."""
    return method.integrator == Newmark() and not all(model.exact for _, model in modelled(scene, method))


def check_yielding(scene: Scene, method: Method, built: dict[str, BuiltBody]) -> None:
    """Raise `CaseError` where a wall meets a face that drives alone move.

    It is raised for laws that need a motion of the faces.
    """
    mechanisms = {name: body.model for name, body in built.items() if isinstance(body.model, MechanismModel)}
    if not mechanisms:
        return
    given = {name for name, model in mechanisms.items() if model.count == len(model.packed.drives)}
    for number, (contact, law) in enumerate(zip(scene.contacts, laws_of(scene, method), strict=True)):
        if not (law.hard or law.moves_faces):
            continue
        followed = [point.body in given or scene.bodies[point.body].is_driven(point.x) for point in contact.faces]
        if any(followed) and all(
            follows or not scene.bodies[point.body].moves
            for follows, point in zip(followed, contact.faces, strict=True)
        ):
            there = "" if any(point.body in given for point in contact.faces) else " from the ground to there"
            raise CaseError(
                f"no force can change the motion of the faces of {contact.name}: all links{there} are "
                f"rigid and follow their drives, and law '{kind_of(law)}' computes its force from a "
                "change of the motion",
                remedy="Give a beam as a link, a mass instead of the wall, or a law of the gap, such as hertz.",
                path=f"contacts.{number}",
            )


def chosen_step(scene: Scene, method: Method, integrator: AbstractIntegrator, built: dict[str, BuiltBody]) -> float:
    """Return the step [s].

    Raise `CaseError` where it is too long for a scheme or a body, or too short for the run.
    """
    limits = {}
    for name, body in built.items():
        if isinstance(body.model, AbstractSelfStepping):
            limits[name] = body.model.longest_step
        elif isinstance(body.model, MechanismModel):
            body.model.check(integrator)
        else:
            check_system(integrator, name, body.system)
            with in_precision(f"the longest stable step of '{name}'", f"bodies.{name}", body.body):
                limits[name] = integrator.limit(body.system)
    with in_precision("the step", "solve.step"):
        dt = fitted_step(checked_step(resolve_step(scene, method, built)), built)
        count = scene.duration / dt
    name = min(limits, key=lambda key: limits[key], default="")
    if name and dt > limits[name] * (1.0 + 1e-9):
        model = built[name].model
        of, others = f"integrator '{kind_of(integrator)}'", ", fewer elements or modes, or integrator newmark"
        if isinstance(model, AbstractSelfStepping):
            if (fault := model.too_long(dt)) is not None:
                raise fault
            of, others = f"model '{kind_of(models_of(scene, method)[name])}'", ""
        raise CaseError(
            f"a step of {dt:.6g} s is beyond the stability limit {limits[name]:.6g} s of {of} for body '{name}'",
            remedy=f"Give dt: {at_most(limits[name])} or less{others}.",
            path="solve.step",
        )
    for name, body in built.items():
        if body.system.highest_frequency * dt > PERIODS_IN_A_STEP:
            raise CaseError(
                f"a step of {dt:.3g} s is {body.system.highest_frequency * dt:.3g} times 1/omega of the highest "
                f"frequency of '{name}'. Allowed: up to {PERIODS_IN_A_STEP:g}",
                remedy="Give a smaller step, or fewer elements or modes.",
                path="solve.step",
            )
    if not count <= MAX_STEPS:
        raise CaseError(
            f"{count:.3g} steps of {dt:.3g} s are too many. Allowed: {MAX_STEPS}",
            remedy="Give a longer step or a shorter duration.",
            path="solve.step",
        )
    return dt


def prepare(scene: Scene, method: Method, known: KnownBodies | None = None) -> Plan:
    """Return the plan of a run; raise `CaseError` or `PairingError` where it cannot start.

    Bodies of a plan that is ``known`` are taken over where they are the same.
    """
    with quietly():
        return _prepared(scene, method, known)


def mechanism_kernels(built: Mapping[str, BuiltBody]) -> Iterator[Kernel]:
    """Give the kernels of the steps of all mechanisms."""
    for _, model, _ in built.values():
        if isinstance(model, MechanismModel):
            yield from kernels_of(model.part)


def _prepared(scene: Scene, method: Method, known: KnownBodies | None) -> Plan:
    if is_exact(scene, method):
        return Plan(scene, method, method, None, 0, {}, {}, (), (), None, exact_run.check(scene, method))
    numbers = check_bodies(scene, method)
    checked = 0
    if method.step.dt is not None and not isinstance(method.integrator, AbstractAdaptive):
        checked = math.ceil(scene.duration / checked_step(method.step.dt) - 1e-9)
        check_records(scene, checked)  # before thousands of bodies are built
    same = {} if known is None else known.same(scene, method)
    built = build_bodies(scene, method, same)
    own = self_stepping(built)
    stepped = is_stepped(scene, own)
    if isinstance(method.integrator, AbstractAdaptive) and stepped:
        return replace(prepare_adaptive(scene, method, method.integrator, built), body_numbers=numbers)
    given = method.integrator
    integrator: AbstractIntegrator = given if isinstance(given, AbstractIntegrator) else Newmark()
    warnings = []
    if not stepped:
        # Only rigid masses are left to an integrator, and their motion under a constant force is known.
        if given is not None and not _by_default(scene, method):
            warnings.append(exact_run.UNUSED)
        integrator = ExactModal()
    check_pairs(scene, method, integrator, own)
    check_yielding(scene, method, built)
    dt = chosen_step(scene, method, integrator, built)
    steps = math.ceil(scene.duration / dt - 1e-9)
    waves = sum(len(body.model.sent()) for body in built.values() if isinstance(body.model, DelayChain))
    if waves or steps != checked:
        check_records(scene, steps, waves)
    impulses = any(law.needs & {Level.IMPULSE, Level.CLOSING} for law in method.laws.values())
    with ahead(lambda: mechanism_kernels(built)):
        kept = {} if known is None else known.same_steppers(same, integrator, dt)
        steppers = prepare_steppers(scene, built, integrator, dt, impulses=impulses, same=kept)
    unknowns = {name: body.system.load.size for name, body in built.items()}
    state = sum(stepper.state.size for stepper in steppers.values())
    shown = state if integrator.velocity_point == 1.0 else 2 * state  # velocities have snapshots of their own
    check_fields(scene, shown, unknowns)
    scene = with_room(scene, shown)
    acting, starts = _started(scene, method, built, steppers, integrator, dt)
    warnings += [*check_messengers(scene, built, starts), *check_step_of_face(scene, method, built, steppers, starts)]
    pushes = pushes_of(scene, built, starts)
    check_closed(scene, laws_of(scene, acting), built, starts, pushes, integrator, dt)
    warnings += check_faces(scene, acting.laws, built, steppers, integrator, dt)
    start_forces: dict[int, float] = {}
    if integrator.load_point != 0.5:
        start_forces = forces_at_start(scene, laws_of(scene, acting), starts, built, dt)
    if pushes or start_forces:
        steppers = prepare_steppers(scene, built, integrator, dt, pushes, impulses, start_forces)
    warnings += [*constraint_warnings(scene, acting, integrator, own), *misfit_warnings(built, dt)]
    warnings += [*probes.warnings(scene, built), *ends.short_loads(scene, dt)]
    warnings += sawtooth.warnings(scene, acting, integrator, built, dt)
    parts = scene, method, acting, dt, max(steps, 1), built, steppers, starts, pushes, integrator, tuple(warnings)
    return Plan(*parts, start_forces=start_forces, body_numbers=numbers)


def _started(
    scene: Scene,
    method: Method,
    built: Mapping[str, BuiltBody],
    steppers: Mapping[str, Stepper],
    integrator: AbstractIntegrator,
    dt: float,
) -> tuple[Method, tuple[Start, ...]]:
    """Return the method with acting laws, and how these start by contact.

    Acting laws may replace those given.
    """
    laws, found = {}, []
    alike: dict[tuple[int, ...], tuple[AbstractContactLaw, Start]] = {}  # contacts of like beads under one law
    for number, contact in enumerate(scene.contacts):
        path, given = f"contacts.{number}.law", method.laws[contact.name]
        own_steppers = (id(steppers[point.body]) for point in contact.faces)
        key = (*own_steppers, *scene.places[number], id(given))
        if key in alike:
            laws[contact.name], start = alike[key]
            found.append(start)
            continue
        with placed_at(f"contacts.{number}"):
            facts = facts_of(scene, method, built, steppers, number)
        with placed_at(path):
            law = laws[contact.name] = given.acting(*facts)
        if integrator.load_point == 0.0:
            highest = max(built[face.body].system.highest_frequency for face in contact.faces)
            check_explicit_spring(law, facts, dt, highest, path)
        found.append(start_law(law, facts, contact.name, path, dt))
        alike[key] = law, found[-1]
    as_given = len(laws) == len(method.laws) and all(law is method.laws[name] for name, law in laws.items())
    return method if as_given else replace(method, laws=laws), tuple(found)


def prepare_adaptive(
    scene: Scene, method: Method, integrator: AbstractAdaptive, unordered: dict[str, BuiltBody]
) -> Plan:
    """Return the plan of an adaptive run; a given step is its longest."""
    check_smooth(scene, method, integrator, self_stepping(unordered))
    check_records(scene, scene.records)
    built = {name: unordered[name] for name in scene.in_order}
    for name, body in built.items():
        check_ordinary(integrator, name, body.system)
    unknowns = {name: body.system.load.size for name, body in built.items()}
    check_fields(scene, 2 * sum(unknowns.values()), unknowns)
    scene = with_room(scene, 2 * sum(unknowns.values()))
    given = method.step.dt is not None or method.step.courant is not None
    with in_precision("the system of equations", "solve.integrator"):
        march = adaptive.March(
            system.System(scene, method, built), integrator, resolve_step(scene, method, built) if given else None
        )
    return Plan(scene, method, method, None, 0, built, {}, (), (), None, (), march)
