"""Runs a sweep: all points of one case, in this process or in several, resumed where it was interrupted."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import impactlab
from impactlab import api
from impactlab.bench.keys import code_hash, numeric_environment, plugin_modules, tree_hash
from impactlab.bench.pool import outcomes
from impactlab.casefile import Case
from impactlab.errors import CaseError, ImpactlabError, StepError
from impactlab.report.figure_files import save as save_figure
from impactlab.report.summary import status_of
from impactlab.sweeps import axes
from impactlab.sweeps.axes import Points
from impactlab.sweeps.chunks import STATUSES, Chunk, Folder, opened
from impactlab.sweeps.plots import plot_sweep
from impactlab.sweeps.quantities import DEFAULT, Asked, Sampled, asked, values
from impactlab.sweeps.result import dataset, needed

if TYPE_CHECKING:
    import xarray

CHUNK_SECONDS = 0.5  # s, about, of the points that are computed and kept together
MAX_CHUNK = 10_000  # points
POINT_LIMIT_S = 60.0  # s, after which a run in a worker counts as hung
MAX_REASON = 300  # characters

Progress = Callable[[float], None]


class Sweep(NamedTuple):
    """All that the results of a sweep depend on."""

    case: Case
    points: Points
    wanted: tuple[Asked, ...]

    def content(self, size: int, command: str = "") -> dict[str, Any]:
        """Return it as plain values: two sweeps of the same content have the same results."""
        axes = [
            {"path": axis.path, "values": axis.values, "si": axis.si, "unit": axis.unit} for axis in self.points.axes
        ]
        case = {"document": self.case.document.data, "variant": self.case.variant_name, "method": self.case.method_name}
        return {
            "schema_version": 1,
            "name": self.case.label,
            "case": case,
            "resolved": self.case.resolved(),
            "axes": axes,
            "listed": self.points.listed,
            "quantities": [each._asdict() for each in self.wanted],
            "chunk": size,
            "code": code_hash(),
            "plugins": {name: tree_hash(name) for name in sorted(plugin_modules(self.case))},
            "environment": numeric_environment(),
            "version": impactlab.__version__,
            "date": datetime.now(UTC).isoformat(timespec="seconds"),
            "command": command,
        }


def sweep(
    case: Case,
    over: Mapping[str, Iterable[Any]] | None = None,
    *,
    points: Mapping[str, Iterable[Any]] | None = None,
    quantities: Sequence[str | Sampled] = DEFAULT,
    workers: int = 0,
    out: str | Path | None = None,
    progress: Progress | None = None,
    command: str = "",
) -> xarray.Dataset:
    """Return quantities of a case at many points, as one labelled dataset.

    Parameters
    ----------
    case : Case
        The case; a method and a variant may have been chosen.
    over : mapping
        Axes of a grid: dotted path to values, as a case file would hold them; ``method`` takes names of methods.
    points : mapping, optional
        In place of ``over``: columns of listed points, dotted path to one value per point.
    quantities : sequence
        Names of quantities (`impactlab plugins` lists them), and `Sampled` channels.
    workers : int
        Processes, each with a time limit for a run; 0 runs in this one, without a limit.
    out : path, optional
        Folder that keeps finished points: a sweep that was interrupted goes on there. It also gets ``sweep.nc`` and
        ``table.csv``.
    progress : callable, optional
        Called with the fraction done, from 0 to 1.

    Raises
    ------
    CaseError, PairingError, PluginError
        Before the first run: a path, a value or a quantity is wrong, or the folder holds something else. A run that is
        refused or fails later is a point with ``status`` and ``reason``; its quantities are NaN.
    """
    needed()
    if (over is None) == (points is None):
        raise CaseError("a sweep takes axes or listed points", remedy="Give one of the two: over or points.")
    grid = axes.grid(case, over) if over is not None else axes.listed(case, points or {})
    made = Sweep(case, grid, asked(grid.case(case, 0).scene(), quantities, case.registry))
    with contextlib.ExitStack() as stack:
        size = None if out is None else _size_before(Path(out))
        size = size or _size(made, workers)
        content = made.content(size, command)
        folder = None if out is None else stack.enter_context(opened(Path(out), content))
        kept = {} if folder is None else {chunk.first: chunk for chunk in folder.chunks()}
        for chunk in _computed(
            made, [first for first in range(0, grid.count, size) if first not in kept], size, workers
        ):
            kept[chunk.first] = chunk
            if folder is not None:
                folder.put(chunk)
            if progress is not None:
                progress(min(1.0, len(kept) * size / grid.count))
        found = dataset(content, kept.values())
        if folder is not None:
            write(folder, found)
        return found


def write(folder: Folder, found: xarray.Dataset) -> None:
    """Write ``sweep.nc``, ``table.csv`` and, over one or two axes, a figure of each quantity into the folder."""
    for name, save in (
        ("sweep.nc", lambda path: found.to_netcdf(path, engine="h5netcdf")),
        ("table.csv", lambda path: found.to_dataframe().to_csv(path)),
    ):
        draft = folder.path / f"{name}.part"
        save(draft)
        draft.replace(folder.path / name)
    if found["status"].dims == ("point",) or found["status"].ndim > 2:
        return
    figures = folder.path / "figures"
    figures.mkdir(exist_ok=True)
    for quantity in map(str, found.data_vars):
        sampled = any(str(dim).startswith("time of") for dim in found[quantity].dims)
        if quantity not in ("status", "reason") and not sampled:
            save_figure(plot_sweep(found, quantity), figures, quantity)


def _size_before(path: Path) -> int | None:
    """Return the points in a chunk of the sweep that a folder holds, or None."""
    if not (path / "sweep.json").exists():
        return None
    size = Folder(path).content.get("chunk")
    return size if isinstance(size, int) and size > 0 else None


def _size(made: Sweep, workers: int) -> int:
    """Return how many points make a chunk, from the time of the first one; 1 where a worker hangs or dies on it."""
    if workers == 0:
        spent = _spent(made)
    else:
        start: dict[str, Any] = {"initializer": _begin, "initargs": (made,)}
        [outcome] = outcomes(_spent_in_worker, [0], limit=2.0 * POINT_LIMIT_S, **start)
        spent = outcome.value if outcome.status == "answered" else math.inf
    return max(1, min(MAX_CHUNK, int(CHUNK_SECONDS / max(spent, 1e-6))))


def _spent(made: Sweep) -> float:
    """Return the time of the first point [s], of a quick one run again without the loading of compiled code."""
    spent = math.inf
    for _ in range(2):
        began = time.perf_counter()
        row(made, 0)
        spent = time.perf_counter() - began
        if spent > CHUNK_SECONDS:
            break
    return spent


class Row(NamedTuple):
    """Results of a point."""

    status: int
    reason: str
    values: list[list[float]]


def row(made: Sweep, number: int) -> Row:
    """Return the results of a point; a run that is refused or fails has missing values."""
    try:
        case = made.points.case(made.case, number)
        with api.warnings_kept():
            history = api.run(case)
        found = values(case.scene(), history, made.wanted, case.registry)
        return Row(STATUSES.index(status_of(history)), "", found)
    except ImpactlabError as error:
        return missing(made, "failed" if isinstance(error, StepError) else "refused", str(error))
    except Exception as error:  # noqa: BLE001 - a part may raise anything; its point tells it
        return missing(made, "failed", f"{type(error).__name__}: {error}")


def missing(made: Sweep, status: str, reason: str) -> Row:
    """Return a point without values."""
    text = " ".join(reason.split())[:MAX_REASON]
    return Row(STATUSES.index(status), text, [[math.nan] * each.size for each in made.wanted])


def chunk_of(first: int, rows: Sequence[Row], wanted: Sequence[Asked]) -> Chunk:
    """Return the chunk of consecutive points."""
    tables = tuple(np.array([each.values[k] for each in rows], dtype=float) for k in range(len(wanted)))
    return Chunk(first, np.array([each.status for each in rows], np.int8), tuple(each.reason for each in rows), tables)


def _computed(made: Sweep, firsts: Sequence[int], size: int, workers: int) -> Iterator[Chunk]:
    """Give the chunks that begin at certain points, in this process or in workers."""
    count = made.points.count
    if workers == 0:
        for first in firsts:
            rows = [row(made, number) for number in range(first, min(first + size, count))]
            yield chunk_of(first, rows, made.wanted)
        return
    jobs = [(first, min(first + size, count)) for first in firsts]
    limit = POINT_LIMIT_S + 4.0 * CHUNK_SECONDS
    lost: list[tuple[int, int]] = []
    for outcome in outcomes(_in_worker, jobs, workers=workers, limit=limit, initializer=_begin, initargs=(made,)):
        if outcome.status == "answered":
            yield chunk_of(outcome.job[0], outcome.value, made.wanted)
        else:
            lost.append(outcome.job)
    # A worker that hung or died: each point of its chunk alone, so that one point is lost and not the chunk.
    single = [(number, number + 1) for first, last in lost for number in range(first, last)]
    alone: dict[int, Row] = {}
    for outcome in outcomes(
        _in_worker, single, workers=workers, limit=POINT_LIMIT_S, initializer=_begin, initargs=(made,)
    ):
        answered = outcome.status == "answered"
        status = "hung" if outcome.status == "hung" else "crashed"
        alone[outcome.job[0]] = outcome.value[0] if answered else missing(made, status, outcome.value)
    for first, last in lost:
        yield chunk_of(first, [alone[number] for number in range(first, last)], made.wanted)


_made: list[Sweep] = []  # of a worker process


def _begin(made: Sweep) -> None:
    _made[:] = [made]


def _spent_in_worker(_: int) -> float:
    return _spent(_made[0])


def _in_worker(job: tuple[int, int]) -> list[Row]:
    return [row(_made[0], number) for number in range(*job)]
