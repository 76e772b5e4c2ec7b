"""Derivatives of stepped runs by a cubic fit over a wide range.

The fit is to whole runs; over its width every event moves by several steps.

The events of a stepped run are found on a grid of steps, so its quantities are a smooth curve of the parameter plus a
ripple that repeats as an event passes from one step into the next. A difference over less than a step measures the
ripple. Here step and mesh are frozen, and events move by `EVENT_STEPS` steps or more. Three terms make the stated
error: the scatter about the fit, its difference from a fit of order five, and the change by coarser meshes and steps.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from impactlab import api
from impactlab.casefile import Case
from impactlab.derivatives.parameters import Parameter, read_parameters
from impactlab.errors import CaseError, ImpactlabError
from impactlab.metrics.grazing import MIN_CONTACT, merged_periods
from impactlab.scene.facts import field_acceleration
from impactlab.scene.method import Method, StepRule
from impactlab.scene.problem import Scene
from impactlab.sweeps.axes import at_point
from impactlab.sweeps.quantities import WantedQuantity, values
from impactlab.types import Array

EVENT_STEPS = 5.0  # steps by which each event moves over half the width, at least
MIN_WIDTH = 0.02  # half of the width, of the parameter or, where that is 0, of its scale in the scene
MAX_WIDTH = 0.1  # the same, of the larger of the two
MAX_SHARE = 0.5  # of a parameter that is not 0, half of the width
MIN_EVENT_SHIFT = 1e-3  # of a step: an event that moves less over the largest width stands still
HALVINGS = 6  # of the width, at most, while the sequence of contacts changes within it
WIDTHS, SHIFTS = (1.0, 0.75, 0.5), (-0.2, 0.0, 0.2)  # of differences, and of their middles, in half widths
PLACES = sorted((shift + side * width for width in WIDTHS for shift in SHIFTS for side in (-1, 1)), key=abs)[::-1]
REACH = abs(PLACES[0])
STEP_SHARE = 0.85  # of the step of the case, where a shifted run is beyond its longest one
MESH_RATIO = 0.5 * (1.0 + math.sqrt(5.0))  # of elements and steps of the next mesh: no step is a multiple of another
SLOPE_SHARE = 0.5  # of the range of the derivative over three meshes
VALUE_SHARE = 1.0  # of the range of the value over three meshes, over the larger of parameter and scale
MAX_ERROR, MAX_ERROR_OF_VALUE = 0.1, 0.01  # of the derivative, of value over parameter: above both it is withheld
SWITCHES = {
    "contacts": "a number of periods of contact has no derivative",
    "near_grazing": "a warning that is on or off has no derivative",
}


Whole = Callable[[float], int]
"""Rounding of a number to a whole one."""


class Difference(NamedTuple):
    """The derivative of one quantity of a run by one parameter, both in SI."""

    value: float  # of the quantity
    derivative: float  # NaN where it is withheld
    error: float  # of the derivative; NaN where it is not known
    reason: str  # why the derivative is withheld; empty where it is given
    reach: float = 0.0  # of the parameter, to each side: there the sequence of contacts is that of the run


class _Run(NamedTuple):
    values: Array  # of all quantities, one after another
    periods: tuple[tuple[str, int, bool], ...]  # of each contact: how many, and whether the last one lasts to the end
    events: Array  # s, closings and openings


class _Fit(NamedTuple):
    values: Array  # of the cubic, in the middle
    slopes: Array  # of the cubic, by the place in half widths
    scatter: Array  # standard deviations of the slopes
    curvature: Array  # differences of the slopes from those of order five


@dataclasses.dataclass(frozen=True)
class _Frozen:
    """Runs of a case at values of one parameter, with steps kept.

    They have as many steps in a second as at its own value.
    """

    case: Case
    path: str
    wanted: Sequence[WantedQuantity]
    chosen: Method | None  # by the automatic choice, at its own value
    dt: float | None  # s; None of a run without steps

    def run(self, value: float, coarser: float = 1.0, whole: Whole = round) -> _Run:
        """Return a run at a value of the parameter.

        Elements and steps are ``coarser`` times longer. ``whole`` makes a whole number of the number of elements.
        """
        scene, method = at_point(self.case, {self.path: value}).simulation()
        history = api.solve(scene, self._solved(method, coarser, whole))
        periods, events = [], []
        for contact in scene.contacts:
            quiet = 0.0 if history.dt is None else max(10.0 * history.dt, MIN_CONTACT * scene.round_trip)
            touches = merged_periods(history, contact.name, quiet)
            periods.append((contact.name, len(touches), bool(touches) and touches[-1].end is None))
            events += [time for touch in touches for time in (touch.start, touch.end) if time is not None]
        rows = values(history, self.wanted, self.case.registry)
        return _Run(np.array([each for row in rows for each in row]), tuple(periods), np.array(events))

    def _solved(self, method: Method, coarser: float, whole: Whole) -> Method:
        if self.chosen is not None:
            own = self.case.simulation().method.laws
            laws = {name: self.chosen.laws[name] if law == own[name] else law for name, law in method.laws.items()}
            method = dataclasses.replace(self.chosen, laws=laws)
        if self.dt is not None:
            method = dataclasses.replace(method, step=StepRule(dt=self.dt * coarser))
        if coarser == 1.0:
            return method
        models = {}
        for name, model in method.models.items():
            counts = {field: getattr(model, field, None) for field in ("elements", "modes")}
            fewer = {field: max(1, whole(count / coarser)) for field, count in counts.items() if count is not None}
            models[name] = dataclasses.replace(model, **fewer) if fewer else model  # type: ignore[type-var]
        return dataclasses.replace(method, models=models)

    def fit(self, at: float, width: float, periods: object, coarser: float = 1.0, whole: Whole = round) -> _Fit | None:
        """Return fits over the places about a value, or None.

        It is None where the sequence of contacts differs at one of them.
        """
        rows = []
        for place in PLACES:
            run = self.run(at + place * width, coarser, whole)
            if run.periods != periods:
                return None
            rows.append(run.values)
        found = np.array(rows)
        cubic, quintic = (np.vander(np.array(PLACES), order + 1, increasing=True) for order in (3, 5))
        inverse = np.linalg.pinv(cubic)
        fitted = inverse @ found
        noise = np.sum((found - cubic @ fitted) ** 2, axis=0) / (len(PLACES) - cubic.shape[1])
        curved = (np.linalg.pinv(quintic) @ found)[1]
        return _Fit(fitted[0], fitted[1], np.sqrt(noise * float(inverse[1] @ inverse[1])), curved - fitted[1])


def differences(case: Case, path: str, wanted: Sequence[WantedQuantity]) -> list[list[Difference]]:
    """Return derivatives of quantities by a number, one list for each quantity.

    A list has an entry for each label; the number is that at ``path``. A run that lasts a number of round trips ends
    with the round trip of each shifted case, as in a sweep: a quantity at its end is differentiated at the moving end.
    A channel at a given time is differentiated at that time.

    Parameters
    ----------
    case : Case
        The case, with the method whose runs are differentiated.
    path : str
        Dotted path of a number of the case.
    wanted : sequence of WantedQuantity
        Quantities, from `impactlab.sweeps.quantities.quantities_of`.

    Raises
    ------
    CaseError, PairingError
        If there is no number at the path, or the case itself is refused.
    StepError
        If the run of the case itself fails.
    """
    (parameter,) = read_parameters(case, [path])
    at = parameter.value
    usual = scale_of(case.scene(), parameter)
    scale = abs(at) or usual
    if math.isnan(scale):
        text = "the value is 0, of which no share gives a width for differences. Allowed: any other value"
        raise CaseError(text, path=path, remedy="Give a value other than 0, or compare runs with two values.")
    widest = max(MAX_WIDTH * scale, min(MAX_SHARE * scale, MAX_WIDTH * usual))
    base = api.solve(*case.simulation())
    chosen = base.choice.method if base.choice is not None else None
    frozen = _Frozen(case, path, wanted, chosen, base.dt)
    own = middle = frozen.run(at)
    for dt in (base.dt and STEP_SHARE * base.dt, None):
        try:
            found = _fits(frozen, at, scale, widest, middle)
            break
        except ImpactlabError as error:
            found = f"a run with another value is not possible: {error.text}"
        if dt is None:
            break
        frozen = dataclasses.replace(frozen, dt=dt)
        middle = frozen.run(at)
    rows = []
    place = 0
    for each in wanted:
        row = []
        for _ in range(each.size):
            value = float(own.values[place])
            if isinstance(found, str) or each.name in SWITCHES:
                row.append(Difference(value, math.nan, math.nan, SWITCHES.get(each.name, str(found))))
            else:
                row.append(_difference(value, place, scale, float(np.fmax(scale, usual)), *found))
            place += 1
        rows.append(row)
    return rows


def _difference(
    value: float, place: int, scale: float, largest: float, width: float, fits: Sequence[_Fit]
) -> Difference:
    """Return the derivative of one value from the fits of several meshes.

    The mesh of the case comes first. ``scale`` is the size of the parameter, ``largest`` that or its size in the scene.
    """
    fine = fits[0]
    slope = float(fine.slopes[place]) / width
    slopes, kept = (
        [float(each[place]) for each in pair] for pair in zip(*((fit.slopes, fit.values) for fit in fits), strict=True)
    )
    terms = {
        "the scatter of the runs": float(fine.scatter[place]) / width,
        "the curvature over the width": abs(float(fine.curvature[place])) / width,
        "the change by a coarser mesh and step": math.hypot(
            SLOPE_SHARE * (max(slopes) - min(slopes)) / width, VALUE_SHARE * (max(kept) - min(kept)) / largest
        ),
    }
    error, reach = math.hypot(*terms.values()), REACH * width
    if not math.isfinite(error) or not math.isfinite(slope):
        return Difference(value, math.nan, math.nan, "a run of the difference does not give this quantity", reach)
    if error > MAX_ERROR * abs(slope) and error > MAX_ERROR_OF_VALUE * abs(value) / scale:
        cause = max(terms, key=lambda name: terms[name])
        text = f"its error, {error:.2g}, is above a tenth of it, {slope:.3g}, mostly from {cause}"
        return Difference(value, math.nan, error, text, reach)
    return Difference(value, slope, error, "", reach)


def _fits(frozen: _Frozen, at: float, scale: float, widest: float, middle: _Run) -> tuple[float, list[_Fit]] | str:
    """Return half of the width and the fits of three meshes, or the reason.

    The first mesh is that of the case. The reason is given where fits are impossible.
    """
    finer = "" if frozen.dt is None else ", which a smaller step would resolve better"
    widest, least = _width(frozen, at, scale, widest, middle)
    for width in (max(widest / 2.0**number, least) for number in range(HALVINGS)):
        fine = frozen.fit(at, width, middle.periods)
        if fine is not None or width == least:
            break
    if fine is None:
        return f"the sequence of contacts changes within {width / scale:.2g} of the parameter{finer}"
    refused = "the sequence of contacts changes with the mesh and the step"
    fits = [fine]
    for coarser in (MESH_RATIO, MESH_RATIO**2, 1.0 / MESH_RATIO):
        other = None
        for whole in (round, math.floor):  # one element more is too short for a step at the stability limit
            try:
                other = frozen.fit(at, width, middle.periods, coarser, whole)
                break
            except ImpactlabError as error:
                refused = f"a run with another mesh is not possible: {error.text}"
        if other is not None:
            fits.append(other)
        if len(fits) == 3:
            return width, fits
    return refused


def _width(frozen: _Frozen, at: float, scale: float, widest: float, middle: _Run) -> tuple[float, float]:
    """Return half of the width in which each event moves by several steps.

    With it comes the least one in which any does.
    """
    step = MIN_WIDTH * scale
    for _ in range(HALVINGS):
        low, high = (frozen.run(at + side * step) for side in (-1, 1))
        if low.periods == high.periods == middle.periods:
            break
        step *= 0.5
    else:
        return step, step
    moved = np.abs(high.events - low.events) / (2.0 * step)  # s per unit of the parameter
    dt = frozen.dt or 0.0
    needed = EVENT_STEPS * dt / moved[moved * widest > MIN_EVENT_SHIFT * dt]
    reached = np.minimum(needed, widest)
    return float(max([step, *reached])), float(min([step, *reached]))


def scale_of(scene: Scene, parameter: Parameter) -> float:
    """Return the size of a parameter in its scene, in SI units.

    It is NaN where its unit has none. It is made of the lightest mass, the fastest velocity and the round trip.
    """
    mass, velocity, time = _scales(scene)
    scales = {
        "m": velocity * time, "m/s": velocity, "m/s2": velocity / time, "s": time, "kg": mass,
        "N": mass * velocity / time, "N/m": mass / time**2, "N s/m": mass / time,
    }  # fmt: skip
    scale = scales.get(parameter.unit, math.nan)
    return scale if 0.0 < scale < math.inf else math.nan


def _scales(scene: Scene) -> tuple[float, float, float]:
    """Return lightest mass [kg], fastest velocity [m/s] and round trip [s] of a scene."""
    bodies = scene.bodies.values()
    mass = min((body.moving_mass for body in bodies), default=math.nan)
    time = scene.round_trip if scene.round_trip > 0.0 else scene.duration
    force = max((end.largest_force(scene.duration) for body in bodies for _, end in body.ends), default=0.0)
    speeds = [abs(body.velocity) for body in bodies]
    return mass, max([*speeds, field_acceleration(scene) * time, force * time / mass]), time
