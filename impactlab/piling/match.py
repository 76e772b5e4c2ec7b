"""Signal matching: soil of a pile from force and velocity measured at its head."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from impactlab import api, simulate
from impactlab.casefile import Case
from impactlab.contact.smith import Smith
from impactlab.errors import CaseError, ImpactlabError, texts
from impactlab.fits.correlation import correlations
from impactlab.fits.identifiable import exponential
from impactlab.fits.intervals import Options, fit_with_intervals
from impactlab.fits.model import AbstractMeans
from impactlab.fits.problem import Experiment, Problem
from impactlab.fits.result import Fit, Fitted
from impactlab.fits.search import solved
from impactlab.fits.signals import Signal
from impactlab.fits.trials import Trials, Values
from impactlab.history.base import AbstractHistory
from impactlab.measurement.inputs import one_of
from impactlab.piling.case_method import first_peak
from impactlab.piling.measured import CaseUnderForce, checked, driven_by, soil_path, written_out
from impactlab.piling.signs import check_length, check_work, warn_of_offsets, warn_of_proportion, warn_of_times
from impactlab.prefixes import prefixed, prefixed_range
from impactlab.scene.method import Simulation
from impactlab.startup.lazy import above
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FREE_EXAMPLE = "Name some, as free=['toe.capacity', 'shaft.capacity']."
BOUNDS = 20.0  # a free number is sought between its start over this and its start times this
COARSE_ELEMENTS = 40  # of the mesh from whose solution the search starts
COARSE_TOL = 1e-2  # of the cost and of the numbers, on that mesh
RISE_SHARE, EARLY_TRIPS = 0.05, 2.0  # of the largest force; round trips after it: the samples that are matched first
MIN_EARLY = 4  # of these samples for each free number
TOLERANCE = 1e-6  # of the cost and of the logarithms of the numbers, at the end of the search
Free = Iterable[str] | Mapping[str, tuple[Any, Any]]


@dataclass(frozen=True, repr=False)
class Match:
    """Soil parameters for which the computed motion of the pile fits the measured one."""

    capacity: Fitted  # N, static, of all soil links together, with its 95 % interval
    parameters: tuple[Fitted, ...]  # the free numbers, as they were named, with their 95 % intervals
    case: Case  # as given, blocks of repeat and chain written out, with the fitted numbers
    driven: Case  # the pile under the measured force, with the fitted numbers
    time: Array = field(repr=False)  # s, (n,) from the first sample
    measured: Array = field(repr=False)  # m/s, (n,) velocity into the soil
    computed: Array = field(repr=False)  # m/s, (n,)
    fit: Fit = field(repr=False, compare=False)

    def __repr__(self) -> str:
        numbers = (("capacity", self.capacity), *((each.path, each) for each in self.parameters))
        found = ", ".join(
            f"{name} {prefixed(each.value, each.unit)} ({prefixed_range(each.lower, each.upper, each.unit)})"
            if each.unit in ("N", "m")
            else f"{name} {each.value:.4g} {each.unit} ({each.lower:.4g} to {each.upper:.4g})"
            for name, each in numbers
        )
        return f"<Match of {len(self.time)} samples, mismatch {100.0 * self.mismatch:.3g} %: {found}>"

    def plot(self) -> Figure:
        """Return the measured and the computed velocity of the head over time as a figure."""
        made: Figure = above("report.figures.evaluations").match(self)
        return made

    @property
    def mismatch(self) -> float:
        """Root mean square of measured less computed velocity, over the largest measured one."""
        return float(np.sqrt(np.mean((self.measured - self.computed) ** 2)) / np.abs(self.measured).max())

    def __getitem__(self, name: str) -> Fitted:
        for each in self.parameters:
            if each.path == name:
                return each
        raise KeyError(name)


class Numbers(NamedTuple):
    """A free number: its names, its place and its bounds."""

    name: str
    given: str  # path in the given case
    path: str  # in the case without hammer
    block: int
    field: str
    bounds: tuple[Any, Any]


def match(
    case: Case, time: ArrayLike, force: ArrayLike, velocity: ArrayLike, free: Free, *, noise: str = "white"
) -> Match:
    """Return the soil that fits the head velocity under the measured head force.

    The hammer, if the case has one, is taken away; the head is driven by the force, straight lines between its samples.
    The free numbers are fitted to the velocity by least squares, from the values of the case. Different soils may fit
    about as well: read the intervals, and `Match.fit` for correlations and warnings.

    Parameters
    ----------
    case : Case
        A pile and its soil, links with the law `smith`; its own mesh and step. Of several rods, joined end to end, a
        hammer or a helmet shows the head.
    time : array
        Rising times [s], shape (n,); the pile is at rest at the first.
    force, velocity : array
        At the head, shape (n,): compression positive [N], velocity into the soil [m/s].
    free : iterable of str, or mapping of str to pairs
        Numbers that are fitted, as ``toe.capacity`` by the name of the contact, or as a path of the case; capacity,
        quake and damping of soil links. A mapping gives bounds in SI units or as texts; without it they are a
        twentieth and twenty times the value of the case.
    noise : str
        As of `impactlab.fit`: ``white``, or ``ar1`` where neighbouring samples err alike.

    Raises
    ------
    CaseError
        If signals differ in length, are not finite or not in order of time, a name is not that of a number of the soil
        or is given twice, the head cannot be identified, or the signals last longer than 1000 round trips of a wave
        through the pile, as times in ms do.
    ImpactlabError
        If the force does no work on the pile: a signal is zero, or has the other sign.

    Warns
    -----
    UnusualValue
        As `case_method`.

    References
    ----------
    RauscheGobleLikins1985.
    """
    one_of("noise", noise, ("white", "ar1"))
    t, measured_force, measured = checked(time, force, velocity)
    names = texts("free", free, FREE_EXAMPLE)
    free = free if isinstance(free, Mapping) else names
    case = written_out(case, free)
    driven = driven_by(case, t, measured_force)
    numbers = list(_numbers(case, driven.blocks, free))
    check_work(t, measured_force, measured)
    check_length(t, driven.round_trip)
    _warn_if_unusual(driven, t, measured_force, measured)
    signal = Signal(driven.velocity, t, driven.direction * measured)
    problem = MatchProblem(driven.case, signal, numbers)
    chosen = Options("linear", noise)
    early = early_samples(t, measured_force, driven.round_trip)
    found = solved(problem, _near(problem, early), tolerance=TOLERANCE)
    if noise == "ar1":
        problem.correlated = correlations(problem, found.x)
        found = solved(problem, found.x, tolerance=TOLERANCE)
    fit = fit_with_intervals(problem, found, chosen)
    named = tuple(each._replace(path=number.name) for number, each in zip(numbers, fit.parameters, strict=True))
    values = {number.given: each.value for number, each in zip(numbers, named, strict=True)}
    computed = driven.direction * np.asarray(problem.fitted(np.asarray(found.x))[0])
    capacity = _capacity(fit, numbers)
    return Match(capacity, named, case.with_settings(values, by="match()"), fit.case, t, measured, computed, fit)


def _warn_if_unusual(driven: CaseUnderForce, time: Array, force: Array, velocity: Array) -> None:
    """Issue an `UnusualValue` of signals whose units or offsets may be wrong."""
    pile = driven.case.scene().elastic[driven.body].waves
    assert pile is not None  # noqa: S101 - a rod
    expected = pile.segment_at(0.0 if driven.direction > 0.0 else pile.length).impedance * velocity
    first = first_peak(0.5 * (force + expected))
    warn_of_times(time, driven.round_trip)
    warn_of_offsets(force, velocity)
    warn_of_proportion(float(time[first]), float(force[first]), float(expected[first]))


def _numbers(case: Case, blocks: Mapping[int, int], free: Free) -> Iterable[Numbers]:
    names = [free] if isinstance(free, str) else list(free)
    if not names:
        raise CaseError("no number to fit", remedy=FREE_EXAMPLE)
    before: dict[str, str] = {}
    for name in names:
        block, of = soil_path(case, name)
        given = f"contacts.{block}.law.{of}"
        if given in before:
            words = "" if before[given] == name else f": {before[given]} is the same number"
            raise CaseError(f"a number that is given twice{words}", remedy="Name it once.", path=name)
        before[given] = name
        law = _law(case.simulation(), case, block)
        start = getattr(law, of)
        if start <= 0.0:
            text = f"the case gives {name} the value {start:g}, from which the fit starts. Allowed: above 0"
            raise CaseError(text, remedy="Give the case a value above 0.", path=given)
        bounds = free[name] if isinstance(free, Mapping) else (start / BOUNDS, start * BOUNDS)
        yield Numbers(name, given, f"contacts.{blocks[block]}.law.{of}", blocks[block], of, bounds)


def _law(run: Simulation, case: Case, block: int) -> Smith:
    """Return the law of a contact block with its totals."""
    first = sum(each.pieces or 1 for each in case.checked.contacts[:block])
    law = run.method.laws[run.scene.contacts[first].name]
    assert isinstance(law, Smith)  # noqa: S101 - `soil_path` has refused others
    return law.divided(1.0 / (case.checked.contacts[block].pieces or 1))


def _capacity(fit: Fit, numbers: Sequence[Numbers]) -> Fitted:
    """Return the static capacity of all soil links, its interval by the logarithms' covariance."""
    run = fit.case.simulation()
    total = sum(law.capacity for law in run.method.laws.values() if isinstance(law, Smith))
    shares = np.array([
        each.value / total if number.field == "capacity" else 0.0
        for number, each in zip(numbers, fit.parameters, strict=True)
    ])  # fmt: skip
    sizes = np.sqrt(np.diag(fit.covariance))
    with np.errstate(all="ignore"):
        reaches = np.log([each.upper / each.value for each in fit.parameters]) / sizes
    variance, known = max(0.0, float(shares @ fit.covariance @ shares)), reaches[np.isfinite(reaches)]
    size = 0.0
    if variance > 0.0:
        size = float(np.max(known)) * math.sqrt(variance) if len(known) else math.inf  # where nothing is determined
    ends = total * exponential(-size), total * exponential(size)
    return Fitted("capacity", total, *ends, "N", intervals={"jacobian": ends})


