"""docs/wall-time.md: wall time of runs and commands by stage.

This tree is compared with an older one.

    python benchmarks/wall_time.py --before DIR --out docs/wall-time.md [--repeats 7]

Both trees run in turn, kernels on disk; shown is the quickest process of each. This tree reports its stages itself
(`cost.wall_time`). An older one, which does not, is timed from outside: its functions are wrapped, and "start" is the
rest. Columns: start (Python, libraries, compiled code read from disk, set-up), case (read and checked), solving,
checks, reference (and errors against it), writing (summary, figures, files).

Runs in one process are those of the paper's case by `il.run`: one case again and again, and cases that no run has seen
yet, which differ in the mass by parts in a million. All times are
least ones.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from tables import page, table

from impactlab.bench.environment import processor

ROOT = Path(__file__).resolve().parents[1]
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


Trees = dict[str, tuple[Path, Path | None]]
"""Of each tree its root, and the folder of its kernels, if they are not beside its source."""


def process(tree: Path, words: list[str], cache: Path | None, given: str = "") -> subprocess.CompletedProcess[str]:
    """Run Python in a tree; it keeps its bytecode, as of an installed package."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    caches = {"NUMBA_CACHE_DIR": str(cache)} if cache else {}
    done = subprocess.run(
        [sys.executable, *words],
        env=kept | {"PYTHONPATH": str(tree)} | caches,
        cwd=tree,
        input=given,
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise SystemExit(f"{tree}: {words[:3]} failed: {done.stderr[-1000:]}")
    return done


def commit_of(tree: Path) -> str:
    """Return the short name of the commit of a tree."""
    words = ["git", "-C", str(tree), "rev-parse", "--short", "HEAD"]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()


def timed(tree: Path, words: list[str], cache: Path | None) -> dict[str, float]:
    """Return the seconds of a command in a tree by column, and their sum.

    The sum is its wall time.
    """
    folder = Path(tempfile.mkdtemp())
    given = ["run", *words, *[str(folder / "out")] * (words[-1] == "--out"), "--json"]
    wraps = not any((tree / "impactlab").rglob("wall_time.py"))
    entry = ["-c", WRAPPED] if wraps else ["-m", "impactlab"]
    began = time.perf_counter()
    done = process(tree, [*entry, *given], cache)
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


def measured(trees: Trees, repeats: int) -> list[list[str]]:
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


CASE = """
bodies:
  hammer: {kind: mass, mass: MASS kg, velocity: 1 m/s}
  BODY
contacts: [{between: [hammer, PLACE], law: {kind: LAW}}]
solve: {duration: 0.3 ms, model: {kind: MODEL}}
"""
ROD = "rod: {kind: rod, length: 0.3 m, diameter: 20 mm, material: steel, ends: {right: clamped}}"
BEAM = (
    "beam: {kind: beam, theory: timoshenko, length: 0.3 m, section: {width: 20 mm, height: 20 mm}, "
    "material: steel, ends: {left: pinned, right: pinned}}"
)
LUMPED = "finite_element, elements: ELEMENTS, mass: lumped}, integrator: {kind: central_difference}, step: {dt: 0.1 us"
CONSISTENT = "finite_element, elements: ELEMENTS}, integrator: {kind: newmark}, step: {dt: 0.1 us"
MODES = "modal, modes: ELEMENTS}, integrator: {kind: exact_modal}, step: {dt: 0.1 us"
RUNS = {
    "exact": ("rod.left", ROD, "continuous"),
    "600 steps of `central_difference`, 100 elements": (
        "rod.left",
        ROD,
        LUMPED.replace("ELEMENTS", "100").replace("0.1 us", "0.5 us"),
    ),
} | {
    f"set-up: {name}, {size}": (place, body, model.replace("ELEMENTS", str(size)))
    for name, (place, body, model) in {
        "`central_difference`, elements": ("rod.left", ROD, LUMPED),
        "`newmark`, elements": ("rod.left", ROD, CONSISTENT),
        "`newmark`, elements of a beam": ("beam.at(0.1)", BEAM, CONSISTENT),
        "`exact_modal`, modes of a beam": ("beam.at(0.1)", BEAM, MODES),
    }.items()
    for size in (30, 100, 400)
    if "modes" not in name or size < 400
}
"""Runs in one process: of the first ones all parts are shown, of the others the set-up of new cases."""
WARM = """
import json, sys, time, yaml
import impactlab as il
found = {}
for name, (texts, label) in json.loads(sys.stdin.read()).items():
    times = []
    for case in [il.Case.from_dict(yaml.safe_load(text)) for text in texts]:
        for _ in range(200 if label == "again" else 1):
            began = time.perf_counter()
            cost = il.run(case).cost
            times.append([time.perf_counter() - began, cost.setup_s, cost.solve_s, cost.checks_s])
    found[name] = [1e3 * min(column) for column in zip(*times)]
print(json.dumps(found))
"""


def texts_of(name: str, new: bool, count: int) -> list[str]:
    """Return the case of a run, or many new ones.

    New ones differ in the mass.
    """
    place, body, model = RUNS[name]
    law = "hertz, stiffness: 1000000000.0" if name.startswith("set-up") else "addition_deletion"
    text = CASE.replace("BODY", body).replace("PLACE", place).replace("LAW", law).replace("MODEL", model)
    return [text.replace("MASS", repr(2.133 * (1.0 + 1e-6 * number))) for number in (range(1, count) if new else [0])]


def in_one_process(trees: Trees, repeats: int) -> tuple[list[list[str]], list[list[str]]]:
    """Return rows of whole runs with their parts, and of set-up [ms].

    Set-up is that of new cases.
    """
    names = [(name, new) for name in RUNS for new in (False, True) if new or not name.startswith("set-up")]
    given = {f"{name}|{new}": (texts_of(name, new, 60), "new" if new else "again") for name, new in names}
    best: dict[str, dict[str, list[float]]] = {label: {} for label in trees}
    for _ in range(repeats):
        for label, (tree, cache) in trees.items():
            done = process(tree, ["-c", WARM], cache, json.dumps(given))
            for name, times in json.loads(done.stdout).items():
                known = best[label].get(name, times)
                best[label][name] = [min(pair) for pair in zip(known, times, strict=True)]
    whole, setup = [], []
    for name, new in names:
        for_all = {label: best[label][f"{name}|{new}"] for label in trees}
        if name.startswith("set-up"):
            setup.append([name.removeprefix("set-up: "), *(f"{times[1]:.2f}" for times in for_all.values())])
        else:
            case = "new" if new else "again"
            whole += [[name, case, label, *(f"{each:.3f}" for each in times)] for label, times in for_all.items()]
    return whole, setup


def written(trees: Trees, repeats: int) -> str:
    """Return the page."""
    whole, setup = in_one_process(trees, repeats)
    filled = {
        "machine": f"{os.cpu_count()} cores of {processor()}, Python {platform.python_version()}",
        "commit": commit_of(trees["before"][0]),
        "whole": table(["`il.run`", "case", "", "whole, ms", "set-up", "solving", "checks"], whole, ["`il.run`"]),
        "setup": table(["a mass on a rod or a beam", "before, ms", "after, ms"], setup, ["a mass on a rod or a beam"]),
        "commands": table(["command", "", *COLUMNS, "whole, s"], measured(trees, repeats), ["command"]),
    }
    return page("wall-time.head.md", filled)


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", type=Path, required=True, help="root of an older tree")
    parser.add_argument("--before-cache", type=Path, help="folder of its kernels")
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    text = written({"before": (given.before.resolve(), given.before_cache), "after": (ROOT, None)}, given.repeats)
    if given.out is None:
        print(text)
    else:
        given.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
