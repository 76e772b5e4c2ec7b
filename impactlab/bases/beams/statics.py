"""Exact statics of a uniform beam under a force at a point, with inertia relief."""

from __future__ import annotations

from typing import final

import numpy as np

from impactlab.scene.bodies import BeamSegment
from impactlab.types import Array

WORDS = ("displacement", "rotation", "bending_moment", "shear_force")
ZERO_AT = {"clamped": (0, 1), "pinned": (0, 2), "free": (2, 3)}  # which of these vanish at an end
PLACES, WEIGHTS = np.polynomial.legendre.leggauss(4)  # exact up to degree 7; 6 is needed


@final
class BeamStatics:
    """Deflection, rotation, bending moment and shear force under a unit force at one point.

    A beam that can move freely is taken in the frame of its rigid acceleration, without rigid motion (inertia relief).
    Where a bending moment M and a shear force Q act, w' = theta + Q/kGA, theta' = M/EI, and in the moving frame
    M' = -Q + rho I theta'', Q' = rho A w'' with the second derivatives those of the rigid motion in time.
    Inside, the beam's length, mass and EI are 1.

    Parameters
    ----------
    segment : BeamSegment
        The whole beam.
    kinds : left and right end, clamped, pinned or free
    motions : (n_rigid, 2)
        Offset and slope over the length of rigid motions, mass-normalised for a beam of unit mass and length.
    face : float
        m, where the force acts.
    """

    def __init__(self, segment: BeamSegment, kinds: tuple[str, str], motions: Array, face: float) -> None:
        length, bending = segment.length, segment.bending_stiffness
        self._face = face / length
        self._shear = bending / (segment.shear_stiffness * length**2)
        self._rotary = segment.rotary_inertia * length / (segment.mass * length**2)
        self._length = length
        self._scales = (length**3 / bending, length**2 / bending, length, 1.0)
        self._acceleration = motions.T @ (motions @ np.array([1.0, self._face])) if len(motions) else np.zeros(2)
        rows, values = [], []
        for x, kind in zip((0.0, 1.0), kinds, strict=True):
            for which in ZERO_AT[kind]:
                rows.append(self._homogeneous(x)[which])
                values.append(-self._particular(x, behind=x == 1.0)[which])
        for offset, slope in motions:
            row, value = self._overlap(offset, slope)
            rows.append(row)
            values.append(-value)
        self._start = np.linalg.lstsq(np.array(rows), np.array(values), rcond=None)[0]

    def at(self, x: float, quantity: str) -> float:
        """Return the quantity at x [m] per newton.

        At the force itself the shear force is the one to its right. At the force on the right end it is the one to the
        left.
        """
        if quantity == "velocity":
            return 0.0
        place, which = x / self._length, WORDS.index(quantity)
        behind = place >= self._face and not place == self._face == 1.0
        value = self._homogeneous(place)[which] @ self._start + self._particular(place, behind)[which]
        return float(value * self._scales[which])

    def _homogeneous(self, x: float) -> Array:
        """Return the four quantities (4,) at x per value at 0.

        The columns are deflection, rotation, moment and shear force at 0, (4,).
        """
        return np.array(
            [
                [1.0, x, x**2 / 2.0, -(x**3) / 6.0 + self._shear * x],
                [0.0, 1.0, x, -(x**2) / 2.0],
                [0.0, 0.0, 1.0, -x],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )

    def _particular(self, x: float, behind: bool) -> Array:
        """Return the four quantities (4,) at x under force and inertia that are zero at 0."""
        (steady, turning), rotary = self._acceleration, self._rotary
        past = x - self._face if behind else 0.0
        force = steady * x + turning * x**2 / 2.0 - (1.0 if behind else 0.0)
        moment = -steady * x**2 / 2.0 - turning * x**3 / 6.0 + past + rotary * turning * x
        rotation = -steady * x**3 / 6.0 - turning * x**4 / 24.0 + past**2 / 2.0 + rotary * turning * x**2 / 2.0
        bent = -steady * x**4 / 24.0 - turning * x**5 / 120.0 + past**3 / 6.0 + rotary * turning * x**3 / 6.0
        sheared = self._shear * (steady * x**2 / 2.0 + turning * x**3 / 6.0 - past)
        return np.array([bent + sheared, rotation, moment, force])

    def _overlap(self, offset: float, slope: float) -> tuple[Array, float]:
        """Return the mass product of a rigid motion with the static fields.

        The first is with the four fields that start at 0, (4,), the second with the particular one.
        """
        row, value = np.zeros(4), 0.0
        for start, stop in ((0.0, self._face), (self._face, 1.0)):
            for place, weight in zip(PLACES, WEIGHTS, strict=True):
                x, share = start + 0.5 * (stop - start) * (1.0 + place), 0.5 * (stop - start) * weight
                lever = np.array([offset + slope * x, self._rotary * slope])
                row += share * lever @ self._homogeneous(x)[:2]
                value += share * float(lever @ self._particular(x, bool(x >= self._face))[:2])
        return row, value
