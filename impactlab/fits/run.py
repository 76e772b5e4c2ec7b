"""Fits numbers of cases to measured signals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from impactlab.casefile import Case
from impactlab.casefile.case import expect_case
from impactlab.casefile.text.words import shown
from impactlab.errors import MAX_SEED, CaseError, closest, expect_whole
from impactlab.fits.intervals import Options, fit_with_intervals
from impactlab.fits.problem import Experiment, Problem
from impactlab.fits.result import BOOTSTRAP, JACOBIAN, PROFILE, Fit
from impactlab.fits.search import search
from impactlab.fits.signals import Setting, Signal
from impactlab.fits.unknowns import frequency

PAIRS = "Give each case with its own: [(case, signals), ...]."
MIN_RESAMPLES = 40  # of the bootstrap

Experiments = Case | Sequence[tuple[Case, Signal | Sequence[Signal]]]
"""A case, or pairs of a case and its signals."""


def fit(
    case: Experiments,
    signals: Signal | Sequence[Signal] | None = None,
    parameters: Mapping[str, tuple[float, float]] | None = None,
    *,
    gain: Setting = "fixed",
    offset: Setting = "fixed",
    shift: Setting = "fixed",
    loss: str = "linear",
    noise: str = "white",
    bandwidth: float | str = 0.0,
    intervals: str | Sequence[str] = JACOBIAN,
    resamples: int = 500,
    seed: int = 0,
) -> Fit:
    """Return a case whose numbers are fitted to measured signals.

    Parameters
    ----------
    case : Case, or sequence of pairs (Case, signals)
        The case, with the method that solves it; its own values are the start. Of several experiments each case with
        its signals: their numbers are fitted together, and start at the values of the first.
    signals : Signal or sequence of Signal
        Measured signal of the case. A sample is the mean over its sampling interval.
    parameters : mapping
        Dotted path of each number that is fitted, to its lower and upper bound in SI units or as texts.
    gain, offset, shift : number, text, pair or str
        Of the instruments whose signal has none of its own: the number where it is known, ``(lower, upper)`` or
        ``free`` where it is fitted, ``fixed`` for a gain of 1, an offset of 0 and a shift of 0: its clock starts with
        the run. A shift may be ``common``: one that is fitted, of all signals of a case.
    loss : str
        ``linear`` for least squares; ``huber`` where single samples may be far off.
    noise : str
        ``white``; ``ar1`` where neighbouring samples err alike; ``std`` where each has a standard deviation.
    bandwidth : float or str
        Frequency [Hz, or a text as 100 kHz] of a low-pass of data and model alike, 3 dB down there; 0 for none.
    intervals : str or sequence of str
        Intervals beside those from the derivatives: ``profile`` (likelihood), ``bootstrap`` (in blocks), or both.
    resamples : int
        Number of fits of the bootstrap, each to signals with residuals that are drawn again.
    seed : int
        Seed of the random numbers of the bootstrap.

    Raises
    ------
    CaseError
        If a path, bound, signal or channel is wrong, before the first fit.
    """
    problem = fit_problem(
        case, signals, parameters, gain=gain, offset=offset, shift=shift, noise=noise, bandwidth=bandwidth
    )
    _allowed("loss", loss, ("linear", "huber"))
    kinds = [each.strip() for each in intervals.split(",")] if isinstance(intervals, str) else list(intervals)
    for kind in kinds:
        _allowed("intervals", kind, (JACOBIAN, PROFILE, BOOTSTRAP))
    if resamples < MIN_RESAMPLES:
        text = f"{resamples} resamples. Allowed: {MIN_RESAMPLES} or more, as percentiles need them"
        raise CaseError(text, remedy=f"Give resamples={MIN_RESAMPLES} or more.")
    expect_whole(seed, "seed", 0, MAX_SEED)
    chosen = Options(loss, noise, tuple(kinds), resamples, seed)
    return fit_with_intervals(problem, search(problem, chosen), chosen)


def fit_problem(
    case: Experiments,
    signals: Signal | Sequence[Signal] | None = None,
    parameters: Mapping[str, tuple[float, float]] | None = None,
    *,
    gain: Setting = "fixed",
    offset: Setting = "fixed",
    shift: Setting = "fixed",
    noise: str = "white",
    bandwidth: float | str = 0.0,
) -> Problem:
    """Return the residuals of a fit, for another program to minimise or sample.

    Parameters are those of `fit`. ``problem.start()`` are its unknowns (logarithms of positive parameters),
    ``problem.bounds()`` their bounds, ``problem.residuals(x)`` the residuals (samples,) in standard deviations of the
    signal, or of the samples under ``noise="std"``, ``problem.jacobian(x)`` their derivatives, ``problem.values(x)``
    the numbers in SI and ``problem.cases(x)`` the cases with them. The names of the unknowns are ``each.path for each
    in problem.unknowns``.
    """
    _allowed("noise", noise, ("white", "ar1", "std"))
    given = {"gain": gain, "offset": offset, "shift": shift}
    if parameters is not None and not isinstance(parameters, Mapping):
        text = f"{shown(parameters)} is given where paths with their bounds are needed"
        raise CaseError(text, remedy="Write parameters={'bodies.hammer.mass': (1.0, 3.0)}.")
    return Problem(_experiments(case, signals), parameters or {}, given, noise, frequency(bandwidth))


def _experiments(case: Experiments, signals: Signal | Sequence[Signal] | None) -> list[Experiment]:
    if isinstance(case, (str, Path, Mapping)) or not isinstance(case, Iterable):
        expect_case(case, "fit")
    pairs = [(case, signals if signals is not None else [])] if isinstance(case, Case) else [*case]
    if not isinstance(case, Case) and signals is not None:
        raise CaseError("signals are given twice: beside the experiments, which have their own", remedy=PAIRS)
    if not pairs:
        raise CaseError("no experiment to fit", remedy="Give at least one case with its signals.")
    for each in pairs:
        if not isinstance(each, (tuple, list)) or len(each) != 2:
            raise CaseError(f"{shown(each)} is given where a case with its signals is needed", remedy=PAIRS)
        expect_case(each[0], "fit")
    return [Experiment(of, [*own] if isinstance(own, Iterable) else [own]) for of, own in pairs]


def _allowed(name: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise CaseError(
            f"{shown(value)} is not allowed.{closest(str(value), allowed)}",
            path=name,
            remedy=f"Allowed: {', '.join(allowed)}.",
        )
