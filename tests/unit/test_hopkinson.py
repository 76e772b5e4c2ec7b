"""Hopkinson bars: signals whose waves are known come back, and the curve that was put in comes out."""

from __future__ import annotations

import math

import numpy as np
import pytest

import impactlab as il
from impactlab import hopkinson
from impactlab.errors import ImpactlabError, UnusualValue
from impactlab.hopkinson import Bar, Specimen, Test
from tests.solving import run_case

# records of 560 us end while the specimen unloads, which these tests do not read
pytestmark = pytest.mark.filterwarnings("ignore:the record ends:impactlab.errors.DoubtfulResult")

C, RHO, D = 5000.0, 8000.0, 0.02
PLAIN = Bar(D, C, RHO, dispersion="none")
STEEL = {"young": RHO * C**2, "density": RHO}
CYLINDER = Specimen(0.005, 0.01)
YOUNG, YIELD, TANGENT = 70e9, 300e6, 500e6
INCIDENT = 0.5 * PLAIN.impedance * 12.0  # N
DT = 1e-7


def bump(t, middle, width=12e-6):
    return np.exp(-0.5 * ((t - middle) / width) ** 2)


def bars(law, duration=560e-6, rods=("incident", "transmission"), model=None, dt=DT, extra=(), first=None):
    """Striker and bars of 20 mm, gauges in the middle, as a delay line unless a model is given."""
    middle = [il.Contact("incident.right", f"{rods[1]}.left", law)]
    bodies = {"incident": il.Rod(length=1.5, diameter=D, material=STEEL)}
    if "specimen" in rods:
        bodies["specimen"] = il.Rod(length=0.005, diameter=0.01, material={"young": 2700 * C**2, "density": 2700})
        middle.append(il.Contact("specimen.right", "transmission.left", law))
    bodies["transmission"] = il.Rod(length=1.5, diameter=D, material=STEEL)
    case = il.Case(
        bodies={"striker": il.Rod(length=0.25, diameter=D, material=STEEL, velocity=12.0), **bodies},
        contacts=[
            il.Contact("striker.right", "incident.left", first or {"kind": "penalty", "stiffness": 1e11}),
            *middle,
        ],
        solve={"duration": duration, "step": {"dt": dt}, **(model or {"model": {"kind": "continuous"}})},
        probes=[{"body": name, "at": 0.75, "quantity": "strain"} for name in ("incident", "transmission")],
    )
    return il.run(case)


def specimen_force(t):
    """Return the force t after the front [N] of a massless specimen that yields, by Z d' = 2 (Fi - F)."""
    elastic, plastic = (
        2.0 * modulus * CYLINDER.area / CYLINDER.length / PLAIN.impedance for modulus in (YOUNG, TANGENT)
    )
    first = YIELD * CYLINDER.area
    yields = -math.log(1.0 - first / INCIDENT) / elastic
    early = INCIDENT * (1.0 - np.exp(-elastic * t))
    late = INCIDENT - (INCIDENT - first) * np.exp(-plastic * (t - yields))
    return np.where(t < 0.0, 0.0, np.where(t < yields, early, late))


def ideal_gauges():
    """Strains in the middle of both bars at 10 MHz while the specimen is loaded, in closed form."""
    t = DT * np.arange(5500)
    stiffness = PLAIN.young * PLAIN.area
    pulse = np.where((t > 150e-6 - 0.5 * DT) & (t < 250e-6 - 0.5 * DT), INCIDENT, 0.0)
    after = np.where(t < 550e-6 - 0.5 * DT, specimen_force(t - 450e-6 + 1e-12), 0.0)
    echo = np.where((t > 450e-6 - 0.5 * DT) & (t < 550e-6 - 0.5 * DT), after - INCIDENT, 0.0)
    return (pulse + echo) / stiffness, after / stiffness


def law_missed(curve, start):
    """Largest distance from the line of the tangent modulus between 10 and 95 us after loading, over 350 MPa."""
    part = curve.between(start + 10e-6, start + 95e-6)
    return np.abs(part.stress - YIELD - TANGENT * (part.strain - YIELD / YOUNG)).max() / 350e6


def test_the_bars_of_the_page():
    assert pytest.approx(75_398.22, abs=0.01) == INCIDENT
    assert PLAIN.young * PLAIN.area * 1.2e-3 == pytest.approx(INCIDENT)


