"""Chunks of a sweep computed in this process or in others, of which one that hangs or dies costs a point."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from impactlab.jobs.process_pool import outcomes
from impactlab.sweeps.batch import Batch, BatchResults
from impactlab.sweeps.chunks import ENGINES, STATUSES, Chunk
from impactlab.sweeps.points import PointResult, Sweep, chunk_of, missing, row

CHUNK_SECONDS = 0.5  # s, about, of the points that are computed and kept together
MAX_CHUNK = 10_000  # points
POINT_LIMIT_S = 60.0  # s, after which a run in a worker counts as hung


def size_of_chunk(made: Sweep, workers: int) -> int:
    """Return how many points make a chunk, from the time of the first one.

    It is 1 where a worker hangs or dies on it.
    """
    if made.batch is not None:
        spent = made.batch.seconds
    elif workers == 0:
        spent = spent_on_first(made)
    else:
        start: dict[str, Any] = {"initializer": _begin, "initargs": (made,)}
        [outcome] = outcomes(_spent_in_worker, [0], limit=2.0 * POINT_LIMIT_S, **start)
        spent = outcome.value if outcome.status == "done" else math.inf
    return points_in(spent)


def points_in(spent: float) -> int:
    """Return how many points make a chunk, from the time of one [s]."""
    return max(1, min(MAX_CHUNK, int(CHUNK_SECONDS / max(spent, 1e-6))))


def spent_on_first(made: Sweep) -> float:
    """Return the time of the first point [s], run again once compiled code is loaded."""
    spent = math.inf
    for _ in range(2):
        began = time.perf_counter()
        row(made, 0)
        spent = time.perf_counter() - began
        if spent > POINT_LIMIT_S:
            break
    return spent


def computed(made: Sweep, firsts: Sequence[int], size: int, workers: int) -> Iterator[Chunk]:
    """Yield the chunks that begin at certain points, in this process or in workers."""
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
        if outcome.status == "done":
            yield chunk_of(outcome.job[0], outcome.value, made.wanted)
        else:
            lost.append(outcome.job)
    # A worker that hung or died: each point of its chunk alone, so that one point is lost and not the chunk.
    alone = _alone(made, [number for first, last in lost for number in range(first, last)], workers)
    for first, last in lost:
        yield chunk_of(first, [alone[number] for number in range(first, last)], made.wanted)


def _alone(made: Sweep, numbers: Sequence[int], workers: int) -> dict[int, PointResult]:
    """Return the results of points by number, each run on its own in a worker."""
    rows: dict[int, PointResult] = {}
    jobs = [(number, number + 1) for number in numbers]
    for outcome in outcomes(
        _in_worker, jobs, workers=workers, limit=POINT_LIMIT_S, initializer=_begin, initargs=(made,)
    ):
        done = outcome.status == "done"
        status = "hung" if outcome.status == "hung" else "crashed"
        rows[outcome.job[0]] = outcome.value[0] if done else missing(made, status, outcome.value)
    return rows


def _batched(made: Sweep, batch: Batch, firsts: Sequence[int], size: int, workers: int) -> Iterator[Chunk]:
    """Yield the chunks that begin at certain points, marched by a batch.

    Points that it leaves are run on their own.
    """
    waiting: list[BatchResults] = []
    for found in batch.chunks(firsts, size, workers):
        if workers > 0 and not found.served.all():
            waiting.append(found)
        else:
            yield _completed(found, {number: row(made, number) for number in found.left})
    rows = _alone(made, [number for found in waiting for number in found.left], workers) if waiting else {}
    for found in waiting:
        yield _completed(found, rows)


def _completed(found: BatchResults, rows: Mapping[int, PointResult]) -> Chunk:
    """Return the chunk of points of a batch, with rows of those left."""
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
    return spent_on_first(_made[0])


def _in_worker(job: tuple[int, int]) -> list[PointResult]:
    return [row(_made[0], number) for number in range(*job)]
