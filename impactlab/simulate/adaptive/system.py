"""A scene as a system of first order, y' = f(t, y), for adaptive solvers."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from impactlab.history.frame import drift_velocities
from impactlab.models.equations import SeveralEquations
from impactlab.scene.facts import field_acceleration
from impactlab.scene.method import Method
from impactlab.scene.problem import Point, Scene
from impactlab.simulate.adaptive.law import InstantContact
from impactlab.simulate.adaptive.matrices import ConstantMatrices
from impactlab.simulate.planning.preparation import BuiltBody, facts_of, start_law
from impactlab.startup.cached import cached_property
from impactlab.types import Array, Quantity

EPSILON = float(np.finfo(float).eps)
STRIDE = EPSILON ** (1.0 / 3.0)  # of the scales, of a central difference
MIN_DRIFT_SHARE = 1e-6  # of the speed of a common drift: slower motion is below its rounding, and it is the scale
TOUCH_TOL = 1e-12  # of the travels of the scene: faces nearer than this touch


class Energies(NamedTuple):
    """Energies and momenta at one instant, bodies in the order of the system."""

    time: float  # s
    bodies: Array  # (n_bodies,) J
    stored: float  # J
    lost: Array  # (3,) J so far, in contacts, in dashpots at ends and inside bodies
    work: float  # J, of loads and drives
    momentum: Array  # (n_bodies,) N s
    by_contact: Array  # (n_contacts,) J lost so far


class System:
    """Bodies and contacts as one system of first-order equations.

    The state holds positions, their rates, impulses and losses of the contacts, then integrals of powers of bodies. The
    integrals are entries of the state, so that they are as exact as the motion.
    """

    def __init__(self, scene: Scene, method: Method, built: dict[str, BuiltBody]) -> None:
        self.scene, self.method = scene, method
        own = {name: found for name, body in built.items() if (found := body.model.own_equations()) is not None}
        constant = {name: body for name, body in built.items() if name not in own}
        self.built = constant | {name: built[name] for name in own}
        self._matrices = ConstantMatrices(constant) if constant else None
        each = [*([] if self._matrices is None else [self._matrices]), *own.values()]
        self.equations = each[0] if len(each) == 1 else SeveralEquations(each)
        self.n_dof, self.n = self.equations.n_dof, self.equations.position.size
        n, contacts = self.n, len(scene.contacts)
        rows = [self.row(c.right, "displacement") - self.row(c.left, "displacement") for c in scene.contacts]
        self._rows = np.array(rows).reshape(contacts, self.n_dof)
        placed = self._rows @ self.equations.placed()
        self.gaps = np.array([contact.gap for contact in scene.contacts]) - placed  # at zero displacement
        self._farthest = float(np.abs(placed).max(initial=0.0))  # m
        self.contacts = []
        for number, contact in enumerate(scene.contacts):  # there is no step: the run stands for it
            law, facts = method.laws[contact.name], facts_of(scene, method, built, {}, number)
            start = start_law(law, facts, contact.name, f"contacts.{number}.law", scene.duration)
            self.contacts.append(InstantContact(law, contact.name, start, scene.duration))
        self.impulses, self.losses = slice(2 * n, 2 * n + contacts), slice(2 * n + contacts, 2 * (n + contacts))
        self.evaluations = 0
        self.start = np.zeros(self.losses.stop + self.equations.powers)
        self.start[:n], self.start[n : 2 * n] = self.equations.position, self.equations.velocity
        self._scales()

    def row(self, point: Point, quantity: Quantity) -> Array:
        """Return a quantity at a point as a row over all displacements (or velocities)."""
        row = np.zeros(self.n_dof)
        row[self.equations.parts[point.body]] = self.built[point.body].model.row(point.x, quantity)
        return row

    def _scales(self) -> None:
        """Set the scales of speed, time, force and of each state entry.

        The speed is the largest of: a body's own in the frame of the bodies that may interact, that of its strain
        energy at the start, gravity or centrifugal force over the run, that of the wave that an end force sends, that
        of the loads and drives of a mechanism. A coordinate's share of it is that of its body (`shares`). Travels are
        those within the shortest period of the bodies, or the run.
        """
        scene = self.scene
        masses = {name: body.moving_mass for name, body in scene.bodies.items() if body.moves}
        at_start = self.energies(self.start)
        speeds = [field_acceleration(scene) * scene.duration]
        for body in scene.elastic.values():
            speeds.append(body.left.largest_force(scene.duration) / body.segments[0].impedance)
            speeds.append(body.right.largest_force(scene.duration) / body.segments[-1].impedance)
        speeds.append(self.equations.speed(masses, scene.duration))
        energies, frames = dict(zip(self.built, at_start.bodies.tolist(), strict=True)), drift_velocities(scene)
        drifting = max(map(abs, frames.values()), default=0.0)
        speeds.append(MIN_DRIFT_SHARE * drifting)
        for name, mass in masses.items():
            drift = frames[name]
            carried = drift * (scene.bodies[name].velocity - 0.5 * drift)
            speeds.append(math.sqrt(2.0 * max(0.0, energies[name] / mass - carried)))
        lightest, heaviest = min(masses.values(), default=1.0), max(masses.values(), default=1.0)
        speeds.append(float(np.sqrt(2.0 * at_start.stored / lightest)))
        self.speed = max(speeds) if max(speeds) > MIN_DRIFT_SHARE * drifting else drifting or 1.0
        highest = max((body.system.highest_frequency for body in self.built.values()), default=0.0)
        self.time = min(scene.duration, 1.0 / highest) if highest > 0.0 else scene.duration
        self.travel = max(self.speed * self.time, EPSILON / TOUCH_TOL * self._farthest)
        self.force = heaviest * self.speed / self.time
        self.scale = np.full(self.start.size, heaviest * self.speed)
        self.scale[self.losses.start :] = 0.5 * heaviest * self.speed**2
        shares = self.speed * self.equations.shares(masses)
        self.scale[: self.n], self.scale[self.n : 2 * self.n] = shares * self.time, shares

    def load_impulses(self, state: Array) -> dict[str, float]:
        """Return the impulses of forces over time on ends so far [N s], by body."""
        return {} if self._matrices is None else self._matrices.load_impulses(state[self.losses.stop :])

    @property
    def shortest_interval(self) -> float:
        """Shortest time between changes of the slope of a force [s].

        It is the duration of the run where no force varies.
        """
        duration = self.scene.duration
        return duration if self._matrices is None else self._matrices.shortest_interval(duration)

    def motion(self, state: Array) -> tuple[Array, Array]:
        """Return displacements and velocities, (n_dof,) or (n_dof, n_times), of one state or (n_state, n_times).

        Rows of faces and probes are over these.
        """
        return self.equations.motion(state[: self.n], state[self.n : 2 * self.n])

    def gaps_of(self, state: Array) -> tuple[Array, Array]:
        """Return gaps [m] and gap rates [m/s] at states (n_state,) or (n_state, n_times)."""
        displacement, velocity = self.motion(state)
        gaps, rates = self._rows @ displacement, self._rows @ velocity
        return (gaps.T + self.gaps).T, rates

    def rates(self, time: float, state: Array) -> Array:
        """Return the rate of change of the state."""
        self.evaluations += 1
        n, out = self.n, np.zeros_like(state)
        v = state[n : 2 * n]
        displacement, velocity, forces = self.equations.at(time, state[:n], v)
        gaps, gap_rates = self._rows @ displacement + self.gaps, self._rows @ velocity
        for number, contact in enumerate(self.contacts):
            contact.port.time = time
            force, power = contact.force_and_loss(float(gaps[number]), float(gap_rates[number]))
            out[self.impulses.start + number], out[self.losses.start + number] = force, power
            if force != 0.0:
                forces += force * self._rows[number]
        out[:n] = v
        out[n : 2 * n], out[self.losses.stop :] = self.equations.accelerations(time, v, forces)
        return out

    def moments(self, times: Array, states: Array) -> dict[str, Array]:
        """Return the moments of drives (n_drives, n_times) [N m] by body, in states (n_state, n_times)."""
        gaps, rates = self.gaps_of(states)
        forces = np.zeros_like(gaps)
        for number, contact in enumerate(self.contacts):
            if contact.closed:
                both = zip(gaps[number].tolist(), rates[number].tolist(), strict=True)
                forces[number] = [contact.force_and_loss(gap, rate)[0] for gap, rate in both]
        p, v = states[: self.n], states[self.n : 2 * self.n]
        return self.equations.moments(times, p, v, self._rows.T @ forces)

    def jacobian(self, time: float, state: Array) -> Array:
        """Return the dense derivative of rates by state, laws by central differences; of mechanisms, all."""
        if self._matrices is not self.equations:
            return self._differences(time, state)
        n, matrix = self.n, self._linear.copy()
        matrix[-2, n : 2 * n], matrix[-1, n : 2 * n] = self._matrices.losing(state[n : 2 * n])
        gaps, gap_rates = self.gaps_of(state)
        for number, contact in enumerate(self.contacts):
            gap, rate = float(gaps[number]), float(gap_rates[number])
            if not contact.closed:
                continue
            contact.port.time = time
            for first, at, (along_gap, along_rate) in (
                (0, STRIDE * max(abs(gap), self.speed * self.time), (1.0, 0.0)),
                (n, STRIDE * max(abs(rate), self.speed), (0.0, 1.0)),
            ):
                up = contact.force_and_loss(gap + at * along_gap, rate + at * along_rate)
                down = contact.force_and_loss(gap - at * along_gap, rate - at * along_rate)
                force, power = ((a - b) / (2.0 * at) for a, b in zip(up, down, strict=True))
                along = self._rows[number]
                matrix[n : 2 * n, first : first + n] += np.outer(self._pushed[:, number], force * along)
                matrix[self.impulses.start + number, first : first + n] += force * along
                matrix[self.losses.start + number, first : first + n] += power * along
        return matrix

    @cached_property
    def _linear(self) -> Array:
        """The Jacobian of bodies with constant matrices without contact, dense."""
        matrix = np.zeros((self.start.size, self.start.size))
        if self._matrices is not None:
            matrix[: 2 * self.n, : 2 * self.n] = self._matrices.linear
        return matrix

    @cached_property
    def _pushed(self) -> Array:
        """Accelerations per unit force of each contact, shape (n_dof, n_contacts)."""
        if self._matrices is None or not len(self._rows):
            return np.zeros((self.n_dof, 0))
        return self._matrices.inverse(self._rows.T.copy())

    def _differences(self, time: float, state: Array) -> Array:
        matrix = np.zeros((state.size, state.size))
        for i in range(2 * self.n):  # nothing follows from the integrals
            stride = STRIDE * max(abs(float(state[i])), float(self.scale[i]))
            moved = np.zeros(state.size)
            moved[i] = stride
            matrix[:, i] = (self.rates(time, state + moved) - self.rates(time, state - moved)) / (2.0 * stride)
        return np.nan_to_num(matrix)  # beyond the reach of a slide, where a solver finds no step

    def energies(self, state: Array, time: float = 0.0) -> Energies:
        """Return energies and momenta of a state."""
        n = self.n
        bodies = self.equations.balance(state[:n], state[n : 2 * n], state[self.losses.stop :])
        gaps, _ = self.gaps_of(state)
        # Laws that follow a face after an opening have lost energy that no integral holds yet.
        released = [c.released(float(g)) for c, g in zip(self.contacts, gaps, strict=True)]
        by_contact = state[self.losses] + np.array(released)
        return Energies(
            time=time,
            bodies=bodies.energies,
            stored=sum(c.stored(float(g)) for c, g in zip(self.contacts, gaps, strict=True)),
            lost=np.array([float(by_contact.sum()), *bodies.lost]),
            work=bodies.work,
            momentum=bodies.momenta,
            by_contact=by_contact,
        )

    def begin(self) -> list[int]:
        """Close contacts that touch at t = 0 and return their numbers."""
        gaps, gap_rates = self.gaps_of(self.start)
        closed: list[int] = []
        n, away = self.n, self.away
        for number, contact in enumerate(self.contacts):
            gap, rate = float(gaps[number]), float(gap_rates[number])
            if abs(gap) <= away and abs(rate) <= 1e-12 * self.speed:  # at rest: the sign of the acceleration decides
                a = self.rates(0.0, self.start)[n : 2 * n]
                second = self.equations.second_rates(self.start[:n], self.start[n : 2 * n], a)
                rate = float(self._rows[number] @ second) * self.time
            if (abs(gap) <= away and rate < 0.0) or (gap < -away and contact.evaluate(gap, rate).trial > 0.0):
                closed.append(number)
            elif gap < -away:  # no force, as the face recedes faster than the damper lets the spring follow
                contact.held = contact.stored(gap)
        for number in closed:
            self.contacts[number].close(float(gaps[number]), float(gap_rates[number]), away)
        return closed

    @property
    def away(self) -> float:
        """Largest gap [m] of faces that touch."""
        return TOUCH_TOL * self.travel
