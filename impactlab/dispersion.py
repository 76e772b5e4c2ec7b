"""Dispersion relations of rotating rods and beams.

They give frequency, phase speed and group speed over the wave number. A wave exp(i (k x - w t)) in the turning frame,
on a body that is uniform and long beside the wave. Where its frequency is not real, as of the longest waves on a guided
rod, frequency and speeds are NaN: such a wave does not travel.

    from impactlab import dispersion

    waves = dispersion.guided_rod(wave_speed=5156.0, rate=100.0)
    waves.group_speed(20.0)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from impactlab.measurement.inputs import above_zero, expect, finite, one_of, row_of_numbers
from impactlab.scene.bodies import BeamSegment
from impactlab.types import Array

DIFFERENCE = 1e-5  # relative, of the wave numbers between which a group speed is taken: it is exact to 1e-10

__all__ = ["Dispersion", "beam", "free_rod", "guided_rod"]


@dataclass(frozen=True)
class Dispersion:
    """One branch of a dispersion relation."""

    squared: Callable[[Array], Array]
    """Squared frequency [1/s2] of wave numbers [1/m]."""

    def frequency(self, wave_number: ArrayLike) -> Array:
        """Return frequencies [rad/s] of wave numbers [1/m], of their shape; NaN where no wave travels."""
        squared = self.squared(row_of_numbers("the wave number", wave_number))
        return np.asarray(np.sqrt(np.where(squared >= 0.0, squared, np.nan)))

    def phase_speed(self, wave_number: ArrayLike) -> Array:
        """Return the speed of the crests w/k [m/s], same shape."""
        return np.asarray(self.frequency(wave_number) / np.asarray(wave_number, float))

    def group_speed(self, wave_number: ArrayLike) -> Array:
        """Return the speed of packets dw/dk [m/s], same shape."""
        k = row_of_numbers("the wave number", wave_number)
        below, above = (self.squared(factor * k) for factor in (1.0 - DIFFERENCE, 1.0 + DIFFERENCE))
        return np.asarray((above - below) / (4.0 * DIFFERENCE * k * self.frequency(k)))


def guided_rod(wave_speed: float, rate: float) -> Dispersion:
    """Return the axial waves of a rotating rod that cannot bend.

    Their relation is w^2 = c^2 k^2 - Omega^2. ``wave_speed`` is c [m/s], ``rate`` Omega [rad/s]. Crests are slower than
    c and packets faster, the product of both speeds is c^2, and the front runs at c.
    """
    wave_speed, rate = above_zero("wave_speed", wave_speed, "m/s"), finite("rate", rate, "rad/s")
    return Dispersion(lambda k: (wave_speed * k) ** 2 - rate**2)


def free_rod(
    wave_speed: float, rate: float, gyration: float = 0.0, branch: Literal["axial", "bending"] = "axial"
) -> Dispersion:
    """Return the waves of a rotating rod that bends in the plane of rotation.

    The Coriolis force couples both motions: (w^2 + Omega^2 - c^2 k^2)(w^2 + Omega^2 - r^2 c^2 k^4) = 4 Omega^2 w^2.

    Parameters
    ----------
    wave_speed : float
        c [m/s].
    rate : float
        Omega [rad/s].
    gyration : float
        Radius of gyration r of the section [m]; 0 leaves its bending stiffness out.
    branch : "axial" or "bending"
        The upper or the lower frequency.

    Raises
    ------
    ImpactlabError
        If a value is no finite number, the wave speed not above 0, or the branch another word.
    """
    wave_speed, rate = above_zero("wave_speed", wave_speed, "m/s"), finite("rate", rate, "rad/s")
    gyration = finite("gyration", gyration, "m")
    one_of("branch", branch, ("axial", "bending"))

    def squared(k: Array) -> Array:
        axial, bending = (wave_speed * k) ** 2, (gyration * wave_speed * k**2) ** 2
        half = 0.5 * (axial + bending) + rate**2
        apart = np.sqrt(half**2 - (axial - rate**2) * (bending - rate**2))
        return np.asarray(
            half + apart if branch == "axial" else (axial - rate**2) * (bending - rate**2) / (half + apart)
        )

    return Dispersion(squared)


def beam(segment: BeamSegment, rate: float, plane: Literal["chord", "flap"], tension: float = 0.0) -> Dispersion:
    """Return the bending waves of a beam that turns, the slower ones where it shears.

    Without shear (rho A + rho I k^2) w^2 = E I k^4 + N k^2, less rho A Omega^2 in the chord plane, or rho I k^2 Omega^2
    in the flap plane.

    Parameters
    ----------
    segment : BeamSegment
        Its constants: of a scene, ``case.scene().bodies["beam"].segments[0]``.
    rate : float
        Omega [rad/s].
    plane : "chord" or "flap"
        In the plane of rotation or across it.
    tension : float
        N at the place of the wave [N].

    Raises
    ------
    ImpactlabError
        If the segment is that of no beam, a number not finite, or the plane another word.
    """
    expect(segment, BeamSegment, 'Give that of a scene: case.scene().bodies["beam"].segments[0].')
    rate, tension = finite("rate", rate, "rad/s"), finite("tension", tension, "N")
    one_of("plane", plane, ("chord", "flap"))
    mass, rotary, bending = segment.density * segment.area, segment.rotary_inertia, segment.bending_stiffness
    moved, turned = (rate**2, 0.0) if plane == "chord" else (0.0, rate**2)
    shear = segment.shear_stiffness

    def squared(k: Array) -> Array:
        square = k**2
        if math.isinf(shear):
            stiff = bending * square**2 + tension * square - mass * moved - rotary * square * turned
            return np.asarray(stiff / (mass + rotary * square))
        # (rho A w^2 - S k^2 - a)(rho I w^2 - S - b) = S^2 k^2; of long waves S^2 k^2 is nearly all of the product
        a, b = tension * square - mass * moved, bending * square - rotary * turned
        half = 0.5 * ((shear * square + a) * rotary + (shear + b) * mass)
        product = mass * rotary * (shear * (square * b + a) + a * b)
        return np.asarray(product / (half + np.sqrt(half**2 - product)) / (mass * rotary))

    return Dispersion(squared)
