"""Claims of the paper, and the registration of their tests."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

CONFIRMED, CORRECTED, REFUTED, REMARK = "confirmed", "corrected", "refuted", "reproduced with remark"
VERDICTS = {
    CONFIRMED: "holds as printed",
    REMARK: "holds, and the remark says within what bounds or why",
    CORRECTED: "the statement stands once a number or a formula in it is changed",
    REFUTED: "does not hold",
}
SECTIONS = {
    "1": "Section 1, Introduction: the classical methods",
    "2": "Section 2, the assumptions",
    "3": "Section 3, St. Venant's solution and the second period of contact",
    "4": "Section 4, the new method",
    "5": "Section 5, numerical simulation",
    "6": "Section 6, numerical results",
    "7": "Section 7, summary and conclusions",
}


class Finding(NamedTuple):
    """Result of a run."""

    ours: str  # in words and numbers
    values: dict[str, float]
    stands: bool  # whether the numbers support the verdict


class Row(NamedTuple):
    """A claim of the paper and how it is put to the test."""

    name: str
    section: str
    where: str
    claim: str
    printed: str
    verdict: str
    rerun: str
    test: Callable[[], Finding]


ROWS: list[Row] = []


def row(
    section: str, where: str, claim: str, printed: str, verdict: str, command: str = ""
) -> Callable[[Callable[[], Finding]], Callable[[], Finding]]:
    """Register a function as the test of a claim; its name is the row's name."""

    def register(test: Callable[[], Finding]) -> Callable[[], Finding]:
        name = test.__name__
        again = command or f"python -m studies paper --row {name}"
        ROWS.append(Row(name, section, where, claim, printed, verdict, again, test))
        return test

    return register


def percent(value: float, digits: int = 2) -> str:
    """Return a share as percent with so many significant digits."""
    return f"{float(f'{100.0 * value:.{digits}g}'):g} %"
