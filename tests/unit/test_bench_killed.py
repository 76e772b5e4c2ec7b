"""A bench killed with SIGKILL at two moments and resumed ends as one that was left alone."""

from __future__ import annotations

import csv
import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests.support import ROOT

CASES = [str(ROOT / "cases" / "axial_impact.yaml")]
METHODS = "exact,central_difference,own"
OF_TIME = ("repeats", "setup_s", "setup_spread_s", "solve_s", "solve_spread_s")


def started(out: Path, jobs: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "impactlab", "bench", *CASES, "--methods", METHODS, "--out", str(out)]
    return subprocess.Popen(
        [*command, "--jobs", str(jobs), "--repeats", "1", "--no-report"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def timeless(value: Any) -> Any:
    """Return a record without the times in it."""
    if isinstance(value, dict):
        return {key: timeless(inner) for key, inner in value.items() if not key.endswith("_s")}
    return [timeless(inner) for inner in value] if isinstance(value, list) else value


def read(folder: Path) -> dict[str, tuple[int, str]]:
    """Return when each file of a folder was written, and its bits without times; a half-written one would raise."""
    found = {}
    for path in folder.glob("*.json"):
        found[path.name] = (path.stat().st_mtime_ns, json.dumps(timeless(json.loads(path.read_text())), sort_keys=True))
    return found


def table(out: Path) -> list[dict[str, str]]:
    with (out / "table.csv").open(newline="", encoding="utf-8") as stream:
        return [{key: value for key, value in row.items() if key not in OF_TIME} for row in csv.DictReader(stream)]


@pytest.mark.slow
def test_a_bench_killed_at_random_moments_loses_nothing_and_does_nothing_twice(tmp_path: Path) -> None:
    left_alone, killed = tmp_path / "left_alone", tmp_path / "killed"
    assert started(left_alone, jobs=1).wait() == 0
    expected = read(left_alone / "rows")
    count = len(expected)
    assert count > 12

    random_s = random.Random(20261)
    known: dict[str, dict[str, tuple[int, str]]] = {"rows": {}, "times": {}}
    # Processes, and how many files there are when they are killed: among the rows, among the times.
    for jobs, files in ((2, count // 3), (1, count + 3)):
        running = started(killed, jobs)
        while sum(len(list((killed / kind).glob("*.json"))) for kind in known) < files:
            assert running.poll() is None
            time.sleep(0.005)
        time.sleep(random_s.uniform(0.0, 0.02))
        running.send_signal(signal.SIGKILL)
        assert running.wait() != 0
        for kind, before in known.items():
            now = read(killed / kind)
            assert {name: now[name] for name in before} == before, kind  # none lost, none written again
            known[kind] = now
    assert started(killed, jobs=2).wait() == 0

    found = read(killed / "rows")
    assert {name: now for name, now in found.items() if name in known["rows"]} == known["rows"]
    assert {name: bits for name, (_, bits) in found.items()} == {name: bits for name, (_, bits) in expected.items()}
    assert table(killed) == table(left_alone)
    keys = [row["key"] for row in table(killed)]
    assert {f"{key}.json" for key in keys} == set(found)
    assert sorted(path.name for path in killed.rglob("*") if path.name.endswith(".part")) == []
    assert not list(killed.glob("session-*"))
