"""Fits of measured signals: instruments, several experiments, bandwidth, tables, and data that are refused."""

from __future__ import annotations

import itertools
import json
import re
from dataclasses import replace

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import CaseError
from impactlab.fits.correlation import correlations
from impactlab.fits.filters import LowPass
from impactlab.fits.model import Means
from impactlab.fits.unknowns import Unknown, settings
from tests.support import invoke

pytestmark = pytest.mark.usefixtures("_no_figures")

FORCE, SPEED = "force:hammer|rod.left", "velocity:hammer"
MASS, STIFFNESS, LENGTH = "bodies.hammer.mass", "contacts.0.law.stiffness", "bodies.rod.length"
BOUNDS = {STIFFNESS: (5e7, 8e8)}
SAMPLES = 200


@pytest.fixture(scope="module")
def case() -> il.Case:
    hard = il.load_case("axial_impact").method("continuous")
    return hard.with_("contacts.0.law", {"kind": "penalty", "stiffness": 2e8, "damping": 2000.0})


def measured(case: il.Case, channel: str = FORCE, shift: float = 0.0, samples: int = SAMPLES) -> il.Signal:
    """Return a channel of a run as an instrument without noise shows it, ``shift`` samples late."""
    history = il.run(case)
    width = 1.1 * history.duration / samples
    times = (np.arange(samples) + 0.5) * width
    empty = il.Signal(channel, times, 0.0 * times)
    return replace(empty, values=Means(history, channel).over(empty.edges, shift * width))


def noise(signal: il.Signal, seed: int = 0) -> np.ndarray:
    return 0.02 * np.max(np.abs(signal.values)) * np.random.default_rng(seed).standard_normal(len(signal.values))


def test_gain_offset_and_trigger_of_each_signal(case):
    force, speed = measured(case, shift=7.4), measured(case, SPEED)
    force = replace(force, values=1.05 * force.values + 3000.0, gain=("0.9", 1.1), offset="free", shift="free")
    speed = replace(speed, values=speed.values - 0.25, offset="-0.25 m/s")
    found = il.fit(case.with_(STIFFNESS, 1.5e8).with_(MASS, 2.5), [force, speed], {**BOUNDS, MASS: (1.0, 4.0)})
    assert found[f"gain of {FORCE}"].value == pytest.approx(1.05, rel=1e-5)
    assert found[f"offset of {FORCE}"].value == pytest.approx(3000.0, rel=1e-4)
    assert found[f"shift of {FORCE}"].value == pytest.approx(7.4 * force.width, rel=1e-5)
    assert found[STIFFNESS].value == pytest.approx(2e8, rel=1e-5)
    assert len(found.parameters) == 5  # nothing of the second instrument is fitted


def test_an_offset_of_strain_may_have_a_unit_of_strain():
    signal = il.Signal(
        "strain:rod@0.15", [0.0, 1e-6, 2e-6, 3e-6], [0.0, 0.0, 1e-5, 0.0], offset=("-50 um/m", "50 µstrain")
    )
    found = settings(signal, {}, "gauge")["offset"]
    assert isinstance(found, Unknown)
    assert (found.low, found.high) == pytest.approx((-5e-5, 5e-5))
    with pytest.raises(CaseError, match=r"not a strain\. Allowed: a plain number, or a number and % or um/m"):
        settings(replace(signal, offset=("-50 kN", "50 kN")), {}, "gauge")


