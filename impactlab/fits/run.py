"""Fits numbers of a case to measured signals: trigger first, then least squares from a strong low-pass to none."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from impactlab import api
from impactlab.casefile import Case
from impactlab.derivatives.parameters import read_parameters
from impactlab.errors import CaseError
from impactlab.fits.model import check_channel, smooth
from impactlab.fits.problem import Problem, Unknown
from impactlab.fits.result import Fit, Fitted
from impactlab.fits.signals import Signal
from impactlab.types import Array

STAGES = (0.06, 0.02, 0.0)  # widths of the low-pass, of the samples of a signal
ROUNDS, BESIDE = 3, 2.0  # of starts beside a solution, and their distance in standard deviations
COARSE = 1.0e-3  # of cost and unknowns, in stages that only find a start
TRIGGERS = 2  # trigger times from which the last stage starts
UNSEEN = 3.0  # standard deviation of a logarithm, from which the signals do not determine it
CORRELATED = 4.0  # of the standard deviation of an autocorrelation under white noise: beyond it is told
HUBER = 1.345  # of the noise: residuals beyond count linearly


class Options(NamedTuple):
    """How the noise is taken."""

    loss: str  # linear or huber
    noise: str  # white or ar1


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
    return _result(problem, found, chosen)


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
            problem.correlated = min(0.99, max(0.0, _autocorrelation(problem, found.x)))
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


def _autocorrelation(problem: Problem, scaled: Array) -> float:
    """Return the autocorrelation of neighbouring residuals."""
    means = problem.means(scaled)
    if means is None:
        return 0.0
    parts = problem.parts(means, problem.shifts(scaled))
    whole = sum((float(part @ part) for part in parts), 0.0)
    return sum((float(part[1:] @ part[:-1]) for part in parts), 0.0) / max(whole, 1e-300)


def _result(problem: Problem, found: Any, chosen: Options) -> Fit:
    residuals, jacobian = problem.residuals(found.x), problem.jacobian(found.x)
    freedom = len(residuals) - problem.size
    spread = float(np.sqrt(residuals @ residuals / freedom))
    if chosen.loss == "huber":
        spread = 1.4826 * float(np.median(np.abs(residuals)))
        kept = np.abs(residuals) <= HUBER * spread
        jacobian = jacobian * kept[:, None]
    _, sizes, ways = np.linalg.svd(jacobian / np.linalg.norm(jacobian, axis=0).clip(1e-300), full_matrices=False)
    norms = np.linalg.norm(jacobian, axis=0).clip(1e-300)
    deviations = spread / np.maximum(sizes, 1e-300)  # along each direction, in columns of unit length
    directions = ways / norms
    lengths = np.linalg.norm(directions[:, : len(problem.unknowns)], axis=1)
    unseen = deviations * lengths > UNSEEN
    covariance = (directions.T * deviations**2) @ directions
    autocorrelation = _autocorrelation(problem, found.x)
    warnings = []
    widened = 1.0
    if (
        chosen.noise == "white"
        and abs(autocorrelation) > CORRELATED / math.sqrt(len(residuals))
        and autocorrelation < 1.0
    ):
        widened = math.sqrt(max(1.0, (1.0 + autocorrelation) / (1.0 - autocorrelation)))
        warnings.append(
            f"warning: neighbouring residuals correlate by {autocorrelation:.2f}: under white noise the intervals "
            f"would be {widened:.2g} times too narrow and are widened; --noise ar1 takes it into account"
        )
    reach = float(student.ppf(0.975, freedom)) * widened
    rows = []
    for number, each in enumerate(problem.unknowns):
        value = each.value(float(found.x[number]))
        free = bool(np.any(unseen & (np.abs(ways[:, number]) > 0.05)))
        half = math.inf if free else reach * math.sqrt(covariance[number, number])
        lower, upper = (value * math.exp(-half), value * math.exp(half)) if half < 700.0 else (0.0, math.inf)
        if not each.is_positive:
            lower, upper = (value + sign * half * (each.high - each.low) for sign in (-1.0, 1.0))
        at_bound = min(value - each.low, each.high - value) <= 1e-6 * (each.high - each.low)
        note = "at its bound" if at_bound else "not determined" if free else ""
        rows.append(Fitted(each.path, value, lower, upper, each.unit, note))
        if at_bound:
            warnings.append(
                f"warning: {each.path} ended at its bound {value:.6g} {each.unit}; the interval does not hold"
            )
    for number, (signal, shift) in enumerate(zip(problem.signals, problem.shifts(found.x), strict=True)):
        if problem.free:
            place = len(problem.unknowns) + number
            half = reach * math.sqrt(covariance[place, place]) * problem.widths[number]
            rows.append(Fitted(f"shift of {signal.channel}", shift, shift - half, shift + half, "s"))
    means = problem.means(found.x)
    parts = () if means is None else tuple(problem.parts(means, problem.shifts(found.x)))
    told = tuple(_told(problem, ways[row] / norms) for row in np.flatnonzero(unseen))
    return Fit(problem.at(found.x), tuple(rows), covariance, parts, spread, autocorrelation, tuple(warnings), told)


def _told(problem: Problem, direction: Array) -> str:
    """Return a direction that the signals do not see, in words."""
    own = direction[: len(problem.unknowns)]
    own = own / own[int(np.argmax(np.abs(own)))]
    powers = [
        f"{each.path.rpartition('.')[2]}^{power:.2g}"
        for each, power in zip(problem.unknowns, own.tolist(), strict=True)
        if abs(power) > 0.05
    ]
    return f"the signals do not tell how large {' '.join(powers)} is: only other combinations are determined"
