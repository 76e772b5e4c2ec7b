"""Uncertain numbers: distributions, designs and estimators against known answers, and refusals before the first run."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.stats

import impactlab as il
from impactlab.sweeps import engines, points
from impactlab.uncertainties import statistics
from impactlab.uncertainties.design import SCRAMBLINGS, design
from impactlab.uncertainties.distributions import read_uncertain, read_vary
from impactlab.uncertainties.records import Estimate, Share, least_certain
from tests.cases.support import CASES
from tests.support import invoke

MASS, SPEED, GAP = "bodies.hammer.mass", "bodies.hammer.velocity", "contacts.0.gap"


@pytest.fixture(scope="module")
def case() -> il.Case:
    return il.load_case("axial_impact").method("continuous")


def shape(case: il.Case, given: Any, path: str = MASS) -> Any:
    [found] = read_uncertain(case, {path: given})
    return found.shape


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ("normal(2.133 kg, 1 %)", scipy.stats.norm(2.133, 0.02133)),
        ("normal(2133 g, 20 g)", scipy.stats.norm(2.133, 0.02)),
        ("uniform(2, 2500 g)", scipy.stats.uniform(2.0, 0.5)),
        (scipy.stats.gamma(4.0, scale=0.5), scipy.stats.gamma(4.0, scale=0.5)),
    ],
)
def test_a_distribution_is_the_one_of_scipy_in_si(case, given, wanted):
    chances = np.array([0.001, 0.3, 0.5, 0.99])
    assert shape(case, given).ppf(chances) == pytest.approx(wanted.ppf(chances), rel=1e-12)


def test_mean_and_deviation_of_a_lognormal_number_are_its_own(case):
    found = shape(case, "lognormal(2 kg, 25 %)")
    assert (found.mean(), found.std()) == pytest.approx((2.0, 0.5), rel=1e-12)
    assert found.ppf(1e-12) > 0.0
    assert shape(case, "normal(-2 m/s, 10 %)", SPEED).std() == pytest.approx(0.2)


@pytest.mark.parametrize("form", ["text", "mapping", "file"])
def test_a_table_gives_each_value_as_often_as_its_weight(case, form, tmp_path):
    file = tmp_path / "masses.csv"
    file.write_text("other [m],mass [g],weight\n7,3000,1\n8,1000,2\n9,2000,1\n", encoding="utf-8")
    given = {
        "text": "table(3 kg: 1, 1 kg: 2, 2000 g: 1)",
        "mapping": {3.0: 1, 1.0: 2, "2000 g": 1},
        "file": f"table({file}, mass)",
    }
    found = shape(case, given[form])
    assert found.ppf([0.01, 0.5, 0.51, 0.75, 0.76, 0.999]).tolist() == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]
    assert found.cdf([0.5, 1.0, 2.5, 3.0]).tolist() == [0.0, 0.5, 0.75, 1.0]
    assert (found.mean(), found.std()) == pytest.approx((1.75, math.sqrt(0.6875)))
    assert shape(case, [1.0, 2.0, 3.0, 6.0]).mean() == 3.0  # samples, with equal weights


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({1.0: 0.2, 2.0: 0.8}, "table(1.0: 0.2, 2.0: 0.8)"),
        ({"1 kg": 1, "2 kg": 3}, "table(1 kg: 1, 2 kg: 3)"),
        ([1.0, 2.0], "table(1.0, 2.0)"),
        ({1.0 + 0.1 * k: 1.0 for k in range(9)}, "table of 9 weighted values"),
        ([1.0 + 0.1 * k for k in range(19)], "table of 19 values"),
    ],
)
def test_a_table_shows_its_weights(case, given, text):
    [found] = read_uncertain(case, {MASS: given})
    assert found.text == text


@pytest.mark.parametrize("given", ["uniform(20, 60)", "normal(40, 5)", scipy.stats.uniform(20.0, 40.0)])
def test_a_whole_number_takes_no_continuous_distribution(given):
    meshed = il.load_case("axial_impact").with_("solve.model", {"kind": "finite_element", "elements": 40})
    with pytest.raises(il.CaseError, match="takes only whole numbers") as raised:
        read_uncertain(meshed, {"solve.model.elements": given})
    assert "table" in raised.value.remedy


@pytest.mark.parametrize("given", ["table(20: 1, 40: 2)", {20: 1, 40: 2}, [20, 40], scipy.stats.randint(20, 40)])
def test_a_whole_number_takes_whole_values(given):
    meshed = il.load_case("axial_impact").with_("solve.model", {"kind": "finite_element", "elements": 40})
    [found] = read_uncertain(meshed, {"solve.model.elements": given})
    assert found.mean > 20.0


def test_samples_are_sobol_points_that_the_seed_fixes(case):
    vary = read_uncertain(case, {MASS: "uniform(1, 2)", SPEED: "uniform(1, 2)"})
    found, again, other = (design(vary, 1024, seed, indices=True) for seed in (1, 1, 2))
    assert found.points.axes == again.points.axes
    assert found.points.axes[0].values != other.points.axes[0].values
    alone = design(vary, 1024, 1, indices=False)
    size = 1024 // SCRAMBLINGS
    for axis, own in zip(found.points.axes, alone.points.axes, strict=True):
        values = np.array(axis.values).reshape(found.shape)
        assert np.array_equal(values[0].ravel(), own.values)  # the same samples without indices
        for each in values[0]:  # one sample in each of as many equal intervals
            assert np.array_equal(np.sort(np.floor((each - 1.0) * size)), np.arange(size))
    masses, speeds = (np.array(axis.values).reshape(found.shape) for axis in found.points.axes)
    assert np.array_equal(masses[2], masses[1])  # the block of the mass: A, with the mass from B
    assert np.array_equal(speeds[2], speeds[0])
    assert np.array_equal(masses[3], masses[0])
    assert np.array_equal(speeds[3], speeds[1])


def varied(case: il.Case, count: int) -> Any:
    """Return so many numbers of the case that lie between 1 and 2."""
    return read_uncertain(case, dict.fromkeys((MASS, SPEED, GAP)[:count], "uniform(1, 2)"))


def sets_of(vary: Any, samples: int, seed: int, spread: tuple[float, ...]) -> list[np.ndarray]:
    """Return the values of exp(spread . z), z normal, at the sets of Saltelli's design, (blocks, points) each."""
    made = design(vary, samples, seed, indices=True)
    drawn = [scipy.stats.norm.ppf(np.array(axis.values).reshape(made.shape) - 1.0) for axis in made.points.axes]
    values = np.exp(np.tensordot(spread, drawn, axes=1))
    return [values[:, number] for number in range(SCRAMBLINGS)]


