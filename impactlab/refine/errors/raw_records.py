"""Compiled passes over the records of a stepped run for error estimates.

No channel is made of the records. Displacements are linear between records, those of beads cubic if the records are
several steps apart. Forces are means over steps, read with the slopes of `impactlab.numerics.slopes`; those of hard
contacts are linear between the middles of steps. Each run of a study is read once, however many others it is compared
with.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.metrics.fronts import Samples
from impactlab.numerics.compiling import ENTRY, PART
from impactlab.numerics.slopes import MIN_MEANS
from impactlab.simulate.stepping.results.history import RecordedHistory
from impactlab.types import Array, Ints

WHOLE_TOL = 1e-6  # of a step: rounding of the instant at which it ends


class Sizes(NamedTuple):
    """Norms of a displacement, and of its difference to another run's [m]."""

    apart: float
    other: float
    own: float
    within: float  # of its own displacement less the drift of its frame


class Steps(NamedTuple):
    """The force of one contact in the records of a run."""

    record: Array  # (n, columns), time first
    column: int
    late: float  # share of a step by which forces act later than in its middle
    dt: float
    duration: float
    hard: bool

    def samples(self) -> Samples:
        """Return the force in the middles of the steps, in the order of time."""
        t = self.record[:, 0]
        length = np.diff(t)
        middles = t[1:] - 0.5 * length + self.late * np.minimum(length, self.dt)
        return Samples(np.minimum(middles, self.duration), self.record[1:, self.column])

    def at(self, t: float) -> float:
        """Return the force [N] at an instant of the run [s]."""
        return force_at(*self, t)

    def moved(self, cells: int) -> Array:
        """Return the displacements of both faces in middles of cells [m].

        The cells of the run are equal; the shape is (2, cells).
        """
        found, columns = np.empty((2, cells)), np.array([self.column + 2, self.column + 4])
        write_displacements(self.record, columns, np.full(2, -1), 0.0, self.duration, np.zeros((2, 2)), found)
        return found

    def size(self, cells: int) -> float:
        """Return the norm of mean forces in middles of equal cells [N]."""
        return mean_size(*self[:5], cells)


class Records:
    """The records of a run, with the columns of displacements by channel.

    Values that were read before are kept.

    Parameters
    ----------
    history : RecordedHistory
        The run.
    record : ndarray
        Its records, (n, columns), time first.
    """

    def __init__(self, history: RecordedHistory, record: Array) -> None:
        assembly = history.assembly
        self.record, self.columns = record, assembly.layout.displacement_columns
        self.arrays, self.dt = assembly.memory, assembly.dt
        whole = (len(record) - 1) * assembly.dt  # located events cut steps
        self.stride = assembly.stride  # steps a record
        self.thinned = self.stride > 1
        self.of_every_step = not self.thinned and abs(record[-1, 0] - whole) <= WHOLE_TOL * assembly.dt
        self._layout, self._duration = assembly.layout, history.duration
        self._late = assembly.integrator.load_point - 0.5
        self._early = (1.0 - assembly.integrator.velocity_point) * assembly.dt
        self._moved: dict[tuple[int, tuple[str, ...]], Array] = {}  # also by each channel alone
        self._peaks: dict[tuple[int, bool, bytes], float] = {}

    def displacements(self, channels: Sequence[str], cells: int) -> Array:
        """Return displacements in the middles of equal cells of the run [m], shape (n_channels, n_cells)."""
        key = cells, tuple(channels)
        if key not in self._moved:
            self._moved[key] = np.empty((len(channels), cells))
            columns = np.array([self.columns[name] for name in channels], dtype=np.int64)
            rates = np.array(self._layout.rates_of(columns.tolist()), dtype=np.int64)
            ends, moved = np.zeros((2, columns.size)), self._moved[key]
            write_displacements(self.record, columns, rates, self._early, self._duration, ends, moved)
            for place, name in enumerate(channels):
                self._moved.setdefault((cells, (name,)), self._moved[key][place : place + 1])
        return self._moved[key]

    def displacements_by_half(self, channels: Sequence[str], cells: int) -> Array:
        """Return displacements of beads [m], read along cubics through every second record: (channels, cells)."""
        n, last = len(channels), len(self.record) - 1
        columns = [self.columns[name] for name in channels]
        kept = np.array([0, *columns, *self._layout.rates_of(columns)])
        sparse = np.array([self.record[at, kept] for at in (*range(0, last, 2), last)])
        places, found = np.arange(1, n + 1), np.empty((n, cells))
        write_displacements(sparse, places, places + n, self._early, self._duration, np.zeros((2, n)), found)
        return found

    def force(self, number: int, hard: bool) -> Steps:
        """Return the force of a contact by its number in the scene."""
        column = self._layout.column_of(number)
        return Steps(self.record, column, self._late, self.dt, self._duration, hard)

    def peak_time(self, number: int, hard: bool, left_out: Array) -> float:
        """Return the instant of a contact's largest force outside intervals [s].

        The intervals (k, 2) [s] rise and do not overlap.
        """
        key = number, hard, left_out.tobytes()
        if key not in self._peaks:
            self._peaks[key] = peak_time(*self.force(number, hard), left_out)
        return self._peaks[key]


