"""Rules on several keys of a case together, checked in order before a scene is built."""

from __future__ import annotations

from collections.abc import Callable, Container
from typing import Any

import numpy as np

from impactlab.casefile.blocks.shared import ElasticBlock
from impactlab.casefile.contacts import RULES_OF_CONTACTS, AllContacts, contact_of
from impactlab.casefile.instruments import instruments_are_whole
from impactlab.casefile.joined import check_bonds, is_joined
from impactlab.casefile.mechanisms import check_mechanisms, gravity_is_one, links_of, tolerance_serves
from impactlab.casefile.points import find_body, place_on
from impactlab.casefile.schema import CHOSEN, CaseBlock, Frames, ProbeBlock, RoundTrips, WallBlock
from impactlab.casefile.text.words import listed, shown
from impactlab.casefile.values.faults import SNAPSHOTS
from impactlab.errors import CaseError, combined
from impactlab.plugins import Registry
from impactlab.scene.bodies import Table
from impactlab.scene.bodies.segmented import PLACE_ROUNDING
from impactlab.scene.ranges import range_of

BASE = "base"  # name of the case as written, among its methods and its variants
OF_LINKS = ("bending_moment", "shear_force", "stress", "strain")  # probes on flexible links of mechanisms
LAST_DIGITS = 1e-12  # of a length: a sum of segments may differ by them
MAX_TURN, MAX_TURN_OF_TABLE = 0.02, 0.5  # of the largest slope of a shape, at a clamped end; of a table of few lines


def check(case: CaseBlock, registry: Registry) -> AllContacts:
    """Return the contacts of a case.

    Raises the `CaseError` of the first broken rule, which holds the others.
    """
    faults: list[CaseError] = []

    def follow(rule: Callable[..., None], *given: Any) -> None:
        try:
            rule(*given)
        except CaseError as error:
            faults.append(error)

    for rule in RULES_OF_BODIES:
        for name, body in case.bodies.items():
            if isinstance(body, ElasticBlock):
                follow(rule, body, f"bodies.{name}")
    follow(check_mechanisms, case)
    if faults:
        raise combined(faults)
    found = AllContacts()
    for number in range(len(case.contacts)):
        follow(_add_contact, found, case, number, registry)
    for check_contact in RULES_OF_CONTACTS:
        for contact in found.contacts:
            follow(check_contact, contact)
    for check_case in (check_bonds, *RULES):
        follow(check_case, case)
    if faults:
        raise combined(faults)
    return found


def _add_contact(found: AllContacts, case: CaseBlock, number: int, registry: Registry) -> None:
    found.contacts.append(contact_of(case, number, found, is_joined(case.contacts[number], registry)))


def reference_rod(case: CaseBlock) -> str | None:
    """Return the body whose round trip is T: the one named, else the first."""
    if case.solve.round_trips_of is not None:
        return case.solve.round_trips_of
    links = links_of(case)
    bodies = ((name, body) for name, body in case.bodies.items() if name not in links)
    return next((name for name, body in bodies if isinstance(body, ElasticBlock)), None)


def _has_a_shape(body: ElasticBlock, path: str) -> None:
    keys, in_segments = body.shape_keys, body.segments is not None
    for key in keys:
        given = body.gives(key)
        if in_segments and given:
            raise CaseError(
                f"given together with segments, which replace {keys[0]}, {keys[1]} and {keys[2]}",
                remedy=f"Keep either {key} or segments.",
                path=f"{path}.{key}",
            )
        if not in_segments and not given:
            first, second, third = (body.shape_words.get(each, each) for each in keys)
            raise CaseError(
                "this key is missing",
                remedy=f"A {body.kind} has {first}, {second} and {third}, or segments with these three each.",
                path=f"{path}.{key}",
            )


def _sections_are_whole(body: ElasticBlock, path: str) -> None:
    for number, piece in enumerate(body.pieces):
        body.check_piece(piece, path if body.segments is None else f"{path}.segments.{number}")


def _profile_is_finite(body: ElasticBlock, path: str) -> None:
    given, shape = getattr(body, body.profile_key), body.profile
    if given is None or shape is None:
        return
    path, length, unit = f"{path}.{body.profile_key}", body.total_length, body.profile_unit
    if isinstance(given, Table) and (given.x[0] > 0.0 or given.x[-1] < length * (1.0 - LAST_DIGITS)):
        raise CaseError(
            f"the table goes from {given.x[0]:g} to {given.x[-1]:g} m; the {body.kind} from 0 to {length:g} m",
            remedy=f"Give values over the whole {body.kind}.",
            path=path,
        )
    values, largest = shape(np.linspace(0.0, length, 1001)), range_of("m").most
    finite = np.all(np.isfinite(values))
    if not finite or np.max(np.abs(values)) > largest:
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
    slopes = np.abs(np.diff(values))
    level = slopes.max() * (MAX_TURN_OF_TABLE if isinstance(given, Table) else MAX_TURN)
    for side, slope in (("left", slopes[0]), ("right", slopes[-1])):
        if body.kind == "beam" and getattr(body.ends, side).kind == "clamped" and slope > level:
            raise CaseError(
                f"the {body.profile_key} turns the clamped {side} end by {slope * (values.size - 1) / length:.3g}; "
                "a clamped end of a beam does not turn",
                remedy=f"Choose a shape that is level there, such as x**2 from a left end, or give {side}: pinned.",
                path=path,
            )


