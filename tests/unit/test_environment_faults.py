"""Faults of the environment, one after another: each is answered in words, or does no harm (`docs/robustness.md`)."""

from __future__ import annotations

import json
import os
import platform
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from impactlab.report import output
from tests.fuzz.fuzz import processor_s
from tests.support import invoke
from tests.unit.test_kernel_cache import KERNELS

CASE = """\
schema_version: 1
bodies: {ball: {kind: mass, mass: 1.0, velocity: 1.0}, wall: {kind: wall}}
contacts:
  - between: [ball, wall]
    law: {kind: penalty, stiffness: 1.0e6}
solve: {duration: 5.0e-3, integrator: {kind: newmark}, step: {dt: 1.0e-5}}
"""
COMMAND = [sys.executable, "-m", "impactlab"]


@pytest.fixture
def case(tmp_path: Path) -> Path:
    path = tmp_path / "ball.yaml"
    path.write_text(CASE)
    return path


def impactlab(
    *arguments: str, before: Callable[[], None] | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    changed = os.environ | environment
    return subprocess.run(
        [*COMMAND, *arguments], capture_output=True, text=True, env=changed, preexec_fn=before, timeout=300, check=False
    )


def limited(kind: int, size: int) -> Callable[[], None]:
    return lambda: resource.setrlimit(kind, (size, size))


@pytest.mark.parametrize("megabytes", [100, 150, 400, 650])
def test_too_little_address_space_hangs_or_interrupts(case: Path, megabytes: int) -> None:
    done = impactlab("run", str(case), "--json", before=limited(resource.RLIMIT_AS, megabytes * 1_000_000))
    assert done.returncode == 2
    assert f"limited to {megabytes} MB, and a run needs 700 MB" in done.stderr
    assert json.loads(done.stdout)["status"] == "refused"


@pytest.mark.parametrize("threads", ["abc", "0", "-1", "", "1.5", "99999999999999999999"])
def test_a_wrong_number_of_threads_prints_a_traceback_or_blames_a_part(case: Path, threads: str) -> None:
    done = impactlab("run", str(case), NUMBA_NUM_THREADS=threads)
    assert done.returncode == 2
    assert "NUMBA_NUM_THREADS" in done.stderr
    assert "Traceback" not in done.stderr
    assert "newmark" not in done.stderr


def test_a_wrong_environment_is_an_error_in_python_too(case: Path) -> None:
    script = f"import impactlab as il\ntry: il.load_case({str(case)!r})\nexcept Exception as error: print(repr(error))"
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        env=os.environ | {"NUMBA_NUM_THREADS": "abc"},
        check=True,
    )
    assert done.stdout.startswith("ImpactlabError(\"the environment variable NUMBA_NUM_THREADS is 'abc'")


def finished(done: subprocess.CompletedProcess[str]) -> None:
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["status"] == "completed"


PARTS = f"""{KERNELS}
from impactlab.numerics.addresses import FREE, kernel_address

def doubled(parameters, state):
    state[0] *= 2.0

print(kernel_address(doubled, FREE) != 0)
"""


@pytest.mark.slow
def test_no_home_and_no_place_for_a_cache(case: Path) -> None:
    """A file in the place of the folder of the cache: nothing can be kept there by any user.

    Kernels of each kind are compiled; the loops, which take half a minute, are run without.
    """
    blocked = case.with_name("blocked")
    blocked.write_text("")
    nowhere = {"NUMBA_CACHE_DIR": str(blocked), "HOME": "/nonexistent"}
    finished(impactlab("run", str(case), "--json", NUMBA_DISABLE_JIT="1", **nowhere))
    script = case.with_name("kernels.py")
    script.write_text(PARTS)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, env=os.environ | nowhere)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[-1] == "True"


@pytest.mark.slow
def test_a_locale_changes_numbers_or_ends_the_run(case: Path) -> None:
    plain = json.loads(invoke("run", str(case), "--json").stdout)
    for locale in ("POSIX", "tr_TR.UTF-8"):  # C is another name of POSIX; in Turkish 0,5 is a half and i has no dot
        done = impactlab("run", str(case), "--json", LC_ALL=locale, PYTHONIOENCODING="ascii:strict", PYTHONUTF8="0")
        finished(done)
        assert done.stdout.isascii()
        assert {**json.loads(done.stdout), "cost": None} == {**plain, "cost": None}, locale


@pytest.mark.slow
def test_a_full_disk_leaves_half_an_output(case: Path) -> None:
    out = case.with_name("out")
    done = impactlab("run", str(case), "--out", str(out), before=limited(resource.RLIMIT_FSIZE, 4096))
    assert done.returncode == 1
    assert "File too large" in done.stderr
    assert "Traceback" not in done.stderr
    assert sorted(path.name for path in case.parent.iterdir()) == ["ball.yaml"]


