"""Network of a scene: nodes, rod pieces and contacts, by junction."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from impactlab.exact.setup.branch_tables import with_branches
from impactlab.exact.setup.contact_kinds import Bond, bonds_of
from impactlab.exact.setup.end_loads import loaded
from impactlab.exact.setup.initial_waves import MIN_ROOM, with_first_pieces
from impactlab.exact.setup.network import Link, Log, NetworkLayout, copied, empty_log, with_room
from impactlab.numerics.addresses import COMPILED
from impactlab.numerics.unions import Unions
from impactlab.scene.bodies import End, Segment, WaveBody
from impactlab.scene.method import Method
from impactlab.scene.problem import Point, Scene
from impactlab.types import Ints

MERGE_TOL = 1.0e-12  # of the shortest round trip: closer breaks are merged
SAME_CUT = 1.0e-12  # of the length of a rod: nearer places are one node
MAX_KEPT = 100  # nodes of a drawing whose order is kept


class Node(NamedTuple):
    """A node at t = 0."""

    mass: float  # kg; inf where it never moves
    v: float = 0.0  # m/s
    u: float = 0.0  # m
    spring: float = 0.0  # N/m, to the ground
    dashpot: float = 0.0  # N s/m, to the ground
    end_force: float = 0.0  # N


class Drawing(NamedTuple):
    """A network before it is ordered by junction.

    Ends 2 i and 2 i + 1 are those of piece i.
    """

    nodes: list[Node]
    members: dict[str, list[int]]  # nodes of each body
    pieces: list[tuple[str, float, float, Segment]]  # rod, place of the left end and length [m], segment
    end_nodes: list[int]
    pairs: list[tuple[int, int]]  # nodes of each contact


def cuts(rod: WaveBody, touched: Sequence[float]) -> list[float]:
    """Return the places of the nodes of a rod [m].

    They are ends, boundaries where the section changes, and inner contact points. ``touched`` are the places of its
    contacts [m].
    """
    places, end = [0.0], 0.0
    for number, segment in enumerate(rod.segments, start=1):
        end += segment.length
        if number == len(rod.segments) or not segment.continues_in(rod.segments[number]):  # else nothing is reflected
            places.append(end)
    places.extend(x for x in touched if 0.0 < x < rod.length)
    merged: list[float] = []
    for x in sorted(places):
        if not merged or x - merged[-1] > SAME_CUT * rod.length:
            merged.append(x)
    return merged


def places_of_contacts(scene: Scene) -> dict[str, list[float]]:
    """Return the places [m] of the contacts of each body that has any."""
    touched: dict[str, list[float]] = {}
    for contact in scene.contacts:
        for point in contact.faces:
            touched.setdefault(point.body, []).append(point.x)
    return touched


def end_node(end: End, velocity: float, displacement: float) -> Node:
    """Return the node of a rod's end with its support."""
    if end.kind == "clamped":
        return Node(math.inf, u=displacement)
    value = {end.kind: end.value}
    mass, spring, dashpot = (value.get(kind, 0.0) for kind in ("mass", "spring", "dashpot"))
    return Node(mass, velocity if mass > 0.0 else 0.0, displacement, spring, dashpot, end.force)


def draw(scene: Scene) -> Drawing:
    """Return the nodes, pieces and contacts of a scene in the order found."""
    drawing = Drawing([], {}, [], [], [])
    nodes, members = drawing.nodes, drawing.members
    places: dict[str, list[float]] = {}
    touched = places_of_contacts(scene)
    for name, any_body in scene.in_order.items():
        body, first = any_body.waves, len(nodes)
        if body is not None:
            x = places[name] = cuts(body, touched.get(name, ()))
            shape = [0.0] * len(x) if body.displacement is None else [float(u) for u in body.displacement(np.array(x))]
            nodes.append(end_node(body.left, body.velocity, shape[0]))
            nodes.extend(Node(0.0, u=u) for u in shape[1:-1])
            nodes.append(end_node(body.right, body.velocity, shape[-1]))
            for number, (start, stop) in enumerate(pairwise(x)):
                drawing.pieces.append((name, start, stop - start, body.segment_at(0.5 * (start + stop))))
                drawing.end_nodes.extend((first + number, first + number + 1))
        elif any_body.rigid_mass < math.inf:
            nodes.append(Node(any_body.rigid_mass, any_body.velocity))
        members[name] = list(range(first, len(nodes)))

    def node_at(point: Point) -> int:
        if point.body in places:
            away = [abs(x - point.x) for x in places[point.body]]
            return members[point.body][away.index(min(away))]
        if not scene.bodies[point.body].moves:  # a wall ties nothing together: one node for every contact
            members[point.body].append(len(nodes))
            nodes.append(Node(math.inf))
        return members[point.body][-1]

    drawing.pairs.extend((node_at(contact.left), node_at(contact.right)) for contact in scene.contacts)
    return drawing


