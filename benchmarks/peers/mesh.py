"""The rod as springs and point masses, or in few Craig-Bampton coordinates.

The programs get these arrays.

Both are set-up and outside the times. All programs get the same arrays, so that only the program differs.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from benchmarks.peers.cases import Array, Case

FINE = 12  # elements of the mesh behind a reduced rod, per coordinate kept


class Chain(NamedTuple):
    """Linear elements of equal length with lumped mass; the clamped end is left out."""

    mass: Array  # (n,) kg, from the struck face on
    spring: Array  # (n,) N/m; the last one holds on to the ground
    h: float  # m


class Reduced(NamedTuple):
    """Craig-Bampton coordinates: the face's displacement, then modes of the rod held at its face."""

    mass: Array  # (n, n) kg
    stiffness: Array  # (n, n) N/m, diagonal
    highest: float  # rad/s, largest frequency of the free rod


class Modes(NamedTuple):
    """The same reduced rod in its own modes, mass-normalised."""

    frequency: Array  # (n,) rad/s
    face: Array  # (n,) kg^-1/2, displacement of the face per mode


@cache
def chain(case: Case, elements: int) -> Chain:
    """Return the rod in ``elements`` elements of equal length.

    A boundary of materials falls on a node.
    """
    h = case.length / elements
    ends = np.cumsum([segment[0] for segment in case.segments])
    middles = (np.arange(elements) + 0.5) * h
    which = np.searchsorted(ends, middles)
    area, young, density = (np.array([segment[i] for segment in case.segments])[which] for i in (1, 2, 3))
    half = 0.5 * density * area * h
    mass = half.copy()
    mass[1:] += half[:-1]
    return Chain(mass, young * area / h, h)


def matrices(case: Case, elements: int) -> tuple[Array, Array]:
    """Return consistent mass and stiffness of a mesh, each (elements, elements)."""
    rod = chain(case, elements)
    half = np.empty(elements)  # half the mass of each element, from the lumped masses
    half[0] = rod.mass[0]
    for i in range(1, elements):
        half[i] = rod.mass[i] - half[i - 1]
    mass = np.diag(2.0 * rod.mass / 3.0) + np.diag(half[:-1] / 3.0, 1) + np.diag(half[:-1] / 3.0, -1)
    diagonal = rod.spring.copy()
    diagonal[1:] += rod.spring[:-1]
    stiffness = np.diag(diagonal) - np.diag(rod.spring[:-1], 1) - np.diag(rod.spring[:-1], -1)
    return mass, stiffness


@cache
def reduced(case: Case, coordinates: int) -> Reduced:
    """Return the rod in ``coordinates`` Craig-Bampton coordinates."""
    mass, stiffness = matrices(case, 2 * (FINE * coordinates // 2))
    squares, shapes = eigh(stiffness[1:, 1:], mass[1:, 1:], subset_by_index=(0, coordinates - 2))
    static = np.append(1.0, -np.linalg.solve(stiffness[1:, 1:], stiffness[1:, 0]))
    basis = np.zeros((mass.shape[0], coordinates))
    basis[:, 0], basis[1:, 1:] = static, shapes
    small = basis.T @ mass @ basis
    small[1:, 1:] = np.eye(coordinates - 1)  # without rounding it is an arrow
    held = np.diag(np.append(static @ stiffness @ static, squares))
    return Reduced(small, held, float(np.sqrt(eigh(held, small, eigvals_only=True)[-1])))


@cache
def modes(case: Case, coordinates: int) -> Modes:
    """Return `reduced` in its own modes: the same motion, uncoupled."""
    rod = reduced(case, coordinates)
    squares, shapes = eigh(rod.stiffness, rod.mass)
    return Modes(np.sqrt(squares), shapes[0])
