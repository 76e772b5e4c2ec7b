"""Waves of round bars against tractions on the surface, evaluated in 30 digits."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from scipy import special

from impactlab.errors import ImpactlabError
from impactlab.measurement import dispersion
from impactlab.measurement.dispersion import Bar


def tractions(speed, ratio, poisson):
    """Determinant of the stresses on the surface of potentials J0(p r) and J1(q r), radius 1, E = rho = 1."""
    k = mp.pi * ratio
    shear = 1 / (2 * (1 + mp.mpf(poisson)))
    lame = poisson / ((1 + mp.mpf(poisson)) * (1 - 2 * mp.mpf(poisson)))
    p = mp.sqrt(mp.mpc(k**2 * (speed**2 / (lame + 2 * shear) - 1)))
    q = mp.sqrt(mp.mpc(k**2 * (speed**2 / shear - 1)))
    j0p, j1p, j0q, j1q = mp.besselj(0, p), mp.besselj(1, p), mp.besselj(0, q), mp.besselj(1, q)
    radial_p = -lame * (p**2 + k**2) * j0p - 2 * shear * p * (p * j0p - j1p)
    radial_q = -2j * k * shear * (q * j0q - j1q)
    along_p, along_q = -2j * k * p * shear * j1p, shear * (k**2 - q**2) * j1q
    return mp.re((radial_p * along_q - radial_q * along_p) / (q * shear**2))  # Q = 0 is no wave


def followed(poisson, ratios):
    """The branch from c = c0 of long waves, each root near the line through the two before."""
    found = []
    for ratio in ratios:
        guess = mp.mpf(1) if len(found) < 2 else 2 * found[-1] - found[-2]
        near = (guess - mp.mpf("0.006"), guess + mp.mpf("0.006"))
        found.append(mp.findroot(lambda c, r=ratio: tractions(c, r, poisson), near, solver="anderson"))
    return found


@pytest.mark.parametrize("poisson", [0.1, 0.29, 0.45])
def test_the_first_branch_is_that_of_surface_tractions(poisson):
    ratios = [mp.mpf(n) / 40 for n in range(1, 81)]
    with mp.workdps(30):
        expected = np.array([float(c) for c in followed(poisson, ratios)])
    found = dispersion.phase_speed(poisson, [float(ratio) for ratio in ratios])
    assert np.abs(found - expected).max() < 1e-13


def test_printed_speeds():
    found = dispersion.phase_speed(0.29, [0.1, 0.5, 1.0])
    assert found == pytest.approx([0.9978905084, 0.9217530939, 0.6892716010], abs=1e-10)
    assert dispersion.phase_speed(0.30, 0.5) == pytest.approx(0.9185369524, abs=1e-10)


@pytest.mark.parametrize("poisson", [0.0, 0.001, 0.29, 0.5])
def test_long_waves_run_at_the_bars_speed_and_short_ones_at_rayleighs(poisson):
    assert dispersion.phase_speed(poisson, 0.0) == pytest.approx(1.0, abs=1e-14)
    ratio = np.linspace(0.0, 2.0, 401)
    frequency = ratio * dispersion.phase_speed(poisson, ratio)
    assert np.all(np.diff(frequency) > 0.0)
    # Rayleigh's speed of a half-space in units of c0: (2 - x)^2 = 4 sqrt(1 - x) sqrt(1 - x/K)
    shear, ratio_squared = 1.0 / (2.0 * (1.0 + poisson)), (2.0 - 2.0 * poisson) / max(1.0 - 2.0 * poisson, 1e-12)
    x = mp.findroot(
        lambda x: (2 - x) ** 2 - 4 * mp.sqrt(1 - x) * mp.sqrt(1 - x / ratio_squared), (0.7, 0.95), "anderson"
    )
    assert dispersion.phase_speed(poisson, 2.0) == pytest.approx(float(mp.sqrt(x * shear)), rel=0.04)


@pytest.mark.parametrize("theory", ["pochhammer", "love"])
@pytest.mark.parametrize("poisson", [0.001, 0.29, 0.5])
def test_speeds_over_frequency_are_those_over_wavelength(theory, poisson):
    bar = Bar(0.02, 5000.0, 8000.0, poisson, theory)
    ratio = np.linspace(0.01, 2.0, 60)
    speed = (dispersion.phase_speed if theory == "pochhammer" else dispersion.love_speed)(poisson, ratio) * 5000.0
    assert dispersion.phase_speed_at(bar, speed * ratio / 0.02) == pytest.approx(speed, rel=1e-11)
    assert dispersion.phase_speed_at(bar, 0.0) == 5000.0


@pytest.mark.parametrize("theory", ["pochhammer", "love", "none"])
def test_there_and_back_is_the_signal_within_the_band(theory):
    bar = Bar(0.02, 5000.0, 8000.0, 0.29, theory)
    band = min(dispersion.band_limit(bar), 290e3)
    noise = dispersion.shift(np.random.default_rng(3).standard_normal(3001), 1e-6, 0.0, bar, band, periodic=True)
    there = dispersion.shift(noise, 1e-6, 0.7531, bar, band, periodic=True)
    assert np.abs(there - noise).max() > 1.0
    assert np.abs(dispersion.shift(there, 1e-6, -0.7531, bar, band, periodic=True) - noise).max() < 1e-12
    t = 1e-7 * np.arange(6000)
    pulse = np.exp(-0.5 * ((t - 120e-6) / 8e-6) ** 2)
    there = dispersion.shift(pulse, 1e-7, 0.7531, bar)
    assert there.max() == pytest.approx({"none": 1.0, "love": 0.994, "pochhammer": 0.994}[theory], abs=0.005)
    assert np.abs(dispersion.shift(there, 1e-7, -0.7531, bar) - pulse).max() < 1e-12


def test_waves_that_leave_the_record_do_not_come_in_at_its_start():
    step = np.where(np.arange(1000) > 300, 1.0, 0.0)
    for distance in (0.5, 4.0, 9.0):
        moved = dispersion.shift(step, 1e-6, distance, Bar(0.02, 5000.0, 8000.0, dispersion="none"))
        late = 300 + round(distance / 5e-3)
        assert np.abs(moved - np.where(np.arange(1000) > late, 1.0, 0.0)).max() < 1e-3


def test_a_plain_shift_by_whole_samples_is_a_delay():
    signal = np.random.default_rng(5).standard_normal(400)
    moved = dispersion.shift(signal, 1e-6, 0.25, Bar(0.02, 5000.0, 8000.0, dispersion="none"))
    assert moved == pytest.approx(np.concatenate([np.zeros(50), signal[:350]]), abs=1e-12)


def test_values_off_the_branch_are_refused():
    bar = Bar(0.02, 5000.0, 8000.0, 0.29)
    with pytest.raises(ImpactlabError, match=r"the frequency 400000 Hz lies beyond the branch, 0 to 293035 Hz"):
        dispersion.phase_speed_at(bar, [1e5, 4e5])
    with pytest.raises(ImpactlabError, match="the band 400000 Hz lies beyond the branch"):
        dispersion.shift(np.zeros(100), 1e-7, 0.1, bar, band=4e5)
    with pytest.raises(ImpactlabError, match=r"diameter over wavelength 2\.1 lies beyond the branch, 0 to 2"):
        dispersion.phase_speed(0.29, 2.1)
    for poisson in (-0.1, 0.51, float("nan")):
        with pytest.raises(ImpactlabError, match=r"Poisson's ratio \S+ lies outside 0 to 0.5"):
            dispersion.phase_speed(poisson, 0.1)
    with pytest.raises(ImpactlabError, match="diameter of the bar is -1"):
        Bar(-1.0, 5000.0, 8000.0)
    with pytest.raises(ImpactlabError, match="no finite value at sample 2"):
        dispersion.shift([0.0, 1.0, np.nan], 1e-6, 0.1, bar)


def test_bessel_functions_of_either_sign_of_their_square_are_hypergeometric():
    """Of the second order, read in slopes alone, the recurrence keeps ten digits next to zero."""
    x = np.concatenate((-np.geomspace(1e-9, 150.0, 300), [0.0], np.geomspace(1e-9, 600.0, 500)))
    for n, (found, scale) in enumerate(zip(dispersion._bessel(x), (1.0, 0.5, 0.125), strict=True)):
        expected = scale * special.hyp0f1(n + 1.0, -0.25 * x)
        assert found == pytest.approx(expected, rel=1e-11 if n < 2 else 1e-9, abs=1e-15)