def test_pulses_are_found_and_cut():
    t = 1e-6 * np.arange(800)
    signal = np.where((t > 99.5e-6) & (t < 149.5e-6), 2.0, 0.0) - np.where((t > 399.5e-6) & (t < 429.5e-6), 1.0, 0.0)
    signal[420:422] = 0.0
    apart = hopkinson.pulses(signal, 1e-6)
    assert [(round(1e6 * p.start), round(1e6 * p.end), p.peak) for p in apart] == [
        (100, 149, 2.0), (400, 419, -1.0), (422, 429, -1.0),
    ]  # fmt: skip
    joined = hopkinson.pulses(signal, 1e-6, quiet=5e-6)
    assert len(joined) == 2
    assert joined[1].mean == pytest.approx(-28.0 / 30.0)
    assert hopkinson.cut(signal, 1e-6, 100e-6, 150e-6).sum() == 100.0


@pytest.mark.parametrize("theory", ["none", "love", "pochhammer"])
def test_one_gauge_gives_both_waves_at_the_end(theory):
    bar = Bar(D, C, RHO, 0.29, theory)
    t = DT * np.arange(9000)
    incident, reflected = 1e-3 * bump(t, 380e-6), -0.7e-3 * bump(t, 390e-6)
    gauge = hopkinson.shift(incident, DT, -0.75, bar) + hopkinson.shift(reflected, DT, 0.75, bar)
    waves = hopkinson.one_gauge(gauge, DT, bar, 0.75)
    within = 1e-13 if theory == "none" else 2e-6  # the tail of a pulse that disperses reaches into the next one
    assert np.abs(waves.to_right - incident).max() < within
    assert np.abs(waves.to_left - reflected).max() < within


@pytest.mark.parametrize("theory", ["none", "love", "pochhammer"])
@pytest.mark.parametrize("swapped", [False, True])
def test_two_gauges_take_long_waves_apart(theory, swapped):
    """Pulses that overlap at both gauges for most of the record, in a bar with and without dispersion."""
    bar = Bar(D, C, RHO, 0.29, theory)
    t = 5e-7 * np.arange(3000)
    right = 1e-3 * (bump(t, 300e-6, 60e-6) + 0.4 * bump(t, 700e-6, 15e-6))  # at x = 0
    left = 1e-3 * (-0.6 * bump(t, 500e-6, 80e-6) + 0.3 * bump(t, 900e-6, 10e-6))  # at x = 1.5
    gauges = [hopkinson.shift(right, 5e-7, x, bar) + hopkinson.shift(left, 5e-7, 1.5 - x, bar) for x in (0.5, 0.813)]
    places = (0.5, 0.813)
    if swapped:
        gauges, places = gauges[::-1], places[::-1]
    found = hopkinson.two_gauges(*gauges, 5e-7, bar, places, at=1.5)
    within = 1e-9 if theory == "none" else 1e-7
    assert np.abs(found.to_left - left).max() < within
    assert np.abs(found.to_right - hopkinson.shift(right, 5e-7, 1.5, bar)).max() < within


def test_force_and_velocity_give_both_waves_back():
    rng = np.random.default_rng(1)
    waves = hopkinson.TwoWaves(rng.standard_normal(50), rng.standard_normal(50))
    found = hopkinson.force_and_velocity(waves.force(PLAIN), waves.velocity(PLAIN), PLAIN)
    assert found.to_right == pytest.approx(waves.to_right)
    assert found.to_left == pytest.approx(waves.to_left)
    alone = hopkinson.TwoWaves(waves.to_right, np.zeros(50))
    assert alone.force(PLAIN) == pytest.approx(PLAIN.impedance * alone.velocity(PLAIN))


@pytest.mark.parametrize("waves", [1, 2, 3])
def test_ideal_gauges_give_back_the_curve_that_was_put_in(waves):
    test = hopkinson.measured(*ideal_gauges(), DT, PLAIN, (0.75, 0.75))
    curve = hopkinson.evaluate(test, CYLINDER, waves)
    assert law_missed(curve, 300e-6) < 5e-4
    at = np.searchsorted(curve.time, [350e-6 - 1e-9, 400e-6 - 2 * DT])
    assert curve.stress[at[0]] * CYLINDER.area == pytest.approx(26_572.0435, rel=1e-6)
    assert curve.strain[at[1]] * CYLINDER.length == pytest.approx(0.781339604e-3, rel=2e-3)


