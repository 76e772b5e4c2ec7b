"""The record of an adaptive run at equal instants and events.

Its memory does not grow with the number of steps.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from impactlab.simulate.adaptive.system import Energies, System
from impactlab.simulate.channels import Probed, probed
from impactlab.simulate.stepping.arrays import SAMPLES
from impactlab.types import Array, Quantity

MOTION: tuple[Quantity, ...] = ("displacement", "velocity")

CHUNK = 256  # instants read off an interpolant at once
MIN_SPACING = 1e-3  # of the spacing: an equal instant nearer to an event is left out


class Record:
    """Instants with impulses, gaps, faces and probes; energies and states at some.

    Energies are kept at some instants, states at the snapshots.
    """

    def __init__(self, system: System) -> None:
        self.system, scene = system, system.scene
        self.probes = [
            Probed(f"{quantity}:{point.body}@{point.x:.6g}", point.body, point.x, quantity, 1.0)
            for point in scene.faces
            if scene.bodies[point.body].elastic is not None
            for quantity in MOTION
        ]
        self.probes += probed(scene)
        self._rows = np.zeros((len(self.probes), 2 * system.n_dof))  # over displacements and velocities
        self._drives: list[tuple[int, str, int]] = []  # number of the probe, body, number of its drive
        for number, (row, (_, body, x, quantity, factor)) in enumerate(zip(self._rows, self.probes, strict=True)):
            if quantity == "moment" and scene.bodies[body].changes:  # it follows from accelerations
                self._drives.append((number, body, int(x)))
                continue
            motion = row[system.n_dof :] if quantity == "velocity" else row[: system.n_dof]
            own = system.equations.parts[body]
            motion[own] = factor * system.built[body].model.row(x, quantity)
            elastic = scene.bodies[body].elastic
            if elastic is not None and (delay := elastic.retardation(x, quantity)) > 0.0:
                row[system.n_dof :][own] = delay * motion[own]
        self._grid = np.linspace(0.0, scene.duration, scene.records + 1)
        self._every = max(1, scene.records // SAMPLES)
        self._next = 0
        self._pieces: list[Array] = []
        self._marks: list[float] = []
        self._samples: dict[float, Energies] = {}  # by time, the first of each
        self._wanted = scene.field_times
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
        probes = self._rows @ np.concatenate(system.motion(states))
        moments = system.moments(times, states) if self._drives else {}
        for number, body, drive in self._drives:
            probes[number] = moments[body][drive]
        self._pieces.append(np.vstack((times, states[system.impulses], gaps, probes)).T)

    def _sample(self, time: float, state: Array) -> None:
        self._samples.setdefault(time, self.system.energies(state, time))

    @property
    def begun(self) -> bool:
        """Whether anything was written."""
        return bool(self._pieces)

    @property
    def table(self) -> Array:
        """Time, impulses, gaps and probes, one row per instant, times rising."""
        table = np.concatenate(self._pieces)
        marks = np.unique(self._marks)
        after = np.searchsorted(marks, table[:, 0])
        sides = [np.abs(marks[np.clip(number, 0, marks.size - 1)] - table[:, 0]) for number in (after - 1, after)]
        nearest = np.minimum(*sides)
        table = table[(nearest == 0.0) | (nearest > MIN_SPACING * self._grid[1])]
        _, first = np.unique(table[:, 0], return_index=True)
        return np.asarray(table[first])

    @property
    def samples(self) -> list[Energies]:
        """Energies, times rising."""
        return [self._samples[time] for time in sorted(self._samples)]
