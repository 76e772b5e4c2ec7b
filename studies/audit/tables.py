"""Gauss points on [0, 1] and the polynomials through them."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

Array = NDArray[np.float64]

STAGES = 5


def gauss(stages: int = STAGES) -> tuple[Array, Array, Array, Array, Array]:
    """Return points, weights, the monomial coefficients of the Lagrange polynomials, their integrals to each point
    (the collocation matrix), and the functional that gives the leading Legendre coefficient.
    """
    x, w = legendre.leggauss(stages)
    points, weights = 0.5 * (x + 1.0), 0.5 * w
    lagrange = np.linalg.inv(np.vander(points, increasing=True)).T  # row j: coefficients of theta^k
    powers = np.arange(1, stages + 1)
    collocation = np.array([(lagrange / powers) @ points[i] ** powers for i in range(stages)])
    order = stages - 1
    top = 0.5 * (2 * order + 1) * w * legendre.legval(x, np.eye(stages)[order])
    return points, weights, np.ascontiguousarray(lagrange), collocation, top
