"""A run in steps: the step loop in chunks, or an adaptive march, then checks."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from impactlab.errors import StepError
from impactlab.history.base import AbstractHistory
from impactlab.history.instruments import check_rates
from impactlab.numerics.addresses import entered, entered_with_table, is_loaded
from impactlab.numerics.ahead import ahead
from impactlab.numerics.garbage_collection import GarbageCollectionPaused
from impactlab.numerics.raised import keep_raised
from impactlab.scene.method import Method, Simulation, laws_of
from impactlab.scene.problem import Scene
from impactlab.scene.recent import KeepsResults
from impactlab.simulate import needed_kernels
from impactlab.simulate.checks import add_warnings, check_gain, check_momentum, check_run
from impactlab.simulate.plan import Plan, prepare
from impactlab.simulate.planning.known_bodies import KnownBodies
from impactlab.simulate.stepping import loop
from impactlab.simulate.stepping.loop import advance_dated
from impactlab.simulate.stepping.results.fault_of_part import fault_of_part
from impactlab.simulate.stepping.results.history import RecordedHistory
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.simulate.stepping.setup.same_structure import has_structure, renumbered
from impactlab.simulate.stepping.unfilled import check_called
from impactlab.startup.lazy import lazy
from impactlab.startup.wall_time import spent_on
from impactlab.types import Progress

if TYPE_CHECKING:
    from impactlab.simulate.adaptive.march import March
    from impactlab.simulate.stepping import located
    from impactlab.simulate.stepping.setup import restepped, retimed
else:  # compiled code, needed only where events are located or a run is like another
    located, retimed = lazy("impactlab.simulate.stepping.located"), lazy("impactlab.simulate.stepping.setup.retimed")
    restepped = lazy("impactlab.simulate.stepping.setup.restepped")

CHUNK_SECONDS = 0.1  # s, between two reports of progress
FIRST_CHUNK = 4_000_000  # steps times entries of the state: a few milliseconds


class Prepared:
    """The plan of a run, and the arrays of its loop.

    Those made first serve the first run, copies the next ones. Threads may run the same case at once: each gets arrays
    of its own.
    """

    bodies: ClassVar[KnownBodies | None] = None  # of the plan before
    arrays: ClassVar[Assembly | None] = None  # of one before with the same bodies, which no run writes into

    def __init__(self, scene: Scene, method: Method) -> None:
        known = Prepared.bodies
        self.plan = prepare(scene, method, known)
        Prepared.bodies = self.plan.known_bodies or known
        made = self._assembly(known)
        self.can_repeat: bool = self.plan.march is None and (made is None or made.can_repeat)
        self._first = iter((made,))  # a step of it gives them to one thread alone
        self._kept: Assembly | None = None  # to copy

    def _assembly(self, known: KnownBodies | None = None) -> Assembly | None:
        """Return new arrays.

        Those of another mass or velocity follow from the arrays of the scene before.
        """
        plan = self.plan
        if plan.dt is None or plan.integrator is None:
            return None
        kept = Prepared.arrays
        like = None if kept is None else renumbered(kept, plan, plan.integrator, plan.dt)
        if like is not None:
            return like
        made = Assembly(plan, plan.integrator, plan.dt)
        if made.can_repeat and known is not None and known.has_all_of(plan.built) and has_structure(made):
            Prepared.arrays = made.again()
        return made

    def assembly(self) -> Assembly | None:
        """Return arrays that no run has written into; None where a run has no loop."""
        if (first := next(self._first, None)) is not None:  # nothing is copied for a scene that is run once
            return first
        if not self.can_repeat:
            return self._assembly()
        kept = self.kept()
        return None if kept is None else kept.again()

    def kept(self) -> Assembly | None:
        """Return arrays to copy; None where a run has no loop.

        No run may write into them.
        """
        if self._kept is None:  # two threads may both make them: either serves
            self._kept = next(self._first, None) or self._assembly()
        return self._kept


ready = KeepsResults(Prepared, lambda made: made.can_repeat)


def prepared_like(like: Simulation, scene: Scene, method: Method) -> tuple[Plan, Assembly | None]:
    """Return plan and arrays of a run, from another one's where possible.

    The other arrays are rewritten for the step.
    """
    known, is_same = ready(*like), scene is like.scene and method is like.method
    plan, assembly = known.plan, known.kept() if known.can_repeat else None
    if assembly is not None and is_same:
        return plan, assembly.again()
    if assembly is not None and retimed.is_alike(plan, assembly, scene, method):
        if retimed.may_be_rewritten(plan, assembly, method):
            made = retimed.retimed(plan, assembly, scene, method)
            return made.layout.plan, made
        other = restepped.restepped(plan, scene, method)
        if other is not None and other.dt is not None:
            return other, restepped.arrays_of(other, other.dt, assembly)
    own = known if is_same else ready(scene, method)
    return own.plan, own.assembly()


def run_adaptive(march: March, progress: Progress | None, began: float, with_warnings: bool) -> AbstractHistory:
    """Return the history of an adaptive run; raises `StepError` as `run` does."""
    set_up = clock.perf_counter()
    with spent_on("solving"):
        history, system = march.run(progress), march.system
    solved = clock.perf_counter()
    if with_warnings:
        add_warnings(history)
    cost = history.cost
    cost.setup_s, cost.solve_s, cost.checks_s = set_up - began, solved - set_up, clock.perf_counter() - solved
    cost.unknowns = system.n_dof
    failure = partial(StepError, time=march.time, step=march.steps, history=history)
    check_momentum(history, march.state[system.impulses].tolist(), history.load_impulses, march.time, failure)
    bound = march.integrator.gains_energy + sum(law.gains_energy for law in laws_of(system.scene, system.method))
    check_gain(history, bound, lambda: "Give a smaller relative_tolerance.", failure)
    return history


def run(
    scene: Scene, method: Method, progress: Progress | None, with_warnings: bool, like: Simulation | None
) -> AbstractHistory:
    """Return the history of a run in steps; arguments and errors as of `impactlab.simulate.driver.run`."""
    began = clock.perf_counter()
    with spent_on("set-up"), GarbageCollectionPaused(), ahead(lambda: needed_kernels.of_steps(scene, method)):
        if like is None:
            prepared = ready(scene, method)
            plan, assembly = prepared.plan, prepared.assembly()
        else:
            plan, assembly = prepared_like(like, scene, method)
        if assembly is not None and with_warnings:  # runs for a reference or for the choice measure nothing
            check_rates(plan.scene, 1.0 / (assembly.stride * assembly.dt))
    if plan.march is not None:
        check_rates(scene, scene.records / scene.duration)
        return run_adaptive(plan.march, progress, began, with_warnings)
    assert assembly is not None  # noqa: S101 - a run in steps that is not adaptive has a loop
    history, status = step_through(plan, assembly, progress, began)
    solved = clock.perf_counter()
    with spent_on("checks"), GarbageCollectionPaused():
        with history.summed_up_to_last_step():
            if with_warnings:
                add_warnings(history)
        history.cost.checks_s = clock.perf_counter() - solved
        check_run(status, assembly, history)
    return history


def step_through(
    plan: Plan, assembly: Assembly, progress: Progress | None, began: float
) -> tuple[RecordedHistory, int]:
    """Take all steps of a run; return its history, and the status with which the loop ended.

    The set-up ``began`` at a reading of the clock [s]. The balances of the history are not checked yet.
    """
    assert plan.integrator is not None  # noqa: S101 - a plan without steps has no arrays
    if progress is not None:
        progress(0.0)
    with spent_on("set-up"), GarbageCollectionPaused():
        history = RecordedHistory(assembly, plan.integrator)
        history.warnings.extend(plan.warnings)
        history.integrator_used = plan.is_stepped
        entered_with_table(loop.start, assembly.memory, assembly.dt)
        if not is_loaded(advance_of(assembly)):  # here, so that the first run's solve time is that of the steps
            entered(advance_of(assembly), assembly.memory, assembly.dt, 0, assembly.stride, assembly.sample_stride)
    with spent_on("solving"):
        set_up = clock.perf_counter()  # after the line above: garbage that was held back is collected there
        status = walk(assembly, history, progress)
        with GarbageCollectionPaused():
            history.finish()
    cost = history.cost
    cost.setup_s, cost.solve_s = set_up - began, clock.perf_counter() - set_up
    cost.steps = assembly.clock.step
    cost.unknowns = sum(body.system.load.size for body in plan.built.values())
    return history, status


def advance_of(assembly: Assembly) -> Callable[..., int]:
    """Return the loop that takes the steps of a run: whole, or cut at events."""
    if assembly.method.events == "located" and assembly.scene.contacts:
        return located.advance_located
    return advance_dated


def walk(assembly: Assembly, history: RecordedHistory, progress: Progress | None) -> int:
    """Run the loop in chunks of about a tenth of a second.

    Return why it ended. No bit depends on the chunks. Raise `StepError` where a piece of the loop is missing, or the
    compiled code of a part raised.
    """
    chunk = max(256, FIRST_CHUNK // assembly.memory.state.size)
    advance = advance_of(assembly)
    while True:
        first = assembly.clock.step
        began = clock.perf_counter()
        last = min(first + chunk, assembly.steps)
        with keep_raised(assembly.fail_all) as raised:
            given = assembly.memory, assembly.dt, last, assembly.stride, assembly.sample_stride
            status = entered_with_table(advance, *given)
        spent = clock.perf_counter() - began
        check_called(assembly.clock)
        history.drain()
        if raised.first is not None:
            raise fault_of_part(assembly, raised.first, history)
        if status in (loop.LAW_FAILED, loop.NOT_FINITE):
            return int(status)
        if status == loop.RECORDS_FULL:
            assembly.grow()
        done = assembly.clock.step
        if progress is not None:
            progress(done / assembly.steps)
        if done >= assembly.steps:
            return int(status)
        if spent < 0.5 * CHUNK_SECONDS:
            chunk *= 2
        elif spent > CHUNK_SECONDS:
            chunk = max(1, chunk // 2)
