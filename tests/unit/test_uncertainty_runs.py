"""Uncertainties of whole cases: the paper's case against its exact edge, power laws, failed points, kept folders."""

from __future__ import annotations

import json
import math
import re
import shlex
from typing import Any

import mpmath
import numpy as np
import pytest
import scipy.stats

import impactlab as il
from impactlab.sweeps import chunks, counts
from tests.support import ROOT, invoke

pytestmark = pytest.mark.slow  # batches and tangents take most of a minute each to compile

PAGE = (ROOT / "docs" / "uncertainty.md").read_text(encoding="utf-8")
MASS, SPEED, AREA, YOUNG = (
    "bodies.hammer.mass",
    "bodies.hammer.velocity",
    "bodies.rod.area",
    "bodies.rod.material.young",
)
GAP = "contacts.0.gap"
SIDES = ("below", "above")


@pytest.fixture(scope="module")
def case() -> il.Case:
    return il.load_case(ROOT / "cases" / "axial_impact.yaml").method("continuous")


@pytest.fixture(scope="module")
def paper(case) -> il.Uncertainty:
    return il.uncertainty(case, {MASS: "normal(2.133 kg, 1 %)"}, ["final_velocity", "first_opening"])


def edge() -> Any:
    """Return the mass ratio above which the paper's case has no second contact, from its waves in closed form."""
    exp = mpmath.exp

    def least_gap(alpha: Any) -> Any:
        beta = 2 * mpmath.mpf(alpha)
        c, a = 1 + exp(-beta), (2 + exp(-beta)) / (2 * beta)
        s = mpmath.findroot(lambda x: (c - 2 * beta * x) * exp(-beta * x) - exp(-beta * a), 0.13)
        opened = mpmath.quad(lambda x: exp(-beta * a) - exp(-beta * x), [a, 1])
        return opened + mpmath.quad(lambda x: exp(-beta * a) - (c - 2 * beta * x) * exp(-beta * x), [0, s])

    with mpmath.workdps(30):
        return mpmath.findroot(least_gap, 1.0107)


def test_the_probability_of_a_second_contact_is_the_exact_one(paper, case):
    alpha = float(edge())
    assert alpha == pytest.approx(1.010701206637, rel=1e-12)
    exact = scipy.stats.norm.cdf(100.0 * (1.0 - 1.0 / alpha))
    assert round(exact, 5) == 0.85515
    found = paper.probability(2)
    assert found.lower <= exact <= found.upper
    assert found.upper - found.lower < 0.002
    assert paper.probability(1).value == pytest.approx(1.0 - found.value)
    assert paper.probability(3).upper == pytest.approx(1.0 - 0.025 ** (1.0 / 4096))
    more = il.uncertainty(case, {MASS: "normal(2.133 kg, 1 %)"}, ["contacts"], samples=65536, seed=2).probability(2)
    assert more.lower <= exact <= more.upper
    assert more.error < 0.2 * found.error


def test_the_linear_estimate_is_shown_to_be_wrong_and_why(paper, case):
    [words] = paper.warnings
    place, away, beyond = map(
        float, re.findall(r"below (\S+) kg, (\S+) standard .* values beyond is (\S+)\.", words)[0]
    )
    assert place == pytest.approx(2.133 / float(edge()), rel=1e-5)
    assert away == pytest.approx(100.0 * (1.0 - 1.0 / float(edge())), rel=5e-3)
    assert beyond == pytest.approx(1.0 - 0.85515, abs=1e-3)
    assert words.endswith("the linear estimate is wrong.")
    velocity, opening = paper.find("final_velocity", "hammer"), paper.find("first_opening")
    slope = il.sensitivities(case, [MASS], ["final_velocity"]).find("final_velocity", MASS, "hammer")
    assert velocity.linear_mean == slope.value
    assert velocity.linear_deviation == pytest.approx(abs(slope.derivative) * 0.02133, rel=1e-12)
    assert velocity.deviation.upper < 0.9 * velocity.linear_deviation
    # The slowest exit of all is that at the edge, with one contact: -2 exp(-a beta).
    beta = 2.0 * float(edge())
    slowest = -2.0 * math.exp(-1.0 - 0.5 * math.exp(-beta))
    samples = paper.data["final_velocity"].sel(body="hammer").values
    assert samples.max() <= slowest * (1.0 - 1e-12)
    assert samples.max() == pytest.approx(slowest, rel=1e-5)
    assert opening.deviation.value == pytest.approx(opening.linear_deviation, rel=0.01)  # it knows no edge


