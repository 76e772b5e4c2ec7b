"""The history of a stepped run: what the loop recorded, read at any time."""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import ImpactlabError
from impactlab.history.base import AbstractHistory, Array, ContactSpan, Cost, EnergyBook, Event, Field, within_run
from impactlab.history.noise_floor import above_noise, reach_of
from impactlab.integrators.base import AbstractIntegrator
from impactlab.numerics.slopes import slopes
from impactlab.scene.frame import carried_by, groups, touched_in
from impactlab.scene.method import laws_of
from impactlab.simulate.channels import Channel, read_channel
from impactlab.simulate.stepping import event_times as dating
from impactlab.simulate.stepping.arrays import SAMPLED
from impactlab.simulate.stepping.assembly import Assembly


@final
class RecordedHistory(AbstractHistory):
    """What a stepped run recorded.

    Forces of hard contacts are constant over a step, those of compliant laws linear with the mean that acted in it;
    displacements and gaps are linear between the ends of steps; velocities are linear between the instants to which the
    scheme's velocities belong. A run of more steps than the scene's ``records`` keeps
    every second, third ... one, and of forces the mean in between; its events are dated in every step and all kept.
    """

    def __init__(self, assembly: Assembly, integrator: AbstractIntegrator) -> None:
        self.assembly = assembly
        self.scene, self.method = assembly.scene, assembly.method
        self._integrator = integrator
        self.duration = assembly.scene.duration
        self.dt = assembly.dt
        self.events = ()
        self.contacts = ()
        self.warnings = []
        self.cost = Cost()
        self._raw: list[tuple[float, int, int, float, float, float]] = []
        self._channels: dict[str, Channel] = {}
        self._joined = groups(assembly.scene)
        self._reach = reach_of(assembly.scene, assembly.method.models, self._joined)
        self._slopes: dict[str, Array] = {}  # of forces that were read

    def drain(self) -> None:
        """Take the events out of the loop's buffer."""
        assembly = self.assembly
        for event in assembly.events[: assembly.clock.n_events]:
            self._raw.append(
                (event.time, event.contact, event.kind, event.impulse, event.span_impulse, event.span_peak)
            )
        assembly.clock.n_events = 0

    def finish(self) -> None:
        """Build channels, events, contacts and energies from what was recorded."""
        self.drain()
        clock = self.assembly.clock
        if clock.step < self.assembly.steps:
            self.duration = min(self.duration, clock.time)
        self._read_channels()
        self._read_events()
        self._read_energy()

    def channels(self) -> tuple[str, ...]:
        return tuple(self._channels)

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        found = self._channels.get(channel)
        if found is None or found.middles is None:
            return read_channel(self._channels, self.duration, t, channel)
        if channel not in self._slopes:  # what stands at t = 0 belongs to no step
            self._slopes[channel] = np.append(0.0, slopes(found.middles[1:], found.values[1:]))
        t = within_run(t, self.duration)
        step = np.minimum(np.searchsorted(found.times, t, side="right"), found.values.size - 1)
        mean = found.values[step]
        values = mean + self._slopes[channel][step] * (t - found.middles[step])
        return np.asarray(np.maximum(values, np.minimum(mean, 0.0)))  # beyond the last step a force that falls is zero

    def field(self, body: str, t: float, quantity: str) -> Field:
        assembly, scene = self.assembly, self.assembly.scene
        if body not in scene.bodies:
            raise ImpactlabError(f"no body '{body}'; bodies: {', '.join(scene.bodies)}")
        within_run(t, self.duration)
        times = np.array([snapshot.time for snapshot in assembly.snapshots[: assembly.clock.n_snapshots]])
        near = np.flatnonzero(np.isclose(times, t, rtol=1e-12, atol=0.0))
        if near.size == 0:
            given = ", ".join(f"{time:.6g}" for time in times) or "none"
            raise ImpactlabError(
                f"no snapshot at t = {t:.6g} s; snapshots: {given}",
                remedy="Add the time to 'snapshots'.",
                path="snapshots",
            )
        number = int(near[0])
        read, factor = scene.bodies[body].reading(quantity)
        model, moves = assembly.built[body].model, read == "velocity"
        before, after = assembly.snapshots[number].before, assembly.snapshots[number].after
        # Leapfrog velocities belong to the middle of their step.
        late = (1.0 - self._integrator.velocity_point) * (after - before) if moves else 0.0
        share = (t - before + late) / (after - before) if after > before else 1.0
        states = assembly.memory.snapshot_state[number]
        state = (1.0 - share) * states[0] + share * states[1]
        x = model.grid()
        rows = np.array([factor * model.row(float(place), read) for place in x])
        return Field(x, np.asarray(rows @ assembly.state_of(body, state, velocities=moves)))

    def jumps(self, channel: str) -> Array:
        found = self._channels[channel]
        return found.times if found.stepped else np.zeros(0)

    def _read_channels(self) -> None:
        assembly = self.assembly
        record = assembly.memory.record[: assembly.clock.n_records]
        times = record[:, 0]
        steps = times.copy()
        steps[1:] -= times[:-1]
        of_velocity, of_force, middles = times, times, times - 0.5 * steps
        if self._integrator.velocity_point != 1.0:
            early = np.minimum(steps, assembly.dt)
            early[:1] = assembly.dt  # what stands at t = 0 belongs to the step before
            of_velocity = times - (1.0 - self._integrator.velocity_point) * early
        if self._integrator.load_point != 0.5:
            late = (self._integrator.load_point - 0.5) * np.minimum(steps, assembly.dt)
            of_force, middles = np.minimum(times + late, times[-1]), middles + late
        channels: dict[str, Channel] = {}
        for number, (contact, law) in enumerate(
            zip(assembly.scene.contacts, laws_of(assembly.scene, assembly.acting), strict=True)
        ):
            column = 1 + 6 * number
            force = record[:, column] if law.answers_force else np.full_like(times, np.nan)
            # The force of a hard contact starts and ends with jumps, often within a few steps: it stays as it acted.
            channels[f"force:{contact.name}"] = Channel(of_force, force, True, None if law.hard else middles)
            channels[f"gap:{contact.name}"] = Channel(times, record[:, column + 1], False)
            for side, point in enumerate((contact.left, contact.right)):
                if assembly.scene.bodies[point.body].elastic is not None:
                    at = column + 2 + 2 * side
                    place = f"{point.body}@{point.x:.6g}"
                    channels[f"displacement:{place}"] = Channel(times, record[:, at], False)
                    channels[f"velocity:{place}"] = Channel(of_velocity, record[:, at + 1], False)
        first = 1 + 6 * len(assembly.scene.contacts)
        for number, (name, quantity) in enumerate(assembly.probe_channels):
            on = of_velocity if quantity == "velocity" else times
            # A face that a contact presses in beyond its coordinates is known from the contact.
            channels.setdefault(name, Channel(on, record[:, first + number], False))
        sample = assembly.memory.sample[: assembly.clock.n_samples]
        for number, name in enumerate(assembly.built):
            channels[f"momentum:{name}"] = Channel(sample[:, 0], sample[:, SAMPLED + 2 + 3 * number], False)
            channels[f"energy:{name}"] = Channel(sample[:, 0], sample[:, SAMPLED + 3 * number], False)
        self._channels = channels

    def _read_energy(self) -> None:
        sample = self.assembly.memory.sample[: self.assembly.clock.n_samples]
        columns = {name: SAMPLED + 3 * number for number, name in enumerate(self.assembly.built)}
        ordered = {name: columns[name] for name in self.assembly.scene.in_order}
        touched = touched_in(self)
        joined = self._joined if len(touched) == len(self._reach.groups) else groups(self.assembly.scene, touched)
        work = sample[:, [column + 1 for column in ordered.values()]].sum(axis=1)
        self.energy = EnergyBook(
            time=sample[:, 0],
            bodies={name: sample[:, column] for name, column in ordered.items()},
            stored=sample[:, 1],
            booked={
                "contact": sample[:, 2],
                "ends": sample[:, 3],
                "damping": sample[:, 4],
                "unresolved": sample[:, 5],
            },
            work=work - work[:1].sum(),
            carried=carried_by(joined, sample[:, 0]),
        )

    def _read_events(self) -> None:
        assembly = self.assembly
        events: list[Event] = []
        spans: list[ContactSpan] = []
        started: dict[int, float] = {}
        kicks: dict[int, list[tuple[float, float]]] = {}
        for time, number, kind, impulse, span_impulse, peak in self._raw:
            contact = assembly.scene.contacts[number]
            if time > self.duration:
                continue
            if kind == dating.IMPULSE:
                events.append(Event(time, contact.name, "impulse", impulse))
                kicks.setdefault(number, []).append((time, impulse))
            elif kind == dating.CLOSE:
                events.append(Event(time, contact.name, "close"))
                started[number] = time
            else:
                events.append(Event(time, contact.name, "open"))
                spans.append(ContactSpan(contact.name, started.pop(number, 0.0), time, span_impulse, peak))
        for number, time in started.items():
            kept = assembly.contacts[number]
            # What was given so far belongs to the instant of the scheme's velocities: leapfrog's, half a step early.
            given_until = assembly.clock.time - (1.0 - self._integrator.velocity_point) * assembly.dt
            after = (given_until - self.duration) * kept.force
            name = assembly.scene.contacts[number].name
            spans.append(ContactSpan(name, time, None, kept.span_impulse - after, kept.span_peak))
        for number, given in kicks.items():
            if not assembly.acting.laws[assembly.scene.contacts[number].name].answers_force:
                total = sum(impulse for _, impulse in given)
                name = assembly.scene.contacts[number].name
                spans.append(ContactSpan(name, given[0][0], given[-1][0], total, None, given[0][1], len(given)))
        events.sort(key=lambda event: event.time)
        steps = self.duration / assembly.dt
        self.events, self.contacts = above_noise(
            assembly.scene, assembly.method.models, events, spans, steps, self._reach
        )
