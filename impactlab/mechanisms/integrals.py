"""Integrals over a link: products of its shapes and of its shortening.

They are taken once. The shortening is that by bending.

A point at x of a link moves to A + (x + u - s) e + v n, with the angle of e; u = psi.a is the axial displacement,
v = phi.q the deflection, and s = q.S q/2 with S(x) = integral of phi' phi'^T from 0 to x the shortening: it stands for
the stiffness that rotation gives to bending, and for buckling.

References
----------
KaneRyanBanerjee1987.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.types import Array

GAUSS = 5  # points of an element: slopes are quadratic there, S is of degree five


class Shapes(NamedTuple):
    """Shapes of a link at the Gauss points of its elements, and at its ends."""

    nodes: Array  # (elements + 1,) m
    density: Array  # (elements,) kg/m
    axial: Array  # (points, na), psi
    bending: Array  # (points, nb), phi
    slopes: Array  # (points, nb), phi'
    axial_end: Array  # (na,) psi at the end
    bending_end: Array  # (nb,) phi at the end
    root_slopes: Array  # (nb,) phi' at the root
    end_slopes: Array  # (nb,) phi' at the end
    axial_stiffness: Array  # (na, na) N/m
    bending_stiffness: Array  # (nb,) N/m


class Integrals(NamedTuple):
    """Integrals of rho A times products over a link, in the order of `terms`."""

    moments: Array  # (3,) kg, kg m, kg m2: of 1, x, x^2
    a0: Array  # (na,) psi
    a1: Array  # (na,) x psi
    aa: Array  # (na, na) psi psi
    ka: Array  # (na, na) N/m
    b0: Array  # (nb,) phi
    b1: Array  # (nb,) x phi
    bb: Array  # (nb,) phi phi: the shapes are orthogonal
    kb: Array  # (nb,) N/m
    ab: Array  # (na, nb) psi phi
    s: Array  # (nb, 3 + na, nb) amplitude that it is contracted with; S at the end, then S, x S and psi S; row
    axial_end: Array  # (na,)
    bending_end: Array  # (nb,)
    root_slopes: Array  # (nb,)
    end_slopes: Array  # (nb,)


def gauss_points(nodes: Array) -> tuple[Array, Array]:
    """Return places and weights (points,) [m] of all elements, one element after the other."""
    places, weights = np.polynomial.legendre.leggauss(GAUSS)
    half = 0.5 * np.diff(nodes)
    middle = 0.5 * (nodes[1:] + nodes[:-1])
    return (middle[:, None] + half[:, None] * places).ravel(), (half[:, None] * weights).ravel()


def shortening(nodes: Array, slopes: Array) -> tuple[Array, Array]:
    """Return S at the Gauss points and at the nodes [1/m].

    Shapes are (points, nb, nb) and (elements + 1, nb, nb).
    """
    places, weights = np.polynomial.legendre.leggauss(GAUSS)
    powers = np.arange(GAUSS)
    to_powers = np.linalg.inv(places[:, None] ** powers)  # coefficients of the polynomial through the points
    upto = (places[:, None] ** (powers + 1) - (-1.0) ** (powers + 1)) / (powers + 1) @ to_powers
    half = 0.5 * np.diff(nodes)
    products = (slopes[:, :, None] * slopes[:, None, :]).reshape(len(half), GAUSS, -1)
    whole = np.einsum("e,g,egk->ek", half, weights, products)
    at_nodes = np.vstack((np.zeros((1, products.shape[2])), np.cumsum(whole, axis=0)))
    inside = at_nodes[:-1, None, :] + half[:, None, None] * np.einsum("hg,egk->ehk", upto, products)
    size = slopes.shape[1]
    return inside.reshape(-1, size, size), at_nodes.reshape(-1, size, size)


def integrals(shapes: Shapes) -> Integrals:
    """Return the integrals of a link with given shapes."""
    x, weights = gauss_points(shapes.nodes)
    weights = weights * np.repeat(shapes.density, GAUSS)
    inside, at_nodes = shortening(shapes.nodes, shapes.slopes)
    psi, phi = shapes.axial, shapes.bending
    heavy_psi, heavy_phi = weights[:, None] * psi, weights[:, None] * phi
    over = np.column_stack((weights, weights * x, heavy_psi))
    products = np.concatenate((at_nodes[-1:], np.tensordot(over.T, inside, 1)))
    return Integrals(
        moments=np.array([weights.sum(), weights @ x, weights @ x**2]),
        a0=heavy_psi.sum(axis=0), a1=x @ heavy_psi, aa=heavy_psi.T @ psi, ka=shapes.axial_stiffness,
        b0=heavy_phi.sum(axis=0), b1=x @ heavy_phi, bb=(heavy_phi * phi).sum(axis=0), kb=shapes.bending_stiffness,
        ab=heavy_psi.T @ phi, s=np.moveaxis(products, 0, 1),
        axial_end=shapes.axial_end, bending_end=shapes.bending_end,
        root_slopes=shapes.root_slopes, end_slopes=shapes.end_slopes,
    )  # fmt: skip


def rigid_link(mass: float, length: float, inertia: float) -> Integrals:
    """Return the integrals of a rigid link with its centre in the middle.

    ``mass`` is in kg, ``inertia`` in kg m2 about the middle.
    """
    none, square, cube = np.zeros(0), np.zeros((0, 0)), np.zeros((0, 3, 0))
    moments = np.array([mass, 0.5 * mass * length, inertia + 0.25 * mass * length**2])
    return Integrals(
        moments, none, none, square, square, none, none, none, none, square, cube, none, none, none, none,
    )  # fmt: skip
