"""Bootstrap of a fit: blocks of residuals are drawn again, and each set is fitted from the solution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from impactlab.fits.loss import AT_BOUND, Loss
from impactlab.types import Array

PERCENT = (2.5, 97.5)
TOLERANCE = 1.0e-5  # of the loss: some hundredths of a standard deviation of an unknown


class Bootstrap(NamedTuple):
    """Solutions of resampled signals."""

    solutions: Array  # (resamples, n), scaled
    blocks: tuple[int, ...]  # samples of a block, of each signal
    seed: int

    def interval(self, number: int, loss: Loss) -> tuple[float, float]:
        """Return the 2.5 % and the 97.5 % percentile of an unknown.

        An end is infinite where resamples end at the bound there.
        """
        low, high = np.percentile(self.solutions[:, number], PERCENT).tolist()
        near = AT_BOUND * float(loss.widths[number])
        return (
            low if low > loss.low[number] + near else -math.inf,
            high if high < loss.high[number] - near else math.inf,
        )


def autocorrelations(values: Array, lags: int) -> Array:
    """Return the autocorrelation of values at lags 0 to ``lags``, (lags + 1,)."""
    moved = values - values.mean()
    whole = float(moved @ moved) or 1.0
    return np.array([float(moved[lag:] @ moved[: len(moved) - lag]) / whole for lag in range(lags + 1)])


def block_length(values: Array) -> int:
    """Return the length of blocks that suits the autocorrelation of values, at least 1 sample.

    The rule of Politis and White, Econometric Reviews 23 (2004) 53, with the correction of 2009, for circular blocks:
    the flat-top window is as wide as twice the lag beyond which the autocorrelation is that of white noise.
    """
    count = len(values)
    quiet = max(5, round(math.sqrt(math.log10(count))))
    most = min(count // 2, math.ceil(math.sqrt(count)) + quiet)
    found = autocorrelations(values, most)
    large = np.flatnonzero(np.abs(found[1:]) > 2.0 * math.sqrt(math.log10(count) / count))
    last = 0
    for lag in (large + 1).tolist():  # the first one that `quiet` small ones follow
        if lag - last > quiet:
            break
        last = lag
    if not last:
        return 1
    lags = np.arange(1, min(2 * last, most) + 1)
    window = np.clip(2.0 * (1.0 - lags / (2.0 * last)), 0.0, 1.0)
    spectrum = 1.0 + 2.0 * float(np.sum(window * found[lags]))
    slope = 2.0 * float(np.sum(window * lags * found[lags]))
    if spectrum <= 1.0:  # residuals that alternate: blocks of them would narrow the intervals
        return 1
    length = (1.5 * slope**2 / spectrum**2 * count) ** (1.0 / 3.0)
    return int(min(max(1, round(length)), max(1, count // 3)))


def bootstrap(loss: Loss, solution: Array, lengths: Sequence[int], count: int, seed: int) -> Bootstrap:
    """Return fits of signals with resampled residuals.

    Residuals are drawn again, in blocks, from those at a solution.

    Parameters
    ----------
    lengths : sequence of int
        Residuals of each signal, in their order; blocks stay inside a signal.
    count : int
        Number of resamples.
    seed : int
        Of the random numbers (PCG64).
    """
    generator = np.random.default_rng(seed)
    base, slope = loss.residuals(solution), loss.jacobian(solution)
    lost = math.sqrt(len(base) / max(1, len(base) - len(solution)))  # by the fit itself
    parts = np.split(base, np.cumsum(lengths)[:-1])
    blocks = tuple(map(block_length, parts))
    middle = np.median if math.isfinite(loss.limit) else np.mean  # samples far off are no offset of all
    centred = [(part - middle(part)) * lost for part in parts]

    def fitted(drawn: Array) -> Array:
        again = replace(
            loss,
            residuals=lambda x: loss.residuals(x) + (drawn - base),
            jacobian=lambda x: slope if np.array_equal(x, solution) else loss.jacobian(x),
            tolerance=TOLERANCE,
        )
        return again.least(solution).x

    found = []
    for _ in range(count):
        parts = [_drawn(part, block, generator) for part, block in zip(centred, blocks, strict=True)]
        found.append(fitted(np.concatenate(parts)))
    return Bootstrap(np.array(found), blocks, seed)


def _drawn(values: Array, block: int, generator: np.random.Generator) -> Array:
    """Return as many values in blocks that start anywhere, with the beginning after the end."""
    starts = generator.integers(0, len(values), math.ceil(len(values) / block))
    return np.asarray(values[(starts[:, None] + np.arange(block)).ravel()[: len(values)] % len(values)])