def junctions(count: int, pairs: Sequence[tuple[int, int]]) -> Ints:
    """Return the junction of every node: nodes linked by contacts share one."""
    groups = Unions[int]()
    for a, b in pairs:
        groups.join(a, b)
    label = [groups.leader(node) for node in range(count)]
    known = {value: i for i, value in enumerate(dict.fromkeys(label))}
    return np.array([known[value] for value in label], np.int64)


def force_scales(drawing: Drawing, pairs: list[tuple[int, int]], bonds: list[Bond], z: list[float]) -> list[float]:
    """Return the impedance of the rods at each contact [N s/m].

    It is the scale of the contact force; ``z`` holds that of each end [N s/m].
    """
    scales, at_node = [], [0.0] * len(drawing.nodes)
    for node, impedance in zip(drawing.end_nodes, z, strict=True):
        at_node[node] += impedance
    contacts_at = Counter(node for pair in pairs for node in set(pair))
    for pair, bond in zip(pairs, bonds, strict=True):
        sides = [at_node[node] for node in pair]
        # The force of a face with other contacts follows from theirs, too.
        alone = bond.face is not None and contacts_at[pair[bond.face]] == 1
        scale = sides[bond.face] if bond.face is not None and alone else max(sides)
        scales.append(scale if scale > 0.0 else bond.rigid_scale(*(drawing.nodes[node].mass for node in pair)))
    return scales


class Order(NamedTuple):
    """Nodes, ends and contacts of a drawing in the order of their junctions."""

    nodes: Ints  # of the drawing, in this order
    ends: Ints
    contacts: Ints
    new_nodes: list[int]  # places in this order, by the number in the drawing
    new_ends: list[int]
    junctions: dict[str, Ints]  # of each node, end and contact, in this order
    first: dict[str, Ints]  # number of the first node, end and contact of each junction, and beyond the last
    counts: dict[str, Ints]  # of nodes, ends and contacts of each junction


class Joints(NamedTuple):
    """Connections of a drawing's nodes, ends and contacts, which determine their order."""

    nodes: int
    end_nodes: tuple[int, ...]  # node of each end
    pairs: tuple[tuple[int, int], ...]  # nodes of each contact
    turns: tuple[int, ...]  # by which contacts of one junction are ordered


def ordered(joints: Joints) -> Order:
    """Return the order of the parts of a drawing by junction."""
    junction = junctions(joints.nodes, joints.pairs)
    of_ends, of_contacts = junction[[*joints.end_nodes]], junction[[a for a, _ in joints.pairs]]
    nodes, ends = np.argsort(junction, kind="stable"), np.argsort(of_ends, kind="stable")
    contacts = np.lexsort((np.array(joints.turns), of_contacts))
    steps = np.arange(int(junction.max()) + 2)
    ranges = {"node": junction[nodes], "end": of_ends[ends], "contact": of_contacts[contacts]}
    first = {kind: np.searchsorted(of, steps) for kind, of in ranges.items()}
    counts = {kind: of[1:] - of[:-1] for kind, of in first.items()}
    return Order(nodes, ends, contacts, np.argsort(nodes).tolist(), np.argsort(ends).tolist(), ranges, first, counts)


def build(scene: Scene, method: Method) -> tuple[NetworkLayout, Log]:
    """Return the network of a scene and its log at t = 0.

    Raises `CaseError` or `PairingError`.
    """
    bonds = bonds_of(scene, method)
    drawing = draw(scene)
    turns = tuple([bond.turn for bond in bonds])
    order, log = blank(Joints(len(drawing.nodes), tuple(drawing.end_nodes), tuple(drawing.pairs), turns))
    bonds = [bonds[c] for c in order.contacts]
    z = [segment.impedance for *_, segment in drawing.pieces for _ in range(2)]
    transit = [length / segment.wave_speed for _, _, length, segment in drawing.pieces for _ in range(2)]
    tolerance = MERGE_TOL * 2.0 * min(transit)
    log.state["gravity"], log.state["duration"], log.state["tolerance"] = scene.gravity, scene.duration, tolerance
    neglect_masses(drawing, z, tolerance)
    write_nodes(log, drawing, order)
    log.ends["impedance"], log.ends["transit"] = np.array((z, transit))[:, order.ends]
    write_contacts(log, scene, drawing, order, bonds, z)
    if any(bond.branches is not None for bond in bonds):
        log = with_branches(log, [bond.branches for bond in bonds])
    layout = layout_of(drawing, order)
    ends_with_loads = {
        layout.nodes[name][0 if x == 0.0 else -1]: load for name in layout.links for x, load in scene.bodies[name].loads
    }
    return layout, with_first_pieces(scene, layout, loaded(log, ends_with_loads, scene.duration))


