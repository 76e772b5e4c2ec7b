"""Base class of continuous bodies, whose stepper of exact waves or memory replaces an integrator."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from impactlab.errors import CaseError, PairingError
from impactlab.models.base import AbstractDiscreteModel, Operators
from impactlab.scene.bodies import Beam, End
from impactlab.stepper import Kernel, Stepper
from impactlab.types import Array, Ints, Level

if TYPE_CHECKING:
    from impactlab.scene.problem import Probe

MIN_SHARE, MAX_TRIED = 0.8, 400  # steps tried: down to this share of the one given, so many at most
MODES = 100  # counted by `points_per_period` on a body without mesh or modes


class AbstractSelfStepping(AbstractDiscreteModel):
    """A continuous body whose motion over a step is known in closed form.

    It needs no integrator. Its coordinates are the places that contacts and probes name. It has displacement and
    velocity per force; velocity per impulse it has none: the mass that an impulse would strike is zero.
    """

    n_dof: int  # coordinates
    serves: ClassVar[frozenset[Level]] = frozenset({Level.POSITION, Level.VELOCITY})
    books_momentum: ClassVar[bool] = False  # True: its momentum changes by the impulses on it alone, to rounding

    def recorded(self, probes: tuple[Probe, ...], duration: float, fields: bool) -> Self:
        """Return the body for a run of a duration [s].

        The run records these probes of it, and fields along it or none.

        A body that can give any quantity at any place, for any time, returns itself, as here.
        """
        return self

    def gives_means(self, x: float) -> bool:
        """Return whether the velocity at x [m] after a step is a mean over it.

        Otherwise, as here, it is that at the end of the step.
        """
        return False

    @property
    @abstractmethod
    def longest_step(self) -> float:
        """Return the longest step that it can take [s]; inf where any step is possible."""

    def too_long(self, dt: float) -> CaseError | None:
        """Return the error of a step [s] beyond `longest_step`, or None for a general error."""
        return None

    def misfit(self, dt: float) -> float:
        """Return the relative change of lengths and speeds that fits a step [s]; here 0."""
        return 0.0

    def misfits(self, steps: Array) -> Array:
        """Return the misfit at each of some steps [s]."""
        return np.array([self.misfit(step) for step in steps.tolist()])

    def broken(self, dt: float) -> float:
        """Return the share of a step by which waves arrive between steps, 0 to 1/2.

        It is 0, as here, if none do; ``dt`` is in s.

        It decides between steps that fit other bodies equally well.
        """
        return 0.0

    def fitting(self, dt: float) -> Array:
        """Return steps from dt down that may fit better, (n,) [s]; here dt alone."""
        return np.array([dt])

    def momentum_row(self) -> Array:
        """Return zeros, (n_dof,): `Stepper.measure` gives the whole momentum."""
        return np.zeros(self.n_dof)

    @abstractmethod
    def stepper(self, ports: Array, dt: float) -> Stepper:
        """Return the stepper for steps of dt [s], pushed along the rows ``ports``."""


def numbers_of_steps(least: float) -> Ints:
    """Return whole numbers of steps that a time may be divided into, no less than ``least``, (n,)."""
    first = max(1, math.ceil(least * (1.0 - 1e-12)))
    last = max(first + 1, min(first + MAX_TRIED, math.floor(first / MIN_SHARE)))
    return np.arange(first, last + 1, dtype=np.int64)


def without_mass(displacement: Array, velocity: Array, load: Array, dashpots: Array, rule: float) -> Operators:
    """Return the operators of a self-stepping body.

    They hold its state at t = 0, and the loads and dashpots at its ends, (n_dof,) each. ``rule`` is the frequency
    [rad/s] whose period ``points_per_period`` counts.
    """
    zeros = np.zeros((1, load.size))
    return Operators(
        mass=zeros,
        damping=dashpots[None, :],
        stiffness=zeros,
        load=load,
        displacement=displacement,
        velocity=velocity,
        highest_frequency=0.0,
        rule_frequency=rule,
        diagonal_mass=True,
        end_dashpots=dashpots,
        modes=False,
    )


def stepper_of(
    free: Kernel, measure: Kernel, parameters: Array, state: Array, force_response: Array, ports: Array
) -> Stepper:
    """Return the stepper of a body that forces move, and impulses and projections do not."""
    none = np.zeros_like(force_response)
    return Stepper(free, measure, parameters, state, force_response, none, none, np.zeros_like(ports), ports)


def under_waves(end: End, impedance: float, dt: float) -> tuple[float, float, float]:
    """Return mean velocity per force of an end, its spring stiffness, and 2 m/dt.

    They hold for a step of dt [s] in which waves arrive.
    """
    value = {end.kind: end.value}
    spring, damping, inertia = value.get("spring", 0.0), value.get("dashpot", 0.0), 2.0 * value.get("mass", 0.0) / dt
    return 1.0 / (impedance + damping + 0.5 * spring * dt + inertia), spring, inertia


def check_served(beam: Beam, gravity: float, theory: str, remedy: str, more: Mapping[str, bool]) -> None:
    """Raise `PairingError` for a beam with segments, tension, damping, gravity, or one of ``more``."""
    faults = {
        "a second segment": len(beam.segments) > 1,
        "tension": beam.tension != 0.0,
        "damping": beam.is_damped,
        **more,
        "gravity": gravity != 0.0,
    }
    for fault, has_it in faults.items():
        if has_it:
            raise PairingError(
                f"the continuous {theory} beam '{beam.name}' does not support {fault}",
                remedy=remedy,
                path=f"solve.models.{beam.name}",
            )
