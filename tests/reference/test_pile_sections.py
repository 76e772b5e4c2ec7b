"""Piles of several rods, joined end to end: by a bond they are one pile, at a crack no tension passes."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import CaseError
from impactlab.piling import Blow, bearing_graph, blow, drive, match

CONCRETE = {"young": "38 GPa", "density": 2450}
AREA, LENGTH, SPLIT = 0.16, 24.0, 8.0  # m2, m
WHOLE, BOND, CRACK = None, {"kind": "bonded"}, {"kind": "wave_identification"}
NONE: dict[str, Any] = {}


def case(joint: dict[str, Any] | None, mirrored: bool = False) -> il.Case:
    """Return a concrete pile that is driven easily, so that tension returns; of two rods where a joint is given."""

    def place(rod: str, *x: float) -> str:
        """Return a face or a span of a rod at depths below its head."""
        length = {"pile": LENGTH, "upper": SPLIT, "lower": LENGTH - SPLIT}[rod]
        at = sorted(length - each for each in x) if mirrored else list(x)
        if len(at) == 2:
            return f"{rod}.along({at[0]} m, {at[1]} m)"
        return f"{rod}.left" if at[0] == 0.0 else f"{rod}.right"

    def soil(name: str, length: float) -> dict[str, Any]:
        law = {"kind": "smith", "capacity": 5e3 * length, "quake": "2.5 mm", "damping": 0.3}
        return {"law": law, "pieces": round(length), "name": name}

    toe = {"kind": "smith", "capacity": "150 kN", "quake": "3 mm", "damping": 0.5, "tension": False}
    head, tip = ("pile", "pile") if joint is None else ("upper", "lower")
    lengths = {"pile": LENGTH} if joint is None else {"upper": SPLIT, "lower": LENGTH - SPLIT}
    rods = {name: il.Rod(length=length, area=AREA, material=CONCRETE) for name, length in lengths.items()}
    pairs: list[tuple[str, str, dict[str, Any]]] = [
        ("ram", "helmet", {"law": {"kind": "bilinear", "stiffness": "1.5 GN/m", "restitution": 0.8}}),
        ("helmet", place(head, 0.0), {"law": {"kind": "bilinear", "stiffness": "0.8 GN/m", "restitution": 0.6}}),
        (place(tip, lengths[tip]), "base", {"law": toe, "name": "toe"}),
    ]
    if joint is None:
        pairs.append((place("pile", 4.0, LENGTH), "ground", soil("shaft", LENGTH - 4.0)))
    else:
        if joint:
            pairs.append((place("upper", SPLIT), place("lower", 0.0), {"law": joint}))
        pairs.append((place("upper", 4.0, SPLIT), "ground", soil("upper_shaft", SPLIT - 4.0)))
        pairs.append((place("lower", 0.0, LENGTH - SPLIT), "ground", soil("lower_shaft", LENGTH - SPLIT)))
    bodies = {"ram": il.Mass("4 t", velocity=-3.0 if mirrored else 3.0), "helmet": il.Mass("0.5 t"), **rods}
    return il.Case(
        bodies={**bodies, "ground": il.Wall(), "base": il.Wall()},
        contacts=[il.Contact(*((b, a) if mirrored else (a, b)), **more) for a, b, more in pairs],
        solve={"duration": "160 ms", "model": {"kind": "continuous"}, "step": {"dt": "40 us"}},
    )


@cache
def bonded(mirrored: bool = False) -> Blow:
    return blow(case(BOND, mirrored))


@pytest.mark.parametrize("mirrored", [False, True])
def test_two_bonded_sections_are_one_pile(mirrored: bool) -> None:
    """It was refused: "one rod must be the pile". Only the rounding of places to the step may differ."""
    whole, two = blow(case(WHOLE, mirrored)), bonded(mirrored)
    assert whole.set is not None
    assert two.set == pytest.approx(whole.set, rel=1e-6)
    assert two.transferred_energy == pytest.approx(whole.transferred_energy, rel=1e-6)
    for found, expected in ((two.peak_compression, whole.peak_compression), (two.peak_tension, whole.peak_tension)):
        assert found.force == pytest.approx(expected.force, rel=1e-6)
        assert expected.rod == "pile"
    np.testing.assert_allclose(two.head.force, whole.head.force, rtol=0.0, atol=1e-6 * whole.head.force.max())


def test_no_tension_passes_a_crack_and_the_set_changes_by_it() -> None:
    joined, cracked = bonded(), blow(case(CRACK))
    assert joined.set is not None
    assert cracked.set is not None
    at = np.linspace(0.0, 0.16, 4001)
    forces = [each.history.evaluate(at, "force:upper.right|lower.left").min() for each in (joined, cracked)]
    assert forces[0] < -1.5e6
    assert forces[1] == 0.0
    # Tension pulls the lower section back; at an open crack it keeps its momentum.
    assert cracked.set > 1.1 * joined.set


def test_the_bearing_graph_of_two_bonded_sections_is_that_of_one_pile() -> None:
    capacities = [300e3, 500e3]
    one, two = (bearing_graph(case(joint), capacities) for joint in (WHOLE, BOND))
    np.testing.assert_allclose(two.set, one.set, rtol=1e-6)


def test_driving_blow_after_blow_refuses_several_rods_with_a_way_out() -> None:
    with pytest.raises(CaseError, match=r"(?s)'upper' and 'lower' are several rods.*`bearing_graph` and `match`"):
        drive(case(CRACK), 2)


def test_the_toe_of_two_bonded_sections_is_matched() -> None:
    """It was refused: "one rod must be the pile". The force is a line between samples, of which one in 8 is kept."""
    head = bonded().head
    kept = np.flatnonzero(head.time < 0.06)[::8]
    velocity = head.impedance_velocity[kept] / head.impedance
    start = case(BOND).with_("contacts.2.law.capacity", 250e3)
    found = match(start, head.time[kept], head.force[kept], velocity, ["toe.capacity"])
    assert found["toe.capacity"].value == pytest.approx(150e3, rel=5e-3)
    assert found.capacity.value == pytest.approx(250e3, rel=3e-3)  # with 5 kN on each of 20 m


def test_sections_that_are_not_joined_are_refused() -> None:
    with pytest.raises(CaseError, match="one rod must be the pile, and 'lower', 'upper' could be"):
        blow(case(NONE))
