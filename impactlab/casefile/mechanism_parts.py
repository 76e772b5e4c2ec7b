"""Mechanisms that a class describes: their parts, and their faces as contacts name them."""

from __future__ import annotations

from collections.abc import Mapping

from impactlab.casefile.blocks.links import MechanismBlock
from impactlab.casefile.parts import read_part
from impactlab.casefile.schema import CaseBlock
from impactlab.casefile.text.words import listed, shown
from impactlab.errors import CaseError, closest
from impactlab.mechanisms.part_mechanism import PartMechanism
from impactlab.plugins import MECHANISMS, Registry
from impactlab.scene.problem import Point


def chains_of(case: CaseBlock) -> dict[str, MechanismBlock]:
    """Return the chains of links among the mechanisms, by name."""
    return {name: block for name, block in case.mechanisms.items() if not isinstance(block, dict)}


def parts_of(case: CaseBlock, gravity: tuple[float, float], registry: Registry) -> dict[str, PartMechanism]:
    """Return the mechanisms that a class describes, by name.

    Raises
    ------
    PluginError
        If a class is not installed or broken.
    CaseError
        If one of its parameters is wrong, or its motion cannot be built.
    """
    found = {}
    for name, block in case.mechanisms.items():
        if isinstance(block, dict):
            part = read_part(block, f"mechanisms.{name}", MECHANISMS, registry)
            found[name] = PartMechanism(name, part, gravity=gravity)
    return found


def placed(point: Point, parts: Mapping[str, PartMechanism], path: str) -> Point:
    """Return a face with its reading's number where its body is a part.

    Raises `CaseError` where it has none.
    """
    if point.body not in parts:
        return point
    body = parts[point.body]
    faces = {reading.name: number for number, reading in enumerate(body.readings) if not reading.is_angle}
    name = point.label.partition(".")[2]
    if name not in faces:
        raise CaseError(
            f"the mechanism {point.body!r} has no face {shown(name)}.{closest(name, faces)}",
            remedy=f"Name one of {listed([f'{point.body}.{face}' for face in faces])}.",
            path=path,
        )
    return Point(point.body, float(faces[name]), point.label)
