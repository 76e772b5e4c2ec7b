"""The stopwatch of a command: each moment belongs to one stage, and the stages sum to the whole."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from impactlab.startup import wall_time
from impactlab.startup.wall_time import STAGES, WallTime, spent_on
from tests.support import CASES, invoke


@pytest.fixture
def ticks(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock that shows what the test sets."""
    now = [0.0]
    monkeypatch.setattr(wall_time.clock, "perf_counter", lambda: now[0])
    return now


def test_the_time_of_an_inner_stage_is_not_that_of_the_outer_one(ticks: list[float]) -> None:
    watch = WallTime(0.0)
    ticks[0] = 1.0
    watch.change("checking")
    ticks[0] = 3.0
    watch.enter("reading")
    ticks[0] = 3.5
    watch.leave()
    ticks[0] = 7.0
    assert watch.seconds() == {"starting": 1.0, "reading": 0.5, "checking": 5.5}


def test_runs_within_a_reference_count_as_reference_except_their_compilation(ticks: list[float]) -> None:
    watch = WallTime(0.0, "other")
    watch.enter("reference")
    watch.enter("solving")
    ticks[0] = 2.0
    watch.enter("compiling")
    ticks[0] = 5.0
    watch.leave()
    watch.leave()
    watch.leave()
    assert watch.seconds() == {"compiling": 3.0, "reference": 2.0, "other": 0.0}


def test_without_a_stopwatch_nothing_is_timed() -> None:
    with spent_on("solving"):
        pass
    assert wall_time._watch == []


def test_a_run_reports_where_all_its_time_goes(tmp_path: Path) -> None:
    case = ["run", str(CASES / "axial_impact.yaml"), "--method", "continuous"]
    text = invoke(*case)
    assert text.exit_code == 0
    line = next(line for line in text.output.splitlines() if line.startswith("  wall time "))
    spent = json.loads(invoke(*case, "--json").stdout)["cost"]["wall_time"]
    assert set(spent) <= set(STAGES)
    assert {"reading", "checking", "set-up", "solving", "checks", "reference", "writing"} <= set(spent)
    assert all(seconds >= 0.0 for seconds in spent.values())
    whole = float(line.split()[2])
    parts = [float(part.rsplit(" ", 1)[1]) for part in line.partition(": ")[2].split(", ")]
    assert whole == pytest.approx(sum(parts), abs=0.006)  # each is rounded to 1 ms
    invoke(*case, "--out", str(tmp_path / "out"))
    kept = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["cost"]["wall_time"]
    assert {"solving", "reference"} <= set(kept)


def test_a_stopwatch_ends_with_its_command(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ZeroDivisionError), wall_time.timed():
        raise ZeroDivisionError
    assert wall_time._watch == []
    monkeypatch.setattr(wall_time, "_asked", [])
    monkeypatch.setattr(wall_time.clock, "clock_gettime", lambda _clock: 1e12, raising=False)
    assert wall_time.age_of_process() > 1e9  # by the clock of the system
    assert wall_time.age_of_process() == 0.0  # once only
