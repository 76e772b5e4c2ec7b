"""Description of rows of rigid bodies under power laws: leapfrog, which solves no contacts together.

Under schemes whose force depends on the end of a step neighbours in a row are solved together, at a hundred times the
cost. Only the automatic choice takes leapfrog: references keep schemes that conserve energy to rounding.
"""

from __future__ import annotations

import math
from weakref import WeakKeyDictionary

from impactlab.contact.power_law import Hertz
from impactlab.history.base import AbstractHistory
from impactlab.integrators.central_difference import CentralDifference
from impactlab.refine.descriptions import cost
from impactlab.refine.descriptions.contact_times import shortest_rise
from impactlab.refine.descriptions.description import Description
from impactlab.refine.errors.between_records import error_between_records
from impactlab.refine.errors.distances import counted
from impactlab.scene.method import Method, Simulation, StepRule, laws_of
from impactlab.scene.sizes import default_records, keeps_default

MAX_RECORDS = 200_000  # instants kept, as of every description
STEPS_A_RECORD = 32  # at most, of the finest run: with more, cubics between the instants kept are the larger error
KEPT_STEPS = 4  # one in so many steps of a long run is kept: the error by cubics between them is far below the steps'
MIN_KEPT = 2000  # instants kept of a run that has so many steps
COARSEST = 2.0  # steps in the shortest rise sqrt(m/k): leapfrog is stable up to a step of twice that of a pair


def serves(request: Simulation) -> bool:
    """Return whether several contacts of a scene without rods and beams are elastic power laws."""
    laws = laws_of(*request)
    return len(laws) > 1 and not request.scene.elastic and all(isinstance(law, Hertz) for law in laws)


def row_of_beads(request: Simulation) -> Description:
    """Return the description by its number of steps."""
    scene, duration, rise = request.scene, request.scene.duration, shortest_rise(*request)
    # A finer run keeps more instants, as long as memory allows it. Runs that keep the same few would have an error in
    # common, which none of them shows: that of a force which still rises at the end.
    most = default_records(scene, MAX_RECORDS)

    known = WeakKeyDictionary[AbstractHistory, float]()

    def between_records(_: int, history: AbstractHistory | None) -> float:
        if history is None or "displacements" not in counted(request)[2]:
            return 0.0
        if history not in known:
            known[history] = error_between_records(history, scene, KEPT_STEPS)
        return known[history]

    def simulation(steps: int) -> Simulation:
        method = Method(request.method.laws, {}, CentralDifference(), StepRule(dt=duration / steps))
        made = Simulation(scene, method)
        kept = min(most, max(MIN_KEPT, steps // KEPT_STEPS))
        return made.but(records=kept + 1) if keeps_default(scene) else made

    return Description(
        "rigid bodies, leapfrog",
        "steps",
        simulation,
        cost.BEADS,
        lambda n: (n, len(scene.contacts)),
        # In a row the errors of all beads that a wave has passed add up, in time and so in displacement.
        error=lambda n: (duration / n / rise) ** 2,
        safety=3.0,
        unseen=between_records,
        remedy="" if keeps_default(scene) else "a larger solve.records",
        min_fineness=max(40, math.ceil(COARSEST * duration / rise)),
        max_fineness=max(STEPS_A_RECORD * most, math.ceil(2.0 * COARSEST * duration / rise)),
    )
