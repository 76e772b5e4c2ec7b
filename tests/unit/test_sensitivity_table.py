"""The printed table of sensitivities: units of derivatives and intervals in words."""

from __future__ import annotations

import math

import pytest

from impactlab.derivatives.table import Sensitivities, Sensitivity


def cells(unit: str, by: str, lower: float, upper: float) -> tuple[str, str, str]:
    """Return value, derivative and interval as printed."""
    row = Sensitivity(
        "name", "", unit, "bodies.a.b", 3.0, by, 2.0, 4.0, 0.0, "tangent", math.nan, math.nan, lower, upper
    )
    ((_, _, value, derivative, _, _, _, interval),) = Sensitivities("case", (row,)).cells()
    return value, derivative, interval


@pytest.mark.parametrize(
    ("unit", "by", "derivative"),
    [
        ("s", "kg", "4 s/kg"),
        ("1", "kg", "4 1/kg"),
        ("m/s", "kg", "4 m/(s kg)"),
        ("s", "m/s", "4 s/(m/s)"),
        ("s", "1", "4 s"),
        ("1", "", "4"),
    ],
)
def test_the_unit_of_a_derivative(unit: str, by: str, derivative: str) -> None:
    assert cells(unit, by, 1.0, 2.0)[1] == derivative


def test_a_dimensionless_value_has_no_unit() -> None:
    assert cells("1", "1", 1.0, 5.0) == ("2", "4", "1 to 5")


@pytest.mark.parametrize(
    ("lower", "upper", "interval"),
    [
        (1.0, 5.0, "1 to 5 kg"),
        (-math.inf, 5.0, "below 5 kg"),
        (1.0, math.inf, "above 1 kg"),
        (-math.inf, math.inf, "any value"),
        (math.nan, math.nan, ""),
    ],
)
def test_an_interval_without_an_end_is_said_in_words(lower: float, upper: float, interval: str) -> None:
    assert cells("s", "kg", lower, upper)[2] == interval
