"""Decorators of compiled functions: each combination of numba's options once.

Pieces that allocate nothing are compiled without numba's runtime for objects; only functions that Python calls have a
wrapper for it. A decorated function keeps its signature for editors and type checkers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeVar, cast

import numba
from numba import types
from numba.core.registry import CPUDispatcher

from impactlab.numerics.addresses import FAST
from impactlab.numerics.cache import digest_of, kept
from impactlab.numerics.part_code import as_parts, named_by

Function = TypeVar("Function", bound=Callable[..., Any])


class Decorator(Protocol):
    """A decorator that compiles a function; its signature stays."""

    def __call__(self, function: Function, /) -> Function: ...


njit: Any = numba.njit
general: Any = types.unliteral
CALLED = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}  # by compiled functions only
EXACTLY = {"_nrt": False, "error_model": "numpy"}  # no sum reordered; a division by zero gives inf, as numpy's


class OnceCompiled(CPUDispatcher):
    """A function that is compiled once for its types.

    Numba compiles one more for each constant that it is given.
    """

    def compile(self, sig: Any) -> Any:
        """Compile a function for a signature as a part of its callers.

        It is read from disk if it is there.
        """
        context: Any = self.targetctx
        with as_parts(context.codegen()), named_by(digest_of(self)):
            return super().compile(sig)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return the template of a call from compiled code.

        It has the types of constants in place of their values.
        """
        return super().get_call_template(tuple(map(general, args)), {name: general(each) for name, each in kws.items()})


def once(make: Callable[..., Any]) -> Decorator:
    """Return a decorator whose functions are compiled once for their types."""

    def decorated(function: Function) -> Function:
        made: Any = make(function)
        if made is not function:  # not with compilation switched off
            made.__class__ = OnceCompiled
        return cast(Function, made)

    return decorated


class PlainFromPython(OnceCompiled):
    """A function that compiled code copies and Python calls as it stands, without compiling it."""

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)


def copied(function: Function) -> Function:
    """Return a function that is copied into its compiled callers; copies of `register_jitable` run slower."""
    made = njit(inline="always")(function)
    if made is not function:  # not with compilation switched off
        made.__class__ = PlainFromPython
    return cast(Function, made)


def called_plain(function: Function) -> Function:
    """Return a function that compiled code calls, with one body.

    All of its callers share the body; from Python it is a plain function.
    """
    made: Any = PART(function)
    if made is not function:  # not with compilation switched off
        made.__class__ = PlainFromPython
    return cast(Function, made)


# Of the step loop and the schemes: called from Python, called by compiled functions, copied into them, called by both.
ENTRY: Decorator = kept(_nrt=False, fastmath=FAST)
PART: Decorator = once(kept(_nrt=False, fastmath=FAST, **CALLED))
MERGED: Decorator = once(kept(_nrt=False, fastmath=FAST, forceinline=True, **CALLED))  # as a PART, merged by LLVM
INLINE: Decorator = njit(inline="always", _nrt=False, **CALLED)
HELPER: Decorator = once(kept(_nrt=False, fastmath=FAST))
IN_ORDER: Decorator = kept(_nrt=False, fastmath={"contract"})  # a helper whose sums stand as they are written
UNPACK: Decorator = copied  # into kernels; from Python a plain function
LAW_PART: Decorator = called_plain  # of a law: parts that are copied into each other grow with every level
# Of the solution from event to event; parts that allocate need the runtime.
EXACT_ENTRY: Decorator = kept(**EXACTLY)
RELEASING_ENTRY: Decorator = kept(nogil=True, **EXACTLY)  # without the interpreter's lock
EXACT_PART: Decorator = once(kept(**EXACTLY, **CALLED))
EXACT_INLINE: Decorator = njit(inline="always", **EXACTLY, **CALLED)
ALLOCATING_PART: Decorator = njit(error_model="numpy", **CALLED)


def plain(function: Function) -> Function:
    """Return the Python function behind a compiled one, itself where nothing is compiled."""
    return getattr(function, "py_func", function)


def called(inlined: Function) -> Function:
    """Return a function that is copied into its callers, compiled once and called instead."""
    return PART(plain(inlined))
