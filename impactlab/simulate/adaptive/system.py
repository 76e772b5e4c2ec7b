"""A scene as a system of first order, y' = f(t, y), for adaptive solvers."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from impactlab.numerics.banded import multiply, widened
from impactlab.scene.facts import field_acceleration
from impactlab.scene.frame import drift_velocities
from impactlab.scene.method import Method
from impactlab.scene.problem import Point, Scene
from impactlab.simulate.adaptive.law import InstantContact
from impactlab.simulate.stepping.preparation import BuiltBody, facts_of, start_law
from impactlab.types import Array, Quantity

if TYPE_CHECKING:
    from scipy.sparse import csr_array

STRIDE = np.finfo(float).eps ** (1.0 / 3.0)  # of the scales, of a central difference
MIN_DRIFT_SHARE = 1e-6  # of the speed of a common drift: slower motion is below its rounding, and it is the scale
TOUCH_TOL = 1e-12  # of the travels of the scene: faces nearer than this touch


class Energies(NamedTuple):
    """Energies and momenta at one instant, bodies in the order of the system."""

    time: float  # s
    bodies: Array  # (n_bodies,) J
    stored: float  # J
    lost: Array  # (3,) J so far, in contacts, in dashpots at ends and inside bodies
    work: float  # J, of gravity and end forces
    momentum: Array  # (n_bodies,) N s


def joined(matrices: list[Array]) -> Array:
    """Return banded matrices as the blocks of one, with nothing between them."""
    bandwidth = max(matrix.shape[0] for matrix in matrices) - 1
    blocks = [widened(matrix, bandwidth) for matrix in matrices]
    for block in blocks:
        for offset in range(1, bandwidth + 1):
            block[offset, max(0, block.shape[1] - offset) :] = 0.0
    return np.hstack(blocks)


def sparse(banded: Array) -> csr_array:
    """Return a symmetric banded matrix for fast products."""
    from scipy.sparse import csr_array, diags_array

    n = banded.shape[1]
    lower = [banded[offset, : n - offset] for offset in range(min(len(banded), n))]
    both = [*lower[:0:-1], *lower]
    return csr_array(diags_array(both, offsets=range(-len(lower) + 1, len(lower)), shape=(n, n)))


def inverse_of(mass: Array) -> Callable[[Array], Array]:
    """Return the function that divides forces by a banded mass, factorised once."""
    from scipy.linalg import cho_solve_banded, cholesky_banded

    if not np.any(mass[1:]):
        inverse = 1.0 / mass[0]
        return lambda force: np.asarray((force.T * inverse).T)
    factors = (cholesky_banded(mass, lower=True), True)
    return lambda force: np.asarray(cho_solve_banded(factors, force, check_finite=False))


class System:
    """The state holds displacements, velocities, impulses and losses of the contacts, losses at ends and inside rods.

    The integrals are entries of the state, so that they are as exact as the motion.
    """

    def __init__(self, scene: Scene, method: Method, built: dict[str, BuiltBody]) -> None:
        self.scene, self.method, self.built = scene, method, built
        systems = [body.system for body in built.values()]
        sizes = [system.load.size for system in systems]
        starts = np.concatenate(([0], np.cumsum(sizes)))
        self.parts = {name: slice(int(a), int(b)) for name, a, b in zip(built, starts[:-1], starts[1:], strict=True)}
        self.n_dof = n = int(starts[-1])
        self.mass, self.stiffness, self.damping = (
            joined([getattr(system, name) for system in systems]) for name in ("mass", "stiffness", "damping")
        )
        self.load = np.concatenate([system.load for system in systems])
        self._stiffness, self._damping = sparse(self.stiffness), sparse(self.damping)
        self._damped = bool(np.any(self.damping))
        self._ends = np.concatenate([system.dashpots_at_ends() for system in systems])
        self.inverse = inverse_of(self.mass)
        self.gaps = np.array([contact.gap for contact in scene.contacts])
        rows = [self.row(c.right, "displacement") - self.row(c.left, "displacement") for c in scene.contacts]
        self.rows = np.array(rows).reshape(len(rows), n)
        self.contacts = []
        for number, contact in enumerate(scene.contacts):  # there is no step: the run stands for it
            law, facts = method.laws[contact.name], facts_of(scene, method, built, {}, number)
            start = start_law(law, facts, f"contacts.{number}.law", scene.duration)
            self.contacts.append(InstantContact(law, start, scene.duration))
        self.impulses = slice(2 * n, 2 * n + len(rows))
        self.losses = slice(2 * n + len(rows), 2 * n + 2 * len(rows))
        self.evaluations = 0
        self.start = np.zeros(2 * n + 2 * len(rows) + 2)
        self.start[:n] = np.concatenate([system.displacement for system in systems])
        self.start[n : 2 * n] = np.concatenate([system.velocity for system in systems])
        self._scales()

    def row(self, point: Point, quantity: Quantity) -> Array:
        """Return a quantity at a point as a row over all displacements (or velocities)."""
        row = np.zeros(self.n_dof)
        row[self.parts[point.body]] = self.built[point.body].model.row(point.x, quantity)
        return row

    def _scales(self) -> None:
        """Set the scales of this scene: speed, time, force, and that of every entry of the state.

        The speed is the largest of: a body's own in the frame of the bodies that may interact, that of its strain
        energy at the start, gravity or centrifugal force over the run, that of the wave that an end force sends. A
        coordinate's share of it is the root mean square over the coordinates of a body that moves with it. Travels are
        those within the shortest period of the bodies, or the run.
        """
        scene, n = self.scene, self.n_dof
        masses = {name: body.moving_mass for name, body in scene.bodies.items() if body.moves}
        at_start = self.energies(self.start)
        speeds = [field_acceleration(scene) * scene.duration]
        for body in scene.elastic.values():
            speeds.append(abs(body.left.force) / body.segments[0].impedance)
            speeds.append(abs(body.right.force) / body.segments[-1].impedance)
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
        self.force = heaviest * self.speed / self.time
        self.scale = np.full(self.start.size, heaviest * self.speed)
        self.scale[self.losses.start :] = 0.5 * heaviest * self.speed**2
        for name, mass in masses.items():
            part = self.parts[name]
            share = self.speed * float(np.sqrt(mass / self.mass[0, part].sum()))
            self.scale[part] = share * self.time
            self.scale[n + part.start : n + part.stop] = share

    def gaps_of(self, state: Array) -> tuple[Array, Array]:
        """Return gaps [m] and gap rates [m/s] of all contacts in states (n_state,) or (n_state, n_times)."""
        n = self.n_dof
        gaps, rates = self.rows @ state[:n], self.rows @ state[n : 2 * n]
        return (gaps.T + self.gaps).T, rates

    def rates(self, time: float, state: Array) -> Array:
        """Return the rate of change of the state."""
        self.evaluations += 1
        n, out = self.n_dof, np.zeros_like(state)
        velocity = state[n : 2 * n]
        push = self.load - self._stiffness @ state[:n]
        if self._damped:
            drag = self._damping @ velocity
            push -= drag
            out[-2:] = self.lost_by(velocity, drag)
        gaps, gap_rates = self.gaps_of(state)
        for number, contact in enumerate(self.contacts):
            contact.port.time = time
            force, power = contact.force_and_loss(float(gaps[number]), float(gap_rates[number]))
            out[self.impulses.start + number], out[self.losses.start + number] = force, power
            if force != 0.0:
                push += force * self.rows[number]
        out[:n], out[n : 2 * n] = velocity, self.inverse(push)
        return out

    def lost_by(self, velocity: Array, drag: Array) -> tuple[float, float]:
        """Return the power [W] lost in dashpots and by damping; drag [N] is C v."""
        at_ends = self._ends * velocity
        return float((velocity * at_ends).sum()), float((velocity * (drag - at_ends)).sum())

    @cached_property
    def _linear(self) -> Array:
        """The Jacobian without contact, dense."""
        n, size = self.n_dof, self.start.size
        matrix = np.zeros((size, size))
        matrix[:n, n : 2 * n] = np.eye(n)
        matrix[n : 2 * n, :n] = -self.inverse(self._stiffness.toarray())
        matrix[n : 2 * n, n : 2 * n] = -self.inverse(self._damping.toarray())
        return matrix

    @cached_property
    def _pushed(self) -> Array:
        """Accelerations per unit force of each contact, shape (n_dof, n_contacts)."""
        return self.inverse(self.rows.T.copy()) if len(self.rows) else np.zeros((self.n_dof, 0))

    def jacobian(self, time: float, state: Array) -> Array:
        """Return the dense derivative of rates by state, laws by central differences."""
        n, matrix = self.n_dof, self._linear.copy()
        drag, at_ends = 2.0 * (self._damping @ state[n : 2 * n]), 2.0 * self._ends * state[n : 2 * n]
        matrix[-2, n : 2 * n], matrix[-1, n : 2 * n] = at_ends, drag - at_ends
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
                along = self.rows[number]
                matrix[n : 2 * n, first : first + n] += np.outer(self._pushed[:, number], force * along)
                matrix[self.impulses.start + number, first : first + n] += force * along
                matrix[self.losses.start + number, first : first + n] += power * along
        return matrix

    @cached_property
    def _ground(self) -> Array:
        return np.concatenate([body.system.springs_to_ground() for body in self.built.values()])

    @cached_property
    def _momenta(self) -> Array:
        """Momenta of the bodies as rows over all velocities, shape (n_bodies, n_dof)."""
        rows = np.zeros((len(self.built), self.n_dof))
        for row, (name, body) in zip(rows, self.built.items(), strict=True):
            row[self.parts[name]] = body.model.momentum_row()
        return rows

    def energies(self, state: Array, time: float = 0.0) -> Energies:
        """Return energies and momenta of a state.

        Strain energy is summed over springs, to the ground and between coordinates: a rod that has travelled far loses
        no digits.
        """
        n = self.n_dof
        u, v = state[:n], state[n : 2 * n]
        strained = self._ground * u * u
        for offset in range(1, len(self.stiffness)):
            strained[:-offset] -= self.stiffness[offset, :-offset] * (u[offset:] - u[:-offset]) ** 2
        energy = 0.5 * (strained + v * multiply(self.mass, v))
        gaps, _ = self.gaps_of(state)
        # Laws that follow a face after an opening have lost energy that no integral holds yet.
        released = sum(c.released(float(g)) for c, g in zip(self.contacts, gaps, strict=True))
        return Energies(
            time=time,
            bodies=np.array([energy[part].sum() for part in self.parts.values()]),
            stored=sum(c.stored(float(g)) for c, g in zip(self.contacts, gaps, strict=True)),
            lost=np.array([float(state[self.losses].sum()) + released, *state[-2:]]),
            work=float(self.load @ u),
            momentum=self._momenta @ v,
        )

    def begin(self) -> list[int]:
        """Close contacts that touch at t = 0 and return their numbers."""
        gaps, gap_rates = self.gaps_of(self.start)
        closed: list[int] = []
        n, away = self.n_dof, self.away
        for number, contact in enumerate(self.contacts):
            gap, rate = float(gaps[number]), float(gap_rates[number])
            if abs(gap) <= away and abs(rate) <= 1e-12 * self.speed:  # at rest: the sign of the acceleration decides
                rate = float(self.rows[number] @ self.rates(0.0, self.start)[n : 2 * n]) * self.time
            if (abs(gap) <= away and rate < 0.0) or (gap < -away and contact.evaluate(gap, rate).trial > 0.0):
                closed.append(number)
        for number in closed:
            self.contacts[number].close(float(gaps[number]), float(gap_rates[number]), away)
        return closed

    @property
    def away(self) -> float:
        """Largest gap [m] of faces that touch."""
        return TOUCH_TOL * self.speed * self.time
