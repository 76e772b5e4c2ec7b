"""Functions passed to the compiled loop as addresses.

A new part needs no recompilation of the loop. With compilation on, an address is that of a C function made by numba (or
of a C callback into Python) and `call` is a machine call. With NUMBA_DISABLE_JIT=1, and inside `interpreted`, an
address is the number of a Python function and `call` looks it up.
"""

from __future__ import annotations

import contextlib
import dis
import logging
import re
import threading
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import parent_process
from types import FunctionType
from typing import Any

import numba
import numpy as np
from numba import from_dtype, types
from numba.core import cgutils
from numba.core.ccallback import CFunc
from numba.core.errors import NumbaError
from numba.core.sigutils import normalize_signature
from numba.extending import intrinsic

from impactlab.errors import PluginError, closest
from impactlab.numerics.cache import FOREIGN, cache_of, is_kept
from impactlab.numerics.garbage_collection import GarbageCollectionPaused
from impactlab.numerics.pointers import by_pointers, form_of, pointed
from impactlab.numerics.windows import VECTOR
from impactlab.startup.wall_time import COMPILING, spent_on
from impactlab.types import Port, Reply, Side

config: Any = numba.config
type_of: Any = numba.typeof
CALLBACK: Any = CFunc
normalised: Any = normalize_signature
COMPILED = not config.DISABLE_JIT

FREE = types.void(VECTOR, VECTOR)
MEASURE = types.void(VECTOR, VECTOR, VECTOR)
DERIVE = FREE
RETIME = types.void(VECTOR, types.float64)
COLUMNS = types.void(VECTOR, VECTOR, VECTOR, VECTOR)
TERMS = types.void(VECTOR, types.float64, VECTOR, VECTOR, VECTOR, VECTOR, VECTOR, VECTOR, VECTOR)
RESPOND = types.void(from_dtype(np.dtype(Port)), from_dtype(np.dtype(Reply)))

# Sums may be reordered, so that they run in vector registers; nothing may be assumed about NaN or infinity.
FAST = {"reassoc", "contract"}
MAX_UNKNOWNS = 2000  # of a body in a trial: its response columns then take Python some 50 ms
LOG = logging.getLogger("impactlab")
_logged: list[bool] = []  # that code is compiled
_in_python: dict[Callable[..., Any], Callable[..., Any]] = {}
_plain: list[Callable[..., None]] = []
_for_arrays: dict[Callable[..., None], int] = {}
_compiled: dict[tuple[Any, int], tuple[Any, Any]] = {}  # the signature is kept, so that its id stays its own
_wrappers: dict[Any, Callable[..., Any]] = {}  # of functions that take a table, by function
before_compiling: list[Callable[[Callable[..., Any]], None]] = []
"""Called with a function that is not on disk, before it is compiled."""


class _Mode(threading.local):
    """Whether plans of this thread are only checked, and kernels interpreted.

    Plans that are only checked never run; interpreted kernels run as plain Python.
    """

    trial = interpreting = False


_mode = _Mode()


def call_in_python(address: int, *arguments: Any) -> None:
    """Call the Python function with this number."""
    _plain[address](*arguments)


if COMPILED:

    def split(context: Any, builder: Any, kind: Any, value: Any) -> list[Any]:
        """Return pointer and size of a vector, a number as it is."""
        if kind != VECTOR:
            return [value]
        array = context.make_array(kind)(context, builder, value)
        return [array.data, array.nitems]

    def _call(typing_context: Any, address: Any, *arguments: Any) -> Any:  # noqa: ARG001 - numba's signature
        """Call the C function at an address; the arguments must be of its very types."""

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:  # noqa: ARG001
            from llvmlite import ir

            unpack: Any = cgutils.unpack_tuple
            passed = unpack(builder, values[1])
            if form_of(arguments):
                passed = [
                    part for pair in zip(arguments, passed, strict=True) for part in split(context, builder, *pair)
                ]
            function = ir.FunctionType(ir.VoidType(), [value.type for value in passed])
            builder.call(builder.inttoptr(values[0], function.as_pointer()), passed)
            return context.get_dummy_value()

        star: Any = types.StarArgTuple
        return types.void(types.intp, star(arguments)), generate

    call: Any = intrinsic(_call)

else:
    call = call_in_python