def _round_trips_have_a_rod(case: CaseBlock) -> None:
    named = case.solve.round_trips_of
    links = links_of(case)
    rods = [name for name, body in case.bodies.items() if isinstance(body, ElasticBlock) and name not in links]
    if named is not None:
        find_body(case, named, "solve.round_trips_of")
        if named not in rods:
            raise CaseError(
                f"{named!r} is a {'link' if named in links else case.bodies[named].kind} and has no round trip",
                remedy=f"Rods, beams and shafts of this case: {listed(rods)}.",
                path="solve.round_trips_of",
            )
    if isinstance(case.solve.duration, RoundTrips) and not rods:
        raise CaseError(
            "round_trips counts the round trips of a rod, a beam or a shaft, and this case has none",
            remedy="Give the duration in seconds.",
            path="solve.duration",
        )


def _models_name_rods(case: CaseBlock) -> None:
    for name in case.solve.models:
        body = find_body(case, name, f"solve.models.{name}")
        if not isinstance(body, ElasticBlock):
            raise CaseError(
                f"{name!r} is a {body.kind}; only rods, beams and shafts have a model",
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


def _one_step_rule(case: CaseBlock) -> None:
    given = [key for key in ("points_per_period", "dt", "courant") if getattr(case.solve.step, key) is not None]
    if len(given) != 1:
        raise CaseError(
            f"{listed(given)} given together" if given else "the step is empty",
            remedy="Give exactly one of points_per_period, dt, courant.",
            path="solve.step",
        )


def _one_spacing_of_snapshots(case: CaseBlock) -> None:
    if isinstance(case.snapshots, Frames) and (case.snapshots.every is None) == (case.snapshots.count is None):
        raise CaseError(
            "every and count are given together" if case.snapshots.every is not None else "the block is empty",
            remedy=SNAPSHOTS,
            path="snapshots",
        )


def _probes_lie_on_bodies(case: CaseBlock) -> None:
    links, faults = links_of(case), list[CaseError]()
    for number, probe in enumerate(case.probes):
        try:
            _lies_on_a_body(case, probe, f"probes.{number}", links)
        except CaseError as error:
            faults.append(error)
    if faults:
        raise combined(faults)


def _lies_on_a_body(case: CaseBlock, probe: ProbeBlock, path: str, links: Container[str]) -> None:
    body = find_body(case, probe.body, f"{path}.body")
    recorded = f"Each run records angle:{probe.body}, rate:{probe.body} and the places of its contacts."
    if probe.body in links and not isinstance(body, ElasticBlock):
        raise CaseError(
            f"{probe.body!r} is a rigid link, of which no {probe.quantity} is recorded",
            remedy=f"Remove it, or make the link a beam. {recorded}",
            path=f"{path}.body",
        )
    if isinstance(body, ElasticBlock):
        place_on(probe.at, probe.body, body.total_length, f"{path}.at")
        kind, known = ("link", OF_LINKS) if probe.body in links else (body.kind, body.quantities)
        if probe.quantity not in known:
            raise CaseError(
                f"the {kind} {probe.body!r} has no {probe.quantity} to record. Allowed: {', '.join(known)}",
                remedy=recorded if probe.body in links else "Probe another quantity.",
                path=f"{path}.quantity",
            )
        if why := body.lacking(probe.quantity):
            raise CaseError(
                f"the {body.kind} {probe.body!r} has no {probe.quantity} to record",
                remedy=f"{why[0].upper()}{why[1:]}.",
                path=f"{path}.quantity",
            )
    elif isinstance(body, WallBlock) or probe.quantity not in ("displacement", "velocity"):
        kind = "wall" if isinstance(body, WallBlock) else "mass"
        allowed = "nothing: it never moves" if kind == "wall" else "displacement, velocity"
        raise CaseError(
            f"the {kind} {probe.body!r} has no {probe.quantity} to record. Allowed: {allowed}",
            remedy="Probe a rod or a beam, or another quantity. Contact forces are recorded without a probe.",
            path=f"{path}.quantity",
        )
    elif probe.at != 0.0:
        raise CaseError(
            f"{probe.at:g} m on the mass {probe.body!r}, which has no length",
            remedy="Leave `at` out.",
            path=f"{path}.at",
        )


def _probes_have_channels_of_their_own(case: CaseBlock) -> None:
    """Raise `CaseError` where two probes of a quantity share a channel name.

    Their places differ by less than the six digits of the name show.
    """
    first: dict[tuple[str, str, str], int] = {}
    for number, probe in enumerate(case.probes):
        other = first.setdefault((probe.body, probe.quantity, f"{probe.at:.6g}"), number)
        at = case.probes[other].at
        if abs(probe.at - at) > PLACE_ROUNDING * abs(at):
            channel = f"{probe.quantity}:{probe.body}@{at:.6g}"
            raise CaseError(
                f"probes.{other} at {at:.12g} m and this one at {probe.at:.12g} m have one channel, {channel}: "
                "channels name places by six digits. Allowed: places that differ in six digits",
                remedy="Move one of the two away from the other, or remove it.",
                path=f"probes.{number}.at",
            )


def _base_is_the_case(case: CaseBlock) -> None:
    for block, what in (("methods", "the case as written"), ("variants", "the scene as written")):
        if BASE in getattr(case, block):
            raise CaseError(
                f"{BASE!r} is the name of {what}, and a {block[:-1]} of that name would never run",
                remedy=f"Give the {block[:-1]} another name.",
                path=f"{block}.{BASE}",
            )


RULES_OF_BODIES: tuple[Callable[[ElasticBlock, str], None], ...] = (
    _has_a_shape,
    _sections_are_whole,
    _profile_is_finite,
)
RULES: tuple[Callable[[CaseBlock], None], ...] = (
    tolerance_serves,
    gravity_is_one,
    _round_trips_have_a_rod,
    _models_name_rods,
    _tolerance_stands_alone,
    _one_step_rule,
    _one_spacing_of_snapshots,
    _probes_lie_on_bodies,
    _probes_have_channels_of_their_own,
    instruments_are_whole,
    _base_is_the_case,
)
