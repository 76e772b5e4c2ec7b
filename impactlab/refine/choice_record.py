"""The record of an automatic choice, and its stated error beside the error against a reference."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from impactlab.history.base import AbstractHistory, Warned
from impactlab.refine.reference import Reference
from impactlab.scene.method import Counted, Method

Verdict = Literal["chosen", "kept", "rejected", "trial", "not run", "refused"]
METRICS: Mapping[Counted, tuple[str, ...]] = {
    "displacements": ("mass_displacement", "face_displacement"),
    "impulses": ("impulse",),
    "peak_forces": ("peak_force",),
}
"""Metrics of the quantities that a tolerance bounds."""


class Candidate(NamedTuple):
    """One description at one fineness: predicted, estimated and measured errors and times, and the outcome."""

    candidate: str
    predicted_error: float | None  # before any run, from facts of its class
    predicted_s: float | None  # solving, by the cost model
    estimated_error: float | None = None  # from three levels; None where it was not run
    measured_error: float | None = None  # against the reference; only by ``impactlab choose``
    solve_s: float | None = None
    verdict: Verdict = "not run"
    reason: str = ""


@dataclass(frozen=True)
class Choice:
    """The description chosen for a scene, its expected error, and the candidates beside it.

    ``expected_error`` is the estimate times the safety factor stated in ``estimate``; the tolerance was met where it
    lies within it. Only the times depend on the machine: choices are made by predicted cost and estimated error.
    """

    tolerance: float
    method: Method
    chosen: str
    expected_error: float
    estimate: str  # how the error was estimated, in words
    ladder: tuple[Candidate, ...]
    choosing_s: float  # s, all that was spent beside the chosen run
    measured_error: float | None = None  # against a reference, less its uncertainty; None where there was none

    @property
    def met(self) -> bool:
        """Whether the expected error, and the measured one where there is one, lie within the tolerance."""
        return max(self.expected_error, self.measured_error or 0.0) <= self.tolerance

    def document(self, described: dict[str, Any]) -> dict[str, Any]:
        """Return the choice for the summary; ``described`` is the summary's block of the same name."""
        named = {field.name: getattr(self, field.name) for field in dataclasses.fields(self) if field.name != "method"}
        return named | {
            "met": self.met,
            "chosen": {"candidate": self.chosen, "events": self.method.events, **described},
            "ladder": [candidate._asdict() for candidate in self.ladder],
        }


def measured_error(errors: Mapping[str, Any], reference: Reference, on: Sequence[Counted]) -> float | None:
    """Return the largest error in the quantities that count, less the uncertainty of the reference.

    Parameters
    ----------
    errors : mapping
        Metrics against the reference by name; None where a metric has no value.
    reference : Reference
        Gives the uncertainties of the metrics.
    on : sequence of str
        Quantities that count, as in `impactlab.scene.method.Tolerance`.

    Returns
    -------
    float or None
        None where no metric has a value.
    """
    found = [
        max(0.0, errors[name] - reference.uncertainties.get(name, reference.uncertainty))
        for counted in on
        for name in METRICS[counted]
        if errors.get(name) is not None
    ]
    return max(found, default=None)


def set_measured_error(history: AbstractHistory, measured: float | None) -> None:
    """Set the measured error of a chosen run; put a warning first where it is larger than the stated one."""
    choice = history.choice
    if choice is None or measured is None or choice.measured_error == measured:
        return
    history.choice = dataclasses.replace(choice, measured_error=measured)
    if measured <= choice.expected_error:
        return
    both = f"the error against the reference is {measured:.2g}, and {choice.expected_error:.2g} was stated"
    if measured <= choice.tolerance:
        history.warnings.insert(0, Warned("stated_error", f"{both}: the estimate was too small"))
    elif choice.met:
        text = f"{both}: the tolerance {choice.tolerance:g} is not met"
        history.warnings.insert(0, Warned("tolerance_not_met", text))
