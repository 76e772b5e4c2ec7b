"""Arrays of records: ctypes structures as numpy types.

Compiled code and plain Python read them under the same names.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from impactlab.numerics.addresses import COMPILED
from impactlab.structures import Record
from impactlab.types import Array

FLOATS_PER_LINE = 8  # of memory, 64 bytes


def records(kind: type[Record], count: int) -> tuple[Sequence[Record], Sequence[Record]]:
    """Return zeroed records by name, and for the loop.

    The first are C structures to write by name, the second are the same memory in the form that the loop takes.
    """
    if not count:
        return _none(kind)
    if not COMPILED:
        made: Any = array_of(kind, count)()
        return made, made
    return _both_of(kind, count, bytearray(count * dtype_of(kind).itemsize))


def on_lines(size: int) -> Array:
    """Return zeros (size,) that begin with a line of memory.

    Writing eight entries across two lines takes twice the time.
    """
    room = np.zeros(size + FLOATS_PER_LINE)
    first = -(room.__array_interface__["data"][0] // room.itemsize) % FLOATS_PER_LINE
    return room[first : first + size]


def copied_on_lines(array: Array) -> Array:
    """Return a copy of an array that begins with a line of memory, too."""
    made = on_lines(array.size).reshape(array.shape)
    made[:] = array
    return made


def copied(array: Any) -> Any:
    """Return a copy of an array, (n,) if of records.

    It is made byte by byte, where numpy copies field by field.
    """
    if array.dtype.names is None:
        return array.copy()
    return np.frombuffer(bytearray(array.tobytes()), array.dtype) if array.size else array


def copied_records(kind: type[Record], taken: Any) -> tuple[Sequence[Record], Any]:
    """Return a copy of records, as `records` does.

    They are in the form that the loop takes, (n,).
    """
    return _both_of(kind, taken.size, bytearray(taken.tobytes())) if taken.size else _none(kind)


def _both_of(kind: type[Record], count: int, memory: bytearray) -> tuple[Sequence[Record], Any]:
    """Return C structures and the loop's records on the same bytes.

    A view of a numpy array takes far longer.
    """
    return array_of(kind, count).from_buffer(memory), np.frombuffer(memory, dtype_of(kind))


def columns(kind: type[Record], count: int) -> tuple[Sequence[Record], Any]:
    """Return zeroed records for the loop, and the same as columns.

    The second is an array with named columns on the same memory.
    """
    if COMPILED:
        array: Any = np.zeros(count, dtype_of(kind))
        return array, array
    structures: Any = (kind * count)()
    return structures, np.frombuffer(structures, dtype_of(kind)) if count else np.zeros(0, dtype_of(kind))


@cache
def _none(kind: type[Record]) -> tuple[Sequence[Record], Sequence[Record]]:
    made: Any = array_of(kind, 0)()
    taken: Any = np.zeros(0, dtype_of(kind)) if COMPILED else made
    return made, taken


@cache
def array_of(kind: type[Any], count: int) -> Any:
    """Return the type of an array of records."""
    return kind * count


@cache
def dtype_of(kind: type[Any]) -> Any:
    """Return the numpy type of a record.

    It is kept, as making it takes longer than a short run.
    """
    return np.dtype(kind)
