"""The history of a stepped run: what the loop recorded, read at any time."""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from impactlab import loop
from impactlab.assembly import Assembly
from impactlab.errors import ImpactlabError
from impactlab.history import AbstractHistory, Array, ContactSpan, Cost, EnergyBook, Event, Field
from impactlab.integrators.base import AbstractIntegrator
from impactlab.scene import Rod
from impactlab.types import Quantity

KINDS = {loop.CLOSE: "close", loop.OPEN: "open", loop.IMPULSE: "impulse"}


class Channel(NamedTuple):
    """Where a channel lies: values at times, stepped (each value holds since the time before it) or linear."""

    times: Array
    values: Array
    stepped: bool


@final
class RecordedHistory(AbstractHistory):
    """What a stepped run recorded.

    Forces are constant over a step; displacements and gaps are linear between the ends of steps; velocities are linear
    between the instants to which the scheme's velocities belong. A run of more than 20000 steps is decimated, forces to their means.
    """

    def __init__(self, assembly: Assembly, integrator: AbstractIntegrator) -> None:
        self._assembly = assembly
        self._integrator = integrator
        self.duration = assembly.scene.duration
        self.dt = assembly.dt
        self.events = ()
        self.contacts = ()
        self.warnings = []
        self.cost = Cost()
        self._raw: list[tuple[float, ...]] = []
        self._channels: dict[str, Channel] = {}

    def drain(self) -> None:
        """Take the events out of the loop's buffer."""
        clock = self._assembly.clock
        self._raw += [tuple(row) for row in self._assembly.record.event[: int(clock[loop.N_EVENTS])].tolist()]
        clock[loop.N_EVENTS] = 0

    def finish(self) -> None:
        """Build channels, events, contacts and energies from what was recorded."""
        self.drain()
        clock = self._assembly.clock
        reached = float(clock[loop.TIME])
        if int(clock[loop.STEP]) < self._assembly.steps:
            self.duration = min(self.duration, reached)
        self._read_energy()
        self._read_channels(int(clock[loop.N_RECORDS]))
        self._read_events(reached)

    def channels(self) -> tuple[str, ...]:
        return tuple(self._channels)

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        if channel not in self._channels:
            raise ImpactlabError(
                f"channel '{channel}' was not recorded; recorded: {', '.join(sorted(self._channels))}",
                remedy="Add a probe for it.",
                path="probes",
            )
        times, values, stepped = self._channels[channel]
        t = np.asarray(t, float)
        if not stepped:
            return np.asarray(np.interp(t, times, values))
        # A value holds on [time before, its own time): at a jump the value after it is given.
        return values[np.minimum(np.searchsorted(times, t, side="right"), values.size - 1)]

    def field(self, body: str, t: float, quantity: str) -> Field:
        record, scene = self._assembly.record, self._assembly.scene
        if body not in scene.bodies:
            raise ImpactlabError(f"no body '{body}'; bodies: {', '.join(scene.bodies)}")
        taken = int(self._assembly.clock[loop.N_SNAPSHOTS])
        times = record.snapshot_time[:taken]
        near = np.flatnonzero(np.isclose(times, t, rtol=1e-12, atol=0.0))
        if near.size == 0:
            given = ", ".join(f"{time:.6g}" for time in times) or "none"
            raise ImpactlabError(
                f"no snapshot at t = {t:.6g} s; snapshots: {given}", remedy="Add the time to 'snapshots'.", path="snapshots"
            )
        snapshot = int(near[0])
        model = self._assembly.built[body].model
        n_dof = self._assembly.built[body].system.load.size
        before, after = record.snapshot_at[snapshot]
        moves = quantity == "velocity"
        # Leapfrog velocities belong to the middle of their step.
        late = (1.0 - self._integrator.velocity_point) * (after - before) if moves else 0.0
        share = (t - before + late) / (after - before) if after > before else 1.0
        state = (1.0 - share) * record.snapshot_state[snapshot, 0] + share * record.snapshot_state[snapshot, 1]
        start = self._assembly.shift[body] + (n_dof if moves else 0)
        x = model.grid()
        known: dict[str, Quantity] = {q: q for q in ("displacement", "velocity", "strain", "stress", "force")}
        rows = np.array([model.row(float(place), known[quantity]) for place in x])
        return Field(x, np.asarray(rows @ state[start : start + n_dof]))

    def jumps(self, channel: str) -> Array:
        times, _, stepped = self._channels[channel]
        return times if stepped else np.zeros(0)

    def _read_channels(self, n_records: int) -> None:
        assembly, record = self._assembly, self._assembly.record
        times = record.time[:n_records]
        steps = np.diff(times, prepend=0.0)
        of_velocity = times - (1.0 - self._integrator.velocity_point) * np.minimum(steps, assembly.dt)
        of_force = times + (self._integrator.load_point - 0.5) * np.minimum(steps, assembly.dt)
        # At t = 0 stands the state as given, whatever half step the scheme keeps its velocities at.
        channels: dict[str, Channel] = {}
        for number, contact in enumerate(assembly.scene.contacts):
            force = record.contact[:n_records, number, 0]
            force = force if contact.law.answers_force else np.full_like(force, np.nan)
            channels[f"force:{contact.name}"] = Channel(of_force, force, True)
            channels[f"gap:{contact.name}"] = Channel(times, record.contact[:n_records, number, 1], False)
            for side, point in enumerate((contact.left, contact.right)):
                if isinstance(assembly.scene.bodies[point.body], Rod):
                    values = record.port[:n_records, 2 * number + side]
                    place = f"{point.body}@{point.x:.6g}"
                    channels[f"displacement:{place}"] = Channel(times, values[:, 0], False)
                    channels[f"velocity:{place}"] = Channel(of_velocity, values[:, 1], False)
        for column, (name, quantity) in enumerate(assembly.probe_channels):
            on = of_velocity if quantity == "velocity" else times
            channels[name] = Channel(on, record.probe[:n_records, column], False)
        for number, name in enumerate(assembly.built):
            momentum = record.sample_body[: self.energy.time.size, number, 2]
            channels[f"momentum:{name}"] = Channel(self.energy.time, momentum, False)
            channels[f"energy:{name}"] = Channel(self.energy.time, self.energy.bodies[name], False)
        self._channels = channels

    def _read_energy(self) -> None:
        record = self._assembly.record
        n = int(self._assembly.clock[loop.N_SAMPLES])
        work = record.sample_body[:n, :, 1].sum(axis=1)
        self.energy = EnergyBook(
            time=record.sample_time[:n],
            bodies={name: record.sample_body[:n, number, 0] for number, name in enumerate(self._assembly.built)},
            stored=record.sample_book[:n, 0],
            booked={"contact": record.sample_book[:n, 1], "ends": record.sample_book[:n, 2], "unresolved": np.zeros(n)},
            work=work - work[:1].sum(),
        )

    def _read_events(self, reached: float) -> None:
        scene = self._assembly.scene
        events: list[Event] = []
        spans: list[ContactSpan] = []
        started: dict[int, float] = {}
        kicks: dict[int, list[tuple[float, float]]] = {}
        for time, number, kind, impulse, span_impulse, peak in self._raw:
            contact = scene.contacts[int(number)]
            if time > self.duration:
                continue
            if kind == loop.IMPULSE:
                events.append(Event(time, contact.name, "impulse", impulse))
                kicks.setdefault(int(number), []).append((time, impulse))
            elif kind == loop.CLOSE:
                events.append(Event(time, contact.name, "close"))
                started[int(number)] = time
            else:
                events.append(Event(time, contact.name, "open"))
                spans.append(ContactSpan(contact.name, started.pop(int(number), 0.0), time, span_impulse, peak))
        for number, time in started.items():
            impulse, peak = self._assembly.contacts.span[number]
            after = max(0.0, reached - self.duration) * self._assembly.contacts.force[number]
            spans.append(ContactSpan(scene.contacts[number].name, time, None, float(impulse - after), float(peak)))
        for number, given in kicks.items():
            if not scene.contacts[number].law.answers_force:
                total = float(sum(impulse for _, impulse in given))
                name = scene.contacts[number].name
                spans.append(ContactSpan(name, given[0][0], given[-1][0], total, None, given[0][1], len(given)))
        self.events = tuple(sorted(events, key=lambda event: event.time))
        self.contacts = tuple(sorted(spans, key=lambda span: span.start))


