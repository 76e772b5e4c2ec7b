"""Ranges of the state that forces change, found before the first step.

Also found are the entries that faces are read from, and even momentum rows. They are found in compiled code: numpy
takes longer over responses of a few hundred entries than the first steps do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from impactlab.numerics.compiling import ENTRY, PART
from impactlab.simulate.stepping.arrays import BodyRecord, FaceRecord, LoadRecord, PushRecord
from impactlab.types import Array, Ints

MIN_EVEN = 16  # coordinates: a shorter momentum row is soon read
SAME_TOL = 4.0 * float(np.finfo(float).eps)  # of an entry of the momentum row: others differ by rounding
RESPONSE_TOL = 1e-20  # of a response's largest entry: smaller entries at its ends are far below rounding


@ENTRY
def write_ranges(
    records: Sequence[FaceRecord] | Sequence[LoadRecord] | Sequence[PushRecord],
    kinds: int,
    bodies: Sequence[BodyRecord],
    phased: Ints,
    responses: Array,
) -> None:
    """Write the ranges of displacements, velocities and other state with nonzero response.

    ``kinds`` are the responses of a record: 1 to a force, 3 to a force, an impulse and a projection. Of a body with
    phases (``phased``, (n_bodies,)), and of a mechanism, they are whole: the response changes within the run.
    """
    for number in range(len(records)):
        record = records[number]
        body = bodies[record.body]
        size, n = body.state_end - body.state_start, body.n_dof
        changes = body.columns != 0 or phased[record.body] != 0
        for kind in range(kinds):
            start = body.response_start + (kind * body.n_ports + record.place) * size
            for part in range(3):
                begin, end = part * n, size if part == 2 else min((part + 1) * n, size)
                low, high = nonzero_range(responses, start, begin, end, changes)
                if high > low:
                    record.low[3 * kind + part], record.high[3 * kind + part] = low, high


@PART
def nonzero_range(responses: Array, start: int, begin: int, end: int, whole: bool) -> tuple[int, int]:
    """Return the range of the nonzero entries of a part of a response.

    Entries within rounding are zero; the range of none is (0, 0).
    """
    if whole:
        return begin, end
    largest, first, last = 0.0, 0, 0
    for i in range(begin, end):
        largest = max(largest, abs(responses[start + i]))
    least = RESPONSE_TOL * largest
    for i in range(begin, end):
        if abs(responses[start + i]) > least:
            if last == 0:
                first = i
            last = i + 1
    return first, last


@PART
def write_entries(faces: Sequence[FaceRecord], row_start: Ints, row_index: Ints, row_value: Array) -> None:
    """Write the entries of the state that are a face's displacement and velocity.

    They are -1 where these are sums.
    """
    for number in range(len(faces)):
        u_at = alone(number, row_start, row_index, row_value)
        v_at = alone(len(faces) + number, row_start, row_index, row_value)
        if u_at < 0 or v_at < 0:
            u_at, v_at = -1, -1
        faces[number].u_at, faces[number].v_at = u_at, v_at


@PART
def alone(row: int, row_start: Ints, row_index: Ints, row_value: Array) -> int:
    """Return the entry of the state that a sparse row is.

    It is -1 where the row is not that entry alone.
    """
    at = row_start[row]
    if row_start[row + 1] - at == 1 and row_value[at] == 1.0:
        return int(row_index[at])
    return -1


@PART
def write_even(bodies: Sequence[BodyRecord], phased: Ints, momentum: Array) -> None:
    """Write whether a body has a momentum row, and the entry that all its inner coordinates share.

    Its outer two coordinates may differ.
    """
    for number in range(len(bodies)):
        body = bodies[number]
        body.has_row = phased[number]
        for i in range(body.state_start + body.n_dof, body.state_start + 2 * body.n_dof):
            if momentum[i] != 0.0:
                body.has_row = 1
        if body.n_dof < MIN_EVEN or phased[number] != 0:
            continue
        first, end = body.state_start + body.n_dof + 1, body.state_start + 2 * body.n_dof - 1
        even, apart = momentum[first], 0.0
        for i in range(first, end):
            apart = max(apart, abs(momentum[i] - even))
        body.even = even if apart <= SAME_TOL * abs(even) else 0.0


@ENTRY
def describe(
    bodies: Sequence[BodyRecord],
    faces: Sequence[FaceRecord],
    phased: Ints,
    momentum: Array,
    responses: Array,
    row_start: Ints,
    row_index: Ints,
    row_value: Array,
    probe_at: Ints,
    first_probe: int,
) -> None:
    """Write even momenta, ranges of faces, and entries of faces and probes.

    The rows of probes begin at ``first_probe``. Rows of two phases have no lone entry.
    """
    write_even(bodies, phased, momentum)
    write_ranges(faces, 3, bodies, phased, responses)
    write_entries(faces, row_start, row_index, row_value)
    for number in range(len(bodies)):
        if phased[number] != 0:
            for face in range(len(faces)):
                faces[face].u_at, faces[face].v_at = -1, -1
            return
    for probe in range(len(probe_at)):
        probe_at[probe] = alone(first_probe + probe, row_start, row_index, row_value)