def test_samples_where_model_and_signal_are_zero_do_not_make_a_signal_look_clean(case, tmp_path):
    """The hammer leaves early: two fifths of the force are 0 on both sides, which says nothing of its noise."""
    free = case.with_("bodies.rod.ends.right", "free")
    force, speed = measured(free), measured(free, SPEED)
    touching = force.values != 0.0
    assert np.count_nonzero(~touching) > 0.35 * SAMPLES
    level = 0.1 * np.max(force.values)
    force = replace(force, values=force.values + level * touching * np.random.default_rng(0).standard_normal(SAMPLES))
    speed = replace(speed, values=speed.values + 2e-3 * np.random.default_rng(1).standard_normal(SAMPLES))
    found = il.fit(free, [force, speed], BOUNDS)
    alone = il.fit(free, speed, BOUNDS)
    widths = [of[STIFFNESS].upper - of[STIFFNESS].lower for of in (found, alone)]
    assert widths[0] < 1.05 * widths[1]  # a second signal, weighed by its noise, adds to what is known
    found.write(tmp_path)
    page = (tmp_path / "fit.html").read_text(encoding="utf-8")
    shown = re.search(r"200 samples, noise ([\d.]+)\s*kN", page)
    assert shown is not None
    assert 1e3 * float(shown[1]) == pytest.approx(level, rel=0.2)


def test_a_gain_that_velocity_makes_up_for_is_not_determined(case):
    signal = measured(case)
    bounds = {**BOUNDS, "bodies.hammer.velocity": (0.2, 5.0)}
    found = il.fit(case, replace(signal, values=signal.values + noise(signal)), bounds, gain="free")
    assert not np.isfinite(found["bodies.hammer.velocity"].upper)
    assert np.isfinite(found[STIFFNESS].upper)


def test_units_of_arrays(case):
    signal = measured(case)
    given = il.Signal(FORCE, 1e6 * signal.time, 1e-3 * signal.values, unit="kN", time_unit="us")
    assert given.time == pytest.approx(signal.time, rel=1e-14)
    assert given.values == pytest.approx(signal.values, rel=1e-14)
    with pytest.raises(CaseError, match="another dimension"):
        il.Signal(FORCE, signal.time, signal.values, unit="mm")


def test_standard_deviations_weight_the_samples(case):
    signal = measured(case)
    wild = signal.values.copy()
    wild[:80] += 30.0 * noise(signal)[:80]
    std = np.where(np.arange(SAMPLES) < 80, 1e6, 0.02 * signal.values.max())
    weighted = il.fit(case, replace(signal, values=wild + noise(signal, 1), std=std), BOUNDS, noise="std")
    plain = il.fit(case, replace(signal, values=wild + noise(signal, 1)), BOUNDS)
    assert abs(weighted[STIFFNESS].value / 2e8 - 1.0) < 0.3 * abs(plain[STIFFNESS].value / 2e8 - 1.0)
    with pytest.raises(CaseError, match="no standard deviations"):
        il.fit(case, signal, BOUNDS, noise="std")


