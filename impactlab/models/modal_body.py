"""Bodies in modal coordinates, of any basis."""

from __future__ import annotations

from typing import Literal, final

import numpy as np

from impactlab.bases.base import Coordinates, Span
from impactlab.bases.reduced import ReducedMesh
from impactlab.bases.residual import MIN_RESIDUAL, WithResiduals
from impactlab.errors import PairingError
from impactlab.models.base import AbstractDiscreteModel, Face, Operators, Phases
from impactlab.models.mesh.base import AbstractMesh, end_load
from impactlab.models.messengers import Waves, arriving_row, waves_at
from impactlab.numerics.banded import multiply
from impactlab.scene.bodies import Beam, ElasticBody
from impactlab.startup.cached import cached_property
from impactlab.types import Array, Quantity


@final
class ModalBody(AbstractDiscreteModel):
    """A rod in mass-normalised modal coordinates: unit mass, squared frequencies as stiffness.

    Parameters
    ----------
    rod : Rod
    gravity : float
        m/s2, along +x.
    basis : Coordinates
    paper_rule : bool
        ``points_per_period`` counts the continuous rod's period (the paper's Eq. 24) if the rod is uniform; else that
        of the highest frequency kept.
    massless : tuple of float
        Places [m] of contacts where the static compliance of the modes left out acts as a spring without mass.
    phases : Phases, optional
    waves : Waves, optional
        Of the modes, where another theory than that of the rod or beam holds (for messengers of single modes).
    """

    def __init__(
        self,
        rod: ElasticBody,
        gravity: float,
        basis: Coordinates,
        paper_rule: bool,
        massless: tuple[float, ...] = (),
        phases: Phases | None = None,
        waves: Waves | None = None,
    ) -> None:
        self._rod, self._gravity, self._basis = rod, gravity, basis
        self._paper_rule, self._massless, self._phases = paper_rule, massless, phases
        self._waves = waves
        self._damping = proportional_damping(rod)
        # That were read; every caller gets the same arrays.
        self._rows: dict[tuple[float, Quantity], Array] = {}
        self._left_out: dict[tuple[float, Quantity, float], float] = {}

    def operators(self) -> Operators:
        basis, rod = self._basis, self._rod
        n_dof = basis.frequencies.size
        elastic = int(np.count_nonzero(basis.frequencies))
        highest = float(basis.frequencies.max(initial=0.0))
        rule = highest
        first = rod.segments[0]
        if self._paper_rule and all(first.continues_in(each) for each in rod.segments[1:]):
            # The paper's rule (Eq. 24) counts the continuous rod's period with any mesh.
            rule = float((2 * elastic + 1) * np.pi * first.wave_speed / (2.0 * rod.length))
        if self._phases is not None:
            closed = self._phases.closed.operators()
            highest, rule = max(highest, closed.highest_frequency), max(rule, closed.rule_frequency)
        rigid, forces = self._uniform, self._gravity != 0.0 or rod.left.force != 0.0 or rod.right.force != 0.0
        squared = basis.frequencies[None, :] ** 2
        of_mass, of_stiffness = self._damping
        return Operators(
            mass=np.ones((1, n_dof)),
            damping=of_mass + of_stiffness * squared,
            stiffness=squared,
            load=rigid * self._gravity + end_load(self, rod) if forces else np.zeros(n_dof),
            displacement=np.zeros(n_dof) if rod.displacement is None else basis.project(rod.displacement),
            velocity=rigid * rod.velocity,
            highest_frequency=highest,
            rule_frequency=rule,
            diagonal_mass=True,
            end_dashpots=np.zeros(n_dof),
            modes=True,
            massless=tuple((x, self.left_out(x, "displacement", x)) for x in self._massless if self._is_incomplete(x)),
            phases=self._phases,
            momentum=self._uniform,
        )

    def row(self, x: float, quantity: Quantity) -> Array:
        quantity = "displacement" if quantity == "velocity" else quantity  # the same row
        if (row := self._rows.get((x, quantity))) is None:
            row = self._rows[x, quantity] = self._basis.row(x, quantity)
            row.flags.writeable = False
        return row

    def left_out(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the static compliance minus that of the elastic modes kept (mode acceleration)."""
        key = x, quantity, face
        if isinstance(self._basis, WithResiduals) and key not in self._left_out:
            self._left_out[key] = self._basis.remainder(x, quantity, face)
        elif key not in self._left_out:
            frequencies = self._basis.frequencies
            elastic = frequencies > 0.0
            kept = self.row(x, quantity)[elastic] * self.row(face, "displacement")[elastic]
            static = self._basis.static(x, quantity, face)
            self._left_out[key] = static - float(np.sum(kept / frequencies[elastic] ** 2))
        return self._left_out[key]

    def momentum_row(self) -> Array:
        return self._uniform

    @property
    def approximate(self) -> ReducedMesh | None:
        """Return the mesh in shapes that need not be eigenvectors; None where the modes are."""
        return self._basis if isinstance(self._basis, ReducedMesh) and not self._basis.uncoupled else None

    @cached_property
    def _uniform(self) -> Array:
        row = self._basis.project_uniform()
        row.flags.writeable = False
        return row

    def grid(self) -> Array:
        return self._basis.grid()

    def arriving(self, face: float, delay: float, speed: Literal["phase", "group"]) -> Array:
        if self._rod.rotation is not None:
            raise PairingError(
                f"messengers of single modes do not support rotating bodies, and '{self._rod.name}' turns at "
                f"{self._rod.rotation.rate:.6g} rad/s",
                remedy="Use wave_identification (rods), addition_deletion or penalty.",
                path=f"bodies.{self._rod.name}.rotation",
            )
        if isinstance(self._basis, WithResiduals):
            raise PairingError(
                "messengers of single modes need a body whose coordinates are all modes, and "
                f"'{self._rod.name}' also has a static shape for each contact",
                remedy="Leave out residual of model modal.",
                path="solve.model.residual",
            )
        waves = self._waves or waves_at(self._rod, face, self._basis.frequencies)
        return arriving_row(self._rod, waves, self.row, face, delay, speed)

    def _is_incomplete(self, x: float) -> bool:
        """Return whether a face has flexibility beyond its coordinates: not if these are complete."""
        return self.left_out(x, "displacement", x) > MIN_RESIDUAL * self._basis.static(x, "displacement", x)


def reduced_body(
    gravity: float, mesh: AbstractMesh, span: Span, paper_rule: bool, faces: tuple[Face, ...]
) -> ModalBody:
    """Return a body in the coordinates of a basis of its mesh."""
    rod = mesh.body
    basis = ReducedMesh(mesh, span.shapes, span.uncoupled)
    massless = tuple(dict.fromkeys(face.x for face in faces)) if span.residual else mesh.places
    phases = None
    if span.closed is not None:
        contact, shapes = span.closed
        attached = ReducedMesh(mesh, shapes, uncoupled=False)
        closed = ModalBody(rod, gravity, attached, paper_rule, massless)
        phases = Phases(contact, closed, projections(basis, attached), projections(attached, basis))
    return ModalBody(rod, gravity, basis, paper_rule, massless, phases)


def projections(given: ReducedMesh, wanted: ReducedMesh) -> Array:
    """Return the maps (2, n_dof, n_dof) from one set of coordinates to another.

    The first is of displacements, the second of velocities. Velocities are projected orthogonally in the mass,
    displacements in the stiffness and the rigid motion of a free rod in the mass: the part dropped has no energy in
    common with the part kept, and none that is negative.
    """
    mesh = given.mesh
    velocities = wanted.shapes.T @ multiply(mesh.mass[..., None], given.shapes)
    elastic = wanted.frequencies > 0.0
    displacements = velocities.copy()
    forces = wanted.shapes[:, elastic].T @ multiply(mesh.stiffness[..., None], given.shapes)
    displacements[elastic] = forces / wanted.frequencies[elastic, None] ** 2
    return np.array([displacements, velocities])


def proportional_damping(rod: ElasticBody) -> tuple[float, float]:
    """Return a [1/s] and b [s] of C = a M + b K.

    K is that of the rotating frame of a body that turns.

    Raise `PairingError` where the damping of the rod is another.

    Only then do its undamped modes stay uncoupled.
    """
    times = {segment.viscosity / segment.young for segment in rod.segments}
    without = [
        text
        for text, acts in (
            ("a spring", any(end.kind == "spring" for end in (rod.left, rod.right))),
            ("a tension", isinstance(rod, Beam) and rod.tension != 0.0),
            ("a rotation", rod.bends and rod.rotation is not None),
        )
        if acts
    ]
    if len(times) > 1 or (without and times != {0.0}):
        what = (
            f"{' and '.join(without)} without viscosity" if len(times) == 1 else "segments of several ratios to young"
        )
        raise PairingError(
            f"model 'modal' does not support the viscosity of '{rod.name}': beside {what}, it couples the modes",
            remedy="Use finite_element, or damping of the whole rod: damping: {mass: 1/s, stiffness: s}.",
            path="solve.model",
        )
    viscous = times.pop()  # of the elastic stiffness, K + Omega^2 M
    return rod.damping.mass + viscous * rod.softening, rod.damping.stiffness + viscous