def test_indices_are_those_of_scipy(case):
    sets = sets_of(varied(case, 2), 1024, 1, (0.3, 0.2))
    a, b, *mixed = np.concatenate(sets, axis=-1)
    wanted = scipy.stats.sobol_indices(
        func={"f_A": a[None], "f_B": b[None], "f_AB": np.array(mixed)[:, None]}, n=a.size
    )
    found = statistics.sobol_indices(sets)
    assert [first.value for first, _ in found] == pytest.approx(wanted.first_order.ravel(), rel=1e-12)
    assert [total.value for _, total in found] == pytest.approx(wanted.total_order.ravel(), rel=1e-12)


def test_intervals_of_95_percent_hold_the_true_value_in_about_95_of_100(case):
    """Of a product of lognormal numbers all estimates are known in closed form."""
    spread = (0.3, 0.2)
    squares = np.square(spread)
    variance, width = np.expm1(squares.sum()), math.sqrt(squares.sum())
    wanted: dict[Any, float] = {"mean": math.exp(0.5 * width**2)}
    wanted |= {("first", k): np.expm1(own) / variance for k, own in enumerate(squares)}
    wanted |= {("total", k): 1.0 - np.expm1(other) / variance for k, other in enumerate(squares[::-1])}
    quantile = {percent: math.exp(width * scipy.stats.norm.ppf(0.01 * percent)) for percent in (2.0, 5.0, 50.0, 95.0)}
    shares = (0.0005, 0.14, 0.85515)
    hits: dict[Any, int] = {}
    vary = varied(case, len(spread))
    for seed in range(100):
        sets = sets_of(vary, 256, seed, spread)
        own = [each[0] for each in sets]
        found: dict[Any, statistics.Estimate] = {"mean": statistics.estimate(lambda of: float(of.mean()), own)}
        for k, (first, total) in enumerate(statistics.sobol_indices(sets)):
            found |= {("first", k): first, ("total", k): total}
        found |= {percent: statistics.percentile(percent, own) for percent in quantile}
        for share in shares:
            limit = math.exp(width * scipy.stats.norm.ppf(share))
            found[share] = statistics.probability([each < limit for each in own])
        for key, truth in {**wanted, **quantile, **{share: share for share in shares}}.items():
            hits[key] = hits.get(key, 0) + (found[key].lower <= truth <= found[key].upper)
    assert min(hits.values()) >= 85, hits
    assert sum(hits.values()) >= 93 * len(hits), hits


