"""Reads the table of a bench as typed rows; any other file is refused."""

from __future__ import annotations

import gzip
import io
import math
import zlib
from pathlib import Path
from typing import Any

from impactlab.bench.schema import FIELDS, NEEDED, STATUSES, Row
from impactlab.errors import CaseError

GZIP = b"\x1f\x8b"  # first bytes of a compressed file
MAX_TABLE_BYTES = 100_000_000  # unpacked: some 200,000 rows


def read_table(path: Path) -> tuple[Row, ...]:
    """Return the rows of a table, CSV in UTF-8, plain or compressed by gzip.

    Raises
    ------
    CaseError
        If the file is not the table of a bench; the message names the line and the column.
    """
    import pandas

    path = Path(path)
    no_table, remedy = (f"{path.name} is not the table of a bench: ", "Give the table.csv of `impactlab bench`.")
    try:
        # Without a header no column becomes an index; this engine marks the missing cells of a short line.
        text = io.StringIO(_text(path))
        cells = pandas.read_csv(text, header=None, dtype=str, keep_default_na=False, engine="python")
    except pandas.errors.ParserError as error:
        raise CaseError(no_table + str(error).strip()[:80], remedy=remedy) from None
    except pandas.errors.EmptyDataError:
        cells = pandas.DataFrame([[""]])
    frame = cells[1:].set_axis(cells.iloc[0].tolist(), axis="columns")
    if not frame.columns.is_unique:
        twice = str(frame.columns[frame.columns.duplicated()][0])[:40]
        raise CaseError(f"{path.name}: two columns have the name {twice!r}", remedy=remedy)
    missing = [name for name in NEEDED if name not in frame]
    if missing:
        raise CaseError(f"{no_table}it has no column {', '.join(missing)}", remedy=remedy)
    if frame.empty:
        raise CaseError(f"{path.name} holds no row", remedy="Run `impactlab bench` first.")
    short = frame.index[frame.isna().any(axis="columns")]
    if len(short):
        line = int(short[0]) + 1
        raise CaseError(f"line {line} has not one cell for each column", remedy=remedy, file=path.name, line=line)
    unknown = frame[~frame["status"].isin(STATUSES)]
    if len(unknown):
        given = f"status: {unknown['status'].iloc[0][:40]!r} is not one of {', '.join(STATUSES)}"
        raise CaseError(given, remedy=remedy, file=path.name, line=int(unknown.index[0]) + 1)
    known = {name: _typed(frame[name], name, path.name) for name in frame if name in FIELDS}
    return tuple(Row(**dict(zip(known, values, strict=True))) for values in zip(*known.values(), strict=True))


def _typed(texts: Any, column: str, file: str) -> list[Any]:
    """Return the values of a column; nothing where a cell is empty or not finite."""
    if FIELDS[column] is str:
        return list(texts)
    values: list[Any] = []
    for number, text in enumerate(texts.tolist(), 1):
        try:
            value = float(text) if text else math.nan
        except ValueError:
            given = f"{column}: {text[:40]!r} is not a number"
            raise CaseError(given, remedy="Leave the cell empty without one.", file=file, line=number + 1) from None
        whole = FIELDS[column] == int | None
        values.append(None if not math.isfinite(value) else int(value) if whole else value)
    return values


def _text(path: Path) -> str:
    remedy = "Give a table.csv of a bench."
    if path.exists() and not path.is_file():
        raise CaseError(f"{str(path)!r} is {'a folder' if path.is_dir() else 'not a regular file'}", remedy=remedy)
    try:
        with path.open("rb") as stream:
            packed = stream.read(len(GZIP)) == GZIP
        with gzip.open(path) if packed else path.open("rb") as stream:
            raw = stream.read(MAX_TABLE_BYTES + 1)
        if len(raw) > MAX_TABLE_BYTES:
            raise CaseError(f"{path.name} holds more than {MAX_TABLE_BYTES} bytes, the limit of a table", remedy=remedy)
        return raw.decode("utf-8-sig")
    except (OSError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise CaseError(f"cannot read {str(path)!r}: {reason}", remedy=remedy) from None
    except UnicodeDecodeError:
        raise CaseError(f"{path.name} is not text in UTF-8", remedy=remedy) from None
