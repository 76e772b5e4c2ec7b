"""Physics that no single key can show, checked in one place and in this order, before a scene is built."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from impactlab.casefile.arms import shafts_have_lever_arms
from impactlab.casefile.blocks import ElasticBlock
from impactlab.casefile.points import Face, check_place, find_body, read_face
from impactlab.casefile.schema import CHOSEN, CaseBlock, RoundTrips, WallBlock
from impactlab.casefile.stops import stops_leave_room
from impactlab.casefile.words import listed, shown
from impactlab.errors import CaseError, combined
from impactlab.scene.bodies import Table
from impactlab.scene.ranges import range_of


class Faces(NamedTuple):
    """The two faces of a contact."""

    left: Face
    right: Face


def check(case: CaseBlock) -> None:
    """Raise the `CaseError` of the first rule that the case breaks; it holds those of the other rules."""
    faults = []
    for rule in RULES:
        try:
            rule(case)
        except CaseError as error:
            faults.append(error)
    if faults:
        raise combined(faults)


def faces_of(case: CaseBlock, number: int) -> Faces:
    """Return the faces of a contact of the case."""
    left, right = case.contacts[number].between
    path = f"contacts.{number}.between"
    return Faces(read_face(case, left, f"{path}.0"), read_face(case, right, f"{path}.1"))


def reference_rod(case: CaseBlock) -> str | None:
    """Return the rod or beam whose round trip the case counts in: the one named, else the first, else None."""
    if case.solve.round_trips_of is not None:
        return case.solve.round_trips_of
    return next((name for name, body in case.bodies.items() if isinstance(body, ElasticBlock)), None)


def _bodies_have_a_shape(case: CaseBlock) -> None:
    for name, body in case.bodies.items():
        if not isinstance(body, ElasticBlock):
            continue
        keys = body.shape_keys
        for key in keys:
            given = getattr(body, key) is not None
            if getattr(body, "segments", None) is not None and given:
                raise CaseError(
                    f"given together with segments, which replace {keys[0]}, {keys[1]} and {keys[2]}",
                    remedy=f"Keep either {key} or segments.",
                    path=f"bodies.{name}.{key}",
                )
            if getattr(body, "segments", None) is None and not given:
                raise CaseError(
                    "this key is missing",
                    remedy=f"A {body.kind} has {keys[0]}, {keys[1]} and {keys[2]}, or segments with these three each.",
                    path=f"bodies.{name}.{key}",
                )


def _sections_are_whole(case: CaseBlock) -> None:
    for name, body in case.bodies.items():
        if isinstance(body, ElasticBlock):
            body.check_pieces(f"bodies.{name}")


def _shapes_are_finite(case: CaseBlock) -> None:
    for name, body in case.bodies.items():
        given = getattr(body, body.profile_key) if isinstance(body, ElasticBlock) else None
        if not isinstance(body, ElasticBlock) or given is None:
            continue
        path, length, unit = f"bodies.{name}.{body.profile_key}", body.total_length, body.profile_unit
        if isinstance(given, Table) and (given.x[0] > 0.0 or given.x[-1] < length):
            raise CaseError(
                f"the table goes from {given.x[0]:g} to {given.x[-1]:g} m; the {body.kind} from 0 to {length:g} m",
                remedy=f"Give values over the whole {body.kind}.",
                path=path,
            )
        shape = body.profile
        values = shape(np.linspace(0.0, length, 1001)) if shape else np.zeros(2)
        largest = range_of("m").most
        if not np.all(np.isfinite(values)) or np.max(np.abs(values)) > largest:
            finite = np.all(np.isfinite(values))
            raise CaseError(
                f"{shown(given)} is not a {f'number up to {largest:g} {unit}' if finite else 'finite number'} "
                f"everywhere on the {body.kind}, 0 to {length:g} m",
                remedy="Fix the formula (a division by zero, the root of a negative number, a factor too large).",
                path=path,
            )
        for side, value in (("left", values[0]), ("right", values[-1])):
            held = getattr(body.ends, side).kind
            if held in ("clamped", "pinned") and abs(value) > 1e-9 * float(np.max(np.abs(values))):
                raise CaseError(
                    f"the {body.profile_key} at the {held} {side} end is {value:g} {unit}; a {held} end stays at 0",
                    remedy=f"Choose a shape that is 0 there, or free the {side} end.",
                    path=path,
                )


def _contacts_join_two_bodies(case: CaseBlock) -> None:
    for number, contact in enumerate(case.contacts):
        path = f"contacts.{number}.between"
        faces = faces_of(case, number)
        left, right = faces.left.point, faces.right.point
        if left.body == right.body:
            raise CaseError(
                f"the body {left.body!r} cannot be in contact with itself",
                remedy="Name two different bodies.",
                path=path,
            )
        if all(isinstance(case.bodies[point.body], WallBlock) for point in (left, right)):
            raise CaseError(
                f"{left.body!r} and {right.body!r} are walls and never move",
                remedy="A contact needs a body that moves: a rod or a mass.",
                path=path,
            )
        pairs = [frozenset(other.between) for other in case.contacts[:number]]
        if frozenset(contact.between) in pairs:
            raise CaseError(
                f"{left.label} and {right.label} already meet in contacts.{pairs.index(frozenset(contact.between))}",
                remedy="Remove one of the two contacts.",
                path=path,
            )


def _faces_look_at_each_other(case: CaseBlock) -> None:
    for number, contact in enumerate(case.contacts):
        faces = faces_of(case, number)
        wrong = (("0", faces.left, "left", "right"), ("1", faces.right, "right", "left"))
        for place, face, at_side, facing in wrong:
            body = case.bodies[face.point.body]
            if face.end == at_side and isinstance(body, ElasticBlock) and not body.both_sides:
                other = contact.between[1 - int(place)]
                swap = f"[{contact.between[1]}, {contact.between[0]}]"
                raise CaseError(
                    f"{face.point.label!r} looks away from {other!r}: "
                    "of between: [a, b], a lies on the left of b, "
                    f"so the {'first' if place == '0' else 'second'} is a mass, a wall, or the {facing} end of a "
                    f"{body.kind}",
                    remedy=f"Swap the two, {swap}, or name {face.point.body}.{facing}.",
                    path=f"contacts.{number}.between.{place}",
                )


def _held_ends_are_not_struck(case: CaseBlock) -> None:
    for number in range(len(case.contacts)):
        for place, face in enumerate(faces_of(case, number)):
            body = case.bodies[face.point.body]
            if not isinstance(body, ElasticBlock) or not face.end:
                continue
            held = getattr(body.ends, face.end).kind
            if held in ("clamped", "pinned"):
                raise CaseError(
                    f"the end {face.point.label!r} is {held} and never moves, so a contact there moves no {body.kind}",
                    remedy="Free that end, or put a wall in its place.",
                    path=f"contacts.{number}.between.{place}",
                )


def _gaps_are_open(case: CaseBlock) -> None:
    for number, contact in enumerate(case.contacts):
        gap, moved = contact.gap, 0.0
        for face, sign in zip(faces_of(case, number), (-1.0, 1.0), strict=True):
            body = case.bodies[face.point.body]
            shape = body.profile if isinstance(body, ElasticBlock) else None
            if shape is not None:
                arm = contact.lever_arm or 1.0  # by which a twist moves the face
                shift = arm * float(shape(np.array([face.point.x]))[0])
                gap, moved = gap + sign * shift, max(moved, abs(shift))
        # What a preload takes away must be typed in as the gap: its last digits are rounding.
        if gap < -1e-9 * moved and contact.overlap is None:
            shapes = "" if gap == contact.gap else " with the displacement at t = 0"
            raise CaseError(
                f"the gap is {gap:g} m{shapes}: the faces overlap before the run. Allowed: 0 or more",
                remedy="Give a gap of 0 or more, or say `overlap: allowed` for this contact.",
                path=f"contacts.{number}.gap",
            )


def _order_is_possible(case: CaseBlock) -> None:
    """Refuse a ring such as a left of b, b left of a; walls may stand on both sides."""
    right_of: dict[str, set[str]] = {}
    for number in range(len(case.contacts)):
        faces = faces_of(case, number)
        left, right = faces.left.point.body, faces.right.point.body
        if any(isinstance(case.bodies[name], WallBlock) for name in (left, right)):
            continue
        if "at(" in faces.left.point.label + faces.right.point.label:
            continue
        seen, front = set[str](), {right}
        while front:
            seen |= front
            front = {after for name in front for after in right_of.get(name, ())} - seen
        if left in seen:
            raise CaseError(
                f"{left!r} would lie on the left of {right!r}, and by the other contacts on its right",
                remedy="Of between: [a, b], a lies on the left of b: swap one pair.",
                path=f"contacts.{number}.between",
            )
        right_of.setdefault(left, set()).add(right)


def _round_trips_have_a_rod(case: CaseBlock) -> None:
    named = case.solve.round_trips_of
    rods = [name for name, body in case.bodies.items() if isinstance(body, ElasticBlock)]
    if named is not None:
        find_body(case, named, "solve.round_trips_of")
        if named not in rods:
            raise CaseError(
                f"{named!r} is no rod or beam and has no round trip",
                remedy=f"Rods and beams: {listed(rods)}.",
                path="solve.round_trips_of",
            )
    if isinstance(case.solve.duration, RoundTrips) and not rods:
        raise CaseError(
            "round_trips counts the round trips of a rod or a beam, and this case has none",
            remedy="Give the duration in seconds.",
            path="solve.duration",
        )


def _models_name_rods(case: CaseBlock) -> None:
    for name in case.solve.models:
        body = find_body(case, name, f"solve.models.{name}")
        if not isinstance(body, ElasticBlock):
            raise CaseError(
                f"{name!r} is no rod or beam, and only these have a model",
                remedy="Remove it.",
                path=f"solve.models.{name}",
            )


def _tolerance_stands_alone(case: CaseBlock) -> None:
    if case.solve.tolerance is None:
        if "tolerance_on" in case.solve.model_fields_set:
            raise CaseError(
                "given without tolerance, which it refines",
                remedy="Give solve.tolerance as well, or remove this key.",
                path="solve.tolerance_on",
            )
        return
    for key in CHOSEN:
        if key in case.solve.model_fields_set:
            raise CaseError(
                f"given together with tolerance, which leaves {key} to the automatic choice",
                remedy=f"Keep either tolerance, or {listed(CHOSEN)}.",
                path=f"solve.{key}",
            )


def _contacts_have_laws(case: CaseBlock) -> None:
    for number, contact in enumerate(case.contacts):
        if contact.law is None and case.solve.tolerance is None:
            raise CaseError(
                "this key is missing",
                remedy="Name a law, or give solve.tolerance: a contact without a law is then a hard one.",
                path=f"contacts.{number}.law",
            )


def _one_step_rule(case: CaseBlock) -> None:
    given = [key for key in ("points_per_period", "dt", "courant") if getattr(case.solve.step, key) is not None]
    if len(given) != 1:
        raise CaseError(
            f"{listed(given)} given together" if given else "the step is empty",
            remedy="Give exactly one of points_per_period, dt, courant.",
            path="solve.step",
        )


def _probes_lie_on_bodies(case: CaseBlock) -> None:
    for number, probe in enumerate(case.probes):
        path = f"probes.{number}"
        body = find_body(case, probe.body, f"{path}.body")
        if isinstance(body, ElasticBlock):
            check_place(probe.at, probe.body, body.total_length, f"{path}.at")
            known = body.quantities
            if probe.quantity not in known:
                raise CaseError(
                    f"the {body.kind} {probe.body!r} has no {probe.quantity} to record. Allowed: {', '.join(known)}",
                    remedy="Probe another quantity.",
                    path=f"{path}.quantity",
                )
        elif isinstance(body, WallBlock) or probe.quantity not in ("displacement", "velocity"):
            kind = "wall" if isinstance(body, WallBlock) else "mass"
            allowed = "nothing: it never moves" if kind == "wall" else "displacement, velocity"
            raise CaseError(
                f"the {kind} {probe.body!r} has no {probe.quantity} to record. Allowed: {allowed}",
                remedy="Probe a rod or a beam, or another quantity.",
                path=f"{path}.quantity",
            )
        elif probe.at != 0.0:
            raise CaseError(
                f"{probe.at:g} m on the mass {probe.body!r}, which has no length",
                remedy="Leave `at` out.",
                path=f"{path}.at",
            )


RULES: tuple[Callable[[CaseBlock], None], ...] = (
    _bodies_have_a_shape,
    _sections_are_whole,
    _shapes_are_finite,
    _contacts_join_two_bodies,
    _faces_look_at_each_other,
    _held_ends_are_not_struck,
    shafts_have_lever_arms,
    stops_leave_room,
    _gaps_are_open,
    _order_is_possible,
    _round_trips_have_a_rod,
    _models_name_rods,
    _tolerance_stands_alone,
    _contacts_have_laws,
    _one_step_rule,
    _probes_lie_on_bodies,
)
