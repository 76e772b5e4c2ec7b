"""Convergence study: one description at rising fineness, its error from three levels by Richardson extrapolation.

The declared order is an upper bound: a lower one is assumed where the levels show it, and each of the three pairs of
levels gives an estimate of its own. Ratios of fineness near the golden section keep steps and elements of the levels
from being multiples of each other, so that touches and fronts fall at other places within a step in each of them.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from impactlab.history.base import AbstractHistory
from impactlab.refine import trial
from impactlab.refine.descriptions.description import MIN_ORDER_SHARE, Description
from impactlab.refine.trial import Check, no_check
from impactlab.scene.method import Simulation
from impactlab.types import Progress

MAX_ORDER = 8.0  # largest order searched for
MAX_ORDER_RATIO = 1.25  # of the observed to the declared order, either way, up to which the order shows
SHOWN_SAFETY = 1.6  # factor on an estimate where the order shows; Roache1998 takes 1.25, docs/audit.md needs more

Pairs = Mapping[tuple[int, int], float]
"""Relative distances of levels in one quantity, by their places in a sequence of rising fineness."""


class Distance(NamedTuple):
    """One quantity of several runs: its name and the distances between them."""

    of: str
    pairs: Pairs


class Estimate(NamedTuple):
    """Error of the finest level, and the order it was estimated with."""

    error: float
    order: float
    shown: bool = False  # whether the declared order shows

    def with_safety(self, safety: float) -> float:
        """Return the error times a safety factor, `SHOWN_SAFETY` where the order shows."""
        return self.error * (min(safety, SHOWN_SAFETY) if self.shown else safety)


@dataclass
class Level:
    """One run of a study."""

    fineness: int
    history: AbstractHistory
    error: float = math.inf  # estimate times safety; inf where none is known
    worst: str = ""  # quantity that this error is of, for people
    reason: str = ""  # against taking it, for people
    run_s: float = 0.0  # set-up and checks included, as if it were run alone
    made: Simulation | None = None  # that was run
    check: Check = no_check  # of its balances, left to be called
    gain: float = 0.0  # of the reference energy, once it was checked
    alone: bool = False  # whether its own records state its error
    by_steps: float = math.inf  # error by its steps, that its own records state


class Reach(NamedTuple):
    """Fineness and error of a description's finest run, and the fineness needed.

    The order is the declared one, or the lower one that its runs show.
    """

    fineness: int  # of the finest run
    error: float  # estimated error of that run
    order: float  # with which it falls
    needed: float  # fineness that the tolerance needs


@dataclass
class Study:
    """A description with its levels so far, and the fineness of the next one."""

    description: Description
    next: int
    levels: list[Level] = field(default_factory=list)  # by rising fineness
    closed: str = ""  # why no level follows, for people
    out_of_reach: bool = False  # whether it was closed as it cannot keep the tolerance within the budget
    wanted: int = 0  # fineness that the tolerance is predicted to need, where the next level is coarser
    falling: dict[int, float] = field(default_factory=dict)  # estimated errors by fineness, each when it was the finest
    reach: Reach | None = None  # None as long as nothing is known
    magnified: float = 1.0  # by which touches magnify an error
    takes_two: bool = False  # whether a first run has not stated its error by itself
    failures: int = 0  # levels that ended as failed
    order_share: float = MIN_ORDER_SHARE  # of the declared order, that the estimate from two levels assumed
    first: Level | None = None  # whose set-up serves those that differ in their step alone

    @property
    def seconds(self) -> float:
        """Predicted time of solving the next level [s]."""
        return self.description.seconds(self.next)

    @property
    def expected(self) -> int:
        """Predicted fineness of a run that keeps the tolerance."""
        needed = self.wanted if self.reach is None else math.ceil(min(self.reach.needed, 1e9))
        least = self.next if self.levels else self.description.coarser(self.next)[0]  # of the first two it may do
        return min(max(least, needed), self.description.max_fineness)

    @property
    def expected_s(self) -> float:
        """Predicted time of solving a run that keeps the tolerance [s]."""
        return self.description.seconds(self.expected)

    def beside(self, level: Level) -> Level | None:
        """Return the other level whose fineness is nearest; None where there is no other."""
        others = [each for each in self.levels if each is not level]
        return min(others, key=lambda each: abs(each.fineness - level.fineness), default=None)

    def run(self, fineness: int, progress: Progress | None = None, checked: bool = True) -> Level:
        """Run a level; raises `CaseError`, `PairingError` or `StepError` as a run does.

        Balances are not looked at unless it is to be ``checked``.
        """
        began = clock.perf_counter()
        made = Simulation(*self.description.simulation(fineness))
        begun = self.description.begun
        begun = None if begun is None or begun.used else begun  # a march goes on once
        like = (made if self.first is None else self.first.made) if self.description.same_bodies else None
        history, check = trial.run(made, progress, begun, like)
        if checked:
            check()
        level = Level(fineness, history, made=made, check=no_check if checked else check)
        level.run_s = clock.perf_counter() - began + (begun.setup_s + begun.march_s if begun else 0.0)
        if self.first is None:
            self.first = level
        elif self.description.same_bodies:  # alone it would have been set up as the first one
            level.run_s += max(self.first.history.cost.setup_s - history.cost.setup_s, 0.0)
        self.levels.append(level)
        self.levels.sort(key=lambda each: each.fineness)
        return level


def finest_error(pairs: Pairs, fineness: Sequence[float], order: float) -> Estimate:
    """Estimate the error of the finest of three or more levels in one quantity.

    Parameters
    ----------
    pairs : mapping
        Distances of the levels, all in the same relative unit.
    fineness : sequence of float
        Of the levels, rising.
    order : float
        Declared order of convergence, an upper bound of the order used.

    Returns
    -------
    Estimate
        The largest estimate by the pairs of the last three levels, inf where differences do not shrink. An order shows
        where it does in all neighbouring levels: one that shows in some and not in others shows by luck.

    References
    ----------
    Roache1998 (grid convergence index: three grids, observed order of convergence).
    """
    estimates = [_of_three(pairs, i, fineness[i : i + 3], order) for i in range(len(fineness) - 2)]
    return estimates[-1]._replace(shown=all(estimate.shown for estimate in estimates))


def error_of_two(distance: float, coarse: float, fine: float, order: float, share: float = MIN_ORDER_SHARE) -> float:
    """Return the error of the finer of two levels.

    It follows from the lowest order that an estimate assumes.

    Parameters
    ----------
    distance : float
        Of the two levels in one quantity.
    coarse, fine : float
        Their fineness.
    order : float
        Declared order of convergence.
    share : float
        Of the declared order, that is assumed.
    """
    return distance / (math.pow(fine / coarse, share * order) - 1.0)


def _of_three(pairs: Pairs, first: int, fineness: Sequence[float], order: float) -> Estimate:
    coarse_middle, coarse_fine = pairs[first, first + 1], pairs[first, first + 2]
    middle_fine = pairs[first + 1, first + 2]
    if not math.isfinite(coarse_middle + coarse_fine + middle_fine):
        return Estimate(math.inf, MIN_ORDER_SHARE * order)
    coarse, fine = fineness[2] / fineness[0], fineness[2] / fineness[1]
    observed = observed_order(coarse_fine / max(middle_fine, 1e-300), coarse, fine)
    p = min(order, max(MIN_ORDER_SHARE * order, observed))
    error = max(coarse_fine / (coarse**p - 1.0), middle_fine / (fine**p - 1.0), coarse_middle / (coarse**p - fine**p))
    return Estimate(error, p, order / MAX_ORDER_RATIO <= observed <= order * MAX_ORDER_RATIO)


def observed_order(ratio: float, coarse: float, fine: float) -> float:
    """Return the order p of errors C n^-p from distances to the finest level.

    Parameters
    ----------
    ratio : float
        Distance of the coarse level over that of the middle one.
    coarse, fine : float
        Fineness of the finest level over that of the coarse and of the middle one.

    Returns
    -------
    float
        Root of (coarse^p - 1)/(fine^p - 1) = ratio, at most `MAX_ORDER`; 0 where there is none.
    """
    low, high = 0.0, MAX_ORDER
    for _ in range(40):
        p = 0.5 * (low + high)
        low, high = (p, high) if (coarse**p - 1.0) / (fine**p - 1.0) < ratio else (low, p)
    return low
