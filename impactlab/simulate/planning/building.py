"""Coordinates of a body by the model chosen for it."""

from __future__ import annotations

from collections.abc import Mapping

from impactlab.errors import CaseError, PairingError, PluginError
from impactlab.mechanisms.base import AbstractMechanism
from impactlab.mechanisms.chain import Chain
from impactlab.mechanisms.model import MechanismModel
from impactlab.mechanisms.part_mechanism import PartMechanism
from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Face
from impactlab.models.rigid import RigidBody
from impactlab.plugins import kind_of
from impactlab.scene.bodies import Beam, Body, Mechanism, MechanismBody, Rod


def build_body(
    body: Body, models: Mapping[str, AbstractRodModel], gravity: float, faces: tuple[Face, ...]
) -> AbstractDiscreteModel:
    """Return a body in coordinates, as the model of its name builds it.

    ``gravity`` is in m/s2, ``faces`` are its contacts.

    Raises
    ------
    CaseError
        If a body that deforms has no model, or its model does not support it.
    PairingError
        If the model has a theory of rods, and the body is of another kind, or if a beam with an
        infinite end does not rest.
    """
    if isinstance(body, MechanismBody):
        return MechanismModel(body, mechanism_of(body, models))
    if body.elastic is None:
        mass = body.rigid_mass if body.moves else None
        distance = 0.0 if body.rotation is None else -body.rotation.axis_at
        return RigidBody(mass, body.velocity, gravity if body.moves else 0.0, body.softening, distance)
    model = models.get(body.name)
    if model is None:
        raise CaseError(f"'{body.name}' has no model", path="solve.model", remedy="Give solve.model.")
    if body.rotation is not None and not model.serves_rotation:
        raise PairingError(
            f"model '{kind_of(model)}' describes bodies that do not turn, and '{body.name}' turns at "
            f"{body.rotation.rate:.6g} rad/s",
            remedy="Use finite_element or modal for this body.",
            path=f"solve.models.{body.name}",
        )
    if isinstance(body, Beam):
        _check_rest(body, gravity)
        return _in_coordinates(model, model.build_beam(body, gravity, faces), "build_beam")
    if model.theory and not isinstance(body, Rod):
        raise PairingError(
            f"theory '{model.theory}' applies to rods, but '{body.name}' is a {body.kind}",
            remedy="Use finite_element, modal or continuous for this body.",
            path=f"solve.models.{body.name}",
        )
    if body.waves is None:
        raise PairingError(
            f"no model describes '{body.name}', a {body.kind}",
            remedy="Give its kind the wave equation (`WaveBody`), or a model that builds it.",
            path=f"solve.models.{body.name}",
        )
    return _in_coordinates(model, model.build(body.waves, gravity if body.falls else 0.0, faces), "build")


def _in_coordinates(model: AbstractRodModel, built: AbstractDiscreteModel, by: str) -> AbstractDiscreteModel:
    """Return a body that a model built; raise `PluginError` for another object."""
    if not isinstance(built, AbstractDiscreteModel):
        raise PluginError(
            f"`{by}` of model '{kind_of(model)}' returned {str(built)[:40]}",
            remedy="It must return an AbstractDiscreteModel (impactlab.models.base).",
            path="solve.model",
        )
    return built


def _check_rest(beam: Beam, gravity: float) -> None:
    """Raise `PairingError` if a beam with an infinite end moves or has weight.

    ``gravity`` is in m/s2.
    """
    if "infinite" not in (beam.left.kind, beam.right.kind):
        return
    for fault, has_it in (("moves as a whole at t = 0", beam.velocity != 0.0), ("has weight", gravity != 0.0)):
        if has_it:
            raise PairingError(
                f"the beam '{beam.name}' {fault}, and has an infinite end, beyond which everything is at "
                "rest. Allowed there: velocity 0, no gravity",
                remedy=(
                    "Give the velocity to the other body, leave gravity out, or give a longer beam with another end."
                ),
                path=f"bodies.{beam.name}.ends",
            )


def mechanism_of(mechanism: MechanismBody, models: Mapping[str, AbstractRodModel]) -> AbstractMechanism:
    """Return the equations of motion of a mechanism: a chain of links, or a part."""
    if isinstance(mechanism, Mechanism):
        return Chain(mechanism, models)
    if isinstance(mechanism, PartMechanism):
        return mechanism.part
    raise TypeError(f"{type(mechanism).__name__} has no equations of motion")
