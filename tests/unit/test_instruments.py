"""Instruments of probes: mean over the gauge, low-pass, sampling, noise, converter; true signals stay as they are."""

import csv
import math

import numpy as np
import pytest
from scipy.special import ndtr

import impactlab as il
from impactlab.errors import CaseError
from impactlab.files import write_tables
from impactlab.history.instruments import Measured, deviation, measured_file
from impactlab.report.figures.signals import MEASURED, panels
from impactlab.report.figures.style import PALETTE, Trace
from tests.solving import in_steps, mesh

FORCE, AREA, YOUNG, SPEED = 1e4, 1e-4, 2e11, 5000.0
STRAIN = FORCE / (YOUNG * AREA)
MESH = in_steps("250 us", "central_difference", mesh(100, "lumped"), courant=1.0)
EXACT = {"duration": "250 us", "model": {"kind": "continuous"}}
BAR = {"kind": "rod", "length": 1.0, "area": AREA, "material": {"young": YOUNG, "density": 8000}}


def pushed(solve, *probes):
    """A bar of 1 m, pushed at its left end from t = 0: a step of strain and velocity travels to the right."""
    bar = BAR | {"ends": {"left": {"force": FORCE}}}
    given = [{"body": "bar", "at": 0.5, "quantity": "strain"} | probe for probe in probes]
    return il.Case(bodies={"bar": bar}, contacts=[], solve=solve, probes=given)


@pytest.mark.parametrize("solve", [MESH, EXACT], ids=["mesh with c dt = h", "exact"])
def test_a_gauge_gives_the_mean_over_its_length(solve):
    length = 0.1
    history = il.run(pushed(solve, {"length": length, "rate": 500_000}))
    found = history.measured(0)
    ramp = np.clip((SPEED * found.time - (0.5 - 0.5 * length)) / length, 0.0, 1.0)
    away = found.time < 0.98 * 250e-6
    np.testing.assert_allclose(found.values[away], STRAIN * ramp[away], atol=1e-10 * STRAIN)
    assert np.sum((ramp > 0.05) & (ramp < 0.95)) >= 8  # samples while the front passes the gauge


def test_the_gauge_of_a_mesh_may_end_inside_elements():
    history = il.run(pushed(MESH, {"at": 0.5013, "length": 0.0034, "rate": 500_000}))
    t, values, _ = history.measured("strain:bar@0.5013")
    inside = [history.evaluate(t, f"displacement:bar@{x:.6g}") for x in (0.5013 - 0.0017, 0.5013 + 0.0017)]
    np.testing.assert_array_equal(values, (inside[0] - inside[1]) / (0.503 - 0.4996))
    assert values[-1] == pytest.approx(STRAIN, rel=1e-9)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_the_gain_of_the_filter_is_that_of_its_formula(ratio):
    rung = 0.5 * SPEED  # Hz, of the first mode of the free bar
    bar = BAR | {"displacement": "1e-5*cos(pi*x/L)"}
    probe = {"body": "bar", "at": 0.0, "quantity": "displacement", "bandwidth": rung * ratio, "rate": 1e5}
    solve = {"duration": 8.0 / rung, "model": {"kind": "continuous"}}
    t, values, _ = il.run(il.Case(bodies={"bar": bar}, contacts=[], solve=solve, probes=[probe])).measured(0)
    middle = np.abs(t - 4.0 / rung) < 1.0 / rung
    gain = 2.0 ** (-0.5 / ratio**2)  # 3 dB down at the bandwidth itself
    np.testing.assert_allclose(values[middle], 1e-5 * gain * np.cos(2 * np.pi * rung * t[middle]), atol=1e-9)


def test_the_step_response_of_the_filter_is_the_integral_of_its_gaussian_without_delay():
    t, values, _ = il.run(pushed(EXACT, {"bandwidth": 50e3, "rate": 2e6})).measured(0)
    expected = STRAIN * ndtr((t - 0.5 / SPEED) / deviation(50e3))
    near = np.abs(t - 0.5 / SPEED) < 30e-6
    np.testing.assert_allclose(values[near], expected[near], atol=0.01 * STRAIN)


