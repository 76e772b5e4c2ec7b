"""Chunks of a sweep on a Dask cluster.

Its scheduler distributes them to workers.

The program that calls keeps each chunk when it arrives and releases it on the cluster. A worker computes one chunk at a
time. A chunk whose worker dies or hangs is split until single points are left, so that one point is lost and not the
chunk.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
import re
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from queue import Empty, SimpleQueue
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from impactlab.casefile.text.words import shown
from impactlab.errors import CaseError, ExtraError, SweepError
from impactlab.jobs.process_pool import MAX_WARM_UP_S, worker_context
from impactlab.jobs.sources import code_hash, numeric_environment, tree_hash
from impactlab.sweeps.chunks import Chunk, joined
from impactlab.sweeps.engines import CHUNK_SECONDS, POINT_LIMIT_S, computed, points_in
from impactlab.sweeps.points import Sweep, chunk_of, missing

if TYPE_CHECKING:
    from distributed import Client, Future, LocalCluster

ANSWER_S = 10.0  # s in which a cluster answers, and in which a lost connection comes back
NO_WORKERS_S = 60.0  # s without any worker, after which a sweep ends
REPLACE_S = 30.0  # the same, after which a local cluster makes new ones: one that dies as it starts is not restarted
MAX_SENT = 100  # times that a sweep is sent again
PARTS = 32  # into which a chunk is split whose worker died
MAX_LOCAL = 1024  # workers
POLL_S = 0.5
DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"  # of a worker: Ctrl-C is for the caller

Job = tuple[int, int]
"""The first point and the one after the last."""


class JobOutcome(NamedTuple):
    """The outcome of a job on the cluster."""

    job: Job
    status: str  # done | hung | crashed | again, where the job itself is not to blame
    value: Any  # the chunk, or the reason in words


@contextlib.contextmanager
def connected(address: str, made: Sweep, plugins: Mapping[str, str]) -> Iterator[Cluster]:
    """Yield the cluster at an address, or a local one of ``local:N`` processes.

    A local one ends with the sweep.

    Raises
    ------
    CaseError
        If it does not respond, has no workers, or workers with other code or other plugins (hashes by module).
    ExtraError
        If Dask is not installed.
    """
    if find_spec("distributed") is None:
        raise ExtraError("a cluster needs distributed (Dask), not installed", remedy="pip install 'impactlab[cluster]'")
    local = re.fullmatch(r"local:(\d{1,4})", address)
    if local is None and not re.fullmatch(r"(tcp|tls)://[^\s/]+:\d{1,5}", address):
        text = f"{shown(address)} is not a valid address of a cluster"
        raise CaseError(text, path="--cluster", remedy="Write tcp://HOST:PORT of a Dask scheduler, or local:2.")
    if local is not None and not 1 <= int(local[1]) <= MAX_LOCAL:
        text = f"{local[1]} workers on this machine; allowed: 1 to {MAX_LOCAL}"
        raise CaseError(text, path="--cluster", remedy="Write local:2.")
    with contextlib.ExitStack() as stack:
        stack.callback(logging.getLogger("distributed").setLevel, logging.getLogger("distributed").level)
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        own = stack.enter_context(_local(int(local[1]))) if local is not None else None
        if own is not None:
            address = str(own.scheduler_address)
        client = stack.enter_context(_client(address))
        expected = fingerprint(tuple(plugins))
        _refuse_others(client, address, expected)
        yield Cluster(client, address, made, expected, own)


@contextlib.contextmanager
def _local(count: int) -> Iterator[LocalCluster]:
    """Yield a cluster of processes on the loopback address, with results in memory."""
    import dask
    from distributed import LocalCluster

    method = worker_context("distributed").get_start_method()
    settings = {"distributed.scheduler.allowed-failures": 1, "distributed.worker.multiprocessing-method": method}
    with dask.config.set(settings):
        cluster = LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            host="127.0.0.1",
            protocol="tcp",
            dashboard_address=None,
            worker_dashboard_address=None,
            memory_limit=0,  # results stay in memory
            silence_logs=logging.CRITICAL,
            preload=[DEAF],
            env=dict(os.environ),
        )
        try:
            yield cluster
        finally:
            with contextlib.suppress(Exception):
                cluster.close(timeout=ANSWER_S)


@contextlib.contextmanager
def _client(address: str) -> Iterator[Client]:
    from distributed import Client

    try:
        client = Client(address, timeout=ANSWER_S, set_as_default=False)
    except (OSError, TimeoutError) as error:
        text = f"the cluster at {address} does not answer within {ANSWER_S:g} s"
        raise CaseError(text, path="--cluster", remedy="Start its scheduler, or give another address.") from error
    try:
        yield client
    finally:
        with contextlib.suppress(Exception):
            client.close(timeout=ANSWER_S)


def fingerprint(plugins: tuple[str, ...]) -> dict[str, str]:
    """Return hashes of impactlab and plugins, and versions of numeric packages, of this process."""
    found = {"code of impactlab": code_hash(), **{f"plugin {name}": tree_hash(name) for name in plugins}}
    return found | {f"version of {name}": version for name, version in numeric_environment().items()}


def _plugins_in(hashes: Mapping[str, str]) -> tuple[str, ...]:
    """Return the plugins whose hashes are in a `fingerprint`."""
    return tuple(name.removeprefix("plugin ") for name in hashes if name.startswith("plugin "))


def _refuse_others(client: Client, address: str, expected: Mapping[str, str]) -> None:
    """Raise `CaseError` where there is no worker, or one with other code."""
    try:
        client.wait_for_workers(1, timeout=ANSWER_S)
    except TimeoutError:
        text = f"the cluster at {address} has no workers"
        raise CaseError(text, path="--cluster", remedy="Start its workers.") from None
    for worker, found in client.run(fingerprint, _plugins_in(expected), on_error="return").items():
        if isinstance(found, Exception):
            raise _other(worker, f"cannot load impactlab and its plugins: {type(found).__name__}: {str(found)[:200]}")
        for name, value in expected.items():
            if found.get(name) != value:
                raise _other(worker, f"has another {name}: {str(found.get(name))[:12]}, here {value[:12]}")


def _other(worker: str, text: str) -> CaseError:
    remedy = "Install the same impactlab, plugins and libraries on all workers."
    return CaseError(f"the worker {worker} {text}", path="--cluster", remedy=remedy)


class Cluster:
    """A Dask cluster that computes the chunks of one sweep. Made by `connected`."""

    def __init__(
        self, client: Client, address: str, made: Sweep, expected: Mapping[str, str], own: LocalCluster | None = None
    ) -> None:
        self.client, self.address, self.made, self.expected = client, address, made, dict(expected)
        self.own = own  # of this process
        self.sent: set[str] = set()  # keys of these tasks
        self.whole = self._send()

    def _send(self) -> Future:
        """Send the sweep as a task of the cluster.

        The scheduler computes it again where its last copy is lost with a worker.
        """
        sent = self.client.submit(_whole, self.made, pure=False)
        self.sent.add(str(sent.key))
        return sent

    def size(self) -> int:
        """Return the number of points in a chunk, from the first point's time.

        All workers compute this point, and so load the code.
        """
        workers = list(self.client.nthreads())
        jobs = [(number, number) for number in range(len(workers))]
        found = list(self._ended(jobs, MAX_WARM_UP_S, len(workers), dict(zip(jobs, workers, strict=True))))
        seconds = [each.value for each in found if each.status == "done"]
        if self.made.batch is not None:
            return points_in(self.made.batch.seconds)
        return points_in(median(seconds) if len(seconds) == len(found) else math.inf)

    def chunks(self, firsts: Sequence[int], size: int) -> Iterator[Chunk]:
        """Yield the chunks that begin at certain points as they arrive."""
        count = self.made.points.count
        jobs = [(first, min(first + size, count)) for first in firsts]
        lost: list[Job] = []
        for ended in self._ended(jobs, POINT_LIMIT_S + 4.0 * CHUNK_SECONDS):
            if ended.status == "done":
                yield ended.value
            else:
                lost.append(ended.job)
        for job in lost:  # one at a time: a worker that dies has nothing else to lose
            yield joined(sorted(self._split(job), key=lambda chunk: chunk.first))

    def _split(self, job: Job) -> Iterator[Chunk]:
        """Yield the chunks of parts of a job whose worker died or hung.

        A single point for which this happens becomes a row. A point counts as hung where it hangs twice: the first time
        it may have waited behind the run that hung before.
        """
        first, last = job
        step = max(1, math.ceil((last - first) / PARTS))
        parts = [(number, min(number + step, last)) for number in range(first, last, step)]
        for first_try in self._ended(parts, POINT_LIMIT_S, 1):
            ended = first_try
            if ended.status == "hung" and step == 1:
                [ended] = self._ended([ended.job], POINT_LIMIT_S, 1)
            if ended.status == "done":
                yield ended.value
            elif step == 1:
                yield chunk_of(ended.job[0], [missing(self.made, ended.status, ended.value)], self.made.wanted)
            else:
                yield from self._split(ended.job)

    def _ended(
        self, jobs: Sequence[Job], limit: float, at_once: int = 0, on: Mapping[Job, str] | None = None
    ) -> Iterator[JobOutcome]:
        """Yield the outcomes of jobs as they end.

        ``at_once`` of them wait or run, by default one for each worker.
        """
        waiting, done = deque(jobs), SimpleQueue[str]()
        busy: dict[str, tuple[Job, Future, float]] = {}
        watch = ConnectionWatch(self.client, self.address, self.own)
        try:
            while waiting or busy:
                while waiting and len(busy) < (at_once or watch.workers()):
                    job = waiting.popleft()
                    future = self._submit(job, None if on is None else on[job])
                    busy[future.key] = (job, future, time.monotonic())
                    future.add_done_callback(lambda future: done.put(future.key))
                try:
                    ended = [done.get(timeout=POLL_S)]
                except Empty:
                    watch.check(future for _, future, _ in busy.values())
                    ended = [key for key, (_, _, began) in busy.items() if time.monotonic() - began > limit]
                for key in ended:
                    if key in busy:
                        job, future, _ = busy.pop(key)
                        outcome = self._outcome(job, future, limit)
                        if outcome.status == "again":
                            waiting.append(job)
                        else:
                            yield outcome
        finally:
            for _, future, _ in busy.values():
                with contextlib.suppress(Exception):
                    future.cancel()

    def _submit(self, job: Job, worker: str | None) -> Future:
        only = {} if worker is None else {"workers": [worker], "allow_other_workers": True}
        function = _timed if job[0] == job[1] or worker is not None else _chunk
        return self.client.submit(function, self.whole, self.expected, *job, pure=False, **only)

    def _outcome(self, job: Job, future: Future, limit: float) -> JobOutcome:
        """Return the outcome of a job that ended or was too slow; release its result."""
        from distributed import KilledWorker

        if not future.done():
            self._restart_worker_of(future)
            return JobOutcome(job, "hung", f"no answer after {limit:g} s")
        if future.status == "finished":
            try:
                return JobOutcome(job, "done", future.result(timeout=ANSWER_S))
            except (OSError, TimeoutError) as error:  # its worker died before the result was fetched
                return JobOutcome(job, "crashed", f"the result was lost: {error}")
        fault = future.exception() if future.status == "error" else None
        if isinstance(fault, KilledWorker) and str(fault.task) in self.sent and len(self.sent) < MAX_SENT:
            # Workers died while they received the sweep: the scheduler gives it up, and with it all jobs.
            if self.whole.status == "error":
                self.whole = self._send()
            return JobOutcome(job, "again", "")
        if isinstance(fault, KilledWorker):
            return JobOutcome(job, "crashed", "the worker process ended")
        if fault is None:
            raise _gone(self.address)
        raise SweepError(f"a worker of the cluster at {self.address} failed: {type(fault).__name__}: {fault}")

    def _restart_worker_of(self, future: Future) -> None:
        with contextlib.suppress(Exception):  # without a nanny it goes on with its run
            busy = [worker for worker, keys in self.client.processing().items() if future.key in map(str, keys)]
            future.cancel(force=True)
            self.client.restart_workers(busy, timeout=ANSWER_S, raise_for_error=False)


class ConnectionWatch:
    """Monitor of the connection to a cluster and of the number of its workers."""

    def __init__(self, client: Client, address: str, own: LocalCluster | None) -> None:
        self.client, self.address, self.own = client, address, own
        self.counted, self.count = -math.inf, 0
        self.seen = self.lived = self.replaced = time.monotonic()

    def workers(self) -> int:
        """Return how many workers there are, counted once a second; at least 1."""
        if time.monotonic() - self.counted > 1.0:
            try:
                self.count = len(self.client.nthreads())
            except Exception as error:  # whatever a broken connection raises
                raise _gone(self.address) from error
            self.counted = time.monotonic()
            self.lived = self.counted if self.count else self.lived
        return max(1, self.count)

    def check(self, futures: Iterator[Future]) -> None:
        """Raise `SweepError` where the scheduler or all workers are gone."""
        now = time.monotonic()
        self.seen = now if self.client.status == "running" else self.seen
        if self.client.status == "closed" or now - self.seen > ANSWER_S:
            raise _gone(self.address)
        if any(future.status in ("cancelled", "lost") for future in futures):
            raise _gone(self.address)
        if self.client.status == "running":
            self.workers()
        if self.own is not None and now - max(self.lived, self.replaced) > REPLACE_S:
            count, self.replaced = len(self.own.worker_spec), now
            self.own.scale(0)
            self.own.scale(count)
        if now - self.lived > NO_WORKERS_S:
            raise SweepError(f"the cluster at {self.address} has had no workers for {NO_WORKERS_S:g} s")


def _gone(address: str) -> SweepError:
    return SweepError(f"the scheduler at {address} is gone")


def _whole(made: Sweep) -> Sweep:
    """Return a sweep as it is: the task whose result all other tasks take, so that it is sent once."""
    return made


_one_at_a_time = threading.Lock()  # of the threads of a worker


def _chunk(made: Sweep, expected: Mapping[str, str], first: int, last: int) -> Chunk:
    """Return a chunk, in a worker."""
    if fingerprint(_plugins_in(expected)) != expected:
        raise RuntimeError("it joined with another code of impactlab, of plugins or libraries")
    with _one_at_a_time:
        [chunk] = computed(made, [first], last - first, 0)
        return chunk


def _timed(made: Sweep, expected: Mapping[str, str], *_job: int) -> float:
    """Return the time of the first point in a worker [s], its code loaded before."""
    spent = math.inf
    for _ in range(2):
        began = time.perf_counter()
        _chunk(made, expected, 0, 1)
        spent = time.perf_counter() - began
    return spent
