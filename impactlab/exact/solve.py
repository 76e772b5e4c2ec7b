"""The exact answer of a scene of uniform rods, rigid masses and walls, from event to event."""

from __future__ import annotations

import time as clock

import numpy as np

from impactlab.errors import CaseError, PairingError, StepError
from impactlab.exact.build import build
from impactlab.exact.history import ContinuousHistory
from impactlab.exact.network import Layout, Log, grown
from impactlab.scene import Scene

DIGITS = 1e-6  # of the energy in play: a balance that is off by more is no rounding
MOST_FLOATS = 60_000_000  # of stored coefficients: half a gigabyte
MOST_INTERVALS = 3_000_000


def serves(scene: Scene) -> str | None:
    """Return None where `solve` answers the scene, else the reason in one sentence; looks at bodies and contacts."""
    try:
        build(scene)
    except (CaseError, PairingError) as error:
        return error.text
    return None


def solve(scene: Scene) -> ContinuousHistory:
    """Return the exact history of a scene.

    Each end of a rod emits a wave and receives what the other end emitted one transit earlier. Between breaks
    every signal is one Chebyshev piece; nodes with mass or springs obey linear differential equations, solved
    spectrally; events are first zeros found by isolation. There is no time step.

    Raises
    ------
    CaseError, PairingError
        Before the start, for a scene that cannot be served.
    StepError
        When events or pieces come without end; carries what was reached.

    References
    ----------
    StVenant1883; TimoshenkoGoodier1951; EscalonaMayoDominguez1999, Section 2. The paper solves the first two
    intervals by hand; here any number of them, contacts and rods is solved.
    """
    from impactlab.exact import march

    began = clock.perf_counter()
    layout, log = build(scene)
    coupled = march.springs(layout.network)
    ready = clock.perf_counter()
    log.tally[3] = MOST_INTERVALS
    while True:
        status = march.march(log, coupled)
        if status == march.DONE:
            break
        if status in (march.TOO_MANY, march.UNRESOLVED, march.PAUSED) or len(log.pool) > MOST_FLOATS:
            stop(scene, layout, log, status == march.UNRESOLVED)
        log = grown(log, status == march.MORE_RECORDS, status == march.MORE_POOL, status == march.MORE_EVENTS)
    history = ContinuousHistory(scene, layout, log, scene.duration)
    history.cost.setup_s = ready - began
    history.cost.solve_s = clock.perf_counter() - ready
    check_balance(history)
    return history


def check_balance(history: ContinuousHistory) -> None:
    """Raise `StepError` where the energy of an exact history does not balance: its digits are lost."""
    book = history.energy
    given = max(float(np.abs(book.total[0])), float(np.abs(book.work).max()))
    error = float(np.max(np.abs(book.balance)))
    if not error <= DIGITS * (given or float(np.abs(book.total).max())):
        raise StepError(
            "the exact solution lost its digits: its energy does not balance",
            time=history.duration,
            step=history.cost.steps,
            history=history,
            path="solve.model",
            remedy="Give a softer spring, or a model that steps.",
        )


def stop(scene: Scene, layout: Layout, log: Log, unresolved: bool) -> None:
    """Raise the `StepError` of a march that has no end, with what was reached."""
    reached = float(min(log.clock))
    history = ContinuousHistory(scene, layout, log, reached) if reached > 0.0 else None
    text = "the exact solution could not be resolved" if unresolved else "contacts or waves come without end"
    raise StepError(
        text,
        time=reached,
        step=int(log.tally[2]),
        history=history,
        path="solve.model",
        remedy="Give a shorter duration, softer springs, or a model that steps.",
    )
