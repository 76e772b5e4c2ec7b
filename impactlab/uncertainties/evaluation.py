"""Estimates of all quantities from the points of a sweep beside linear ones, with warnings."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from impactlab.casefile import Case
from impactlab.derivatives.table import few
from impactlab.errors import ImpactlabError
from impactlab.sweeps import Sampled
from impactlab.sweeps.chunks import STATUSES
from impactlab.sweeps.plots import ENDED
from impactlab.sweeps.quantities import absent_words
from impactlab.sweeps.result import labels_in, unit_of
from impactlab.types import Array
from impactlab.uncertainties.design import MIN_SAMPLES, Design
from impactlab.uncertainties.distributions import Uncertain
from impactlab.uncertainties.edges import edges_within
from impactlab.uncertainties.linear import Linear, estimates, linear
from impactlab.uncertainties.records import Index, Share, Spread
from impactlab.uncertainties.result import Uncertainty
from impactlab.uncertainties.statistics import (
    deviation,
    estimate,
    needed_samples,
    percentile,
    probability,
    sobol_indices,
)

if TYPE_CHECKING:
    import xarray

COUNTED = "contacts"
MAX_RANGE = 0.5  # of the whole range of a number, that a region narrows it to
MAX_WORDS = 160  # characters of a reason


def evaluated(
    case: Case,
    made: Design,
    data: xarray.Dataset,
    quantities: Sequence[str | Sampled],
    percents: tuple[float, ...],
    *,
    leave_out: bool,
) -> Uncertainty:
    """Return the estimates of a complete sweep.

    ``leave_out`` leaves points without values out of the indices.
    """
    uncertain, ended = made.uncertain, np.isin(data["status"].values, ENDED)
    warnings = [] if ended.all() else [failed_words(data, ended, uncertain)]
    slopes, lines = linear(case, uncertain, quantities), dict[tuple[str, str], Linear]()
    if isinstance(slopes, ImpactlabError):
        warnings.append(f"No linear estimate: {slopes.text}.")
    else:
        lines = estimates(slopes, uncertain)
        warnings += [edge.words for edge in edges_within(case, uncertain, slopes)]
    shares = _shares(data, made)
    spreads, found, lacking = [], list[Index](), list[str]()
    absent, withheld, sided = (dict[str, list[str]]() for _ in range(3))  # names by the reason
    for name in [each.channel if isinstance(each, Sampled) else each for each in quantities]:
        if not data[name].size:
            absent.setdefault(absent_words(str(data[name].dims[-1])), []).append(name)
        for label, values in _values(data, name, made):
            line = lines.get((name, label), Linear())
            spread = _spread(name, label, data, values[0], percents, line)
            spreads.append(spread)
            if spread.samples < np.count_nonzero(ended[: made.samples]):
                lacking.append(spread.name)
            if line.reason:
                withheld.setdefault(line.reason, []).append(spread.name)
            if line.one_sided:
                sided.setdefault(line.one_sided, []).append(spread.name)
            if made.shape[0] > 1:
                found += _indices(spread, values, uncertain, line, leave_out=leave_out)
    warnings += [f"No value of {few(names)}: {reason}." for reason, names in absent.items()]
    warnings += [f"No linear estimate of {few(names)}: {reason}." for reason, names in withheld.items()]
    text = "holds on one side of the means alone"
    warnings += [f"The linear estimate of {few(names)} {text}: {words}." for words, names in sided.items()]
    warnings += _open_words(spreads, percents, made.samples)
    if lacking:
        warnings.append(f"No value at some samples: {few(lacking)}. Estimates are those of the other samples.")
    if any(math.isnan(each.total.value) for each in found) and (lacking or not ended.all()) and not leave_out:
        text = "Points without values stop the Sobol indices."
        warnings.append(f"{text} To leave them out: failed='leave_out', or --failed leave_out.")
    return Uncertainty(
        case=case.label,
        uncertain=uncertain,
        samples=made.samples,
        seed=made.seed,
        percents=percents,
        spreads=tuple(spreads),
        shares=tuple(shares),
        indices=tuple(found),
        warnings=tuple(warnings),
        data=data,
    )


def _open_words(spreads: Sequence[Spread], percents: Sequence[float], samples: int) -> list[str]:
    """Return sentences on percentiles with open intervals, and the samples they need.

    As many of these are taken to fail, in proportion, as of those of this evaluation.
    """
    words = []
    for number, percent in enumerate(percents):
        is_open = [each for each in spreads if each.samples and math.isinf(each.percentiles[number].error)]
        names = [each.name for each in is_open]
        if names:
            least, fewest = needed_samples(percent), min(each.samples for each in is_open)
            needed = max(MIN_SAMPLES, 1 << (math.ceil(least * samples / fewest) - 1).bit_length())
            words.append(
                f"The {percent:g} % percentile of {few(names)} has an interval that is open at an end: a closed one "
                f"takes {least:,} samples with a value, and there are fewer. Give --samples {needed} or more."
            )
    return words


def _values(data: xarray.Dataset, name: str, made: Design) -> list[tuple[str, Array]]:
    """Return label and values, (blocks, scramblings, points), of each value of a quantity."""
    values = data[name].transpose("point", ...).values.reshape(*made.shape, -1)
    return [(label, values[..., number]) for number, label in enumerate(labels_in(data[name], ["point"]))]


def _spread(
    name: str, label: str, data: xarray.Dataset, values: Array, percents: tuple[float, ...], line: Linear
) -> Spread:
    sets = [each[np.isfinite(each)] for each in values]
    return Spread(
        quantity=name,
        label=label,
        unit=unit_of(data[name]),
        samples=sum(each.size for each in sets),
        mean=estimate(lambda of: float(np.mean(of)), sets),
        deviation=deviation(sets),
        percentiles=tuple(percentile(percent, sets) for percent in percents),
        linear_mean=line.mean,
        linear_deviation=line.deviation,
    )


def _shares(data: xarray.Dataset, made: Design) -> list[Share]:
    """Return the probability of each number of periods of contact."""
    found = []
    for label, values in _values(data, COUNTED, made):
        sets = [each[np.isfinite(each)] for each in values[0]]
        for number in np.unique(np.concatenate(sets)).tolist():
            found.append(Share(label, int(number), probability([each == number for each in sets])))
    return found


def _indices(
    spread: Spread, values: Array, uncertain: Sequence[Uncertain], line: Linear, *, leave_out: bool
) -> list[Index]:
    """Return the Sobol indices of a value by each number.

    They are not known where points are missing, unless these are left out.
    """
    known: NDArray[np.bool_] = np.asarray(np.isfinite(values).all(axis=0))
    sets = [values[:, k, known[k]] for k in range(values.shape[1])] if known.all() or leave_out else []
    blocks = sets or [np.full((len(values), 1), np.nan)]
    return [
        Index(spread.quantity, spread.label, each.path, first, total, line.shares.get(each.path, math.nan))
        for each, (first, total) in zip(uncertain, sobol_indices(blocks), strict=True)
    ]


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
