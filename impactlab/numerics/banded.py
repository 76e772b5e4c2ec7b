"""Small helpers on symmetric banded matrices in lower form, shape (bandwidth + 1, n).

Scipy is imported where it is called, here and everywhere in the package: a run without matrices, as an exact one,
starts a third of a second sooner.
"""

from __future__ import annotations

import math

import numpy as np

from impactlab.types import Array


def widened(banded: Array, bandwidth: int) -> Array:
    """Return the matrix with zero bands added, shape (bandwidth + 1, n)."""
    missing = bandwidth + 1 - banded.shape[0]
    return np.ascontiguousarray(np.vstack([banded, np.zeros((missing, banded.shape[1]))]))


def full(banded: Array) -> Array:
    """Return the symmetric matrix of a lower banded form, shape (n, n)."""
    matrix = np.diag(banded[0])
    for offset in range(1, min(banded.shape)):  # a beam of one element has more bands than coordinates
        column = np.arange(banded.shape[1] - offset)
        matrix[column + offset, column] = matrix[column, column + offset] = banded[offset, :-offset]
    return matrix


def grounded(banded: Array, known: Array | float = 0.0) -> Array:
    """Return the sums of the rows of a matrix less a known part, shape (n,).

    Of a stiffness they are its springs to the ground.

    A sum that is zero except for rounding is zero: only the ends of a row of bars are tied to the ground.
    """
    ground = multiply(banded, np.ones(banded.shape[1])) - known
    return np.where(np.abs(ground) <= 1e-13 * banded[0], 0.0, ground)


def trimmed(banded: Array) -> Array:
    """Return the matrix without its outermost bands that are zero, shape (bandwidth + 1, n)."""
    width = banded.shape[0] - 1
    while width > 0 and not np.count_nonzero(banded[width]):
        width -= 1
    return banded[: width + 1]


def multiply(banded: Array, vector: Array) -> Array:
    """Return the product with a vector, shape (n,).

    Bands with a last axis of length 1 are multiplied by several vectors at once, shape (n, count).
    """
    product = banded[0] * vector
    for offset in range(1, banded.shape[0]):
        coupling = banded[offset, :-offset]
        product[offset:] += coupling * vector[:-offset]
        product[:-offset] += coupling * vector[offset:]
    return np.asarray(product)


def solve(banded: Array, vector: Array) -> Array:
    """Return the solution of a positive definite system, shape (n,)."""
    if vector.size == 0:
        return vector.copy()
    if banded.shape[0] == 1 or vector.size == 1:
        return np.asarray(vector / banded[0])
    return _solved(banded, vector)


def solve_each(banded: Array, rows: Array) -> Array:
    """Return the solutions of a positive definite system for some right-hand sides, shape (n_rows, n)."""
    if len(banded) == 1 or rows.size == 0 or not np.count_nonzero(banded[1:]):
        return np.ascontiguousarray(rows / banded[0])
    return np.ascontiguousarray(_solved(banded, rows.T).T)


def _solved(banded: Array, given: Array) -> Array:
    """Return the result of `scipy.linalg.solveh_banded`, which checks for longer; it is called where LAPACK fails."""
    from scipy.linalg import solveh_banded
    from scipy.linalg.lapack import dpbsv, dptsv

    found, fault = (
        dptsv(banded[0], banded[1, :-1], given)[2:] if len(banded) == 2 else dpbsv(banded, given, lower=1)[1:]
    )
    flat = found.ravel()
    if fault or not math.isfinite(flat.dot(flat)):
        found = solveh_banded(banded, given, lower=True)
    return np.asarray(found)
