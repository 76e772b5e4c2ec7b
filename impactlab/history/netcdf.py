"""Labelled arrays as NetCDF files, written by h5netcdf.

The libraries of arrays that xarray looks for when it writes a dataset take seconds to load.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from impactlab.errors import NO_ROOM, ImpactlabError
from impactlab.history.dataset import Labelled, needed

COMPRESSED = {"compression": "gzip", "compression_opts": 1, "shuffle": True}


def write(path: Path, arrays: Labelled, more: Mapping[str, str], group: str | None = None) -> None:
    """Write labelled arrays and ``more`` attributes to a NetCDF file, or into a group of it.

    Raises
    ------
    ImpactlabError
        If there is no folder to write in, or the file cannot be written.
    """
    library = needed("h5netcdf")
    folder = Path(path).absolute().parent
    if not folder.is_dir():
        raise ImpactlabError(f"there is no folder '{folder}' to write in", remedy="Make it, or give another path.")
    try:
        with library.File(path, "w" if group is None else "a") as file:
            _fill(file if group is None else file.create_group(group), arrays, more)
    except OSError as error:
        if error.errno in NO_ROOM:
            raise
        raise ImpactlabError(
            f"the file '{path}' cannot be written: {str(error)[:300]}", remedy="Give another path."
        ) from error


def _fill(group: Any, arrays: Labelled, more: Mapping[str, str]) -> None:
    """Write dimensions, coordinates, variables and attributes into a group."""
    text = needed("h5py").string_dtype()
    given = {**arrays.coordinates, **arrays.variables}
    sizes: dict[str, int] = {}
    for dimensions, values, *_ in given.values():
        sizes.update(zip(_names(dimensions), np.shape(values), strict=True))
    group.dimensions = sizes
    beside = {name: set(_names(each[0])) for name, each in arrays.coordinates.items() if _names(each[0]) != (name,)}
    for name, (dimensions, values, *attributes) in given.items():
        names, is_text = _names(dimensions), values.dtype == object
        packed = COMPRESSED if name in arrays.variables and not is_text and values.size > 1 else {}
        made = group.create_variable(name, names, text if is_text else values.dtype, **packed)
        if values.size:
            made[...] = values
        places = [each for each, of in beside.items() if name in arrays.variables and of <= set(names)]
        about = {**(attributes[0] if attributes else {}), **({"coordinates": " ".join(places)} if places else {})}
        made.attrs.update(about)
    group.attrs.update({**arrays.attributes, **more})


def _names(dimensions: str | tuple[str, ...]) -> tuple[str, ...]:
    return (dimensions,) if isinstance(dimensions, str) else dimensions
