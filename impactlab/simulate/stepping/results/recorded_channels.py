"""The channels of a stepped run, read from its records on first use."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import final

import numpy as np

from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.models.continuous.delay_line import DelayLine
from impactlab.scene.problem import Contact
from impactlab.simulate.channels import Channel, Smooth
from impactlab.simulate.stepping.results import readout
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.simulate.stepping.setup.layout import Source
from impactlab.startup.cached import cached_property
from impactlab.types import Array

MAX_COPIED = 100_000_000  # bytes of a record, up to which columns that are read are copied: reads of them are quick
Ends = dict[str, tuple[Array, Array]]  # of delay lines: times; displacements of both ends, or waves


@final
class Instants:
    """The instants to which the records of a run belong [s], (n,) each.

    Records have the shape (n, n_columns); the instants follow from the scheme.
    """

    def __init__(self, record: Array, dt: float, integrator: AbstractIntegrator) -> None:
        self.times = record[:, 0].copy()  # side by side: every read of a column takes a line of memory per record
        self._dt, self._integrator = dt, integrator

    @cached_property
    def _lengths(self) -> Array:
        """Times between records; 0 of the first."""
        lengths = self.times.copy()
        lengths[1:] -= self.times[:-1]
        return lengths

    @cached_property
    def _last_steps(self) -> Array:
        return np.minimum(self._lengths, self._dt)  # a record of several steps ends with the last of them

    @cached_property
    def velocities(self) -> Array:
        """Those of velocities in the scheme."""
        before = 1.0 - self._integrator.velocity_point
        if before == 0.0:
            return self.times
        early = before * self._last_steps
        early[:1] = before * self._dt  # the velocity at t = 0 belongs to the step before
        return self.times - early

    @cached_property
    def step_means(self) -> Array:
        """The middles of the last steps, to which mean velocities belong."""
        return self.times - 0.5 * self._last_steps

    @property
    def _late(self) -> Array | float:
        """Times by which forces act later than in the middle of their step."""
        return (self._integrator.load_point - 0.5) * self._last_steps if self._integrator.load_point != 0.5 else 0.0

    @cached_property
    def forces(self) -> Array:
        """The ends of the intervals over which forces acted."""
        return np.minimum(self.times + self._late, self.times[-1:])

    @cached_property
    def middles(self) -> Array:
        """The middles of these intervals."""
        return self.times - 0.5 * self._lengths + self._late

    @cached_property
    def forces_from_start(self) -> tuple[Array, Array]:
        """The ends and middles of these intervals, with one more before them.

        In it the force at t = 0 acts, up to the middle of the first step.
        """
        first = float(self._late[1]) if isinstance(self._late, np.ndarray) else 0.0
        return np.insert(self.forces, 1, first), np.insert(self.middles, 1, 0.0)


@final
class RecordedChannels(Mapping[str, Channel]):
    """The channels of a run by name, without those inside delay lines."""

    def __init__(self, assembly: Assembly, integrator: AbstractIntegrator) -> None:
        self._assembly, self._sources = assembly, assembly.layout.sources
        self._integrator = integrator
        self.record = assembly.memory.record[: assembly.clock.n_records]  # (n_records, n_columns), of the loop
        self._sample = assembly.memory.sample[: assembly.clock.n_samples]
        self._sample_times = self._sample[:, 0]
        self._read: dict[str, Channel] = {}

    def __getitem__(self, name: str) -> Channel:
        if name not in self._read:
            self._read[name] = self._channel(self._sources[name])
        return self._read[name]

    def smallest_gap(self, contact: Contact) -> float:
        """Return the smallest gap of a contact [m]; those of beads are found together."""
        name = f"gap:{contact.name}"
        source = self._sources[name]
        of_bead = source.kept == "bead_gaps"
        return float(self._smallest_bead_gaps[source.columns[0]] if of_bead else self[name].values.min())

    def __contains__(self, name: object) -> bool:
        return name in self._sources

    def __iter__(self) -> Iterator[str]:
        return iter(self._sources)

    def __len__(self) -> int:
        return len(self._sources)

    @cached_property
    def instants(self) -> Instants:
        """The instants to which the values of the record belong."""
        return Instants(self.record, self._assembly.dt, self._integrator)

    @cached_property
    def _start_forces(self) -> dict[int, float]:
        """Forces at t = 0 that no step has, of a scheme whose forces act at the ends of steps [N], by column."""
        if self._integrator.load_point <= 0.5:
            return {}
        layout = self._assembly.layout
        return {layout.column_of(number): force for number, force in layout.plan.start_forces.items()}

    @cached_property
    def _bead_rates(self) -> Array:
        return readout.bead_rates(self._assembly, self.record, self.instants.velocities)

    @cached_property
    def _bead_gap_rates(self) -> Array:
        return readout.across_beads(self._assembly, self._bead_rates)

    @cached_property
    def _bead_gaps(self) -> Array:
        return readout.bead_gaps(self._assembly, self.record)

    @cached_property
    def _smallest_bead_gaps(self) -> Array:
        return np.asarray(self._bead_gaps.min(axis=1))

    def _channel(self, source: Source) -> Channel:
        if source.kept == "sample":
            return Channel(self._sample_times, self._sample[:, source.columns[0]], False, None, source.rate)
        times: Array = getattr(self.instants, source.instants)
        if source.kept == "bead_gaps":
            gaps = self._bead_gaps[source.columns[0]]
            return Channel(times, gaps, False, smooth=self._smooth(source, gaps))
        values = self.record[:, source.columns[0]]
        for column in source.columns[1:]:
            values = values + self.record[:, column]
        if self.record.nbytes <= MAX_COPIED:  # side by side, as the instants
            values = np.ascontiguousarray(values)
        if source.kept == "none":
            values = np.full_like(times, np.nan)
        middles = self.instants.middles if source.sloped else None
        at_start = sum(self._start_forces.get(column, 0.0) for column in source.columns) if source.stepped else 0.0
        if at_start != 0.0 and times.size > 1 and not source.cubic:
            values = np.insert(values, 1, at_start)
            times, starts_at = self.instants.forces_from_start
            middles = starts_at if source.sloped else None
        return Channel(times, values, source.stepped, middles, source.rate, source.pulls, self._smooth(source, values))

    def _smooth(self, source: Source, values: Array) -> Smooth | None:
        """Return the smooth motion or force of beads, where records are several steps apart."""
        times, layout, column = self.instants.times, self._assembly.layout, source.columns[0]
        if not source.cubic or times.size == 1:
            return None
        if source.stepped:  # a force
            column -= layout.first_bead_force
            power = layout.rows.forces[layout.rows.contacts[column]]
            return Smooth(times, self._bead_gaps[column], self._bead_gap_rates[column], power)
        rates = (
            self._bead_gap_rates[column] if source.kept == "bead_gaps" else self._bead_rates[column - layout.first_bead]
        )
        return Smooth(times, values, rates)


def lag_of(assembly: Assembly, integrator: AbstractIntegrator, body: str, x: float) -> float:
    """Return how long before its step's end a recorded velocity belongs [s]."""
    of_scheme = 1.0 - integrator.velocity_point
    lags = {"velocities": of_scheme, "step_means": 0.5, "times": 0.0}
    return lags[assembly.layout.instants_of_velocity(body, x)] * assembly.dt


def ends_of(assembly: Assembly, channels: RecordedChannels) -> Ends:
    """Return the records of delay lines, by body."""
    layout, record, found = assembly.layout, channels.record, Ends()
    first = layout.first_probe + len(layout.probes)
    far = {(each.body, each.x): record[:, first + number] for number, each in enumerate(layout.far_ends)}
    for name, body in layout.built.items():
        if isinstance(body.model, DelayLine):
            ends = [
                far[name, x] if (name, x) in far else channels[f"displacement:{name}@{x:.6g}"].values
                for x in (0.0, body.body.length)
            ]
            found[name] = channels.instants.times, np.array(ends)
        elif isinstance(body.model, DelayChain):
            own = [number for number, (owner, _) in enumerate(layout.sent) if owner == name]
            found[name] = channels.instants.times, record[:, first + len(layout.far_ends) :][:, own].T
    return found