def in_python(function: Any) -> Any:
    """Return a compiled function as plain Python, with its callees.

    Other functions are returned as they are.
    """
    if function is call:
        return call_in_python
    inner = getattr(function, "py_func", function)
    if not isinstance(inner, FunctionType) or inner.__module__.partition(".")[0] in FOREIGN:
        return function
    if inner not in _in_python:
        names = dict(inner.__globals__)
        _in_python[inner] = FunctionType(inner.__code__, names, inner.__name__, inner.__defaults__, inner.__closure__)
        names.update({name: in_python(names[name]) for name in inner.__code__.co_names if name in names})
    return _in_python[inner]


@contextlib.contextmanager
def trial() -> Iterator[None]:
    """Let `interpreted` hold inside: for plans that are checked and never run."""
    before, _mode.trial = _mode.trial, True
    try:
        yield
    finally:
        _mode.trial = before


def in_trial() -> bool:
    """Return whether plans are checked and never run, as inside `trial`."""
    return _mode.trial


@contextlib.contextmanager
def interpreted(unknowns: int) -> Iterator[None]:
    """Run kernels of few unknowns as plain Python within a trial.

    Results differ by rounding alone. Loading compiled code takes a fifth of a second. Addresses that are made inside
    hold only there.
    """
    _mode.interpreting = _mode.trial and unknowns <= MAX_UNKNOWNS
    try:
        yield
    finally:
        _mode.interpreting = False


def log_compiling(entry: Any) -> None:
    """Log once in a session that compiled code is made first.

    This is done if that of a function is not on disk.
    """
    if COMPILED and parent_process() is None and not _logged and not is_kept(entry):
        _logged.append(True)
        LOG.warning("compiling code for this kind of run (once per machine, up to a minute) ...")


def entered(entry: Any, *arguments: Any) -> Any:
    """Call a compiled function; its first call is booked as compiling."""
    if _mode.interpreting:
        return in_python(entry)(*arguments)
    if not is_loaded(entry):
        with spent_on(COMPILING), GarbageCollectionPaused():
            log_compiling(entry)
            announce_compiling(entry)
            return entry(*arguments)
    return entry(*arguments)


def entered_with_table(entry: Any, table: Any, *others: Any) -> Any:
    """Call a compiled function with a table (`impactlab.numerics.tables`); its first call as `entered`.

    ``others`` are numbers, and arrays whose form is always the same, as is that of the table. Numba compares the forms
    with those of earlier calls, which takes longer than a short run; here the function is called as it was compiled.
    """
    wrapper = _wrappers.get(entry)
    if wrapper is not None and not _mode.interpreting:
        return wrapper(table, *others)
    found = entered(entry, table, *others)
    if COMPILED and not _mode.interpreting and len(entry.overloads) == 1:
        _wrappers[entry] = next(iter(entry.overloads.values())).entry_point
    return found


def load(entry: Any, signature: tuple[Any, ...]) -> None:
    """Load a compiled function for arguments of some types, before its first call."""
    if COMPILED and not entry.overloads:
        with spent_on(COMPILING), GarbageCollectionPaused():
            announce_compiling(entry)
            entry.compile(signature)


def announce_compiling(entry: Any) -> None:
    """Call the functions in `before_compiling` for one compiled next.

    They are not called if it is on disk.
    """
    if not is_kept(entry):
        for each in before_compiling:
            each(entry)


def is_loaded(entry: Any) -> bool:
    """Return whether a compiled function has been called before; True of plain Python."""
    return not COMPILED or bool(entry.overloads)


def compiled(function: Callable[..., None], signature: Any, allocates: bool = True) -> Any:
    """Return the C function of a Python one.

    It comes from the disk cache where it can be kept there. One with a signature of its own may make arrays, unless
    ``allocates`` is False.
    """
    known = _compiled.get((function, id(signature)))  # signatures are constants; comparing them takes far longer
    if known is not None:
        return known[1]
    with spent_on(COMPILING), GarbageCollectionPaused():
        return _compiled_now(function, signature, allocates)


