"""Signals from tables: CSV files headed by name and unit, and NetCDF files with units."""

from __future__ import annotations

import contextlib
import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from impactlab.casefile.text.separated import SeparatedRows
from impactlab.casefile.text.words import shown
from impactlab.errors import CaseError, closest, unreadable
from impactlab.fits.signals import Setting, Signal, factor_of, unit_of
from impactlab.fits.unknowns import read_setting
from impactlab.history import dataset
from impactlab.types import Array

HEADING = re.compile(r"\s*(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\[\]]+)\]|\((?P<in_round>[^()]+)\))\s*")
TIME = re.compile(r"(?:t(?![a-z])|time)", re.IGNORECASE)  # beginning of the heading of the times
NETCDF = (".nc", ".nc4", ".cdf")
NUMBER_ALONE = "Write a number alone, with a decimal point; its unit is that of the heading."
STD = "std "  # before the name of a column: its standard deviations


def read_signals(file: str | Path, channels: Mapping[str, str]) -> list[Signal]:
    """Return signals from a table of measured samples.

    A CSV file has a column of times first, and units in brackets: ``time [ms], force [kN], gauge 1 (µstrain)``. The
    first column may have any name with a unit of time. A column ``std force [kN]`` holds the standard deviations of
    ``force [kN]``. A NetCDF file has variables over ``time``, each with the attribute ``units``; of a file that
    impactlab wrote, such as ``history.nc``, columns are its channels.

    Parameters
    ----------
    file : str or Path
        The file; a CSV file has commas between columns and decimal points in numbers, or semicolons or tabs between
        columns, and decimal points or commas in numbers.
    channels : mapping
        Heading of a column, or name of a variable, to the channel of a run that it measures:
        ``{"force [kN]": "force:hammer|rod.left"}``. Other columns are left out.

    Raises
    ------
    CaseError
        If the file cannot be read, a column has no unit, or a cell is not a number; names file and line.
    ExtraError
        For a NetCDF file without xarray and h5netcdf: ``pip install 'impactlab[data]'``.
    """
    if not isinstance(channels, Mapping):
        raise CaseError(
            f"read_signals() takes the columns as a mapping, not {shown(channels)}",
            remedy="Write read_signals(FILE, {HEADING: CHANNEL}), such as {'force [kN]': 'force:hammer|rod.left'}.",
        )
    columns = _columns(Path(file))
    with _in(file):
        return [_signal(columns, heading, channel) for heading, channel in channels.items()]


def read_tables(
    files: Sequence[str | Path], channels: Mapping[str, str], settings: Mapping[str, Sequence[str]]
) -> list[list[Signal]]:
    """Return the signals of several tables, as the command names them.

    Parameters
    ----------
    files : sequence of str or Path
        Tables; each is read for the columns that it has, one of ``channels`` at least.
    channels : mapping
        As of `read_signals`.
    settings : mapping
        Of ``gain``, ``offset`` and ``shift``: texts such as ``free`` or ``0.9:1.1`` for all signals, and
        ``force [kN]=0.9:1.1`` for those of one column.

    Raises
    ------
    CaseError, ExtraError
        As `read_signals`; or if a column is in no table.
    """
    chosen: dict[str, dict[str, Setting]] = {heading: {} for heading in channels}
    for name, texts in settings.items():
        for text in sorted(texts, key=lambda each: "=" in each):
            heading, _, given = (part.strip() for part in text.rpartition("="))
            if heading and heading not in channels:
                raise CaseError(f"--{name} {shown(text)}: no --signal {shown(heading)}", remedy="Name a --signal.")
            for each in [heading] if heading else channels:
                chosen[each][name] = read_setting(given)
    found, left = [], set(channels)
    for file in files:
        columns = _columns(Path(file))
        there = [heading for heading in channels if heading in columns.headings] or list(channels)
        left -= set(there)
        with _in(file):
            found.append([replace(_signal(columns, each, channels[each]), **chosen[each]) for each in there])
    if left:
        with _in(files[0]):
            raise _unknown(min(left), _columns(Path(files[0])).headings)
    return found


@contextlib.contextmanager
def _in(file: str | Path) -> Iterator[None]:
    """Name the file in errors."""
    try:
        yield
    except CaseError as error:
        error.located(str(file), error.line)
        raise


def _columns(path: Path) -> _Csv | _Variables:
    with _in(path):
        return _netcdf(path) if path.suffix in NETCDF else _Csv(path)


def _signal(columns: _Csv | _Variables, heading: str, channel: str) -> Signal:
    values = columns.read(heading, unit_of(channel))
    std = STD + heading
    deviations = columns.read(std, unit_of(channel)) if std in columns.headings else None
    return Signal(channel, columns.times, values, deviations)


