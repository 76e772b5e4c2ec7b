"""Runs that touch once, under a force without jumps, and differ in their step alone: their errors follow an order.

Between the steps such runs are exact, so that their error is that of a force which is constant over each step. Of 350
random beams under a ball (supports, laws, masses, speeds and gaps, with 1e-1 to 1e-4 asked for) the error of the
coarser of two runs was 0.3 to 0.8 times the one that three quarters of the declared order states. With a second touch
it was up to 4 times as large: when and how fast the faces meet again is uneven in the step.
"""

from __future__ import annotations

from collections.abc import Sequence

from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import AbstractHystereticLaw, Hertz
from impactlab.history.base import AbstractHistory
from impactlab.refine.description import MIN_ORDER_SHARE, Description
from impactlab.scene.facts import rods_of
from impactlab.scene.method import Simulation, laws_of

ORDER_SHARE = 0.75  # of the declared order, that an estimate from two such runs assumes
SMOOTH = (Penalty, Hertz, AbstractHystereticLaw)


def order_share(description: Description, histories: Sequence[AbstractHistory], asked: Simulation) -> float:
    """Return the share of the declared order that an estimate from two runs assumes."""
    return ORDER_SHARE if description.alike and touch_once(histories, asked) else MIN_ORDER_SHARE


def touch_once(histories: Sequence[AbstractHistory], asked: Simulation) -> bool:
    """Return whether each run has one period of contact in all, under a law without a jump, and no waves in rods."""
    if any(len(history.contacts) != 1 for history in histories):
        return False
    smooth = all(isinstance(law, SMOOTH) and not law.force_jumps for law in laws_of(*asked))
    return smooth and not rods_of(asked.scene) and not asked.scene.loaded_ends
