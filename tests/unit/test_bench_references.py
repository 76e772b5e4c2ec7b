"""References are found before the rows, once per scene, in a time of their own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from impactlab.bench import run as runs
from impactlab.bench import worker
from impactlab.bench.cells import Job
from impactlab.bench.grid import read_grid
from impactlab.bench.run import Options, bench
from impactlab.jobs.process_pool import Outcome
from tests.support import PAPER

GRID = """
schema_version: 1
families:
  few: {model: {kind: modal}, integrator: {kind: exact_modal}, levels: {model.modes: [2, 4]}}
  wrong: {model: {kind: modal, elements: 2, modes: 99}}
  short: {model: {kind: continuous}, settings: {solve.duration: {round_trips: 1.0}}}
"""
Put = Callable[[Job, str], Outcome[Job] | None]


class Inline:
    """Takes the place of the worker processes: the same jobs, done in this one."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, put: Put = lambda _job, _name: None) -> None:
        self.asked: list[tuple[str, str, float]] = []  # function, method, limit
        self.put = put
        monkeypatch.setattr(runs, "outcomes", self)

    def __call__(
        self, function: Any, jobs: Sequence[Job], *, limit: float, initargs: tuple[Any, ...], **_: Any
    ) -> Iterator[Outcome[Job]]:
        worker.start(*initargs)
        for job in jobs:
            self.asked.append((function.__name__, job.method, limit))
            yield self.put(job, function.__name__) or Outcome(job, "done", function(job))


def run(tmp_path: Path, **options: Any) -> runs.Bench:
    (tmp_path / "grid.yaml").write_text(GRID)
    families = read_grid(tmp_path / "grid.yaml")
    return bench([PAPER], "s", families, tmp_path / "out", Options(timing=False, **options), methods=["none"])


def test_each_reference_is_one_job_before_all_rows_and_has_more_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inline = Inline(monkeypatch)
    found = run(tmp_path, limit=7.0)
    # A shorter run is another scene to answer; a method that the case refuses has none.
    assert [(name, method) for name, method, _ in inline.asked] == [
        ("reference", "few"),
        ("reference", "short"),
        ("row", "few"),
        ("row", "few"),
        ("row", "wrong"),
        ("row", "short"),
    ]
    assert {limit for name, _, limit in inline.asked if name == "row"} == {7.0}
    assert {limit for name, _, limit in inline.asked if name == "reference"} == {21.0}
    names = {cell.method: found.records[cell.key]["reference"] for cell in found.cells}
    assert names["few"]["name"] == "st_venant"
    assert names["short"]["name"] == "st_venant"
    assert names["wrong"] is None
    inline.asked.clear()
    run(tmp_path)
    assert inline.asked == []


def test_rows_go_without_a_reference_that_was_lost_and_are_run_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Inline(monkeypatch, lambda job, name: Outcome(job, "hung", "no answer after 3 s") if name == "reference" else None)
    found = run(tmp_path)
    assert found.counts == {"completed": 3, "refused": 1}
    told = found.records[found.cells[0].key]
    assert told["summary"]["errors"] is None
    assert told["reference"]["name"] == "none"
    assert told["reference"]["found"] == "the search for it hung: no answer after 3 s"
    again = Inline(monkeypatch)
    found = run(tmp_path)
    assert [method for name, method, _ in again.asked if name == "row"] == ["few", "few", "short"]
    assert found.records[found.cells[0].key]["reference"]["name"] == "st_venant"


def test_crashed_references_run_again_and_refused_ones_do_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Inline(
        monkeypatch,
        lambda job, name: Outcome(job, "crashed", "SIGKILL") if (name, job.method) == ("row", "short") else None,
    )
    assert run(tmp_path).counts == {"completed": 2, "refused": 1, "crashed": 1}
    again = Inline(monkeypatch)
    assert run(tmp_path).counts == {"completed": 3, "refused": 1}
    assert [(name, method) for name, method, _ in again.asked] == [("reference", "short"), ("row", "short")]
