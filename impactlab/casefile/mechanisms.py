"""The mechanisms of a checked case: links, rules, and bodies in SI."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from impactlab.casefile.blocks.beams import BeamBlock
from impactlab.casefile.blocks.links import JointBlock, LinkBlock
from impactlab.casefile.mechanism_parts import chains_of
from impactlab.casefile.points import at_end, name_in
from impactlab.casefile.schema import CaseBlock, WallBlock
from impactlab.casefile.text.words import listed, shown
from impactlab.errors import CaseError, closest
from impactlab.scene.bodies import Drive, Gauge, Link, Mark, Mechanism

SAME_GRAVITY = 1e-12  # of gravity: components nearer than this agree
HALF_TURN_TOL = 1e-9  # rad: 180 deg in radians is no more than half a turn


class Fault(NamedTuple):
    """A fault of a link: its text, the remedy, and the key of the link that has it."""

    text: str
    remedy: str
    key: str


class LinkOf(NamedTuple):
    """A body of the case as a link."""

    mechanism: str
    number: int


def links_of(case: CaseBlock) -> dict[str, LinkOf]:
    """Return the bodies that are links of mechanisms, by name."""
    if not case.mechanisms:  # asked for every contact
        return {}
    return {
        link.body: LinkOf(name, number)
        for name, mechanism in chains_of(case).items()
        for number, link in enumerate(mechanism.links)
    }


def direction(along: Any) -> tuple[float, float]:
    """Return the direction of a contact as a vector of length 1."""
    if along in ("x", "y"):
        return (1.0, 0.0) if along == "x" else (0.0, 1.0)
    size = math.hypot(*along)
    return along[0] / size, along[1] / size


def gravity_vector(gravity: Any) -> tuple[float, float]:
    """Return gravity as (x, y) [m/s2]; a number acts along +x."""
    return tuple(gravity) if isinstance(gravity, (list, tuple)) else (gravity, 0.0)


def directions(case: CaseBlock) -> dict[str, tuple[float, float]]:
    """Return the directions of bodies that meet a mechanism, by name.

    A body that meets several has the first. Bodies that meet one of them move with it along one line.
    """
    found: dict[str, tuple[float, float]] = {}
    if not case.mechanisms:
        return found
    links = links_of(case)
    for contact in case.contacts:
        for text in contact.between:
            if contact.along is not None and name_in(text) not in links:
                found.setdefault(name_in(text), direction(contact.along))
    moving = {name for name, block in case.bodies.items() if not isinstance(block, WallBlock)} - links.keys()
    pairs = [[name_in(text) for text in contact.between] for contact in case.contacts]
    pairs = [pair for pair in pairs if moving.issuperset(pair)]
    reached = -1
    while reached < len(found) and found:
        reached = len(found)
        for one, other in [*pairs, *(pair[::-1] for pair in pairs)]:
            if one in found:
                found.setdefault(other, found[one])
    return found


def odd_mechanisms(case: CaseBlock) -> Iterator[str]:
    """Yield sentences on values of mechanisms that may be mistakes.

    They are gravity along x that may be meant downwards, and each angle of more than half a turn.
    """
    g = case.gravity
    if case.mechanisms and not isinstance(g, tuple) and g != 0.0:
        yield (
            f"gravity: {g:g} m/s2 acts along x on {', '.join(map(repr, case.mechanisms))}; is it meant downwards, "
            f"[0, {-abs(g):g}]? Along x write [{g:g}, 0]"
        )
    for name, chain in chains_of(case).items():
        for number, link in enumerate(chain.links):
            if abs(link.angle) > math.pi + HALF_TURN_TOL:
                yield (
                    f"mechanisms.{name}.links.{number}.angle: {link.angle:g} rad is more than half a turn; is a unit "
                    f"missing, as in '{link.angle:g} deg'?"
                )


def gravity_of(case: CaseBlock) -> float:
    """Return the gravity of all bodies except links [m/s2].

    It is along the motion of each. Raises `CaseError` where it differs. A body that meets a mechanism moves along its
    contact; a number acts on any other, and a vector on none.
    """
    x, y = gravity_vector(case.gravity)
    if not case.mechanisms and not isinstance(case.gravity, tuple):
        return x
    links, along, on = links_of(case), directions(case), dict[str, float]()
    for name, block in case.bodies.items():
        if isinstance(block, WallBlock) or name in links:
            continue
        if name in along:
            on[name] = along[name][0] * x + along[name][1] * y
        elif not isinstance(case.gravity, tuple) or (x, y) == (0.0, 0.0):
            on[name] = x
        else:
            raise CaseError(
                f"gravity is given as [x, y], and the direction in which {name!r} moves is not known: it "
                "is in contact with no link",
                remedy="Give gravity as a number: it acts on mechanisms along +x, on other bodies along their motion.",
                path="gravity",
            )
    first = next(iter(on.values()), 0.0)
    for name, value in on.items():
        if not math.isclose(value, first, abs_tol=SAME_GRAVITY * math.hypot(x, y)):
            raise CaseError(
                f"along its motion gravity acts with {value:.6g} m/s2 on {name!r}, and with {first:.6g} m/s2 on "
                f"{next(iter(on))!r}. Allowed: one value for all bodies beside mechanisms",
                remedy="Leave gravity out, or let them meet the mechanism in one direction.",
                path="gravity",
            )
    return first


def mechanism_body(case: CaseBlock, name: str, marks: tuple[Mark, ...]) -> Mechanism:
    """Return a mechanism of a checked case in SI."""
    block = chains_of(case)[name]
    links = tuple(_link(case, *each) for each in zip(block.links, _angles(block.links), strict=True))
    slide = None if block.end == "free" else block.end["slide"]
    numbers = {link.name: number for number, link in enumerate(links)}
    places = [(numbers[probe.body], at_end(probe.at, links[numbers[probe.body]].length)) for probe in case.probes
              if probe.body in numbers]  # fmt: skip
    gauges = tuple(Gauge(*place) for place in dict.fromkeys(places))
    return Mechanism(name, links, slide, marks, gauges, gravity=gravity_vector(case.gravity))


def _angles(joints: Sequence[JointBlock]) -> list[float]:
    """Return the angles of links at t = 0 [rad].

    A link that is clamped to the one before continues straight.
    """
    angles: list[float] = []
    for joint in joints:
        straight = angles and joint.joint == "clamped" and joint.drive is None and "angle" not in joint.model_fields_set
        angles.append(angles[-1] if straight else joint.angle)
    return angles


def _link(case: CaseBlock, joint: JointBlock, angle: float) -> Link:
    block: Any = case.bodies[joint.body]
    drive = None if joint.drive is None else Drive(joint.drive.rate, joint.drive.within or 0.0)
    given: dict[str, Any] = {
        "joint": joint.joint, "angle": angle, "rate": joint.rate, "torque": joint.torque, "drive": drive,
        "end_mass": joint.end_mass, "axial_modes": joint.axial_modes,
    }  # fmt: skip
    if isinstance(block, BeamBlock):
        return Link(joint.body, block.total_length, beam=block.body(joint.body, 1.0), **given)
    inertia = block.mass * block.length**2 / 12.0 if block.inertia is None else block.inertia
    return Link(joint.body, block.length, block.mass, inertia, **given)


def check_mechanisms(case: CaseBlock) -> None:
    """Raise `CaseError` where the links of a mechanism are wrong.

    They are missing, repeated or of a wrong kind, or their hinges are given twice.
    """
    seen: dict[str, str] = {}
    for name, mechanism in case.mechanisms.items():
        if name in case.bodies:
            raise CaseError(
                f"{name!r} names a mechanism here and a body in bodies.{name}. Allowed: one name for one thing",
                remedy="Give the mechanism another name.",
                path=f"mechanisms.{name}",
            )
        if isinstance(mechanism, dict):  # its own class reads it
            continue
        for number, joint in enumerate(mechanism.links):
            path = f"mechanisms.{name}.links.{number}"
            slides = mechanism.end != "free" and number == len(mechanism.links) - 1
            fault = next(_faults(case, joint, number, slides), None)
            if fault is not None:
                raise CaseError(fault.text, remedy=fault.remedy, path=f"{path}.{fault.key}")
            if joint.body in seen:
                raise CaseError(
                    f"{joint.body!r} is a link of {seen[joint.body]!r} already",
                    remedy="Give each link a body of its own.",
                    path=f"{path}.body",
                )
            seen[joint.body] = name
        if mechanism.end != "free" and len(mechanism.links) < 2:
            raise CaseError(
                "one link on a slide cannot move",
                remedy="Give two links or more, or end: free.",
                path=f"mechanisms.{name}.end",
            )
    loose = [name for name, body in case.bodies.items() if isinstance(body, LinkBlock) and name not in seen]
    if loose:
        raise CaseError(
            f"{loose[0]!r} is a link of no mechanism",
            remedy="Name it in the links of a mechanism, or remove it.",
            path=f"bodies.{loose[0]}",
        )


def _faults(case: CaseBlock, joint: JointBlock, number: int, slides: bool) -> Iterator[Fault]:
    """Yield the faults of a link."""
    body = case.bodies.get(joint.body)
    if body is None:
        links = [name for name, each in case.bodies.items() if isinstance(each, (LinkBlock, BeamBlock))]
        yield Fault(
            f"there is no body {shown(joint.body)}.{closest(joint.body, links)}", f"Links: {listed(links)}.", "body"
        )
        return
    if not isinstance(body, (LinkBlock, BeamBlock)):
        yield Fault(
            f"{joint.body!r} is a {body.kind}. Allowed: link (rigid), beam", "Name a body of one of the two.", "body"
        )
        return
    if joint.drive is not None and joint.torque != 0.0:
        yield Fault("a hinge is driven or bears a torque, and here both are given", "Keep one of the two.", "drive")
    if joint.drive is not None and joint.rate != 0.0:
        yield Fault("the rate of a driven hinge is that of its drive", "Remove one of the two.", "rate")
    if slides and (joint.drive is not None or joint.rate != 0.0 or joint.joint == "clamped"):
        yield Fault("the motion of the last link follows from the slide", "Drive or turn another link.", "joint")
    if joint.joint == "clamped" and number > 0 and (joint.drive is not None or joint.torque or joint.rate):
        yield Fault("a link clamped to the one before it turns with it", "Give joint: hinge.", "joint")
    if isinstance(body, LinkBlock):
        if joint.axial_modes:
            yield Fault(f"{joint.body!r} is rigid", "Remove it, or describe the link as a beam.", "axial_modes")
        return
    held = [end for end in (body.ends.left, body.ends.right) if end.kind != "free" or end.is_loaded]
    if held:
        text = "the ends of a link are its joints, and its beam has ends of its own"
        yield Fault(text, "Leave `ends` out; a mass at the end of a link is its end_mass.", "body")
    if joint.drive is not None and joint.joint == "hinge":
        yield Fault(
            "a drive turns the root section of a beam, which a hinge leaves free",
            "Give joint: clamped: the beam stands on a driven hub.",
            "joint",
        )
    if body.tension != 0.0 or body.theory != "euler_bernoulli" or body.velocity != 0.0 or body.profile is not None:
        text = "a link bends by the theory of Euler and Bernoulli, straight and without preload at t = 0"
        yield Fault(text, "Remove tension, theory, velocity and displacement from the beam.", "body")
    if body.rayleigh.mass or body.rayleigh.stiffness or viscous(body):
        yield Fault("a link has no damping", "Remove damping and viscosity from the beam.", "body")
    if body.rotation is not None:
        text = "a link turns by its joints, and its beam has a steady rotation of its own"
        yield Fault(text, "Remove rotation; a drive at its joint gives a link a rate.", "body")


def viscous(beam: BeamBlock) -> bool:
    """Return whether the material of a beam has a viscosity."""
    return any(piece.material is not None and piece.material.viscosity > 0.0 for piece in beam.pieces)


def tolerance_serves(case: CaseBlock) -> None:
    """Refuse a tolerance where a mechanism moves."""
    if case.mechanisms and case.solve.tolerance is not None:
        raise CaseError(
            f"the automatic choice does not support mechanisms, and {next(iter(case.mechanisms))!r} is one",
            remedy="Give model, integrator midpoint and step instead, and compare with half the step.",
            path="solve.tolerance",
        )


def gravity_is_one(case: CaseBlock) -> None:
    """Refuse gravity that is a vector without mechanisms, or differs between the bodies beside them."""
    if isinstance(case.gravity, tuple) and not case.mechanisms:
        raise CaseError(
            "gravity as [x, y] acts on mechanisms, and this case has none",
            remedy="Give a number: gravity along +x, of beams along +u.",
            path="gravity",
        )
    gravity_of(case)
