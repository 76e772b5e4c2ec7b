"""Dispersion of longitudinal waves in round bars, by Pochhammer-Chree and Love theory.

It gives phase speeds, and moves signals along a bar.

The frequency equation of the first branch, with radius a, wave number k, K = k a, s = (c/c0)^2 and c0^2 = E/rho:

    2 p (q + 1) j1(P) j1(Q) - (q - 1)^2 j0(P) j1(Q) - 4 p j1(P) j0(Q) = 0
    p = s (1 + nu)(1 - 2 nu)/(1 - nu) - 1,  q = 2 s (1 + nu) - 1,  P = K^2 p,  Q = K^2 q

Here j0(x) = J0(sqrt x) and j1(x) = J1(sqrt x)/sqrt x are entire: the equation has no poles. At a given K its
zeros in s are squared frequencies of a self-adjoint problem, all real, and one at s = 0 that is no wave. On such a
function Newton's method from below the first zero rises to it and never passes it, so no other branch is ever taken.

    from impactlab.measurement import dispersion

    dispersion.phase_speed(0.29, 0.5)  # 0.92175, of c0
    bar = dispersion.Bar(diameter=0.02, wave_speed=5000.0, density=8000.0, poisson=0.29)
    at_face = dispersion.shift(signal, 1e-7, 0.75, bar)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impactlab.errors import ImpactlabError
from impactlab.measurement.inputs import (
    above_zero,
    expect,
    finite,
    in_si,
    row_of_numbers,
    warn_outside,
    warn_size,
    warn_unusual,
)
from impactlab.prefixes import prefixed
from impactlab.startup.lazy import lazy
from impactlab.types import Array
from impactlab.wrong_calls import names_parameters

Theory = Literal["pochhammer", "love", "none"]

fft, interpolate, special = lazy("scipy.fft"), lazy("scipy.interpolate"), lazy("scipy.special")

MAX_D_OVER_WAVELENGTH = 2.0
"""Diameter over wavelength up to which the branch is followed: beyond, the wave is one of the surface."""
START_SQUARED = 0.25  # (c/c0)^2 below the first branch for every Poisson's ratio: it ends at 0.30 (0.5) to 0.38 (0)
WAVE_SPEEDS = (300.0, 20_000.0)  # m/s, of lead and of diamond with room on both sides
MAX_METAL_SPEED = 6600.0  # m/s, of hard metal; ceramics and beryllium are faster, and lighter than
MIN_METAL_DENSITY = 4000.0  # kg/m3
DENSITIES = (500.0, 25_000.0)  # kg/m3, of wood and of osmium with room on both sides
NEAR_ZERO = 1e-4  # of x: up to it three terms of the series hold to rounding
MAX_NEWTON = 60  # 6 to 13 are taken
TABLE_POINTS = 257  # of wave numbers over frequency, a first guess that the equation itself corrects

__all__ = ["Bar", "band_limit", "love_speed", "phase_speed", "phase_speed_at", "shift", "wave_number"]


@names_parameters
@dataclass(frozen=True, init=False, repr=False)
class Bar:
    """A round bar that waves run along.

    Parameters
    ----------
    diameter : float or str
        d [m], or a string with its unit such as ``"16 mm"``. An `UnusualValue` is issued above 0.5 m.
    wave_speed : float or str
        c0 = sqrt(E/rho) of long waves [m/s]. An `UnusualValue` is issued outside 300 to 20000 m/s.
    density : float or str
        rho [kg/m3]. An `UnusualValue` is issued outside 500 to 25000 kg/m3.
    poisson : float
        Poisson's ratio, 0 to 0.5.
    dispersion : "pochhammer", "love" or "none"
        Theory of its waves: the first Pochhammer-Chree branch, Love's rod, or one speed for all.

    Raises
    ------
    ImpactlabError
        If a value is not above 0, or Poisson's ratio outside 0 to 0.5.
    """

    diameter: float
    wave_speed: float
    density: float
    poisson: float = 0.3
    dispersion: Theory = "pochhammer"

    def __init__(
        self,
        diameter: float | str,
        wave_speed: float | str,
        density: float | str,
        poisson: float = 0.3,
        dispersion: Theory = "pochhammer",
    ) -> None:
        given = {"diameter": (diameter, "m"), "wave_speed": (wave_speed, "m/s"), "density": (density, "kg/m3")}
        for name, (value, unit) in given.items():
            object.__setattr__(self, name, above_zero(f"{name} of the bar", value, unit))
        object.__setattr__(self, "poisson", _poisson(poisson))
        object.__setattr__(self, "dispersion", dispersion)
        warn_size("diameter of the bar", self.diameter)
        warn_outside("wave speed of the bar", self.wave_speed, "m/s", WAVE_SPEEDS, "'5 km/s'")
        warn_outside("density of the bar", self.density, "kg/m3", DENSITIES, "'7.85 g/cm^3'")
        if self.wave_speed > MAX_METAL_SPEED and self.density > MIN_METAL_DENSITY:
            warn_unusual(
                f"no bar has a wave speed of {self.wave_speed:.6g} m/s and a density of {self.density:.6g} kg/m3. "
                "The order is Bar(diameter, wave_speed, density)."
            )
        if not isinstance(dispersion, str) or dispersion not in ("pochhammer", "love", "none"):
            raise ImpactlabError(
                f"no dispersion {self.dispersion!r} of a bar", remedy="Give 'pochhammer', 'love' or 'none'."
            )

    def __repr__(self) -> str:
        return (
            f"<Bar of {prefixed(self.diameter, 'm')}: c0 {self.wave_speed:.6g} m/s, density {self.density:.6g} kg/m3, "
            f"Poisson's ratio {self.poisson:.4g}, dispersion {self.dispersion}>"
        )

    @property
    def area(self) -> float:
        """Section [m2]."""
        return 0.25 * math.pi * self.diameter**2

    @property
    def young(self) -> float:
        """Young's modulus rho c0^2 [Pa]."""
        return self.density * self.wave_speed**2

    @property
    def impedance(self) -> float:
        """Impedance rho c0 A of long waves [N s/m]."""
        return self.density * self.wave_speed * self.area


