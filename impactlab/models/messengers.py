"""Messengers of single modes: waves read before they reach the face.

For each mode there is a place from which the wave reaches the face in time; its velocity and force are read there.

Near the face a mode of frequency w is taken for two waves that travel along the body, of wave number k by the theory of
the segment at the face. The one that heads for the face has velocity and force in the ratio rho A c, with c = w/k its
phase speed (m u'' = N' for a wave u(x + c t)): read at c dt from the face, v + N/(rho A c) with N the force of the part
behind on the part before. For a mode that is one standing wave with its crest at a free face, such as those of a
uniform rod, this is the velocity that its face has after dt. For others it is not: `miss` returns the difference.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from impactlab.errors import PairingError
from impactlab.printing import at_most
from impactlab.scene.bodies import Beam, BeamSegment, ElasticBody
from impactlab.types import Array, Quantity

Speed = Literal["phase", "group"]
PLACE_TOL = 1e-9  # of a body: a messenger this little beyond an end stands on it
DIFFERENCE = 1e-5  # relative, of the frequencies between which a group speed is taken


class Waves(NamedTuple):
    """The waves of some frequencies on a segment. Zero where the frequency is."""

    phase_speed: Array  # (n,) m/s
    group_speed: Array  # (n,) m/s
    line_mass: float  # kg/m
    force: tuple[tuple[Quantity, Array], ...]  # the force on the part before: quantities of the body, weights (n,)


def waves_at(body: ElasticBody, face: float, frequencies: Array) -> Waves:
    """Return the waves of each frequency [rad/s] on the segment at a face.

    Of two waves on a beam it is the slower one.
    """
    segment = body.segment_at(face)
    line_mass = segment.density * segment.area
    if not isinstance(body, Beam) or not isinstance(segment, BeamSegment):
        speed = np.where(frequencies > 0.0, segment.wave_speed, 0.0)
        return Waves(speed, speed, line_mass, (("force", np.full_like(speed, -1.0)),))
    below, above = (
        wave_numbers(segment, body.tension, factor * frequencies) for factor in (1.0 - DIFFERENCE, 1.0 + DIFFERENCE)
    )
    numbers = wave_numbers(segment, body.tension, frequencies)
    moving = frequencies > 0.0
    phase, group = np.zeros_like(frequencies), np.zeros_like(frequencies)
    phase[moving] = frequencies[moving] / numbers[moving]
    group[moving] = 2.0 * DIFFERENCE * frequencies[moving] / (above - below)[moving]
    # A tension pulls along the slope u' = rotation + shear strain.
    sheared = np.full_like(phase, 1.0 + body.tension / segment.shear_stiffness)
    pulled = np.full_like(phase, body.tension)
    return Waves(phase, group, line_mass, (("shear_force", sheared), ("rotation", pulled)))


def wave_numbers(segment: BeamSegment, tension: float, frequencies: Array) -> Array:
    """Return the wave number [1/m] of each frequency on a beam, (n,).

    Where two waves travel, it is that of the slower one.
    """
    mass, rotary, bending = segment.density * segment.area, segment.rotary_inertia, segment.bending_stiffness
    squared = frequencies**2
    if math.isinf(segment.shear_stiffness):
        # E I k^4 + (T - rho I w^2) k^2 = rho A w^2
        a, b, c = np.full_like(squared, bending), tension - rotary * squared, -mass * squared
    else:
        # ((S + T) k^2 - rho A w^2)(E I k^2 + S - rho I w^2) = S^2 k^2
        shear = segment.shear_stiffness
        held = shear - rotary * squared
        a = np.full_like(squared, (shear + tension) * bending)
        b = (shear + tension) * held - mass * squared * bending - shear**2
        c = -mass * squared * held
    return np.asarray(np.sqrt((-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)))


def arriving_row(
    body: ElasticBody,
    waves: Waves,
    row: Callable[[float, Quantity], Array],
    face: float,
    delay: float,
    speed: Speed,
) -> Array:
    """Return the velocity of the face by the messengers of all modes.

    It is a row over displacements and velocities. At an inner point waves come from both sides, and the face has the
    mean velocity of two free faces.

    Parameters
    ----------
    row : function of x [m] and a quantity, as that of a model in modes
    face : float
        m from the body's left end.
    delay : float
        s, the time that the waves still need.

    Returns
    -------
    row : (2 n_dof,)
    """
    n = waves.phase_speed.size
    distances = (waves.phase_speed if speed == "phase" else waves.group_speed) * delay
    ways = [way for way, end in ((1.0, body.length), (-1.0, 0.0)) if abs(end - face) > PLACE_TOL * body.length]
    result = np.zeros(2 * n)
    for way in ways:
        for mode in range(n):
            x = face + way * distances[mode]
            if not -PLACE_TOL * body.length <= x <= (1.0 + PLACE_TOL) * body.length:
                raise beyond(body, mode, face, float(distances[mode]), delay)
        places, index = np.unique(np.clip(face + way * distances, 0.0, body.length), return_inverse=True)
        for number, x in enumerate(places):
            read = np.flatnonzero(index == number)
            result[n + read] += row(float(x), "velocity")[read] / len(ways)
            moving = read[waves.phase_speed[read] > 0.0]
            if moving.size:
                impedance = waves.line_mass * waves.phase_speed[moving]
                for quantity, weight in waves.force:
                    values = weight[moving] * row(float(x), quantity)[moving]
                    result[moving] += way * values / impedance / len(ways)
    return result


def beyond(body: ElasticBody, mode: int, face: float, distance: float, delay: float) -> PairingError:
    """Return the error of a messenger that would stand beyond the body."""
    room = max(face, body.length - face) if face in (0.0, body.length) else min(face, body.length - face)
    return PairingError(
        f"the messenger of mode {mode + 1} of '{body.name}' would be {distance:.6g} m from the "
        f"face, beyond the body ({room:.6g} m), where the wave has not been reflected yet",
        remedy=f"Give a step of {at_most(delay * room / distance, 3)} s or less.",
        path="solve.step",
    )


def miss(row: Array, face: Array, frequencies: Array, delay: float) -> float:
    """Return the relative error of the messengers in the free motion of the face.

    It is the difference over the change of that motion in ``delay`` [s]. The free velocity of the face in one mode is
    phi (cos(w dt) v - w sin(w dt) u); of a mode in any phase the error and the change, 2 phi sin(w dt/2), are lengths
    in the plane of v and w u. Both are summed over modes of equal energy.

    Parameters
    ----------
    row : (2 n_dof,)
        As `arriving_row` returns it.
    face : (n_dof,)
        phi: displacement of the face in each mode.
    """
    n, moving = face.size, frequencies > 0.0
    velocity = row[n:] - face * np.cos(frequencies * delay)
    swing = row[:n][moving] / frequencies[moving] + (face * np.sin(frequencies * delay))[moving]
    change = float(np.sum((2.0 * face * np.sin(0.5 * frequencies * delay)) ** 2))
    missed = float(np.sum(velocity**2) + np.sum(swing**2))
    return math.sqrt(missed / change) if change > 0.0 else 0.0
