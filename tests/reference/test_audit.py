"""Random scenes against independent programs: the programs themselves, and runs with a tolerance beside them."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import pytest

STUDIES = str(Path(__file__).resolve().parents[2] / "studies")
if STUDIES not in sys.path:
    sys.path.insert(0, STUDIES)

from audit import compare, families, measure, scenes, truth  # noqa: E402

import impactlab as il  # noqa: E402


def ball_on_wall(gap: float, zeta: float) -> scenes.Doc:
    """Return a ball of 1 kg at 1 m/s before a wall with k = 1 MN/m."""
    law = {"kind": "penalty", "stiffness": 1.0e6, "damping": 2000.0 * zeta}
    bodies = {"ball": {"kind": "mass", "mass": 1.0, "velocity": 1.0}, "wall": {"kind": "wall"}}
    return scenes.finished(bodies, [{"between": ["ball", "wall"], "gap": gap, "law": law}], 5e-3, 1e-8)


@pytest.mark.parametrize("zeta", [0.1, 0.6, 0.9])
def test_truth_has_the_closed_form_of_a_spring_and_dashpot(zeta: float) -> None:
    answer = truth.solve(ball_on_wall(7.767e-5, zeta))
    exit_speed = math.exp(-2.0 * zeta * math.acos(zeta) / math.sqrt(1.0 - zeta**2))
    assert answer.impulses["ball|wall"] == pytest.approx(1.0 + exit_speed, rel=1e-10)
    assert len(answer.jumps["ball|wall"]) == 1
    assert answer.jumps["ball|wall"][0] == pytest.approx((7.767e-5, 2000.0 * zeta), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("number", [number for number in range(20) if number != 17])  # 17: the exact solver stops
def test_exact_solver_and_truth_agree(number: int) -> None:
    doc = families.draw("exact", 20, number).doc
    try:
        answer = truth.solve(doc)
    except truth.NotKnownError:
        return
    del doc["solve"]["tolerance"]
    doc["solve"]["model"] = {"kind": "continuous"}
    for contact in doc["contacts"]:
        contact.setdefault("law", {"kind": "addition_deletion"})
    found = compare.errors(measure.seen(il.run(measure.case_for(doc)), answer), answer, 1e-4)
    assert max(found.values()) <= 1e-6 + 3.0 * max(answer.uncertainty.values())
