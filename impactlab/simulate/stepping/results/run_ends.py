"""Velocities, momenta and energies at both ends of a run.

They are needed where the records lie beside these instants. Leapfrog keeps the velocities of the middle of each step,
and free ends of delay lines their means over it: the last ones lie half a step before the end. Where a step with a kick
reaches beyond the end of the run, a line from its start to its end passes through a mixture of both sides. In these
runs values at the end lie on a line without the kick, which is added as a whole (`beyond_end`). Where events are
located, the last step ends with the run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.base import Operators
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.numerics.banded import multiply
from impactlab.simulate.channels import Channel
from impactlab.simulate.stepping.arrays import SAMPLED
from impactlab.simulate.stepping.results.beyond_end import ON_STEP, LastSteps, RecordsAround, row_of
from impactlab.simulate.stepping.results.recorded_channels import lag_of
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.simulate.stepping.setup.layout import PER_CONTACT
from impactlab.types import Array

MIDDLE = 0.5  # of a step


class Rate(NamedTuple):
    """A channel whose values follow from velocities."""

    channel: str
    lag: float  # s, by which its values belong to an instant before the end of their step
    column: int  # of the record, or of the sample
    sampled: bool
    at_start: float | None = None  # at t = 0; None where the first record has it


class Early(NamedTuple):
    """Energy at t = 0, and leapfrog's shares of half a step before [J]."""

    initial: float  # energy of bodies and contacts at t = 0
    work: float  # of loads before t = 0
    ends: float  # losses before t = 0
    damping: float


@dataclass
class EndChannels:
    """Channels, samples and load impulses with their values at both run ends.

    A chain of beads has tens of thousands of channels: each is made when it is first read, and those at the same
    instants share the array of these.
    """

    rates: dict[str, Rate]  # of the channels that differ from the records
    duration: float  # s
    slack: float  # s
    missing: frozenset[str]  # channels without a record at the end of the run
    around: RecordsAround | None  # the end of the run; None where no channel needs them
    early: Early | None  # None where the first sample is that of t = 0
    end: Array | None  # sample at the end of the run; None where it lies between two samples of the run
    start: Array  # first sample
    load_impulses: dict[str, float]  # N s, of loads over time in the run, by body
    _made: dict[str, Channel] = field(default_factory=dict)
    _instants: dict[tuple[int, float, bool, bool], tuple[Array, Array, NDArray[np.bool_]]] = field(default_factory=dict)

    def settled(self, name: str, recorded: Channel) -> Channel:
        """Return a channel with its values at both ends, from the recorded one."""
        rate = self.rates.get(name)
        if rate is None:
            return recorded
        if name not in self._made:
            self._made[name] = self._settled(rate, recorded)
        return self._made[name]

    def _settled(self, rate: Rate, channel: Channel) -> Channel:
        values, ends = channel.values, self.around if rate.channel in self.missing else None
        times, kept = self._instants_of(rate, channel.times, ends is not None)
        if rate.at_start is not None:
            values = np.concatenate(([rate.at_start], values[1:]))
        if ends is not None:
            rows, changes = (ends.sample, ends.sample_changes) if rate.sampled else (ends.record, ends.record_changes)
            column = rows[:, rate.column], rate.lag, changes[:, rate.column], rate.at_start
            values = np.append(values[kept], ends.at(self.duration, *column))
        return channel._replace(times=times, values=values)

    def _instants_of(self, rate: Rate, recorded: Array, ends: bool) -> tuple[Array, NDArray[np.bool_]]:
        """Return the instants of a channel, and which of the recorded ones they keep."""
        lag, starts = rate.lag if rate.sampled else 0.0, rate.at_start is not None
        key = id(recorded), lag, starts, ends
        known = self._instants.get(key)
        if known is not None and known[0] is recorded:  # of a copy, another array may have this id
            return known[1:]
        times = np.maximum(recorded - lag, 0.0) if lag != 0.0 else recorded
        if starts:
            times = np.concatenate(([0.0], times[1:]))
        kept = times < self.duration - self.slack
        if ends:
            times = np.append(times[kept], self.duration)
        self._instants[key] = recorded, times, kept
        return times, kept


def settled(
    assembly: Assembly,
    integrator: AbstractIntegrator,
    duration: float,
    touches: LastSteps,
    beyond: Callable[[], RecordsAround | None],
) -> EndChannels:
    """Return the ends of a run whose records lie beside its start or its end.

    Parameters
    ----------
    assembly : Assembly
        Of the run, which has ended.
    integrator : AbstractIntegrator
    duration : float
        Where the run ends [s], in its last step.
    touches : LastSteps
        Those in its last steps.
    beyond : function
        Gives the records around the end, and is called where they are needed.
    """
    rates, slack = list(_rates(assembly, integrator)), ON_STEP * assembly.dt
    last = assembly.clock.time + slack  # of values at the ends of steps
    missing = frozenset(rate.channel for rate in rates if touches.crossed or rate.lag != 0.0 or duration > last)
    around = beyond() if missing else None
    early = integrator.velocity_point < 1.0
    lag = 0.5 * assembly.dt if early else 0.0
    differing: dict[str, Rate] = {}
    for rate in rates:
        moved = (rate.sampled and rate.lag != 0.0) or rate.at_start is not None
        if moved or (around is not None and rate.channel in missing):
            differing.setdefault(rate.channel, rate)
    return EndChannels(
        rates=differing,
        duration=duration,
        slack=slack,
        missing=missing,
        around=around,
        early=_before_start(assembly) if early else None,
        end=None if around is None else _sample_at_end(assembly, around, duration, lag),
        start=assembly.memory.sample[0].copy(),
        load_impulses=_load_impulses(assembly, integrator, duration, around),
    )