def test_the_converter_has_equal_steps_and_an_end():
    probe = {"length": 0.1, "rate": 500_000}
    ideal = il.run(pushed(EXACT, probe)).measured(0)
    assert ideal.overloaded == 0
    fine = il.run(pushed(EXACT, probe | {"bits": 8, "range": 2 * STRAIN})).measured(0)
    step = 4 * STRAIN / 256
    np.testing.assert_allclose(fine.values / step, np.rint(fine.values / step), atol=1e-12)
    assert np.max(np.abs(fine.values - ideal.values)) <= 0.5 * step * (1 + 1e-9)
    assert fine.overloaded == 0
    short = il.run(pushed(EXACT, probe | {"bits": 4, "range": 0.5 * STRAIN})).measured(0)
    assert short.values.max() == pytest.approx(0.5 * STRAIN * 7 / 8, rel=1e-12)  # codes run from -8 to 7
    assert short.overloaded == np.count_nonzero(ideal.values > 0.5 * STRAIN * 7.5 / 8)


def test_noise_is_that_of_its_seed_and_of_its_gauge():
    quiet = {"length": 0.01, "rate": 4e6, "noise": 3e-6}
    probes = [quiet, quiet | {"at": 0.6}, quiet | {"seed": 1, "at": 0.7}, quiet | {"seed": 2, "at": 0.7}]
    solve = EXACT | {"duration": "1 ms"}
    case = pushed(solve, *probes)
    first, again = il.run(case), il.run(case)
    ideal = il.run(pushed(solve, *({**probe, "noise": 0.0} for probe in probes)))
    errors = [first.measured(n).values - ideal.measured(n).values for n in range(4)]
    for number, error in enumerate(errors):
        np.testing.assert_array_equal(first.measured(number).values, again.measured(number).values)
        assert np.std(error) == pytest.approx(3e-6, rel=0.05)
    alike = np.corrcoef(errors) - np.eye(4)
    assert np.max(np.abs(alike)) < 0.1  # of 4000 samples


@pytest.mark.parametrize("solve", [MESH, EXACT], ids=["mesh", "exact"])
def test_the_true_signals_stay_as_they_are(solve):
    instrument = {"length": 0.02, "bandwidth": 1e5, "rate": 4e5, "bits": 10, "range": 1e-3, "noise": 1e-6}
    bare, measured = il.run(pushed(solve, {})), il.run(pushed(solve, instrument))
    t = np.linspace(0.0, bare.duration, 777)
    assert set(bare.channels()) < set(measured.channels())
    for channel in bare.channels():
        np.testing.assert_array_equal(bare.evaluate(t, channel), measured.evaluate(t, channel))


def test_without_a_rate_samples_are_the_records_of_the_run(tmp_path):
    history = il.run(pushed(MESH, {"bandwidth": 1e5}, {}))
    t, _, _ = history.measured(0)
    assert t[1] == pytest.approx(history.dt, rel=1e-9)
    plain = history.measured(1)
    np.testing.assert_array_equal(plain.values, history.evaluate(plain.time, "strain:bar@0.5"))


def test_measured_signals_are_files_and_curves_beside_the_true_ones(tmp_path):
    case = pushed(EXACT, {}, {"at": 0.6, "length": 0.01, "rate": 1e6, "bits": 6, "range": 1e-3})
    history = il.run(case)
    write_tables(tmp_path, history)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["contacts.csv", measured_file(1), "probes.csv"]
    with (tmp_path / measured_file(1)).open() as file:
        heading, *rows = csv.reader(file)
    assert heading == ["time [s]", "strain:bar@0.6 [1]"]
    found = history.measured(1)
    np.testing.assert_array_equal(np.array(rows, float), np.column_stack([found.time, found.values]))
    traces = [Trace("run", history, PALETTE[0])]
    shown = [panel for panel in panels(traces, case.scene(), compared=False) if panel.group == "probe"]
    assert [[line.name for line in panel.lines] for panel in shown] == [["bar at 500 mm"], ["bar at 600 mm", MEASURED]]
    assert set(np.unique(shown[1].lines[1].values)) <= set(np.unique(found.values))


def test_two_instruments_at_one_place_have_a_panel_each():
    case = pushed(EXACT, {"bits": 2, "range": STRAIN}, {"bits": 2, "range": 0.5 * STRAIN})
    traces = [Trace("run", il.run(case), PALETTE[0])]
    shown = [panel for panel in panels(traces, case.scene(), compared=False) if panel.group == "probe"]
    ends = [panel.lines[1].values[-1] / STRAIN for panel in shown]  # codes run from -2 to 1
    assert ends == pytest.approx([0.5, 0.25], rel=1e-12)


def test_a_probe_is_named_by_channel_or_number():
    history = il.run(pushed(EXACT, {"bits": 6, "range": 1e-3}, {"bits": 7, "range": 1e-3}))
    assert isinstance(history.measured(history.scene.probes[1]), Measured)
    for asked in ("strain:bar@0.5", 2, -1, "strain:bar@0.7"):
        with pytest.raises(CaseError, match=r"0: strain:bar@0.5, 1: strain:bar@0.5"):
            history.measured(asked)


