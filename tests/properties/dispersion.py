"""Waves in an endless uniform beam: frequency, phase speed and group speed of a wave number.

A wave cos(k x - w t) of deflection in a Timoshenko beam under a tension T satisfies a w^4 - b w^2 + c = 0 with

    a = rho A rho I/kGA,  b = rho A (1 + EI k^2/kGA) + rho I k^2 (1 + T/kGA),  c = EI k^4 (1 + T/kGA) + T k^2.

The lower root is the bending wave; the upper one, from the cut-off frequency sqrt(kGA/rho I) on, turns the cross
sections. Where nothing shears and rotation costs nothing (Euler and Bernoulli) w^2 = (EI k^4 + T k^2)/rho A is left.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from impactlab.scene.bodies import BeamSegment
from impactlab.types import Array

Branch = Literal["bending", "shear"]


def frequency(segment: BeamSegment, wave_number: Array, branch: Branch = "bending", tension: float = 0.0) -> Array:
    """Return the frequencies w [rad/s] of wave numbers k > 0 [1/m], shape of k; inf on a branch that does not exist.

    References
    ----------
    Timoshenko1921; Graff1975, section 3.4 (both branches), section 3.1 (Euler and Bernoulli).
    """
    a, b, c = _coefficients(segment, wave_number, tension)
    root = np.sqrt(b**2 - 4.0 * a * c)
    if branch == "bending":
        return np.asarray(np.sqrt(2.0 * c / (b + root)))
    return np.asarray(np.sqrt((b + root) / (2.0 * a))) if a > 0.0 else np.full(b.shape, np.inf)


def phase_speed(segment: BeamSegment, wave_number: Array, branch: Branch = "bending", tension: float = 0.0) -> Array:
    """Return w/k [m/s], the speed of a crest, shape of k."""
    return np.asarray(frequency(segment, wave_number, branch, tension) / wave_number)


def group_speed(segment: BeamSegment, wave_number: Array, branch: Branch = "bending", tension: float = 0.0) -> Array:
    """Return dw/dk [m/s], the speed of a packet and of its energy, shape of k."""
    a, b, _ = _coefficients(segment, wave_number, tension)
    w = frequency(segment, wave_number, branch, tension)
    stretch = 1.0 + tension / segment.shear_stiffness
    line_mass, bending = segment.density * segment.area, segment.bending_stiffness
    b_slope = 2.0 * wave_number * (line_mass * bending / segment.shear_stiffness + segment.rotary_inertia * stretch)
    c_slope = 4.0 * bending * stretch * wave_number**3 + 2.0 * tension * wave_number
    return np.asarray((b_slope * w**2 - c_slope) / (2.0 * w * (2.0 * a * w**2 - b)))


def cut_off(segment: BeamSegment) -> float:
    """Return the frequency sqrt(kGA/rho I) [rad/s] from which the second wave travels; inf where there is none."""
    if segment.rotary_inertia == 0.0:
        return math.inf
    return math.sqrt(segment.shear_stiffness / segment.rotary_inertia)


def _coefficients(segment: BeamSegment, wave_number: Array, tension: float) -> tuple[float, Array, Array]:
    line_mass, bending, shear = segment.density * segment.area, segment.bending_stiffness, segment.shear_stiffness
    stretch, squared = 1.0 + tension / shear, np.asarray(wave_number, np.float64) ** 2
    b = line_mass * (1.0 + bending / shear * squared) + segment.rotary_inertia * stretch * squared
    return line_mass * segment.rotary_inertia / shear, b, bending * stretch * squared**2 + tension * squared
