"""Autocorrelation of noise from residuals: restricted maximum likelihood.

The autocorrelation of the residuals themselves is too small, as the fitted numbers take out a part of slow noise. Here
the likelihood is that of residuals after the part that the unknowns can explain is removed, linear about a solution.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize_scalar

from impactlab.fits.problem import Problem, whitened
from impactlab.types import Array

MAX_CORRELATION = 0.995
TOLERANCE = 1.0e-4  # of the correlation
ROUNDS = 2  # over all signals, where there are several


def correlations(problem: Problem, x: Array) -> list[float]:
    """Return the autocorrelation of neighbouring errors of each signal, 0 or more."""
    given, problem.correlated = problem.correlated, [0.0] * len(problem.signals)
    parts, jacobian = problem.parts(x), problem.jacobian(x)
    problem.correlated = given
    if parts is None:
        return given
    ends = np.cumsum([0, *(len(part) for part in parts)])
    columns = [jacobian[low:high] for low, high in pairwise(ends.tolist())]
    found = list(given)
    for _ in range(ROUNDS if len(parts) > 1 else 1):
        for number in range(len(parts)):

            def loss(value: float, at: int = number) -> float:
                return _loss(parts, columns, [value if k == at else each for k, each in enumerate(found)])

            best = minimize_scalar(loss, bounds=(0.0, MAX_CORRELATION), method="bounded", options={"xatol": TOLERANCE})
            found[number] = float(best.x) if loss(float(best.x)) < loss(0.0) else 0.0
    return found


def _loss(parts: list[Array], columns: list[Array], values: list[float]) -> float:
    """Return twice the negative logarithm of the restricted likelihood, up to a constant."""
    residuals = np.concatenate([whitened(part, value) for part, value in zip(parts, values, strict=True)])
    jacobian = np.concatenate([whitened(each, value) for each, value in zip(columns, values, strict=True)])
    jacobian = jacobian[:, np.any(jacobian, axis=0)]  # an unknown without an effect explains nothing
    norms = np.linalg.norm(jacobian, axis=0)
    across, upper = np.linalg.qr(jacobian / norms)
    left = residuals - across @ (across.T @ residuals)
    scales = np.abs(np.diag(upper)) * norms
    whole: float = (len(residuals) - jacobian.shape[1]) * math.log(max(float(left @ left), 1e-300))
    whole += 2.0 * float(np.sum(np.log(scales.clip(1e-300))))
    return whole - math.fsum(math.log1p(-(each**2)) for each in values)
