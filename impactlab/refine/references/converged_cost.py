"""Predicted cost of a converged reference: its levels, their steps, their records and their comparisons."""

from __future__ import annotations

import math

from impactlab.refine.descriptions.description import RATIO, Description
from impactlab.refine.descriptions.rods import MIN_FINENESS
from impactlab.refine.references.converged import (
    CHECK_UNCERTAINTY,
    FIRST_SHARE,
    MIN_CHECK_S,
    descriptions_of,
    least_s,
    target,
)
from impactlab.refine.references.reference_record import FULL_BUDGET_S
from impactlab.scene.facts import beams_of
from impactlab.scene.method import Method, Simulation, laws_of
from impactlab.scene.problem import RECORDS, Scene
from impactlab.scene.sizes import default_records

CONTACT_S = 1.5e-7  # a step and contact, beside the first
LEVEL_S = 3e-3  # of a level, for each contact and the first
COMPARISON_S = 4e-3  # of two levels, likewise; each is compared with two others
FIRST_UNCERTAINTY, FIRST_OF_BEAMS = 1e-3, 5e-4  # expected of a reference at its coarsest level
FIRST_OF_YIELDING = 2e-2  # the same where a contact yields; steps that do not end where it begins to are of first order


def predicted_s(scene: Scene, method: Method) -> float | None:
    """Return the predicted time of a converged reference [s].

    None where none would converge within the budget.
    """
    request = Simulation(scene, method).but(records=default_records(scene, RECORDS), frames=())
    found = list(descriptions_of(request))
    if not found or all(least_s(each) > FIRST_SHARE * FULL_BUDGET_S for each in found):
        return None
    contacts, first, most = max(1, len(scene.contacts)), FIRST_UNCERTAINTY, math.inf
    if any(not law.smooth and not law.hard for law in laws_of(scene, method)):
        first, most = FIRST_OF_YIELDING, 1.0
    elif beams_of(scene):
        first = FIRST_OF_BEAMS
    total, solving = _levels_s(found[0], contacts, first, most, FIRST_SHARE * FULL_BUDGET_S, alone=len(found) == 1)
    if len(found) > 1:
        total += _levels_s(found[1], contacts, first, most, max(MIN_CHECK_S, solving), CHECK_UNCERTAINTY)[0]
    return total


def _levels_s(
    description: Description,
    contacts: int,
    first: float,
    most: float,
    budget: float,
    enough: float = 0.0,
    alone: bool = False,
) -> tuple[float, float]:
    """Return the predicted times of all levels and of their solving [s].

    The levels end at an uncertainty. They end at a budget of solving. ``first`` is the uncertainty that is expected of
    the coarsest level, ``most`` the largest order with which it falls.
    """
    level, solving, total, count = MIN_FINENESS, 0.0, 0.0, 0
    while True:
        fineness = description.per_level * level
        seconds, steps = description.seconds(fineness), description.work(fineness)[0]
        if solving + seconds > budget:
            return total, solving
        solving += seconds
        of_contacts = CONTACT_S * (contacts - 1) * steps
        total += (
            seconds + description.finding(fineness) + of_contacts + contacts * (LEVEL_S + min(2, count) * COMPARISON_S)
        )
        count += 1
        level = round(RATIO * level)
        order = min(most, max(1.0, description.reference_order))
        uncertainty = first * (MIN_FINENESS * description.per_level / fineness) ** order
        next_s = description.seconds(description.per_level * level)
        if count >= 3 and uncertainty <= max(enough, target(next_s, alone)):
            return total, solving
