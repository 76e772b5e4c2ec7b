"""How sure a fit is: intervals of three kinds, products that signals determine, edges, noise, and the page."""

from __future__ import annotations

import csv
import json
import math
import re
import shlex
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t as student

import impactlab as il
from impactlab.fits.bootstrap import block_length, bootstrap
from impactlab.fits.identifiable import named, powers, short_names
from impactlab.fits.loss import Loss
from impactlab.fits.model import Means
from impactlab.fits.profiles import profile
from tests.support import invoke

FORCE = "force:hammer|rod.left"
MASS, VELOCITY = "bodies.hammer.mass", "bodies.hammer.velocity"
STIFFNESS, DAMPING = "contacts.0.law.stiffness", "contacts.0.law.damping"
ALL = (
    MASS, "bodies.rod.length", "bodies.rod.area", "bodies.rod.material.young", "bodies.rod.material.density", VELOCITY
)  # fmt: skip
VALUES = (2.133, 0.3, 9e-4, 2.1e11, 7900.0, 1.0)
SAMPLES = 200
NUMBERS = np.random.default_rng(7)


@pytest.fixture(scope="module")
def hard() -> il.Case:
    return il.load_case("axial_impact").method("continuous").with_("solve.duration", 3.5e-4).with_("probes", [])


@pytest.fixture(scope="module")
def cushioned(hard) -> il.Case:
    return hard.with_("contacts.0.law", {"kind": "penalty", "stiffness": 2e8, "damping": 2000.0})


def coloured(count: int, correlated: float, seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).standard_normal(count)
    for k in range(1, count):
        noise[k] = correlated * noise[k - 1] + math.sqrt(1.0 - correlated**2) * noise[k]
    return noise


def measured(case: il.Case, noise: float = 0.02, seed: int = 0, correlated: float = 0.0, **keys) -> il.Signal:
    times = (np.arange(SAMPLES) + 0.5) * 3.4e-4 / SAMPLES
    empty = il.Signal(FORCE, times, 0.0 * times)
    clean = Means(il.run(case), FORCE).over(empty.edges, 0.0)
    return il.Signal(FORCE, times, clean + noise * clean.max() * coloured(SAMPLES, correlated, seed), **keys)


def test_intervals_of_a_linear_problem_are_those_of_the_textbook(hard):
    # the force is the velocity times a signal that does not depend on it: a straight line with an offset
    signal = measured(hard)
    found = il.fit(hard, signal, {VELOCITY: (0.0, 5.0)}, offset="free", intervals="profile")
    shape = Means(il.run(hard), FORCE).over(signal.edges, 0.0)
    design = np.stack([shape, np.ones(SAMPLES)], axis=1)
    solution, squares, *_ = np.linalg.lstsq(design, signal.values, rcond=None)
    covariance = squares[0] / (SAMPLES - 2) * np.linalg.inv(design.T @ design)
    halves = student.ppf(0.975, SAMPLES - 2) * np.sqrt(np.diag(covariance))
    for path, value, half in zip((VELOCITY, f"offset of {FORCE}"), solution, halves, strict=True):
        row = found[path]
        assert row.value == pytest.approx(value, abs=1e-4 * half)
        assert (row.lower, row.upper) == pytest.approx((value - half, value + half), abs=1e-3 * half)
    assert found[VELOCITY].intervals["profile"] == pytest.approx(
        (solution[0] - halves[0], solution[0] + halves[0]), abs=2e-3 * halves[0]
    )


def line(noise: np.ndarray) -> Loss:
    """Return the loss of a constant and a slope under some noise."""
    design = np.stack([np.ones(len(noise)), np.linspace(-1.0, 1.0, len(noise))], axis=1)
    free = np.full(2, np.inf)
    return Loss(lambda x: design @ x - noise, lambda _: design, -free, free)


def test_the_profile_of_a_parabola_is_that_parabola():
    loss = line(NUMBERS.standard_normal(50))
    solution = loss.least(np.zeros(2)).x
    found = profile(loss, 1, solution, 1.0, 2.0, 0.1)
    curvature = np.sum(np.linspace(-1.0, 1.0, 50) ** 2)
    assert found.rise == pytest.approx(curvature * (found.x - solution[1]) ** 2, abs=1e-9)
    assert found.upper - solution[1] == pytest.approx(2.0 / math.sqrt(curvature), rel=1e-3)
    assert found.better is None


def test_a_profile_is_one_sided_where_the_effect_vanishes():
    times = np.linspace(0.0, 1.0, 40)
    low, high = np.array([0.0]), np.array([40.0])
    loss = Loss(
        lambda x: np.exp(-x[0]) * times - 0.01 * times,
        lambda x: -np.exp(-x[0]) * times[:, None], low, high,
    )  # fmt: skip
    solution = loss.least(np.array([3.0])).x
    found = profile(loss, 0, solution, 0.05, 2.0, 1.0)
    assert 0.0 < found.lower < solution[0]
    assert math.isinf(found.upper)
    assert found.x[-1] == 40.0