def test_the_low_pass_is_three_decibels_down_and_right_at_the_ends():
    times = 1e-6 * np.arange(2000)
    low_pass = LowPass(il.Signal(SPEED, times, 0.0 * times), 50e3)
    assert low_pass(np.full(2000, 3.0)) == pytest.approx(3.0, rel=1e-13)  # also at the ends
    shown = low_pass(np.sin(2.0 * np.pi * 50e3 * times + 0.3))[10:-10]
    every = np.arange(2000)[(1999 % 10) // 2 :: 10][10:-10]
    assert shown == pytest.approx(np.sqrt(0.5) * np.sin(2.0 * np.pi * 50e3 * times[every] + 0.3), abs=2e-3)
    assert low_pass.deviations(np.ones(2000)).max() < 0.5


def test_a_bandwidth_filters_model_and_data_alike(case):
    signal = measured(case)
    hum = 0.3 * signal.values.max() * np.sin(2.0 * np.pi * 180e3 * signal.time)
    noisy = replace(signal, values=signal.values + hum + noise(signal))
    found, plain = (il.fit(case.with_(STIFFNESS, 1.5e8), noisy, BOUNDS, bandwidth=width) for width in ("60 kHz", 0.0))
    assert found[STIFFNESS].lower < 2e8 < found[STIFFNESS].upper
    assert found.noise < 0.3 * plain.noise
    uneven = signal.time + 0.3 * signal.width * (np.arange(SAMPLES) % 2)
    with pytest.raises(CaseError, match="equal sampling intervals"):
        il.fit(case, replace(signal, time=uneven), BOUNDS, bandwidth=6e4)


def test_experiments_with_their_own_cases_are_fitted_together(case, tmp_path):
    heavy = case.with_(MASS, 4.0)
    pairs = [(each, measured(each)) for each in (case, heavy)]
    start = [
        (each.with_(STIFFNESS, 1.4e8), replace(s, values=s.values + noise(s, k))) for k, (each, s) in enumerate(pairs)
    ]
    found = il.fit(start, parameters=BOUNDS, shift="free")
    assert found[STIFFNESS].lower < 2e8 < found[STIFFNESS].upper
    alone = il.fit(*start[0], BOUNDS, shift="free")
    assert found[STIFFNESS].upper - found[STIFFNESS].lower < alone[STIFFNESS].upper - alone[STIFFNESS].lower
    found.write(tmp_path)
    masses = [
        il.load_case(tmp_path / f"{name}.yaml").resolved()["bodies"]["hammer"]["mass"]
        for name in ("fitted", "fitted-2")
    ]
    assert masses == [pytest.approx(2.133), 4.0]
    with pytest.raises(CaseError, match="signals are given twice: beside the experiments"):
        il.fit(start, start[0][1], BOUNDS)


def test_a_trial_that_the_case_refuses_is_a_shorter_step(case):
    probed = case.with_("probes", [{"body": "rod", "at": 0.28, "quantity": "strain"}])
    signal = measured(probed.with_(LENGTH, 0.281))
    with pytest.raises(CaseError):
        il.run(probed.with_(LENGTH, 0.279))
    found = il.fit(probed.with_(LENGTH, 0.33), signal, {LENGTH: (0.1, 0.6)})  # below 0.28 m there is no run
    assert found[LENGTH].value == pytest.approx(0.281, rel=1e-5)


def test_a_hard_contact_is_found_from_a_start_far_off():
    hard = il.load_case("axial_impact").method("continuous")
    signal = measured(hard)
    bounds = {MASS: (0.5, 10.0), "bodies.rod.material.young": (5e10, 1e12)}
    start = hard.with_(MASS, 3.0).with_("bodies.rod.material.young", 1.4e11)
    found = il.fit(start, replace(signal, values=signal.values + noise(signal)), bounds)
    assert found[MASS].value == pytest.approx(2.133, rel=0.01)
    assert found["bodies.rod.material.young"].value == pytest.approx(2.1e11, rel=0.01)


def test_the_correlation_of_noise_is_not_underestimated(case):
    signal = measured(case)
    found, raw = [], []
    for seed in range(12):
        error = np.random.default_rng(seed).standard_normal(SAMPLES)
        for k in range(1, SAMPLES):
            error[k] = 0.9 * error[k - 1] + np.sqrt(0.19) * error[k]
        problem = il.fit_problem(
            case, replace(signal, values=signal.values + 1e3 * error), {**BOUNDS, MASS: (1.0, 4.0)}
        )
        x = problem.start()
        for _ in range(3):  # linear least squares
            x = x - np.linalg.lstsq(problem.jacobian(x), problem.residuals(x), rcond=None)[0]
        left = problem.residuals(x)
        raw.append(float(left[1:] @ left[:-1]) / float(left @ left))
        found.append(correlations(problem, x)[0])
    assert np.mean(found) == pytest.approx(0.9, abs=0.03)
    assert np.mean(raw) < np.mean(found)


def test_netcdf_files_of_runs_and_of_instruments(case, tmp_path):
    xarray = pytest.importorskip("xarray")
    il.run(case).to_netcdf(tmp_path / "history.nc")
    [own] = il.read_signals(tmp_path / "history.nc", {FORCE: FORCE})
    assert own.values.max() == pytest.approx(measured(case).values.max(), rel=0.01)
    table = xarray.Dataset({
        "load": ("time", [0.0, 1.0, 2.0, 3.0], {"units": "kN"}), "bare": ("time", [0.0, 1.0, 2.0, 3.0]),
        "std load": ("time", [0.1, 0.1, 0.1, 0.2], {"units": "kN"}),
    }, {"time": ("time", [0.0, 1.0, 2.0, 3.0], {"units": "us"})})  # fmt: skip
    table.to_netcdf(tmp_path / "data.nc", engine="h5netcdf")
    [signal] = il.read_signals(tmp_path / "data.nc", {"load": FORCE})
    assert (signal.time[-1], signal.values[-1], signal.std[-1]) == pytest.approx((3e-6, 3000.0, 200.0))
    with pytest.raises(CaseError, match="has no unit"):
        il.read_signals(tmp_path / "data.nc", {"bare": FORCE})
    with pytest.raises(CaseError, match="load"):
        il.read_signals(tmp_path / "data.nc", {"laod": FORCE})


def written(signal: il.Signal, file, std: bool = False) -> str:
    heading = "time [us], force [kN]" + (", std force [kN]" if std else "")
    rows = [
        f"{1e6 * t:.9g},{1e-3 * f:.9g}" + (",1.5" if std else "")
        for t, f in zip(signal.time, signal.values, strict=True)
    ]
    file.write_text("\n".join([heading, *rows]), encoding="utf-8")
    return str(file)


def test_the_command_takes_experiments_instruments_and_a_bandwidth(case, tmp_path):
    files = []
    for name, each in (("a", case), ("b", case.with_(MASS, 4.0))):
        signal = measured(each, shift=5.0)
        data = written(replace(signal, values=1.04 * signal.values + noise(signal)), tmp_path / f"{name}.csv", True)
        own = tmp_path / f"{name}.yaml"
        own.write_text(each.with_(STIFFNESS, 1.6e8).to_yaml(), encoding="utf-8")
        files += [str(own), data]
    arguments = ["fit", *files[:2], "--experiment", f"{files[2]}={files[3]}", "--signal", f"force [kN]={FORCE}"]
    arguments += ["--parameters", f"{STIFFNESS}=5e7:8e8", "--gain", "force [kN]=0.9:1.1", "--offset", "-1 kN:1 kN"]
    arguments += [
        "--shift",
        "free",
        "--noise",
        "std",
        "--bandwidth",
        "200 kHz",
        "--json",
        "--out",
        str(tmp_path / "out"),
    ]
    done = invoke(*arguments)
    assert done.exit_code == 0, done.output
    rows = {row["path"]: row for row in json.loads((tmp_path / "out" / "fit.json").read_text())["parameters"]}
    assert rows[STIFFNESS]["value"] == pytest.approx(2e8, rel=0.02)
    assert rows[f"gain of {FORCE} (2)"]["value"] == pytest.approx(1.04, rel=0.02)
    assert (tmp_path / "out" / "fitted-2.yaml").exists()


@pytest.mark.parametrize(
    ("heading", "factor"), [("Zeit [ms]", 1e-3), ("temps (µs)", 1e-6), ("X [s]", 1.0), ("time [us]", 1e-6)]
)
def test_times_are_headed_in_any_language_with_a_unit_of_time(tmp_path, heading, factor):
    """'Zeit [ms]' was refused as no time; 'Last [kN]' in its place is."""
    file = tmp_path / "shot.csv"
    file.write_text(f"{heading};Kraft [kN]\n0,5;1,0\n1,5;2,0\n2,5;2,0\n3,5;2,0\n", encoding="utf-8")
    (signal,) = il.read_signals(file, {"Kraft [kN]": FORCE})
    assert signal.time == pytest.approx(factor * np.array([0.5, 1.5, 2.5, 3.5]), rel=1e-12)
    file.write_text("Last [kN];Kraft [kN]\n0,5;1,0\n", encoding="utf-8")
    with pytest.raises(il.CaseError, match="where times are needed"):
        il.read_signals(file, {"Kraft [kN]": FORCE})


FREE = {"--shift": "free", "--gain": "free", "--offset": "free"}
GOOD = "time [us],force [kN]\n" + "".join(f"{k},{k % 7}\n" for k in range(1, 40))


@pytest.mark.parametrize(
    ("table", "options", "said"),
    [
        (GOOD.replace("time [us]", "time"), {}, "has no unit"),
        (GOOD.replace("force [kN]", "force"), {"--signal": f"force={FORCE}"}, "has no unit"),
        (GOOD.replace("force [kN]", "force [mm]"), {"--signal": f"force [mm]={FORCE}"}, "another dimension"),
        (GOOD.replace("7,0", '7,"0,5"'), {}, "is not a finite number"),
        (GOOD.replace("7,0", "7,0,5"), {}, "3 cells, 2 columns"),
        (GOOD.replace("time [us],", "").replace("\n7,", "\n"), {}, "where times are needed"),
        (GOOD.replace("\n9,", "\n,"), {}, "the cell is empty"),
        (GOOD.replace("\n9,", "\nnan,"), {}, "data.csv:10: time [us]: 'nan' is not a finite number"),
        (GOOD.replace("\n9,", "\n7,"), {}, "is not later"),
        (GOOD.replace("force [kN]", "force [kN],force [kN]"), {}, "two columns are headed"),
        (GOOD.replace("\n9,2", "\n\n9,two"), {}, "data.csv:11:"),
        (GOOD.replace("[kN]", "[µstrian]"), {"--signal": "force [µstrian]=strain:rod@0.1"}, "Did you mean 'µstrain'?"),
        ("", {}, "the file is empty"),
        (GOOD[: GOOD.index("\n5,")], FREE, "4 samples are given for 4 unknowns"),
        (GOOD, {"--signal": f"froce [kN]={FORCE}"}, "no column is headed"),
        (GOOD, {"--signal": "force [kN]=force:hammer|rod"}, "no run has the channel"),
        (GOOD, {"--signal": "force [kN]=speed:hammer"}, "is not a channel"),
        (GOOD, {"--parameters": f"{STIFFNESS}=8e8:5e7"}, "lower one first"),
        (GOOD, {"--parameters": f"{STIFFNESS}=3e8:5e8"}, "lies outside"),
        (GOOD, {"--parameters": f"{STIFFNESS}=5e7:8e8,bodies.hammer.mass=1:4"}, "gives several numbers"),
        (GOOD, {"--parameters": f"{STIFFNESS}=1 kg:5e8"}, "another dimension"),
        (GOOD, {"--parameters": "bodies.hammer.weight=1:5"}, "bodies.hammer"),
        (GOOD, {"--gain": "1.2:0.9"}, "lower one first"),
        (GOOD, {"--shift": "perhaps"}, "'free' or 'fixed'"),
        (GOOD, {"--offset": "load [kN]=free"}, "no --signal"),
        (GOOD, {"--bandwidth": "100 mm"}, "another dimension"),
        (GOOD, {"--noise": "std"}, "no standard deviations"),
        (GOOD, {"--noise": "pink"}, "Allowed: white, ar1, std"),
    ],
)  # fmt: skip
def test_bad_data_are_refused_before_the_first_run(case, tmp_path, monkeypatch, table, options, said):
    (tmp_path / "case.yaml").write_text(case.to_yaml(), encoding="utf-8")
    (tmp_path / "data.csv").write_text(table, encoding="utf-8")
    monkeypatch.setattr("impactlab.simulate.driver.run", None)  # a run would fail
    given = {"--signal": f"force [kN]={FORCE}", "--parameters": f"{STIFFNESS}=5e7:8e8", **options}
    words = [word for pair in given.items() for word in pair]
    done = invoke(
        "fit", str(tmp_path / "case.yaml"), str(tmp_path / "data.csv"), *words, "--out", str(tmp_path / "out")
    )
    assert done.exit_code == 2, done.output
    assert said in " ".join(done.output.split())
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "table",
    [
        "time [ms],left [µstrain]\n{}",
        "time (ms);left (µstrain)\n{}",
        "t [ms]\tleft [um/m]\n{}",
        "Time (ms),left (microstrain)\n{}",
    ],
    ids=["commas", "semicolons and decimal commas", "tabs", "spelt out"],
)
def test_tables_of_recorders_are_read_in_their_own_form(tmp_path, table):
    """Half a millisecond between samples, -1206.5 micrometres per metre at the second."""
    rows = [("0.0", "0.0"), ("0.5", "-1206.5"), ("1.0", "3.0"), ("1.5", "4.0")]
    separator = next(mark for mark in "\t;," if mark in table)
    lines = "".join(f"{separator.join(row)}\n" for row in rows)
    text = table.format(lines.replace(".", ",") if separator == ";" else lines)
    (tmp_path / "shot.csv").write_text(text, encoding="utf-8")
    heading = text.splitlines()[0].split(separator)[1]
    (signal,) = il.read_signals(tmp_path / "shot.csv", {heading: "strain:bar@0.5"})
    assert signal.time == pytest.approx([0.0, 5e-4, 1e-3, 1.5e-3], abs=1e-18)
    assert signal.values == pytest.approx([0.0, -1206.5e-6, 3e-6, 4e-6], abs=1e-18)


