"""Searches that numba repeats at every use of an operator or an array, shortened. The compiled code is the same.

- For a sum of two floats numba asks some thirty templates for a signature, those of arrays, lists and texts too. One
  that stands in a template's list of cases depends on the types of the arguments alone, and is found once.
- Compiler options are keys of its tables. All have the same hash, and two sets are compared option by option.
- For each array numba looks for a conversion to an array. It finds none, and then loads all of its registries again.

Together they take a tenth of the time of a compilation.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, cast

from numba import types
from numba.core.targetconfig import TargetConfig
from numba.core.types.functions import BaseFunction
from numba.extending import lower_builtin

Function, Options, lowered = cast(tuple[Any, Any, Any], (BaseFunction, TargetConfig, lower_builtin))
NUMBERS = (types.Number, types.Boolean)


@cache
def shorten_searches() -> None:
    """Let numba keep what it has found, in this process."""
    find, compare = Function.get_call_type, Options.__eq__

    def signature_of(self: Any, context: Any, args: tuple[Any, ...], kws: Mapping[str, Any]) -> Any:
        if kws or not all(isinstance(each, NUMBERS) for each in args):
            return find(self, context, args, kws)
        kept = vars(self).setdefault("_kept_signatures", {})  # with the function: it keeps the code of its signatures
        if (context, args) not in kept:
            found = find(self, context, args, kws)
            if not any(found is case for template in self.templates for case in getattr(template, "cases", ())):
                return found
            kept[context, args] = found
        return kept[context, args]

    def are_equal(self: Any, other: Any) -> Any:
        return (type(self) is type(other) and self._values == other._values) or compare(self, other)

    def array_of_itself(_context: Any, _builder: Any, _signature: Any, given: Any) -> Any:
        return given[0]

    Function.get_call_type, Options.__eq__ = signature_of, are_equal
    lowered("__array__", types.Array)(array_of_itself)