CASE = """\
schema_version: 1
bodies:
  bar: {kind: rod, length: 1 m, area: 1 cm^2, material: {young: 200 GPa, density: 8000}, velocity: 1 m/s}
  ball: {kind: mass, mass: 1 kg}
solve:
  duration: 0.2 ms
  records: 100
  model: {kind: finite_element, elements: 10, mass: lumped}
  integrator: {kind: central_difference}
  step: {courant: 0.5}
probes:
  - {body: bar, at: 0.5, quantity: velocity}
  - PROBE
"""


@pytest.mark.parametrize(
    ("keys", "key", "text"),
    [
        ("quantity: strain, length: 1.1 m", "length", "reaches from -0.05 to 1.05 m, beyond the body 'bar'"),
        ("quantity: strain, length: 0", "length", "0 m is out of range. Allowed: a number in m above 0"),
        ("quantity: strain, length: 1e-9", "length", "both of its ends are 0.5"),
        ("quantity: velocity, length: 1 mm", "length", "measures strain, not velocity"),
        ("quantity: strain, rate: 0 Hz", "rate", "0 Hz is out of range"),
        ("quantity: strain, rate: 10 kg", "rate", "unit of another dimension"),
        ("quantity: strain, bandwidth: -1 kHz", "bandwidth", "-1000 Hz is out of range"),
        ("quantity: strain, rate: 1 kHz, bandwidth: 501 Hz", "bandwidth", "Allowed: up to half the rate, 500 Hz"),
        ("quantity: strain, bits: 14", "bits", "bits is given without range"),
        ("quantity: strain, range: 1e-3", "range", "range is given without bits"),
        ("quantity: strain, bits: 0, range: 1e-3", "bits", "0 is out of range"),
        ("quantity: strain, bits: 8, range: 0", "range", "0 is out of range"),
        ("quantity: velocity, bits: 8, range: 1 kN", "range", "unit of another dimension"),
        ("quantity: strain, noise: -1e-6", "noise", "-1e-06 is out of range"),
        ("quantity: strain, noise: 1e-6, seed: -1", "seed", "-1 is out of range"),
        ("quantity: strain, seed: 3", "seed", "seed is given without noise"),
        ("quantity: strain, noise: [1]", "noise", "a number in the unit of the quantity"),
        # 0.2 ms in steps of 10 us: 20 records
        ("quantity: strain, rate: 200 kHz", "rate", "200000 Hz is above the 100000 records per second that this run"),
        ("quantity: strain, bandwidth: 60 kHz", "bandwidth", "60000 Hz is above half of the 100000 records per second"),
    ],
)
def test_bad_instruments(tmp_path, keys, key, text):
    path = tmp_path / "case.yaml"
    path.write_text(CASE.replace("PROBE", f"{{body: bar, at: 0.5, {keys}}}"))
    with pytest.raises(CaseError) as caught:
        il.run(il.load_case(path))
    assert text in str(caught.value)
    assert caught.value.path == f"probes.1.{key}"
    assert caught.value.line == 13
    assert caught.value.remedy


def test_a_file_of_a_run_keeps_its_measured_signals(tmp_path):
    history = il.run(pushed(EXACT, {"rate": 10e6, "bits": 2, "range": STRAIN, "at": 0.4}, {"rate": 100e3}, {}))
    history.to_netcdf(tmp_path / "history.nc")
    kept = il.open_netcdf(tmp_path / "history.nc")
    assert kept.channels() == history.channels()
    for number in range(2):
        one, other = history.measured(number), kept.measured(number)
        np.testing.assert_array_equal(one.time, other.time)
        np.testing.assert_array_equal(one.values, other.values)
        assert one.overloaded == other.overloaded
    assert one.overloaded == 0
    assert history.measured(0).overloaded > 1000
    assert kept.measured(2).time.size == 1921  # without an instrument: the instants of the file


def test_units_follow_the_quantity():
    probe = {"quantity": "velocity", "noise": "2 mm/s", "bits": 12, "range": "20 m/s", "rate": "1 MHz"}
    scene = pushed(EXACT, probe).scene()
    instrument = scene.probes[0].instrument
    assert (instrument.noise, instrument.range, instrument.rate) == (0.002, 20.0, 1e6)
    assert instrument.resolution == pytest.approx(40.0 / 4096, rel=1e-15)
    assert math.isclose(deviation(1e3), 0.13250 / 1e3, rel_tol=1e-4)
