"""docs/speed.md: cost of step loop, laws, integrators and short runs.

python benchmarks/speed.py --out docs/speed.md [--repeats 20] [--before DIR]
"""

from __future__ import annotations

import argparse
import math
import os
import platform
import subprocess
import sys
from pathlib import Path

import laws
import llvmlite
import numba
import numpy as np
import scaling
import schemes
import step_loop
from tables import table

from impactlab.bench.environment import processor
from impactlab.scene import RECORDS
from impactlab.simulate.stepping.arrays import SAMPLES

PAGE = """# Speed

The cost of a step. Written by `python benchmarks/speed.py --out docs/speed.md`: least times
of {repeats} interleaved runs on one core of {machine};
Python {python}, numba {numba}, llvmlite {llvmlite}, numpy {numpy}.
Times differ between machines, ratios less: the package uses the widest vector registers there are.

## The loop against hand-written ones

How close is the general step loop to a loop written for one problem? The case is the impact of the 1999 paper on a
lumped mesh, with `addition_deletion`. Two loops are written by hand and compiled (`benchmarks/step_loop.py`):

- "By hand" has one scheme and one law, and makes the same records. The target is at most twice its time with 400
  elements and 1.5 times with 1600.
- "Best by hand" keeps displacements only, in two arrays that are swapped, has one factor for all elements, and
  computes no energies. The target is at most 2, 1.5 and 1.25 times its time with 100, 400 and 1600 elements.

"Before" is an older version on the same processor (`--before`; commit 0a39002). The hand-written loop of Newmark's
method substitutes row by row, the package eight rows at a time.

{loop}

The ratios to the best loop depend on the processor. With 100 elements they were 2.7 on an Intel Xeon with 512-bit
registers, 2.2 to 3.8 on an AMD EPYC with 256-bit registers, and 3.2 to 3.5 on a newer one with 512-bit registers,
whose best loop takes half as long. With 400 elements they were 1.5 to 1.7. The package does two things that the
best loop does not: it records energies and momenta at some 200 instants (20 to 40 ns of each step), and it calls a
general contact law with its records and events (35 to 60 ns while a contact is closed).

## Scaling

Set-up is the time before the first step. The cost per element falls with their number, because a step has a fixed
cost of about 0.1 us (`benchmarks/scaling.py`).

{scaling}

## Memory

{small} elements, `central_difference`, probes only, whole runs: the peak memory of Python and numpy. Runs of up to
{records} steps keep every step. Longer ones keep every second, third ... step, at most {records} of them
(`solve.records` sets another number). Forces are then means between these instants; energies are kept at {samples}
instants. All events are kept, with their times in the step.

{memory}

## Fixed cost

Short runs of the case, with all modules loaded. "With contacts, energies, checks" is the whole of `simulate.run`
and the channels that a summary evaluates.

{fixed}

Cold starts: wall time of a new process, imports included.

{starts}

## Laws

The same case with {elements} elements and half the stable step (`benchmarks/laws.py`). The ratio is to the
hand-written loop of central difference. It is a fair comparison only for `central_difference`: `newmark` solves a
tridiagonal system in every step, and `exact_modal` has {modes} modes. "Plain Python" is the additional cost of the
same law without compilation (`compiled = False`). An empty law costs {call:.1f} us. "-" is a run that was stopped,
because its contact opened and closed too often.

{laws}

## Integrators

The same case, whole loop, contact and records included, on lumped meshes; `exact_modal` on as many modes. The slope is
between the smallest and the largest mesh (`benchmarks/schemes.py`).

{schemes}
"""


OTHERS = "\n## Pages and first use\n"  # heading of the part of the page that other programs give


