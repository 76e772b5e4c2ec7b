"""Scenes whose forces have no jumps, and their error estimates.

It states which runs state their error alone, and the order that two runs may assume.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import AbstractHystereticLaw, Hertz
from impactlab.history.base import AbstractHistory
from impactlab.refine.descriptions.description import MIN_ORDER_SHARE, Description
from impactlab.scene.facts import beams_of, is_lossy
from impactlab.scene.method import Simulation, laws_of

ORDER_SHARE = 0.75  # of the declared order, assumed by an estimate from two such runs
SAFETY_ALONE = 1.25  # factor on the error that one run shows
SHOWN, SHOWN_OF_SPRINGS = 3.2, 2.2  # error that one run shows over the predicted one, in most scenes
MAX_CONTACTS = 8  # the equation of their errors is solved with a full matrix in every step
SMOOTH = (Penalty, Hertz, AbstractHystereticLaw)


def are_soft(request: Simulation) -> bool:
    """Return whether all contacts have a law without a jump."""
    return all(isinstance(law, SMOOTH) and not law.force_jumps for law in laws_of(*request))


def is_smooth(request: Simulation) -> bool:
    """Return whether no law has a jump and no waves exist.

    Waves are sent by rods and by loads on ends.
    """
    return are_soft(request) and not request.scene.wave_bodies and not request.scene.loaded_ends


def stated_alone(request: Simulation) -> float:
    """Return the ratio of the stated to the predicted error of one run.

    It is inf where two runs are needed. Two are needed with probes, as only two runs show whether these converge, with
    beams that lose energy, which are not stepped exactly, and with many contacts.
    """
    if request.scene.probes or not 0 < len(request.scene.contacts) <= MAX_CONTACTS or not is_smooth(request):
        return math.inf
    if any(is_lossy(beam) for beam in beams_of(request.scene)):
        return math.inf
    return SAFETY_ALONE * max(SHOWN_OF_SPRINGS if law.is_spring else SHOWN for law in laws_of(*request))


def order_share(description: Description, histories: Sequence[AbstractHistory], request: Simulation) -> float:
    """Return the share of the declared order that an estimate from two runs assumes."""
    once = description.alike and all(len(history.contacts) == 1 for history in histories) and is_smooth(request)
    plain = all(beam.theory != "timoshenko" and not is_lossy(beam) for beam in beams_of(request.scene))
    return ORDER_SHARE if once and plain else MIN_ORDER_SHARE
