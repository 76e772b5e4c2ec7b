"""Before the first step: bodies in coordinates, their steppers, and what each law asks for."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from impactlab.contact.base import AbstractContactLaw
from impactlab.errors import CaseError, PairingError
from impactlab.integrators.base import AbstractIntegrator, Stepper
from impactlab.models.base import AbstractDiscreteModel, Face, Operators
from impactlab.models.building import build_body
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.scene.bodies import Body
from impactlab.scene.facts import facts_at
from impactlab.scene.method import Method, side_facts
from impactlab.scene.precision import beyond, check_finite, in_precision
from impactlab.scene.problem import Contact, Point, Scene
from impactlab.types import MEMORY, PARAMETERS, READINGS, Arriving, Quantity, Reading, SideFacts, Start


@dataclass(frozen=True)
class BuiltBody:
    """A body of the scene with its coordinates."""

    body: Body
    model: AbstractDiscreteModel
    system: Operators


Facts = tuple[tuple[SideFacts, SideFacts], ...]  # of both sides of each contact
TOLD = 0.1  # share of a static contact force that a basis may miss at the face where a law works with it


class Push(NamedTuple):
    """A row of one body along which a contact may push it."""

    contact: int
    body: str
    x: float  # m
    quantity: Quantity
    weight: float


def build_bodies(scene: Scene, method: Method) -> dict[str, BuiltBody]:
    """Return every body in its coordinates; raises `CaseError` where a model cannot serve one."""
    built = {}
    for name, body in scene.bodies.items():
        with in_precision(f"the description of '{name}'", f"bodies.{name}", body):
            model = build_body(body, method.models.get(name), scene.gravity, faces_of(scene, name))
            if isinstance(model, AbstractSelfStepping):
                probes = tuple(probe for probe in (*scene.probes, *scene.loaded_ends) if probe.body == name)
                model = model.recorded(probes, scene.duration, bool(scene.snapshots))
        with in_precision(f"the matrices of '{name}'", f"bodies.{name}", body):
            built[name] = BuiltBody(body, model, model.operators())
        system = built[name].system
        matrices = system.mass, system.damping, system.stiffness, system.load, system.displacement, system.velocity
        check_finite(f"the matrices of '{name}'", f"bodies.{name}", body, *matrices)
        frequencies = np.array([system.highest_frequency, system.rule_frequency])
        check_finite(f"the highest frequency of '{name}'", f"bodies.{name}", body, frequencies)
    return built


def self_stepping(built: dict[str, BuiltBody]) -> frozenset[str]:
    """Return the names of the bodies that step by themselves."""
    return frozenset(name for name, body in built.items() if isinstance(body.model, AbstractSelfStepping))


def faces_of(scene: Scene, body: str) -> tuple[Face, ...]:
    """Return where a body is struck and by what, contact by contact."""
    faces = []
    for number, contact in enumerate(scene.contacts):
        for point, other in ((contact.left, contact.right), (contact.right, contact.left)):
            if point.body == body:
                faces.append(Face(point.x, number, scene.bodies[other.body].rigid_mass))
    return tuple(faces)


def prepare_steppers(
    scene: Scene,
    built: dict[str, BuiltBody],
    integrator: AbstractIntegrator,
    dt: float,
    pushes: tuple[Push, ...] = (),
) -> dict[str, Stepper]:
    """Return the stepper of every body, its ports as `prepare_stepper` orders them."""
    return {
        name: prepare_stepper(scene, name, body.model, body.system, integrator, dt, pushes)
        for name, body in built.items()
    }


def prepare_stepper(
    scene: Scene,
    name: str,
    model: AbstractDiscreteModel,
    system: Operators,
    integrator: AbstractIntegrator,
    dt: float,
    pushes: tuple[Push, ...],
) -> Stepper:
    """Return the stepper of one body; its ports are its faces in the order of the contacts, then its pushed rows."""
    points = [point for contact in scene.contacts for point in (contact.left, contact.right)]
    rows = [model.row(point.x, "displacement") for point in points if point.body == name]
    rows += [model.row(push.x, push.quantity) for push in pushes if push.body == name]
    ports = np.array(rows).reshape(len(rows), system.load.size)
    what, path, body = f"the steps of '{name}'", f"bodies.{name}", scene.bodies[name]
    with in_precision(what, path, body):
        if isinstance(model, AbstractSelfStepping):
            stepper = model.stepper(ports, dt)
        else:
            stepper = integrator.prepare(system._replace(momentum=model.momentum_row()), ports, dt)
    check_finite(what, path, body, stepper.parameters, stepper.state, stepper.force_response, stepper.impulse_response)
    return stepper


def face_velocity_per_force(scene: Scene, steppers: dict[str, Stepper], number: int, side: int) -> float:
    """Return how fast a face (0 left, 1 right of a contact) moves after a step per unit force [m/(N s)]."""
    points = [point for contact in scene.contacts for point in (contact.left, contact.right)]
    body = points[2 * number + side].body
    place = sum(other.body == body for other in points[: 2 * number + side])
    stepper = steppers[body]
    n_dof = stepper.jump.shape[1]
    return float(stepper.force_response[place, n_dof : 2 * n_dof] @ stepper.face_rows[place])


@contextmanager
def placed_at(path: str) -> Iterator[None]:
    """Give the errors of a law the path of its contact, in front of the field that they name."""
    try:
        with in_precision("the contact", ""):
            yield
    except (PairingError, CaseError) as error:
        if not error.path:
            error.path = path
        elif not error.path.startswith(("solve", "bodies", "contacts")):
            error.path = f"{path}.{error.path}"
        raise


def check_explicit_spring(
    scene: Scene,
    laws: Sequence[AbstractContactLaw],
    facts: Facts,
    steppers: dict[str, Stepper],
    integrator: AbstractIntegrator,
    dt: float,
) -> None:
    """Raise `CaseError` where a contact spring is too stiff for a force that acts at the start of the step.

    Two bodies and the spring between them swing with w^2 = k (yields of both faces); leapfrog is stable up to w dt = 2.
    """
    if integrator.load_point > 0.0:
        return
    for number, law in enumerate(laws):
        with placed_at(f"contacts.{number}.law"):
            stiffness = law.stiffest(*facts[number], dt)
        pliancy = dt * sum(face_velocity_per_force(scene, steppers, number, side) for side in (0, 1))
        if not math.isfinite(stiffness * pliancy):
            raise beyond("the contact", f"contacts.{number}.law")
        if stiffness * pliancy > 4.0:
            stable = dt * 2.0 / math.sqrt(stiffness * pliancy)
            raise CaseError(
                f"the contact spring of {stiffness:.6g} N/m is too stiff for an explicit step of {dt:.6g} s between "
                f"these faces; the limit is {4.0 / pliancy:.6g} N/m",
                remedy=f"Give a step of {stable:.6g} s or less, or integrator newmark.",
                path=f"contacts.{number}.law",
            )


def facts_of(scene: Scene, method: Method, built: dict[str, BuiltBody], steppers: dict[str, Stepper]) -> Facts:
    """Return what the law of each contact may know of its two sides."""
    found = []
    for number in range(len(scene.contacts)):
        with placed_at(f"contacts.{number}"):
            found.append(_facts(scene, method, built, steppers, number))
    return tuple(found)


def _facts(
    scene: Scene, method: Method, built: dict[str, BuiltBody], steppers: dict[str, Stepper], number: int
) -> tuple[SideFacts, SideFacts]:
    contact = scene.contacts[number]
    facts = []
    for side, point in enumerate((contact.left, contact.right)):
        body = built[point.body]
        with in_precision(f"the static compliance of '{point.body}'", f"bodies.{point.body}", body.body):
            known = side_facts(scene, method, point, face_velocity_per_force(scene, steppers, number, side))
            facts.append(
                known._replace(
                    flexibility=dict(body.system.massless).get(point.x, 0.0),
                    left_out=body.model.left_out(point.x, "displacement", point.x),
                )
            )
    return facts[0], facts[1]


def acting_laws(laws: Sequence[AbstractContactLaw], facts: Facts) -> tuple[AbstractContactLaw, ...]:
    """Return the laws that act on the faces of the contacts, massless or not."""
    acting = []
    for number, (law, known) in enumerate(zip(laws, facts, strict=True)):
        with placed_at(f"contacts.{number}.law"):
            acting.append(law.acting(*known))
    return tuple(acting)


def start_laws(laws: Sequence[AbstractContactLaw], facts: Facts, dt: float) -> tuple[Start, ...]:
    """Return what the law of each contact asks for; errors name the contact."""
    return tuple(start_law(law, facts[number], f"contacts.{number}.law", dt) for number, law in enumerate(laws))


def start_law(law: AbstractContactLaw, facts: tuple[SideFacts, SideFacts], path: str, dt: float) -> Start:
    """Return what one law asks for; raise `PairingError` where it cannot serve the sides or asks for too much."""
    for given in facts:
        if given.flexibility > 0.0 and not law.serves_massless:
            raise PairingError(
                f"this law cannot press on a massless face, and the {given.kind} has one",
                remedy="Use addition_deletion, or a model whose faces have mass.",
                path=path,
            )
    with placed_at(path):
        start = law.begin(facts[0], facts[1], dt)
    for what, asked, room in (
        ("parameters", start.parameters, PARAMETERS),
        ("memory", start.memory, MEMORY),
        ("readings", start.readings, READINGS),
    ):
        if len(asked) > room:
            raise PairingError(
                f"the law asks for {len(asked)} {what}; there is room for {room}",
                remedy="This is a fault of the law, not of the case: it must keep to the room.",
                path=path,
            )
    return start


def face_read(contact: Contact, reading: Reading | Arriving) -> Point:
    """Return the face that a reading belongs to."""
    return contact.left if reading.side == "left" else contact.right


def reading_place(contact: Contact, reading: Reading) -> tuple[Point, float]:
    """Return the face that a reading belongs to, and the x at which it is taken [m]."""
    point = face_read(contact, reading)
    return point, point.x + (-reading.distance if reading.side == "left" else reading.distance)


def pushes_of(scene: Scene, built: dict[str, BuiltBody], starts: tuple[Start, ...]) -> tuple[Push, ...]:
    """Return the rows that laws may push along; a row that is zero is refused, for it would do nothing unseen."""
    pushes = []
    for number, (contact, start) in enumerate(zip(scene.contacts, starts, strict=True)):
        for reading, weight in start.pushed:
            point, x = reading_place(contact, reading)
            body, model = scene.bodies[point.body], built[point.body].model
            if reading.quantity == "force" and facts_at(scene, point, math.nan).end == "force":
                raise PairingError(
                    f"the law takes the force at the face for that of the contact, and at {point.label} another acts",
                    remedy="Use addition_deletion or penalty.",
                    path=f"contacts.{number}.law",
                )
            middle = model.row(0.5 * body.length, reading.quantity)
            if np.abs(model.row(x, reading.quantity)).max(initial=0.0) <= 1e-9 * np.abs(middle).max(initial=0.0):
                raise PairingError(
                    f"the law works with the {reading.quantity} at the face, and in every coordinate of "
                    f"'{point.body}' it is zero there",
                    remedy="Use finite_element, or modal with basis craig_bampton.",
                    path=f"contacts.{number}.law",
                )
            left_out = abs(model.left_out(x, reading.quantity, point.x))
            if reading.quantity == "force" and left_out > TOLD:
                raise PairingError(
                    f"the law works with the force at the face, and the modes kept of '{point.body}' tell only "
                    f"{100.0 * (1.0 - left_out):.3g} % of it",
                    remedy="Use finite_element, or modal with basis craig_bampton.",
                    path=f"contacts.{number}.law",
                )
            pushes.append(Push(number, point.body, x, reading.quantity, weight))
    return tuple(pushes)
