"""How sure a fit is: intervals from the derivatives at its solution, and what its signals do not tell."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import t as student

from impactlab.fits.problem import Problem
from impactlab.fits.result import Fit, Fitted
from impactlab.types import Array

UNSEEN = 3.0  # standard deviation of a logarithm, from which the signals do not determine it
CORRELATED = 4.0  # of the standard deviation of an autocorrelation under white noise: beyond it is told
HUBER = 1.345  # of the noise: residuals beyond count linearly


class Options(NamedTuple):
    """How the noise is taken."""

    loss: str  # linear or huber
    noise: str  # white or ar1


def autocorrelations(problem: Problem, scaled: Array) -> list[float]:
    """Return the autocorrelation of neighbouring residuals of each signal."""
    parts = problem.parts(scaled) or []
    return [float(part[1:] @ part[:-1]) / max(float(part @ part), 1e-300) for part in parts]


def fit_with_intervals(problem: Problem, found: Any, chosen: Options) -> Fit:
    """Return the fit whose solution was found, with its intervals."""
    residuals, jacobian = problem.residuals(found.x), problem.jacobian(found.x)
    freedom = len(residuals) - problem.size
    spread = float(np.sqrt(residuals @ residuals / freedom)) if chosen.noise != "std" else 1.0
    if chosen.loss == "huber":
        spread = 1.4826 * float(np.median(np.abs(residuals)))
        kept = np.abs(residuals) <= HUBER * spread
        jacobian = jacobian * kept[:, None]
    _, sizes, ways = np.linalg.svd(jacobian / np.linalg.norm(jacobian, axis=0).clip(1e-300), full_matrices=False)
    norms = np.linalg.norm(jacobian, axis=0).clip(1e-300)
    deviations = spread / np.maximum(sizes, 1e-300)  # along each direction, in columns of unit length
    directions = ways / norms
    told = np.array([each.unit != "s" and not each.path.startswith("offset") for each in problem.unknowns])
    lengths = np.linalg.norm(directions * told, axis=1)
    unseen = deviations * lengths > UNSEEN
    covariance = (directions.T * deviations**2) @ directions
    parts = problem.parts(found.x) or []
    neighbours = sum(float(part[1:] @ part[:-1]) for part in parts) / max(float(residuals @ residuals), 1e-300)
    warnings = []
    widened = 1.0
    if chosen.noise == "white" and abs(neighbours) > CORRELATED / math.sqrt(len(residuals)) and neighbours < 1.0:
        widened = math.sqrt(max(1.0, (1.0 + neighbours) / (1.0 - neighbours)))
        warnings.append(
            f"warning: neighbouring residuals correlate by {neighbours:.2f}: under white noise the intervals "
            f"would be {widened:.2g} times too narrow and are widened; --noise ar1 takes it into account"
        )
    reach = float(student.ppf(0.975, freedom)) * widened
    rows = []
    for number, each in enumerate(problem.unknowns):
        value = each.value(float(found.x[number]))
        free = bool(told[number] and np.any(unseen & (np.abs(ways[:, number]) > 0.05)))
        half = math.inf if free else reach * math.sqrt(covariance[number, number])
        lower, upper = (value * math.exp(-half), value * math.exp(half)) if half < 700.0 else (0.0, math.inf)
        if not each.is_positive:
            lower, upper = (value + sign * half * each.scale for sign in (-1.0, 1.0))
        at_bound = min(value - each.low, each.high - value) <= 1e-6 * (each.high - each.low)
        note = "at its bound" if at_bound else "not determined" if free else ""
        rows.append(Fitted(each.path, value, lower, upper, each.unit, note))
        if at_bound:
            warnings.append(
                f"warning: {each.path} ended at its bound {value:.6g} {each.unit}; the interval does not hold"
            )
    words = tuple(_told(problem, ways[row] / norms) for row in np.flatnonzero(unseen))
    cases = problem.cases(found.x)
    return Fit(cases[0], tuple(rows), covariance, tuple(parts), spread, neighbours, tuple(warnings), words, cases)


def _told(problem: Problem, direction: Array) -> str:
    """Return a direction that the signals do not see, in words."""
    own = direction[: len(problem.parameters)]
    own = own / own[int(np.argmax(np.abs(own)))]
    powers = [
        f"{each.path.rpartition('.')[2]}^{power:.2g}"
        for each, power in zip(problem.parameters, own.tolist(), strict=True)
        if abs(power) > 0.05
    ]
    return f"the signals do not tell how large {' '.join(powers)} is: only other combinations are determined"
