"""Measured signals: read from tables with units, and checked."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from impactlab.casefile.units import to_si
from impactlab.casefile.words import shown
from impactlab.errors import CaseError
from impactlab.history.units import UNITS
from impactlab.types import Array

HEADING = re.compile(r"\s*(?P<name>[^\[\]]+?)\s*\[(?P<unit>[^\[\]]+)\]\s*")
FRACTIONS = {"1": 1.0, "%": 1e-2, "1e-6": 1e-6, "um/m": 1e-6}  # units of a strain
MIN_SAMPLES = 4


@dataclass(frozen=True)
class Signal:
    """A measured channel: each sample is the mean over its sampling interval.

    Parameters
    ----------
    channel : str
        The channel of a run that it measures, such as ``force:hammer|rod.left``.
    times : array
        Middles of the sampling intervals [s], (n,), increasing.
    values : array
        Samples in SI units, (n,).
    """

    channel: str
    times: Array
    values: Array

    def __post_init__(self) -> None:
        for name in ("times", "values"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))
        self._check()

    def _check(self) -> None:
        if self.times.ndim != 1 or self.times.shape != self.values.shape:
            raise CaseError(
                f"signal {self.channel}: {self.times.shape} times and {self.values.shape} samples",
                remedy="Give one time for each sample.",
            )
        if len(self.times) < MIN_SAMPLES:
            raise CaseError(f"signal {self.channel}: {len(self.times)} samples", remedy=f"Give {MIN_SAMPLES} or more.")
        for name, column in (("time", self.times), ("value", self.values)):
            wrong = np.flatnonzero(~np.isfinite(column))
            if len(wrong):
                raise CaseError(
                    f"signal {self.channel}: {name} {wrong[0] + 1} is not a finite number",
                    remedy="Leave that sample out.",
                )
        falls = np.flatnonzero(np.diff(self.times) <= 0.0)
        if len(falls):
            raise CaseError(
                f"signal {self.channel}: time {falls[0] + 2}, {self.times[falls[0] + 1]:g} s, is not later",
                remedy="Give increasing times.",
            )

    @property
    def edges(self) -> Array:
        """Ends of the sampling intervals [s], (n + 1,): midway between the times."""
        middle = 0.5 * (self.times[1:] + self.times[:-1])
        first, last = 2.0 * self.times[0] - middle[0], 2.0 * self.times[-1] - middle[-1]
        return np.concatenate([[first], middle, [last]])


def read_signals(file: str | Path, channels: Mapping[str, str]) -> list[Signal]:
    """Return signals from a CSV file with a time column and units in brackets: ``time [us], force [kN]``.

    Parameters
    ----------
    file : str or Path
        The file; decimal points, commas between columns.
    channels : mapping
        Heading of a column to the channel of a run: ``{"force [kN]": "force:hammer|rod.left"}``. Other columns are left
        out.

    Raises
    ------
    CaseError
        If the file cannot be read, a heading has no unit, or a cell is no number; names file and line.
    """
    path = Path(file)
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            header, *rows = [row for row in csv.reader(stream) if row]
    except (OSError, ValueError, csv.Error) as error:
        raise CaseError(f"the signals cannot be read: {error}", file=str(path), remedy="Give a CSV file.") from None
    headings = [heading.strip() for heading in header]
    if not headings[0].lower().startswith("time"):
        raise CaseError(
            f"the first column is headed {shown(headings[0])}", file=str(path), line=1, remedy="Write time [us] or so."
        )
    times = _column(path, rows, 0, headings[0], "s", len(headings))
    found = []
    for heading, channel in channels.items():
        if heading not in headings:
            raise CaseError(
                f"no column is headed {shown(heading)}", file=str(path), line=1,
                remedy=f"Columns: {', '.join(headings[1:])}.",
            )  # fmt: skip
        unit = UNITS.get(channel.partition(":")[0], "1")
        found.append(Signal(channel, times, _column(path, rows, headings.index(heading), heading, unit, len(headings))))
    return found


def _column(path: Path, rows: Sequence[Sequence[str]], number: int, heading: str, unit: str, count: int) -> Array:
    named = HEADING.fullmatch(heading)
    if named is None:
        raise CaseError(
            f"column {shown(heading)} has no unit", file=str(path), line=1, remedy=f"Write {heading} [{unit}] or so."
        )
    given = named["unit"].strip()
    factor = FRACTIONS.get(given) if unit == "1" else to_si(f"1 {given}", unit)
    if factor is None:
        raise CaseError(f"{shown(given)} is no unit of a strain", file=str(path), line=1, remedy="Write 1, % or 1e-6.")
    found = []
    for line, row in enumerate(rows, start=2):
        try:
            if len(row) != count:
                raise ValueError
            found.append(float(row[number]))
        except ValueError:
            text = row[number] if number < len(row) else ""
            raise CaseError(
                f"{len(row)} cells, {count} columns" if len(row) != count else f"{shown(text)} is no number",
                file=str(path), line=line, path=heading,
                remedy="Write a decimal point, and commas between columns only.",
            ) from None  # fmt: skip
    return factor * np.array(found)
