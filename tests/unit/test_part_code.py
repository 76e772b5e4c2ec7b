"""Code of parts: intermediate code that callers take in, on disk too; machine code only where it is asked for."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tests.support import ROOT

CODE = """
import sys
from impactlab.numerics.compiling import ENTRY, HELPER, MERGED, PART

@PART
def squared(x):
    return x * x

@MERGED
def shifted(x, by):
    return squared(x) + by

@HELPER
def called_from_both(x):
    return shifted(x, 0.5)

@ENTRY
def first(x):
    return shifted(x, 1.0) + called_from_both(x)

@ENTRY
def second(x):
    return 2.0 * shifted(x, 3.0)

def waits(function):
    return [found.library._waits for found in function.overloads.values()]

entry = {"first": first, "second": second}[sys.argv[1]]
print(entry(3.0), called_from_both(2.0))
print(waits(shifted), waits(called_from_both), sum(shifted.stats.cache_hits.values()))
"""


def run(folder: Path, entry: str) -> list[str]:
    (folder / "code.py").write_text(CODE, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(folder / "kernels")}
    environment.pop("NUMBA_DISABLE_JIT", None)
    command = [sys.executable, str(folder / "code.py"), entry]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.split("\n")


def test_a_part_has_no_machine_code_and_from_disk_serves_another_caller(tmp_path: Path) -> None:
    """One that Python calls has machine code.

    Of the second process the entry comes from disk, the third compiles another one with the part from disk.
    """
    assert run(tmp_path, "first")[:2] == ["19.5 4.5", "[True] [False] 0"]
    assert run(tmp_path, "first")[:2] == ["19.5 4.5", "[] [False] 0"]
    assert run(tmp_path, "second")[:2] == ["24.0 4.5", "[True] [False] 1"]
