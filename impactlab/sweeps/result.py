"""The result of a sweep: one labelled dataset."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Collection, Hashable, Iterable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from impactlab.errors import CaseError, ExtraError, expect_path
from impactlab.sweeps.chunks import ENGINES, STATUSES, Chunk, Folder

if TYPE_CHECKING:
    import pandas
    import xarray

TIME, TIME_OF = "time", "time of "  # over which a sampled channel has values; its dimension begins with the second
ABOUT = ("status", "reason", "engine")  # variables beside the quantities
TABLE_ROWS = 20_000  # that are written at a time


MAX_RESULT = 2_000_000_000  # bytes of a result in memory; its table and file need about as much again


def needed() -> None:
    """Raise `ExtraError` where the packages of labelled data are missing."""
    absent = [name for name in ("xarray", "h5netcdf") if find_spec(name) is None]
    if absent:
        raise ExtraError(f"sweeps need {' and '.join(absent)}, not installed", remedy="pip install 'impactlab[data]'")


def refuse_large(points: int, sizes: Iterable[int]) -> None:
    """Raise `CaseError` where the values of all points exceed `MAX_RESULT`."""
    numbers = sum(sizes)
    if (size := points * (8 * numbers + 10)) > MAX_RESULT:
        text = f"{points:,} points with {numbers:,} values each are {size / 1e9:.3g} GB"
        raise CaseError(f"{text}; allowed: {MAX_RESULT / 1e9:g} GB", remedy="Give fewer points, quantities or times.")


def open_sweep(path: str | Path) -> xarray.Dataset:
    """Return the dataset of the folder of a sweep, also of an unfinished one.

    Points that are not computed are ``missing``.

    Raises
    ------
    CaseError
        If the folder holds no sweep.
    """
    needed()
    expect_path(path, "open_sweep", "Give the folder of a sweep.")
    folder = Folder(Path(path))
    result = Result(folder.content)
    for chunk in folder.chunks():
        result.add(chunk)
    return result.dataset()


def counts(found: xarray.Dataset) -> dict[str, int]:
    """Return the number of points of each status that occurs in a sweep's dataset."""
    numbers = np.bincount(found.status.values.ravel(), minlength=len(STATUSES)).tolist()
    return {name: count for name, count in zip(STATUSES, numbers, strict=True) if count}


def first_reason(found: xarray.Dataset) -> str:
    """Return the reason of the first point without values, or an empty text."""
    reasons = (str(reason) for reason in found.reason.values.ravel())
    return next((reason for reason in reasons if reason), "")


