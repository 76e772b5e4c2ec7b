"""Metrics of an impact: exit velocities, lasting opening, force oscillation, momentum balance."""

from __future__ import annotations

import itertools
import math

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.history.frame import frames as frames_of
from impactlab.history.frame import touched_in
from impactlab.metrics.norms import ZERO, force_channels, largest, midpoints
from impactlab.scene.momentum import BodyMomentum, balance
from impactlab.scene.problem import Scene
from impactlab.types import Array

MIN_OPEN = 0.1  # T: an opening counts if the contact then stays open so long


def free_bodies(scene: Scene, *histories: AbstractHistory) -> dict[str, float]:
    """Return the masses [kg] of free bodies whose momentum all histories have."""
    channels = [frozenset(history.channels()) for history in histories]
    return {
        name: body.moving_mass
        for name, body in scene.bodies.items()
        if not body.is_held and all(f"momentum:{name}" in recorded for recorded in channels)
    }


def exit_velocity(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> float | None:
    """Return the largest error of an exit velocity, over the largest speed.

    A body's velocity is its momentum at the end of the run over its mass; bodies that something holds are left out.
    The largest speed is that of the reference, over those bodies and the run, in the frame of the bodies that interact
    (`impactlab.history.frame`; the frame at rest where no contact was closed). None where there is no such body.
    """
    bodies = free_bodies(scene, history, reference)
    t, end = midpoints(scene.duration), np.array([scene.duration])
    frames = frames_of(scene, touched_in(reference))
    speeds = {name: _velocity(reference, name, mass, t) for name, mass in bodies.items()}
    scale, fastest = (
        max((float(np.max(np.abs(each))) for each in found), default=0.0)
        for found in ([v - frames[name].velocity_at(t) for name, v in speeds.items()], speeds.values())
    )
    scale = scale if scale > ZERO * fastest else fastest
    if scale == 0.0:
        return None
    return largest(
        abs(float((_velocity(history, name, mass, end) - _velocity(reference, name, mass, end))[0])) / scale
        for name, mass in bodies.items()
    )


def _velocity(history: AbstractHistory, body: str, mass: float, t: Array) -> Array:
    return np.asarray(history.evaluate(t, f"momentum:{body}") / mass)


def opening_time(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> float | None:
    """Return the largest error of a contact's first lasting opening, in T.

    An opening lasts if the contact then stays open for 0.1 T, or to the end of the run: a force that chatters has not
    parted yet. None where no contact parts in both, or where there is no T. A law of impulses does not open.
    """
    if not np.isfinite(scene.round_trip):
        return None
    errors = []
    for contact in scene.contacts:
        one, other = (_parted(h, contact.name, MIN_OPEN * scene.round_trip) for h in (history, reference))
        if one is not None and other is not None:
            errors.append(abs(one - other) / scene.round_trip)
    return max(errors, default=None)


def _parted(history: AbstractHistory, contact: str, lasting: float) -> float | None:
    """Return the first time [s] at which a contact opens for ``lasting`` [s]."""
    events = [event for event in history.events if event.contact == contact and event.kind in ("close", "open")]
    for event, following in itertools.zip_longest(events, events[1:]):
        if event.kind == "open" and (following is None or following.time - event.time >= lasting):
            return event.time
    return None


def force_oscillation(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> float | None:
    """Return the excess variation of a force over the reference, in peaks.

    It is the largest over contacts of the total variation of the force on the 6000 cells, sum |F_i+1 - F_i| from F
    = 0 before the run, less that of the reference, over the peak of the reference; 0 where the force varies less. A
    force that drops to zero and comes back once too often counts 2; ripples of 1 % up and down over a hundred steps
    count 2, too. Where steps are shorter than cells, changes within a cell are not seen. None where the reference has
    no force.
    """
    t = midpoints(scene.duration)
    errors: list[float | None] = []
    for name in force_channels(scene):
        exact = reference.evaluate(t, name)
        peak = float(np.max(np.abs(exact)))
        if peak > 0.0:
            more = _variation(exact if history is reference else history.evaluate(t, name)) - _variation(exact)
            errors.append(more if math.isnan(more) else max(0.0, more) / peak)
    return largest(errors)


def _variation(values: Array) -> float:
    return float(np.sum(np.abs(np.diff(values, prepend=0.0))))


def momentum_error(
    history: AbstractHistory,
    reference: AbstractHistory,  # noqa: ARG001 - a metric has it
    scene: Scene,
) -> float | None:
    """Return the error of the momentum balance of a body; the largest over free bodies.

    |p(end) - p(0) - impulses of contacts - (m g + forces on ends) t| over the momentum in play; see `momentum.balance`.
    It is a balance of the run itself, for any reference. None where every body is held.
    """
    errors = []
    t = np.minimum(history.energy.time, history.duration)  # the last step may end after the run
    impulses = [history.impulse_of(contact.name) for contact in scene.contacts]
    for name in free_bodies(scene, history):
        if not scene.bodies[name].is_free:
            continue
        momentum = history.evaluate(np.append(t, history.duration), f"momentum:{name}")
        energy = float(np.max(np.abs(history.energy.bodies[name])))
        given = history.load_impulses.get(name)
        seen = BodyMomentum(float(momentum[0]), float(momentum[-1]), float(np.max(np.abs(momentum))), energy)
        errors.append(balance(scene, name, impulses, history.duration, seen, given).error)
    return largest(errors)
