"""Histories as labelled data: xarray, NetCDF, pandas.

Dimensions: ``time`` of channels, ``frame`` of fields, ``energy_time``; ``contact``, ``body`` and ``place`` along it,
``event``, ``period`` of contact; and for each recorded quantity the places where it was, as ``strain_at``.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from impactlab import __version__
from impactlab.errors import ExtraError, ImpactlabError
from impactlab.history.base import AbstractHistory, BranchChange, ContactSpan, Cost, Event, HasCase, LinkResult, Warned
from impactlab.history.energy import CarriedEnergy, EnergyBook, EnergyEnds
from impactlab.history.instruments import Measured, measured_signals
from impactlab.history.kept_fields import BodyFields, body_fields
from impactlab.history.sampled import Facts, SampledHistory, channels_of, facts_of
from impactlab.history.units import LONG_NAMES, UNITS
from impactlab.scene.method import Simulation
from impactlab.types import Array

if TYPE_CHECKING:
    import pandas
    import xarray

FORMAT = 1  # of the files
REFERENCE = "reference"  # group of a file that holds the reference of its errors


def needed(name: str) -> Any:
    """Return a library of the ``data`` extra; raise `ExtraError` with the command that installs it."""
    try:
        return import_module(name)
    except ImportError as error:
        raise ExtraError(
            f"labelled data need {name}, which is not installed", remedy="pip install 'impactlab[data]'"
        ) from error


def split(channel: str) -> tuple[str, str]:
    """Return quantity and label of a channel: ``strain`` and ``bar@0.5``."""
    quantity, _, label = channel.partition(":")
    return quantity, label


def labelled(quantity: str, **more: Any) -> dict[str, Any]:
    """Return units and long name of a quantity as attributes."""
    return {"units": UNITS[quantity], "long_name": LONG_NAMES[quantity], **more}


class Labelled(NamedTuple):
    """Arrays as xarray.Dataset takes them: by name a tuple of dimensions, values and attributes."""

    variables: dict[str, Any]
    coordinates: dict[str, Any]
    attributes: dict[str, Any]


def to_xarray(history: AbstractHistory, times: Array) -> xarray.Dataset:
    """Return a history as a dataset: channels, fields, energies, events, periods of contact."""
    library = needed("xarray")
    made: xarray.Dataset = library.Dataset(*labelled_arrays(history, times))
    return made


def labelled_arrays(history: AbstractHistory, times: Array) -> Labelled:
    """Return the arrays of a history's dataset."""
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {"time": ("time", times, {"units": "s", "long_name": "time"})}
    _add_channels(history, times, variables, coordinates)
    fields = history.fields if isinstance(history, SampledHistory) else body_fields(history)
    _add_fields(fields, variables, coordinates)
    _add_energies(history.energy, variables, coordinates)
    _add_contacts(history, variables)
    _add_measured(history, variables, coordinates)
    return Labelled(variables, coordinates, _attributes(history))


def _add_channels(
    history: AbstractHistory, times: Array, variables: dict[str, Any], coordinates: dict[str, Any]
) -> None:
    of: dict[str, list[str]] = {}
    contacts = {contact.name for contact in history.scene.contacts}
    for channel in channels_of(history):
        quantity, label = split(channel)
        of.setdefault("contact_force" if quantity == "force" and label in contacts else quantity, []).append(channel)
    for quantity, channels in of.items():
        dimension = "contact" if quantity in ("contact_force", "gap") else f"{quantity}_at"
        values = history.evaluate_each(times, channels)
        variables[quantity] = ((dimension, "time"), values, labelled(quantity))
        coordinates[dimension] = (dimension, _texts(split(channel)[1] for channel in channels))
        if dimension != "contact":
            x = [float(split(channel)[1].rpartition("@")[2] or 0.0) if "@" in channel else 0.0 for channel in channels]
            coordinates[f"{dimension}_x"] = (
                dimension,
                np.array(x),
                {"units": "m", "long_name": "place along the body"},
            )


