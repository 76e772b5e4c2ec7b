"""A straight row of uniform segments between two ends: lengths, masses, places, travel times."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

from impactlab.scene.bodies.pieces import End, Segment

PLACE_ROUNDING = 1e-12  # of a length: a place this near to a boundary of segments is on it


@dataclass(frozen=True)
class Segmented:
    """Segments from the left end, x = 0, to the right, with both supports."""

    segments: tuple[Segment, ...]
    left: End
    right: End

    @property
    def length(self) -> float:
        """Whole length [m]."""
        return sum(segment.length for segment in self.segments)

    @property
    def mass(self) -> float:
        """Mass of the segments, without end masses [kg]."""
        return sum(segment.mass for segment in self.segments)

    @property
    def ends(self) -> tuple[tuple[float, End], ...]:
        """Place x [m] and support of each end."""
        return (0.0, self.left), (self.length, self.right)

    @property
    def round_trip(self) -> float:
        """Time [s] of a wave to the far end and back, summed over segments."""
        trip = 0.0
        for segment in self.segments:  # plain sums: those of later versions of Python are compensated
            trip += 2.0 * segment.length / segment.wave_speed
        return trip

    def segment_at(self, x: float) -> Segment:
        """Return the segment at x [m]; at a boundary, met to rounding, the right one."""
        if len(self.segments) == 1:
            return self.segments[0]
        ends, behind = self._segment_ends(), x + PLACE_ROUNDING * self.length
        return next((piece for piece, end in zip(self.segments, ends, strict=True) if behind < end), self.segments[-1])

    def segment_before(self, x: float) -> Segment:
        """Return the segment at x [m]; at a boundary, met to rounding, the left one."""
        ends, before = self._segment_ends(), x - PLACE_ROUNDING * self.length
        return next((piece for piece, end in zip(self.segments, ends, strict=True) if before <= end), self.segments[-1])

    def _segment_ends(self) -> Iterator[float]:
        """Give the place x [m] of the right end of each segment."""
        return itertools.accumulate(segment.length for segment in self.segments)

    def is_inner(self, x: float) -> bool:
        """Return whether x [m] lies between the ends."""
        return 0.0 < x < self.length

    def carries(self, x: float) -> str:
        """Return the support at x [m]: ``inner``, ``force``, or the kind of the end."""
        return "inner" if self.is_inner(x) else (self.left if x == 0.0 else self.right).carries

    def front_time(self, x: float, other: float) -> float:
        """Return the travel time [s] of a front between two x [m]."""
        low, high = min(x, other), max(x, other)
        time = at = 0.0
        for segment in self.segments:
            inside = max(0.0, min(high, at + segment.length) - max(low, at))
            time, at = time + inside / segment.front_speed, at + segment.length
        return time