def _near(problem: MatchProblem, early: NDArray[np.bool_]) -> Array:
    """Return a start near the solution, fitted to the early samples first.

    The mesh is coarse where the case has a fine one. Later the pile rings, and soils whose ringing is a period off are
    minima of their own: starts at half of the capacities ended there.
    """
    (trials,), x = problem.trials, problem.start()
    assert isinstance(trials, MatchTrials)  # noqa: S101 - of `MatchProblem`
    fine = trials.simulation
    coarse = coarsened(fine)
    parts = [~early] if early.sum() > MIN_EARLY * problem.size else []
    try:
        if coarse is not None:
            trials.use(coarse)
        for left_out in [*parts, None] if coarse is not None else parts:
            problem.left_out = [] if left_out is None else [left_out]
            near = least_squares(
                problem.residuals, x, problem.jacobian, problem.bounds(),
                method="dogbox", x_scale="jac", ftol=COARSE_TOL, xtol=COARSE_TOL,
            )  # fmt: skip
            x = np.asarray(near.x)
    except ImpactlabError:
        return problem.start()
    finally:
        problem.left_out = []
        trials.use(fine)
    return x


def early_samples(time: Array, force: Array, round_trip: float) -> NDArray[np.bool_]:
    """Return whether samples lie within two round trips of the force's rise, (n,)."""
    rise = float(time[np.argmax(np.abs(force) >= RISE_SHARE * np.abs(force).max())])
    return np.asarray(time <= rise + EARLY_TRIPS * round_trip)


