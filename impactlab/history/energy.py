"""Energies over a run, and the balance between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from impactlab.prefixes import prefixed, prefixed_range
from impactlab.startup.cached import cached_property
from impactlab.types import Array


class CarriedEnergy(NamedTuple):
    """Energy of the common motion of all interacting bodies, which contacts cannot exchange."""

    kinetic: float  # J, of the centres of mass at t = 0
    work: Array  # (n,) J, of loads on the common motion


class EnergyEnds(NamedTuple):
    """Energies at both ends of a run [J]."""

    initial: float  # bodies and contacts
    final: float
    work: float  # of gravity and end forces, over the run
    booked: dict[str, float]  # losses over the run
    by_contact: dict[str, float] | None = None  # those in contacts, of each that lost energy; None: not known

    def __repr__(self) -> str:
        lost = prefixed(sum(self.booked.values()), "J")
        ends = f"initial={prefixed(self.initial, 'J')}, final={prefixed(self.final, 'J')}"
        return f"EnergyEnds({ends}, work={prefixed(self.work, 'J')}, losses={lost})"


MIN_ENERGY = 1e-290  # J: shares of a smaller one have no digits, as its parts are no normal floats
DRIFT_ROUNDING = 1e-13  # of the energy of all bodies: a smaller difference of such energies is rounding


@dataclass(frozen=True, repr=False)
class EnergyBook:
    """Energies over the run and the balance inside it [J].

    Gain and loss are shares of the scale. The balance is the same in every frame of reference; the scale is that of the
    bodies' own frame.
    """

    time: Array  # (n,) s, the instants at which energies were taken
    bodies: dict[str, Array]  # name -> (n,) kinetic + strain energy of each body
    stored: Array  # (n,) held by contacts
    booked: dict[str, Array]  # name -> (n,) losses booked so far: contact, ends, unresolved; never negative
    work: Array  # (n,) work of gravity and end forces so far
    carried: CarriedEnergy | None = None  # by free bodies in a common motion (`impactlab.history.frame`); None: nothing
    by_contact: dict[str, Array] | None = None  # (n,) losses in each contact that may lose energy; None: not known

    def __repr__(self) -> str:
        bodies = f"{len(self.bodies)} bod{'ies' if len(self.bodies) != 1 else 'y'}"
        if not len(self.time):
            return f"<EnergyBook of {bodies}, no instants>"
        lost = sum(float(values[-1]) for values in self.booked.values())
        return (
            f"<EnergyBook of {bodies} at {len(self.time)} instants, "
            f"{prefixed_range(self.time[0], self.time[-1], 's')}: total {prefixed(self.total[0], 'J')} to "
            f"{prefixed(self.total[-1], 'J')}, work {prefixed(self.work[-1], 'J')}, losses {prefixed(lost, 'J')}, "
            f"largest gain {round(100.0 * self.largest_gain, 9):.3g} %>"
        )

    @cached_property
    def total(self) -> Array:
        """Energy of all bodies and contacts, shape (n,) [J]."""
        return np.asarray(sum(self.bodies.values(), 0.0) + self.stored)

    @cached_property
    def balance(self) -> Array:
        """Return the energy balance, shape (n,) [J]; zero for a perfect run.

        It is bodies + stored + booked - work - initial.
        """
        total = self.total + sum(self.booked.values(), 0.0) - self.work
        return np.asarray(total - total[0])

    @cached_property
    def at_stake(self) -> float:
        """Reference energy [J]: the exchangeable energy or the work of loads, whichever is larger.

        It is measured in the frame of the centre of mass of the interacting bodies. Bodies that only drift have none
        there; for them it is the energy of the drift.
        """
        start, whole = self._start, max(self._start, self._most_work)
        if self.carried is None:
            return whole
        inside = max(0.0, start - self.carried.kinetic)
        inside = max(inside, _largest(self.work - self.carried.work))
        return inside if inside > DRIFT_ROUNDING * whole else whole

    @cached_property
    def rounding(self) -> float:
        """Energy of bodies and work of loads over the scale, which bounds rounding errors."""
        return max(1.0, max(self._start, self._most_work) / self.scale)

    @cached_property
    def _start(self) -> float:
        return abs(float(self.total[0]))

    @cached_property
    def _most_work(self) -> float:
        return _largest(self.work)

    @cached_property
    def scale(self) -> float:
        """Return the energy of which gains and losses are shares [J].

        It is `at_stake`, or 1 J if a float cannot resolve shares of that.
        """
        return self.at_stake if self.at_stake > MIN_ENERGY else 1.0

    @cached_property
    def returned(self) -> float:
        """Energy that dampers gave back [J]: the largest falls of the losses booked in them."""
        booked = (self.booked[name] for name in ("damping", "ends") if name in self.booked)
        return sum(float(np.max(np.maximum.accumulate(each) - each)) for each in booked if np.count_nonzero(each))

    @cached_property
    def final_error(self) -> float:
        """Error of the balance at the end, over the scale."""
        return abs(float(self.balance[-1])) / self.scale

    @cached_property
    def largest_gain(self) -> float:
        """Largest rise of the balance above its start, over the scale."""
        return max(0.0, float(np.maximum.reduce(self.balance))) / self.scale

    @cached_property
    def largest_loss(self) -> float:
        """Largest fall of the balance below its start, over the scale."""
        return max(0.0, -float(np.minimum.reduce(self.balance))) / self.scale


def _largest(values: Array) -> float:
    """Return the largest size of some values, 0 without any.

    `np.max` takes several times as long for a few hundred.
    """
    return float(np.maximum.reduce(np.abs(values), initial=0.0)) if np.count_nonzero(values) else 0.0
