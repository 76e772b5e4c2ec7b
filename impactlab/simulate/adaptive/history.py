"""The history of an adaptive run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np

from impactlab.history.base import ContactSpan, Event
from impactlab.history.energy import EnergyBook
from impactlab.history.frame import carried_energy, touched_in
from impactlab.history.noise_floor import above_noise
from impactlab.simulate.adaptive.record import Record
from impactlab.simulate.channels import AbstractRecordedHistory, Channel
from impactlab.types import Array, Ints


@final
class AdaptiveHistory(AbstractRecordedHistory):
    """An adaptive run, recorded at equal instants and at every event.

    Forces are means between instants, so that their sum over time is the impulse, which the solver integrates; the rest
    is linear between instants. Impulses, peaks and times of contacts do not depend on the instants.
    """

    def __init__(self, record: Record) -> None:
        system = record.system
        super().__init__(system.scene, system.method, system.built)
        self._record = record
        self.events, self.contacts = (), ()
        self.recorded: dict[str, Channel] = {}

    def memories(self) -> list[Sequence[float]]:
        return [contact.port.memory[:] for contact in self._record.system.contacts]

    def finish(self, events: list[Event], spans: list[ContactSpan]) -> None:
        """Build channels and energies from the record."""
        system, table = self._record.system, self._record.table
        times, contacts = table[:, 0], system.scene.contacts
        lengths = np.diff(times)
        sums: dict[str, Array] = {}
        for number, contact in enumerate(contacts):
            force = np.diff(table[:, 1 + number]) / lengths
            if not system.method.laws[contact.name].pulls:
                force = np.maximum(force, 0.0)  # the interpolant of its impulse may fall by its tolerance
            self.recorded[f"force:{contact.name}"] = Channel(times, np.concatenate(([0.0], force)), True)
            self.recorded[f"gap:{contact.name}"] = Channel(times, table[:, 1 + len(contacts) + number], False)
            if contact.group:
                sums[contact.group] = np.asarray(sums.get(contact.group, 0.0) + force)
        for group, force in sums.items():
            self.recorded.setdefault(f"force:{group}", Channel(times, np.concatenate(([0.0], force)), True))
        for number, probe in enumerate(self._record.probes):
            self.recorded[probe.channel] = Channel(times, table[:, 1 + 2 * len(contacts) + number], False)
        events.sort(key=lambda event: event.time)
        reached = self.duration
        self.events, self.contacts = above_noise(system.scene, system.method, events, spans, reached=reached)
        samples = self._record.samples
        sampled, work = np.array([each.time for each in samples]), np.array([each.work for each in samples])
        losses = np.maximum.accumulate([each.lost for each in samples])  # an interpolant may dip by its tolerance
        own = np.maximum.accumulate([each.by_contact for each in samples]).T
        bodies = dict(zip(system.built, np.array([each.bodies for each in samples]).T, strict=True))
        self.energy = EnergyBook(
            time=sampled,
            bodies=bodies,
            stored=np.array([each.stored for each in samples]),
            booked=dict(zip(("contact", "ends", "damping"), losses.T, strict=True)) | {"unresolved": 0.0 * sampled},
            work=work - work[0],
            carried=carried_energy(system.scene, sampled, touched_in(self)),
            by_contact=dict(zip((contact.name for contact in contacts), own, strict=True)),
        )
        for number, name in enumerate(system.built):
            if not system.scene.bodies[name].changes:  # that of a mechanism is a vector, which nothing sums up
                momentum = np.array([each.momentum[number] for each in samples])
                self.recorded[f"momentum:{name}"] = Channel(sampled, momentum, False)
            self.recorded[f"energy:{name}"] = Channel(sampled, bodies[name], False)

    def snapshots(self) -> Array:
        return np.array([time for time, _ in self._record.snapshots])

    def motions(self, numbers: Ints, body: str, velocities: bool) -> Array:
        system, kept = self._record.system, self._record.snapshots
        states = np.array([kept[number][1] for number in numbers.tolist()]).T
        return np.asarray(system.motion(states)[int(velocities)][system.equations.parts[body]].T)
