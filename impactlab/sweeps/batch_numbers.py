"""Axes of a sweep as entries of the vectors of numbers that a batch of exact runs marches."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from impactlab.casefile import Case
from impactlab.casefile.check import reference_rod
from impactlab.casefile.schema import RoundTrips
from impactlab.errors import ImpactlabError
from impactlab.scene.method import is_exact, laws_of, theories
from impactlab.startup.lazy import lazy
from impactlab.sweeps.axes import Axis, Points, at_point, spread
from impactlab.types import Array

if TYPE_CHECKING:
    from impactlab.exact.batch import marcher, pattern, points
else:  # compiled code, needed only where a batch starts
    marcher, points = lazy("impactlab.exact.batch.marcher"), lazy("impactlab.exact.batch.points")
    pattern = lazy("impactlab.exact.batch.pattern")

MAX_BUILT = 20_000  # values of an axis that are built one by one, a millisecond each
MAX_CORNERS = 16  # of a grid
INNER_POINTS = 4  # that are built beside the corners


class NotServed(Exception):  # noqa: N818 - a reason, no fault: the points are then runs of their own
    """The reason why a sweep is not computed as a batch."""


class BatchMismatch(NotServed):
    """Results of a batch and of a run differ: a fault of impactlab.

    Users should see it.
    """


class AxisEntries(NamedTuple):
    """An axis as entries of the vector."""

    entries: list[int]
    values: Array  # (values of the axis, entries)


def numbers_of(case: Case) -> marcher.Built:
    """Return pattern, vector and network of a case; raise `NotServed`, or its errors."""
    run = case.simulation()
    if run.method.tolerance is not None or not is_exact(*run) or any(theories(*run)):
        raise NotServed("the runs are not exact: some rods are not continuous, or some laws have no exact solution")
    if any(law.branches() is not None for law in laws_of(*run)):
        raise NotServed("laws that change their branch")
    if any(body.loads for body in run.scene.bodies.values()):
        raise NotServed("forces over time on ends")
    given, counted = case.checked.solve.duration, reference_rod(case.checked)
    trips = float(given.round_trips) if isinstance(given, RoundTrips) else None
    made = None if counted is None else marcher.built(run, counted, trips)
    if made is None:
        raise NotServed(pattern.misfit(run.scene) or "no rod")
    return made


def on_axis(case: Case, axis: Axis, others: Mapping[str, Any], base: marcher.Built) -> AxisEntries:
    """Return the entries of the vector that the values of an axis replace.

    An axis whose values are entries themselves, as masses are, is built at some of them; others at all. ``others`` are
    the settings of the other axes at which the vector of ``base`` holds.
    """
    si = np.array(axis.si, dtype=float)
    _, first, back = np.unique(si, return_index=True, return_inverse=True)
    distinct = si[first]

    def vectors(places: Sequence[int]) -> Array:
        made = [numbers_of(at_point(case, {**others, axis.path: axis.values[first[place]]})) for place in places]
        if not all(each.pattern.same_as(base.pattern) for each in made):
            raise NotServed(f"{axis.path} changes how bodies are connected")
        return np.array([each.vector for each in made])

    places = spread(distinct)
    found = vectors(places)
    entries = np.flatnonzero(np.any(found != base.vector, axis=0)).tolist()
    if np.array_equal(found[:, entries], np.repeat(distinct[places, None], len(entries), axis=1)):
        return AxisEntries(entries, np.repeat(si[:, None], len(entries), axis=1))
    if len(distinct) > MAX_BUILT:
        raise NotServed(
            f"{axis.path} has more than {MAX_BUILT} values, none of which is a number of the network itself"
        )
    found = vectors(range(len(distinct)))
    entries = np.flatnonzero(np.any(found != base.vector, axis=0)).tolist()
    return AxisEntries(entries, found[:, entries][back])


def over_all(case: Case, grid: Points, base: marcher.Built) -> points.Numbers:
    """Return the numbers of all points; raise `NotServed` where axes share a number."""
    axes = [on_axis(case, axis, grid.settings(0), base) for axis in grid.axes]
    entries = [entry for axis in axes for entry in axis.entries]
    if len(set(entries)) < len(entries):
        raise NotServed("two axes change one number of the network")
    shape = [len(axis.values) for axis in grid.axes]
    divisor = [1 if grid.listed else int(np.prod(shape[number + 1 :])) for number in range(len(shape))]
    ends = np.cumsum([0, *(axis.values.size for axis in axes)])
    return points.Numbers(
        base.vector,
        np.array(divisor, np.int64),
        np.array(shape, np.int64),
        np.cumsum([0, *(len(axis.entries) for axis in axes)]).astype(np.int64),
        np.array(entries, np.int64),
        ends[:-1].astype(np.int64),
        np.concatenate([axis.values.ravel() for axis in axes]),
    )


def within_limits(case: Case, grid: Points) -> tuple[Points, NDArray[np.bool_]]:
    """Return a sweep with medians for values that the case does not allow.

    The second result is True at the points that had one. Points by a design are not checked before: the case may refuse
    the tail of a distribution. It allows intervals of numbers, whose ends are found by bisection.
    """
    refused = np.zeros(grid.count, bool)
    if not grid.design:
        return grid, refused
    made = []
    for axis in grid.axes:
        order = np.argsort(np.array(axis.si, dtype=float), kind="stable").tolist()
        middle = len(order) // 2

        def allows(place: int, axis: Axis = axis, order: Sequence[int] = order) -> bool:
            try:
                at_point(case, {axis.path: axis.values[order[place]]}).resolved()
            except ImpactlabError:
                return False
            return True

        # place of the first value that is allowed, and of the last one
        first, last = (bisected(allows, middle, end) for end in (0, len(order) - 1))
        outside = [*order[:first], *order[last + 1 :]]
        refused[outside] = True
        values, si = list(axis.values), list(axis.si)
        for place in outside:
            values[place], si[place] = values[order[middle]], si[order[middle]]
        made.append(Axis(axis.path, tuple(values), tuple(si), axis.unit) if outside else axis)
    return Points(tuple(made), listed=True), refused


def bisected(allows: Callable[[int], bool], good: int, end: int) -> int:
    """Return the place next to ``end`` that is allowed, between a good one and that."""
    if allows(end):
        return end
    while abs(end - good) > 1:
        middle = (good + end) // 2
        good, end = (middle, end) if allows(middle) else (good, middle)
    return good


def corners(grid: Points) -> list[dict[str, Any]]:
    """Return the settings of the corners of a grid, up to `MAX_CORNERS`.

    Of listed points they are the corners of the box that holds them.
    """
    ends = []
    for axis in grid.axes:
        order = np.argsort(np.array(axis.si, dtype=float), kind="stable")
        ends.append([(axis.path, axis.values[place]) for place in dict.fromkeys((int(order[0]), int(order[-1])))])
    return [dict(each) for each in itertools.islice(itertools.product(*ends), MAX_CORNERS)]


def inner_points(count: int) -> list[int]:
    """Return the first point, the last one and some between, the same ones each time."""
    chosen = np.random.default_rng(0).integers(0, count, INNER_POINTS).tolist()
    return list(dict.fromkeys([0, count - 1, *chosen]))


def check_networks(case: Case, grid: Points, base: marcher.Built, march: marcher.Marcher) -> None:
    """Build corners and some points to compare networks; raise `NotServed` where one differs."""
    for settings in corners(grid):
        if not numbers_of(at_point(case, settings)).pattern.same_as(base.pattern):
            raise NotServed("a corner of the grid has bodies that are connected in another way")
    for number in inner_points(grid.count):
        wanted = numbers_of(grid.case(case, number))
        if not (wanted.pattern.same_as(base.pattern) and marcher.same_network(march.network(number), wanted.log)):
            raise NotServed(f"the network of point {number} is not the one that its numbers give")
