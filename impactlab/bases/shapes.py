"""Shapes of a mesh from which bases are made: eigenvectors, and static answers to moved or loaded places."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from threadpoolctl import threadpool_limits

from impactlab.banded import full, multiply
from impactlab.errors import CaseError
from impactlab.models.base import Face
from impactlab.models.massless import Ints
from impactlab.models.meshed import AbstractMesh
from impactlab.types import Array


def lowest(mass: Array, stiffness: Array, count: int) -> Array:
    """Return the first eigenvectors (n_dof, count) of banded matrices, mass-normalised, their first larger entry up."""
    from scipy.linalg import eigh

    if count == 0:
        return np.zeros((mass.shape[1], 0))
    # One thread: eigenvectors differ in their last bits with the number of threads.
    with threadpool_limits(limits=1):
        _, shapes = eigh(full(stiffness), full(mass), subset_by_index=(0, count - 1))
    return upright(shapes)


def upright(shapes: Array) -> Array:
    """Return shapes, each with the sign that makes its first entry of some size positive."""
    first = np.argmax(np.abs(shapes) > 1e-3 * np.abs(shapes).max(axis=0), axis=0)
    return np.asarray(shapes * np.sign(shapes[first, np.arange(shapes.shape[1])]))


def eigenvectors(mesh: AbstractMesh, count: int) -> Array:
    """Return the first eigenvectors of a mesh, (n_mesh_dof, count); rigid motions first, and exact."""
    shapes = lowest(mesh.mass, mesh.stiffness, count)
    shapes[:, : mesh.rigid.shape[1]] = mesh.rigid
    return shapes


def struck(mesh: AbstractMesh, faces: tuple[Face, ...]) -> Ints:
    """Return the coordinates that move the contacts, sorted, (n,) int: one each, all of its element inside one."""
    rows = [np.flatnonzero(mesh.row(face.x, "displacement")) for face in faces]
    return np.unique(np.concatenate([np.zeros(0, np.int64), *rows]))


def part(matrix: Array, start: int, stop: int) -> Array:
    """Return the banded matrix of the coordinates from ``start`` to before ``stop``."""
    cut = matrix[:, start:stop].copy()
    for offset in range(1, len(cut)):
        cut[offset, max(0, cut.shape[1] - offset) :] = 0.0
    return cut


def pieces(mesh: AbstractMesh, kept: Ints) -> list[tuple[int, int]]:
    """Return the runs of coordinates between those kept, as (start, stop), empty ones left out."""
    edges = [-1, *(int(k) for k in kept), mesh.mass.shape[1]]
    return [(a + 1, b) for a, b in pairwise(edges) if b > a + 1]


def constraint_modes(mesh: AbstractMesh, kept: Ints) -> Array:
    """Return the static shapes (n_mesh_dof, n_kept) in which one coordinate kept moves by 1 and the others do not."""
    n_dof = mesh.mass.shape[1]
    shapes = np.zeros((n_dof, kept.size))
    for column, coordinate in enumerate(kept):
        moved = np.zeros(n_dof)
        moved[coordinate] = 1.0
        shapes[coordinate, column] = 1.0
        pull = multiply(mesh.stiffness, moved)
        for start, stop in pieces(mesh, kept):
            if np.any(pull[start:stop]):
                shapes[start:stop, column] = -solve_part(mesh.stiffness, start, stop, pull[start:stop])
    return shapes


def solve_part(stiffness: Array, start: int, stop: int, force: Array) -> Array:
    """Return the displacements of a run of coordinates under a force, all others fixed."""
    from scipy.linalg import solveh_banded

    matrix = part(stiffness, start, stop)[: stop - start]
    return np.asarray(solveh_banded(matrix, force, lower=True))


def fixed_modes(mesh: AbstractMesh, start: int, stop: int, count: int) -> Array:
    """Return the first eigenvectors (n_mesh_dof, count) of a run of coordinates, all others fixed."""
    shapes = np.zeros((mesh.mass.shape[1], count))
    shapes[start:stop] = lowest(part(mesh.mass, start, stop), part(mesh.stiffness, start, stop), count)
    return shapes


def too_few(basis: str, modes: int, needed: int, what: str) -> CaseError:
    """Return the error of a basis that needs more modes than were given."""
    return CaseError(
        f"basis '{basis}' needs {needed} modes or more here ({what}); {modes} given",
        remedy=f"Give modes: {needed} or more.",
        path="solve.model.modes",
    )


def no_contact(basis: str) -> CaseError:
    """Return the error of a basis that is made from a contact, on a rod that has none."""
    return CaseError(
        f"basis '{basis}' is made from the contact that loads the rod, and this rod has none",
        remedy="Use basis eigenvectors.",
        path="solve.model.basis",
    )
