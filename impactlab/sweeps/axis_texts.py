"""Axes and points of a sweep as texts: of the command line, and of CSV files."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from impactlab.casefile import Case
from impactlab.casefile.document import parse_value
from impactlab.casefile.text.words import shown
from impactlab.errors import CaseError, unreadable
from impactlab.sweeps.axes import in_si

MAX_RANGE = 1_000_000  # values of one range
HALF_RANGE = re.compile(r"[-+]?[0-9.][^:,\[\]{}]*:[-+]?[0-9.][^:,\[\]{}]*")
BAD_COUNT = re.compile(r"(?P<ends>[-+]?[0-9.][^:,\[\]{}]*:[-+]?[0-9.][^:,\[\]{}]*):(?P<count>[^:,\[\]{}]*)")
RANGE = re.compile(r"(?P<first>[^:]+):(?P<last>[^:]+):(?P<count>[0-9]{1,9})(?P<log>log)?")


def read_over(case: Case, text: str) -> tuple[str, list[Any]]:
    """Return path and values of an axis of the command line.

    ``PATH=A,B,C`` lists values, ``PATH=FIRST:LAST:COUNT`` gives equal steps, ``PATH=FIRST:LAST:COUNTlog`` equal ratios.
    """
    path, equals, values = (part.strip() for part in text.partition("="))
    if not equals or not path or not values:
        raise CaseError(f"--over {shown(text)} is not PATH=VALUES", remedy="Write PATH=A,B,C or PATH=FIRST:LAST:COUNT.")
    found = RANGE.fullmatch(values)
    if found is None and (counted := BAD_COUNT.fullmatch(values)):
        text = f"--over {shown(text)} gives a range of {shown(counted['count'])} values; allowed: 2 to {MAX_RANGE}"
        raise CaseError(text, remedy=f"Write {path}=FIRST:LAST:COUNT, as in {counted['ends']}:11.", path=path)
    if found is None and HALF_RANGE.fullmatch(values):
        text = f"--over {shown(text)} gives a range without its number of values"
        raise CaseError(text, remedy=f"Write {path}=FIRST:LAST:COUNT, as in {path}={values}:11.", path=path)
    first, _, rest = values.partition(":")
    last, colon, number = rest.partition(":")
    if found is None and colon and HALF_RANGE.fullmatch(f"{first}:{last}"):
        text = f"--over {shown(text)}: {shown(number)} is not a number of values"
        raise CaseError(text, remedy=f"Write a whole number, as in {path}={first}:{last}:11, or 11log.", path=path)
    if found is None:
        return path, [_parsed(value, path) for value in _split(values)]
    start, end = (in_si(case, path, _parsed(found[name], path)) for name in ("first", "last"))
    count = int(found["count"])
    for bound in (start, end):
        if not isinstance(bound, (int, float)) or isinstance(bound, bool):
            text = f"{shown(bound)} is not a number and cannot begin or end a range"
            raise CaseError(text, path=path, remedy="List the values.")
    if not 2 <= count <= MAX_RANGE:
        text = f"a range of {count} values; allowed: 2 to {MAX_RANGE}"
        raise CaseError(text, remedy="Give another number of values.", path=path)
    if found["log"] and not start * end > 0.0:
        raise CaseError(f"equal ratios from {start:g} to {end:g} pass through zero", path=path, remedy="Leave out log.")
    spaced = np.geomspace if found["log"] else np.linspace
    return path, spaced(start, end, count).tolist()


def _parsed(text: str, path: str) -> Any:
    """Return the value of a text of an axis, read as in a case file."""
    if not text.strip():
        raise CaseError("a value is missing", path=path, remedy="Write PATH=A,B,C with a value at each place.")
    try:
        return parse_value(text.strip())
    except CaseError as error:
        error.path, error.given_by = error.path or path, "--over"
        raise


def _split(values: str) -> list[str]:
    """Return the parts between commas outside brackets."""
    parts, depth = [""], 0
    for letter in values:
        if letter in "[{":
            depth += 1
        elif letter in "]}":
            depth -= 1
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def read_points(file: Path) -> dict[str, list[Any]]:
    """Return the columns of a CSV file of points.

    A column is headed by a path, with a unit in brackets or none; 1 is that of a plain number.
    """
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            header, *rows = [row for row in csv.reader(stream) if row]
    except (OSError, ValueError, csv.Error) as error:
        raise CaseError(
            f"the points cannot be read: {unreadable(file, error)}", file=str(file), remedy="Give a CSV file."
        ) from None
    columns: dict[str, list[Any]] = {}
    for number, heading in enumerate(header):
        named = re.fullmatch(r"\s*([^\s\[]+)\s*(?:\[([^\]]*)\])?\s*", heading)
        if named is None or named[1] in columns:
            raise CaseError(f"{shown(heading)} is not a valid column heading, or appears twice", file=str(file),
                            remedy="Write a path of the case, as in: bodies.hammer.mass [kg].")  # fmt: skip
        unit = "" if named[2] == "1" else named[2] or ""
        columns[named[1]] = [_cell(file, line, row, number, unit) for line, row in enumerate(rows, start=2)]
    return columns


def _cell(file: Path, line: int, row: Sequence[str], number: int, unit: str) -> Any:
    if len(row) <= number or not row[number].strip():
        text = f"the value in column {number + 1} is missing"
        raise CaseError(text, file=str(file), line=line, remedy="Give a value in each column.")
    value = parse_value(row[number].strip())
    return f"{row[number].strip()} {unit}" if unit and isinstance(value, (int, float)) else value
