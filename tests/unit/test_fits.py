"""Fits: known numbers found again from noisy signals, what signals cannot tell, and bad data."""

from __future__ import annotations

import hashlib
import json
import math
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import CaseError
from impactlab.fits.model import Means
from impactlab.fits.trials import MarchedMeans
from tests.support import invoke

FORCE = "force:hammer|rod.left"
MASS, YOUNG = "bodies.hammer.mass", "bodies.rod.material.young"
STIFFNESS, DAMPING = "contacts.0.law.stiffness", "contacts.0.law.damping"
SAMPLES = 200


@pytest.fixture(scope="module")
def hard() -> il.Case:
    return il.load_case("axial_impact").method("continuous")


@pytest.fixture(scope="module")
def cushioned(hard) -> il.Case:
    return hard.with_("contacts.0.law", {"kind": "penalty", "stiffness": 2e8, "damping": 2000.0})


def measured(case: il.Case, noise: float = 0.02, shift: float = 0.0, seed: int = 0) -> il.Signal:
    """Return the force of a run as an instrument shows it: means over intervals, noise, its own trigger time."""
    history = il.run(case)
    width = 1.1 * history.duration / SAMPLES
    times = (np.arange(SAMPLES) + 0.5) * width
    empty = il.Signal(FORCE, times, 0.0 * times)
    shown = Means(history, FORCE).over(empty.edges, shift * width)
    shown += noise * shown.max() * np.random.default_rng(seed).standard_normal(SAMPLES)
    return il.Signal(FORCE, times, shown)


def test_a_sample_is_the_mean_over_its_interval(hard):
    history = il.run(hard)
    edges = np.linspace(0.0, history.duration, 31)
    means = Means(history, FORCE).over(edges, 0.0)
    assert np.sum(means * np.diff(edges)) == pytest.approx(sum(span.impulse for span in history.contacts), rel=1e-12)
    shifted = Means(history, FORCE).over(edges, 0.3 * edges[1])
    # until the first echo the force is Z v0 exp(-Z t/M)
    z, mass = 36657.74, 2.133
    assert shifted[0] * edges[1] == pytest.approx(mass * (1.0 - math.exp(-z / mass * 0.7 * edges[1])), rel=1e-6)


@pytest.mark.parametrize("channel", ["strain:rod@0.15", "velocity:rod@0.07", "stress:rod@0.3", "velocity:hammer"])
def test_integrals_of_channels_are_exact_across_fronts(cushioned, channel):
    history = il.run(cushioned.with_("gravity", 9.81))
    edges = np.linspace(0.0, history.duration, 7)
    found = np.diff(history.integral(channel, edges))
    fine = np.linspace(0.0, history.duration, 6 * 4000 + 1)
    middle = history.evaluate(0.5 * (fine[1:] + fine[:-1]), channel).reshape(6, -1)
    assert found == pytest.approx(np.mean(middle, axis=1) * (edges[1] - edges[0]), abs=1e-3 * np.max(np.abs(found)))


def test_without_noise_the_numbers_come_back(cushioned):
    start = cushioned.with_(STIFFNESS, 1.5e8).with_(DAMPING, 2500.0)
    found = il.fit(start, measured(cushioned, 0.0), {STIFFNESS: (5e7, 8e8), DAMPING: (500.0, 8000.0)})
    assert found[STIFFNESS].value == pytest.approx(2e8, rel=1e-6)
    assert found[DAMPING].value == pytest.approx(2000.0, rel=1e-5)
    assert found.noise < 1e-6


def test_a_hard_contact_with_noise_and_an_unknown_trigger(hard):
    start = hard.with_(MASS, 2.6).with_(YOUNG, 1.7e11)
    signal = measured(hard, 0.02, shift=11.3, seed=3)
    found = il.fit(start, signal, {MASS: (0.5, 10.0), YOUNG: ("50 GPa", "1000 GPa")}, shift="free")
    level = 0.02 * 78276.57 / np.std(signal.values)
    assert found.noise < 1.1 * level
    for path, truth in ((MASS, 2.133), (YOUNG, 2.1e11)):
        assert found[path].value == pytest.approx(truth, rel=0.01)
        assert found[path].lower < found[path].value < found[path].upper
    shift = found[f"shift of {FORCE}"]
    assert shift.value == pytest.approx(11.3 * (signal.time[1] - signal.time[0]), abs=0.3 * signal.time[0])


