"""The march of an adaptive solver from event to event, started again at each."""

from __future__ import annotations

import math
import time as clock
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from impactlab.errors import StepError
from impactlab.history.base import ContactSpan, Event
from impactlab.integrators.base import AbstractAdaptive, Problem
from impactlab.scene.problem import Point
from impactlab.simulate.adaptive.events import Change, first_change, largest_force
from impactlab.simulate.adaptive.history import AdaptiveHistory
from impactlab.simulate.adaptive.law import LawFailed
from impactlab.simulate.adaptive.record import Record
from impactlab.simulate.adaptive.system import System
from impactlab.simulate.slides import REACH_FURTHER, out_of_reach, slid
from impactlab.types import Progress

MIN_ACCUMULATED = 20  # events within a hundredth of the time so far that count as an accumulation
MIN_TILT = 1e-4  # rad, of a link from across its slide: nearer its acceleration grows beyond bounds
PROGRESS_SECONDS = 0.1  # between two reports of progress

MORE_STEPS = "Give more most_steps, a looser relative_tolerance, or for stiff scenes method Radau or BDF."


@dataclass
class ContactUnderWay:
    """A contact under way."""

    start: float  # s
    impulse: float  # N s, of the contact at its start
    peak: float = 0.0  # N


class March:
    """One adaptive run.

    Events lie on the interpolant of an accepted step; the step ends at the first one, since the force has a kink there.
    A contact that opens and closes within one step is found as long as its trace shows on nine samples of it; no step
    is longer than a wave takes through the shortest rod, or than the samples of a force over time are apart.
    """

    def __init__(self, system: System, integrator: AbstractAdaptive, longest: float | None) -> None:
        self.system, self.integrator = system, integrator
        integrator.load()
        scene = system.scene
        transits = [0.5 * body.round_trip for body in scene.elastic.values()]
        self.longest = min([scene.duration, *transits]) if longest is None else longest
        self.longest = min(self.longest, system.shortest_interval)
        self.time, self.steps, self.factorisations = 0.0, 0, 0
        self.state = system.start.copy()
        self.record = Record(system)
        self.history = AdaptiveHistory(self.record)
        self._events: list[Event] = []
        self._spans: list[ContactSpan] = []
        self._under_way: dict[int, ContactUnderWay] = {}
        self._angles = [system.row(Point(name, x, ""), "displacement") for name, x in slid(scene)]

    def run(self, progress: Progress | None = None) -> AdaptiveHistory:
        """Return the history; raise `StepError` where solver, law or step limit fails."""
        duration, reported = self.system.scene.duration, clock.perf_counter()
        try:
            self._begin()
            solver: Any = None
            while self.time < duration:
                if self.steps >= self.integrator.most_steps:
                    self._fail(f"{self.steps} steps did not reach the end of the run{self._accumulation()}", MORE_STEPS)
                if solver is None:
                    solver = self._solver()
                before = solver.nlu
                going_on = self._step(solver)
                self.factorisations += solver.nlu - before
                solver = going_on
                if progress is not None and clock.perf_counter() - reported > PROGRESS_SECONDS:
                    reported = clock.perf_counter()
                    progress(self.time / duration)
        except LawFailed as failed:
            self._fail(str(failed), cause=failed.__cause__)
        self._finish()
        if progress is not None:
            progress(1.0)
        return self.history

    def _begin(self) -> None:
        for number in self.system.begin():
            self._close(0.0, number)
        self.record.mark(0.0, self.state)

    def _solver(self) -> Any:
        system = self.system
        duration = system.scene.duration
        longest = min(self.longest, duration - self.time)
        with np.errstate(over="ignore", invalid="ignore"):
            return self.integrator.solver(
                Problem(system.rates, system.jacobian, self.time, duration, self.state, system.scale, longest)
            )

    def _step(self, solver: Any) -> Any:
        """Take one step; return the solver, or None after an event."""
        begin = self.time
        with np.errstate(over="ignore", invalid="ignore"):  # of trial stages, which are rejected
            reason = solver.step()
        self.steps += 1
        if solver.status == "failed" or not np.all(np.isfinite(solver.y)):
            self._fail(
                f"the solver did not find a step: {reason or 'the state is not a finite number'}",
                "Try another method, a looser tolerance, or a softer contact.",
            )
        interpolant = solver.dense_output()
        change = first_change(self.system, interpolant, begin, solver.t)
        self.time = solver.t if change is None else change.time
        self.state = solver.y if change is None else np.asarray(interpolant(change.time))
        self.record.take(interpolant, self.time)
        for number, span in self._under_way.items():
            span.peak = largest_force(self.system, interpolant, number, begin, self.time, span.peak)
        if change is not None:
            self._change(change)
            return None
        moved = self.system.motion(self.state)[0] if self._angles else self.state
        if any(abs(math.cos(row @ moved)) < MIN_TILT for row in self._angles):
            self._fail("a link is perpendicular to its slide", REACH_FURTHER)
        gaps, rates = self.system.gaps_of(self.state)
        for contact, gap, rate in zip(self.system.contacts, gaps, rates, strict=True):
            contact.carry(float(gap), float(rate))
        return solver

    def _accumulation(self) -> str:
        """Return the text for contacts that come ever faster, empty without them."""
        last = self._events[-MIN_ACCUMULATED:]
        within = last[-1].time - last[0].time if len(last) == MIN_ACCUMULATED else self.time
        return (
            f"; contacts accumulate: the last {MIN_ACCUMULATED} events lie within {within:.3g} s"
            if within < 0.01 * self.time
            else ""
        )

    def _change(self, change: Change) -> None:
        contact = self.system.contacts[change.number]
        gaps, rates = self.system.gaps_of(self.state)
        gap, rate = float(gaps[change.number]), float(rates[change.number])
        if contact.closed:
            contact.open(gap, rate)
            name, span = self.system.scene.contacts[change.number].name, self._under_way.pop(change.number)
            impulse = self._impulse(change.number) - span.impulse
            self._events.append(Event(change.time, name, "open"))
            self._spans.append(ContactSpan(name, span.start, change.time, impulse, span.peak))
        else:
            self.state[self.system.losses.start + change.number] += contact.released(gap)
            contact.close(gap, rate, self.system.away)
            self._close(change.time, change.number)
        self.record.mark(change.time, self.state)

    def _close(self, time: float, number: int) -> None:
        self._events.append(Event(time, self.system.scene.contacts[number].name, "close"))
        self._under_way[number] = ContactUnderWay(time, self._impulse(number))

    def _impulse(self, number: int) -> float:
        return float(self.state[self.system.impulses.start + number])

    def _finish(self) -> None:
        self.record.mark(self.time, self.state)
        for number, span in self._under_way.items():
            name = self.system.scene.contacts[number].name
            self._spans.append(ContactSpan(name, span.start, None, self._impulse(number) - span.impulse, span.peak))
        self._under_way = {}
        self.history.duration = min(self.history.duration, self.time)
        self.history.load_impulses = self.system.load_impulses(self.state)
        self.history.finish(self._events, self._spans)
        self.history.cost.steps = self.steps
        self.history.cost.rhs_evaluations = self.system.evaluations
        self.history.cost.factorisations = self.factorisations

    def _fail(self, text: str, remedy: str = "", cause: BaseException | None = None) -> NoReturn:
        history, time = None, self.time
        if self.record.begun:
            self._finish()
            history = self.history
            if remedy and (stuck := out_of_reach(history, ended=True)) is not None:
                text, remedy, time = stuck.text, REACH_FURTHER, stuck.time
        raise StepError(text, time=time, step=self.steps, history=history, remedy=remedy) from cause
