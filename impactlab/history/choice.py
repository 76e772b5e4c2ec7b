"""The record of an automatic choice and of its candidates."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, final, overload

from impactlab.scene.method import Method
from impactlab.startup.cached import cached_property
from impactlab.startup.lazy import above

CandidateVerdict = Literal["chosen", "kept", "rejected", "trial", "not run", "refused"]


class Candidate(NamedTuple):
    """One description at one fineness: predicted, estimated and measured errors and times, and the outcome."""

    candidate: str
    predicted_error: float | None  # before any run, from facts of its class
    predicted_s: float | None  # solving, by the cost model
    estimated_error: float | None = None  # from three levels; None where it was not run
    measured_error: float | None = None  # against the reference; only by ``impactlab choose``
    solve_s: float | None = None
    verdict: CandidateVerdict = "not run"
    reason: str = ""


@final
class Ladder(Sequence[Candidate]):
    """Candidates of a choice, described when first read: an exact run never needs them."""

    def __init__(self, find: Callable[[], Sequence[Candidate]]) -> None:
        self._find = find

    @cached_property
    def _found(self) -> tuple[Candidate, ...]:
        return tuple(self._find())

    @overload
    def __getitem__(self, index: int) -> Candidate: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Candidate, ...]: ...
    def __getitem__(self, index: int | slice) -> Candidate | tuple[Candidate, ...]:
        return self._found[index]

    def __len__(self) -> int:
        return len(self._found)

    def __eq__(self, other: object) -> bool:
        return self._found == (other._found if isinstance(other, Ladder) else other)

    def __hash__(self) -> int:
        return hash(self._found)

    def __repr__(self) -> str:
        return repr(self._found)

    def __reduce__(self) -> tuple[Any, ...]:
        return tuple, (self._found,)


@dataclass(frozen=True, repr=False)
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
    ladder: Sequence[Candidate]
    choosing_s: float  # s, all that was spent beside the chosen run
    measured_error: float | None = None  # against a reference, less its uncertainty; None where there was none

    @property
    def met(self) -> bool:
        """Whether the expected and the measured error lie within the tolerance."""
        return max(self.expected_error, self.measured_error or 0.0) <= self.tolerance

    def __repr__(self) -> str:
        relation = "within" if self.met else "not within"
        return f"<Choice of {self.chosen!r}: expected error {self.expected_error:.2g}, {relation} {self.tolerance:g}>"

    def __str__(self) -> str:
        lines: list[str] = above("report.choice").choice_lines(self.document({}))
        return "\n".join(line.removeprefix("  choice    ").removeprefix(" " * 10) for line in lines)

    def document(self, described: dict[str, Any]) -> dict[str, Any]:
        """Return the choice for the summary; ``described`` is the summary's block of the same name."""
        named = {field.name: getattr(self, field.name) for field in dataclasses.fields(self) if field.name != "method"}
        return named | {
            "met": self.met,
            "chosen": {"candidate": self.chosen, "events": self.method.events, **described},
            "ladder": [candidate._asdict() for candidate in self.ladder],
        }
