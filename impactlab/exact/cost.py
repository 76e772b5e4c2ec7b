"""Predicted cost of the exact solver by extrapolation in time.

Operations of the first intervals are counted and extrapolated as a power of time. Intervals and multiplications are
counted, not seconds: the same scene always has the same prediction.
"""

from __future__ import annotations

import math
import time as clock
from dataclasses import dataclass
from typing import TYPE_CHECKING

from impactlab.exact.arrays import MORE_EVENTS, MORE_POOL, MORE_RECORDS, PAUSED
from impactlab.exact.setup.build import build
from impactlab.exact.setup.network import Log, NetworkLayout, grown
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from impactlab.startup.lazy import lazy

if TYPE_CHECKING:
    from impactlab.exact import march
else:  # compiled code, needed only when a march starts
    march = lazy("impactlab.exact.march")

# Seconds, fitted to 150 random scenes (benchmarks/exact_cost.py) on one idle core of 2023.
FIXED_S = 6.0e-6
INTERVAL_S = 4.0e-7  # an interval of a junction
WORK_S = 1.0e-9  # a multiplication
NUMBER_S = 2.0e-9  # a number kept
PILOT_S = 4.0e-3  # s of predicted solution time that are counted: most scenes of the suite take less in all
FIRST_COUNT = 128  # intervals up to the first count; doubled for each further one
MAX_POWER = 6.0  # power of time with which the cost may grow: fronts in rods of four or more incommensurate transits


@dataclass
class StartedMarch:
    """A march over its first intervals, which `impactlab.exact.solve.solve` goes on with, once."""

    layout: NetworkLayout
    log: Log
    status: int  # in which the march returned
    predicted_s: float  # s, of the whole solution, without its set-up
    setup_s: float  # s, measured
    march_s: float  # s, measured
    used: bool = False  # its arrays are those of a march that has gone on


def spent(log: Log) -> float:
    """Return the predicted seconds of a march so far."""
    state = log.state
    return float(FIXED_S + INTERVAL_S * state["intervals"] + WORK_S * state["work"] + NUMBER_S * state["pool_used"])


def predicted_s(scene: Scene, method: Method) -> float:
    """Return the predicted seconds of `impactlab.exact.solve.solve`; raises `CaseError` where it does not apply."""
    return begin(scene, method).predicted_s


def begin(scene: Scene, method: Method) -> StartedMarch:
    """Return a march over the first intervals, with the predicted seconds of all.

    Raises
    ------
    CaseError, PairingError
        Where the solver does not support the scene.
    """
    began = clock.perf_counter()
    layout, log = build(scene, method)
    log = march.prepared(log)
    ready = clock.perf_counter()
    counts: list[tuple[float, float]] = []  # (time reached, seconds)
    log.state["most"] = FIRST_COUNT
    predicted, status = math.nan, PAUSED
    while math.isnan(predicted):
        status = march.march(log)
        if status == PAUSED:
            counts.append((log.reached, spent(log)))
            log.state["most"] = FIRST_COUNT * 2 ** len(counts)
            if counts[-1][1] > PILOT_S:
                predicted = _extrapolated(counts, scene.duration)
        elif status in (MORE_RECORDS, MORE_POOL, MORE_EVENTS):
            log = grown(log, status)
        else:
            break
    marched = clock.perf_counter() - ready
    predicted = spent(log) if math.isnan(predicted) else predicted
    return StartedMarch(layout, log, status, predicted, ready - began, marched)


def _extrapolated(counts: list[tuple[float, float]], duration: float) -> float:
    """Return the time of the whole march [s], extrapolated by the power of the last counts."""
    reached, cost = counts[-1]
    before, less = counts[-2] if len(counts) > 1 else (0.0, 0.0)
    power = 1.0
    if 0.0 < before < reached and less > 0.0:
        power = min(max(1.0, math.log(cost / less) / math.log(reached / before)), MAX_POWER)
    return cost * (duration / reached) ** power if reached > 0.0 else math.inf