@pytest.mark.parametrize(("waves", "factor"), [(1, 1.0), (2, np.sqrt(2.0)), (3, 0.5 * np.sqrt(3.0))])
def test_gauges_as_they_are_glued_give_back_the_curve_within_their_noise(waves, factor):
    """Gauges of 3 mm at 2 MHz, 14 bits over 2000 microstrain of each sign, noise of 2 microstrain.

    The stress is E A/As times t, i + r or (i + r + t)/2, each with the noise of a gauge: 1.60 MPa times the factor, or
    0.46, 0.65 and 0.40 % of 350 MPa. The rms of 170 samples scatters by 5 %.
    """
    mean = np.array([0.5, 1.0, 1.0, 1.0, 1.0, 1.0, 0.5]) / 6.0  # 3 mm pass in 0.6 us
    bit = 4000e-6 / 2**14
    for seed in range(5):
        rng = np.random.default_rng(seed)
        gauges = []
        for strain in ideal_gauges():
            seen = np.convolve(strain, mean, "same")[::5]
            gauges.append(np.round((seen + 2e-6 * rng.standard_normal(len(seen))) / bit) * bit)
        curve = hopkinson.evaluate(hopkinson.measured(*gauges, 5 * DT, PLAIN, (0.75, 0.75)), CYLINDER, waves)
        part = curve.between(310e-6, 395e-6)
        missed = part.stress - YIELD - TANGENT * (part.strain - YIELD / YOUNG)
        noise = PLAIN.young * PLAIN.area / CYLINDER.area * np.hypot(2e-6, bit / np.sqrt(12.0))
        assert np.sqrt(np.mean(missed**2)) < 1.2 * factor * noise


def test_a_run_gives_back_its_law_and_three_evaluations_agree():
    law = {
        "kind": "specimen", "length": 0.005, "area": CYLINDER.area, "young": YOUNG,
        "flow": {"yield_stress": YIELD, "hardening": TANGENT},
    }  # fmt: skip
    test = hopkinson.of_history(bars(law), rate=10e6)
    one, two, three = (hopkinson.evaluate(test, CYLINDER, waves) for waves in (1, 2, 3))
    for curve in (one, two, three):
        assert law_missed(curve, 300e-6) < 5e-4
        assert curve.stress == pytest.approx(three.stress, abs=1e-9 * YIELD)
        assert curve.strain == pytest.approx(three.strain, abs=1e-11)
    assert np.nanmax(np.abs(hopkinson.equilibrium(test)[3000:4000])) < 1e-8


def test_a_flow_stress_that_rises_with_the_rate_is_read_with_its_rate():
    """Johnson and Cook without hardening: the force settles at A (1 + C ln e') with Z L e' = 2 (Fi - F)."""
    flow = {"kind": "johnson_cook", "A": 300e6, "C": 0.02, "reference_rate": 1.0}
    law = {"kind": "specimen", "length": 0.005, "area": CYLINDER.area, "young": 120e9, "flow": flow}
    curve = hopkinson.evaluate(hopkinson.of_history(bars(law)), CYLINDER).between(340e-6, 395e-6)
    assert curve.stress == pytest.approx(344.0369e6, rel=1e-6)
    assert curve.rate == pytest.approx(1539.91, rel=1e-5)


def test_a_rod_between_the_bars_rings_up_to_rounding():
    """After its nth step the transmitted wave is 1 - r^(2n) of the incident one: mesh with c dt = h."""
    elements = {"incident": 300, "transmission": 300, "specimen": 1, "striker": 50}
    mesh = {
        "models": {name: {"kind": "finite_element", "elements": n, "mass": "lumped"} for name, n in elements.items()},
        "integrator": {"kind": "central_difference"},
    }
    rods = ("incident", "specimen", "transmission")
    history = bars({"kind": "bonded"}, 401e-6, rods, mesh, 1e-6, first={"kind": "addition_deletion"})
    specimen = 2700.0 * C * CYLINDER.area
    r = (PLAIN.impedance - specimen) / (PLAIN.impedance + specimen)
    steps = np.arange(1, 50)
    passed = 1.0 - r ** (2 * steps)
    assert passed[[0, 1, 4]] == pytest.approx([0.287021734, 0.491661993, 0.815761048], abs=1e-9)
    _, transmitted = hopkinson.sampled(history, "force:specimen.right|transmission.left", 1e6)
    assert transmitted[300 + 2 * steps] == pytest.approx(INCIDENT * passed, rel=1e-11)


def test_a_rod_has_other_forces_in_front_than_behind():
    """1, 2 and 3 waves differ; the mean of both forces over the change of length is Young's modulus."""
    rods = ("incident", "specimen", "transmission")
    stiff = {"kind": "penalty", "stiffness": 1e12}
    test = hopkinson.of_history(bars({"kind": "bonded"}, rods=rods, dt=1e-6, first=stiff), rate=1e6, smooth=0.0)
    one, two, three = (hopkinson.evaluate(test, CYLINDER, waves).between(309e-6, 390e-6) for waves in (1, 2, 3))
    assert three.stress / three.strain == pytest.approx(67.5e9, rel=1e-6)
    assert np.abs(one.stress / one.strain / 67.5e9 - 1.0).max() > 5e-3
    assert np.abs(two.stress - one.stress).max() > 1e6
    ratio = hopkinson.equilibrium(test)
    assert ratio[301] > 0.05
    assert abs(ratio[340]) < 1e-3


