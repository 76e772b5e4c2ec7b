"""A process pool (pebble) with a time limit for each job; one that hangs or dies ends its worker alone."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from multiprocessing import get_context, parent_process
from multiprocessing.context import BaseContext
from queue import SimpleQueue
from typing import Any, Generic, NamedTuple, TypeVar

from impactlab.errors import CaseError
from impactlab.numerics.threads import one_thread

T = TypeVar("T")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
PR_SET_PDEATHSIG = 1  # of prctl(2)
PRELOADED = ("impactlab.bench.worker", "impactlab.sweeps.engines")  # once, before workers are forked
MAX_WARM_UP_S = 600.0  # to compile the loops on a slow machine
MAX_TEXT = 500  # characters of an error


class Outcome(NamedTuple, Generic[T]):
    """The outcome of a job."""

    job: T
    status: str  # done | raised | hung | crashed
    value: Any  # the result, or the reason in words


def outcomes(
    function: Callable[[T], Any],
    jobs: Sequence[T],
    *,
    workers: int = 1,
    limit: float,
    initializer: Callable[..., None] | None = None,
    initargs: tuple[Any, ...] = (),
    warm_up: Callable[[], Any] | None = None,
) -> Iterator[Outcome[T]]:
    """Run a function on each job in worker processes, and yield the outcomes.

    They come in the order in which jobs end.

    Parameters
    ----------
    function : callable
        Called in a worker with a job; it and its results are pickled.
    jobs : sequence
        One argument each.
    workers : int
        How many processes; each has one thread of linear algebra, so that results do not depend on their number.
    limit : float
        Time [s] after which a worker is killed and its job ``hung``.
    initializer, initargs : callable, tuple
        Called at the start of each process.
    warm_up : callable, optional
        Run once in one worker before the jobs: code that it compiles is on disk when the others need it.

    Raises
    ------
    CaseError
        If no worker starts, or the warm-up does not succeed.
    """
    from pebble import ProcessPool

    if not jobs:
        return
    done: SimpleQueue[tuple[T, Any]] = SimpleQueue()
    with _one_thread_each():
        setup = (dict(os.environ), initializer, initargs)
        pool = ProcessPool(min(workers, len(jobs)), 0, _start, setup, worker_context())
        try:
            if warm_up is not None:
                status, value = _ended(pool.schedule(warm_up, timeout=MAX_WARM_UP_S), MAX_WARM_UP_S)
                if status != "done":
                    raise CaseError(f"a first run {status}: {value}", remedy="Try `impactlab run` on a case first.")
            for job in jobs:
                future = pool.schedule(function, (job,), timeout=limit)
                future.add_done_callback(partial(lambda job, future: done.put((job, future)), job))
            for _ in jobs:
                job, future = done.get()
                yield Outcome(job, *_ended(future, limit))
        finally:
            pool.stop()  # type: ignore[no-untyped-call]
            pool.join()


def _ended(future: Any, limit: float) -> tuple[str, Any]:
    """Return the status of a job and its value."""
    from pebble import ProcessExpired

    try:
        return "done", future.result()
    except TimeoutError:
        return "hung", f"no answer after {limit:g} s"
    except ProcessExpired as error:
        return "crashed", f"the process ended with {_code(error.exitcode)}"
    except RuntimeError as error:
        remedy = "See standard error. A script that starts workers does so under: if __name__ == '__main__':"
        raise CaseError(f"a worker process did not start: {error}", remedy=remedy) from None
    except Exception as error:  # noqa: BLE001 - whatever a part raises is an outcome
        return "raised", f"{type(error).__name__}: {str(error)[:MAX_TEXT]}"


def worker_context(*modules: str) -> BaseContext:
    """Return the context that starts workers.

    On Linux they are forked from a server, a process of one thread that has imported the package, and further modules
    where it does not run yet: imports take a second. Elsewhere each worker imports for itself.
    """
    if sys.platform != "linux":
        return get_context("spawn")
    from multiprocessing import forkserver

    context = get_context("forkserver")
    context.set_forkserver_preload([*PRELOADED, *modules])
    with _one_thread_each():
        forkserver.ensure_running()
    return context


def _start(environment: dict[str, str], initializer: Callable[..., None] | None, initargs: tuple[Any, ...]) -> None:
    """Prepare a worker: prints go to standard error, and the process ends with its owner."""

    def attend() -> None:
        owner = parent_process()
        if owner is not None:
            owner.join()
            os._exit(1)

    many = os.environ.get(THREADS[1]) != "1"  # a server that other code started, maybe with numpy imported
    os.environ.clear()
    os.environ.update(environment)  # of the owner now; the server has that of its start
    if many:
        one_thread().__enter__()
    sys.stdout = sys.stderr
    threading.Thread(target=attend, daemon=True).start()
    if sys.platform == "linux":  # by the system, also in the middle of a compiled run
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGKILL))
    if initializer is not None:
        initializer(*initargs)


def _code(code: int) -> str:
    if code < 0:
        with contextlib.suppress(ValueError):
            return signal.Signals(-code).name
    return f"code {code}"


@contextlib.contextmanager
def _one_thread_each() -> Iterator[None]:
    """Let processes that are started inside have one thread of linear algebra."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
