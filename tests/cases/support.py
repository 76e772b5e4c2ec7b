"""The case files by name, their exact histories, and what several tests ask of both."""

from __future__ import annotations

import re
from functools import cache
from typing import Any
from unittest import mock

import impactlab as il
from impactlab import api
from impactlab.api import physics_of, reference_of
from impactlab.casefile import Case
from impactlab.history import AbstractHistory
from impactlab.refine.references.reference_record import Reference, physics_key
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from tests.support import CASES

NAMES = sorted(file.stem for file in CASES.glob("*.yaml"))
# Seconds of predicted solving for references that only check methods of a mechanism, to 1e-3: what the file tells is
# read from its method `fine`. That of the blows is known to 1e-5, as the page has it; all that a comparison may take
# gives 5e-6. Those of the measured head and of copper have all digits that their files and the page print.
CHECK_S = {
    "arm_on_stop": 2.0,
    "residual_blows": 3.0,
    "measured_head": 0.5,
    "hopkinson_copper": 0.5,
}


@cache
def case_of(label: str) -> Case:
    """Return a case, or one of its variants: `mass_ratios`, `mass_ratios/alpha_3`."""
    name, _, variant = label.partition("/")
    case = il.load_case(CASES / f"{name}.yaml")
    return case.variant(variant) if variant else case


@cache
def labels() -> tuple[str, ...]:
    """Return every case, and every variant of each, found by the text: reading every case takes seconds."""
    found: list[str] = []
    for name in NAMES:
        block = re.search(r"^variants:\n((?:(?: .*)?\n)+)", (CASES / f"{name}.yaml").read_text("utf-8"), re.MULTILINE)
        variants = re.findall(r"^  (\w+):", block[1], re.MULTILINE) if block else []
        found += [name, *(f"{name}/{variant}" for variant in variants)]
    return tuple(found)


@cache
def compared(label: str) -> il.Comparison:
    """Return the methods of a case side by side, with the answer they are measured against.

    Of one mechanism those that share the reference of the case as written, which is solved for seconds; the references
    of others are in tests/reference/test_adaptive_mechanisms.py.
    """

    def found(scene: Scene, method: Method) -> Reference | None:
        return reference_of(scene, method, CHECK_S.get(label)) if is_measured(label, scene, method) else None

    with mock.patch.object(api, "reference_of", found):
        return il.compare(case_of(label))


def is_measured(label: str, scene: Scene, method: Method) -> bool:
    """Return whether a method of a case has errors against a reference here."""
    if mechanical(label):
        return label == "arm_on_stop" and physics_key(scene, method) == physics_key(*physics_of(case_of(label)))
    return True


@cache
def mechanical(label: str) -> bool:
    """Return whether a mechanism moves in a case: its reference has the shapes of the case as written."""
    return any(body.changes for body in case_of(label).scene().bodies.values())


def rows(label: str) -> dict[str, dict[str, Any]]:
    """Return the summaries of a case's methods, by name."""
    return {row.name: row.summary for row in compared(label).rows}


@cache
def exact(label: str) -> AbstractHistory:
    """Return the reference history of a case: exact, or converged where no exact one is."""
    reference = reference_of(*case_of(label).simulation())
    assert reference is not None, label
    return reference.history


def times(history: AbstractHistory, contact: str) -> list[float]:
    """Return when a contact closed and opened [s]."""
    return [event.time for event in history.events if event.contact == contact]
