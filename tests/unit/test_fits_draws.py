"""Draws of a fit are as wide as its intervals, correlate as its numbers do, and predict another case by a sweep."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from tests.support import invoke

pytestmark = pytest.mark.usefixtures("_no_figures")

STIFFNESS, MASS, VELOCITY = "contacts.0.law.stiffness", "bodies.hammer.mass", "bodies.hammer.velocity"
FORCE = "force:hammer|rod.left"
BOUNDS = {STIFFNESS: (2e7, 2e9), MASS: (0.5, 8.0)}
COUNT = 4000


@pytest.fixture(scope="module")
def case() -> il.Case:
    rod = il.Rod(length=0.3, area=9.0e-4, material={"young": 2.1e11, "density": 7900}, ends={"right": "clamped"})
    return il.Case(
        bodies={"hammer": il.Mass(2.133, velocity=1.0), "rod": rod},
        contacts=[il.Contact("hammer", "rod.left", {"kind": "penalty", "stiffness": 2e8})],
        solve={"duration": "0.35 ms", "model": {"kind": "continuous"}},
    )


def measured(case: il.Case, seed: int) -> il.Signal:
    times = np.linspace(0.0, 3.4e-4, 100)
    force = il.run(case).evaluate(times, FORCE)
    return il.Signal(FORCE, times, force + 1000.0 * np.random.default_rng(seed).standard_normal(100))


@pytest.fixture(scope="module")
def fitted(case) -> il.Fit:
    return il.fit(case, measured(case, 0), BOUNDS, shift=(-1e-5, 1e-5))


def test_draws_are_as_wide_as_the_intervals_and_correlate(fitted):
    drawn = fitted.draws(COUNT)
    assert list(drawn) == [STIFFNESS, MASS], "the shift is the instrument's"
    for path, values in drawn.items():
        inside = np.mean((values > fitted[path].lower) & (values < fitted[path].upper))
        assert inside == pytest.approx(0.95, abs=4.0 * np.sqrt(0.95 * 0.05 / COUNT))  # four deviations of a share
        assert np.median(values) == pytest.approx(fitted[path].value, rel=4e-3)
    expected = fitted.correlations[0, 1]
    found = np.corrcoef(np.log(drawn[STIFFNESS]), np.log(drawn[MASS]))[0, 1]
    assert found == pytest.approx(expected, abs=4.0 * (1.0 - expected**2) / np.sqrt(COUNT))


def test_draws_stay_within_the_bounds_and_repeat(fitted, case):
    again, other = fitted.draws(50, seed=3), fitted.draws(50, seed=4)
    assert np.array_equal(again[MASS], fitted.draws(50, seed=3)[MASS])
    assert not np.array_equal(again[MASS], other[MASS])
    low, high = 0.99 * fitted[MASS].value, 1.001 * fitted[MASS].value
    narrow = il.fit(fitted.case, measured(case, 0), {MASS: (low, high)})
    assert np.all((narrow.draws(200)[MASS] >= low) & (narrow.draws(200)[MASS] <= high))


def test_a_prediction_holds_the_true_peak(case, fitted):
    """A mass at twice the speed: of a linear contact the force is twice that of the same numbers, exactly."""
    points = fitted.draws(100)
    fast = il.sweep(fitted.case.with_(VELOCITY, 2.0), points=points, quantities=["peak_force"])
    slow = il.sweep(fitted.case, points=points, quantities=["peak_force"])
    peaks = fast.peak_force.values.ravel()
    assert peaks == pytest.approx(2.0 * slow.peak_force.values.ravel(), rel=1e-9)
    true = max(span.peak_force for span in il.run(case.with_(VELOCITY, 2.0)).contacts)
    low, high = np.percentile(peaks, [0.5, 99.5])
    assert low < true < high


def test_the_file_of_draws_is_one_of_points(fitted, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fitted.write("out")
    arguments = ["sweep", "out/fitted.yaml", "--points", "out/draws.csv", "--quantities", "peak_force", "--json"]
    result = invoke(*arguments, "--set", f"{VELOCITY}=2 m/s")
    assert result.exit_code == 0, result.output
    heads, first = (tmp_path / "out" / "draws.csv").read_text().splitlines()[:2]
    assert heads == f"{STIFFNESS} [N/m],{MASS} [kg]"
    drawn = fitted.draws()
    assert [float(each) for each in first.split(",")] == [drawn[STIFFNESS][0], drawn[MASS][0]]


def test_numbers_that_are_not_determined_cannot_be_drawn(case, tmp_path):
    """Mass, stiffness, section and density a tenth larger, and the speed a tenth lower: the same force."""
    free = {MASS: (0.5, 8.0), STIFFNESS: (2e7, 2e9), "bodies.rod.area": (1e-4, 1e-2), VELOCITY: (0.2, 5.0)}
    found = il.fit(case, measured(case, 0), free)
    with pytest.raises(il.ImpactlabError, match=r"the signals do not determine .*velocity"):
        found.draws()
    found.write(tmp_path)
    assert not (tmp_path / "draws.csv").exists()


@pytest.mark.parametrize(
    ("given", "path"), [((0,), "count"), ((2.5,), "count"), ((10, -1), "seed"), ((10, "a"), "seed")]
)
def test_counts_and_seeds_are_whole_numbers(fitted, given, path):
    with pytest.raises(il.CaseError, match=f"{path}: .* is not allowed\nGive a whole number from"):
        fitted.draws(*given)


def test_a_seed_of_a_fit_is_a_whole_number(case):
    for seed in (-1, 1.5, "a", np.random.default_rng(0)):
        with pytest.raises(il.CaseError, match=r"seed: .* is not allowed"):
            il.fit(case, measured(case, 0), BOUNDS, intervals="bootstrap", seed=seed)


def test_a_signal_is_shown_in_a_line(case):
    assert repr(measured(case, 0)).startswith(f"<Signal '{FORCE}': 100 samples at 0 to 340 µs, ")
    strain = il.Signal("strain:rod@0.1", [0, 1e-6, 2e-6, 3e-6], [0, 1e-5, 2e-5, -1e-6])
    assert repr(strain) == "<Signal 'strain:rod@0.1': 4 samples at 0 to 3 µs, -1e-06 to 2e-05>"


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ((None, [0, 1, 2, 3], [0, 1, 2, 3]), "the channel of a signal is a NoneType"),
        ((FORCE, [0, 1, 2, 3], ["a", 1, 2, 3]), "values does not hold numbers"),
        ((FORCE, [[0], 1, 2, 3], [0, 1, 2, 3]), "time does not hold numbers"),
    ],
)
def test_signals_of_other_types_are_refused(given, says):
    with pytest.raises(il.CaseError, match=says):
        il.Signal(*given)
