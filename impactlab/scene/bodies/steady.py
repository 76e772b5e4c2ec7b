"""Steady state of rotating rods and beams: radii, stretch, tension; limit rate of rods.

A rod stretched by its own centrifugal force has r'' = -(Omega/c)^2 r, with r(x) the radius at which the section x
turns: circular functions in each segment, joined by the tension E A (r' - 1). A beam, whose stretch is left out, has
N' = -Omega^2 rho A (x - axis). Radii are signed: positive where the axis lies on the side of smaller x.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from impactlab.scene.bodies.pieces import End, Segment
from impactlab.types import Array

RIGID_TOL = 1e-9  # of the highest frequency that the lowest may be: strains below are 1e-18 of the displacements
BOUND_FACTOR = 1.0 + 1e-6  # times a bound that may be reached: rounding of a phase is far below pi times 1e-6


class SteadyState(NamedTuple):
    """A body that turns and does not move otherwise."""

    radii: tuple[float, float]  # m, of the left end and of the right end, signed along +x
    stretch: float  # m, of the whole length
    root_stress: float  # Pa, at the end that holds the body, positive in tension; the larger one of two


@dataclass(frozen=True)
class SteadyRod:
    """A rotating rod, its ends clamped, on springs, free, or with masses."""

    segments: Sequence[Segment]
    left: End
    right: End
    rate: float = 0.0  # rad/s
    axis_at: float = 0.0  # m

    def state(self) -> SteadyState:
        """Return radii, stretch and root stress."""
        length = sum(segment.length for segment in self.segments)
        (left, pull), (right, force) = self.section(0.0), self.section(length)
        ends = ((self.left, pull, self.segments[0]), (self.right, force, self.segments[-1]))
        held = [tension / segment.area for end, tension, segment in ends if end.kind in ("clamped", "spring")]
        return SteadyState((left, right), right - left - length, max(held, key=abs, default=0.0))

    def section(self, x: float) -> tuple[float, float]:
        """Return radius [m] and tension [N] at x [m]."""
        length = sum(segment.length for segment in self.segments)
        pull, axis = _pull(self.left, self.rate), self.axis_at
        # Radius and tension that the left end allows: one pair, and the direction in which it is free.
        start, free = (-axis, 0.0), (1.0, pull)
        if self.left.kind == "clamped":
            free = (0.0, 1.0)
        elif self.left.kind == "mass":
            start = (-axis, -pull * axis)
        # By how much the right end misses its condition follows linearly from them.
        missed = self._missed(self._carried(start, 1.0, length), length - axis)
        share = -missed / self._missed(self._carried(free, 0.0, length), 0.0)
        root = start[0] + share * free[0], start[1] + share * free[1]
        return root if x == 0.0 else self._carried(root, 1.0, x)

    def _missed(self, state: tuple[float, float], unstrained: float) -> float:
        """Return the residual of the condition at the right end, at rest at ``unstrained`` [m]."""
        radius, tension = state
        if self.right.kind == "clamped":
            return radius - unstrained
        return tension + _pull(self.right, self.rate) * (radius - (unstrained if self.right.kind == "spring" else 0.0))

    def _carried(self, state: tuple[float, float], pulled: float, x: float) -> tuple[float, float]:
        """Return radius and tension at x [m] from those at the left end.

        ``pulled`` times E A is subtracted from the tension.
        """
        (radius, tension), start = state, 0.0
        for segment in self.segments:
            length = min(segment.length, x - start)
            if length <= 0.0:
                break
            phase, line = self.rate * length / segment.wave_speed, segment.impedance * self.rate
            stiff = pulled * segment.young * segment.area
            cosine, sine, slope = math.cos(phase), math.sin(phase), tension + stiff
            radius, tension = radius * cosine + slope / line * sine, slope * cosine - line * radius * sine - stiff
            start += segment.length
        return radius, tension

    def limit_rate(self) -> float:
        """Return the rate at which the steady state is lost [rad/s].

        It is the lowest frequency at rest; 0 if the rod is free. The phase of a standing wave (Pruefer's angle, whose
        tangent is Z w u over the tension) grows steadily with the frequency, and reaches that of the right end first at
        the lowest one.
        """
        from scipy.optimize import brentq

        if not any(end.kind in ("clamped", "spring") for end in (self.left, self.right)):
            return 0.0
        # The lowest frequency of a segment clamped at both ends, which that of a uniform rod so held is.
        highest = BOUND_FACTOR * math.pi / min(segment.length / segment.wave_speed for segment in self.segments)
        if self._ahead(RIGID_TOL * highest) >= 0.0:  # so slow that it moves as a mass on its springs
            ends = (self.left, self.right)
            mass = sum(each.mass for each in self.segments) + sum(end.value for end in ends if end.kind == "mass")
            return math.sqrt(sum(end.value for end in ends if end.kind == "spring") / mass)
        return float(brentq(self._ahead, RIGID_TOL * highest, highest, xtol=1e-14 * highest, rtol=1e-14))

    def _ahead(self, rate: float) -> float:
        """Return the excess of the right end's phase over that of its support.

        ``rate`` is the frequency [rad/s].
        """
        phase = _phase(self.left, rate, self.segments[0])
        for before, segment in zip((self.segments[0], *self.segments), self.segments, strict=False):
            turns, part = divmod(phase, math.pi)
            joined = math.atan2(math.sin(part) * segment.impedance, math.cos(part) * before.impedance)
            phase = turns * math.pi + joined + rate * segment.length / segment.wave_speed
        return phase - (math.pi - _phase(self.right, rate, self.segments[-1]))


def _pull(end: End, rate: float) -> float:
    """Return the force of an end towards its place at rest, per displacement [N/m]."""
    return {"spring": end.value, "mass": -end.value * rate**2}.get(end.kind, 0.0)


def _phase(end: End, rate: float, segment: Segment) -> float:
    """Return a standing wave's phase at an end, counted inwards: 0 if clamped, pi/2 if free."""
    return 0.0 if end.kind == "clamped" else math.atan2(segment.impedance * rate, _pull(end, rate))