def test_columns_without_channels_are_refused():
    with pytest.raises(CaseError, match=r"takes the columns as a mapping, not a list of 1"):
        il.read_signals("shot.csv", ["force [kN]"])


def test_a_signal_that_no_parameter_moves_is_named(case):
    early = np.linspace(1e-7, 2e-6, 30)  # the wave has not arrived there
    quiet = il.Signal("strain:rod@0.25", early, 0.0 * early)
    with pytest.raises(CaseError, match=r"no parameter moves the signal strain:rod@0\.25"):
        il.fit(case, [measured(case), quiet], BOUNDS)


def test_runs_that_scatter_are_not_called_without_an_effect():
    """The constraint chatters under this scheme: a millionth of the mass puts its forces into other steps."""
    rough = il.load_case("axial_impact").with_(
        "solve",
        {
            "model": {"kind": "finite_element", "elements": 100},
            "integrator": {"kind": "newmark"},
            "step": {"points_per_period": 10},
        },
    )
    signal = measured(il.load_case("axial_impact").method("continuous"))
    with pytest.raises(CaseError, match=r"a change of bodies\.hammer\.mass by 1e-06 .* no fit converges"):
        il.fit(rough.with_("contacts.0.law", {"kind": "addition_deletion"}), signal, {"bodies.hammer.mass": (1.0, 4.0)})


