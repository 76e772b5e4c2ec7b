"""The independent solution of scenes with damped rods or beams.

It has compliant contacts on the modes of its own mesh.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.audit.compare import JUDGED, Truth, errors
from studies.audit.network import DASHPOT, HARD, Doc, frames, segments_of
from studies.audit.oscillators import AT, LAGRANGE, POINTS, WEIGHTS, Operators, System, operators, system_of
from studies.audit.tables import STAGES, Array
from studies.audit.truth import SAMPLES, SHARE, NotKnownError, drifted, unknown

MOST_CUTS = 300  # of steps at touches
FLOOR = 1e-6  # m/s, least approach speed of the laws with hysteresis
LEVELS = ((9, 500), (14, 800), (24, 1600), (40, 2500), (64, 3500))  # elements a body, steps a run
KNOTS = np.array([0.0, *AT])  # where displacements are known in a step
HALVINGS = 8  # of a step in which a contact is closed for a part of it only: the force has a kink there
SPREAD = np.linalg.inv(np.vander(KNOTS, increasing=True))  # values there -> monomials


@dataclass
class Contacts:
    """State of the contacts between steps."""

    closed: list[bool]
    approach: Array
    force: Array  # (contacts, stages) of the last step
    impulse: Array
    peak: Array
    touches: list[int]
    jumps: list[list[tuple[float, float]]]


def pushed(
    law: tuple[int, tuple[float, ...]], approach: float, depth: Array, rate: Array
) -> tuple[Array, Array, Array]:
    """Return force, and its slopes by indentation and rate, shape of depth."""
    kind, (k, c, h) = law
    inside = depth > 0.0
    if kind == DASHPOT:
        force, by_depth, by_rate = k * depth + c * rate, np.full_like(depth, k), np.full_like(depth, c)
    else:
        d = np.maximum(depth, 1e-300)
        a = h / approach
        force = k * d**c * (1.0 + a * rate)
        by_depth, by_rate = c * k * d ** (c - 1.0) * (1.0 + a * rate), a * k * d**c
    pulls = ~inside | (force <= 0.0)
    return np.where(pulls, 0.0, force), np.where(pulls, 0.0, by_depth), np.where(pulls, 0.0, by_rate)


def forces(system: System, ops: Operators, free: Array, held: Contacts) -> Array:
    """Return the contact forces at the stages, shape (contacts, stages), by Newton's iteration."""
    count = len(system.rest)
    forced = ops.row_forced[:, :STAGES, :count]  # (2, stages, contacts, contacts, stages)
    matrix = np.moveaxis(forced, 1, 2).reshape(2, count * STAGES, count * STAGES)
    base = np.moveaxis(free[:, :STAGES, :count], 1, 2).reshape(2, count * STAGES)
    found = held.force.reshape(-1).copy()
    unit = np.eye(count * STAGES)

    def residual(values: Array) -> tuple[Array, Array]:
        depth, rate = -(base[0] + matrix[0] @ values), -(base[1] + matrix[1] @ values)
        target, slope = np.zeros_like(values), unit.copy()
        for c in range(count):
            at = slice(c * STAGES, (c + 1) * STAGES)
            f, by_depth, by_rate = pushed(system.laws[c], held.approach[c], depth[at], rate[at])
            target[at] = f
            slope[at] += by_depth[:, None] * matrix[0, at] + by_rate[:, None] * matrix[1, at]
        return values - target, slope

    left, slope = residual(found)
    for _ in range(60):
        size = float(np.abs(left).max())
        if size <= 1e-12 * float(np.abs(found).max(initial=0.0)) + 1e-280:
            return found.reshape(count, STAGES)
        move, share = np.linalg.solve(slope, left), 1.0
        while True:
            trial = found - share * move
            new, new_slope = residual(trial)
            if float(np.abs(new).max()) < size or share < 1e-3:
                break
            share *= 0.5
        if float(np.abs(share * move).max()) <= 1e-13 * float(np.abs(trial).max(initial=0.0)):
            return trial.reshape(count, STAGES)
        found, left, slope = trial, new, new_slope
    raise NotKnownError("contact forces not found")


