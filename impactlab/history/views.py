"""Tables, labelled data, figures, files and notebook displays of a history.

The code is in modules above this one, with libraries that most runs never need. They are imported by name on first use,
as plotting backends are.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from impactlab.errors import ImpactlabError, expect_whole
from impactlab.history.advice import warning_lines
from impactlab.history.sampling import HISTORY_POINTS, page_times
from impactlab.startup.lazy import above
from impactlab.types import Array

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.animation import FuncAnimation
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

MAX_POINTS = 100_000_000  # instants of a table
MAX_SHOWN = 8  # channels in the text of a history


class Views:
    """Tables, labelled data, figures and displays of a history."""

    if TYPE_CHECKING:  # fields of the history
        duration: float
        case: Any
        cost: Any
        dt: float | None
        integrator_used: bool
        contacts: tuple[Any, ...]
        events: tuple[Any, ...]
        warnings: list[Any]

        def channels(self) -> tuple[str, ...]: ...

    def summary(self, reference: bool = False) -> dict[str, Any]:
        """Return the numbers of the run and its errors, as ``impactlab run --json`` prints them.

        Parameters
        ----------
        reference : bool
            Compute the reference of the errors in any case. Otherwise it is computed only where that is predicted to
            take no longer than ten times the run, and ten seconds at most; ``errors`` is else None.

        Returns
        -------
        dict
            Plain numbers, texts and lists: ``events``, ``contacts``, ``final``, ``energy``, ``probes``, ``errors`` and
            others, in SI.

        Raises
        ------
        ImpactlabError
            If the run is of no case.
        """
        if self.case is None:
            raise ImpactlabError("only the run of a case has a summary", remedy="Run a case: il.run(case).")
        budget = above("refine.references.reference_record").FULL_BUDGET_S if reference else None
        made: dict[str, Any] = above("api").summarised(self.case, self, budget)[0]
        return made

    def to_xarray(self, points: int = HISTORY_POINTS) -> xarray.Dataset:
        """Return the run as an xarray Dataset, with units and long names.

        ``contact_force`` and ``gap`` have the dimensions (contact, time); a probed quantity such as ``strain`` has
        (strain_at, time); its fields ``strain_field`` (body, place, frame), with the places as ``x`` [m]. Units and
        long names are attributes, and the case as YAML.

        Raises
        ------
        ExtraError
            Without xarray: ``pip install 'impactlab[data]'``.
        """
        expect_whole(points, "points", 2, MAX_POINTS)
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
        expect_whole(points, "points", 2, MAX_POINTS)
        made: pandas.DataFrame = above("history.dataset").to_pandas(self, page_times(self.duration, points))
        return made

    @property
    def contacts_table(self) -> pandas.DataFrame:
        """The periods of contact as a table: contact, start, end, impulse, peak_force, kicks."""
        made: pandas.DataFrame = above("history.dataset").contacts_table(self)
        return made

    def jacobian(self, channel: str, times: ArrayLike, parameters: Sequence[str]) -> Array:
        """Return the derivatives of a channel of an exact run by numbers of its case.

        The shape is (times, parameters), in SI.

        Parameters
        ----------
        channel : str
            One of ``channels()``, or at any other place of a rod.
        times : array
            Times [s]; where a wave front passes, the derivative is NaN.
        parameters : sequence of str
            Dotted paths of numbers of the case, such as ``bodies.hammer.mass``.

        Raises
        ------
        CaseError
            If the run is not exact, a path does not lead to a number, or the channel is not known.
        """
        made: Array = above("derivatives").jacobian(self.case, channel, times, parameters)
        return made

    def plot(self, *channels: str, start: float = 0.0, end: float | None = None) -> Figure:
        """Return a figure of probes, contact forces and displacements over time, or of some channels.

        ``history.plot("force:hammer|rod.left", "stress:rod@0.15", end=2e-4)`` draws two of them early in the run. Of
        more than ten curves in a panel six have names, those furthest apart. Of more than 40 contacts or probes
        40 are drawn, spread over the case.

        Parameters
        ----------
        channels : str
            Some of ``channels()``, a panel for each quantity; of an exact run also those at other places of a rod.
        start, end : float, optional
            Times [s] between which they are drawn; the whole run if not given.

        Raises
        ------
        ImpactlabError
            If the run has no such channel, a channel no values, the run nothing to draw, or the times do not lie in it.
        """
        made: Figure = above("report.notebook").plot(self, *channels, start=start, end=end)
        return made

    def plot_xt(self) -> Figure:
        """Return the Lagrange diagram: place to the right, time upwards, load as colour.

        Of a row of mostly rigid bodies, such as a chain of beads, it has the contacts to the right and their forces as
        colour.

        Raises
        ------
        ImpactlabError
            If no fields were kept of any body: a stepped run keeps them with ``il.run(case, frames=240)``.
        """
        made: Figure = above("report.notebook").plot_xt(self)
        return made

    def animate(self, path: str | Path | None = None, seconds: float = 8.0) -> FuncAnimation | None:
        """Return or write the run as an animation: bodies coloured by load, and their waves.

        Parameters
        ----------
        path : str or Path, optional
            A file to write, .gif or .mp4 (which needs ffmpeg); then nothing is returned.
        seconds : float, optional
            How long it plays.

        Raises
        ------
        ImpactlabError
            If the file has another ending, or ffmpeg is missing.
        """
        if path is not None:
            above("report.figures.film_files").write(self, Path(path), seconds)
            return None
        made: FuncAnimation = above("report.figures.animation").animate(self, seconds)
        return made

    def _repr_html_(self) -> str:
        made: str = above("report.notebook").of_history(self)
        return made

    def __repr__(self) -> str:
        named = "" if self.case is None else f" of '{self.case.label}'"
        method = "" if self.case is None or self.case.method_name == "base" else f", method '{self.case.method_name}'"
        taken = "steps" if self.dt is not None or self.integrator_used else "intervals between events"
        lines = [
            f"<{type(self).__name__}{named}{method}: {self.duration:.6g} s, {self.cost.steps} {taken}",
            f"  periods of contact: {len(self.contacts)}, events: {len(self.events)}",
            *(f"  warning {line}" for line in warning_lines(warned._asdict() for warned in self.warnings)),
            "  channels: "
            + ", ".join(self.channels()[:MAX_SHOWN])
            + (", ..." if len(self.channels()) > MAX_SHOWN else ""),
        ]
        return "\n".join(lines) + ">"
