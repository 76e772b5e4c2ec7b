"""Bodies in SI and in plain frozen records: rods, beams, masses, walls.

x runs from a body's left end to its right end; displacements and velocities are positive to the right. Of a beam the
displacement is the deflection, positive up.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, final

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from impactlab.models.base import AbstractRodModel

Profile = Callable[[NDArray[float64]], NDArray[float64]]
"""A quantity as a function of x [m], shape (n,) to shape (n,)."""


@dataclass(frozen=True)
class Table:
    """A quantity given at places x [m], rising; straight lines between them."""

    x: tuple[float, ...]
    u: tuple[float, ...]

    def __call__(self, x: NDArray[float64]) -> NDArray[float64]:
        return np.asarray(np.interp(x, self.x, self.u), dtype=float)


@dataclass(frozen=True)
class Segment:
    """A uniform piece of a rod or a beam."""

    length: float  # m
    area: float  # m2
    young: float  # Pa
    density: float  # kg/m3
    viscosity: float = 0.0  # Pa s: stress = E strain + viscosity times strain rate (Kelvin and Voigt)

    @property
    def wave_speed(self) -> float:
        """Speed of axial waves sqrt(E/rho) [m/s]."""
        return float((self.young / self.density) ** 0.5)

    @property
    def impedance(self) -> float:
        """Impedance rho c A [N s/m]."""
        return self.density * self.wave_speed * self.area

    @property
    def mass(self) -> float:
        """Mass rho A L [kg]."""
        return self.density * self.area * self.length


@dataclass(frozen=True)
class BeamSegment(Segment):
    """A uniform piece of a beam."""

    inertia: float = math.nan  # m4, second moment I of the area about the neutral axis
    shear_stiffness: float = math.inf  # N, k G A; inf where shear gives no deformation
    rotary_inertia: float = 0.0  # kg m, rho I; 0 where rotation costs no kinetic energy
    height: float = math.nan  # m, of the cross section, where it is known

    @property
    def bending_stiffness(self) -> float:
        """Bending stiffness E I [N m2]."""
        return self.young * self.inertia

    @property
    def shear_speed(self) -> float:
        """Speed of the shear front sqrt(k G A/(rho A)) [m/s]; inf for a beam that does not shear."""
        return math.sqrt(self.shear_stiffness / (self.density * self.area))

    @property
    def shear_impedance(self) -> float:
        """Impedance sqrt(k G A rho A) [N s/m] of a cross section in one direction; inf where nothing shears."""
        return math.sqrt(self.shear_stiffness * self.density * self.area)


@dataclass(frozen=True)
class End:
    """What holds an end of a rod or a beam: nothing, a clamp, a grounded spring or dashpot, or a mass riding on it.

    A beam may be pinned (no deflection, free rotation), its spring may resist rotation too, and it may go on for ever.
    A force may act on an end that is not clamped or pinned.
    """

    kind: Literal["free", "clamped", "spring", "dashpot", "mass", "pinned", "infinite"]
    value: float = 0.0  # N/m, N s/m or kg
    force: float = 0.0  # N, along +x (of a beam along +u), constant from t = 0 on
    rotational: float = 0.0  # N m/rad, of a spring against rotation at the end of a beam

    @property
    def carries(self) -> str:
        """What contact laws are told of this end: its kind, or `force` where a force acts on it."""
        return "force" if self.force != 0.0 else self.kind


@dataclass(frozen=True)
class Rayleigh:
    """Damping of a whole rod by its own matrices: C = mass M + stiffness K."""

    mass: float = 0.0  # 1/s
    stiffness: float = 0.0  # s


@dataclass(frozen=True)
class ElasticBody(ABC):
    """A straight body of one or more uniform segments along x, which moves along its axis or across it."""

    name: str
    segments: tuple[Segment, ...]
    left: End
    right: End
    velocity: float = 0.0  # m/s, uniform at t = 0
    displacement: Profile | None = None  # m, at t = 0
    model: AbstractRodModel | None = None  # None only while a case is being read
    damping: Rayleigh = Rayleigh()

    @property
    @abstractmethod
    def kind(self) -> str:
        """What a case calls such a body: ``rod`` or ``beam``."""

    @property
    def length(self) -> float:
        """Whole length [m]."""
        return sum(segment.length for segment in self.segments)

    @property
    def mass(self) -> float:
        """Mass of the segments, without end masses [kg]."""
        return sum(segment.mass for segment in self.segments)

    @property
    def end_force(self) -> float:
        """Sum of the forces on both ends [N], along +x, of a beam along +u."""
        return self.left.force + self.right.force

    @property
    def is_damped(self) -> bool:
        """Whether the body itself loses energy; dashpots at its ends do not count."""
        return self.damping != Rayleigh() or any(segment.viscosity > 0.0 for segment in self.segments)

    @property
    def is_held(self) -> bool:
        """Whether anything but contacts and loads can change its momentum."""
        return any(end.kind not in ("free", "mass") for end in (self.left, self.right))

    @property
    def round_trip(self) -> float:
        """Time of a wave to the far end and back, 2 L/c summed over the segments [s], with c = sqrt(E/rho)."""
        return sum(2.0 * segment.length / segment.wave_speed for segment in self.segments)


@final
@dataclass(frozen=True)
class Rod(ElasticBody):
    """A straight elastic rod: it moves along its axis."""

    @property
    def kind(self) -> str:
        return "rod"


@final
@dataclass(frozen=True)
class Beam(ElasticBody):
    """A straight elastic beam: it deflects across its axis; its round trip is that of an axial wave."""

    segments: tuple[BeamSegment, ...]
    theory: Literal["euler_bernoulli", "timoshenko"] = "euler_bernoulli"
    tension: float = 0.0  # N, axial preload, positive in tension

    @property
    def kind(self) -> str:
        return "beam"


@dataclass(frozen=True)
class Mass:
    """A rigid body."""

    name: str
    mass: float  # kg
    velocity: float = 0.0  # m/s at t = 0


@dataclass(frozen=True)
class Wall:
    """A rigid body that never moves."""

    name: str


Body = Rod | Beam | Mass | Wall
