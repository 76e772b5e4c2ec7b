"""Exact solution of rods, masses and walls from event to event: d'Alembert waves, Chebyshev pieces."""

from __future__ import annotations

import contextlib
import dataclasses
import time as clock
from typing import TYPE_CHECKING

import numpy as np

from impactlab.errors import CaseError, PairingError, StepError
from impactlab.exact.arrays import DONE, MORE_POOL, MORE_RECORDS, PAUSED, TOO_MANY, UNRESOLVED
from impactlab.exact.cost import StartedMarch
from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.results.thinned import ThinnedHistory, Thinner, oldest
from impactlab.exact.setup.build import build
from impactlab.exact.setup.network import Log, NetworkLayout, copied, grown, needed, with_room
from impactlab.history.energy import MIN_ENERGY
from impactlab.numerics.addresses import COMPILED
from impactlab.scene.method import Method, Simulation
from impactlab.scene.problem import Scene
from impactlab.scene.recent import KeepsResults
from impactlab.scene.sizes import BYTES, in_bytes, memory_limit
from impactlab.startup.lazy import lazy
from impactlab.startup.wall_time import spent_on
from impactlab.types import Progress

if TYPE_CHECKING:
    from impactlab.exact import end_balance, march
else:  # compiled code, needed only when a march starts
    end_balance, march = lazy("impactlab.exact.end_balance"), lazy("impactlab.exact.march")

BALANCE_TOL = 1e-6  # of the reference energy: a larger error of the balance is not rounding
CLOSED_TOL = 1e-12  # of the same: a smaller error at the end is rounding, and nothing was lost on the way
MAX_KEPT_SHARE = 0.1  # of the memory allowed, for all waves of a run; beyond it they are sampled and dropped
MAX_WHOLE_SHARE = 0.25  # the same where every wave is needed: references are evaluated at any time
PIECE_NUMBERS = 4  # kept for a piece, besides its coefficients
INTERVALS_PER_CHECK = 50_000  # intervals between two checks of the memory and reports of progress: 0.02 to 0.5 s
MAX_KEPT_NUMBERS = 100_000  # of a network that is kept for the next run of the same scene
MAX_INTERVALS = 30_000_000  # some minutes, as an interval takes 0.5 to 10 us


class Network:
    """The network of a scene with its log, used by the first march and copied for others."""

    def __init__(self, scene: Scene, method: Method) -> None:
        self._run = scene, method
        self.layout, log = build(scene, method)
        self.is_kept = COMPILED and room(log) + log.memory.stack.size <= MAX_KEPT_NUMBERS
        self._first = [log]
        self._kept: Log | None = None  # to copy

    def log(self) -> Log:
        """Return a log that no march has written into.

        Nothing is copied for a scene that is run once.
        """
        with contextlib.suppress(IndexError):
            return self._first.pop()
        self._kept = self._kept or build(*self._run)[1]
        return copied(self._kept)


built = KeepsResults(Network, lambda made: made.is_kept)


def network(scene: Scene, method: Method) -> tuple[NetworkLayout, Log]:
    """Return the network of a scene, with arrays of its own; raises `CaseError` or `PairingError`."""
    made = built(scene, method)
    return dataclasses.replace(made.layout, carried={}), made.log()


def serves(scene: Scene, method: Method) -> str | None:
    """Return None if `solve` supports a scene, else a sentence with the reason."""
    try:
        built(scene, method)
    except (CaseError, PairingError) as error:
        return error.text
    return None


def solve(
    scene: Scene,
    method: Method,
    whole: bool = False,
    progress: Progress | None = None,
    begun: StartedMarch | None = None,
) -> ContinuousHistory | ThinnedHistory:
    """Return the exact history of a scene.

    Each end of a rod emits a wave and receives the one that the other end emitted a transit earlier. Between breaks
    every signal is one Chebyshev piece; nodes with mass or springs obey linear differential equations, solved
    spectrally; events are first zeros found by isolation. There is no time step.

    If the waves need more than a tenth of the memory allowed, the run is sampled at its ``records`` instants as it
    proceeds (`impactlab.exact.results.thinned`), unless it must be kept ``whole``. ``progress`` is called with the
    fraction of the duration that every body has reached. A march of the same scene that has ``begun`` is gone on with,
    unless it has been used already.

    Raises
    ------
    CaseError, PairingError
        Before the start, for a scene that the solver does not support.
    StepError
        If events or pieces accumulate without limit; carries the history so far.

    References
    ----------
    StVenant1883; TimoshenkoGoodier1951; EscalonaMayoDominguez1999, Section 2. The paper solves the first two
    intervals by hand; here any number of them, contacts and rods is solved.
    """
    began, run = clock.perf_counter(), Simulation(scene, method)
    if begun is not None and begun.used:
        begun = None
    with spent_on("set-up"):
        if begun is None:
            layout, log = network(scene, method)
            log = march.prepared(log)
        else:
            layout, log = begun.layout, begun.log
            begun.used = True
    ready = clock.perf_counter()
    with spent_on("solving"):
        history = marched(run, layout, log, whole, progress, begun)
    history.cost.setup_s = ready - began + (begun.setup_s if begun else 0.0)
    history.cost.solve_s = clock.perf_counter() - ready + (begun.march_s if begun else 0.0)
    solved = clock.perf_counter()
    with spent_on("checks"):
        if not (isinstance(history, ContinuousHistory) and end_balance.error_at_end(history.log) <= CLOSED_TOL):
            check_balance(history)
    history.cost.checks_s = clock.perf_counter() - solved
    return history


