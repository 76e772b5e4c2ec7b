"""Sensitivities of a case: effects of parameters, their methods and ranges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from impactlab import api
from impactlab.casefile import Case
from impactlab.casefile.case import expect_case
from impactlab.derivatives.differences import Difference, differences
from impactlab.derivatives.direct import Direct
from impactlab.derivatives.exact import MIN_DISTANCE, Derivatives, derivatives
from impactlab.derivatives.parameters import Parameter, read_parameters, refuse_held
from impactlab.derivatives.table import DIFFERENCES, WITHHELD, Sensitivities, Sensitivity
from impactlab.errors import CaseError
from impactlab.exact.results.history import ContinuousHistory
from impactlab.history.base import AbstractHistory
from impactlab.measurement.inputs import row_of_numbers
from impactlab.plugins import Registry
from impactlab.sweeps.quantities import WantedQuantity, quantities_of, values
from impactlab.sweeps.sampled import Sampled, extreme_in
from impactlab.types import Array

DEFAULT = ("first_opening", "impulse", "peak_force", "restitution", "final_velocity")
COUNTED = ("contacts", "near_grazing", "energy_gain")  # they change in steps, or are rounding
NO_VALUE = {
    "first_opening": "the contact does not open in this run",
    "restitution": "in this run the two bodies do not meet and part without other influences",
}
"""Why a quantity has no value, where the words are its own."""
MAX_ERROR = 1.0e-3  # of a derivative by differences, or of its value over the parameter: larger ones are not known
ZERO_TOL = 1.0e-9  # of the largest value of the same quantity, over the parameter: smaller errors are rounding


def sensitivities(
    case: Case, parameters: Sequence[str], quantities: Sequence[str | Sampled] = DEFAULT
) -> Sensitivities:
    """Return derivatives of quantities by numbers of a case.

    Of exact runs (all rods continuous, contacts hard or springs with dashpots) they are tangents, right to about
    1e-10; of stepped runs differences, with their scatter as error.

    Parameters
    ----------
    case : Case
        The case, with the method that solves it.
    parameters : sequence of str
        Dotted paths of numbers, such as ``bodies.hammer.mass``.
    quantities : sequence
        Names of quantities (`impactlab plugins` lists them), extremes of channels such as
        ``max(stress:rod@0.15)``, and `Sampled` channels.

    Returns
    -------
    Sensitivities
        Value, derivative in SI, logarithmic derivative, how it was found, its error, and the interval of the parameter
        in which the sequence of contacts stays the same. Where a quantity has no derivative, both one-sided ones.

    Raises
    ------
    CaseError, PluginError, StepError
        If a path does not lead to a number, a quantity is not known, or the run fails.
    """
    expect_case(case, "sensitivities")
    refuse_held(parameters)
    read = read_parameters(case, parameters)
    wanted = quantities_of(case.scene(), quantities, case.registry)
    _refuse_along(case, wanted)
    with api.warnings_kept():
        history = api.run(case)
    flat = FlatValues(wanted, case.registry)
    base = flat(history)
    largest = flat.largest(base)
    rows: list[Sensitivity] = []
    if isinstance(history, ContinuousHistory):
        for parameter, found in zip(read, derivatives(case, history, read, flat), strict=True):
            rows += [
                _exact(parameter, found, flat, number, base[number], largest[number]) for number in range(len(base))
            ]
    else:
        for parameter in read:
            rows += _stepped(parameter, flat, differences(case, parameter.path, wanted))
    rows += [_lacking(parameter, each) for each in wanted if each.lacking for parameter in read]
    order = {each.name: place for place, each in enumerate(wanted)}
    labels = {(each.name, label): place for place, (each, label) in enumerate(flat.names)}
    rows.sort(key=lambda row: (order[row.quantity], labels.get((row.quantity, row.label), 0)))
    return Sensitivities(case.label, tuple(rows))


def jacobian(case: Case, channel: str, times: ArrayLike, parameters: Sequence[str]) -> Array:
    """Return the derivatives of a channel by parameters in SI units, (times, parameters).

    ``times`` are in s. NaN where a wave front passes: a signal that jumps there has no derivative. NaN by a parameter
    at whose value the sequence of contacts changes.

    Raises
    ------
    CaseError
        If a path does not lead to a number, the channel is not known, or the run is not exact.
    """
    expect_case(case, "jacobian")
    refuse_held(parameters)
    read = read_parameters(case, parameters)
    at = row_of_numbers("times", times)
    with api.warnings_kept():
        history = api.run(case)
    signal = history.evaluate(at, channel)
    if not isinstance(history, ContinuousHistory):
        raise CaseError(
            "derivatives of a signal are those of an exact run", remedy="Give solve.model: {kind: continuous}."
        )
    found = derivatives(case, history, read, Sample(channel, at))
    columns = []
    for each, parameter in zip(found, read, strict=True):
        sizes = np.abs(signal).ravel() / parameter.scale
        column = np.array([_smooth(*each.at(number)[:2], size) for number, size in enumerate(sizes)])
        if _is_at_edge(each, parameter):
            column[np.isnan(each.slopes.below) | np.isnan(each.slopes.above)] = math.nan
        columns.append(column)
    return np.stack(columns, axis=-1).reshape(*at.shape, len(read))


def _smooth(slopes: tuple[float, float, float, float], kinked: bool, size: float) -> float:
    """Return a derivative, or NaN near a kink or a front.

    A front may pass so close that no difference is sure.
    """
    middle, error = slopes[:2]
    return math.nan if kinked or _is_vague(middle, error, size) else middle


def _is_at_edge(found: Derivatives, parameter: Parameter) -> bool:
    """Return whether the sequence of contacts changes at the value of a parameter."""
    return any(abs(edge.distance) < MIN_DISTANCE * parameter.scale for edge in found.edges)


def _is_vague(middle: float, error: float, size: float) -> bool:
    """Return whether a derivative is not known.

    ``size`` is that of the value over the parameter.
    """
    return error > MAX_ERROR * max(abs(middle), size)


class FlatValues:
    """Values of several quantities of a run, one after the other."""

    def __init__(self, wanted: tuple[WantedQuantity, ...], registry: Registry) -> None:
        self.wanted, self.registry = wanted, registry
        self.names = [(each, str(label)) for each in wanted for label in each.places]

    def __call__(self, history: AbstractHistory) -> Array:
        """Return the values, (names,)."""
        return np.concatenate(values(history, self.wanted, self.registry))

    def largest(self, found: Array) -> Array:
        """Return the largest magnitude of the values of the same quantity, (names,)."""
        parts = np.split(np.nan_to_num(np.abs(found)), np.cumsum([each.size for each in self.wanted])[:-1])
        return np.concatenate([np.full(part.size, part.max(initial=0.0)) for part in parts])

    def by_formulas(self, direct: Direct) -> Array:
        """Return the derivatives for which there are formulas, (names,), NaN of the others."""
        parts = []
        for each in self.wanted:
            if each.over == "time":
                parts.append(direct.sampled(each.name, np.array(each.labels)))
            elif _no_slope(each.name):
                parts.append(np.zeros(each.size))
            else:
                known = direct.of(each.name)
                parts.append(np.array([known.get(str(label), math.nan) for label in each.places]))
        return np.concatenate(parts)


class Sample:
    """A channel at given times as values to be derived."""

    def __init__(self, channel: str, times: Array) -> None:
        self.channel, self.times = channel, times.ravel()

    def __call__(self, history: AbstractHistory) -> Array:
        """Return the values, (times,)."""
        return np.asarray(history.evaluate(self.times, self.channel))

    def by_formulas(self, direct: Direct) -> Array:
        """Return the derivatives, (times,), NaN where there is no formula."""
        return direct.sampled(self.channel, self.times)


def _exact(
    parameter: Parameter, found: Derivatives, flat: FlatValues, number: int, value: float, largest: float
) -> Sensitivity:
    each, label = flat.names[number]
    rounding = ZERO_TOL * largest / parameter.scale
    (middle, error, below, above), kink, by = found.at(number)
    near, least = [edge.distance for edge in found.edges], MIN_DISTANCE * parameter.scale
    lower = parameter.value + max(
        (step for step in near if step <= (0.0 if math.isnan(below) else -least)), default=-math.inf
    )
    upper = parameter.value + min(
        (step for step in near if step >= (0.0 if math.isnan(above) else least)), default=math.inf
    )
    reason = ""
    if no_slope := _no_slope(each.name):
        by, reason, below, above = WITHHELD, no_slope, math.nan, math.nan
    elif math.isnan(middle) and _is_at_edge(found, parameter):
        by, reason = WITHHELD, "the sequence of contacts changes at this value"
    elif kink:
        by, reason = WITHHELD, f"not differentiable here: {below:.6g} from below, {above:.6g} from above"
    elif math.isnan(middle):
        by, reason = WITHHELD, _absent(each, value)
        if not reason:
            reason, lower, upper = "the sequence of contacts changes on both sides", parameter.value, parameter.value
    elif error > rounding and _is_vague(middle, error, abs(value) / parameter.scale):
        by, reason = WITHHELD, f"its error, {error:.2g}, is above a thousandth of it: it may jump at this value"
        below = above = math.nan
    elif math.isnan(below) or math.isnan(above):
        reason = f"one-sided derivative (from {'above' if math.isnan(below) else 'below'} only)"
    if by == WITHHELD:
        middle = math.nan
    return Sensitivity(
        each.name, label, each.unit, parameter.path, parameter.value, parameter.unit,
        value, middle, error, by, below, above, lower, upper, reason,
    )  # fmt: skip


def _refuse_along(case: Case, wanted: Sequence[WantedQuantity]) -> None:
    """Raise `CaseError` for an extreme over all places of a rod."""
    for each in wanted:
        extreme = extreme_in(each.name)
        if extreme is not None and extreme.along(case.scene()) is not None:
            raise CaseError(
                f"{each.name} is sought over all places of a rod and has no derivative",
                remedy=f'Give a place and times: il.Sampled("{extreme.channel}@X", times).',
            )


def _no_slope(name: str) -> str:
    """Return the reason why a quantity has no derivative, or an empty text."""
    if name in COUNTED:
        return "it changes in steps, or is rounding"
    extreme = extreme_in(name)
    if extreme is None:
        return ""
    return f'an extreme is read at fixed instants, which hide its slope; give il.Sampled("{extreme.channel}", times)'


def _lacking(parameter: Parameter, each: WantedQuantity) -> Sensitivity:
    """Return the row of a quantity without a place for a value.

    An example is one of contacts in a case that has none.
    """
    return Sensitivity(
        each.name, "", each.unit, parameter.path, parameter.value, parameter.unit,
        math.nan, math.nan, math.nan, WITHHELD, math.nan, math.nan, math.nan, math.nan, each.lacking,
    )  # fmt: skip


def _absent(each: WantedQuantity, value: float) -> str:
    """Return why there is no value to differentiate; empty where there is one."""
    return NO_VALUE.get(each.name, "it has no value in this run") if math.isnan(value) else ""


def _stepped(parameter: Parameter, flat: FlatValues, found: list[list[Difference]]) -> Iterator[Sensitivity]:
    """Yield the derivatives of a stepped run, its contact sequence known as far as differences reach."""
    flattened = [each for row in found for each in row]
    for (wanted, label), each in zip(flat.names, flattened, strict=True):
        lower, upper = (parameter.value + side * (each.reach or math.nan) for side in (-1, 1))
        reason = each.reason and (_absent(wanted, each.value) or each.reason)
        if extreme_in(wanted.name):
            each, reason = each._replace(derivative=math.nan), _no_slope(wanted.name)
        yield Sensitivity(
            wanted.name, label, wanted.unit, parameter.path, parameter.value, parameter.unit, each.value,
            each.derivative, each.error, WITHHELD if reason else DIFFERENCES, math.nan, math.nan, lower, upper, reason,
        )  # fmt: skip
