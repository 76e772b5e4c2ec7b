"""Runs a sweep: all points of one case, in this process or in several, resumed where it was interrupted."""

from __future__ import annotations

import contextlib
import json
import logging
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import impactlab
from impactlab import api
from impactlab.bench.keys import code_hash, numeric_environment, plugin_modules, top, tree_hash
from impactlab.bench.pool import outcomes
from impactlab.casefile import Case
from impactlab.errors import CaseError, ImpactlabError, StepError, SweepError
from impactlab.plugins import QUANTITIES
from impactlab.report.figure_files import save as save_figure
from impactlab.report.summary import status_of
from impactlab.sweeps import axes
from impactlab.sweeps.axes import Points
from impactlab.sweeps.batch import Batch, Found, batch_of
from impactlab.sweeps.chunks import CONTENT, DRAFT, ENGINES, STATUSES, Chunk, Folder, opened, refuse_folder
from impactlab.sweeps.plots import plot_sweep
from impactlab.sweeps.quantities import DEFAULT, Asked, asked, values
from impactlab.sweeps.result import Result, needed, refuse_large, write_table
from impactlab.sweeps.sampled import Sampled, check_sampled
from impactlab.sweeps.shards import Shard, read_shard

if TYPE_CHECKING:
    import xarray

CHUNK_SECONDS = 0.5  # s, about, of the points that are computed and kept together
MAX_CHUNK = 10_000  # points
POINT_LIMIT_S = 60.0  # s, after which a run in a worker counts as hung
MAX_REASON = 300  # characters

LOG = logging.getLogger("impactlab")

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Sweep:
    """All that the results of a sweep depend on."""

    case: Case
    points: Points
    wanted: tuple[Asked, ...]

    @cached_property
    def batch(self) -> Batch | None:
        """The points as a batch, or None where they are runs of their own."""

        def single(number: int) -> list[list[float]] | None:
            found = row(self, number)
            return found.values if found.status == STATUSES.index("completed") else None

        found = batch_of(self.case, self.points, self.wanted, single)
        if isinstance(found, str):
            LOG.info("each point is a run of its own: %s", found)
            return None
        return found

    def __getstate__(self) -> dict[str, Any]:
        """Return it without the batch, which holds memory of this process."""
        return {name: value for name, value in vars(self).items() if name != "batch"}

    def content(self, command: str = "") -> dict[str, Any]:
        """Return it as plain values: two sweeps of the same content have the same results."""
        found = [
            {"path": axis.path, "values": axis.values, "si": axis.si, "unit": axis.unit} for axis in self.points.axes
        ]
        return {
            **_origin(self.case),
            "axes": found,
            "listed": self.points.listed,
            "quantities": [each._asdict() for each in self.wanted],
            "plugins": {name: tree_hash(name) for name in sorted(self._modules())},
            "version": impactlab.__version__,
            "date": datetime.now(UTC).isoformat(timespec="seconds"),
            "command": command,
        }

    def _modules(self) -> set[str]:
        """Return the top modules of plugins that the results come from."""
        names = [each.name for each in self.wanted]
        entries = [each for each in self.case.registry.entries if each.group == QUANTITIES.name and each.name in names]
        cases = [self.case]
        for axis in self.points.axes:
            if not axis.is_numeric:
                distinct = {repr(value): value for value in axis.values}.values()
                cases += [axes.at_point(self.case, {axis.path: value}) for value in distinct]
        return ({top(each) for each in entries} | {name for case in cases for name in plugin_modules(case)}) - {
            "impactlab"
        }


def _origin(case: Case) -> dict[str, Any]:
    """Return the part of the content of a sweep that its axes were checked against."""
    return {
        "schema_version": 2,
        "name": case.label,
        "case": {"document": case.document.data, "variant": case.variant_name, "method": case.method_name},
        "resolved": case.resolved(),
        "code": code_hash(),
        "environment": numeric_environment(),
    }


