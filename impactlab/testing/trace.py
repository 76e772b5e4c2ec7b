"""A stepped run one step at a time, with its state after each."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from impactlab.errors import CaseError, StepError, raised_at
from impactlab.integrators.base import AbstractIntegrator
from impactlab.numerics.raised import keep_raised
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Scene
from impactlab.simulate.checks import SMALLER_STEP
from impactlab.simulate.plan import Plan, prepare
from impactlab.simulate.planning.preparation import FAULT_OF_LAW
from impactlab.simulate.stepped_run import advance_of
from impactlab.simulate.stepping import loop
from impactlab.simulate.stepping.arrays import SAMPLED
from impactlab.simulate.stepping.results.fault_of_part import fault_of_part
from impactlab.simulate.stepping.results.history import RecordedHistory
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.types import Array


class Trace(NamedTuple):
    """Every state of a run, with the forces and impulses between them."""

    scene: Scene
    plan: Plan
    history: RecordedHistory
    dt: float  # s
    states: Array  # (n_steps + 1, n_state): the whole state after each step
    forces: Array  # (n_steps, n_contacts) N, of each step; with located events of the last piece of each step
    impulses: Array  # (n_steps, n_contacts) N s, of each step
    projections: Array  # (n_steps, n_contacts) kg m, of each step
    pushes: Array  # (n_steps, n_contacts) of each step, along the rows that the laws push

    @property
    def integrator(self) -> AbstractIntegrator:
        """The scheme of the run."""
        assert self.plan.integrator is not None
        return self.plan.integrator

    @property
    def times(self) -> Array:
        """The ends of all steps, t = 0 first, shape (n_steps + 1,) [s]."""
        return np.asarray(self.dt * np.arange(len(self.states)), float)

    def displacements(self, body: str) -> Array:
        """The coordinates of a body after each step, shape (n_steps + 1, n_dof)."""
        return np.array([self.history.assembly.layout.state_of(body, state) for state in self.states])

    def velocities(self, body: str) -> Array:
        """The velocities of a body's coordinates after each step, shape (n_steps + 1, n_dof)."""
        return np.array([self.history.assembly.layout.state_of(body, state, velocities=True) for state in self.states])

    def kept(self, body: str) -> Array:
        """The further state of a body after each step of the scheme, (n_steps + 1, ...)."""
        start, size = self.history.assembly.layout.shift[body], self.plan.steppers[body].state.size
        known = 2 * self.plan.built[body].system.load.size
        return self.states[:, start + known : start + size]

    def momentum(self, body: str) -> Array:
        """The momentum of a body after each step, shape (n_steps + 1,).

        It includes the impulse still due from its scheme.
        """
        number = list(self.plan.built).index(body)
        return self.history.assembly.memory.sample[: len(self.states), SAMPLED + 2 + 3 * number]


def trace(simulation: Simulation) -> Trace:
    """Return every step of a run, with energies at each.

    The loop of `impactlab.run` is called once a step.

    Raises
    ------
    CaseError, PairingError
        Before the first step, as `impactlab.run`.
    StepError
        Where a law fails or a number is not finite. A gain of energy raises nothing here: tests look at it.
    """
    plan, assembly, history = begun(simulation, with_beads=False)
    states, given = [assembly.memory.state.copy()], []
    while assembly.clock.step < plan.steps:
        walk_to(assembly, history, assembly.clock.step + 1, sample_stride=1)
        states.append(assembly.memory.state.copy())
        given.append([(each.force, each.impulse, each.projection, each.push) for each in assembly.contacts])
    history.finish()
    replies = np.moveaxis(np.array(given).reshape(plan.steps, len(plan.scene.contacts), 4), 2, 0)
    return Trace(plan.scene, plan, history, assembly.dt, np.array(states), *replies)


def run_sampled(simulation: Simulation) -> RecordedHistory:
    """Return the history that `trace` returns, with energies at each step, from one call of the loop.

    It raises as `trace` does.
    """
    plan, assembly, history = begun(simulation, with_beads=False)
    walk_to(assembly, history, plan.steps, sample_stride=1)
    history.finish()
    return history


def forces_after(traced: Trace) -> Array:
    """Return the forces of contacts in the step after a run [N].

    This step is taken again for them.
    """
    assembly = Assembly(traced.plan, traced.integrator, traced.dt, with_beads=False)
    loop.start(assembly.memory, assembly.dt)
    walk_to(assembly, RecordedHistory(assembly, traced.integrator), traced.plan.steps + 1, sample_stride=1)
    return np.array([each.force for each in assembly.contacts])


def run_in_cuts(simulation: Simulation, next_cut: Callable[[int], int]) -> RecordedHistory:
    """Return the history of a run whose loop stops at each ``next_cut(step)``.

    The bits of a run must not depend on the cuts.
    """
    plan, assembly, history = begun(simulation)
    while assembly.clock.step < plan.steps:
        to = min(plan.steps, max(assembly.clock.step + 1, next_cut(int(assembly.clock.step))))
        walk_to(assembly, history, to, assembly.sample_stride)
    history.finish()
    return history


def begun(simulation: Simulation, with_beads: bool = True) -> tuple[Plan, Assembly, RecordedHistory]:
    """Return a run before its first step.

    Without rows of beads every contact has its port and its reply.
    """
    plan = prepare(*simulation)
    if plan.dt is None or plan.integrator is None:
        text = "the continuous model has no steps to trace"
        raise CaseError(text, remedy="Give a model with steps.", path="solve.model")
    assembly = Assembly(plan, plan.integrator, plan.dt, with_beads)
    loop.start(assembly.memory, assembly.dt)
    return plan, assembly, RecordedHistory(assembly, plan.integrator)


def walk_to(assembly: Assembly, history: RecordedHistory, step: int, sample_stride: int) -> None:
    """Call the loop up to a step, with more room where needed."""
    advance = advance_of(assembly)
    while assembly.clock.step < step:
        with keep_raised(assembly.fail_all) as kept:
            status = advance(assembly.memory, assembly.dt, step, assembly.stride, sample_stride)
        history.drain()
        if kept.first is not None:
            raise fault_of_part(assembly, kept.first, history)
        if status == loop.RECORDS_FULL:
            assembly.grow()
        if status in (loop.LAW_FAILED, loop.NOT_FINITE):
            raised = next((law.raised for law in assembly.laws if law.raised is not None), None)
            text, remedy = "the energy is not a finite number", SMALLER_STEP
            if raised is not None:
                text, remedy = f"the law raised {raised_at(raised)}", FAULT_OF_LAW
            elif status == loop.LAW_FAILED:
                text = "the contact law did not return a force"
            clock = assembly.clock
            raise StepError(text, time=clock.time, step=clock.step, history=history, remedy=remedy) from raised
