"""Sensitivities as records and as a table."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from impactlab.printing import aligned, plain

if TYPE_CHECKING:
    import pandas

TANGENT, DIFFERENCES, WITHHELD = "tangent", "differences", "withheld"


class Sensitivity(NamedTuple):
    """The derivative of a quantity by a parameter, in SI."""

    quantity: str
    label: str  # contact, pair or body; empty where the quantity has one value
    unit: str
    parameter: str  # path of the case
    parameter_value: float
    parameter_unit: str
    value: float
    derivative: float  # NaN where it is withheld
    error: float
    found: str  # tangent, differences or withheld
    below: float  # one-sided derivatives, NaN where not known
    above: float
    lower: float  # of the parameter: between them the sequence of contacts stays the same
    upper: float
    reason: str = ""  # why it is withheld, or from one side

    def __repr__(self) -> str:
        size, error = (
            f"{each:.6g} {_per(self.unit, self.parameter_unit)}".rstrip() for each in (self.derivative, self.error)
        )
        found = WITHHELD if math.isnan(self.derivative) else f"{size}, error {error}"
        how = "" if found == WITHHELD else f" ({self.found})"
        return f"<Sensitivity of {self.name} to {self.parameter}: {found}{how}>"

    @property
    def logarithmic(self) -> float:
        """The logarithmic derivative d ln y/d ln p; NaN where the value is zero."""
        return self.derivative * self.parameter_value / self.value if self.value else math.nan

    @property
    def name(self) -> str:
        """Quantity and label."""
        return f"{self.quantity} {self.label}".strip()


BOUND = "\N{PLUS-MINUS SIGN}"  # before a bound of a derivative that is smaller than its error
MAX_NAMED = 3  # quantities that a note lists
COLUMNS = ("quantity", "parameter", "value", "derivative", "its error", "d ln/d ln", "found", "same contacts for")


@dataclass(frozen=True)
class Sensitivities:
    """The derivatives of several quantities by several parameters."""

    case: str
    rows: tuple[Sensitivity, ...]

    def __repr__(self) -> str:
        return "\n  ".join([f"<Sensitivities of '{self.case}'", *str(self).splitlines()]) + ">"

    def __iter__(self) -> Iterator[Sensitivity]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def find(self, quantity: str, parameter: str, label: str = "") -> Sensitivity:
        """Return the sensitivity of a quantity to a parameter.

        ``label`` is needed where the quantity has several values.

        Raises
        ------
        KeyError
            If there is no such row.
        """
        for row in self.rows:
            if row.quantity == quantity and row.parameter == parameter and label in ("", row.label):
                return row
        raise KeyError(f"{quantity} {label} by {parameter}")

    def to_pandas(self) -> pandas.DataFrame:
        """Return a data frame with a row for each derivative; needs the extra ``data``."""
        from pandas import DataFrame

        return DataFrame([{**row._asdict(), "logarithmic": row.logarithmic} for row in self.rows])

    def to_dict(self) -> dict[str, Any]:
        """Return plain values: None in place of NaN and infinity."""
        rows = [{**row._asdict(), "logarithmic": row.logarithmic} for row in self.rows]
        return {"schema_version": 1, "case": self.case, "sensitivities": plain(rows)}

    def cells(self) -> list[tuple[str, ...]]:
        """Return the rows of the printed table, in the order of `COLUMNS`."""
        return [_cells(row) for row in self.rows]

    def __str__(self) -> str:
        valued = [row for row in self.rows if not math.isnan(row.value)] or self.rows  # the notes name the others
        lines = aligned([COLUMNS, *map(_cells, valued)])
        if any(_is_unknown(row) for row in self.rows):
            lines.append(f"{BOUND}: the error is larger than the derivative; this bounds its size, its sign is unknown")
        notes: dict[str, list[str]] = {}
        for row in self.rows:
            if row.reason:
                notes.setdefault(row.reason, []).append(f"{row.name} by {row.parameter}")
        return "\n".join([*lines, *(f"{few(of)}: {reason}" for reason, of in notes.items())])


def few(names: list[str]) -> str:
    """Return the first of some names, and how many more there are."""
    shown = ", ".join(names[:MAX_NAMED])
    return shown + (f" and {len(names) - MAX_NAMED} more" if len(names) > MAX_NAMED else "")


def _number(value: float, digits: int = 6) -> str:
    return "" if math.isnan(value) else f"{value:.{digits}g}"


def _is_unknown(row: Sensitivity) -> bool:
    """Return whether the error of a derivative exceeds it, so that no digit is known."""
    return 0.0 < abs(row.derivative) < row.error < math.inf


def _bound(size: float) -> str:
    """Return a bound of a size in one digit, rounded up."""
    unit = 10.0 ** math.floor(math.log10(size))
    return f"{BOUND}{unit * math.ceil(size / unit - 1e-9):.1g}"


def _per(unit: str, by: str) -> str:
    """Return the unit of a derivative; the units of numbers without one are empty."""
    if not by:
        return unit
    above, _, below = (unit or "1").partition("/")
    if " " in by or "/" in by:
        return f"{unit or '1'}/({by})"
    return f"{above}/({below} {by})" if below else f"{above}/{by}"


def _interval(lower: float, upper: float, unit: str) -> str:
    """Return an interval in words; empty where an end is not known."""
    if math.isnan(lower) or math.isnan(upper):
        return ""
    if math.isinf(lower) and math.isinf(upper):
        return "any value"
    low, high = _number(lower), _number(upper)
    words = f"below {high}" if math.isinf(lower) else f"above {low}" if math.isinf(upper) else f"{low} to {high}"
    return f"{words} {unit}".rstrip()


def _cells(row: Sensitivity) -> tuple[str, ...]:
    unit, parameter_unit = ("" if each == "1" else each for each in (row.unit, row.parameter_unit))
    digits, logarithmic = _number(row.derivative), _number(row.logarithmic)
    if _is_unknown(row):
        digits = _bound(abs(row.derivative) + row.error)
        share = abs(row.logarithmic) * (1.0 + row.error / abs(row.derivative))
        logarithmic = _bound(share) if share > 0.0 else ""
    derivative = f"{digits} {_per(unit, parameter_unit)}".rstrip()
    if math.isnan(row.derivative):
        derivative = " | ".join(_number(side) for side in (row.below, row.above) if not math.isnan(side)) or "-"
    return (
        row.name,
        row.parameter,
        f"{_number(row.value)} {unit}".rstrip(),
        derivative,
        _number(row.error, 1),
        logarithmic,
        row.found,
        _interval(row.lower, row.upper, parameter_unit),
    )
