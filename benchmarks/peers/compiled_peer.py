"""A hand-written loop for this impact, compiled by numba, as the yardstick.

Central difference with a multiplier and Newmark (`benchmarks/step_loop.py`), both with
per-element coefficients, both recording faces, force, energies and momenta. Scanned: mesh and step.
"""

from __future__ import annotations

from functools import partial
from itertools import product
from typing import Any

import numpy as np

from benchmarks.peers.cases import Case, Outcome
from benchmarks.peers.mesh import chain
from benchmarks.peers.run import Run, Setting, version_of
from benchmarks.step_loop import by_hand, factor, newmark_by_hand
from impactlab.simulate.stepping.arrays import SAMPLES

NAME = "compiled loop"
LIBRARY = "numba"
version = partial(version_of, "numba")
MESHES = (20, 30, 40, 60, 80, 120, 160, 240, 320, 480, 640)


def settings(case: Case) -> list[dict[str, Any]]:
    """Return meshes, schemes and steps [h/c]."""
    explicit = [
        {"model": "chain", "coordinates": n, "scheme": "central_difference", "courant": courant}
        for n, courant in product(MESHES, (0.7, 0.9, 1.0))
    ]
    implicit = [
        {"model": "chain", "coordinates": n, "scheme": "newmark", "courant": courant}
        for n, courant in product(MESHES[2:-3], (0.5, 1.0))
    ]
    return explicit + implicit


def build(case: Case, setting: Setting, record: bool) -> Run:
    """Return a run; it records at every step, always."""
    rod = chain(case, setting["coordinates"])
    steps, dt = case.steps_of(setting["courant"] * rod.h / case.wave_speed)
    out, energies = np.zeros((steps, 9)), np.zeros((SAMPLES + 1, 4))
    out.fill(0.0)  # the kernel's page faults on fresh pages are no part of the time
    stride = -(-steps // SAMPLES)
    if setting["scheme"] == "newmark":
        factors, state = factor(rod.mass, rod.spring, dt), np.zeros((4, rod.mass.size))

        def solve() -> None:
            given = rod.spring, rod.mass, factors, case.striker, case.velocity, state
            newmark_by_hand(*given, out, energies, dt, steps, stride)
    else:
        u, v = np.zeros((2, rod.mass.size))

        def solve() -> None:
            by_hand(rod.spring, rod.mass, case.striker, u, v, out, energies, dt, steps, stride)

    def outcome() -> Outcome:
        rows = np.vstack((np.zeros(9), out))
        return Outcome(rows[:, 0], rows[:, 3], rows[:, 5], float(out[-1, 4]), rows[:, 1])

    return Run(solve, outcome)
