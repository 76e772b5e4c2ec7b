"""Dispersion relations of bodies that turn: their limits, their boundary value problems, and pulses on a mesh."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from impactlab import dispersion
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.integrators.central_difference import CentralDifference
from impactlab.models.finite_element import FiniteElement
from impactlab.models.messengers import wave_numbers
from impactlab.scene.bodies import BeamSegment, End, Mass, Rod, Rotation, Segment
from impactlab.scene.method import StepRule
from impactlab.scene.problem import Contact, Point, Probe
from impactlab.simulate import run
from impactlab.testing.scenes import simulation

STEEL = BeamSegment(1.0, 1e-4, 2.1e11, 7850.0, inertia=0.02 * 0.005**3 / 12.0)
SHEARED = replace(STEEL, shear_stiffness=5.0 / 6.0 * 8e10 * 1e-4, rotary_inertia=7850.0 * STEEL.inertia)
K = np.array([0.5, math.pi / 2.0, 7.0, 60.0])


def test_guided_waves_have_slow_crests_and_fast_packets() -> None:
    """First frequency 1.56761 c/L at Omega L/c = 0.1; phase speed times group speed is c^2."""
    waves = dispersion.guided_rod(1.0, 0.1)
    assert float(waves.frequency(math.pi / 2.0)) == pytest.approx(1.56761, abs=5e-6)
    assert_allclose(waves.phase_speed(K) * waves.group_speed(K), 1.0, rtol=1e-9)
    assert np.all(waves.phase_speed(K) < 1.0)
    assert math.isnan(waves.frequency(0.09))  # longer than 2 pi c/Omega: it does not travel


def test_a_rod_free_to_bend_is_faster_than_c() -> None:
    """Its determinant is zero on both branches; short waves without bending stiffness have c^2 k^2 + 3 Omega^2."""
    c, rate, gyration = 1.0, 0.1, 0.02
    for branch in ("axial", "bending"):
        k = K[1:]
        w2 = dispersion.free_rod(c, rate, gyration, branch).squared(k)
        axial, bending = w2 + rate**2 - (c * k) ** 2, w2 + rate**2 - (gyration * c * k**2) ** 2
        assert_allclose(axial * bending - 4.0 * rate**2 * w2, 0.0, atol=1e-12 * np.max(k**8 * gyration**4 + k**4))
    assert np.all(dispersion.free_rod(c, rate, gyration).phase_speed(K[1:]) > 1.0)
    short = dispersion.free_rod(c, rate).squared(np.array([200.0]))
    assert_allclose(short - 200.0**2, 3.0 * rate**2, rtol=1e-5)


@pytest.mark.parametrize("segment", [STEEL, SHEARED])
def test_beam_waves_at_rest_are_those_of_the_theory(segment: BeamSegment) -> None:
    waves = dispersion.beam(segment, 0.0, "flap", 100.0)
    assert_allclose(wave_numbers(segment, 100.0, waves.frequency(K)), K, rtol=1e-10)
    still = dispersion.beam(STEEL, 0.0, "flap")
    assert_allclose(still.group_speed(K), 2.0 * still.phase_speed(K), rtol=1e-9)


@pytest.mark.parametrize("k", [1e-3, 1e-2, 0.1])
def test_the_longest_waves_of_a_sheared_beam_are_those_of_a_slender_one(k: float) -> None:
    """Shear and rotary inertia change them by (E I/S + I/A) k^2; rounding gave a group speed 28 % off at k = 1e-3."""
    change = (SHEARED.bending_stiffness / SHEARED.shear_stiffness + SHEARED.inertia / SHEARED.area) * k**2
    slender = 2.0 * math.sqrt(SHEARED.bending_stiffness / (SHEARED.density * SHEARED.area)) * k
    assert dispersion.beam(SHEARED, 0.0, "flap").group_speed(k) == pytest.approx(slender, rel=2.0 * change + 1e-9)


@pytest.mark.parametrize("plane", ["chord", "flap"])
def test_a_sheared_beam_that_turns_satisfies_both_of_its_equations(plane: str) -> None:
    """Deflection: rho A (w^2 + Omega^2 of the chord) W = ...; rotation: rho I (w^2 + Omega^2 of the flap) R = ..."""
    rate, pull, shear, bending = 600.0, 2e4, SHEARED.shear_stiffness, SHEARED.bending_stiffness
    mass, rotary = SHEARED.density * SHEARED.area, SHEARED.rotary_inertia
    w2 = dispersion.beam(SHEARED, rate, plane, pull).squared(K)
    for k, squared in zip(K, w2, strict=True):
        moved, turned = (rate**2, 0.0) if plane == "chord" else (0.0, rate**2)
        matrix = np.array(
            [
                [(shear + pull) * k**2 - mass * (squared + moved), 1j * shear * k],
                [-1j * shear * k, bending * k**2 + shear - rotary * (squared + turned)],
            ]
        )
        assert abs(np.linalg.det(matrix)) < 1e-9 * abs(matrix[0, 0] * matrix[1, 1]) + 1e-9 * shear**2 * k**2


def test_the_planes_of_a_slender_beam_differ_by_the_rate_squared() -> None:
    chord, flap = (dispersion.beam(STEEL, 60.0, plane, 500.0) for plane in ("chord", "flap"))
    assert_allclose(flap.squared(K) - chord.squared(K), 60.0**2, rtol=1e-9)


# --- pulses on a soft rod: L = 1 m, c = 1 m/s

SOFT = Segment(1.0, 1e-3, 1e4, 1e4)
ELEMENTS = 1000


@pytest.mark.parametrize("rate", [0.3, 1.5])
def test_a_packet_on_a_guided_rod_travels_with_the_group_speed(rate: float) -> None:
    """Its centre moves with the group speed; at rest exactly with c, so that the difference is the rotation's alone."""
    k, width, begun = 60.0 * math.pi, 0.05, 0.4

    def packet(x: np.ndarray) -> np.ndarray:
        return np.exp(-(((x - begun) / width) ** 2)) * np.cos(k * (x - begun))

    rod = Rod("rod", (SOFT,), End("clamped"), End("free"), displacement=packet, rotation=Rotation(rate))
    times = (0.2, 0.4)
    made = simulation(
        "packet", {"rod": rod}, (), 0.5, CentralDifference(), StepRule(courant=1.0),
        model=FiniteElement(ELEMENTS, "lumped"), snapshots=times, round_trip=2.0,
    )  # fmt: skip
    history = run(*made)
    places = []
    for time in times:
        field = history.field("rod", time, "displacement")
        ahead = np.where(field.x > begun + 0.05, field.values, 0.0) ** 2
        places.append(float(np.sum(field.x * ahead) / np.sum(ahead)))
    speed = (places[1] - places[0]) / (times[1] - times[0])
    waves = dispersion.guided_rod(1.0, rate)
    assert speed == pytest.approx(float(waves.group_speed(k)), rel=1e-2)
    assert speed - 1.0 == pytest.approx(float(waves.group_speed(k)) - 1.0, rel=0.05)


def test_the_front_on_a_guided_rod_runs_at_c() -> None:
    rod = Rod("rod", (SOFT,), End("clamped"), End("free"), rotation=Rotation(0.3))
    radius = rod.steady.radii[1]
    hammer = Mass("hammer", 10.0, -1.0, rotation=Rotation(0.3, -radius))
    contact = Contact(Point("rod", 1.0, "rod.right"), Point("hammer", 0.0, "hammer"), 0.0)
    probe = Probe("rod", 0.5, "velocity")
    made = simulation(
        "front", {"rod": rod, "hammer": hammer}, (contact,), 0.6, CentralDifference(), StepRule(courant=1.0),
        model=FiniteElement(ELEMENTS, "lumped"), law=AdditionDeletion(), probes=(probe,), round_trip=2.0,
    )  # fmt: skip
    history = run(*made)
    before, after = history.evaluate([0.5 - 2.0 / ELEMENTS, 0.5 + 2.0 / ELEMENTS], probe.channel)
    assert before == 0.0
    assert after == pytest.approx(-1.0, rel=0.01)