@pytest.mark.slow
def test_a_read_only_place_for_the_output_ends_in_a_traceback(case: Path) -> None:
    done = impactlab("run", str(case), "--out", "/proc/self/out")
    assert done.returncode in (1, 2)
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_reader_that_closes_its_pipe_sees_a_traceback(case: Path) -> None:
    with subprocess.Popen([*COMMAND, "run", str(case)], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        assert running.stdout is not None
        assert running.stderr is not None
        running.stdout.close()
        said = running.stderr.read().decode()
    assert "Traceback" not in said


@pytest.mark.slow
def test_an_interrupt_leaves_half_an_output(case: Path) -> None:
    out = case.with_name("out")
    long = case.read_text().replace("5.0e-3", "10.0").replace("1.0e-5", "1.0e-8")
    case.write_text(long)
    with subprocess.Popen([*COMMAND, "run", str(case), "--out", str(out)], stderr=subprocess.PIPE) as running:
        while running.poll() is None and processor_s(running.pid) < 4.0:  # after imports, among the steps
            time.sleep(0.1)
        running.send_signal(signal.SIGINT)
        assert running.wait(60) == 130
    assert sorted(path.name for path in case.parent.iterdir()) == ["ball.yaml"]


def test_two_writers_of_one_folder_mix_their_files(tmp_path: Path) -> None:
    """Each writes files of its own names, 100 times, as `run --out` does; where the other one was faster it fails."""
    out = tmp_path / "out"
    running = [subprocess.Popen([sys.executable, "-c", TWO_WRITERS, str(out), name]) for name in "ab"]
    assert [each.wait(300) for each in running] == [0, 0]
    names = {path.name for path in out.iterdir()}
    assert names in [{output.MANIFEST, *(f"{name}{number}" for number in range(20))} for name in "ab"]
    with output.output_folder(out) as draft:
        (draft / "one").write_text("1")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


TWO_WRITERS = """
import sys
from pathlib import Path
from impactlab.errors import CaseError
from impactlab.report import output
written = 0
for _ in range(100):
    try:
        with output.output_folder(Path(sys.argv[1])) as draft:
            for number in range(20):
                (draft / f"{sys.argv[2]}{number}").write_text("whole")
        written += 1
    except (OSError, CaseError):
        pass
assert written
"""
WRITERS = """
import os, sys
from pathlib import Path
from impactlab.report import output
for _ in sys.stdin:
    child = os.fork()
    while child == 0:
        with output.output_folder(Path(sys.argv[1])) as draft:
            for number in range(20):
                (draft / str(number)).write_text("whole")
    print(child, flush=True)
    os.waitpid(child, 0)
    print("ended", flush=True)
"""


def killed(out: Path, count: int) -> None:
    """Kill processes that write a folder again and again, at random moments; all are forked from one."""
    draw = random.Random(5)
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", WRITERS, str(out)], stdin=pipe, stdout=pipe, text=True) as running:
        assert running.stdin is not None
        assert running.stdout is not None
        for _ in range(count):
            print(file=running.stdin, flush=True)
            writer = int(running.stdout.readline())
            time.sleep(draw.uniform(0.0, 0.02))
            os.kill(writer, signal.SIGKILL)
            assert running.stdout.readline() == "ended\n"
            if out.exists():  # a folder under its name is whole
                names = {path.name for path in out.iterdir()}
                assert names == {str(number) for number in range(20)} | {output.MANIFEST}
        running.stdin.close()


def test_kills_leave_hidden_folders_for_good(tmp_path: Path) -> None:
    out = tmp_path / "out"
    killed(out, 200)
    with output.output_folder(out) as draft:
        (draft / "one").write_text("1")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_draft_of_a_run_that_goes_on_is_swept_away(tmp_path: Path) -> None:
    (tmp_path / f".out{output.DRAFT}elsewhere-1.abc").mkdir()
    old = tmp_path / f".out{output.DRAFT}elsewhere-2.abc"
    old.mkdir()
    os.utime(old, (0.0, 0.0))
    (tmp_path / ".somebodys.folder").mkdir()
    with output.output_folder(tmp_path / "one") as draft, output.output_folder(tmp_path / "two") as other:
        (draft / "1").write_text("1")
        (other / "2").write_text("2")
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"one", "two", ".somebodys.folder", f".out{output.DRAFT}elsewhere-1.abc"}
    assert platform.node() == "" or output.DRAFT in draft.name
