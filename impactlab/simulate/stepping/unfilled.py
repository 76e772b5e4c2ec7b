"""Placeholder for an uncompiled piece of the step loop: it ends the run.

A call of address 0 would end the process without a word. This one is a fault of the program, and the error states it.
"""

from __future__ import annotations

import ctypes
import threading
from functools import cache, partial
from typing import Any

from impactlab.errors import StepError
from impactlab.numerics.addresses import COMPILED, kernel_address
from impactlab.simulate.stepping.arrays import PIECES, ClockRecord, StepArrays

_kept: list[Any] = []  # C functions, which must live as long as they may be called


class _Called(threading.local):
    """The missing piece that a loop of this thread called; None so far."""

    piece: int | None = None


_called = _Called()


def end_run(piece: int, clock: Any) -> None:
    """Note that a piece is missing, and end the loop.

    The clock is set to the last step, so that the loop returns.
    """
    _called.piece = piece
    clock.step = clock.steps


def from_loop(piece: int, table: int) -> None:
    """Call `end_run` from the compiled loop with its table of arrays.

    The first word of the table is the address of the clock.
    """
    end_run(piece, ClockRecord.from_address(ctypes.c_int64.from_address(table).value))


def from_python(piece: int, m: StepArrays, *_: float) -> None:
    """The same, called by the loop in plain Python."""
    end_run(piece, m.clock[0])


@cache
def address_without(piece: int) -> int:
    """Return the address to call where a piece is missing.

    Numbers that it is given beside the arrays are ignored.
    """
    if not COMPILED:
        return kernel_address(partial(from_python, piece), None)
    _kept.append(ctypes.CFUNCTYPE(None, ctypes.c_void_p)(partial(from_loop, piece)))
    return int(ctypes.cast(_kept[-1], ctypes.c_void_p).value or 0)


@cache
def addresses_without() -> tuple[int, ...]:
    """Return the addresses of all pieces of a scene that needs none."""
    return tuple(map(address_without, range(PIECES)))


def check_called(clock: ClockRecord) -> None:
    """Raise `StepError` where the loop has called a piece that is missing."""
    if (piece := _called.piece) is not None:
        _called.piece = None
        raise StepError(
            f"the step loop called its piece {piece} (see `stepping.arrays`), which was not set up",
            time=clock.time,
            step=round(clock.time / clock.timed),
            remedy="This is a fault of impactlab, not of the case. Report it, with the case.",
        )
