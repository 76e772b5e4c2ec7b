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
def test_an_interval_without_an_end_is_written_in_words(lower: float, upper: float, interval: str) -> None:
    assert cells("s", "kg", lower, upper)[2] == interval


def row(derivative: float, error: float) -> Sensitivity:
    sides = (math.nan,) * 4
    return Sensitivity("force", "", "N", "bodies.a.mass", 2.0, "kg", 1e5, derivative, error, "differences", *sides)


def test_a_derivative_below_its_error_is_printed_as_a_bound_of_its_size() -> None:
    """It was printed with six digits, as the others."""
    table = Sensitivities("case", (row(15.2371, 20.0), row(15.2371, 0.3)))
    unknown, known = table.cells()
    assert unknown[3:6] == ("±4e+01 N/kg", "2e+01", "±0.0008")
    assert known[3:6] == ("15.2371 N/kg", "0.3", "0.000304742")
    assert str(table).count("the error is larger than the derivative") == 1
    assert "larger" not in str(Sensitivities("case", (row(15.2371, 0.3), row(0.0, 1e-9))))
    first = table.to_dict()["sensitivities"][0]
    assert (first["derivative"], first["error"]) == (15.2371, 20.0)


@pytest.mark.parametrize(
    ("derivative", "error", "bound"), [(0.5, 0.5001, "±2"), (-1.0, 1.5, "±3"), (6.0, 7.0, "±2e+01")]
)
def test_the_bound_is_rounded_up(derivative: float, error: float, bound: str) -> None:
    ((*_, cell, _, _, _, _),) = Sensitivities("case", (row(derivative, error),)).cells()
    assert cell == f"{bound} N/kg"