_known: WeakKeyDictionary[RecordedHistory, Records] = WeakKeyDictionary()


def records_of(history: AbstractHistory) -> Records | None:
    """Return the records of a complete stepped run; else None.

    A complete run has the whole duration of its scene.
    """
    if not isinstance(history, RecordedHistory) or "assembly" not in vars(history):
        return None
    count = history.assembly.clock.n_records
    if count <= MIN_MEANS + 1 or history.duration < history.scene.duration:
        return None
    known = _known.get(history)
    if known is None:
        known = _known[history] = Records(history, history.assembly.memory.record[:count])
    return known


@PART
def _record_before(record: Array, first: int, t: float) -> int:
    """Return the last record at an instant or before.

    The search begins at ``first``; the last record of all is never returned.
    """
    low, reach, last = first, 1, len(record) - 2
    while low + reach <= last and record[low + reach, 0] <= t:
        low += reach
        reach *= 2
    high = min(low + reach, last + 1)
    while high - low > 1:
        middle = (low + high) // 2
        if record[middle, 0] <= t:
            low = middle
        else:
            high = middle
    return low


@PART
def _write_rates(record: Array, at: int, rates: Ints, early: float, out: Array, side: int) -> None:
    """Write velocities at the end of a record's step to a row of an array, (2, n_columns) [m/s].

    Those of the record are ``early`` [s] before it, and go on with their slope by the records beside it.
    """
    first, last = max(at - 1, 0), min(at + 1, len(record) - 1)
    before, after = record[at, 0] - record[first, 0], record[last, 0] - record[at, 0]
    whole = before + after
    low, high = 1.0 / whole, 1.0 / whole  # at an end of the run the slope is one-sided
    if before > 0.0 and after > 0.0:
        low, high = after / (before * whole), before / (after * whole)
    for row in range(rates.size):
        if rates[row] >= 0:
            here = record[at, rates[row]]
            slope = low * (here - record[first, rates[row]]) + high * (record[last, rates[row]] - here)
            out[side, row] = here + early * slope


@ENTRY
def write_displacements(
    record: Array, columns: Ints, rates: Ints, early: float, duration: float, ends: Array, out: Array
) -> None:
    """Write displacements (n_columns, n_cells) [m] in the middles of equal cells of the run.

    They are linear between records, or cubic with the velocities in the columns ``rates``, which are negative without;
    these belong ``early`` [s] before the ends of their steps. ``ends`` (2, n_columns) is room.
    """
    at, known, cells = 0, -1, out.shape[1]
    for k in range(cells):
        t = (k + 0.5) * (duration / cells)
        at = _record_before(record, at, t)
        apart = record[at + 1, 0] - record[at, 0]
        share = min(max((t - record[at, 0]) / apart, 0.0), 1.0)
        if at != known:
            _write_rates(record, at, rates, early, ends, 0)
            _write_rates(record, at + 1, rates, early, ends, 1)
            known = at
        for row in range(columns.size):
            first, last = record[at, columns[row]], record[at + 1, columns[row]]
            bend = 0.0
            if rates[row] >= 0:
                rise = last - first
                bend = (1.0 - share) * (ends[0, row] * apart - rise) - share * (ends[1, row] * apart - rise)
            out[row, k] = first + share * (last - first + (1.0 - share) * bend)


@ENTRY
def write_sizes(own: Array, other: Array, drift: Array, out: Array) -> None:
    """Write the norms of `Sizes` of displacements (n, n_cells) of two runs: (n, 4)."""
    for row in range(len(own)):
        apart = whole = size = within = 0.0
        for k in range(own.shape[1]):
            u, v = own[row, k], other[row, k]
            apart += (u - v) ** 2
            whole += v**2
            size += u**2
            within += (u - drift[row, k]) ** 2
        out[row, 0], out[row, 1] = math.sqrt(apart), math.sqrt(whole)
        out[row, 2], out[row, 3] = math.sqrt(size), math.sqrt(within)


def sizes_of(own: Array, other: Array, drift: Array) -> list[Sizes]:
    """Return the norms of displacements (n, n_cells) of two runs [m], one for each."""
    found = np.empty((len(own), len(Sizes._fields)))
    write_sizes(own, other, drift, found)
    return [Sizes(*each) for each in found.tolist()]


@PART
def _end(record: Array, step: int, late: float, dt: float) -> float:
    """Return the end of the interval over which the force of a step acted [s]."""
    end: float = record[0, 0]
    if step > 0:
        end = min(record[step, 0] + late * min(record[step, 0] - record[step - 1, 0], dt), record[-1, 0])
    return end


