"""Integers beyond the range of floats, as only Python can give them, are refused as any wrong value is."""

from typing import Any

import pytest

import impactlab as il
from impactlab.errors import CaseError

PLACES = [
    "bodies.rod.kind",
    "bodies.rod.length",
    "bodies.rod.ends.left",
    "bodies.rod.material",
    "contacts.0.between",
    "contacts.0.gap",
    "contacts.0.law.kind",
    "contacts.0.overlap",
    "gravity",
    "probes.0.quantity",
    "schema_version",
    "snapshots",
    "solve.duration",
    "solve.events",
    "solve.integrator.kind",
    "solve.model.elements",
    "solve.model.mass",
    "solve.records",
    "solve.step.dt",
    "solve.tolerance_on",
    "title",
]


@pytest.mark.parametrize("place", PLACES)
def test_a_huge_integer_is_refused_at_its_place(place: str) -> None:
    blocks: dict[str, Any] = {
        "schema_version": 1,
        "bodies": {
            "rod": {"kind": "rod", "length": 1.0, "area": 1e-3, "material": "steel", "ends": {"left": "free"}},
            "ball": {"kind": "mass", "mass": 1.0, "velocity": -1.0},
        },
        "contacts": [{"between": ["rod.right", "ball"], "gap": 0.0, "law": {"kind": "hertz", "stiffness": 1e9}}],
        "solve": {
            "duration": 1e-4,
            "model": {"kind": "finite_element", "elements": 10, "mass": "lumped"},
            "integrator": {"kind": "central_difference"},
            "step": {"courant": 0.5},
        },
        "probes": [{"body": "rod", "at": 0.5, "quantity": "strain"}],
    }
    *path, last = [int(key) if key.isdigit() else key for key in place.split(".")]
    at: Any = blocks
    for key in path:
        at = at[key]
    at[last] = 10**400
    with pytest.raises(CaseError) as caught:
        il.Case.from_dict(blocks)
    assert len(str(caught.value)) < 1500
