"""Batches of exact runs: points of a sweep in one compiled call.

They differ in numbers alone.

The network of the case is built once. Each axis is reduced to the entries of the vector of numbers that it replaces;
points are then written, marched and read in compiled code (`impactlab.exact.batch`), without the interpreter's lock. A
point that a batch cannot do is left to a run of its own.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from impactlab.casefile import Case
from impactlab.errors import ImpactlabError
from impactlab.plugins import QUANTITIES, Registry
from impactlab.scene.method import Simulation
from impactlab.startup.lazy import lazy
from impactlab.sweeps import quantities as ours
from impactlab.sweeps.axes import Points
from impactlab.sweeps.batch_numbers import (
    BatchMismatch,
    NotServed,
    check_networks,
    inner_points,
    numbers_of,
    over_all,
    within_limits,
)
from impactlab.sweeps.quantities import WantedQuantity
from impactlab.types import Array

if TYPE_CHECKING:
    from impactlab.exact.batch import marcher, points
    from impactlab.exact.batch.pattern import Pattern
else:  # compiled code, needed only where a batch starts
    marcher, points = lazy("impactlab.exact.batch.marcher"), lazy("impactlab.exact.batch.points")

LOG = logging.getLogger("impactlab")
MIN_POINTS = 250  # of a batch: fewer are run in the time that it takes to set up
TRIAL_POINTS = 2  # points that are also run on their own before the others
ROUNDING = 1e-12  # of a share, such as an energy gain
TRIED_TOL = 1e-9  # of the size of a quantity: a point that was tried may not differ by more

Values = Sequence[Sequence[float]]
"""Values of each quantity at a point."""


class BatchResults(NamedTuple):
    """Results of consecutive points."""

    first: int
    values: tuple[Array, ...]  # of each quantity (points, values at a point)
    served: NDArray[np.bool_]  # (points,), False where a run of its own is needed

    @property
    def left(self) -> list[int]:
        """Numbers of the points that need a run of their own."""
        return (self.first + np.flatnonzero(~self.served)).tolist()


class Batch:
    """The points of a sweep, ready to march."""

    def __init__(
        self,
        run: Simulation,
        grid: Points,
        base: marcher.Built,
        case: Case,
        wanted: Sequence[WantedQuantity],
        refused: NDArray[np.bool_],
    ) -> None:
        self.refused = refused  # (points,), by the case: left to runs of their own
        self.run, self.pattern, self.numbers = run, base.pattern, over_all(case, grid, base)
        self.count = grid.count
        self.results_wanted = sum({points.WANTED[each.name] for each in wanted if each.name in points.WANTED})
        self.columns = [columns_of(each, self.pattern) for each in wanted]
        self.seconds = 0.0  # of a point
        self._own = threading.local()

    @property
    def marcher(self) -> marcher.Marcher:
        """The memory of this thread."""
        if not hasattr(self._own, "marcher"):
            self._own.marcher = marcher.Marcher(self.run, self.pattern, self.numbers)
        made: marcher.Marcher = self._own.marcher
        return made

    def at(self, numbers: Sequence[int] | range) -> tuple[tuple[Array, ...], NDArray[np.bool_]]:
        """Return the values of each quantity at points, and which points have values."""
        table, states = self.marcher.results(np.array(numbers, np.int64), self.results_wanted)
        served = (states == points.SERVED) & ~self.refused[np.asarray(numbers)]
        table[~served] = np.nan
        return tuple(table[:, columns] for columns in self.columns), served

    def found(self, first: int, last: int) -> BatchResults:
        """Return the results of consecutive points."""
        return BatchResults(first, *self.at(range(first, last)))

    def chunks(self, firsts: Sequence[int], size: int, workers: int) -> Iterator[BatchResults]:
        """Yield the results of chunks of points, computed by ``workers`` threads.

        ``firsts`` are the first points of the chunks.
        """
        if workers < 2:
            for first in firsts:
                yield self.found(first, min(first + size, self.count))
            return
        waiting: deque[Future[BatchResults]] = deque()
        with ThreadPoolExecutor(workers) as pool:
            try:
                for first in firsts:
                    waiting.append(pool.submit(self.found, first, min(first + size, self.count)))
                    if len(waiting) > 2 * workers:
                        yield waiting.popleft().result()
                while waiting:
                    yield waiting.popleft().result()
            finally:
                for future in waiting:
                    future.cancel()


def batch_of(
    case: Case, grid: Points, wanted: Sequence[WantedQuantity], single: Callable[[int], Values | None]
) -> Batch | str:
    """Return the batch of a sweep, or why it has none.

    Parameters
    ----------
    single : callable
        Runs one point on its own: its number to the values of each quantity, None where it has none.
    """
    try:
        return _batch(case, grid, wanted, single)
    except BatchMismatch as reason:
        LOG.warning("each point is a run of its own, as %s: please report this fault of impactlab", reason)
        return str(reason)
    except NotServed as reason:
        return str(reason)
    except ImpactlabError as error:
        return f"the case is refused at a corner of the grid: {error.text}"


def _batch(case: Case, grid: Points, wanted: Sequence[WantedQuantity], single: Callable[[int], Values | None]) -> Batch:
    if grid.count < MIN_POINTS:
        raise NotServed(f"fewer than {MIN_POINTS} points")
    words = [axis.path for axis in grid.axes if not axis.is_numeric]
    if words:
        raise NotServed(f"{words[0]} holds words")
    others = [each.name for each in wanted if not is_ours(each, case.registry)]
    if others:
        raise NotServed(f"{others[0]} is a quantity of whole histories")
    grid, refused = within_limits(case, grid)
    first = grid.case(case, 0)
    base = numbers_of(first)
    batch = Batch(first.simulation(), grid, base, case, wanted, refused)
    check_networks(case, grid, base, batch.marcher)
    _try(batch, grid.count, wanted, single)
    return batch


def is_ours(each: WantedQuantity, registry: Registry) -> bool:
    """Return whether a quantity is one that a batch reads."""
    known = (*points.OF_CONTACT, *points.OF_PAIR, *points.OF_BODY, *points.OF_WHOLE)
    return each.name in known and registry.load(QUANTITIES, each.name) is getattr(ours, each.name)


def columns_of(each: WantedQuantity, pattern: Pattern) -> NDArray[np.int64]:
    """Return the columns of a quantity in the results of a point."""
    at = 0
    for names, count in marcher.parts_of(pattern):
        if each.name in names:
            return at + names.index(each.name) + len(names) * np.arange(count)
        at += len(names) * count
    raise KeyError(each.name)


def _try(batch: Batch, count: int, wanted: Sequence[WantedQuantity], single: Callable[[int], Values | None]) -> None:
    """Compare some points with runs, and time others; raise `BatchMismatch` where they differ."""
    chosen = inner_points(count)
    values, served = batch.at(chosen)
    if not served.any():
        raise NotServed("none of the points that were tried")
    for place in np.flatnonzero(served)[:TRIAL_POINTS].tolist():
        alone = single(chosen[place])
        if alone is None:
            raise NotServed(f"point {chosen[place]} has no values on its own")
        for each, table, own in zip(wanted, values, alone, strict=True):
            scale = float(np.max(np.abs(table[served]), initial=0.0, where=np.isfinite(table[served])))
            floor = TRIED_TOL * scale + (ROUNDING if each.unit == "1" else 0.0)
            if not np.allclose(table[place], own, rtol=TRIED_TOL, atol=floor, equal_nan=True):
                raise BatchMismatch(
                    f"{each.name} of point {chosen[place]} is {table[place]} in a batch, {own} in a run"
                )
    began = time.perf_counter()
    batch.at(chosen)
    batch.seconds = (time.perf_counter() - began) / len(chosen)