def test_a_number_that_a_force_does_not_determine_has_no_interval(cushioned):
    paths = {MASS: (0.2, 20.0), "bodies.rod.area": (1e-4, 1e-2), STIFFNESS: (2e7, 2e9), DAMPING: (200.0, 20000.0),
             "bodies.hammer.velocity": (0.1, 10.0)}  # fmt: skip
    found = il.fit(cushioned, measured(cushioned), paths)
    [told] = found.undetermined  # heavier, stiffer and slower by one factor: the same force
    assert "velocity" in told
    assert all(math.isinf(found[path].upper) for path in paths)
    known = il.fit(cushioned, measured(cushioned), {MASS: (0.2, 20.0), STIFFNESS: (2e7, 2e9)})
    assert not known.undetermined
    assert known[MASS].upper < 2.2


def test_outliers_under_huber(cushioned):
    signal = measured(cushioned, 0.01)
    wild = signal.values.copy()
    wild[5:45:4] += 10.0 * 0.01 * wild.max()  # while the force grows
    bounds = {STIFFNESS: (5e7, 8e8)}
    clean, robust = (
        il.fit(cushioned, il.Signal(FORCE, signal.time, values), bounds, loss="huber")
        for values in (signal.values, wild)
    )
    plain = il.fit(cushioned, il.Signal(FORCE, signal.time, wild), bounds)
    moved = abs(robust[STIFFNESS].value - clean[STIFFNESS].value)
    assert moved < 0.5 * (clean[STIFFNESS].upper - clean[STIFFNESS].lower)
    assert moved < 0.5 * abs(plain[STIFFNESS].value - clean[STIFFNESS].value)


def test_correlated_residuals_are_warned_of_and_widen_the_interval(cushioned):
    signal = measured(cushioned, 0.0)
    noise = np.random.default_rng(5).standard_normal(SAMPLES)
    for k in range(1, SAMPLES):
        noise[k] += 0.9 * noise[k - 1]
    noisy = il.Signal(FORCE, signal.time, signal.values + 0.02 * signal.values.max() * noise)
    bounds = {STIFFNESS: (5e7, 8e8)}
    white, coloured = (il.fit(cushioned, noisy, bounds, noise=kind) for kind in ("white", "ar1"))
    assert any("have a correlation" in text for text in white.warnings)
    assert not any("have a correlation" in text for text in coloured.warnings)
    assert abs(coloured.autocorrelation) < 0.3 < white.autocorrelation
    assert coloured[STIFFNESS].lower < 2e8 < coloured[STIFFNESS].upper


def test_samples_after_the_end_of_the_run_are_warned_of(cushioned):
    longer = cushioned.with_("solve.duration", 5e-4)
    times = np.linspace(2e-6, 4.9e-4, SAMPLES)
    signal = il.Signal("velocity:hammer", times, il.run(longer).evaluate(times, "velocity:hammer"))
    bounds = {STIFFNESS: (5e7, 8e8), MASS: (1.0, 4.0)}
    short, whole = (il.fit(case, signal, bounds) for case in (cushioned, longer))
    ends = il.run(cushioned).duration
    late = int(np.sum(signal.edges[:-1] >= ends))
    assert abs(short[MASS].value / 2.133 - 1.0) > 0.02  # the hammer does not keep the velocity of the end of the run
    assert any(f"{late} of {SAMPLES} samples of velocity:hammer lie after the end" in text for text in short.warnings)
    assert whole[MASS].value == pytest.approx(2.133, rel=1e-3)
    assert not any("after the end" in text for text in whole.warnings)
    shifted = il.Signal("velocity:hammer", times + 2e-4, signal.values)
    moved = il.fit(longer, shifted, bounds, shift=2e-4)  # the clock of the instrument starts before the run
    assert not any("after the end" in text for text in moved.warnings)


def test_a_fit_that_ends_at_a_bound_warns(cushioned):
    found = il.fit(cushioned.with_(STIFFNESS, 5e8), measured(cushioned), {STIFFNESS: (4e8, 8e8)})
    assert found[STIFFNESS].note == "at its bound"
    assert any("bound" in text for text in found.warnings)


