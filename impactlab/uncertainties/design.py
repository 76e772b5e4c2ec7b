"""Points of an uncertainty: independently scrambled Sobol points, and those of Saltelli's design for indices."""

from __future__ import annotations

import json
import numbers as kinds
from typing import NamedTuple

import numpy as np

from impactlab.errors import MAX_SEED, CaseError, expect_whole
from impactlab.sweeps import axes
from impactlab.sweeps.axes import Axis, Points
from impactlab.types import Array
from impactlab.uncertainties.distributions import Uncertain

SCRAMBLINGS = 16
"""Independent sets of Sobol points, whose scatter is the sampling error: 15 degrees of freedom widen it by 9 %."""
MIN_SAMPLES = 4 * SCRAMBLINGS
CELL = 0.5**30  # width of the smallest interval that a Sobol point of 30 bits stands for


class Design(NamedTuple):
    """Points of an uncertainty, block by block.

    They are samples, and with indices those that Saltelli's design adds. Block 0 holds the samples A, block 1 others,
    B, and each further block A with one number taken from B.
    """

    uncertain: tuple[Uncertain, ...]
    seed: int
    points: Points
    shape: tuple[int, int, int]  # blocks, scramblings, points of each

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.shape[1] * self.shape[2]


def check_samples(samples: int, seed: int) -> None:
    """Raise `CaseError` unless samples are a power of two and the seed whole."""
    if isinstance(samples, bool) or not isinstance(samples, kinds.Integral) or samples < MIN_SAMPLES:
        text = f"{samples} samples are too few"
        raise CaseError(text, path="--samples", remedy=f"Give at least {MIN_SAMPLES}, a power of two.")
    if samples & (samples - 1):
        below = 1 << (int(samples).bit_length() - 1)
        text = f"{samples} samples: Sobol points are balanced in sets of a power of two"
        raise CaseError(text, path="--samples", remedy=f"Give {max(below, MIN_SAMPLES)} or {2 * below}.")
    expect_whole(seed, "--seed", 0, MAX_SEED)


def design(uncertain: tuple[Uncertain, ...], samples: int, seed: int, *, indices: bool) -> Design:
    """Return the points of the samples, and with ``indices`` those of the Sobol indices.

    The samples themselves are the same with and without indices.

    Raises
    ------
    CaseError
        If there are too many points.
    """
    from scipy.stats import qmc

    size = len(uncertain)
    blocks = 2 + size if indices and size > 1 else 1
    if (count := blocks * samples) > axes.MAX_POINTS:
        text = f"{samples} samples of {size} numbers are {count:.3g} points; allowed: {axes.MAX_POINTS:.3g}"
        raise CaseError(text, path="--samples", remedy="Give fewer samples, or leave out the indices.")
    shape = (blocks, SCRAMBLINGS, samples // SCRAMBLINGS)
    chances = np.empty((*shape, size))
    for number, own in enumerate(np.random.SeedSequence(seed).spawn(SCRAMBLINGS)):
        drawn = qmc.Sobol(2 * size, scramble=True, seed=np.random.default_rng(own)).random(shape[2]) + 0.5 * CELL
        chances[:, number] = drawn[:, :size]
        if blocks > 1:
            chances[1, number] = drawn[:, size:]
            for k in range(size):
                chances[2 + k, number, :, k] = drawn[:, size + k]
    columns: list[Array] = [np.asarray(each.shape.ppf(chances[..., k])).ravel() for k, each in enumerate(uncertain)]
    made = []
    for each, column in zip(uncertain, columns, strict=True):
        values = tuple(column.astype(float).tolist())
        made.append(Axis(each.path, values, values, each.unit))
    about = {
        "samples": int(samples),
        "seed": int(seed),
        "scramblings": SCRAMBLINGS,
        "distributions": json.dumps({each.path: each.text for each in uncertain}),
    }
    return Design(uncertain, seed, Points(tuple(made), listed=True, design=about), shape)
