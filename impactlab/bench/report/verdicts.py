"""Verdicts on rows of hard cases.

A row is completed, or refused or failed with its reason; all else is a violation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import Enum

from impactlab.bench.schema import Row

ERROR_WARN = 0.2  # error of displacement or impulse from which a completed run must carry a warning about its result
MAX_IMBALANCE = 0.02  # of the momentum in play, read between the records; the run itself checks it to 1e-9
MAX_GAIN = 0.05  # of the reference energy: a larger gain must carry a warning
OF_RESULTS = (
    "chatter",
    "coarse_contact",
    "constraint_energy",
    "drift",
    "energy_gain",
    "energy_loss",
    "few_modes",
    "heavy_faces",
    "near_grazing",
    "no_contact",
    "overlap",
    "slow_touch",
    "soft_contact",
    "tolerance_not_met",
)
"""Codes of warnings about the result of a run."""


class BenchVerdict(Enum):
    """The outcome of a method on a scene, with the mark that stands for it."""

    RIGHT = "✓"
    WARNED = "w"  # completed, wrong by more than `ERROR_WARN`, with a warning
    UNKNOWN = "?"  # completed in good order, without a reference
    REFUSED = "r"
    FAILED = "F"
    VIOLATION = "!"


def result_warnings(row: Row) -> tuple[str, ...]:
    """Return the codes of warnings about the result of a row."""
    return tuple(code for code in row.warnings.split(";") if code in OF_RESULTS)


def worst_error(row: Row) -> float | None:
    """Return the larger error of displacement and impulse, less the uncertainty of the reference."""
    known = [value for value in (row.displacement, row.impulse) if value is not None]
    return max(0.0, max(known) - (row.reference_uncertainty or 0.0)) if known else None


def violations(row: Row) -> Iterator[str]:
    """Yield the violations of a row in words.

    A run is completed, refused with a reason and a remedy, or failed with a reason and the time it reached. A completed
    run keeps momentum and warns of energy that it gained; where its result is off by more than `ERROR_WARN` of the
    reference, a warning gives the reason.
    """
    if row.status in ("hung", "crashed"):
        yield f"{row.status}: {row.reason}"
    elif row.status == "refused":
        if not (row.reason and row.remedy):
            yield "refused without a reason or a remedy"
    elif row.status == "failed":
        if not row.reason or row.reached_time is None:
            yield "failed without a reason or the time that it reached"
    else:
        if row.energy_gain is None or row.energy_loss is None:
            yield "its energy is not a number"
        elif row.energy_gain > MAX_GAIN and not result_warnings(row):
            yield f"gained {100.0 * row.energy_gain:.2g} % of its energy without a warning"
        if row.momentum_error is not None and row.momentum_error > MAX_IMBALANCE:
            yield f"momentum and impulses differ by {100.0 * row.momentum_error:.2g} %"
        error = worst_error(row)
        if error is not None and error > ERROR_WARN and not result_warnings(row):
            yield f"wrong by {100.0 * error:.2g} % without a warning"


def verdict(row: Row) -> BenchVerdict:
    """Return the verdict on a row."""
    if any(violations(row)):
        return BenchVerdict.VIOLATION
    if not row.completed:
        return BenchVerdict.REFUSED if row.status == "refused" else BenchVerdict.FAILED
    error = worst_error(row)
    if error is None:
        return BenchVerdict.UNKNOWN
    return BenchVerdict.WARNED if error > ERROR_WARN else BenchVerdict.RIGHT


def faults(rows: Sequence[Row]) -> list[tuple[Row, str]]:
    """Return all violations of a table, with their rows."""
    return [(row, fault) for row in rows for fault in violations(row)]
