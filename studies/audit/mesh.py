"""Damped rods and beams in the modes of a separate mesh.

It has high-order elements; all modes are kept, contacts are at nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh

from studies.audit.network import Doc, section_of, segments_of
from studies.audit.tables import Array

DEGREE = 6  # of the elements of rods and of beams with shear


@dataclass
class Modes:
    """A body as oscillators: q'' + damping q' + square q = shape(x) force."""

    square: Array  # (modes,) 1/s2
    damping: Array  # (modes,) 1/s
    shapes: dict[float, Array]  # x -> (modes,), mass-normalised
    rates: Array  # (modes,) q' at the start
    load: Array  # (modes,) generalised force of gravity per m/s2


def lobatto(degree: int) -> Array:
    """Return the Gauss-Lobatto points on [-1, 1]."""
    inner = np.polynomial.Legendre.basis(degree).deriv().roots()
    return np.array([-1.0, *np.real(inner), 1.0])


def element(degree: int) -> tuple[Array, Array, Array]:
    """Return mass, stiffness and mixed matrices of Lagrange polynomials on an element of length 2."""
    nodes = lobatto(degree)
    inverse = np.linalg.inv(legendre.legvander(nodes, degree))
    x, w = legendre.leggauss(degree + 2)
    values = legendre.legvander(x, degree) @ inverse
    slopes = np.array([legendre.legval(x, legendre.legder(column)) for column in inverse.T]).T
    mass = values.T @ (w[:, None] * values)
    return mass, slopes.T @ (w[:, None] * slopes), slopes.T @ (w[:, None] * values)


def cells(body: Doc, points: list[float], count: int) -> list[tuple[float, Doc]]:
    """Return elements (length, segment) such that all points and steps of the section are nodes."""
    whole = sum(s["length"] for s in segments_of(body))
    found: list[tuple[float, Doc]] = []
    start = 0.0
    for segment in segments_of(body):
        stop = start + segment["length"]
        inner = sorted(x for x in points if start + 1e-9 * whole < x < stop - 1e-9 * whole)
        for a, b in zip([start, *inner], [*inner, stop], strict=True):
            number = max(2, round(count * (b - a) / whole))
            found += [((b - a) / number, segment)] * number
        start = stop
    return found


def damping_of(body: Doc) -> tuple[float, float]:
    """Return the shares of mass and stiffness in the damping.

    The ratio of viscosity to Young's modulus must be the same everywhere.
    """
    given = body.get("damping", {})
    ratios = {s["material"].get("viscosity", 0.0) / s["material"]["young"] for s in segments_of(body)}
    if max(ratios) - min(ratios) > 1e-9 * max(ratios):
        raise ValueError("viscosity not in proportion")
    return float(given.get("mass", 0.0)), float(given.get("stiffness", 0.0)) + max(ratios)


def end_of(body: Doc, side: str) -> Doc:
    """Return the support of an end, as a mapping."""
    end = body.get("ends", {}).get(side, "free")
    return {end: True} if isinstance(end, str) else dict(end)


def modes_of(body: Doc, points: list[float], count: int) -> Modes:
    """Return a body in the modes of a mesh of about so many elements."""
    if body["kind"] == "rod":
        mass, stiffness, along = _rod(body, points, count)
        ways, turns = 1, False
    elif body.get("theory", "euler_bernoulli") == "timoshenko":
        mass, stiffness, along = _sheared(body, points, count)
        ways, turns = 2, True
    else:
        mass, stiffness, along = _bent(body, points, 4 * count)
        ways, turns = 2, True
    size = len(mass)
    fixed: list[int] = []
    for side, first in (("left", 0), ("right", size - ways)):
        for kind, value in end_of(body, side).items():
            if kind == "clamped":
                fixed += [first, first + 1] if turns else [first]
            elif kind == "pinned":
                fixed.append(first)
            elif kind == "spring":
                stiffness[first, first] += value
            elif kind == "mass":
                mass[first, first] += value
            elif kind != "free":
                raise ValueError(kind)
    kept = np.setdiff1d(np.arange(size), fixed)
    square, vectors = oscillations(stiffness[np.ix_(kept, kept)], mass[np.ix_(kept, kept)], 100.0 * slowest(body))
    full = np.zeros((size, len(kept)))
    full[kept] = vectors
    translation = np.zeros(size)
    translation[::ways] = 1.0
    if ways == 2 and body.get("theory", "euler_bernoulli") != "timoshenko":
        translation[1::2] = 0.0
    share_mass, share_stiffness = damping_of(body)
    places = {x: int(ways * np.argmin(np.abs(along - x))) for x in points}
    moved = full.T @ (mass @ translation)
    return Modes(
        np.maximum(square, 0.0),
        share_mass + share_stiffness * np.maximum(square, 0.0),
        {x: full[place] for x, place in places.items()},
        moved * float(body.get("velocity", 0.0)),
        moved,
    )