def test_indices_of_a_product_of_powers_are_exact(case):
    """Until the first echo the peak force is A sqrt(E rho) v0."""
    sizes = {AREA: 0.2, SPEED: 0.15, YOUNG: 0.15}
    vary = {
        AREA: "lognormal(9 cm^2, 20 %)",
        SPEED: "lognormal(1 m/s, 15 %)",
        YOUNG: scipy.stats.lognorm(math.sqrt(math.log1p(0.15**2)), scale=2.1e11),
    }
    found = il.uncertainty(case.with_("solve.duration", "71 us"), vary, ["peak_force"], samples=256, seed=3)
    powers = {AREA: 1.0, SPEED: 1.0, YOUNG: 0.5}
    squares = {path: powers[path] ** 2 * math.log1p(size**2) for path, size in sizes.items()}
    whole = math.expm1(sum(squares.values()))
    for path, own in squares.items():
        index = found.index("peak_force", path)
        others = math.expm1(sum(squares.values()) - own)
        for of, truth in ((index.first, math.expm1(own) / whole), (index.total, 1.0 - others / whole)):
            assert abs(of.value - truth) <= 1.5 * of.error  # of 95 % intervals some must fail
            assert of.error < 0.15
    peak = found.find("peak_force")
    middle = 9e-4 / math.hypot(1.0, 0.2) / math.hypot(1.0, 0.15) * math.sqrt(2.1e11 * 7900.0)
    for percent, of in zip((5.0, 50.0, 95.0), peak.percentiles, strict=True):
        truth = middle * math.exp(math.sqrt(sum(squares.values())) * scipy.stats.norm.ppf(0.01 * percent))
        assert abs(of.value - truth) <= 1.5 * max(of.upper - of.value, of.value - of.lower)
    means = sum(power**2 * size**2 for power, size in ((1.0, 0.2), (1.0, 0.15)))
    share = found.index("peak_force", AREA).linear
    young = 0.25 * (vary[YOUNG].std() / vary[YOUNG].mean()) ** 2
    assert share == pytest.approx(0.04 / (means + young), rel=1e-9)


def test_points_without_values_stop_the_indices_and_are_named(case):
    vary = {MASS: "normal(1 kg, 60 %)", SPEED: "uniform(0.5 m/s, 1 m/s)"}
    found = il.uncertainty(case, vary, ["peak_force"], samples=64)
    failed = counts(found.data)["refused"]
    masses = found.data[MASS].values
    assert failed == np.count_nonzero(masses <= 0.0) > 0
    assert np.isnan([index.first.value for index in found.indices]).all()
    assert f"{failed} of 256 points have no values (refused), all with {MASS} below" in found.warnings[0]
    assert "is out of range" in found.warnings[0]
    assert "given by the distribution" in found.warnings[0]
    assert SPEED not in found.warnings[0]
    assert "failed='leave_out'" in found.warnings[-1]
    peak = found.find("peak_force")
    values = found.data["peak_force"].values[:64, 0]
    assert peak.samples == np.count_nonzero(np.isfinite(values)) < 64
    assert peak.mean.value == pytest.approx(np.nanmean(values))
    unseen = found.probability(7)  # beyond it less than 0.025 of so many samples with a value would show it never
    assert (1.0 - unseen.upper) ** peak.samples == pytest.approx(0.025)
    left = il.uncertainty(case, vary, ["peak_force"], samples=64, failed="leave_out")
    assert all(math.isfinite(index.total.lower) for index in left.indices)
    assert left.index("peak_force", SPEED).total.value > 0.8
    assert left.warnings == found.warnings[:-1]


def test_samples_that_the_case_refuses_leave_the_others_in_a_batch(case):
    found = il.uncertainty(case, {GAP: "normal(0.1 mm, 0.05 mm)"}, ["final_momentum"], samples=256)
    gaps, engine = found.data[GAP].values, found.data["engine"].values
    assert np.array_equal(found.data["status"].values == chunks.STATUSES.index("completed"), gaps >= 0.0)
    assert np.array_equal(engine == chunks.ENGINES.index("batch"), gaps >= 0.0)
    assert np.any(gaps < 0.0)
    momentum = found.data["final_momentum"].sel(body="hammer").values
    for number in (int(np.nanargmax(gaps)), int(np.argmin(np.where(gaps < 0.0, np.inf, gaps)))):
        history = il.run(case.with_(GAP, float(gaps[number])))
        own = history.evaluate(np.array([history.duration]), "momentum:hammer")[0]
        assert momentum[number] == pytest.approx(own, rel=1e-12)