def test_the_command_reads_a_table_and_writes_a_case_that_runs(cushioned, tmp_path):
    signal = measured(cushioned)
    case, data = tmp_path / "case.yaml", tmp_path / "data.csv"
    case.write_text(cushioned.with_(STIFFNESS, 1.6e8).to_yaml(), encoding="utf-8")
    rows = [f"{1e6 * t:.9g},{1e-3 * f:.9g}" for t, f in zip(signal.time, signal.values, strict=True)]
    data.write_text("\n".join(["time [us], force [kN]", *rows]), encoding="utf-8")
    arguments = ["fit", str(case), str(data), "--signal", f"force [kN]={FORCE}"]
    arguments += ["--parameters", f"{STIFFNESS}=5e7:8e8", "--out", str(tmp_path / "out"), "--json"]
    done = invoke(*arguments)
    assert done.exit_code == 0, done.output
    document = json.loads((tmp_path / "out" / "fit.json").read_text())
    fitted = il.load_case(tmp_path / "out" / "fitted.yaml")
    assert document["parameters"][0]["value"] == pytest.approx(2e8, rel=0.02)
    assert fitted.resolved()["contacts"][0]["law"]["stiffness"] == pytest.approx(document["parameters"][0]["value"])
    assert len(il.run(fitted).contacts) >= 1
    (given,) = il.read_signals(data, {"force [kN]": FORCE})
    (shown,) = document["signals"]
    assert (shown["channel"], shown["samples"]) == (FORCE, len(given.time))
    assert shown["sha256"] == hashlib.sha256(given.time.tobytes() + given.values.tobytes()).hexdigest()
    assert document["impactlab_version"] == il.__version__


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time [us],force\n1,2\n2,3\n3,4\n4,5\n", "has no unit"),
        ("time [us],force [kN]\n1,2\n2,3\n2,4\n4,5\n", "is not later"),
        ('time [us],force [kN]\n1,"2,5"\n2,3\n3,4\n4,5\n', "is not a finite number"),
        ("time [us],force [kN]\n1,2\n2\n3,4\n4,5\n", "1 cells, 2 columns"),
        ("time [us],force [kN]\n1,nan\n2,3\n3,4\n4,5\n", "not a finite number"),
        ("time [us],force [kN]\n1,2\n", "1 sample. Allowed: 4 or more"),
        ("force [kN],time [us]\n1,2\n", "first column"),
    ],
)
def test_bad_tables_are_refused(tmp_path, text, said):
    file = tmp_path / "data.csv"
    file.write_text(text, encoding="utf-8")
    heading = "force" if "force\n" in text else "force [kN]"
    with pytest.raises(CaseError, match=said):
        il.read_signals(file, {heading: FORCE})


@pytest.mark.parametrize(
    ("bounds", "said"),
    [
        ({STIFFNESS: (8e8, 5e7)}, "lower one first"),
        ({STIFFNESS: (5e8, 8e8)}, "lies outside"),
        ({"contacts.0.law.stifness": (5e7, 8e8)}, "stiffness"),
        ({STIFFNESS: 2e8}, "pair of bounds"),
    ],
)
def test_bad_bounds_are_refused(cushioned, bounds, said):
    with pytest.raises(CaseError, match=said):
        il.fit(cushioned, measured(cushioned), bounds)


def test_a_contact_by_number_and_by_name_is_one_parameter(cushioned):
    named = cushioned.with_("contacts.0.name", "cushion")
    with pytest.raises(CaseError, match=f"given twice: {STIFFNESS} is the same number"):
        il.fit(named, measured(named), {STIFFNESS: (5e7, 8e8), "contacts.cushion.law.stiffness": (5e7, 8e8)})


def test_an_unknown_channel_is_refused(cushioned):
    signal = measured(cushioned)
    with pytest.raises(CaseError, match="no run has the channel"):
        il.fit(cushioned, il.Signal("force:hammer|rod", signal.time, signal.values), {STIFFNESS: (5e7, 8e8)})


