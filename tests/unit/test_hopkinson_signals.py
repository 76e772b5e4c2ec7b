"""Hopkinson signals as a laboratory has them: echoes of far ends, offsets, units; values that may be mistakes."""

from __future__ import annotations

import copy
import math
import warnings
from pathlib import Path

import numpy as np
import pytest

import impactlab as il
from impactlab import hopkinson
from impactlab.errors import ImpactlabError
from impactlab.report.figures import applications
from impactlab.report.figures.style import PALETTE, Trace

pytestmark = pytest.mark.filterwarnings("error::impactlab.errors.RunWarning")

STARTER = Path(il.__file__).parent / "casefile" / "starters" / "hopkinson.yaml"
CYLINDER = hopkinson.Specimen("8 mm", "10 mm")
SET = 0.000365868 / 8e-3  # of the summary of the run: its permanent shortening over its length
SPEED = math.sqrt(210e9 / 7850.0)
DT = 5e-7  # s, of a record at 2 MHz


@pytest.fixture(scope="module")
def history() -> il.run:
    """Return a run of the starter that lasts until waves from all far ends have passed the gauges."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", il.RunNote)
        return il.run(il.load_case(STARTER).with_settings({"solve.duration": "900 us"}))


def amplified(run, channel, t):
    """Return a channel smoothed by a Gaussian of 0.4 us, zero before the run."""
    lag = 0.4e-6 * np.linspace(-4.0, 4.0, 81)
    weight = np.exp(-0.5 * (lag / 0.4e-6) ** 2)
    times = t[:, None] + lag
    seen = run.evaluate(np.clip(times, 0.0, run.duration).ravel(), channel).reshape(times.shape)
    return np.where(times > 0.0, seen, 0.0) @ weight / weight.sum()


@pytest.fixture(scope="module")
def gauges(history):
    """Return what an amplifier gives of both gauges, with 40 us before the trigger."""
    t = DT * np.arange(1041) - 40e-6
    return tuple(amplified(history, f"strain:{bar}@0.5", t) for bar in ("incident", "transmission"))


@pytest.fixture(scope="module")
def bar(history) -> hopkinson.Bar:
    return hopkinson.bar_of(history, "incident")


def evaluated(test, waves=1):
    return hopkinson.evaluate(test, CYLINDER, waves)


@pytest.mark.parametrize("waves", [1, 2, 3])
@pytest.mark.parametrize("duration", [480e-6, 600e-6, 900e-6])
def test_the_starter_gives_back_its_specimen_however_long_it_runs(duration, waves) -> None:
    """Up to 900 us waves from all far ends pass the gauges, and the specimen is pulled open at 580 us."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", il.RunNote)
        run = il.run(il.load_case(STARTER).with_settings({"solve.duration": duration}))
    test = hopkinson.of_history(run)
    curve = evaluated(test, waves)
    t = test.time[test.time < 380e-6]
    contact = run.scene.contacts[1].name
    closed = run.evaluate([0.0], f"gap:{contact}")[0] - run.evaluate(t, f"gap:{contact}")
    force = run.evaluate(t, f"force:{contact}")
    assert curve.strain[: len(t)] == pytest.approx(closed / 8e-3, abs=1e-4)
    assert curve.stress[: len(t)] == pytest.approx(force / CYLINDER.area, abs=0.01 * 268e6)
    assert curve.strain.max() == pytest.approx(0.0495, abs=1e-4)
    assert curve.strain[-1] == pytest.approx(SET, rel=2e-3)
    assert np.abs(curve.stress).max() == pytest.approx(268.4e6, rel=5e-3)
    assert curve.stress.min() > -1e6


def test_the_starter_ends_before_the_first_echo() -> None:
    case = il.load_case(STARTER)
    first_echo = (1.0 + 1.0 + 0.5) / SPEED  # s, to the far end of the transmission bar and back to its gauge
    assert 0.98 * first_echo < case.scene().duration < first_echo


def test_the_picture_of_the_starter_follows_its_specimen(history) -> None:
    figure = applications.of_laws_with_memory(Trace("starter", history, PALETTE[0]), history.scene)[0]
    assert "far end" in figure.caption
    strain, stress = figure.draw().axes[0].lines[2].get_data()
    assert 4.9 < np.max(strain) < 5.0
    assert np.min(stress) > -1.0
    assert np.max(stress) < 270.0


