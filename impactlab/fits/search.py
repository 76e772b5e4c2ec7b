"""Solution of a fit: trigger times by a scan, then least squares from a strong low-pass to none."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from impactlab.fits.filters import smooth
from impactlab.fits.intervals import HUBER, Options, autocorrelations
from impactlab.fits.problem import Problem
from impactlab.types import Array

STAGES = (0.06, 0.02)  # widths of the low-pass, of the samples of a signal, before the stage without
ROUNDS, BESIDE = 3, 2.0  # of starts beside a solution, and their distance in standard deviations
COARSE = 1.0e-3  # of cost and unknowns, in stages that only find a start
TRIGGERS = 2  # trigger times from which a stage starts
INSIDE = 1.0e-9  # of the bounds, by which a start is moved inside them


def solved(problem: Problem, start: Array, loss: str = "linear", scale: float = 1.0, tolerance: float = 1e-8) -> Any:
    """Return the solution of least squares from a start."""
    low, high = problem.bounds()
    wide = np.where(np.isfinite(high - low), high - low, 0.0)
    inner = np.clip(start, low + INSIDE * wide, high - INSIDE * wide)
    return least_squares(
        problem.residuals, inner, problem.jacobian, (low, high),
        x_scale="jac", loss=loss, f_scale=scale, ftol=tolerance, xtol=tolerance,
    )  # fmt: skip


def search(problem: Problem, chosen: Options) -> Any:
    """Return the solution of a fit as scipy gives it."""
    start = problem.start()
    for stage in STAGES:
        problem.smoothed = stage
        start = _best(solved(problem, each, tolerance=COARSE) for each in triggers(problem, start, TRIGGERS)).x
    problem.smoothed = 0.0
    starts = [start, *triggers(problem, start, TRIGGERS)]
    found = polished(problem, solved(problem, _best(solved(problem, each, tolerance=COARSE) for each in starts).x))
    if chosen.loss == "huber":
        for _ in range(2):
            size = 1.4826 * float(np.median(np.abs(problem.residuals(found.x))))
            found = solved(problem, found.x, "huber", HUBER * max(size, 1e-12))
    if chosen.noise == "ar1":
        for _ in range(2):
            problem.correlated = [0.0] * len(problem.signals)
            problem.correlated = [min(0.99, max(0.0, each)) for each in autocorrelations(problem, found.x)]
            found = solved(problem, found.x)
    return found


def _best(found: Any) -> Any:
    return min(found, key=lambda each: float(each.cost))


def polished(problem: Problem, found: Any) -> Any:
    """Return the best of solutions from starts beside one: a front that enters another sample leaves a kink there."""
    for _ in range(ROUNDS):
        sizes, ways = np.linalg.svd(found.jac, full_matrices=False)[1:]
        spread = math.sqrt(2.0 * float(found.cost) / max(1, len(found.fun) - problem.size))
        steps = [way * min(spread / float(size), 0.1) for size, way in zip(sizes, ways, strict=True) if size > 0.0]
        tried = [solved(problem, found.x + side * BESIDE * step) for step in steps for side in (-1.0, 1.0)]
        best = _best([found, *tried])
        if not best.cost < found.cost * (1.0 - 1e-9):
            break
        found = best
    return found


def triggers(problem: Problem, start: Array, count: int) -> list[Array]:
    """Return starts with the trigger times at which the signals fit best, the best first; the start if none is free."""
    means = problem.means(start)
    free = [number for number in range(len(problem.signals)) if problem.place(number, "shift") is not None]
    if means is None or not free:
        return [start]
    low, high = problem.bounds()
    best: dict[int, list[float]] = {}
    for number in free:
        signal, mean = problem.signals[number], means[number]
        place = int(problem.place(number, "shift") or 0)
        every = np.arange(max(-0.5 * len(signal.times), low[place]), min(0.9 * len(signal.times), high[place]), 1.0)
        width = problem.smoothed * len(signal.times)
        shown = smooth(mean.over(problem.measured[number].edges, 0.0), width)
        moved = signal.times - every[:, None] * signal.width
        model = np.interp(moved, signal.times, shown, left=mean.rest, right=mean.last)
        costs = _costs(problem, number, start, model, smooth(signal.values, width))
        inner = np.flatnonzero((costs[1:-1] <= costs[:-2]) & (costs[1:-1] < costs[2:])) + 1
        ordered = inner[np.argsort(costs[inner])][:count] if len(inner) else [int(np.argmin(costs))]
        best[place] = every[ordered].tolist()
    found = []
    for turn in range(max(map(len, best.values()))):
        moved = start.copy()
        for place, each in best.items():
            moved[place] = each[min(turn, len(each) - 1)]
        found.append(moved)
    return found


def _costs(problem: Problem, number: int, start: Array, model: Array, data: Array) -> Array:
    """Return the squares that are left for each row of a model, with the best gain and offset where they are free."""
    gain, offset, _ = problem.setting(start, number)
    if problem.place(number, "offset") is not None:
        model, data, offset = model - np.mean(model, axis=1, keepdims=True), data - np.mean(data), 0.0
    if problem.place(number, "gain") is not None:
        along, own = (data - offset) @ model.T, np.sum(model * model, axis=1)
        return np.asarray(float((data - offset) @ (data - offset)) - along * np.abs(along) / np.maximum(own, 1e-300))
    return np.asarray(np.sum((gain * model + offset - data) ** 2, axis=1))
