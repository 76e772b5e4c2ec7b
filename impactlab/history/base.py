"""History of a run, stepped or exact: channels, events, contact periods, energies, warnings, cost."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import ImpactlabError, closest
from impactlab.history.arguments import check_several, within_run
from impactlab.history.energy import EnergyBook, EnergyEnds
from impactlab.history.extremes import extremes
from impactlab.history.instruments import Measured, measure
from impactlab.history.sampling import page_times
from impactlab.history.views import Views
from impactlab.history.waves import Waves, separated
from impactlab.prefixes import prefixed
from impactlab.scene.method import Method
from impactlab.scene.problem import Probe, Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from impactlab.history.choice import Choice


class Event(NamedTuple):
    """A closing, an opening or an impulse of a contact at one instant."""

    time: float  # s
    contact: str
    kind: Literal["close", "open", "impulse"]
    impulse: float | None = None  # N s, of an impulse event only

    def __repr__(self) -> str:
        impulse = "" if self.impulse is None else f", impulse={prefixed(self.impulse, 'N s')}"
        return f"Event({self.contact!r}, {self.kind}, time={prefixed(self.time, 's')}{impulse})"


class ContactSpan(NamedTuple):
    """One period of contact; under a law of impulses from the first impulse to the last."""

    contact: str
    start: float  # s
    end: float | None  # s; None while still closed at the end of the run
    impulse: float  # N s
    peak_force: float | None  # N; None where the law has no force
    first_impulse: float | None = None  # N s, impulse laws only
    kicks: int | None = None  # number of impulses, impulse laws only

    def __repr__(self) -> str:
        end = "None" if self.end is None else prefixed(self.end, "s")
        peak = "None" if self.peak_force is None else prefixed(self.peak_force, "N")
        kicks = "" if self.kicks is None else f", kicks={self.kicks}"
        return (
            f"ContactSpan({self.contact!r}, start={prefixed(self.start, 's')}, end={end}, "
            f"impulse={prefixed(self.impulse, 'N s')}, peak_force={peak}{kicks})"
        )

    def until(self, duration: float) -> float:
        """Return its end, or the end of the run while still closed [s]."""
        return duration if self.end is None else self.end


class BranchChange(NamedTuple):
    """A change of branch of a piecewise linear law: the instant at which it yields, unloads or opens."""

    time: float  # s
    contact: str
    branch: str  # name in the law of the branch that begins

    def __repr__(self) -> str:
        return f"BranchChange({self.contact!r}, {self.branch}, time={prefixed(self.time, 's')})"


class LinkResult(NamedTuple):
    """Results of a link, or of all links of one name: forces, permanent set, absorbed energy."""

    name: str
    pieces: int
    set: float | None  # m, permanent set, the largest of its pieces in size; None for a law without one
    largest: float  # N, largest force, of the sum of the pieces
    smallest: float  # N, smallest force, negative where it pulled
    loss: float  # J, absorbed energy
    sets: tuple[float | None, ...] = ()  # m, of each piece in the order of the scene's contacts


class Warned(NamedTuple):
    """A warning of a run: a code and the contact for programs, a text for people."""

    code: str
    text: str
    contact: str = ""  # name of the contact that it is about; empty where it is about no single one


# Codes of warnings about a doubtful result: shown first.
SERIOUS = ("tolerance_not_met", "energy_gain", "energy_loss", "coordinates_change", "large_strain")


@dataclass(repr=False)
class Cost:
    """Times and counts of the work of a run."""

    setup_s: float = 0.0  # s, before the first step
    solve_s: float = 0.0  # s, the steps
    steps: int = 0
    rhs_evaluations: int | None = None  # of an adaptive run
    checks_s: float = 0.0  # s, after the run: reading the records, as far as checks for warnings need them
    unknowns: int | None = None  # displacements that are stepped, over all bodies; None without steps
    factorisations: int | None = None  # of an adaptive run that is implicit: LU decompositions

    def __repr__(self) -> str:
        counts = {"unknowns": self.unknowns, "rhs_evaluations": self.rhs_evaluations}
        known = [f"{name}={count}" for name, count in counts.items() if count is not None]
        times = {"setup": self.setup_s, "solve": self.solve_s, "checks": self.checks_s}
        parts = [f"steps={self.steps}", *known, *(f"{name}={prefixed(taken, 's')}" for name, taken in times.items())]
        return f"Cost({', '.join(parts)})"


def instants_around(times: Array, start: float, end: float) -> tuple[float, float]:
    """Return the last time up to a start and the first from an end.

    They are of rising times (n,) [s]; the first or the last of all where none lies there. Times and both ends are in s.
    """
    first = max(0, int(np.searchsorted(times, start, side="right")) - 1)
    last = min(len(times) - 1, int(np.searchsorted(times, end)))
    return float(times[first]), float(times[last])


class Field(NamedTuple):
    """A quantity along a body at one instant."""

    x: Array  # (n,) m
    values: Array  # (n,)

    def __repr__(self) -> str:
        low, high = float(np.min(self.values)), float(np.max(self.values))
        return f"<Field at {len(self.x)} places, x = {self.x[0]:.6g} to {self.x[-1]:.6g} m: {low:.6g} to {high:.6g}>"


IMPULSE_SAMPLES = 4000  # of a force whose impulse is summed
FIELD_POINTS = 401  # places of a field along a continuous rod, if none are given
MAX_NAMED = 60  # contacts in a message


class HasCase(Protocol):
    """The case that a run is of, as far as histories read it: `impactlab.Case`."""

    @property
    def label(self) -> str: ...
    @property
    def title(self) -> str: ...
    @property
    def source(self) -> str: ...
    @property
    def method_name(self) -> str: ...
    def to_yaml(self) -> str: ...


class AbstractHistory(Views, ABC):
    """A run, stepped or exact: four abstract methods, and fields that are set.

    1. ``channels``: the names that ``evaluate`` accepts.
    2. ``evaluate``: values of a channel at any times in [0, duration]. At a jump the value after it is given. Times
       outside the run are refused (`within_run`).
    3. ``field``: a quantity along a body at one time of the run.
    4. ``jumps``: the instants at which a channel jumps, for norms that leave their neighbourhood out.

    Channels: ``displacement|velocity|strain|stress|force:body@x`` (x as %.6g m), ``position:body`` and
    ``velocity:body`` of a mass, ``force:a|b``, ``gap:a|b``, ``momentum:body``, ``energy:body``.
    The last two are, in stepped runs, lines between at most 257 equally spaced instants.
    """

    scene: Scene
    method: Method  # as given; under a tolerance `choice` holds the chosen one
    duration: float  # s
    dt: float | None  # s, the step; None for an exact history
    events: tuple[Event, ...]
    contacts: tuple[ContactSpan, ...]
    links: tuple[LinkResult, ...] = ()
    changes: tuple[BranchChange, ...] = ()  # in order of time; of exact histories alone
    energy: EnergyBook
    warnings: list[Warned]
    cost: Cost
    case: HasCase | None = None  # None of a scene that was run without a case
    choice: Choice | None = None  # of a run with a tolerance: the method chosen, and why
    load_impulses: Mapping[str, float] = {}  # N s, of loads over time as the run has taken them, by body
    # The contacts and their periods by contact, once looked up.
    _spans: tuple[tuple[ContactSpan, ...], dict[str, list[tuple[int, ContactSpan]]]] | None = None
    integrator_used: bool = True  # False: every elastic body steps by itself, or the run is exact

    @abstractmethod
    def channels(self) -> tuple[str, ...]:
        """Return the names of the recorded channels; an exact history also has those at any other x."""

    @abstractmethod
    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        """Return a channel at times t [s], same shape; NaN where it has no value.

        Raises
        ------
        ImpactlabError
            If a time lies outside [0, duration] by more than rounding, or the channel was not recorded.
        """

    def evaluate_each(self, t: Array, channels: Sequence[str]) -> Array:
        """Return several channels at times t, shape (n,) [s]: shape (channels, n); see `evaluate`."""
        check_several(channels)
        t = np.atleast_1d(t)
        return np.array([self.evaluate(t, channel) for channel in channels]).reshape(len(channels), len(t))

    @abstractmethod
    def field(self, body: str, t: float, quantity: str, x: ArrayLike | None = None) -> Field:
        """Return a quantity along a body at time t [s].

        Places x [m] have the shape (n,); without them, those of the body's own grid. Continuous rods have fields at
        any time, bodies in the coordinates of a mesh or of modes at `field_times`: there the state is interpolated
        linearly between the ends of the step, displacements and velocities each from the instants of the scheme.

        Raises
        ------
        ImpactlabError
            If t lies outside [0, duration] by more than rounding or is not one of `field_times`; if x lies outside the
            body.
        """

    def fields_at(self, body: str, times: ArrayLike, quantity: str, x: ArrayLike | None = None) -> Field:
        """Return a quantity along a body at times (n,) [s], one at least, as `field` at each.

        The values have the shape (n, places).
        """
        each = [self.field(body, t, quantity, x) for t in np.asarray(times, float).tolist()]
        return Field(each[0].x, np.array([one.values for one in each]))

    def field_times(self, body: str) -> Array | None:
        """Return the times (n,) [s] at which a body has fields; None for any time."""
        return None

    @abstractmethod
    def jumps(self, channel: str) -> Array:
        """Return the instants (n,) [s] at which a channel jumps; empty where it is continuous."""

    def turning_times(self, channel: str) -> Array:
        """Return the instants (n,) [s] at which a channel may have extremes, in addition to equal instants.

        By default these are both sides of its jumps. The last step may reach beyond the end of the run.
        """
        jumps = np.minimum(self.jumps(channel), self.duration)
        return np.concatenate((jumps, np.nextafter(jumps, 0.0)))

    def at_end(self, channel: str) -> float:
        """Return the value of a channel at the end of the run."""
        return float(self.evaluate(np.array([self.duration]), channel)[0])

    def energy_ends(self) -> EnergyEnds:
        """Return the energies at both ends of the run [J].

        The last step may reach beyond the end: the energies of the book are linear in it, as channels are.
        """
        book = self.energy

        def at_end(values: Array) -> float:
            return float(np.interp(self.duration, book.time, values))

        booked = {name: at_end(losses) for name, losses in book.booked.items()}
        losses = None if book.by_contact is None else {name: at_end(lost) for name, lost in book.by_contact.items()}
        lost = None if losses is None else {name: loss for name, loss in losses.items() if loss != 0.0}
        return EnergyEnds(float(book.total[0]), at_end(book.total), at_end(book.work), booked, lost)

    def largest(self, channel: str) -> float:
        """Return the largest value of a channel in the run; see `extremes`."""
        return extremes(self, channel)[1]

    def recorded_around(self, channel: str, start: float, end: float) -> tuple[float, float]:
        """Return the recorded instants around an interval of a channel [s].

        These are the last one up to its start and the first one from its end on. By default a channel is known at any
        time, and the interval is returned.
        """
        return start, end

    @property
    def record_rate(self) -> float:
        """Number of records of channels per second.

        Between records channels are interpolated; inf where they are known at any time.
        """
        return math.inf

    def measured(self, probe: Probe | str | int) -> Measured:
        """Return times [s] and values of a probe as its instrument gives them.

        Parameters
        ----------
        probe : Probe, str or int
            A probe of the run, its channel such as ``strain:bar@0.5``, or its number from 0. The signal of one without
            an instrument is its channel at the rate of the records.

        Raises
        ------
        CaseError
            If there is no such probe, or its rate is above that of the records.
        """
        return measure(self, probe)

    def travelling(self, body: str, x: float, t: ArrayLike) -> tuple[Array, Array]:
        """Return the velocities [m/s] of the two waves at x [m], (n,) each.

        Continuous rods have them at any x. Other bodies give them from two channels that were recorded: the velocity
        at x, and there the strain, stress or force; at an end without support the contact forces on it.

        Raises
        ------
        ImpactlabError
            If the body is not a rod or a shaft, x lies outside it, or a channel is missing.
        """
        return separated(self.scene, body, x, self.channels(), lambda channel: self.evaluate(t, channel))

    def waves(self, body: str, x: float, quantity: str = "strain", t: ArrayLike | None = None) -> Waves:
        """Return the waves to the right and to the left at x [m].

        Parameters
        ----------
        quantity : str
            velocity, strain, stress or force; of a shaft twist_rate or torque.
        t : array_like, optional
            Times [s], shape (n,); those of a page if not given.

        Raises
        ------
        ImpactlabError
            As `travelling`, and if the body has no such quantity.
        """
        times = page_times(self.duration) if t is None else within_run(t, self.duration)
        to_right, to_left = self.travelling(body, x, times)
        return Waves.of(self.scene.bodies[body], x, quantity, times, to_right, to_left)

    def spans(self, contact: str) -> list[ContactSpan]:
        """Return the periods of contact of one contact by its name.

        Raises
        ------
        ImpactlabError
            If the scene has no contact of that name.
        """
        found = self._by_contact().get(str(contact))
        if found is None and str(contact) not in self.scene.contact_names:
            names = [each.name for each in self.scene.contacts]
            shown = f"{', '.join(names[:MAX_NAMED])}{', ...' if len(names) > MAX_NAMED else ''}"
            raise ImpactlabError(
                f"no contact {contact!r}.{closest(str(contact), names)} Contacts: {shown or 'none'}",
                remedy="Name one of these, as in their channels force:NAME.",
            )
        return [span for _, span in found or ()]

    def spans_of(self, contacts: Iterable[str]) -> list[ContactSpan]:
        """Return the periods of several contacts by name, in the order of ``contacts``."""
        table = self._by_contact()
        found = [numbered for contact in dict.fromkeys(contacts) for numbered in table.get(contact, ())]
        return [span for _, span in sorted(found, key=lambda numbered: numbered[0])]

    def _by_contact(self) -> dict[str, list[tuple[int, ContactSpan]]]:
        """Return the numbered periods of each contact, found once for runs with thousands of contacts."""
        if self._spans is None or self._spans[0] is not self.contacts:
            found: dict[str, list[tuple[int, ContactSpan]]] = {}
            for number, span in enumerate(self.contacts):
                found.setdefault(span.contact, []).append((number, span))
            self._spans = self.contacts, found
        return self._spans[1]

    def impulse_of(self, contact: str) -> float:
        """Return the whole impulse of one contact, or of a link [N s]."""
        return sum(span.impulse for span in self.spans(contact))

    def impulse_until(self, contact: str, time: float) -> float:
        """Return the impulse of a contact or link up to a time [N s].

        By default it is the mean of the force at equal instants times the time.
        """
        middles = max(0.0, time) * (np.arange(IMPULSE_SAMPLES) + 0.5) / IMPULSE_SAMPLES
        return float(np.mean(self.evaluate(middles, f"force:{contact}"))) * max(0.0, time)
