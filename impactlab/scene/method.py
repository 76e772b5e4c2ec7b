"""The method of a scene: models, laws, integrator, step and events, or a tolerance.

Models are given by body, laws by contact.

A `Method` holds nothing physical but the laws: a scene and a method together are a run. The functions here return facts
of the two together.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from impactlab.contact.base import AbstractContactLaw
from impactlab.integrators.base import AbstractScheme
from impactlab.models.base import AbstractRodModel
from impactlab.scene.bodies import ElasticBody
from impactlab.scene.facts import facts_at
from impactlab.scene.problem import Contact, Point, Scene
from impactlab.types import Relative, SideFacts

ELEMENTS = 100  # elements of a body that has no model, as under a tolerance: the scale of a relative stiffness
Counted = Literal["displacements", "impulses", "peak_forces"]
COUNTED: tuple[Counted, ...] = ("displacements", "impulses", "peak_forces")
"""Quantities whose largest relative error counts against a tolerance."""


@dataclass(frozen=True)
class StepRule:
    """How the step is chosen: by exactly one of the three."""

    points_per_period: float | None = None  # steps in the shortest period of the method
    dt: float | None = None  # s
    courant: float | None = None  # c dt/h


@dataclass(frozen=True)
class Tolerance:
    """A relative error that a run may have; models and step are then chosen automatically."""

    error: float
    on: tuple[Counted, ...] = COUNTED  # the quantities whose errors it bounds


@dataclass(frozen=True)
class Method:
    """How a scene is solved; under a tolerance, only laws are known before the choice."""

    laws: Mapping[str, AbstractContactLaw] = field(default_factory=dict)  # by name of the contact
    models: Mapping[str, AbstractRodModel] = field(default_factory=dict)  # by name of the rod or beam
    integrator: AbstractScheme | None = None
    step: StepRule = StepRule()
    events: Literal["dated", "located"] = "dated"
    tolerance: Tolerance | None = None

    @property
    def links(self) -> tuple[str, ...]:
        """Names of the contacts whose law acts in both directions: they are joined from the start."""
        return tuple(name for name, law in self.laws.items() if law.two_sided)


class Simulation(NamedTuple):
    """A scene and the method that solves it: together, all that a run needs."""

    scene: Scene
    method: Method

    def but(
        self, *, model: AbstractRodModel | None = None, law: AbstractContactLaw | None = None, **changes: Any
    ) -> Simulation:
        """Return the pair with one model, one law, or other fields of either."""
        if model is not None:
            parts = [name for body in self.scene.bodies.values() for name in body.modelled_parts]
            changes["models"] = dict.fromkeys([*self.scene.elastic, *parts], model)
        if law is not None:
            changes["laws"] = {contact.name: law for contact in self.scene.contacts}
        of_method = {field.name for field in dataclasses.fields(Method)} & set(changes)
        method = dataclasses.replace(self.method, **{name: changes.pop(name) for name in of_method})
        # The same scene keeps all that was found of it.
        same = all(getattr(self.scene, name) == value for name, value in changes.items())
        return Simulation(self.scene if same else dataclasses.replace(self.scene, **changes), method)


def laws_of(scene: Scene, method: Method) -> list[AbstractContactLaw]:
    """Return the laws of the contacts of a scene, in their order."""
    return [method.laws[contact.name] for contact in scene.contacts]


def modelled(scene: Scene, method: Method) -> list[tuple[ElasticBody, AbstractRodModel]]:
    """Return the rods and beams that have a model, each with its own."""
    return [(body, method.models[name]) for name, body in scene.elastic.items() if name in method.models]


def models_of(scene: Scene, method: Method) -> dict[str, AbstractRodModel]:
    """Return the models of rods, beams and flexible links by name."""
    parts = [name for body in scene.bodies.values() for name in body.modelled_parts]
    own = {body.name: model for body, model in modelled(scene, method)}
    return own | {name: method.models[name] for name in parts if name in method.models}


def force_jumps(scene: Scene, method: Method) -> bool:
    """Return whether a contact force may jump, by its law or as a front arrives."""
    return scene.fronts_at_start or any(law.force_jumps for law in laws_of(scene, method))


def is_exact(scene: Scene, method: Method) -> bool:
    """Return whether the exact solver supports all rods and all laws.

    Rods must be continuous, and laws hard, constant springs or linear between changes of branch. Where a law has
    branches, a given step selects a stepped delay line.
    """
    models = [method.models.get(name) for name, body in scene.elastic.items() if body.waves is not None]
    if any(body.changes for body in scene.bodies.values()):
        return False
    continuous = len(models) == len(scene.elastic) > 0 and all(model is not None and model.exact for model in models)
    if not continuous:
        return False
    laws = laws_of(scene, method)
    branched = method.step.dt is None and any(law.branches() is not None for law in laws)
    return all(
        (law.hard and law.answers_force) or law.is_spring or (branched and law.branches() is not None) for law in laws
    )


def theories(scene: Scene, method: Method) -> tuple[str, ...]:
    """Return the theory of waves that the model of each rod or beam declares.

    "" where it is that of the body.
    """
    return tuple(method.models[name].theory if name in method.models else "" for name in scene.elastic)


def side_facts(
    scene: Scene,
    method: Method,
    point: Point,
    velocity_per_force: float = math.nan,
    left_out: float = 0.0,
    flexibility: float = 0.0,
) -> SideFacts:
    """Return the facts of one side of a contact, by the model's elements.

    The last three arguments are those of a body that is built.
    """
    body, length = scene.bodies[point.body].elastic, math.nan
    if body is not None:
        model = method.models.get(body.name)
        length = body.length / ELEMENTS if model is None else model.element_length(body)
    return facts_at(scene, point, length, velocity_per_force, left_out, flexibility)


def sides(scene: Scene, method: Method, contact: Contact) -> tuple[SideFacts, SideFacts]:
    """Return the facts of the left and the right side of a contact."""
    return side_facts(scene, method, contact.left), side_facts(scene, method, contact.right)


def stiffness_of(scene: Scene, method: Method, contact: Contact) -> float | None:
    """Return a contact's stiffness [N/m]: inf of a hard one, None without spring."""
    law = method.laws[contact.name]
    if law.hard:
        return math.inf
    constants = law.spring(*sides(scene, method, contact), math.nan)
    return None if constants is None else constants[0]


def dashpot_of(scene: Scene, method: Method, contact: Contact) -> float:
    """Return the damping of a contact's constant dashpot [N s/m]; 0 without one."""
    law = method.laws[contact.name]
    constants = None if law.hard else law.spring(*sides(scene, method, contact), math.nan)
    return 0.0 if constants is None else constants[1]


def stiffness_at(scene: Scene, method: Method, contact: Contact, overlap: float) -> float | None:
    """Return the tangent stiffness [N/m] of a contact at an overlap [m], None if unknown."""
    return method.laws[contact.name].stiffness_at(overlap, *sides(scene, method, contact))


def is_relative(law: Any) -> bool:
    """Return whether a law refers to the elements of the bodies that it acts on."""
    return any(isinstance(getattr(law, each.name), Relative) for each in dataclasses.fields(law))
