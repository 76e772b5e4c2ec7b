"""Peaks of contact forces for error estimates, without a search over a grid.

The forces of a stepped run are means over steps, read with a slope inside each that keeps them between the means of the
neighbours: no value is larger than the largest mean. A summary searches a grid instead (`impactlab.metrics.peaks`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.metrics.peaks import find_peak, smooth_force
from impactlab.numerics.slopes import MIN_MEANS
from impactlab.scene.problem import Contact
from impactlab.simulate.channels import AbstractRecordedHistory, Channel
from impactlab.types import Array

CELLS = 400  # of a run whose force has no steps
PER_SPAN = 100  # of one of its periods of contact
MAX_SINGLE = 12  # instants that are read one by one: for more, all slopes of a run are found faster


def forces_at_peaks(histories: Sequence[AbstractHistory], contact: Contact, left_out: Array, hard: bool) -> Array:
    """Return the forces of all runs at the instants of the peaks of all runs, shape (runs, runs) [N].

    Entry i, j is the force of run i at the peak of run j outside the intervals ``left_out`` (k, 2) [s], which rise and
    do not overlap.
    """
    t = np.array([peak_time(history, contact, left_out, hard) for history in histories])
    return np.array([force_at(history, t, contact, hard) for history in histories])


def peak_time(history: AbstractHistory, contact: Contact, left_out: Array, hard: bool) -> float:
    """Return the instant of the largest force of a run outside intervals (k, 2) [s]; 0 where there is none."""
    channel = _steps_of(history, contact)
    if channel is None:
        return find_peak(history, contact, left_out, hard, CELLS, PER_SPAN).time
    ends, means = channel.times, channel.values[1:]
    if not len(left_out):
        top = int(means.argmax())
        return min(0.5 * float(ends[top] + ends[top + 1]), history.duration)
    # The middles of steps, and the borders of the intervals: the force may fall from one of these on.
    t = np.minimum(np.concatenate((0.5 * (ends[1:] + ends[:-1]), left_out.ravel())), history.duration)
    t = t[np.logical_and(t >= 0.0, _outside(t, left_out))]
    return float(t[np.argmax(force_at(history, t, contact, hard))]) if t.size else 0.0


def force_at(history: AbstractHistory, t: Array, contact: Contact, hard: bool) -> Array:
    """Return a contact force [N] as `impactlab.metrics.peaks.smooth_force`; at few instants without all slopes."""
    channel = _steps_of(history, contact)
    if channel is None or channel.middles is None or t.size > MAX_SINGLE or channel.values.size <= MIN_MEANS:
        return smooth_force(history, t, contact, hard)
    steps = np.minimum(np.searchsorted(channel.times, t, side="right"), channel.values.size - 1)
    return np.array([_in_step(channel, step, at) for step, at in zip(steps.tolist(), t.tolist(), strict=True)])


def mean_forces(history: AbstractHistory, t: Array, contact: Contact) -> Array:
    """Return a contact force [N] at instants of a run, (n,) [s]: where it is known over steps, its mean in each."""
    channel = _steps_of(history, contact)
    if channel is None:
        return history.evaluate(t, f"force:{contact.name}")
    step = np.minimum(np.searchsorted(channel.times, t, side="right"), channel.values.size - 1)
    return np.asarray(channel.values[step])


def _steps_of(history: AbstractHistory, contact: Contact) -> Channel | None:
    """Return the force of a contact as means over steps; None where it is none of these."""
    channel = history.recorded.get(f"force:{contact.name}") if isinstance(history, AbstractRecordedHistory) else None
    return None if channel is None or not channel.stepped or channel.times.size < 2 else channel


def _in_step(channel: Channel, step: int, t: float) -> float:
    """Return a force inside a step from 1 on, with the slope of `impactlab.numerics.slopes`."""
    assert channel.middles is not None  # noqa: S101 - asked of compliant laws alone
    last = channel.values.size - 1
    first = min(max(step - 2, 1), last - MIN_MEANS + 1)  # three means at an end of the run, five elsewhere
    means = channel.values[first : step + MIN_MEANS].tolist()
    middles = channel.middles[first : step + MIN_MEANS].tolist()
    own = step - first

    def steepness(at: int) -> float:
        return float((means[at + 1] - means[at]) / (middles[at + 1] - middles[at]))

    before, after = steepness(own - 1 if step > 1 else 1), steepness(own if step < last else own - 2)
    least = min(abs(before), abs(after))
    if 1 < step < last:
        least = min(2.0 * least, 0.5 * abs(before + after))
    slope = math.copysign(least, before + after) if before * after > 0.0 else 0.0
    mean = means[own]
    return float(max(mean + slope * (t - middles[own]), min(mean, 0.0)))


def _outside(t: Array, left_out: Array) -> Array:
    """Return whether instants (n,) lie outside intervals (k, 2) that rise and do not overlap."""
    before = np.searchsorted(left_out[:, 0], t, side="left") - 1  # the last interval that begins before an instant
    return np.asarray((before < 0) | (t >= left_out[np.maximum(before, 0), 1]))
