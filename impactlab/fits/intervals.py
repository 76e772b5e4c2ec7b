"""Parameters of a fit with 95 % intervals of each kind, and warnings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import chdtrc, stdtrit  # as in scipy.stats, which takes half a second to import

from impactlab.fits.bootstrap import Bootstrap, bootstrap
from impactlab.fits.identifiable import (
    Identifiability,
    exponential,
    products,
    seen,
    short_names,
    undetermined,
    with_effects,
)
from impactlab.fits.loss import Loss, from_median
from impactlab.fits.problem import Problem
from impactlab.fits.profiles import Profile, profile
from impactlab.fits.result import BOOTSTRAP, JACOBIAN, PROFILE, WIDENED, Curve, Fit, Fitted, Resamples, Shown
from impactlab.fits.secants import jumping, secants
from impactlab.fits.unknowns import Unknown, is_of_instrument
from impactlab.numerics.bisection import bisected
from impactlab.types import Array

CORRELATED = 4.0  # of the standard deviation of an autocorrelation under white noise: beyond it a warning is given
HUBER = 1.345  # of the noise: residuals beyond count linearly
ABOVE_NOISE = 1.0e-3  # probability of residuals as large as that under the given noise
MIN_SPREAD = 1.0e-7  # of the scale of a signal: smaller residuals are rounding of runs, not noise
HALVINGS = 8  # of the way between two different sequences of contacts
RESTARTS = 3  # from a better solution that a profile has found
OF_THE_RISE = 0.5  # of a front, in which its shift may lie for intervals from the derivatives to hold
AT_BOUND = 1.0e-6  # of the distance between the bounds


class Options(NamedTuple):
    """How the noise is taken, and which intervals are given beside those from the derivatives."""

    loss: str  # linear or huber
    noise: str  # white, ar1 or std
    intervals: tuple[str, ...] = ()  # profile, bootstrap
    resamples: int = 500
    seed: int = 0


class Solution(NamedTuple):
    """A solution with all that its intervals are made of."""

    x: Array  # (n,), scaled
    residuals: Array
    spread: float  # standard deviation of the residuals that the intervals take
    reach: float  # half an interval over a standard deviation, under the noise that is assumed
    widened: float  # of the reach, for correlated residuals
    seen: Identifiability


def _neighbours(parts: Sequence[Array]) -> float:
    """Return the autocorrelation of neighbouring residuals of all signals."""
    whole = sum(float(part @ part) for part in parts)
    return sum(float(part[1:] @ part[:-1]) for part in parts) / max(whole, 1e-300)


def _natural(each: Unknown, scaled: float) -> float:
    """Return the SI value of a scaled unknown, possibly beyond its bounds or infinite."""
    if each.is_positive:
        return each.start * exponential(scaled)
    return scaled * each.scale


def fit_with_intervals(problem: Problem, found: Any, chosen: Options) -> Fit:
    """Return the fit whose solution was found, with its intervals."""
    x = np.asarray(found.x)
    for _ in range(RESTARTS):
        solution, warnings = _solution(problem, x, chosen)
        loss = _loss(problem, solution, chosen)
        profiles = _profiles(problem, loss, solution) if PROFILE in chosen.intervals else {}
        better = next((each.better for each in profiles.values() if each.better is not None), None)
        if better is None:
            break
        x = loss.least(better).x
    else:
        x = solution.x
        warnings.append(
            "warning: the profiles found solutions with a smaller loss several times: the intervals "
            "are not those of one minimum. Start from other values, or fit fewer parameters"
        )
    resampled = None
    if BOOTSTRAP in chosen.intervals:
        resampled = bootstrap(loss, x, [len(part) for part in problem.parts(x) or []], chosen.resamples, chosen.seed)
    rows, more = _rows(problem, loss, solution, profiles, resampled)
    reach, unknowns = solution.reach * solution.widened, problem.unknowns
    paths = [each.path for each in unknowns]
    made = []
    free = [each for each, is_free in zip(unknowns, solution.seen.is_free.tolist(), strict=True) if is_free]
    if free and all(each.is_positive or each.path.startswith("gain of") for each in free):
        made = products(solution.seen, paths, problem.values(x), reach)
    curves = [
        Curve(each.path, each.unit, np.array([_natural(each, place) for place in profiles[number].x.tolist()]),
              profiles[number].rise, reach**2, each.is_positive)
        for number, each in enumerate(unknowns) if number in profiles
    ]  # fmt: skip
    shown = [
        Shown(of.label, of.signal.time, of.signal.values, fitted)
        for of, fitted in zip(problem.measured, problem.fitted(x), strict=True)
    ]
    parts = problem.parts(x) or []
    cases = problem.cases(x)
    return Fit(
        case=cases[0],
        parameters=tuple(rows),
        covariance=solution.seen.covariance,
        residuals=tuple(parts),
        noise=_size(solution.residuals, problem, chosen),
        autocorrelation=_neighbours(parts),
        warnings=(*warnings, *more),
        undetermined=tuple(undetermined(solution.seen, paths, made)),
        cases=cases,
        determined=tuple(made),
        signals=tuple(shown),
        profiles=tuple(curves),
        bootstrap=None if resampled is None else Resamples(chosen.resamples, chosen.seed, resampled.blocks),
        assumed={"noise": chosen.noise, "loss": chosen.loss},
        unknowns=tuple(unknowns),
        reach=reach,
    )


def _after_the_run(problem: Problem, x: Array) -> list[str]:
    """Return warnings about signals with samples after the end of their run."""
    warnings = []
    for number, (of, mean) in enumerate(zip(problem.measured, problem.means(x) or [], strict=True)):
        late = int(np.sum(of.edges[:-1] - problem.setting(x, number)[2] >= mean.duration))
        if late:
            warnings.append(
                f"warning: {late} of {len(of.signal.time)} samples of {of.label} lie after the end of the run, "
                f"{mean.duration:.6g} s: they are compared with its last value. Give solve.duration a longer time, or "
                "leave these samples out"
            )
    return warnings


def _loose_fronts(problem: Problem, x: Array, halves: Array) -> list[str]:
    """Return warnings about signals whose shift is uncertain beside a free offset.

    It may differ by a share of the rise time of their front. ``halves`` (n,) are half the intervals of the scaled
    unknowns, of shifts in samples.
    """
    warnings = []
    for number, (of, shown) in enumerate(zip(problem.measured, problem.fitted(x), strict=True)):
        shift, offset = problem.place(number, "shift"), problem.place(number, "offset")
        steepest = float(np.abs(np.diff(shown)).max(initial=0.0))
        if shift is None or offset is None or not steepest > 0.0:
            continue
        half = float(halves[shift]) * problem.unknowns[shift].scale / problem.signals[number].width
        rise = float(np.ptp(shown)) / steepest
        if half > OF_THE_RISE * rise:
            warnings.append(
                f"warning: the uncertainty of the shift of {of.label} is {half:.2g} samples, and its "
                f"steepest front rises within {rise:.2g}. If the offset is also free, the 95 % intervals "
                "from the derivatives contained the true value in 60 to 90 % of trials. Fix the shift or "
                "the offset, or give a record that continues after the contact"
            )
    return warnings


def _rough(paths: Sequence[str]) -> list[str]:
    """Return a warning about unknowns with which residuals jump, if there are any."""
    if not paths:
        return []
    return [
        (
            f"warning: the signals of this stepped run jump where {', '.join(short_names(paths))} "
            "changes and an event passes from one step to the next. Intervals by profile or "
            "bootstrap may end at such a jump, and are then too narrow. Use those from the "
            "derivatives, or give a smaller step or the exact solver (solve.model: {kind: "
            "continuous})"
        )
    ]


def _size(residuals: Array, problem: Problem, chosen: Options) -> float:
    """Return the standard deviation of residuals, from their median where some are far off."""
    if chosen.loss == "huber":
        return from_median(residuals)
    return float(np.sqrt(residuals @ residuals / (len(residuals) - problem.size)))


def _solution(problem: Problem, x: Array, chosen: Options) -> tuple[Solution, list[str]]:
    """Return a solution with its spread, and warnings about its residuals."""
    residuals, freedom, warnings = problem.residuals(x), problem.count - problem.size, []
    spread = max(_size(residuals, problem, chosen), MIN_SPREAD)
    jacobian = with_effects(problem.jacobian(x, both_sides=not problem.is_quick), spread)
    if not problem.is_quick and {PROFILE, BOOTSTRAP} & set(chosen.intervals):
        rough = jumping(problem.residuals, x, problem.bounds(), jacobian, spread)
        warnings += _rough([problem.unknowns[number].path for number in rough])
    jacobian = secants(problem.residuals, x, problem.bounds(), jacobian, spread)
    if chosen.loss == "huber":
        jacobian = jacobian * (np.abs(residuals) <= HUBER * spread)[:, None]
    left_out = sum(int(np.sum(each)) for each in problem.left_out)
    if left_out:
        warnings.append(f"note: {left_out} of {problem.count} samples are outliers and are left out")
    reach = float(stdtrit(freedom, 0.975))
    if chosen.noise == "std":
        is_above = chdtrc(freedom, float(residuals @ residuals)) < ABOVE_NOISE
        if is_above:
            warnings.append(
                f"warning: the residuals are {spread:.2g} times the given standard deviations, and the "
                "intervals are widened by that factor: an effect is missing in the case, or the noise is "
                "larger"
            )
        spread = max(1.0, spread) if is_above else 1.0
        reach = reach if is_above else float(stdtrit(math.inf, 0.975))
    neighbours, widened = _neighbours(problem.parts(x) or []), 1.0
    if chosen.noise != "ar1" and CORRELATED / math.sqrt(len(residuals)) < neighbours < 1.0:
        widened = math.sqrt((1.0 + neighbours) / (1.0 - neighbours))
        warnings.append(
            f"warning: neighbouring residuals have a correlation of {neighbours:.2f}: the noise is "
            "coloured, or an effect is missing in the case. Intervals for white noise are too "
            f"narrow; widened ones, {widened:.2g} times as wide, are listed beside them. noise ar1 "
            "takes the correlation into account"
        )
    warnings += _after_the_run(problem, x)
    found = seen(jacobian, spread, np.array([_weight(each, x[number]) for number, each in enumerate(problem.unknowns)]))
    warnings += _loose_fronts(problem, x, reach * widened * np.sqrt(np.diag(found.known)))
    return Solution(x, residuals, spread, reach, widened, found), warnings


def _weight(each: Unknown, scaled: float) -> float:
    """Return d(ln number)/d(unknown); 0 of offsets and shifts."""
    if each.path.startswith("gain of"):
        return 1.0 / max(abs(scaled), 1e-9)
    return 0.0 if is_of_instrument(each.path) else 1.0


def _loss(problem: Problem, solution: Solution, chosen: Options) -> Loss:
    low, high = problem.bounds()
    limit = HUBER * solution.spread if chosen.loss == "huber" else math.inf
    return Loss(problem.residuals, problem.jacobian, low, high, limit)


def _profiles(problem: Problem, loss: Loss, solution: Solution) -> dict[int, Profile]:
    found = {}
    for number in range(problem.size):
        is_free = bool(solution.seen.is_free[number])
        known = math.sqrt(float(solution.seen.known[number, number]))
        deviation = known if known > 0.0 else math.inf
        limit = solution.reach * solution.widened
        found[number] = profile(loss, number, solution.x, solution.spread, limit, deviation, is_seen=not is_free)
    return found


def _rows(
    problem: Problem, loss: Loss, solution: Solution, profiles: Mapping[int, Profile], resampled: Bootstrap | None
) -> tuple[list[Fitted], list[str]]:
    """Return the rows of the result, and warnings about single parameters."""
    rows, warnings = [], []
    names = short_names([each.path for each in problem.unknowns])
    here = problem.closings(solution.x)
    for number, each in enumerate(problem.unknowns):
        x, is_free = float(solution.x[number]), bool(solution.seen.is_free[number])
        half = math.inf if is_free else solution.reach * math.sqrt(float(solution.seen.known[number, number]))
        ends = {JACOBIAN: (x - half, x + half)}
        if solution.widened > 1.0:
            ends[WIDENED] = (x - solution.widened * half, x + solution.widened * half)
        if number in profiles:
            ends[PROFILE] = (profiles[number].lower, profiles[number].upper)
        if resampled is not None:
            ends[BOOTSTRAP] = (-math.inf, math.inf) if is_free else resampled.interval(number, loss)
        shown = {kind: (_natural(each, low), _natural(each, high)) for kind, (low, high) in ends.items()}
        value, notes = each.value(x), ["not determined"] if is_free else []
        if _is_at_bound(each, value):
            notes.insert(0, "at its bound")
            warnings.append(f"warning: {each.path} is at its bound, {value:.6g} {each.unit}; its interval is not valid")
        place = None
        if here is not None and number < len(problem.parameters) and not is_free:
            place = _edge(problem, solution, here, number)
        if place is not None:
            notes.append("near an edge")
            warnings.append(
                f"warning: inside the interval of {names[number]}, at about {_natural(each, place):.6g} "
                f"{each.unit}, the sequence of contacts changes. The loss may have a kink or a second "
                "minimum there, and the interval from the derivatives may not be valid; a profile "
                "(intervals profile) shows it"
            )
        lower, upper = shown.get(WIDENED, shown[JACOBIAN])
        rows.append(Fitted(each.path, value, lower, upper, each.unit, "; ".join(notes), shown))
    return rows, warnings


def _is_at_bound(each: Unknown, value: float) -> bool:
    width = each.high - each.low if math.isfinite(each.high - each.low) else max(abs(value), 1e-9)
    return min(value - each.low, each.high - value) <= AT_BOUND * width


def _edge(problem: Problem, solution: Solution, here: list[tuple[str, ...]], number: int) -> float | None:
    """Return the value of an unknown, scaled, at the nearest change of the sequence of contacts; None for no change."""
    low, high = problem.bounds()
    column = solution.seen.known[:, number]
    way = column / math.sqrt(float(column[number])) * solution.reach * solution.widened  # the others follow
    found = []
    for end in (np.clip(solution.x + sign * way, low, high) for sign in (-1.0, 1.0)):
        share = _share_to_change(problem, here, solution.x, end)
        if share is not None:
            found.append((share, float(solution.x[number] + share * (end - solution.x)[number])))
    return min(found)[1] if found else None


def _share_to_change(problem: Problem, here: list[tuple[str, ...]], start: Array, end: Array) -> float | None:
    """Return the share of the way from a solution to an end at which other contacts close; None where none do.

    The loss may have a kink there. ``here`` are the contacts that close at the solution.
    """
    if problem.closings(end) in (None, here):
        return None
    return bisected(lambda share: problem.closings(start + share * (end - start)) != here, 0.0, 1.0, HALVINGS)[1]
