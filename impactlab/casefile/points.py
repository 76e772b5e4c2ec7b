"""Reads the faces that a contact names: ``hammer``, ``rod.left``, ``rod.at(0.15)``, ``pile.along(5 m, 20 m)``."""

from __future__ import annotations

import re
from typing import NamedTuple

from impactlab.casefile.blocks.links import LinkBlock
from impactlab.casefile.blocks.shared import ElasticBlock
from impactlab.casefile.schema import BodyBlock, CaseBlock, MassBlock
from impactlab.casefile.text.words import listed_bodies, rows_of, shown
from impactlab.casefile.values.units import to_si
from impactlab.errors import CaseError, closest
from impactlab.scene.facts import SAME_PLACE
from impactlab.scene.problem import Point

_FACE = re.compile(r"([A-Za-z_][A-Za-z0-9_-]{0,39})(?:\.(\w{1,40})(?:\(([^()]{1,64})\))?)?")
_NUMBER = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]{1,3})?")
_REMEDY = "Write body, body.left, body.right or body.at(x)."


class Face(NamedTuple):
    """A face as the case names it: the point and the end of its body."""

    point: Point
    end: str  # left, right, or empty for an inner point, a mass and a wall
    body: str  # its name in the case; a link is part of the body that its mechanism is
    span: tuple[float, float] | None = None  # m, of a face along a body


def read_face(case: CaseBlock, text: str, path: str) -> Face:
    """Return the face that a text names.

    Raises
    ------
    CaseError
        If there is no such body, no such end, or no such place on it.
    """
    match = _FACE.fullmatch(text.strip())
    if match is None:
        name, at, x = text.strip().partition("@")  # as places stand in the names of channels
        meant = f". Did you mean {shown(f'{name}.at({x})')}?" if at and x else ""
        raise CaseError(f"{shown(text)} does not name a face{meant}", remedy=_REMEDY, path=path)
    name, side, place = match.groups()
    if isinstance(case.mechanisms.get(name), dict):
        return _of_part(name, side, place, path)
    body = find_body(case, name, path)
    if not isinstance(body, (ElasticBlock, LinkBlock)):
        if side is not None:
            kind = "a mass" if isinstance(body, MassBlock) else "a wall"
            raise CaseError(
                f"{shown(text)}: {name!r} is {kind} and has no ends", remedy=f"Write {name!r} alone.", path=path
            )
        return Face(Point(name, 0.0, name), "", name)
    if side is None:
        raise CaseError(
            f"{name!r} is a {body.kind}, so the face must be named. Allowed: {name}.left, {name}.right, {name}.at(x)",
            remedy="Name one of these faces.",
            path=path,
        )
    length = body.total_length
    if side == "at" and place is not None:
        return _inner(name, place, length, text, path)
    if side == "along" and place is not None and place.count(",") == 1:
        return _along(name, place, length, text, path)
    if side not in ("left", "right") or place is not None:
        hint = closest(side, ("left", "right"))
        raise CaseError(
            f"{shown(text)}: a {body.kind} has no end {shown(side)}.{hint} "
            f"Allowed: {name}.left, {name}.right, {name}.at(x)",
            remedy="Name one of its two ends, or a place x on it.",
            path=path,
        )
    return Face(Point(name, 0.0 if side == "left" else length, f"{name}.{side}"), side, name)


def _of_part(name: str, face: str | None, place: str | None, path: str) -> Face:
    """Return a face of a mechanism that a class describes.

    Whether it has a face of that name is checked later.
    """
    if face is None or place is not None:
        raise CaseError(
            f"{name!r} is a mechanism, so its face must be named: {name}.face",
            remedy="`impactlab run` of the case without contacts lists its positions.",
            path=path,
        )
    return Face(Point(name, 0.0, f"{name}.{face}"), "", name)


def name_in(text: str) -> str:
    """Return the body that the text of a face names; empty where it names none."""
    match = _FACE.fullmatch(text.strip())
    return "" if match is None else match[1]


def find_body(case: CaseBlock, name: str, path: str) -> BodyBlock:
    """Return the body of that name, or raise with the closest one."""
    if name not in case.bodies:
        rows = rows_of(case.bodies)
        stem, _, number = name.rpartition("_")
        if (block := stem if number.isdecimal() else name) in rows:
            hint = f" Block {block!r} makes {block}_1 to {block}_{rows[block]}."
        else:
            hint = closest(name, rows) or closest(name, case.bodies)
        raise CaseError(
            f"there is no body {shown(name)}.{hint}",
            remedy=f"Bodies of this case: {listed_bodies(case.bodies)}.",
            path=path,
        )
    return case.bodies[name]


def _place(place: str, name: str, length: float, text: str, path: str) -> float:
    """Return a place on a body, ``0.15`` or ``150 mm`` [m]."""
    try:
        x = float(place) if _NUMBER.fullmatch(place.strip()) else to_si(place.strip(), "m")
    except ValueError as error:
        raise CaseError(f"{shown(text)}: {error}", remedy=_REMEDY, path=path) from error
    return place_on(x, name, length, path)


def _along(name: str, places: str, length: float, text: str, path: str) -> Face:
    start, end = (_place(place, name, length, text, path) for place in places.split(","))
    if start >= end:
        raise CaseError(
            f"{shown(text)} runs from {start:g} to {end:g} m. Allowed: from a smaller x to a larger one",
            remedy=f"Write {name}.along(from, to), x from the left end.",
            path=path,
        )
    label = f"{name}.along({start:.6g}, {end:.6g})"
    return Face(Point(name, 0.5 * (start + end), label), "", name, (start, end))


def _inner(name: str, place: str, length: float, text: str, path: str) -> Face:
    x = _place(place, name, length, text, path)
    end = "left" if x == 0.0 else "right" if x == length else ""
    return Face(Point(name, x, f"{name}.at({x:.6g})"), end, name)


def place_on(x: float, name: str, length: float, path: str) -> float:
    """Return x on a body of a length [m].

    A place that meets an end to rounding is that end.

    Raises
    ------
    CaseError
        If x lies outside the body.
    """
    met = at_end(x, length)
    if not 0.0 <= met <= length:
        raise CaseError(
            f"x = {x:.12g} m lies outside the body {name!r}. Allowed: 0 to {length:.12g} m",
            remedy="x runs from the left end of a body to its right end.",
            path=path,
        )
    return met


def at_end(x: float, length: float) -> float:
    """Return a place, moved to an end if equal to rounding [m].

    The ends are 0 and the length of the body. The length of a body of segments is a sum: 0.7 m and 0.1 m make
    0.7999999999999999 m.
    """
    slack = SAME_PLACE * length
    return 0.0 if abs(x) <= slack else length if abs(x - length) <= slack else x
