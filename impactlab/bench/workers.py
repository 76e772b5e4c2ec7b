"""Worker processes: jobs are handed out, answers collected, and a process that hangs or dies is replaced."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time as clock
from collections import deque
from collections.abc import Callable, Container, Iterator, Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple

from impactlab.bench.cells import Job
from impactlab.bench.keys import code_hash
from impactlab.bench.worker import THREADS, serve
from impactlab.errors import CaseError

START_LIMIT = 120.0  # s for a process to start and import
WARM_LIMIT = 600.0  # s to compile the loops on a slow machine


class Answer(NamedTuple):
    """What became of a job."""

    job: Job
    status: str  # answered | raised | hung | crashed
    value: Any  # the answer; else a text that says why there is none


class Pending:
    """The jobs not yet handed out, scene by scene: the cells of one scene share a case and a reference."""

    def __init__(self, jobs: Sequence[Job]) -> None:
        self._scenes: dict[str, deque[Job]] = {}
        for job in jobs:
            self._scenes.setdefault(job.scene, deque()).append(job)

    def __len__(self) -> int:
        return sum(map(len, self._scenes.values()))

    def next_for(self, scene: str | None, others: Container[str | None]) -> Job:
        """Return the next job of a worker's scene; else of one that no other works at; else of the longest."""
        if scene not in self._scenes:
            free = (name for name in self._scenes if name not in others)
            scene = next(free, max(self._scenes, key=lambda name: len(self._scenes[name])))
        jobs = self._scenes[scene]
        job = jobs.popleft()
        if not jobs:
            del self._scenes[scene]
        return job


class Process:
    """One worker process and the job it is at."""

    def __init__(self, session: Path | None) -> None:
        context = get_context("spawn")
        ours, theirs = context.Pipe()
        self.connection: Connection = ours
        self.process = context.Process(target=serve, args=(theirs, session, str(Path.cwd())), daemon=True)
        with _quiet_start():
            self.process.start()
        theirs.close()
        self.job: Job | None = None
        self.scene: str | None = None  # of its last job
        self.deadline = float("inf")
        try:
            if not ours.poll(START_LIMIT):
                raise EOFError
            found = ours.recv()
        except (EOFError, OSError):
            self.kill()
            raise CaseError("a worker process did not start", remedy="See standard error for the reason.") from None
        if found != code_hash():
            self.kill()
            raise CaseError("impactlab's sources changed while the bench ran", remedy="Start it again.")

    def ask(self, job: Job | None, limit: float, *question: Any) -> None:
        """Send a question; its answer comes through the connection."""
        self.job, self.deadline = job, clock.monotonic() + limit
        self.scene = None if job is None else job.scene
        self.connection.send(question)

    def answer(self) -> tuple[str, Any]:
        """Return status and value of what came through the connection."""
        try:
            done, value = self.connection.recv()
        except (EOFError, OSError):
            self.process.join(5.0)
            code = self.process.exitcode
            self.kill()
            return "crashed", f"the process ended with {_code(code)}"
        return ("answered" if done else "raised"), value

    def kill(self) -> None:
        """End the process now."""
        self.process.kill()
        self.process.join()
        self.connection.close()


def run_jobs(
    jobs: Sequence[Job],
    question: Callable[[Job], tuple[Any, ...]],
    took: Callable[[Answer], None],
    *,
    workers: int = 1,
    limit: float,
    session: Path | None = None,
) -> None:
    """Hand jobs to worker processes and give each answer to ``took`` as it comes, in this process.

    Parameters
    ----------
    jobs : sequence of Job
        What to do; jobs of one scene are given to one worker as long as there are scenes left.
    question : callable
        What to ask about a job: name of a method of `worker.Worker` and its arguments, e.g. ``("row", job)``.
    took : callable
        Called with each answer.
    workers : int
        How many processes.
    limit : float
        Time [s] after which a worker that has not answered is killed, its job ``hung``.
    session : Path, optional
        Folder that the workers share.
    """
    left = Pending(jobs)
    team: list[Process] = []
    try:
        while left or any(member.job is not None for member in team):
            while len(team) < workers and len(team) < len(left) + sum(member.job is not None for member in team):
                team.append(_started(session, first=not team))
            for member in team:
                if member.job is None and left:
                    job = left.next_for(member.scene, {other.scene for other in team if other is not member})
                    member.ask(job, limit, *question(job))
            for member in _ready(team):
                done = member.job
                if done is None:
                    continue
                if member.connection.poll():
                    status, value = member.answer()
                else:
                    status, value = "hung", f"no answer after {limit:g} s"
                member.job = None
                if status in ("hung", "crashed"):
                    member.kill()
                    team.remove(member)
                took(Answer(done, status, value))
    finally:
        for member in team:
            member.kill()


def _started(session: Path | None, first: bool) -> Process:
    """Return a worker process; the first one compiles what is not compiled yet, so that no two do."""
    process = Process(session)
    if first:
        process.ask(None, WARM_LIMIT, "warm_up")
        if not process.connection.poll(WARM_LIMIT):
            process.kill()
            raise CaseError("the loops were not compiled in ten minutes", remedy="Try `impactlab run` on a case first.")
        status, value = process.answer()
        if status != "answered":
            process.kill()
            raise CaseError(f"a first run {status}: {value}", remedy="Try `impactlab run` on a case first.")
    return process


def _ready(team: Sequence[Process]) -> list[Process]:
    """Wait until a worker has answered, died or run out of time; return those."""
    busy = [member for member in team if member.job is not None]
    soonest = min(member.deadline for member in busy)
    ready = wait([member.connection for member in busy], max(0.0, soonest - clock.monotonic()))
    now = clock.monotonic()
    return [member for member in busy if member.connection in ready or member.deadline <= now]


def _code(code: int | None) -> str:
    if code is not None and code < 0:
        with contextlib.suppress(ValueError):
            return signal.Signals(-code).name
    return f"code {code}"


@contextlib.contextmanager
def _quiet_start() -> Iterator[None]:
    """Let processes started inside have one thread of linear algebra, and leave Ctrl-C to this one.

    Errors do not depend on the number of threads then, and times are those of one core.
    """
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    main = threading.current_thread() is threading.main_thread()
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN) if main else None
    try:
        yield
    finally:
        if main:
            signal.signal(signal.SIGINT, handler)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
