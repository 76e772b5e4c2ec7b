"""A description of a scene that one number refines, with its cost and error.

It also sets where its trials begin.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

from impactlab.exact.cost import StartedMarch
from impactlab.history.base import AbstractHistory
from impactlab.refine.descriptions import cost
from impactlab.refine.descriptions.cost import Cost
from impactlab.scene.method import Simulation

RATIO = 0.5 * (1.0 + math.sqrt(5.0))  # of fineness between neighbouring levels: no step is a multiple of another
TWO_LEVEL_SAFETY = 2.0  # factor, at least, on an estimate from two levels by half the order; Roache1998: 3 by the order
MIN_ORDER_SHARE = 0.5  # of the declared order: the least that an estimate assumes
SHORT_S = 3.5e-4  # s of predicted solving: shorter runs take less than another trial
MIN_GROWTH = 1.06  # of a fineness that is sought
MAX_SURE_COST = 1.25  # times the predicted cost of a short run, up to which it begins finer, so that two runs suffice
SURE_RATIO = 4.0  # of its error to one that needs three runs: two are extrapolated by half the order
START_MARGIN = 1.5  # on predicted errors, as that of peak forces (`impactlab.refine.errors.level_errors`)
MAX_FREE_COST = 1.4  # times the fixed cost of a run, up to which a finer start is taken at no price
LONG_ALONE_S = 1e-3  # s of predicted solving, from which a run that states its own error has a coarser one before it
COARSER_BEFORE = 2  # fineness of the longer run over that of the one before it


@dataclasses.dataclass(frozen=True)
class Description:
    """Model, integrator and step rule for a scene at any fineness."""

    name: str
    unit: str  # of the fineness; "" of the exact solver, which has none
    simulation: Callable[[int], Simulation]
    cost: Cost
    work: Callable[[int], tuple[float, float]]  # steps of a run, and the size of a step as its cost counts it
    reference_order: float = 0.0  # of displacements and impulses, at most; 0 where references do not use it
    per_level: int = 1  # fineness of a level of a reference over that of a mesh at the same level
    # Of the automatic choice alone:
    for_choice: bool = True
    error: Callable[[int], float] = lambda _n: math.inf  # predicted, relative
    order: float = 2.0  # of the error in the fineness, from below
    safety: float = 2.0  # factor on its estimated error
    min_fineness: int = 16  # coarser runs show no order yet
    max_fineness: int = 10_000_000
    multiple: int = 1  # that a fineness is of
    check: Callable[[int], Simulation] | None = None  # the same off the special step, where it has one
    check_error: Callable[[int], float] = lambda _n: 0.0  # of `check`, at most
    # Error that runs of neighbouring fineness have in common, at most; by a run, where there is one.
    unseen: Callable[[int, AbstractHistory | None], float] = lambda _n, _history: 0.0
    remedy: str = ""  # what lowers that error, for people: "a larger solve.records"
    # In its place where a run, and how much its touches magnify an error, show that to be large.
    otherwise: Callable[[AbstractHistory, float], Description] | None = None
    detail: Callable[[int], str] | None = None  # other settings of a fineness, in words
    finding: Callable[[int], float] = lambda _n: 0.0  # s, predicted, of modes of a mesh, which are found first
    alike: bool = False  # whether runs differ in their step alone, so that one set-up serves all
    own_steppers: bool = False  # the same, where each run has steppers and arrays of its own
    alone: float = math.inf  # error that one run states, over its predicted one; inf where two are needed
    resolves: int = 0  # least fineness at which such runs follow the fastest motion of their shapes
    begun: StartedMarch | None = None  # of the exact solver: its march over the first intervals

    @property
    def same_bodies(self) -> bool:
        """Whether runs share the bodies in their coordinates, and the checks of the scene."""
        return self.alike or self.own_steppers

    def words(self, fineness: int) -> str:
        """Return the description with its fineness, for people."""
        if not self.unit:
            return self.name
        detail = "" if self.detail is None else f", {self.detail(fineness)}"
        return f"{self.name}, {fineness} {self.unit}{detail}"

    def seconds(self, fineness: int) -> float:
        """Return the predicted time of solving [s]."""
        return self.cost.seconds(*self.work(fineness))

    def setup_s(self, *fineness: int) -> float:
        """Return the predicted time of setting up runs [s]."""
        if self.alike and fineness:
            return self.cost.setup_s + self.finding(fineness[0]) + (len(fineness) - 1) * cost.ALIKE_S
        return sum(self.cost.setup_s + self.finding(each) for each in fineness)

    def fineness_for(self, error: float, safety: float) -> int:
        """Return about the least fineness whose predicted error, times a safety, lies within an error."""
        fineness = self.min_fineness
        while (ratio := safety * self.error(fineness) / error) > 1.0 and fineness < self.max_fineness:
            grown = fineness * max(math.pow(ratio, 1.0 / self.order), MIN_GROWTH) if ratio < math.inf else 2 * fineness
            fineness = min(math.ceil(grown), self.max_fineness)
        return fineness

    def start_for(self, error: float) -> int:
        """Return the finer of the first two runs for an error.

        So fine that the coarser one is likely to keep it where another trial would take longer than the steps of the
        two: they are few, or another run has the same set-up. Else so fine that the finer one does by three runs.
        """

        def seconds(fineness: int) -> float:
            return self.seconds(self.coarser(fineness)[0])

        safety = START_MARGIN * self.stated_of_two()[0]
        needed = free = self.fineness_for(error, safety)
        needed_s = seconds(needed)
        if not self.alike and needed_s > SHORT_S:
            safety = self.safety
            needed = free = self.fineness_for(error, safety)
            needed_s = seconds(needed)
        if self.alike or needed_s <= SHORT_S:
            sure, most = self.fineness_for(error / SURE_RATIO, safety), MAX_SURE_COST * needed_s
            if seconds(sure) <= most:
                free = sure
            while free < sure and seconds(finer := free + max(1, free // 8)) <= most:
                free = finer
        while self.seconds(2 * free) <= MAX_FREE_COST * cost.FIXED_S and free < self.max_fineness:
            free *= 2
        return self.whole(max(needed, free))

    def first_alone(self, error: float) -> int:
        """Return the fineness of a first run that states its own error.

        It is 0 where no run does. Where that run is predicted to be long, a coarser one is tried first: it may show
        that a several times smaller fineness is enough.
        """
        if math.isinf(self.alone):
            return 0
        needed = self.whole(min(max(self.fineness_for(error, self.alone), self.resolves), self.max_fineness))
        if self.seconds(needed) <= LONG_ALONE_S:
            return needed
        return self.whole(max(needed // COARSER_BEFORE, self.resolves, self.min_fineness))

    def wanted_of(self, start: int, error: float) -> int:
        """Return which of the first two runs is predicted to keep an error.

        It is the coarser one if that does, else ``start``.
        """
        coarser = self.coarser(start)[0]
        return coarser if self.stated_of_two()[1] * self.error(coarser) <= error else start

    def stated_of_two(self) -> tuple[float, float]:
        """Return the stated error of the coarser of two first runs, as ratios.

        They are over the error of the finer run and over its own.
        """
        shrinks = RATIO ** (2.0 * self.order)  # of the error from the coarser run to the finer one
        safety = max(self.safety, TWO_LEVEL_SAFETY)
        stated = shrinks - 1.0 + safety * (shrinks - 1.0) / (math.pow(shrinks, MIN_ORDER_SHARE) - 1.0)
        return stated, stated / shrinks

    def coarser(self, fineness: int) -> tuple[int, int]:
        """Return two lower values of fineness, rising, by the golden section."""
        multiple, least = self.multiple, self.min_fineness
        second = -(-max(round(fineness / RATIO), least // 2 + 1) // multiple) * multiple  # as `whole`
        first = -(-max(round(second / RATIO), least // 3) // multiple) * multiple
        return (first, second) if first < second else (second, self.whole(second + 1))

    def whole(self, fineness: int) -> int:
        """Return the next fineness that the description may have."""
        return -(-fineness // self.multiple) * self.multiple
