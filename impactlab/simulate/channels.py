"""Recorded histories: channels as steps or lines, fields at snapshots.

Forces have slopes inside steps.
"""

from __future__ import annotations

import itertools
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impactlab.errors import ImpactlabError, closest
from impactlab.history.arguments import END_ROUNDING, check_one, check_several, one_time, places_on, within_run
from impactlab.history.base import AbstractHistory, Cost, Field, instants_around
from impactlab.numerics.interpolation import Between, between, cubic, interpolated, turning_points
from impactlab.numerics.slopes import slopes
from impactlab.scene.bodies import mechanism_of
from impactlab.scene.method import Method
from impactlab.scene.problem import Contact, Scene
from impactlab.simulate.field_rows import FieldRows, rows_of, snapshots_at
from impactlab.simulate.planning.contact_facts import ContactFacts
from impactlab.simulate.planning.preparation import BuiltBody
from impactlab.startup.cached import cached_property
from impactlab.types import Array, Ints, PowerForce, Quantity


class Smooth(NamedTuple):
    """A smooth motion [m], or the contact force K (-u)^n of one: cubic between records by its rates.

    Several at the same times have values and rates (channels, n).
    """

    times: Array  # (n,) s
    values: Array  # (n,) m
    rates: Array  # (n,) m/s
    power: PowerForce | None = None

    def at(self, t: Between) -> Array:
        """Return the motion [m] or force [N], in the shape of the times."""
        found = cubic(t, self.values, self.rates)
        if self.power is None:
            return found
        return np.asarray(self.power.stiffness * np.maximum(-found, 0.0) ** self.power.exponent)

    def turning_times(self) -> Array:
        """Return the instants at which it may have extremes [s]."""
        return np.concatenate((self.times, turning_points(self.times, self.values, self.rates)))


class Channel(NamedTuple):
    """Values at times, stepped (each value holds since the time before it) or linear.

    Where the values of a stepped channel are means over steps with known middles, it is read with a slope inside each
    step (`slopes`): the stairs themselves are of the first order only. A channel with a ``smooth`` one is read by that,
    and its values are those of the records.
    """

    times: Array
    values: Array
    stepped: bool
    middles: Array | None = None
    rate: bool = False  # whether it follows from velocities, which some schemes keep at other instants than the ends
    pulls: bool = False  # a force that may have either sign
    smooth: Smooth | None = None


class Probed(NamedTuple):
    """A channel of a quantity of one body at one place."""

    channel: str
    body: str
    x: float  # m; of a mechanism the number of a reading or of a gauge
    quantity: Quantity
    factor: float  # of the quantity, in the channel


def probed(scene: Scene) -> Iterator[Probed]:
    """Yield the channels of probes, gauge ends, loaded ends and rigid masses.

    Of a probe on a link, ``x`` is the number of the gauge of its mechanism.
    """
    for probe in scene.recorded_probes:
        if probe.body in scene.bodies:
            yield Probed(probe.channel, probe.body, probe.x, *scene.bodies[probe.body].reading(probe.quantity))
        else:  # of a link
            mechanism = mechanism_of(probe.body, scene.bodies.values())
            yield Probed(probe.channel, mechanism.name, *mechanism.gauged(probe.body, probe.x, probe.quantity))
    for name, channel, x, quantity in scene.own_channels:
        yield Probed(channel, name, x, quantity, 1.0)


SAME_PLACE = 1e-9  # of a body's length: a place this near to a face is the face
MIN_LOCATED = 1000  # instants, from which on their steps are kept: for fewer a comparison takes longer than the search
MAX_TOGETHER = 50_000  # values of channels that are read at once: some passes over them stay in the cache
PER_STEP = 8  # instants in the rest of a step, at which a force is integrated
MAX_NAMED = 60  # channels in a message: of thousands of beads there are six each
# Fields that refer to the memory of a run.
OF_THE_RUN = ("assembly", "_record", "_channels", "_last_bead_gaps", "_located", "_lying")


