"""Network of a scene for the exact solver: nodes, rod pieces, junctions; refusal with a reason."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from impactlab.exact.contact_kinds import Bond, check
from impactlab.exact.initial_waves import end_pieces, first_records
from impactlab.exact.network import Layout, Link, Log, Network
from impactlab.scene.bodies import End, WaveBody
from impactlab.scene.method import Method
from impactlab.scene.problem import Point, Scene

MERGE_TOL = 1.0e-12  # of the shortest round trip: closer breaks are merged


@dataclass
class Nodes:
    """Nodes as they are laid out, before they are ordered by junction."""

    mass: list[float] = field(default_factory=list)
    spring: list[float] = field(default_factory=list)
    dashpot: list[float] = field(default_factory=list)
    push: list[float] = field(default_factory=list)
    u: list[float] = field(default_factory=list)
    v: list[float] = field(default_factory=list)

    def add(
        self, mass: float, v: float, u: float = 0.0, spring: float = 0.0, dashpot: float = 0.0, push: float = 0.0
    ) -> int:
        """Add a node and return its number; fixed nodes have no velocity."""
        self.mass.append(mass)
        self.spring.append(spring)
        self.dashpot.append(dashpot)
        self.push.append(push)
        self.u.append(u)
        self.v.append(v if 0.0 < mass < math.inf else 0.0)
        return len(self.mass) - 1


def cuts(rod: WaveBody, scene: Scene) -> list[float]:
    """Return the places [m] of the nodes of a rod: ends, segment boundaries, inner contact points."""
    places = [0.0]
    for segment in rod.segments:
        places.append(places[-1] + segment.length)
    for contact in scene.contacts:
        for point in (contact.left, contact.right):
            if point.body == rod.name and 0.0 < point.x < rod.length:
                places.append(point.x)
    merged: list[float] = []
    for x in sorted(places):
        if not merged or x - merged[-1] > 1e-12 * rod.length:
            merged.append(x)
    return merged


def end_node(nodes: Nodes, end: End, velocity: float, displacement: float) -> int:
    """Add the node of a rod's end with its support."""
    if end.kind == "clamped":
        return nodes.add(math.inf, 0.0, displacement)
    if end.kind == "mass":
        return nodes.add(end.value, velocity, displacement, push=end.force)
    spring = end.value if end.kind == "spring" else 0.0
    dashpot = end.value if end.kind == "dashpot" else 0.0
    return nodes.add(0.0, 0.0, displacement, spring, dashpot, end.force)


def drop_light(nodes: Nodes, end_nodes: list[int], impedance: list[float], shortest: float) -> None:
    """Neglect end masses with a time constant below the shortest time resolved [s].

    An end mass m delays an echo by 2 m/Z; here by less than the rounding of a round trip.
    """
    for node, z in zip(end_nodes, impedance, strict=True):
        if 0.0 < nodes.mass[node] <= z * shortest:
            nodes.mass[node] = nodes.v[node] = 0.0


def junctions(count: int, pairs: list[tuple[int, int]]) -> list[int]:
    """Return the junction of every node: nodes linked by contacts share one."""
    label = list(range(count))
    for a, b in pairs:
        old, new = label[b], label[a]
        label = [new if value == old else value for value in label]
    known = {value: i for i, value in enumerate(dict.fromkeys(label))}
    return [known[value] for value in label]


def build(scene: Scene, method: Method) -> tuple[Layout, Log]:
    """Return the network of a scene and its log at t = 0; raises `CaseError` or `PairingError`."""
    bonds = check(scene, method)
    nodes = Nodes()
    links: dict[str, tuple[Link, ...]] = {}
    members: dict[str, list[int]] = {}
    places: dict[str, list[float]] = {}
    end_nodes: list[int] = []
    impedance: list[float] = []
    transit: list[float] = []
    for name, any_body in scene.in_order.items():
        body = any_body.waves
        if body is not None:
            x = cuts(body, scene)
            shape = [0.0] * len(x) if body.displacement is None else [float(u) for u in body.displacement(np.array(x))]
            row = [end_node(nodes, body.left, body.velocity, shape[0])]
            row += [nodes.add(0.0, 0.0, u) for u in shape[1:-1]]
            row.append(end_node(nodes, body.right, body.velocity, shape[-1]))
            pieces = []
            for i in range(len(x) - 1):
                middle = 0.5 * (x[i] + x[i + 1])
                edge = 0.0
                segment = body.segments[-1]
                for candidate in body.segments:
                    edge += candidate.length
                    if middle < edge:
                        segment = candidate
                        break
                count = len(end_nodes)
                link = Link(x[i], x[i + 1] - x[i], segment.area, segment.young, segment.density, count, count + 1)
                end_nodes += [row[i], row[i + 1]]
                impedance += [segment.impedance] * 2
                transit += [link.transit] * 2
                pieces.append(link)
            links[name] = tuple(pieces)
            members[name] = row
            places[name] = x
        else:
            members[name] = (
                [nodes.add(any_body.rigid_mass, any_body.velocity)] if any_body.rigid_mass < math.inf else []
            )

    def node_at(point: Point) -> int:
        if point.body in places:
            return members[point.body][int(np.argmin([abs(x - point.x) for x in places[point.body]]))]
        if not scene.bodies[point.body].moves:  # a wall ties nothing together: one node for every contact
            members[point.body].append(nodes.add(math.inf, 0.0))
        return members[point.body][-1]

    pairs = [(node_at(contact.left), node_at(contact.right)) for contact in scene.contacts]
    return assemble(scene, bonds, nodes, links, members, end_nodes, impedance, transit, pairs)


