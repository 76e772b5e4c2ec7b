"""Base classes of models, which describe bodies in space alone, and the operators of a body in coordinates."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Literal, NamedTuple, TypeVar

import numpy as np

from impactlab.errors import PairingError
from impactlab.models.equations import AbstractEquations
from impactlab.models.mesh.beam_runs import BeamElements
from impactlab.numerics.banded import grounded, multiply
from impactlab.scene.bodies import Beam, ElasticBody, WaveBody
from impactlab.types import Array, Quantity

Deformed = TypeVar("Deformed", bound=ElasticBody)  # a rod, a shaft or a beam


class Face(NamedTuple):
    """A contact of a body: its place and its partner."""

    x: float  # m from the rod's left end
    contact: int  # number of the contact in the scene
    partner_mass: float  # kg; inf for a wall, NaN for another rod


class Phases(NamedTuple):
    """Coordinates of a body that change while one of its contacts is closed.

    Both sets have the same number of coordinates.
    """

    contact: int  # number of the contact in the scene
    closed: AbstractDiscreteModel  # the body while it is closed
    closing: Array  # (2, n_dof, n_dof) maps of displacements and of velocities to the closed coordinates
    opening: Array  # (2, n_dof, n_dof) and back


class Operators(NamedTuple):
    """A linear body M a + C v + K u = load.

    Matrices are symmetric, in lower banded form; row i holds diagonal -i.

    Stiffness and damping are also springs and dashpots: between coordinates i and j of -K_ij, to the ground of the sum
    of row i. A model states these sums where they are known without rounding, as zero for a chain that is not held.
    """

    mass: Array  # (bandwidth + 1, n_dof)
    damping: Array  # (bandwidth + 1, n_dof)
    stiffness: Array  # (bandwidth + 1, n_dof)
    load: Array  # (n_dof,) N, constant: gravity and end forces
    displacement: Array  # (n_dof,) at t = 0
    velocity: Array  # (n_dof,) at t = 0
    highest_frequency: float  # rad/s, or a close bound above it; 0 for a body that never vibrates
    rule_frequency: float  # rad/s, the one whose period ``points_per_period`` counts
    diagonal_mass: bool
    modes: bool  # mass and stiffness are diagonal
    massless: tuple[tuple[float, float], ...] = ()  # places x [m] of faces without mass, and their flexibility [m/N]
    phases: Phases | None = None
    ground_springs: Array | None = None  # (n_dof,) N/m, sums of the rows of the stiffness; None: to be added up
    ground_dashpots: Array | None = None  # (n_dof,) N s/m, those of the damping inside the body; None: to be added up
    end_dashpots: Array | None = None  # (n_dof,) N s/m, of dashpots at the ends, part of the damping; None: zero
    beam_elements: BeamElements | None = None  # the stiffness, where it is that of a row of beam elements
    softening: float = 0.0  # 1/s2, of a body that turns: -softening M is in the stiffness, not in stated ground_springs
    momentum: Array | None = None  # (n_dof,) the model's momentum row; None: set where the stepper is prepared

    def springs_to_ground(self) -> Array:
        """Return the springs to the ground, shape (n_dof,) [N/m]."""
        if self.softening == 0.0:
            return self.supports()
        return self.supports() - self.softening * multiply(self.mass, np.ones(self.load.size))

    def supports(self) -> Array:
        """Return the springs to the ground, shape (n_dof,) [N/m], without centrifugal softening."""
        return grounded(self.stiffness) if self.ground_springs is None else self.ground_springs

    def dashpots_at_ends(self) -> Array:
        """Return the dashpots at the ends, shape (n_dof,) [N s/m]."""
        return np.zeros(self.load.size) if self.end_dashpots is None else self.end_dashpots

    def dashpots_inside(self) -> Array:
        """Return the dashpots from inside the body to the ground, shape (n_dof,) [N s/m]."""
        inside = self.ground_dashpots
        return grounded(self.damping, self.dashpots_at_ends()) if inside is None else inside


class AbstractDiscreteModel(ABC):
    """A body in a finite number of coordinates, built for one scene."""

    def for_run(self, duration: float) -> AbstractDiscreteModel:
        """Return the body for a run of a duration [s].

        It is the body itself where, as here, its coordinates do not depend on the duration.
        """
        return self

    @abstractmethod
    def operators(self) -> Operators:
        """Return mass, damping, stiffness, load and the state at t = 0."""

    @abstractmethod
    def row(self, x: float, quantity: Quantity) -> Array:
        """Return the quantity at x [m] as a row over the coordinates, shape (n_dof,).

        ``velocity`` is the row over velocities (the same as ``displacement``); strain, stress and force are positive
        in compression.
        """

    def own_equations(self) -> AbstractEquations | None:
        """Return the equations of motion of a body whose matrices are not constant, else None."""
        return None

    def left_out(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the static compliance at x of the modes left out: 0, as here.

        It is per unit force to the right at ``face`` [m].
        """
        return 0.0

    @abstractmethod
    def momentum_row(self) -> Array:
        """Return the momentum [N s] as a row over the velocities, shape (n_dof,)."""

    @abstractmethod
    def grid(self) -> Array:
        """Return the places [m] at which fields are given, shape (n,)."""

    def arriving(self, face: float, delay: float, speed: Literal["phase", "group"]) -> Array:
        """Return the velocity of a face due to the waves that arrive after ``delay`` [s], mode by mode.

        It is a row over displacements and velocities, shape (2 n_dof,); see `impactlab.models.messengers`. A body whose
        modes are not known, as here, raises `PairingError`.
        """
        raise PairingError(
            "a messenger for each mode needs a body in modes",
            remedy="Use model modal for this body, or a law that needs no messengers.",
        )


