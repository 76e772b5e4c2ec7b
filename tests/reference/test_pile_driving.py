"""A blow on a pile in Smith's soil, against two independent programs, and the passivity that the printed law lacks.

Concrete, 20 m; a ram on a cushion, a helmet and a second cushion; a shaft in fifteen pieces and a toe that never pulls.
The numbers were found by a characteristics program and a finite difference program of their own.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.history import AbstractHistory

SET, HEAD = 11.653e-3, 4009.85e3  # m, N
LUMPED = {"kind": "finite_element", "elements": 320, "mass": "lumped"}


def blow(
    model: dict[str, Any], integrator: str, pieces: int = 15, courant: float = 0.5, **shaft: Any
) -> AbstractHistory:
    soil = {"kind": "smith", "capacity": "600 kN", "quake": "2.5 mm", "damping": 0.2, **shaft}
    toe = {"kind": "smith", "capacity": "900 kN", "quake": "3 mm", "damping": 0.5, "tension": False}
    case = il.Case(
        bodies={
            "ram": il.Mass(5000.0, velocity=4.5),
            "helmet": il.Mass(1000.0),
            "pile": il.Rod(length=20.0, area=0.16, material={"young": 40e9, "density": 2500.0}),
            "ground": il.Wall(),
            "base": il.Wall(),
        },
        contacts=[
            il.Contact("ram", "helmet", {"kind": "bilinear", "stiffness": 1e9, "restitution": 0.8}),
            il.Contact("helmet", "pile.left", {"kind": "bilinear", "stiffness": 6e8, "restitution": 0.5}),
            il.Contact("pile.along(5 m, 20 m)", "ground", soil, pieces=pieces, name="shaft"),
            il.Contact("pile.right", "base", toe, name="toe"),
        ],
        solve={"duration": 0.1, "model": model, "integrator": {"kind": integrator}, "step": {"courant": courant}},
    )
    return il.run(case)


def link(history: AbstractHistory, name: str) -> Any:
    return next(each for each in history.links if each.name == name)


@pytest.mark.parametrize(
    ("model", "integrator", "balance"),
    [
        (LUMPED, "central_difference", 1e-6),
        ({"kind": "finite_element", "elements": 160}, "midpoint", 1e-12),
        ({"kind": "finite_element", "elements": 160}, "newmark", 1e-12),
    ],
)
def test_the_set_and_the_head_force_of_a_blow(model: dict[str, Any], integrator: str, balance: float) -> None:
    history = blow(model, integrator)
    assert link(history, "toe").set == pytest.approx(SET, rel=5e-5)
    t = np.linspace(0.0, 0.1, 40_001)
    assert history.evaluate(t, "force:helmet|pile.left").max() == pytest.approx(HEAD, rel=1e-4)
    assert history.evaluate(t, "displacement:pile@20").max() == pytest.approx(14.653e-3, rel=5e-5)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < balance


def test_the_pieces_of_a_shaft_are_summed_under_its_name() -> None:
    history = blow(LUMPED, "central_difference")
    shaft, t = link(history, "shaft"), np.arange(0, 12_800, 10) * (history.dt or 0.0)  # where forces act
    assert shaft.pieces == 15
    names = [name for name in history.channels() if name.startswith("force:pile.at(")]
    assert len(names) == 15
    total = sum(history.evaluate(t, name) for name in names)
    np.testing.assert_allclose(history.evaluate(t, "force:shaft"), total, atol=1e-6 * shaft.largest)
    assert shaft.smallest < -5e5  # it holds the pile back as that rebounds
    assert link(history, "toe").smallest == 0.0
    assert history.events[0].contact == "ram|helmet"
    assert {event.contact for event in history.events} == {"ram|helmet", "helmet|pile.left"}


def test_shafts_of_more_pieces_tend_to_one_set() -> None:
    sets = [link(blow(LUMPED, "central_difference", pieces), "toe").set for pieces in (15, 30, 60, 150)]
    assert sets[-1] == pytest.approx(11.6526e-3, rel=2e-5)
    steps = np.abs(np.diff(sets))
    assert steps[0] > steps[1] > steps[2]


def test_soil_without_capacity_leaves_every_other_number_as_it_was() -> None:
    numbers = [
        (link(each, "toe").set, each.contacts[0].impulse, each.contacts[0].peak_force)
        for each in (blow(LUMPED, "central_difference", 15, capacity=capacity) for capacity in (1e-6, 1e-9))
    ]
    np.testing.assert_allclose(numbers[0], numbers[1], rtol=1e-12)
