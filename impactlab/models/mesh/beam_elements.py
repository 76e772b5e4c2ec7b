"""The two-node beam element, which bends and shears: its shape functions and matrices.

The shapes are those of a beam that carries no load between its nodes: a cubic deflection and a quadratic rotation with
one shear strain, tied by Phi = 12 EI/(kGA h2). So the stiffness is exact for loads at nodes, nothing locks, and without
shear (Phi = 0) the element is that of Hermite's cubics. Coordinates are the deflection w [m] and the rotation theta
[rad] of the left node, then of the right.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from impactlab.scene.bodies import BeamSegment
from impactlab.types import Array

PLACES = 0.5 * (1.0 + np.array([-1.0, 1.0]) / np.sqrt(3.0))  # Gauss, exact for the square of a line
GAUSS = np.polynomial.legendre.leggauss(4)  # exact for the square of a cubic
GAUSS_PLACES = 0.5 * (1.0 + GAUSS[0])


class ElementMatrices(NamedTuple):
    """The matrices of one element, (4, 4) each."""

    stiffness: Array
    mass: Array
    tension: Array  # stiffness per tension of 1 N


def shear_ratio(segment: BeamSegment, h: float) -> float:
    """Return Phi = 12 EI/(kGA h2) of an element of length ``h`` [m]; 0 without shear."""
    return 12.0 * segment.bending_stiffness / (segment.shear_stiffness * h**2)


def deflections(place: float, h: float, phi: float) -> Array:
    """Return the deflection at ``place`` (0 to 1) per coordinate, shape (4,)."""
    s, r = place, 1.0 - place
    bubble = s * r
    return np.array(
        [
            r * r * (1.0 + 2.0 * s) + phi * r,
            h * bubble * (r + 0.5 * phi),
            s * s * (1.0 + 2.0 * r) + phi * s,
            -h * bubble * (s + 0.5 * phi),
        ]
    ) / (1.0 + phi)  # fmt: skip


def rotations(place: float, h: float, phi: float) -> Array:
    """Return the rotation per coordinate, shape (4,): the slope without shear deformation."""
    s, r = place, 1.0 - place
    bend = 6.0 * s * r / h
    return np.array([-bend, r * (r - 2.0 * s) + phi * r, bend, s * (s - 2.0 * r) + phi * s]) / (1.0 + phi)


def curvatures(place: float, h: float, phi: float) -> Array:
    """Return the slope of the rotation [1/m] per coordinate, shape (4,)."""
    bend = 6.0 * (1.0 - 2.0 * place) / h
    return np.array([-bend, 6.0 * place - 4.0 - phi, bend, 6.0 * place - 2.0 + phi]) / (h * (1.0 + phi))


def slope_of_curvature(h: float, phi: float) -> Array:
    """Return the second derivative of the rotation [1/m2] per coordinate, shape (4,): it is constant."""
    return np.array([12.0 / h, 6.0, -12.0 / h, 6.0]) / (h**2 * (1.0 + phi))


def shear_strain(h: float, phi: float) -> Array:
    """Return slope minus rotation per coordinate, shape (4,): it is constant."""
    return -phi / (1.0 + phi) * np.array([1.0 / h, 0.5, -1.0 / h, 0.5])


def stretched(segment: BeamSegment, h: float, tensions: Array) -> Array:
    """Return the stiffness (n, 4, 4) of elements under a tension.

    ``tensions`` are given at the four Gauss points, (n, 4) [N]. It is the integral of N w'^2, exact for a tension that
    is a quadratic in x.
    """
    phi = shear_ratio(segment, h)
    slopes = np.array([rotations(place, h, phi) for place in GAUSS_PLACES]) + shear_strain(h, phi)
    return np.asarray(np.einsum("eg,gi,gj->eij", 0.5 * h * GAUSS[1] * tensions, slopes, slopes))


@lru_cache(maxsize=256)
def matrices(segment: BeamSegment, h: float) -> ElementMatrices:
    """Return the exactly integrated matrices of an element of length h [m].

    They are kept and cannot be written.

    References
    ----------
    Przemieniecki1968, sections 5.6 and 11.4 (stiffness with shear); FriedmanKosmatka1993 (mass by the same shapes).
    """
    phi = shear_ratio(segment, h)
    bends = np.array([curvatures(place, h, phi) for place in PLACES])
    stiffness = 0.5 * h * segment.bending_stiffness * bends.T @ bends
    if phi > 0.0:
        sheared = shear_strain(h, phi)
        stiffness += h * segment.shear_stiffness * np.outer(sheared, sheared)
    weights = 0.5 * h * GAUSS[1]
    w = np.array([deflections(place, h, phi) for place in GAUSS_PLACES])
    theta = np.array([rotations(place, h, phi) for place in GAUSS_PLACES])
    slope = theta + shear_strain(h, phi)
    mass = segment.density * segment.area * (weights * w.T) @ w
    mass += segment.rotary_inertia * (weights * theta.T) @ theta
    found = ElementMatrices(stiffness, mass, (weights * slope.T) @ slope)
    for matrix in found:
        matrix.flags.writeable = False
    return found


def lumped(segment: BeamSegment, h: float) -> Array:
    """Return the diagonal mass of an element, shape (4,).

    It is in kg for deflections and in kg m2 for rotations. A node has half of the mass, and m h2/78 + rho I h/2.

    References
    ----------
    HintonRockZienkiewicz1976 (the diagonal of the consistent mass, scaled to the whole mass).
    """
    mass = segment.density * segment.area * h
    turning = mass * h**2 / 78.0 + 0.5 * segment.rotary_inertia * h
    return np.array([0.5 * mass, turning, 0.5 * mass, turning])
