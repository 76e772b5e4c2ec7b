"""Fits the cost model of the descriptions: ``python benchmarks/cost_model.py [--repeats N]``.

Runs every description that steps (`impactlab.refine.descriptions`, `impactlab.refine.beam_descriptions`) at several
values of fineness on scenes of one and more bodies, and fits seconds = fixed + (step + size x unknowns) x steps, by
least squares of relative errors. The constants are printed beside those in use (`impactlab.refine.cost`), with the
spread of predicted over measured times. Least times of repeats on one core; a machine scales all of them alike, so
the ratios should agree among the descriptions.
"""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Callable, Iterator
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.optimize import nnls

from impactlab import simulate
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.power_law import Hertz
from impactlab.refine import cost
from impactlab.refine.beam_descriptions import continuous
from impactlab.refine.cost import StepCost
from impactlab.refine.descriptions import Description
from impactlab.refine.serving import stepped
from impactlab.scene import Beam, BeamSegment, Contact, End, Mass, Point, Rod, Segment, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.testing.scenes import simulation

STEEL = {"young": 2.1e11, "density": 7850.0}
COSTS = {
    "rigid bodies": "RIGID",
    "adaptive": "ADAPTIVE",
    "stepped delay line": "DELAY_LINE",
    "lumped mesh, central": "LUMPED_MESH",
    "consistent mesh, midpoint": "IMPLICIT_MESH",
    "lumped mesh, midpoint": "IMPLICIT_MESH",
    "modes": "BEAM_MODES",
    "consistent mesh under": "BEAM_MESH",
    "continuous beams": "BEAM_GRIDS",
}
"""Names of the constants in use, by the first words of a description."""
FINENESS = (50, 81, 131, 212, 343, 555, 898)
MAX_SOLVE_S = 0.5  # s: finer runs are left out
MIN_SOLVE_S = 3e-4  # s: shorter ones are the fixed cost


class Measured(NamedTuple):
    """One run: the steps and sizes that its prediction counts, and its time of solving [s]."""

    steps: float
    size: float
    seconds: float


def scenes() -> Iterator[Simulation]:
    """Give rows of rods struck by a mass, a sphere on beams of both theories, and a ball on a wall."""
    rule = StepRule(dt=1e-6)
    for law in (Hertz(1e11), AdditionDeletion()):
        for count in (1, 3):
            bodies: dict[str, object] = {"mass": Mass("mass", 1.0, 1.0)}
            contacts = []
            previous = Point("mass", 0.0, "mass")
            for number in range(count):
                name = f"rod{number}"
                bodies[name] = Rod(name, (Segment(0.3, 9e-4, **STEEL),), End("free"), End("free"))
                contacts.append(Contact(previous, Point(name, 0.0, f"{name}.left"), 1e-5 * number))
                previous = Point(name, 0.3, f"{name}.right")
            yield simulation(f"{count} rods", bodies, tuple(contacts), 4e-4, None, rule, law=law)
    for theory, law in (("euler_bernoulli", Hertz(1e9)), ("timoshenko", Hertz(1e9)), ("timoshenko", AdditionDeletion())):
        shear = {"shear_stiffness": 2e7, "rotary_inertia": 6.28e-5} if theory == "timoshenko" else {}
        segment = BeamSegment(length=1.0, area=3e-4, inertia=8e-9, **STEEL, **shear)
        beam = Beam("beam", (segment,), End("clamped"), End("clamped"), theory=theory)
        bodies = {"ball": Mass("ball", 0.1, 1.0), "beam": beam}
        contact = Contact(Point("ball", 0.0, "ball"), Point("beam", 0.5, "beam"), 0.0)
        yield simulation(theory, bodies, (contact,), 1e-3, None, rule, law=law)
    contact = Contact(Point("ball", 0.0, "ball"), Point("wall", 0.0, "wall"), 0.0)
    bodies = {"ball": Mass("ball", 2.0, 1.0), "wall": Wall("wall")}
    yield simulation("ball", bodies, (contact,), 0.01, None, rule, law=Hertz(1e9))


def counted(description: Description, fineness: int) -> tuple[float, float]:
    """Return the steps and the sizes times steps of a prediction, by its constants replaced by 0 and 1."""
    return description.seconds(fineness), 0.0


def measured(description: Description, fineness: int, repeats: int) -> float:
    """Return the least time of solving [s]."""
    scene, method = description.simulation(fineness)
    return min(simulate.run(scene, method).cost.solve_s for _ in range(repeats))
