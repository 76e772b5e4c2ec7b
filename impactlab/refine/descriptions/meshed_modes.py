"""Frequency errors of the modes of meshes.

Their frequencies are a little too high, so that vibrations run ahead, the more the longer a run. Measured on random
beams after a touch, the error of displacements is about that of the wave which turns once in a rise of the force, by
its turn k h in an element: of order 4, and of order 2 where sections shear, by S = k2 EI/(kGA).
"""

from __future__ import annotations

import math

from impactlab.scene.bodies import Beam

BENDS = 2e-3  # of (k h)^4, times the duration over the rise: measured, 1.2e-3 to 1.7e-3
SHEARS = 0.05  # of S (k h)^2: measured, 0.01 to 0.06


def error_of(beam: Beam, elements: int, rise: float, duration: float) -> float:
    """Return the relative error by the mesh behind a beam's modes.

    The force rises in a time [s].
    """
    turn, sheared = _wave(beam, rise)
    square = (turn / elements) ** 2
    return duration / rise * (BENDS * square + SHEARS * sheared) * square


def elements_for(beam: Beam, error: float, rise: float, duration: float) -> int:
    """Return the elements that leave an error."""
    turn, sheared = _wave(beam, rise)
    half = 0.5 * SHEARS * sheared
    square = (math.sqrt(half**2 + BENDS * error * rise / duration) - half) / BENDS
    return math.ceil(turn / math.sqrt(square))


def _wave(beam: Beam, rise: float) -> tuple[float, float]:
    """Return the turn of a wave over a beam [rad], and its S.

    It is the wave that turns once in a rise of the force.
    """
    square = 1.0 / (rise * min(math.sqrt(s.bending_stiffness / (s.density * s.area)) for s in beam.segments))
    sheared = square * max(s.bending_stiffness / s.shear_stiffness for s in beam.segments)
    return beam.length * math.sqrt(square), sheared if beam.theory == "timoshenko" else 0.0
