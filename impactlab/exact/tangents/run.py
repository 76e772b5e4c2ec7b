"""Runs the exact solver with tangents."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from impactlab.errors import StepError
from impactlab.exact.arrays import DONE, MORE_EVENTS, MORE_POOL, MORE_RECORDS
from impactlab.exact.march import prepared
from impactlab.exact.setup.network import Log, NetworkLayout, with_room
from impactlab.exact.tangents.arrays import Rates, TangentArrays, tangent_arrays
from impactlab.exact.tangents.march import MORE_TANGENTS, advance
from impactlab.exact.tangents.springs import with_springs
from impactlab.numerics.addresses import entered

MAX_INTERVALS = 20_000  # of a run with tangents: some seconds


class Solved(NamedTuple):
    """A march with tangents."""

    layout: NetworkLayout
    log: Log
    tangents: TangentArrays


def solve(build: Callable[[], tuple[NetworkLayout, Log]], rates: Rates) -> Solved:
    """March a network with the tangents of its waves and events by parameters.

    Raises
    ------
    StepError
        If the march does not reach the end.
    """
    pieces = events = pool = 0
    while True:
        layout, log = build()
        log = prepared(with_room(log, pieces, pool, events))
        log.state["most"] = MAX_INTERVALS
        tangents = with_springs(log.memory, tangent_arrays(log, rates))
        status = int(entered(advance, log.memory, tangents, np.zeros(len(rates.state))))
        if status == DONE:
            return Solved(layout, log, tangents)
        if status not in (MORE_RECORDS, MORE_POOL, MORE_EVENTS, MORE_TANGENTS):
            raise StepError(
                "the exact solution with tangents did not reach the end of the run",
                time=log.reached,
                step=int(log.state["intervals"]),
                path="solve.duration",
                remedy="Give a shorter duration, or a contact law that is not hard.",
            )
        pieces = log.pieces.shape[1] * (2 if status == MORE_RECORDS else 1)
        events = len(log.events) * (2 if status == MORE_EVENTS else 1)
        pool = len(log.pool) * (2 if status in (MORE_POOL, MORE_TANGENTS) else 1)
