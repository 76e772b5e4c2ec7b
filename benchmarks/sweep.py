"""Speed of batched sweeps of exact runs: ``python benchmarks/sweep.py [--points N] [--repeats N] [--map N]``.

For axes of the paper's case, processor time per point of bare marches in a compiled loop over prepared memory, of the
batch with its results, of a whole `il.sweep`, and of single runs `il.run(case.with_(...))`. The four take turns, and
the least time of each counts, so that ratios hold on a busy machine. ``--map`` adds the map of hammer, rod and wall, N
values on each axis, by wall and processor time on one thread and on two.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable

import numpy as np

import impactlab as il
from impactlab.casefile import Case
from impactlab.exact.batch.points import BARE
from impactlab.sweeps import axes
from impactlab.sweeps.points import Sweep
from impactlab.sweeps.quantities import DEFAULT, quantities_of
from impactlab.types import Array

FEW = ("contacts", "restitution")
SINGLE = 60  # single runs
AXES = {
    "bodies.hammer.mass": (0.2, 20.0),
    "bodies.hammer.velocity": (0.1, 10.0),
    "bodies.rod.length": (0.3, 0.9),
    "bodies.rod.material.young": (7e10, 2.1e11),
    "contacts.0.gap": (1e-6, 1e-4),
}


def least(calls: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Return the least processor time of each call [s]; they take turns."""
    found = dict.fromkeys(calls, np.inf)
    for _ in range(repeats):
        for name, call in calls.items():
            began = time.process_time()
            call()
            found[name] = min(found[name], time.process_time() - began)
    return found


def on_axis(case: Case, path: str, values: Array, repeats: int) -> None:
    """Print a line of the table: times per point over one axis, and their ratios."""
    grid = axes.grid(case, {path: values})
    wanted = {
        name: quantities_of(case.scene(), names, case.registry) for name, names in (("few", FEW), ("all", DEFAULT))
    }
    batches = {name: Sweep(case, grid, each).batch for name, each in wanted.items()}
    few, whole = batches["few"], batches["all"]
    if few is None or whole is None:
        raise SystemExit(f"{path} is no batch")
    every = np.arange(len(values))
    chosen = values[:: max(1, len(values) // SINGLE)].tolist()
    calls: dict[str, Callable[[], object]] = {
        "bare": lambda: few.marcher.results(every, BARE),
        "few": lambda: few.at(range(len(values))),
        "all": lambda: whole.at(range(len(values))),
        "sweep": lambda: il.sweep(case, {path: values}, quantities=FEW),
        "runs": lambda: [il.run(case.with_(path, value)) for value in chosen],
    }
    found = least(calls, repeats)
    counts = dict.fromkeys(calls, len(values)) | {"runs": len(chosen)}
    each = {name: 1e6 * spent / counts[name] for name, spent in found.items()}
    ratios = [each[name] / each["bare"] for name in ("few", "all", "sweep")]
    print(f"| `{path}` | " + " | ".join(f"{each[name]:.1f}" for name in calls), end=" | ")
    print(" | ".join(f"{ratio:.2f}" for ratio in ratios), f"| {each['runs'] / each['sweep']:.0f} |", flush=True)


def of_map(count: int) -> None:
    """Print time and memory of the map of hammer, rod and wall.

    It is computed on one thread and on two.
    """
    case = il.load_case("hammer_rod_wall").with_("solve.duration", {"round_trips": 6})
    over = {"bodies.hammer.mass": np.geomspace(0.1, 10.0, count), "contacts.1.gap": np.linspace(0.0, 2.4e-4, count)}
    il.sweep(case, {path: values[:: max(1, count // 20)] for path, values in over.items()}, quantities=FEW)
    for workers in (0, 2):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        wall, spent = time.perf_counter(), time.process_time()
        found = il.sweep(case, over, quantities=FEW, workers=workers)
        wall, spent = time.perf_counter() - wall, time.process_time() - spent
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        size = found.nbytes / 1e6
        print(f"{count} x {count}, workers={workers}: {wall:.1f} s, {spent:.1f} s of processor,", end=" ")
        print(f"{1e6 * spent / count**2:.1f} us a point; memory grew by {grown / 1e3:.0f} MB, result {size:.0f} MB")


def main() -> None:
    """Print the table, and the map if requested."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=10_000)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--map", type=int, default=0)
    given = parser.parse_args()
    paper = il.load_case("axial_impact").method("continuous")
    blocks = {key: value for key, value in paper.document.data.items() if key not in ("probes", "snapshots")}
    case = Case.from_dict(blocks, "axial_impact")
    print(
        "| axis | bare march | batch, few | batch, default | whole sweep | single run | few/bare | default/bare |",
        end="",
    )
    print(" sweep/bare | run/sweep |")
    print("|---|" + "---|" * 9)
    for path, (first, last) in AXES.items():
        on_axis(case, path, np.geomspace(first, last, given.points), given.repeats)
    if given.map:
        of_map(given.map)


if __name__ == "__main__":
    main()