def phase_speed(poisson: float, d_over_wavelength: ArrayLike) -> Array:
    """Return c/c0 of the first Pochhammer-Chree branch over diameter by wavelength, same shape.

    Parameters
    ----------
    poisson : float
        Poisson's ratio, 0 to 0.5.
    d_over_wavelength : array_like
        0 to 2.

    Raises
    ------
    ImpactlabError
        If a value lies outside its range.

    References
    ----------
    Bancroft1941; Kolsky1963, chapter 3.
    """
    poisson, ratio = _poisson(poisson), row_of_numbers("diameter over wavelength", d_over_wavelength)
    _within(ratio, MAX_D_OVER_WAVELENGTH, "diameter over wavelength", "")
    return _first_branch(poisson, np.pi * ratio)


def love_speed(poisson: float, d_over_wavelength: ArrayLike) -> Array:
    """Return c/c0 of Love's rod over diameter by wavelength, same shape.

    It is 1/sqrt(1 + nu^2 r^2 k^2). r is the polar radius of gyration of a circle, r^2 = d^2/8.

    References
    ----------
    Love1927, section 278.
    """
    poisson, ratio = _poisson(poisson), row_of_numbers("diameter over wavelength", d_over_wavelength)
    _within(ratio, MAX_D_OVER_WAVELENGTH, "diameter over wavelength", "")
    return np.asarray(1.0 / np.sqrt(1.0 + 0.5 * (poisson * np.pi * ratio) ** 2))


def phase_speed_at(bar: Bar, frequency: ArrayLike) -> Array:
    """Return the phase speed [m/s] of a bar at frequencies [Hz], same shape.

    Raises
    ------
    ImpactlabError
        If a frequency lies beyond the branch, 0 to `band_limit`.
    """
    hertz = row_of_numbers("the frequency", frequency)
    number = wave_number(bar, hertz)
    ratio = np.divide(2.0 * np.pi * hertz, number, out=np.full_like(hertz, bar.wave_speed), where=hertz > 0.0)
    return np.asarray(ratio)


def wave_number(bar: Bar, frequency: ArrayLike) -> Array:
    """Return the wave number k [rad/m] of a bar at frequencies [Hz], same shape.

    Raises
    ------
    ImpactlabError
        If a frequency lies beyond the branch, 0 to `band_limit`.
    """
    expect_bar(bar)
    hertz = row_of_numbers("the frequency", frequency)
    _within(hertz, band_limit(bar), "the frequency", " Hz")
    scaled = np.pi * bar.diameter / bar.wave_speed * hertz  # w a/c0
    if bar.dispersion == "none":
        return np.asarray(2.0 * scaled / bar.diameter)
    if bar.dispersion == "love":  # w^2 = c0^2 k^2/(1 + nu^2 r^2 k^2), r^2 = a^2/2
        return np.asarray(2.0 * scaled / bar.diameter / np.sqrt(1.0 - 0.5 * (bar.poisson * scaled) ** 2))
    table = _table(bar.poisson)
    number = table(scaled)
    for _ in range(MAX_NEWTON):  # 3 are taken; more near the bend that the branch of a Poisson's ratio below 0.01 has
        change = table(scaled, 1) * (number * _first_branch(bar.poisson, number) - scaled)
        number = number - change
        if np.all(np.abs(change) <= 4.0 * np.finfo(float).eps * (1.0 + number)):
            break
    return np.asarray(2.0 * number / bar.diameter)


