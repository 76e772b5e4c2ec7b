"""Stress, strain and rate of a specimen from the waves at its faces, by one, two and three waves, nominal and true.

    force at the front  F1 = E A (i + r)     velocity  v1 = c0 (i - r)
    force at the back   F2 = E A t           velocity  v2 = c0 t
    waves = 1           stress F2/As                   rate -2 c0 r/Ls
    waves = 2           stress F1/As                   rate 2 c0 (i - t)/Ls
    waves = 3           stress (F1 + F2)/(2 As)        rate (v1 - v2)/Ls

with the strains i of the incident, r of the reflected and t of the transmitted wave at the specimen, its section As and
length Ls. With equal forces on both faces, i + r = t, the three are one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy import float64
from numpy.typing import ArrayLike, NDArray

from impactlab.errors import ImpactlabError
from impactlab.hopkinson.separation import one_gauge, same_length
from impactlab.hopkinson.windows import THRESHOLD
from impactlab.measurement.dispersion import Bar, shift

Array = NDArray[float64]

__all__ = ["Curve", "Specimen", "Test", "equilibrium", "evaluate", "measured"]


@dataclass(frozen=True)
class Specimen:
    """A cylinder between two bars.

    Parameters
    ----------
    length : float
        Before the test [m].
    diameter : float
        Before the test [m].

    Raises
    ------
    ImpactlabError
        If one of them is not above 0.
    """

    length: float
    diameter: float

    def __post_init__(self) -> None:
        for name in ("length", "diameter"):
            value = getattr(self, name)
            if not (value > 0.0 and math.isfinite(value)):
                raise ImpactlabError(
                    f"{name} of the specimen is {value:.6g} m; it must be positive", remedy="Give it in metres."
                )

    @property
    def area(self) -> float:
        """Section [m2]."""
        return 0.25 * math.pi * self.diameter**2


@dataclass(frozen=True)
class Test:
    """The waves at the faces of a specimen between two bars alike: strains, positive in compression.

    Parameters
    ----------
    dt : float
        Time between samples [s].
    bar : Bar
    incident, reflected, transmitted : Array
        Shape (n,) each, at one time base.

    Raises
    ------
    ImpactlabError
        If they differ in length.
    """

    __test__ = False  # no class of tests for pytest

    dt: float
    bar: Bar
    incident: Array = field(repr=False)
    reflected: Array = field(repr=False)
    transmitted: Array = field(repr=False)

    def __post_init__(self) -> None:
        if not self.dt > 0.0:
            raise ImpactlabError(f"dt is {self.dt:.6g} s; it must be positive", remedy="Give it in seconds.")
        rows = same_length(incident=self.incident, reflected=self.reflected, transmitted=self.transmitted)
        for name, row in zip(("incident", "reflected", "transmitted"), rows, strict=True):
            object.__setattr__(self, name, row)

    @property
    def time(self) -> Array:
        """Times of the samples [s], shape (n,)."""
        return np.asarray(self.dt * np.arange(len(self.incident)))

    @property
    def forces(self) -> tuple[Array, Array]:
        """Forces on the front and on the back of the specimen [N], shape (n,) each."""
        stiffness = self.bar.young * self.bar.area
        return stiffness * (self.incident + self.reflected), stiffness * self.transmitted


@dataclass(frozen=True)
class Curve:
    """Stress, strain and rate of a specimen over time, positive in compression."""

    time: Array = field(repr=False)  # (n,) s
    strain: Array = field(repr=False)  # (n,)
    stress: Array = field(repr=False)  # (n,) Pa
    rate: Array = field(repr=False)  # (n,) 1/s

    @cached_property
    def true(self) -> Curve:
        """The true ones of nominal ones e, s: -ln(1 - e) and s (1 - e), at constant volume.

        Raises
        ------
        ImpactlabError
            If a nominal strain reaches 1: nothing of the specimen would be left.
        """
        if np.any(self.strain >= 1.0):
            when = float(self.time[np.argmax(self.strain >= 1.0)])
            raise ImpactlabError(
                f"the nominal strain reaches 1 at {when:.6g} s: nothing of the specimen would be left",
                remedy="Cut the curve before it, and check the length of the specimen and the signals.",
            )
        left = 1.0 - self.strain
        return Curve(self.time, -np.log(left), self.stress * left, self.rate / left)

    def between(self, start: float, end: float) -> Curve:
        """Return the part from ``start`` to ``end`` [s], both included."""
        part = (self.time >= start) & (self.time <= end)
        return Curve(self.time[part], self.strain[part], self.stress[part], self.rate[part])


def measured(
    incident_gauge: ArrayLike,
    transmission_gauge: ArrayLike,
    dt: float,
    bar: Bar,
    distances: tuple[float, float],
    threshold: float = THRESHOLD,
) -> Test:
    """Return the waves at the specimen from one gauge on each bar.

    Parameters
    ----------
    incident_gauge, transmission_gauge : array_like
        Strains, shape (n,) each, the first samples at one instant.
    dt : float
        Time between samples [s].
    bar : Bar
        Both bars; with dispersion their pulses are moved by it.
    distances : (float, float)
        From each gauge to the specimen [m].
    threshold : float
        As of `one_gauge`.

    Raises
    ------
    ImpactlabError
        If the signals differ in length, or the pulses on the incident bar overlap.

    References
    ----------
    Kolsky1949; Gray2000.
    """
    front, back = same_length(incident_gauge=incident_gauge, transmission_gauge=transmission_gauge)
    waves = one_gauge(front, dt, bar, distances[0], threshold)
    return Test(dt, bar, waves.to_right, waves.to_left, shift(back, dt, -distances[1], bar))


def evaluate(test: Test, specimen: Specimen, waves: Literal[1, 2, 3] = 3) -> Curve:
    """Return the nominal stress, strain and rate of a specimen; ``.true`` gives the true ones.

    Parameters
    ----------
    test : Test
    specimen : Specimen
    waves : 1, 2 or 3
        1: stress from the transmitted wave, rate from the reflected one. 2: stress from incident and reflected, rate
        from incident and transmitted. 3: the mean of both forces, the difference of both velocities.

    Raises
    ------
    ImpactlabError
        If ``waves`` is none of them.

    References
    ----------
    Gray2000.
    """
    if waves not in (1, 2, 3):
        raise ImpactlabError(f"no evaluation by {waves!r} waves", remedy="Give 1, 2 or 3.")
    front, back = test.forces
    incident, reflected, transmitted = test.incident, test.reflected, test.transmitted
    speed = test.bar.wave_speed / specimen.length
    if waves == 1:
        force, rate = back, -2.0 * speed * reflected
    elif waves == 2:
        force, rate = front, 2.0 * speed * (incident - transmitted)
    else:
        force, rate = 0.5 * (front + back), speed * (incident - reflected - transmitted)
    strain = np.concatenate([[0.0], np.cumsum(0.5 * test.dt * (rate[1:] + rate[:-1]))])
    return Curve(test.time, strain, force / specimen.area, rate)


def equilibrium(test: Test, floor: float = THRESHOLD) -> Array:
    """Return the equilibrium ratio 2 (F1 - F2)/(F1 + F2) of the forces on both faces, shape (n,).

    0 is equilibrium, 2 a specimen that passes nothing on; NaN where the mean force is below ``floor`` of its largest.
    """
    front, back = test.forces
    mean = 0.5 * (front + back)
    loaded = np.abs(mean) > floor * np.abs(mean).max()
    return np.divide(front - back, mean, out=np.full_like(mean, np.nan), where=loaded)
