"""Sweeps refuse bad input before the first run, and end with kept points where something breaks on the way."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import ExtraError, SweepError
from impactlab.jobs.files import locked
from impactlab.sweeps import axes, chunks, counts, engines, points, result, run, shards
from tests.cases.support import CASES
from tests.support import invoke

pytestmark = pytest.mark.usefixtures("_no_figures")

PAPER = CASES / "axial_impact.yaml"
MASS, GAP = "bodies.hammer.mass", "contacts.0.gap"
OVER = ["--over", f"{MASS}=1,2"]
LAW = "contacts.0.law"
DAMPED = ["--set", f"{LAW}={{kind: penalty, damping: 5.0}}"]


@pytest.fixture(scope="module")
def case() -> il.Case:
    return il.load_case(PAPER).method("continuous")


def invoked(arguments: list[str], out: Path):
    return invoke("sweep", str(PAPER), "--method", "continuous", *arguments, "--out", str(out))


@pytest.fixture
def no_run(monkeypatch):
    for module in (points, engines):
        monkeypatch.setattr(module, "row", lambda *_: pytest.fail("a run was started"))


@pytest.mark.parametrize(
    ("arguments", "path", "words"),
    [
        (["--over", "bodies.hammer.mas=1,2"], "bodies.hammer", "Did you mean 'mass'?"),
        (["--over", "bodies.hammer.kind=1:2:3"], "bodies.hammer.kind", "'1' is not a kind of body"),
        (["--over", "bodies.hammer=1,2"], "bodies.hammer", "where a block of keys is needed"),
        (["--over", f"{MASS}="], "", "is not PATH=VALUES"),
        (["--over", f"{MASS}=1,,2"], MASS, "a value is missing"),
        (["--over", f"{MASS}=.inf,1"], MASS, ".inf is not a finite number"),
        (["--over", f"{MASS}=1:10:three"], MASS, "gives a range of 'three' values; allowed: 2 to 1000000"),
        (["--over", f"{MASS}=1 kg:10 kg:3lin"], MASS, "gives a range of '3lin' values; allowed: 2 to 1000000"),
        (["--over", f"{MASS}=1:2e400:3"], MASS, "'2e400' is beyond any number"),
        (["--over", f"{MASS}=1:nan:3"], MASS, "'nan' is not a number with a unit"),
        (["--over", f"{MASS}=1 m,2 kg"], MASS, "'1 m' has a unit of another dimension"),
        (["--over", f"{MASS}=1 xyz,2"], MASS, "'1 xyz' has a unit that is not known"),
        (["--over", f"{MASS}=1,-1"], MASS, "-1 kg is out of range"),
        (
            ["--over", f"methods.penalty.{LAW}.stiffness=1e8,1e9"],
            f"methods.penalty.{LAW}.stiffness",
            "has no effect: the values of a point are set after",
        ),
        (["--over", f"{GAP}=0:1:3log"], GAP, "pass through zero"),
        (["--over", f"{MASS}=1:2:1e3"], MASS, "gives a range of '1e3' values; allowed: 2 to 1000000"),
        (["--over", f"{MASS}=1 kg:2 kg:"], MASS, "gives a range of '' values; allowed: 2 to 1000000"),
        (["--over", f"{MASS}=1:2:2000000"], MASS, "a range of 2000000 values; allowed: 2 to 1000000"),
        (["--over", f"{MASS}=1:2:10000", "--over", f"{GAP}=0:1:10000"], "", "10000 x 10000 = 1e+08 points"),
        ([*OVER, "--over", f"{MASS}=3"], MASS, "an axis that is given twice"),
        ([*OVER, "--over", "bodies.hammer={velocity: 1.0}"], "bodies.hammer", f"whose values {MASS} gives, too"),
        ([*OVER, "--set", f"{MASS}=3"], MASS, "an axis that --set gives, too"),
        (["--over", f"{LAW}={{damping: 1.0}},{{damping: 2.0}}", *DAMPED], LAW, "an axis that --set gives, too"),
        (
            ["--over", "bodies.rod={length: 0.3},{length: 0.4}", "--set", "bodies.rod.material.young=2e11"],
            "bodies.rod",
            "an axis of blocks, and --set gives bodies.rod.material.young inside them",
        ),
        (
            ["--over", "bodies.rod.kind=rod,beam", "--set", "bodies.rod.length=0.4"],
            "bodies.rod.kind",
            "'beam', which removes bodies.rod.length, a key that --set gives",
        ),
        (["--over", "method=penalty,continuous"], "method", "whose method is chosen: continuous"),
        ([*OVER, "--quantities", "restituton"], "", "Did you mean 'restitution'?"),
        ([*OVER, "--quantities", ""], "", "a sweep without a quantity"),
        ([*OVER, "--quantities", "contacts,contacts"], "", "'contacts' is named twice"),
        ([*OVER, "--points", "points.csv"], "", "the points cannot be read"),
        ([*OVER, "--shard", "3/2"], "--shard", "'3/2' is not a shard"),
        ([*OVER, "--shard", "0/2"], "--shard", "'0/2' is not a shard"),
    ],
)
def test_the_command_refuses_with_path_and_remedy_and_writes_nothing(arguments, path, words, tmp_path, no_run):
    out = tmp_path / "out"
    found = invoked([*arguments, "--json"], out)
    assert found.exit_code == 2
    fault = json.loads(found.stdout)["error"]
    assert words in fault["text"]
    assert (fault["path"] or "").startswith(path)
    assert fault["remedy"] or words == "is out of range"
    assert list(tmp_path.iterdir()) == []


def sampled(channel: str, times: list[float], methods: str = "continuous") -> None:
    il.sweep(il.load_case(PAPER).method(methods), {MASS: [1.0]}, quantities=[il.Sampled(channel, times)])


@pytest.mark.parametrize(
    ("channel", "times", "words"),
    [
        ("force:hamer|rod.left", [1e-5], "Did you mean 'force:hammer|rod.left'?"),
        ("forc:hammer|rod.left", [1e-5], "Did you mean 'force'?"),
        ("velocity:rod@9", [1e-5], "x = 9 m lies outside the body 'rod'"),
        ("energy:nobody", [1e-5], "Did you mean 'energy:"),
        ("force:hammer|rod.left", [], "is requested at no time of a run"),
        ("force:hammer|rod.left", [float("nan")], "is requested at no time of a run"),
        ("force:hammer|rod.left", [1e-5, 9.0], "is requested at 9 s; the run ends at 0.000349121 s"),
    ],
)
def test_sampled_channels_are_checked_before_the_first_run(channel, times, words, no_run):
    with pytest.raises(il.CaseError) as raised:
        sampled(channel, times)
    assert words in str(raised.value)
    assert raised.value.remedy


def test_places_without_a_probe_are_for_continuous_bodies(no_run):
    with pytest.raises(il.CaseError, match="needs a probe in the case"):
        sampled("displacement:rod@0.123", [1e-5], "penalty")
    with pytest.raises(pytest.fail.Exception, match="a run was started"):
        sampled("displacement:rod@0.123", [1e-5])


def test_a_result_beyond_the_memory_is_refused_with_its_size(case, no_run):
    times = np.linspace(0.0, 1e-5, 5000)
    with pytest.raises(il.CaseError, match=r"100,000 points with 5,000 values each are 4 GB; allowed: 2 GB"):
        il.sweep(case, {GAP: [0.0] * 100_000}, quantities=[il.Sampled("force:hammer|rod.left", times)])


def test_a_folder_of_others_is_refused(tmp_path, case, no_run):
    for number, make in enumerate(
        (
            lambda folder: folder.joinpath("thesis.txt").write_text("chapter one"),
            lambda folder: folder.joinpath("chunks").mkdir() or folder.joinpath("chunks", "00000000.npz").touch(),
        )
    ):
        folder = tmp_path / str(number)
        folder.mkdir()
        make(folder)
        with pytest.raises(il.CaseError, match="holds files that no sweep wrote, such as"):
            il.sweep(case, {MASS: [1.0]}, out=folder)
    (tmp_path / "file").touch()
    for bad in ("file", "file/inside"):
        with pytest.raises(il.CaseError, match=r"is not a folder|cannot be made"):
            il.sweep(case, {MASS: [1.0]}, out=tmp_path / bad)


def test_a_missing_library_is_refused_with_the_command_that_installs_it(case, monkeypatch):
    monkeypatch.setattr(result, "find_spec", lambda name: None)
    with pytest.raises(ExtraError, match="xarray") as raised:
        il.sweep(case, {MASS: [1.0]})
    assert raised.value.remedy == "pip install 'impactlab[data]'"


@pytest.fixture
def kept(tmp_path, case, monkeypatch):
    monkeypatch.setattr(run, "size_of_chunk", lambda *_: 2)
    il.sweep(case, {MASS: [1.0, 2.0, 3.0]}, quantities=["contacts"], out=tmp_path / "s")
    return tmp_path / "s"


def test_a_folder_at_work_is_refused_and_left_as_it_is(kept, case, monkeypatch, no_run):
    monkeypatch.setattr(shards, "PATIENCE_S", 0.2)
    before = sorted(path.name for path in kept.rglob("*"))
    with (kept / shards.LOCK).open("a") as lock:
        assert locked(lock.fileno())
        for shard in (None, "1/2"):
            with pytest.raises(il.CaseError, match="another sweep is at work in") as raised:
                il.sweep(case, {MASS: [1.0, 2.0, 3.0]}, quantities=["contacts"], out=kept, shard=shard)
            assert raised.value.remedy
    assert sorted(path.name for path in kept.rglob("*")) == before


@pytest.mark.parametrize(
    ("at_work", "asked", "is_refused"),
    [("1/2", "1/2", True), ("1/2", "2/2", False), ("1/2", "2/3", True), ("1/2", None, True)],
)
def test_shards_that_overlap_are_refused(kept, case, at_work, asked, is_refused):
    with (kept / shards.read_shard(at_work).lock).open("a") as lock:
        assert locked(lock.fileno())
        arguments = {"quantities": ["contacts"], "out": kept, "shard": asked}
        if not is_refused:
            assert counts(il.sweep(case, {MASS: [1.0, 2.0, 3.0]}, **arguments)) == {"completed": 3}
            return
        with pytest.raises(il.CaseError, match=f"shard {at_work} is at work in") as raised:
            il.sweep(case, {MASS: [1.0, 2.0, 3.0]}, **arguments)
        assert raised.value.path == "--shard"


def test_shards_compute_their_chunks_and_the_last_call_collects(tmp_path, case, monkeypatch):
    monkeypatch.setattr(run, "size_of_chunk", lambda *_: 2)
    masses, out = np.linspace(1.0, 2.0, 9), tmp_path / "s"
    arguments = {"quantities": ["impulse"], "out": out}
    first = il.sweep(case, {MASS: masses}, shard="1/3", **arguments)
    assert [chunks.STATUSES[each][0] for each in first["status"].values] == list("ccmmmmccm")
    assert not (out / "sweep.nc").exists()
    found = invoked(["--over", f"{MASS}=1:2:9", "--quantities", "impulse", "--shard", "3/3"], out)
    assert (found.exit_code, found.stdout) == (0, "9 points: 3 missing, 6 completed\n")
    written = {path: path.stat().st_mtime_ns for path in out.glob("chunks/*.npz")}
    assert len(written) == 3
    whole = il.sweep(case, {MASS: masses}, **arguments)
    assert {path: path.stat().st_mtime_ns for path in written} == written
    assert whole.equals(il.sweep(case, {MASS: masses}, quantities=["impulse"]))
    assert (out / "sweep.nc").exists()


def broken_after(puts: int, break_it, monkeypatch) -> None:
    """Let the folder break before a chunk is kept."""
    put = chunks.Folder.put
    done = []

    def breaking(folder, chunk):
        if len(done) == puts:
            break_it(folder)
        done.append(chunk)
        put(folder, chunk)

    monkeypatch.setattr(chunks.Folder, "put", breaking)


def disk_full(*_, **__):
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize(
    ("fault", "words", "last"),
    [
        ("full", "No space left on device", "4 of 6 points are kept in {}. The same command computes the others."),
        (
            "removed",
            "No such file or directory",
            "The folder has been removed. The same command starts the sweep again.",
        ),
    ],
)
def test_a_folder_that_breaks_ends_the_sweep_with_advice(tmp_path, monkeypatch, fault, words, last):
    out = tmp_path / "out"
    with monkeypatch.context() as patched:
        patched.setattr(run, "size_of_chunk", lambda *_: 2)
        break_it = {
            "full": lambda _: patched.setattr(np, "savez", disk_full),
            "removed": lambda folder: shutil.rmtree(folder.path),
        }
        broken_after(2, break_it[fault], patched)
        found = invoked(["--over", f"{MASS}=1:2:6"], out)
    assert found.exit_code == 1
    assert words in found.stderr
    assert found.stderr.splitlines()[-1] == last.format(repr(str(out)))
    if fault == "full":
        assert counts(il.open_sweep(out)) == {"missing": 2, "completed": 4}
    again = invoked(["--over", f"{MASS}=1:2:6"], out)
    assert (again.exit_code, again.stdout) == (0, "6 points: 6 completed\n")


def test_a_disk_that_is_full_at_the_end_keeps_all_points(kept, case, monkeypatch):
    (kept / "index.html").unlink()
    monkeypatch.setattr(run, "write_table", disk_full)
    with pytest.raises(SweepError, match="No space left on device") as raised:
        il.sweep(case, {MASS: [1.0, 2.0, 3.0]}, quantities=["contacts"], out=kept)
    assert "Finished points stay" in raised.value.remedy
    assert counts(il.open_sweep(kept)) == {"completed": 3}


def test_the_keyboard_ends_a_sweep_with_130_and_finished_points(tmp_path, monkeypatch):
    monkeypatch.setattr(run, "size_of_chunk", lambda *_: 2)

    def interrupt(_):
        raise KeyboardInterrupt

    broken_after(1, interrupt, monkeypatch)
    out = tmp_path / "out"
    found = invoked(["--over", f"{MASS}=1:2:6"], out)
    assert found.exit_code == 130
    last = f"interrupted: 2 of 6 points are kept in {str(out)!r}. The same command computes the others."
    assert found.stderr.splitlines()[-1] == last


class Interrupted:
    """Presses Ctrl-C while it is deleted, where Python only prints what is raised."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


