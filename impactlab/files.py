"""Runs as files: NetCDF and tables.

A NetCDF file has the sampled history, its case and summary, and the reference of its errors. Nothing in such a file is
run when it is read: the case is text, checked as any case file is.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from impactlab.casefile.case import Case, case_of
from impactlab.casefile.document import parse_yaml
from impactlab.casefile.text.limits import MAX_GIVEN
from impactlab.errors import NO_ROOM, ImpactlabError, expect_path
from impactlab.history import dataset as data
from impactlab.history.base import AbstractHistory, ContactSpan
from impactlab.history.instruments import instrumented, measured_file
from impactlab.history.sampled import SampledHistory
from impactlab.history.sampling import MAX_FORCES, file_times, page_times
from impactlab.history.units import UNITS
from impactlab.refine.references.reference_record import Reference
from impactlab.report.summary import summarise
from impactlab.scene.method import Simulation

NETCDF = "history.nc"  # name of the file in the folder of a run
COMPRESSED = {"compression": "gzip", "compression_opts": 1, "shuffle": True}


class SavedRun(NamedTuple):
    """Content of the file of a run."""

    case: Case
    history: SampledHistory
    summary: dict[str, Any]
    reference: Reference | None  # its history is sampled, too
    texts: dict[str, str]  # command, citations, date ...


def write_netcdf(
    path: str | Path,
    history: AbstractHistory,
    summary: Mapping[str, Any] | None = None,
    reference: Reference | None = None,
    texts: Mapping[str, str] | None = None,
) -> None:
    """Write a run into a NetCDF file.

    Parameters
    ----------
    summary : mapping, optional
        Its summary; made without errors if not given.
    reference : Reference, optional
        The reference of the errors in the summary.
    texts : mapping, optional
        Texts to keep by name, as the command that made the run.

    Raises
    ------
    ExtraError
        Without h5netcdf.
    ImpactlabError
        If there is no folder to write in, or the file cannot be written.
    """
    expect_path(path, "to_netcdf")
    known = history.case.label if history.case is not None else history.scene.name
    times = file_times(history.duration, len(history.channels()))
    about = {
        "summary": json.dumps(summary if summary is not None else summarise(known, history)),
        "texts": json.dumps(dict(texts or {})),
    }
    _write_arrays(Path(path), data.labelled_arrays(history, times), about)
    if reference is not None:
        of_errors = {"reference": json.dumps([reference.name, *reference[2:]], default=dict)}
        _write_arrays(Path(path), data.labelled_arrays(reference.history, times), of_errors, data.REFERENCE)


def _write_arrays(path: Path, arrays: data.Labelled, more: Mapping[str, str], group: str | None = None) -> None:
    """Write labelled arrays and ``more`` attributes to a NetCDF file, or into a group of it.

    h5netcdf writes them: the libraries of arrays that xarray looks for when it writes take seconds to load.
    """
    library = data.needed("h5netcdf")
    folder = path.absolute().parent
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


def _fill(group: Any, arrays: data.Labelled, more: Mapping[str, str]) -> None:
    """Write dimensions, coordinates, variables and attributes into a group."""
    text = data.needed("h5py").string_dtype()
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


def open_netcdf(path: str | Path) -> SampledHistory:
    """Return the history in a NetCDF file that `to_netcdf` or ``impactlab run --out`` wrote.

    Raises
    ------
    ExtraError
        Without xarray or h5netcdf: ``pip install 'impactlab[data]'``.
    ImpactlabError
        If the file does not hold a run of a case; `CaseError` where its case cannot be built, as without a plugin.
    """
    return read_netcdf(path).history


def read_netcdf(path: str | Path) -> SavedRun:
    """Return the content of the file of a run; raises as `open_netcdf`."""
    expect_path(path, "open_netcdf")
    dataset = data.read(Path(path))
    case = _case(str(path), dataset.attrs)
    history = data.to_history(dataset, case.simulation(), case)
    reference = None
    if data.has_reference(Path(path)):
        group = data.read(Path(path), data.REFERENCE)
        of = Simulation(case.scene(), case.simulation().method)
        name, *known = json.loads(group.attrs["reference"])
        reference = Reference(name, data.to_history(group, of, None), *known)
    history.saved_summary = json.loads(dataset.attrs["summary"])
    return SavedRun(case, history, history.saved_summary, reference, json.loads(dataset.attrs["texts"]))


def _case(path: str, attributes: Mapping[str, Any]) -> Case:
    if "case" not in attributes:
        raise ImpactlabError(
            f"'{path}' holds a run of a scene without a case, which cannot be built again",
            remedy="Run a Case, made by il.Case or il.load_case, and write that.",
        )
    name, document = str(attributes["case_name"]), parse_yaml(str(attributes["case"]), most=MAX_GIVEN)
    return case_of(name, path, document, method=str(attributes["method"]))


def write_tables(folder: Path, history: AbstractHistory) -> None:
    """Write contacts.csv, the periods of contact, and probes.csv, the probes and contact forces over time.

    The forces of more than `MAX_FORCES` contacts stand in history.npz and history.nc alone.

    Each probe that is an instrument has its measured signal in a file of its own, `measured_file`.

    The first line of each names the columns, with units: ``start [s]``, ``strain:bar@0.5 [1]``.
    """
    rows = [[_cell(value) for value in span] for span in history.contacts]
    _write_csv(folder / "contacts.csv", [data.with_unit(field) for field in ContactSpan._fields], rows)
    time = page_times(history.duration)
    wanted = [probe.channel for probe in history.scene.probes]
    if len(history.scene.contacts) <= MAX_FORCES:
        wanted += [f"force:{contact.name}" for contact in history.scene.contacts]
    recorded = frozenset(history.channels())
    names = [name for name in dict.fromkeys(wanted) if name in recorded]
    columns = [time, *(history.evaluate(time, name) for name in names)]
    headings = ["time [s]", *(f"{name} [{UNITS[name.partition(':')[0]]}]" for name in names)]
    _write_csv(folder / "probes.csv", headings, zip(*(column.tolist() for column in columns), strict=True))

    for number, probe in instrumented(history.scene):
        found = history.measured(probe)
        headings = ["time [s]", f"{probe.channel} [{UNITS[probe.quantity]}]"]
        rows_of_signal = zip(found.time.tolist(), found.values.tolist(), strict=True)
        _write_csv(folder / measured_file(number), headings, rows_of_signal)


def _cell(value: Any) -> Any:
    return "" if value is None else value


def _write_csv(path: Path, headings: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(headings)
        table.writerows(rows)


def write_data(
    folder: Path,
    history: AbstractHistory,
    summary: Mapping[str, Any],
    reference: Reference | None,
    texts: Mapping[str, str],
) -> Callable[[], None] | None:
    """Write the tables of a run, and return the call that writes its history.nc.

    It is None if a library of NetCDF is missing.
    """
    write_tables(folder, history)
    if not all(find_spec(name) is not None for name in ("h5netcdf", "h5py")):
        return None
    return partial(write_netcdf, folder / NETCDF, history, summary, reference, texts)
