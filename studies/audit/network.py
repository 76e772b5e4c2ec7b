"""A case as a network of points and uniform rod pieces.

It is read from the plain document alone. A point is fixed, carries mass, or is massless; pieces of rods join points;
contacts act between points. A place of a contact inside a rod cuts the rod there. Only the keys of the audit's scenes
are read: SI numbers, uniform initial velocities, linear ends, end forces, gravity, and hard, spring-and-dashpot and
power-law contacts.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any, NamedTuple

FIXED, HEAVY, BARE = 0, 1, 2
HARD, DASHPOT, POWER = 0, 1, 2

Doc = dict[str, Any]


@dataclass
class Node:
    """A point: its mass, its ground spring and dashpot, a constant force, its initial velocity."""

    kind: int
    mass: float = 0.0
    spring: float = 0.0
    dashpot: float = 0.0
    force: float = 0.0
    velocity: float = 0.0


@dataclass
class Piece:
    """A uniform piece of a rod between two points."""

    left: int
    right: int
    length: float
    area: float
    young: float
    density: float
    velocity: float

    @property
    def transit(self) -> float:
        """Time of a wave from end to end [s]."""
        return self.length * math.sqrt(self.density / self.young)

    @property
    def impedance(self) -> float:
        """Impedance rho c A [N s/m]."""
        return self.area * math.sqrt(self.density * self.young)


@dataclass
class Touch:
    """A contact between two points: its law with three parameters."""

    name: str
    left: int
    right: int
    gap: float
    law: int
    parameters: tuple[float, ...]


@dataclass
class Network:
    """Everything that a truth program of rods and rigid bodies needs."""

    nodes: list[Node] = field(default_factory=list)
    pieces: list[Piece] = field(default_factory=list)
    touches: list[Touch] = field(default_factory=list)
    channels: dict[str, int] = field(default_factory=dict)  # displacements that are compared: name -> node
    body_of: dict[str, str] = field(default_factory=dict)  # a channel -> its body
    duration: float = 0.0
    gravity: float = 0.0
    round_trip: float = math.nan


class Frame(NamedTuple):
    """The centre-of-mass motion of bodies in contact: V t + g t^2/2."""

    velocity: float
    gravity: float


def frames(doc: Doc, touched: Collection[str]) -> dict[str, Frame]:
    """Return the frame of each body.

    It is that of the centre of mass of all that the body meets, at rest where one is held. A wall joins no bodies, but
    holds those that touch it; ``touched`` are the names of contacts that were closed.
    """
    bodies = doc["bodies"]
    group = {name: {name} for name in bodies}
    held = {name for name, body in bodies.items() if body["kind"] == "wall" or _is_held(body)}
    for contact in doc["contacts"]:
        if "|".join(contact["between"]) not in touched:
            continue
        a, b = (label.partition(".")[0] for label in contact["between"])
        walls = [name for name in (a, b) if bodies[name]["kind"] == "wall"]
        if walls:
            held.update((a, b))
            continue
        joined = group[a] | group[b]
        for name in joined:
            group[name] = joined
    found = {}
    for name, names in group.items():
        if names & held:
            found[name] = Frame(0.0, 0.0)
            continue
        masses = [(whole_mass(bodies[n]), float(bodies[n].get("velocity", 0.0))) for n in names]
        found[name] = Frame(sum(m * v for m, v in masses) / sum(m for m, _ in masses), float(doc.get("gravity", 0.0)))
    return found


def _ends(body: Doc) -> list[Doc]:
    ends = [body.get("ends", {}).get(side, "free") for side in ("left", "right")]
    return [{end: True} if isinstance(end, str) else end for end in ends]


def _is_held(body: Doc) -> bool:
    grounded = body.get("damping", {}).get("mass", 0.0) > 0.0
    return grounded or any(kind not in ("free", "mass", "force") for end in _ends(body) for kind in end)


def whole_mass(body: Doc) -> float:
    """Return the mass of a body with its end masses [kg]; inf of a wall."""
    return mass_of(body) + sum(float(end.get("mass", 0.0)) for end in _ends(body))


def segments_of(rod: Doc) -> list[Doc]:
    """Return the segments of a rod or beam."""
    return list(rod["segments"]) if "segments" in rod else [rod]


def length_of(rod: Doc) -> float:
    """Return the whole length of a rod or beam [m]."""
    return float(sum(s["length"] for s in segments_of(rod)))


def section_of(segment: Doc) -> tuple[float, float, float]:
    """Return area, second moment and shear factor of a beam's section."""
    section = segment["section"]
    if "width" in section:
        b, h = section["width"], section["height"]
        return b * h, b * h**3 / 12.0, section.get("shear_factor", 5.0 / 6.0)
    if "diameter" in section:
        d = section["diameter"]
        return math.pi * d * d / 4.0, math.pi * d**4 / 64.0, section.get("shear_factor", 0.9)
    return section["area"], section["inertia"], section.get("shear_factor", float("nan"))


