"""Converged references beside the truth: the uncertainty that each claims, and its error."""

from __future__ import annotations

import time as clock
from typing import Any

import numpy as np

from impactlab.refine.references import converged as converged_reference
from studies.audit import answers, compare
from studies.audit.measure import KNOWN, case_for, seen
from studies.audit.scenes import Drawn
from studies.audit.summary import Row, markdown, number
from studies.audit.truth import SHARE

COLUMNS = ("family", "number", "found", "claimed", "true", "displacement", "impulse", "uncertainty", "seconds", "note")
HEADS = ("family", "cases", "no reference", "judged", "claim holds", "share", "claimed/true: least", "1 %", "median")
JUDGED = ("displacement", "impulse")
ENOUGH = 0.05  # of the claim: uncertainty of the truth at which it is refined no further
BUDGETS = (0.25, 2.0)  # s of predicted solving that a reference may take: in a plain run, and more; they take turns


def claimed(drawn: Drawn) -> dict[str, Any]:
    """Return the row of one case: its converged reference, also where the exact solver serves."""
    row: dict[str, Any] = dict.fromkeys(COLUMNS, "")
    row.update(family=drawn.family, number=drawn.number)
    began = clock.perf_counter()
    try:
        budget = BUDGETS[drawn.number % len(BUDGETS)]
        found = converged_reference.converged(*case_for(drawn.doc).simulation(), budget)
    except Exception as error:  # noqa: BLE001 - whatever ends it is a row of the study
        row["note"] = f"{type(error).__name__}: {error}"[:160]
        return row
    row["seconds"] = clock.perf_counter() - began
    if found is None:
        row["found"] = "none"
        return row
    row.update(found=found.found, claimed=found.uncertainty)
    drawn.doc["solve"]["tolerance"] = max(
        1e-6, ENOUGH / SHARE * found.uncertainty
    )  # the truth is refined to SHARE of it
    try:
        answer = answers.solve(drawn.doc, JUDGED)
    except answers.NotKnownError as error:
        row["note"] = str(error)[:160]
        return row
    errors = compare.errors(seen(found.history, answer), answer, 1e-4)
    row.update({name: errors[name] for name in JUDGED}, true=max(errors[name] for name in JUDGED))
    row["uncertainty"] = max(answer.uncertainty[name] for name in JUDGED)
    return row


def is_judged(row: Row) -> bool:
    """Return whether the truth is certain enough to verify a claim."""
    if row["true"] in ("", None):
        return False
    true, claim, unknown = (number(row, name) for name in ("true", "claimed", "uncertainty"))
    return true + unknown <= claim or true - unknown > claim or unknown <= KNOWN * claim


def line(name: str, rows: list[Row]) -> list[str]:
    """Return the cells of a family."""
    judged = [row for row in rows if is_judged(row)]
    holds = [row for row in judged if number(row, "true") <= number(row, "claimed") + number(row, "uncertainty")]
    ratios = [number(row, "claimed") / max(number(row, "true"), 1e-12) for row in judged]
    return [
        name,
        str(len(rows)),
        str(sum(row["found"] in ("none", "") for row in rows)),
        str(len(judged)),
        str(len(holds)),
        f"{100.0 * len(holds) / len(judged):.1f} %" if judged else "",
        f"{min(ratios):.2g}" if ratios else "",
        f"{np.quantile(ratios, 0.01):.2g}" if ratios else "",
        f"{np.median(ratios):.2g}" if ratios else "",
    ]


def table(rows: list[Row]) -> str:
    """Return the table by family as Markdown."""
    return markdown(HEADS, line, rows)


def worst(rows: list[Row], count: int = 15) -> list[str]:
    """Return the references whose stated uncertainty is most too small."""
    beyond = [row for row in rows if is_judged(row)]
    beyond = [row for row in beyond if number(row, "true") > number(row, "claimed") + number(row, "uncertainty")]
    beyond.sort(key=lambda row: -number(row, "true") / number(row, "claimed"))
    return [
        f"{row['family']} {row['number']}: claims {number(row, 'claimed'):.2g}, is {number(row, 'true'):.2g} "
        f"({row['found']})"
        for row in beyond[:count]
    ]
