"""Cost of each registered integrator on the paper's case.

Meshes are lumped; the whole loop with contact and records is timed.

The slope is the time per step and per degree of freedom between the smallest and the largest mesh, free of what a step
costs on any mesh. Times are minima of interleaved runs.

    python benchmarks/schemes.py [--repeats 20] [--json]
"""

from __future__ import annotations

import argparse
import json
import math
from typing import Any

from step_loop import scene_of, time_loop
from tables import figure, table

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.modal import Modal
from impactlab.plugins import INTEGRATORS, registry
from impactlab.simulate import Plan, prepare

ELEMENTS = (100, 400, 1600)
STEPS = 4800.0  # of each run: round trips fall as the mesh grows


def plan_of(integrator: AbstractIntegrator, elements: int) -> Plan:
    """Return the run on a mesh, or on as many analytic modes."""
    law = AdditionDeletion()
    model = Modal(elements=elements) if integrator.needs_modes else None
    return prepare(*scene_of(elements, law, integrator, model, 0.5, STEPS / (4.0 * elements)))


def measure(repeats: int) -> list[dict[str, Any]]:
    """Return one row per integrator with fixed steps."""
    rows, plans = [], []
    for name in registry().names(INTEGRATORS):
        kind = registry().load(INTEGRATORS, name)
        if not issubclass(kind, AbstractIntegrator):
            continue
        rows.append({"integrator": name} | {f"us_{elements}": math.inf for elements in ELEMENTS})
        plans.append([plan_of(kind(), elements) for elements in ELEMENTS])
    for _ in range(repeats + 1):
        for row, each in zip(rows, plans, strict=True):
            for elements, plan in zip(ELEMENTS, each, strict=True):
                row[f"us_{elements}"] = min(row[f"us_{elements}"], 1e6 * time_loop(plan)[0] / plan.steps)
    for row in rows:
        low, high = ELEMENTS[0], ELEMENTS[-1]
        row["ns_per_dof"] = 1e3 * (row[f"us_{high}"] - row[f"us_{low}"]) / (high - low)
    return rows


def shown(rows: list[dict[str, Any]]) -> str:
    """Return the rows as a Markdown table."""
    names = [*(f"us_{elements}" for elements in ELEMENTS), "ns_per_dof"]
    cells = [(f"`{row['integrator']}`", *(figure(row[name]) for name in names)) for row in rows]
    heads = ("integrator", *(f"{elements} elements" for elements in ELEMENTS), "ns per dof and step")
    return table(heads, cells, text=heads[:1])


def main() -> None:
    """Print one row per integrator: us per step on each mesh, and the slope."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = measure(arguments.repeats)
    print(json.dumps(rows, indent=1) if arguments.json else shown(rows))


if __name__ == "__main__":
    main()
