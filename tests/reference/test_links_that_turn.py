"""A link clamped on a driven hub, linear about steady rotation: against series of its equations, and Part A's beam."""

from __future__ import annotations

import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import impactlab as il
from impactlab.bases.eigenvectors import Eigenvectors
from impactlab.bases.reduced import ReducedMesh
from impactlab.models.mesh.beams import BeamMesh
from impactlab.scene.bodies import Beam, BeamSegment, End, Rotation
from tests.reference.chains import Chain, document

LENGTH, WAVE_SPEED, DENSITY, AREA = 1.0, 1.0e3, 1.0e3, 1.0e-4
YOUNG = DENSITY * WAVE_SPEED**2
TERMS = 40  # of the series


def on_a_hub(rate: float, gyration: float, axial_modes: int, modes: int, elements: int = 160) -> il.Case:
    """Return a link of some radius of gyration [m] on a hub that turns [rad/s]."""
    beam = {
        "kind": "beam", "length": LENGTH, "section": {"area": AREA, "inertia": AREA * gyration**2},
        "material": {"young": YOUNG, "density": DENSITY},
    }  # fmt: skip
    links = [{"body": "beam", "joint": "clamped", "drive": {"rate": rate}, "axial_modes": axial_modes}]
    return document({"beam": beam}, links, 1e-3, 1e-5, modes=modes).with_("solve.model.elements", elements)


def frequencies(case: il.Case, rate: float) -> np.ndarray:
    """Return frequencies [rad/s] in rising order: `terms` linear about the straight beam without its steady stretch."""
    chain = Chain(case)
    n, step = chain.n, 1e-7
    still, turning = np.zeros(n), np.eye(n)[0] * rate

    def slopes(along: Any) -> np.ndarray:
        each = [(along(step * unit) - along(-step * unit)) / (2.0 * step) for unit in np.eye(n)[1:]]
        return -np.array(each).T

    mass = chain.at(still, turning)[0][1:, 1:]
    tangent = slopes(lambda moved: chain.at(moved, turning)[1][1:])
    gyroscopic = slopes(lambda moved: chain.at(still, turning + rate * moved)[1][1:]) / rate
    zero, inverse = np.zeros_like(mass), np.linalg.inv(mass)
    system = np.block([[zero, np.eye(n - 1)], [-inverse @ tangent, -inverse @ gyroscopic]])
    found = np.sort(np.linalg.eigvals(system).imag)
    return found[found > 0.0]


def by_power_series(rate: float, gyration: float, guess: float) -> float:
    """Return a frequency of a rotating cantilever in c/L, its rate and radius of gyration in c/L and L.

    Stretch U cos(wt) and chordwise deflection W sin(wt) solve
    U_xx = -(w^2 + Omega^2) U - 2 Omega w W,
    r^2 W_xxxx = (Omega^2/2) ((1 - x^2) W_x)_x + (w^2 + Omega^2) W + 2 Omega w U.
    Three series begin with x of U, x^2 and x^3 of W; strain, curvature and its slope are zero at the tip.
    """

    def fault(w: Any) -> Any:
        rows = []
        for first in range(3):
            a, b = [mp.mpf(0)] * (TERMS + 4), [mp.mpf(0)] * (TERMS + 4)
            if first == 0:
                a[1] = mp.mpf(1)
            else:
                b[first + 1] = mp.mpf(1)
            for k in range(TERMS):
                a[k + 2] = (-(w**2 + omega**2) * a[k] - 2 * omega * w * b[k]) / ((k + 1) * (k + 2))
                pulled = omega**2 / 2 * ((k + 2) * (k + 1) * b[k + 2] - k * (k + 1) * b[k])
                pulled += (w**2 + omega**2) * b[k] + 2 * omega * w * a[k]
                b[k + 4] = pulled / (r**2 * (k + 1) * (k + 2) * (k + 3) * (k + 4))
            rows.append(
                [
                    sum(k * v for k, v in enumerate(a)),
                    sum(k * (k - 1) * v for k, v in enumerate(b)),
                    sum(k * (k - 1) * (k - 2) * v for k, v in enumerate(b)),
                ]
            )
        return mp.det(mp.matrix(rows))

    with mp.workdps(40):
        omega, r = mp.mpf(rate), mp.mpf(gyration)
        return float(mp.findroot(fault, (guess * 0.9999, guess * 1.0001), solver="anderson"))


