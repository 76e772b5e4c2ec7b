"""A history made of plain functions, and its law: to test a metric, a figure or a report without a run."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from impactlab.history.base import AbstractHistory, ContactSpan, Cost, Event, Field, Warned
from impactlab.history.energy import EnergyBook
from impactlab.scene.method import Simulation
from impactlab.types import Array

Signal = Callable[[Array], Array]


@dataclasses.dataclass(frozen=True)
class SyntheticLaw:
    """Stands for a contact law that answers by force, with what a metric or a summary asks of it."""

    answers_force: ClassVar[bool] = True
    hard: ClassVar[bool] = False
    force_jumps: ClassVar[bool] = False
    remembers: ClassVar[bool] = False
    two_sided: ClassVar[bool] = False

    def restitutions(self) -> None:
        return None


class SyntheticHistory(AbstractHistory):
    """A history whose channels are functions of time.

    ``signals`` go from channel to a function of times [s], (n,) to (n,); ``fields`` from ``quantity:body`` to one of
    (x [m] of shape (n,), t [s]), on 201 points of ``length`` [m]; ``jumps`` from channel to instants [s]. Metrics of
    forces and touches, and summaries, need a ``simulation``.
    """

    def __init__(
        self,
        duration: float,
        signals: Mapping[str, Signal],
        *,
        events: tuple[Event, ...] = (),
        contacts: tuple[ContactSpan, ...] = (),
        energy: EnergyBook | None = None,
        fields: Mapping[str, Callable[[Array, float], Array]] | None = None,
        jumps: Mapping[str, tuple[float, ...]] | None = None,
        length: float = 1.0,
        dt: float | None = None,
        warnings: tuple[Warned, ...] = (),
        cost: Cost | None = None,
        simulation: Simulation | None = None,
    ) -> None:
        none = np.zeros(2)
        self.duration = duration
        self.dt = dt
        if simulation is not None:
            self.scene, self.method = simulation
        self.events = events
        self.contacts = contacts
        self.energy = energy or EnergyBook(np.array([0.0, duration]), {}, none, {}, none)
        self.warnings = list(warnings)
        self.cost = cost or Cost()
        self._signals = dict(signals)
        self._fields = dict(fields or {})
        self._jumps = dict(jumps or {})
        self._length = length

    def channels(self) -> tuple[str, ...]:
        return tuple(self._signals)

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        return np.asarray(self._signals[channel](np.asarray(t, dtype=float)), dtype=float)

    def field(self, body: str, t: float, quantity: str, x: ArrayLike | None = None) -> Field:
        x = np.linspace(0.0, self._length, 201)
        return Field(x, self._fields[f"{quantity}:{body}"](x, t))

    def jumps(self, channel: str) -> Array:
        return np.asarray(self._jumps.get(channel, ()), dtype=float)
