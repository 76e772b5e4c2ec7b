"""Sweeps: all points of a case, in this process or in several, continued after an interruption."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from impactlab.casefile import Case
from impactlab.casefile.case import expect_case
from impactlab.errors import CaseError, DoubtfulResult, ImpactlabError, SweepError, expect_whole
from impactlab.jobs.files import whole
from impactlab.measurement.inputs import warn
from impactlab.report.facts import joined_in
from impactlab.report.provenance import of_case
from impactlab.scene.problem import Scene
from impactlab.sweeps import axes
from impactlab.sweeps.axes import Points
from impactlab.sweeps.chunks import CONTENT, Chunk, Folder, opened, refuse_folder
from impactlab.sweeps.cluster import connected
from impactlab.sweeps.engines import computed, size_of_chunk
from impactlab.sweeps.interrupts import remembered
from impactlab.sweeps.page import write_page
from impactlab.sweeps.points import Sweep, origin_of
from impactlab.sweeps.quantities import DEFAULT, one_by_one, quantities_of
from impactlab.sweeps.result import Result, counts, first_reason, needed, refuse_large, write_table
from impactlab.sweeps.sampled import Sampled, check_channel, check_sampled, extreme_in
from impactlab.sweeps.shards import Shard, read_shard
from impactlab.types import Progress

if TYPE_CHECKING:
    import xarray

Engine = Callable[[Sequence[int], int], Iterator[Chunk]]
"""Gives the chunks of so many points that begin at certain ones."""
MAX_WORKERS = 1024


def sweep(
    case: Case,
    over: Mapping[str, Iterable[Any]] | None = None,
    *,
    points: Mapping[str, Iterable[Any]] | Points | None = None,
    quantities: Sequence[str | Sampled] = DEFAULT,
    workers: int = 0,
    out: str | Path | None = None,
    shard: str | tuple[int, int] | None = None,
    cluster: str | None = None,
    progress: Progress | None = None,
    command: str = "",
    repeat: str = "impactlab run case.yaml",
) -> xarray.Dataset:
    """Return quantities of a case at many points, as one labelled dataset.

    Parameters
    ----------
    case : Case
        The case; a method and a variant may have been chosen.
    over : mapping
        Axes of a grid: dotted path to values, as a case file would hold them; ``method`` takes names of methods.
    points : mapping, optional
        In place of ``over``: columns of listed points, dotted path to one value per point. `Points` are taken as they
        are: one that the case refuses has the status ``refused``.
    quantities : sequence
        Names of quantities (`impactlab plugins` lists them), extremes of channels such as
        ``max(stress:rod@0.15)``, and `Sampled` channels.
    workers : int
        Processes, each with a time limit for a run; 0 runs in this one, without a limit.
    out : path, optional
        Folder that keeps finished points: a sweep that was interrupted goes on there. It also gets ``sweep.nc``,
        ``table.csv`` and the page ``index.html``.
    shard : str or (int, int), optional
        ``"3/40"``: only the third of 40 equal parts, whose points are kept in ``out``; several programs may compute
        other parts at the same time. A last call without it collects them.
    cluster : str, optional
        Where to compute, in place of ``workers``: ``"tcp://HOST:PORT"`` of a Dask scheduler, or ``"local:2"`` for two
        processes of this machine under one. It needs the extra ``cluster``.
    progress : callable, optional
        Called with the fraction done, from 0 to 1.
    command, repeat : str
        For the page: the command that repeats the sweep, and the one that runs its case, to which the settings of a
        point are added.

    Warns
    -----
    DoubtfulResult
        If every point was refused or failed, with the first reason.

    Raises
    ------
    CaseError, PairingError, PluginError
        Before the first run: a path, a value or a quantity is wrong, or the folder holds something else. A run that is
        refused or fails later is a point with ``status`` and ``reason``; its quantities are NaN.
    SweepError
        If points can no longer be kept or computed; those that were are in the folder.
    """
    expect_case(case, "sweep")
    needed()
    if (over is None) == (points is None):
        remedy = "Give one of the two: over or points (--over PATH=VALUES or --points FILE.csv)."
        raise CaseError("a sweep takes axes or listed points", remedy=remedy)
    expect_whole(workers, "workers", 0, MAX_WORKERS)
    part = None if shard is None else read_shard(shard)
    path = None if out is None else Path(out)
    if path is None and part is not None:
        text = f"shard {shard} has no folder, in which all shards of the sweep come together"
        raise CaseError(text, path="--shard", remedy="Give the folder of all shards with --out.")
    if cluster is not None and workers:
        text = f"{workers} workers of this machine are given, and the cluster {cluster}, which has its own"
        raise CaseError(text, path="--workers", remedy="Give one of the two.")
    made = _made_of(case, over, points, quantities, path)
    content = made.content(command)
    if path is not None:
        refuse_folder(path, content, part)
    with contextlib.ExitStack() as stack:
        engine: Engine = partial(computed, made, workers=workers)
        content["chunk"] = None if path is None else _size_of(path)
        if cluster is not None:
            reached = stack.enter_context(connected(cluster, made, content["plugins"]))
            engine, content["chunk"] = reached.chunks, content["chunk"] or reached.size()
        content["chunk"] = content["chunk"] or size_of_chunk(made, workers)
        if path is None:
            return _with_values(_filled(Result(content), engine, None, None, progress).dataset())
        stack.enter_context(kept_in(path))
        folder = stack.enter_context(opened(path, content, part))
        result = Result(folder.content)
        for chunk in folder.chunks():
            result.add(chunk)
        missing = np.count_nonzero(result.status == 0)
        _filled(result, engine, folder, part, progress)
        found = result.dataset()
        if part is None and (missing or not (path / "index.html").exists()):
            write(folder, found, made, command, repeat)
        return _with_values(found)


def _with_values(found: xarray.Dataset) -> xarray.Dataset:
    """Return a sweep; issue a `DoubtfulResult` if every point was refused or failed."""
    reason = first_reason(found)
    if reason and set(counts(found)) <= {"refused", "failed", "hung", "crashed"}:
        warn(f"no point of the sweep has values. The first: {reason}", DoubtfulResult)
    return found


def _made_of(
    case: Case,
    over: Mapping[str, Iterable[Any]] | None,
    points: Mapping[str, Iterable[Any]] | Points | None,
    quantities: Sequence[str | Sampled],
    path: Path | None,
) -> Sweep:
    """Return a sweep whose axes and quantities are checked; those that its folder holds were."""
    known = None
    if path is not None and (path / CONTENT).exists():
        before, now = Folder(path).content, json.loads(json.dumps(origin_of(case)))
        if all(before.get(name) == value for name, value in now.items()):
            known = {axis["path"]: axis for axis in before["axes"]}
    if isinstance(points, Points):
        grid = points
    elif over is not None:
        grid = axes.grid(case, over, known)
    else:
        grid = axes.listed(case, {} if points is None else points, known)
    ends = []
    for number in {0, grid.count - 1}:
        with contextlib.suppress(ImpactlabError):
            ends.append(grid.case(case, number).simulation())
    run = (ends or [case.simulation()])[0]
    for each in one_by_one(quantities):
        if isinstance(each, Sampled):
            check_sampled(each, *run, max(scene.duration for scene, _ in (ends or [run])))
        elif (extreme := extreme_in(each)) and extreme.along(run[0]) is None:
            check_channel(extreme.channel, *run)
    wanted = quantities_of(run.scene, quantities, case.registry, _others(case, grid))
    refuse_large(grid.count, [each.size for each in wanted])
    return Sweep(case, grid, wanted)


def _others(case: Case, grid: Points) -> list[Scene]:
    """Return scenes of each method, block or whole number, in which bodies and contacts may differ."""
    changing = [axis for axis in grid.axes if not axis.is_numeric or axes.takes_whole(case, axis.path)]
    if grid.listed:
        firsts: dict[str, int] = {}
        for number in range(grid.count if changing else 0):
            firsts.setdefault(repr([axis.values[number] for axis in changing]), number)
        settings = [grid.settings(number) for number in firsts.values()]
    else:
        distinct = [(axis.path, {repr(value): value for value in axis.values}.values()) for axis in changing]
        settings = [{**grid.settings(0), path: value} for path, values in distinct for value in values]
    found = []
    for each in settings:
        with contextlib.suppress(ImpactlabError):
            found.append(axes.at_point(case, each).scene())
    return found


def _filled(
    result: Result, engine: Engine, folder: Folder | None, shard: Shard | None, progress: Progress | None
) -> Result:
    """Return the result with its missing points, each chunk kept at once."""
    size = result.content["chunk"]
    chunks = [k for k in range(math.ceil(result.status.size / size)) if shard is None or shard.has(k)]
    firsts = [k * size for k in chunks if not result.status[k * size]]
    done = len(chunks) - len(firsts)
    try:
        with remembered() as raise_if_pressed:
            for chunk in engine(firsts, size):
                _keep(chunk, result, folder)
                done += 1
                if progress is not None:
                    progress(done / len(chunks))
                raise_if_pressed()
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted: {kept_words(result, folder)}") from None
    except SweepError as error:
        error.remedy = error.remedy or kept_words(result, folder)
        raise
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
    """Return the last message of a sweep that ended early.

    They are how many points a folder keeps, and how to go on.
    """
    if folder is None:
        return "no point is kept. Give a folder with --out to keep finished ones."
    if not folder.path.is_dir():
        return "The folder has been removed. The same command starts the sweep again."
    text = f"{np.count_nonzero(result.status)} of {result.status.size} points are kept in {str(folder.path)!r}."
    return f"{text} The same command computes the others."


def write(folder: Folder, found: xarray.Dataset, made: Sweep, command: str, repeat: str) -> None:
    """Write ``sweep.nc``, ``table.csv`` and the page with its figures into the folder."""
    with whole(folder.path / "sweep.nc") as draft:
        found.to_netcdf(draft, engine="h5netcdf")
    with whole(folder.path / "table.csv") as draft:
        write_table(found, draft)
    scene, method = made.case.simulation()
    write_page(folder.path, found, scene, of_case(made.case, command), repeat, joined_in(scene, method))


@contextlib.contextmanager
def kept_in(path: Path) -> Iterator[None]:
    """Turn a fault of the folder of a sweep, as a full disk, into `SweepError`."""
    try:
        yield
    except OSError as error:
        remedy = f"Finished points stay in {str(path)!r}. The same command continues once the folder can be written to."
        raise SweepError(f"the folder cannot be written: {error}", remedy=remedy) from error


def _size_of(path: Path) -> int | None:
    """Return the points in a chunk of the sweep that a folder holds, or None."""
    if not (path / CONTENT).exists():
        return None
    size = Folder(path).content.get("chunk")
    return size if isinstance(size, int) and size > 0 else None