@PART
def _middle(record: Array, step: int, late: float, dt: float, duration: float) -> float:
    """Return the middle of the interval of a step's force [s].

    It is the interval over which the force acted, within the run.
    """
    return min(0.5 * (_end(record, step, late, dt) + _end(record, step - 1, late, dt)), duration)


@PART
def _mean_middle(record: Array, step: int, late: float, dt: float) -> float:
    """Return the instant to which the mean of a step belongs [s]."""
    length = record[step, 0] - record[step - 1, 0]
    middle: float = record[step, 0] - 0.5 * length + late * min(length, dt)
    return middle


@PART
def _step_at(record: Array, late: float, dt: float, t: float) -> int:
    """Return the step whose force acts at an instant, from 1 on."""
    low, high = 0, len(record) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if _end(record, middle, late, dt) <= t:
            low = middle
        else:
            high = middle
    return high


@PART
def _apart(record: Array, step: int, late: float, dt: float) -> float:
    """Return the time between the middles of a step and the next one [s]."""
    return float(_mean_middle(record, step + 1, late, dt) - _mean_middle(record, step, late, dt))


@PART
def _steepness(record: Array, column: int, step: int, late: float, dt: float) -> float:
    """Return the slope between the means of consecutive steps [N/s]."""
    steepness: float = (record[step + 1, column] - record[step, column]) / _apart(record, step, late, dt)
    return steepness


@PART
def _sloped(record: Array, column: int, late: float, dt: float, t: float) -> float:
    """Return a force with the slope of its step (`impactlab.numerics.slopes`)."""
    step, last = _step_at(record, late, dt, t), len(record) - 1
    before = _steepness(record, column, step - 1 if step > 1 else 2, late, dt)
    after = _steepness(record, column, step if step < last else last - 2, late, dt)
    if 1 < step < last:
        slope = min(2.0 * min(abs(before), abs(after)), 0.5 * abs(before + after))
    else:
        own, other = (abs(after), abs(before)) if step == 1 else (abs(before), abs(after))
        near = 1 if step == 1 else last - 1  # of the end cell and its neighbour, then of the two beside them
        apart = _apart(record, near, late, dt)
        beyond = apart / (apart + _apart(record, 2 if step == 1 else last - 2, late, dt))
        slope = min(max(own + beyond * (own - other), 0.0), 2.0 * own)
    if before * after <= 0.0:
        slope = 0.0
    mean: float = record[step, column]
    sloped = mean + math.copysign(slope, before + after) * (t - _mean_middle(record, step, late, dt))
    found: float = max(sloped, min(mean, 0.0))
    return found


@PART
def _lined(record: Array, column: int, late: float, dt: float, duration: float, t: float) -> float:
    """Return a force that is linear between the middles of its steps."""
    step, last = _step_at(record, late, dt, t), len(record) - 1
    if t < _middle(record, step, late, dt, duration):
        step -= 1
    step = min(max(step, 1), last - 1)
    start, end = _middle(record, step, late, dt, duration), _middle(record, step + 1, late, dt, duration)
    share = min(max((t - start) / (end - start), 0.0), 1.0) if end > start else 0.0
    force: float = record[step, column] + share * (record[step + 1, column] - record[step, column])
    return force


@PART
def _force(record: Array, column: int, late: float, dt: float, duration: float, hard: bool, t: float) -> float:
    """Return a contact force at an instant [N]."""
    if hard:
        return _lined(record, column, late, dt, duration, t)
    return _sloped(record, column, late, dt, t)


@ENTRY
def force_at(record: Array, column: int, late: float, dt: float, duration: float, hard: bool, t: float) -> float:
    """Return a contact force at an instant [N]."""
    return _force(record, column, late, dt, duration, hard, t)


@ENTRY
def peak_time(
    record: Array, column: int, late: float, dt: float, duration: float, hard: bool, left_out: Array
) -> float:
    """Return the instant of the largest force outside rising intervals [s].

    It is 0 where there is none. It is the middle of a step, as slopes keep a force between the means of its neighbours,
    or the border of an interval.
    """
    best, largest, interval = 0.0, -math.inf, 0
    for step in range(1, len(record)):
        if record[step, column] > largest:
            t = _middle(record, step, late, dt, duration)
            while interval < len(left_out) and left_out[interval, 1] <= t:
                interval += 1
            if interval == len(left_out) or t <= left_out[interval, 0]:
                best, largest = t, record[step, column]
    for k in range(len(left_out)):
        for t in left_out[k]:
            if 0.0 <= t <= duration:
                force = _force(record, column, late, dt, duration, hard, t)
                if force > largest:
                    best, largest = t, force
    return best


@ENTRY
def mean_size(record: Array, column: int, late: float, dt: float, duration: float, cells: int) -> float:
    """Return the norm of mean forces in middles of equal cells [N]."""
    total, step = 0.0, 1
    for k in range(cells):
        t = (k + 0.5) * (duration / cells)
        while step + 1 < len(record) and _end(record, step, late, dt) <= t:
            step += 1
        total += record[step, column] ** 2
    return math.sqrt(total)
