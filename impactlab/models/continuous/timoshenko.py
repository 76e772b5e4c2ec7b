"""Timoshenko beam by characteristics.

Each of its two families of waves is shifted exactly; shear and rotation couple them.
"""

from __future__ import annotations

import math
from typing import final

import numpy as np

from impactlab.errors import CaseError
from impactlab.models.base import Face, Operators
from impactlab.models.continuous import timoshenko_kernel as characteristics
from impactlab.models.continuous.base import (
    MODES,
    AbstractSelfStepping,
    check_served,
    numbers_of_steps,
    stepper_of,
    under_waves,
    without_mass,
)
from impactlab.models.continuous.timoshenko_grids import Grid, coupling, factor, in_blocks, transposed
from impactlab.models.continuous.timoshenko_kernel import DEFLECTION, ENDS, MOMENT, ROTATION, SHEAR
from impactlab.numerics.lanes import LANES
from impactlab.scene.bodies import Beam, End
from impactlab.scene.problem import Probe
from impactlab.scene.sizes import check_cells
from impactlab.stepper import Stepper
from impactlab.types import QUANTITIES_OF_BEAM, Array, Quantity

MAX_CELLS = 2_000_000  # of one family
MIN_CELLS = 8  # cells over a beam with two ends
STATIONS = 101  # places of a snapshot
KINDS = {"displacement": DEFLECTION, "rotation": ROTATION, "bending_moment": MOMENT, "shear_force": SHEAR}


