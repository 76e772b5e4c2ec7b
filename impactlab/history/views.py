"""What people see of a history, and the files it goes into: tables, labelled data, figures, notebook displays.

The code stands in modules above this one, with libraries that most runs never need. They are found by their names when
they are first asked for, as plotting backends are.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from impactlab.history.sampling import HISTORY_POINTS, page_times

if TYPE_CHECKING:
    import pandas
    import xarray

MAX_SHOWN = 8  # channels and warnings in the text of a history


def above(module: str) -> Any:
    """Return a module of the package that imports this one, by its name."""
    return import_module(f"impactlab.{module}")


class Views:
    """Tables, labelled data, figures and displays of a history."""

    if TYPE_CHECKING:  # fields of the history
        duration: float
        case: Any
        cost: Any
        contacts: tuple[Any, ...]
        events: tuple[Any, ...]
        warnings: list[Any]

        def channels(self) -> tuple[str, ...]: ...

    def to_xarray(self, points: int = HISTORY_POINTS) -> xarray.Dataset:
        """Return the run as an xarray Dataset: channels at equal times, fields, energies, events, periods of contact.

        ``contact_force`` and ``gap`` have the dimensions (contact, time); a probed quantity such as ``strain`` has
        (strain_at, time); its fields ``strain_field`` (body, place, frame), with the places as ``x`` [m]. Units and
        long names are attributes, and the case as YAML.

        Raises
        ------
        ExtraError
            Without xarray: ``pip install 'impactlab[data]'``.
        """
        made: xarray.Dataset = above("history.dataset").to_xarray(self, page_times(self.duration, points))
        return made

    def to_netcdf(self, path: str | Path) -> None:
        """Write the run into a NetCDF file that `impactlab.open_netcdf` and ``impactlab report`` read.

        Raises
        ------
        ExtraError
            Without xarray or h5netcdf: ``pip install 'impactlab[data]'``.
        """
        above("files").write_netcdf(path, self)

    def to_pandas(self, points: int = HISTORY_POINTS) -> pandas.DataFrame:
        """Return all channels as columns over equal times [s]; ``attrs["units"]`` has their units."""
        made: pandas.DataFrame = above("history.dataset").to_pandas(self, page_times(self.duration, points))
        return made

    @property
    def contacts_table(self) -> pandas.DataFrame:
        """The periods of contact as a table: contact, start, end [s], impulse [N s], peak_force [N] and kicks."""
        made: pandas.DataFrame = above("history.dataset").contacts_table(self)
        return made

    def __repr__(self) -> str:
        named = "" if self.case is None else f" of '{self.case.label}'"
        method = "" if self.case is None or self.case.method_name == "base" else f", method '{self.case.method_name}'"
        lines = [
            f"<{type(self).__name__}{named}{method}: {self.duration:.6g} s, {self.cost.steps} steps",
            f"  periods of contact: {len(self.contacts)}, events: {len(self.events)}",
            *(f"  warning {warned.code}: {warned.text}" for warned in self.warnings[:MAX_SHOWN]),
            "  channels: "
            + ", ".join(self.channels()[:MAX_SHOWN])
            + (", ..." if len(self.channels()) > MAX_SHOWN else ""),
        ]
        return "\n".join(lines) + ">"
