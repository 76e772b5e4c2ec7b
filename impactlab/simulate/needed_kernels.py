"""Compiled functions that a run will need, compiled side by side before its set-up if not on disk."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING, Any, get_args, get_type_hints

import numpy as np
from numba import types

from impactlab.exact.setup.network import empty_log, with_room
from impactlab.numerics.addresses import RESPOND, type_of
from impactlab.numerics.ahead import Kernel
from impactlab.numerics.records import records
from impactlab.scene.method import Method, is_exact, laws_of
from impactlab.scene.problem import Scene
from impactlab.simulate.stepping import loop
from impactlab.simulate.stepping.arrays import SOLVE_SEVERAL, StepArrays
from impactlab.simulate.stepping.pieces import kernel_of
from impactlab.startup.lazy import lazy
from impactlab.types import Array, Ints

if TYPE_CHECKING:
    from impactlab.exact import end_balance, march, periods
    from impactlab.simulate.stepping import located
else:  # compiled code, which few runs need
    end_balance, march = lazy("impactlab.exact.end_balance"), lazy("impactlab.exact.march")
    periods = lazy("impactlab.exact.periods")
    located = lazy("impactlab.simulate.stepping.located")

NUMBER, WHOLE = types.float64, types.int64
DIMENSIONS = {
    "dashpots": 2, "beads": 2, "bead_contacts": 2, "influence": 3, "own_influence": 2, "left_out": 2, "record": 2,
    "sample": 2, "snapshot_state": 3, "system": 2,
}  # fmt: skip
"""Of the arrays of the loop that are not flat."""


@cache
def type_of_arrays() -> Any:
    """Return the type of the arrays of the step loop, the same for all runs."""
    made: dict[str, Any] = {}
    for name, kind in get_type_hints(StepArrays).items():
        if kind in (Array, Ints):
            made[name] = np.zeros((0,) * DIMENSIONS.get(name, 1), float if kind == Array else np.int64)
        else:
            made[name] = records(get_args(kind)[0], 0)[1]
    return type_of(StepArrays(**made))


def of_steps(scene: Scene, method: Method) -> Iterator[Kernel]:
    """Yield the kernels of a stepped run that no body determines.

    Those that take longest to compile come first. An exact run has none.
    """
    if is_exact(scene, method):
        return
    arrays = type_of_arrays()
    laws = {law.respond for law in laws_of(scene, method) if law.compiled}
    yield from (Kernel(respond, RESPOND) for respond in laws)
    if method.events == "located":
        yield Kernel(located.advance_located, (arrays, NUMBER, WHOLE, WHOLE, WHOLE))
    else:
        yield Kernel(loop.advance_dated, (arrays, NUMBER, WHOLE, WHOLE, WHOLE))
    yield Kernel(loop.start, (arrays, NUMBER))
    if len(scene.contacts) > 1:
        yield kernel_of(SOLVE_SEVERAL, arrays)


def of_exact() -> Iterator[Kernel]:
    """Yield the kernels of an exact solution, the one that takes longest first."""
    arrays = type_of(with_room(empty_log(1, 1, 1, 1, 1), 1, 1, 1).memory)
    yield from (Kernel(march.advance, (arrays,)), Kernel(end_balance.end_error, (arrays,)))
    yield Kernel(periods.finish_spans, (arrays, type_of(np.zeros((0, periods.SPAN_COLUMNS)))))