def band_limit(bar: Bar) -> float:
    """Return the frequency [Hz] at which the diameter is two wavelengths; infinite without dispersion."""
    expect_bar(bar)
    if bar.dispersion == "none":
        return math.inf
    speed = phase_speed if bar.dispersion == "pochhammer" else love_speed
    ratio = MAX_D_OVER_WAVELENGTH
    return float(ratio * speed(bar.poisson, ratio)) * bar.wave_speed / bar.diameter


def shift(
    signal: ArrayLike, dt: float, distance: float | str, bar: Bar, band: float | None = None, periodic: bool = False
) -> Array:
    """Return the signal of one travelling wave at a place further along its way.

    Each frequency f is delayed by k(f) distance/(2 pi f); a negative distance goes back to a place that the wave
    passed before. Frequencies above the band are removed. A signal within the band that is moved there and back is the
    signal to rounding, as far as it stayed in the record: outside it is taken as zero, and nothing comes in.

    Parameters
    ----------
    signal : array_like
        Shape (n,): any quantity that the wave carries.
    dt : float
        Time between samples [s].
    distance : float or str
        Along the way of the wave [m], or a string with its unit.
    bar : Bar
        ``dispersion="none"`` delays all frequencies alike, by distance/c0.
    band : float, optional
        Highest frequency kept [Hz]; the band limit of the bar if not given.
    periodic : bool
        Take the record as periodic: waves that leave it at one end enter at the other.

    Raises
    ------
    ImpactlabError
        If the band lies beyond the branch, or the signal is not finite or not one row.

    References
    ----------
    TyasPope2005; Bacon1998.
    """
    values = checked_signal("the signal", signal)
    dt, way = above_zero("dt", dt, "s"), finite("the distance", distance, "m")
    expect_bar(bar)
    count = len(values) if periodic else padded(len(values), dt, way, bar)
    frequency, kept = in_band(bar, count, dt, band)
    spectrum = np.fft.rfft(values, count)
    spectrum[~kept] = 0.0
    spectrum[kept] *= np.exp(-1j * way * wave_number(bar, frequency[kept]))
    return np.asarray(np.fft.irfft(spectrum, count)[: len(values)])


def expect_bar(given: object) -> None:
    """Raise `ImpactlabError` unless a function was given a bar."""
    expect(given, Bar, "Give hopkinson.Bar(diameter=..., wave_speed=..., density=..., poisson=...).")


def padded(count: int, dt: float, distance: float, bar: Bar) -> int:
    """Return the samples of a record with zeros behind.

    Waves of up to a third of c0 then do not enter it again.
    """
    delay = abs(distance) / bar.wave_speed / dt
    return int(fft.next_fast_len(2 * count + math.ceil(3.0 * delay), real=True))


def in_band(bar: Bar, count: int, dt: float, band: float | None) -> tuple[Array, NDArray[np.bool_]]:
    """Return the frequencies [Hz] of ``count`` samples, and which are within the band."""
    limit = band_limit(bar)
    if band is not None:
        wanted = finite("the band", band, "Hz")
        _within(np.array(wanted), limit, "the band", " Hz")
        limit = wanted
    frequency = np.asarray(np.fft.rfftfreq(count, dt))
    return frequency, frequency <= limit


def checked_signal(name: str, signal: ArrayLike) -> Array:
    """Return a signal as an array (n,), n at least 2.

    Raises
    ------
    ImpactlabError
        If it has another shape or values that are not finite.
    """
    values = row_of_numbers(name, signal)
    if values.ndim != 1 or values.size < 2:
        raise ImpactlabError(f"{name} has the shape {values.shape}", remedy="Give one row of two samples or more.")
    if not np.all(np.isfinite(values)):
        index = int(np.flatnonzero(~np.isfinite(values))[0])
        raise ImpactlabError(
            f"{name} has no finite value at sample {index}", remedy="Fill the gap or cut the record before it."
        )
    return values


