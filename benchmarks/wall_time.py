"""Where the wall time of five typical commands goes: this tree beside an older one, each command a process of its own.

    python benchmarks/wall_time.py [--before DIR] [--repeats 7]
    python benchmarks/wall_time.py --warm

Both trees run interleaved, kernels on disk; shown is the quickest process of each. This tree reports its stages itself
(`cost.wall_time`). An older one, which does not, is timed from outside: its functions are wrapped, and "start" is the
remainder. Columns: start (Python, libraries, compiled code read from disk, set-up), case (read and checked), solving,
checks, reference (and errors against it), writing (summary, figures, files).

``--warm`` times `il.run` of the paper's case in one process instead: of one case again and again, and of cases that no
run has seen yet, which differ in the mass by parts in a million. Shown are the least times of many.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from tables import table

ROOT = Path(__file__).parents[1]
COMMANDS = {
    "exact": ["axial_impact", "--method", "continuous"],
    "modes, Newmark": ["axial_impact"],
    "ball on a rod, Hunt and Crossley": ["hunt_crossley_ball"],
    "pile with 18 links": ["smith_pile"],
    "modes, with page and data": ["axial_impact", "--out"],
}
COLUMNS = ("start", "case", "solving", "checks", "reference", "writing")
OF_STAGES = {"reading": "case", "checking": "case", "choosing": "solving"} | {name: name for name in COLUMNS[2:]}
WRAPPED = """
import json, sys, time
from impactlab import api
from impactlab.cli import running
from impactlab.cli import main
spent = {}
def wrap(module, name, stage):
    function = getattr(module, name)
    def timed(*arguments, **options):
        began = time.perf_counter()
        try:
            return function(*arguments, **options)
        finally:
            spent[stage] = spent.get(stage, 0.0) + time.perf_counter() - began
    setattr(module, name, timed)
wrap(running, "load", "case")
wrap(api, "reference_of", "reference")
wrap(api, "summarised", "summarised")
solve = api.run
def solved(*arguments, **options):
    history = solve(*arguments, **options)
    spent["solving"], spent["checks"] = history.cost.solve_s, history.cost.checks_s
    spent["ended"] = time.perf_counter()
    return history
api.run = solved
try:
    main()
finally:
    spent["writing"] = time.perf_counter() - spent.pop("ended") - spent["reference"]
    spent.pop("summarised")
    print(json.dumps(spent), file=sys.stderr)
"""


def timed(tree: Path, words: list[str], cache: Path | None) -> dict[str, float]:
    """Return the seconds of a command in a tree by column, and their sum, its wall time."""
    folder = Path(tempfile.mkdtemp())
    given = ["run", *words, *[str(folder / "out")] * (words[-1] == "--out"), "--json"]
    wraps = not (tree / "impactlab" / "wall_time.py").exists()
    entry = ["-c", WRAPPED] if wraps else ["-m", "impactlab"]
    caches = {"NUMBA_CACHE_DIR": str(cache)} if cache else {}
    # Python keeps its bytecode, as of an installed package.
    installed = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    began = time.perf_counter()
    done = subprocess.run(
        [sys.executable, *entry, *given],
        env=installed | {"PYTHONPATH": str(tree)} | caches,
        cwd=tree,
        capture_output=True,
        text=True,
        check=True,
    )
    whole = time.perf_counter() - began
    shutil.rmtree(folder)
    found: dict[str, Any] = {}
    if wraps:
        found = json.loads(done.stderr.splitlines()[-1])
    else:
        for stage, seconds in json.loads(done.stdout)["cost"]["wall_time"].items():
            column = OF_STAGES.get(stage, "start")
            found[column] = found.get(column, 0.0) + seconds
    found["start"] = whole - sum(seconds for name, seconds in found.items() if name != "start")
    return {name: float(found.get(name, 0.0)) for name in COLUMNS} | {"whole": whole}


def measured(trees: dict[str, tuple[Path, Path | None]], repeats: int) -> list[list[str]]:
    """Return a row for each command and tree: seconds by column of its quickest process."""
    rows = []
    for name, words in COMMANDS.items():
        best: dict[str, dict[str, float]] = {}
        for _ in range(repeats + 1):  # the first may compile
            for label, (tree, cache) in trees.items():
                found = timed(tree, words, cache)
                best[label] = min(best.get(label, found), found, key=lambda each: each["whole"])
        rows += [
            [name, label, *(f"{found[column]:.3f}" for column in COLUMNS), f"{found['whole']:.2f}"]
            for label, found in best.items()
        ]
    return rows


WARM = """
bodies:
  hammer: {kind: mass, mass: 2.133 kg, velocity: 1 m/s}
  rod: {kind: rod, length: 0.3 m, diameter: 20 mm, material: steel, ends: {right: clamped}}
contacts: [{between: [hammer, rod.left], law: {kind: addition_deletion}}]
solve: {duration: 0.3 ms, model: {kind: MODEL}}
"""
STEPPED = "finite_element, elements: 100, mass: lumped}, integrator: {kind: central_difference}, step: {dt: 0.5 us"


def warm(repeats: int) -> list[list[str]]:
    """Return a row for the exact case and one of 600 steps: least milliseconds of whole runs and of their parts."""
    import yaml

    import impactlab as il

    rows = []
    for name, model in (("exact", "continuous"), ("600 steps of `central_difference`, 100 elements", STEPPED)):
        case = il.Case.from_dict(yaml.safe_load(WARM.replace("MODEL", model)))
        fresh = [case.with_("bodies.hammer.mass", 2.133 * (1.0 + 1e-6 * number)) for number in range(1, repeats)]
        for label, cases in (("again", [case] * repeats), ("new", fresh)):
            times = []
            for each in cases:
                began = time.perf_counter()
                cost = il.run(each).cost
                times.append([time.perf_counter() - began, cost.setup_s, cost.solve_s, cost.checks_s])
            rows.append([name, label, *(f"{1e3 * min(column):.3f}" for column in zip(*times, strict=True))])
    return rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", type=Path, help="root of an older tree")
    parser.add_argument("--before-cache", type=Path, help="folder of its kernels")
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--warm", action="store_true", help="runs in one process, not commands")
    given = parser.parse_args()
    if given.warm:
        print(table(["`il.run`", "", "whole, ms", "set-up", "solving", "checks"], warm(100 * given.repeats)))
        return
    trees: dict[str, tuple[Path, Path | None]] = {"after": (ROOT, None)}
    if given.before:
        trees = {"before": (given.before.resolve(), given.before_cache), **trees}
    print(table(["command", "", *COLUMNS, "whole, s"], measured(trees, given.repeats)))


if __name__ == "__main__":
    main()
