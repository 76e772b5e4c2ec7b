"""Stiffness of the contact of two spheres, or of a sphere and a plane, by Hertz's theory."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, TypeVar, final

import numpy as np

from impactlab.options import option
from impactlab.types import Array

Number = TypeVar("Number", float, Array)

EXPONENT = 1.5  # of the indentation, of all smooth rounded bodies


def stiffness_of(radii: tuple[Number, Number], moduli: tuple[Number, Number], ratios: tuple[float, float]) -> Number:
    """Return K [N/m^1.5] of F = K d^1.5 between two spheres.

    K = 4/3 E* sqrt(R*), 1/R* = 1/R1 + 1/R2, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.

    Parameters
    ----------
    radii : pair of float or array
        Of both spheres [m]; inf is a plane.
    moduli : pair of float or array
        Young's moduli [Pa].
    ratios : pair of float
        Poisson's ratios.

    References
    ----------
    Hertz1882.
    """
    compliance = (1.0 - ratios[0] ** 2) / moduli[0] + (1.0 - ratios[1] ** 2) / moduli[1]
    found: Number = 4.0 / 3.0 / compliance * np.sqrt(1.0 / (1.0 / radii[0] + 1.0 / radii[1]))
    return found


@final
@dataclass(frozen=True)
class Spheres:
    """Two spheres, or a sphere and a plane, as a case gives them in place of a stiffness."""

    kind: ClassVar[str] = ""  # a case names none

    radius: float = option(unit="m", above=0.0, description="radius of the sphere or of the rounded end")
    young: float = option(unit="Pa", above=0.0, description="Young's modulus of the sphere")
    poisson: float = option(at_least=0.0, at_most=0.5, description="Poisson's ratio of the sphere")
    other_radius: float | None = option(
        None, unit="m", above=0.0, description="radius of the other sphere; a plane if not given"
    )
    other_young: float | None = option(
        None, unit="Pa", above=0.0, description="Young's modulus of the other body; the same if not given"
    )
    other_poisson: float | None = option(
        None, at_least=0.0, at_most=0.5, description="Poisson's ratio of the other body; the same if not given"
    )

    @property
    def stiffness(self) -> float:
        """Return K of F = K d^1.5 [N/m^1.5]."""
        other_young = self.young if self.other_young is None else self.other_young
        other_poisson = self.poisson if self.other_poisson is None else self.other_poisson
        radii = self.radius, math.inf if self.other_radius is None else self.other_radius
        return float(stiffness_of(radii, (self.young, other_young), (self.poisson, other_poisson)))
