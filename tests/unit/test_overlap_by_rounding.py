"""Faces that stand on a wall do not travel: their gap is rounding, and no overlap worth a warning."""

from __future__ import annotations

import pytest

import impactlab as il

STEEL = {"length": 0.55, "area": 9.4e-4, "material": "steel"}
SOFT = {"length": 0.46, "area": 1.3e-4, "material": {"young": 3.0e9, "density": 1200.0}}
PULSE = {"t": [0, 2e-5, 8e-5, 2e-4], "f": [0, 5e4, 2.5e4, 0]}
METHODS = {
    "explicit": ({"kind": "finite_element", "elements": 60, "mass": "lumped"}, "central_difference"),
    "implicit": ({"kind": "finite_element", "elements": 60}, "midpoint"),
}


@pytest.mark.filterwarnings("ignore::impactlab.RunWarning")
@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("speed", [1.9, 1.9e-6])
def test_a_rod_that_stays_on_its_wall(name: str, speed: float) -> None:
    """The overlap of 1e-21 m was 0.5 of a travel that is rounding, too."""
    model, integrator = METHODS[name]
    pulse = {"t": PULSE["t"], "f": [each * speed for each in PULSE["f"]]}
    case = il.Case(
        bodies={
            "rod": il.Rod(segments=[STEEL, SOFT], velocity=speed, ends={"left": {"force": pulse}}),
            "wall": il.Wall(),
        },
        contacts=[il.Contact("rod.right", "wall", {"kind": "addition_deletion"})],
        solve={"duration": 3e-3, "model": model, "integrator": {"kind": integrator}, "step": {"courant": 0.5}},
    )
    history = il.run(case)
    assert history.impulse_of("rod.right|wall") > 0.5 * speed
    assert "overlap" not in [warned.code for warned in history.warnings]