@final
class TimoshenkoWaves(AbstractSelfStepping):
    """A uniform Timoshenko beam in its characteristics.

    Deflection rate and shear force travel with c2 = sqrt(kGA/rho A), rate of rotation and bending moment with
    c1 = sqrt(E/rho): each pair has a grid of cells that a wave crosses in one step, so that transport is a shift,
    without interpolation, dispersion or loss, and fronts stay sharp. Their coupling, V' = -kGA theta' and
    rho I theta'' = V, acts along the characteristics by the trapezoidal rule, carried from one grid to the other by a
    symmetric average (`timoshenko_grids`): second order, stable for every step. The energy of the waves, half a step's
    turn of shear and rotation ahead, is kept to rounding. A force at an inner point moves it at once with
    F/(2 sqrt(kGA rho A)), at a tip with twice that.

    The step must fit: a beam with two ends takes a whole number of cells of both grids, a contact stands on a node of
    the first. So a step up to a fifth shorter than the given one is taken, the one that fits best. The rest is
    adjusted: contacts move to the nearest node (less than half a cell), the rotary inertia changes (by less than 1e-4
    as a rule) so that the bending grid closes. Ends that are infinite are as long as needed for nothing to come back
    within the run. ``points_per_period`` counts the period of mode ``modes`` of shear waves over the length, as on the
    delay line; the radius of gyration should hold a cell or more.

    References
    ----------
    LeonardBudiansky1954 (characteristics of the Timoshenko beam); Graff1975, section 3.4.
    """

    def __init__(
        self,
        beam: Beam,
        gravity: float,
        faces: tuple[Face, ...],
        probes: tuple[Probe, ...] = (),
        duration: float = 0.0,
        fields: bool = False,
        modes: int = MODES,
    ) -> None:
        preloaded = beam.displacement is not None and "infinite" in (beam.left.kind, beam.right.kind)
        more = {"displacement at t = 0 together with infinite ends": preloaded}
        check_served(beam, gravity, "Timoshenko", "Use finite_element or modal for this body.", more)
        self._beam, self._gravity, self._all_faces, self._duration = beam, gravity, faces, duration
        self._modes = modes
        segment = beam.segments[0]
        self._speeds = segment.shear_speed, segment.wave_speed
        self._faces = tuple(sorted({face.x for face in faces}))
        # m, of contacts from the anchor, each of which should be a whole number of cells: for a hundred steps in turn.
        self._length, self._distances = beam.length, sorted({abs(x - self._anchor()) for x in self._faces})
        self._stations = np.linspace(0.0, beam.length, STATIONS) if fields else np.array(self._faces)
        wanted = [(x, "displacement") for x in self._faces]
        read = [(probe.x, beam.reading(probe.quantity)[0]) for probe in probes]
        wanted += [(x, "displacement" if quantity == "velocity" else quantity) for x, quantity in read]
        wanted += [(x, "displacement") for x, end in self._beam.ends if end.kind == "dashpot"]
        wanted += [(float(x), "displacement") for x in self._stations]
        for x, quantity in wanted:
            if quantity not in KINDS:
                raise self._unknown(x, quantity)
        self.coordinates: tuple[tuple[float, str], ...] = tuple(dict.fromkeys(wanted)) or ((0.0, "displacement"),)
        self.n_dof = len(self.coordinates)
        self._closed = all(end.kind != "infinite" for _, end in self._beam.ends)

    def recorded(self, probes: tuple[Probe, ...], duration: float, fields: bool) -> TimoshenkoWaves:
        return TimoshenkoWaves(self._beam, self._gravity, self._all_faces, probes, duration, fields, self._modes)

    @property
    def longest_step(self) -> float:
        return self._beam.length / (MIN_CELLS * max(self._speeds)) if self._closed else math.inf

    def misfit(self, dt: float) -> float:
        return float(self.misfits(np.array([dt]))[0])

    def misfits(self, steps: Array) -> Array:
        h, length = self._speeds[0] * steps, self._length
        shifts = np.zeros(steps.size)
        for distance in self._distances:
            shifts += np.abs(distance - h * np.rint(distance / h)) / length
        if self._closed:
            for speed in self._speeds:
                cells = length / (speed * steps)
                shifts += np.abs(1.0 - np.maximum(1.0, np.rint(cells)) / cells)
        return np.round(shifts, 12)

    def fitting(self, dt: float) -> Array:
        lengths = [self._beam.length] if self._closed else [each for each in self._distances if each > 0.0][-1:]
        if not lengths:
            return np.array([dt])
        return np.asarray(lengths[0] / (self._speeds[0] * numbers_of_steps(lengths[0] / (self._speeds[0] * dt))))

    def operators(self) -> Operators:
        n, beam = self.n_dof, self._beam
        damping, start, velocity = np.zeros(n), np.zeros(n), np.zeros(n)
        for x, end in self._beam.ends:
            if end.kind == "dashpot":
                damping[self.coordinates.index((x, "displacement"))] = end.value
        for number, (x, quantity) in enumerate(self.coordinates):
            velocity[number] = beam.velocity if quantity == "displacement" else 0.0
            start[number] = self._initial(x, quantity)
        rule = (2 * self._modes + 1) * math.pi * self._speeds[0] / (2.0 * beam.length)
        return without_mass(start, velocity, np.zeros(n), damping, rule)

    def row(self, x: float, quantity: Quantity) -> Array:
        key = (x, "displacement" if quantity == "velocity" else quantity)
        if key not in self.coordinates:
            raise self._unknown(x, quantity)
        row = np.zeros(self.n_dof)
        row[self.coordinates.index(key)] = 1.0
        return row

    def grid(self) -> Array:
        return self._stations

    def stepper(self, ports: Array, dt: float) -> Stepper:
        check_cells(self._beam.length / (min(self._speeds) * dt), self._beam.name)
        shear, bend = (self._grid(speed, dt) for speed in self._speeds)
        segment = self._beam.segments[0]
        # With the impedance and EI as given, a speed that fits the grid changes masses, by no more than the misfit.
        speeds = shear.spacing / dt, bend.spacing / dt
        impedances = segment.shear_impedance, segment.bending_stiffness / speeds[1]
        stiffness, turning = impedances[0] * speeds[0], impedances[1] / speeds[1]
        couple = coupling(shear, bend)
        share = shear.spacing / bend.spacing
        weight = dt**2 * stiffness / (4.0 * turning) * share
        numbers, n = self._numbered(shear, bend), self.n_dof
        ends = np.array([self._end(end, family, impedances, dt) for family in range(2) for _, end in self._beam.ends])
        blocks, forth = in_blocks(couple)
        back_blocks, back = in_blocks(transposed(couple, bend.cells))
        bands, factors = factor(couple, bend.cells, weight)
        parameters = np.concatenate(
            [
                [float(each) for each in (shear.cells, bend.cells, blocks, back_blocks, bands)],
                [dt, *impedances, 0.5 * dt * stiffness, dt / turning * share, float(n), 0.5 * self._beam.velocity],
                ends.ravel(),
                numbers.ravel(),
                forth,
                back,
                factors,
            ]
        )
        at = 2 * n + ENDS
        state = np.zeros(at + 3 * shear.cells + 3 * bend.cells + LANES * (blocks + back_blocks))
        system = self.operators()
        state[:n], state[n : 2 * n] = system.displacement, system.velocity
        for number, (x, end) in enumerate(self._beam.ends):
            if end.kind not in ("clamped", "pinned", "infinite"):
                state[2 * n + 2 * number] = self._initial(x, "displacement")
                state[2 * n + 2 * number + 1] = self._beam.velocity
                state[2 * n + 4 + 2 * number] = self._initial(x, "rotation")
        state[at : at + 2 * shear.cells] = 0.5 * self._beam.velocity
        if self._beam.displacement is not None:
            moment = [self._initial(float(x), "bending_moment", bend.spacing) for x in bend.centres]
            waves = state[at + 2 * shear.cells : at + 2 * shear.cells + 2 * bend.cells]
            half = 0.5 * np.array(moment) / impedances[1]
            waves[: bend.cells], waves[bend.cells :] = -half, half
        responses = np.array([self._response(row, numbers, shear, ends, impedances[0], dt) for row in ports])
        force_response = np.zeros((len(ports), state.size))
        force_response[:, : at + 2 * shear.cells] = responses.reshape(len(ports), at + 2 * shear.cells)
        return stepper_of(characteristics.free, characteristics.measure, parameters, state, force_response, ports)

    def _unknown(self, x: float, quantity: str) -> CaseError:
        return CaseError(
            f"the continuous beam '{self._beam.name}' has no {quantity} at {x:.6g} m: its quantities are "
            f"{', '.join(QUANTITIES_OF_BEAM)}, at the places of contacts and probes",
            remedy="Name one of these in a probe.",
            path="probes",
        )

    def _anchor(self) -> float:
        """Return the node from which the grids count [m].

        It is an end, or the first place at which the beam is struck.
        """
        if self._beam.left.kind != "infinite":
            return 0.0
        if self._beam.right.kind != "infinite":
            return self._beam.length
        return self._faces[0] if self._faces else 0.0

    def _grid(self, speed: float, dt: float) -> Grid:
        """Return the cells of a family of waves.

        They cover the beam, and beyond infinite ends so much that nothing returns during the run.
        """
        length, anchor = self._beam.length, self._anchor()
        if self._closed:
            count = max(1, round(length / (speed * dt)))
            return Grid(0.0, length / count, self._allowed(count))
        h = speed * dt
        beyond = 0.5 * max(self._speeds) * self._duration + 2.0 * max(self._speeds) * dt
        below = anchor + (beyond if self._beam.left.kind == "infinite" else 0.0)
        above = length - anchor + (beyond if self._beam.right.kind == "infinite" else 0.0)
        before, after = (self._allowed(math.ceil(reach / h - 1e-9)) for reach in (below, above))
        return Grid(anchor - before * h, h, before + after)

    def _allowed(self, count: int) -> int:
        if count > MAX_CELLS:
            raise CaseError(
                f"the continuous beam '{self._beam.name}' would need {count} cells. Allowed: {MAX_CELLS}",
                remedy="Give a longer step or a shorter duration, or finite_element.",
                path=f"solve.models.{self._beam.name}",
            )
        return count

    def _numbered(self, shear: Grid, bend: Grid) -> Array:
        """Return kind, cell or node, and share of the next one, of each coordinate, (n, 3)."""
        numbers = []
        for x, quantity in self.coordinates:
            kind = KINDS[quantity]
            grid = shear if kind in (DEFLECTION, SHEAR) else bend
            place = (x - grid.start) / grid.spacing
            if x in self._faces and kind == DEFLECTION:
                numbers.append((kind, round(place), 0.0))
            elif kind in (DEFLECTION, ROTATION):
                index = min(max(math.floor(place + 1e-9), 0), grid.cells)
                numbers.append((kind, index, max(0.0, place - index)))
            else:
                index = min(max(math.floor(place - 0.5), 0), grid.cells - 2)
                numbers.append((kind, index, place - 0.5 - index))
        return np.array(numbers, dtype=float)

    def _end(self, end: End, family: int, impedances: tuple[float, float], dt: float) -> tuple[float, ...]:
        """Return the five parameters of an end, for deflection (family 0) or rotation (1)."""
        if end.kind == "infinite":
            return 1.0, 0.0, 0.0, 0.0, 0.0
        if end.kind == "clamped" or (end.kind == "pinned" and family == 0):
            return 0.0, 0.0, 0.0, 0.0, 0.0
        if family == 1:
            turned = End(end.kind, end.rotational) if end.kind == "spring" else End("free")
            return 0.0, *under_waves(turned, impedances[1], dt), 0.0
        return 0.0, *under_waves(end, impedances[0], dt), end.force

    def _initial(self, x: float, quantity: str, h: float | None = None) -> float:
        """Return a quantity of the displacement at t = 0, by differences over h [m].

        The shear force is zero.
        """
        if self._beam.displacement is None:
            return 0.0
        length = self._beam.length
        h = length * 1e-3 if h is None else h
        middle = min(max(x, h), length - h)
        low, here, high = self._beam.displacement(np.array([middle - h, middle, middle + h]))
        if quantity == "displacement":
            return float(self._beam.displacement(np.array([x]))[0])
        curvature = (high - 2.0 * here + low) / h**2
        if quantity == "rotation":
            return float((high - low) / (2.0 * h) + (x - middle) * curvature)
        return float(self._beam.segments[0].bending_stiffness * curvature) if quantity == "bending_moment" else 0.0

    def _response(self, row: Array, numbers: Array, shear: Grid, ends: Array, impedance: float, dt: float) -> Array:
        """Return the change of coordinates and shear waves per newton on one over a step."""
        n, count = self.n_dof, shear.cells
        node = int(numbers[int(np.argmax(row)), 1])
        response, at = np.zeros(2 * n + ENDS + 2 * count), 2 * n + ENDS
        if 0 < node < count:
            velocity = 0.5 / impedance
            response[at + node] = response[at + count + node - 1] = velocity
        else:
            side = 0 if node == 0 else 1
            velocity, inertia = float(ends[side, 1]), float(ends[side, 3])
            response[at if node == 0 else at + 2 * count - 1] = velocity
            response[2 * n + 2 * side] = dt * velocity
            response[2 * n + 2 * side + 1] = 2.0 * velocity if inertia > 0.0 else velocity
        for c, (kind, index, share) in enumerate(numbers):
            if kind == DEFLECTION:
                response[n + c] = velocity * ((index == node) * (1.0 - share) + (index + 1 == node) * share)
                response[c] = dt * response[n + c]
            elif kind == SHEAR:
                for cell, part in ((int(index), 1.0 - share), (int(index) + 1, share)):
                    response[c] += part * impedance * (response[at + count + cell] - response[at + cell])
        return response