class AbstractRodModel(ABC):
    """A model of a rod or beam as a case file chooses it.

    It is a frozen dataclass of options.
    """

    exact: ClassVar[bool] = False  # True: its rods are solved from event to event where contacts are hard or springs;
    # not inherited by a model that builds its bodies itself or has another theory, unless it states it
    serves_rotation: ClassVar[bool] = False  # its bodies may turn (`Body.rotation`)
    theory: ClassVar[str] = ""  # of waves, if not that of the body: such runs have no reference
    citations: ClassVar[tuple[str, ...]] = ()
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)  # options that its contract suite tries, one by one

    def __init_subclass__(cls, **given: Any) -> None:
        super().__init_subclass__(**given)
        own = vars(cls)
        if "exact" not in own and not {"build", "build_beam", "theory"}.isdisjoint(own):
            cls.exact = False

    @property
    def has_mesh(self) -> bool:
        """Whether there are elements, as here, so that ``courant`` has a meaning."""
        return True

    @property
    def reads_partners(self) -> bool:
        """Whether its bodies may depend on the masses in contact with them (`Face.partner_mass`), as here."""
        return True

    @abstractmethod
    def element_length(self, body: ElasticBody) -> float:
        """Return the length of the shortest element, or the length per mode [m]."""

    def shortest_transit(self, body: ElasticBody) -> float:
        """Return the shortest time of a wave across an element [s], which ``courant`` counts.

        Here it is a lower bound: the shortest element at the fastest wave of the body.
        """
        return self.element_length(body) / max(segment.wave_speed for segment in body.segments)

    def meshed(self, body: Deformed, faces: tuple[Face, ...]) -> Deformed:
        """Return a body with segments to which its elements fit; unchanged, as here, by default.

        ``faces`` are its contacts, at which a mesh may need nodes.
        """
        return body

    @abstractmethod
    def build(self, rod: WaveBody, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractDiscreteModel:
        """Return the rod in coordinates, or as a body that steps by itself (`AbstractSelfStepping`).

        ``faces`` are the rod's contacts, for descriptions that depend on the places and the partners. Raises
        `CaseError` where the description does not support the rod.
        """

    def build_beam(self, beam: Beam, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractDiscreteModel:
        """Return a beam in coordinates, as `build` returns a rod.

        A model of rods alone, as here, raises `PairingError`.
        """
        raise PairingError(
            f"this model describes rods, and '{beam.name}' is a beam",
            remedy="Use finite_element or modal for this body: models: {name: {kind: modal, ...}}.",
            path=f"solve.models.{beam.name}",
        )

    def exact_frequencies(self, rod: WaveBody, count: int) -> Array | None:
        """Return the lowest elastic frequencies of a uniform rod, (count,) [rad/s].

        They are those of the model's own theory. None, as here, stands for the classical bar, u'' = u_tt/c^2.
        """
        return None
