"""Nitsche's method under an explicit step: what cannot be stable with the contact closed is refused before it runs."""

from __future__ import annotations

from typing import Any

import pytest

import impactlab as il
from impactlab.errors import CaseError
from impactlab.simulate import run
from tests.support import PAPER

MODES = {"kind": "modal", "elements": 40, "modes": 40, "basis": {"kind": "ritz"}}


def case(theta: str, model: dict[str, Any], step: dict[str, float]) -> il.casefile.Case:
    made = il.load_case(PAPER).with_("snapshots", []).with_("probes", []).with_("solve.model", {"kind": "continuous"})
    made = made.with_("solve.model", model).with_("contacts.0.law", {"kind": "nitsche", "theta": theta})
    return made.with_("solve.integrator", {"kind": "central_difference"}).with_("solve.step", step)


def mesh(elements: int) -> dict[str, Any]:
    return {"kind": "finite_element", "elements": elements, "mass": "lumped"}


@pytest.mark.parametrize(("theta", "model"), [("0", MODES), ("-1", MODES), ("0", mesh(350)), ("-1", mesh(100))])
def test_nitsche_does_not_blow_up_under_an_explicit_step_but_is_refused_with_its_limit(theta: str, model: Any) -> None:
    courant = 0.5 if model is MODES else 0.65
    with pytest.raises(CaseError, match="with the contact closed") as refused:
        il.run(case(theta, model, {"courant": courant}))
    limit = float(refused.value.remedy.split("dt: ")[1].split(" ")[0])
    assert run(*case(theta, model, {"dt": limit}).simulation()).energy.largest_gain < 0.35
    assert refused.value.path == "solve.step"


def test_the_symmetric_method_keeps_the_limit_of_its_bodies() -> None:
    assert run(*case("1", MODES, {"courant": 0.5}).simulation()).energy.largest_gain < 0.35