def test_a_quantity_without_a_value_is_missed_by_name(case):
    found = il.uncertainty(
        case.with_("solve.duration", "179 us"), {MASS: "normal(2.133 kg, 1 %)"}, ["first_opening"], samples=64
    )
    opening = found.find("first_opening")
    assert 0 < opening.samples < 64
    assert any("No value at some samples: first_opening hammer|rod.left." in words for words in found.warnings)


def test_a_folder_keeps_points_and_gives_the_same_again(case, tmp_path, monkeypatch):
    vary = {MASS: "normal(2.133 kg, 1 %)", SPEED: "uniform(0.9 m/s, 1.1 m/s)"}
    options: dict[str, Any] = {"quantities": ["final_velocity"], "samples": 64, "out": tmp_path / "out"}
    whole = il.uncertainty(case, vary, ["final_velocity"], samples=64)
    put = chunks.Folder.put

    def interrupted(folder: Any, chunk: Any) -> None:
        if list(folder.path.glob("chunks/*.npz")):
            raise KeyboardInterrupt
        put(folder, chunk)

    with monkeypatch.context() as patched:
        patched.setattr("impactlab.sweeps.run.size_of_chunk", lambda *_: 100)
        patched.setattr(chunks.Folder, "put", interrupted)
        with pytest.raises(KeyboardInterrupt, match="100 of 256 points are kept"):
            il.uncertainty(case, vary, **options)
    part = il.uncertainty(case, vary, shard="2/2", **options)
    assert part.warnings == ("200 of 256 points are there. A call without the shard gives the estimates.",)
    assert not (tmp_path / "out" / "uncertainty.json").exists()
    assert part.spreads == ()
    found = il.uncertainty(case, vary, **options)
    assert found.to_dict() == whole.to_dict()
    written = json.loads((tmp_path / "out" / "uncertainty.json").read_text(encoding="utf-8"))
    assert written == json.loads(json.dumps(whole.to_dict()))
    assert {"sweep.nc", "table.csv", "case.yaml"} < {path.name for path in (tmp_path / "out").iterdir()}
    kept = il.open_sweep(tmp_path / "out")
    assert (kept.attrs["seed"], kept.attrs["samples"]) == (1, 64)
    assert json.loads(kept.attrs["distributions"]) == vary
    assert np.array_equal(kept["final_velocity"], found.data["final_velocity"])
    assert "Sobol indices" in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    with pytest.raises(il.CaseError, match="different: axes, the samples"):
        il.uncertainty(case, vary, **options, seed=2)


def test_a_stepped_case_has_its_edges_and_linear_estimate_too():
    stepped = il.load_case(ROOT / "cases" / "axial_impact.yaml")
    found = il.uncertainty(stepped, {MASS: "uniform(1.8 kg, 2.5 kg)"}, ["impulse", "contacts"], samples=64)
    edges = [float(words.split(side)[1].split()[0]) for words, side in zip(found.warnings[:2], SIDES, strict=True)]
    assert edges[0] < 2.15 < edges[1]
    for place in edges:
        before, after = (il.run(stepped.with_(MASS, place * (1.0 + side))).contacts for side in (-3e-4, 3e-4))
        assert len(before) != len(after)
    slope = il.sensitivities(stepped.with_(MASS, 2.15), [MASS], ["impulse"]).find("impulse", MASS)
    assert found.find("impulse").linear_deviation == pytest.approx(abs(slope.derivative) * 0.7 / math.sqrt(12.0))
    assert found.warnings[2].startswith("No linear estimate of contacts hammer|rod.left: ")


def test_a_linear_estimate_from_a_one_sided_derivative_is_marked():
    """The rod rests at the wall: a force on its far end presses it there, or pulls it away."""
    force = "bodies.rod.ends.left.force"
    rod = il.Rod(length=0.3, area=9e-4, material="steel", ends={"left": {"force": 0.0}})
    wall = il.Contact("rod.right", "wall", {"kind": "addition_deletion"})
    solve = {"duration": 3e-4, "model": {"kind": "continuous"}}
    pressed = il.Case(bodies={"rod": rod, "wall": il.Wall()}, contacts=[wall], solve=solve)
    found = il.uncertainty(pressed, {force: "normal(0 N, 1 kN)"}, ["impulse"], samples=64)
    assert found.find("impulse").linear_deviation == 0.0
    assert found.find("impulse").deviation.lower > 0.0
    start = "The linear estimate of impulse rod.right|wall holds on one side of the means alone: "
    assert f"{start}{force}: one-sided derivative (from below only)." in found.warnings


