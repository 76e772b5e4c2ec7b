"""Failed points of an uncertainty: how many, in which part of the ranges, and why."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from impactlab.sweeps.chunks import STATUSES
from impactlab.uncertainties.distributions import Uncertain

if TYPE_CHECKING:
    import xarray

MAX_RANGE = 0.5  # of the whole range of a number, that a region narrows it to
MAX_WORDS = 160  # characters of a reason


def failed_words(data: xarray.Dataset, ended: NDArray[np.bool_], uncertain: Sequence[Uncertain]) -> str:
    """Return how many points of a sweep failed, where, and the first reason."""
    names = ", ".join(sorted({STATUSES[status] for status in data["status"].values[~ended].tolist()}))
    reason = next((text for text in data["reason"].values[~ended].tolist() if text), "")
    reason = textwrap.shorten(reason, MAX_WORDS, placeholder=" ...")
    count = f"{np.count_nonzero(~ended):,} of {ended.size:,} points have no values ({names})"
    text = f"{count}, {where(data, ~ended, uncertain)}"
    return f"{text}. The first: {reason}" if reason else f"{text}."


def where(data: xarray.Dataset, marked: NDArray[np.bool_], uncertain: Sequence[Uncertain]) -> str:
    """Return the part of the ranges of the numbers in which marked points lie."""
    words = []
    for each in uncertain:
        values = data[each.path].values
        low, high, others = values[marked].min(), values[marked].max(), values[~marked]
        if others.size and high < others.min():
            words.append(f"{each.path} below {others.min():.4g} {each.unit}")
        elif others.size and low > others.max():
            words.append(f"{each.path} above {others.max():.4g} {each.unit}")
        elif high - low < MAX_RANGE * np.ptp(values):
            words.append(f"{each.path} from {low:.4g} to {high:.4g} {each.unit}")
    found = " and ".join(word.removesuffix(" 1").rstrip() for word in words)
    return f"all with {found}" if found else "spread over the whole ranges"