def test_the_page_runs_in_both_forms(monkeypatch, tmp_path):
    root = Path(__file__).parents[2]
    (tmp_path / "cases").mkdir()
    shutil.copy(root / "cases" / "axial_impact.yaml", tmp_path / "cases")
    monkeypatch.chdir(tmp_path)
    page = (root / "docs" / "fits.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    for code in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(code, names)
    found = names["found"]
    assert found[STIFFNESS].lower < 2e8 < found[STIFFNESS].upper
    assert names["together"][STIFFNESS].value == pytest.approx(2e8, rel=0.01)
    assert (tmp_path / "out" / "fit.html").exists()
    Path("my_case.yaml").write_text(names["case"].to_yaml(), encoding="utf-8")
    rows = [f"{1e6 * t!r},{1e-3 * f!r}" for t, f in zip(names["times"].tolist(), names["force"].tolist(), strict=True)]
    Path("data.csv").write_text("\n".join(["time [us], force [kN]", *rows]), encoding="utf-8")
    made = []
    for command in re.findall(r"^impactlab (fit .*)$", page, re.MULTILINE):
        done = invoke(*shlex.split(command))
        assert done.exit_code == 0, done.output
        made.append(json.loads(Path("out", "fit.json").read_text())["parameters"])
    rows = next(each for each in made if "bootstrap" in each[0]["intervals"])
    for row, fitted in zip(rows, found.parameters, strict=True):
        for kind, ends in fitted.intervals.items():
            assert row["intervals"][kind] == pytest.approx(ends, rel=1e-6)


@pytest.mark.parametrize("channel", [FORCE, "velocity:hammer", "strain:rod@0.15", "stress:rod@0.3"])
def test_trials_of_exact_scenes_are_those_of_runs(cushioned, channel):
    signal = measured(cushioned)
    paths = (STIFFNESS, YOUNG, MASS)
    bounds = {STIFFNESS: (5e7, 8e8), YOUNG: (1e11, 4e11), MASS: (1.0, 4.0)}
    problem = il.fit_problem(cushioned, il.Signal(channel, signal.time, signal.values), bounds)
    for values in ((1.5e8, 2.3e11, 2.5), (3e8, 1.8e11, 1.7)):
        [found] = problem.trials[0].means(values)
        assert isinstance(found, MarchedMeans)
        run = il.run(cushioned.with_settings(zip(paths, values, strict=True)))
        wanted = Means(run, channel).over(signal.edges, 2.5e-6)
        assert found.over(signal.edges, 2.5e-6) == pytest.approx(wanted, abs=1e-12 * np.max(np.abs(wanted)))


def test_a_number_without_an_effect_leaves_the_others_determined() -> None:
    """Until 2L/c the force is Z v exp(-Z t/M), whatever the length: velocity alone has a closed interval."""
    rod = il.Rod(length=0.5, area=2.5e-4, material={"young": 2e11, "density": 8000.0}, ends={"right": "clamped"})
    bodies = {"hammer": il.Mass(1.0, velocity=1.0), "rod": rod}
    contacts = [il.Contact("hammer", "rod.left", law={"kind": "wave_identification"})]
    solve = {"duration": 1.9e-4, "model": {"kind": "continuous"}}
    case = il.Case(bodies=bodies, contacts=contacts, solve=solve)
    z, width, noise = 1e4, 3e-6, 300.0
    times = 5e-6 + width * np.arange(60)
    unit = z * np.exp(-z * times) * math.sinh(0.5 * z * width) / (0.5 * z * width)  # mean over each interval
    force = 0.9 * unit + noise * np.random.default_rng(1).standard_normal(60)
    speed, length = "bodies.hammer.velocity", "bodies.rod.length"
    found = il.fit(case, il.Signal(FORCE, times, force), {speed: (0.2, 3.0), length: (0.495, 0.6)})
    value = float(force @ unit / (unit @ unit))
    size = float(np.linalg.norm(force - value * unit)) / math.sqrt(58)
    half = 2.0017 * size / float(np.linalg.norm(unit))  # Student's t of 58 degrees of freedom
    row = found[speed]
    assert row.value == pytest.approx(value, rel=1e-6)
    assert (row.lower, row.upper) == pytest.approx((value - half, value + half), abs=0.02 * half)
    assert math.isinf(found[length].upper)
    assert "not determined by the signals: length; its interval is infinite" in str(found)


def test_a_parameter_without_effect_at_the_start_is_tried_elsewhere() -> None:
    """The joint at the start never yields: no derivative leads to the yield force of the measured one."""

    def joint(yield_force: float) -> il.Case:
        law = {"kind": "elastic_plastic", "stiffness": 1e8, "yield_force": yield_force, "hardening": 2e7}
        return il.Case(
            bodies={"hammer": il.Mass(1.0, velocity=2.0), "wall": il.Wall()},
            contacts=[il.Contact("hammer", "wall", law)],
            solve={"duration": 1e-3, "integrator": {"kind": "newmark"}, "step": {"dt": 2e-6}},
        )

    times = np.linspace(5e-6, 9.5e-4, 120)
    noise = 1e-3 * np.random.default_rng(0).standard_normal(120)
    signal = il.Signal("velocity:hammer", times, il.run(joint(1e4)).evaluate(times, "velocity:hammer") + noise)
    found = il.fit(joint(2.5e4), signal, {"contacts.0.law.yield_force": (2e3, 4e4), STIFFNESS: (5e7, 2e8)})
    assert found["contacts.0.law.yield_force"].value == pytest.approx(1e4, rel=1e-3)
    assert found[STIFFNESS].value == pytest.approx(1e8, rel=1e-3)
