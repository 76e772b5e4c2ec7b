"""History of a run, stepped or exact: channels at any time, events, contact periods, energies, warnings, cost."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy import float64
from numpy.typing import ArrayLike, NDArray

from impactlab.errors import ImpactlabError
from impactlab.scene.bodies import Body
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene

if TYPE_CHECKING:
    import xarray

    from impactlab.refine.choice_record import Choice

Array = NDArray[float64]


class Event(NamedTuple):
    """A closing, an opening or an impulse of a contact at one instant."""

    time: float  # s
    contact: str
    kind: Literal["close", "open", "impulse"]
    impulse: float | None = None  # N s, of an impulse event only


class ContactSpan(NamedTuple):
    """One period of contact; for an impulse law one entry per pair, first kick to last."""

    contact: str
    start: float  # s
    end: float | None  # s; None while still closed at the end of the run
    impulse: float  # N s
    peak_force: float | None  # N; None where the law has no force
    first_impulse: float | None = None  # N s, impulse laws only
    kicks: int | None = None  # impulse laws only

    def until(self, duration: float) -> float:
        """Return its end, or the end of the run while still closed [s]."""
        return duration if self.end is None else self.end


class CarriedEnergy(NamedTuple):
    """Energy of the common motion of all interacting bodies, which contacts cannot exchange."""

    kinetic: float  # J, of the centres of mass at t = 0
    work: Array  # (n,) J, of loads on the common motion


DRIFT_ROUNDING = 1e-13  # of the energy of all bodies: a smaller difference of such energies is rounding


@dataclass(frozen=True)
class EnergyBook:
    """Energies over the run and the balance inside it (units J; gain and loss are shares of the scale).

    The balance is the same in every frame of reference; the scale is that of the bodies' own frame.
    """

    time: Array  # (n,) s, the instants at which energies were taken
    bodies: dict[str, Array]  # name -> (n,) kinetic + strain energy of each body
    stored: Array  # (n,) held by contacts
    booked: dict[str, Array]  # name -> (n,) losses booked so far: contact, ends, unresolved; never negative
    work: Array  # (n,) work of gravity and end forces so far
    carried: CarriedEnergy | None = None  # by free bodies in a common motion (`impactlab.scene.frame`); None: nothing

    @cached_property
    def total(self) -> Array:
        """Energy of all bodies and contacts, shape (n,) [J]."""
        return np.asarray(sum(self.bodies.values(), np.zeros_like(self.time)) + self.stored)

    @cached_property
    def balance(self) -> Array:
        """Bodies + stored + booked - work - initial, shape (n,) [J]; zero for a perfect run."""
        total = self.total + sum(self.booked.values(), np.zeros_like(self.time)) - self.work
        return np.asarray(total - total[0])

    @cached_property
    def at_stake(self) -> float:
        """Reference energy [J]: the larger of the energy that bodies can exchange and the work of loads; 0 if both are.

        It is measured in the frame of the centre of mass of the interacting bodies. Bodies that only drift have none
        there; for them it is the energy of the drift.
        """
        start = float(np.abs(self.total[0]))
        whole = max(start, float(np.max(np.abs(self.work), initial=0.0)))
        if self.carried is None:
            return whole
        inside = max(0.0, start - self.carried.kinetic)
        inside = max(inside, float(np.max(np.abs(self.work - self.carried.work), initial=0.0)))
        return inside if inside > DRIFT_ROUNDING * whole else whole

    @cached_property
    def rounding(self) -> float:
        """Energy of all bodies and work of loads, over the scale: rounding errors of the balance grow with it."""
        whole = max(float(np.abs(self.total[0])), float(np.max(np.abs(self.work), initial=0.0)))
        return max(1.0, whole / self.scale)

    @cached_property
    def scale(self) -> float:
        """`at_stake`; 1 J if that is zero [J]: gains and losses are shares of it."""
        return self.at_stake or 1.0

    @cached_property
    def final_error(self) -> float:
        """Error of the balance at the end, over the scale."""
        return abs(float(self.balance[-1])) / self.scale

    @cached_property
    def largest_gain(self) -> float:
        """Largest rise of the balance above its start, over the scale."""
        return max(0.0, float(np.max(self.balance))) / self.scale

    @cached_property
    def largest_loss(self) -> float:
        """Largest fall of the balance below its start, over the scale."""
        return max(0.0, -float(np.min(self.balance))) / self.scale


class Warned(NamedTuple):
    """A warning of a run: a code for programs, a text for people."""

    code: str
    text: str


SERIOUS = ("tolerance_not_met", "energy_gain")  # codes of warnings about a doubtful result: shown first


@dataclass
class Cost:
    """Times and counts of the work of a run."""

    setup_s: float = 0.0  # s, before the first step
    solve_s: float = 0.0  # s, the steps, and reading their records
    steps: int = 0
    rhs_evaluations: int | None = None  # of an adaptive run
    checks_s: float = 0.0  # s, after the run: checks for warnings
    unknowns: int | None = None  # displacements that are stepped, over all bodies; None without steps
    factorisations: int | None = None  # of an adaptive run that is implicit: LU decompositions


class Field(NamedTuple):
    """A quantity along a body at one instant."""

    x: Array  # (n,) m
    values: Array  # (n,)


END_ROUNDING = 1e-9  # of duration or length: a time outside a run, a place outside a body by less is moved into it


def within_run(t: ArrayLike, duration: float) -> Array:
    """Return times as an array, those outside [0, duration] by rounding moved into it, same shape as t [s].

    Raises
    ------
    ImpactlabError
        If a time lies further outside, or is not a number.
    """
    times = np.asarray(t, float)
    slack = END_ROUNDING * duration
    outside = times[~((times >= -slack) & (times <= duration + slack))]
    if outside.size:
        raise ImpactlabError(
            f"{float(outside.flat[0]):.6g} s lies outside the run, 0 to {duration:.6g} s",
            remedy="Give times of the run, or run the case with a longer duration.",
            path="solve.duration",
        )
    return np.asarray(np.clip(times, 0.0, duration))


def places_on(body: Body, x: ArrayLike) -> Array:
    """Return places on a body as an array, those outside its length by rounding moved onto it, shape (n,) [m].

    Raises
    ------
    ImpactlabError
        If a place lies further outside, or is not a number.
    """
    places = np.atleast_1d(np.asarray(x, float))
    slack = END_ROUNDING * body.length
    outside = places[~((places >= -slack) & (places <= body.length + slack))]
    if outside.size:
        raise ImpactlabError(
            f"{float(outside.flat[0]):.6g} m lies outside '{body.name}', 0 to {body.length:.6g} m",
            remedy="Give x from the left end of the body.",
            path=f"bodies.{body.name}",
        )
    return np.asarray(np.clip(places, 0.0, body.length))


class AbstractHistory(ABC):
    """A run, computed or exact. To write one, supply the four abstract methods and set the fields.

    1. ``channels``: the names that ``evaluate`` accepts.
    2. ``evaluate``: values of a channel at any times in [0, duration]. At a jump the value after it is given. Times
       outside the run are refused (`within_run`).
    3. ``field``: a quantity along a body at one time of the run.
    4. ``jumps``: the instants at which a channel jumps, for norms that leave their neighbourhood out.

    Channels: ``displacement|velocity|strain|stress|force:body@x`` (x as %.6g m), ``position:body`` and
    ``velocity:body`` of a mass, ``force:a|b``, ``gap:a|b``, ``momentum:body``, ``energy:body``.
    """

    scene: Scene
    method: Method  # as given; under a tolerance `choice` holds the chosen one
    duration: float  # s
    dt: float | None  # s, the step; None for an exact history
    events: tuple[Event, ...]
    contacts: tuple[ContactSpan, ...]
    energy: EnergyBook
    warnings: list[Warned]
    cost: Cost
    choice: Choice | None = None  # of a run with a tolerance: the method chosen, and why
    integrator_used: bool = True  # False: every elastic body steps by itself, or the run is exact

    @abstractmethod
    def channels(self) -> tuple[str, ...]:
        """Return the names of the channels that were recorded (an exact history has them at any other x, too)."""

    @abstractmethod
    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        """Return the channel at the times t [s], same shape as t, SI units; NaN where the method gives no value.

        Raises
        ------
        ImpactlabError
            If a time lies outside [0, duration] by more than rounding, or the channel was not recorded.
        """

    @abstractmethod
    def field(self, body: str, t: float, quantity: str, x: ArrayLike | None = None) -> Field:
        """Return a quantity along a body at time t [s], at places x [m], shape (n,), or those of the body's own grid.

        Continuous rods answer at any time. Bodies in the coordinates of a mesh or of modes answer at the times in
        `field_times`: there the state is interpolated linearly between the two ends of the step, displacements and
        velocities each from the instants to which the scheme's own belong.

        Raises
        ------
        ImpactlabError
            If t lies outside [0, duration] by more than rounding or is none of `field_times`; if x lies outside the
            body.
        """

    def field_times(self, body: str) -> Array | None:
        """Return the times at which `field` answers for a body, shape (n,) [s]; None, as here, for any time."""
        return None

    @abstractmethod
    def jumps(self, channel: str) -> Array:
        """Return the instants at which the channel jumps, shape (n,) [s]; empty where it is continuous."""

    def spans(self, contact: str) -> list[ContactSpan]:
        """Return the periods of contact of one contact by its name."""
        return [span for span in self.contacts if span.contact == contact]

    def to_xarray(self, points: int = 1000) -> xarray.Dataset:
        """Return all channels on an equal grid of times as an xarray Dataset (needs the ``data`` extra)."""
        import xarray

        times = np.linspace(0.0, self.duration, points)
        return xarray.Dataset({name: ("time", self.evaluate(times, name)) for name in self.channels()}, {"time": times})
