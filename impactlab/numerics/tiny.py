"""Numbers below 2.2e-308, which have fewer digits: a processor takes a hundred times as long over each of them.

The coordinates of damped modes fade away into this range when nothing excites them any more.
"""

from __future__ import annotations

import platform
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from llvmlite import ir
from numba import types

from impactlab.numerics.addresses import COMPILED, entered
from impactlab.numerics.compiling import ENTRY
from impactlab.numerics.windows import typed

SERVES = COMPILED and platform.machine().lower() in ("x86_64", "amd64")
AS_ZERO = 0x8040  # in the control word of a thread: results, and operands, of this size are zero
WORD = ir.IntType(32)


def _access(builder: Any, name: str, room: Any) -> None:
    """Let the processor store its control word in memory, or load it from there."""
    at = builder.bitcast(room, ir.IntType(8).as_pointer())
    kind = ir.FunctionType(ir.VoidType(), [at.type])
    builder.call(builder.module.declare_intrinsic(f"llvm.x86.sse.{name}", fnty=kind), [at])


def _read(_: Any) -> Any:
    def generate(_context: Any, builder: Any, _signature: Any, _values: Any) -> Any:
        room = builder.alloca(WORD)
        _access(builder, "stmxcsr", room)
        return builder.zext(builder.load(room), ir.IntType(64))

    return types.int64(), generate


def _write(_: Any, word: Any) -> Any:  # noqa: ARG001 - numba's signature
    def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        room = builder.alloca(WORD)
        builder.store(builder.trunc(values[0], WORD), room)
        _access(builder, "ldmxcsr", room)
        return context.get_dummy_value()

    return types.void(types.int64), generate


read: Any = typed(_read)
write: Any = typed(_write)


@ENTRY
def control_word() -> int:
    """Return the control word of floating point of this thread."""
    return int(read())


@ENTRY
def set_control_word(word: int) -> None:
    """Set it."""
    write(word)


@contextmanager
def tiny_as_zero() -> Iterator[None]:
    """Take numbers below 2.2e-308 for zero inside, in compiled code on processors of the x86 family."""
    if not SERVES:
        yield
        return
    before = entered(control_word)
    entered(set_control_word, before | AS_ZERO)
    try:
        yield
    finally:
        set_control_word(before)
