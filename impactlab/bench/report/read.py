"""The table of a bench as rows of typed values; a file that is something else is refused."""

from __future__ import annotations

import csv
import gzip
import io
import json
import math
import zlib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

from impactlab.errors import CaseError

COMPLETED = "completed"
ENDED = (COMPLETED, "tolerance_not_met")  # with all their numbers
STATUSES = (*ENDED, "refused", "failed", "hung", "crashed")
BASE = "base"  # name of the scene that a case describes without a variant
GZIP = b"\x1f\x8b"  # how a compressed file begins


class Row(NamedTuple):
    """One run of one method at one setting on one scene; None is an empty cell. Units: SI, errors relative, in T."""

    case: str
    method: str
    status: str
    key: str = ""
    suite: str = ""
    variant: str = ""
    level: str = ""
    settings: str = ""  # JSON: path to value
    model: str = ""
    basis: str = ""
    law: str = ""
    integrator: str = ""
    events: str = ""
    dt: float | None = None
    steps: int | None = None
    unknowns: int | None = None
    elements: int | None = None
    modes: int | None = None
    reason: str = ""
    remedy: str = ""
    reached_time: float | None = None
    reference: str = ""
    reference_uncertainty: float | None = None
    mass_displacement: float | None = None
    face_displacement: float | None = None
    force: float | None = None
    force_away_from_jumps: float | None = None
    force_graph: float | None = None
    impulse: float | None = None
    event_times: float | None = None
    events_missed: int | None = None
    events_extra: int | None = None
    displacement: float | None = None
    energy_initial: float | None = None
    energy_gain: float | None = None
    energy_loss: float | None = None
    energy_final_error: float | None = None
    momentum_error: float | None = None
    force_oscillation: float | None = None
    warnings: str = ""
    contacts: int | None = None
    events_found: int | None = None
    rhs_evaluations: int | None = None
    factorisations: int | None = None
    repeats: int | None = None
    setup_s: float | None = None
    setup_spread_s: float | None = None
    solve_s: float | None = None
    solve_spread_s: float | None = None
    tolerance_asked: float | None = None
    expected_error: float | None = None
    choosing_s: float | None = None
    round_trips: float | None = None
    code: str = ""
    machine: str = ""
    python: str = ""
    numpy: str = ""
    scipy: str = ""
    numba: str = ""
    more: Mapping[str, str] = {}  # columns that this page knows nothing of, as they are written

    @property
    def scene(self) -> str:
        """Return the name of what was solved: ``case`` or ``case/variant``."""
        return self.case if self.variant in ("", BASE) else f"{self.case}/{self.variant}"

    @property
    def completed(self) -> bool:
        """Return whether the run came to its end."""
        return self.status in ENDED

    @property
    def stepless(self) -> bool:
        """Return whether the run went from event to event: no step, nothing to refine."""
        return self.completed and self.dt is None and not self.integrator

    @property
    def total_s(self) -> float | None:
        """Return the time to solve with set-up [s]."""
        return None if self.solve_s is None else self.solve_s + (self.setup_s or 0.0)


NEEDED = ("case", "method", "status", "displacement", "impulse", "solve_s", "setup_s", "steps", "unknowns")
"""Columns without which nothing can be told; others may be missing."""
FIELDS = {name: hint for name, hint in get_type_hints(Row).items() if name != "more"}
LARGEST_TABLE = 100_000_000  # bytes, unpacked: some 200,000 rows


def read_table(path: Path) -> tuple[Row, ...]:
    """Return the rows of a table, CSV in UTF-8, plain or compressed by gzip.

    Raises
    ------
    CaseError
        If the file is not the table of a bench; the message names the line and the column.
    """
    path = Path(path)
    reader = csv.DictReader(io.StringIO(_text(path), newline=""))
    try:
        names = reader.fieldnames or ()
    except csv.Error as error:
        raise CaseError(f"{path.name}: {str(error)[:80]}", remedy="Give a table.csv of a bench.") from None
    missing = [name for name in NEEDED if name not in names]
    if missing:
        raise CaseError(
            f"{path.name} is not the table of a bench: it has no column {', '.join(missing)}",
            remedy="Give the table.csv that `impactlab bench --out DIR` wrote.",
        )
    try:
        rows = tuple(_row(cells, path.name, reader.line_num) for cells in reader)
    except csv.Error as error:
        raise CaseError(f"{path.name}: {str(error)[:80]}", file=path.name, line=reader.line_num) from None
    if not rows:
        raise CaseError(f"{path.name} holds no row", remedy="Run `impactlab bench` first.")
    return rows


def _text(path: Path) -> str:
    if path.exists() and not path.is_file():
        kind = "is a folder" if path.is_dir() else "is no regular file"
        raise CaseError(f"{str(path)!r} {kind}", remedy="Give a table.csv of a bench.")
    try:
        with path.open("rb") as stream:
            packed = stream.read(len(GZIP)) == GZIP
        with gzip.open(path) if packed else path.open("rb") as stream:
            raw = stream.read(LARGEST_TABLE + 1)
        if len(raw) > LARGEST_TABLE:
            raise CaseError(
                f"{path.name} holds more than {LARGEST_TABLE} bytes, the most a table may have",
                remedy="Give a table.csv of a bench.",
            )
        return raw.decode("utf-8-sig")
    except (OSError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise CaseError(f"cannot read {str(path)!r}: {reason}", remedy="Give a table.csv of a bench.") from None
    except UnicodeDecodeError:
        raise CaseError(f"{path.name} is not text in UTF-8", remedy="Give a table.csv of a bench.") from None


def _row(cells: Mapping[Any, Any], name: str, line: int) -> Row:
    if None in cells or None in cells.values():
        raise CaseError(f"line {line} has not one cell for each column", file=name, line=line)
    if cells["status"] not in STATUSES:
        told = f"status: {cells['status'][:40]!r} is not one of {', '.join(STATUSES)}"
        raise CaseError(told, file=name, line=line)
    known = {column: _value(cells[column], FIELDS[column], column, name, line) for column in cells if column in FIELDS}
    return Row(**known, more={column: text for column, text in cells.items() if column not in FIELDS})


def _value(text: str, kind: Any, column: str, name: str, line: int) -> Any:
    if kind is str:
        return text
    if text == "":
        return None
    try:
        value = float(text)
    except ValueError:
        told = f"{column}: {text[:40]!r} is not a number"
        raise CaseError(told, remedy="An empty cell says that there is none.", file=name, line=line) from None
    if not math.isfinite(value):
        return None
    return int(value) if kind == int | None else value


def settings_of(row: Row) -> dict[str, Any]:
    """Return the settings of a row, path to value; empty if it has none."""
    return _parsed(row.settings)


@cache
def _parsed(text: str) -> dict[str, Any]:
    try:
        settings = json.loads(text or "{}")
    except ValueError:
        return {}
    return settings if isinstance(settings, dict) else {}


def setting(row: Row, path: str) -> Any:
    """Return one setting of a row by its dotted path, ``solve.step.courant``; None if it is not set there."""
    for start, block in settings_of(row).items():
        if start == path:
            return block
        if path.startswith(f"{start}."):
            value = block
            for part in path[len(start) + 1 :].split("."):
                value = value.get(part) if isinstance(value, dict) else None
            if value is not None:
                return value
    return None
