"""Draws of fitted numbers from the normal distribution of their covariance, for sweeps that predict."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from impactlab.errors import MAX_SEED, expect_whole
from impactlab.fits.unknowns import Unknown, is_of_instrument
from impactlab.types import Array

NORMAL = 1.959964  # half of a 95 % interval of the normal distribution over its standard deviation
MAX_DRAWS = 1_000_000
WRITTEN = 400  # rows of a file: percentiles of 2.5 % are of ten rows on either side


def drawn(
    unknowns: Sequence[Unknown], values: Sequence[float], covariance: Array, count: int, seed: int
) -> dict[str, Array]:
    """Return values of the numbers of the case, (count,) each, by path.

    Parameters
    ----------
    unknowns : sequence
        Those of the fit, also of the instruments, which are drawn and left out.
    values : sequence
        Their values in SI, the middle of the distribution.
    covariance : array
        Of the scaled unknowns, (n, n).
    count : int
        Number of draws.
    seed : int
        Seed of the random numbers (PCG64).
    """
    expect_whole(count, "count", 1, MAX_DRAWS)
    expect_whole(seed, "seed", 0, MAX_SEED)
    middle = np.array([each.scaled(value) for each, value in zip(unknowns, values, strict=True)])
    found = np.random.default_rng(seed).multivariate_normal(middle, covariance, size=count, method="svd")
    return {
        each.path: np.array([each.value(scaled) for scaled in found[:, number].tolist()])
        for number, each in enumerate(unknowns)
        if not is_of_instrument(each.path)
    }


def write_points(path: Path, points: Mapping[str, Array], units: Mapping[str, str]) -> None:
    """Write points as a file for ``impactlab sweep --points``."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        rows = csv.writer(stream, lineterminator="\n")
        rows.writerow([f"{name} [{units[name]}]" for name in points])
        rows.writerows(zip(*(values.tolist() for values in points.values()), strict=True))
