"""Linear algebra on one thread, for reproducible results.

Eigenvectors differ in their last bits with the number of threads.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController


@cache
def _controller() -> ThreadpoolController:
    """Return the controller of the thread pools.

    To find them it reads the maps of the process, 2 ms each time.
    """
    import scipy.linalg  # noqa: F401 - loads its own library of linear algebra

    return ThreadpoolController()


def one_thread() -> AbstractContextManager[Any]:
    """Return a context in which linear algebra runs on one thread."""
    limited: AbstractContextManager[Any] = _controller().limit(limits=1)
    return limited