def test_an_interrupt_inside_a_destructor_ends_a_sweep(tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(run, "size_of_chunk", lambda *_: 2)
    broken_after(1, lambda _: Interrupted(), monkeypatch)
    handlers = signal.signal(signal.SIGINT, signal.default_int_handler), sys.unraisablehook
    try:
        found = invoked(["--over", f"{MASS}=1:2:6"], tmp_path)
        assert (signal.getsignal(signal.SIGINT), sys.unraisablehook) == (signal.default_int_handler, handlers[1])
    finally:
        signal.signal(signal.SIGINT, handlers[0])
    assert found.exit_code == 130
    assert "4 of 6 points are kept" in found.stderr.splitlines()[-1]
    assert "Exception ignored" not in found.stderr + capfd.readouterr().err


def test_known_axes_are_read_without_checking_again(kept, case, monkeypatch):
    monkeypatch.setattr(axes, "in_si", lambda *_: pytest.fail("a value was checked again"))
    assert counts(il.sweep(case, {MASS: [1.0, 2.0, 3.0]}, quantities=["contacts"], out=kept)) == {"completed": 3}


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["--workers=0", "--workers=2", "--cluster=local:2"])
def test_ctrl_c_at_the_terminal(tmp_path, engine):
    """The signal goes to all processes of the terminal, as Ctrl-C does."""
    out = tmp_path / "out"
    over = ["--over", f"{MASS}=1:2:3000", "--quantities", "contacts", engine, "--out", str(out)]
    command = [sys.executable, "-c", "from impactlab.cli import main; main()", "sweep", str(PAPER), *over]
    process = subprocess.Popen(
        [*command, "--method", "modal_10"], stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    while len(list(out.glob("chunks/*.npz"))) < 2 and process.poll() is None:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert "points are kept in" in errors.splitlines()[-1]
    assert "Traceback" not in errors
    assert 0 < counts(il.open_sweep(out))["completed"] < 3000


def test_a_contact_by_number_and_by_name_is_one_axis(case, no_run):
    named = il.Case.from_dict(
        {**case.document.data, "contacts": [{**case.document.data["contacts"][0], "name": "cushion"}]}
    )
    by_name = "contacts.cushion.gap"
    for options in ({"over": {GAP: [0.0], by_name: [1e-4]}}, {"points": {by_name: [0.0], GAP: [1e-4]}}):
        with pytest.raises(il.CaseError, match=r"an axis whose values contacts.* gives, too"):
            il.sweep(named, **options)
    with pytest.raises(il.CaseError, match=r"whose values contacts\.cushion gives, too"):
        il.sweep(named, {"contacts.cushion": [{"gap": 0.0}], GAP: [1e-4]})
    with pytest.raises(il.CaseError, match=r"whose values contacts\.00\.gap gives, too"):
        il.sweep(named, {"contacts.00.gap": [0.0], GAP: [1e-4]})
    with pytest.raises(il.CaseError, match="that --set gives, too"):
        il.sweep(named.with_settings([(GAP, 0.0)], by="--set"), {by_name: [0.0, 1e-4]})
    with pytest.raises(il.CaseError, match=r"whose values contacts\.0\.gap gives, too"):
        il.uncertainty(named, {GAP: "uniform(0, 1 mm)", by_name: "uniform(0, 1 mm)"})


@pytest.mark.parametrize("workers", [-1, 1.5, "2", None, True, 5000])
def test_an_invalid_number_of_workers_is_refused(case, no_run, workers):
    """With -1 the sweep waited for ever, and with '2' a TypeError came from inside."""
    with pytest.raises(il.CaseError, match=r"workers: .* is not allowed\nGive a whole number from 0 to 1024"):
        il.sweep(case, {MASS: [1.0, 2.0]}, workers=workers)


def test_points_may_be_a_table_of_pandas(case):
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame({MASS: [1.0, 2.0], GAP: [0.0, 1e-4]})
    found = il.sweep(case, points=table, quantities=["impulse"])
    listed = il.sweep(case, points={MASS: [1.0, 2.0], GAP: [0.0, 1e-4]}, quantities=["impulse"])
    assert np.array_equal(found.impulse, listed.impulse)


@pytest.mark.parametrize("name", ["over", "points"])
def test_points_that_are_no_columns(case, no_run, name):
    with pytest.raises(il.CaseError, match=f"{name} is a list, not paths with values"):
        il.sweep(case, **{name: [{MASS: 1.0}]})


def test_a_value_that_is_beyond_any_number_is_named_with_its_option(tmp_path, no_run):
    found = invoked(["--over", f"{MASS}=1:2e400:3"], tmp_path / "out")
    assert found.stderr.startswith(f"--over {MASS}: '2e400' is beyond any number")
