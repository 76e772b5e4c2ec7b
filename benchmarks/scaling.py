"""Growth of cost with elements and steps, memory, and cost before the first step.

The paper's case. Set-up is all that `simulate.run` does before its first step, the compiled loop at hand; memory is the
most that Python and numpy hold at once during a whole run with probes only, each run in a process of its own. A cold
start is a new process each time, what it reads still in memory, in time on the clock. All else is processor time.

    python benchmarks/scaling.py [--repeats 5] [--most-steps 10000000]
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path
from typing import Any

from step_loop import SCHEMES, scene_of, time_loop
from tables import table

from impactlab import simulate
from impactlab.models.continuous import Continuous
from impactlab.scene.method import Simulation
from impactlab.simulate.stepping.setup.assembly import Assembly

ELEMENTS = (100, 1_000, 10_000, 100_000)
WORK = 20_000_000  # elements times steps of one measured run
LEAST_STEPS = 4_000  # of one measured run: energies are taken 256 times, whatever the number of steps
SMALL = 10  # elements of the runs with many steps
CASE = Path(__file__).resolve().parents[1] / "cases" / "axial_impact.yaml"
EXACT = ("run", str(CASE), "--set", "solve.model.kind=continuous", "--json")
STARTS = {"`impactlab --help`": ("--help",), "`impactlab run cases/axial_impact.yaml`, exact": EXACT}


def scaling(repeats: int) -> list[dict[str, Any]]:
    """Return set-up [ms] and time per element and step [ns].

    There is one row per scheme and mesh.
    """
    rows = []
    for name, integrator in SCHEMES.items():
        for elements in ELEMENTS:
            steps = max(LEAST_STEPS, WORK // elements)
            scene = scene_of(elements, integrator=integrator, round_trips=steps / (2.0 * elements))
            setup = least = math.inf
            for _ in range(repeats + 1):
                began = time.thread_time()
                plan = simulate.prepare(*scene)
                assert plan.dt is not None
                assert plan.integrator is not None
                Assembly(plan, plan.integrator, plan.dt)
                setup = min(setup, time.thread_time() - began)
                least = min(least, time_loop(plan)[0] / plan.steps)
            each = {"steps": plan.steps, "setup_ms": 1e3 * setup, "ns": 1e9 * least / elements}
            rows.append({"integrator": name, "elements": elements} | each)
    return rows


def scaling_table(rows: list[dict[str, Any]]) -> str:
    """Return the rows as a Markdown table."""
    cells = [
        (f"`{row['integrator']}`", row["elements"], row["steps"], f"{row['setup_ms']:.2f}", f"{row['ns']:.2f}")
        for row in rows
    ]
    return table(("integrator", "elements", "steps", "set-up, ms", "ns per element and step"), cells, ("integrator",))


def many_steps(steps: int) -> dict[str, Any]:
    """Run many steps of a small mesh in this process; return its largest memory.

    Time, records and energies are returned as well.
    """

    def scene(count: int) -> Simulation:
        return scene_of(SMALL, round_trips=count / (2.0 * SMALL))

    simulate.run(*scene(1000))
    tracemalloc.start()
    began = time.thread_time()
    history = simulate.run(*scene(steps))
    spent, most = time.thread_time() - began, tracemalloc.get_traced_memory()[1]
    return {
        "steps": history.cost.steps,
        "mb": most / 1024.0**2,
        "us": 1e6 * spent / history.cost.steps,
        "kept": history.jumps("force:hammer|rod.left").size,
        "gain": history.energy.largest_gain,
        "loss": history.energy.largest_loss,
    }


def memory(most: int) -> list[dict[str, Any]]:
    """Return `many_steps` of ten thousand steps and more, each in a process of its own."""
    rows, steps = [], 10_000
    while steps <= most:
        command = (sys.executable, __file__, "--child", str(steps))
        answer = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        rows.append(json.loads(answer))
        steps *= 10
    return rows


def memory_table(rows: list[dict[str, Any]]) -> str:
    """Return the rows as a Markdown table."""
    formats = {"steps": "d", "kept": "d", "mb": ".1f", "us": ".2f", "gain": ".1e", "loss": ".1e"}
    heads = ("steps", "instants kept", "memory, MB", "us per step", "energy gained", "lost")
    return table(heads, [[f"{row[name]:{each}}" for name, each in formats.items()] for row in rows])


def fixed(repeats: int) -> list[dict[str, Any]]:
    """Return the times of short runs [ms].

    They are set-up, solution, and all with contacts, energies and warnings.
    """
    scenes = {"exact": scene_of(100, model=Continuous()).but(integrator=None)}
    scenes |= {name: scene_of(100, integrator=integrator) for name, integrator in SCHEMES.items()}
    rows = []
    for name, scene in scenes.items():
        row = {"run": name, "setup_ms": math.inf, "solve_ms": math.inf, "all_ms": math.inf}
        for _ in range(10 * repeats):
            began = time.thread_time()
            history = simulate.run(*scene)
            assert history.contacts is not None
            assert history.energy.largest_gain >= 0.0
            assert isinstance(history.warnings, list)
            row["all_ms"] = min(row["all_ms"], 1e3 * (time.thread_time() - began))
            row["setup_ms"] = min(row["setup_ms"], 1e3 * history.cost.setup_s)
            row["solve_ms"] = min(row["solve_ms"], 1e3 * history.cost.solve_s)
        rows.append(row | {"steps": history.cost.steps if history.dt is not None else 0})
    return rows


def fixed_table(rows: list[dict[str, Any]]) -> str:
    """Return the rows as a Markdown table."""
    times = [[f"{row[name]:.2f}" for name in ("setup_ms", "solve_ms", "all_ms")] for row in rows]
    cells = [(f"`{row['run']}`", row["steps"] or "", *each) for row, each in zip(rows, times, strict=True)]
    heads = ("run", "steps", "set-up, ms", "solution, ms", "with contacts, energies, checks, ms")
    return table(heads, cells, text=("run",))


def starts_table(repeats: int) -> str:
    """Return the times of commands from a cold start [s] as a table.

    Bytecode is kept, as when installed.
    """
    cells = []
    installed = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    for name, arguments in STARTS.items():
        least = math.inf
        for _ in range(repeats + 1):
            began = time.perf_counter()
            command = (sys.executable, "-m", "impactlab", *arguments)
            subprocess.run(command, check=True, capture_output=True, env=installed)
            least = min(least, time.perf_counter() - began)
        cells.append((name, f"{least:.2f}"))
    return table(("command", "s"), cells, text=("command",))


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--most-steps", type=int, default=10_000_000)
    parser.add_argument("--child", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child is not None:
        print(json.dumps(many_steps(given.child)))
        return
    tables = scaling_table(scaling(given.repeats)), memory_table(memory(given.most_steps))
    print("\n\n".join((*tables, fixed_table(fixed(given.repeats)), starts_table(given.repeats))))


if __name__ == "__main__":
    main()
