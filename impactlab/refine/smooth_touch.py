"""Runs that touch once, under a force without jumps, and differ in their step alone: their errors follow an order.

Between the steps such runs are exact, so that their error is that of a force which is constant over each step. It was
measured on 500 random beams under a ball (supports, laws, masses, speeds and gaps, with 1e-1 to 1e-4 asked for):

- Three quarters of the declared order state, of two runs, 1.3 times the error of the coarser one and more; in 3 of 2900
  pairs less, where the error was below a twentieth of the tolerance. With a second touch the error was up to 4
  times as large as stated: when and how fast the faces meet again is uneven in the step. On beams that shear half the
  order is left, as the error of their modes left out, which is added, may be larger than stated.
- Of one run, four times the larger of the second differences of its force and of its predicted error is at least 1.2
  times the error, and mostly far more (40 times in the median), so that it serves where steps cost next to nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import AbstractHystereticLaw, Hertz
from impactlab.history.base import AbstractHistory
from impactlab.refine.description import MIN_ORDER_SHARE, Description
from impactlab.refine.raw_records import records_of
from impactlab.scene.facts import beams_of, rods_of
from impactlab.scene.method import Simulation, laws_of

ORDER_SHARE = 0.75  # of the declared order, that an estimate from two such runs assumes
SAFETY_ALONE = 4.0  # factor on the second differences of a run and on its predicted error
ROUGHNESS, ROUGHNESS_OF_SPRINGS = 12.0, 40.0  # second differences over the predicted error: nine in ten have less
SMOOTH = (Penalty, Hertz, AbstractHystereticLaw)


def is_smooth(asked: Simulation) -> bool:
    """Return whether all contacts have a law without a jump, and neither rods nor loads send waves."""
    smooth = all(isinstance(law, SMOOTH) and not law.force_jumps for law in laws_of(*asked))
    return smooth and not rods_of(asked.scene) and not asked.scene.loaded_ends


def stated_alone(asked: Simulation) -> float:
    """Return the error that one run states, over its predicted one; inf where two are needed.

    They are with several contacts, and with probes, whose convergence two runs show.
    """
    if len(asked.scene.contacts) != 1 or asked.scene.probes or not is_smooth(asked):
        return float("inf")
    return SAFETY_ALONE * max(ROUGHNESS_OF_SPRINGS if law.is_spring else ROUGHNESS for law in laws_of(*asked))


def error_alone(history: AbstractHistory, predicted: float) -> float:
    """Return the error of a run of a scene that `stated_alone` has allowed; inf where it takes two to know it."""
    records = records_of(history)
    if records is None or len(history.contacts) != 1:
        return float("inf")
    return SAFETY_ALONE * max(records.force(0, False).roughness(), predicted)


def order_share(description: Description, histories: Sequence[AbstractHistory], asked: Simulation) -> float:
    """Return the share of the declared order that an estimate from two runs assumes."""
    once = description.alike and all(len(history.contacts) == 1 for history in histories) and is_smooth(asked)
    sheared = any(beam.theory == "timoshenko" for beam in beams_of(asked.scene))
    return ORDER_SHARE if once and not sheared else MIN_ORDER_SHARE