def test_derivatives_of_steps_do_not_contain_the_jump_beside_a_solution():
    """Residuals jump where an event passes to another step, and the least loss lies there more often than not."""
    stepped, exact = il.load_case("axial_impact"), il.load_case("axial_impact").method("continuous")
    problem = il.fit_problem(stepped, measured(exact), {"bodies.hammer.mass": (1.0, 4.0)})

    def at(x: float) -> np.ndarray:
        return problem.residuals(np.array([x]))

    places = np.linspace(0.0, 0.02, 21)
    changes = [float(np.linalg.norm(at(high) - at(low))) for low, high in itertools.pairwise(places)]
    number = int(np.argmax(changes))
    low, high = float(places[number]), float(places[number + 1])
    before = np.linalg.norm(problem.jacobian(np.array([low - 1e-5])))
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        upper = np.linalg.norm(at(high) - at(middle)) > np.linalg.norm(at(middle) - at(low))
        low, high = (middle, high) if upper else (low, middle)
    beside = np.array([low])
    assert np.linalg.norm(problem.jacobian(beside)) > 100.0 * before
    assert np.linalg.norm(problem.jacobian(beside, both_sides=True)) == pytest.approx(before, rel=0.5)


def test_profiles_of_runs_that_jump_are_warned_of():
    """A profile ends at the first jump, where an event passes to another step: here below the true mass of 2.133 kg."""
    clean = measured(il.load_case("axial_impact").method("continuous"))
    signal = replace(clean, values=clean.values + noise(clean))
    hard = il.load_case("axial_impact")
    soft = hard.with_("contacts.0.law", {"kind": "penalty", "stiffness": 2e9})
    for case, said in ((hard, True), (soft, False)):
        found = il.fit(case, signal, {MASS: (1.0, 4.0)}, intervals="profile")
        assert said is any("the signals of this stepped run jump where mass changes" in text for text in found.warnings)
        if said:
            assert found[MASS].intervals["profile"][1] < 2.133 < found[MASS].upper


