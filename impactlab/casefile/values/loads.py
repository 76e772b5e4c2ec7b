"""Forces over time on ends: tables, formulas, or files.

They are a table {t, f}, a formula of t, or columns of a CSV file in the folder of the case.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from impactlab.casefile.text.samples import Samples
from impactlab.casefile.text.separated import SeparatedRows
from impactlab.casefile.text.words import listed, shown
from impactlab.casefile.values.faults import refuse
from impactlab.casefile.values.formula import TimeFormula
from impactlab.casefile.values.units import to_si
from impactlab.errors import CaseError, closest
from impactlab.printing import counted
from impactlab.scene.bodies import AbstractLoad, Body, FunctionLoad, SampledLoad
from impactlab.scene.ranges import range_of

MAX_BYTES = 50_000_000  # of a file of samples
MIN_SAMPLES, MAX_WRITTEN = 2, 10_000  # of a table; of one that is written into the text of a case
FORMS = "a formula of t such as 1e5*sin(2*pi*t/1e-3), {t: [...], f: [...]}, or {file: NAME.csv, t: COLUMN, f: COLUMN}"
_HEADING = re.compile(r"^(?P<name>.*?)\s*\[(?P<unit>[^\]]+)\]$")  # force [kN]
_OF_TIME = re.compile(r"(?<![A-Za-z0-9_.])t(?![A-Za-z0-9_])")
_folder: ContextVar[Path | None] = ContextVar("folder", default=None)


@contextmanager
def folder_of(file: str) -> Iterator[None]:
    """Read the files that a case names beside its own file.

    A case without a file has no folder.
    """
    token = _folder.set(Path(file).parent if file else None)
    try:
        yield
    finally:
        _folder.reset(token)


def is_over_time(value: Any) -> bool:
    """Return whether a value is meant as a force over time, not a number with a unit."""
    return isinstance(value, Mapping) or (isinstance(value, str) and bool(_OF_TIME.search(value)))


def read_load(value: Any, unit: str) -> AbstractLoad:
    """Return a force over time; raise with the allowed forms."""
    if isinstance(value, str):
        try:
            return FunctionLoad(TimeFormula(value))
        except ValueError as error:
            raise refuse(str(error)) from error
    keys = set(value)
    if keys == {"t", "f"}:
        times, forces = _column(value["t"], "t", "s"), _column(value["f"], "f", unit)
        return _checked(times, forces, "the table")
    if keys == {"file", "t", "f"}:
        if not all(isinstance(value[key], str) and value[key] for key in keys):
            raise refuse(f"file, t and f must be strings. Allowed: {FORMS}")
        columns = _from_file(_path(value["file"]), value["t"], value["f"], unit)
        return _checked(np.array(columns[0]), np.array(columns[1]), value["file"])
    hint = next((closest(str(key), ("t", "f", "file")) for key in keys - {"t", "f", "file"}), "")
    raise refuse(f"{shown(dict.fromkeys(value, '...'))} is not a valid force over time.{hint} Allowed: {FORMS}")


def load_values(load: AbstractLoad) -> Any:
    """Return a load as a case gives it: its formula, or its table."""
    if isinstance(load, FunctionLoad) and isinstance(load.function, TimeFormula):
        return load.function.text
    own = load.sampled(1.0)
    return {"t": list(own.t), "f": list(own.f)}


def _column(values: Any, name: str, unit: str) -> np.ndarray[Any, Any]:
    if not isinstance(values, (Samples, list, tuple)):
        raise refuse(f"{name} of the table is {shown(values)}; give a list of numbers in {unit}")
    if isinstance(values, Samples):
        return values.array
    return np.array([_number(value, name, number, unit) for number, value in enumerate(values)], dtype=float)


def _number(value: Any, name: str, number: int, unit: str) -> float:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return math.inf
    try:
        return to_si(str(value), unit)
    except ValueError as error:
        raise refuse(f"{name} {number + 1} of the table is {shown(value)}: {error}") from error


def _checked(times: np.ndarray[Any, Any], forces: np.ndarray[Any, Any], what: str) -> SampledLoad:
    """Return the samples as a load.

    Raises an error where they are not finite numbers at rising times.
    """
    if len(times) != len(forces):
        raise refuse(f"{what} has {len(times)} times t and {len(forces)} forces f; give one f for each t")
    if len(times) < MIN_SAMPLES:
        raise refuse(f"{what} has {counted(len(times), 'sample')}; give at least {MIN_SAMPLES}")
    for name, column in (("t", times), ("f", forces)):
        bad = np.flatnonzero(~np.isfinite(column))
        if len(bad):
            raise refuse(f"{name} {bad[0] + 1} of {what} is not a finite number; leave that sample out")
    falls = np.flatnonzero(np.diff(times) <= 0.0)
    if len(falls):
        at = int(falls[0])
        kind = "repeats the one before" if times[at] == times[at + 1] else "is before the one before"
        text = f"time {at + 2} of {what}, {times[at + 1]:g} s, {kind}; give rising times"
        raise refuse(f"{text} (a jump is a steep line between two times)")
    return SampledLoad(tuple(times.tolist()), tuple(forces.tolist()))


def _path(name: str) -> Path:
    folder = _folder.get()
    if folder is None:
        raise refuse(
            f"{shown(name)} stands in no folder: this case was made without a file. Read the columns and give them as "
            "{t: times, f: forces}"
        )
    try:
        root, path = folder.resolve(), (folder / name).resolve()
        inside = path.is_relative_to(root) and not Path(name).is_absolute()
        there = inside and path.is_file()
    except (OSError, ValueError):
        inside, there = True, False
    if not inside:
        raise refuse(
            f"{shown(name)} lies outside the folder of the case; put the file beside the case and name it alone"
        )
    if not there:
        raise refuse(f"there is no file {shown(name)} in the folder of the case; put it there, or correct the name")
    return path


def _from_file(path: Path, t: str, f: str, unit: str) -> tuple[Sequence[float], Sequence[float]]:
    try:
        state = path.stat()
        if state.st_size > MAX_BYTES:
            raise refuse(f"{path.name} has {state.st_size} bytes; at most {MAX_BYTES} are read. Keep fewer samples")
        return _columns(str(path), (state.st_mtime_ns, state.st_size), t, f, unit)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise refuse(f"{path.name} cannot be read as a table: {str(error)[:120]}; save it as UTF-8 text") from error


@lru_cache(maxsize=8)
def _columns(
    path: str,
    stamp: tuple[int, int],  # noqa: ARG001 - a file that changed is read again
    t: str,
    f: str,
    unit: str,
) -> tuple[Sequence[float], Sequence[float]]:
    name = Path(path).name
    table = SeparatedRows(Path(path).read_text(encoding="utf-8-sig"))
    if not table.rows:
        raise refuse(f"{name} is empty; its first line names the columns, then a line for each sample")
    headings = [cell.strip() for cell in table.rows[0][1]]
    found = [_heading(headings, column, wanted, name) for column, wanted in ((t, "s"), (f, unit))]
    columns: list[list[float]] = [[], []]
    for line, row in table.rows[1:]:
        for (at, factor), column in zip(found, columns, strict=True):
            try:
                column.append(factor * table.number(row[at]))
            except (IndexError, ValueError):
                cell = shown(row[at]) if at < len(row) and row[at].strip() else "nothing"
                words = f"line {line} of {name} has {cell} under {shown(headings[at])}"
                raise refuse(f"{words}; give a finite number, or leave that line out") from None
    return columns[0], columns[1]


def _heading(headings: list[str], column: str, unit: str, name: str) -> tuple[int, float]:
    """Return a column's number, and the factor to SI of the unit in its heading."""
    parts = [_name_and_unit(each) for each in headings]
    found = [number for number, each in enumerate(headings) if each == column]
    found = found or [number for number, (short, _) in enumerate(parts) if short == column]
    if not found:
        hint = closest(column, dict.fromkeys([*headings, *(short for short, _ in parts)]))
        raise refuse(f"{name} has no column {shown(column)}.{hint} Columns: {listed(headings)}")
    if len(found) > 1:
        alike = listed([headings[number] for number in found])
        raise refuse(f"{name} has {len(found)} columns {shown(column)}: {alike}; give them different names")
    number = found[0]
    given = parts[number][1]
    try:
        return number, to_si(f"1 {given}", unit) if given else 1.0
    except ValueError as error:
        raise refuse(f"column {shown(headings[number])} of {name}: {error}") from error


