"""Worker processes: what hangs, dies or raises is a row, and the rest goes on; then `bench` from end to end."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from impactlab import CaseError
from impactlab.bench import worker
from impactlab.cli import app
from impactlab.jobs.process_pool import outcomes
from tests.support import ROOT

PAPER = ROOT / "cases" / "axial_impact.yaml"

LAWS = '''
"""Laws that misbehave."""

import os
import time
from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.types import Level, Start


class Bad(AbstractContactLaw):
    """Their common part."""

    needs = frozenset({Level.POSITION})
    citations = ("Goldsmith1960",)
    compiled = False

    def begin(self, left, right, dt):
        self.misbehave()
        return Start()

    @staticmethod
    def respond(port, reply):
        pass


@final
@dataclass(frozen=True)
class Hangs(Bad):
    """It hangs."""

    def misbehave(self):
        print("a part may print")
        time.sleep(3600)


@final
@dataclass(frozen=True)
class Dies(Bad):
    """It dies."""

    def misbehave(self):
        os.kill(os.getpid(), 11)


@final
@dataclass(frozen=True)
class Leaves(Bad):
    """It leaves."""

    def misbehave(self):
        os._exit(7)


@final
@dataclass(frozen=True)
class Raises(Bad):
    """It raises."""

    def misbehave(self):
        raise KeyError("what a stranger raises")
'''
GRID = """
schema_version: 1
families:
  fine: {model: {kind: modal}, integrator: {kind: exact_modal}, levels: {model.modes: [2, 4, 6, 8]}}
  hangs: {law: {kind: hangs}}
  dies: {law: {kind: dies}}
  leaves: {law: {kind: leaves}}
  raises: {law: {kind: raises}}
