"""What a worker process does: take a job, answer a record. It writes nothing to the store."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable
from multiprocessing import parent_process
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from impactlab import api
from impactlab.bench.cells import Job
from impactlab.bench.keys import code_hash
from impactlab.bench.references import References
from impactlab.bench.rows import row_of
from impactlab.bench.timing import settle, times_of
from impactlab.casefile import Case
from impactlab.casefile.case import case_of
from impactlab.casefile.document import parse_yaml
from impactlab.simulate import driver

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
PR_SET_PDEATHSIG = 1  # of prctl(2)
WARM_UP = """
schema_version: 1
bodies:
  hammer: {kind: mass, mass: 1.0, velocity: 1.0}
  rod: {kind: rod, length: 1.0, area: 1.0, material: {young: 1.0, density: 1.0}, ends: {right: clamped}}
contacts: [{between: [hammer, rod.left], law: {kind: addition_deletion}}]
solve: {duration: {round_trips: 0.6}, model: {kind: modal, modes: 2}, integrator: {kind: exact_modal}}
"""


class Worker:
    """The state of a worker: the case at hand and the references of the bench."""

    def __init__(self, session: Path | None) -> None:
        self.references = References(session)
        self._read: tuple[Job, Case] | None = None

    def case(self, job: Job) -> Case:
        """Return the case of a job; kept until a job of another scene comes."""
        if self._read is None or (self._read[0].scene, self._read[0].document) != (job.scene, job.document):
            self._read = (job, case_of(job.name, job.file, job.document))
        return self._read[1]

    def row(self, job: Job) -> dict[str, Any]:
        """Return the record of a cell; see `rows.row_of`."""
        return row_of(self.case(job), job.method, job.settings, self.references)

    def reference(self, job: Job) -> None:
        """Find what a cell is measured against, where the workers of this bench share it."""
        self.references.of(api.physics_of(self.case(job).solved_by(job.method, job.settings)))

    def times(self, job: Job, repeats: int) -> dict[str, Any]:
        """Return what a cell costs; see `timing.times_of`."""
        settle()
        return times_of(self.case(job).solved_by(job.method, job.settings), repeats)


def warm_up() -> None:
    """Run each loop once, so that what numba compiles is on disk before several workers ask for it."""
    case = case_of("warm_up", "", parse_yaml(WARM_UP))
    for setting in (("solve.events", "dated"), ("solve.events", "located"), ("solve.model", {"kind": "continuous"})):
        driver.run(case.with_settings([setting]).scene())


def serve(connection: Connection, session: Path | None, folder: str) -> None:
    """Answer what comes over a connection until it closes: ``(name, *arguments)`` of a method of `Worker`.

    The first answer is the hash of the sources that this process imports.
    """
    _follow()
    os.chdir(folder)
    with contextlib.redirect_stdout(sys.stderr):  # what a part prints may not get into a JSON document
        worker = Worker(session)
        known: dict[str, Callable[..., Any]] = {
            "reference": worker.reference,
            "row": worker.row,
            "times": worker.times,
            "warm_up": warm_up,
        }
        connection.send(code_hash())
        while True:
            try:
                name, *arguments = connection.recv()
            except (EOFError, OSError):
                return
            try:
                answer = (True, known[name](*arguments))
            except Exception as error:  # noqa: BLE001 - whatever it is, the owner says so
                answer = (False, f"{type(error).__name__}: {str(error)[:500]}")
            connection.send(answer)


def _follow() -> None:
    """End with the owner, also where it is killed: by a thread, and on Linux by the system, in the midst of a run."""

    def attend() -> None:
        owner = parent_process()
        if owner is not None:
            owner.join()
            os._exit(1)

    threading.Thread(target=attend, daemon=True).start()
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGKILL))