def mass_of(body: Doc) -> float:
    """Return the mass of a body without its end masses [kg]; inf of a wall."""
    if body["kind"] == "wall":
        return math.inf
    if body["kind"] == "mass":
        return float(body["mass"])
    areas = [section_of(s)[0] if body["kind"] == "beam" else s["area"] for s in segments_of(body)]
    pairs = zip(segments_of(body), areas, strict=True)
    return float(sum(s["length"] * area * s["material"]["density"] for s, area in pairs))


def place_of(label: str, doc: Doc) -> tuple[str, float]:
    """Return the body of a face and its x."""
    name, _, where = label.partition(".")
    if where in ("", "left"):
        return name, 0.0
    if where == "right":
        return name, length_of(doc["bodies"][name])
    found = re.fullmatch(r"at\((.*)\)", where)
    if found is None:
        raise ValueError(label)
    return name, float(found.group(1))


def channel_of(name: str, x: float, doc: Doc) -> str:
    """Return the displacement channel of a face."""
    return f"position:{name}" if doc["bodies"][name]["kind"] == "mass" else f"displacement:{name}@{x:.6g}"


def law_of(contact: Doc, masses: tuple[float, float]) -> tuple[int, tuple[float, ...]]:
    """Return the kind and the parameters of a contact law."""
    law = contact.get("law")
    if law is None:
        return HARD, (0.0, 0.0, 0.0)
    kind = law["kind"]
    if kind == "penalty":
        return DASHPOT, (float(law["stiffness"]), float(law.get("damping", 0.0)), 0.0)
    if kind == "khulief_shabana":
        mass = law.get("effective_mass") or 1.0 / (1.0 / masses[0] + 1.0 / masses[1])
        k, loss = float(law["stiffness"]), -math.log(law["restitution"])
        return DASHPOT, (k, 2.0 * _ratio(loss) * math.sqrt(k * mass), 0.0)
    e = float(law.get("restitution", 1.0))
    factors = {
        "hertz": 0.0,
        "hunt_crossley": 1.5 * (1.0 - e),
        "lankarani_nikravesh": 0.75 * (1.0 - e * e),
        "flores": 1.6 * (1.0 - e) / e,
    }
    if kind in factors:
        return POWER, (float(law["stiffness"]), float(law.get("exponent", 1.5)), factors[kind])
    if kind in ("wave_identification", "addition_deletion"):
        return HARD, (0.0, 0.0, 0.0)
    raise ValueError(kind)


def _ratio(loss: float) -> float:
    """Return the damping ratio of a spring and dashpot by restitution.

    They let go at no force, and have the restitution exp(-loss).
    """
    from scipy.optimize import brentq

    if loss == 0.0:
        return 0.0

    def excess(zeta: float) -> float:
        root = math.sqrt(abs(1.0 - zeta * zeta))
        angle = math.acos(zeta) / root if zeta < 1.0 else math.acosh(zeta) / root if zeta > 1.0 else 1.0
        return 2.0 * zeta * angle - loss

    top = 1.0
    while excess(top) < 0.0:
        top *= 2.0
    return float(brentq(excess, 0.0, top, xtol=1e-15, rtol=1e-14))


