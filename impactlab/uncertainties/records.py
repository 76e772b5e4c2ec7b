"""Estimates of an uncertainty with their 95 % intervals, as records."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple


class Estimate(NamedTuple):
    """An estimate with its 95 % interval; NaN where there is none.

    An end of a percentile is infinite where the samples do not reach it.
    """

    value: float
    lower: float = math.nan
    upper: float = math.nan

    @property
    def error(self) -> float:
        """Half the width of the interval."""
        return 0.5 * (self.upper - self.lower)


CONSTANT_TOL = 1e-10  # of the mean: a quantity that deviates less does not vary
NOTHING = Estimate(math.nan)


class Spread(NamedTuple):
    """The distribution of a quantity, in its SI unit."""

    quantity: str
    label: str  # contact, pair, body or time; empty where the quantity has one value
    unit: str
    samples: int  # that have a value
    mean: Estimate
    deviation: Estimate
    percentiles: tuple[Estimate, ...]
    linear_mean: float  # of the linear estimate; NaN where there is none
    linear_deviation: float

    @property
    def varies(self) -> bool:
        """Whether the values differ by more than rounding."""
        return self.samples > 1 and self.deviation.value > CONSTANT_TOL * abs(self.mean.value)

    @property
    def name(self) -> str:
        """Quantity and label."""
        return f"{self.quantity} {self.label}".strip()


class Share(NamedTuple):
    """The probability that a contact has a certain number of periods."""

    contact: str
    number: int
    probability: Estimate


def least_certain(shares: Sequence[Share]) -> list[Share]:
    """Return shares with the least certain first, as a page shows the first few of many.

    Contacts that never close, such as links, are left out where others close.
    """
    closing = [each for each in shares if each.number or each.probability.value < 1.0]
    return sorted(closing or shares, key=lambda each: abs(each.probability.value - 0.5))


class Index(NamedTuple):
    """The Sobol indices of a quantity by an uncertain number."""

    quantity: str
    label: str
    parameter: str
    first: Estimate  # share of the variance that the number explains alone
    total: Estimate  # share including its interactions with other numbers
    linear: float  # share by the linear estimate

    @property
    def name(self) -> str:
        """Quantity and label."""
        return f"{self.quantity} {self.label}".strip()
