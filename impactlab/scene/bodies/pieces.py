"""Parts of elastic bodies: segments, end supports, damping, tables over x."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from impactlab.scene.bodies.loads import AbstractLoad
from impactlab.types import Array

Profile = Callable[[Array], Array]
"""A quantity as a function of x [m], shape (n,) to shape (n,)."""


@dataclass(frozen=True)
class Table:
    """A quantity given at places x [m], rising; straight lines between them."""

    x: tuple[float, ...]
    u: tuple[float, ...]

    def __call__(self, x: Array) -> Array:
        return np.asarray(np.interp(x, self.x, self.u), dtype=float)


@dataclass(frozen=True)
class Segment:
    """A uniform piece of a rod or a beam."""

    length: float  # m
    area: float  # m2
    young: float  # Pa
    density: float  # kg/m3
    viscosity: float = 0.0  # Pa s: stress = E strain + viscosity times strain rate (Kelvin and Voigt)

    def continues_in(self, other: Segment) -> bool:
        """Return whether another piece has the same section and material, so that both are one."""
        return replace(other, length=self.length) == self

    @property
    def wave_speed(self) -> float:
        """Speed of axial waves sqrt(E/rho) [m/s]."""
        return math.sqrt(self.young / self.density)

    @property
    def front_speed(self) -> float:
        """Speed of its fastest front [m/s]."""
        return self.wave_speed

    @property
    def impedance(self) -> float:
        """Impedance rho c A [N s/m]."""
        return self.density * self.wave_speed * self.area

    @property
    def bending_stiffness(self) -> float:
        """Bending stiffness E I [N m2]; NaN where nothing bends."""
        return math.nan

    @property
    def mass(self) -> float:
        """Mass rho A L [kg]."""
        return self.density * self.area * self.length

    def per_velocity(self, quantity: str) -> float:
        """Return strain, stress [Pa] or force [N] per velocity difference [m/s] of both waves."""
        if quantity == "strain":
            return 1.0 / self.wave_speed
        return self.density * self.wave_speed * (self.area if quantity == "force" else 1.0)


@dataclass(frozen=True)
class End:
    """The support of an end of a body.

    The end is free, clamped, or on a grounded spring or dashpot, or it carries a mass that moves with it. The end of a
    beam may be pinned (no deflection, free rotation), its spring may resist rotation too, and it may be infinite. The
    infinite end of a rod or shaft is a dashpot of its impedance. A force may act on an end that is not clamped or
    pinned.
    """

    kind: Literal["free", "clamped", "spring", "dashpot", "mass", "pinned", "infinite"]
    value: float = 0.0  # N/m, N s/m or kg
    force: float = 0.0  # N, along +x (of a beam along +u), constant from t = 0 on
    rotational: float = 0.0  # N m/rad, of a spring against rotation at the end of a beam
    load: AbstractLoad | None = None  # a force over time, in place of the constant one
    unbounded: bool = False  # of a dashpot: the infinite end of a rod or shaft, whose impedance it has

    @property
    def is_loaded(self) -> bool:
        """Whether a force acts on it, constant or over time."""
        return self.force != 0.0 or self.load is not None

    def largest_force(self, duration: float) -> float:
        """Return the largest size [N] of the force on it over a run."""
        return abs(self.force) if self.load is None else self.load.largest(duration)

    @property
    def carries(self) -> str:
        """Kind of the end for contact laws, or `force` where a force acts."""
        return "force" if self.is_loaded else self.kind


@dataclass(frozen=True)
class Rayleigh:
    """Damping of a rod by its matrices, C = mass M + stiffness K."""

    mass: float = 0.0  # 1/s
    stiffness: float = 0.0  # s


UNDAMPED = Rayleigh()
