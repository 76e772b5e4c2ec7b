"""Keys of blocks given in Python; unknown ones are refused as a block is made."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar

from impactlab.errors import CaseError
from impactlab.startup.lazy import lazy
from impactlab.wrong_calls import names_parameters

if TYPE_CHECKING:
    from impactlab.casefile import schema
    from impactlab.casefile.values import faults
else:  # needed only for keys beside the usual ones
    faults, schema = lazy("impactlab.casefile.values.faults"), lazy("impactlab.casefile.schema")


class BodyKeys(dict[str, Any]):
    """Keys of the block of a body or a contact.

    Those that are None are left out. Unknown ones are refused at once, values by `Case`.

    Raises
    ------
    CaseError
        If a key is not known.
    """

    block: ClassVar[str] = ""  # the class of its block in `impactlab.casefile.schema`; empty: its keys are open

    def __init_subclass__(cls) -> None:
        names_parameters(cls)

    def __init__(self, **keys: Any) -> None:
        super().__init__({key: value for key, value in keys.items() if value is not None})
        others = self.keys() - _own_names(type(self))
        if others and self.block:
            known = getattr(schema, self.block)
            for key in sorted(others - known.model_fields.keys()):
                text, remedy = faults.unknown_key(key, [*known.model_fields], [known])
                raise CaseError(text, remedy=remedy, path=f"{type(self).__name__}.{key}")


def given(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys given to a constructor: parameters among its local variables, and ``others``."""
    named = {key: value for key, value in arguments.items() if key not in ("self", "others", "__class__")}
    return {**named, **arguments["others"]}


@cache
def _own_names(kind: type[BodyKeys]) -> frozenset[str]:
    """Return the parameter names of a constructor, and keys it makes."""
    return frozenset(inspect.signature(kind).parameters) | {"kind", "between", "chain"}
