"""What a row of hard cases is worth: completed, refused or failed with its reason; anything else is a violation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import Enum

from impactlab.bench.schema import Row

WRONG = 0.2  # error of displacement or impulse from which a completed run must have said what is wrong
BALANCE = 0.02  # of the momentum in play, which a summary reads between records; the run checks it to 1e-9 itself
DRIFT = 0.05  # of the energy: a gain beyond must have been told
TELLING = (
    "chatter",
    "coarse_contact",
    "constraint_energy",
    "drift",
    "energy_gain",
    "energy_loss",
    "heavy_faces",
    "near_grazing",
    "no_contact",
    "overlap",
    "slow_touch",
    "soft_contact",
    "tolerance_not_met",
)
"""Codes of warnings about the result of a run."""


class Verdict(Enum):
    """What became of a method on a scene, with the mark that stands for it."""

    RIGHT = "✓"
    TOLD = "w"  # completed, wrong by more than `WRONG`, and said so
    UNKNOWN = "?"  # completed in good order, and nothing to measure it by
    REFUSED = "r"
    FAILED = "F"
    VIOLATION = "!"


def told(row: Row) -> tuple[str, ...]:
    """Return the codes of warnings about the result of a row."""
    return tuple(code for code in row.warnings.split(";") if code in TELLING)


def worst_error(row: Row) -> float | None:
    """Return the larger of the errors of displacement and impulse, less the uncertainty of the reference."""
    known = [value for value in (row.displacement, row.impulse) if value is not None]
    return max(0.0, max(known) - (row.reference_uncertainty or 0.0)) if known else None


def violations(row: Row) -> Iterator[str]:
    """Give the violations of a row in words.

    A run is completed, refused with a reason and a remedy, or failed with a reason and the time it reached. One that
    completed keeps momentum and tells where it gained energy; where its answer is known and off by more than `WRONG`,
    one of its warnings says why.
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
        yield from _completed(row)


def _completed(row: Row) -> Iterator[str]:
    if row.energy_gain is None or row.energy_loss is None:
        yield "its energy is no number"
    elif row.energy_gain > DRIFT and not told(row):
        yield f"gained {100.0 * row.energy_gain:.2g} % of its energy and did not say so"
    if row.momentum_error is not None and row.momentum_error > BALANCE:
        yield f"momentum and impulses differ by {100.0 * row.momentum_error:.2g} %"
    error = worst_error(row)
    if error is not None and error > WRONG and not told(row):
        yield f"wrong by {100.0 * error:.2g} % without a warning"


def verdict(row: Row) -> Verdict:
    """Return the verdict on a row."""
    if any(violations(row)):
        return Verdict.VIOLATION
    if not row.completed:
        return Verdict.REFUSED if row.status == "refused" else Verdict.FAILED
    error = worst_error(row)
    if error is None:
        return Verdict.UNKNOWN
    return Verdict.TOLD if error > WRONG else Verdict.RIGHT


def faults(rows: Sequence[Row]) -> list[tuple[Row, str]]:
    """Return all violations of a table, with their rows."""
    return [(row, fault) for row in rows for fault in violations(row)]