def test_raw_values_of_a_run_leave_spikes_at_its_fronts(history) -> None:
    raw = evaluated(hopkinson.of_history(history, smooth=0.0), 2)
    assert raw.stress.max() > 400e6
    with pytest.raises(ImpactlabError, match=r"smooth is -1 samples\. Allowed: 0 to 100"):
        hopkinson.of_history(history, smooth=-1.0)


def test_a_far_end_nearer_than_the_specimen_is_heard_unless_it_is_named(bar) -> None:
    """A gauge 0.75 m behind the specimen and 0.4 m before the end of its bar: the echo comes after 160 us."""
    t = 1e-7 * np.arange(9000)
    bar = hopkinson.Bar("20 mm", 5000.0, 8000.0, dispersion="none")

    def pulse(start, size):
        return size * np.clip(np.minimum(t - start, start + 100e-6 - t) / 5e-6, 0.0, 1.0)

    front = pulse(150e-6, 1e-3) - pulse(450e-6, 6e-4)
    back = pulse(450e-6, 4e-4) - pulse(450e-6 + 160e-6, 4e-4)
    named = evaluated(hopkinson.measured(front, back, 1e-7, bar, (0.75, 0.75), far_ends=(0.75, 0.4)), 3)
    unnamed = evaluated(hopkinson.measured(front, back, 1e-7, bar, (0.75, 0.75)), 3)
    strain = 5000.0 * (1e-3 + 6e-4 - 4e-4) / 8e-3 * 95e-6
    assert named.strain[-1] == pytest.approx(strain, rel=1e-3)
    assert named.stress.min() > -1e-3 * named.stress.max()
    assert unnamed.stress.min() < -0.4 * named.stress.max()
    texts = hopkinson.measured(front, back, 1e-7, bar, ("75 cm", 0.75), far_ends=("750 mm", "0.4 m"))
    assert evaluated(texts, 3).strain == pytest.approx(named.strain, abs=1e-15)


def aluminium(duration, places=(0.75, 0.75)):
    """Return the run of the case with its gauges at two places [m] and a duration [s]."""
    case = il.load_case("hopkinson_aluminium")
    return il.run(case.with_settings({
        "solve.duration": duration, "probes.0.at": places[0], "probes.1.at": places[1],
    }))  # fmt: skip


def test_a_record_that_ends_inside_the_reflected_pulse_gives_a_curve_that_ends_there() -> None:
    """The gauge 0.9 m before the specimen sees it up to 180 us before the end of the record, the other up to 80 us."""
    specimen = hopkinson.Specimen("5 mm", "10 mm")
    words = (
        r"end at 0\.00038 s. At that time .*19\.\d % of the incident wave is still to come. Record 0\.000155 s longer"
    )
    with pytest.warns(il.DoubtfulResult, match=words):
        short = hopkinson.of_history(aluminium(560e-6, (0.6, 0.4)), rate=10e6)
    long = hopkinson.of_history(aluminium(800e-6, (0.6, 0.4)), rate=10e6)
    for waves in (1, 2, 3):
        cut, whole = (hopkinson.evaluate(test, specimen, waves) for test in (short, long))
        assert cut.time[-1] == pytest.approx(380e-6)
        assert cut.strain == pytest.approx(whole.strain[: len(cut.time)], abs=1e-6)
        assert cut.stress[:-5] == pytest.approx(whole.stress[: len(cut.time) - 5], rel=1e-6, abs=1.0)
        assert np.interp(395e-6, whole.time, whole.strain) == pytest.approx(0.148949, rel=1e-5)
        assert np.interp(395e-6, whole.time, whole.stress) == pytest.approx(372.33e6, rel=1e-5)


def test_a_record_that_ends_while_a_specimen_unloads_is_doubtful_and_a_longer_one_is_not() -> None:
    with pytest.warns(il.DoubtfulResult, match=r"end at 0\.00041 s. At that time the reflected wave still has 9.6"):
        hopkinson.of_history(aluminium(560e-6))
    assert hopkinson.of_history(il.run(il.load_case("hopkinson_aluminium"))).time[-1] == pytest.approx(450e-6)


def test_a_record_that_ends_before_a_wave_is_at_its_gauge_is_refused(gauges, bar) -> None:
    with pytest.raises(ImpactlabError, match=r"before the transmitted wave that reaches its gauge at 0\.000\d+ s"):
        hopkinson.measured(*gauges, DT, bar, (0.5, 2.2))
    with pytest.warns(
        il.DoubtfulResult, match=r"within the reflected pulse, .*: the wave to the left is valid up to 0\.0002"
    ):
        hopkinson.one_gauge(gauges[0][:700], DT, bar, 0.5)