def _unknown(heading: str, headings: Sequence[str]) -> CaseError:
    return CaseError(
        f"no column is headed {shown(heading)}.{closest(heading, headings)}", line=1,
        remedy=f"Columns: {', '.join(headings)}.",
    )  # fmt: skip


def _unit(named: re.Match[str]) -> str:
    return (named["unit"] or named["in_round"]).strip()


def _is_of_times(heading: str) -> bool:
    """Return whether a heading begins as that of times does, or has a unit of time: ``Zeit [ms]``."""
    if TIME.match(heading):
        return True
    named = HEADING.fullmatch(heading)
    if named is None:
        return False
    try:
        return factor_of(_unit(named), "s") > 0.0
    except CaseError:
        return False


class _Csv:
    """Columns of a CSV file with names and units; the first is time."""

    def __init__(self, path: Path) -> None:
        try:
            self._table = SeparatedRows(path.read_text(encoding="utf-8-sig"))
        except (OSError, ValueError, csv.Error) as error:
            raise CaseError(
                f"the signals cannot be read: {unreadable(path, error)}", remedy="Give a CSV or NetCDF file."
            ) from None
        if not self._table.rows:
            raise CaseError("the file is empty", remedy="Give a line of headings, and a line for each time.")
        (_, header), *self._rows = self._table.rows
        named = [heading.strip() for heading in header]
        self._named, self.headings = named, named[1:]
        if not _is_of_times(named[0]):
            text = f"the first column is headed {shown(named[0])}, where times are needed"
            raise CaseError(text, line=1, remedy="Put the times first, with headings such as time [us],force [kN].")
        twice = next((name for name in named if named.count(name) > 1), None)
        if twice is not None:
            raise CaseError(f"two columns are headed {shown(twice)}", line=1, remedy="Give each its own name.")
        self.times = self.read(named[0], "s")

    def read(self, heading: str, unit: str) -> Array:
        """Return a column in SI."""
        if heading not in self._named:
            raise _unknown(heading, self.headings)
        named = HEADING.fullmatch(heading)
        if named is None:
            raise CaseError(
                f"column {shown(heading)} has no unit", line=1, remedy=f"Write {heading} [{unit}], for example."
            )
        factor = factor_of(_unit(named), unit)
        number, count = self._named.index(heading), len(self._named)
        found = []
        for line, row in self._rows:
            try:
                if len(row) != count:
                    raise ValueError
                found.append(self._table.number(row[number]))
            except ValueError:
                text = row[number].strip() if number < len(row) else ""
                why = f"{shown(text)} is not a finite number" if text else "the cell is empty"
                remedy = "Leave that line out." if not text or text.lower() == "nan" else NUMBER_ALONE
                if len(row) != count:
                    why = f"{len(row)} cells, {count} columns"
                    remedy = "Give a cell in each column; numbers have decimal points where commas divide the columns."
                raise CaseError(why, line=line, path=heading, remedy=remedy) from None
        return factor * np.array(found)


class _Variables:
    """Variables of a NetCDF file over its times, each with a unit."""

    def __init__(self, columns: Mapping[str, tuple[Array, str]]) -> None:
        self._columns = dict(columns)
        self.headings = [name for name in columns if name != "time"]
        if "time" not in columns:
            raise CaseError("the file has no variable 'time'", remedy="Give the times of the samples that name.")
        self.times = self.read("time", "s")

    def read(self, heading: str, unit: str) -> Array:
        """Return a variable in SI."""
        if heading not in self._columns:
            raise _unknown(heading, self.headings)
        values, given = self._columns[heading]
        if not given:
            raise CaseError(f"variable {shown(heading)} has no unit", remedy="Give it the attribute 'units'.")
        return factor_of(given, unit) * np.asarray(values, dtype=float)


def _netcdf(path: Path) -> _Variables:
    library = dataset.needed("xarray")
    dataset.needed("h5netcdf")
    try:
        with library.open_dataset(path, engine="h5netcdf", decode_times=False) as opened:
            data = opened.load()
    except (OSError, ValueError) as error:
        raise CaseError(
            f"the signals cannot be read: {unreadable(path, error)}", remedy="Give a CSV or NetCDF file."
        ) from None
    columns = {name: _column(array) for name, array in data.variables.items() if array.dims == ("time",)}
    for name, array in data.data_vars.items():  # of a run: a row for each place or contact
        other = [each for each in array.dims if each != "time"]
        if "time" in array.dims and len(other) == 1 and other[0] in data.coords:
            for label in data[other[0]].values.tolist():
                quantity = "force" if name == "contact_force" else name
                columns[f"{quantity}:{label}"] = _column(array.sel({other[0]: label}))
    return _Variables(columns)


def _column(array: Any) -> tuple[Array, str]:
    return np.asarray(array.values), str(array.attrs.get("units", ""))