def slowest(body: Doc) -> float:
    """Return the size of the square of a body's first angular frequency [1/s2]."""
    whole = sum(s["length"] for s in segments_of(body))
    rates = [s["material"]["young"] / s["material"]["density"] / whole**2 for s in segments_of(body)]
    if body["kind"] == "beam":
        slender = [section_of(s)[1] / section_of(s)[0] / whole**2 for s in segments_of(body)]
        rates = [rate * each for rate, each in zip(rates, slender, strict=True)]
    return float(min(rates))


def oscillations(stiffness: Array, mass: Array, shift: float) -> tuple[Array, Array]:
    """Return squares of the angular frequencies, rising, and mass-normalised modes.

    From the flexibility of the shifted body: the rounding is then a share of each low frequency, and not of the highest
    one, which is 1e6 times larger in a fine mesh of a beam.
    """
    flexible, vectors = eigh(mass, stiffness + shift * mass)
    square = 1.0 / flexible[::-1] - shift
    vectors = vectors[:, ::-1]
    square[np.abs(square) < 1e-6 * shift] = 0.0  # rigid motion
    return square, vectors / np.sqrt(np.einsum("ij,ij->j", vectors, mass @ vectors))


def _rod(body: Doc, points: list[float], count: int) -> tuple[Array, Array, Array]:
    m0, k0, _ = element(DEGREE)
    parts = cells(body, points, count)
    size = len(parts) * DEGREE + 1
    mass, stiffness, along = np.zeros((size, size)), np.zeros((size, size)), np.full(size, np.inf)
    x, along[0] = 0.0, 0.0
    for number, (length, segment) in enumerate(parts):
        stuff, at = segment["material"], slice(number * DEGREE, (number + 1) * DEGREE + 1)
        mass[at, at] += stuff["density"] * segment["area"] * length / 2.0 * m0
        stiffness[at, at] += stuff["young"] * segment["area"] * 2.0 / length * k0
        x += length
        along[(number + 1) * DEGREE] = x
    return mass, stiffness, along


def _sheared(body: Doc, points: list[float], count: int) -> tuple[Array, Array, Array]:
    """Return a Timoshenko beam: deflection and rotation in turns."""
    m0, k0, c0 = element(DEGREE)
    parts = cells(body, points, count)
    nodes = len(parts) * DEGREE + 1
    mass, stiffness, along = np.zeros((2 * nodes,) * 2), np.zeros((2 * nodes,) * 2), np.full(nodes, np.inf)
    x, along[0] = 0.0, 0.0
    for number, (length, segment) in enumerate(parts):
        stuff, half = segment["material"], length / 2.0
        area, inertia, factor = section_of(segment)
        shear = stuff.get("shear_modulus") or stuff["young"] / (2.0 * (1.0 + stuff["poisson"]))
        shear *= factor * area
        first = 2 * number * DEGREE
        w, t = np.arange(first, first + 2 * DEGREE + 1, 2), np.arange(first + 1, first + 2 * DEGREE + 2, 2)
        mass[np.ix_(w, w)] += stuff["density"] * area * half * m0
        mass[np.ix_(t, t)] += stuff["density"] * inertia * half * m0
        stiffness[np.ix_(w, w)] += shear / half * k0
        stiffness[np.ix_(t, t)] += stuff["young"] * inertia / half * k0 + shear * half * m0
        stiffness[np.ix_(w, t)] -= shear * c0
        stiffness[np.ix_(t, w)] -= shear * c0.T
        x += length
        along[(number + 1) * DEGREE] = x
    return mass, stiffness, along


def _bent(body: Doc, points: list[float], count: int) -> tuple[Array, Array, Array]:
    """Return an Euler-Bernoulli beam: deflection and slope in turns, cubic elements."""
    parts = cells(body, points, count)
    nodes = len(parts) + 1
    mass, stiffness, along = np.zeros((2 * nodes,) * 2), np.zeros((2 * nodes,) * 2), np.zeros(nodes)
    for number, (h, segment) in enumerate(parts):
        stuff = segment["material"]
        area, inertia, _ = section_of(segment)
        at = slice(2 * number, 2 * number + 4)
        bend, weight = stuff["young"] * inertia / h**3, stuff["density"] * area * h / 420.0
        stiffness[at, at] += bend * np.array(
            [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h], [-12, -6 * h, 12, -6 * h],
             [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
        )  # fmt: skip
        mass[at, at] += weight * np.array(
            [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h], [54, 13 * h, 156, -22 * h],
             [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
        )  # fmt: skip
        along[number + 1] = along[number] + h
    return mass, stiffness, along
