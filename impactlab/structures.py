"""C structures laid out by their annotations.

They are records that compiled code and plain Python read under the same names.
"""

from __future__ import annotations

import ctypes
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

Numbers = ctypes.Array[ctypes.c_double]
"""Room for some numbers inside a record: written and read by index."""

Integers = ctypes.Array[ctypes.c_int64]
"""The same for integers."""

Record = TypeVar("Record", bound=ctypes.Structure)


def record(kind: type[Record]) -> type[Record]:
    """Lay out a C structure by its annotations, in their order.

    Fields are numbers, other records, and room for some numbers.
    """
    fields: list[tuple[str, Any]] = []
    for name, hint in get_type_hints(kind, include_extras=True).items():
        if hint is float:
            fields.append((name, ctypes.c_double))
        elif hint is int:
            fields.append((name, ctypes.c_int64))
        elif get_origin(hint) is Annotated:
            array, count = get_args(hint)
            fields.append((name, get_args(array)[0] * count))
        else:
            fields.append((name, hint))
    kind._fields_ = fields
    return kind
