"""Chain of delay lines: travelling waves of a rod of several segments, struck anywhere, in steps."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from impactlab.errors import CaseError
from impactlab.models.base import Face, Operators
from impactlab.models.continuous import delay_chain_kernel as chain
from impactlab.models.continuous.base import (
    MODES,
    AbstractSelfStepping,
    numbers_of_steps,
    stepper_of,
    under_waves,
    without_mass,
)
from impactlab.models.continuous.delay_chain_kernel import MOVED, SENT_LEFT, SENT_RIGHT
from impactlab.models.continuous.delay_line import dispersed
from impactlab.printing import at_most
from impactlab.scene.bodies import End, Segment, WaveBody
from impactlab.scene.facts import SAME_PLACE
from impactlab.scene.sizes import check_cells
from impactlab.stepper import Stepper
from impactlab.types import Array, Quantity

POINTS = 10  # steps in the period that ``points_per_period`` counts, unless a case gives it
BESIDE = 1e-9  # of the length: the place just before or just behind a node
TIE = 1e-9  # of a cell: places this near to the middle of one are in it


class Piece(NamedTuple):
    """A delay: the rod between two neighbouring nodes."""

    start: float  # m
    length: float  # m
    segment: Segment
    cells: int  # steps in which a wave crosses it
    gain: float  # m/s, velocity that gravity gives to either wave in a step


@final
class DelayChain(AbstractSelfStepping):
    """A rod as delays between its nodes.

    Nodes are its ends, the ends of its segments and the places of its contacts. A wave takes a whole number of steps
    from node to node, so that transport is exact and costs nothing in between. At a node of impedances Z1 and Z2 two
    waves arrive and two leave (`delay_chain_kernel`); a contact force acts on it within the step through 1/(Z1 + Z2),
    and on no other node. Energy and momentum are those of the waves on their way, and are kept to rounding. Coordinates
    are the displacements of the nodes, each between the time integrals of the velocities that the node sends to the
    left and to the right, from which every quantity follows at every place.

    The step must fit: a step up to a fifth shorter than the given one is taken, the one that fits best. Then nodes
    move to the grid, by half a cell at most, counted from the middle of the rod; impedances and weights stay. Gravity
    accelerates both waves on their way, each by half of it. ``points_per_period`` counts the period of mode ``modes``,
    or ten times the shortest delay where that is shorter.
    """

    books_momentum = True

    def __init__(self, rod: WaveBody, gravity: float, faces: tuple[Face, ...], modes: int = MODES) -> None:
        if rod.is_damped:
            raise CaseError(dispersed(rod), remedy="Use finite_element or modal.", path="solve.model")
        self._rod, self._gravity, self._modes = rod, gravity, modes
        bounds = [0.0, *itertools.accumulate(each.length for each in rod.segments[:-1]), rod.length]
        transits = [0.0, *itertools.accumulate(each.length / each.wave_speed for each in rod.segments)]
        places, slack = bounds.copy(), SAME_PLACE * rod.length
        for x in sorted({face.x for face in faces}):
            if min(abs(x - place) for place in (*bounds, places[-1])) > slack:
                places.append(x)
        self.places = np.array(sorted(places))  # m, of the nodes
        self._times = np.interp(self.places, bounds, transits)
        self.transit = float(self._times[-1])
        self.n_dof = 3 * self.places.size
        middles = 0.5 * (self.places[1:] + self.places[:-1])
        self._segments = [rod.segment_at(float(x)) for x in middles]

    @property
    def longest_step(self) -> float:
        return float(np.diff(self._times).min())

    def too_long(self, dt: float) -> CaseError:
        at = int(np.argmin(np.diff(self._times)))
        near, far = self.places[at : at + 2]
        return CaseError(
            f"a step of {dt:.6g} s is longer than a wave takes from {near:.6g} m to {far:.6g} m of '{self._rod.name}', "
            f"{self.longest_step:.6g} s. Allowed: up to the shortest time between its ends, the ends of its segments "
            "and the places of its contacts",
            remedy=f"Give dt: {at_most(self.longest_step)} or less, or finite_element.",
            path="solve.step",
        )

    def misfit(self, dt: float) -> float:
        numbers, exact = self._on_grid(dt)
        cells = self.transit / dt
        moved = np.abs(numbers - exact).max() / cells
        return round(float(max(moved, abs(numbers[-1] / cells - 1.0))), 12)

    def fitting(self, dt: float) -> Array:
        if self.misfit(dt) == 0.0:
            return np.array([dt])
        return np.asarray(self.transit / numbers_of_steps(self.transit / dt))

    def operators(self) -> Operators:
        rod, n, load, dashpots = self._rod, self.n_dof, np.zeros(self.n_dof), np.zeros(self.n_dof)
        start, velocity = np.zeros(n), np.zeros(n)
        start[MOVED::3] = self._initial(self.places)
        velocity[MOVED::3] = rod.velocity
        for node, end in ((0, rod.left), (self.places.size - 1, rod.right)):
            dashpots[3 * node + MOVED] = end.value if end.kind == "dashpot" else 0.0
            load[3 * node + MOVED] = self._load_on(end)
        highest = (2 * self._modes + 1) * math.pi / (2.0 * self.transit)
        rule = max(highest, 2.0 * math.pi / (POINTS * self.longest_step))
        return without_mass(start, velocity, load, dashpots, rule)

    def node_at(self, x: float) -> int | None:
        """Return the number of the node at x [m]; None where there is none."""
        node = int(np.argmin(np.abs(self.places - x)))
        return node if abs(self.places[node] - x) <= SAME_PLACE * self._rod.length else None

    def gives_means(self, x: float) -> bool:
        ends: dict[int | None, End] = {0: self._rod.left, self.places.size - 1: self._rod.right}
        end = ends.get(self.node_at(x))
        return end is None or not (end.kind == "mass" and end.value > 0.0)

    def row(self, x: float, quantity: Quantity) -> Array:
        node = self.node_at(x)
        if quantity not in ("displacement", "velocity") or node is None:
            raise CaseError(
                f"the stepped delay line of '{self._rod.name}' has no {quantity} at {x:.6g} m within a step: it has "
                "displacement and velocity at its ends, between its segments and at its contacts",
                remedy="Use finite_element or modal, or a law that reads nothing inside a rod.",
                path="solve.model",
            )
        return np.asarray(np.eye(1, self.n_dof, 3 * node + MOVED)[0])

    def sent(self) -> Array:
        """Return the time integrals of waves as rows over the coordinates, (2 pieces, n_dof).

        Piece by piece: the wave from its left node to the right, and the one from its right node to the left.
        """
        columns = [3 * node + at for node in range(self.places.size - 1) for at in (SENT_RIGHT, 3 + SENT_LEFT)]
        rows = np.zeros((len(columns), self.n_dof))
        rows[np.arange(len(columns)), columns] = 1.0
        return rows

    def grid(self) -> Array:
        """Return the ends and both sides of every inner node [m].

        At an inner node the force or the stress may jump.
        """
        inner, beside = self.places[1:-1], BESIDE * self._rod.length
        return np.sort(np.concatenate((self.places[[0, -1]], inner - beside, inner + beside)))

    def pieces(self, dt: float) -> tuple[Piece, ...]:
        """Return the delays between the nodes for a step [s], from left to right."""
        cells = np.diff(self._on_grid(dt)[0])
        if cells.min() < 1:
            raise self.too_long(dt)
        lengths = np.diff(self.places)
        found = []
        for x, length, segment, count in zip(self.places, lengths, self._segments, cells, strict=False):
            # Places may have moved; the weight is that of the piece as it is.
            gain = 0.5 * self._gravity * length / (segment.wave_speed * count)
            found.append(Piece(float(x), float(length), segment, int(count), float(gain)))
        return tuple(found)

    def before(self, piece: Piece, dt: float) -> tuple[Array, Array]:
        """Return the waves to either side at t = 0, (cells,) each [m/s].

        Those to the right come first; all are means over cells.

        The first is nearest to the node that sends it, as if it had done so in the step before; they are less by the
        velocity that gravity would have given them on the way.
        """
        speed, cells = piece.length / (piece.cells * dt), np.linspace(0.0, 1.0, piece.cells + 1)
        slopes = np.diff(self._initial(piece.start + piece.length * cells)) / (piece.length / piece.cells)
        velocity, gained = self._rod.velocity, piece.gain * (np.arange(piece.cells) + 0.5)
        return 0.5 * (velocity - speed * slopes) - gained, 0.5 * (velocity + speed * slopes[::-1]) - gained

    def stepper(self, ports: Array, dt: float) -> Stepper:
        """Return the chain for steps of dt [s], at most the shortest time between nodes."""
        rod, pieces, nodes = self._rod, self.pieces(dt), self.places.size
        check_cells(sum(piece.cells for piece in pieces), rod.name)
        impedances = np.array([0.0, *(piece.segment.impedance for piece in pieces), 0.0])
        of_nodes = np.zeros((nodes, chain.NODE))
        of_nodes[:, 0], of_nodes[:, 1] = impedances[:-1], impedances[1:]
        of_nodes[1:-1, 2] = 1.0 / (impedances[1:-2] + impedances[2:-1])
        for node, end in ((0, rod.left), (nodes - 1, rod.right)):
            if end.kind != "clamped":
                of_nodes[node, 2:5] = under_waves(end, impedances[node] + impedances[node + 1], dt)
            of_nodes[node, 5] = self._load_on(end)
        cells = np.array([piece.cells for piece in pieces], float)
        first = chain.FIRST + of_nodes.size + chain.PIECE * len(pieces)
        starts = first + 2.0 * (np.cumsum(cells) - cells)
        gains = [piece.gain for piece in pieces]
        of_pieces = np.column_stack((cells, starts, np.zeros(len(pieces)), impedances[1:-1], gains))
        waves = np.zeros((int(cells.sum()), 2))
        state = np.zeros(2 * self.n_dof)
        state[: self.n_dof], velocities = self.operators().displacement, state[self.n_dof :]
        velocities[MOVED::3] = rod.velocity
        for node, end in ((0, rod.left), (nodes - 1, rod.right)):
            velocities[3 * node + MOVED] *= end.kind != "clamped"
        for number, piece in enumerate(pieces):
            to_right, to_left = self.before(piece, dt)
            velocities[3 * number + SENT_RIGHT], velocities[3 * number + 3 + SENT_LEFT] = to_right[0], to_left[0]
            # The place to be read next stands at 0: entry -j holds the wave sent j steps before the newest.
            at = int(starts[number] - first) // 2
            waves[at + 1 : at + piece.cells, 0] = to_right[:0:-1]
            waves[at + 1 : at + piece.cells, 1] = to_left[:0:-1]
        parameters = np.concatenate(([float(nodes), dt, 0.0], of_nodes.ravel(), of_pieces.ravel(), waves.ravel()))
        force_response = np.zeros((len(ports), state.size))
        for port, row in enumerate(ports):
            node = int(np.argmax(row)) // 3
            compliance, _, inertia = of_nodes[node, 2:5]
            moved = np.array([node > 0, 1.0, node < nodes - 1])
            force_response[port, 3 * node : 3 * node + 3] = dt * compliance * moved
            rates = force_response[port, self.n_dof + 3 * node : self.n_dof + 3 * node + 3]
            rates[:] = compliance * moved
            rates[MOVED] *= 2.0 if inertia > 0.0 else 1.0
        return stepper_of(chain.free, chain.measure, parameters, state, force_response, ports)

    def _load_on(self, end: End) -> float:
        """Return the constant force on an end [N]: load and weight of a mass."""
        return end.force + (self._gravity * end.value if end.kind == "mass" else 0.0)

    def _initial(self, x: Array) -> Array:
        return np.zeros(x.size) if self._rod.displacement is None else np.asarray(self._rod.displacement(x))

    def _on_grid(self, dt: float) -> tuple[NDArray[np.int64], Array]:
        """Return the cells from the left end to each node, rounded and before rounding.

        Both are counted from the middle of the rod, so that the mirrored rod has the mirrored grid; a node half-way
        between two places moves away from the middle.
        """
        cells = max(1, math.floor(self.transit / dt + 0.5))
        exact = self._times / dt + 0.5 * (cells - self.transit / dt)
        late = exact > 0.5 * cells
        numbers = np.where(late, np.floor(exact + 0.5 + TIE), np.ceil(exact - 0.5 - TIE))
        return numbers.astype(np.int64), exact