def test_a_signal_that_is_rounding_is_no_signal():
    """Nothing reaches the rod: the stress in it is zero for any length, and the run gives the rounding of two waves."""
    rod = il.Rod(length=0.2, area=5e-4, material={"young": 6.5e10, "density": 6000.0}, velocity=0.2)
    scene = il.Case(
        bodies={"a": il.Mass(0.05, velocity=1.0), "b": il.Mass(0.03), "rod": rod},
        contacts=[
            il.Contact("a", "b", {"kind": "penalty", "stiffness": 4.4e7}),
            il.Contact("b", "rod.left", {"kind": "penalty", "stiffness": 1e7}, gap=1e-3),
        ],
        solve={"duration": 1.6e-4, "model": {"kind": "continuous"}},
        probes=[{"body": "rod", "at": 0.1, "quantity": "stress"}],
    )
    times = np.linspace(1e-6, 1.55e-4, 100)
    force = il.Signal("force:a|b", times, il.run(scene).evaluate(times, "force:a|b"))
    quiet = il.Signal("stress:rod@0.1", times, 0.0 * times)
    bounds = {"contacts.0.law.stiffness": (2e7, 8e7), "bodies.rod.length": (0.15, 0.35)}
    with pytest.raises(CaseError, match=r"no parameter moves the signal stress:rod@0\.1"):
        il.fit(scene.with_("bodies.rod.length", 0.23), [force, quiet], bounds)
    alone = il.fit(scene.with_("bodies.rod.length", 0.23), force, bounds)["bodies.rod.length"]
    assert (alone.lower, alone.upper) == (0.0, np.inf)


