"""Whether a plain run computes its reference, by predicted times of both.

No clock is read, so that the same case has the same summary on every machine. Both predictions count work: steps,
unknowns and contacts of the run, and of the levels that a converged reference is expected to need. A level costs more
than its steps: bodies are built, records are read, and it is compared with the levels before it, contact by contact.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from impactlab.exact import solve as exact
from impactlab.exact.cost import INTERVAL_S, begin
from impactlab.history.base import AbstractHistory
from impactlab.refine.references.reference import find, find_exact
from impactlab.refine.references.reference_record import CONVERGED, FULL_BUDGET_S, Reference
from impactlab.scene.method import Method, laws_of, theories
from impactlab.scene.problem import Scene
from impactlab.startup.lazy import lazy

if TYPE_CHECKING:
    from impactlab.refine.references import converged as converged_reference
else:  # with the step loop, which an exact solution does not need
    converged_reference = lazy("impactlab.refine.references.converged")

MAX_RATIO = 10.0  # predicted time of a reference over that of the run, up to which a plain run computes it
MAX_PLAIN_S = 10.0  # s, predicted time of a reference up to which a plain run computes it, however long the run took
# Seconds, measured on the cases of the suite by the time of the processor.
SETUP_S = 8e-4  # of a run, for a body and its contacts
STEP_S = 3e-7
UNKNOWN_S = 3e-9  # a step and unknown
CONTACT_S = 1.5e-7  # a step and contact, beside the first
RATE_S = 1e-4  # an evaluation of the equations of motion by an adaptive integrator
EXACT_RATIO = 8.0  # cost of an interval, over that without its multiplications


class Outlook(NamedTuple):
    """Facts of a reference before it is computed."""

    status: Literal["exact", "converged", "not_computed", "none"]
    about_s: float | None = None  # s, predicted time of its computation; None where there is none
    theory: str = ""  # theory of waves of a model that differs from the body's: references do not have it

    @property
    def text(self) -> str | None:
        """Why there are no errors, for people; None where there are."""
        if self.status == "not_computed":
            return f"not computed; --reference computes it, about {float(f'{self.about_s or 0.0:.1g}'):g} s"
        if self.theory:
            return f"not measured: a model has the theory of waves '{self.theory}', and no reference is of it"
        if self.status == "none":
            return f"not measured: no exact solution, and no reference that converges within {FULL_BUDGET_S:g} s"
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
    """Return the predicted time of the reference [s]: exact, else converged."""
    if (theory := next(filter(None, theories(scene, method)), "")) != "":
        return Outlook("none", theory=theory)
    if exact.serves(scene, method) is None:
        predicted = begin(scene, method).predicted_s
        if predicted <= FULL_BUDGET_S or all(law.branches() is None for law in laws_of(scene, method)):
            return Outlook("exact", predicted)
    return converged_s(scene, method)


def converged_s(scene: Scene, method: Method) -> Outlook:
    """Return the predicted time of a converged reference [s]."""
    predicted = converged_reference.predicted_s(scene, method)
    return Outlook("none") if predicted is None else Outlook("converged", predicted)


def of_plain_run(scene: Scene, method: Method, history: AbstractHistory) -> tuple[Reference | None, Outlook]:
    """Return the reference of a run where none was requested, with its outlook.

    Parameters
    ----------
    scene, method : Scene, Method
        The physics that errors refer to, as for `impactlab.refine.references.reference.find`.
    history : AbstractHistory
        The run.
    """
    outlook = reference_s(scene, method)
    if outlook.status == "none":
        return None, outlook
    if (outlook.about_s or 0.0) > min(MAX_RATIO * run_s(history), MAX_PLAIN_S):
        return None, outlook._replace(status="not_computed")
    if outlook.status == "converged":
        found = find(scene, method)
        return found, of(found)
    found = find_exact(scene, method, math.inf)
    if found is None:  # it ended early
        outlook = converged_s(scene, method)
        return None, outlook._replace(status="not_computed") if outlook.about_s is not None else outlook
    return found, of(found)


def of(reference: Reference | None, method: Method | None = None) -> Outlook:
    """Return the outlook of a reference that was requested for the physics of a method."""
    if reference is None:
        models = () if method is None else method.models.values()
        return Outlook("none", theory=next((model.theory for model in models if model.theory), ""))
    return Outlook("converged" if reference.name == CONVERGED else "exact")