def _first_branch(poisson: float, number: Array) -> Array:
    """Return c/c0 over K = k a, by Newton's method from below."""
    squared = np.full_like(number, START_SQUARED)
    for _ in range(MAX_NEWTON):
        value, slope = _frequency_equation(squared, number, poisson)
        step = -value / (slope - value / squared)  # of the equation over s, which has no zero at s = 0
        squared = squared + step
        if np.all(np.abs(step) <= 4.0 * np.finfo(float).eps):
            break
    return np.asarray(np.sqrt(squared))


def _frequency_equation(squared: Array, number: Array, poisson: float) -> tuple[Array, Array]:
    """Return the frequency equation and its derivative by s = (c/c0)^2."""
    pressure, shear = (1.0 + poisson) * (1.0 - 2.0 * poisson) / (1.0 - poisson), 2.0 * (1.0 + poisson)
    p, q = squared * pressure - 1.0, squared * shear - 1.0
    (p0, p1, p2), (q0, q1, q2) = _bessel(number**2 * p), _bessel(number**2 * q)
    dp, dq = 0.5 * pressure * number**2, 0.5 * shear * number**2  # j0' = -j1/2, j1' = -j2/2
    value = 2.0 * p * (q + 1.0) * p1 * q1 - (q - 1.0) ** 2 * p0 * q1 - 4.0 * p * p1 * q0
    slope = (
        2.0 * (pressure * (q + 1.0) + p * shear) * p1 * q1
        - 2.0 * p * (q + 1.0) * (dp * p2 * q1 + dq * p1 * q2)
        - 2.0 * (q - 1.0) * shear * p0 * q1
        + (q - 1.0) ** 2 * (dp * p1 * q1 + dq * p0 * q2)
        - 4.0 * pressure * p1 * q0
        + 4.0 * p * (dp * p2 * q0 + dq * p1 * q1)
    )
    return value, slope


def _bessel(x: Array) -> tuple[Array, Array, Array]:
    """Return Jn(sqrt x)/sqrt(x)^n for n = 0, 1, 2.

    For x < 0 it is In(sqrt -x)/sqrt(-x)^n.
    """
    far = np.abs(x) > NEAR_ZERO
    apart = np.where(far, x, 1.0)
    root, waves = np.sqrt(np.abs(apart)), apart > 0.0
    zeroth = _either(waves, root, special.j0, special.i0)
    first = _either(waves, root, special.j1, special.i1) / root
    of_zero = 1.0 - x / 4.0 + x**2 / 64.0, 0.5 - x / 16.0 + x**2 / 384.0, 0.125 - x / 96.0 + x**2 / 3072.0
    return (
        np.where(far, zeroth, of_zero[0]),
        np.where(far, first, of_zero[1]),
        np.where(far, (2.0 * first - zeroth) / apart, of_zero[2]),
    )


def _either(chosen: NDArray[np.bool_], x: Array, one: Callable[..., Array], other: Callable[..., Array]) -> Array:
    """Return one function of x where it is chosen, another one elsewhere."""
    x, found = np.asarray(x), np.empty(np.shape(x))
    found[chosen], found[~chosen] = one(x[chosen]), other(x[~chosen])
    return found


@lru_cache(maxsize=32)
def _table(poisson: float) -> Callable[..., Array]:
    """Return K = k a over w a/c0 as a spline, for a first guess."""
    number = np.linspace(0.0, np.pi * MAX_D_OVER_WAVELENGTH, TABLE_POINTS)
    table: Callable[..., Array] = interpolate.CubicSpline(number * _first_branch(poisson, number), number)
    return table


def _poisson(poisson: float) -> float:
    """Return Poisson's ratio; raise `ImpactlabError` where it is no number from 0 to 0.5."""
    found = in_si("Poisson's ratio", poisson, "1")
    if not 0.0 <= found <= 0.5:
        raise ImpactlabError(f"Poisson's ratio {found:.6g} lies outside 0 to 0.5", remedy="Steel has about 0.29.")
    return found


def _within(values: Array, limit: float, name: str, unit: str) -> None:
    outside = values[~((values >= 0.0) & (values <= limit * (1.0 + 1e-12)))]
    if outside.size:
        raise ImpactlabError(
            f"{name} {float(outside.flat[0]):.6g}{unit} lies beyond the branch, 0 to {limit:.6g}{unit}",
            remedy="The first branch is followed until the diameter is two wavelengths; filter the signal below that.",
        )