def _sample_at_end(assembly: Assembly, around: RecordsAround, duration: float, lag: float) -> Array:
    """Return the sample at the end of a run.

    Booked losses are at least those of the step before the last one: they never fall, but a step beyond the end may
    lose far more than those with kicks, and the line from there passes below.
    """
    end = np.asarray(around.at(duration, around.sample, lag, around.sample_changes))
    before = assembly.memory.sample[max(assembly.clock.n_samples - 2, 0)]
    end[2:SAMPLED] = np.maximum(end[2:SAMPLED], before[2:SAMPLED])
    return end


def _load_impulses(
    assembly: Assembly, integrator: AbstractIntegrator, duration: float, around: RecordsAround | None
) -> dict[str, float]:
    """Return the impulses of loads between both ends of a run [N s].

    They are by body. As the momentum that they give, those that do not act in the middle of a step are summed from
    instants beside the start to instants beside the ends of steps.
    """
    found: dict[str, float] = {}
    names, clock, whole = [*assembly.layout.built], assembly.clock, integrator.momentum_early * assembly.dt
    for number, load in enumerate(assembly.loads):
        name, early = names[load.body], whole if load.point != MIDDLE else 0.0
        at_start = float(assembly.memory.load_forces[load.table_start]) if early != 0.0 else 0.0
        if around is not None and early != 0.0:
            given = float(around.at(duration, around.impulses[:, number], early, None, early * at_start))
        else:
            given = load.impulse + (duration - clock.time + early) * load.force
        found[name] = found.get(name, 0.0) + given - early * at_start
    return found


def _before_start(assembly: Assembly) -> Early:
    """Return the energy at t = 0 and shares before it in samples [J].

    The shares are those of half a step.
    """
    first, half = assembly.memory.sample[0], 0.5 * assembly.dt
    initial, work, ends, damping = float(first[1]), 0.0, 0.0, 0.0
    for number, built in enumerate(assembly.layout.built.values()):
        system, at = built.system, SAMPLED + 3 * number
        if isinstance(built.model, AbstractSelfStepping):
            initial += float(first[at])
            continue
        u, v = system.displacement, system.velocity
        initial += _energy(system)
        work += float(system.load @ u) - float(first[at + 1])
        lost = half * system.dashpots_at_ends() @ v**2
        ends, damping = ends + float(lost), damping + float(half * v @ multiply(system.damping, v) - lost)
        for x, load in built.body.loads:
            work += half * float(load.at(np.zeros(1))[0]) * float(built.model.row(x, "velocity") @ v)
    return Early(initial, work, ends, damping)


def _rates(assembly: Assembly, integrator: AbstractIntegrator) -> Iterator[Rate]:
    """Yield the channels of velocities, energies and momenta."""
    m, layout, scene = assembly.memory, assembly.layout, assembly.scene
    n_faces, early = len(assembly.faces), integrator.velocity_point < 1.0
    begin = _state_at_start(assembly) if early else m.state

    def known(name: str) -> bool:
        """Return whether a body's first record lies beside t = 0.

        Its rows must be those of t = 0, too.
        """
        built = layout.built[name]
        return early and not isinstance(built.model, AbstractSelfStepping) and built.system.phases is None

    for number, point in enumerate(layout.points):
        if scene.bodies[point.body].elastic is not None:
            column = 1 + PER_CONTACT * (number // 2) + 3 + 2 * (number % 2)
            start = row_of(m, n_faces + number, begin) if known(point.body) else None
            lag = lag_of(assembly, integrator, point.body, point.x)
            yield Rate(f"velocity:{point.body}@{point.x:.6g}", lag, column, False, start)
    rows = {probe: 2 * n_faces + len(m.readings) + place for place, probe in enumerate(layout.probes)}
    for probe in layout.recorded:
        if probe.quantity == "velocity":
            start = None
            if known(probe.body):
                start = row_of(m, rows[probe], begin) if probe in rows else scene.bodies[probe.body].velocity
            lag = lag_of(assembly, integrator, probe.body, probe.x)
            yield Rate(probe.channel, lag, layout.probe_column(probe), False, start)
    for number, (name, built) in enumerate(layout.built.items()):
        own = isinstance(built.model, AbstractSelfStepping)
        first, lags = SAMPLED + 3 * number, (0.0, 0.0)
        if not own:
            lags = (1.0 - integrator.velocity_point) * assembly.dt, integrator.momentum_early * assembly.dt
        beside = lags[1] != 0.0 and built.system.phases is None
        energy = _energy(built.system) if known(name) else None
        momentum = float(built.model.momentum_row() @ built.system.velocity) if beside else None
        yield Rate(f"energy:{name}", lags[0], first, True, energy)
        if not built.body.changes:
            yield Rate(f"momentum:{name}", lags[1], first + 2, True, momentum)


def _energy(system: Operators) -> float:
    """Return the energy of a body at t = 0 [J]."""
    moving = system.velocity @ multiply(system.mass, system.velocity)
    return 0.5 * float(moving + system.displacement @ multiply(system.stiffness, system.displacement))


def _state_at_start(assembly: Assembly) -> Array:
    """Return the state at t = 0 with the velocities of that instant.

    The shape is (n_state,).
    """
    layout, state = assembly.layout, assembly.layout.state()
    for name, built in layout.built.items():
        start, n_dof = layout.shift[name], built.system.load.size
        if not isinstance(built.model, AbstractSelfStepping):
            state[start + n_dof : start + 2 * n_dof] = built.system.velocity
    return state