def _add_fields(fields: Mapping[str, BodyFields], variables: dict[str, Any], coordinates: dict[str, Any]) -> None:
    """Add fields as (body, place, frame), with NaN where values are missing.

    A body may have fewer places, or may not be kept at an instant.
    """
    if not fields:
        return
    names, frames = list(fields), np.unique(np.concatenate([kept.times for kept in fields.values()]))
    most = max(kept.x.size for kept in fields.values())
    x = np.full((len(names), most), np.nan)
    for number, kept in enumerate(fields.values()):
        x[number, : kept.x.size] = kept.x
    coordinates["body"] = ("body", _texts(names))
    coordinates["frame"] = ("frame", frames, {"units": "s", "long_name": "time of a field"})
    coordinates["x"] = (("body", "place"), x, {"units": "m", "long_name": "place along the body"})
    for quantity in dict.fromkeys(quantity for kept in fields.values() for quantity in kept.values):
        values = np.full((len(names), most, frames.size), np.nan)
        for number, kept in enumerate(fields.values()):
            if quantity in kept.values:
                at = np.searchsorted(frames, kept.times)
                values[number, : kept.x.size, at] = kept.values[quantity]
        variables[f"{quantity}_field"] = (("body", "place", "frame"), values, labelled(quantity))


def _add_energies(book: EnergyBook, variables: dict[str, Any], coordinates: dict[str, Any]) -> None:
    time = "energy_time"
    coordinates[time] = (time, book.time, {"units": "s", "long_name": "time of the energies"})
    coordinates["moving"] = ("moving", _texts(book.bodies))
    coordinates["loss"] = ("loss", _texts(book.booked))
    joule = {"units": "J"}
    rows = {
        "energy_body": ("moving", book.bodies, "energy of a body"),
        "energy_lost": ("loss", book.booked, "booked loss"),
    }
    for name, (dimension, values, words) in rows.items():
        table = np.array(list(values.values())).reshape(len(values), book.time.size)
        variables[name] = ((dimension, time), table, {**joule, "long_name": words})
    variables["energy_stored"] = (time, book.stored, {**joule, "long_name": "energy stored in contacts"})
    variables["energy_work"] = (time, book.work, {**joule, "long_name": "work of gravity and end forces"})
    if book.carried is not None:
        words = "work on the common motion of all interacting bodies"
        kinetic = {"kinetic": book.carried.kinetic}
        variables["energy_carried"] = (time, np.asarray(book.carried.work), {**joule, "long_name": words, **kinetic})


def _add_contacts(history: AbstractHistory, variables: dict[str, Any]) -> None:
    for dimension, records, kind in (("event", history.events, Event), ("period", history.contacts, ContactSpan)):
        for field in kind._fields:
            values = [getattr(each, field) for each in records]
            attributes = {"units": UNITS_OF_RECORDS[field]} if field in UNITS_OF_RECORDS else {}
            text = field in ("contact", "kind")
            column = _texts(values) if text else np.array([np.nan if v is None else v for v in values], float)
            variables[f"{dimension}_{field}"] = (dimension, column, attributes)


UNITS_OF_RECORDS = {"time": "s", "start": "s", "end": "s", "impulse": "N s", "first_impulse": "N s", "peak_force": "N"}


def with_unit(field: str) -> str:
    """Return the name of a column of a table with its unit: ``start [s]``."""
    return f"{field} [{UNITS_OF_RECORDS[field]}]" if field in UNITS_OF_RECORDS else field


def _add_measured(history: AbstractHistory, variables: dict[str, Any], coordinates: dict[str, Any]) -> None:
    """Add the signals of instruments, each over times of its own: measured_1 over sample_1."""
    for number, signal in measured_signals(history).items():
        probe, sample = history.scene.probes[number], f"sample_{number + 1}"
        coordinates[sample] = (sample, signal.time, {"units": "s", "long_name": "time of a sample"})
        about = {"channel": probe.channel, "overloaded": signal.overloaded}
        variables[f"measured_{number + 1}"] = (sample, signal.values, labelled(probe.quantity, **about))


