"""Shapes of a mesh from which bases are made: eigenvectors, constraint modes."""

from __future__ import annotations

import numpy as np

from impactlab.errors import CaseError
from impactlab.models.base import Face
from impactlab.models.mesh.base import AbstractMesh, null_space, part
from impactlab.numerics.banded import full, multiply, solve
from impactlab.numerics.threads import one_thread
from impactlab.scene.recent import Recent
from impactlab.types import Array, Ints

LOW_SHARE = (
    8  # coordinates of a mesh for each of its lowest eigenvectors: above, (1/8)^4 of the highest frequency squared
)
ALL_FROM = 5  # coordinates of a mesh for each eigenvector wanted: below, all of them take two thirds of the time
MAX_ALL = 1000  # coordinates of a mesh, up to which they are: they need room for two more full matrices
MIN_FINE = 200  # coordinates of a mesh, below which that rounding is 2e-6 at most
OF_RODS = 2  # bands of the stiffness of rods, whose highest frequencies are too low to matter
MAX_KEPT = 8  # meshes whose eigenvectors stay in memory
MAX_KEPT_SIZE = 500_000  # numbers of one of them, 4 MB


def lowest(mass: Array, stiffness: Array, count: int) -> Array:
    """Return the first eigenvectors (n_dof, count) of two full matrices, mass-normalised, first larger entry up.

    Both matrices are symmetric and overwritten: copies of a fine mesh's would fill the memory.
    """
    from scipy.linalg import eigh

    if count == 0:
        return np.zeros((len(mass), 0))
    with one_thread():
        if len(mass) < min(ALL_FROM * count, MAX_ALL):  # by divide and conquer
            return upright(eigh(stiffness.T, mass.T, driver="gvd", overwrite_a=True, overwrite_b=True)[1][:, :count])
        return upright(eigh(stiffness.T, mass.T, subset_by_index=(0, count - 1), overwrite_a=True, overwrite_b=True)[1])


