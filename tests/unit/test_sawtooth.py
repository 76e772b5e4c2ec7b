"""Warning of the sawtooth that a dashpot leaves in a lumped mesh at its stability limit.

The rod: c 5000 m/s, Z 4000 N s/m. Its end with a dashpot of Z/2 moves with F/(1.5 Z) under a step load F, and two
thirds of the load go into the rod; with a dashpot of 2 Z it is a third.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import impactlab as il
from tests.solving import in_steps, mesh

STEEL = {"young": 2e11, "density": 8000.0}
HAMMER = {"kind": "mass", "mass": 0.3, "velocity": 1.0}
DASHPOT = {"kind": "penalty", "stiffness": 1e7, "damping": 4000.0}


def ran(
    courant: float, left: Any = "free", right: Any = "free", law: Any = None, velocity: float = 0.0, gap: float = 0.0
) -> Any:
    """Run a rod of 0.6 m until the front is at its middle and beyond."""
    rod = il.Rod(length=0.6, area=1e-4, material=STEEL, ends={"left": left, "right": right}, velocity=velocity)
    case = il.Case(
        bodies={"rod": rod} | ({} if law is None else {"hammer": HAMMER}),
        contacts=[] if law is None else [il.Contact("hammer", "rod.left", law, gap=gap)],
        probes=[{"body": "rod", "at": x, "quantity": "force"} for x in (0.2, 0.2005)],  # a node, inside an element
        solve=in_steps(1e-4, "central_difference", mesh(600, "lumped"), courant=courant),
    )
    return il.run(case)


def warned(history: Any) -> bool:
    return any(warning.code == "sawtooth" for warning in history.warnings)


def test_a_dashpot_under_a_step_load_leaves_a_sawtooth() -> None:
    loaded = {"force": 1e4, "dashpot": 2000.0}
    history = ran(1.0, loaded)
    force = history.evaluate(7e-5 + np.arange(2) * history.dt, "force:rod@0.2005")
    assert force.mean() == pytest.approx(2e4 / 3.0, rel=1e-9)
    assert abs(force[1] - force[0]) > 1e3  # and not as in a rod
    assert warned(history)
    at_node = history.evaluate(7e-5, "force:rod@0.2")  # the mean of both sides
    assert at_node == pytest.approx(2e4 / 3.0, rel=1e-9)
    history = ran(0.95, loaded)
    assert history.evaluate(7e-5 + np.arange(6) * history.dt, "force:rod@0.2005") == pytest.approx(2e4 / 3.0, rel=0.06)
    assert not warned(history)


def test_under_a_stiff_dashpot_the_first_step_is_that_of_the_front() -> None:
    history = ran(1.0, {"force": 1e4, "dashpot": 8000.0})
    force = history.evaluate(7e-5 + np.arange(6) * history.dt, "force:rod@0.2005")
    assert force == pytest.approx(1e4 / 3.0, rel=1e-9)
    assert not warned(history)


def test_where_no_dashpot_starts_a_front_there_is_none() -> None:
    """A step load, an infinite end that it meets, a load that rises from 0, a hard contact."""
    history = ran(1.0, {"force": 1e4}, "infinite")
    assert history.evaluate(7e-5 + np.arange(6) * history.dt, "force:rod@0.2005") == pytest.approx(1e4, rel=1e-9)
    assert not warned(history)
    assert not warned(ran(1.0, {"force": {"t": [0, 1e-5, 1e-4], "f": [0, 1e4, 1e4]}, "dashpot": 8000.0}))
    assert not warned(ran(1.0, law={"kind": "addition_deletion"}))


def test_a_dashpot_in_a_contact_whose_faces_touch_within_a_step() -> None:
    """Faces that touch at t = 0 do so at the start of a step: there is no sawtooth."""

    def jump(history: Any) -> float:
        one, other = history.evaluate(6e-5 + np.arange(2) * history.dt, "force:rod@0.2005")
        return abs(other / one - 1.0)

    within, at_start = ran(1.0, law=DASHPOT, gap=3.3e-8), ran(1.0, law=DASHPOT)
    assert jump(within) > 0.3
    assert warned(within)
    assert jump(at_start) < 3e-3
    assert not warned(at_start)
    assert not warned(ran(0.95, law=DASHPOT, gap=3.3e-8))


def test_a_dashpot_that_holds_a_moving_rod() -> None:
    assert warned(ran(1.0, {"dashpot": 2000.0}, velocity=1.0))
    stiff = ran(1.0, {"dashpot": 8000.0}, velocity=1.0)  # the front has the force 2 Z v0/3
    force = stiff.evaluate(7e-5 + np.arange(6) * stiff.dt, "force:rod@0.2005")
    assert np.abs(force) == pytest.approx(8000.0 / 3.0, rel=1e-9)
    assert not warned(stiff)
