"""The result of a sweep: one labelled dataset."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.sweeps.chunks import STATUSES, Chunk, Folder

if TYPE_CHECKING:
    import xarray


def needed() -> None:
    """Raise `ImpactlabError` where the packages of labelled data are missing."""
    absent = [name for name in ("xarray", "h5netcdf") if find_spec(name) is None]
    if absent:
        raise ImpactlabError(
            f"sweeps need {' and '.join(absent)}", remedy="Install them: pip install 'impactlab[data]'"
        )


def open_sweep(path: str | Path) -> xarray.Dataset:
    """Return the dataset of the folder of a sweep, also of an unfinished one, whose other points are ``missing``.

    Raises
    ------
    CaseError
        If the folder holds no sweep.
    """
    needed()
    folder = Folder(Path(path))
    return dataset(folder.content, folder.chunks())


def counts(found: xarray.Dataset) -> dict[str, int]:
    """Return the number of points of each status that occurs in the dataset of a sweep."""
    numbers = np.bincount(found.status.values.ravel(), minlength=len(STATUSES)).tolist()
    return {name: count for name, count in zip(STATUSES, numbers, strict=True) if count}


def dataset(content: Mapping[str, Any], chunks: Iterable[Chunk]) -> xarray.Dataset:
    """Return chunks as a dataset: a dimension per axis, or ``point``; quantities with units; status and reason."""
    import xarray

    axes = content["axes"]
    names = [axis["path"] for axis in axes]
    shape = (len(axes[0]["values"]),) if content["listed"] else tuple(len(axis["values"]) for axis in axes)
    dims = ("point",) if content["listed"] else tuple(names)
    count = math.prod(shape)
    wanted = content["quantities"]
    tables = [np.full((count, max(1, len(each["labels"]))), np.nan) for each in wanted]
    status, reason = np.zeros(count, np.int8), np.full(count, "", dtype=object)
    for chunk in chunks:
        here = slice(chunk.first, chunk.first + len(chunk.status))
        status[here], reason[here] = chunk.status, chunk.reason
        for table, found in zip(tables, chunk.values, strict=True):
            table[here] = found
    coordinates = {}
    for axis, name in zip(axes, names, strict=True):
        attributes = {"units": axis["unit"]} if axis["unit"] not in ("", "1") else {}
        plain = [value if isinstance(value, (int, float, str)) else json.dumps(value) for value in axis["si"]]
        coordinates[name] = (dims if content["listed"] else (name,), np.array(plain), {**attributes, "path": name})
    variables: dict[str, Any] = {}
    for each, table in zip(wanted, tables, strict=True):
        own, whole = dims, shape
        if each["labels"]:
            label = each["over"] if each["over"] != "time" else f"time of {each['name']}"
            own, whole = (*dims, label), (*shape, len(each["labels"]))
            units = {"units": "s"} if each["over"] == "time" else {}
            coordinates[label] = ((label,), np.array(each["labels"]), units)
        described = {"units": each["unit"] or "1", "long_name": each["description"].rstrip(".")}
        variables[each["name"]] = (own, table.reshape(whole), described)
    flags = {"flag_values": np.arange(len(STATUSES), dtype=np.int8), "flag_meanings": " ".join(STATUSES)}
    variables["status"] = (dims, status.reshape(shape), flags)
    variables["reason"] = (dims, reason.reshape(shape).astype(str), {"long_name": "why a point has no values"})
    attributes = {
        "title": f"Sweep of {content['name']}",
        "case": json.dumps(content["resolved"]),
        "command": content["command"],
        "source": f"impactlab {content['version']}",
        "date": content["date"],
    }
    return xarray.Dataset(variables, coordinates, attributes)
