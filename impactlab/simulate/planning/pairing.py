"""Checks of pairs of integrator, laws, bodies and events, and the energy gain they declare."""

from __future__ import annotations

import math
from collections.abc import Collection

from impactlab.bases.base import AbstractBasis
from impactlab.errors import PairingError
from impactlab.exact.setup.contact_kinds import massless
from impactlab.history.base import Warned
from impactlab.integrators.base import AbstractAdaptive, AbstractIntegrator
from impactlab.models.base import AbstractRodModel, Operators
from impactlab.plugins import kind_of, parts_inside
from impactlab.scene.bodies import ElasticBody
from impactlab.scene.facts import changes
from impactlab.scene.method import Method, laws_of, modelled
from impactlab.scene.problem import Contact, Scene
from impactlab.types import Level

Own = Collection[str]  # names of the bodies that step by themselves
CONTINUOUS_LAWS = {  # on a rod, on a beam
    False: "wave_identification or penalty",
    True: "addition_deletion, dispersive_identification or penalty",
}


def check_pairs(scene: Scene, method: Method, integrator: AbstractIntegrator, own: Own) -> None:
    """Raise `PairingError` where an integrator does not support the laws or events of a method."""
    differences = integrator.load_point == 0.0 and integrator.velocity_point == 0.5
    for number, (contact, law) in enumerate(zip(scene.contacts, laws_of(scene, method), strict=True)):
        path = f"contacts.{number}.law"
        if law.needs_second_differences() and not differences:
            raise PairingError(
                f"the restitution of law '{kind_of(law)}' is defined by second differences of position, which "
                f"integrator '{kind_of(integrator)}' does not have",
                remedy="Use central_difference, restitution: 0, or law velocity_complementarity.",
                path=path,
            )
        beam = on_continuous_beam(scene, contact, own)
        impulses = Level.IMPULSE in law.needs or (Level.CLOSING in law.needs and not beam)
        if impulses and (contact.left.body in own or contact.right.body in own):
            raise PairingError(
                f"law '{kind_of(law)}' gives impulses, and the mass that they would strike "
                f"{'on a continuous beam' if beam else 'at the end of a continuous rod'} is zero",
                remedy=f"Use finite_element or modal, or law {CONTINUOUS_LAWS[beam]}.",
                path=path,
            )
    if method.events == "located":
        check_located(scene, method, integrator, own)


def constraint_warnings(scene: Scene, method: Method, integrator: AbstractIntegrator, own: Own = ()) -> list[Warned]:
    """Return warnings of position constraints under a scheme; raise `PairingError` where one cannot work.

    Two masses that meet jump; a constraint on positions does not determine how they part.
    """
    gaining, heavy = [], []
    for number, contact in enumerate(scene.contacts):
        if constraint_gains(scene, method, contact, integrator, own):
            text = f"{contact.name}: a hard position constraint under '{kind_of(integrator)}' is known to gain energy"
            gaining.append(Warned("constraint_energy", text, contact.name))
        law = method.laws[contact.name]
        if not law.holds_position or massless(scene, contact.left) or massless(scene, contact.right):
            continue
        if integrator.projects_first:
            raise PairingError(
                f"integrator '{kind_of(integrator)}' projects positions and leaves velocities to the waves behind a "
                f"face; both faces of {contact.name} have mass, and their velocities would never meet",
                remedy="Use law velocity_complementarity or penalty, or integrator moreau_jean.",
                path=f"contacts.{number}.law",
            )
        if integrator.load_point > 0.0 and method.events == "dated" and not on_continuous_beam(scene, contact, own):
            text = (
                f"{contact.name}: both faces have mass; their velocities after the contact depend on the "
                "instant within the step at which they meet"
            )
            heavy.append(Warned("heavy_faces", text + "; velocity_complementarity has a restitution", contact.name))
    return gaining + heavy


def on_continuous_beam(scene: Scene, contact: Contact, own: Own) -> bool:
    """Return whether one face of a contact is a self-stepping beam, without mass."""
    if not own:
        return False
    names = (point.body for point in contact.faces)
    return any(name in own and scene.bodies[name].bends for name in names)