def sweep(
    case: Case,
    over: Mapping[str, Iterable[Any]] | None = None,
    *,
    points: Mapping[str, Iterable[Any]] | None = None,
    quantities: Sequence[str | Sampled] = DEFAULT,
    workers: int = 0,
    out: str | Path | None = None,
    shard: str | tuple[int, int] | None = None,
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
    shard : str or (int, int), optional
        ``"3/40"``: only the third of 40 equal parts, whose points are kept in ``out``; several programs may compute
        other parts at the same time. A last call without it collects them.
    progress : callable, optional
        Called with the fraction done, from 0 to 1.

    Raises
    ------
    CaseError, PairingError, PluginError
        Before the first run: a path, a value or a quantity is wrong, or the folder holds something else. A run that is
        refused or fails later is a point with ``status`` and ``reason``; its quantities are NaN.
    SweepError
        If points can no longer be kept or computed; those that were are in the folder.
    """
    needed()
    if (over is None) == (points is None):
        raise CaseError("a sweep takes axes or listed points", remedy="Give one of the two: over or points.")
    part = None if shard is None else read_shard(shard)
    path = None if out is None else Path(out)
    if path is None and part is not None:
        raise CaseError("a shard without a folder", path="--shard", remedy="Give the folder of all shards with --out.")
    made = _made_of(case, over, points, quantities, path)
    content = made.content(command)
    if path is None:
        result = Result({**content, "chunk": _size(made, workers)})
        return _filled(made, result, None, None, workers, progress).dataset()
    refuse_folder(path, content, part)
    with kept_in(path), opened(path, {**content, "chunk": _size_of(path) or _size(made, workers)}, part) as folder:
        result = Result(folder.content)
        missing = int(np.count_nonzero(result.status == 0))
        for chunk in folder.chunks():
            result.add(chunk)
        _filled(made, result, folder, part, workers, progress)
        found = result.dataset()
        if part is None and (missing or not (path / "sweep.nc").exists()):
            write(folder, found)
        return found


def _made_of(
    case: Case,
    over: Mapping[str, Iterable[Any]] | None,
    points: Mapping[str, Iterable[Any]] | None,
    quantities: Sequence[str | Sampled],
    path: Path | None,
) -> Sweep:
    """Return a sweep whose axes and quantities are checked; those that its folder holds were."""
    known = None
    if path is not None and (path / CONTENT).exists():
        before, now = Folder(path).content, json.loads(json.dumps(_origin(case)))
        if all(before.get(name) == value for name, value in now.items()):
            known = {axis["path"]: axis for axis in before["axes"]}
    grid = axes.grid(case, over, known) if over is not None else axes.listed(case, points or {}, known)
    ends = []
    for number in {0, grid.count - 1}:
        with contextlib.suppress(ImpactlabError):
            ends.append(grid.case(case, number).simulation())
    run = (ends or [case.simulation()])[0]
    for each in quantities:
        if isinstance(each, Sampled):
            check_sampled(each, *run, max(scene.duration for scene, _ in (ends or [run])))
    wanted = asked(run.scene, quantities, case.registry)
    refuse_large(grid.count, [each.size for each in wanted])
    return Sweep(case, grid, wanted)


def _filled(
    made: Sweep, result: Result, folder: Folder | None, shard: Shard | None, workers: int, progress: Progress | None
) -> Result:
    """Return the result with the points that it misses, each chunk kept as soon as it is there."""
    size = result.content["chunk"]
    chunks = [k for k in range(math.ceil(made.points.count / size)) if shard is None or shard.has(k)]
    firsts = [k * size for k in chunks if not result.status[k * size]]
    done = len(chunks) - len(firsts)
    try:
        for chunk in _computed(made, firsts, size, workers):
            _keep(chunk, result, folder)
            done += 1
            if progress is not None:
                progress(done / len(chunks))
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted: {kept_words(result, folder)}") from None
    return result


def _keep(chunk: Chunk, result: Result, folder: Folder | None) -> None:
    """Put a chunk into the result, once its folder has it."""
    if folder is not None:
        try:
            folder.put(chunk)
        except OSError as error:
            raise SweepError(f"points cannot be kept: {error}", remedy=kept_words(result, folder)) from error
    result.add(chunk)


def kept_words(result: Result, folder: Folder | None) -> str:
    """Return how many points a folder keeps, and how to go on, as the last words of a sweep that ended early."""
    if folder is None:
        return "no point is kept. Give a folder with --out to keep finished ones."
    if not folder.path.is_dir():
        return "The folder is gone. The same command begins again."
    text = f"{np.count_nonzero(result.status)} of {result.status.size} points are kept in {str(folder.path)!r}."
    return f"{text} The same command goes on with the others."


def write(folder: Folder, found: xarray.Dataset) -> None:
    """Write ``sweep.nc``, ``table.csv`` and, over one or two axes, a figure of each quantity into the folder."""
    for name, save in (
        ("sweep.nc", lambda path: found.to_netcdf(path, engine="h5netcdf")),
        ("table.csv", lambda path: write_table(found, path)),
    ):
        draft = folder.path / f"{name}{DRAFT}"
        save(draft)
        draft.replace(folder.path / name)
    if found["status"].dims == ("point",) or found["status"].ndim > 2:
        return
    figures = folder.path / "figures"
    figures.mkdir(exist_ok=True)
    for quantity in map(str, found.data_vars):
        sampled = any(str(dim).startswith("time of") for dim in found[quantity].dims)
        if quantity not in ("status", "reason", "engine") and not sampled:
            save_figure(plot_sweep(found, quantity), figures, quantity)


@contextlib.contextmanager
def kept_in(path: Path) -> Iterator[None]:
    """Turn a fault of the folder of a sweep, such as a full disk, into `SweepError`."""
    try:
        yield
    except OSError as error:
        remedy = f"Finished points stay in {str(path)!r}. The same command goes on, once it can be written to."
        raise SweepError(f"the folder cannot be written: {error}", remedy=remedy) from error


def _size_of(path: Path) -> int | None:
    """Return the points in a chunk of the sweep that a folder holds, or None."""
    if not (path / CONTENT).exists():
        return None
    size = Folder(path).content.get("chunk")
    return size if isinstance(size, int) and size > 0 else None


def _size(made: Sweep, workers: int) -> int:
    """Return how many points make a chunk, from the time of the first one; 1 where a worker hangs or dies on it."""
    if made.batch is not None:
        spent = made.batch.seconds
    elif workers == 0:
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
    status = np.array([each.status for each in rows], np.int8)
    engine = np.full(len(rows), ENGINES.index("run"), np.int8)
    return Chunk(first, status, tuple(each.reason for each in rows), tables, engine)


def _computed(made: Sweep, firsts: Sequence[int], size: int, workers: int) -> Iterator[Chunk]:
    """Give the chunks that begin at certain points, in this process or in workers."""
    count = made.points.count
    if firsts and made.batch is not None:
        yield from _batched(made, made.batch, firsts, size, workers)
        return
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
    alone = _alone(made, [number for first, last in lost for number in range(first, last)], workers)
    for first, last in lost:
        yield chunk_of(first, [alone[number] for number in range(first, last)], made.wanted)


def _alone(made: Sweep, numbers: Sequence[int], workers: int) -> dict[int, Row]:
    """Return the results of points by their numbers, each run on its own in a worker."""
    rows: dict[int, Row] = {}
    jobs = [(number, number + 1) for number in numbers]
    for outcome in outcomes(
        _in_worker, jobs, workers=workers, limit=POINT_LIMIT_S, initializer=_begin, initargs=(made,)
    ):
        answered = outcome.status == "answered"
        status = "hung" if outcome.status == "hung" else "crashed"
        rows[outcome.job[0]] = outcome.value[0] if answered else missing(made, status, outcome.value)
    return rows


def _batched(made: Sweep, batch: Batch, firsts: Sequence[int], size: int, workers: int) -> Iterator[Chunk]:
    """Give the chunks that begin at certain points, marched by a batch; points that it leaves are run on their own."""
    waiting: list[Found] = []
    for found in batch.chunks(firsts, size, workers):
        if workers > 0 and not found.served.all():
            waiting.append(found)
        else:
            yield _completed(found, {number: row(made, number) for number in found.left})
    rows = _alone(made, [number for found in waiting for number in found.left], workers) if waiting else {}
    for found in waiting:
        yield _completed(found, rows)


def _completed(found: Found, rows: Mapping[int, Row]) -> Chunk:
    """Return the chunk of points of a batch, with the rows of those that it left."""
    status = np.full(len(found.served), STATUSES.index("completed"), np.int8)
    reason = [""] * len(status)
    for number in found.left:
        place, own = number - found.first, rows[number]
        status[place], reason[place] = own.status, own.reason
        for table, given in zip(found.values, own.values, strict=True):
            table[place] = given
    engine = np.where(found.served, ENGINES.index("batch"), ENGINES.index("run")).astype(np.int8)
    return Chunk(found.first, status, tuple(reason), found.values, engine)


_made: list[Sweep] = []  # of a worker process


def _begin(made: Sweep) -> None:
    _made[:] = [made]


def _spent_in_worker(_: int) -> float:
    return _spent(_made[0])


def _in_worker(job: tuple[int, int]) -> list[Row]:
    return [row(_made[0], number) for number in range(*job)]