def first_touch(gap: Array) -> float:
    """Return the first share of a step at which a gap closes.

    The gap is given at the knots; inf where it does not close.
    """
    monomials = SPREAD @ gap
    thetas = np.linspace(0.0, 1.0, 33)
    values = np.polynomial.polynomial.polyval(thetas, monomials)
    below = np.flatnonzero(values[1:] < 0.0)
    if len(below) == 0:
        return math.inf
    low, high = thetas[below[0]], thetas[below[0] + 1]
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if np.polynomial.polynomial.polyval(middle, monomials) < 0.0 else (middle, high)
    return float(high)


def walk(doc: Doc, count: int, steps: int) -> Truth:
    """Return the solution with one mesh and one step."""
    system = system_of(doc, count)
    if any(law == HARD for law, _ in system.laws):
        raise NotKnownError("hard contact on a damped body")
    duration = float(doc["solve"]["duration"])
    contacts, n = len(system.rest), len(system.square)
    held = Contacts(
        [False] * contacts,
        np.ones(contacts),
        np.zeros((contacts, STAGES)),
        np.zeros(contacts),
        np.zeros(contacts),
        [0] * contacts,
        [[] for _ in range(contacts)],
    )
    q, p, t, sample = np.zeros(n), system.start.copy(), 0.0, 0
    regular = duration / steps
    times = (np.arange(SAMPLES) + 0.5) * (duration / SAMPLES)
    shown, shown_force = np.zeros((len(system.channels), SAMPLES)), np.zeros((contacts, SAMPLES))
    step, halvings, cuts = regular, 0, 0
    while t < duration * (1.0 - 1e-12):
        ops = operators(system, step)
        free = ops.row_free @ np.concatenate((q, p)) + ops.row_constant
        free[0, :, :contacts] += system.rest
        start = np.concatenate((system.rest, np.zeros(len(system.channels)))) + system.rows @ q
        now = system.rows @ p
        for c in range(contacts):
            if not held.closed[c] and start[c] <= 0.0 and now[c] < 0.0:
                touch(held, c, -now[c])
        before = dataclasses.replace(
            held, closed=list(held.closed), approach=held.approach.copy(), touches=list(held.touches)
        )
        force, again = settle(system, ops, free, start, held)
        if 1e-6 < again < 1.0 - 1e-9:
            cuts += 1
            if cuts > MOST_CUTS:
                raise NotKnownError("too many touches")
            step *= again  # cut at the touch of a dashpot
            continue
        pressed = force > 0.0
        if halvings < HALVINGS and (pressed.any(axis=1) & ~pressed.all(axis=1)).any():
            halvings += 1
            step = min(regular * 0.5**halvings, duration - t)
            held = before
            continue
        motion = free + np.einsum("iscdk,dk->isc", ops.row_forced, force)
        record(system, held, force, t, step)
        last = np.searchsorted(times, t + step, side="right") if t + step < duration * (1.0 - 1e-12) else SAMPLES
        theta = (times[sample:last] - t) / step
        powers = theta[None, :] ** np.arange(len(KNOTS))[:, None]
        knots = np.concatenate((start[None, contacts:], motion[0, :, contacts:]))
        shown[:, sample:last] = (SPREAD @ knots).T @ powers
        shown_force[:, sample:last] = np.maximum(0.0, force @ LAGRANGE @ powers[:STAGES])
        generalised = force.T @ system.rows[:contacts]  # (stages, modes)
        new = [
            ops.free[-1, i, 0] * q + ops.free[-1, i, 1] * p + (ops.forced[-1, i] * generalised).sum(axis=0)
            + ops.constant[-1, i]
            for i in (0, 1)
        ]  # fmt: skip
        q, p = new
        t, sample = t + step, last
        for c in range(contacts):
            open_now = motion[0, -1, c] >= 0.0
            if open_now:
                held.closed[c] = False
        halvings = max(0, halvings - 1)
        step = regular * 0.5**halvings
        if t + step > duration * (1.0 - 1e-9):
            step = duration - t
        held.force = force
        if len(system.operators) > 40:
            system.operators = {regular: operators(system, regular)}
    return told(doc, system, held, times, shown, shown_force)


def touch(held: Contacts, c: int, speed: float) -> None:
    """Close a contact that is met at a speed."""
    held.closed[c], held.approach[c] = True, max(FLOOR, speed)
    held.touches[c] += 1


