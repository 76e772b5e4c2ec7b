"""Derivatives of exact runs by tangents or, where these do not hold, by differences of runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from impactlab import api
from impactlab.casefile import Case
from impactlab.derivatives.direct import Direct
from impactlab.derivatives.parameters import Parameter
from impactlab.derivatives.stencil import ROUNDING as MOVED_ROUNDING
from impactlab.derivatives.stencil import Slopes, slopes
from impactlab.derivatives.table import DIFFERENCES, TANGENT
from impactlab.errors import CaseError, ImpactlabError
from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.setup.build import build
from impactlab.exact.setup.network import Log, NetworkLayout
from impactlab.exact.tangents.edges import Edge, edges, passes_end
from impactlab.exact.tangents.moved import largest_step, moved
from impactlab.exact.tangents.numbers import rates
from impactlab.exact.tangents.run import Solved, solve
from impactlab.history.base import AbstractHistory
from impactlab.scene.method import Simulation
from impactlab.types import Array

WIDTH = 5.0e-4  # of a parameter: distance of two histories that are moved along tangents
ROUNDING = 1.0e-11  # of a derivative by a formula, or of the value over the parameter
RUN_WIDTH = 2.0e-3  # the same of two runs
RUN_ROUNDING = 1.0e-13  # of the values of a run
MIN_DISTANCE = 1.0e-9  # of the parameter: nearer to an edge tangents do not hold, and runs on either side are compared
MAX_APART = 1.0e-10  # of the way at the largest velocity: fronts that arrive together and part more slowly are one
RECHECK_TOL = 1.0e-6  # of a derivative: where its error is larger, runs closer by are compared
MAX_NARROWED, NARROWED = 4, 0.1  # how often, and by how much
SHARE = 0.15  # of the distance to an edge: distance of two runs


class Quantities(Protocol):
    """Values to be derived."""

    def __call__(self, history: AbstractHistory, /) -> Array:
        """Return the values of a run, (n,)."""

    def by_formulas(self, direct: Direct) -> Array:
        """Return the derivatives for which there are formulas, (n,), NaN of the others."""


class Derivatives(NamedTuple):
    """Derivatives by one parameter."""

    slopes: Slopes
    by: str  # tangent or differences
    edges: Sequence[Edge]
    of_runs: Slopes | None = None  # differences of runs, where those of histories along tangents are doubtful
    doubtful: NDArray[np.bool_] | None = None  # (values,), of which they are taken

    def at(self, number: int) -> tuple[tuple[float, float, float, float], bool, str]:
        """Return derivative, error and sides of a value, kink, and the method used."""
        slopes, by = self.slopes, self.by
        if self.of_runs is not None and self.doubtful is not None and self.doubtful[number]:
            slopes, by = self.of_runs, DIFFERENCES
        middle, error, below, above = (float(of[number]) for of in slopes[:4])
        return (middle, error, below, above), bool(slopes.kink[number]), by


class Network(NamedTuple):
    """Scene, layout and network of a case at one value of a parameter."""

    run: Simulation
    layout: NetworkLayout
    log: Log


def network(case: Case) -> Network:
    """Return the network of a case at t = 0."""
    run = case.simulation()
    return Network(Simulation(*run), *build(*run))


def solved_with(case: Case, parameters: Sequence[Parameter]) -> Solved:
    """Return the exact run of a case with its tangents by parameters."""
    base = network(case)
    if len(base.log.names):
        scene, method = base.run
        names = [contact.name for contact in scene.contacts if method.laws[contact.name].branches() is not None]
        raise CaseError(
            f"tangents are not available for laws that change their branch, as that of {', '.join(names)}",
            remedy="Take differences of runs.",
        )
    if base.log.junctions["loaded"].any():
        raise CaseError("tangents are not available for forces over time", remedy="Take differences of runs.")
    beside = [lambda value, of=each: network(of.case(case, value)).log for each in parameters]
    found = rates(base.log, beside, [each.value for each in parameters], [each.scale for each in parameters])
    return solve(lambda: build(*base.run), found)


def derivatives(
    case: Case, history: AbstractHistory, parameters: Sequence[Parameter], values: Quantities
) -> list[Derivatives]:
    """Return the derivatives of values of an exact run by each parameter."""
    base = values(history)
    try:
        solved = solved_with(case, parameters)
    except ImpactlabError:  # a network that changes beside the value: runs are compared
        return [
            Derivatives(_of_runs(case, each, values, base, history, np.inf), DIFFERENCES, ()) for each in parameters
        ]
    found = []
    for number, parameter in enumerate(parameters):
        near = edges(solved, number)
        least = MIN_DISTANCE * parameter.scale
        distance = min((abs(edge.distance) for edge in near if abs(edge.distance) >= least), default=np.inf)
        way = float(solved.log.state["fastest"]) * float(solved.log.state["duration"])
        at_edge = bool(near) and abs(near[0].distance) < least
        parts = solved.tangents.apart[number] * parameter.scale > MAX_APART * way
        if at_edge or parts or passes_end(solved, number):
            found.append(Derivatives(_of_runs(case, parameter, values, base, history, distance), DIFFERENCES, near))
            continue
        by_tangents, doubtful = _of_tangents(case, parameter, number, values, solved)
        by_runs = _of_runs(case, parameter, values, base, history, distance) if doubtful.any() else None
        found.append(Derivatives(by_tangents, TANGENT, near, by_runs, doubtful))
    return found


def _of_tangents(
    case: Case, parameter: Parameter, number: int, values: Quantities, solved: Solved
) -> tuple[Slopes, NDArray[np.bool_]]:
    """Return derivatives by formulas or moved histories, and which are doubtful.

    Histories are moved along tangents where there is no formula. Where fronts meet, one of which moves, a history that
    is moved may jump between them: a peak there has two derivatives, and only both of its sides show it. A front may
    pass the end of the run, too.
    """

    def beside(step: float) -> Array | None:
        try:
            there = network(parameter.case(case, parameter.value + step))
        except ImpactlabError:
            return None
        return values(moved(solved, number, step, *there))

    start = network(case)
    still = moved(solved, number, 0.0, *start)
    base = values(still)
    direct = values.by_formulas(Direct(solved, number, still))
    limit = largest_step(solved, number)
    width = min(WIDTH * abs(parameter.value) or limit / 40.0, limit / 3.0)
    if not np.isfinite(width):
        width = WIDTH * parameter.scale
    error = ROUNDING * np.maximum(np.abs(direct), np.abs(base) / parameter.scale)
    below, above = direct.copy(), direct.copy()
    if parameter.value == 0.0:  # one side may not be allowed, as a gap below zero
        for side, sign in ((below, -1.0), (above, 1.0)):
            if beside(sign * width) is None:
                side[:] = np.nan
    by_formula = Slopes(direct, error, below, above, np.zeros(len(base)))
    by_moving = by_formula
    is_moved = np.isnan(direct) & np.isfinite(base)
    if is_moved.any():
        by_moving = _narrowed(beside, base, width, parameter.scale)
    pairs = zip(by_formula, by_moving, strict=True)
    found = Slopes(*(np.where(np.isnan(direct), other, own) for own, other in pairs))
    one_sided = np.isnan(found.below) != np.isnan(found.above)
    return found, np.logical_or(found.kink, np.logical_and(is_moved, one_sided))


def sequence(history: AbstractHistory) -> list[tuple[str, str]]:
    """Return the contacts that close and open, in order."""
    if isinstance(history, ContinuousHistory):
        return [(event.contact, event.kind) for event in history.dated]
    return [(event.contact, event.kind) for event in history.events]


def _of_runs(
    case: Case, parameter: Parameter, values: Quantities, base: Array, history: AbstractHistory, distance: float
) -> Slopes:
    before = sequence(history)

    def beside(step: float) -> Array | None:
        try:
            there = parameter.case(case, parameter.value + step)
            with api.warnings_kept():
                run = api.run(there)
        except ImpactlabError:
            return None
        return values(run) if sequence(run) == before else None

    width = min(RUN_WIDTH * parameter.scale, SHARE * distance)
    return _narrowed(beside, base, width, parameter.scale, RUN_ROUNDING)


def _narrowed(
    beside: Callable[[float], Array | None], base: Array, width: float, scale: float, rounding: float = MOVED_ROUNDING
) -> Slopes:
    """Return derivatives by differences ever closer by, until their errors are small.

    A kink or a front inside the stencil spoils a difference, and its error shows it.
    """
    found = slopes(beside, base, width, rounding)
    for _ in range(MAX_NARROWED):
        surely = found.error <= RECHECK_TOL * np.maximum(np.abs(found.middle), np.abs(base) / scale)
        if np.all(np.logical_or.reduce((surely, found.kink, np.isnan(base)))):
            break
        width *= NARROWED
        finer = slopes(beside, base, width, rounding)
        better = np.logical_or(finer.error < found.error, np.isnan(found.middle))
        found = Slopes(*(np.where(better, new, old) for new, old in zip(finer, found, strict=True)))
    return found