def _measured(dataset: xarray.Dataset) -> dict[int, Measured]:
    found = {}
    for name, variable in dataset.data_vars.items():
        if str(name).startswith("measured_"):
            number = int(str(name).removeprefix("measured_"))
            times = dataset[f"sample_{number}"].values
            found[number - 1] = Measured(times, variable.values, int(variable.attrs["overloaded"]))
    return found


def _texts(values: Any) -> Any:
    return np.array(list(values), dtype=object)


def _attributes(history: AbstractHistory) -> dict[str, Any]:
    facts = facts_of(history)
    kept = {
        "duration": facts.duration,
        "dt": facts.dt,
        "integrator_used": facts.integrator_used,
        "channels": list(facts.listed),
        "warnings": [list(each) for each in facts.warnings],
        "cost": dataclasses.asdict(facts.cost),
        "links": [list(each) for each in facts.links],
        "changes": [list(each) for each in facts.changes],
        "link_impulses": dict(facts.link_impulses),
        "load_impulses": dict(facts.load_impulses),
        "ends": None if facts.ends is None else facts.ends[:4],
        "losses_by_contact": None if facts.ends is None else facts.ends.by_contact,
    }
    attributes = {"impactlab_version": __version__, "impactlab_format": FORMAT, "run": json.dumps(kept)}
    if history.case is not None:
        case = history.case
        attributes |= {"title": case.title, "source": case.source, "case_name": case.label}
        attributes |= {"method": case.method_name, "case": case.to_yaml()}
    return attributes


def read(path: Path, group: str | None = None) -> xarray.Dataset:
    """Return the dataset of a NetCDF file, or of a group in it.

    Raises
    ------
    ImpactlabError
        If there is no such file, or it does not hold a run.
    """
    library = needed("xarray")
    needed("h5netcdf")
    if not Path(path).is_file():
        raise ImpactlabError(f"there is no file '{path}'", remedy="Give a file that to_netcdf or `run --out` wrote.")
    try:
        with library.open_dataset(path, group=group, engine="h5netcdf") as opened:
            dataset: xarray.Dataset = opened.load()
    except (OSError, ValueError, KeyError) as error:
        text = f"'{path}' is not a NetCDF file with a run: {str(error)[:300]}"
        raise ImpactlabError(
            text, remedy="Give the history.nc that `run --out` wrote, or a file of to_netcdf."
        ) from error
    if dataset.attrs.get("impactlab_format") != FORMAT:
        raise ImpactlabError(
            f"'{path}' holds no run in format {FORMAT} of impactlab", remedy="Write it again with this version."
        )
    return dataset


def has_reference(path: Path) -> bool:
    """Return whether a file holds the reference of its errors."""
    with needed("h5netcdf").File(path, "r") as opened:
        return bool(REFERENCE in opened.groups)


