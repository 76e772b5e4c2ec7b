"""One run with a tolerance beside the truth: a row."""

from __future__ import annotations

import os
import time as clock
from dataclasses import dataclass
from typing import Any

import impactlab as il
from impactlab.casefile.case import case_of
from impactlab.casefile.document import Document
from impactlab.errors import ImpactlabError
from studies.audit import answers, compare
from studies.audit.scenes import Drawn
from studies.audit.tables import Array

COLUMNS = (
    *("family", "number", "tolerance", "status", "chosen", "stated", "met", "warned"),
    *("true", "displacement", "displacement_ground", "impulse", "peak", "uncertainty", "known", "contacts"),
    *("wall_s", "solve_s", "choosing_s", "truth_s", "note"),
)
KNOWN = 0.1  # of the tolerance: a reference with a larger uncertainty is not used


@dataclass
class Seen:
    """A history as the truth has it."""

    displacements: dict[str, Array]
    forces: dict[str, Array]
    impulses: dict[str, float]


def seen(history: Any, answer: answers.Truth) -> Seen:
    """Return a history at the instants of the truth."""
    return Seen(
        {name: history.evaluate(answer.times, name) for name in answer.displacements},
        {name: history.evaluate(answer.times, f"force:{name}") for name in answer.forces},
        {name: sum(span.impulse for span in history.contacts if span.contact == name) for name in answer.forces},
    )


def case_for(doc: dict[str, Any]) -> il.Case:
    """Return the case of a document."""
    return case_of("audit", "audit", Document(doc, {}))


def largest(found: dict[str, float]) -> float:
    """Return the error that counts: of displacements, impulses and peak forces."""
    return max(found[name] for name in compare.JUDGED)


def ran(drawn: Drawn) -> tuple[dict[str, Any], Any]:
    """Return the row of one case so far, and its history where the run ended."""
    row: dict[str, Any] = dict.fromkeys(COLUMNS, "")
    tolerance = drawn.doc["solve"]["tolerance"]
    row.update(family=drawn.family, number=drawn.number, tolerance=tolerance)
    began = clock.perf_counter()
    try:
        history = il.run(case_for(drawn.doc))
    except ImpactlabError as error:
        row.update(status="refused" if not hasattr(error, "step") else "failed", note=str(error)[:160])
        return row, None
    except Exception as error:  # noqa: BLE001 - whatever ends a run is a row of the study
        row.update(status="error", note=f"{type(error).__name__}: {error}"[:160])
        return row, None
    row["wall_s"] = clock.perf_counter() - began
    choice = history.choice
    row.update(status="ran", chosen=choice.chosen, stated=choice.expected_error, met=int(choice.met))
    codes = sorted({warning.code for warning in history.warnings})
    row.update(warned=" ".join(codes), solve_s=history.cost.solve_s, choosing_s=choice.choosing_s)
    return row, history


def timed(drawn: Drawn) -> dict[str, Any]:
    """Return the row of one case without the truth."""
    return ran(drawn)[0]


def measured(drawn: Drawn) -> dict[str, Any]:
    """Return the row of one case."""
    row, history = ran(drawn)
    if history is None:
        return row
    tolerance = drawn.doc["solve"]["tolerance"]
    began = clock.perf_counter()
    try:
        answer = answers.solve(drawn.doc)
    except answers.NotKnownError as error:
        row.update(known=0, note=str(error)[:160], truth_s=clock.perf_counter() - began)
        return row
    row["truth_s"] = clock.perf_counter() - began
    found = compare.errors(seen(history, answer), answer, tolerance)
    unknown = largest(answer.uncertainty)
    row.update(found, true=largest(found), uncertainty=unknown, contacts=answer.contacts)
    row["known"] = int(unknown <= KNOWN * tolerance)
    return row


def quiet() -> None:
    """Keep numerical libraries to one thread each."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