def blank(joints: Joints) -> tuple[Order, Log]:
    """Return the order of a drawing and a log without numbers.

    Small ones are kept for scenes that differ in their numbers. Nothing else than the joints sets either.
    """
    if joints.nodes > MAX_KEPT or not COMPILED:
        return joined(joints)
    order, log = kept(joints)
    return order, copied(log)


def joined(joints: Joints) -> tuple[Order, Log]:
    """Return the order of a drawing and a log with its connections.

    The log has its junctions, the places of its parts, and the ends where waves arrive.
    """
    order = ordered(joints)
    counts = order.counts
    rows = 2 * counts["node"] + 2 * counts["end"] + counts["contact"]
    log = empty_log(len(rows), len(order.nodes), len(order.ends), len(order.contacts), int(rows.max()))
    log = with_room(log, MIN_ROOM, 0, MIN_ROOM)
    for kind, of in order.first.items():
        log.junctions[f"first_{kind}"], log.junctions[f"last_{kind}"] = of[:-1], of[1:]
    log.junctions["nodes"], log.junctions["ends"], log.junctions["rows"] = counts["node"], counts["end"], rows
    log.junctions["burst"] = -np.inf
    log.nodes["junction"] = order.junctions["node"]
    of_ends = order.junctions["end"]
    peer = np.array(order.new_ends)[order.ends ^ 1]  # emits the wave that arrives
    source = of_ends[peer]
    log.ends["node"], log.ends["junction"] = [order.new_nodes[joints.end_nodes[e]] for e in order.ends], of_ends
    log.ends["source"], log.ends["row"] = source, 2 * counts["node"][source] + peer - order.first["end"][source]
    pairs = [joints.pairs[c] for c in order.contacts]
    log.contacts["left"], log.contacts["right"] = [[order.new_nodes[pair[side]] for pair in pairs] for side in range(2)]
    return order, log


kept = lru_cache(maxsize=16)(joined)


def neglect_masses(drawing: Drawing, z: Sequence[float], tolerance: float) -> None:
    """Leave out masses whose delay of an echo is below rounding.

    A mass m delays an echo by 2 m/Z; the rounding is that of a round trip.
    """
    nodes = drawing.nodes
    for node, impedance in zip(drawing.end_nodes, z, strict=True):
        if 0.0 < nodes[node].mass <= impedance * tolerance:
            nodes[node] = nodes[node]._replace(mass=0.0, v=0.0)


def write_nodes(log: Log, drawing: Drawing, order: Order) -> None:
    """Write the nodes at t = 0."""
    for name, column in zip(Node._fields, zip(*(drawing.nodes[n] for n in order.nodes), strict=True), strict=True):
        log.nodes[name] = column


def write_contacts(log: Log, scene: Scene, drawing: Drawing, order: Order, bonds: list[Bond], z: list[float]) -> None:
    """Write the constants of contacts.

    They are gap, stiffness and damping, the face that gives a force, and the scale of the force.
    """
    new, pairs = order.new_nodes, [drawing.pairs[c] for c in order.contacts]
    faces = [-1 if bond.face is None else new[pair[bond.face]] for pair, bond in zip(pairs, bonds, strict=True)]
    log.contacts["face"], log.contacts["gap"] = faces, [scene.contacts[c].gap for c in order.contacts]
    log.contacts["stiffness"] = [bond.stiffness for bond in bonds]
    log.contacts["damping"] = [bond.damping for bond in bonds]
    log.contacts["impedance"] = force_scales(drawing, pairs, bonds, z)


def layout_of(drawing: Drawing, order: Order) -> NetworkLayout:
    """Return the places of bodies' pieces and nodes, and contacts, in the log."""
    links: dict[str, list[Link]] = {}
    for number, (name, x, length, segment) in enumerate(drawing.pieces):
        ends = order.new_ends[2 * number : 2 * number + 2]
        start = drawing.nodes[drawing.end_nodes[2 * number]].u
        links.setdefault(name, []).append(Link(x, length, segment, start, *ends))
    return NetworkLayout(
        {name: tuple(row) for name, row in links.items()},
        {name: tuple(order.new_nodes[node] for node in row) for name, row in drawing.members.items()},
        order.contacts,
    )