@pytest.fixture(scope="module")
def mirrored() -> il.run:
    """Return a run of the aluminium case with the striker on the right."""
    data = copy.deepcopy(dict(il.load_case("hopkinson_aluminium").document.data))
    data["bodies"]["striker"]["velocity"] = "-12 m/s"
    first, second = data["contacts"]
    first["between"] = ["incident.right", "striker.left"]
    second["between"] = ["transmission.right", "incident.left"]
    data["probes"][0]["at"], data["probes"][1]["at"] = 0.9, 1.1
    data["solve"]["duration"] = "800 us"
    del data["methods"]
    return il.run(il.Case.from_dict(data, "mirrored"))


def test_a_striker_on_the_right_gives_the_curve_of_one_on_the_left(mirrored) -> None:
    specimen = hopkinson.Specimen("5 mm", "10 mm")
    tests = hopkinson.of_history(mirrored), hopkinson.of_history(aluminium(800e-6, (0.6, 0.4)))
    for waves in (1, 2, 3):
        right, left = (hopkinson.evaluate(test, specimen, waves) for test in tests)
        assert right.strain == pytest.approx(left.strain, abs=1e-9)
        assert right.stress == pytest.approx(left.stress, abs=1.0)
        assert np.interp(395e-6, right.time, right.stress) == pytest.approx(372.33e6, rel=1e-5)


def test_bars_named_in_the_wrong_order_are_refused(mirrored) -> None:
    with pytest.raises(ImpactlabError, match="it comes from 'incident'") as raised:
        hopkinson.of_history(mirrored, "transmission", "incident")
    assert "of_history(history, 'incident', 'transmission')" in str(raised.value)


def test_waves_that_are_cut_while_they_act_are_doubtful(gauges, bar) -> None:
    with pytest.warns(
        il.DoubtfulResult, match=r"the reflected wave still has 5\d\.\d % .* transmitted wave still has 8"
    ):
        test = hopkinson.measured(*gauges, DT, bar, (0.5, 0.5), far_ends=(0.5, 0.1))
    kept = evaluated(hopkinson.measured(*gauges, DT, bar, (0.5, 0.5)))
    early = test.time < 265e-6
    assert evaluated(test).strain[early] == pytest.approx(kept.strain[early], abs=2e-5)


def test_zero_takes_offsets_away(gauges, bar) -> None:
    """Offsets of 6 and -4 um/m: strains by one, two and three waves are wrong by up to 10 % unless they are removed."""
    offset = (gauges[0] + 6e-6, gauges[1] - 4e-6)
    for waves in (1, 2, 3):
        true = evaluated(hopkinson.measured(*gauges, DT, bar, (0.5, 0.5)), waves).strain[-1]
        zeroed = hopkinson.measured(*offset, DT, bar, (0.5, 0.5), zero=(0.0, 40e-6))
        assert evaluated(zeroed, waves).strain[-1] == pytest.approx(true, rel=1e-9)
        assert true == pytest.approx(SET, rel=0.01)
        with pytest.warns(il.UnusualValue, match="before the first pulse"):
            left = hopkinson.measured(*offset, DT, bar, (0.5, 0.5))
        assert abs(evaluated(left, waves).strain[-1] / true - 1.0) > 0.02


def test_an_offset_is_named_with_its_size_and_noise_is_not(gauges, bar) -> None:
    with pytest.warns(il.UnusualValue) as issued:
        hopkinson.measured(gauges[0] + 6e-6, gauges[1], DT, bar, (0.5, 0.5))
    assert len(issued) == 1
    assert "the incident gauge has a mean of 6 um/m before the first pulse, 0.62 %" in str(issued[0].message)
    rng = np.random.default_rng(3)
    noisy = [each + 5e-6 * rng.standard_normal(len(each)) for each in gauges]
    hopkinson.measured(*noisy, DT, bar, (0.5, 0.5))


@pytest.mark.parametrize(
    ("zero", "words"),
    [
        ((0.0, 300e-6), r"the incident gauge moves by 966\.\d um/m inside the interval for zero, 0 to 0\.0003 s"),
        ((1.0, 2.0), r"holds no sample of the record, 0 to 0\.00052 s"),
        ((30e-6, 20e-6), "holds no sample"),
    ],
)
def test_intervals_that_hold_no_zero_are_refused(zero, words, gauges, bar) -> None:
    with pytest.raises(ImpactlabError, match=words):
        hopkinson.measured(*gauges, DT, bar, (0.5, 0.5), zero=zero)