def loops_of(tree: Path, repeats: int) -> dict[tuple[str, int], float]:
    """Return the times per step of an older tree [us].

    They are by integrator and elements, as its `step_loop.py` prints them.
    """
    found: dict[tuple[str, int], float] = {}
    for name in step_loop.SCHEMES:
        words = ["benchmarks/step_loop.py", "--repeats", str(repeats), "--scheme", name]
        run = {"cwd": tree, "env": os.environ | {"PYTHONPATH": str(tree)}, "capture_output": True, "text": True}
        for line in subprocess.run([sys.executable, *words], check=True, **run).stdout.splitlines():
            cells = line.split()
            if len(cells) > 3 and cells[0].isdecimal():
                found[name, int(cells[0])] = float(cells[2])
    return found


def least_before(tree: Path | None, repeats: int) -> dict[tuple[str, int], str]:
    """Return the least of two runs of an older tree as text; nothing without one."""
    if tree is None:
        return {}
    first, second = loops_of(tree, repeats), loops_of(tree, repeats)
    return {key: f"{min(first[key], second[key]):.3f}" for key in first}


def loop_table(repeats: int, tree: Path | None) -> str:
    """Return a Markdown table of loops, and the cost of a step.

    Beside the loops are those by hand and of an older tree; the cost is that on any mesh.
    """
    cells, lines_through, old = [], [], least_before(tree, repeats)
    for name, integrator in step_loop.SCHEMES.items():
        rows = [step_loop.measure(elements, repeats, integrator) for elements in schemes.ELEMENTS]
        for row in rows:
            ours, theirs = (1e6 * row[each] / row["steps"] for each in ("loop_s", "by_hand_s"))
            best = 1e6 * row["best_s"] / row["steps"] if "best_s" in row else math.nan
            beside = (f"{best:.3f}", f"{ours / best:.2f}") if best > 0.0 else ("", "")
            before = old.get((name, int(row["elements"])), "")
            times = f"{ours:.3f}", f"{theirs:.3f}", f"{row['ratio']:.2f}", *beside, before
            cells.append((f"`{name}`", row["elements"], *times))
        (ours, slope), (theirs, other) = (step_loop.line(rows, each) for each in ("loop_s", "by_hand_s"))
        lines_through.append(
            f"Between 100 and 400 elements a step of `{name}` costs {ours:.2f} us and {slope:.2f} ns per element, "
            f"by hand {theirs:.2f} us and {other:.2f} ns."
        )
    heads = ("integrator", "elements", "loop, us per step", "by hand", "ratio", "best by hand", "ratio", "loop before")
    return "\n".join((table(heads, cells, text=heads[:1]), "", *lines_through))


def main() -> None:
    """Measure everything and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--elements", type=int, default=400)
    parser.add_argument("--most-steps", type=int, default=10_000_000)
    parser.add_argument("--before", type=Path, help="root of an older tree, for the column beside")
    given = parser.parse_args()
    page = PAGE.format(
        repeats=given.repeats,
        machine=f"{processor()} ({os.cpu_count()} cores)",
        python=platform.python_version(),
        numba=numba.__version__,
        llvmlite=llvmlite.__version__,
        numpy=np.__version__,
        elements=given.elements,
        modes=given.elements // 4,
        loop=loop_table(given.repeats, given.before),
        scaling=scaling.scaling_table(scaling.scaling(max(2, given.repeats // 4))),
        small=scaling.SMALL,
        records=RECORDS,
        samples=SAMPLES,
        memory=scaling.memory_table(scaling.memory(given.most_steps)),
        fixed=scaling.fixed_table(scaling.fixed(given.repeats)),
        starts=scaling.starts_table(given.repeats),
        call=laws.empty_call(given.repeats),
        laws=laws.shown(laws.measure(given.elements, given.repeats)),
        schemes=schemes.shown(schemes.measure(given.repeats)),
    )
    kept = given.out.read_text(encoding="utf-8") if given.out.exists() else ""
    by_other_programs = kept[kept.index(OTHERS) :] if OTHERS in kept else ""
    given.out.write_text(page + by_other_programs, encoding="utf-8")


if __name__ == "__main__":
    main()
