"""Predicted over measured cost of the exact solver on random scenes: ``python benchmarks/exact_cost.py [--scenes N]``.

Rows of rods of one to four materials, masses, walls, steps, springs, dashpots, end masses, several contacts, lengths
that have no common measure. Measured times are least ones of a few repeats, nothing else running; on another machine
all ratios are another by one factor.
"""

from __future__ import annotations

import argparse
import itertools
import time
from typing import NamedTuple

import numpy as np

from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import ImpactlabError
from impactlab.exact.cost import predicted_s
from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.solve import solve
from impactlab.scene import Contact, End, Mass, Point, Rod, Segment, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.testing.scenes import simulation

MATERIALS = ((2.1e11, 7900.0), (7.0e10, 2700.0), (1.1e11, 8900.0), (3.0e9, 1200.0), (1.16e11, 4500.0))
LONGEST = 2.0  # s of solving: longer runs are not repeated


class Row(NamedTuple):
    """One scene."""

    name: str
    predicted_s: float
    measured_s: float
    intervals: int
    pieces: int
    events: int
    fault: str = ""


def random_end(rng: np.random.Generator, rod_mass: float, stiffness: float, impedance: float) -> End:
    """Return how an outer end of a row is held."""
    kind = str(rng.choice(["free", "free", "free", "clamped", "mass", "spring", "dashpot"]))
    if kind == "mass":
        return End("mass", rod_mass * float(10.0 ** rng.uniform(-3.0, 1.0)))
    if kind == "spring":
        return End("spring", stiffness * float(10.0 ** rng.uniform(-2.0, 1.0)))
    if kind == "dashpot":
        return End("dashpot", impedance * float(rng.uniform(0.0, 2.0)))
    return End(kind)  # type: ignore[arg-type]


def random_rod(rng: np.random.Generator, name: str, left: bool, right: bool) -> Rod:
    """Return a rod; ends that nothing touches may be held."""
    common = rng.random() < 0.5  # lengths that have a common measure
    segments = []
    for _ in range(int(rng.choice([1, 1, 1, 2, 3, 4]))):
        length = 0.05 * float(rng.integers(1, 9)) if common else float(rng.uniform(0.03, 0.5))
        young, density = MATERIALS[int(rng.integers(0, 5 if rng.random() < 0.5 else 1))]
        segments.append(Segment(length, float(10.0 ** rng.uniform(-4.0, -3.0)), young, density))
    mass = sum(each.density * each.area * each.length for each in segments)
    length, first = sum(each.length for each in segments), segments[0]
    stiffness = first.young * first.area / length
    ends = [
        random_end(rng, mass, stiffness, first.impedance) if touched is False else End("free")
        for touched in (left, right)
    ]
    velocity = float(rng.uniform(-1.0, 2.0)) if all(end.kind in ("free", "mass") for end in ends) else 0.0
    return Rod(name, tuple(segments), ends[0], ends[1], velocity)


def random_scene(rng: np.random.Generator, number: int) -> Simulation:
    """Return a row of bodies in contact.

    A rod stands on one side of each hard contact, with a bare face.
    """
    kinds = ["rod"]
    for side in range(2):
        while rng.random() < 0.6 and len(kinds) < 4:
            kind = str(rng.choice(["rod", "mass", "wall"]))
            if kind != "rod" and kinds[-1 if side else 0] != "rod":
                break
            kinds = [*kinds, kind] if side else [kind, *kinds]
            if kind == "wall":
                break
    if len(kinds) == 1:
        kinds = ["mass", "rod"]
    bodies: list[Rod | Mass | Wall] = []
    for i, kind in enumerate(kinds):
        name = f"b{i}"
        if kind == "rod":
            bodies.append(random_rod(rng, name, i > 0, i + 1 < len(kinds)))
        elif kind == "mass":
            bodies.append(Mass(name, float(10.0 ** rng.uniform(-2.0, 1.5)), float(rng.uniform(-1.0, 3.0))))
        else:
            bodies.append(Wall(name))
    contacts, laws = [], []
    for a, b in itertools.pairwise(bodies):
        left = Point(a.name, a.length, f"{a.name}.right") if isinstance(a, Rod) else Point(a.name, 0.0, a.name)
        right = Point(b.name, 0.0, f"{b.name}.left" if isinstance(b, Rod) else b.name)
        law: Penalty | WaveIdentification = WaveIdentification()
        if rng.random() < 0.3:
            damping = float(10.0 ** rng.uniform(2.0, 4.0)) if rng.random() < 0.3 else 0.0
            law = Penalty(stiffness=float(10.0 ** rng.uniform(6.5, 10.0)), damping=damping)
        gap = 0.0 if rng.random() < 0.5 else float(10.0 ** rng.uniform(-6.0, -3.5))
        contacts.append(Contact(left, right, gap))
        laws.append(law)
    rods = [body for body in bodies if isinstance(body, Rod)]
    trip = max(body.round_trip for body in rods)
    duration = trip * float(10.0 ** rng.uniform(0.0, 2.0))
    return simulation(
        f"{number}: {' '.join(kinds)}", {body.name: body for body in bodies}, tuple(contacts), duration, None,
        StepRule(courant=1.0), round_trip=trip, law=laws,
    )  # fmt: skip


def measured(scene: Simulation) -> Row:
    """Return the row of a scene."""
    predicted = predicted_s(*scene)
    try:
        history = solve(*scene)
    except ImpactlabError as error:
        return Row(scene.scene.name, predicted, np.nan, 0, 0, 0, error.text)
    best = history.cost.solve_s
    began = time.perf_counter()
    while time.perf_counter() - began < 20.0 * best and best < LONGEST:
        best = min(best, solve(*scene).cost.solve_s)
    # Those of long runs are dropped.
    pieces = int(np.sum(history.log.junctions["records"])) if isinstance(history, ContinuousHistory) else 0
    return Row(scene.scene.name, predicted, best, history.cost.steps, pieces, len(history.events))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--scenes", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    rows = []
    for number in range(given.scenes):
        try:
            row = measured(random_scene(rng, number))
        except ImpactlabError as error:
            print(f"{number}: refused: {error.text}")
            continue
        rows.append(row)
        ratio = row.predicted_s / row.measured_s
        print(
            f"{row.name:32} predicted {1e3 * row.predicted_s:9.3f} ms, measured {1e3 * row.measured_s:9.3f} ms, "
            f"ratio {ratio:7.2f}, {row.intervals} intervals, {row.pieces} pieces, {row.events} events {row.fault}",
            flush=True,
        )
    ratios = np.array([row.predicted_s / row.measured_s for row in rows if not row.fault])
    within = float(np.mean((ratios < 3.0) & (ratios > 1.0 / 3.0)))
    print(
        f"{len(rows)} scenes, {sum(bool(row.fault) for row in rows)} not solved; predicted over measured: median "
        f"{np.median(ratios):.2f}, {np.quantile(ratios, 0.05):.2f} to {np.quantile(ratios, 0.95):.2f} for nine of ten, "
        f"extremes {ratios.min():.2f} and {ratios.max():.2f}; within a factor of 3: {100 * within:.0f} %"
    )


if __name__ == "__main__":
    main()
