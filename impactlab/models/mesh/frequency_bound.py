"""The highest frequency of a mesh, or a close bound above it: the stability limit of explicit steps follows from it."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from impactlab.models.mesh.bar_elements import Reference
from impactlab.scene.bodies import End
from impactlab.types import Array


class Mesh(Protocol):
    """A rod in bar elements: matrices (bandwidth + 1, n), values of each element (n_elements,), ends by node."""

    order: int
    lumped: bool
    element: Reference
    mass: Array
    stiffness: Array
    lengths: Array
    young: Array
    area: Array
    density: Array
    ends: tuple[tuple[int, End], ...]


def highest_frequency(mesh: Mesh) -> float:
    """Return the highest frequency, rad/s: exact for 2-node bars of lumped mass, else a bound.

    For 2-node bars of consistent mass the bound is that by rows (Gershgorin); for elements of higher order the highest
    frequency of any one element alone (IronsTreharne1971).
    """
    from scipy.linalg.lapack import dstebz

    mass, stiffness = mesh.mass, mesh.stiffness
    if mesh.order > 1:
        squared = max(element_frequency(mesh, number) for number in unlike_elements(mesh))
    elif mesh.lumped:
        scale = 1.0 / np.sqrt(mass[0])
        off = stiffness[1, :-1] * scale[:-1] * scale[1:] if len(scale) > 1 else np.zeros(1)
        top = mass.shape[1]  # the wrapper of `scipy.linalg.eigvalsh_tridiagonal` takes longer than a small mesh
        squared = dstebz(stiffness[0] * scale**2, off, 2, 0.0, 1.0, top, top, 0.0, "E")[1][0]
    else:
        rows = [np.abs(matrix[1]) + np.concatenate(([0.0], np.abs(matrix[1, :-1]))) for matrix in (mass, stiffness)]
        squared = np.max((stiffness[0] + rows[1]) / (mass[0] - rows[0]))
    return float(np.sqrt(squared))


def unlike_elements(mesh: Mesh) -> set[int]:
    """Return the numbers of the first and last element, and of the first of each segment."""
    each = (mesh.lengths, mesh.young, mesh.area, mesh.density)
    changes = np.array([np.diff(values) != 0.0 for values in each]).any(axis=0)
    return {0, len(mesh.lengths) - 1, *(int(number) + 1 for number in np.flatnonzero(changes))}


def element_frequency(mesh: Mesh, number: int) -> float:
    """Return the highest squared frequency of an element cut free, with the spring of its end."""
    from scipy.linalg import eigh

    half, element = 0.5 * mesh.lengths[number], mesh.element
    stiffness = mesh.young[number] * mesh.area[number] / half * element.stiffness
    mass = element.lumped if mesh.lumped else element.consistent
    for node, end in mesh.ends:
        if end.kind == "spring" and number == (0 if node == 0 else len(mesh.lengths) - 1):
            corner = 0 if node == 0 else mesh.order
            stiffness[corner, corner] += end.value
    return float(eigh(stiffness, mesh.density[number] * mesh.area[number] * half * mass, eigvals_only=True)[-1])