def test_numbers_of_ends_have_units(case):
    toe = "bodies.rod.ends.right.dashpot"
    pile = case.with_("bodies.rod.ends.right", {"dashpot": 1.5e4})
    found = il.fit(pile, measured(pile), {toe: ("3 kN s/m", "70 kN s/m")})
    assert found[toe].unit == "N s/m"
    with pytest.raises(CaseError, match="another dimension"):
        il.fit(pile, measured(pile), {toe: ("3 kg", "70 kg")})


def test_a_noisy_signal_does_not_hide_a_clean_one(case):
    force, speed = measured(case), measured(case, SPEED)
    force = replace(force, values=force.values + 0.2 * noise(force))
    speed = replace(speed, values=speed.values + 20.0 * noise(speed, 1))
    start = case.with_(STIFFNESS, 1.5e8)
    alone, both = (il.fit(start, signals, BOUNDS)[STIFFNESS] for signals in (force, [force, speed]))
    assert both.lower < 2e8 < both.upper
    assert both.upper - both.lower < 1.2 * (alone.upper - alone.lower)


def test_a_missing_table_is_refused_with_the_nearest_name(tmp_path):
    (tmp_path / "data.csv").write_text("time [s],force [N]\n", encoding="utf-8")
    with pytest.raises(CaseError, match=r"the file does not exist\. Did you mean 'data\.csv'\?"):
        il.read_signals(tmp_path / "data.cvs", {"force [N]": FORCE})
