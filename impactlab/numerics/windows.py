"""Ranges of flat arrays in compiled code, without the checks of a slice.

A slice in Python may begin before zero or end beyond the array; numba spends a dozen instructions on each, and loops
over such slices do not always run in vector registers. The ranges of kernels are right by construction.
"""

from __future__ import annotations

from typing import Any, cast

from numba import types
from numba.extending import intrinsic, lower_builtin, type_callable

from impactlab.types import Array

WORD = 8  # bytes of a float
VECTOR = types.float64[::1]
CONSTANT = types.Array(types.float64, 1, "C", readonly=True)  # of a module


def window(values: Array, first: int, size: int) -> Array:
    """Return a view of ``size`` values from an index on.

    The range must lie inside the array.
    """
    return values[first : first + size]


def _array(context: Any, builder: Any, pointer: Any, size: Any) -> Any:
    """Return an array of floats over memory that it does not own."""
    from numba.np.arrayobj import populate_array

    made, word = context.make_array(VECTOR)(context, builder), context.get_constant(types.intp, WORD)
    fill: Any = populate_array
    fill(made, data=pointer, shape=[size], strides=[word], itemsize=word, meminfo=None)
    return made._getvalue()


def _type_of_window(context: Any) -> Any:  # noqa: ARG001 - numba's signature
    return lambda values, first, size: VECTOR if values in (VECTOR, CONSTANT) else None  # noqa: ARG005


def _window(context: Any, builder: Any, signature: Any, given: Any) -> Any:
    values, first, size = given
    source = context.make_array(signature.args[0])(context, builder, values)
    first, size = (
        context.cast(builder, value, kind, types.intp)
        for value, kind in zip((first, size), signature.args[1:], strict=True)
    )
    return _array(context, builder, builder.gep(source.data, [first], inbounds=True), size)


def _at(typing_context: Any, pointer: Any, size: Any) -> Any:  # noqa: ARG001
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:  # noqa: ARG001
        return _array(context, builder, given[0], given[1])

    return VECTOR(pointer, types.intp), generate


typing, lowering, typed = cast(tuple[Any, Any, Any], (type_callable, lower_builtin, intrinsic))
typing(window)(_type_of_window)
for kind_of_values in (VECTOR, CONSTANT):
    lowering(window, kind_of_values, types.Integer, types.Integer)(_window)
array_at = typed(_at)  # of a pointer and a size
