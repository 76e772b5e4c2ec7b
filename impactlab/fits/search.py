"""Solution of a fit: scan of trigger times, then least squares from a strong low-pass filter to none."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from impactlab.fits.correlation import correlations
from impactlab.fits.filters import smooth
from impactlab.fits.identifiable import MIN_COLUMN
from impactlab.fits.intervals import HUBER, Options
from impactlab.fits.loss import from_median
from impactlab.fits.model import AbstractMeans
from impactlab.fits.problem import Problem
from impactlab.types import Array

STAGES = (0.06, 0.02, 0.007)  # widths of the low-pass, of the samples of a signal, before the stage without
KEPT_SOLUTIONS = 3  # solutions of a stage that the next one starts from
SAME_TOL = 0.02  # of a scaled unknown: solutions that differ by less are one
START_SPREAD = 0.3  # of a logarithm, by which parameters are tried about the start
MAX_FULL = 3  # parameters that are tried in all combinations, more one by one
BESIDE = (2.0, 8.0)  # standard deviations: starts beside a solution
MAX_BESIDE = 0.1  # of a scaled unknown: the same
ROUNDS = 3  # of such starts
PLACES = 6  # between its bounds, at which a parameter without effect at a solution is tried
COST_TOL = 1.0e-5  # of the cost, in these: a solution better by more is another one
MAX_FAR = 4.685  # standard deviations of a residual: samples beyond are left out under huber (95 % efficient)
NOISE_ROUNDS = 2  # times that the size of the noise of each signal, or its correlation, is found again
COARSE_TOL = 1.0e-3  # of the cost, in stages that only find a start
XTOL = 1.0e-6  # of the unknowns, of which shifts are in samples
TRIGGERS = 2  # trigger times from which a stage starts
STRIDE = 3.0  # a scan looks at so many samples and shifts in the width of the low-pass
BOUND_MARGIN = 1.0e-9  # of the bounds, by which a start is moved inside them


def solved(problem: Problem, start: Array, loss: Any = "linear", scale: float = 1.0, tolerance: float = 1e-8) -> Any:
    """Return the solution of least squares from a start."""
    low, high = problem.bounds()
    wide = np.where(np.isfinite(high - low), high - low, 0.0)
    inner = np.clip(start, low + BOUND_MARGIN * wide, high - BOUND_MARGIN * wide)
    return least_squares(
        problem.residuals, inner, problem.jacobian, (low, high),
        x_scale="jac", loss=loss, f_scale=scale, ftol=tolerance, xtol=min(tolerance, XTOL),
    )  # fmt: skip


def search(problem: Problem, chosen: Options) -> Any:
    """Return the solution of a fit as scipy gives it."""
    problem.smoothed = STAGES[0]
    starts = on_both_sides(problem)
    for stage in STAGES:
        problem.smoothed = stage
        kept = _apart(solved(problem, each, tolerance=COARSE_TOL) for each in starts)
        starts = [place for each in kept for place in triggers(problem, each.x)]
    problem.smoothed = 0.0
    starts = [each.x for each in kept]
    if problem.has_shifts:
        starts += triggers(problem, kept[0].x)
    found = polished(problem, _best(solved(problem, each, tolerance=COARSE_TOL) for each in starts).x)
    found = moved_to_effect(problem, found)
    if len(problem.signals) > 1 and chosen.noise != "std":
        for _ in range(NOISE_ROUNDS):
            problem.weigh(found.x)
            found = polished(problem, found.x)
    if chosen.loss == "huber" or chosen.noise == "ar1":
        for _ in range(NOISE_ROUNDS):
            if chosen.noise == "ar1":
                problem.correlated = correlations(problem, found.x)
            found = polished(problem, found.x, *_loss(problem, found.x, chosen))
    if chosen.loss == "huber":  # a front that bends to one sample far off is found by a loss that forgets this sample
        limit = MAX_FAR * _size(problem, found.x)
        found = polished(problem, found.x, biweight, limit)
        problem.leave_out(found.x, limit)
        found = polished(problem, found.x, *_loss(problem, found.x, chosen))
    return found


def _loss(problem: Problem, x: Array, chosen: Options) -> tuple[str, float]:
    """Return the loss as scipy names it, and its scale."""
    return ("huber", HUBER * _size(problem, x)) if chosen.loss == "huber" else ("linear", 1.0)


def _size(problem: Problem, x: Array) -> float:
    """Return the standard deviation of the residuals, from their median."""
    return max(from_median(problem.residuals(x)), 1e-12)


def biweight(squares: Array) -> Array:
    """Return Tukey's loss of relative squares and its two derivatives, (3, n).

    Squares are over that of the limit; the loss is constant from 1 on.
    """
    left = np.maximum(0.0, 1.0 - squares)
    return np.stack([(1.0 - left**3) / 3.0, left**2, -2.0 * left])


def _apart(found: Any) -> list[Any]:
    """Return the best solutions, no two of which are the same."""
    kept: list[Any] = []
    for each in sorted(found, key=lambda solution: float(solution.cost)):
        if len(kept) < KEPT_SOLUTIONS and all(np.max(np.abs(each.x - other.x)) > SAME_TOL for other in kept):
            kept.append(each)
    return kept


def _best(found: Any) -> Any:
    return min(found, key=lambda each: float(each.cost))


def polished(problem: Problem, start: Array, loss: Any = "linear", scale: float = 1.0) -> Any:
    """Return the best of solutions from a start and from places beside its solution.

    A front that enters another sample leaves a kink there, and may leave a minimum to each side.
    """
    found = solved(problem, start, loss, scale)
    for _ in range(ROUNDS):
        sizes, ways = np.linalg.svd(found.jac, full_matrices=False)[1:]
        spread = math.sqrt(2.0 * float(found.cost) / max(1, len(found.fun) - problem.size))
        steps = [
            side * way * far * min(spread / size, MAX_BESIDE)
            for size, way in zip(sizes.tolist(), ways, strict=True)
            if size > 0.0
            for far in (BESIDE if problem.is_quick else BESIDE[:1])
            for side in (-1.0, 1.0)
        ]
        best = _best(solved(problem, found.x + step, loss, scale, COST_TOL) for step in steps)
        if not best.cost < found.cost * (1.0 - COST_TOL):
            break
        found = solved(problem, best.x, loss, scale)
    return found


def moved_to_effect(problem: Problem, found: Any) -> Any:
    """Return the best solution, also from places where parameters have an effect.

    Parameters without an effect at the solution are moved there. A yield force above the largest force, or a play that
    is never used up, has no derivative that leads away.
    """
    low, high = problem.bounds()
    best = found
    for number in range(len(problem.parameters)):
        without_effect = np.linalg.norm(found.jac[:, number]) <= MIN_COLUMN * np.linalg.norm(found.jac, axis=0).max()
        if not without_effect or not np.isfinite(high[number] - low[number]):
            continue
        places = np.repeat(np.asarray(found.x)[None], PLACES, axis=0)
        places[:, number] = np.linspace(low[number], high[number], PLACES + 2)[1:-1]
        left = [problem.residuals(place) for place in places]
        with_effect = [n for n, each in enumerate(left) if not np.array_equal(each, found.fun)]
        with_effect.sort(key=lambda n: float(left[n] @ left[n]))
        best = _best([best, *(solved(problem, places[n], tolerance=COARSE_TOL) for n in with_effect[:KEPT_SOLUTIONS])])
    return polished(problem, best.x) if best.cost < found.cost * (1.0 - COST_TOL) else found


def on_both_sides(problem: Problem) -> list[Array]:
    """Return the best starts on both sides of the given parameters.

    Each has its trigger times. Where a trial takes a run of its own, the given start alone.
    """
    start, (low, high) = problem.start(), problem.bounds()
    if not problem.is_quick:
        return triggers(problem, start)
    count = len(problem.parameters)
    signs: list[tuple[float, ...]] = [(0.0,) * count]
    if count <= MAX_FULL:
        signs = list(itertools.product((0.0, -1.0, 1.0), repeat=count))
    else:
        for moved in range(count):
            signs += [tuple(sign if k == moved else 0.0 for k in range(count)) for sign in (-1.0, 1.0)]
    found = []
    for each in signs:
        place = start.copy()
        for number, sign in enumerate(each):
            room = (high if sign > 0.0 else low)[number] - start[number]
            place[number] += sign * min(START_SPREAD, 0.5 * abs(room))
        found += scanned(problem, place)
    found.sort(key=lambda each: each[0])
    return [place for _, place in found[: 2 * KEPT_SOLUTIONS]]


def triggers(problem: Problem, start: Array) -> list[Array]:
    """Return starts with the best trigger times, best first; the start itself without a free shift."""
    return [place for _, place in scanned(problem, start)]


def scanned(problem: Problem, start: Array) -> list[tuple[float, Array]]:
    """Return the remaining squares and the starts of the best trigger times, the best first."""
    means = problem.means(start)
    free = [number for number in range(len(problem.signals)) if problem.place(number, "shift") is not None]
    if means is None or not free:
        left = problem.residuals(start)
        return [(float(left @ left), start)]
    low, high = problem.bounds()
    best: dict[int, list[tuple[float, float]]] = {}
    fixed, shared = 0.0, dict[int, list[int]]()  # signals of each shift
    for number in range(len(problem.signals)):
        place = problem.place(number, "shift")
        if place is None:
            left = problem.part(number, means[number], problem.setting(start, number))
            fixed += float(left @ left)
        else:
            shared.setdefault(place, []).append(number)
    for place, numbers in shared.items():
        signal, scale = problem.signals[numbers[0]], problem.unknowns[place].scale
        stride = min(_stride(problem, number) * problem.signals[number].width for number in numbers) / scale
        first, last = max(-0.5 * len(signal.time), low[place]), min(0.9 * len(signal.time), high[place])
        every = np.arange(first, max(last, first + 0.5), stride)
        costs = sum((_scan(problem, number, start, means[number], every * scale) for number in numbers), np.zeros(1))
        inner = np.flatnonzero((costs[1:-1] <= costs[:-2]) & (costs[1:-1] < costs[2:])) + 1
        ordered = inner[np.argsort(costs[inner])][:TRIGGERS] if len(inner) else np.array([np.argmin(costs)])
        best[place] = list(zip(costs[ordered].tolist(), every[ordered].tolist(), strict=True))
    found = []
    for turn in range(max(map(len, best.values()))):
        moved, total = start.copy(), fixed
        for place, each in best.items():
            cost, moved[place] = each[min(turn, len(each) - 1)]
            total += cost
        found.append((total, moved))
    return found


def _stride(problem: Problem, number: int) -> int:
    """Return the number of samples that a scan passes over at once.

    The low-pass filter keeps one of them.
    """
    return max(1, int(problem.smoothed * len(problem.signals[number].time) / STRIDE))


def _scan(problem: Problem, number: int, start: Array, mean: AbstractMeans, shifts: Array) -> Array:
    """Return the squares that are left of a signal at some shifts [s]."""
    signal, stride = problem.signals[number], _stride(problem, number)
    width = problem.smoothed * len(signal.time)
    shown = smooth(mean.over(problem.measured[number].edges, 0.0), width)
    model = np.interp(signal.time[::stride] - shifts[:, None], signal.time, shown, left=mean.rest, right=mean.last)
    costs = _costs(problem, number, start, model, smooth(signal.values, width)[::stride])
    return np.asarray(costs * (stride / signal.scale**2))


def _costs(problem: Problem, number: int, start: Array, model: Array, data: Array) -> Array:
    """Return the remaining squares for each row of a model.

    Gain and offset are the best ones where they are free.
    """
    gain, offset, _ = problem.setting(start, number)
    if problem.place(number, "offset") is not None:
        model, data, offset = model - np.mean(model, axis=1, keepdims=True), data - np.mean(data), 0.0
    if problem.place(number, "gain") is not None:
        along, own = (data - offset) @ model.T, np.sum(model * model, axis=1)
        return np.asarray(float((data - offset) @ (data - offset)) - along * np.abs(along) / np.maximum(own, 1e-300))
    return np.asarray(np.sum((gain * model + offset - data) ** 2, axis=1))
