"""A queue of functions that other processes compile.

They are kept on disk; this process compiles others at the same time. Each of some threads has a process
(`impactlab.numerics.compile_worker`), hands it one function after the other, and ends it when nothing waits. A process
that does not start or dies costs only time: its code is compiled here.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

IDLE_S = 10.0  # s without work after which a process ends
PATIENCE_S = 180.0  # s that a function under way is waited for: the largest takes a tenth of it on a quiet machine
WORKER = "impactlab.numerics.compile_worker"


class Request(NamedTuple):
    """A function to compile, in a form that another process understands."""

    module: str
    name: str  # in the module, with dots
    is_entry: bool  # called from Python; else a C function
    signature: Any  # numba's types of its arguments, or the signature of a C function
    allocates: bool


class CompileQueue:
    """Functions that wait to be compiled.

    Parameters
    ----------
    processes : int
        How many others may compile beside this one.
    compile_here : callable
        Compiles a request in this process.
    """

    def __init__(self, processes: int, compile_here: Callable[[Request], Any]) -> None:
        self.processes, self._compile_here = processes, compile_here
        self._changed = threading.Condition()
        self._waiting: list[Request] = []
        self._under_way: set[tuple[str, str]] = set()
        self._known: set[tuple[str, str]] = set()
        self._threads: list[threading.Thread] = []
        self._ended = 0  # processes, for good

    def add(self, requests: Sequence[Request]) -> None:
        """Let functions wait, those that take longest first; one is taken once in a session."""
        with self._changed:
            for request in requests:
                if request[:2] not in self._known:
                    self._known.add(request[:2])
                    self._waiting.append(request)
            for _ in range(min(self.processes - len(self._threads) - self._ended, len(self._waiting))):
                self._threads.append(threading.Thread(target=self._serve, daemon=True))
                self._threads[-1].start()
            self._changed.notify_all()

    def before(self, module: str, name: str) -> None:
        """Wait until no other process compiles a function.

        It is then on disk, or not begun at all. Until then this process compiles the code that waits. A process that
        does not reply is waited for `PATIENCE_S`.
        """
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            with self._changed:
                self._known.add((module, name))
                self._waiting = [each for each in self._waiting if each[:2] != (module, name)]
                if (module, name) not in self._under_way:
                    return
                if not self._waiting:
                    self._changed.wait(end - time.monotonic())
                    continue
                spare = self._waiting.pop(0)
            with contextlib.suppress(Exception):  # its next caller compiles it again, and reports
                self._compile_here(spare)

    def _serve(self) -> None:
        """Hand functions to a process of this thread until nothing waits, or it dies."""
        died = False
        try:
            with _worker() as process:
                while not died and (request := self._next()) is not None:
                    try:
                        process.stdin.write(pickle.dumps(tuple(request)))
                        process.stdin.flush()
                        died = not process.stdout.readline()
                    finally:
                        self._done(request)
        except Exception:  # noqa: BLE001 - the code is then compiled where it is needed
            died = True
        with self._changed:
            self._ended += died
            self._threads.remove(threading.current_thread())

    def _next(self) -> Request | None:
        with self._changed:
            if not self._waiting:
                self._changed.wait(IDLE_S)
            if not self._waiting:
                return None
            request = self._waiting.pop(0)
            self._under_way.add(request[:2])
            return request

    def _done(self, request: Request) -> None:
        with self._changed:
            self._under_way.discard(request[:2])
            self._changed.notify_all()


@contextlib.contextmanager
def _worker() -> Iterator[Any]:
    """Start a process that compiles; it ends with this one."""
    paths = os.pathsep.join(path or os.getcwd() for path in sys.path)  # noqa: PTH109 - as Python reads ''
    process = subprocess.Popen(  # noqa: S603 - this program
        [sys.executable, "-m", WORKER],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"PYTHONPATH": paths, "IMPACTLAB_COMPILERS": "1"},
    )
    atexit.register(process.kill)
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        atexit.unregister(process.kill)
        for pipe in filter(None, (process.stdin, process.stdout)):
            with contextlib.suppress(OSError):
                pipe.close()
