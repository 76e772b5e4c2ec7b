"""Rods and shafts with an infinite end: whether they rest at t = 0 and have no weight."""

from __future__ import annotations

from impactlab.casefile.blocks import ElasticBlock
from impactlab.casefile.schema import CaseBlock
from impactlab.errors import CaseError
from impactlab.scene.bodies import ElasticBody


def check_rest(case: CaseBlock, body: ElasticBody, gravity: float) -> None:
    """Raise `CaseError` where a rod or shaft with an infinite end moves as a whole, or has weight by gravity [m/s2].

    The end is a dashpot of the impedance, which stands for a far part at rest: it would brake a body that moves with
    its far part, and bear a weight that nothing bears. Beams are checked where they are built, in all models.
    """
    block = case.bodies[body.name]
    if body.bends or not isinstance(block, ElasticBlock):
        return
    for side in ("left", "right"):
        if getattr(block.ends, side).kind != "infinite":
            continue
        key = "twist_rate" if body.kind == "shaft" else "velocity"
        given, unit = getattr(block, key), "rad/s" if body.kind == "shaft" else "m/s"
        path, dashpot = f"bodies.{body.name}", f"ends: {{{side}: {{dashpot: {_impedance(body, side):.6g}}}}}"
        if given != 0.0:
            raise CaseError(
                f"'{body.name}' has {key} {given:.6g} {unit} at t = 0 and an infinite end ({side}), a dashpot that "
                f"stands for a far part at rest and would brake it. Allowed with an infinite end: {key} 0",
                remedy=f"Let the other body move, or give a longer {body.kind}, from whose free end nothing comes back "
                f"within the run; where a dashpot is meant, whose force acts on the velocity, give {dashpot}.",
                path=f"{path}.{key}",
            )
        if gravity != 0.0 and body.falls:
            raise CaseError(
                f"'{body.name}' has weight and an infinite end ({side}), beyond which the weight has no bound. Allowed "
                "with an infinite end: no gravity",
                remedy=f"Leave gravity out, or give a longer {body.kind}, from whose end nothing comes back within the "
                f"run; where a dashpot is meant, whose force acts on the velocity, give {dashpot}.",
                path=f"{path}.ends.{side}",
            )


def _impedance(body: ElasticBody, side: str) -> float:
    """Return the dashpot of an infinite end in the unit of the block: N s/m, of a shaft N m s."""
    value = (body.left if side == "left" else body.right).value
    return value * getattr(body, "lever_arm", 1.0) ** 2
