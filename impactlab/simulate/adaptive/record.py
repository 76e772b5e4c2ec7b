"""What an adaptive run writes down: equal instants and events, so that memory does not follow the steps."""

from __future__ import annotations

from typing import Any

import numpy as np

from impactlab.simulate.adaptive.system import Energies, System
from impactlab.simulate.stepping.arrays import SAMPLES
from impactlab.types import Array, Quantity

MOTION: tuple[Quantity, ...] = ("displacement", "velocity")

CHUNK = 256  # instants read off an interpolant at once
APART = 1e-3  # of the spacing: an equal instant nearer to an event is left to it


class Record:
    """Instants with impulses, gaps, faces and probes; energies at some of them; states at the snapshots."""

    def __init__(self, system: System) -> None:
        self.system, scene = system, system.scene
        self.names, displacements, velocities = [], [], []
        watched = (*scene.probes, *scene.loaded_ends)
        asked = [
            (probe.channel, probe.body, probe.x, *scene.bodies[probe.body].reading(probe.quantity)) for probe in watched
        ]
        for contact in scene.contacts:
            for point in (contact.left, contact.right):
                if scene.bodies[point.body].elastic is not None:
                    place = f"{point.body}@{point.x:.6g}"
                    asked += [(f"{q}:{place}", point.body, point.x, q, 1.0) for q in MOTION]
        for name, body in scene.bodies.items():
            asked += [(f"{own}:{name}", name, 0.0, quantity, 1.0) for own, quantity in body.own_channels]
        for channel, name, x, quantity, factor in asked:
            row = np.zeros(system.n_dof)
            row[system.parts[name]] = factor * system.built[name].model.row(x, quantity)
            moves = quantity == "velocity"
            self.names.append(channel)
            displacements.append(np.zeros_like(row) if moves else row)
            velocities.append(row if moves else np.zeros_like(row))
        shape = (len(asked), system.n_dof)
        self._rows = np.hstack((np.array(displacements).reshape(shape), np.array(velocities).reshape(shape)))
        self._grid = np.linspace(0.0, scene.duration, scene.records + 1)
        self._every = max(1, scene.records // SAMPLES)
        self._next = 0
        self._pieces: list[Array] = []
        self._marks: list[float] = []
        self._energies: list[tuple[float, Energies, float, Array]] = []
        self._wanted = sorted(scene.snapshots)
        self.snapshots: list[tuple[float, Array]] = []

    def take(self, interpolant: Any, end: float) -> None:
        """Read the instants up to ``end`` [s] off an interpolant."""
        last = int(np.searchsorted(self._grid, end, side="right"))
        while self._next < last:
            upto = min(last, self._next + CHUNK)
            times = self._grid[self._next : upto]
            states = interpolant(times)
            self._write(times, states)
            for at in range(-self._next % self._every, len(times), self._every):
                self._sample(float(times[at]), states[:, at])
            self._next = upto
        while len(self.snapshots) < len(self._wanted) and self._wanted[len(self.snapshots)] <= end:
            time = self._wanted[len(self.snapshots)]
            self.snapshots.append((time, np.asarray(interpolant(time))))

    def mark(self, time: float, state: Array) -> None:
        """Write an instant that must be there: an event, the start, the end."""
        self._marks.append(time)
        self._write(np.array([time]), state[:, None])
        self._sample(time, state)

    def _write(self, times: Array, states: Array) -> None:
        system = self.system
        gaps, _ = system.gaps_of(states)
        probes = self._rows @ states[: 2 * system.n_dof]
        self._pieces.append(np.vstack((times, states[system.impulses], gaps, probes)).T)

    def _sample(self, time: float, state: Array) -> None:
        energies = self.system.energies(state)
        lost = float(state[self.system.losses].sum()) + energies.released
        self._energies.append((time, energies, lost, state[-2:].copy()))

    @property
    def begun(self) -> bool:
        """Whether anything was written."""
        return bool(self._pieces)

    @property
    def table(self) -> Array:
        """Time, impulses, gaps, then what ``names`` says, one row per instant; times rise."""
        table = np.concatenate(self._pieces)
        marks = np.unique(self._marks)
        nearest = np.abs(marks[np.clip(np.searchsorted(marks, table[:, 0]), 0, marks.size - 1)] - table[:, 0])
        before = np.abs(marks[np.clip(np.searchsorted(marks, table[:, 0]) - 1, 0, marks.size - 1)] - table[:, 0])
        nearest = np.minimum(nearest, before)
        table = table[(nearest == 0.0) | (nearest > APART * self._grid[1])]
        _, first = np.unique(table[:, 0], return_index=True)
        return np.asarray(table[first])

    @property
    def energies(self) -> tuple[Array, list[tuple[float, Energies, float, Array]]]:
        """Instants, and (time, energies, lost in contacts, lost at ends and inside bodies) at each; times rise."""
        times, first = np.unique([time for time, *_ in self._energies], return_index=True)
        return times, [self._energies[i] for i in first]