@pytest.mark.parametrize(("width", "size", "least"), [(0.3, 1, 90), (0.8, 1, 86), (0.5, 3, 86)])
def test_intervals_of_a_deviation_hold_for_long_tails(case, width, size, least):
    """Intervals that are symmetric about the deviation hold it in 74 to 86 of 100 repetitions here."""
    truth = math.sqrt(np.expm1(size * width**2)) * math.exp(0.5 * size * width**2)
    vary = varied(case, size)
    found = [statistics.deviation([each[0] for each in sets_of(vary, 64, seed, [width] * size)]) for seed in range(200)]
    hits = sum(each.lower <= truth <= each.upper for each in found)
    assert hits >= 2 * least, hits


def test_a_deviation_without_a_scatter_is_known():
    assert statistics.deviation([np.full(4, 3.0)] * 16) == (0.0, 0.0, 0.0)
    two_values = statistics.deviation([np.array([-1.0, 1.0])] * 16)
    assert two_values == pytest.approx((1.0, 1.0, 1.0), rel=1e-15)


@pytest.mark.parametrize("number", [1.0, -2.5, 1e-9])
def test_the_interval_of_a_deviation_has_the_unit_of_its_values(number):
    sets = list(np.random.default_rng(1).lognormal(size=(16, 8)))
    one, other = statistics.deviation(sets), statistics.deviation([number * each for each in sets])
    assert other == pytest.approx([abs(number) * each for each in one], rel=1e-12)


