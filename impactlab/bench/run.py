"""A bench: run and time the missing rows, write the table."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from impactlab.bench import table, worker
from impactlab.bench.cells import Cell, Job, cells, laws_left_out
from impactlab.bench.environment import described, environment
from impactlab.bench.grid import Family
from impactlab.bench.places import places_of
from impactlab.bench.references import lose
from impactlab.bench.rows import VERSION, ended
from impactlab.bench.store import Store, opened
from impactlab.errors import CaseError
from impactlab.jobs.process_pool import Outcome, outcomes
from impactlab.jobs.sources import code_hash
from impactlab.printing import counted
from impactlab.report.summary import has_numbers

Show = Callable[[str, float], None]
Records = dict[str, dict[str, Any]]  # by key of the row
REFERENCE_LIMITS = 3.0  # times the limit of a row: the limit of the search for the reference of a scene


@dataclass(frozen=True)
class Options:
    """How a bench is run."""

    workers: int = 1  # processes that run rows; 0 for one per core; times are always taken by one alone
    repeats: int = worker.MAX_REPEATS  # of a timed run, at most
    timing: bool = True
    limit: float = 60.0  # s of a row


class Bench(NamedTuple):
    """The result of a bench."""

    suite: str
    cells: list[Cell]
    records: Records
    times: Records
    new: int  # rows that this bench ran; the others were known
    places: table.Places  # of the faults of rows without a result

    @property
    def document(self) -> dict[str, Any]:
        """The document of ``bench --json``."""
        return table.document(self.suite, self.cells, self.records, self.times, self.places)

    @property
    def first_reason(self) -> str:
        """Why the first row without a result has none; empty if all have one."""
        for cell in self.cells:
            error = self.records[cell.key]["summary"].get("error") or {}
            if error.get("text"):
                words = (str(self.places.get(cell.row_id, "")), f"method {cell.method}", error["path"], error["text"])
                return ": ".join(filter(None, words))
        return ""

    @property
    def counts(self) -> Counter[str]:
        """The number of rows by status."""
        return Counter(self.records[cell.key]["summary"]["status"] for cell in self.cells)


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
        If a case cannot be read, no method applies to any, or the folder is in use or somebody else's.
    """
    with opened(out) as store:
        found, jobs = cells(files, suite, families, methods)
        if not found:
            raise CaseError(
                "none of these methods applies to any of these cases",
                remedy="Give other --methods or another --grid; own.NAME is method NAME of the cases.",
            )
        store.write_json("cells.json", [cell._asdict() for cell in found])
        kept = {key: _kept(store, key, options) for key in jobs}
        records = {key: record for key, record in kept.items() if record is not None}
        missing = [job for key, job in jobs.items() if key not in records]
        scenes = len({(c.case, c.variant) for c in found})
        say(f"{len(found)} rows of {counted(scenes, 'scene')}: {len(missing)} runs to do")
        for text in laws_left_out(found, families, suite):
            say(text)
        _find_references(store, missing, options, show)
        records |= _run(store, missing, options, show)
        times = _times(store, jobs, records, options, show, say)
        store.write_json("references.json", table.references(found, records), sort_keys=True)
        store.write_json("environment.json", described())
        store.write("table.csv", table.as_csv(table.rows(found, records, times)))
    return Bench(suite, found, records, times, len(missing), places_of(files, found, records))


def _kept(store: Store, key: str, options: Options) -> dict[str, Any] | None:
    """Return the row of a key that need not be run again.

    None if there is no such row. A row that hung is run again under a longer limit; one that crashed, or whose
    reference was lost, always: the machine may have been short of memory.
    """
    record = store.get("rows", key)
    if record is None or record.get("version") != VERSION:
        return None
    status = record["summary"]["status"]
    if status == "crashed" or (record["reference"] or {}).get("lost"):
        return None
    return None if status == "hung" and record.get("limit", options.limit) < options.limit else record


def _outcomes(
    store: Store, function: Callable[[Job], Any], jobs: Sequence[Job], workers: int, limit: float
) -> Iterator[tuple[float, Outcome[Job]]]:
    """Yield the fraction done and the outcome of each job.

    Worker processes that share the session folder run the jobs.
    """
    found = outcomes(
        function,
        jobs,
        workers=workers or os.cpu_count() or 1,
        limit=limit,
        initializer=worker.start,
        initargs=(store.session, code_hash()),
        warm_up=worker.warm_up,
    )
    return ((done / len(jobs), outcome) for done, outcome in enumerate(found, 1))


def _find_references(store: Store, missing: Sequence[Job], options: Options, show: Show) -> None:
    """Find the references of the rows before any row is run.

    Each is a job of its own. The rows read them from the folder of this bench, or there the reason why one was lost.
    """
    first: dict[str, Job] = {}
    for job in missing:
        if job.reference is not None:
            first.setdefault(job.reference, job)
    jobs, limit = list(first.values()), REFERENCE_LIMITS * options.limit
    for done, (job, status, value) in _outcomes(store, worker.reference, jobs, options.workers, limit):
        show(f"reference of {job.name}", done)
        if status != "done" and job.reference is not None:
            lose(store.session, job.reference, f"{status}: {value}")


def _run(store: Store, missing: Sequence[Job], options: Options, show: Show) -> Records:
    """Run rows and return their records by key."""
    records: Records = {}
    for done, (job, status, value) in _outcomes(store, worker.row, missing, options.workers, options.limit):
        lost = "crashed" if status == "raised" else status
        record = value if status == "done" else ended(job.name, lost, str(value), options.limit)
        store.put("rows", job.key, record)
        records[job.key] = record
        show(f"{job.name} {job.method}", done)
    return records


def _times(
    store: Store, jobs: Mapping[str, Job], records: Records, options: Options, show: Show, say: Callable[[str], None]
) -> Records:
    """Return the times of all completed rows by key, taken by one process alone."""
    completed = [key for key, record in records.items() if has_numbers(record["summary"]["status"])]
    machine = environment()["machine"]
    known = {key: store.get("times", key) for key in completed}
    times = {key: found for key, found in known.items() if found is not None and found.get("machine") == machine}
    missing = [jobs[key] for key in completed if key not in times]
    if not options.timing or not missing:
        return times
    say(f"{len(missing)} rows to time, one after another")
    # A run is repeated: several of them may take as long as several rows.
    timed, limit = partial(worker.times, repeats=options.repeats), (options.repeats + 2) * options.limit
    for done, (job, status, value) in _outcomes(store, timed, missing, 1, limit):
        show(f"timing {job.name} {job.method}", done)
        if status == "done":
            times[job.key] = {**value, "machine": machine}
            store.put("times", job.key, times[job.key])
        else:
            say(f"{job.name} {job.method}: not timed, {status}: {value}")
    return times
