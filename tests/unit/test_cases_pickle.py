"""Cases go to the worker processes of a bench by pickle."""

from __future__ import annotations

import pickle
from pathlib import Path

from impactlab import load_case

CASE = Path(__file__).resolve().parents[2] / "cases" / "axial_impact.yaml"


def test_a_case_and_a_case_with_settings_survive_pickle() -> None:
    case = load_case(CASE)
    for each in (case, case.with_("bodies.hammer.mass", 3.0)):
        again = pickle.loads(pickle.dumps(each))
        assert again.scene().bodies["hammer"] == each.scene().bodies["hammer"]
