"""Random Hopkinson trains solved exactly, compared with rods and lattices.

python studies/exact_trains.py [--trains 200] [--seed 1] [--out TABLE.md]

Every train is solved over 1 ms and compared with the same train whose bars and specimen are one rod of three segments,
as long as that rod is not pulled where the faces are, and with delay lines on a lattice of 0.5 ns, which share nothing
with the solver (`tests/reference/lattice.py`), up to the fortieth event: the lattice cannot follow a specimen that
rattles on. A second table has the cost of a rod between two walls by the number of its contacts.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from impactlab.errors import ImpactlabError
from impactlab.exact.solve import solve
from impactlab.scene import Wall
from impactlab.scene.method import Simulation
from tests.reference.exact_scenes import HARD, point, rod, scene
from tests.reference.trains import Differences, compare, random_train

COUNTS = (100, 1000, 2000, 5000, 10_000)


def walls(contacts: int) -> Simulation:
    """Return a rod between two walls over so many contacts.

    Units are c = Z = L = 1, with gaps of 4 and the velocity 1.
    """
    bar, left, right = rod(velocity=1.0), Wall("left"), Wall("right")
    pairs = [
        (point(left), point(bar, "left"), 4.0, HARD),
        (point(bar, "right"), point(right), 4.0, HARD),
    ]
    return scene([bar, left, right], pairs, 10.0 * contacts)


def trains(count: int, seed: int) -> str:
    """Return the table of random trains."""
    rng = np.random.default_rng(seed)
    found: list[Differences] = []
    stopped = []
    for number in range(count):
        train = random_train(rng)
        try:
            found.append(compare(train))
        except ImpactlabError as error:
            stopped.append(f"{number}: {error.text}")
        print(number, found[-1] if found else stopped[-1], file=sys.stderr, flush=True)
    lines = [
        f"{count} trains (seed {seed}), 1 ms: {len(found)} solved to the end, {len(stopped)} not. {'; '.join(stopped)}",
        "",
        "| | median | largest |",
        "|---|---:|---:|",
    ]
    names = {
        "lattice_displacement": "displacements against the lattice, over the largest",
        "lattice_impulse": "impulses of the contacts at all times against the lattice, over the largest",
        "segments_force": "forces against one rod of three segments, over the largest",
        "segments_displacement": "displacements against one rod of three segments, over the largest",
        "together": "time that the bars hold together [s]",
        "energy": "energy balance, over the energy",
        "events": "openings and closings",
        "intervals": "intervals solved",
        "pieces": "pieces kept",
    }
    for name, words in names.items():
        values = np.array([getattr(each, name) for each in found], dtype=float)
        lines.append(f"| {words} | {np.median(values):.2g} | {np.max(values):.2g} |")
    return "\n".join(lines)


def bounces() -> str:
    """Return the table of a rod between walls."""
    lines = ["| contacts | time to solve [s] | intervals | pieces kept | energy error | end velocity - 1 |"]
    lines.append("|---:|---:|---:|---:|---:|---:|")
    solve(*walls(10))
    for count in COUNTS:
        case = walls(count)
        began = time.perf_counter()
        history = solve(*case)
        took = time.perf_counter() - began
        balance = float(np.max(np.abs(history.energy.balance))) / float(history.energy.total[0])
        pieces = int(np.sum(history.log.junctions["records"]))
        end = abs(float(history.evaluate(case.scene.duration, "velocity:rod@0.5"))) - 1.0
        lines.append(
            f"| {len(history.contacts)} | {took:.3g} | {history.cost.steps} | {pieces} | {balance:.1e} | {end:.1e} |"
        )
    return "\n".join(lines)


def main() -> int:
    """Compute both tables, print them and write them if requested."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--trains", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, help="page to write")
    given = parser.parse_args()
    page = (
        f"# Hopkinson trains and bouncing rods, solved exactly\n\n{trains(given.trains, given.seed)}\n\n{bounces()}\n"
    )
    print(page)
    if given.out is not None:
        given.out.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