def test_a_channel_gives_a_band_over_time(case):
    times = np.linspace(1e-6, 5e-5, 20)
    found = il.uncertainty(
        case, {SPEED: "uniform(1 m/s, 2 m/s)"}, [il.Sampled("force:hammer|rod.left", times)], samples=64
    )
    force = il.run(case).evaluate(times, "force:hammer|rod.left")
    means = [each.mean.value for each in found.spreads]
    assert means == pytest.approx(1.5 * force, rel=1e-2)
    [axes] = found.plot("force:hammer|rod.left").axes
    assert axes.get_xlabel() == "time [\N{MICRO SIGN}s]"
    with pytest.raises(il.CaseError, match="no quantity 'impulse' to draw"):
        found.plot("impulse")


def test_both_forms_of_the_page_give_its_numbers(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(ROOT)
    first, second = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    [command] = re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL)
    names: dict[str, Any] = {}
    exec(first.replace('"exit_velocity.png"', repr(str(tmp_path / "exit_velocity.png"))), names)
    printed = capsys.readouterr().out
    result = invoke(*shlex.split(command)[1:])
    assert (result.exit_code, result.stdout) == (0, printed)
    found, probability = names["found"], names["found"].probability(2)
    page = " ".join(PAGE.split())
    said = f"{probability.value:.4f} (95 % interval {probability.lower:.4f} to {probability.upper:.4f})"
    assert f"Two contacts have a probability of {said}" in page
    assert found.warnings[0] in PAGE.replace("\n> ", " ")
    velocity = found.find("final_velocity", "hammer")
    slowest = found.data["final_velocity"].sel(body="hammer").values.max()
    assert f"the lowest possible exit speed is {-slowest:.4f} m/s" in page
    slower = scipy.stats.norm.sf(slowest, velocity.linear_mean, velocity.linear_deviation)
    assert f"it gives a probability of {100.0 * slower:.0f} % to lower speeds" in page
    assert f"deviation of {velocity.linear_deviation:.4f} instead of {velocity.deviation.value:.4f} m/s" in page
    exec(second, names)
    of = {path: names["found"].index("final_velocity", path, "hammer") for path in (MASS, SPEED, AREA)}
    assert f"mass and area have the largest shares of the variance of the exit velocity, {of[MASS].linear:.2f}" in page
    assert round(of[AREA].linear, 2) == round(of[MASS].linear, 2)
    assert f"the velocity has the largest, {of[SPEED].first.value:.2f}" in page
    assert of[MASS].total.lower > of[MASS].first.upper  # mass and area act together


def test_the_samples_that_a_percentile_takes_are_counted_with_those_that_fail(case):
    """Half of the gaps are negative, so twice as many samples are needed."""
    few, enough = (
        il.uncertainty(case, {GAP: "normal(0 mm, 0.1 mm)"}, ["impulse"], samples=samples, percentiles=[5.0])
        for samples in (128, 256)
    )
    [words] = [text for text in few.warnings if "percentile" in text]
    assert "takes 72 samples with a value, and there are fewer. Give --samples 256 or more." in words
    assert not any("percentile" in text for text in enough.warnings)


def test_a_case_without_a_contact_spreads_too():
    case = il.load_case("step_loaded_rod")
    found = il.uncertainty(case, {"bodies.rod.length": "normal(1 m, 1 %)"}, samples=64)
    assert [each.name for each in found.spreads] == ["final_velocity rod"]
    words = "No value of first_opening, impulse, peak_force and 1 more: the case has no contact."
    assert words in found.warnings
    assert not found.shares


def test_a_far_percentile_of_few_samples_is_open_and_names_the_number_needed(case):
    found = il.uncertainty(
        case, {MASS: "normal(2.133 kg, 1 %)"}, ["final_velocity"], samples=64, percentiles=[1.0, 50.0]
    )
    outer, middle = found.find("final_velocity").percentiles
    assert math.isinf(outer.lower)
    assert math.isfinite(outer.upper)
    assert math.isfinite(middle.error)
    [words] = [text for text in found.warnings if "percentile" in text]
    assert "The 1 % percentile of final_velocity hammer" in words
    assert "a closed one takes 368 samples with a value, and there are fewer. Give --samples 512 or more." in words
    assert "(below " in str(found)
    assert found.to_dict()["quantities"][0]["percentiles"][0]["lower"] is None
    panel = found.plot("final_velocity").axes[1]
    assert all(np.all(np.isfinite(line.get_xdata())) for line in panel.lines)
