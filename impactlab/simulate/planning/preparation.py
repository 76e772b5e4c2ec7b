"""Preparation of a run: bodies in coordinates, steppers, constants and readings of laws."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType, TracebackType
from typing import Any, NamedTuple

import numpy as np

from impactlab.contact.base import AbstractContactLaw
from impactlab.errors import CaseError, ImpactlabError, PairingError, StepError, raised_at
from impactlab.integrators.base import AbstractIntegrator
from impactlab.mechanisms.model import MechanismModel
from impactlab.models.base import AbstractDiscreteModel, Face, Operators, Phases
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.plugins import kind_of
from impactlab.printing import at_most
from impactlab.scene.bodies import Body
from impactlab.scene.facts import facts_at
from impactlab.scene.method import Method, side_facts
from impactlab.scene.precision import beyond, check_finite, in_precision
from impactlab.scene.problem import Contact, Point, Scene
from impactlab.simulate.planning.building import build_body
from impactlab.simulate.planning.model_shapes import check_operators, checked_row
from impactlab.stepper import Stepper
from impactlab.types import MEMORY, PARAMETERS, READINGS, Array, Arriving, Quantity, Reading, SideFacts, Start


class BuiltBody(NamedTuple):
    """A body of the scene with its coordinates."""

    body: Body
    model: AbstractDiscreteModel
    system: Operators


Facts = tuple[SideFacts, SideFacts]  # of both sides of a contact
SPRING_SHARE = 0.5  # of the stability limit with a closed contact spring: at 0.7 of it touches added 6 % of energy
FAULT_OF_LAW = "This is a fault of the law."  # remedy where it raised
MAX_MISSING_FORCE = 0.1  # of a static contact force, in a basis at a face whose internal force a law uses
NOTHING: Mapping[Any, Any] = MappingProxyType({})


class Push(NamedTuple):
    """A row of one body along which a contact may push it."""

    contact: int
    body: str
    x: float  # m
    quantity: Quantity
    weight: float


def build_bodies(scene: Scene, method: Method, same: Mapping[str, BuiltBody] = NOTHING) -> dict[str, BuiltBody]:
    """Return every body in its coordinates; raises `CaseError` where a model does not support one.

    Those that are the ``same`` as in a scene before are taken as they are.
    """
    built: dict[str, BuiltBody] = {}
    rigid: dict[tuple[float, float, bool], BuiltBody] = {}  # masses of a chain are mostly alike
    for name, body in scene.bodies.items():
        if name in same:
            built[name] = same[name]
            continue
        alike = (body.rigid_mass, body.velocity, body.moves) if _is_plain(body) else None
        if alike in rigid:
            built[name] = rigid[alike]._replace(body=body)
            continue
        with in_precision(f"the description of '{name}'", f"bodies.{name}", body):
            model = build_body(body, method.models, scene.gravity, faces_of(scene, name)).for_run(scene.duration)
            if isinstance(model, AbstractSelfStepping):
                probes = tuple(probe for probe in (*scene.probes, *scene.loaded_ends) if probe.body == name)
                model = model.recorded(probes, scene.duration, bool(scene.field_times))
        with in_precision(f"the matrices of '{name}'", f"bodies.{name}", body):
            built[name] = BuiltBody(body, model, model.operators())
        system = built[name].system
        check_operators(name, system)
        matrices = system.mass, system.damping, system.stiffness, system.load, system.displacement, system.velocity
        check_finite(f"the matrices of '{name}'", f"bodies.{name}", body, *matrices)
        if not math.isfinite(system.highest_frequency + system.rule_frequency):
            raise beyond(f"the highest frequency of '{name}'", f"bodies.{name}", body)
        if alike is not None:
            rigid[alike] = built[name]
    return built


def _is_plain(body: Body) -> bool:
    """Return whether mass and velocity alone describe a body.

    Such a body is rigid and moves along one line.
    """
    return body.elastic is None and not body.changes and body.rotation is None and not body.loads


def self_stepping(built: Mapping[str, BuiltBody]) -> frozenset[str]:
    """Return the names of the bodies that step by themselves."""
    return frozenset(name for name, body in built.items() if isinstance(body.model, AbstractSelfStepping))


def faces_of(scene: Scene, body: str) -> tuple[Face, ...]:
    """Return the faces of a body: places and partners, contact by contact."""
    faces = []
    for number, side in scene.touching.get(body, ()):
        pair = scene.contacts[number].left, scene.contacts[number].right
        faces.append(Face(pair[side].x, number, scene.bodies[pair[1 - side].body].rigid_mass))
    return tuple(faces)


def prepare_steppers(
    scene: Scene,
    built: Mapping[str, BuiltBody],
    integrator: AbstractIntegrator,
    dt: float,
    pushes: Sequence[Push] = (),
    impulses: bool = True,
    start_forces: Mapping[int, float] = NOTHING,
    same: Mapping[str, Stepper] = NOTHING,
) -> dict[str, Stepper]:
    """Return the steppers of bodies.

    Their ports are faces in the order of the contacts, pushed rows, loads over time. Without ``impulses`` their columns
    in a mechanism stay those at t = 0. ``start_forces`` are contact forces at t = 0 [N], by the number of the contact.
    Steppers that are the ``same`` as in a scene before are taken as they are.
    """
    points = [contact.faces for contact in scene.contacts]
    pushed: dict[str, list[Push]] = {}
    for push in pushes:
        pushed.setdefault(push.body, []).append(push)
    steppers: dict[str, Stepper] = {}
    rigid: dict[tuple[int, int, float], Stepper] = {}  # by description, number of faces, which are all alike, and force
    for name, (body, model, system) in built.items():
        if name in same:
            steppers[name] = same[name]
            continue
        touching = scene.touching.get(name, ())
        held = (
            [start_forces.get(number, 0.0) * (1.0 if side else -1.0) for number, side in touching]
            if start_forces
            else []
        )
        alike = (id(system), len(touching), sum(held)) if _is_plain(body) else None
        if alike in rigid and name not in pushed:
            steppers[name] = rigid[alike]
            continue
        rows = [model.row(points[number][side].x, "displacement") for number, side in touching]
        rows += [model.row(push.x, push.quantity) for push in pushed.get(name, ())]
        of_loads = [model.row(x, "displacement") for x, _ in body.loads]
        n_dof = system.load.size
        ports = np.array([checked_row(name, row, n_dof) for row in rows + of_loads])
        ports = ports.reshape(len(rows) + len(of_loads), n_dof)
        subject, path = f"the steps of '{name}'", f"bodies.{name}"
        with in_precision(subject, path, body):
            if isinstance(model, MechanismModel):
                stepper = model.stepper(ports, dt, impulses)
            elif isinstance(model, AbstractSelfStepping):
                stepper = model.stepper(ports, dt)
            else:
                forces = [
                    float(load.at(np.zeros(1))[0]) * row for (_, load), row in zip(body.loads, of_loads, strict=True)
                ]
                forces += [force * row for force, row in zip(held, rows, strict=False) if force != 0.0]
                stepper = _stepper(name, integrator, system, model, ports, dt, forces)
        checked = stepper.parameters, stepper.state, stepper.force_response, stepper.impulse_response
        check_finite(subject, path, body, *checked)
        steppers[name] = stepper
        if alike is not None and name not in pushed:
            rigid[alike] = stepper
    return steppers


def _stepper(
    name: str,
    integrator: AbstractIntegrator,
    system: Operators,
    model: AbstractDiscreteModel,
    ports: Array,
    dt: float,
    forces: Sequence[Array],
) -> Stepper:
    """Return the stepper of a body with matrices.

    ``forces`` act on its coordinates at t = 0.
    """
    at_start = sum(forces, np.zeros(system.load.size)) if forces else None
    if system.momentum is None:
        system = system._replace(momentum=checked_row(name, model.momentum_row(), system.load.size, "momentum_row"))
    return integrator.prepare(system, ports, dt, at_start)


class placed_at(in_precision):  # noqa: N801 - used as `with placed_at(...)`
    """Errors of a law with the path of its contact.

    The path stands in front of the field that they name.
    """

    __slots__ = ("at",)

    def __init__(self, path: str) -> None:
        super().__init__("the contact", "")
        self.at = path

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            super().__exit__(kind, error, trace)
            return
        try:
            super().__exit__(kind, error, trace)
        except CaseError as lost:  # of digits
            lost.path = self.at
            raise
        if isinstance(error, (PairingError, CaseError)):
            if not error.path:
                error.path = self.at
            elif not error.path.startswith(("solve", "bodies", "contacts")):
                error.path = f"{self.at}.{error.path}"


def check_explicit_spring(law: AbstractContactLaw, facts: Facts, dt: float, highest: float, path: str) -> None:
    """Raise `CaseError` where a contact spring is too stiff for explicit steps.

    The force acts at the start of the step. Two bodies and the spring between them swing with w^2 = k (compliances of
    both faces); leapfrog is stable up to w dt = 2. With the frequencies of the bodies, up to ``highest`` [rad/s], the
    squares add at most. The remedy is a share of the limit of both, as touches inside a step add energy near it.
    """
    with placed_at(path):
        stiffness = law.stiffest(*facts, dt)
    compliance = dt * (facts[0].velocity_per_force + facts[1].velocity_per_force)
    if not math.isfinite(stiffness * compliance):
        raise beyond("the contact", path)
    if stiffness * compliance > 4.0:
        stable = SPRING_SHARE * dt * 2.0 / math.sqrt(stiffness * compliance + (highest * dt) ** 2)
        raise CaseError(
            f"the contact spring of {stiffness:.6g} N/m is too stiff for an explicit step of {dt:.6g} s between "
            f"these faces; the limit is {4.0 / compliance:.6g} N/m",
            remedy=f"Give a step of {at_most(stable)} s or less, or integrator newmark.",
            path=path,
        )


def facts_of(
    scene: Scene, method: Method, built: Mapping[str, BuiltBody], steppers: Mapping[str, Stepper], number: int
) -> Facts:
    """Return the facts of both sides of a contact.

    Without a stepper a face has no velocity per force.
    """
    found = []
    for point, port in zip(scene.contacts[number].faces, scene.places[number], strict=True):
        body, moved = built[point.body], math.nan
        if stepper := steppers.get(point.body):
            n_dof = stepper.jump.shape[1]
            moved = float(stepper.force_response[port, n_dof : 2 * n_dof].dot(stepper.face_rows[port]))
        with in_precision(f"the static compliance of '{point.body}'", f"bodies.{point.body}", body.body):
            left_out = body.model.left_out(point.x, "displacement", point.x)
            massless = body.system.massless
            flexibility = dict(massless).get(point.x, 0.0) if massless else 0.0
            facts = side_facts(scene, method, point, moved, flexibility=flexibility, left_out=left_out)
            found.append(facts._replace(in_waves=isinstance(body.model, AbstractSelfStepping)))
    return found[0], found[1]


def start_law(law: AbstractContactLaw, facts: Facts, contact: str, path: str, dt: float) -> Start:
    """Return constants, memory and readings of a law, for the contact of a name.

    Raise `PairingError` where they exceed the room of a port, `StepError` where the law raised.
    """
    try:
        with placed_at(path):
            start = law.begin(*facts, dt)
    except ImpactlabError:
        raise
    except Exception as raised:
        text = f"{law_raised(law, contact, raised)}, in begin"
        raise StepError(text, time=0.0, step=0, remedy=FAULT_OF_LAW, path=path) from raised
    if fault := fault_of_start(start):
        remedy = "This is a fault of the law, not of the case: fix its `begin`."
        raise PairingError(fault, remedy=remedy, path=path)
    return start


def fault_of_start(start: Start) -> str:
    """Return why a law's constants, memory or readings do not fit.

    They are kept in a port; the text is empty if they fit.
    """
    if not isinstance(start, Start):
        return f"the `begin` of the law returned {str(start)[:40]}, and must return a Start(...)"
    for name, given, room in (
        ("parameters", start.parameters, PARAMETERS),
        ("numbers of memory", start.memory, MEMORY),
        ("readings", start.readings, READINGS),
    ):
        if len(given) > room:
            return f"the law has {len(given)} {name}. Allowed: up to {room}"
    return ""


def law_raised(law: AbstractContactLaw, contact: str, raised: BaseException) -> str:
    """Return in words that the law of a contact raised."""
    return f"law '{kind_of(law)}' of contact {contact} raised {raised_at(raised)}"


def face_read(contact: Contact, reading: Reading | Arriving) -> Point:
    """Return the face that a reading belongs to."""
    return contact.left if reading.side == "left" else contact.right


def reading_place(contact: Contact, reading: Reading) -> tuple[Point, float]:
    """Return the face of a reading, and its position x [m]."""
    point = face_read(contact, reading)
    return point, point.x + (-reading.distance if reading.side == "left" else reading.distance)


def pushes_of(scene: Scene, built: Mapping[str, BuiltBody], starts: Sequence[Start]) -> tuple[Push, ...]:
    """Return the rows that laws push along.

    Raises `PairingError` where one is zero, or its force is not that of the contact.
    """
    pushes = []
    for number, (contact, start) in enumerate(zip(scene.contacts, starts, strict=True)):
        for reading, weight in start.pushed:
            point, x = reading_place(contact, reading)
            _check_pushed(scene, built[point.body].model, point, x, reading.quantity, f"contacts.{number}.law")
            pushes.append(Push(number, point.body, x, reading.quantity, weight))
    return tuple(pushes)


def _check_pushed(
    scene: Scene, model: AbstractDiscreteModel, point: Point, x: float, quantity: Quantity, path: str
) -> None:
    """Raise `PairingError` where a law cannot push along a row.

    The row is zero, or its force is not that of the contact.
    """
    text, remedy = "", "Use finite_element, or modal with basis craig_bampton."
    left_out = abs(model.left_out(x, quantity, point.x))
    largest = np.abs(model.row(0.5 * scene.bodies[point.body].length, quantity)).max(initial=0.0)
    end = facts_at(scene, point, math.nan).end if quantity == "force" else ""
    if end in ("force", "inner"):
        other = "another force acts at" if end == "force" else "the rod goes on beyond the inner point"
        text = f"the law takes the internal force at the face for the contact force, and {other} {point.label}"
        remedy = "Use addition_deletion or penalty."
    elif np.abs(model.row(x, quantity)).max(initial=0.0) <= 1e-9 * largest:
        text = f"the law uses the {quantity} at the face, which is zero in all coordinates of '{point.body}'"
    elif quantity == "force" and left_out > MAX_MISSING_FORCE:
        text = (
            f"the law uses the force at the face, and the modes of '{point.body}' have only "
            f"{100.0 * (1.0 - left_out):.3g} % of it"
        )
    if text:
        raise PairingError(text, remedy=remedy, path=path)


def check_phases(phased: Mapping[str, Phases], built: Mapping[str, BuiltBody], steppers: Mapping[str, Stepper]) -> None:
    """Raise `PairingError` where a scheme or a body cannot change its coordinates within a run."""
    for name in phased:
        stepper, system = steppers[name], built[name].system
        if np.any(system.damping):
            raise PairingError(
                f"'{name}' changes its coordinates with its contact, which is possible only for undamped bodies",
                remedy="Leave the damping out, or use another basis.",
                path="solve.model",
            )
        if stepper.state.size > 3 * system.load.size:
            raise PairingError(
                f"'{name}' changes its coordinates with its contact, and the state of this integrator is "
                "more than displacements and velocities",
                remedy="Use newmark, midpoint or exact_modal.",
                path="solve.integrator",
            )


def left_out_per_force(
    model: AbstractDiscreteModel, contact: Contact, body: str, x: float, quantity: Quantity
) -> float:
    """Return a contact's static response at x by the modes left out.

    It is per unit force.
    """
    total = 0.0
    for point, sign in ((contact.left, -1.0), (contact.right, 1.0)):
        if point.body == body:
            total += sign * model.left_out(x, quantity, point.x)
    return total
