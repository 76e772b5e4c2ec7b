"""Whatever a case holds, it is accepted or refused: no other exception, no hang, no death, within 1 s and 200 MB.

Time is that of the processor; memory is by how much the resident memory of the process grows at most while a mutant is
answered, as Linux counts it (VmHWM, set back before each).
"""

from __future__ import annotations

import os

import pytest

from tests.fuzz.fuzz import Row, fuzz

LARGEST_MB = 200.0
COUNT = int(os.environ.get("IMPACTLAB_MUTANTS", "200"))
SEED = int(os.environ.get("IMPACTLAB_MUTANTS_SEED", "20"))


def escaped(rows: list[Row]) -> list[Row]:
    """Return the rows of mutants that were neither accepted nor refused."""
    return [row for row in rows if row["outcome"] not in ("accepted", "refused")]


@pytest.mark.slow
def test_mutants_are_accepted_or_refused() -> None:
    """All were answered, in little memory, and both answers occur."""
    rows = fuzz(SEED, COUNT, jobs=1)
    assert [row["number"] for row in rows] == list(range(COUNT))
    assert not escaped(rows), escaped(rows)[0]
    assert max(row["megabytes"] for row in rows) <= LARGEST_MB
    assert {row["outcome"] for row in rows} == {"accepted", "refused"}


@pytest.mark.slow
def test_mutants_run_or_fail_with_a_word() -> None:
    count = COUNT // 5
    rows = fuzz(SEED, count, jobs=1, runs=True)
    assert not escaped(rows), escaped(rows)[0]