def test_lengths_take_units() -> None:
    bar = hopkinson.Bar("16 mm", "5172 m/s", "7.85 g/cm^3")
    assert (bar.diameter, bar.wave_speed, bar.density) == (0.016, 5172.0, 7850.0)
    assert hopkinson.Specimen("6 mm", "0.9 cm") == hopkinson.Specimen(6e-3, 9e-3)
    t = 1e-7 * np.arange(4000)
    pulse = 1e-3 * np.exp(-0.5 * ((t - 100e-6) / 12e-6) ** 2)
    assert np.array_equal(hopkinson.shift(pulse, 1e-7, "50 cm", bar), hopkinson.shift(pulse, 1e-7, 0.5, bar))
    echo = pulse - np.roll(pulse, 2000)
    numbers, texts = (hopkinson.one_gauge(echo, 1e-7, bar, each) for each in (0.5172, "517.2 mm"))
    assert np.array_equal(numbers.to_left, texts.to_left)
    second = hopkinson.shift(pulse, 1e-7, 0.2, bar)
    numbers, texts = (
        hopkinson.two_gauges(pulse, second, 1e-7, bar, places, at)
        for places, at in (((0.1, 0.3), 0.4), (("100 mm", "30 cm"), "0.4 m"))
    )
    assert np.array_equal(numbers.to_right, texts.to_right)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: hopkinson.Bar("16 kg", 5172.0, 7850.0),
            "diameter of the bar: '16 kg' has a unit of another dimension",
        ),
        (lambda: hopkinson.Bar("16", 5172.0, 7850.0), "'16' is not a number with a unit"),
        (lambda: hopkinson.Bar("-16 mm", 5172.0, 7850.0), r"diameter of the bar is -0\.016 m; it must be positive"),
        (lambda: hopkinson.Bar(None, 5172.0, 7850.0), "diameter of the bar is None; it must be a number in m"),
        (lambda: hopkinson.Specimen("6 mm", "9 s"), "diameter of the specimen: '9 s' has a unit of another dimension"),
    ],
)
def test_texts_that_are_no_lengths_are_refused(make, words) -> None:
    with pytest.raises(ImpactlabError, match=words):
        make()


def test_millimetres_and_micrometres_per_metre_without_their_unit_are_named(gauges, bar) -> None:
    with pytest.warns(il.UnusualValue, match=r"diameter of the bar is 16 m.*give 0\.016, or '16 mm'"):
        hopkinson.Bar(16.0, 5172.0, 7850.0)
    with pytest.warns(il.UnusualValue, match="specimen is") as issued:
        hopkinson.Specimen(6.0, 9.0)
    assert [str(each.message).split(",")[0] for each in issued] == [
        "the length of the specimen is 6 m", "the diameter of the specimen is 9 m",
    ]  # fmt: skip
    assert {each.filename for each in issued} == {__file__}  # the line of the user, not one of the package
    scaled = [1e6 * each for each in gauges]
    with pytest.warns(il.UnusualValue, match=r"the largest strain of a bar is 966\.\d+") as issued:
        hopkinson.measured(*scaled, DT, bar, (0.5, 0.5))
    assert len(issued) == 1
    assert issued[0].filename == __file__
    with pytest.warns(il.UnusualValue, match=r"the time between samples is 0\.5 s.*give 5e-07"):
        hopkinson.measured(*gauges, 0.5, bar, (0.5, 0.5))
    with pytest.warns(il.UnusualValue, match="the largest strain of a bar is 966"):
        hopkinson.one_gauge(scaled[0], DT, bar, 0.5)
    with pytest.warns(il.UnusualValue, match="the largest strain of a bar is 966"):
        hopkinson.two_gauges(*scaled, DT, bar, (0.5, 0.8), 1.0)
    with pytest.warns(il.UnusualValue, match="the largest strain of a bar is 966"):
        hopkinson.Test(DT, bar, scaled[0], scaled[0], scaled[1])


def test_a_specimen_wider_than_the_bar_is_named(gauges, bar) -> None:
    test = hopkinson.measured(*gauges, DT, bar, (0.5, 0.5))
    hopkinson.evaluate(test, hopkinson.Specimen("8 mm", "16 mm"))
    with pytest.warns(il.UnusualValue, match="the specimen is wider than a bar, 18 mm and 16 mm"):
        hopkinson.evaluate(test, hopkinson.Specimen("8 mm", "18 mm"))