def _name_and_unit(heading: str) -> tuple[str, str]:
    """Return the name and the unit of a heading such as ``force [kN]``; no unit of one without it."""
    match = _HEADING.match(heading)
    return (heading, "") if match is None else (match["name"], match["unit"])


def with_tables(data: Any, key: str = "") -> Any:
    """Return plain values of a case with tables in place of files.

    A table that is too long stays in its file.
    """
    if isinstance(data, list):
        return [with_tables(value) for value in data]
    if not isinstance(data, Mapping):
        return data
    if data.keys() != {"file", "t", "f"}:
        return {inner: with_tables(value, inner) for inner, value in data.items()}
    columns = _from_file(_path(data["file"]), data["t"], data["f"], "N m" if key == "torque" else "N")
    return {"t": [*columns[0]], "f": [*columns[1]]} if len(columns[0]) <= MAX_WRITTEN else data


def settled(body: Body, duration: float) -> Body:
    """Return a body whose loads are known over a whole run.

    A load that is one number there is a constant force.

    Raises
    ------
    CaseError
        If the force is not a finite number somewhere, or its samples leave a part of the run out.
    """
    if (elastic := body.elastic) is None or not body.loads:
        return body
    ends: dict[str, Any] = {}
    for side, end in (("left", elastic.left), ("right", elastic.right)):
        if end.load is None:
            continue
        text, remedy = _left_out(end.load, duration)
        if text:
            key = "torque" if body.kind == "shaft" else "force"
            raise CaseError(text, remedy=remedy, path=f"bodies.{body.name}.ends.{side}.{key}")
        values = end.load.sampled(duration).forces
        if isinstance(end.load, SampledLoad) and np.all(values == values[0]):
            ends[side] = replace(end, force=float(values[0]), load=None)
    return replace(elastic, **ends)


def _left_out(load: AbstractLoad, duration: float) -> tuple[str, str]:
    """Return why a load is not known over a run, and the fix; both empty if known."""
    if isinstance(load, SampledLoad):
        start, end = load.reaches(duration)
        remedy = "Give samples over the whole run, or a first or last sample of 0, before or after which it stays 0."
        if not start:
            return f"the samples begin at {load.t[0]:g} s, and the force before is not known", remedy
        if not end:
            return f"the samples end at {load.t[-1]:g} s, and the run lasts {duration:g} s", remedy
    own = load.sampled(duration)
    wrong_at, most = np.flatnonzero(~np.isfinite(own.forces)), range_of("N").most
    if len(wrong_at):
        return f"the force is not a finite number at t = {own.times[wrong_at[0]]:.6g} s", "Correct the formula."
    if (largest := float(np.abs(own.forces).max())) > most:
        return (
            f"the force reaches {largest:g}, beyond the numbers a case may hold. Allowed: up to {most:g}",
            "Reduce it.",
        )
    return "", ""
