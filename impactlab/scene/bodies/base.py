"""Facts of every body, and of those that deform, in SI units.

x runs from a body's left end to its right end; displacements and velocities are positive to the right. Of a beam the
displacement is the deflection, positive up.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from impactlab.errors import CaseError, closest
from impactlab.scene.bodies.loads import AbstractLoad
from impactlab.scene.bodies.pieces import UNDAMPED, End, Profile, Rayleigh
from impactlab.scene.bodies.rotation import Rotation
from impactlab.scene.bodies.segmented import Segmented
from impactlab.scene.bodies.steady import SteadyRod, SteadyState
from impactlab.types import INTERNAL_FORCES, QUANTITIES_OF_ROD, Quantity, SideFacts


@dataclass(frozen=True)
class Body(ABC):
    """A body of a scene: facts of its motion for contacts, checks, warnings and reports.

    A rigid body has no length and no waves; `ElasticBody` adds segments and ends. A new kind of body overrides the
    facts in which it differs.
    """

    name: str
    rotation: Rotation | None = field(default=None, kw_only=True)  # None: the body does not turn

    kind: ClassVar[str]  # its name in a case, as ``rod``
    moves: ClassVar[bool] = True  # False: nothing can move it
    falls: ClassVar[bool] = True  # False: gravity does not act along its motion
    bends: ClassVar[bool] = False  # True: it moves across its axis, and has a face on either side everywhere
    waves_of_solid: ClassVar[bool] = True  # False: its wave speed is not that of a material, as of a string
    changes: ClassVar[bool] = False  # True: its matrices change as it moves
    coordinates_per_node: ClassVar[int] = 1  # of a finite element mesh
    own_channels: ClassVar[tuple[tuple[str, Quantity], ...]] = ()  # recorded in every run: name and quantity at x = 0

    @property
    def recorded(self) -> tuple[tuple[str, float, Quantity], ...]:
        """Channels that every run records: name, place x [m] and quantity."""
        return tuple((f"{own}:{self.name}", 0.0, quantity) for own, quantity in self.own_channels)

    @property
    def velocity(self) -> float:
        """Velocity at t = 0 [m/s]."""
        return 0.0

    @property
    def gravity(self) -> tuple[float, float]:
        """Gravity in the plane of a body of large motion, (x, y) [m/s2].

        Other bodies have that of the scene.
        """
        return 0.0, 0.0

    @property
    @abstractmethod
    def moving_mass(self) -> float:
        """Mass [kg] with the masses on its ends; inf where it never moves."""

    @property
    def rigid_mass(self) -> float:
        """Mass [kg] of a rigid body; NaN of an elastic one, inf of a wall."""
        return math.nan if self.elastic is not None else self.moving_mass

    @property
    def length(self) -> float:
        """Whole length [m]; 0 of a rigid body."""
        return 0.0

    @property
    def modelled_parts(self) -> tuple[str, ...]:
        """Names of its parts that have a model each; empty for a single part."""
        return ()

    @property
    def sliding(self) -> str:
        """Name of the link of a mechanism whose end slides, else empty."""
        return ""

    @property
    def elastic(self) -> ElasticBody | None:
        """The body itself where it deforms and needs a model, None where it is rigid."""
        return None

    @property
    def waves(self) -> WaveBody | None:
        """The body itself where its motion is the wave equation of a rod, else None."""
        return None

    @property
    def quantities(self) -> Mapping[str, tuple[Quantity, float]]:
        """Quantities of it, each with the quantity of its model and the factor on it."""
        return plain("displacement", "velocity") if self.moves else {}

    def reading(self, quantity: str) -> tuple[Quantity, float]:
        """Return the quantity of its model and the factor for one of `quantities`.

        Raises
        ------
        CaseError
            If the body has no such quantity.
        """
        if str(quantity) not in self.quantities:
            raise CaseError(
                f"the {self.kind} '{self.name}' has no {quantity}.{closest(quantity, self.quantities)}",
                remedy=f"It has: {', '.join(self.quantities) or 'nothing, as it never moves'}.",
            )
        return self.quantities[quantity]

    @property
    def ends(self) -> tuple[tuple[float, End], ...]:
        """Place x [m] and support of each end; none of a rigid body."""
        return ()

    @property
    def ground_drives(self) -> tuple[tuple[str, str], ...]:
        """Links turned by a ground drive past the links before them, each with the previous one."""
        return ()

    @property
    def lengths_of_bent(self) -> Mapping[str, float]:
        """Lengths [m] of flexible links by name, each with a channel of its shortening."""
        return {}

    @property
    def end_force(self) -> float:
        """Sum of the constant forces on both ends [N], along +x, on a beam along +u."""
        return 0.0

    @property
    def loads(self) -> tuple[tuple[float, AbstractLoad], ...]:
        """Place x [m] of each end with a force over time, and that force."""
        return tuple([(x, end.load) for x, end in self.ends if end.load is not None])

    def is_driven(self, x: float) -> bool:
        """Return whether drives alone move a place, so that no force there can."""
        return False

    @property
    def is_held(self) -> bool:
        """Whether a support other than contacts and loads can change its momentum."""
        return not self.moves

    @property
    def is_free(self) -> bool:
        """Whether only contacts and loads change its momentum; damping by its mass holds it, too.

        The centrifugal force changes that of a body that turns and moves in the plane of rotation.
        """
        return self.moves and self.softening == 0.0

    @property
    def softening(self) -> float:
        """Centrifugal force per mass and displacement along the motion [1/s2]; 0 without rotation."""
        return 0.0 if self.rotation is None else self.rotation.softening

    @property
    def slowest_period(self) -> float:
        """First period [s] of the clamped and free body; 0 of a rigid one."""
        return 0.0

    @property
    def static_compliance(self) -> float:
        """Compliance of the whole body along its motion, L/EA of a rod [m/N].

        It is 0 of a rigid body, NaN if it bends.
        """
        return 0.0

    @property
    def has_fronts(self) -> bool:
        """Whether its waves have a front, before which nothing moves."""
        return False

    @property
    def unbounded_first_force(self) -> bool:
        """Whether the first force of a hard contact on it has no bound."""
        return False

    def theory_doubts(self, contact: str, duration: float) -> tuple[str, ...]:
        """Return the reasons why its theory may not hold, a sentence each.

        ``contact`` is the name of that contact, ``duration`` its length [s], inf without one.
        """
        return ()

    def mesh_rounding(self, element_length: float) -> float:
        """Return the energy that rounding may give its mesh, over that of the slowest motion."""
        return 0.0

    @property
    def steady(self) -> SteadyState | None:
        """Steady state of a body that deforms and turns; None of any other."""
        return None

    def steady_place(self, x: float) -> float:
        """Return the place of x in the steady state, from the axis [m].

        It is counted along the motion. It is the radius of a body that moves along the radius; of a mass minus
        ``axis_at``, of a beam 0.
        """
        return 0.0 if self.rotation is None else -self.rotation.axis_at

    def face_channel(self, x: float) -> str:
        """Return the name of the channel of the displacement at x [m]: ``displacement:rod@0.15``."""
        return f"displacement:{self.name}@{x:.6g}"

    def impedance_at(self, x: float) -> float:
        """Return the wave impedance [N s/m] at x [m], both directions; inf without waves."""
        return math.inf

    def side_facts(self, x: float, element_length: float) -> SideFacts:
        """Return the facts of a face at x [m], for elements of a length [m]."""
        nan = math.nan
        return SideFacts(self.kind, nan, nan, nan, nan, nan, self.rigid_mass, 0.0, body=self.name)

    def travel_time(self, x: float, other: float) -> float:
        """Return the least travel time [s] between two x [m]; 0 without fronts."""
        return 0.0


@dataclass(frozen=True)
class ElasticBody(Segmented, Body):
    """A straight body of uniform segments along x that moves along or across its axis."""

    velocity: float = 0.0  # m/s, uniform at t = 0
    displacement: Profile | None = None  # m, at t = 0
    damping: Rayleigh = UNDAMPED

    @property
    def elastic(self) -> ElasticBody:
        return self

    @property
    def moving_mass(self) -> float:
        return self.mass + sum(end.value for end in (self.left, self.right) if end.kind == "mass")

    @property
    def loads(self) -> tuple[tuple[float, AbstractLoad], ...]:
        return super().loads if self.left.load is not None or self.right.load is not None else ()

    @property
    def end_force(self) -> float:
        return self.left.force + self.right.force

    @property
    @abstractmethod
    def stiffness(self) -> float:
        """Static stiffness [N/m], EA/L of a rod with its first segment."""

    def own_ratios(self) -> tuple[tuple[str, float, str], ...]:
        """Return ratios of sizes of its kind: text, ratio, and key below the body."""
        return ()

    def retardation(self, x: float, quantity: Quantity) -> float:
        """Return the viscous part of an internal force at x, per its rate [s].

        It is viscosity over E, and the factor of the stiffness in Rayleigh damping, which is a viscosity of that factor
        times E. It is 0 of quantities that are no internal force.
        """
        if quantity not in INTERNAL_FORCES:
            return 0.0
        segment = self.segment_at(x)
        return segment.viscosity / segment.young + self.damping.stiffness

    @property
    def is_damped(self) -> bool:
        """Whether the body itself loses energy; dashpots at its ends do not count."""
        return self.damping != UNDAMPED or any(segment.viscosity > 0.0 for segment in self.segments)

    @property
    def is_held(self) -> bool:
        return any(end.kind not in ("free", "mass") for end in (self.left, self.right))

    @property
    @abstractmethod
    def is_held_along(self) -> bool:
        """Whether an end holds the body along its axis, so that it may rotate steadily."""

    @property
    def limit_rate(self) -> float:
        """Rate [rad/s] from which its stiffness does not hold it; inf where the mesh limits it."""
        return math.inf

    @property
    def is_free(self) -> bool:
        return not self.is_held and self.damping.mass == 0.0 and self.softening == 0.0

    def travel_time(self, x: float, other: float) -> float:
        return self.front_time(x, other) if self.has_fronts else 0.0


@dataclass(frozen=True)
class WaveBody(ElasticBody):
    """An elastic body whose displacement u solves the wave equation of rods.

    E A u'' = rho A u_tt in each segment.
    """

    @property
    def waves(self) -> WaveBody:
        return self

    @property
    def quantities(self) -> Mapping[str, tuple[Quantity, float]]:
        return plain(*QUANTITIES_OF_ROD)

    @property
    def slowest_period(self) -> float:
        return 2.0 * self.round_trip

    @property
    def stiffness(self) -> float:
        return self.segments[0].young * self.segments[0].area / self.length

    @property
    def static_compliance(self) -> float:
        return sum(each.length / (each.young * each.area) for each in self.segments)

    @property
    def has_fronts(self) -> bool:
        return not self.is_damped

    @property
    def is_held_along(self) -> bool:
        return any(end.kind in ("clamped", "spring") for _, end in self.ends)

    @property
    def limit_rate(self) -> float:
        return SteadyRod(self.segments, self.left, self.right).limit_rate()

    @property
    def steady(self) -> SteadyState | None:
        return None if self.rotation is None else self._steady_rod(self.rotation).state()

    def steady_place(self, x: float) -> float:
        return 0.0 if self.rotation is None else self._steady_rod(self.rotation).section(x)[0]

    def _steady_rod(self, rotation: Rotation) -> SteadyRod:
        return SteadyRod(self.segments, self.left, self.right, rotation.rate, rotation.axis_at)

    def impedance_at(self, x: float) -> float:
        if not self.is_inner(x):
            return self.segment_at(x).impedance
        return self.segment_before(x).impedance + self.segment_at(x).impedance

    def side_facts(self, x: float, element_length: float) -> SideFacts:
        inner, segment = self.is_inner(x), self.segment_at(x)
        return SideFacts(
            kind="rod",
            impedance=self.impedance_at(x),
            wave_speed=segment.wave_speed,
            area=segment.area,
            element_stiffness=segment.young * segment.area / element_length,
            room=math.nan if inner else segment.length,
            mass=self.moving_mass,
            gravity=0.0,
            end=self.carries(x),
            body=self.name,
        )


def plain(*quantities: Quantity) -> dict[str, tuple[Quantity, float]]:
    """Return quantities that are those of the model itself, for `Body.quantities`."""
    return {quantity: (quantity, 1.0) for quantity in quantities}
