"""Estimated memory of a scene from its sizes, and the limit on it.

It is checked before anything is allocated.

The numbers of bytes were measured, and rounded up. The limit is 2 GB for all that a run keeps; bodies in coordinates
may take a tenth of it, as every check builds them. ``IMPACTLAB_MEMORY`` sets another limit, in bytes.
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from impactlab.errors import CaseError
from impactlab.scene.problem import RECORDS

if TYPE_CHECKING:
    from impactlab.scene.problem import Scene

MEMORY = 2e9  # bytes
BUILT = 0.1  # of it, for the matrices and steppers of all bodies
FREE_MEMORY_CHECK = 1e8  # bytes, from which the free memory of the machine is read
FRAMES = 0.1  # of it, for the states at the frames of a run
PER_CELL = 14.0  # numbers a cell of a delay line or of a beam's characteristics
MIN_RECORDS = 100  # records of a run
BYTES = 8.0  # bytes
NUMBERS_OF_ROWS = 2.0**18  # in the records of rows of beads of a short run, unless their number is given: 2 MB
STEPS_A_RECORD = 32  # of rows of beads in a long run: a record takes as long as several steps


def memory_limit() -> float:
    """Return the most bytes that a run may take: 2e9, or the value of ``IMPACTLAB_MEMORY``."""
    given = os.environ.get("IMPACTLAB_MEMORY", "")
    if not given:
        return MEMORY
    try:
        limit = float(given)
    except ValueError:
        limit = math.nan
    if not 1e6 <= limit <= 1e15:
        raise CaseError(
            f"IMPACTLAB_MEMORY={given[:40]!r} is not a valid memory limit",
            remedy="Give a number of bytes, 1e6 to 1e15.",
        )
    return limit


def available_memory() -> float | None:
    """Return the free memory of the machine [bytes]; None where it is not known."""
    try:
        with Path("/proc/meminfo").open(encoding="ascii") as stream:
            for line in stream:
                if line.startswith("MemAvailable:"):
                    return 1024.0 * float(line.split()[1])
    except (OSError, ValueError, IndexError):
        pass
    try:
        return float(os.sysconf("SC_AVPHYS_PAGES")) * float(os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, OSError, ValueError):
        return None


def fits(numbers: float, share: float = BUILT) -> bool:
    """Return whether `check_memory` allows these numbers without asking the machine: then no text is made."""
    needed = BYTES * numbers
    return needed <= share * memory_limit() and needed <= FREE_MEMORY_CHECK


def check_memory(numbers: float, text: str, path: str, remedy: str, share: float = BUILT) -> None:
    """Raise `CaseError` where numbers of 8 bytes exceed a share of the memory.

    ``text`` says which they are, as in: ``400 elements of order 3``.
    """
    needed, allowed = BYTES * numbers, share * memory_limit()
    if not needed <= allowed:
        raise CaseError(
            f"{text} take about {in_bytes(needed)}. Allowed: {in_bytes(allowed)}",
            remedy=(
                f"{remedy} The limit of the whole run is {in_bytes(memory_limit())}; the environment "
                "variable IMPACTLAB_MEMORY, in bytes, sets another one."
            ),
            path=path,
        )
    if needed > FREE_MEMORY_CHECK and (free := available_memory()) is not None and needed > share * free:
        raise CaseError(
            f"{text} take about {in_bytes(needed)}, and this machine has {in_bytes(free)} free. Allowed: "
            f"{in_bytes(share * free)}",
            remedy=f"{remedy} Or end other programs.",
            path=path,
        )


def in_bytes(count: float) -> str:
    """Return a number of bytes for people: ``240 MB``."""
    for unit, size in (("GB", 1e9), ("MB", 1e6)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return f"{count / 1e3:.3g} kB"


def columns_of(scene: Scene) -> int:
    """Return the count of numbers in a record: time, contacts' six, probes, masses' position and velocity."""
    return 1 + 6 * len(scene.contacts) + len(scene.recorded_probes) + len(scene.own_channels)


def default_records(scene: Scene, most: int) -> int:
    """Return the default count of instants kept: ``most``, fewer for many bodies.

    Of many bodies it is as many as half the limit holds. The limit is that of 2 GB, whatever ``IMPACTLAB_MEMORY`` is,
    so that the same case keeps the same.
    """
    room = 0.5 * (1.0 - BUILT) * MEMORY / (2.0 * BYTES * columns_of(scene))
    return max(MIN_RECORDS, min(most, int(room)))


def keeps_default(scene: Scene) -> bool:
    """Return whether a scene keeps the default count of instants, which is smaller for many bodies."""
    return scene.records in (RECORDS, default_records(scene, RECORDS))


def kept_of_rows(scene: Scene, steps: int, columns: int) -> int:
    """Return the count of instants kept in a run with rows of beads.

    By default they are few, as a record costs more than a step. ``columns`` is how many numbers of a record are those
    of the rows.
    """
    if not keeps_default(scene):
        return scene.records
    return min(scene.records, max(MIN_RECORDS, steps // STEPS_A_RECORD, int(NUMBERS_OF_ROWS / columns)))


def check_records(scene: Scene, steps: float, more: int = 0) -> None:
    """Raise `CaseError` where the records of a run are too large.

    ``more`` numbers are recorded beside channels.
    """
    columns = columns_of(scene) + more
    kept = min(steps, float(scene.records)) + 1.0
    if fits(2.0 * kept * columns, 1.0 - BUILT):
        return
    fitting = int((1.0 - BUILT) * memory_limit() / (2.0 * BYTES * columns))
    remedy = f"Give {fitting} or fewer." if fitting >= MIN_RECORDS else "Give fewer bodies, contacts or probes."
    check_memory(2.0 * kept * columns, f"{kept:.3g} records of {columns} numbers", "solve.records", remedy, 1.0 - BUILT)


def check_fields(scene: Scene, state: int, unknowns: Mapping[str, int]) -> None:
    """Raise `CaseError` where snapshots or the rows of probes are too large."""
    taken = len(scene.snapshots)
    if not taken and not scene.recorded_probes:
        return
    rows = float(sum(unknowns.get(probe.body, 0) for probe in scene.recorded_probes))
    if fits(2.0 * taken * state + rows, 1.0 - BUILT):
        return
    check_memory(2.0 * taken * state, f"{taken} snapshots of {state} numbers", "snapshots", "Take fewer.", 1.0 - BUILT)
    check_memory(rows, f"{len(scene.probes)} probes", "probes", "Give fewer.", 1.0 - BUILT)


def with_room(scene: Scene, state: int) -> Scene:
    """Return the scene with as many frames as fit into a tenth of the memory."""
    if not scene.frames:
        return scene
    room = int(FRAMES * memory_limit() / (2.0 * BYTES * max(1, state)))
    if room == 0:
        return dataclasses.replace(scene, frames=())
    every = math.ceil(len(scene.frames) / room)
    return scene if every == 1 else dataclasses.replace(scene, frames=scene.frames[::every])


def check_cells(cells: float, name: str) -> None:
    """Raise `CaseError` where a step gives a self-stepping body too many cells."""
    check_memory(PER_CELL * cells, f"{cells:.3g} steps in the transit of '{name}'", "solve.step", "Give a longer step.")
