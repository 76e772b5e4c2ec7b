"""Lever arms: each contact of a shaft has one, all of a shaft the same, and on its other side a rigid body."""

from __future__ import annotations

from impactlab.casefile.blocks import ElasticBlock
from impactlab.casefile.points import read_face
from impactlab.casefile.schema import CaseBlock
from impactlab.casefile.shafts import ShaftBlock
from impactlab.errors import CaseError


def lever_arm_of(case: CaseBlock, name: str) -> float:
    """Return the lever arm of the contacts of a shaft [m]; 1 m without a contact."""
    arms = (case.contacts[number].lever_arm for number in range(len(case.contacts)) if name in _sides(case, number))
    return next((arm for arm in arms if arm is not None), 1.0)


def _sides(case: CaseBlock, number: int) -> list[str]:
    """Return the names of the two bodies of a contact."""
    labels = enumerate(case.contacts[number].between)
    return [read_face(case, label, f"contacts.{number}.between.{side}").point.body for side, label in labels]


def shafts_have_lever_arms(case: CaseBlock) -> None:
    """Raise `CaseError` where a contact of a shaft has no lever arm, another one, or a partner that is not rigid."""
    for number, contact in enumerate(case.contacts):
        names, arm = _sides(case, number), contact.lever_arm
        shafts = [name for name in names if isinstance(case.bodies[name], ShaftBlock)]
        others = [name for name in names if isinstance(case.bodies[name], ElasticBlock) and name not in shafts[:1]]
        text = ""
        if not shafts and arm is not None:
            text, remedy = f"a lever arm turns a shaft, and neither {names[0]!r} nor {names[1]!r} is one", "Remove it."
        elif shafts and others:
            text = (
                f"the {case.bodies[others[0]].kind} {others[0]!r} meets the shaft {shafts[0]!r}, whose lever arm can "
            )
            text += "strike rigid bodies. Allowed: a mass or a wall"
            remedy = "Put a mass between the two, with a contact to each."
        elif shafts and arm is None:
            text = f"this key is missing: the contact turns the shaft {shafts[0]!r} by an arm of some length"
            remedy = "Give lever_arm in m, the distance of the contact from the axis of the shaft."
        elif shafts and arm != (first := lever_arm_of(case, shafts[0])):
            text = f"the shaft {shafts[0]!r} has a lever arm of {first:g} m at another contact, and {arm:g} m here. "
            text += "Allowed: one for all contacts of a shaft"
            remedy = "Give its contacts the same lever_arm r: a mass m at an arm a is one of m (a/r)^2 at r."
        if text:
            raise CaseError(
                text, remedy=remedy, path=f"contacts.{number}.{'between' if others and shafts else 'lever_arm'}"
            )
