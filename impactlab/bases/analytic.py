"""Eigenfunctions of a uniform rod with free or clamped ends, in closed form."""

from __future__ import annotations

import math
from typing import final

import numpy as np

from impactlab.bases.base import Completable, even_grid, quadrature
from impactlab.errors import CaseError
from impactlab.scene.bodies import Profile, WaveBody
from impactlab.types import Array, Quantity

MAX_PLACES = 4096  # of a quadrature at once: a thousand modes then take 100 MB


@final
class AnalyticBasis(Completable):
    """The first modes of a uniform rod, mass-normalised.

    The rigid mode of a free rod comes first and is not counted. With wave numbers k: cos(k x) where the left end is
    free, sin(k x) where it is clamped. A rod that turns has the same shapes at the frequencies omega^2 = (c k)^2 -
    Omega^2.

    Attributes
    ----------
    frequencies : (n_dof,)
        rad/s; exactly zero for the rigid mode.
    """

    def __init__(self, rod: WaveBody, modes: int) -> None:
        kinds = (rod.left.kind, rod.right.kind)
        if len(rod.segments) != 1 or any(kind not in ("free", "clamped") for kind in kinds):
            raise CaseError(
                f"analytic modes need a uniform rod with free or clamped ends; '{rod.name}' has "
                f"{len(rod.segments)} segment(s) and ends {kinds[0]}, {kinds[1]}",
                remedy="Give 'elements' for the eigenvectors of a mesh.",
                path="solve.model",
            )
        self._segment = rod.segments[0]
        self._length = rod.length
        self._clamped = (kinds[0] == "clamped", kinds[1] == "clamped")
        count = np.arange(1, modes + 1)
        quarter = self._clamped[0] != self._clamped[1]
        self._numbers = (2 * count - 1) * np.pi / (2 * self._length) if quarter else count * np.pi / self._length
        self._scale: Array = np.full(modes, float(np.sqrt(2.0 / self._segment.mass)))
        if not any(self._clamped):
            self._numbers = np.concatenate(([0.0], self._numbers))
            self._scale = np.concatenate(([1.0 / np.sqrt(self._segment.mass)], self._scale))
        softest = self._softest = math.sqrt(rod.softening) / self._segment.wave_speed
        numbers = np.sqrt((self._numbers - softest) * (self._numbers + softest)) if softest else self._numbers
        self.frequencies: Array = np.asarray(numbers * self._segment.wave_speed, np.float64)

    def _shape(self, x: Array) -> Array:
        phase = np.multiply.outer(x, self._numbers)
        return np.asarray((np.sin(phase) if self._clamped[0] else np.cos(phase)) * self._scale)

    def row(self, x: float, quantity: Quantity) -> Array:
        if quantity in ("displacement", "velocity"):
            return self._shape(np.array(x))
        phase = self._numbers * x
        slope = np.cos(phase) if self._clamped[0] else -np.sin(phase)
        young, area = self._segment.young, self._segment.area
        factor = {"strain": 1.0, "stress": young, "force": young * area}[quantity]
        return np.asarray(-factor * self._scale * self._numbers * slope)

    def static(self, x: float, quantity: Quantity, face: float) -> float:
        if self._softest:
            return self._static_turning(x, quantity, face)
        young, area, length = self._segment.young, self._segment.area, self._length
        behind = 1.0 if x > face or (x == face and face == 0.0) else 0.0
        left, right = self._clamped
        if left and right:
            force = face / length - (1.0 - behind)
            displacement = min(x, face) * (1.0 - max(x, face) / length)
        elif right:
            force = behind
            displacement = length - max(x, face)
        elif left:
            force = behind - 1.0
            displacement = min(x, face)
        else:
            force = behind - x / length
            displacement = (x**2 + face**2) / (2 * length) - max(x, face) + length / 3.0
        if quantity == "displacement":
            return displacement / (young * area)
        if quantity == "velocity":
            return 0.0
        return force / {"strain": young * area, "stress": area, "force": 1.0}[quantity]

    def _static_turning(self, x: float, quantity: Quantity, face: float) -> float:
        """Return `static` of a rotating rod, by circular functions of wave number Omega/c."""
        if quantity == "velocity":
            return 0.0
        number, length, segment = self._softest, self._length, self._segment
        behind = x > face or (x == face and face == 0.0)
        left, right = (face, length - x) if behind else (x, length - face)
        (u, du), (w, dw) = (
            (math.sin(number * at), math.cos(number * at)) if held else (math.cos(number * at), -math.sin(number * at))
            for at, held in ((left, self._clamped[0]), (right, self._clamped[1]))
        )
        whole = math.sin(number * length) if all(self._clamped) else math.cos(number * length)
        stiff = segment.young * segment.area
        if quantity == "displacement":
            return u * w / (stiff * number * whole)
        slope = -u * dw if behind else du * w
        return -slope / whole / {"strain": stiff, "stress": segment.area, "force": 1.0}[quantity]

    def project(self, profile: Profile) -> Array:
        x, weight = quadrature(self._length, self._numbers.size)
        weighted = weight * self._segment.density * self._segment.area * profile(x)
        blocks = (slice(first, first + MAX_PLACES) for first in range(0, x.size, MAX_PLACES))
        return np.asarray(sum(self._shape(x[block]).T @ weighted[block] for block in blocks))

    def project_uniform(self) -> Array:
        line_mass, length = self._segment.density * self._segment.area, self._length
        numbers = np.where(self._numbers > 0.0, self._numbers, 1.0)
        integral = (
            (1.0 - np.cos(numbers * length)) / numbers if self._clamped[0] else np.sin(numbers * length) / numbers
        )
        integral = np.where(self._numbers > 0.0, integral, length)
        return np.asarray(line_mass * self._scale * integral)

    def grid(self) -> Array:
        return even_grid(self._length, self._numbers.size)
