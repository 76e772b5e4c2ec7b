"""The history of an adaptive run."""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import ImpactlabError
from impactlab.history.base import AbstractHistory, Array, ContactSpan, Cost, EnergyBook, Event, Field, within_run
from impactlab.history.noise_floor import above_noise
from impactlab.scene.frame import carried_energy, touched_in
from impactlab.simulate.adaptive.record import Record
from impactlab.simulate.channels import Channel, read_channel


@final
class AdaptiveHistory(AbstractHistory):
    """What an adaptive run recorded, at as many equal instants as the scene says, and at every event.

    Forces are means between instants, so that their sum over time is the impulse, which the solver integrates; the rest
    is linear between instants. Impulses, peaks and times of contacts do not depend on the instants.
    """

    def __init__(self, record: Record, duration: float) -> None:
        self.duration = duration
        self.scene, self.method = record.system.scene, record.system.method
        self.dt = None
        self.events = ()
        self.contacts = ()
        self.warnings = []
        self.cost = Cost()
        self._record = record
        self._channels: dict[str, Channel] = {}

    def finish(self, events: list[Event], spans: list[ContactSpan]) -> None:
        """Build channels and energies from what was recorded."""
        system, table = self._record.system, self._record.table
        times, contacts = table[:, 0], system.scene.contacts
        steps = np.diff(times)
        for number, contact in enumerate(contacts):
            force = np.diff(table[:, 1 + number]) / steps
            self._channels[f"force:{contact.name}"] = Channel(times, np.concatenate(([0.0], force)), True)
            self._channels[f"gap:{contact.name}"] = Channel(times, table[:, 1 + len(contacts) + number], False)
        for number, name in enumerate(self._record.names):
            self._channels[name] = Channel(times, table[:, 1 + 2 * len(contacts) + number], False)
        events.sort(key=lambda event: event.time)
        self.events, self.contacts = above_noise(system.scene, system.method.models, events, spans)
        sampled, samples = self._record.energies
        work = np.array([energies.work for _, energies, _, _ in samples])
        self.energy = EnergyBook(
            time=sampled,
            bodies={
                name: np.array([energies.bodies[number] for _, energies, _, _ in samples])
                for number, name in enumerate(system.built)
            },
            stored=np.array([energies.stored for _, energies, _, _ in samples]),
            booked={
                # Nothing is ever won back; an interpolant may dip by its tolerance.
                "contact": np.maximum.accumulate([lost for _, _, lost, _ in samples]),
                "ends": np.maximum.accumulate([lost[0] for _, _, _, lost in samples]),
                "damping": np.maximum.accumulate([lost[1] for _, _, _, lost in samples]),
                "unresolved": np.zeros(len(samples)),
            },
            work=work - work[0],
            carried=carried_energy(system.scene, sampled, touched_in(self)),
        )
        for number, name in enumerate(system.built):
            momentum = np.array([energies.momentum[number] for _, energies, _, _ in samples])
            self._channels[f"momentum:{name}"] = Channel(sampled, momentum, False)
            self._channels[f"energy:{name}"] = Channel(sampled, self.energy.bodies[name], False)

    def channels(self) -> tuple[str, ...]:
        return tuple(self._channels)

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        return read_channel(self._channels, self.duration, t, channel)

    def field(self, body: str, t: float, quantity: str) -> Field:
        system = self._record.system
        if body not in system.built:
            raise ImpactlabError(f"no body '{body}'; bodies: {', '.join(system.built)}")
        within_run(t, self.duration)
        kept = [state for time, state in self._record.snapshots if np.isclose(time, t, rtol=1e-12, atol=0.0)]
        if not kept:
            given = ", ".join(f"{time:.6g}" for time, _ in self._record.snapshots) or "none"
            raise ImpactlabError(
                f"no snapshot at t = {t:.6g} s; snapshots: {given}",
                remedy="Add the time to 'snapshots'.",
                path="snapshots",
            )
        n = system.n_dof
        read, factor = system.scene.bodies[body].reading(quantity)
        motion = (kept[0][n : 2 * n] if read == "velocity" else kept[0][:n])[system.parts[body]]
        model = system.built[body].model
        x = model.grid()
        return Field(x, np.array([factor * (model.row(float(place), read) @ motion) for place in x]))

    def jumps(self, channel: str) -> Array:
        found = self._channels[channel]
        return found.times if found.stepped else np.zeros(0)
