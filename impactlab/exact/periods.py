"""Impulse and peak force of periods of contact of a march, compiled."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from impactlab.exact.arrays import MarchArrays
from impactlab.exact.batch.reading import mean, piece_at
from impactlab.exact.kernel import chopped, value
from impactlab.numerics.addresses import entered_with_table
from impactlab.numerics.compiling import EXACT_ENTRY, EXACT_PART
from impactlab.types import Array

CONTACT, START, STOP, IMPULSE, PEAK = 0, 1, 2, 3, 4  # columns of a period of contact
SPAN_COLUMNS = 5


@EXACT_PART
def peak_in(m: MarchArrays, r: int, row: int, best: float) -> float:
    """Return the largest value of a row in piece r.

    If the best so far is larger, it is returned.
    """
    piece = m.pieces[r]
    at = piece.offset + row * piece.size
    a = m.pool[at : at + piece.size]
    n = chopped(a, piece.size, 0.0)
    left = right = spread = a[0]
    bend = slope = 0.0
    sign = 1.0
    for k in range(1, n):
        sign = -sign
        left += sign * a[k]
        right += a[k]
        spread += abs(a[k])
        if k > 1:
            bend += k * k * abs(a[k])
        else:
            slope = abs(a[k])
    best = max(best, left, right)
    if spread <= best or bend <= slope:
        return best
    count, place, high = 4 * n, 0, -np.inf
    for i in range(count + 1):
        y = math.cos(math.pi * (count - i) / count)
        here = value(a, n, y)
        if here > high:
            high, place = here, i
    # The largest value may lie beside an end of the piece, too: after a front that only bends the curve.
    low = math.cos(math.pi * min(count, count - place + 1) / count)
    most = math.cos(math.pi * max(0, count - place - 1) / count)
    y = math.cos(math.pi * (count - place) / count)
    for _ in range(6):
        slope, down = derivatives(a, n, y)
        if down >= 0.0:
            break
        y = min(max(y - slope / down, low), most)
    return max(best, high, value(a, n, y))


@EXACT_PART
def derivatives(a: Array, n: int, y: float) -> tuple[float, float]:
    """Return the first and second derivative of a series at y in [-1, 1]."""
    b1 = b2 = d1 = d2 = e1 = e2 = 0.0
    for k in range(n - 1, 0, -1):  # Clenshaw, differentiated twice
        e1, e2 = 2.0 * (y * e1 + 2.0 * d1) - e2, e1
        d1, d2 = 2.0 * (y * d1 + b1) - d2, d1
        b1, b2 = 2.0 * y * b1 - b2 + a[k], b1
    return y * d1 - d2 + b1, y * e1 - e2 + 2.0 * d1


@EXACT_PART
def finish_span(m: MarchArrays, span: Array, peaks: bool) -> None:
    """Write impulse and, on request, peak force of a contact period.

    All pieces that reach into the period count.
    """
    c = int(span[CONTACT])
    j = m.nodes[m.contacts[c].left].junction
    junction = m.junctions[j]
    row = 2 * junction.nodes + 2 * junction.ends + c - junction.first_contact
    slack, last = m.state[0].tolerance, len(m.pieces) // len(m.junctions) * j + junction.records
    until = min(span[STOP], m.state[0].duration)
    total, peak = 0.0, 0.0
    r = piece_at(m, j, span[START])
    while r < last and m.pieces[r].start < until - slack:
        piece = m.pieces[r]
        at = piece.offset + row * piece.size
        total += 0.5 * (piece.stop - piece.start) * mean(m.pool[at : at + piece.size], piece.size, False)
        if peaks:
            peak = peak_in(m, r, row, peak)
        r += 1
    span[IMPULSE], span[PEAK] = total, peak


@EXACT_ENTRY
def finish_spans(m: MarchArrays, spans: Array) -> None:
    """Write impulse and peak force of every period of contact.

    Rows are (contact, start, stop, impulse, peak).
    """
    for k in range(len(spans)):
        finish_span(m, spans[k], True)


def finished(memory: MarchArrays, periods: Sequence[tuple[int, float, float]]) -> list[tuple[float, float]]:
    """Return impulse [N s] and peak force [N] of each period.

    A period is (contact of the network, start [s], stop [s]).
    """
    spans = np.zeros((len(periods), SPAN_COLUMNS))
    spans[:, :IMPULSE] = periods
    entered_with_table(finish_spans, memory, spans)
    return [(impulse, peak) for impulse, peak in spans[:, IMPULSE:].tolist()]
