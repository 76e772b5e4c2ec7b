"""Fits numbers of a case to measured signals: trigger first, then least squares from a strong low-pass to none."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from impactlab import api
from impactlab.casefile import Case
from impactlab.derivatives.parameters import read_parameters
from impactlab.errors import CaseError
from impactlab.fits.intervals import HUBER, Options, autocorrelation, fit_with_intervals
from impactlab.fits.model import check_channel, smooth
from impactlab.fits.problem import Problem, Unknown
from impactlab.fits.result import Fit
from impactlab.fits.signals import Signal
from impactlab.types import Array

STAGES = (0.06, 0.02, 0.0)  # widths of the low-pass, of the samples of a signal
ROUNDS, BESIDE = 3, 2.0  # of starts beside a solution, and their distance in standard deviations
COARSE = 1.0e-3  # of cost and unknowns, in stages that only find a start
TRIGGERS = 2  # trigger times from which the last stage starts


def fit(
    case: Case,
    signals: Signal | Sequence[Signal],
    parameters: Mapping[str, tuple[float, float]],
    *,
    shift: str = "fixed",
    loss: str = "linear",
    noise: str = "white",
) -> Fit:
    """Return a case whose numbers are fitted to measured signals.

    Parameters
    ----------
    case : Case
        The case, with the method that solves it; its own values are the start.
    signals : Signal or sequence of Signal
        What was measured. A sample is the mean over its sampling interval.
    parameters : mapping
        Dotted path of each number that is fitted, to its lower and upper bound in SI units or as texts.
    shift : str
        ``free`` where the trigger time of each signal is unknown, else ``fixed``.
    loss : str
        ``linear`` for least squares; ``huber`` where single samples may be far off.
    noise : str
        ``white``, or ``ar1`` where neighbouring samples err alike.

    Raises
    ------
    CaseError
        If a path, bound, signal or channel is wrong, before the first fit.
    """
    chosen = _options(shift, loss, noise)
    given = [signals] if isinstance(signals, Signal) else list(signals)
    if not given:
        raise CaseError("no signal to fit", remedy="Give at least one.")
    unknowns = [_unknown(case, path, bounds) for path, bounds in parameters.items()]
    problem = Problem(case, given, unknowns, shift == "free")
    samples = sum(len(signal.times) for signal in given)
    if samples <= problem.size:
        raise CaseError(
            f"{samples} samples for {problem.size} unknowns", remedy="Give more samples, or fewer parameters."
        )
    with api.warnings_kept():
        history = api.run(case)
    for signal in given:
        check_channel(history, signal.channel)
    start = np.array([each.scaled(each.start) for each in unknowns] + [0.0] * (problem.size - len(unknowns)))
    found = _fitted(problem, start, chosen)
    return fit_with_intervals(problem, found, chosen)


def _options(shift: str, loss: str, noise: str) -> Options:
    for name, value, allowed in (
        ("shift", shift, ("fixed", "free")), ("loss", loss, ("linear", "huber")), ("noise", noise, ("white", "ar1")),
    ):  # fmt: skip
        if value not in allowed:
            raise CaseError(f"{name} {value!r}", remedy=f"Allowed: {', '.join(allowed)}.")
    return Options(loss, noise)


def _unknown(case: Case, path: str, bounds: Any) -> Unknown:
    (parameter,) = read_parameters(case, [path])
    try:
        low, high = bounds
    except (TypeError, ValueError):
        raise CaseError(f"{bounds!r} is no pair of bounds", path=path, remedy="Give (lower, upper).") from None
    ends = [read_parameters(case.with_(path, end), [path])[0].value for end in (low, high)]
    if not ends[0] < ends[1]:
        raise CaseError(f"bounds {low} and {high}", path=path, remedy="Give the lower one first.")
    if not ends[0] <= parameter.value <= ends[1]:
        raise CaseError(
            f"the start {parameter.value:g} lies outside {ends[0]:g} to {ends[1]:g} {parameter.unit}", path=path,
            remedy="Give the case a value inside the bounds.",
        )  # fmt: skip
    return Unknown(path, parameter.value, ends[0], ends[1], parameter.unit)


def _solved(problem: Problem, start: Array, loss: str = "linear", scale: float = 1.0, tolerance: float = 1e-8) -> Any:
    low, high = problem.bounds()
    inner = np.clip(start, low + 1e-9 * (high - low), high - 1e-9 * (high - low))
    return least_squares(
        problem.residuals, inner, problem.jacobian, (low, high),
        x_scale="jac", loss=loss, f_scale=scale, ftol=tolerance, xtol=tolerance,
    )  # fmt: skip


def _fitted(problem: Problem, start: Array, chosen: Options) -> Any:
    length = max(len(signal.times) for signal in problem.signals)
    if problem.free:
        for stage in STAGES[:-1]:
            problem.smoothed = stage * length
            best = [_solved(problem, each, tolerance=COARSE) for each in _triggers(problem, start, 2)]
            start = min(best, key=lambda each: float(each.cost)).x
    problem.smoothed = 0.0
    starts = [start, *(_triggers(problem, start, TRIGGERS) if problem.free else [])]
    tried = [_solved(problem, each, tolerance=COARSE) for each in starts]
    found = _polished(problem, _solved(problem, min(tried, key=lambda each: float(each.cost)).x))
    if chosen.loss == "huber":
        for _ in range(2):
            size = 1.4826 * float(np.median(np.abs(problem.residuals(found.x))))
            found = _solved(problem, found.x, "huber", HUBER * max(size, 1e-12))
    if chosen.noise == "ar1":
        for _ in range(2):
            problem.correlated = 0.0
            problem.correlated = min(0.99, max(0.0, autocorrelation(problem, found.x)))
            found = _solved(problem, found.x)
    return found


def _polished(problem: Problem, found: Any) -> Any:
    """Return the best of solutions from starts beside one: a front that enters another sample leaves a kink there."""
    for _ in range(ROUNDS):
        sizes, ways = np.linalg.svd(found.jac, full_matrices=False)[1:]
        spread = math.sqrt(2.0 * float(found.cost) / max(1, len(found.fun) - problem.size))
        steps = [way * min(spread / float(size), 0.1) for size, way in zip(sizes, ways, strict=True) if size > 0.0]
        tried = [_solved(problem, found.x + side * BESIDE * step) for step in steps for side in (-1.0, 1.0)]
        best = min([found, *tried], key=lambda each: float(each.cost))
        if not best.cost < found.cost * (1.0 - 1e-9):
            break
        found = best
    return found


def _triggers(problem: Problem, start: Array, count: int) -> list[Array]:
    """Return starts with the trigger times at which a signal fits best, the best first."""
    means = problem.means(start)
    if means is None:
        return [start]
    first = len(problem.unknowns)
    best: list[list[float]] = []
    for number, signal in enumerate(problem.signals):
        places = np.arange(-0.5 * len(signal.times), 0.9 * len(signal.times), 1.0)
        mean, shown = means[number], means[number].over(signal.edges, 0.0)
        costs: Array = np.empty(len(places))
        for k, place in enumerate((places * problem.widths[number]).tolist()):
            model = np.interp(signal.times, signal.times + place, shown, left=mean.rest, right=mean.last)
            filtered = smooth(model - signal.values, problem.smoothed)
            costs[k] = float(filtered @ filtered)
        inner = np.flatnonzero((costs[1:-1] <= costs[:-2]) & (costs[1:-1] < costs[2:])) + 1
        ordered = inner[np.argsort(costs[inner])][:count] if len(inner) else [int(np.argmin(costs))]
        best.append(places[ordered].tolist())
    found = []
    for turn in range(max(map(len, best))):
        moved = start.copy()
        moved[first:] = [each[min(turn, len(each) - 1)] for each in best]
        found.append(moved)
    return found
