"""Compiling ahead: other processes compile functions that a run will need.

They do so when a first one is not on disk. Code names the kernels that it needs next by `ahead`. Nothing is
done where all of them are on disk.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterable
from functools import cache
from importlib import import_module
from multiprocessing import parent_process
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

from impactlab.numerics import addresses
from impactlab.numerics import cache as kernel_cache
from impactlab.numerics.compile_queue import CompileQueue, Request
from impactlab.numerics.compiling import plain
from impactlab.numerics.garbage_collection import GarbageCollectionPaused

VARIABLE = "IMPACTLAB_COMPILERS"  # how many processes compile at once; by default one for each processor,
MOST = 8  # at most: a run seldom lacks more kernels that take long, and each process takes 150 MB


class Kernel(NamedTuple):
    """A compiled function that is needed soon.

    It is called from Python with arguments of some types, or by address.
    """

    function: Callable[..., Any]
    signature: Any
    allocates: bool = True


class ahead:  # noqa: N801 - it reads as a phrase: with ahead(kernels)
    """Context inside which some kernels will be needed, those that take longest to compile first.

    Parameters
    ----------
    kernels : callable
        Gives them; called only where a kernel is not on disk.
    """

    __slots__ = ("_kernels",)

    def __init__(self, kernels: Callable[[], Iterable[Kernel]]) -> None:
        self._kernels = kernels

    def __enter__(self) -> None:
        _coming.append(self._kernels)

    def __exit__(self, *_: object) -> None:
        if self._kernels in _coming:  # else they wait to be compiled
            _coming.remove(self._kernels)


_coming: list[Callable[[], Iterable[Kernel]]] = []


def processes() -> int:
    """Return how many processes may compile at once.

    1 inside processes that were started to compute, and in programs that hold Python: these would be started again.
    """
    if parent_process() is not None or "python" not in Path(sys.executable or "").name.lower():
        return 1
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    given = os.environ.get(VARIABLE, "")
    return int(given) if given.isdecimal() and int(given) > 0 else min(own, MOST)


@cache
def queue() -> CompileQueue:
    """Return the queue of this process."""
    return CompileQueue(processes() - 1, compile_request)


def before_compiling(function: Callable[..., Any]) -> None:
    """Hand kernels that are needed soon to other processes.

    Wait where one of them compiles this function.
    """
    if processes() == 1:
        return
    given, _coming[:] = list(_coming), []
    this = plain(function)
    with contextlib.suppress(Exception):  # faults of a part are reported where it is needed
        coming = [kernel for kernels in given for kernel in kernels()]
        requests = [request_of(each) for each in coming if plain(each.function) is not this and is_missing(each)]
        if any(requests):
            queue().add([each for each in requests if each is not None])
    queue().before(this.__module__, this.__qualname__)


addresses.before_compiling.append(before_compiling)


def is_missing(kernel: Kernel) -> bool:
    """Return whether a kernel is neither loaded nor on disk, where it could be kept."""
    if is_entry(kernel):
        entry: Any = kernel.function
        return not entry.overloads and kernel_cache.is_missing(entry)
    return addresses.is_missing(*kernel)


def is_entry(kernel: Kernel) -> bool:
    """Return whether Python calls a kernel; else compiled code does, by its address."""
    return hasattr(kernel.function, "overloads")


def request_of(kernel: Kernel) -> Request | None:
    """Return a kernel as a request to another process.

    None where that would not find it by its name.
    """
    function = plain(kernel.function)
    request = Request(function.__module__, function.__qualname__, is_entry(kernel), kernel.signature, kernel.allocates)
    try:
        found = function.__module__ != "__main__" and plain(named(request)) is function
    except (ImportError, AttributeError):
        return None
    return request if found else None


def named(request: Request) -> Any:
    """Return the function that a request names."""
    return attrgetter(request.name)(import_module(request.module))


def compile_request(request: Request) -> None:
    """Compile a function, and keep it on disk."""
    function = named(request)
    if request.is_entry:
        with GarbageCollectionPaused():
            function.compile(request.signature)
    else:
        addresses.compiled(plain(function), request.signature, request.allocates)
