"""Invariants of a run as numbers that are zero, except for rounding, if law and scheme are right."""

from __future__ import annotations

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.numerics.banded import solve
from impactlab.scene.problem import Scene
from impactlab.simulate.stepping.results.history import RecordedHistory
from impactlab.testing.trace import Trace, forces_after


def strongest_pull(history: AbstractHistory) -> float:
    """Return the most negative contact force [N] or impulse [N s].

    It is 0.0 without a pull. Links may pull.
    """
    lowest = 0.0
    names = [f"force:{name}" for name, law in history.method.laws.items() if not law.two_sided]
    for channel in history.channels():
        if channel in names:
            times = np.minimum(history.jumps(channel), history.duration)  # the last step may reach beyond the end
            values = history.evaluate(np.append(0.0, times), channel) if times.size else np.zeros(1)
            lowest = min(lowest, float(np.nanmin(values, initial=0.0)))
    lowest = min([lowest, *(event.impulse for event in history.events if event.impulse is not None)])
    return min([lowest, *(span.impulse for span in history.contacts)])


def given_impulses(traced: Trace) -> dict[str, float]:
    """Return the impulse [N s] of each contact over the run."""
    sums = (traced.forces * traced.dt + traced.impulses).sum(axis=0)
    return {contact.name: float(total) for contact, total in zip(traced.scene.contacts, sums, strict=True)}


def reported_impulse_error(traced: Trace) -> float:
    """Return the largest difference of reported impulses from those given, over the latter.

    Give a scene whose duration is a whole number of steps: contacts still closed are reported up to the end. Sums of
    forces reach the instant of the last momentum, in a leapfrog half a step before the end, in generalised-alpha half a
    step after it. The impulse between there and the end, of the next step or of the last one, is added or taken off, as
    momenta at the end lie on this line. The impulse of a force at t = 0 before it, or still to come, is not reported.
    """
    worst = 0.0
    late = traced.integrator.momentum_early * traced.dt
    after = forces_after(traced) if late > 0.0 else traced.forces[-1]
    for number, (name, given) in enumerate(given_impulses(traced).items()):
        spans = [span for span in traced.history.contacts if span.contact == name]
        joined = traced.history.method.laws[name].two_sided
        if joined or any(span.end is None for span in spans):
            given += late * float(after[number])
        given -= late * traced.plan.start_forces.get(number, 0.0)
        reported = traced.history.impulse_of(name) if joined else sum(span.impulse for span in spans)
        moved = float(np.abs(traced.forces[:, number]).sum()) * traced.dt if joined else given
        worst = max(worst, abs(reported - given) / moved if moved > 0.0 else abs(reported))
    return worst


def exchanged_momentum_error(traced: Trace) -> float:
    """Return the error of a mass's momentum against its contacts' impulse, over its momenta."""
    worst, given = 0.0, given_impulses(traced)
    for name, body in traced.scene.bodies.items():
        if body.elastic is not None or not body.moves:
            continue
        momentum = traced.momentum(name)
        taken = body.moving_mass * traced.scene.gravity * traced.dt * len(traced.forces)
        size = abs(taken) + np.max(np.abs(momentum))
        for contact in traced.scene.contacts:
            for point, sign in ((contact.left, -1.0), (contact.right, 1.0)):
                taken += sign * given[contact.name] if point.body == name else 0.0
        # A leapfrog starts half a step early; the impulse of gravity there is not of the contacts.
        worst = max(worst, abs(momentum[-1] - momentum[0] - taken) / size)
    return float(worst)


def is_free(scene: Scene) -> bool:
    """Return whether nothing outside holds the bodies: no wall, no clamp, no spring, no dashpot."""
    return not any(body.is_held for body in scene.bodies.values())


def free_momentum_error(traced: Trace) -> float:
    """Return the error of free bodies' momentum against gravity's impulse, over its size."""
    assert is_free(traced.scene)
    total, size = np.zeros(len(traced.states)), 0.0
    for name, built in traced.plan.built.items():
        row, velocities = built.model.momentum_row(), traced.velocities(name)
        total += traced.momentum(name)
        size += float(np.max(np.abs(velocities) @ np.abs(row)))
        total -= traced.times * float(row @ solve(built.system.mass, built.system.load))
    return float(np.max(np.abs(total - total[0])) / size)


def precursor(history: RecordedHistory, body: str, speed: float, margin: float = 0.0) -> float:
    """Return the largest velocity ahead of the wave, over ``speed`` [m/s].

    Ahead means further than c t + ``margin`` [m]. The rod must be at rest at first, uniform, and struck at t = 0.
    """
    rod = history.assembly.scene.elastic[body]
    assert len(rod.segments) == 1
    worst = 0.0
    for time in history.assembly.scene.snapshots:
        x, values = history.field(body, time, "velocity")
        ahead = x > rod.segments[0].wave_speed * time + margin
        worst = max(worst, float(np.max(np.abs(values[ahead]), initial=0.0)) / speed)
    return worst


def mirror_difference(history: RecordedHistory, image: RecordedHistory) -> float:
    """Return the largest relative difference of a run and its mirror image."""
    return records_difference(history, image, force=1.0, length=1.0, time=1.0)


def scaling_difference(
    history: RecordedHistory, scaled: RecordedHistory, mass: float, length: float, time: float
) -> float:
    """Return the largest relative difference of a run and itself in other units."""
    return records_difference(history, scaled, force=mass * length / time**2, length=length, time=time)


def records_difference(one: RecordedHistory, other: RecordedHistory, force: float, length: float, time: float) -> float:
    """Return the largest relative difference of the records of two runs."""
    first, second = (history.assembly.memory.record[: history.assembly.clock.n_records] for history in (one, other))
    if len(first) != len(second):
        return float("inf")
    worst = float(np.max(np.abs(first[:, 0] * time - second[:, 0])) / second[-1, 0])
    for number in range(len(one.assembly.scene.contacts)):
        for column, factor in ((1 + 6 * number, force), (2 + 6 * number, length)):
            size = float(np.max(np.abs(second[:, column])))
            difference = float(np.max(np.abs(first[:, column] * factor - second[:, column])))
            worst = max(worst, difference / size if size > 0.0 else difference)
    return worst


def same_bits(one: RecordedHistory, other: RecordedHistory) -> bool:
    """Return whether two runs recorded the very same numbers and events."""
    a, b = one.assembly, other.assembly
    return (
        one.events == other.events
        and one.contacts == other.contacts
        and np.array_equal(a.memory.state, b.memory.state)
        and np.array_equal(a.memory.record[: a.clock.n_records], b.memory.record[: b.clock.n_records])
        and np.array_equal(a.memory.sample[: a.clock.n_samples], b.memory.sample[: b.clock.n_samples])
    )
