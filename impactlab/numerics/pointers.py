"""Arrays handed to C functions as pointers and sizes.

Numba passes an array as seven words on the stack, which are written and read again at every call. The compiled loop
calls kernels in every step, so that these take a pointer and a size per array, in registers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numba
from numba import types

from impactlab.numerics.windows import VECTOR, array_at

pointer_to: Any = types.CPointer
POINTER = pointer_to(types.float64)
Kernel = Callable[..., None]


def _vv(kernel: Kernel) -> Kernel:
    def by_pointers(a: Any, n_a: int, b: Any, n_b: int) -> None:
        kernel(array_at(a, n_a), array_at(b, n_b))

    return by_pointers


def _vvv(kernel: Kernel) -> Kernel:
    def by_pointers(a: Any, n_a: int, b: Any, n_b: int, c: Any, n_c: int) -> None:
        kernel(array_at(a, n_a), array_at(b, n_b), array_at(c, n_c))

    return by_pointers


def _vvvv(kernel: Kernel) -> Kernel:
    def by_pointers(a: Any, n_a: int, b: Any, n_b: int, c: Any, n_c: int, d: Any, n_d: int) -> None:
        kernel(array_at(a, n_a), array_at(b, n_b), array_at(c, n_c), array_at(d, n_d))

    return by_pointers


def _vf(kernel: Kernel) -> Kernel:
    def by_pointers(a: Any, n_a: int, x: float) -> None:
        kernel(array_at(a, n_a), x)

    return by_pointers


FORMS = {"vv": _vv, "vvv": _vvv, "vvvv": _vvvv, "vf": _vf}  # by arguments: vectors and numbers


def form_of(arguments: Sequence[Any]) -> str:
    """Return the form of a kernel whose arrays are pointers.

    The text is empty if they are not handed over so.
    """
    form = "".join({VECTOR: "v", types.float64: "f"}.get(each, "?") for each in arguments)
    return form if form in FORMS else ""


def by_pointers(kernel: Kernel, form: str, options: dict[str, Any]) -> Kernel:
    """Return a function that takes pointers and runs the kernel.

    It takes sizes, too; the kernel is copied into it.
    """
    return FORMS[form](numba.njit(inline="always", **options)(kernel))


def pointed(arguments: Sequence[Any]) -> list[Any]:
    """Return the types of arguments with a pointer and a size for each vector."""
    return [part for each in arguments for part in ((POINTER, types.intp) if each == VECTOR else (each,))]
