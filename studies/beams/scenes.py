"""Beams struck by a mass or a sphere, with closed forms.

They serve the scripts of these pages.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.special import erfcx

from impactlab import simulate
from impactlab.contact.base import AbstractContactLaw
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.exact_modal import ExactModal
from impactlab.scene import Beam, BeamSegment, ElasticBody, End, Probe, Rod
from impactlab.scene.method import StepRule
from impactlab.testing.scenes import CLAMPED, FREE, STEEL
from impactlab.testing.scenes import struck as struck_body
from impactlab.types import Array
from studies.pages import ROOT

YOUNG, DENSITY, SIDE = 2.157463e11, 7960.0, 0.01  # Pa, kg/m3, m: a steel beam of 1 cm x 1 cm
AREA, INERTIA = SIDE**2, SIDE**4 / 12.0
SHEAR = 5.0 / 6.0 * AREA * YOUNG / 2.6  # N, k G A with nu = 0.3
BENDING, LINE = YOUNG * INERTIA, DENSITY * AREA  # N m2, kg/m
ROTARY = DENSITY * INERTIA  # kg m
RESISTANCE = (
    2.0 * math.sqrt(2.0) * BENDING**0.25 * LINE**0.75
)  # N s^(1/2)/m, an infinite slender beam at an inner point
TEN = StepRule(points_per_period=10.0)


def beam(length: float, left: Any, right: Any, theory: str = "euler_bernoulli") -> Beam:
    """Return the steel beam with a length [m], ends and theory."""
    segment = BeamSegment(length, AREA, YOUNG, DENSITY, inertia=INERTIA, height=SIDE)
    if theory == "timoshenko":
        segment = replace(segment, shear_stiffness=SHEAR, rotary_inertia=ROTARY)
    return Beam("beam", (segment,), End(left), End(right), theory=theory)  # type: ignore[arg-type]


def rod() -> Rod:
    """Return the rod of the 1999 paper, free left, clamped right."""
    return Rod("rod", (STEEL,), FREE, CLAMPED)


def struck(
    body: ElasticBody,
    model: Any,
    law: AbstractContactLaw,
    mass: float,
    duration: float,
    x: float,
    *,
    velocity: float = 1.0,
    step: StepRule = TEN,
    integrator: AbstractIntegrator = ExactModal(),  # noqa: B008
    snapshots: tuple[float, ...] = (),
) -> AbstractHistory:
    """Return the history of a mass that strikes a body at x [m].

    It comes from below, or from the left.
    """
    probes = (Probe(body.name, x, "displacement"),)
    given = {"velocity": velocity, "duration": duration, "probes": probes, "snapshots": snapshots}
    return simulate.run(*struck_body(body, model, law, integrator, step, mass=mass, x=x, **given))


def slender(mass: float, share: float, t: Array) -> Array:
    """Return v/v0 of a mass on an infinite slender beam.

    It is erfcx(kappa sqrt t): share 1 at inner points, 1/4 at a tip.
    """
    return np.asarray(erfcx(share * RESISTANCE / mass * np.sqrt(t)))


TERMS, AVERAGED = 2000, 14  # of Euler's sum, and the last of them that are averaged
DECAY = 23.0  # exp(-DECAY) of the values at later times is the error of the sum


def inverted(transform: Callable[[Array], Array], t: Array) -> Array:
    """Return a function of time from its Laplace transform, by Euler's sum of its Fourier series.

    Abate and Whitt, ORSA J. Comput. 7 (1995). The sum runs along a line to the right of all singularities. The contour
    of Talbot's method would have to enclose the branch points of these waves, on the imaginary axis at their cutoff
    frequencies, and needs thousands of terms for them.
    """
    k = np.arange(TERMS + AVERAGED + 1)
    terms = transform((DECAY + 2j * np.pi * k) / (2.0 * t[:, None])).real * np.where(k % 2, -1.0, 1.0)
    terms[:, 0] *= 0.5
    weights = np.array([math.comb(AVERAGED, j) for j in range(AVERAGED + 1)]) / 2.0**AVERAGED
    return np.asarray(math.exp(0.5 * DECAY) / t * (np.cumsum(terms, axis=1)[:, TERMS:] @ weights))


def sheared(mass: float, tip: bool, t: Array) -> Array:
    """Return v/v0 of a mass on an infinite Timoshenko beam.

    It is computed by inversion of its Laplace transform. With u = sum A_j exp(-l_j x) and rotation sum B_j exp(-l_j x)
    on each side: S (u'' - r') = m s^2 u gives B_j/A_j. At an inner point the rotation vanishes and each side carries
    half of the force, at a tip the bending moment vanishes.
    """

    def transform(s: Array) -> Array:
        b = SHEAR * (SHEAR + ROTARY * s * s) + LINE * s * s * BENDING - SHEAR**2
        root = np.sqrt(b * b - 4.0 * SHEAR * BENDING * LINE * s * s * (SHEAR + ROTARY * s * s))
        first, second = (np.sqrt((b + sign * root) / (2.0 * SHEAR * BENDING)) for sign in (1, -1))
        turn = [(LINE * s * s / SHEAR - each**2) / each for each in (first, second)]
        weights = [turn[0] * first, turn[1] * second] if tip else turn
        a = [weights[1], -weights[0]]  # the ratio of both waves
        carried = a[0] * first + a[1] * second + (a[0] * turn[0] + a[1] * turn[1])
        force = SHEAR * carried * (1.0 if tip else 2.0)
        return np.asarray(mass / (mass * s + force / (s * (a[0] + a[1]))))

    return inverted(transform, t)


def love(mass: float, lateral: float, t: Array) -> Array:
    """Return v/v0 of a mass on the clamped Love rod in contact.

    ``lateral`` is nu r [m].
    """

    def transform(s: Array) -> Array:
        root = np.sqrt(STEEL.wave_speed**2 + (lateral * s) ** 2)
        resistance = STEEL.density * STEEL.area * root / np.tanh(s * STEEL.length / root)
        return np.asarray(mass / (mass * s + resistance))

    return inverted(transform, t)


def love_rod(modes: int, lateral: float) -> Any:
    """Return the plugin's model of a Love rod in its modes.

    The plugin is installed or beside these docs; ``lateral`` is nu r [m].
    """
    folder = ROOT / "plugins" / "impactlab-love-rod"
    sys.path.append(str(folder))
    try:
        from impactlab_love_rod.model import LoveRod
    finally:
        sys.path.remove(str(folder))
    return LoveRod(modes=modes, poisson=0.3, radius_of_gyration=lateral / 0.3)