def rotated(mass: Array, stiffness: Array, shapes: Array) -> Array:
    """Return eigenvectors of two banded matrices from approximate ones (n_dof, n).

    Solved for all frequencies of a mesh at once, the lowest eigenvectors of a beam hold some of each other, by the
    rounding of the highest frequency squared over the difference of their own: of 400 elements on a soft support some
    1e-3. The space of the lowest eighth is accurate, and its own highest frequency is far lower, so that the matrices
    in it give them (Rayleigh and Ritz). They are as `lowest` returns them.
    """
    from scipy.linalg import eigh

    count = min(shapes.shape[1], shapes.shape[0] // LOW_SHARE)
    if len(stiffness) <= OF_RODS or len(shapes) < MIN_FINE or count < 2:
        return shapes
    low = shapes[:, :count]
    with one_thread():
        mixed = eigh(*(low.T @ multiply(matrix[..., None], low) for matrix in (stiffness, mass)))[1]
    return np.hstack((upright(low @ mixed), shapes[:, count:]))


def upright(shapes: Array) -> Array:
    """Return shapes, each with the sign that makes its first entry of some size positive."""
    first = np.argmax(np.abs(shapes) > 1e-3 * np.abs(shapes).max(axis=0), axis=0)
    return np.asarray(shapes * np.sign(shapes[first, np.arange(shapes.shape[1])]))


_kept: Recent[tuple[bytes, bytes, int], Array] = Recent(MAX_KEPT)


def eigenvectors(mesh: AbstractMesh, count: int) -> Array:
    """Return the first eigenvectors of a mesh, (n_mesh_dof, count); rigid motions first, and exact.

    Those of the last meshes are kept: runs of one mesh with other steps, as the automatic choice makes them, solve one
    eigenproblem.
    """
    shapes = _kept.get_or_make(
        (mesh.mass.tobytes(), mesh.stiffness.tobytes(), count),
        lambda: rotated(mesh.mass, mesh.stiffness, lowest(full(mesh.mass), full(mesh.stiffness), count)),
        lambda made: made.size <= MAX_KEPT_SIZE,
    )
    return with_rigid_motions(mesh, shapes.copy())


def with_rigid_motions(mesh: AbstractMesh, shapes: Array) -> Array:
    """Return shapes (n_mesh_dof, n) that begin with the exact rigid motions.

    The others are made orthogonal to these, as computed eigenvectors are only up to rounding: little in a rod, up to
    1e-4 in a beam of hundreds of elements.
    """
    count = mesh.rigid.shape[1]
    if not count:
        return shapes
    inertia = np.column_stack([multiply(mesh.mass, motion) for motion in mesh.rigid.T])
    elastic = shapes[:, count:]
    return np.hstack((mesh.rigid, elastic - mesh.rigid @ (inertia.T @ elastic)))


def struck(mesh: AbstractMesh, faces: tuple[Face, ...]) -> Ints:
    """Return the coordinates that move the contacts, sorted, (n,) int.

    There is one for each contact at a node, and all of its element for one inside.
    """
    rows = [np.flatnonzero(mesh.row(face.x, "displacement")) for face in faces]
    return np.unique(np.concatenate([np.zeros(0, np.int64), *rows]))


def pieces(mesh: AbstractMesh, kept: Ints) -> list[Ints]:
    """Return the coordinates that are not kept, in uncoupled groups, each sorted (n,).

    A node of a rod that is kept cuts it in two; one of a beam does so only if its rotation is kept as well.
    """
    n_dof = mesh.mass.shape[1]
    free = np.ones(n_dof, np.bool_)
    free[kept] = False
    rest = np.flatnonzero(free)
    if not rest.size:
        return []
    changes = np.zeros(n_dof + 1)
    for matrix in (mesh.stiffness, mesh.mass):
        for offset in range(1, min(len(matrix), n_dof)):
            coupled = (matrix[offset, : n_dof - offset] != 0.0) & free[: n_dof - offset] & free[offset:]
            changes[1 : n_dof - offset + 1] += coupled
            changes[offset + 1 :] -= coupled
    # How many couplings pass from below a coordinate to it or beyond it.
    passing = np.cumsum(changes)[rest[1:]]
    return np.split(rest, np.flatnonzero(passing == 0) + 1)


def still_free(mesh: AbstractMesh, kept: Ints) -> Array:
    """Return the rigid motions (n_mesh_dof, n) that are left when the coordinates kept are fixed."""
    if not mesh.rigid.shape[1] or not kept.size:
        return mesh.rigid
    return np.asarray(mesh.rigid @ null_space(mesh.rigid[kept]))


def constraint_modes(mesh: AbstractMesh, kept: Ints) -> Array:
    """Return the static shapes (n_mesh_dof, n_kept) of unit displacements of kept coordinates.

    In each of them the other coordinates kept do not move. Where the rest can still move (a beam turns about the one
    place it is held at), a shape is any of those.
    """
    n_dof = mesh.mass.shape[1]
    shapes = np.zeros((n_dof, kept.size))
    stiffness = mesh.stiffness
    for motion in still_free(mesh, kept).T if kept.size else ():
        # Constraint forces do no work on that motion, so that a spring to the ground which stops it carries no force.
        stiffness = stiffness.copy()
        stiffness[0, max(mesh.pins, key=lambda pin: abs(motion[pin]))] *= 2.0
    groups = pieces(mesh, kept)
    for column, coordinate in enumerate(kept):
        moved = np.zeros(n_dof)
        moved[coordinate] = 1.0
        shapes[coordinate, column] = 1.0
        pull = multiply(mesh.stiffness, moved)
        for inside in groups:
            if np.any(pull[inside]):
                shapes[inside, column] = -solve(part(stiffness, inside)[: inside.size], pull[inside])
    return shapes


def fixed_modes(mesh: AbstractMesh, inside: Ints, count: int) -> Array:
    """Return the first eigenvectors (n_mesh_dof, count) of some coordinates, all others fixed."""
    shapes = np.zeros((mesh.mass.shape[1], count))
    mass, stiffness = part(mesh.mass, inside), part(mesh.stiffness, inside)
    shapes[inside] = rotated(mass, stiffness, lowest(full(mass), full(stiffness), count))
    return shapes


def too_few(basis: str, modes: int, needed: int, what: str) -> CaseError:
    """Return the error of a basis that needs more modes than were given."""
    return CaseError(
        f"basis '{basis}' needs {needed} modes or more here ({what}); {modes} given",
        remedy=f"Give modes: {needed} or more.",
        path="solve.model.modes",
    )


def no_contact(basis: str) -> CaseError:
    """Return the error of a basis of contacts on a rod that has none."""
    return CaseError(
        f"basis '{basis}' is made from the contact that loads the rod, and this rod has none",
        remedy="Use basis eigenvectors.",
        path="solve.model.basis",
    )
