"""The two impacts that every program solves, with exact results.

They are plain numbers, with the errors of a run.

``paper`` is the paper's case: the mass weighs as much as the uniform rod and strikes twice, the second contact 1 % from
vanishing. ``two_material`` is a rod of steel and brass on meshes of equal length: no step fits both wave speeds (5064
and 3430 m/s), so that dt = h/c, exact on a uniform rod, flatters nobody.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.exact.solve import solve
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractScheme
from impactlab.metrics import midpoints, relative_l2
from impactlab.models.base import AbstractRodModel
from impactlab.models.continuous import Continuous
from impactlab.scene import Contact, End, Mass, Point, Rod, Segment
from impactlab.scene.method import Simulation, StepRule
from impactlab.testing.scenes import simulation

Array = NDArray[float64]

NORMS = ("mass_displacement", "face_displacement", "opening_time", "exit_velocity")
SHORTEST_FLIGHT = 0.1  # T: a shorter one is chatter of a method, not the first opening; as impactlab.metrics.impact
CELLS = 6000  # where displacements are compared, as in impactlab.metrics


@dataclass(frozen=True)
class Case:
    """A rigid mass strikes the bare end of a rod whose other end is clamped."""

    name: str
    segments: tuple[tuple[float, float, float, float], ...]  # length m, area m2, Young's modulus Pa, density kg/m3
    striker: float  # kg
    velocity: float = 1.0  # m/s
    round_trips: float = 3.0

    @property
    def length(self) -> float:
        """Length of the rod [m]."""
        return sum(segment[0] for segment in self.segments)

    @property
    def wave_speed(self) -> float:
        """Largest wave speed [m/s]."""
        return max(float(np.sqrt(young / density)) for _, _, young, density in self.segments)

    @property
    def round_trip(self) -> float:
        """Time T of a wave to the far end and back [s]."""
        return 2.0 * sum(length / float(np.sqrt(young / density)) for length, _, young, density in self.segments)

    @property
    def duration(self) -> float:
        """Length of the run [s]."""
        return self.round_trips * self.round_trip

    def steps_of(self, dt: float) -> tuple[int, float]:
        """Return the number of equal steps of the run, and their length [s].

        They are at most ``dt`` [s].
        """
        steps = math.ceil(self.duration / dt - 1e-9)
        return steps, self.duration / steps

    def scene(
        self,
        model: AbstractRodModel,
        integrator: AbstractScheme | None = None,
        step: StepRule | None = None,
        law: AbstractContactLaw | None = None,
        events: str = "dated",
    ) -> Simulation:
        """Return the impact as a scene of impactlab."""
        parts = tuple(Segment(*segment) for segment in self.segments)
        rod = Rod("rod", parts, End("free"), End("clamped"))
        ends = Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left")
        contact = Contact(*ends, 0.0)
        bodies = {"hammer": Mass("hammer", self.striker, self.velocity), "rod": rod}
        rule = step or StepRule(courant=1.0)
        return simulation(
            self.name, bodies, (contact,), self.duration, integrator, rule,
            events=events, round_trip=self.round_trip, model=model, law=law or AdditionDeletion(),
        )  # fmt: skip


PAPER = Case("paper", ((0.3, 9e-4, 2.1e11, 7900.0),), 2.133)
TWO_MATERIAL = Case("two_material", ((0.3, 2e-4, 2.0e11, 7800.0), (0.3, 2e-4, 1.0e11, 8500.0)), 0.8)
CASES = {case.name: case for case in (PAPER, TWO_MATERIAL)}

PAPER_EVENTS = (0.0, 1.53383382080915, 2.12462323494217, 2.16284275559957)
"""Touches and openings of the paper's case [T], from 40 digits: tests/reference/st_venant_mp.py finds them again."""


@dataclass(frozen=True)
class Outcome:
    """Results of a run: displacements over time, contact, and exit velocity.

    The exit velocity is that of the mass at the end.
    """

    times: Array  # (n,) s
    mass: Array  # (n,) m
    face: Array  # (n,) m
    exit_velocity: float  # m/s
    force: Array | None = None  # (n,) N; None where the program gives none: then the gap is read
    opening: float | None = None  # s, where the program dates it itself


@dataclass(frozen=True)
class Exact:
    """The exact answer on the midpoints of `CELLS` cells."""

    times: Array
    mass: Array
    face: Array
    opening: float
    exit_velocity: float
    history: AbstractHistory


@cache
def exact(case: Case) -> Exact:
    """Return the exact answer of a case."""
    history = solve(*case.scene(Continuous()))
    times = midpoints(case.duration, CELLS)
    opening = next(event.time for event in history.events if event.kind == "open")
    return Exact(
        times,
        history.evaluate(times, "position:hammer"),
        history.evaluate(times, "displacement:rod@0"),
        opening,
        float(history.evaluate(np.array([case.duration]), "velocity:hammer")[0]),
        history,
    )


def opening_of(outcome: Outcome, round_trip: float) -> float:
    """Return when the first flight longer than `SHORTEST_FLIGHT` begins [s], infinity where there is none.

    With a force: the last two forces of the contact are drawn out to zero, within the step. Without: the gap between
    the last sample that touches and the first that does not, by a straight line.
    """
    if outcome.opening is not None:
        return outcome.opening
    gap = outcome.face - outcome.mass
    touching = gap <= 0.0 if outcome.force is None else outcome.force > 0.0
    closed = np.flatnonzero(touching)
    if closed.size == 0:
        return float("inf")
    ends = np.append(outcome.times[closed[1:]], outcome.times[-1])
    flights = np.flatnonzero(ends - outcome.times[closed] > SHORTEST_FLIGHT * round_trip)
    if flights.size == 0 or closed[flights[0]] + 1 >= outcome.times.size:
        return float("inf")
    last = int(closed[flights[0]])
    step = outcome.times[last + 1] - outcome.times[last]
    if outcome.force is None:
        before, after = gap[last], gap[last + 1]
        part = before / (before - after) if after > before else 0.5
    else:
        before, after = outcome.force[last - 1] if last > 0 else 0.0, outcome.force[last]
        part = after / (before - after) if before > after else 0.5
    return float(outcome.times[last] + min(max(part, 0.0), 1.0) * step)


def errors_of(outcome: Outcome, case: Case) -> dict[str, float]:
    """Return the errors of a run against the exact solution in the `NORMS`.

    They are as `impactlab.metrics` has them. Displacements in the relative L2 norm over the whole run, between samples
    by straight lines; the opening in T; the exit velocity, that of the mass at the end of the run, in its first one.
    Infinity where a value is not finite.
    """
    answer = exact(case)
    values = [np.interp(answer.times, outcome.times, each) for each in (outcome.mass, outcome.face)]
    found = dict.fromkeys(NORMS, float("inf"))
    if all(np.all(np.isfinite(value)) for value in values):
        for name, value, true in zip(NORMS, values, (answer.mass, answer.face), strict=False):
            error = relative_l2(value, true)  # None where the answer is rounding beside what came out
            found[name] = float("inf") if error is None else error
        found["opening_time"] = abs(opening_of(outcome, case.round_trip) - answer.opening) / case.round_trip
        found["exit_velocity"] = abs(outcome.exit_velocity - answer.exit_velocity) / case.velocity
    return found