def read(doc: Doc) -> Network:
    """Return the network of a case.

    Raises `ValueError` or `KeyError` where the case has more than is read here.
    """
    net = Network(duration=float(doc["solve"]["duration"]), gravity=float(doc.get("gravity", 0.0)))
    places: dict[tuple[str, float], int] = {}
    faces = [[place_of(label, doc) for label in contact["between"]] for contact in doc["contacts"]]
    for name, body in doc["bodies"].items():
        if body["kind"] == "rod":
            _read_rod(net, places, name, body, sorted({x for pair in faces for n, x in pair if n == name}))
            if math.isnan(net.round_trip):
                net.round_trip = 2.0 * sum(p.transit for p in net.pieces)
        elif body["kind"] in ("mass", "wall"):
            places[(name, 0.0)] = len(net.nodes)
            heavy = body["kind"] == "mass"
            mass, speed = (float(body["mass"]), float(body.get("velocity", 0.0))) if heavy else (0.0, 0.0)
            net.nodes.append(Node(HEAVY if heavy else FIXED, mass=mass, velocity=speed))
        else:
            raise ValueError(body["kind"])
    for contact, pair in zip(doc["contacts"], faces, strict=True):
        masses = (whole_mass(doc["bodies"][pair[0][0]]), whole_mass(doc["bodies"][pair[1][0]]))
        law, parameters = law_of(contact, masses)
        left, right = places[pair[0]], places[pair[1]]
        net.touches.append(
            Touch("|".join(contact["between"]), left, right, float(contact.get("gap", 0.0)), law, parameters)
        )
        for (name, x), node in zip(pair, (left, right), strict=True):
            if doc["bodies"][name]["kind"] != "wall":
                channel = channel_of(name, x, doc)
                net.channels[channel], net.body_of[channel] = node, name
    _check(net)
    return net


def _read_rod(net: Network, places: dict[tuple[str, float], int], name: str, rod: Doc, cuts: list[float]) -> None:
    if "damping" in rod or "displacement" in rod or any(s["material"].get("viscosity") for s in segments_of(rod)):
        raise ValueError("damped")
    speed, whole, ends = float(rod.get("velocity", 0.0)), length_of(rod), rod.get("ends", {})
    start, pieces = 0.0, []
    for segment in segments_of(rod):
        stop = start + segment["length"]
        inner = [x for x in cuts if start + 1e-9 * whole < x < stop - 1e-9 * whole]
        pieces += [(a, b, segment) for a, b in zip([start, *inner], [*inner, stop], strict=True)]
        start = stop
    first = len(net.nodes)
    for number, (a, b, segment) in enumerate(pieces):
        stuff = segment["material"]
        net.nodes.append(_end(ends.get("left", "free"), speed) if number == 0 else Node(BARE, velocity=speed))
        piece = Piece(
            first + number, first + number + 1, b - a, segment["area"], stuff["young"], stuff["density"], speed
        )
        net.pieces.append(piece)
    net.nodes.append(_end(ends.get("right", "free"), speed))
    at = [a for a, _, _ in pieces] + [whole]
    for x in cuts:
        nearest = min(range(len(at)), key=lambda i: abs(at[i] - x))
        places[(name, x)] = first + nearest


def _end(end: Any, speed: float) -> Node:
    given = {end: True} if isinstance(end, str) else dict(end)
    force = float(given.pop("force", 0.0))
    kind, value = next(iter(given.items()), ("free", True))
    if kind == "clamped":
        return Node(FIXED)
    if kind == "mass":
        return Node(HEAVY, mass=float(value), force=force, velocity=speed)
    node = Node(BARE, force=force, velocity=speed)
    if kind == "spring":
        node.spring = float(value)
    elif kind == "dashpot":
        node.dashpot = float(value)
    elif kind != "free":
        raise ValueError(kind)
    return node


def _check(net: Network) -> None:
    """Raise `ValueError` for contacts that are not served here.

    They are two contacts at one massless point, and hard contacts without one.
    """
    bare = [n for t in net.touches for n in (t.left, t.right) if net.nodes[n].kind == BARE]
    if len(bare) != len(set(bare)):
        raise ValueError("two contacts at one massless point")
    for touch in net.touches:
        if touch.law == HARD and BARE not in (net.nodes[touch.left].kind, net.nodes[touch.right].kind):
            raise ValueError("hard contact of two masses")
