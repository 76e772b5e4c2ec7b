"""The pattern of a scene: its network, with its numbers in a vector.

Each part of the network has the places of its numbers in the vector. Scenes of one pattern differ in their numbers
alone. `numbers_of` gives the vector of a scene, `pattern_of` where its parts read theirs;
`impactlab.exact.batch.writing` makes the network at t = 0 of a vector, with the bits of `impactlab.exact.setup.build`.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from impactlab.exact.setup.build import cuts, places_of_contacts
from impactlab.exact.setup.contact_kinds import balanced, massless
from impactlab.exact.setup.network import Log, NetworkLayout
from impactlab.numerics.records import columns
from impactlab.scene.bodies import End, WaveBody
from impactlab.scene.problem import Scene
from impactlab.structures import record
from impactlab.types import Array, Ints

FIXED, INNER, END, RIGID = 0, 1, 2, 3  # kinds of nodes
SUPPORTS = ("free", "mass", "spring", "dashpot")  # of ends that can move, by their numbers here
OF_END = ("velocity", "left value", "left force", "right value", "right force")  # numbers of a rod before its segments
OF_SEGMENT = ("length", "area", "young", "density")


@record
class NodePattern(ctypes.Structure):
    """A node: its kind, and the places of its numbers."""

    kind: int
    body: int
    support: int  # of an end
    value: int  # mass, spring or dashpot; mass of a rigid body
    velocity: int
    force: int


@record
class BodyPattern(ctypes.Structure):
    """A body, in the order in which energies are summed."""

    place: int  # among the bodies that move, in the order of the scene; -1 of a wall
    rigid: int
    held: int  # whether a support can change its momentum
    falls: int
    first: int  # number of the vector: its velocity; of a rigid body its mass, and then the velocity
    first_segment: int  # number of the vector
    segments: int
    first_cut: int
    cuts: int
    first_link: int
    last_link: int


@record
class LinkPattern(ctypes.Structure):
    """A uniform piece of a rod."""

    cut: int  # of its left end
    segment: int  # number of the vector: its length
    left_end: int
    right_end: int


@record
class ContactPattern(ctypes.Structure):
    """A contact of the network."""

    place: int  # among the contacts of the scene
    number: int  # of the vector: gap, stiffness, damping
    pair: int  # of bodies, as the scene has them
    left_body: int
    right_body: int
    hard: int
    bare_left: int  # whether the balance of the left face may give its force
    bare_right: int
    left_alone: int  # whether the left face has no other contact
    right_alone: int


@record
class PairPattern(ctypes.Structure):
    """Two bodies that contacts join."""

    left: int
    right: int


@record
class WholePattern(ctypes.Structure):
    """The scene as a whole."""

    gravity: int  # numbers of the vector
    duration: int  # s, or round trips
    in_round_trips: int
    counted: int  # rod whose round trip counts
    moving: int  # bodies


class Pattern(NamedTuple):
    """The pattern of a scene as the compiled code takes it."""

    whole: Sequence[WholePattern]  # (1,)
    nodes: Sequence[NodePattern]
    bodies: Sequence[BodyPattern]
    links: Sequence[LinkPattern]
    contacts: Sequence[ContactPattern]
    pairs: Sequence[PairPattern]
    cuts: Ints  # of all rods: how many segments lie before it, or -1 - place among the fixed ones
    fixed: Array  # m, places of inner contacts

    def same_as(self, other: Pattern) -> bool:
        """Return whether two scenes differ in numbers alone."""
        return all(np.array_equal(np.asarray(a), np.asarray(b)) for a, b in zip(self, other, strict=True))


def numbers_of(scene: Scene, layout: NetworkLayout, log: Log, round_trips: float | None) -> Array:
    """Return the vector of a scene; ``round_trips`` is its duration where it is given so."""
    values: list[float] = []
    for body in scene.bodies.values():
        if (rod := body.waves) is not None:
            values += [rod.velocity, rod.left.value, rod.left.force, rod.right.value, rod.right.force]
            for each in rod.segments:
                values += [each.length, each.area, each.young, each.density]
        elif body.moves:
            values += [body.rigid_mass, body.velocity]
    back = np.argsort(layout.places)  # contact of the scene -> of the network
    for contact, place in zip(scene.contacts, back.tolist(), strict=True):
        values += [contact.gap, float(log.contacts["stiffness"][place]), float(log.contacts["damping"][place])]
    return np.array([*values, scene.gravity, scene.duration if round_trips is None else round_trips])


def _starts(scene: Scene) -> tuple[dict[str, int], int]:
    """Return the places in the vector of each body's first number, and of the contacts'."""
    starts, at = dict[str, int](), 0
    for name, body in scene.bodies.items():
        starts[name] = at
        if (rod := body.waves) is not None:
            at += len(OF_END) + len(OF_SEGMENT) * len(rod.segments)
        elif body.moves:
            at += 2
    return starts, at


def pattern_of(scene: Scene, layout: NetworkLayout, log: Log, counted: str, in_round_trips: bool) -> Pattern:
    """Return the pattern of a scene with its network.

    ``counted`` is the rod whose round trip counts.
    """
    starts, first_contact = _starts(scene)
    order, touched = list(scene.in_order), places_of_contacts(scene)
    moving = [name for name, body in scene.bodies.items() if body.moves]
    node, nodes = columns(NodePattern, len(log.nodes))
    body_taken, bodies = columns(BodyPattern, len(order))
    link_rows: list[tuple[int, ...]] = []
    cut_codes: list[int] = []
    fixed: list[float] = []
    nodes["kind"] = FIXED
    for number, name in enumerate(order):
        body, first, own = scene.bodies[name], starts[name], layout.nodes[name]
        row: dict[str, Any] = {"place": moving.index(name) if body.moves else -1, "rigid": body.waves is None}
        row |= {"held": body.is_held, "falls": body.falls, "first": first, "first_link": len(link_rows)}
        if (rod := body.waves) is not None:
            places = cuts(rod, touched.get(name, ()))
            row |= {"first_segment": first + len(OF_END), "segments": len(rod.segments)}
            row |= {"first_cut": len(cut_codes), "cuts": len(places)}
            for link in layout.links[name]:
                at = places.index(link.x)
                piece = [each is link.segment for each in rod.segments].index(True)
                segment = first + len(OF_END) + len(OF_SEGMENT) * piece
                link_rows.append((len(cut_codes) + at, segment, link.left_end, link.right_end))
            cut_codes += _codes(rod, places, fixed)
            for place, end, value in ((own[0], rod.left, first + 1), (own[-1], rod.right, first + 3)):
                nodes[place] = _node_of(end, number, value, first)
            for place in own[1:-1]:
                nodes[place] = INNER, number, 0, 0, 0, 0
        elif body.moves:
            nodes[own[0]] = RIGID, number, 0, first, first + 1, 0
        row["last_link"] = len(link_rows)
        for key, value in row.items():
            bodies[key][number] = value
    link_taken, links = columns(LinkPattern, len(link_rows))
    links[:] = link_rows
    pair_names = list(dict.fromkeys((contact.left.body, contact.right.body) for contact in scene.contacts))
    pair_taken, pairs = columns(PairPattern, len(pair_names))
    pairs[:] = [(order.index(left), order.index(right)) for left, right in pair_names]
    whole_taken, whole = columns(WholePattern, 1)
    last = first_contact + 3 * len(scene.contacts)
    whole[0] = last, last + 1, in_round_trips, order.index(counted), len(moving)
    contact_taken = _contacts(scene, layout, log, first_contact, order, pair_names)
    return Pattern(
        whole_taken, node, body_taken, link_taken, contact_taken, pair_taken,
        np.array(cut_codes, np.int64), np.array(fixed),
    )  # fmt: skip


def _codes(rod: WaveBody, places: list[float], fixed: list[float]) -> list[int]:
    """Return how each place of a rod follows from its vector.

    Places that do not follow from it are added to the fixed ones.
    """
    ends = [0.0]
    for segment in rod.segments:
        ends.append(ends[-1] + segment.length)
    codes = []
    for x in places:
        if x in ends:
            codes.append(ends.index(x))
        else:
            fixed.append(x)
            codes.append(-len(fixed))
    return codes


def _node_of(end: End, body: int, value: int, first: int) -> tuple[int, ...]:
    if end.kind == "clamped":
        return FIXED, body, 0, 0, 0, 0
    return END, body, SUPPORTS.index(end.kind), value, first, value + 1


def _contacts(
    scene: Scene, layout: NetworkLayout, log: Log, first: int, order: list[str], pairs: list[tuple[str, str]]
) -> Sequence[ContactPattern]:
    """Return the patterns of the contacts, in the order of the network."""
    taken, contacts = columns(ContactPattern, len(scene.contacts))
    hard = [n for n, c in zip(layout.places.tolist(), log.contacts["stiffness"].tolist(), strict=True) if c < 0.0]
    faces, _ = balanced(scene, sorted(hard), massless)
    of_contacts = [*log.contacts["left"].tolist(), *log.contacts["right"].tolist()]
    for number, place in enumerate(layout.places.tolist()):
        contact, record_of = scene.contacts[place], log.contacts[number]
        sides = [side for _, side in faces.get(place, [])]
        row = {"place": place, "number": first + 3 * place, "hard": place in hard}
        row["pair"] = pairs.index((contact.left.body, contact.right.body))
        for side, (key, point) in enumerate((("left", contact.left), ("right", contact.right))):
            face = int(record_of[key])
            row |= {f"{key}_body": order.index(point.body), f"bare_{key}": side in sides}
            row[f"{key}_alone"] = of_contacts.count(face) == 1
        for name, value in row.items():
            contacts[name][number] = value
    return taken


def misfit(scene: Scene) -> str:
    """Return why a scene's numbers do not fit into a vector.

    The text is empty where they do. Rods start without a displacement of their own, and no two segments are one piece,
    of which a sweep may change one.
    """
    elastic = [body.elastic for body in scene.bodies.values() if body.elastic is not None]
    if any(body.displacement is not None for body in elastic):
        return "rods that start with a displacement"
    for body in elastic:
        if any(one.continues_in(other) for one, other in pairwise(body.segments)):
            return f"neighbouring segments of '{body.name}' have the same section and material"
    return "" if all(math.isfinite(contact.gap) for contact in scene.contacts) else "gaps that are not finite"
