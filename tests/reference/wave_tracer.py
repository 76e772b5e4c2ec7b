"""An independent answer for rods in a row: square waves traced from joint to joint in exact rational arithmetic.

Rods start unstrained and without gravity, each with its own velocity; so every wave is a staircase. All numbers are
fractions, so wave fronts that meet do so exactly, and a force that is zero is zero. Nothing is shared with the solver.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from fractions import Fraction

ZERO = Fraction(0)


@dataclass
class Piece:
    """A uniform rod piece; waves are velocities."""

    transit: Fraction
    impedance: Fraction
    velocity: Fraction = ZERO
    strain_wave: Fraction = ZERO  # c times initial compressive strain
    arriving: list[Fraction] = field(default_factory=list)  # at its left and right end
    coming: list[deque] = field(default_factory=list)  # (time, wave) to its left and right end
    sent: list[Fraction | None] = field(default_factory=lambda: [None, None])


@dataclass
class Joint:
    """The contact between neighbours of the row: None for a bond, else a gap; the outer ones hold the outer ends."""

    gap: Fraction | None = None
    closed: bool = False
    force: Fraction = ZERO


def send(piece, end, velocity, time):
    """Let an end that moves with a velocity send the wave this takes, if it is another than before."""
    wave = velocity - piece.arriving[end]
    if piece.sent[end] != wave:
        piece.sent[end] = wave
        piece.coming[1 - end].append((time + piece.transit, wave))


def outer(piece, dashpot, end):
    """Return the velocity of an end of the row."""
    return ZERO if dashpot is None else 2 * piece.impedance * piece.arriving[end] / (piece.impedance + dashpot)


def answer(joint, a, b, time):
    """Let a joint answer what arrives: its faces, its event if there is one, and the rate of its gap."""
    together = 2 * (a.impedance * a.arriving[1] + b.impedance * b.arriving[0]) / (a.impedance + b.impedance)
    press = 2 * a.impedance * b.impedance * (a.arriving[1] - b.arriving[0]) / (a.impedance + b.impedance)
    event = None
    if joint.gap is not None:
        if joint.closed and press <= 0:
            joint.closed, event = False, "open"
        elif not joint.closed and joint.gap == 0 and press > 0:
            joint.closed, event = True, "close"
    bonded = joint.gap is None or joint.closed
    send(a, 1, together if bonded else 2 * a.arriving[1], time)
    send(b, 0, together if bonded else 2 * b.arriving[0], time)
    joint.force = press if bonded else ZERO
    return event, ZERO if bonded else 2 * (b.arriving[0] - a.arriving[1])


def trace(pieces, gaps, duration, left=ZERO, right=ZERO):
    """Return events (time, joint, kind) and forces {joint: [(time, force)]} of rod pieces in a row.

    gaps[i] lies between pieces i and i + 1 at t = 0, None where they are one rod. left and right are the dashpots at
    the outer ends; None is a clamp.
    """
    joints = [Joint(gap) for gap in gaps]
    for piece in pieces:
        piece.arriving = [(piece.velocity - piece.strain_wave) / 2, (piece.velocity + piece.strain_wave) / 2]
        piece.coming = [deque(), deque()]
    events, forces = [], {i: [] for i in range(len(joints))}
    time = ZERO
    while True:
        send(pieces[0], 0, outer(pieces[0], left, 0), time)
        send(pieces[-1], 1, outer(pieces[-1], right, 1), time)
        rates = {}
        for i, joint in enumerate(joints):
            event, rates[i] = answer(joint, pieces[i], pieces[i + 1], time)
            if event:
                events.append((time, i, event))
            if not forces[i] or forces[i][-1][1] != joint.force:
                forces[i].append((time, joint.force))
        after = [queue[0][0] for piece in pieces for queue in piece.coming if queue]
        after += [time - joints[i].gap / rate for i, rate in rates.items() if rate < 0]
        if not after or min(after) > duration:
            return events, forces
        step, time = min(after) - time, min(after)
        for i, rate in rates.items():
            if rate:
                joints[i].gap += step * rate
        for piece in pieces:
            for end in range(2):
                while piece.coming[end] and piece.coming[end][0][0] <= time:
                    piece.arriving[end] = piece.coming[end].popleft()[1]