class Result:
    """The arrays of a sweep, filled chunk by chunk; other points are missing."""

    def __init__(self, content: Mapping[str, Any]) -> None:
        self.content = content
        axes = content["axes"]
        self.shape = (len(axes[0]["values"]),) if content["listed"] else tuple(len(axis["values"]) for axis in axes)
        count = math.prod(self.shape)
        sizes = [len(each["labels"]) if each["over"] else 1 for each in content["quantities"]]
        self.tables = [np.full((count, size), np.nan) for size in sizes]
        self.status, self.reason = np.zeros(count, np.int8), np.full(count, "", dtype=object)
        self.engine = np.zeros(count, np.int8)

    def add(self, chunk: Chunk) -> None:
        """Put a chunk in its place."""
        here = slice(chunk.first, chunk.first + len(chunk.status))
        self.status[here], self.reason[here], self.engine[here] = chunk.status, chunk.reason, chunk.engine
        for table, found in zip(self.tables, chunk.values, strict=True):
            table[here] = found

    def dataset(self) -> xarray.Dataset:
        """Return the dataset of the arrays, without a copy.

        It has a dimension per axis, or ``point``, quantities with units, status and reason.
        """
        import xarray

        content, shape = self.content, self.shape
        dims = ("point",) if content["listed"] else tuple(axis["path"] for axis in content["axes"])
        coordinates = {}
        for axis in content["axes"]:
            name = axis["path"]
            attributes = {"units": axis["unit"]} if axis["unit"] not in ("", "1") else {}
            plain = [value if isinstance(value, (int, float, str)) else json.dumps(value) for value in axis["si"]]
            coordinates[name] = (dims if content["listed"] else (name,), np.array(plain), {**attributes, "path": name})
        variables: dict[str, Any] = {}
        for each, table in zip(content["quantities"], self.tables, strict=True):
            own, whole = dims, shape
            if each["over"]:
                label = each["over"] if each["over"] != TIME else f"{TIME_OF}{each['name']}"
                own, whole = (*dims, label), (*shape, len(each["labels"]))
                units = {"units": "s"} if each["over"] == TIME else {}
                values = np.array(each["labels"], dtype=float if each["over"] == TIME else str)
                coordinates[label] = ((label,), values, units)
            described = {"units": each["unit"] or "1", "long_name": each["description"].rstrip(".")}
            variables[each["name"]] = (own, table.reshape(whole), described)
        for name, numbers, meanings in (("status", self.status, STATUSES), ("engine", self.engine, ENGINES)):
            flags = {"flag_values": np.arange(len(meanings), dtype=np.int8), "flag_meanings": " ".join(meanings)}
            variables[name] = (dims, numbers.reshape(shape), flags)
        variables["reason"] = (dims, self.reason.reshape(shape), {"long_name": "why a point has no values"})
        attributes = {
            "title": f"Sweep of {content['name']}",
            "case": json.dumps(content["resolved"]),
            "command": content["command"],
            "source": f"impactlab {content['version']}",
            "date": content["date"],
            **content.get("design", {}),
        }
        return xarray.Dataset(variables, coordinates, attributes)


def unit_of(variable: xarray.DataArray) -> str:
    """Return the unit of a variable; an empty text for a number without one."""
    unit = str(variable.attrs.get("units", "1"))
    return "" if unit == "1" else unit


def labels_in(variable: xarray.DataArray, points: Collection[Hashable]) -> list[str]:
    """Return the labels of the values of a variable at a point; one empty label for a single value.

    ``points`` are the dimensions of the points.
    """
    others = [dim for dim in variable.dims if dim not in points]
    return [str(label) for label in variable[others[0]].values.tolist()] if others else [""]


def clauses(variable: xarray.DataArray) -> tuple[str, str]:
    """Return the first clause of the description of a variable, and the others."""
    first, *others = re.split("[;:]", str(variable.attrs["long_name"]), maxsplit=1)
    return first, "".join(others).strip()


def rows(found: xarray.Dataset, first: int = 0, last: int | None = None) -> pandas.DataFrame:
    """Return points of a sweep as rows of a table, a column for each value.

    Points are numbered as in a file.
    """
    import pandas

    dims, last = found["status"].dims, found["status"].size if last is None else last
    places = np.unravel_index(np.arange(first, last), found["status"].shape)
    columns: dict[str, Any] = {}
    for name in [each for each in found.coords if set(found[each].dims) <= set(dims) and each != "point"]:
        columns[_headed(str(name), found[name])] = found[name].values[places[dims.index(found[name].dims[0])]]
    for name, variable in found.data_vars.items():
        if name in ABOUT:
            continue
        table = variable.values.reshape(found["status"].size, -1)[first:last]
        for number, label in enumerate(labels_in(variable, dims)):
            columns[_headed(f"{name} of {label}" if label else str(name), variable)] = table[:, number]
    columns["status"] = np.array(STATUSES)[found["status"].values.ravel()[first:last]]
    columns["reason"] = found["reason"].values.ravel()[first:last]
    return pandas.DataFrame(columns)


def _headed(name: str, variable: xarray.DataArray) -> str:
    unit = unit_of(variable)
    return f"{name} [{unit}]" if unit else name


def write_table(found: xarray.Dataset, file: Path) -> None:
    """Write the points of a sweep as CSV, some at a time."""
    with file.open("w", newline="", encoding="utf-8") as stream:
        for first in range(0, found["status"].size, TABLE_ROWS):
            part = rows(found, first, min(first + TABLE_ROWS, found["status"].size))
            part.to_csv(stream, index=False, header=first == 0)
