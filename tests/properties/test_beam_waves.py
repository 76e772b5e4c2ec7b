"""A packet of bending waves, simulated, travels as the dispersion relation says."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from impactlab import simulate
from impactlab.bases.beams.modes import BeamModes
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import Beam, BeamSegment, End, Probe
from impactlab.scene.method import StepRule
from impactlab.testing.scenes import simulation
from tests.properties import dispersion
from tests.reference.beam_scenes import STEEL, sheared

RADIUS = math.sqrt(STEEL.inertia / STEEL.area)  # of gyration
PINNED = End("pinned")
# In wave lengths: the beam, where the packet starts, its width, three places that it passes.
LENGTH, START, WIDTH, PLACES = 32.0, 14.0, 1.5, (18.0, 18.0 + 1.0 / 3.0, 22.0)

MODELS = {
    "finite_element": (FiniteElement(int(40 * LENGTH)), Newmark()),
    "modal": (Modal(None, int(4 * LENGTH)), ExactModal()),
}


def signals(segment: BeamSegment, theory: str, model: str, wave_number: float, tension: float):
    """Times of a packet's passage and the deflections at three places, shape (3, n)."""
    wave = 2.0 * math.pi / wave_number
    beam = Beam(
        "beam", (replace(segment, length=LENGTH * wave),), PINNED, PINNED,
        theory=theory, tension=tension,
        displacement=lambda x: 1e-6 * np.exp(-(((x - START * wave) / (WIDTH * wave)) ** 2))
        * np.cos(wave_number * (x - START * wave)),
    )  # fmt: skip
    # Until the middle has passed the last place by five widths; the other half of the packet, mirrored at the left end,
    # is 28 wave lengths behind.
    speed = float(dispersion.group_speed(segment, np.array(wave_number), tension=tension))
    duration = (PLACES[-1] - START + 5.0 * WIDTH) * wave / speed
    period = 2.0 * math.pi / float(dispersion.frequency(segment, np.array(wave_number), tension=tension))
    steps = math.ceil(80.0 * duration / period)
    probes = tuple(Probe("beam", place * wave, "displacement") for place in PLACES)
    scene = simulation(
        "packet", {"beam": beam}, (), duration, MODELS[model][1], StepRule(dt=duration / steps),
        round_trip=beam.round_trip, probes=probes, model=MODELS[model][0],
    )  # fmt: skip
    history = simulate.run(*scene)
    times = np.linspace(0.0, duration, steps + 1)
    return times, np.array([history.evaluate(times, probe.channel) for probe in probes])


def speeds(segment: BeamSegment, theory: str, model: str, wave_number: float, tension: float = 0.0):
    """Phase and group speed at the packet's frequency, from Fourier's phases at the three places."""
    times, passed = signals(segment, theory, model, wave_number, tension)
    wave = 2.0 * math.pi / wave_number
    middle = float(dispersion.frequency(segment, np.array(wave_number), tension=tension))
    frequencies = middle * np.linspace(0.98, 1.02, 5)
    turned = np.exp(1j * np.outer(frequencies, times)) @ passed.T
    # A third of a wave length apart there is no doubt about whole turns.
    lag = np.angle(turned[2, 1] / turned[2, 0])
    phase = middle * (PLACES[1] - PLACES[0]) * wave / lag
    travelled = np.unwrap(np.angle(turned[:, 2] / turned[:, 0]))
    group = (PLACES[2] - PLACES[0]) * wave * (frequencies[3] - frequencies[1]) / (travelled[3] - travelled[1])
    return phase, group


PACKETS = given(
    theory=st.sampled_from(["euler_bernoulli", "timoshenko"]),
    model=st.sampled_from(sorted(MODELS)),
    slenderness=st.floats(0.02, 1.0),
)


