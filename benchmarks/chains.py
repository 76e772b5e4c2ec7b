"""docs/speed-of-chains.md: steps of chains of contacts against hand-written loops.

It shows their growth with the number of contacts as well.

python benchmarks/chains.py --out docs/speed-of-chains.md [--repeats 7] [--contacts 10 100 1000 10000]

Hertzian beads by leapfrog, struck at one end or pressed together between walls, and plastic hard contacts of beads that
fall on a wall. The hand-written loops hold the same scheme and law, without records, events or energies. Times are
minima of interleaved runs, in time of the processor.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numba import njit
from tables import table

from impactlab.bench.environment import processor
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.power_law import Hertz
from impactlab.contact.velocity_complementarity import VelocityComplementarity
from impactlab.integrators.central_difference import CentralDifference
from impactlab.numerics.addresses import entered
from impactlab.scene import RECORDS, Mass, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.scene.sizes import default_records
from impactlab.simulate import prepare
from impactlab.simulate.plan import Plan
from impactlab.simulate.stepped_run import walk
from impactlab.simulate.stepping import loop
from impactlab.simulate.stepping.results.history import RecordedHistory
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.testing.scenes import in_a_row

DT, STIFFNESS, PRESSED = 1e-3, 1e3, 1e-3  # s, N/m^1.5, m of overlap
HARD_STEPS = 100

PAGE = """# Speed of chains

Time for each contact and step of a chain, in ns. Written by
`python benchmarks/chains.py --out docs/speed-of-chains.md`: least times of {repeats} interleaved runs, in time of one
core of {machine}.

## Hertzian beads

Leapfrog, {steps} steps or more. In "struck" all beads touch and the first one moves, so few contacts are closed at
a time. In "pressed" all contacts between two walls are closed. The target is at most twice the time of a
hand-written loop with 1000 beads, and no growth of the time per contact with their number.

- "Loop" is the whole loop of the package, with its default records, events and energies. "Reading" is the time to
  evaluate the records after the run.
- "By hand" is the faster of two compiled loops, one with a single pass over the beads, one with two passes in
  vector instructions. They step all beads and record nothing.

The package processes eight contacts at a time in vector registers, and skips blocks of beads that the wave has not
reached; in "pressed" there are none. With 10 beads the latency of the operations in a step dominates, and recording
takes about as long again.

{beads}

## Hard contacts

Beads with random masses and speeds fall on a wall under gravity, `velocity_complementarity` without restitution,
{hard_steps} steps by leapfrog. Groups of touching beads grow from the wall, and the contact solve takes Newton
steps on a tridiagonal system.

