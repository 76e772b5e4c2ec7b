"""scipy's `solve_ivp` on a Craig-Bampton rod, cut at its events.

How it is set, and why:

- The contact is hard and phases are cut by ``events`` that end them: in contact the mass rides on the face's coordinate
  and the phase ends where the force falls through zero; apart it ends where the gap closes, and the velocities of mass
  and face join with their common momentum. A penalty spring would make the equations stiff for nothing.
- A few Craig-Bampton coordinates spare the high frequencies of a mesh; matrices are inverted beforehand, so one
  evaluation is one small matrix product.
- `RK45`, `DOP853`, `RK23` and `LSODA` with scanned tolerances; `Radau` and `BDF` took four times as
  long, for nothing is stiff. Results at 300 instants, from the method's own interpolation.
"""

from __future__ import annotations

from functools import partial
from itertools import product
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.peers.cases import SHORTEST_FLIGHT, Array, Case, Outcome
from benchmarks.peers.mesh import reduced
from benchmarks.peers.run import Run, Setting, version_of

NAME = "solve_ivp"
SAMPLES = 300
MOST_PHASES = 60
LIBRARY = "scipy"
version = partial(version_of, "scipy")


def settings(case: Case) -> list[dict[str, Any]]:
    """Return sizes, methods and relative tolerances."""
    return [
        {"model": "reduced", "coordinates": n, "scheme": scheme, "relative_tolerance": tolerance}
        for n, scheme, tolerance in product(
            (8, 12, 16, 20, 24, 32, 48), ("RK45", "DOP853", "RK23", "LSODA"), (1e-2, 1e-3, 1e-4)
        )
    ]


def build(case: Case, setting: Setting, record: bool) -> Run:
    """Return a run."""
    n, rod = setting["coordinates"], reduced(case, setting["coordinates"])
    apart = np.zeros((n + 1, n + 1))  # of the rod and the mass, which moves freely
    apart[:n, :n] = -np.linalg.solve(rod.mass, rod.stiffness)
    heavy = rod.mass.copy()
    heavy[0, 0] += case.striker
    together = np.zeros((n + 1, n + 1))
    together[:n, :n] = -np.linalg.solve(heavy, rod.stiffness)
    together[n] = together[0]
    pull = -together[n]  # times displacement: the force over the mass of the striker
    share = np.linalg.solve(rod.mass, np.eye(n)[0])  # velocity of the rod per impulse at its face
    size = n + 1
    pieces: list[tuple[Array, Array]] = []
    cuts: list[float] = []  # ends of phases, in turn apart and together

    def force(_: float, y: Array) -> float:
        return float(pull @ y[:size])

    def gap(_: float, y: Array) -> float:
        return float(y[0] - y[n])

    force.terminal = gap.terminal = True  # type: ignore[attr-defined]
    force.direction = gap.direction = -1.0  # type: ignore[attr-defined]

    def solve() -> None:
        y, t, closed = np.zeros(2 * size), 0.0, True
        y[-1] = case.velocity
        instants = np.linspace(0.0, case.duration, SAMPLES + 1)
        options = {"method": setting["scheme"], "rtol": setting["relative_tolerance"]}
        # Displacements are of the order v0 T, velocities of v0: one tolerance each.
        small = setting["relative_tolerance"] * case.velocity * 0.1
        scale = np.append(np.full(size, small * case.round_trip), np.full(size, small))
        for _ in range(MOST_PHASES):
            if closed:
                impulse = (y[-1] - y[size]) / (share[0] + 1.0 / case.striker)
                y[size:-1] += impulse * share
                y[-1] = y[size]
            matrix = together if closed else apart

            def rate(_: float, y: Array, matrix: Array = matrix) -> Array:
                return np.concatenate((y[size:], matrix @ y[:size]))

            # The phase begins on its event's zero: a gap just opened must not close it again.
            event = force if closed else gap
            wanted = instants[instants > t]
            found = solve_ivp(rate, (t, case.duration), y, t_eval=wanted, events=event, atol=scale, **options)
            if len(found.t):  # a phase may end before the first instant
                pieces.append((found.t, found.y[(n, 0, -1), :]))
            if found.status != 1:
                break
            t, y = float(found.t_events[0][0]), found.y_events[0][0].copy()
            pieces.append((np.array([t]), y[[n, 0, -1]][:, None]))
            cuts.append(t)
            closed = not closed
            if closed:
                y[n] = y[0]

    def outcome() -> Outcome:
        times = np.concatenate([[0.0], *(piece[0] for piece in pieces)])
        mass, face, velocity = np.hstack([[[0.0], [0.0], [case.velocity]], *(piece[1] for piece in pieces)])
        ends = [*cuts, case.duration]
        flights = zip(ends[0::2], ends[1::2], strict=False)
        shortest = SHORTEST_FLIGHT * case.round_trip
        opening = next((start for start, end in flights if end - start > shortest), float("inf"))
        return Outcome(times, mass, face, float(velocity[-1]), opening=opening)

    return Run(solve, outcome)
