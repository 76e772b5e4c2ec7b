"""Spheres: their mass, and the stiffness of their contact by Hertz's theory."""

from __future__ import annotations

import math
import numbers

from impactlab.errors import ImpactlabError


def sphere_mass(radius: float, density: float) -> float:
    """Return the mass [kg] of a sphere: 4/3 pi R^3 rho.

    Parameters
    ----------
    radius : float
        m
    density : float
        kg/m3
    """
    _positive(radius=radius, density=density)
    return 4.0 / 3.0 * math.pi * radius**3 * density


def sphere_stiffness(
    young: float, poisson: float, radius: float, other: float = math.inf, *, others: tuple[float, float] | None = None
) -> float:
    """Return k [N/m^1.5] of F = k d^1.5 between a sphere and another one, or a plane.

    k = 4/3 E* sqrt(R*), 1/R* = 1/R1 + 1/R2, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2. Two equal spheres have
    k = E sqrt(2 R)/(3 (1 - nu^2)).

    Parameters
    ----------
    young, poisson, radius : float
        Of the sphere [Pa, 1, m].
    other : float
        Radius of the other sphere [m]; inf, as given here, is a plane.
    others : pair of float, optional
        Young's modulus [Pa] and Poisson's ratio of the other body; the same material if not given.

    References
    ----------
    Hertz1882.
    """
    second = (young, poisson) if others is None else others
    _positive(young=young, radius=radius, other=other, others=second[0])
    for ratio in (poisson, second[1]):
        if not 0.0 <= ratio <= 0.5:
            raise ImpactlabError(f"poisson {ratio:g} is out of range. Allowed: 0 to 0.5", remedy="Give another ratio.")
    compliance = (1.0 - poisson**2) / young + (1.0 - second[1] ** 2) / second[0]
    return 4.0 / 3.0 / compliance * math.sqrt(1.0 / (1.0 / radius + 1.0 / other))


def _positive(**given: float) -> None:
    for name, value in given.items():
        if not isinstance(value, numbers.Real):
            raise ImpactlabError(f"{name} {value!r} is not a number", remedy="Give a number in SI, such as 5e-3.")
        if not value > 0.0:
            raise ImpactlabError(f"{name} {value:g} is out of range. Allowed: above 0", remedy="Give a size in SI.")
