"""A loop in numpy as a first try: central difference, whole arrays.

A multiplier acts at the contact.

Nothing is allocated inside the loop: each operation writes into an array made before. Scanned: mesh and step.
"""

from __future__ import annotations

from functools import partial
from itertools import product
from typing import Any

import numpy as np

from benchmarks.peers.cases import Case, Outcome
from benchmarks.peers.mesh import chain
from benchmarks.peers.run import Run, Setting, version_of

NAME = "numpy loop"
LIBRARY = "numpy"
version = partial(version_of, "numpy")


def settings(case: Case) -> list[dict[str, Any]]:
    """Return meshes and steps [h/c]."""
    return [
        {"model": "chain", "coordinates": n, "scheme": "central_difference", "courant": courant}
        for n, courant in product((20, 30, 40, 60, 80, 120, 160, 240, 320, 480, 640), (0.7, 0.9, 1.0))
    ]


def build(case: Case, setting: Setting, record: bool) -> Run:
    """Return a run; it records displacements and force at every step, always."""
    rod = chain(case, setting["coordinates"])
    steps, dt = case.steps_of(setting["courant"] * rod.h / case.wave_speed)
    n = rod.mass.size
    u, v, force, tension = np.zeros(n + 1), np.zeros(n), np.zeros(n), np.zeros(n)  # u[n] is the clamped end
    gain, striker = dt / rod.mass, case.striker
    compliance = dt * dt * (1.0 / striker + 1.0 / rod.mass[0])
    kept, last = np.zeros((steps + 1, 4)), [case.velocity]

    def solve() -> None:
        left, right, moved = u[:-1], u[1:], np.zeros(n)
        um, vm = 0.0, case.velocity
        for step in range(1, steps + 1):
            np.subtract(right, left, out=tension)
            np.multiply(tension, rod.spring, out=tension)
            force[0] = tension[0]
            np.subtract(tension[1:], tension[:-1], out=force[1:])
            np.multiply(force, gain, out=force)
            np.add(v, force, out=v)
            np.multiply(v, dt, out=moved)
            np.add(left, moved, out=left)
            um += dt * vm
            push = (um - u[0]) / compliance
            if push > 0.0:
                um -= dt * dt * push / striker
                vm -= dt * push / striker
                u[0] += dt * dt * push / rod.mass[0]
                v[0] += dt * push / rod.mass[0]
            else:
                push = 0.0
            kept[step] = step * dt, um, u[0], push
        last[0] = vm

    def outcome() -> Outcome:
        return Outcome(kept[:, 0], kept[:, 1], kept[:, 2], float(last[0]), kept[:, 3])

    return Run(solve, outcome)
