"""SIMD lanes: eight neighbours of a flat array in one vector register.

They serve sweeps in which each value needs the one before it. A compiler leaves such a sweep to scalar code, where
every value waits for the last one. Written with whole registers, eight values wait once
(`impactlab.numerics.chain_solve`). In plain Python lanes are arrays of eight values; compiled, they add, subtract and
multiply as numbers do, and a product that is added is not rounded before.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import lower_builtin, models, register_model, type_callable

from impactlab.numerics.windows import VECTOR
from impactlab.structures import Numbers
from impactlab.types import Array

LANES = 8
_VALUES = ir.VectorType(ir.DoubleType(), LANES)
_PLACES = ir.VectorType(ir.IntType(32), LANES)
_ZERO = ir.Constant(_VALUES, [0.0] * LANES)
_typing, _lowering, _model, _models = cast(tuple[Any, ...], (type_callable, lower_builtin, register_model, models))


def lanes_at(values: Array | Numbers, first: int) -> Array:
    """Return eight values from an index on; they must lie inside the array."""
    return np.array(values[first : first + LANES])


def put_lanes(values: Array | Numbers, first: int, lanes: Array) -> None:
    """Write eight values from an index on; the range must lie inside the array."""
    values[first : first + LANES] = lanes


def all_lanes(value: float) -> Array:
    """Return a value in all lanes."""
    return np.full(LANES, value)


def lanes_of_pairs(even: float, odd: float) -> Array:
    """Return one value in lanes 0, 2, 4, 6 and another in the others."""
    return np.tile((even, odd), LANES // 2)


def swapped(lanes: Array) -> Array:
    """Return the lanes with neighbours exchanged in pairs: 1, 0, 3, 2 and so on."""
    return lanes.reshape(-1, 2)[:, ::-1].ravel()


def later_one(lanes: Array) -> Array:
    """Return the lanes moved on by one, zero in the first."""
    return np.append(np.zeros(1), lanes[:-1])


def later_two(lanes: Array) -> Array:
    """Return the lanes moved on by two, zeros in the first."""
    return np.append(np.zeros(2), lanes[:-2])


def later_four(lanes: Array) -> Array:
    """Return the lanes moved on by four, zeros in the first."""
    return np.append(np.zeros(4), lanes[:-4])


def earlier_one(lanes: Array) -> Array:
    """Return the lanes moved back by one, zero in the last."""
    return np.append(lanes[1:], np.zeros(1))


def earlier_two(lanes: Array) -> Array:
    """Return the lanes moved back by two, zeros in the last."""
    return np.append(lanes[2:], np.zeros(2))


def earlier_four(lanes: Array) -> Array:
    """Return the lanes moved back by four, zeros in the last."""
    return np.append(lanes[4:], np.zeros(4))


def after_last(before: Array, lanes: Array) -> Array:
    """Return the lanes moved on by one.

    The last one of the lanes before them is in the first.
    """
    return np.append(before[-1:], lanes[:-1])


def before_first(lanes: Array, after: Array) -> Array:
    """Return the lanes moved back by one.

    The first one of the lanes after them is in the last.
    """
    return np.append(lanes[1:], after[:1])


def all_first(lanes: Array) -> Array:
    """Return the first value in all lanes."""
    return np.full(LANES, lanes[0])


def all_last(lanes: Array) -> Array:
    """Return the last value in all lanes."""
    return np.full(LANES, lanes[-1])


def first_lane(lanes: Array) -> float:
    """Return the first value."""
    return float(lanes[0])


def lane(lanes: Array, place: int) -> float:
    """Return the value at a place."""
    return float(lanes[place])


def larger_lanes(one: Array, other: Array) -> Array:
    """Return the larger value in each lane."""
    return np.where(one > other, one, other)


def roots_of_lanes(lanes: Array) -> Array:
    """Return the square root in each lane."""
    return np.sqrt(lanes)


def lanes_above(one: Array, other: Array) -> int:
    """Return which lanes of the first are above those of the other, as bits.

    The bit of the first lane is 1, then 2, then 4.
    """
    return int(np.dot(one > other, 1 << np.arange(LANES)))


def sum_of_lanes(lanes: Array) -> float:
    """Return the sum of the eight values, added in pairs four, two and one apart."""
    fours = lanes[:4] + lanes[4:]
    twos = fours[:2] + fours[2:]
    return float(twos[0] + twos[1])


class _LanesType(types.Type):
    def __init__(self) -> None:
        super().__init__("Lanes")


LANES_TYPE = _LanesType()
OF_RECORD = types.NestedArray(types.float64, (LANES,))  # eight values in a record


@_model(_LanesType)
class _LanesModel(_models.PrimitiveModel):  # type: ignore[misc, name-defined]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VALUES)


def _known(function: Callable[..., Any], result: Any, given: Sequence[Any], generate: Callable[..., Any]) -> None:
    """Register the types of a function and its code with numba.

    The code is ``generate(context, builder, values)``.
    """

    def resolved(*kinds: Any) -> Any:
        same = (
            kind == asked or (asked == types.intp and isinstance(kind, types.Integer))
            for kind, asked in zip(kinds, given, strict=True)
        )
        return result if all(same) else None

    # Numba reads the number of arguments from the signature.
    of_size = {1: lambda a: resolved(a), 2: lambda a, b: resolved(a, b), 3: lambda a, b, c: resolved(a, b, c)}

    def lower(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        cast_to = [
            context.cast(builder, value, kind, asked)
            for value, kind, asked in zip(values, signature.args, given, strict=True)
        ]
        made = generate(context, builder, cast_to)
        return context.get_dummy_value() if result == types.none else made

    _typing(function)(lambda context: of_size[len(given)])  # noqa: ARG005 - numba's signature
    _lowering(function, *(types.Integer if each == types.intp else each for each in given))(lower)


def _pointer(context: Any, builder: Any, array: Any, first: Any) -> Any:
    source = context.make_array(VECTOR)(context, builder, array)  # of a record's array the same words
    return builder.bitcast(builder.gep(source.data, [first], inbounds=True), _VALUES.as_pointer())


def _load(context: Any, builder: Any, values: Any) -> Any:
    return builder.load(_pointer(context, builder, *values), align=LANES)


def _store(context: Any, builder: Any, values: Any) -> None:
    builder.store(values[2], _pointer(context, builder, *values[:2]), align=LANES)


def _shuffled(places: list[int]) -> Callable[..., Any]:
    """Return the code for lanes taken from these places.

    Places are those of the lanes, followed by eight zeros.
    """
    return lambda _, builder, values: builder.shuffle_vector(values[0], _ZERO, ir.Constant(_PLACES, places))


def _after_last(_: Any, builder: Any, values: Any) -> Any:
    return builder.shuffle_vector(*values, ir.Constant(_PLACES, list(range(LANES - 1, 2 * LANES - 1))))


def _before_first(_: Any, builder: Any, values: Any) -> Any:
    return builder.shuffle_vector(*values, ir.Constant(_PLACES, list(range(1, LANES + 1))))


def _spread(_: Any, builder: Any, values: Any) -> Any:
    alone = builder.insert_element(_ZERO, values[0], ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(alone, _ZERO, ir.Constant(_PLACES, [0] * LANES))


def _pairs(_: Any, builder: Any, values: Any) -> Any:
    first = builder.insert_element(_ZERO, values[0], ir.Constant(ir.IntType(32), 0))
    both = builder.insert_element(first, values[1], ir.Constant(ir.IntType(32), 1))
    return builder.shuffle_vector(both, _ZERO, ir.Constant(_PLACES, [0, 1] * (LANES // 2)))


def _summed(_: Any, builder: Any, values: Any) -> Any:
    total = values[0]
    for apart in (4, 2, 1):
        moved = builder.shuffle_vector(total, _ZERO, ir.Constant(_PLACES, list(range(apart, LANES + apart))))
        total = builder.fadd(total, moved)
    return builder.extract_element(total, ir.Constant(ir.IntType(32), 0))


def _larger(_: Any, builder: Any, values: Any) -> Any:
    return builder.select(builder.fcmp_ordered(">", *values), *values)


def _roots(_: Any, builder: Any, values: Any) -> Any:
    name, kind = f"llvm.sqrt.v{LANES}f64", ir.FunctionType(_VALUES, [_VALUES])
    known = builder.module.globals.get(name)
    return builder.call(known or ir.Function(builder.module, kind, name), values)


def _above(_: Any, builder: Any, values: Any) -> Any:
    bits = builder.bitcast(builder.fcmp_ordered(">", *values), ir.IntType(LANES))
    return builder.zext(bits, ir.IntType(64))


def _sum_of(name: str) -> Callable[..., Any]:
    return lambda _, builder, values: getattr(builder, name)(*values, flags=("contract",))


for _values in (VECTOR, OF_RECORD):
    _known(lanes_at, LANES_TYPE, (_values, types.intp), _load)
    _known(put_lanes, types.none, (_values, types.intp, LANES_TYPE), _store)
_known(all_lanes, LANES_TYPE, (types.float64,), _spread)
_known(lanes_of_pairs, LANES_TYPE, (types.float64, types.float64), _pairs)
_known(swapped, LANES_TYPE, (LANES_TYPE,), _shuffled([1, 0, 3, 2, 5, 4, 7, 6]))
for _function, _by in ((later_one, 1), (later_two, 2), (later_four, 4)):
    _known(_function, LANES_TYPE, (LANES_TYPE,), _shuffled([LANES] * _by + list(range(LANES - _by))))
for _function, _by in ((earlier_one, 1), (earlier_two, 2), (earlier_four, 4)):
    _known(_function, LANES_TYPE, (LANES_TYPE,), _shuffled(list(range(_by, LANES + _by))))
_known(after_last, LANES_TYPE, (LANES_TYPE, LANES_TYPE), _after_last)
_known(before_first, LANES_TYPE, (LANES_TYPE, LANES_TYPE), _before_first)
_known(all_first, LANES_TYPE, (LANES_TYPE,), _shuffled([0] * LANES))
_known(all_last, LANES_TYPE, (LANES_TYPE,), _shuffled([LANES - 1] * LANES))
_known(lane, types.float64, (LANES_TYPE, types.intp), lambda _, builder, values: builder.extract_element(*values))
_known(
    first_lane,
    types.float64,
    (LANES_TYPE,),
    lambda _, builder, values: builder.extract_element(values[0], ir.Constant(ir.IntType(32), 0)),
)
_known(larger_lanes, LANES_TYPE, (LANES_TYPE, LANES_TYPE), _larger)
_known(roots_of_lanes, LANES_TYPE, (LANES_TYPE,), _roots)
_known(lanes_above, types.int64, (LANES_TYPE, LANES_TYPE), _above)
_known(sum_of_lanes, types.float64, (LANES_TYPE,), _summed)
for _operator, _name in ((operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul")):
    _known(_operator, LANES_TYPE, (LANES_TYPE, LANES_TYPE), _sum_of(_name))
