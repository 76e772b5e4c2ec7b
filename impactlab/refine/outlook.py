"""Whether a reference is computed unasked: its predicted seconds beside those of the run that is measured against it.

No clock is read, so that the same case has the same summary on every machine. Both predictions count work: steps,
unknowns and contacts of the run, and of the levels that a converged reference is expected to need. A level costs more
than its steps: bodies are built, records are read, and it is compared with the levels before it, contact by contact.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

from impactlab.exact import solve as exact
from impactlab.exact.cost import INTERVAL_S, begin
from impactlab.history.base import AbstractHistory
from impactlab.refine.description import RATIO, Description
from impactlab.refine.descriptions import MIN_FINENESS
from impactlab.refine.reference import (
    CHECK_UNCERTAINTY,
    CONVERGED,
    FIRST_SHARE,
    FULL_BUDGET_S,
    MIN_CHECK_S,
    Reference,
    descriptions_of,
    find,
    least_s,
    target,
)
from impactlab.scene.facts import beams_of
from impactlab.scene.method import Method, Simulation, laws_of, theories
from impactlab.scene.problem import RECORDS, Scene
from impactlab.scene.sizes import default_records

MAX_RATIO = 10.0  # of the predicted seconds of a reference to those of the run, up to which it is computed unasked
MAX_UNASKED_S = 10.0  # s predicted of a reference, up to which it is computed unasked, however long the run took
# Seconds, measured on the cases of the suite by the time of the processor.
SETUP_S = 8e-4  # of a run, for a body and its contacts
STEP_S = 3e-7
UNKNOWN_S = 3e-9  # a step and unknown
CONTACT_S = 1.5e-7  # a step and contact, beside the first
RATE_S = 1e-4  # an evaluation of the equations of motion by an adaptive integrator
EXACT_RATIO = 8.0  # of an interval in all to what it costs without its multiplications
LEVEL_S = 3e-3  # of a level, for each contact and the first
COMPARISON_S = 4e-3  # of two levels, likewise; each is compared with two others
FIRST_UNCERTAINTY, FIRST_OF_BEAMS = 1e-3, 1e-4  # expected of a reference at its coarsest level
FIRST_OF_YIELDING = 2e-2  # the same where a contact yields; steps that do not end where it begins to are of first order


class Outlook(NamedTuple):
    """What is known of a reference before it is computed."""

    status: Literal["exact", "converged", "not_computed", "none"]
    about_s: float | None = None  # s, predicted of its computation; None where there is none

    @property
    def text(self) -> str | None:
        """Why there are no errors, for people; None where there are."""
        if self.status == "not_computed":
            return f"not computed; --reference computes it, about {float(f'{self.about_s or 0.0:.1g}'):g} s"
        if self.status == "none":
            return f"not measured: no exact answer, and none that converges within {FULL_BUDGET_S:g} s"
        return None

    @property
    def document(self) -> dict[str, Any]:
        """The entry of a summary: status, predicted seconds where it was not computed, text."""
        about_s = self.about_s if self.status == "not_computed" else None
        return {"status": self.status, "about_s": about_s, "text": self.text}


def run_s(history: AbstractHistory) -> float:
    """Return the predicted time of a run [s], from the counts of its history."""
    done, contacts = history.cost, len(history.scene.contacts)
    setup = SETUP_S * max(1, contacts)
    if done.rhs_evaluations is not None:
        return setup + RATE_S * done.rhs_evaluations
    if history.dt is None:
        return setup + EXACT_RATIO * INTERVAL_S * done.steps
    return setup + done.steps * (STEP_S + UNKNOWN_S * (done.unknowns or 0) + CONTACT_S * max(0, contacts - 1))


def reference_s(scene: Scene, method: Method) -> Outlook:
    """Return the predicted seconds of the reference that is asked for: exact, else converged."""
    if any(theories(scene, method)):
        return Outlook("none")
    if exact.serves(scene, method) is None:
        predicted = begin(scene, method).predicted_s
        if predicted <= FULL_BUDGET_S or all(law.branches() is None for law in laws_of(scene, method)):
            return Outlook("exact", predicted)
    return converged_s(scene, method)


def converged_s(scene: Scene, method: Method) -> Outlook:
    """Return the predicted seconds of a converged reference."""
    asked = Simulation(scene, method).but(records=default_records(scene, RECORDS), frames=())
    found = list(descriptions_of(asked))
    if not found or all(least_s(each) > FIRST_SHARE * FULL_BUDGET_S for each in found):
        return Outlook("none")
    contacts, first, most = max(1, len(scene.contacts)), FIRST_UNCERTAINTY, math.inf
    if any(not law.smooth and not law.hard for law in laws_of(scene, method)):
        first, most = FIRST_OF_YIELDING, 1.0
    elif beams_of(scene):
        first = FIRST_OF_BEAMS
    total, solving = _levels_s(found[0], contacts, first, most, FIRST_SHARE * FULL_BUDGET_S, alone=len(found) == 1)
    if len(found) > 1:
        total += _levels_s(found[1], contacts, first, most, max(MIN_CHECK_S, solving), CHECK_UNCERTAINTY)[0]
    return Outlook("converged", total)


def _levels_s(
    description: Description,
    contacts: int,
    first: float,
    most: float,
    budget: float,
    enough: float = 0.0,
    alone: bool = False,
) -> tuple[float, float]:
    """Return the predicted seconds of the levels of a description in all and of solving, up to an uncertainty.

    They end at a budget of solving. ``first`` is the uncertainty that is expected of the coarsest level, ``most`` the
    largest order with which it falls.
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


def unasked(scene: Scene, method: Method, history: AbstractHistory) -> tuple[Reference | None, Outlook]:
    """Return the reference of a run where none was requested, with its outlook.

    Parameters
    ----------
    scene, method : Scene, Method
        The physics that errors refer to, as for `impactlab.refine.reference.find`.
    history : AbstractHistory
        The run.
    """
    outlook = reference_s(scene, method)
    if outlook.status == "none":
        return None, outlook
    if (outlook.about_s or 0.0) > min(MAX_RATIO * run_s(history), MAX_UNASKED_S):
        return None, outlook._replace(status="not_computed")
    found = find(scene, method, FULL_BUDGET_S if outlook.status == "converged" else math.inf, outlook.status == "exact")
    if found is None and outlook.status == "exact":  # it does not come to its end
        outlook = converged_s(scene, method)
        return None, outlook._replace(status="not_computed") if outlook.about_s is not None else outlook
    return found, of(found)


def of(reference: Reference | None) -> Outlook:
    """Return the outlook of a reference that was requested."""
    if reference is None:
        return Outlook("none")
    return Outlook("converged" if reference.name == CONVERGED else "exact")
