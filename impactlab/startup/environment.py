"""Checks, before heavy imports, of an environment that would end in a hang or a traceback."""

from __future__ import annotations

import os

from impactlab.errors import ImpactlabError

MIN_ADDRESS_SPACE = 700_000_000  # bytes: a small run maps 525 MB, and OpenBLAS hangs where its threads find no room
MIN_SPACE_THREADED = 2_000_000_000  # bytes of address space: below it OpenBLAS has one thread, as each maps some 40 MB


def check_environment() -> None:
    """Raise `ImpactlabError` where numba or OpenBLAS could not start in these surroundings."""
    threads = os.environ.get("NUMBA_NUM_THREADS")
    if threads is not None and not (threads.isascii() and threads.isdigit() and 1 <= int(threads[:9]) <= 1024):
        raise ImpactlabError(
            f"the environment variable NUMBA_NUM_THREADS is {threads[:40]!r}. Allowed: a whole number from 1 to 1024",
            remedy="Unset it, or give such a number.",
        )
    space = address_space()
    if space is None:
        return
    if space < MIN_ADDRESS_SPACE:
        raise ImpactlabError(
            f"the address space of this process is limited to {space / 1e6:.0f} MB, and a run needs "
            f"{MIN_ADDRESS_SPACE / 1e6:.0f} MB",
            remedy="Raise the limit (ulimit -v), or run it elsewhere.",
        )
    if space < MIN_SPACE_THREADED:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def address_space() -> int | None:
    """Return the limit of the address space [bytes]; None where there is none."""
    try:
        import resource
    except ImportError:  # not on Windows
        return None
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return None if limit == resource.RLIM_INFINITY else int(limit)
