"""docs/compiled-code.md: how long compiling from nothing takes, this tree beside an older one.

    python benchmarks/compiling.py --before DIR --out docs/compiled-code.md

Each command runs twice in new processes, with a folder for compiled code that is empty before the first command. Time
of a processor: what the first process takes longer than the second, both without helpers. Wall time: the stage
"compiling" of the first process, alone and with a helper on each further processor.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from tables import page, table
from wall_time import commit_of

from impactlab.bench.environment import processor

ROOT = Path(__file__).resolve().parents[1]
COMMANDS = {
    "step loop and exact march: `run axial_impact`": "axial_impact",
    "a law that yields, many contacts: `run smith_pile` after it": "smith_pile",
    "a mechanism: `run two_link_arm` after both": "two_link_arm",
}


def run(tree: Path, case: str, folder: Path, compilers: int | None) -> tuple[float, float]:
    """Return processor time [s] and compiling wall time [s] of a new process.

    The process runs ``case``; the second time is that of the stage "compiling".
    """
    given = os.environ | {"PYTHONPATH": str(tree), "NUMBA_CACHE_DIR": str(folder)}
    given.pop("IMPACTLAB_COMPILERS", None)
    if compilers is not None:
        given["IMPACTLAB_COMPILERS"] = str(compilers)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-m", "impactlab", "run", case, "--json"],
        env=given, cwd=folder, check=True, capture_output=True, text=True,
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    wall = json.loads(done.stdout).get("cost", {}).get("wall_time", {})
    return spent, wall.get("compiling", float("nan"))


def measured(before: Path) -> list[list[str]]:
    """Return a row for each command, and one of their sums."""
    columns: list[list[float]] = [[], [], [], []]
    for number, (tree, compilers) in enumerate(((before, 1), (ROOT, 1), (ROOT, None))):
        with tempfile.TemporaryDirectory() as folder:
            for case in COMMANDS.values():
                first, wall = run(tree, case, Path(folder), compilers)
                if number < 2:
                    again, _ = run(tree, case, Path(folder), compilers)
                    columns[number].append(first - again)
                if number > 0:
                    columns[number + 1].append(wall)
    for column in columns:
        column.append(sum(column))
    return [
        [name, *(f"{column[number]:.1f}" for column in columns)] for number, name in enumerate([*COMMANDS, "in all"])
    ]


def written(before: Path) -> str:
    """Return the page."""
    titles = ["kernels", "processor before, s", "processor, s", "wall alone, s", "wall with helpers, s"]
    filled = {
        "machine": f"{os.cpu_count()} processors of {processor()}, Python {platform.python_version()}",
        "commit": commit_of(before),
        "compiled": table(titles, measured(before), ["kernels"]),
    }
    return page("compiled-code.head.md", filled)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", type=Path, required=True, help="checkout of an older tree")
    parser.add_argument("--out", type=Path, help="page to write; without it the page is printed")
    given = parser.parse_args()
    text = written(given.before.resolve())
    given.out.write_text(text, encoding="utf-8") if given.out else print(text)


if __name__ == "__main__":
    main()