def test_a_fit_without_noise_has_narrow_intervals(cushioned, tmp_path):
    signal = measured(cushioned, 0.0)
    found = il.fit(cushioned.with_(MASS, 2.3), signal, {MASS: (1.0, 4.0)}, intervals="profile,bootstrap", resamples=40)
    for lower, upper in found[MASS].intervals.values():
        assert lower == pytest.approx(2.133, rel=1e-6)
        assert upper == pytest.approx(2.133, rel=1e-6)
    found.write(tmp_path)
    with pytest.raises(il.CaseError, match="determine 1 number"):
        found.plot("correlations")


def test_a_profile_finds_a_better_solution():
    loss = Loss(
        lambda x: np.array([(x[0] ** 2 - 1.0), 0.3 * (x[0] - 1.0)]),
        lambda x: np.array([[2.0 * x[0]], [0.3]]), np.array([-3.0]), np.array([3.0]),
    )  # fmt: skip
    found = profile(loss, 0, loss.least(np.array([-1.0])).x, 0.6, 2.0, 0.2)
    assert found.better is not None
    assert loss.least(found.better).x[0] == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(
    "keys", [{"intervals": "profile,bootstrap", "resamples": 40}, {"noise": "ar1"}, {"loss": "huber"}]
)
def test_a_number_without_an_effect_has_no_interval(cushioned, tmp_path, keys):
    document, far = cushioned.document.data, "contacts.1.gap"
    away = il.Case.from_dict(
        {
            **document,
            "bodies": {**document["bodies"], "ball": {"kind": "mass", "mass": 1.0}, "wall": {"kind": "wall"}},
            "contacts": [
                *document["contacts"],
                {"between": ["ball", "wall"], "gap": 0.01, "law": {"kind": "penalty", "stiffness": 1e8}},
            ],
        }
    )
    signal = measured(away)
    alone = il.fit(away, signal, {STIFFNESS: (5e7, 8e8)}, **keys)
    found = il.fit(away, signal, {STIFFNESS: (5e7, 8e8), far: (5e-3, 2e-2)}, **keys)
    assert found[far].note == "not determined"
    for lower, upper in found[far].intervals.values():
        assert lower in (0.0, -math.inf)
        assert math.isinf(upper)
    assert found.undetermined == ("not determined by the signals: gap; its interval is infinite",)
    known, wanted = (each[STIFFNESS] for each in (found, alone))
    assert (known.lower, known.upper) == pytest.approx((wanted.lower, wanted.upper), rel=1e-3)
    if "intervals" in keys:
        found.write(tmp_path)


def test_a_stiff_contact_has_an_interval_without_upper_end(hard):
    stiff = hard.with_("contacts.0.law", {"kind": "penalty", "stiffness": 1e13, "damping": 0.0})
    found = il.fit(stiff, measured(stiff, 0.05), {STIFFNESS: (1e9, 1e16)}, intervals="profile")
    lower, upper = found[STIFFNESS].intervals["profile"]
    assert 1e11 < lower < 1e13
    assert math.isinf(upper)
    assert "above" in str(found)


def test_blocks_are_as_long_as_residuals_correlate():
    lengths = [[block_length(coloured(400, correlated, seed)) for seed in range(20)] for correlated in (0.0, 0.6, 0.9)]
    white, some, much = map(np.median, lengths)
    assert white == 1
    assert 3 <= some < much


def test_the_bootstrap_of_correlated_residuals_is_wider_and_right():
    for correlated, wider in ((0.0, 1.0), (0.6, math.sqrt(1.6 / 0.4))):
        found = []
        for seed in range(12):
            loss = line(coloured(1000, correlated, seed))
            drawn = bootstrap(loss, loss.least(np.zeros(2)).x, [1000], 60, seed)
            found.append(drawn.solutions[:, 0].std())
        # the deviation of a mean of n samples is 1/sqrt(n), and sqrt((1 + r)/(1 - r)) times that where they correlate
        assert np.mean(found) * math.sqrt(1000) == pytest.approx(wider, rel=0.15)


def test_a_bootstrap_is_the_same_for_the_same_seed(cushioned):
    signal = measured(cushioned, seed=1)
    one, again, other = (
        il.fit(cushioned, signal, {STIFFNESS: (5e7, 8e8)}, intervals=["bootstrap"], resamples=50, seed=seed)
        for seed in (3, 3, 4)
    )
    ends = [found[STIFFNESS].intervals["bootstrap"] for found in (one, again, other)]
    assert ends[0] == ends[1] != ends[2]
    half = 0.5 * (one[STIFFNESS].upper - one[STIFFNESS].lower)
    assert ends[0] == pytest.approx((one[STIFFNESS].lower, one[STIFFNESS].upper), abs=0.5 * half)
    assert one.to_dict()["bootstrap"] == {"resamples": 50, "seed": 3, "blocks": [1]}