@dataclass(frozen=True)
class SteadyBeam:
    """A rotating beam.

    Clamped and pinned ends hold it along its axis; where both do, it keeps its length.
    """

    segments: Sequence[Segment]
    left: End
    right: End
    rate: float  # rad/s
    axis_at: float  # m

    def tension(self, x: Array) -> Array:
        """Return the tension [N] at places [m], of any shape."""
        lengths = np.array([segment.length for segment in self.segments])
        starts = np.concatenate(([0.0], np.cumsum(lengths)[:-1]))
        lines = np.array([segment.density * segment.area for segment in self.segments])
        # rho A (s - axis) integrated over each segment [kg m], and from the left end to its start.
        whole = lines * lengths * (0.5 * lengths + starts - self.axis_at)
        before = np.concatenate(([0.0], np.cumsum(whole)[:-1]))
        piece = np.clip(np.searchsorted(starts, x, side="right") - 1, 0, lengths.size - 1)
        into = x - starts[piece]
        moment = before[piece] + lines[piece] * into * (0.5 * into + starts[piece] - self.axis_at)
        return np.asarray(self.rate**2 * (self._root(lengths, starts, lines, whole, before) - moment))

    def _root(self, lengths: Array, starts: Array, lines: Array, whole: Array, before: Array) -> float:
        """Return the tension at the left end over the rate squared [kg m]."""
        held = [end.kind in ("clamped", "pinned") for end in (self.left, self.right)]
        carried = [end.value if end.kind == "mass" else 0.0 for end in (self.left, self.right)]
        if all(held):
            soft = 1.0 / np.array([segment.young * segment.area for segment in self.segments])
            inside = before * lengths + lines * lengths**2 * (lengths / 6.0 + 0.5 * (starts - self.axis_at))
            return float(np.sum(soft * inside) / np.sum(soft * lengths))
        if held[1]:
            return float(carried[0] * self.axis_at)
        return float(whole.sum()) + carried[1] * float(lengths.sum() - self.axis_at)

    def state(self) -> SteadyState:
        """Return radii, stretch and root stress."""
        start, stretch = 0.0, 0.0
        for segment in self.segments:  # Gauss's rule: the tension is a quadratic in each
            n = self.tension(start + 0.5 * segment.length * (1.0 + np.array([-1.0, 1.0]) / math.sqrt(3.0)))
            stretch += segment.length / (segment.young * segment.area) * 0.5 * float(n[0] + n[1])
            start += segment.length
        held = [end.kind in ("clamped", "pinned") for end in (self.left, self.right)]
        left = -self.axis_at - (0.0 if held[0] else stretch)
        forces = self.tension(np.array([0.0, start]))
        ends = ((0, held[0], self.segments[0].area), (1, held[1], self.segments[-1].area))
        stresses = [float(forces[number]) / area for number, holds, area in ends if holds]
        return SteadyState((left, left + start + stretch), stretch, max(stresses, key=abs, default=0.0))