def settle(system: System, ops: Operators, free: Array, start: Array, held: Contacts) -> tuple[Array, float]:
    """Return the forces of a step, and the share of touch.

    A dashpot touches at this share of the step; inf where none does.
    """
    contacts = len(system.rest)
    closed, approach, touches = list(held.closed), held.approach.copy(), list(held.touches)
    try:
        force = forces(system, ops, free, held)
    except NotKnownError:
        # A dashpot that touches between two stages may have no forces there: cut at the touch of the free motion.
        free_gaps = [np.concatenate((start[c : c + 1], free[0, :, c])) for c in range(contacts) if not held.closed[c]]
        theta = min((first_touch(gap) for gap in free_gaps), default=math.inf)
        if not 1e-6 < theta < 1.0 - 1e-9:
            raise
        return np.zeros((contacts, STAGES)), theta
    for _ in range(4):
        motion = free + np.einsum("iscdk,dk->isc", ops.row_forced, force)
        changed, cut = False, math.inf
        for c in range(contacts):
            if closed[c]:
                continue
            theta = first_touch(np.concatenate((start[c : c + 1], motion[0, :, c])))
            if theta == math.inf:
                continue
            law, (_, damping, factor) = system.laws[c]
            if law == DASHPOT and damping > 0.0:
                cut = min(cut, theta)
            if law != DASHPOT and factor > 0.0:
                # The rate at the touch, from the polynomial through the rates at the stages and the end.
                spread = np.linalg.inv(np.vander(AT, increasing=True))
                rate = float(np.polynomial.polynomial.polyval(theta, spread @ motion[1, :, c]))
                speed = max(FLOOR, -rate)
                changed = changed or abs(speed - held.approach[c]) > 1e-12 * speed
                held.approach[c] = speed
            held.closed[c], held.touches[c] = True, touches[c] + 1
        if cut < 1.0:
            held.closed, held.approach, held.touches = closed, approach, touches
            return force, max(cut, 1e-12)
        if not changed:
            break
        force = forces(system, ops, free, held)
    return force, math.inf


def record(system: System, held: Contacts, force: Array, t: float, step: float) -> None:
    """Add a step to impulses, peaks and jumps."""
    held.impulse += step * force @ WEIGHTS
    first = force @ LAGRANGE[:, 0]
    held.peak = np.maximum(held.peak, np.maximum(force.max(axis=1), first))
    before = held.force @ LAGRANGE.sum(axis=1) if t > 0.0 else np.zeros(len(first))
    for c, (law, (_, damping, _)) in enumerate(system.laws):
        if law == DASHPOT and damping > 0.0 and abs(first[c] - before[c]) > 0.02 * max(held.peak[c], 1e-300):
            held.jumps[c].append((t, float(first[c] - before[c])))


def told(doc: Doc, system: System, held: Contacts, times: Array, shown: Array, shown_force: Array) -> Truth:
    """Return a walk in the words of a history."""
    frame = frames(doc, {name for name, count in zip(system.names, held.touches, strict=True) if count})
    round_trip = next(
        (
            2.0
            * sum(s["length"] * math.sqrt(s["material"]["density"] / s["material"]["young"]) for s in segments_of(b))
            for b in doc["bodies"].values()
            if b["kind"] in ("rod", "beam")
        ),
        math.nan,
    )
    return Truth(
        times,
        dict(zip(system.channels, shown, strict=True)),
        dict(zip(system.names, shown_force, strict=True)),
        dict(zip(system.names, held.impulse.tolist(), strict=True)),
        dict(zip(system.names, held.peak.tolist(), strict=True)),
        dict(zip(system.names, held.jumps, strict=True)),
        {name: drifted(frame[body], times) for name, body in system.bodies.items()},
        round_trip,
        sum(held.touches),
    )


def solve(doc: Doc, judged: Sequence[str] = JUDGED) -> Truth:
    """Return the solution, refined to a share of the tolerance.

    It is refined until the quantities are known so well, or the levels end.
    """
    wanted = SHARE * float(doc["solve"].get("tolerance", 1e-4))
    known: Truth | None = None
    before: Truth | None = None
    for count, steps in LEVELS:
        try:
            found = walk(doc, count, steps)
        except (ValueError, KeyError) as error:
            raise NotKnownError(f"not served: {error}") from error
        if before is not None:
            found.uncertainty = errors(before, found, tolerance=1e-4)
            known = found
            if unknown(found, judged) <= wanted:
                break
        before = found
    assert known is not None
    return known


__all__ = ["POINTS", "NotKnownError", "solve"]
