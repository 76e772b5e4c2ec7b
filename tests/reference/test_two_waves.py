"""The two travelling waves at a section: St Venant's impact, reflection at ends and impedance steps, other models."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import ImpactlabError

STEEL = {"young": 2.1e11, "density": 7850.0}
SPEED = math.sqrt(2.1e11 / 7850.0)
AREA, LENGTH, MASS, V0 = 9e-4, 1.0, 2.0, 3.0
IMPEDANCE = 7850.0 * SPEED * AREA
TRANSIT = LENGTH / SPEED
PROBES = [{"body": "rod", "at": x, "quantity": each} for x in (0.0, 0.4) for each in ("strain", "velocity")]


def struck(far: str = "free", **solve: Any) -> il.Case:
    """Return a mass that strikes a long rod, for one and a half transits."""
    solve = {"model": {"kind": "continuous"}, **solve}
    law = {"kind": "addition_deletion"}
    return il.Case(
        bodies={
            "hammer": il.Mass(MASS, velocity=V0),
            "rod": il.Rod(length=LENGTH, area=AREA, material=STEEL, ends={"left": "free", "right": far}),
        },
        contacts=[il.Contact("hammer", "rod.left", law)],
        solve={"duration": 1.5 * TRANSIT, **solve},
        probes=PROBES,
    )


@pytest.mark.parametrize("x", [0.0, 0.4, 1.0])
@pytest.mark.parametrize(("far", "sign"), [("free", -1.0), ("clamped", 1.0)])
def test_st_venant(x: float, far: str, sign: float) -> None:
    """The hammer sends v0 exp(-Z t/M); a free end turns its strain round, a clamped one sends it back."""
    history = il.run(struck(far))
    t = np.linspace(0.003, 0.997, 401) * history.duration
    waves = history.waves("rod", x, "strain", t)

    def sent(since: np.ndarray) -> np.ndarray:
        return np.where(since > 0.0, V0 / SPEED * np.exp(-IMPEDANCE * np.maximum(since, 0.0) / MASS), 0.0)

    assert waves.to_right == pytest.approx(sent(t - x / SPEED), rel=1e-9, abs=1e-15)
    assert waves.to_left == pytest.approx(sign * sent(t - (2.0 * LENGTH - x) / SPEED), rel=1e-9, abs=1e-15)
    assert waves.total == pytest.approx(history.evaluate(t, f"strain:rod@{x:g}"), abs=1e-15)
    velocity = history.evaluate(t, f"velocity:rod@{x:g}")
    assert SPEED * (waves.to_right - waves.to_left) == pytest.approx(velocity, abs=1e-12)
    both = history.waves("rod", x, "velocity", t)
    assert both.total == pytest.approx(velocity, abs=1e-12)
    force = history.waves("rod", x, "force", t)
    assert force.to_right == pytest.approx(IMPEDANCE * both.to_right, rel=1e-12)
    assert force.to_left == pytest.approx(-IMPEDANCE * both.to_left, rel=1e-12)


def test_a_step_of_impedance_splits_a_wave() -> None:
    """Of a wave from Z1 into Z2 the share 2 Z2/(Z1 + Z2) of the force goes on and (Z2 - Z1)/(Z1 + Z2) comes back."""
    pieces = [{"length": LENGTH, "area": area, "material": STEEL} for area in (AREA, 3.0 * AREA)]
    case = struck().with_("bodies.rod", {"segments": pieces, "length": None, "area": None, "material": None})
    history = il.run(case.with_("probes", []))
    t = np.linspace(1.01, 1.49, 50) * TRANSIT
    arriving, leaving = history.waves("rod", 1.0 - 1e-9, "force", t), history.waves("rod", 1.0 + 1e-9, "force", t)
    assert arriving.to_left == pytest.approx(0.5 * arriving.to_right, rel=1e-6)
    assert leaving.to_right == pytest.approx(1.5 * arriving.to_right, rel=1e-6)
    assert leaving.to_left == pytest.approx(np.zeros(50), abs=1e-9)


@pytest.mark.parametrize("x", [0.0, 0.4])
def test_a_mesh_gives_them_from_its_probes(x: float) -> None:
    mesh = {"model": {"kind": "finite_element", "elements": 400}, "step": {"courant": 0.5}}
    computed, answer = il.run(struck(**mesh)), il.run(struck())
    for quantity in ("strain", "velocity"):
        ours, there = computed.waves("rod", x, quantity), answer.waves("rod", x, quantity)
        assert np.array_equal(ours.time, there.time)
        for one, other in ((ours.to_right, there.to_right), (ours.to_left, there.to_left)):
            assert np.mean(np.abs(one - other)) < 0.02 * np.abs(there.to_right).max()


def test_without_a_gauge_the_contact_gives_the_force_at_a_free_end() -> None:
    mesh = {"model": {"kind": "finite_element", "elements": 100}}
    history = il.run(struck(**mesh).with_("probes", []))
    waves = history.waves("rod", 0.0, "force")
    assert waves.total == pytest.approx(history.evaluate(waves.time, "force:hammer|rod.left"), abs=1e-6)
    with pytest.raises(
        ImpactlabError, match=r"waves at 0\.4 m of 'rod' need its velocity.*\n.*quantity: velocity} and"
    ):
        history.waves("rod", 0.4)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (("hammer", 0.0), "'hammer' is a mass"),
        (("bar", 0.0), "no body 'bar'; bodies: hammer, rod"),
        (("rod", 1.2), "1.2 m lies outside 'rod', 0 to 1 m"),
        (("rod", 0.4, "displacement"), "the waves of 'rod' carry no displacement"),
        (("rod", 0.4, "torque"), "the rod 'rod' has no torque"),
        (("rod", 0.4, "strain", [1.0]), "1 s lies outside the run"),
    ],
)
def test_wrong_places_and_quantities_are_named(given: Any, text: str) -> None:
    with pytest.raises(ImpactlabError) as caught:
        il.run(struck()).waves(*given)
    assert text in str(caught.value)


def test_a_shaft_carries_torque() -> None:
    shaft = il.Shaft(length=1.0, section={"diameter": 0.04}, material="steel", ends={"left": "free", "right": "free"})
    case = il.Case(
        bodies={"ball": il.Mass(1.0, velocity=1.0), "shaft": shaft},
        contacts=[il.Contact("ball", "shaft.left", {"kind": "addition_deletion"}, lever_arm=0.1)],
        solve={"duration": "300 us", "model": {"kind": "continuous"}},
    )
    history = il.run(case)
    waves = history.waves("shaft", 0.5, "torque")
    assert waves.to_right.max() > 1.0
    assert waves.total == pytest.approx(history.evaluate(waves.time, "torque:shaft@0.5"), abs=1e-9)
