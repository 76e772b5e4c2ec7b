"""A body that brings its own stepper: exact waves or an exact memory in place of an integrator."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar, Self

from impactlab.integrators.base import Stepper
from impactlab.models.base import AbstractDiscreteModel
from impactlab.types import Array, Level

if TYPE_CHECKING:
    from impactlab.scene.problem import Probe


class AbstractSelfStepping(AbstractDiscreteModel):
    """A continuous body: what it does in a step is known in closed form, so that no integrator is asked.

    Its coordinates are the places that contacts and probes name. It has displacement and velocity per force; velocity
    per impulse it has none: the mass that an impulse would strike is zero.
    """

    serves: ClassVar[frozenset[Level]] = frozenset({Level.POSITION, Level.VELOCITY})

    def recorded(self, probes: tuple[Probe, ...], duration: float, fields: bool) -> Self:
        """Return the body for a run of a duration [s] that records these probes of it, and fields along it or none.

        A body that can give any quantity at any place, for any time, returns itself, as here.
        """
        return self

    @property
    @abstractmethod
    def longest_step(self) -> float:
        """Return the longest step that it can take [s]; inf where any is served."""

    @abstractmethod
    def misfit(self, dt: float) -> float:
        """Return by how much of itself something must give way so that a step of dt [s] fits; 0 where any fits."""

    @abstractmethod
    def fitting(self, dt: float) -> Array:
        """Return steps from dt down that may fit better, (n,) [s]; dt alone where any step fits."""

    @abstractmethod
    def stepper(self, ports: Array, dt: float) -> Stepper:
        """Return the stepper for steps of dt [s]; ``ports`` are the rows along which contacts push."""