def check_system(integrator: AbstractIntegrator, body: str, system: Operators) -> None:
    """Raise `PairingError` where the integrator cannot step a body."""
    if integrator.needs_modes and not system.modes:
        name = kind_of(integrator)
        raise PairingError(
            f"integrator '{name}' needs a model with modes, and '{body}' has none",
            remedy="Use model modal, or integrator newmark (central_difference with mass: lumped).",
            path="solve.integrator",
        )
    if integrator.needs_diagonal_mass and not system.diagonal_mass:
        name = kind_of(integrator)
        raise PairingError(
            f"integrator '{name}' needs a diagonal mass, and '{body}' has a consistent one",
            remedy="Give finite_element mass: lumped, or use model modal, or integrator newmark.",
            path="solve.integrator",
        )


def constraint_gains(
    scene: Scene, method: Method, contact: Contact, integrator: AbstractIntegrator, own: Own = ()
) -> bool:
    """Return whether a hard position constraint gains energy without bound."""
    holds = method.laws[contact.name].holds_position and method.events == "dated"
    return holds and not integrator.jump_in_force and not on_continuous_beam(scene, contact, own)


def energy_bound(scene: Scene, method: Method, integrator: AbstractIntegrator, own: Own = ()) -> float:
    """Return the largest energy gain that parts declare, over the initial energy."""
    # A touch within 1e-6 of a step from its end is not cut: a hard law finds the faces that little apart.
    bound = (1e-9 if method.events == "dated" else 1e-6) + integrator.gains_energy
    bound += sum(gains_of(body, model) for body, model in modelled(scene, method))
    for contact in scene.contacts:
        if constraint_gains(scene, method, contact, integrator, own):
            return math.inf
        bound += method.laws[contact.name].gains_energy
    return bound


def gains_of(body: ElasticBody, model: AbstractRodModel) -> float:
    """Return the energy gain that a body's description declares."""
    inside = sum(part.gains_energy for part in parts_inside(model) if isinstance(part, AbstractBasis))
    return inside + (body.mesh_rounding(model.element_length(body)) if model.has_mesh else 0.0)


def check_located(scene: Scene, method: Method, integrator: AbstractIntegrator, own: Own) -> None:
    """Raise `PairingError` where events cannot be located."""
    if not integrator.any_dt:
        raise PairingError(
            f"events: located needs an integrator that can cut a step; '{kind_of(integrator)}' cannot",
            remedy="Use midpoint or exact_modal, or events: dated.",
            path="solve.events",
        )
    for name, body in scene.elastic.items():
        if name in own:
            raise PairingError(
                f"events: located cuts steps, and the continuous {body.kind} '{name}' has one step length",
                remedy="Use modal for this body, or events: dated.",
                path="solve.events",
            )
    for number, law in enumerate(laws_of(scene, method)):
        if law.fixed_step:
            raise PairingError(
                f"events: located cuts steps, and law '{kind_of(law)}' {law.why_fixed}",
                remedy="Use addition_deletion, penalty or impulse_momentum, or events: dated.",
                path=f"contacts.{number}.law",
            )


def check_smooth(scene: Scene, method: Method, integrator: AbstractAdaptive, own: Own) -> None:
    """Raise `PairingError` where an adaptive integrator does not support a scene.

    The laws or the descriptions of the bodies may be the reason.
    """
    name = kind_of(integrator)
    others = "midpoint" if changes(scene) else "newmark, central_difference or exact_modal"
    for number, law in enumerate(laws_of(scene, method)):
        if not law.smooth:
            raise PairingError(
                f"integrator '{name}' needs a force that follows from gap and gap rate alone, and only presses; "
                f"law '{kind_of(law)}' has no such force",
                remedy=f"Use penalty, or integrator {others}.",
                path=f"contacts.{number}.law",
            )
    for body in scene.elastic.values():
        if body.name in own:
            raise PairingError(
                f"integrator '{name}' needs bodies in coordinates, "
                f"and the continuous {body.kind} '{body.name}' has none",
                remedy="Use modal or finite_element for this body, or integrator newmark or exact_modal.",
                path=f"solve.models.{body.name}",
            )


def check_ordinary(integrator: AbstractAdaptive, body: str, system: Operators) -> None:
    """Raise `PairingError` where a body is not one ordinary differential equation all along."""
    faults = (
        ("a face without mass", bool(system.massless)),
        ("other coordinates while a contact is closed", system.phases is not None),
    )
    for fault, has_it in faults:
        if has_it:
            raise PairingError(
                f"integrator '{kind_of(integrator)}' does not support '{body}', which has {fault}",
                remedy="Use another description of this body, or another integrator.",
                path="solve.integrator",
            )
