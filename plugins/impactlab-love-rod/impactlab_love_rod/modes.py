"""Modes of a uniform Love rod, in closed form.

They are those of the bar, slower, and of smaller amplitude.
"""

from __future__ import annotations

from typing import final

import numpy as np

from impactlab.bases.analytic import AnalyticBasis
from impactlab.models.messengers import Waves
from impactlab.scene import Profile, Segment, WaveBody
from impactlab.types import Array, Quantity


@final
class LoveModes:
    """The first modes of a uniform Love rod, mass-normalised, rigid one first.

    Its ends are free or clamped. A free end has u' = 0 as that of a bar, so the shapes are the bar's. Lateral inertia
    multiplies the modal mass of wave number k by 1 + (nu r k)^2 and leaves the stiffness.

    Parameters
    ----------
    rod : WaveBody
    modes : int
        Elastic ones.
    lateral : float
        nu r_p [m].

    Attributes
    ----------
    frequencies : (n_dof,)
        rad/s.
    """

    def __init__(self, rod: WaveBody, modes: int, lateral: float) -> None:
        self._bar = AnalyticBasis(rod, modes)
        self._numbers: Array = self._bar.frequencies / rod.segments[0].wave_speed
        self._smaller: Array = 1.0 / np.sqrt(1.0 + (lateral * self._numbers) ** 2)
        self.frequencies: Array = self._bar.frequencies * self._smaller

    def row(self, x: float, quantity: Quantity) -> Array:
        """Return the quantity at x [m] of each mode, shape (n_dof,)."""
        return self._bar.row(x, quantity) * self._smaller

    def static(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the exact static quantity at x per unit force at ``face``.

        It is that of the bar.
        """
        return self._bar.static(x, quantity, face)

    def project(self, profile: Profile) -> Array:
        """Return the modal coordinates of a displacement profile, shape (n_dof,)."""
        return self._bar.project(profile) / self._smaller

    def project_uniform(self) -> Array:
        """Return the momentum of each mode at unit modal velocity, shape (n_dof,)."""
        return self._bar.project_uniform() * self._smaller

    def grid(self) -> Array:
        """Return places fine enough for the shortest mode, shape (n,) [m]."""
        return self._bar.grid()

    def waves(self, segment: Segment) -> Waves:
        """Return the waves of the modes, with lateral inertia in their force.

        That force is E A u' + rho A (nu r)^2 u'_tt, of a wave rho A c^2 u' with c its phase speed.
        """
        phase = segment.wave_speed * self._smaller
        phase[self._numbers == 0.0] = 0.0
        return Waves(phase, phase * self._smaller**2, segment.density * segment.area, (("force", -(self._smaller**2)),))
