"""Spheres: their mass, and the stiffness of their contact by Hertz's theory."""

from __future__ import annotations

import math
from typing import TypeAlias, overload

import numpy as np
from numpy.typing import ArrayLike

from impactlab.casefile.text.words import shown
from impactlab.casefile.values.materials import MATERIALS
from impactlab.casefile.values.units import to_si
from impactlab.contact.spheres import stiffness_of
from impactlab.errors import ImpactlabError
from impactlab.measurement.dispersion import DENSITIES
from impactlab.measurement.inputs import finite, pair, warn_unusual
from impactlab.types import Array

RADII = (1e-9, 1.0)  # m, of a sphere: a larger one is meant in mm, or is a density
MODULI = (1e4, 1.5e12)  # Pa, of gels and of diamond: a smaller one is meant in GPa

Size: TypeAlias = float | str
"""A number in SI, or a string with a unit such as ``5 mm``."""


@overload
def sphere_mass(radius: Size, density: Size) -> float: ...  # type: ignore[overload-overlap]
@overload
def sphere_mass(radius: ArrayLike, density: ArrayLike) -> Array: ...
def sphere_mass(radius: ArrayLike, density: ArrayLike) -> float | Array:
    """Return the mass [kg] of a sphere, 4/3 pi R^3 rho, or of several.

    Parameters
    ----------
    radius : float, str or array, shape (n,)
        m, or a string with a unit, ``"5 mm"``
    density : float, str or array, shape (n,)
        kg/m3, or a string with a unit, ``"7.85 g/cm^3"``, or the name of a material, ``"steel"``

    Raises
    ------
    ImpactlabError
        If a size is not a number, or not above 0.

    Warns
    -----
    UnusualValue
        If a radius is outside 1 nm to 1 m, or a density outside 500 to 25000 kg/m3, as where the two are exchanged.
    """
    if isinstance(density, str) and density in MATERIALS:
        density = MATERIALS[density].density
    r, rho = positive("radius", radius, "m"), positive("density", density, "kg/m3")
    order = "sphere_mass(radius, density)"
    if not warn_of_order("the radius of the sphere", r, "m", RADII, order):  # one warning where both are exchanged
        warn_of_order("the density of the sphere", rho, "kg/m3", DENSITIES, order)
    return _plain(4.0 / 3.0 * math.pi * r**3 * rho)


@overload
def sphere_stiffness(  # type: ignore[overload-overlap]
    young: Size, poisson: float, radius: Size, other: Size = math.inf, *, others: tuple[Size, float] | None = None
) -> float: ...
@overload
def sphere_stiffness(
    young: ArrayLike,
    poisson: float,
    radius: ArrayLike,
    other: ArrayLike = math.inf,
    *,
    others: tuple[ArrayLike, float] | None = None,
) -> Array: ...
def sphere_stiffness(
    young: ArrayLike,
    poisson: float,
    radius: ArrayLike,
    other: ArrayLike = math.inf,
    *,
    others: tuple[ArrayLike, float] | None = None,
) -> float | Array:
    """Return k [N/m^1.5] of F = k d^1.5 between two spheres.

    The other body may be a plane. k = 4/3 E* sqrt(R*), 1/R* = 1/R1 + 1/R2, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2. Two
    equal spheres have k = E sqrt(2 R)/(3 (1 - nu^2)). Of a row of spheres of radii R, ``radius=R[:-1], other=R[1:]``
    gives all contacts.

    Parameters
    ----------
    young, radius : float, str or array, shape (n,)
        Of the sphere [Pa, m], or a string with a unit, ``"210 GPa"``.
    poisson : float
        Of the sphere.
    other : float, str or array, shape (n,)
        Radius of the other sphere [m]; inf, as given here, is a plane.
    others : pair, optional
        Young's modulus [Pa] and Poisson's ratio of the other body; the same material if not given.

    Raises
    ------
    ImpactlabError
        If a size is not a number, or out of range, or arrays of sizes differ in shape.

    Warns
    -----
    UnusualValue
        If Young's modulus is outside 10 kPa to 1500 GPa, or a radius outside 1 nm to 1 m.

    References
    ----------
    Hertz1882.
    """
    second = (young, poisson) if others is None else pair("others", others, "('70 GPa', 0.33)")
    modulus, modulus_other = positive("young", young, "Pa"), positive("others", second[0], "Pa")
    r, r_other = positive("radius", radius, "m"), positive("other", other, "m")
    ratios = [finite("poisson", ratio, "1") for ratio in (poisson, second[1])]
    for ratio in ratios:
        if not 0.0 <= ratio <= 0.5:
            raise ImpactlabError(f"poisson {ratio:g} is out of range. Allowed: 0 to 0.5", remedy="Give another ratio.")
    shapes = [each.shape for each in (modulus, modulus_other, r, r_other) if each.shape]
    if len({*shapes}) > 1:
        text = f"sizes of shapes {', '.join(map(str, dict.fromkeys(shapes)))} are given"
        raise ImpactlabError(text, remedy="Give arrays of one shape, as in radius=R[:-1], other=R[1:].")
    order = "sphere_stiffness(young, poisson, radius, other)"
    if not warn_of_order("Young's modulus of the sphere", modulus, "Pa", MODULI, order):
        warn_of_order("the radius of the sphere", r, "m", RADII, order)
    return _plain(stiffness_of((r, r_other), (modulus, modulus_other), (ratios[0], ratios[1])))


def warn_of_order(name: str, values: Array, unit: str, usual: tuple[float, float], order: str) -> bool:
    """Issue an `UnusualValue` of sizes beyond the usual ones, with the order of the arguments; return whether."""
    odd = values[(values < usual[0]) | (values > usual[1])] if values.ndim else values
    if odd.size and not usual[0] <= (first := float(odd.flat[0])) <= usual[1]:
        warn_unusual(
            f"{name} is {first:.6g} {unit}, and usual ones lie between {usual[0]:g} and {usual[1]:g} {unit}. "
            f"The order is {order}, in SI or as strings with units."
        )
        return True
    return False


def positive(name: str, given: ArrayLike, unit: str) -> Array:
    """Return a size, or sizes, as an array in SI."""
    try:
        values = np.asarray(to_si(given, unit) if isinstance(given, str) else given, dtype=float)
    except ValueError as error:
        text = str(error) if isinstance(given, str) else f"{shown(given)} is neither a number nor an array of numbers"
        raise ImpactlabError(f"{name}: {text}", remedy=f"Give numbers in {unit}.") from None
    except TypeError:
        text = f"{name}: {type(given).__name__} is neither a number nor an array of numbers"
        raise ImpactlabError(text, remedy=f"Give numbers in {unit}.") from None
    wrong = np.argwhere(~(values > 0.0))
    if len(wrong):
        place = tuple(wrong[0].tolist())
        at = f"[{', '.join(map(str, place))}]" if place else ""
        text = f"{name}{at} {float(values[place]):g} is out of range. Allowed: above 0"
        raise ImpactlabError(text, remedy="Give a size in SI.")
    return values


def _plain(values: Array) -> float | Array:
    return float(values) if np.ndim(values) == 0 else np.asarray(values)