def to_history(dataset: xarray.Dataset, run: Simulation, case: HasCase | None) -> SampledHistory:
    """Return the history that a dataset holds, of a scene, its method and its case."""
    kept = json.loads(dataset.attrs["run"])
    values = {}
    for name, variable in dataset.data_vars.items():
        if variable.dims[1:] == ("time",):
            quantity = "force" if name == "contact_force" else str(name)
            for number, label in enumerate(dataset[variable.dims[0]].values):
                values[f"{quantity}:{label}"] = variable.values[number]
    facts = Facts(
        duration=kept["duration"],
        dt=kept["dt"],
        events=tuple(Event(*row[:3], *_numbers(row[3:])) for row in _rows(dataset, "event", Event)),
        contacts=tuple(_span(row) for row in _rows(dataset, "period", ContactSpan)),
        energy=_book(dataset),
        warnings=[Warned(*each) for each in kept["warnings"]],
        cost=Cost(**kept["cost"]),
        integrator_used=kept["integrator_used"],
        case=case,
        listed=tuple(kept["channels"]),
        measured=_measured(dataset),
        links=tuple(LinkResult._make([*each[:-1], tuple(each[-1])]) for each in kept.get("links", ())),
        changes=tuple(BranchChange(*each) for each in kept.get("changes", ())),
        link_impulses=kept.get("link_impulses", {}),
        load_impulses=kept.get("load_impulses", {}),
        # a file of an earlier version has none
        ends=EnergyEnds._make([*kept["ends"][:4], kept.get("losses_by_contact")]) if kept.get("ends") else None,
    )
    return SampledHistory(run, facts, dataset["time"].values, values, _body_fields(dataset))


def _rows(dataset: xarray.Dataset, dimension: str, kind: Any) -> list[tuple[Any, ...]]:
    columns = [dataset[f"{dimension}_{field}"].values.tolist() for field in kind._fields]
    return list(zip(*columns, strict=True))


def _numbers(values: tuple[float, ...]) -> list[float | None]:
    return [None if np.isnan(value) else value for value in values]


def _span(row: tuple[Any, ...]) -> ContactSpan:
    contact, start, end, impulse, peak, first, kicks = row
    end, peak, first, count = _numbers((end, peak, first, kicks))
    return ContactSpan(contact, start, end, impulse, peak, first, None if count is None else int(count))


def _book(dataset: xarray.Dataset) -> EnergyBook:
    def rows(name: str, dimension: str) -> dict[str, Array]:
        return {str(each): dataset[name].values[n] for n, each in enumerate(dataset[dimension].values)}

    carried = None
    if "energy_carried" in dataset:
        carried = CarriedEnergy(float(dataset["energy_carried"].attrs["kinetic"]), dataset["energy_carried"].values)
    time, stored, work = (dataset[name].values for name in ("energy_time", "energy_stored", "energy_work"))
    return EnergyBook(time, rows("energy_body", "moving"), stored, rows("energy_lost", "loss"), work, carried)


def _body_fields(dataset: xarray.Dataset) -> dict[str, BodyFields]:
    fields = {}
    for number, name in enumerate(dataset["body"].values if "body" in dataset.coords else ()):
        x = dataset["x"].values[number]
        places = np.isfinite(x)
        values, frames = {}, np.zeros(0)
        for field, variable in dataset.data_vars.items():
            table = (
                variable.values[number][places].T if variable.dims == ("body", "place", "frame") else np.zeros((0, 0))
            )
            there = np.isfinite(table).all(axis=1)
            if there.any():
                frames = dataset["frame"].values[there]
                values[str(field).removesuffix("_field")] = np.ascontiguousarray(table[there])
        fields[str(name)] = BodyFields(frames, x[places], values)
    return fields


def to_pandas(history: AbstractHistory, times: Array) -> pandas.DataFrame:
    """Return all channels as columns over time [s]; ``attrs["units"]`` has the unit of each."""
    library = needed("pandas")
    names = history.channels()
    rows = history.evaluate_each(times, names)
    table: pandas.DataFrame = library.DataFrame(rows.T, library.Index(times, name="time"), names)
    table.attrs["units"] = {"time": "s", **{name: UNITS[split(name)[0]] for name in names}}
    return table


def contacts_table(history: AbstractHistory) -> pandas.DataFrame:
    """Return the periods of contact as a table, units in its attributes."""
    table: pandas.DataFrame = needed("pandas").DataFrame(list(history.contacts), columns=ContactSpan._fields)
    table.attrs["units"] = {
        field: UNITS_OF_RECORDS[field] for field in ContactSpan._fields if field in UNITS_OF_RECORDS
    }
    return table