@settings(max_examples=8, deadline=None)
@PACKETS
def test_a_packet_has_the_phase_and_group_speed_of_its_wave_number(theory, model, slenderness):
    check_speeds(theory, model, slenderness)


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@PACKETS
def test_many_packets_have_the_speeds_of_their_wave_numbers(theory, model, slenderness):
    check_speeds(theory, model, slenderness)


def check_speeds(theory, model, slenderness):
    segment = STEEL if theory == "euler_bernoulli" else sheared(STEEL)
    wave_number = slenderness / RADIUS
    phase, group = speeds(segment, theory, model, wave_number)
    one = np.array(wave_number)
    assert phase == pytest.approx(float(dispersion.phase_speed(segment, one)), rel=0.01)
    assert group == pytest.approx(float(dispersion.group_speed(segment, one)), rel=0.01)


@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
def test_tension_hastens_a_packet(theory):
    tension = 2e6
    segment = STEEL if theory == "euler_bernoulli" else sheared(STEEL)
    wave_number = np.array(0.2 / RADIUS)
    phase, group = speeds(segment, theory, "finite_element", float(wave_number), tension)
    assert phase == pytest.approx(float(dispersion.phase_speed(segment, wave_number, tension=tension)), rel=0.01)
    assert group == pytest.approx(float(dispersion.group_speed(segment, wave_number, tension=tension)), rel=0.01)
    # It matters: T/(EI k^2) is 0.28 there.
    assert float(dispersion.phase_speed(segment, wave_number)) < 0.95 * phase


@pytest.mark.parametrize("segment", [STEEL, sheared(STEEL)])
@pytest.mark.parametrize("branch", ["bending", "shear"])
def test_group_speed_is_the_slope_of_the_frequency(segment, branch):
    if branch == "shear" and segment.rotary_inertia == 0.0:
        assert np.all(np.isinf(dispersion.frequency(segment, np.array([1.0, 10.0]), branch)))
        return
    wave_number, step = np.geomspace(0.01, 10.0, 30) / RADIUS, 1e-5
    ahead, behind = (dispersion.frequency(segment, wave_number * (1.0 + sign * step), branch) for sign in (1.0, -1.0))
    slope = (ahead - behind) / (2.0 * step * wave_number)
    # The third derivative of a power law, step^2; rounding, eps over the step.
    assert dispersion.group_speed(segment, wave_number, branch) == pytest.approx(
        slope, rel=1e-6, abs=1e-6 * slope.max()
    )


def test_limits_of_the_dispersion_relation():
    segment = sheared(STEEL)
    long, short = np.array([1e-3 / RADIUS]), np.array([1e3 / RADIUS])
    bending = math.sqrt(segment.bending_stiffness / (segment.density * segment.area))
    # Long waves are those of Euler and Bernoulli, except for a share (1 + E/kG)(k r)^2/2.
    assert dispersion.frequency(segment, long) == pytest.approx(bending * long**2, rel=5e-6)
    assert dispersion.frequency(segment, long, "shear") == pytest.approx(dispersion.cut_off(segment), rel=1e-5)
    # Short ones run with the shear front and with the speed of bars.
    assert dispersion.phase_speed(segment, short) == pytest.approx(segment.shear_speed, rel=1e-5)
    assert dispersion.phase_speed(segment, short, "shear") == pytest.approx(segment.wave_speed, rel=1e-5)


def test_frequencies_of_a_pinned_beam_are_those_of_its_wave_numbers():
    segment = sheared(replace(STEEL, length=5.0 * math.sqrt(STEEL.area)))
    modes = BeamModes(Beam("beam", (segment,), PINNED, PINNED), 20)
    numbers = np.pi * np.arange(1, 21) / segment.length
    known = [dispersion.frequency(segment, numbers, branch) for branch in ("bending", "shear")]
    both = np.sort(np.concatenate((*known, [dispersion.cut_off(segment)])))[:20]
    assert modes.frequencies == pytest.approx(both, rel=1e-12)
    assert all(low < high for low, high in pairwise(modes.frequencies))
