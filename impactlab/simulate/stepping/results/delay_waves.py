"""The two travelling waves of a delay line.

They follow from the displacements of its ends, and give any quantity at any place and time. With P and Q the time
integrals of the velocities that the waves carry away from the left and the right end, the displacement is u(x, t) = C +
P(t - x/c) + Q(t - (L - x)/c). At the ends this gives P and Q from the recorded displacements, transit by transit. A
step holds its waves constant, so that P and Q are straight lines in a step: so far the step loop computes the same, and
its displacements come back to rounding. Velocities are straight lines between the middles of steps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.scene.bodies import WaveBody
from impactlab.types import Array


class SentWave(NamedTuple):
    """The wave that an end sends: displacement, and velocity at middles of steps."""

    times: Array  # (n,) s, from before t = 0 on
    moved: Array  # (n,) m

    def displacement(self, t: Array) -> Array:
        """Return the time integral of the velocity [m] at times t [s]."""
        return np.asarray(np.interp(t, self.times, self.moved))

    def velocity(self, t: Array) -> Array:
        """Return the velocity [m/s] at times t [s]."""
        return np.asarray(np.interp(t, self.middles, np.diff(self.moved) / np.diff(self.times)))

    @property
    def middles(self) -> Array:
        """Middles of the steps, shape (n - 1,) [s]."""
        return np.asarray(0.5 * (self.times[1:] + self.times[:-1]))


def beyond(last: float, onward: Array, back: Array) -> Array:
    """Return by how much waves left their ends after the last middle [s].

    It is the middle of the last step; the value is 0 for earlier waves. A wave that an end sends is known up to there,
    the one that arrives at it half a step longer. Both are read as much earlier, so that they belong together at a
    front.
    """
    return np.asarray(np.maximum(0.0, np.maximum(onward, back) - last))


class DelayWaves:
    """The waves of a uniform rod from both of its ends.

    The one from the left end travels to the right, the other to the left.

    Parameters
    ----------
    rod : WaveBody
        The rod, of one segment.
    times : Array
        Recorded instants, from 0 on, rising, shape (n,) [s].
    ends : Array
        Displacements of the left and the right end at them, shape (2, n) [m].
    dt : float
        The step [s], in which the waves that are on their way at t = 0 are resolved.
    """

    def __init__(self, rod: WaveBody, times: Array, ends: Array, dt: float) -> None:
        self.rod, self.segment = rod, rod.segments[0]
        self.transit = rod.length / self.segment.wave_speed
        edges = np.arange(int(self.transit / dt) + 3) * dt
        before, start = [], rod.displacement or np.zeros_like
        u = start(np.array([0.0, rod.length]))
        for side, x in enumerate((edges * self.segment.wave_speed, rod.length - edges * self.segment.wave_speed)):
            strained = start(np.clip(x, 0.0, rod.length)) - u[side]
            before.append(-0.5 * (rod.velocity * edges - strained))
        self.offset = float(0.5 * u.sum() + 0.5 * rod.velocity * self.transit)
        first, moved = edges.size - 1, np.zeros((2, edges.size - 1 + times.size))
        instants = np.concatenate([-edges[:0:-1], times])
        for side in range(2):
            moved[side, :first] = before[side][:0:-1]
        done = first
        while done < instants.size:
            upto = int(np.searchsorted(instants, instants[done - 1] + self.transit, side="right"))
            upto = max(upto, done + 1)
            arriving = instants[done:upto] - self.transit
            arrived = [np.interp(arriving, instants[:done], moved[1 - side, :done]) for side in range(2)]
            for side in range(2):
                moved[side, done:upto] = ends[side, done - first : upto - first] - self.offset - arrived[side]
            done = upto
        self.sent = SentWave(instants, moved[0]), SentWave(instants, moved[1])

    def velocities(self, x: Array, t: Array) -> tuple[Array, Array]:
        """Return the velocities of both waves at places and times [m/s].

        The wave to the right comes first; x is in m, t in s.
        """
        right, left = self.sent
        onward, back = self._left_at(x, t)
        late = beyond(float(right.middles[-1]), onward, back)
        return right.velocity(onward - late), left.velocity(back - late)

    def _left_at(self, x: Array, t: Array) -> tuple[Array, Array]:
        """Return when the waves at x [m] and t [s] left both ends [s]."""
        speed = self.segment.wave_speed
        return t - x / speed, t - (self.rod.length - x) / speed

    def at(self, quantity: str, x: Array, t: Array) -> Array:
        """Return a quantity at places x [m] and times t [s].

        These are broadcast against each other.
        """
        if quantity == "displacement":
            right, left = self.sent
            onward, back = self._left_at(x, t)
            return self.offset + right.displacement(onward) + left.displacement(back)
        to_right, to_left = self.velocities(x, t)
        if quantity == "velocity":
            return to_right + to_left
        return self.segment.per_velocity(quantity) * (to_right - to_left)
