"""A long column of numbers given in Python, kept as one value of a case."""

from __future__ import annotations

from typing import final

import numpy as np

from impactlab.startup.cached import cached_property
from impactlab.types import Array


@final
class Samples(tuple[float, ...]):
    """Numbers of an array."""

    @cached_property
    def array(self) -> Array:
        """The numbers, shape (n,)."""
        return np.array(self)
