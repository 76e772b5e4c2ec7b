"""Bodies with constant matrices as one banded system, M u'' + C u' + K u = load + forces."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, final

import numpy as np

from impactlab.models.equations import AbstractEquations, Balance
from impactlab.numerics.banded import multiply, widened
from impactlab.simulate.planning.preparation import BuiltBody
from impactlab.startup.cached import cached_property
from impactlab.types import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

MAX_PARTS = 20_000  # of a run: samples nearer to each other do not bound the step


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
    if n == 0:  # walls alone
        return csr_array((0, 0))
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


@final
class ConstantMatrices(AbstractEquations):
    """Bodies whose matrices do not change.

    Its powers are the forces over time on ends (their integrals are impulses), the powers of these, and those lost in
    dashpots at ends and by damping inside.
    """

    def __init__(self, built: Mapping[str, BuiltBody]) -> None:
        systems = [body.system for body in built.values()]
        starts = np.concatenate(([0], np.cumsum([system.load.size for system in systems])))
        self.parts = {name: slice(int(a), int(b)) for name, a, b in zip(built, starts[:-1], starts[1:], strict=True)}
        self.n_dof = int(starts[-1])
        self.mass, self.stiffness, self.damping = (
            joined([getattr(system, name) for system in systems]) for name in ("mass", "stiffness", "damping")
        )
        self.load = np.concatenate([system.load for system in systems])
        self.position = np.concatenate([system.displacement for system in systems])
        self.velocity = np.concatenate([system.velocity for system in systems])
        self._built, self._stiffness, self._damping = built, sparse(self.stiffness), sparse(self.damping)
        self._damped = bool(np.any(self.damping))
        self._loads = [(name, x, load) for name, each in built.items() for x, load in each.body.loads]
        self._loaded = np.zeros((len(self._loads), self.n_dof))
        for row, (name, x, _) in zip(self._loaded, self._loads, strict=True):
            row[self.parts[name]] = built[name].model.row(x, "displacement")
        self.powers = 2 * len(self._loads) + 2
        self._ends = np.concatenate([system.dashpots_at_ends() for system in systems])
        self.inverse = inverse_of(self.mass)
        self._powers = np.zeros(self.powers)

    def at(self, time: float, p: Array, v: Array) -> tuple[Array, Array, Array]:
        if self.n_dof == 0:  # walls alone
            return p, v, self.load.copy()
        forces = self.load - self._stiffness @ p
        if self._damped:
            drag = self._damping @ v
            forces -= drag
            self._powers[-2:] = self.lost_by(v, drag)
        if self._loads:
            now, count = np.array(time), len(self._loads)
            pushed = np.array([float(load.at(now)) for _, _, load in self._loads])
            forces = forces + pushed @ self._loaded
            self._powers[:count], self._powers[count : 2 * count] = pushed, pushed * (self._loaded @ v)
        return p, v, forces

    def accelerations(self, time: float, v: Array, forces: Array) -> tuple[Array, Array]:
        return self.inverse(forces), self._powers

    def motion(self, p: Array, v: Array) -> tuple[Array, Array]:
        return p, v

    def lost_by(self, velocity: Array, drag: Array) -> tuple[float, float]:
        """Return the power [W] lost in dashpots and by damping; drag [N] is C v."""
        at_ends = self._ends * velocity
        return float((velocity * at_ends).sum()), float((velocity * (drag - at_ends)).sum())

    def shares(self, masses: Mapping[str, float]) -> Array:
        """Return root mean squares over the coordinates of bodies, per speed.

        A body that moves as a whole has the speed; ``masses`` are those of moving bodies [kg].
        """
        found = np.ones(self.n_dof)
        for name in masses.keys() & self.parts.keys():
            part = self.parts[name]
            found[part] = float(np.sqrt(masses[name] / self.mass[0, part].sum()))
        return found

    @cached_property
    def linear(self) -> Array:
        """The Jacobian without contact, dense, over displacements and velocities."""
        n = self.n_dof
        matrix = np.zeros((2 * n, 2 * n))
        matrix[:n, n:] = np.eye(n)
        matrix[n:, :n] = -self.inverse(self._stiffness.toarray())
        matrix[n:, n:] = -self.inverse(self._damping.toarray())
        return matrix

    def losing(self, v: Array) -> tuple[Array, Array]:
        """Return the derivatives of the powers by the velocities, (n,) each."""
        drag, at_ends = 2.0 * (self._damping @ v), 2.0 * self._ends * v
        return at_ends, drag - at_ends

    @cached_property
    def _ground(self) -> Array:
        return np.concatenate([body.system.springs_to_ground() for body in self._built.values()])

    @cached_property
    def _momenta(self) -> Array:
        """Momenta of the bodies as rows over all velocities, shape (n_bodies, n_dof)."""
        rows = np.zeros((len(self._built), self.n_dof))
        for row, (name, body) in zip(rows, self._built.items(), strict=True):
            row[self.parts[name]] = body.model.momentum_row()
        return rows

    def balance(self, p: Array, v: Array, integrals: Array) -> Balance:
        """Return energies and momenta.

        Strain energy is summed over springs, to the ground and between coordinates: a rod that has travelled far loses
        no digits.
        """
        strained = self._ground * p * p
        for offset in range(1, len(self.stiffness)):
            strained[:-offset] -= self.stiffness[offset, :-offset] * (p[offset:] - p[:-offset]) ** 2
        energy = 0.5 * (strained + v * multiply(self.mass, v))
        return Balance(
            energies=np.array([energy[part].sum() for part in self.parts.values()]),
            momenta=self._momenta @ v,
            work=float(self.load @ p) + float(integrals[len(self._loads) : -2].sum()),
            lost=(float(integrals[-2]), float(integrals[-1])),
        )

    def load_impulses(self, integrals: Array) -> dict[str, float]:
        """Return the impulses of forces over time so far [N s], by body."""
        found: dict[str, float] = {}
        for (name, _, _), impulse in zip(self._loads, integrals, strict=False):
            found[name] = found.get(name, 0.0) + float(impulse)
        return found

    def shortest_interval(self, duration: float) -> float:
        """Return the shortest time between changes of a load's slope [s].

        It is at least a small part of the run.
        """
        spacings = [load.spacing(duration) for _, _, load in self._loads]
        return max(min(spacings, default=duration), duration / MAX_PARTS)