def test_true_values_keep_the_volume():
    test = Test(1e-6, PLAIN, np.full(100, 1e-3), np.full(100, -6e-4), np.full(100, 4e-4))
    curve = hopkinson.evaluate(test, CYLINDER)
    true = curve.true
    assert true.strain == pytest.approx(-np.log1p(-curve.strain))
    assert true.stress * CYLINDER.area / (1.0 - curve.strain) == pytest.approx(test.forces[1])
    assert np.gradient(true.strain, 1e-6)[1:-1] == pytest.approx(true.rate[1:-1], rel=1e-3)
    pulled = hopkinson.evaluate(Test(1e-6, PLAIN, -test.incident, -test.reflected, -test.transmitted), CYLINDER)
    assert pulled.stress == pytest.approx(-curve.stress)
    with pytest.warns(UnusualValue, match="a specimen that is pulled"):
        assert np.all(np.abs(pulled.true.stress[1:]) > np.abs(pulled.stress[1:]))
    with pytest.raises(ImpactlabError, match="nominal strain reaches 1"):
        _ = hopkinson.evaluate(test, Specimen(2e-4, 0.01)).true


def test_bad_input_is_refused_in_words():
    quiet, t = np.zeros(5000), DT * np.arange(5000)
    with pytest.raises(ImpactlabError, match="different lengths: incident gauge 5000, transmission gauge 4000 samples"):
        hopkinson.measured(quiet, quiet[:4000], DT, PLAIN, (0.75, 0.75))
    # Signals of two recorders must not be cut: one of them would be stretched.
    with pytest.raises(ImpactlabError, match=r"Sampled at different intervals, interpolate them to common instants"):
        hopkinson.measured(quiet, quiet[:4000], DT, PLAIN, (0.75, 0.75))
    with pytest.raises(ImpactlabError, match=r"both gauges are at 0\.5 m"):
        hopkinson.two_gauges(quiet, quiet, DT, PLAIN, (0.5, 0.5), 1.0)
    long = np.where((t > 50e-6) & (t < 400e-6), 1e-3, 0.0)
    with pytest.raises(ImpactlabError, match=r"the pulses overlap from 0\.0002501 s on"):
        hopkinson.one_gauge(long, DT, PLAIN, 0.5)
    with pytest.raises(ImpactlabError, match="before the reflection that begins"):
        hopkinson.one_gauge(long, DT, PLAIN, 2.5)
    with pytest.raises(ImpactlabError, match="zero throughout"):
        hopkinson.one_gauge(quiet, DT, PLAIN, 0.5)
    with pytest.raises(ImpactlabError, match="no evaluation by 4 waves"):
        hopkinson.evaluate(Test(DT, PLAIN, quiet, quiet, quiet), CYLINDER, 4)
    with pytest.raises(ImpactlabError, match="length of the specimen is 0 m"):
        Specimen(0.0, 0.01)
    with pytest.raises(ImpactlabError, match=r"Poisson's ratio 0\.6 lies outside 0 to 0\.5"):
        Bar(D, C, RHO, 0.6)
    for dt in (0.0, -DT):
        for refused in (
            lambda dt=dt: hopkinson.measured(long, long, dt, PLAIN, (0.75, 0.75)),
            lambda dt=dt: hopkinson.one_gauge(long, dt, PLAIN, 0.75),
            lambda dt=dt: hopkinson.two_gauges(long, long, dt, PLAIN, (0.25, 0.5), 1.0),
            lambda dt=dt: hopkinson.pulses(long, dt),
            lambda dt=dt: hopkinson.cut(long, dt, 0.0, 1.0),
        ):
            with pytest.raises(ImpactlabError, match="it must be positive"):
                refused()
    history = run_case(
        bodies={"ball": il.Mass(0.1, velocity=1.0), "rod": il.Rod(length=1.0, diameter=D, material=STEEL)},
        contacts=[il.Contact("ball", "rod.left", {"kind": "penalty", "stiffness": 1e8})],
        solve={"duration": 1e-4, "model": {"kind": "continuous"}, "step": {"dt": 1e-6}}
    )  # fmt: skip
    with pytest.raises(ImpactlabError, match="'ball' is not a rod with one segment"):
        hopkinson.of_history(history, "ball", "rod")
    with pytest.raises(ImpactlabError, match="'rod' has 0 strain probes"):
        hopkinson.of_history(history, "rod", "rod")
