"""Signals of one recorder share one clock: with a common shift their arrivals give the speed of the waves."""

from __future__ import annotations

import math

import numpy as np
import pytest

import impactlab as il
from impactlab.fits.problem import Problem
from tests.support import invoke

YOUNG, MASS = "bodies.bar.material.young", "bodies.mass.mass"
BOUNDS = {YOUNG: (1.5e11, 3e11), MASS: (0.1, 1.0)}
LATE, NOISE = 21.3e-6, 0.05  # s, of the run on the clock of the recorder; of the largest strain
PLACES = (0.2, 0.8)


@pytest.fixture(scope="module")
def case() -> il.Case:
    bar = il.Rod(length=1.0, diameter=0.02, material={"young": 2.1e11, "density": 7850.0}, ends={"right": "infinite"})
    cushion = {"kind": "penalty", "stiffness": 5e7}
    bodies = {"mass": il.Mass(0.4, velocity=2.0), "bar": bar}
    solve = {"duration": "0.5 ms", "model": {"kind": "continuous"}}
    return il.Case(bodies=bodies, contacts=[il.Contact("mass", "bar.left", cushion)], solve=solve)


def measured(case: il.Case, samples: tuple[int, int] = (200, 200), seed: int = 0) -> list[il.Signal]:
    history, found = il.run(case), []
    for number, (x, count) in enumerate(zip(PLACES, samples, strict=True)):
        times, channel = np.linspace(0.0, 4.5e-4, count), f"strain:bar@{x}"
        strain = history.evaluate(times, channel)
        noise = np.random.default_rng((seed, number)).standard_normal(count) * NOISE * np.max(strain)
        found.append(il.Signal(channel, times + LATE, strain + noise))
    return found


def width(fit: il.Fit, path: str) -> float:
    return math.log(fit[path].upper / fit[path].lower) if fit[path].lower > 0.0 else math.inf


def test_a_common_shift_gives_the_wave_speed(case):
    signals = measured(case, (200, 330))
    own = il.fit(case, signals, BOUNDS, shift="free", gain="free")
    common = il.fit(case, signals, BOUNDS, shift="common", gain="free")
    assert [each.path for each in common.parameters if each.path.startswith("shift")] == ["shift of all signals"]
    found = common["shift of all signals"]
    assert found.lower < LATE < found.upper
    assert common[YOUNG].lower < 2.1e11 < common[YOUNG].upper
    # No wave comes back: without the arrivals only the shape of the pulse is left, and the mass changes it, too.
    assert width(common, YOUNG) < 0.2 * width(own, YOUNG)


def test_of_one_signal_it_is_the_free_one(case):
    (signal, _) = measured(case)
    own, common = (il.fit(case, signal, BOUNDS, shift=each) for each in ("free", "common"))
    assert [each.value for each in own.parameters] == [each.value for each in common.parameters]
    assert [each.lower for each in own.parameters] == [each.lower for each in common.parameters]


def shifts(problem: Problem) -> list[str]:
    return [each.path for each in problem.unknowns if each.path.startswith("shift")]


def test_each_experiment_has_its_own_clock_and_a_signal_may_have_another(case):
    faster = case.with_("bodies.mass.velocity", 3.0)
    pairs = [(case, measured(case)), (faster, measured(faster, seed=1))]
    problem = il.fit_problem(pairs, parameters=BOUNDS, shift="common")
    assert shifts(problem) == ["shift of all signals (1)", "shift of all signals (2)"]
    moved = problem.jacobian(problem.start())[:, -2:] != 0.0  # residuals of 200 samples of each signal
    assert [moved[rows].any(axis=0).tolist() for rows in np.split(np.arange(800), 4)] == [[True, False]] * 2 + [
        [False, True]
    ] * 2
    first, second = measured(case)
    known = il.Signal(second.channel, second.time, second.values, shift=LATE)
    problem = il.fit_problem(case, [first, known], BOUNDS, shift="common")
    assert len(shifts(problem)) == 1
    moved = problem.jacobian(problem.start())[:, -1] != 0.0
    assert [moved[:200].any(), moved[200:].any()] == [True, False]


def test_the_command_takes_it(case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bar.yaml").write_text(case.to_yaml())
    one, two = measured(case)
    rows = [
        f"{t!r},{a!r},{b!r}"
        for t, a, b in zip(one.time.tolist(), one.values.tolist(), two.values.tolist(), strict=True)
    ]
    (tmp_path / "data.csv").write_text("\n".join(["time [s],near [1],far [1]", *rows]))
    signals = ["--signal", "near [1]=strain:bar@0.2", "--signal", "far [1]=strain:bar@0.8"]
    result = invoke(
        "fit", "bar.yaml", "data.csv", *signals, "--parameters", f"{YOUNG}=1.5e11:3e11", "--shift", "common"
    )
    assert result.exit_code == 0, result.output
    assert "shift of all signals" in result.stdout


def test_only_a_shift_is_common(case):
    with pytest.raises(il.CaseError, match=r"gain of strain:bar@0.2: 'common' is not a number"):
        il.fit(case, measured(case), BOUNDS, gain="common")
