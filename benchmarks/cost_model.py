"""Fits the cost model: ``python benchmarks/cost_model.py [--repeats N]``.

Runs every description that steps, of references and of the choice, at several values of fineness on scenes of one and
more bodies, and fits seconds = (step + size x size of a step) x steps above the fixed cost of a run, by least squares
of relative errors. The fixed cost is the least time of all runs; the cost of setting up is the median. The constants
are printed beside those in use (`impactlab.refine.descriptions.cost`), with predicted over measured times. Times are
least ones of repeats, nothing else running; another machine scales all of them, so only the ratios of the descriptions
agree.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import os
from collections import defaultdict
from collections.abc import Iterator

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.optimize import nnls

from impactlab import simulate
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.power_law import Hertz
from impactlab.errors import ImpactlabError
from impactlab.refine.descriptions import cost
from impactlab.refine.descriptions.beams import continuous
from impactlab.refine.descriptions.description import Description
from impactlab.refine.descriptions.suitable import in_turn, stepped
from impactlab.scene import Beam, BeamSegment, Body, Contact, End, Mass, Point, Rayleigh, Rod, Segment, Wall
from impactlab.scene.facts import beams_of
from impactlab.scene.method import Simulation, StepRule
from impactlab.testing.scenes import simulation

RULE = StepRule(dt=1e-6)  # replaced by each description
FINENESS = (12, 20, 50, 81, 131, 212, 343, 555, 898, 1453, 2351, 3804)
MIN_PREDICTED_S, MAX_PREDICTED_S = 2e-4, 0.1  # s: shorter runs are their fixed cost, longer ones take too long
NAMES = {  # of beams under a power law a step costs more, and a margin may differ: sizes and set-ups tell them apart
    (value.size_s, value.setup_s): name for name, value in vars(cost).items() if isinstance(value, cost.Cost)
}


def rods(count: int, law: Hertz | AdditionDeletion, damping: float) -> Simulation:
    """Return a mass that strikes a row of rods."""
    bodies: dict[str, Body] = {"mass": Mass("mass", 1.0, 1.0)}
    contacts, face = [], Point("mass", 0.0, "mass")
    for number in range(count):
        name = f"rod{number}"
        segment = Segment(0.3, 9e-4, 2.1e11, 7850.0)
        bodies[name] = Rod(name, (segment,), End("free"), End("free"), damping=Rayleigh(mass=damping))
        contacts.append(Contact(face, Point(name, 0.0, f"{name}.left"), 1e-5 * number))
        face = Point(name, 0.3, f"{name}.right")
    return simulation(f"{count} rods", bodies, tuple(contacts), 4e-4, None, RULE, law=law)


def struck(body: Beam | Wall, x: float, duration: float, law: Hertz | AdditionDeletion) -> Simulation:
    """Return a ball that strikes one other body."""
    contact = Contact(Point("ball", 0.0, "ball"), Point(body.name, x, body.name), 0.0)
    bodies: dict[str, Body] = {"ball": Mass("ball", 0.1, 1.0), body.name: body}
    return simulation(body.name, bodies, (contact,), duration, None, RULE, law=law)


def scenes() -> Iterator[Simulation]:
    """Yield rows of rods, beams of both theories, and a wall.

    Contacts are soft and hard; rows have one to four rods.
    """
    for count in (1, 2, 4):
        yield rods(count, Hertz(1e11), 0.0)
        yield rods(count, AdditionDeletion(), 500.0)
    plain = BeamSegment(length=1.0, area=3e-4, inertia=8e-9, young=2.1e11, density=7850.0)
    sheared = dataclasses.replace(plain, shear_stiffness=2e7, rotary_inertia=6.28e-5)
    clamped = End("clamped"), End("clamped")
    yield struck(Beam("beam", (plain,), *clamped), 0.5, 1e-3, Hertz(1e9))
    yield struck(Beam("beam", (plain,), *clamped, damping=Rayleigh(mass=100.0)), 0.5, 1e-3, Hertz(1e9))
    short = dataclasses.replace(plain, length=0.1, shear_stiffness=2e7, rotary_inertia=6.28e-5)
    yield struck(Beam("beam", (short,), *clamped, theory="timoshenko"), 0.05, 1e-4, Hertz(1e10))
    for law in (Hertz(1e9), AdditionDeletion()):
        yield struck(Beam("beam", (sheared,), *clamped, theory="timoshenko"), 0.5, 1e-3, law)
    yield struck(Wall("wall"), 0.0, 0.01, Hertz(1e9))


def main() -> None:
    """Measure, fit and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5)
    given = parser.parse_args()
    rows: dict[str, list[tuple[float, float, float, float]]] = defaultdict(list)
    setups: dict[str, list[float]] = defaultdict(list)
    least = min(measured(description, given.repeats) for description in coarsest())
    for scene in scenes():
        grids = continuous(scene) if beams_of(scene.scene) else None
        known = [*stepped(scene), *(each for each in in_turn(scene)[0] if each.unit), *([grids] if grids else [])]
        for description in known:
            for fineness in FINENESS:
                predicted = description.seconds(fineness)
                if fineness >= description.min_fineness // 3 and MIN_PREDICTED_S < predicted < MAX_PREDICTED_S:
                    steps, size = description.work(fineness)
                    try:
                        runs = [simulate.run(*description.simulation(fineness)) for _ in range(given.repeats + 1)]
                    except ImpactlabError:  # a mesh too coarse for its contact
                        continue
                    seconds = min(run.cost.solve_s for run in runs[1:])  # the first one compiles
                    name = NAMES[description.cost.size_s, description.cost.setup_s]
                    rows[name].append((steps, steps * size, seconds, predicted))
                    setups[name].append(min(run.cost.setup_s for run in runs[1:]))
    print(f"least time of a run {least:.2g} s ({cost.FIXED_S:.2g})")
    print("constants fitted and in use [s]; predicted over measured: median, 5 and 95 %; median of setting up")
    for name, found in rows.items():
        steps, sizes, seconds, predicted = np.array(found).T
        used: cost.Cost = getattr(cost, name)
        terms = np.column_stack((steps, sizes if used.size_s else 0.0 * sizes)) / seconds[:, None]
        fitted, _ = nnls(terms, np.maximum(seconds - least, 0.0) / seconds)
        ratio = np.quantile(predicted / seconds, (0.5, 0.05, 0.95))
        print(
            f"{name:14} step {fitted[0]:8.2g} ({used.step_s:.2g}), size {fitted[1]:8.2g} ({used.size_s:.2g}); "
            f"{ratio[0]:5.2f}, {ratio[1]:5.2f} to {ratio[2]:5.2f} of {len(found)} runs; "
            f"set-up {np.median(setups[name]):.2g} ({used.setup_s:.2g})"
        )


def coarsest() -> Iterator[Description]:
    """Give the descriptions of the choice whose runs take the fewest steps."""
    for scene in scenes():
        yield from (each for each in in_turn(scene)[0] if each.unit and each.work(each.min_fineness)[0] < 300.0)


def measured(description: Description, repeats: int) -> float:
    """Return the least time of solving at the coarsest fineness [s]; inf where it fails."""
    try:
        runs = [simulate.run(*description.simulation(description.min_fineness)) for _ in range(3 * repeats)]
    except ImpactlabError:
        return math.inf
    return min(run.cost.solve_s for run in runs)


if __name__ == "__main__":
    main()