def coarsened(run: Simulation) -> Simulation | None:
    """Return a scene on a coarse mesh with longer steps, or None.

    It is None where the scene has no mesh, or a coarse one.
    """
    models, coarser = {}, 1.0
    for name, model in run.method.models.items():
        elements = getattr(model, "elements", None)
        if not isinstance(elements, int) or elements < 2 * COARSE_ELEMENTS:
            return None
        coarser = elements / COARSE_ELEMENTS
        models[name] = replace(model, elements=COARSE_ELEMENTS)  # type: ignore[type-var]
    rule = run.method.step
    step = rule if rule.dt is None else replace(rule, dt=coarser * rule.dt)
    return Simulation(run.scene, replace(run.method, models=models, step=step)) if models else None


class Instants(AbstractMeans):
    """Values of a channel at the instants of its samples.

    Velocities are sampled at instants, and are no means.
    """

    def __init__(self, history: AbstractHistory, channel: str, times: Array) -> None:
        self._history, self._channel, self.duration = history, channel, history.duration
        self._times = times  # (n,) s, of the samples: between unequal intervals they are not the middles of edges
        self.rest = self.last = 0.0

    def sums(self, edges: Array) -> Array:
        values = self._history.evaluate(np.clip(self._times, 0.0, self.duration), self._channel)
        return np.concatenate([[0.0], np.cumsum(values * np.diff(edges))])

    def over(self, edges: Array, shift: float) -> Array:
        return self._history.evaluate(np.clip(self._times - shift, 0.0, self.duration), self._channel)


class MatchTrials(Trials):
    """Runs of the driven pile with other soil.

    Laws are replaced in the scene, and nothing else is built again.
    """

    def __init__(self, problem: MatchProblem, case: Case) -> None:
        signal = problem.experiments[0].signals[0]
        super().__init__(case, problem.parameters, [signal.channel])
        self._numbers, self.simulation, self._times = problem.numbers, case.simulation(), signal.time

    def use(self, run: Simulation) -> None:
        """Take another mesh from now on."""
        self.simulation = run
        self._kept.clear()

    def _run(self, values: Values) -> list[AbstractMeans]:
        scene, method = self.simulation
        laws, first = dict(method.laws), 0
        for number, block in enumerate(self.case.checked.contacts):
            names = [each.name for each in scene.contacts[first : first + (block.pieces or 1)]]
            first += len(names)
            changed: dict[str, Any] = {
                n.field: value for n, value in zip(self._numbers, values, strict=True) if n.block == number
            }
            if changed:
                law = replace(_law(self.simulation, self.case, number), **changed)
                laws |= dict.fromkeys(names, law.divided(len(names)))
        with_soil = replace(method, laws=laws)
        quick = method.tolerance is None
        history = simulate.run(scene, with_soil, with_warnings=False) if quick else api.solve(scene, with_soil)
        return [Instants(history, self.channels[0], self._times)]


class MatchProblem(Problem):
    """The residuals of one velocity at a pile's head."""

    def __init__(self, case: Case, signal: Signal, numbers: Sequence[Numbers]) -> None:
        self.numbers = numbers
        super().__init__([Experiment(case, [signal])], {each.path: each.bounds for each in numbers})

    def _trials(self, experiment: Experiment) -> Trials:
        return MatchTrials(self, experiment.case)
