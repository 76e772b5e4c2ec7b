"""Derivatives of residuals over a standard deviation, in place of those at a point.

A wave front that enters another sample leaves a kink of the loss. Where one lies within a standard deviation of the
solution, the derivatives to one side of it promise intervals that are too narrow.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from impactlab.fits.identifiable import lengths
from impactlab.types import Array

MAX_STEP = 0.1  # of a scaled unknown: directions that need more keep their derivatives
MAX_STEEPER = 2.0  # times a derivative: a secant beyond comes from another solution, or there is no run


def secants(
    residuals: Callable[[Array], Array], x: Array, bounds: tuple[Array, Array], jacobian: Array, spread: float
) -> Array:
    """Return derivatives as central differences over a standard deviation.

    They are taken along the axes of the ellipsoid.

    Parameters
    ----------
    residuals : callable
        From unknowns (n,) to residuals (m,).
    x, bounds : array
        The solution and the bounds of the unknowns, (n,) each.
    jacobian : array
        Derivatives there, (m, n).
    spread : float
        Standard deviation of the residuals.
    """
    norms = lengths(jacobian)
    _, sizes, ways = np.linalg.svd(jacobian / norms, full_matrices=False)
    along = jacobian @ (ways / norms).T  # (m, n): by the directions
    for number, (size, way) in enumerate(zip(sizes.tolist(), ways / norms, strict=True)):
        if size <= 0.0 or not np.max(np.abs(spread / size * way)) <= MAX_STEP:
            continue
        step = spread / size * way
        if np.any((x - np.abs(step) < bounds[0]) | (x + np.abs(step) > bounds[1])):
            continue
        secant = (residuals(x + step) - residuals(x - step)) * (0.5 * size / spread)
        if np.linalg.norm(secant) <= MAX_STEEPER * size:
            along[:, number] = secant
    return np.where(np.any(jacobian, axis=0), along @ ways * norms, 0.0)  # an unknown without an effect keeps none


def jumping(
    residuals: Callable[[Array], Array], x: Array, bounds: tuple[Array, Array], jacobian: Array, spread: float
) -> list[int]:
    """Return the unknowns with which residuals jump, by number.

    Over a standard deviation of such an unknown they change by far more than its derivative times that. Parameters are
    those of `secants`.
    """
    found = []
    for number, size in enumerate(np.linalg.norm(jacobian, axis=0).tolist()):
        if size <= 0.0 or not spread / size <= MAX_STEP:
            continue
        moved = x.copy()
        moved[number] = min(x[number] + spread / size, bounds[1][number])
        below = x.copy()
        below[number] = max(x[number] - spread / size, bounds[0][number])
        changed = float(np.linalg.norm(residuals(moved) - residuals(below)))
        if changed > MAX_STEEPER * size * (moved[number] - below[number]):
            found.append(number)
    return found
