"""The warning of rods and masses whose weight is not in equilibrium at t = 0.

They are held, or rest on others, and vibrate under their own weight beside the impact. The static equilibrium is that
of bars with nodes at ends, joints and faces, which is exact there.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple, final

import numpy as np

from impactlab.contact.power_law import AbstractHystereticLaw, Hertz
from impactlab.history.base import AbstractHistory, Warned
from impactlab.scene.bodies import Body, WaveBody
from impactlab.scene.facts import cut_at
from impactlab.scene.method import Method, stiffness_at, stiffness_of
from impactlab.scene.problem import Contact, Scene
from impactlab.types import Array

SWING_WARN = 0.01  # of the motion of a face in the run: the share that the vibration by the weight has in it
MAX_PLACES = 400  # bodies and faces, nodes of a dense matrix; scenes of more are left out
HARD = 1e6  # stiffness of a hard contact over the largest other one
INSTANTS = 1000  # of a run, at which the motion is read
MAX_TURNS, SETTLED = 100, 1e-12  # solutions for contacts that stiffen, and the share by which the last forces differ
MIN_FORCE = 1e-9  # N: a contact that carries nothing has no stiffness, and the equilibrium needs one
ROUNDING = 1e-9  # of the largest strain: a smaller jump of it is none
MAX_LENGTH, MAX_NODES = 400, 150  # characters and parts of a formula of a case, as in `casefile.values.formula`
Node = tuple[str, float]  # body and place x [m]


class Swing(NamedTuple):
    """The largest vibration by the weight at a face."""

    share: float  # of the motion there
    node: Node
    sag: float  # m, from the start to the equilibrium
    moved: float  # m


def warnings(history: AbstractHistory) -> Iterator[Warned]:
    """Yield a warning where the vibration by the weight of resting bodies matters.

    None where the weight alone moves the scene. Of beams see `static_sag`.
    """
    scene = history.scene
    if scene.gravity == 0.0 or any(body.bends or body.changes or body.rotation for body in scene.bodies.values()):
        return
    if not (scene.loaded_ends or any(body.velocity != 0.0 for body in scene.bodies.values())):
        return
    if len(scene.bodies) + len(scene.faces) > MAX_PLACES:
        return
    rest = StaticRest(scene, history.method)
    found = list(_swings(history, rest))
    if found and (largest := max(found)).share > SWING_WARN:
        yield Warned("weight_at_start", _text(scene, rest, largest))


def _text(scene: Scene, rest: StaticRest, largest: Swing) -> str:
    """Return the text of the warning."""
    name, x = largest.node
    place = f" at {x:.6g} m" if scene.bodies[name].waves is not None else ""
    return (
        f"'{name}' is not in static equilibrium at t = 0: its weight, and that of bodies which rest on it, act from "
        f"then on. It vibrates about its equilibrium, {largest.sag:.3g} m away{place}, by up to "
        f"{largest.share * largest.moved:.3g} m within the run, while it moves by {largest.moved:.3g} m there. If it "
        "is at rest at the start, leave gravity out: displacements and forces then count from the equilibrium"
        f"{rest.start()}"
    )


def _swings(history: AbstractHistory, rest: StaticRest) -> Iterator[Swing]:
    """Yield the vibrations at the faces of bodies that rest.

    A face goes to twice its distance from the equilibrium at most, and no further than it falls from rest.
    """
    times = np.linspace(0.0, history.duration, INSTANTS)
    fall = 0.5 * abs(history.scene.gravity) * history.duration**2
    faces = {(point.body, point.x): None for point in history.scene.faces}
    for node in (each for each in faces if each in rest.held):
        sag = float(rest.sags[rest.nodes[node]])
        moved = float(np.ptp(history.evaluate(times, history.scene.bodies[node[0]].face_channel(node[1]))))
        if moved > 0.0:
            yield Swing(min(2.0 * abs(sag), fall) / moved, node, sag, moved)


@final
class StaticRest:
    """The equilibrium under gravity of the bodies that rest at t = 0.

    They are rods without a given displacement and masses, at rest; what nothing holds falls and is left out.
    """

    def __init__(self, scene: Scene, method: Method) -> None:
        self._scene, self._method = scene, method
        self.nodes: dict[Node, int] = {}
        self._springs: list[tuple[int, int, float]] = []  # nodes, -1 the ground, and stiffness [N/m]
        self._clamped: list[int] = []
        self._weights: dict[int, float] = {}  # kg, by node
        for name, body in scene.bodies.items():
            if body.falls and body.moves and body.velocity == 0.0:
                self._add(name, body)
        self._closed = [each for each in scene.contacts if each.gap <= 0.0 and self._rests(each)]
        self._solve()

    def _add(self, name: str, body: Body) -> None:
        rod = body.waves
        if rod is None:
            if body.elastic is None:
                self._weights[self._node(name, 0.0)] = body.moving_mass
            return
        if rod.displacement is not None:
            return
        places = sorted({x for _, contact in self._scene.met_by(name) for x in contact.places_on(name)})
        x, before = 0.0, self._node(name, 0.0)
        for segment in cut_at(rod.segments, places):
            x += segment.length
            at = next((place for place in places if math.isclose(place, x)), x)
            node = self._node(name, rod.length if math.isclose(x, rod.length) else at)
            self._springs.append((before, node, segment.young * segment.area / segment.length))
            for each in (before, node):
                self._weights[each] = self._weights.get(each, 0.0) + 0.5 * segment.mass
            before = node
        for place, end in rod.ends:
            node = self._node(name, place)
            if end.kind == "clamped":
                self._clamped.append(node)
            elif end.kind == "spring":
                self._springs.append((node, -1, end.value))
            elif end.kind == "mass":
                self._weights[node] = self._weights.get(node, 0.0) + end.value

    def _node(self, name: str, x: float) -> int:
        return self.nodes.setdefault((name, x), len(self.nodes))

    def _number(self, name: str, x: float) -> int | None:
        """Return the node of a place, -1 on a wall, None on a body that does not rest."""
        return -1 if not self._scene.bodies[name].moves else self.nodes.get((name, x))

    def _rests(self, contact: Contact) -> bool:
        """Return whether both bodies of a contact rest."""
        numbers = [self._number(point.body, point.x) for point in contact.faces]
        return None not in numbers and numbers[0] != numbers[1]

    def _pairs(self) -> Iterator[tuple[int, int]]:
        yield from ((one, other) for one, other, _ in self._springs)
        yield from ((node, -1) for node in self._clamped)
        for contact in self._closed:
            one, other = (self._number(point.body, point.x) for point in contact.faces)
            if one is not None and other is not None:
                yield one, other

    def _held(self) -> set[Node]:
        """Return the nodes from which a path leads to the ground."""
        pairs, reached, before = list(self._pairs()), {-1}, 0
        while len(reached) > before:
            before = len(reached)
            for pair in pairs:
                if not reached.isdisjoint(pair):
                    reached.update(pair)
        return {node for node, number in self.nodes.items() if number in reached}

    def _solve(self) -> None:
        """Find the displacements from the start to the equilibrium; contacts that would pull are open."""
        laws = self._method.laws
        while True:
            self.held = self._held()
            self.sags, self.forces = self._solved({})
            for _ in range(MAX_TURNS if any(map(self._power, self._closed)) else 0):
                before = self.forces
                self.sags, self.forces = self._solved(before)
                if all(abs(force - before[each]) <= SETTLED * abs(force) for each, force in self.forces.items()):
                    break
            pull = {each.name for each, force in self.forces.items() if force < 0.0 and not laws[each.name].two_sided}
            if not pull:
                return
            self._closed = [each for each in self._closed if each.name not in pull]

    def start(self) -> str:
        """Return the keys of a start in equilibrium, for people; empty where a formula does not give it."""
        scene, keys = self._scene, []
        for name, rod in ((name, body.waves) for name, body in scene.bodies.items()):
            if rod is not None and (name, 0.0) in self.held:
                shape = self._shape(name, rod)
                if len(shape) > MAX_LENGTH or sum(1 for _ in ast.walk(ast.parse(shape, mode="eval").body)) > MAX_NODES:
                    return ""
                keys.append(f"displacement of '{name}': {shape}")
        for contact, force in self.forces.items():
            stiffness = stiffness_of(scene, self._method, contact)
            if stiffness is None and self._power(contact) is None:
                return ""
            gap = -force / (self._stiffness(contact, force) if stiffness is None else stiffness)
            for sign, point in zip((1.0, -1.0), contact.faces, strict=True):
                if scene.bodies[point.body].waves is not None:  # places of masses count from the start
                    gap += sign * float(self.sags[self.nodes[point.body, point.x]])
            keys.append(f"gap of {contact.name}: {gap:.9g}")
        return f". Or start in equilibrium: {'; '.join(keys)}"

    def _shape(self, name: str, rod: WaveBody) -> str:
        """Return the equilibrium of a rod as a formula of x.

        It is a parabola between two nodes. Where strain or curvature jump, at joints and faces, terms in |x - a| and
        (x - a) |x - a| are added.
        """
        places = sorted(x for body, x in self.nodes if body == name)
        sags = np.array([self.sags[self.nodes[name, x]] for x in places])
        pieces = list(cut_at(rod.segments, places))
        factors = np.array([self._scene.gravity * each.density / (2.0 * each.young) for each in pieces])
        lengths = np.diff(places)
        slopes = np.diff(sags) / lengths
        jumps = slopes[1:] + factors[1:] * lengths[1:] - slopes[:-1] + factors[:-1] * lengths[:-1]  # of the strain
        kinks, bends, ends = 0.5 * jumps, 0.5 * (factors[:-1] - factors[1:]), np.array(places[1:-1])
        least = ROUNDING * float(np.abs(slopes).max() + np.abs(factors * lengths).max())
        terms = [
            f" + {kink:.13g}*abs(x - {end:.13g})"  # short: a formula of a case has at most `MAX_LENGTH` characters
            if bend == 0.0
            else f" + ({kink:.13g} + {bend:.13g}*(x - {end:.13g}))*abs(x - {end:.13g})"
            for kink, bend, end in zip(kinks.tolist(), bends.tolist(), ends.tolist(), strict=True)
            if abs(kink) > least or bend != 0.0
        ]
        # The terms are those of the rod beside the parabola of the ends: what they are there is taken off.
        curved = float(factors[0] - bends.sum())
        low, high = (float(np.sum((kinks + bends * (x - ends)) * np.abs(x - ends))) for x in (0.0, rod.length))
        left, slope = sags[0] - low, (sags[-1] - high - sags[0] + low) / rod.length
        if not terms:
            return f"{left:.12g} + {slope:.12g}*x + {curved:.9g}*x*(L - x)"
        return f"{left:.13g} + {slope:.13g}*x + {curved:.9g}*x*(L - x){''.join(terms)}"  # of which much cancels

    def _solved(self, before: Mapping[Contact, float]) -> tuple[Array, dict[Contact, float]]:
        """Return the displacements of the nodes [m] and the forces of the closed contacts [N].

        Contacts that stiffen are as stiff as under the forces ``before`` [N].
        """
        size = len(self.nodes)
        matrix, load = np.zeros((size + 1, size + 1)), np.zeros(size + 1)  # the last one is the ground
        for node, weight in self._weights.items():
            load[node] = weight * self._scene.gravity
        weight = sum(self._weights.values()) * abs(self._scene.gravity)
        soft = {contact: self._stiffness(contact, before.get(contact, weight)) for contact in self._closed}
        finite = [k for _, _, k in self._springs] + [k for k in soft.values() if k < math.inf]
        hard = HARD * max(finite, default=1.0)
        contacts = []
        for contact, stiffness in soft.items():
            left, right = (self._number(point.body, point.x) for point in contact.faces)
            assert left is not None and right is not None  # noqa: S101, PT018 - both rest
            contacts.append((contact, left, right, min(stiffness, hard)))
        for one, other, stiffness in [
            *self._springs,
            *((left, right, stiffness) for _, left, right, stiffness in contacts),
        ]:
            matrix[one, one] += stiffness
            matrix[other, other] += stiffness
            matrix[one, other] -= stiffness
            matrix[other, one] -= stiffness
        for contact, left, right, stiffness in contacts:
            load[left] += stiffness * contact.gap
            load[right] -= stiffness * contact.gap
        free = [number for node, number in self.nodes.items() if node in self.held and number not in self._clamped]
        found = np.zeros(size + 1)
        found[free] = np.linalg.solve(matrix[np.ix_(free, free)], load[free])
        forces = {c: -k * (c.gap + float(found[right] - found[left])) for c, left, right, k in contacts}
        return found[:size], {c: f for c, f in forces.items() if self._is_held(c)}

    def _is_held(self, contact: Contact) -> bool:
        return any((point.body, point.x) in self.held for point in contact.faces)

    def _power(self, contact: Contact) -> tuple[float, float] | None:
        """Return K and n of a contact whose force at rest is K d^n of its overlap d, else None."""
        law = self._method.laws[contact.name]
        return (law.stiffness, law.exponent) if isinstance(law, (Hertz, AbstractHystereticLaw)) else None

    def _stiffness(self, contact: Contact, force: float) -> float:
        """Return the force of a contact over its overlap [N/m], under a force [N] where it stiffens."""
        stiffness = stiffness_of(self._scene, self._method, contact)
        if stiffness is not None:
            return stiffness or math.inf
        if (power := self._power(contact)) is not None:
            factor, exponent = power
            return float(factor ** (1.0 / exponent) * max(force, MIN_FORCE) ** (1.0 - 1.0 / exponent))
        weight = sum(self._weights.values()) * abs(self._scene.gravity)
        low, high = 1e-12, 1.0  # m
        for _ in range(60):
            middle = math.sqrt(low * high)
            stiffness = stiffness_at(self._scene, self._method, contact, middle)
            if stiffness is None:
                return math.inf
            low, high = (middle, high) if stiffness * middle < weight else (low, middle)
        return weight / low
