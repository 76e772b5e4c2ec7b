"""A bench: find the missing rows, run and time them, write the table."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from impactlab.bench import table, worker
from impactlab.bench.cells import Cell, Job, cells
from impactlab.bench.environment import described, environment
from impactlab.bench.grid import Family
from impactlab.bench.keys import code_hash
from impactlab.bench.pool import Outcome, outcomes
from impactlab.bench.references import lose
from impactlab.bench.rows import VERSION, ended
from impactlab.bench.store import Store, opened
from impactlab.errors import CaseError
from impactlab.report.summary import has_numbers

Show = Callable[[str, float], None]
REFERENCE_LIMITS = 3.0  # times the limit of a row, to find what the rows of a scene are measured against


@dataclass(frozen=True)
class Options:
    """How a bench is run."""

    workers: int = 1  # processes; 0 for one per core
    repeats: int = 9  # of a timed run, at most
    timing: bool = True
    limit: float = 60.0  # s of a row

    @property
    def processes(self) -> int:
        """How many processes run rows; times are always taken by one alone."""
        return self.workers or os.cpu_count() or 1


class Bench(NamedTuple):
    """The result of a bench."""

    suite: str
    cells: list[Cell]
    records: dict[str, dict[str, Any]]
    times: dict[str, dict[str, Any]]
    new: int  # rows that this bench ran; the others were known

    @property
    def document(self) -> dict[str, Any]:
        """The document of ``bench --json``."""
        return table.document(self.suite, self.cells, self.records, self.times)

    @property
    def counts(self) -> dict[str, int]:
        """How many rows ended how."""
        found: dict[str, int] = {}
        for cell in self.cells:
            status = self.records[cell.key]["summary"]["status"]
            found[status] = found.get(status, 0) + 1
        return found


def bench(
    files: Sequence[Path],
    suite: str,
    families: Sequence[Family],
    out: Path,
    options: Options = Options(),
    methods: Sequence[str] | None = None,
    show: Show = lambda _label, _fraction: None,
    say: Callable[[str], None] = lambda _: None,
) -> Bench:
    """Run the missing rows of a grid of methods over cases, and write the table.

    Parameters
    ----------
    files : sequence of Path
        Case files.
    suite : str
        Name of the suite.
    families : sequence of Family
        The grid; see `grid.read_grid`.
    out : Path
        Folder of the rows and the table. Rows that are there already, by key, are not run again.
    options : Options
        Processes, repeats, limits.
    methods : sequence of str, optional
        Methods of the cases that join the grid; all if not given.
    show, say : callable
        Progress as (label, fraction); a line for people.

    Raises
    ------
    CaseError
        If a case cannot be read, no method serves any, or the folder is in use or somebody else's.
    """
    with opened(out) as store:
        found, jobs = cells(files, suite, families, methods)
        if not found:
            raise CaseError(
                "none of these methods serves any of these cases",
                remedy="Give other --methods or another --grid; own.NAME is method NAME of the cases.",
            )
        store.write("cells.json", json.dumps([cell._asdict() for cell in found], indent=1, ensure_ascii=False) + "\n")
        kept = {key: _kept(store, key, options) for key in jobs}
        records = {key: record for key, record in kept.items() if record is not None}
        missing = [job for key, job in jobs.items() if key not in records]
        say(f"{len(found)} rows of {len({(c.case, c.variant) for c in found})} scenes: {len(missing)} runs to do")
        _find_references(store, missing, options, show)
        _run(store, missing, records, options, show)
        times = _times(store, jobs, records, options, show, say)
        _write(store, found, records, times)
    return Bench(suite, found, records, times, len(missing))


def _kept(store: Store, key: str, options: Options) -> dict[str, Any] | None:
    """Return the row of a key if there is one that need not be run again.

    What hung is run again where it gets more time; what crashed, or lost its reference, always: the machine may have
    been short of memory.
    """
    record = store.get("rows", key)
    if record is None or record.get("version") != VERSION:
        return None
    status = record["summary"]["status"]
    if status == "crashed" or (record["reference"] or {}).get("lost"):
        return None
    return None if status == "hung" and record.get("limit", options.limit) < options.limit else record


def _find_references(store: Store, missing: Sequence[Job], options: Options, show: Show) -> None:
    """Find the references of the rows, each a job of its own, before any row is run.

    The rows read them from the folder of this bench; where one was lost to a kill or a crash it says so there.
    """
    first: dict[str, Job] = {}
    for job in missing:
        if job.reference is not None:
            first.setdefault(job.reference, job)
    asked = {job.key: key for key, job in first.items()}
    limit = REFERENCE_LIMITS * options.limit
    found = _outcomes(store, worker.reference, list(first.values()), options.processes, limit)
    for done, (job, status, value) in enumerate(found, 1):
        show(f"reference of {job.name}", done / len(first))
        if status != "answered":
            lose(store.session, asked[job.key], f"{status}: {value}")


def _outcomes(
    store: Store, function: Callable[[Job], Any], jobs: Sequence[Job], workers: int, limit: float
) -> Iterator[Outcome[Job]]:
    """Give the outcome of each job, run by worker processes that share a folder."""
    return outcomes(
        function,
        jobs,
        workers=workers,
        limit=limit,
        initializer=worker.start,
        initargs=(store.session, code_hash()),
        warm_up=worker.warm_up,
    )


def _run(
    store: Store, missing: Sequence[Job], records: dict[str, dict[str, Any]], options: Options, show: Show
) -> None:
    found = _outcomes(store, worker.row, missing, options.processes, options.limit)
    for done, (job, status, value) in enumerate(found, 1):
        if status == "answered":
            record: dict[str, Any] = value
        else:
            record = ended(job.name, "crashed" if status == "raised" else status, str(value), options.limit)
        store.put("rows", job.key, record)
        records[job.key] = record
        show(f"{job.name} {job.method}", done / len(missing))


def _times(
    store: Store,
    jobs: Mapping[str, Job],
    records: Mapping[str, Mapping[str, Any]],
    options: Options,
    show: Show,
    say: Callable[[str], None],
) -> dict[str, dict[str, Any]]:
    """Return the times of all completed rows by key; taken one after another by one process, and nothing beside it."""
    known = {key: store.get("times", key) for key, record in records.items() if _completed(record)}
    machine = environment()["machine"]
    times = {key: found for key, found in known.items() if found is not None and found.get("machine") == machine}
    missing = [jobs[key] for key in known if key not in times]
    if not options.timing or not missing:
        return times
    say(f"{len(missing)} rows to time, one after another")
    # A run is repeated: several of them may take as long as several rows.
    limit = (options.repeats + 2) * options.limit
    found = _outcomes(store, partial(worker.times, repeats=options.repeats), missing, 1, limit)
    for done, (job, status, value) in enumerate(found, 1):
        show(f"timing {job.name} {job.method}", done / len(missing))
        if status != "answered":
            say(f"{job.name} {job.method}: not timed, {status}: {value}")
            continue
        times[job.key] = {**value, "machine": machine}
        store.put("times", job.key, times[job.key])
    return times


def _completed(record: Mapping[str, Any]) -> bool:
    return has_numbers(record["summary"]["status"])


def _write(
    store: Store,
    found: Sequence[Cell],
    records: Mapping[str, Mapping[str, Any]],
    times: Mapping[str, Mapping[str, Any]],
) -> None:
    references: dict[str, Any] = {}
    for cell in found:
        told = records[cell.key]["reference"]
        if told is not None:
            references.setdefault(f"{cell.case}/{cell.variant}", told)
    store.write("references.json", json.dumps(references, indent=1, sort_keys=True, ensure_ascii=False) + "\n")
    store.write("environment.json", json.dumps(described(), indent=1, ensure_ascii=False) + "\n")
    store.write("table.csv", table.as_csv(table.rows(found, records, times)))