@pytest.mark.parametrize(("gamma", "published"), [(2.0, 3.6195), (4.0, 3.8880), (6.0, 4.2393)])
def test_the_first_chordwise_frequency_is_that_of_the_literature(gamma: float, published: float) -> None:
    """Over sqrt(EI/rho A L^4), slenderness 70: Hamza Cherif and Houmat 2004, Table 2, after YooShin1998."""
    gyration = LENGTH / 70.0
    unit = WAVE_SPEED / LENGTH * gyration
    exact = by_power_series(gamma * gyration, gyration, published * gyration) / gyration
    assert exact == pytest.approx(published, abs=1e-4)
    rate = gamma * unit
    assert frequencies(on_a_hub(rate, gyration, 6, 10), rate)[0] / unit == pytest.approx(exact, rel=1e-5)


def test_without_axial_motion_the_first_chordwise_frequency_is_higher() -> None:
    rate = 2.0 * WAVE_SPEED / 70.0
    assert frequencies(on_a_hub(rate, 1.0 / 70.0, 0, 10), rate)[0] / (rate / 2.0) == pytest.approx(3.6218, abs=5e-5)


def test_axial_waves_of_a_rod_free_to_bend_are_faster() -> None:
    """First axial frequency at Omega L/c = 0.1, radius of gyration 0.02 L; guided it is the slower one of Part A."""
    exact = by_power_series(0.1, 0.02, 1.58046)
    guided = math.sqrt((math.pi / 2.0) ** 2 - 0.1**2)
    assert (exact, guided) == pytest.approx((1.58046, 1.56761), abs=5e-6)
    rate, errors = 0.1 * WAVE_SPEED / LENGTH, []
    for axial_modes in (3, 6, 12):
        found = frequencies(on_a_hub(rate, 0.02, axial_modes, 16), rate) * LENGTH / WAVE_SPEED
        errors.append(float(np.min(np.abs(found / exact - 1.0))))
    assert errors[0] > 4.0 * errors[1] > 16.0 * errors[2]
    assert errors[2] < 2e-5


def of_part_a(rate: float, gyration: float, elements: int) -> np.ndarray:
    """Return frequencies [rad/s] of the same beam, turning steadily in the chord plane as a body of its own."""
    segment = BeamSegment(LENGTH, AREA, YOUNG, DENSITY, inertia=AREA * gyration**2)
    turning = Beam("beam", (segment,), End("clamped"), End("free"), rotation=Rotation(rate, 0.0, "chord"))
    mesh = BeamMesh(turning, elements, "consistent", 0.0)
    return ReducedMesh(mesh, Eigenvectors().span(mesh, 3, ()).shapes, True).frequencies


@pytest.mark.parametrize("gamma", [2.0, 6.0])
def test_a_link_of_given_length_has_the_chord_plane_of_a_rotating_beam(gamma: float) -> None:
    """With all shapes of the mesh both span the same space."""
    rate, elements = gamma * WAVE_SPEED / 70.0, 12
    found = frequencies(on_a_hub(rate, 1.0 / 70.0, 0, 2 * elements, elements), rate)[:3]
    assert found == pytest.approx(of_part_a(rate, 1.0 / 70.0, elements), rel=1e-8)


def test_the_chord_plane_is_the_limit_of_large_axial_stiffness() -> None:
    """The coupling to axial motion falls with the square of the slenderness; at 2240 it is below 1e-6."""
    differences = []
    for slenderness in (140.0, 560.0, 2240.0):
        rate = 2.0 * WAVE_SPEED / slenderness
        chord = of_part_a(rate, 1.0 / slenderness, 160)[0]
        differences.append(1.0 - frequencies(on_a_hub(rate, 1.0 / slenderness, 6, 16), rate)[0] / chord)
    assert differences[0] / differences[1] == pytest.approx(16.0, rel=0.05)
    assert abs(differences[2]) < 1e-6
