"""Tolerances out of reach: the least cost, and the best within budget.

The least cost of keeping a tolerance follows from the declared order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from impactlab.errors import CaseError
from impactlab.refine.convergence import SHOWN_SAFETY, Level, Study
from impactlab.refine.descriptions.description import Description

MAX_SHARE = 0.6  # of a budget, of its last run: those before it take the rest


class Best(NamedTuple):
    """The least error that a description may have within a time."""

    words: str
    error: float
    seconds: float  # predicted


def in_common(description: Description) -> float:
    """Return the least error that all runs of a description have in common.

    It remains however fine the runs are, and is known before any run.
    """
    return description.unseen(description.max_fineness, None)


def reason_in_common(error: float) -> str:
    """Return why a description is not tried, for people."""
    return f"cannot keep the tolerance: all its runs have an error of {error:.2g} in common"


def needed_s(study: Study) -> float:
    """Return the least predicted solving time for the tolerance [s]; 0 if not known yet."""
    if study.reach is None:
        return 0.0
    return study.description.seconds(_whole(study, study.reach.needed))


def within(study: Study, seconds: float) -> Best:
    """Return the best that a study may reach within a time [s].

    All its runs solve for so long together. The order may not show, so that the estimate takes the safety of the
    description.
    """
    description, reach = study.description, study.reach
    assert reach is not None  # noqa: S101 - asked of studies out of reach alone
    low, high = reach.fineness, max(_whole(study, reach.needed), reach.fineness)
    while high - low > max(1, low // 50):
        middle = (low + high) // 2
        low, high = (
            (middle, high) if description.seconds(description.whole(middle)) <= MAX_SHARE * seconds else (low, middle)
        )
    low = min(description.whole(low), description.max_fineness)
    order = min(reach.order, description.order)  # a refusal allows for more, an offer does not
    error = max(1.0, description.safety / SHOWN_SAFETY) * reach.error * math.pow(reach.fineness / low, order)
    error += study.magnified * description.unseen(low, study.levels[-1].history if study.levels else None)
    return Best(description.words(low), error, description.seconds(low))


def reason(study: Study, seconds: float) -> str:
    """Return why a study ends, for people; ``seconds`` are left of the budget."""
    best = within(study, seconds)
    return (
        f"cannot keep the tolerance: it takes {needed_s(study):.2g} s of solving at least, and {seconds:.2g} s may be "
        f"spent; about {best.error:.2g} could be reached"
    )


def refusal(
    tolerance: float, studies: Sequence[Study], best: tuple[Study, Level] | None, seconds: float
) -> CaseError | None:
    """Return the error of a tolerance out of reach of all studies.

    Its text states the best that could be reached. None where no study ended for that reason; ``best`` is None where
    none could be run.
    """
    ended = [study for study in studies if study.out_of_reach]
    if not ended:
        return None
    found = [_promised(study, seconds) for study in ended]
    if best is not None:
        description, level = best[0].description, best[1]
        found.append(Best(description.words(level.fineness), level.error, description.seconds(level.fineness)))
    least = min(found, key=lambda each: each.error)
    budget = f" within {seconds:g} s of solving" if best is not None else ""
    others = [each for each in dict.fromkeys(study.description.remedy for study in ended) if each]
    return CaseError(
        f"no description keeps {tolerance:g}{budget}: the best that could be reached is about {least.error:.2g}, by "
        f"{least.words}",
        remedy=f"Give {', '.join([f'a tolerance of {_rounded_up(least.error):g} or more', *others])}, a shorter "
        "duration, or model, integrator and step of your own.",
        path="solve.tolerance",
    )


def _promised(study: Study, seconds: float) -> Best:
    """Return the best that a study may reach.

    A study that was not run has ended for the error that its runs share.
    """
    if study.reach is not None:
        return within(study, seconds)
    return Best(study.description.name, in_common(study.description), 0.0)


def _rounded_up(value: float) -> float:
    """Return the value with a margin of a half, its first digit rounded up."""
    scale = 10.0 ** math.floor(math.log10(1.5 * value))
    return math.ceil(1.5 * value / scale) * scale


def _whole(study: Study, fineness: float) -> int:
    description = study.description
    return description.whole(math.ceil(min(fineness, description.max_fineness)))
