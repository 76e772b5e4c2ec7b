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
        path, names = f"contacts.{number}", _sides(case, number)
        shafts = [name for name in names if isinstance(case.bodies[name], ShaftBlock)]
        others = [name for name in names if isinstance(case.bodies[name], ElasticBlock) and name not in shafts[:1]]
        if not shafts and contact.lever_arm is not None:
            raise CaseError(
                f"a lever arm turns a shaft, and neither {names[0]!r} nor {names[1]!r} is one",
                remedy="Remove lever_arm.",
                path=f"{path}.lever_arm",
            )
        if shafts and others:
            raise CaseError(
                f"the {case.bodies[others[0]].kind} {others[0]!r} meets the shaft {shafts[0]!r}, and a contact of a "
                "shaft is that of an arm with a rigid body. Allowed: a mass or a wall",
                remedy="Put a mass between the two, with a contact to each.",
                path=f"{path}.between",
            )
        if shafts and contact.lever_arm is None:
            raise CaseError(
                f"this key is missing: the contact turns the shaft {shafts[0]!r} by an arm of some length",
                remedy="Give lever_arm in m, the distance of the contact from the axis of the shaft.",
                path=f"{path}.lever_arm",
            )
        if shafts and contact.lever_arm != lever_arm_of(case, shafts[0]):
            raise CaseError(
                f"the shaft {shafts[0]!r} has a lever arm of {lever_arm_of(case, shafts[0]):g} m at another contact, "
                f"and {contact.lever_arm:g} m here. Allowed: one for all contacts of a shaft",
                remedy="Give its contacts the same lever_arm: at an arm r a mass m at an arm a is one of m (a/r)^2.",
                path=f"{path}.lever_arm",
            )
