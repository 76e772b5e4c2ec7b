"""The history of a stepped run, from the records of the loop."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike

from impactlab.history.arguments import one_time, places_on, within_run
from impactlab.history.base import ContactSpan, Event, Field, LinkResult
from impactlab.history.energy import EnergyBook, EnergyEnds
from impactlab.history.frame import carried_by, drifts_alone, groups, touched_in
from impactlab.history.noise_floor import Found, above_noise
from impactlab.history.waves import wave_body
from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.numerics.garbage_collection import GarbageCollectionPaused
from impactlab.numerics.records import dtype_of
from impactlab.scene.problem import Contact
from impactlab.simulate.channels import AbstractRecordedHistory, Channel
from impactlab.simulate.stepping import event_times
from impactlab.simulate.stepping.arrays import SAMPLED, EventRecord
from impactlab.simulate.stepping.results import readout, rounding_touches, run_ends, snapshots
from impactlab.simulate.stepping.results.beyond_end import (
    ON_STEP,
    LastSteps,
    RecordsAround,
    around_end,
    last_steps,
)
from impactlab.simulate.stepping.results.chain_waves import ChainWaves, field_places
from impactlab.simulate.stepping.results.delay_waves import DelayWaves
from impactlab.simulate.stepping.results.recorded_channels import Ends, RecordedChannels, ends_of
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.startup.cached import cached_property
from impactlab.types import Array, Ints

MAX_AT_ONCE = 10_000  # values of a field read from waves: their intermediate arrays stay in the processor's cache
BOOKED = ("contact", "ends", "damping", "unresolved")  # losses, in the order of the samples


@final
class RecordedHistory(AbstractRecordedHistory):
    """A stepped run.

    Forces of hard contacts are constant over a step, those of compliant laws linear with the mean that acted in it;
    displacements and gaps are linear between the ends of steps; velocities are linear between the instants to which the
    scheme's velocities belong. A run of more steps than the scene's ``records`` keeps every second, third ... one, and
    of forces the mean in between; its events are dated in every step. Between, beads move on cubics by their rates.
    """

    def __init__(self, assembly: Assembly, integrator: AbstractIntegrator) -> None:
        super().__init__(assembly.scene, assembly.method, assembly.layout.built, assembly.dt)
        self.assembly = assembly
        self._facts = assembly.layout.plan.facts
        self._delayed: dict[str, DelayWaves | ChainWaves] = {}  # those that were evaluated
        self._times = np.zeros(0)  # of the snapshots
        self._integrator = integrator
        self._raw: list[Any] = []  # structured arrays of the fields of `EventRecord`
        self._up_to_last_step = False

    def drain(self) -> None:
        """Take the events out of the loop's buffer."""
        assembly, kind = self.assembly, dtype_of(EventRecord)
        if assembly.clock.n_events:
            buffer: Any = assembly.events  # C structures
            self._raw.append(np.frombuffer(buffer, kind, assembly.clock.n_events).copy())
            assembly.clock.n_events = 0

    def finish(self) -> None:
        """End the run; its records are read on first use."""
        self.drain()
        clock = self.assembly.clock
        if clock.step < self.assembly.steps:
            self.duration = min(self.duration, clock.time)
        self.dropped = clock.lost_in_maps, clock.n_maps

    @cached_property
    def _channels(self) -> RecordedChannels:
        return RecordedChannels(self.assembly, self._integrator)

    @cached_property
    def recorded(self) -> Mapping[str, Channel]:  # type: ignore[override]
        """Channels by name."""
        in_waves = self.assembly.layout.in_waves
        channels = dict(self._channels) if in_waves else {}
        for each in in_waves:
            times = self._ends[each.body][0]
            values = each.factor * self._waves_of(each.body).at(each.quantity, np.array(each.x), times)
            channels[each.channel] = Channel(times, values, False)
        return channels or self._channels

    def force_means(self, contact: Contact) -> tuple[Array, Array]:
        source, record = self.assembly.layout.sources[f"force:{contact.name}"], self._channels.record
        return record[:, 0], record[:, source.columns[0]]

    def smallest_gap(self, contact: Contact) -> float:
        kept = self.recorded  # a dictionary in a copy
        return kept.smallest_gap(contact) if isinstance(kept, RecordedChannels) else super().smallest_gap(contact)

    def _channel(self, name: str) -> Channel:
        found = self.recorded[name]
        return self._settled.settled(name, found) if found.rate else found

    @cached_property
    def _settled(self) -> run_ends.EndChannels:
        """Velocities, momenta and energies at both ends of the run.

        They are needed where the records lie beside these instants.
        """
        given = self.assembly, self._integrator, self.duration, self._last_steps
        return run_ends.settled(*given, lambda: self._around)

    @cached_property
    def _last_steps(self) -> LastSteps:
        return last_steps(self.assembly, self._integrator, self._raw, self.duration)

    @cached_property
    def _around(self) -> RecordsAround | None:
        """Records around the end of the run, for which a step beyond it is taken."""
        return around_end(self.assembly, self._integrator, self._last_steps)

    @contextmanager
    def summed_up_to_last_step(self) -> Iterator[None]:
        """Take no step beyond the end for impulses of closed contacts.

        The checks need none.
        """
        self._up_to_last_step = True
        try:
            yield
        finally:
            self._up_to_last_step = False
            self.__dict__.pop("_joined_impulses", None)
            if "contacts" in self.__dict__ and any(span.end is None for span in self.contacts):
                for name in ("_found", "events", "contacts"):
                    self.__dict__.pop(name, None)

    @cached_property
    def load_impulses(self) -> Mapping[str, float]:  # type: ignore[override]
        """Impulses of loads over time in the run [N s], by body."""
        return self._settled.load_impulses

    def energy_ends(self) -> EnergyEnds:
        return self._energy_ends

    @cached_property
    def _energy_ends(self) -> EnergyEnds:
        found, ends = super().energy_ends(), self._settled
        early, end, start = ends.early, ends.end, ends.start
        if end is not None:
            final, work = end[1] + end[SAMPLED::3].sum(), end[SAMPLED + 1 :: 3].sum() - start[SAMPLED + 1 :: 3].sum()
            booked = {name: float(lost) for name, lost in zip(BOOKED, end[2:SAMPLED], strict=True)}
            found = found._replace(final=float(final), work=float(work), booked=booked)
        found = found._replace(by_contact=readout.losses(self.assembly, found.booked["contact"]))
        if early is None:
            return found
        booked = found.booked | {name: found.booked[name] - getattr(early, name) for name in ("ends", "damping")}
        return found._replace(initial=early.initial, work=found.work - early.work, booked=booked)

    @cached_property
    def _ends(self) -> Ends:
        """Records of delay lines."""
        return ends_of(self.assembly, self._channels)

    @cached_property
    def _found(self) -> Found:
        with GarbageCollectionPaused(
            sum(map(len, self._raw))
        ):  # hard contacts of a mesh may open and close in each step
            return self._read_events()

    @cached_property
    def events(self) -> tuple[Event, ...]:  # type: ignore[override] # may be assigned, as that of every history
        """Closings, openings and impulses in order of time."""
        return self._found[0]

    @cached_property
    def contacts(self) -> tuple[ContactSpan, ...]:  # type: ignore[override]
        """Periods of contact in order of their start."""
        return self._found[1]

    @cached_property
    def energy(self) -> EnergyBook:  # type: ignore[override]
        """Energies at the samples of the run."""
        return self._read_energy()

    @cached_property
    def links(self) -> tuple[LinkResult, ...]:  # type: ignore[override]
        """Results of each link, or of all links of one name."""
        return tuple(readout.links(self.assembly, self.recorded))

    def memories(self) -> list[Sequence[float]]:
        return self._memories

    @cached_property
    def _memories(self) -> list[Sequence[float]]:
        return readout.memories(self.assembly)

    def __getstate__(self) -> dict[str, Any]:
        _ = self._joined_impulses, self._memories, self._ends, self.load_impulses, self._energy_ends
        return super().__getstate__() | {"recorded": dict(self.recorded)}

    def snapshots(self) -> Array:
        taken = bisect_left(self.assembly.shown[0], self.assembly.clock.n_snapshots)
        if self._times.size != taken:
            self._times = np.array(self.scene.field_times[:taken])
        return self._times

    def motions(self, numbers: Ints, body: str, velocities: bool) -> Array:
        return snapshots.motions(self.assembly, self._integrator, numbers, body, velocities)

    def field_times(self, body: str) -> Array | None:
        return None if body in self._ends else super().field_times(body)

    def field(self, body: str, t: float, quantity: str, x: ArrayLike | None = None) -> Field:
        if str(body) not in self._ends:
            return super().field(body, t, quantity, x)
        places, values = self.fields_at(body, [one_time(t, self.duration)], quantity, x)
        return Field(places, values[0])

    def fields_at(self, body: str, times: ArrayLike, quantity: str, x: ArrayLike | None = None) -> Field:
        if str(body) not in self._ends:
            return super().fields_at(body, times, quantity, x)
        instants, shown = within_run(times, self.duration), self.scene.bodies[body]
        read, factor = shown.reading(quantity)
        places = field_places(shown.length, self.built[body].model) if x is None else places_on(shown, x)
        waves, several = self._waves_of(body), max(1, instants.size * places.size // MAX_AT_ONCE)
        blocks = np.array_split(instants[:, None], several)
        return Field(places, factor * np.concatenate([waves.at(read, places, block) for block in blocks]))

    def travelling(self, body: str, x: float, t: ArrayLike) -> tuple[Array, Array]:
        if str(body) not in self._ends:
            return super().travelling(body, x, t)
        wave_body(self.scene, body, x)
        return self._waves_of(body).velocities(np.array(x), within_run(t, self.duration))

    def impulse_of(self, contact: str) -> float:
        return self._joined_impulses[contact] if str(contact) in self._joined_impulses else super().impulse_of(contact)

    @cached_property
    def _joined_impulses(self) -> dict[str, float]:
        """Impulses of the links by name [N s]."""
        solved = zip(self.assembly.layout.solved, self.assembly.contacts, strict=True)
        return {
            self.scene.contacts[number].name: self._up_to_end(number, record.total, record.force)
            - self._before_start(number)
            for number, record in solved
            if record.joined
        }

    def _up_to_end(self, number: int, given: float, force: float) -> float:
        """Return the impulse of a contact up to the run's end [N s].

        It belongs to the same instant as the momenta there. All steps together have ``given`` it, the last one with a
        ``force`` [N].
        """
        assembly, early = self.assembly, self._integrator.momentum_early * self.assembly.dt
        goes_on = self.duration > assembly.clock.time + ON_STEP * assembly.dt
        beside = early != 0.0 or goes_on or self._last_steps.crossed
        around = self._around if beside and not self._up_to_last_step else None
        if around is None:  # momenta there lie on a line within the last step
            return given - (assembly.clock.time - early - self.duration) * force
        at_start, place = assembly.layout.plan.start_forces.get(number, 0.0), assembly.layout.places[number]
        solved, column = place < len(assembly.contacts), assembly.layout.column_of(number)
        before = given - force * assembly.dt - (assembly.contacts[place].impulse if solved else 0.0)
        return around.impulse(self.duration, column, place if solved else None, before, early, at_start)

    def _before_start(self, number: int) -> float:
        """Return the impulse of a contact that belongs before t = 0 [N s].

        The steps count it, as of faces that are pressed together. In leapfrog that is half a step of the force at t =
        0; generalised-alpha lacks as much.
        """
        force = self.assembly.layout.plan.start_forces.get(number, 0.0)
        return self._integrator.momentum_early * self.assembly.dt * force

    def _peak_at_end(self, number: int, start: float, last: float, peak: float) -> float:
        """Return the peak of a contact that continues at the run's end [N].

        It began at ``start`` [s]. A force that rises is largest there: more than the ``last`` mean over a step, or less
        where the middle of that step lies beyond the run.
        """
        middles, record = self._channels.instants.middles, self._channels.record
        if last >= peak and middles[-1] > self.duration:
            within = record[(middles > start) & (middles <= self.duration), self.assembly.layout.column_of(number)]
            peak = float(within.max(initial=0.0))
        return max(peak, self._force_at_end(number))

    def _force_at_end(self, number: int) -> float:
        """Return the force of a closed contact at the end of the run [N], that of its channel.

        Of leapfrog, which knows forces up to the start of the last step, it follows from the overlap: at the front of a
        wave along beads it may rise by some per cent in a step.
        """
        layout, contact = self.assembly.layout, self.scene.contacts[number].name
        power = self.assembly.acting.laws[contact].power_force(layout.plan.starts[number])
        if power is None or self._integrator.load_point > 0.0:
            return self.at_end(f"force:{contact}")
        column, last = layout.column_of(number), self._channels.record[-2:]
        place = column - layout.first_bead_force
        gap = np.interp(self.duration, last[:, 0], last[:, column + 1]) if place < 0 else self._last_bead_gaps[place]
        return float(power.stiffness * max(0.0, -float(gap)) ** power.exponent)

    @cached_property
    def _last_bead_gaps(self) -> Array:
        """Gaps of bead contacts at the end of the run [m], (n_bead_contacts,)."""
        channels = self._channels
        return readout.bead_gaps_at_end(self.assembly, channels.record, channels.instants.velocities, self.duration)

    def _waves_of(self, body: str) -> DelayWaves | ChainWaves:
        if body not in self._delayed:
            times, kept = self._ends[body]
            rod, model = self.scene.elastic[body].waves, self.built[body].model
            assert rod is not None and self.dt is not None  # noqa: S101, PT018 - a delay line is a rod that steps
            self._delayed[body] = (
                ChainWaves(model, times, kept, self.dt)
                if isinstance(model, DelayChain)
                else DelayWaves(rod, times, kept, self.dt)
            )
        return self._delayed[body]

    def _read_energy(self) -> EnergyBook:
        assembly, scene = self.assembly, self.scene
        sample = assembly.memory.sample[: assembly.clock.n_samples]
        columns = {name: SAMPLED + 3 * assembly.layout.body_numbers[name] for name in scene.in_order}
        touched = touched_in(self)
        joined = groups(scene, touched)
        works = [sample[:, column + 1] for column in columns.values()]
        work = works[0] + works[1] if len(works) == 2 else np.array(works).T.sum(axis=1)
        time = sample[:, 0]
        if self._integrator.velocity_point < 1.0:  # energies of leapfrog are those of the instants of its velocities
            time = np.maximum(time - (1.0 - self._integrator.velocity_point) * assembly.dt, 0.0)
        return EnergyBook(
            time=time,
            bodies={name: sample[:, column] for name, column in columns.items()},
            stored=sample[:, 1],
            booked={name: sample[:, column] for column, name in enumerate(BOOKED, start=2)},
            work=work - (work[0] if len(work) else 0.0),
            carried=None if drifts_alone(scene, joined) else carried_by(joined, time),
        )

    def _read_events(self) -> Found:
        assembly, contacts = self.assembly, self.scene.contacts
        events: list[Event] = []
        spans: list[ContactSpan] = []
        started: dict[int, float] = {}
        early = {number: self._before_start(number) for number in assembly.layout.plan.start_forces}
        kicks: dict[int, list[tuple[float, float]]] = {}
        released = readout.opened_in_first_step(assembly, self._raw, -self._integrator.momentum_early * assembly.dt)
        found = rounding_touches.events_of(assembly, self._raw, self.duration, early)
        for time, place, kind, impulse, span_impulse, peak in (*released, *found):
            number = assembly.layout.numbers[place]
            name = contacts[number].name
            if time > self.duration:
                continue
            if kind == event_times.IMPULSE:
                events.append(Event(time, name, "impulse", impulse))
                kicks.setdefault(number, []).append((time, impulse))
            elif kind == event_times.CLOSE:
                events.append(Event(time, name, "close"))
                started[number] = time
            else:
                events.append(Event(time, name, "open"))
                since_start = span_impulse - early.pop(number, 0.0)
                spans.append(ContactSpan(name, started.pop(number, 0.0), time, since_start, peak))
        for number, time in started.items():
            name, (impulse, force, peak) = contacts[number].name, readout.span_of(assembly, number)
            if not assembly.acting.laws[name].hard:  # a force that may jump is known as means over steps alone
                peak = self._peak_at_end(number, time, force, peak)
            since_start = self._up_to_end(number, impulse, force) - early.pop(number, 0.0)
            since_start = max(0.0, since_start)  # of a force that began in the last step a line may begin below zero
            spans.append(ContactSpan(name, time, None, since_start, peak))
        for number, given in kicks.items():
            name = contacts[number].name
            if not assembly.acting.laws[name].answers_force:
                total = sum(impulse for _, impulse in given)
                spans.append(ContactSpan(name, given[0][0], given[-1][0], total, None, given[0][1], len(given)))
        spans = readout.with_forces_at_start(assembly, spans)
        events.sort(key=lambda event: event.time)
        steps = self.duration / assembly.dt
        return above_noise(self.scene, assembly.method, events, spans, steps, self.duration)