{hard}
"""


@njit(error_model="numpy")
def one_pass(
    u: np.ndarray, v: np.ndarray, gain: np.ndarray, k: np.ndarray, gap: np.ndarray, dt: float, steps: int
) -> None:
    """March beads in one pass.

    A bead is moved once the forces on both sides are known.
    """
    last = u.size - 1
    for _ in range(steps):
        before, here = 0.0, u[0]
        for i in range(last):
            after = u[i + 1]
            overlap, force = here - after - gap[i], 0.0
            if overlap > 0.0:
                force = k[i] * overlap * math.sqrt(overlap)
            v[i] += gain[i] * (before - force)
            u[i] = here + dt * v[i]
            before, here = force, after
        v[last] += gain[last] * before
        u[last] += dt * v[last]


@njit(error_model="numpy", fastmath={"reassoc", "contract"})
def two_passes(
    u: np.ndarray, v: np.ndarray, gain: np.ndarray, k: np.ndarray, gap: np.ndarray, dt: float, steps: int
) -> None:
    """March beads in two passes without branches: all forces, then all beads."""
    n, force = u.size, np.zeros(u.size + 1)
    for _ in range(steps):
        for i in range(n - 1):
            overlap = max(u[i] - u[i + 1] - gap[i], 0.0)
            force[i + 1] = k[i] * overlap * math.sqrt(overlap)
        for i in range(n):
            v[i] += gain[i] * (force[i] - force[i + 1])
            u[i] += dt * v[i]


def struck(contacts: int, steps: int) -> Simulation:
    """Return beads that touch, the first one moving."""
    beads = [Mass(f"b{i}", 1.0, 1.0 if i == 0 else 0.0) for i in range(contacts + 1)]
    return in_a_row(beads, None, Hertz(STIFFNESS), CentralDifference(), StepRule(dt=DT), duration=steps * DT)


def pressed(contacts: int, steps: int) -> Simulation:
    """Return beads between two walls, all contacts closed, the first bead moving."""
    beads = [Mass(f"b{i}", 1.0, 1e-3 if i == 0 else 0.0) for i in range(contacts - 1)]
    bodies = [Wall("near"), *beads, Wall("far")]
    law, scheme, rule = Hertz(STIFFNESS), CentralDifference(), StepRule(dt=DT)
    return in_a_row(bodies, None, law, scheme, rule, gaps=-PRESSED, duration=steps * DT)


def falling(contacts: int, law: AbstractContactLaw) -> Simulation:
    """Return beads that fall on a wall."""
    random = np.random.default_rng(1)
    masses, speeds = random.uniform(0.5, 2.0, contacts), random.normal(size=contacts) + 1.0
    bodies = [Mass(f"b{i}", float(m), float(v)) for i, (m, v) in enumerate(zip(masses, speeds, strict=True))]
    fields = {"duration": HARD_STEPS * DT, "gravity": 9.81}
    return in_a_row([*bodies, Wall("ground")], None, law, CentralDifference(), StepRule(dt=DT), **fields)


def planned(given: Simulation) -> Plan:
    """Return the plan of a run with the records that a case keeps by default."""
    return prepare(*given.but(records=default_records(given.scene, RECORDS)))


def timed(plan: Plan) -> tuple[float, float, int]:
    """Return the times of the loop and of its history [s], and the steps."""
    assert plan.dt is not None
    assert plan.integrator is not None
    assembly = Assembly(plan, plan.integrator, plan.dt)
    history = RecordedHistory(assembly, plan.integrator)
    entered(loop.start, assembly.memory, plan.dt)
    entered(loop.advance_dated, assembly.memory, plan.dt, 0, assembly.stride, assembly.sample_stride)
    began = time.process_time()
    walk(assembly, history, None)
    middle = time.process_time()
    history.finish()
    _ = history.recorded, history.events, history.energy  # read at their first use
    return middle - began, time.process_time() - middle, assembly.clock.step


def by_hand(march: Callable[..., None], contacts: int, is_pressed: bool, steps: int) -> float:
    """Return the time of a hand-written loop [s].

    Walls are two beads more, too heavy to move.
    """
    n = contacts + 1
    u, v, gain = np.zeros(n), np.zeros(n), np.full(n, DT)
    k, gap = np.full(contacts, STIFFNESS), np.full(contacts, -PRESSED if is_pressed else 0.0)
    v[1 if is_pressed else 0] = 1e-3 if is_pressed else 1.0
    if is_pressed:
        gain[0] = gain[-1] = 0.0
    march(u.copy(), v.copy(), gain, k, gap, DT, 1)
    began = time.process_time()
    march(u, v, gain, k, gap, DT, steps)
    return time.process_time() - began


def rows_of_beads(counts: Sequence[int], repeats: int, steps: int) -> list[list[object]]:
    """Return the table of Hertzian beads."""
    rows: list[list[object]] = []
    for scene in (struck, pressed):
        for contacts in counts:
            taken = max(steps, 200_000 // contacts)
            plan, least = planned(scene(contacts, taken)), np.full(4, np.inf)
            for _ in range(repeats):
                ours, reading, _ = timed(plan)
                hands = [by_hand(march, contacts, scene is pressed, taken) for march in (one_pass, two_passes)]
                least = np.minimum(least, (ours, reading, *hands))
            loop_ns, reading_ns, *by_hand_ns = (1e9 * least / contacts / taken).tolist()
            hand = min(by_hand_ns)
            numbers = [f"{each:.2f}" for each in (loop_ns, hand, loop_ns / hand, reading_ns)]
            rows.append([f"`{scene.__name__}`", contacts, taken, *numbers])
    return rows


def rows_of_hard(counts: Sequence[int], repeats: int) -> list[list[object]]:
    """Return the table of hard contacts."""
    rows: list[list[object]] = []
    for contacts in counts:
        plan = planned(falling(contacts, VelocityComplementarity()))
        took, _, steps = (min(column) for column in zip(*(timed(plan) for _ in range(repeats)), strict=True))
        rows.append([contacts, f"{1e9 * took / contacts / steps:.0f}", f"{1e3 * took / steps:.3g}"])
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--contacts", type=int, nargs="+", default=[10, 100, 1000, 10_000])
    given = parser.parse_args()
    heads = ["chain", "contacts", "steps", "loop, ns", "by hand, ns", "ratio", "reading, ns"]
    beads = table(heads, rows_of_beads(given.contacts, given.repeats, given.steps), ["chain"])
    hard = table(["contacts", "ns per contact and step", "ms per step"], rows_of_hard(given.contacts, given.repeats))
    filled = {"repeats": given.repeats, "machine": processor(), "steps": given.steps, "hard_steps": HARD_STEPS}
    text = PAGE.format(beads=beads, hard=hard, **filled)
    if given.out is None:
        print(text)
    else:
        given.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
