"""The record of an automatic choice and of its candidates."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from impactlab.scene.method import Method

Verdict = Literal["chosen", "kept", "rejected", "trial", "not run", "refused"]


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
        """Whether the expected and the measured error lie within the tolerance."""
        return max(self.expected_error, self.measured_error or 0.0) <= self.tolerance

    def document(self, described: dict[str, Any]) -> dict[str, Any]:
        """Return the choice for the summary; ``described`` is the summary's block of the same name."""
        named = {field.name: getattr(self, field.name) for field in dataclasses.fields(self) if field.name != "method"}
        return named | {
            "met": self.met,
            "chosen": {"candidate": self.chosen, "events": self.method.events, **described},
            "ladder": [candidate._asdict() for candidate in self.ladder],
        }
