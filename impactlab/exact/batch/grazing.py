"""Detection of nearly grazing contacts in a march as in `impactlab.metrics.grazing`, compiled."""

from __future__ import annotations

from impactlab.exact.arrays import MarchArrays
from impactlab.exact.batch.reading import piece_at
from impactlab.exact.periods import CONTACT, START, STOP
from impactlab.metrics.grazing import (
    MAX_NEAR_GAP,
    MAX_RUN_SAMPLES,
    MAX_SAMPLES,
    MIN_CONTACT,
    MIN_FLIGHT,
    MIN_GAP,
    MIN_MEETING_RATE,
    SAMPLES,
)
from impactlab.numerics.compiling import EXACT_PART
from impactlab.types import Array

MIN_SAMPLES = 16  # of a flight
WIDEST_SAMPLES = MAX_SAMPLES // 10
BLOCK = 64  # instants that are evaluated side by side
GAP_ROOM = MAX_SAMPLES + MIN_SAMPLES


@EXACT_PART
def sample_gap(m: MarchArrays, c: int, t0: float, t1: float, count: int, gap: Array) -> None:
    """Write the gap of a contact at equal instants [m].

    There are ``count`` instants from t0 to t1, in gap[:count].
    """
    contact = m.contacts[c]
    j = m.nodes[contact.left].junction
    junction = m.junctions[j]
    series, x, late, early = m.waves[0], m.stack[0], m.stack[1], m.stack[2]
    step = (t1 - t0) / (count - 1)
    i, r = 0, piece_at(m, j, t0)
    last = len(m.pieces) // len(m.junctions) * j + junction.records - 1
    while i < count:
        piece = m.pieces[r]
        n, half = piece.size, 0.5 * (piece.stop - piece.start)
        left = piece.offset + (junction.nodes + contact.left - junction.first_node) * n
        right = piece.offset + (junction.nodes + contact.right - junction.first_node) * n
        used = 1
        for k in range(n):
            series[k] = m.pool[right + k] - m.pool[left + k]
            if series[k] != 0.0:
                used = k + 1
        series[0] += contact.gap
        while i < count:
            size = min(BLOCK, count - i)
            if r < last:
                inside = int((piece.stop - t0) / step) - i + 1
                if inside <= 0:
                    break
                size = min(size, inside)
            for k in range(size):
                x[k] = min(max((t0 + step * (i + k) - piece.start) / half - 1.0, -1.0), 1.0)
                late[k] = early[k] = 0.0
            for order in range(used - 1, 0, -1):
                a = series[order]
                for k in range(size):
                    here = 2.0 * x[k] * late[k] - early[k] + a
                    early[k] = late[k]
                    late[k] = here
            for k in range(size):
                gap[i + k] = x[k] * late[k] - early[k] + series[0]
            i += size
        r = min(r + 1, last)


@EXACT_PART
def samples_of(length: float, trip: float, most: float) -> int:
    """Return the instants at which a flight of a length [s] is sampled."""
    return int(min(most, MIN_SAMPLES + SAMPLES * length / trip))


@EXACT_PART
def meets_slowly(gap: Array, count: int, least: float) -> bool:
    """Return whether faces rest against each other after a flight wider than ``least`` [m]."""
    fastest, widest = 0.0, gap[0]
    for i in range(1, count):
        fastest, widest = max(fastest, abs(gap[i] - gap[i - 1])), max(widest, gap[i])
    last = gap[count - 2] - gap[count - 1]
    return bool(widest > least and 0.0 < last < MIN_MEETING_RATE * fastest)


@EXACT_PART
def nearest(gap: Array, count: int, least: float) -> float:
    """Return the largest gap before a near miss in a flight [m].

    It is 0 for no near miss; gaps grew beyond ``least`` before it.
    """
    largest = gap[0]
    for i in range(1, count - 1):
        largest = max(largest, gap[i])
        minimum = gap[i] < gap[i - 1] and gap[i] <= gap[i + 1]
        if minimum and largest > least and 0.0 <= gap[i] < MAX_NEAR_GAP * largest:
            return float(largest)
    return 0.0


@EXACT_PART
def write_merged_periods(spans: Array, count: int, c: int, periods: Array) -> int:
    """Write the periods of a contact, those without time between as one; return their number."""
    found = 0
    for k in range(count):
        if spans[k, CONTACT] != c:
            continue
        if found > 0 and spans[k, START] <= periods[found - 1, STOP]:
            periods[found - 1, STOP] = spans[k, STOP]
        else:
            periods[found, START], periods[found, STOP] = spans[k, START], spans[k, STOP]
            found += 1
    return found


@EXACT_PART
def grazes(m: MarchArrays, c: int, spans: Array, count: int, trip: float, periods: Array, gap: Array) -> bool:
    """Return whether a small change of the case may alter the contact count.

    This is the number of periods of contact. ``periods`` and ``gap`` are room for the periods and for samples.
    """
    duration, widest = m.state[0].duration, -1.0
    rounding = MIN_GAP * m.state[0].fastest * duration
    found = write_merged_periods(spans, count, c, periods)
    most = min(float(MAX_SAMPLES), float(MAX_RUN_SAMPLES // max(1, found)))
    for k in range(found):
        if periods[k, STOP] - periods[k, START] < MIN_CONTACT * trip:
            return True
    begin = 0.0
    for k in range(found):
        start = periods[k, START]
        if start - begin > MIN_CONTACT * trip:
            samples = samples_of(start - begin, trip, MIN_SAMPLES + most)
            sample_gap(m, c, begin, start, samples, gap)
            if meets_slowly(gap, samples, rounding):
                return True
        begin = min(periods[k, STOP], duration)
    for k in range(found):
        end = periods[k, STOP]
        until = periods[k + 1, START] if k + 1 < found else duration
        if end >= until:
            continue
        samples = samples_of(until - end, trip, most)
        sample_gap(m, c, end, until, samples, gap)
        if nearest(gap, samples, rounding) > 0.0:
            if widest < 0.0:
                sample_gap(m, c, 0.0, duration, WIDEST_SAMPLES, gap)
                widest = gap[0]
                for i in range(1, WIDEST_SAMPLES):
                    widest = max(widest, gap[i])
                sample_gap(m, c, end, until, samples, gap)
            if nearest(gap, samples, max(rounding, MIN_FLIGHT * widest)) > 0.0:
                return True
    return False
