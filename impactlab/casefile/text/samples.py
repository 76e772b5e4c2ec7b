"""A long column of numbers given in Python, kept as one value of a case."""

from __future__ import annotations

from typing import Any, final

import numpy as np

from impactlab.startup.cached import cached_property
from impactlab.types import Array


@final
class Samples(tuple[float, ...]):
    """Numbers of an array; a copy of a case shares them."""

    def __copy__(self) -> Samples:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Samples:
        return self

    @cached_property
    def array(self) -> Array:
        """The numbers, shape (n,)."""
        return np.array(self)