"""


def invoke(*arguments: str, cwd: Path, **settings: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "impactlab", "bench", *arguments], capture_output=True, text=True, cwd=cwd, **settings
    )


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--suite", "hard"), "there are no cases in 'cases/hard'"),
        ((str(PAPER), "--suite", "hrad"), "there is no suite 'hrad'"),
        ((str(PAPER), "--methods", "exakt"), "Did you mean 'exact'?"),
        ((str(PAPER), "--grid", "none.yaml"), "the grid file does not exist"),
        ((str(PAPER), "--out", "somebody"), "holds files that no bench wrote, such as 'work'"),
    ],
)
def test_wrong_input_leaves_with_2_and_one_document(
    tmp_path: Path, arguments: tuple[str, ...], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "somebody").mkdir()
    (tmp_path / "somebody" / "work").touch()
    (tmp_path / "cases" / "hard").mkdir(parents=True)
    done = CliRunner().invoke(app, ["bench", *arguments, "--json"])
    assert done.exit_code == 2, done.stderr
    assert said in done.stderr
    assert json.loads(done.stdout)["status"] == "refused"
    assert "Traceback" not in done.stderr


def install(site: Path) -> dict[str, str]:
    """Write what pip writes of a plugin with the laws above; return the environment that finds it."""
    information = site / "misbehaving-1.0.dist-info"
    information.mkdir(parents=True)
    (site / "misbehaving.py").write_text(LAWS)
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: misbehaving\nVersion: 1.0\n")
    names = ("Hangs", "Dies", "Leaves", "Raises")
    points = "\n".join(f"{name.lower()} = misbehaving:{name}" for name in names)
    (information / "entry_points.txt").write_text(f"[impactlab.contact_laws]\n{points}\n")
    return {**os.environ, "PYTHONPATH": os.pathsep.join((str(site), str(ROOT)))}


def read(out: Path) -> list[dict[str, str]]:
    with (out / "table.csv").open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.slow
def test_methods_that_hang_die_or_raise_are_rows_and_the_others_are_run(tmp_path: Path) -> None:
    environment = install(tmp_path / "site")
    (tmp_path / "grid.yaml").write_text(GRID)
    methods = "fine,hangs,dies,leaves,raises,own.modal_10"
    arguments = (
        str(PAPER),
        "--grid",
        "grid.yaml",
        "--methods",
        methods,
        "--jobs",
        "2",
        "--repeats",
        "2",
        "--json",
        "--no-report",
    )
    done = invoke(*arguments, "--time-limit", "8", cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    found = {(row["method"], row["level"]): row["summary"] for row in document["rows"]}
    assert {method: summary["status"] for (method, _), summary in found.items()} == {
        "fine": "completed",
        "own.modal_10": "completed",
        "hangs": "hung",
        "dies": "crashed",
        "leaves": "crashed",
        "raises": "failed",
    }
    assert found["hangs", 1]["error"]["text"] == "no answer after 8 s"
    assert found["dies", 1]["error"]["text"] == "the process ended with SIGSEGV"
    assert found["leaves", 1]["error"]["text"] == "the process ended with code 7"
    assert "what a stranger raises" in found["raises", 1]["error"]["text"]
    rows = read(tmp_path / "out" / "bench")
    assert len(rows) == len(document["rows"]) == 9
    assert all(float(row["solve_s"]) > 0.0 for row in rows if row["status"] == "completed")

    # Known rows are not run again; crashed ones are, and those that hung, where they get more time.
    kept = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "out" / "bench" / "rows").iterdir()}
    again = invoke(*arguments, "--time-limit", "9", cwd=tmp_path, env=environment)
    assert "3 runs to do" in again.stderr
    now = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "out" / "bench" / "rows").iterdir()}
    assert {name for name in kept if kept[name] != now[name]} == {
        f"{row['key']}.json" for row in rows if row["method"] in ("hangs", "dies", "leaves")
    }


@pytest.mark.slow
def test_ctrl_c_leaves_with_130_and_keeps_finished_rows(tmp_path: Path) -> None:
    arguments = [sys.executable, "-m", "impactlab", "bench", str(PAPER), "--no-timing", "--jobs", "2", "--out", "b"]
    with subprocess.Popen(arguments, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as running:
        while len(list(tmp_path.glob("b/rows/*.json"))) < 3 and running.poll() is None:
            time.sleep(0.01)
        running.send_signal(signal.SIGINT)
        _, told = running.communicate(timeout=60)
    assert running.returncode == 130, told
    assert "Traceback" not in told
    rows = list(tmp_path.glob("b/rows/*.json"))
    assert len(rows) >= 3
    assert all(json.loads(path.read_text())["summary"]["status"] for path in rows)
    assert not (tmp_path / "b" / "table.csv").exists()
    assert not list(tmp_path.glob("b/session-*"))


def test_a_job_that_hangs_is_killed_and_the_next_one_runs() -> None:
    found = {job: (status, value) for job, status, value in outcomes(time.sleep, [60.0, 0.0], limit=1.0)}
    assert found == {60.0: ("hung", "no answer after 1 s"), 0.0: ("done", None)}


def test_other_sources_than_those_of_the_bench_are_refused() -> None:
    with pytest.raises(CaseError, match="a worker process did not start"):
        list(outcomes(worker.row, [None], limit=9.0, initializer=worker.start, initargs=(None, "other")))


def test_a_bench_of_no_job_starts_no_process() -> None:
    assert list(outcomes(pytest.fail, [], limit=1.0)) == []


REFUSED = """\
schema_version: 1
bodies:
  hammer: {kind: mass, mass: 1.0, velocity: 1.0}
  rod: {kind: rod, length: 1.0, area: 1.0e-4, material: steel}
contacts: [{between: [hammer, rod.left], law: {kind: addition_deletion}}]
solve: {duration: 1.0e-5, model: {kind: finite_element, elements: 4}, integrator: {kind: exact_modal}}
"""


def test_a_bench_without_any_result_leaves_with_1(tmp_path: Path) -> None:
    """It left with 0."""
    file = tmp_path / "refused.yaml"
    file.write_text(REFUSED, encoding="utf-8")
    options = ["--methods", "own", "--no-timing", "--no-report", "--out", str(tmp_path / "out"), "--json"]
    done = CliRunner().invoke(app, ["bench", str(file), *options])
    assert done.exit_code == 1
    assert [row["summary"]["status"] for row in json.loads(done.stdout)["rows"]] == ["refused"]