class AbstractRecordedHistory(AbstractHistory):
    """A history of recorded channels. To write one, supply ``recorded``, `snapshots`, `motions` and `memories`."""

    recorded: Mapping[str, Channel]
    dropped: tuple[float, int] = (0.0, 0)  # J, by changes of coordinates with a contact, and their number
    _located: tuple[Array, Array, NDArray[np.int64]] | None = None  # ends of steps, instants read last, their steps
    _lying: Between | None = None  # those of smooth channels

    def __init__(self, scene: Scene, method: Method, built: Mapping[str, BuiltBody], dt: float | None = None) -> None:
        self.scene, self.method, self.duration, self.dt = scene, method, scene.duration, dt
        self.warnings, self.cost = [], Cost()
        self.built = built
        self._facts: dict[str, ContactFacts] = {}  # of contacts, by name
        self._slopes: dict[str, Array] = {}  # of forces that were read
        self._along: dict[
            tuple[str, Quantity, bool], FieldRows
        ] = {}  # of fields that were read: grid, places given last
        self._taken: tuple[Array, dict[tuple[str, bool], Array]] | None = None  # snapshots of a copy

    def facts_of(self, contact: Contact) -> ContactFacts:
        """Return the facts of a contact that checks read, shared by runs of a plan."""
        known = self._facts.get(contact.name)
        if known is None:
            known = ContactFacts(self.scene, self.method, self.built, self.dt, contact)
            self._facts[contact.name] = known
        return known

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields of a copy, without the memory of the run.

        All records are read first, for copies and pickles alike.
        """
        _ = self.recorded, self.events, self.contacts, self.energy, self.links
        times = self._snapshots
        numbers = np.arange(len(times))
        motions = {at: self._motions(numbers, *at) for at in itertools.product(self.built, (False, True))}
        return {key: value for key, value in vars(self).items() if key not in OF_THE_RUN} | {"_taken": (times, motions)}

    @property
    def _snapshots(self) -> Array:
        return self.snapshots() if self._taken is None else self._taken[0]

    def _motions(self, numbers: Ints, body: str, velocities: bool) -> Array:
        if self._taken is None:
            return self.motions(numbers, body, velocities)
        return self._taken[1][body, velocities][numbers]

    @abstractmethod
    def snapshots(self) -> Array:
        """Return the times of the snapshots taken so far, shape (n,) [s]."""

    @abstractmethod
    def motions(self, numbers: Ints, body: str, velocities: bool) -> Array:
        """Return displacements or velocities of a body's coordinates at snapshots by their numbers (n,).

        The shape is (n, n_dof); see `_row`.
        """

    @abstractmethod
    def memories(self) -> Sequence[Sequence[float]]:
        """Return the memory of the law of each contact at the end of the run."""

    def channels(self) -> tuple[str, ...]:
        return tuple(self.recorded)

    def force_means(self, contact: Contact) -> tuple[Array, Array]:
        """Return instants [s], and the mean force of a contact from the instant before up to each [N]."""
        force = self.recorded[f"force:{contact.name}"]
        return force.times, force.values

    def smallest_gap(self, contact: Contact) -> float:
        """Return the smallest gap of a contact in the records [m], negative in an overlap."""
        return float(self.recorded[f"gap:{contact.name}"].values.min())

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        t = within_run(t, self.duration)
        self._check_channel(channel)
        times, values, stepped, middles, _, pulls, smooth = self._channel(channel)
        if smooth is not None:
            return smooth.at(self._between(smooth.times, t))
        if not stepped:
            return np.asarray(np.interp(t, times, values))
        step = self._step_at(times, t)
        if middles is None:
            return values[step]
        if channel not in self._slopes:  # the value at t = 0 belongs to no step
            self._slopes[channel] = np.append(0.0, slopes(middles[1:], values[1:]))
        return _on_slopes(values.take(step), self._slopes[channel].take(step), t - middles.take(step), pulls)

    def evaluate_each(self, t: Array, channels: Sequence[str]) -> Array:
        check_several(channels)
        t = np.atleast_1d(within_run(t, self.duration))
        found = np.empty((len(channels), len(t)))
        alike: dict[Any, tuple[list[int], list[Channel]]] = {}
        for number, name in enumerate(channels):
            self._check_channel(name)
            channel = self._channel(name)
            instants, smooth = (id(channel.times), id(channel.middles)), channel.smooth and (channel.smooth.power,)
            numbers, group = alike.setdefault((*instants, channel.stepped, channel.pulls, smooth), ([], []))
            numbers.append(number)
            group.append(channel)
        for numbers, group in alike.values():
            some = max(1, MAX_TOGETHER // max(1, group[0].times.size))
            for first in range(0, len(group), some):
                found[numbers[first : first + some]] = self._together(t, group[first : first + some])
        return found

    def _together(self, t: Array, group: Sequence[Channel]) -> Array:
        """Return channels that differ only in their values and rates, (channels, n), at times t [s]."""
        first, rows = group[0], np.array([(channel.smooth or channel).values for channel in group])
        if first.smooth is not None:
            rates = np.array([channel.smooth.rates for channel in group if channel.smooth is not None])
            return first.smooth._replace(values=rows, rates=rates).at(self._between(first.smooth.times, t))
        if not first.stepped:
            return interpolated(t, first.times, rows)
        step = self._step_at(first.times, t)
        if first.middles is None:
            return np.asarray(rows[:, step])
        means = rows[:, step]
        slope = np.zeros_like(rows)
        slope[:, 1:] = slopes(first.middles[1:], rows[:, 1:])
        return _on_slopes(means, slope[:, step], t - first.middles[step], first.pulls)

    def _step_at(self, times: Array, t: Array) -> NDArray[np.int64]:
        """Return the numbers of a stepped channel's values at times t [s].

        They have the shape of t. A value holds on [time before, its own time): at a jump the value after it is given.
        Many contacts are mostly read at the same instants one after the other: the last ones are kept.
        """
        kept = self._located
        if kept is not None and t.size >= MIN_LOCATED and kept[0] is times and np.array_equal(kept[1], t):
            return kept[2]
        step = np.minimum(np.searchsorted(times, t, side="right"), times.size - 1)
        if t.size >= MIN_LOCATED:
            self._located = times, t, step
        return step

    def _between(self, times: Array, t: Array) -> Between:
        """Return where times t lie between those of records [s]; the last ones are kept, as by `_step_at`."""
        kept = self._lying
        if kept is None or kept.instants is not times or not np.array_equal(kept.t, t):
            kept = self._lying = between(t.copy(), times)
        return kept

    def _check_channel(self, channel: str) -> None:
        """Raise `ImpactlabError` where a channel was not recorded."""
        if str(channel) in self.recorded:
            return
        check_one(channel)
        names = sorted(self.recorded)
        many = f", ... ({len(names)} in all: `history.channels()`)" if len(names) > MAX_NAMED else ""
        raise ImpactlabError(
            f"channel '{channel}' was not recorded.{closest(str(channel), names)} "
            f"Recorded: {', '.join(names[:MAX_NAMED])}{many}",
            remedy="A quantity at another place needs a probe in the case.",
        )

    def _channel(self, name: str) -> Channel:
        """Return a channel as it is evaluated."""
        return self.recorded[name]

    def recorded_around(self, channel: str, start: float, end: float) -> tuple[float, float]:
        before, after = instants_around(self._channel(channel).times, start, end)
        return min(before, start), max(end, min(after, self.duration))

    def impulse_until(self, contact: str, time: float) -> float:
        """Return the impulse of a contact or link up to a time [N s].

        Means over whole steps are summed; the force is integrated over the rest. In leapfrog the last force acts from
        half a step before the end of the run.
        """
        times, means, stepped, *_ = self._channel(f"force:{contact}")
        if not stepped:
            return super().impulse_until(contact, time)
        whole = max(0, int(np.searchsorted(times, time, side="right")) - 1)
        start = float(times[whole])
        given = float(np.sum(means[1 : whole + 1] * np.diff(times[: whole + 1])))
        if time <= start:
            return given
        middles = start + (time - start) * (np.arange(PER_STEP) + 0.5) / PER_STEP
        return given + float((time - start) * np.mean(self.evaluate(middles, f"force:{contact}")))

    def largest(self, channel: str) -> float:
        self._check_channel(channel)
        found = self._channel(channel)
        if found.stepped or found.smooth is not None:
            return super().largest(channel)
        inside = found.values[: np.searchsorted(found.times, self.duration)]  # the last step may reach beyond the end
        return float(inside.max(initial=self.at_end(channel)))

    @cached_property
    def record_rate(self) -> float:
        times = next((each.times for each in self.recorded.values()), np.zeros(0))
        return 1.0 / float(np.max(np.diff(times))) if times.size > 1 else 0.0

    def jumps(self, channel: str) -> Array:
        self._check_channel(channel)
        found = self.recorded[channel]
        return found.times if found.stepped else np.zeros(0)

    def turning_times(self, channel: str) -> Array:
        self._check_channel(channel)
        found = self._channel(channel)  # straight lines between records are largest at one of them
        if found.smooth is not None:
            times = found.smooth.turning_times()
        else:
            times = super().turning_times(channel) if found.stepped else found.times
        return np.clip(times, 0.0, self.duration)  # the last step may end after the run

    def field_times(self, body: str) -> Array | None:
        self._check_body(body)
        return self._snapshots

    def field(self, body: str, t: float, quantity: str, x: ArrayLike | None = None) -> Field:
        places, values = self.fields_at(body, [one_time(t, self.duration)], quantity, x)
        return Field(places, values[0])

    def fields_at(self, body: str, times: ArrayLike, quantity: str, x: ArrayLike | None = None) -> Field:
        self._check_body(body)
        read, factor = self.scene.bodies[body].reading(quantity)
        numbers = snapshots_at(within_run(times, self.duration).ravel(), self._snapshots, END_ROUNDING * self.duration)
        places, rows, delays = self._rows_at(body, read, x)
        of_rates = [read == "velocity"] if delays is None else [read == "velocity", True]
        motions = [self._motions(numbers, body, rate) for rate in of_rates]
        values = rows.times(motions[0])
        if delays is not None:
            values += delays * rows.times(motions[1])
        if read == "displacement":
            self._press(values, places, body, self._snapshots[numbers])
        return Field(places.copy(), factor * values)

    def _press(self, values: Array, places: Array, body: str, times: Array) -> None:
        """Set displacements (times, places) at faces that a contact presses in beyond their coordinates.

        They are those of the channels of the faces. The channel of a run that keeps every step is as exact as the
        coordinates; in others it counts at faces without mass alone, where the compliance beyond the coordinates is
        large.
        """
        built = self.built[body]
        for x in {x for _, each in self.scene.met_by(body) for x in each.places_on(body)}:
            channel = built.body.face_channel(x)
            at = np.flatnonzero(np.abs(places - x) <= SAME_PLACE * built.body.length)
            if at.size == 0 or channel not in self.recorded or built.model.left_out(x, "displacement", x) <= 0.0:
                continue
            if x in dict(built.system.massless) or self._keeps_every_step(channel):
                values[:, at] = self.evaluate(times, channel)[:, None]

    def _keeps_every_step(self, channel: str) -> bool:
        times = self.recorded[channel].times
        return self.dt is not None and times.size > 1 and float(np.diff(times).max()) <= (1.0 + END_ROUNDING) * self.dt

    def _check_body(self, body: str) -> None:
        if str(body) not in self.built:
            parts = {name for each in self.built.values() for name in each.body.modelled_parts}
            is_link = str(body) in parts
            what = f"'{body}' is a link of a mechanism, which has no fields" if is_link else f"no body '{body}'"
            raise ImpactlabError(f"{what}; bodies: {', '.join(self.built)}", remedy="Name one of these.")

    def _rows_at(self, body: str, read: Quantity, x: ArrayLike | None) -> FieldRows:
        """Return places and the rows of a quantity there.

        Those of the body's own grid, and of the last x, are kept.
        """
        key, kept = (body, read, x is None), self._along.get((body, read, x is None))
        if kept is not None and x is None:
            return kept
        places = self.built[body].model.grid() if x is None else places_on(self.scene.bodies[body], x)
        if kept is None or not np.array_equal(places, kept.places):
            rows = rows_of([self._row(body, float(place), read) for place in places])
            elastic = self.scene.bodies[body].elastic
            delays = np.array([0.0 if elastic is None else elastic.retardation(float(x), read) for x in places])
            kept = self._along[key] = FieldRows(places, rows, delays if delays.any() else None)
        return kept

    def _row(self, body: str, x: float, read: Quantity) -> Array:
        """Return a row over the coordinates of a body.

        Of a body with phases, these are the coordinates while open, then those while closed.
        """
        _, model, system = self.built[body]
        rows = [model.row(x, read)] + ([] if system.phases is None else [system.phases.closed.row(x, read)])
        return np.concatenate(rows)


def _on_slopes(means: Array, slope: Array, after: Array, pulls: bool) -> Array:
    """Return forces at times after the middles of their steps [s], from means and slopes in these.

    Beyond the last step a force that falls and may not pull is zero.
    """
    sloped = means + slope * after
    return np.asarray(sloped if pulls else np.maximum(sloped, np.minimum(means, 0.0)))