def marched(
    run: Simulation, layout: NetworkLayout, log: Log, whole: bool, progress: Progress | None, begun: StartedMarch | None
) -> ContinuousHistory | ThinnedHistory:
    """Return the history of a march to the end, with the arguments of `solve`."""
    scene = run.scene
    thinner: Thinner | None = None
    log.state["most"] = log.state["intervals"] + INTERVALS_PER_CHECK
    if begun is not None and begun.status in (TOO_MANY, UNRESOLVED):
        stop(run, layout, log, reason(run, layout, log, begun.status), thinner)
    done = begun is not None and begun.status == DONE
    while not done and (status := march.march(log)) != DONE:
        if status in (TOO_MANY, UNRESOLVED) or log.state["intervals"] >= MAX_INTERVALS:
            stop(run, layout, log, reason(run, layout, log, status), thinner)
        if status == PAUSED:
            log.state["most"] += INTERVALS_PER_CHECK
            if progress is not None:
                progress(log.reached / scene.duration)
            continue
        most = (MAX_WHOLE_SHARE if whole else MAX_KEPT_SHARE) * memory_limit() / BYTES
        larger = with_more_room(log, status, most)
        if larger is not None:
            log = larger
        else:
            numbers, pieces = needed(log, oldest(log))
            if whole or 2 * numbers > len(log.pool) or 2 * pieces > log.pieces.shape[1]:  # before they are sampled
                stop(run, layout, log, too_large(run, log, most), thinner)
            thinner = thinner or Thinner(run, layout, log)
            log = thinner.take(log)
    return thinner.finish(log, scene.duration) if thinner else ContinuousHistory(run, layout, log, scene.duration)


def room(log: Log) -> int:
    """Return the numbers that a log has room for."""
    return len(log.pool) + PIECE_NUMBERS * int(log.pieces.size)


def with_more_room(log: Log, status: int, most: float) -> Log | None:
    """Return the log with more room, at most twice, in the array that is full; None where it has ``most`` numbers."""
    spare, pool = int(most) - room(log), len(log.pool)
    if status == MORE_POOL and pool > spare > pool // 4:
        return with_room(log, 0, pool + spare, 0)
    more = {MORE_POOL: pool, MORE_RECORDS: PIECE_NUMBERS * int(log.pieces.size)}.get(status, 0)
    return grown(log, status) if more <= spare else None


def check_balance(history: ContinuousHistory | ThinnedHistory) -> None:
    """Raise `StepError` if the energy of an exact history does not balance."""
    book = history.balanced if isinstance(history, ContinuousHistory) else history.energy
    given = max(float(np.abs(book.total[0])), float(np.abs(book.work).max()))
    error = float(np.max(np.abs(book.balance)))
    reference = max(given or float(np.abs(book.total).max()), MIN_ENERGY)
    if not error <= BALANCE_TOL * reference:
        raise StepError(
            "the exact solution is spoiled by rounding errors: its energy does not balance, with an error of "
            f"{error / reference:.2g} of the energy. Allowed: {BALANCE_TOL:g}",
            time=history.duration,
            step=history.cost.steps,
            history=history,
            path="solve.model",
            remedy="Give a softer spring, or a model that steps.",
        )


def reason(run: Simulation, layout: NetworkLayout, log: Log, status: int) -> tuple[str, str]:
    """Return the reason why a march stopped, and the remedy."""
    if status == TOO_MANY:
        last = log.events[log.state["events"] - 1]
        name = run.scene.contacts[layout.places[last["contact"]]].name
        if last["branch"] >= 0:
            return (
                f"the law of contact {name} changes its branch more than {march.MAX_BURST} times at one instant",
                f"Give a model that steps, or end the run before {log.reached:.6g} s.",
            )
        if log.contacts["stiffness"][last["contact"]] >= 0.0:
            return (
                f"the exact solution is spoiled by rounding errors: the spring of contact {name} is "
                f"loaded and unloaded more than {march.MAX_BURST} times at one instant",
                "Give a softer spring, or a model that steps.",
            )
        return (
            f"contact {name} opens and closes more than {march.MAX_BURST} times at one instant",
            f"Give that contact the law penalty, or end the run before {log.reached:.6g} s. "
            "Bars that stay together are better described as one rod with segments.",
        )
    if status == UNRESOLVED:
        return (
            "the motion of a mass or a spring is too fast for the shortest time that can be resolved, "
            f"{log.state['tolerance']:.2g} s",
            "Give a larger mass or a softer spring, or a model that steps.",
        )
    return (
        f"the exact solution needs more than {MAX_INTERVALS:,} intervals: every wave front is "
        "split at each joint of segments",
        shorter(run, log),
    )


def too_large(run: Simulation, log: Log, most: float) -> tuple[str, str]:
    """Return why a log has no more room in memory, and the remedy."""
    return (
        f"the wave fronts within one round trip take more than {in_bytes(BYTES * most)}: every "
        "front is split at each joint of segments and at each contact",
        shorter(run, log),
    )


def shorter(run: Simulation, log: Log) -> str:
    """Return the remedy of a run that is too long; a tolerance is none for links, which need the exact solver."""
    links = any(law.two_sided for law in run.method.laws.values())
    tolerance = "" if links else "solve.tolerance in place of a model, or "
    return f"Give a duration of at most {0.9 * log.reached:.3g} s, or {tolerance}a model that steps."


def stop(run: Simulation, layout: NetworkLayout, log: Log, why: tuple[str, str], thinner: Thinner | None) -> None:
    """Raise the `StepError` of a march that stopped early, with the history so far."""
    reached = log.reached
    history: ContinuousHistory | ThinnedHistory | None = None
    if thinner is not None:
        history = thinner.finish(log, reached)
    elif reached > 0.0:
        history = ContinuousHistory(run, layout, log, reached)
    text, remedy = why
    raise StepError(
        text, time=reached, step=int(log.state["intervals"]), history=history, path="solve.model", remedy=remedy
    )