def assemble(
    scene: Scene,
    bonds: list[Bond],
    nodes: Nodes,
    links: dict[str, tuple[Link, ...]],
    members: dict[str, list[int]],
    end_nodes: list[int],
    impedance: list[float],
    transit: list[float],
    pairs: list[tuple[int, int]],
) -> tuple[Layout, Log]:
    """Order nodes, ends and contacts by junction and fill the arrays."""
    junction = junctions(len(nodes.mass), pairs)
    total = max(junction) + 1
    node_order = np.argsort(junction, kind="stable")
    node_new = np.argsort(node_order)
    end_junction = np.array([junction[n] for n in end_nodes], dtype=np.int64)
    end_order = np.argsort(end_junction, kind="stable")
    end_new = np.argsort(end_order)
    contact_junction = np.array([junction[a] for a, _ in pairs], dtype=np.int64)
    contact_order = np.lexsort((np.array([kind.turn for kind in bonds]), contact_junction))
    peers = np.arange(len(end_nodes)) ^ 1
    steps = np.arange(total + 1)
    z = np.array(impedance)
    ordered_pairs = [pairs[c] for c in contact_order]
    faces, scales = [], []
    for c, (a, b) in zip(contact_order, ordered_pairs, strict=True):
        face = bonds[c].face
        node = -1 if face is None else (a, b)[face]
        faces.append(-1 if face is None else int(node_new[node]))
        sides = [sum(z[e] for e, n in enumerate(end_nodes) if n == side) for side in (a, b)]
        shared = sum(node in pair for pair in ordered_pairs) != 1  # its forces come from those of others too
        scale = max(sides) if face is None or shared else sides[face]
        scales.append(scale if scale > 0.0 else bonds[c].rigid_scale(nodes.mass[a], nodes.mass[b]))
    tolerance = MERGE_TOL * 2.0 * min(transit)
    drop_light(nodes, end_nodes, impedance, tolerance)
    node_junction = np.array(junction, dtype=np.int64)[node_order]
    node_of = np.searchsorted(node_junction, steps)
    net = Network(
        node_of=node_of.astype(np.int64),
        end_of=np.searchsorted(end_junction[end_order], steps).astype(np.int64),
        contact_of=np.searchsorted(contact_junction[contact_order], steps).astype(np.int64),
        mass=np.array(nodes.mass)[node_order],
        spring=np.array(nodes.spring)[node_order],
        dashpot=np.array(nodes.dashpot)[node_order],
        push=np.array(nodes.push)[node_order],
        end_node=node_new[np.array(end_nodes, dtype=np.int64)[end_order]].astype(np.int64),
        end_peer=end_new[peers[end_order]].astype(np.int64),
        end_junction=end_junction[end_order],
        impedance=z[end_order],
        transit=np.array(transit)[end_order],
        left=np.array([node_new[a] for a, _ in ordered_pairs], dtype=np.int64),
        right=np.array([node_new[b] for _, b in ordered_pairs], dtype=np.int64),
        face=np.array(faces, dtype=np.int64),
        stiffness=np.array([bonds[c].stiffness for c in contact_order], dtype=np.float64),
        damping=np.array([bonds[c].damping for c in contact_order], dtype=np.float64),
        gap=np.array([scene.contacts[c].gap for c in contact_order], dtype=np.float64),
        contact_impedance=np.array(scales, dtype=np.float64),
        gravity=float(scene.gravity),
        duration=float(scene.duration),
        tolerance=float(tolerance),
    )
    renumbered = {
        name: tuple(
            Link(k.x, k.length, k.area, k.young, k.density, int(end_new[k.left_end]), int(end_new[k.right_end]))
            for k in pieces
        )
        for name, pieces in links.items()
    }
    layout = Layout(
        net,
        renumbered,
        {name: tuple(int(node_new[n]) for n in row) for name, row in members.items()},
        node_junction,
        contact_order.astype(np.int64),
    )
    pieces = end_pieces(scene, layout)
    u = np.array(nodes.u)[node_order]
    v = np.array(nodes.v)[node_order]
    return layout, first_records(scene, layout, pieces, u, v)
