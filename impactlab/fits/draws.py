"""Draws numbers of a fit from the normal distribution of their covariance, for predictions by a sweep."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from impactlab.errors import MAX_SEED, ImpactlabError, expect_whole
from impactlab.types import Array

if TYPE_CHECKING:
    from impactlab.fits.result import Fit

NORMAL = 1.959964  # half of a 95 % interval of the normal distribution over its standard deviation
MAX_DRAWS = 1_000_000
WRITTEN = 400  # rows of a file: percentiles of 2.5 % are of ten rows on either side


def undetermined(fit: Fit) -> list[str]:
    """Return the fitted numbers of the case whose intervals are infinite on both sides."""
    return [each.path for each in fit.parameters
            if " of " not in each.path and each.lower in (0.0, -math.inf) and each.upper == math.inf]  # fmt: skip


def draws(fit: Fit, count: int, seed: int) -> dict[str, Array]:
    """Return values of the fitted numbers of the case, (count,) each, by path; see `Fit.draws`."""
    expect_whole(count, "count", 1, MAX_DRAWS)
    expect_whole(seed, "seed", 0, MAX_SEED)
    if unknown := undetermined(fit):
        raise ImpactlabError(
            f"the signals do not determine {' and '.join(unknown)}: there is no distribution to draw from",
            remedy="Fix the numbers that you know, or measure another channel; then fit again.",
        )
    middle = np.array([each.scaled(row.value) for each, row in zip(fit.unknowns, fit.parameters, strict=True)])
    drawn = np.random.default_rng(seed).multivariate_normal(
        middle, fit.covariance * (fit.reach / NORMAL) ** 2, size=count, method="svd"
    )
    return {
        each.path: np.array([each.value(scaled) for scaled in drawn[:, number].tolist()])
        for number, each in enumerate(fit.unknowns)
        if " of " not in each.path  # gain, offset and shift are the instruments'
    }


def write_points(path: Path, points: Mapping[str, Array], units: Mapping[str, str]) -> None:
    """Write points as a file for ``impactlab sweep --points``."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        rows = csv.writer(stream, lineterminator="\n")
        rows.writerow([f"{name} [{units[name]}]" for name in points])
        rows.writerows(zip(*(values.tolist() for values in points.values()), strict=True))
