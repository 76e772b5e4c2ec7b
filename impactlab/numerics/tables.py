"""Named tuples of arrays as one pointer in compiled code.

It points to a table of their addresses and shapes. Numba passes a tuple of arrays as seven words or more for each of
them: with some fifty arrays every call moves hundreds of words, and most of the time of a compilation goes into them.
Of a table compiled code reads the words that it needs. They do not change while it runs, and are declared so to LLVM
(`invariant.load`): they are read once before a loop.

The tuple itself is unchanged: from Python compiled functions take it as it is, and plain Python reads its fields.
"""

from __future__ import annotations

import hashlib
from typing import Any, TypeVar, cast

import numpy as np
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.pythonapi import NativeValue, unbox
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.core.typing.typeof import typeof_impl
from numba.extending import lower_getattr_generic, register_model

from impactlab.numerics.addresses import COMPILED

Kind = TypeVar("Kind", bound=type)
TypeClass: Any = types.Type
Resolver: Any = AttributeTemplate
Primitive: Any = models.PrimitiveModel
Native: Any = NativeValue
Room: Any = cgutils.alloca_once
Unpacked: Any = cgutils.unpack_tuple
DIGITS = 16  # of a digest, in names of compiled functions
typed, taken, lowered, modelled, resolved = cast(
    tuple[Any, Any, Any, Any, Any], (typeof_impl, unbox, lower_getattr_generic, register_model, infer_getattr)
)


class TableType(TypeClass):  # type: ignore[misc] # numba has types in some versions
    """The type of a table: names, types and places of fields.

    A place is the word at which a field begins.
    """

    def __init__(self, name: str, fields: tuple[tuple[str, Any], ...]) -> None:
        self.fields, self.places, self.words = fields, {}, 0
        for field, of in fields:
            self.places[field] = self.words, of
            self.words += 1 + of.ndim if isinstance(of, types.Array) else 1
        super().__init__(f"{name}{fields}")
        self._in_symbols = f"{name}.{hashlib.sha256(self.name.encode()).hexdigest()[:DIGITS]}"

    @property
    def mangling_args(self) -> tuple[str, tuple[()]]:
        """The text for the table in names of functions.

        Its own name lists all fields of all records: it would fill half of the intermediate code.
        """
        return self._in_symbols, ()


def by_table(kind: Kind) -> Kind:
    """Return a named tuple that compiled functions take as a table.

    It has C arrays and integers.
    """
    if not COMPILED:
        return kind
    known: dict[tuple[Any, ...], TableType] = {}
    seen: dict[tuple[Any, ...], TableType] = {}  # numba needs 0.6 ms for the types of fifty arrays of records

    def type_of(value: Any, context: Any) -> Any:
        form = tuple(
            (each.dtype, each.ndim, each.flags.num) if isinstance(each, np.ndarray) else type(each) for each in value
        )
        if form not in seen:
            of = tuple(typed(each, context) for each in value)
            if of not in known:
                known[of] = TableType(kind.__name__, tuple(zip(kind._fields, of, strict=True)))  # type: ignore[attr-defined]
            seen[form] = known[of]
        return seen[form]

    typed.register(kind)(type_of)
    return kind


if COMPILED:
    from llvmlite import ir

    WORD = ir.IntType(64)
    POINTER = WORD.as_pointer()

    @modelled(TableType)
    class TableModel(Primitive):  # type: ignore[misc]
        """A table is a pointer to its words."""

        def __init__(self, manager: Any, kind: Any) -> None:
            super().__init__(manager, kind, POINTER)

    @resolved
    class TableFields(Resolver):  # type: ignore[misc]
        """Fields of a table by name."""

        key = TableType

        def generic_resolve(self, table: TableType, field: str) -> Any:
            """Return the type of a field, None if there is none of that name."""
            return table.places.get(field, (0, None))[1]

    def word_at(builder: Any, table: Any, place: int, of: Any = WORD) -> Any:
        """Return a word of a table as an integer or a pointer.

        No word changes in a function that has the table.
        """
        at = builder.gep(table, [ir.Constant(WORD, place)], inbounds=True)
        word = builder.load(at if of is WORD else builder.bitcast(at, of.as_pointer()))
        word.set_metadata("invariant.load", builder.module.add_metadata([]))
        return word

    def bytes_of(entry: Any) -> int:
        """Return the size of an entry of an array; numba would have LLVM read a module for each [bytes]."""
        return int(entry.size if isinstance(entry, types.Record) else entry.bitwidth // 8)

    def field_of(context: Any, builder: Any, kind: TableType, table: Any, field: str) -> Any:
        """Return a field of a table.

        It is an array over memory that it does not own, or an integer.
        """
        from numba.np.arrayobj import populate_array

        place, of = kind.places[field]
        if not isinstance(of, types.Array):
            return word_at(builder, table, place)
        fill: Any = populate_array
        made = context.make_array(of)(context, builder)
        item = context.get_constant(types.intp, bytes_of(of.dtype))
        shape = [word_at(builder, table, place + 1 + axis) for axis in range(of.ndim)]
        strides = [item]
        for length in shape[:0:-1]:
            strides.insert(0, builder.mul(strides[0], length))
        data = word_at(builder, table, place, made.data.type)
        fill(made, data=data, shape=shape, strides=strides, itemsize=item, meminfo=None)
        return made._getvalue()

    def table_of(kind: TableType, given: Any, c: Any) -> Any:
        """Write the table of a named tuple handed over from Python.

        It is an argument of a compiled function.
        """
        builder = c.builder
        words = Room(builder, WORD, size=kind.words)

        def write(place: int, value: Any) -> None:
            builder.store(value, builder.gep(words, [ir.Constant(WORD, place)], inbounds=True))

        for number, (field, of) in enumerate(kind.fields):
            place, item = kind.places[field][0], c.pyapi.tuple_getitem(given, number)
            if not isinstance(of, types.Array):
                write(place, c.unbox(of, item).value)
                continue
            made = c.context.make_array(of)(c.context, builder)
            c.pyapi.numba_array_adaptor(item, builder.bitcast(made._getpointer(), c.pyapi.voidptr))
            write(place, builder.ptrtoint(made.data, WORD))
            for axis, length in enumerate(Unpacked(builder, made.shape)):
                write(place + 1 + axis, length)
        # The pointer passes through an empty instruction, so that no read of a word may move before these writes.
        same = ir.InlineAsm(ir.FunctionType(POINTER, [POINTER]), "", "=r,0,~{memory}", side_effect=True)
        return Native(builder.call(same, [words]))

    lowered(TableType)(field_of)
    taken(TableType)(table_of)