def _compiled_now(function: Callable[..., None], signature: Any, allocates: bool) -> Any:
    if signature == RESPOND and function.__code__.co_argcount != 2:
        raise PluginError(
            f"{_place(function, TypeError())}: `{function.__qualname__}` takes {function.__code__.co_argcount} "
            "arguments, and is called with two, port and reply",
            remedy="Write @staticmethod, and below it def respond(port: Port, reply: Reply) -> None.",
        )
    try:
        made = _c_function(function, signature, _options_of(signature, allocates))
    except Exception as error:
        raise PluginError(
            f"{_place(function, error)}: `{function.__qualname__}` cannot be compiled: {_fault(error)}",
            remedy="Compiled code takes floats, `math` and fields of its records; `compiled = False` takes any Python.",
        ) from error
    _compiled[function, id(signature)] = signature, made
    return made


def is_missing(function: Callable[..., None], signature: Any, allocates: bool = True) -> bool:
    """Return whether a C function is neither loaded nor on disk.

    False where it could not be kept on disk.
    """
    if (function, id(signature)) in _compiled:
        return False
    made = _callback(function, signature, _options_of(signature, allocates))
    return made._cache.keeps and not _is_on_disk(made)


def _options_of(signature: Any, allocates: bool) -> dict[str, Any]:
    return {"fastmath": FAST, "_nrt": allocates and signature != RESPOND and not form_of(signature.args)}


def _is_on_disk(made: Any) -> bool:
    return bool(made._cache.holds(made._sig, made._targetdescr.target_context))


def _callback(function: Callable[..., None], signature: Any, options: dict[str, Any]) -> Any:
    """Return a C function that is not compiled yet."""
    form = form_of(signature.args)
    if form:
        taken = types.void(*pointed(signature.args))
        made = CALLBACK(by_pointers(function, form, options), normalised(taken), locals={}, options=options)
    else:
        made = CALLBACK(function, normalised(signature), locals={}, options=options)
    made._cache = cache_of(function, options)
    return made


def _c_function(function: Callable[..., None], signature: Any, options: dict[str, Any]) -> Any:
    """Return a C function, if possible without numba's runtime for objects.

    The runtime counts references at every slice of an array. Code that makes arrays of its own needs that runtime, and
    is compiled again with it.
    """
    made = _callback(function, signature, options)
    if before_compiling and not _is_on_disk(made):
        for each in before_compiling:
            each(function)
    try:
        made.compile()
    except NumbaError:
        if options["_nrt"]:
            raise
        return _c_function(function, signature, options | {"_nrt": True})
    return made


def _place(function: Callable[..., None], error: Exception) -> str:
    """Return file and line of a name that a compilation missed.

    Else they are those of the function.
    """
    code = function.__code__
    missing = error.args[0] if isinstance(error, KeyError) else None
    used = (each.positions for each in dis.get_instructions(function) if missing and each.argval == missing)
    line = next((place.lineno for place in used if place and place.lineno), code.co_firstlineno)
    return f"{code.co_filename}, line {line}"


def _fault(error: Exception) -> str:
    if isinstance(error, KeyError):
        names = [name for record in (Port, Reply, Side) for name, *_ in record._fields_]
        return f"its records have no field {error.args[0]!r}.{closest(str(error.args[0]), names)}"
    said = [line.strip() for line in str(error).splitlines() if line.strip() and not line.startswith("Failed in")]
    if said and re.match("No conversion from .* to none", said[0]):
        return "it returns a value; it must return nothing, and write into its records, as in reply.force = ..."
    return said[0] if said else type(error).__name__


def kernel_address(function: Callable[..., None] | None, signature: Any, allocates: bool = True) -> int:
    """Return the address of a function as `compiled` makes it; 0 for none."""
    if function is None:
        return 0
    if COMPILED and not _mode.interpreting:
        return int(compiled(function, signature, allocates).address)
    return plain_address(in_python(function) if _mode.interpreting else function)


def address_for(function: Callable[..., None], arrays: Sequence[Any], numbers: Sequence[Any]) -> int:
    """Return the address of a function of tables and then numbers (numba's types), found at its first use.

    Tables differ in the size of their arrays and never in type, and typing them takes 0.3 ms.
    """
    if function not in _for_arrays:
        signature = types.void(*map(type_of, arrays), *numbers) if COMPILED else None
        _for_arrays[function] = kernel_address(function, signature)
    return _for_arrays[function]


def plain_address(function: Callable[..., None]) -> int:
    """Return the number by which `call_in_python` calls a Python function."""
    _plain.append(function)
    return len(_plain) - 1
