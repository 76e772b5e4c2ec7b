"""Linear estimate of an uncertainty: values and derivatives at the means, and variances carried over."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from impactlab.casefile import Case
from impactlab.derivatives import Sensitivities, Sensitivity, sensitivities
from impactlab.errors import ImpactlabError
from impactlab.sweeps.sampled import Sampled, extreme_in
from impactlab.uncertainties.distributions import Uncertain


class Linear(NamedTuple):
    """The linear estimate of a quantity; NaN where there is none."""

    mean: float = math.nan
    deviation: float = math.nan
    shares: Mapping[str, float] = {}  # of the variance, by path
    reason: str = ""  # why there is none
    one_sided: str = ""  # the derivatives of it that hold on one side alone, in words


def at_means(case: Case, uncertain: Sequence[Uncertain]) -> Case:
    """Return the case with each number at its mean."""
    return case.with_settings([(each.path, each.mean) for each in uncertain], by="the means")


def linear(
    case: Case, uncertain: Sequence[Uncertain], quantities: Sequence[str | Sampled]
) -> Sensitivities | ImpactlabError:
    """Return the sensitivities at the means, or why there are none.

    Extremes over all places of a rod have none, and do not hide those of others.
    """
    usual = [each for each in quantities if not (isinstance(each, str) and _is_along(case, each))]
    try:
        return sensitivities(at_means(case, uncertain), [each.path for each in uncertain], usual or quantities)
    except ImpactlabError as error:
        return error


def _is_along(case: Case, name: str) -> bool:
    """Return whether a quantity is an extreme over all places of a rod."""
    extreme = extreme_in(name)
    return extreme is not None and extreme.along(case.scene()) is not None


def estimates(found: Sensitivities, uncertain: Sequence[Uncertain]) -> dict[tuple[str, str], Linear]:
    """Return the linear estimate of each quantity and label."""
    rows: dict[tuple[str, str], list[Sensitivity]] = {}
    for row in found:
        rows.setdefault((row.quantity, row.label), []).append(row)
    return {key: _of(own, uncertain) for key, own in rows.items()}


def _of(rows: Sequence[Sensitivity], uncertain: Sequence[Uncertain]) -> Linear:
    slopes = {row.parameter: row.derivative for row in rows}
    parts = {each.path: (slopes[each.path] * each.deviation) ** 2 for each in uncertain}
    variance = sum(parts.values())
    shares = {path: part / variance if variance > 0.0 else math.nan for path, part in parts.items()}
    reason = next((row.reason for row in rows if math.isnan(row.derivative) and row.reason), "")
    sided = [f"{row.parameter}: {row.reason}" for row in rows if not math.isnan(row.derivative) and row.reason]
    return Linear(rows[0].value, math.sqrt(variance), shares, reason, "" if reason else "; ".join(sided))
