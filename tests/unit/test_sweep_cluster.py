"""Sweeps on a Dask cluster over TCP on the loopback address: the same bits, faults as points, a scheduler that dies."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from distributed import KilledWorker, Status

import impactlab as il
from impactlab.errors import ExtraError, SweepError
from impactlab.sweeps import chunks, cluster, counts, points, run
from tests.cases.support import CASES
from tests.unit.test_sweeps import HANGS, faulty_case

MASS, STIFFNESS = "bodies.hammer.mass", "contacts.0.law.stiffness"
ROOT = CASES.parent


@pytest.fixture(scope="module")
def case() -> il.Case:
    return il.load_case(CASES / "axial_impact.yaml").method("penalty")


SCHEDULER = """
import sys, time
from distributed import LocalCluster
if __name__ == "__main__":
    cluster = LocalCluster(n_workers=2, threads_per_worker=int(sys.argv[1]), host="127.0.0.1", protocol="tcp",
                           dashboard_address=None, memory_limit=0, silence_logs=50)
    print(cluster.scheduler_address, flush=True)
    time.sleep(600)
"""


def started(tmp_path: Path, threads: int = 1) -> tuple[subprocess.Popen[str], str]:
    """Start a cluster of two workers in a process of its own, and return that process and the address."""
    script = tmp_path / "scheduler.py"
    script.write_text(SCHEDULER)
    process = subprocess.Popen(
        [sys.executable, str(script), str(threads)],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        start_new_session=True,
    )
    assert process.stdout is not None
    return process, process.stdout.readline().strip()


@pytest.fixture
def scheduler(tmp_path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    process, address = started(tmp_path, threads=2)
    yield process, address
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("tcp:/nowhere", "is not a valid address of a cluster"),
        ("local:0", "0 workers on this machine; allowed: 1 to 1024"),
        ("tcp://127.0.0.1:{port}", "does not answer within 0.5 s"),
    ],
)
def test_a_cluster_that_is_not_there_is_refused_and_nothing_written(address, words, case, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "ANSWER_S", 0.5)
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        text = address.format(port=closed.getsockname()[1])
        with pytest.raises(il.CaseError) as raised:
            il.sweep(case, {MASS: [1.0]}, cluster=text, out=tmp_path / "out")
    assert words in str(raised.value)
    assert raised.value.path == "--cluster"
    assert raised.value.remedy
    assert list(tmp_path.iterdir()) == []


def test_workers_beside_a_cluster_and_a_missing_library_are_refused(case, monkeypatch):
    with pytest.raises(il.CaseError, match="workers of this machine are given, and the cluster"):
        il.sweep(case, {MASS: [1.0]}, cluster="local:2", workers=2)
    monkeypatch.setattr(cluster, "find_spec", lambda name: None)
    with pytest.raises(ExtraError) as raised:
        il.sweep(case, {MASS: [1.0]}, cluster="local:2")
    assert raised.value.remedy == "pip install 'impactlab[cluster]'"


@pytest.mark.slow
def test_the_bits_are_those_of_one_process_and_other_code_is_refused(case, scheduler, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster.Cluster, "size", lambda _: 5)
    masses, arguments = np.linspace(1.0, 2.0, 23), {"quantities": ["impulse", "contacts"]}
    found = il.sweep(case, {MASS: masses}, cluster=scheduler[1], out=tmp_path / "out", **arguments)
    assert found.equals(il.sweep(case, {MASS: masses}, **arguments))
    assert len(list((tmp_path / "out").glob("chunks/*.npz"))) == 5
    for name, expected in (("code_hash", "has another code of impactlab"), ("tree_hash", "has another plugin json")):
        with monkeypatch.context() as patched:
            patched.setattr(cluster, name, lambda *_: "0" * 64)
            patched.setattr(points, "plugin_modules", lambda _: {"json"})
            with pytest.raises(il.CaseError, match=r"the worker tcp://127\.0\.0\.1:\d+ has another") as raised:
                il.sweep(case, {MASS: masses}, cluster=scheduler[1], out=tmp_path / "other", **arguments)
        assert expected in str(raised.value)
        assert "here 000000000000" in str(raised.value)
        assert not (tmp_path / "other").exists()


@pytest.mark.slow
def test_a_point_that_kills_its_worker_is_one_row_and_all_others_are_completed(monkeypatch):
    monkeypatch.setattr(points, "plugin_modules", lambda _: set())
    monkeypatch.setattr(cluster, "PARTS", 3)
    monkeypatch.setattr(cluster, "NO_WORKERS_S", 400.0)  # a busy machine may take minutes to start other workers
    monkeypatch.setattr(cluster, "POINT_LIMIT_S", 400.0)  # and the first run of a process loads, too
    monkeypatch.setattr(cluster.Cluster, "size", lambda _: 6)
    stiffness = np.geomspace(1e8, 1e9, 20)
    stiffness[17] = 1.0
    found = il.sweep(faulty_case(), {STIFFNESS: stiffness}, quantities=["contacts"], cluster="local:2")
    status = [chunks.STATUSES[each] for each in found["status"].values]
    assert [number for number, each in enumerate(status) if each != "completed"] == [17]
    assert status[17] == "crashed"
    assert str(found["reason"].values[17]) == "the worker process ended"


@pytest.mark.slow
def test_workers_that_die_as_they_start_are_replaced_on_this_machine(case, monkeypatch):
    """Dask does not restart a worker that ends before its start is complete: a sweep waited for workers in vain."""

    def lose(self: cluster.Cluster) -> int:
        for nanny in self.own.workers.values():
            nanny.status = Status.starting
        self.client.run(os._exit, 1, on_error="ignore", nanny=False)
        return 2

    monkeypatch.setattr(points, "plugin_modules", lambda _: set())
    monkeypatch.setattr(cluster, "NO_WORKERS_S", 400.0)  # a busy machine may take minutes to start other workers
    monkeypatch.setattr(cluster, "REPLACE_S", 20.0)
    monkeypatch.setattr(cluster.Cluster, "size", lose)
    found = il.sweep(case, {MASS: [1.0, 1.5, 2.0]}, quantities=["impulse"], cluster="local:2")
    assert found.equals(il.sweep(case, {MASS: [1.0, 1.5, 2.0]}, quantities=["impulse"]))


@pytest.mark.slow
def test_a_sweep_that_dies_with_the_workers_that_receive_it_is_sent_again(case, monkeypatch):
    """The scheduler gives up a task whose workers died; the points that wait for it are not to blame."""
    seen: list[cluster.Cluster] = []

    def lose(self: cluster.Cluster) -> int:
        lost = self.client.submit(os._exit, 1, pure=False)
        assert isinstance(lost.exception(timeout=60), KilledWorker)
        self.whole, self.sent = lost, {str(lost.key)}
        seen.append(self)
        return 2

    monkeypatch.setattr(cluster.Cluster, "size", lose)
    found = il.sweep(case, {MASS: [1.0, 2.0, 3.0, 4.0]}, quantities=["impulse"], cluster="local:2")
    assert [chunks.STATUSES[each] for each in found["status"].values] == ["completed"] * 4
    assert len(seen[0].sent) == 2


@pytest.mark.slow
def test_a_point_that_hangs_on_a_cluster_is_one_row(monkeypatch, tmp_path):
    monkeypatch.setenv(HANGS, str(tmp_path))
    # A clock that a run which hangs sets forward by more than any limit, so that nobody waits; the limit is that of
    # every sweep, in which a process loads on a busy machine, too.
    ahead = SimpleNamespace(monotonic=lambda: time.monotonic() + 1000.0 * len(list(tmp_path.iterdir())))
    monkeypatch.setattr(cluster, "time", ahead)
    monkeypatch.setattr(cluster, "ANSWER_S", 30.0)  # to start another worker
    monkeypatch.setattr(points, "plugin_modules", lambda _: set())
    monkeypatch.setattr(cluster.Cluster, "size", lambda _: 3)
    found = il.sweep(faulty_case(), {STIFFNESS: [1e9, 2.0, 2e9, 3e9]}, quantities=["contacts"], cluster="local:2")
    assert [chunks.STATUSES[each] for each in found["status"].values] == ["completed", "hung", "completed", "completed"]


@pytest.mark.parametrize(("outcomes", "expected"), [(("hung", "done"), "told"), (("hung", "hung"), "hung")])
def test_a_point_that_waited_behind_one_that_hung_is_tried_again(outcomes, expected, monkeypatch):
    made = object.__new__(cluster.Cluster)
    given = iter(outcomes)
    ended = lambda _self, jobs, *_: iter([cluster.JobOutcome(jobs[0], next(given), "told")])  # noqa: E731
    monkeypatch.setattr(cluster.Cluster, "_ended", ended)
    monkeypatch.setattr(cluster, "missing", lambda _made, status, _text: status)
    monkeypatch.setattr(cluster, "chunk_of", lambda _first, rows, _wanted: rows[0])
    made.made = SimpleNamespace(wanted=())
    assert list(made._split((7, 8))) == [expected]
    assert list(given) == []


@pytest.mark.slow
def test_a_scheduler_that_dies_leaves_finished_chunks(case, scheduler, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster.Cluster, "size", lambda _: 20)
    monkeypatch.setattr(cluster, "ANSWER_S", 3.0)
    masses, put = np.linspace(1.0, 2.0, 2000), chunks.Folder.put
    process, address = scheduler

    def killing(folder, chunk):
        put(folder, chunk)
        if len(list(folder.path.glob("chunks/*.npz"))) == 3:
            os.killpg(process.pid, signal.SIGKILL)

    with monkeypatch.context() as patched:
        patched.setattr(chunks.Folder, "put", killing)
        with pytest.raises(SweepError, match=r"the scheduler at tcp://.* is gone") as raised:
            il.sweep(case, {MASS: masses}, quantities=["contacts"], cluster=address, out=tmp_path / "out")
    kept = counts(il.open_sweep(tmp_path / "out"))["completed"]
    assert 60 <= kept < 2000
    assert raised.value.remedy.startswith(f"{kept} of 2000 points are kept in")
    monkeypatch.setattr(run, "computed", lambda made, firsts, size, workers: iter(()))
    again = il.sweep(case, {MASS: masses}, quantities=["contacts"], out=tmp_path / "out", shard="1/1")
    assert counts(again)["completed"] == kept
