"""Subnormal numbers, below 2.2e-308, flushed to zero in steps.

They have fewer digits, and a processor takes a hundred times as long over each of them. The coordinates of damped modes
fade away into this range when nothing excites them, and a mesh is in it some way ahead of a wave. Steps of bodies take
such numbers for zero. Contact laws do not: of two numbers that differ the difference may be taken for zero, and a law
may divide by it.
"""

from __future__ import annotations

import platform
from typing import Any, cast

from llvmlite import ir
from numba import types
from numba.extending import lower_builtin, type_callable

ON_X86 = platform.machine().lower() in ("x86_64", "amd64")
AS_ZERO = 0x8040  # in the control word of a thread: results, and operands, of this size are zero
WORD, WHOLE, BYTE = ir.IntType(32), ir.IntType(64), ir.IntType(8)
_typing, _lowering = cast(tuple[Any, Any], (type_callable, lower_builtin))


def flush_subnormals() -> int:
    """Let this thread take numbers below 2.2e-308 for zero; return the state for `restore_subnormals`.

    This holds in compiled code on processors of the x86 family; elsewhere nothing changes.
    """
    return 0


def restore_subnormals(before: int) -> None:
    """Let this thread reckon with tiny numbers as it did before."""


def _access(builder: Any, name: str, room: Any) -> None:
    """Let the processor store its control word in memory, or load it from there."""
    at = builder.bitcast(room, BYTE.as_pointer())
    kind = ir.FunctionType(ir.VoidType(), [at.type])
    builder.call(builder.module.declare_intrinsic(f"llvm.x86.sse.{name}", fnty=kind), [at])


def _take(_context: Any, builder: Any, _signature: Any, _values: Any) -> Any:
    if not ON_X86:
        return ir.Constant(WHOLE, 0)
    from numba.core import cgutils

    allocate: Any = cgutils.alloca_once
    room = allocate(builder, WORD)
    _access(builder, "stmxcsr", room)
    before = builder.load(room)
    builder.store(builder.or_(before, ir.Constant(WORD, AS_ZERO)), room)
    _access(builder, "ldmxcsr", room)
    return builder.zext(before, WHOLE)


def _restore(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
    if ON_X86:
        from numba.core import cgutils

        allocate: Any = cgutils.alloca_once
        room = allocate(builder, WORD)
        builder.store(builder.trunc(values[0], WORD), room)
        _access(builder, "ldmxcsr", room)
    return context.get_dummy_value()


_typing(flush_subnormals)(lambda context: lambda: types.int64)  # noqa: ARG005 - numba's signature
_typing(restore_subnormals)(lambda context: lambda before: types.none)  # noqa: ARG005
_lowering(flush_subnormals)(_take)
_lowering(restore_subnormals, types.Integer)(_restore)