def test_values_at_the_limits_are_usual(gauges, bar) -> None:
    hopkinson.Bar(0.5, 5000.0, 8000.0)
    hopkinson.Test(10e-6, bar, np.array([0.0, 0.02]), np.array([0.0, -0.02]), np.zeros(2))
    hopkinson.measured(*gauges, DT, bar, (0.5, 0.5))


def test_reprs_are_one_line_of_main_numbers(gauges, bar) -> None:
    test = hopkinson.measured(*gauges, DT, bar, (0.5, 0.5))
    assert repr(bar) == "<Bar of 16 mm: c0 5172.19 m/s, density 7850 kg/m3, Poisson's ratio 0.3, dispersion none>"
    assert repr(CYLINDER) == "<Specimen, length 8 mm, diameter 10 mm>"
    assert repr(test).startswith("<Test of 1041 samples, 0 to 520 µs, largest strains: incident 970.")
    curve = repr(evaluated(test))
    assert curve.startswith("<Curve of 1041 samples, 0 to 520 µs: strain ")
    assert "to 4.9" in curve
    assert " MPa" in curve
    assert repr(evaluated(test).between(2.0, 3.0)) == "<Curve without samples>"
    assert repr(hopkinson.pulses(np.array([0.0, 1.0, 1.0, 0.0]), np.float64(1e-6))[0]) == (
        "<Pulse of 1 to 2 µs: peak 1, mean 1>"
    )
    waves = hopkinson.TwoWaves(np.full(5, 1e-3), np.full(5, -2e-4))
    assert repr(waves) == "<TwoWaves of 5 samples, largest strains 1000 µm/m to the right, 200 µm/m to the left>"


PAGE = Path(__file__).parents[2] / "docs" / "hopkinson.md"


@pytest.fixture
def page_of_shot(tmp_path, monkeypatch) -> tuple[str, str, str]:
    """The two Python blocks of the page on laboratory signals, with their record: 40 us before the trigger, offsets.

    The offsets are -6 and 4 um/m, and compression is negative.
    """
    run = il.run(il.load_case("hopkinson_aluminium").with_settings({"solve.duration": "700 us"}))
    t = DT * np.arange(1321)  # the trigger is after 40 us
    columns = [1e3 * t]
    for body, offset in (("incident", -6.0), ("transmission", 4.0)):
        columns.append(offset - 1e6 * amplified(run, f"strain:{body}@0.75", t - 40e-6))
    monkeypatch.chdir(tmp_path)
    header = "time [ms],incident [µstrain],transmission [µstrain]"
    form = ["%.4f", "%.1f", "%.1f"]
    np.savetxt("shot.csv", np.transpose(columns), form, delimiter=",", header=header, comments="", encoding="utf-8")
    text = PAGE.read_text(encoding="utf-8").partition("## From laboratory signals")[2]
    shown = text.partition("```text\n")[2].partition("```")[0].splitlines()
    lines = Path("shot.csv").read_text(encoding="utf-8").splitlines()
    assert shown[0] == header
    assert all(line in lines for line in shown if line != "...")
    reading, flattening, drawing = (block.partition("```")[0] for block in text.split("```python\n")[1:4])
    return reading, flattening, drawing


