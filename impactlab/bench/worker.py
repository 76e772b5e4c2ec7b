"""The jobs of a worker process: run, reference, times.

A worker runs a cell, finds its reference, or times it. It writes no file to the store.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from impactlab import api
from impactlab.bench.cells import Job
from impactlab.bench.references import References
from impactlab.bench.rows import row_of
from impactlab.bench.timing import settle, times_of
from impactlab.casefile import Case
from impactlab.casefile.case import case_of
from impactlab.casefile.document import parse_yaml
from impactlab.jobs.sources import code_hash
from impactlab.simulate import driver

WARM_UP = """
schema_version: 1
bodies:
  hammer: {kind: mass, mass: 1.0, velocity: 1.0}
  rod: {kind: rod, length: 1.0, area: 1.0, material: {young: 1.0, density: 1.0}, ends: {right: clamped}}
contacts: [{between: [hammer, rod.left], law: {kind: addition_deletion}}]
solve: {duration: {round_trips: 0.6}, model: {kind: modal, modes: 2}, integrator: {kind: exact_modal}}
"""


_references = References()  # of the bench of this process
_read: tuple[Job, Case] | None = None  # the last job and its case: jobs come scene by scene


def warm_up() -> None:
    """Run each loop once, so that compiled code is on disk.

    It is needed by several workers afterwards.
    """
    case = case_of("warm_up", "", parse_yaml(WARM_UP))
    for setting in (("solve.events", "dated"), ("solve.events", "located"), ("solve.model", {"kind": "continuous"})):
        driver.run(*case.with_settings([setting]).simulation())


def start(session: Path | None, code: str) -> None:
    """Prepare this process for `row`, `reference` and `times`.

    Raises `RuntimeError` for sources other than those of the owner.
    """
    global _references
    if code_hash() != code:
        raise RuntimeError("impactlab's sources changed while the bench ran. Start it again.")
    _references = References(session)


def _case(job: Job) -> Case:
    """Return the case of a job, read again when a job of another scene comes."""
    global _read
    if _read is None or (_read[0].file, _read[0].document) != (job.file, job.document):
        _read = (job, case_of(job.name, job.file, job.document))
    return _read[1]


def row(job: Job) -> dict[str, Any]:
    """Return the record of a cell; see `rows.row_of`."""
    return row_of(_case(job), job.method, job.settings, _references)


def reference(job: Job) -> None:
    """Find the reference of a cell and keep it.

    It is kept in the folder that the workers of this bench share.
    """
    _references.of(*api.physics_of(_case(job).solved_by(job.method, job.settings)))


def times(job: Job, repeats: int) -> dict[str, Any]:
    """Return the cost of a cell; see `timing.times_of`."""
    settle()
    return times_of(_case(job).solved_by(job.method, job.settings), repeats)