def test_products_that_one_force_determines(hard):
    bounds = {path: (value / 5.0, 5.0 * value) for path, value in zip(ALL, VALUES, strict=True)}
    found = il.fit(hard.with_(MASS, 2.4), measured(hard), bounds, intervals="profile,bootstrap", resamples=40)
    assert all(ends == (0.0, math.inf) for path in ALL for ends in found[path].intervals.values())
    assert all(len(curve.values) > 4 and curve.rise.max() < 1.0 for curve in found.profiles)  # flat
    rows = np.array([[product.powers.get(path, 0) for path in ALL] for product in found.determined])
    # A^2 E rho v0^2, L^2 rho/E and rho A L/M span the same products
    expected = np.array([[0, 0, 2, 1, 1, 2], [0, 2, 0, -1, 1, 0], [-1, 1, 1, 0, 1, 0]])
    assert rows.shape == (3, 6)
    assert np.linalg.matrix_rank(rows) == np.linalg.matrix_rank(np.vstack([rows, expected])) == 3
    for product, row in zip(found.determined, rows, strict=True):
        assert product.lower < np.prod(np.array(VALUES) ** row) < product.upper
        assert product.upper < 1.05 * product.lower
        assert product.text in found.undetermined[0]


def test_gain_and_velocity_are_not_distinguished(cushioned, tmp_path):
    found = il.fit(cushioned, measured(cushioned), {VELOCITY: (0.2, 5.0), STIFFNESS: (5e7, 8e8)}, gain="free")
    assert [product.powers for product in found.determined] == [{VELOCITY: 1, f"gain of {FORCE}": 1}]
    assert math.isinf(found[VELOCITY].upper)
    assert math.isinf(found[f"gain of {FORCE}"].upper)
    assert found[STIFFNESS].upper < 2.2e8
    found.write(tmp_path)
    text = (tmp_path / "fit.html").read_text(encoding="utf-8")
    words = "Not determined by the signals: velocity and gain; their intervals are infinite."
    assert f"{words} Only {found.determined[0].text} is determined." in text
    assert text.count("<td>infinite</td>") == 2


def test_names_and_powers():
    assert short_names(["bodies.a.mass", "bodies.b.mass", "contacts.0.gap"]) == ["a.mass", "b.mass", "gap"]
    assert named([2, 0, -1, -1], ["length", "area", "young", "mass"]) == "length^2/(young mass)"
    way = np.array([[1.0, 2.0, 0.0]]) / math.sqrt(5.0)
    assert {tuple(row) for row in powers(way).tolist()} == {(0, 0, 1), (2, -1, 0)}
    assert len(powers(np.array([[math.pi, -1.0]]) / math.hypot(math.pi, 1.0))) == 0


def test_correlated_residuals_give_both_intervals(cushioned):
    found = il.fit(cushioned, measured(cushioned, 0.02, 5, 0.9), {STIFFNESS: (5e7, 8e8)}, intervals="profile")
    row = found[STIFFNESS]
    plain, wide = (np.diff(np.log(row.intervals[kind]))[0] for kind in ("jacobian", "widened"))
    assert wide / plain == pytest.approx(math.sqrt((1 + found.autocorrelation) / (1 - found.autocorrelation)), rel=1e-9)
    assert (row.lower, row.upper) == row.intervals["widened"]
    assert np.diff(np.log(row.intervals["profile"]))[0] == pytest.approx(wide, rel=0.1)
    assert "have a correlation" in found.warnings[0]
    assert "widened" in str(found)
    assert set(found.to_dict()["parameters"][0]["intervals"]) == {"jacobian", "widened", "profile"}


def test_an_edge_inside_the_interval_is_named(hard):
    # the second contact vanishes where the mass of the rod is 1.0107012 that of the hammer
    found = il.fit(hard.with_(MASS, 2.2), measured(hard, 0.05), {MASS: (1.0, 4.0)})
    [warned] = [text for text in found.warnings if "sequence of contacts" in text]
    edge = float(re.search(r"at about ([\d.]+) kg", warned)[1])
    assert edge == pytest.approx(9e-4 * 0.3 * 7900.0 / 1.010701206637, rel=2e-3)
    assert "near an edge" in found[MASS].note
    clean = il.fit(hard.with_(MASS, 1.0), measured(hard.with_(MASS, 1.0), 0.02), {MASS: (0.5, 4.0)})
    assert not clean.warnings