def test_the_example_of_the_page_reads_a_record_in_microstrain(page_of_shot) -> None:
    """The run has a permanent strain of 15.0897 %."""
    reading, *_ = page_of_shot
    for waves in (1, 2, 3):
        names: dict[str, object] = {}
        exec(reading.replace("(test, specimen)", f"(test, specimen, {waves})"), names)
        assert names["curve"].strain[-1] == pytest.approx(0.150897, rel=2e-3)
    written = np.loadtxt("curve.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(written[:, 1], names["curve"].strain)
    plain = reading.replace("poisson=0.29", "dispersion='none'").replace("    zero=(0.0, 40e-6),", "    zero=None,")
    found = []
    for waves in (1, 2, 3):
        with pytest.warns(il.UnusualValue, match="before the first pulse"):
            exec(plain.replace("(test, specimen)", f"(test, specimen, {waves})"), names)
        found.append(names["curve"].strain[-1])
    assert found == pytest.approx([0.1476, 0.1596, 0.1536], abs=3e-4)


def test_the_band_of_the_page_is_that_of_the_products(page_of_shot) -> None:
    """The stress rho c^2 (d/ds)^2 t has 0.25, 2 x 0.2, 2 x 0.05, 2 x 0.1 and, of the gain, 0.5 % of deviation.

    That of 40 draws, of the 100 of the page, has a standard error of 11 %; the slope of the curve, 0.5 GPa, adds 0.1 %
    at a strain of 0.08.
    """
    reading, _, drawing = page_of_shot
    names: dict[str, object] = {}
    exec(reading.replace("(test, specimen)", "(test, specimen, 1)") + drawing.replace("range(100)", "range(40)"), names)
    stresses = np.array(names["stresses"])
    assert len(stresses) == 40
    assert np.isfinite(stresses).all()
    share = (stresses.std(axis=0) / stresses.mean(axis=0))[np.searchsorted(names["strain"], 0.08)]
    assert share == pytest.approx(1e-2 * math.sqrt(0.25**2 + 0.4**2 + 0.1**2 + 0.2**2 + 0.5**2), rel=0.25)
    assert Path("curve.pdf").stat().st_size > 1000


def test_a_drift_is_removed_within_the_error_of_the_page(page_of_shot) -> None:
    reading, flattening, _ = page_of_shot
    names: dict[str, object] = {}
    exec(reading, names)
    signal = names["incident"]
    names["incident"] = il.Signal(signal.channel, signal.time, signal.values + 2e-5 + 0.02 * signal.time)
    exec(flattening.replace("0.5e-3", "40e-6"), names)  # this record is at rest for 40 us
    rest = names["rest"]
    assert rest.sum() == 80
    assert np.polyfit(signal.time[rest], names["flat"][rest], 1) == pytest.approx([0.0, 0.0], abs=1e-9)
    rng, times = np.random.default_rng(0), np.linspace(0.0, 50e-6, 100)
    slopes = [np.polyfit(times, 3e-6 * rng.standard_normal(100), 1)[0] for _ in range(400)]
    # The standard deviation of 400 draws has a standard error of 3.5 %.
    assert np.std(slopes) == pytest.approx(math.sqrt(12.0 / 100) * 3e-6 / 50e-6, rel=0.14)


def test_the_stress_at_a_strain_is_that_of_the_loading() -> None:
    time = np.arange(5.0)
    curve = hopkinson.Curve(time, np.array([0.0, 0.1, 0.2, 0.15, 0.1]), np.array([0.0, 10.0, 20.0, 5.0, 0.0]), time)
    np.testing.assert_allclose(curve.stress_at([0.05, 0.15, 0.2]), [5.0, 15.0, 20.0])
    assert np.isnan(curve.stress_at(0.25))
    assert np.isnan(curve.between(9.0, 10.0).stress_at([0.1])).all()


def test_a_missing_sample_leaves_no_equal_interval() -> None:
    times = np.round(3.3e-7 * np.arange(100), 7)  # printed in tenths of a microsecond
    signal = il.Signal("strain:bar@0.5", times, 0.0 * times)
    assert signal.interval == pytest.approx(3.3e-7, rel=2e-3)
    assert signal.width == pytest.approx(3e-7)
    with pytest.raises(il.CaseError, match="not equal"):
        il.Signal("strain:bar@0.5", np.delete(times, 50), 0.0 * times[1:]).interval  # noqa: B018 - it is refused


def test_of_history_warns_where_the_gauges_are_instruments() -> None:
    """Noise, gauge length and converter of the case were left out, and the curve was that of ideal gauges."""
    bars = ("incident", "transmission")
    probes = [{"body": bar, "at": 0.75, "quantity": "strain", "noise": 2e-6, "rate": 2e6} for bar in bars]
    run = il.run(il.load_case("hopkinson_aluminium").with_("probes", probes))
    with pytest.warns(il.UnusualValue, match="true strains of the bars, and not the signals of the instruments"):
        ideal = hopkinson.of_history(run)
    signals = [run.measured(f"strain:{bar}@0.75").values for bar in bars]
    test = hopkinson.measured(*signals, 0.5e-6, hopkinson.bar_of(run, "incident"), (0.75, 0.75), far_ends=(0.75, 0.75))
    curves = [evaluated(each).between(320e-6, 390e-6) for each in (ideal, test)]
    roughness = [np.std(np.diff(curve.stress, 2)) for curve in curves]
    assert roughness[1] > 100.0 * roughness[0]