@pytest.mark.parametrize(("percent", "samples"), [(1.0, 64), (1.0, 512), (5.0, 64), (5.0, 128), (99.0, 256)])
def test_an_interval_that_few_samples_do_not_reach_is_open_and_holds(percent, samples):
    truth, hits = scipy.stats.norm.ppf(0.01 * percent), 0
    for seed in range(400):
        drawn = np.random.default_rng(seed).standard_normal((SCRAMBLINGS, samples // SCRAMBLINGS))
        found = statistics.percentile(percent, list(drawn))
        hits += found.lower <= truth <= found.upper
        assert found.lower <= found.value <= found.upper
        outer = found.lower if percent < 50.0 else found.upper
        assert math.isinf(outer) == (samples < statistics.needed_samples(percent))
    assert hits >= 370  # 380 on average; 370 is 2.3 standard deviations below


def test_samples_that_a_percentile_takes():
    assert [statistics.needed_samples(percent) for percent in (1.0, 5.0, 50.0, 95.0, 99.0)] == [368, 72, 6, 72, 368]


def test_nothing_seen_is_no_proof(case):
    none = statistics.probability([np.zeros(256, bool)] * SCRAMBLINGS)
    assert (none.value, none.lower) == (0.0, 0.0)
    assert none.upper == pytest.approx(1.0 - 0.025 ** (1.0 / 4096))
    assert statistics.probability([np.ones(256, bool)] * SCRAMBLINGS).lower == pytest.approx(1.0 - none.upper)


@pytest.fixture
def no_run(monkeypatch):
    for module in (points, engines):
        monkeypatch.setattr(module, "row", lambda *_: pytest.fail("a run was started"))


@pytest.mark.parametrize(
    ("vary", "options", "path", "words"),
    [
        (MASS, [], "", "is not PATH=DISTRIBUTION"),
        (f"{MASS}=norml(2 kg, 1 %)", [], MASS, "Did you mean 'normal'?"),
        (f"{MASS}=2 kg", [], MASS, "is not a distribution"),
        (f"{MASS}=normal(2 kg)", [], MASS, "does not have two numbers"),
        (f"{MASS}=normal(2 kg, -1 %)", [], MASS, "'-1 %' is not above zero"),
        (f"{MASS}=normal(2 kg, 0 g)", [], MASS, "'0 g' is not above zero"),
        (f"{MASS}=normal(2 m, 1 %)", [], MASS, "'2 m' has a unit of another dimension"),
        (f"{MASS}=normal(2 kg, 1 m)", [], MASS, "'1 m' has a unit of another dimension"),
        (f"{MASS}=normal(-2 kg, 1 %)", [], MASS, "-2 kg is out of range"),
        (f"{MASS}=normal(nan, 1)", [], MASS, "not a finite number"),
        (f"{SPEED}=normal(0 m/s, 1 %)", [], SPEED, "'1 %' of a mean of zero"),
        (f"{SPEED}=lognormal(-1 m/s, 1 %)", [], SPEED, "a lognormal distribution with the mean -1"),
        (f"{MASS}=uniform(2, 1)", [], MASS, "a uniform distribution from 2 to 1"),
        (f"{GAP}=uniform(-1 mm, 1 mm)", [], GAP, "the gap is -0.001 m"),
        (f"{MASS}=table(2)", [], MASS, "a distribution without spread"),
        (f"{MASS}=table(1: 1, 2)", [], MASS, "is not a valid table"),
        (f"{MASS}=table(1: 1, 2: -1)", [], MASS, "a negative weight"),
        (f"{MASS}=table(1, -2)", [], MASS, "-2 kg is out of range"),
        (f"{MASS}=table(none.csv)", [], "", "cannot be read"),
        ("bodies.hammer.mas=normal(2 kg, 1 %)", [], "bodies.hammer", "Did you mean 'mass'?"),
        ("bodies.hammer.kind=normal(2 kg, 1 %)", [], "bodies.hammer.kind", "is not a kind of body"),
        (f"{MASS}=normal(2 kg, 1 %)", ["--vary", f"{MASS}=uniform(1, 2)"], MASS, "given twice"),
        (f"{MASS}=normal(2 kg, 1 %)", ["--set", f"{MASS}=3"], MASS, "--set gives, too"),
        (f"{MASS}=normal(2 kg, 1 %)", ["--samples", "1000"], "--samples", "balanced in sets of a power of two"),
        (f"{MASS}=normal(2 kg, 1 %)", ["--samples", "32"], "--samples", "32 samples are too few"),
        (f"{MASS}=normal(2 kg, 1 %)", ["--samples", "16777216"], "--samples", "1.68e+07 points; allowed: 1e+07"),
        (f"{MASS}=normal(2 kg, 1 %)", ["--seed", "-1"], "--seed", "-1 is not allowed"),
        (f"{MASS}=normal(2 kg, 1 %)", ["--percentiles", "5,100"], "--percentiles", "'5, 100'"),
        (f"{MASS}=normal(2 kg, 1 %)", ["--percentiles", "5,x"], "--percentiles", "'x' is not a number"),
        (f"{MASS}=normal(2 kg, 1 %)", ["--failed", "ignore"], "--failed", "'ignore' is not a way"),
        (f"{MASS}=normal(2 kg, 1 %)", ["--quantities", "restituton"], "", "Did you mean 'restitution'?"),
    ],
)
def test_bad_input_is_refused_with_path_and_remedy_and_nothing_is_written(vary, options, path, words, tmp_path, no_run):
    out = tmp_path / "out"
    arguments = ["uncertainty", str(CASES / "axial_impact.yaml"), "--method", "continuous", "--vary", vary, *options]
    found = invoke(*arguments, "--out", str(out), "--json")
    assert found.exit_code == 2
    fault = json.loads(found.stdout)["error"]
    assert words in fault["text"]
    assert (fault["path"] or "").startswith(path)
    assert fault["remedy"]
    assert not out.exists()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (3.0, "is not a distribution"),
        ([], "without values"),
        ((2.1, 0.02), "may be mean and deviation, two ends, or two values"),
        (scipy.stats.cauchy(2.0), "without a finite mean"),
        ({1.0: 0.0, 2.0: 0.0}, "none above zero"),
    ],
)
def test_an_object_that_is_no_distribution_is_refused(case, given, words):
    with pytest.raises(il.CaseError, match=words):
        read_uncertain(case, {MASS: given})
    with pytest.raises(il.CaseError, match="no number is uncertain"):
        read_uncertain(case, {})


def test_a_file_of_samples_names_its_columns(case, tmp_path: Path):
    file = tmp_path / "masses.csv"
    file.write_text("first [g],second [kg]\n1000,2\n3000,4\n", encoding="utf-8")
    for given, words in ((f"table({file})", "2 columns"), (f"table({file}, third)", "no column 'third'")):
        with pytest.raises(il.CaseError, match=words) as raised:
            read_uncertain(case, {MASS: given})
        assert "first, second" in raised.value.remedy
    assert shape(case, f"table({file}, first)").mean() == 2.0
    assert read_vary(f"{MASS} = table({file}, first)") == (MASS, f"table({file}, first)")


def test_the_least_certain_numbers_of_contacts_come_first_and_links_are_left_out() -> None:
    shares = [Share("shaft", 0, Estimate(1.0)), Share("ram", 2, Estimate(0.9)), Share("ram", 3, Estimate(0.1)),
              Share("head", 3, Estimate(0.45))]  # fmt: skip
    assert least_certain(shares)[0].contact == "head"
    assert "shaft" not in {each.contact for each in least_certain(shares)}
    assert least_certain(shares[:1]) == shares[:1]  # nothing closes at all: that is the result