def test_a_fit_above_the_given_noise_is_warned_of(cushioned):
    clean = measured(cushioned)
    size = 0.02 * measured(cushioned, 0.0).values.max()
    right, small = (
        il.fit(
            cushioned,
            il.Signal(FORCE, clean.time, clean.values, std=np.full(SAMPLES, std)),
            {STIFFNESS: (5e7, 8e8)},
            noise="std",
        )
        for std in (size, size / 3.0)
    )
    assert not right.warnings
    assert "times the given standard deviations" in small.warnings[0]
    widths = [np.diff(np.log((found[STIFFNESS].lower, found[STIFFNESS].upper)))[0] for found in (right, small)]
    assert widths[1] == pytest.approx(widths[0], rel=0.1)


class Parts(HTMLParser):
    """Ids of figures, cells of the table, addresses and texts of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.figures: list[str] = []
        self.cells: list[str] = []
        self.addresses: list[str] = []
        self.command = ""
        self._in = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = dict(attributes)
        self._in = "command" if given.get("class") == "again" else tag
        if tag == "figure":
            self.figures.append(str(given["id"]))
        self.addresses += [str(given[name]) for name in ("href", "src") if given.get(name)]

    def handle_data(self, text: str) -> None:
        if self._in == "td":
            self.cells.append(text)
        elif self._in == "command" and not self.command:
            self.command = text
        self._in = ""


def test_the_page_has_its_parts_and_its_command_repeats_the_fit(cushioned, tmp_path, monkeypatch):
    signal = measured(cushioned)
    (tmp_path / "case.yaml").write_text(cushioned.with_(STIFFNESS, 1.6e8).to_yaml(), encoding="utf-8")
    rows = [f"{1e6 * t:.9g},{1e-3 * f:.9g}" for t, f in zip(signal.time, signal.values, strict=True)]
    (tmp_path / "data.csv").write_text("\n".join(["time [us], force [kN]", *rows]), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    command = [
        "fit",
        "case.yaml",
        "data.csv",
        "--signal",
        f"force [kN]={FORCE}",
        "--parameters",
        f"{STIFFNESS}=5e7:8e8",
    ]
    command += ["--parameters", f"{MASS}=1 kg:4 kg", "--intervals", "profile,bootstrap", "--resamples", "60"]
    done = invoke(*command, "--out", "out")
    assert done.exit_code == 0, done.output
    page = Parts((tmp_path / "out" / "fit.html").read_text(encoding="utf-8"))
    assert page.figures == ["signals", "autocorrelation", "profiles", "correlations"]
    assert all((tmp_path / "out" / "figures" / f"{name}.png").stat().st_size > 5000 for name in page.figures)
    assert "".join(page.cells).count("MN/m") == 1
    for address in page.addresses:
        assert address.startswith(("data:", "#")) or (tmp_path / "out" / address).exists(), address
    again = shlex.split(page.command.replace("DIR", "again"))
    assert invoke(*again[1:]).exit_code == 0
    first, second = (json.loads(Path(name, "fit.json").read_text())["parameters"] for name in ("out", "again"))
    assert first == second
    with Path("out", "parameters.csv").open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert [row["interval"] for row in table] == ["jacobian", "profile", "bootstrap"] * 2
    assert float(table[0]["value"]) == first[0]["value"]
    assert float(table[1]["upper"]) == first[0]["intervals"]["profile"][1]


def test_a_page_of_two_signals(cushioned, tmp_path):
    two = cushioned.with_("probes", [{"body": "rod", "at": 0.15, "quantity": "strain"}])
    history, force = il.run(two), measured(cushioned)
    strain = Means(history, "strain:rod@0.15").over(force.edges, 0.0)
    signals = [force, il.Signal("strain:rod@0.15", force.time, strain + 1e-6 * NUMBERS.standard_normal(SAMPLES))]
    found = il.fit(two, signals, {MASS: (1.0, 4.0), "bodies.rod.area": (4e-4, 2e-3), STIFFNESS: (5e7, 8e8),
                                  DAMPING: (500.0, 8000.0), VELOCITY: (0.2, 5.0)})  # fmt: skip
    found.write(tmp_path)
    text = (tmp_path / "fit.html").read_text(encoding="utf-8")
    assert "strain" in text
    assert len(found.plot().axes) == 4
    assert not found.undetermined


@pytest.mark.parametrize(("keys", "said"), [({"intervals": "profil"}, "profile"), ({"resamples": 3}, "40")])
def test_bad_intervals_are_refused(cushioned, keys, said):
    with pytest.raises(il.CaseError, match=said):
        il.fit(cushioned, measured(cushioned), {STIFFNESS: (5e7, 8e8)}, **keys)
