"""docs/speed.md: what the step loop, laws and integrators cost, measured here and now.

python benchmarks/speed.py --out docs/speed.md [--repeats 20]
"""

from __future__ import annotations

import argparse
import os
import platform
from pathlib import Path

import laws
import llvmlite
import numba
import numpy as np
import schemes
import step_loop

PAGE = """# Speed

What a step costs, and how to measure it again. Written by `python benchmarks/speed.py --out docs/speed.md`: least times
of {repeats} interleaved runs on one core of {machine};
Python {python}, numba {numba}, llvmlite {llvmlite}, numpy {numpy}.
Times differ from machine to machine, ratios hardly. This one did other work meanwhile: the last digits are noise.

## The loop against a hand-written one

The paper's case, lumped mesh, `central_difference`, `addition_deletion`. The hand-written loop is compiled, knows its
scheme and its law, and records the same (`benchmarks/step_loop.py`). The aim is at most 2.5 times its time with 400
elements.

{loop}

## Laws

The same case with {elements} elements and half the stable step (`benchmarks/laws.py`). The ratio is to the same
hand-written loop, so it tells something of the rows of `central_difference`; `newmark` solves a tridiagonal system in
every step, and `exact_modal` has {modes} modes. "plain Python" is the same law with `compiled = False`: what it costs
more when it is called back, its own arithmetic included. An empty one costs {call:.1f} us; a law that iterates costs
what its turns cost.

{laws}

## Integrators

The same case, whole loop, contact and records included, on lumped meshes; `exact_modal` on as many modes. The slope is
between the smallest and the largest mesh (`benchmarks/schemes.py`).

{schemes}
"""


def machine() -> str:
    """Return the kind of processor."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{names[0] if names else platform.processor() or platform.machine()} ({os.cpu_count()} cores)"


def loop_table(repeats: int) -> str:
    """Return the loop beside the hand-written one as a Markdown table."""
    lines = ["| elements | loop, us per step | by hand | ratio |", "|---:|---:|---:|---:|"]
    for elements in schemes.ELEMENTS:
        row = step_loop.measure(elements, repeats)
        ours, theirs = (1e6 * row[name] / row["steps"] for name in ("loop_s", "by_hand_s"))
        lines.append(f"| {elements} | {ours:.3f} | {theirs:.3f} | {row['ratio']:.2f} |")
    return "\n".join(lines)


def main() -> None:
    """Measure everything and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--elements", type=int, default=400)
    given = parser.parse_args()
    page = PAGE.format(
        repeats=given.repeats,
        machine=machine(),
        python=platform.python_version(),
        numba=numba.__version__,
        llvmlite=llvmlite.__version__,
        numpy=np.__version__,
        elements=given.elements,
        modes=given.elements // 4,
        loop=loop_table(given.repeats),
        call=laws.empty_call(given.repeats),
        laws=laws.table(laws.measure(given.elements, given.repeats)),
        schemes=schemes.table(schemes.measure(given.repeats)),
    )
    given.out.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
