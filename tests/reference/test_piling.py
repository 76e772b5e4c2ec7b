"""What a pile engineer reads from blows: set, stresses, bearing graph, residual forces, and the Case method.

The numbers were found by a characteristics program and a finite difference program of their own.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import ImpactlabError
from impactlab.piling import Blow, bearing_graph, blow, case_method, drive

Z, LENGTH, SPEED = 1.6e6, 20.0, 4000.0  # N s/m, m, m/s
TOE = {"kind": "smith", "capacity": "900 kN", "quake": "3 mm", "damping": 0.5, "tension": False}


def driven(
    toe: dict[str, Any] | None = TOE, shaft: float = 6e5, mirrored: bool = False, courant: float = 0.9
) -> il.Case:
    """Return a concrete pile of 20 m, driven along +x or, mirrored, along -x."""
    sign = -1.0 if mirrored else 1.0
    span = "0 m, 15 m" if mirrored else "5 m, 20 m"
    head, end = ("pile.right", "pile.left") if mirrored else ("pile.left", "pile.right")
    soil = {"kind": "smith", "capacity": shaft, "quake": "2.5 mm", "damping": 0.2}
    pairs: list[tuple[str, str, Any, dict[str, Any]]] = [
        ("ram", "helmet", {"kind": "bilinear", "stiffness": 1e9, "restitution": 0.8}, {}),
        ("helmet", head, {"kind": "bilinear", "stiffness": 6e8, "restitution": 0.5}, {}),
        (f"pile.along({span})", "ground", soil, {"pieces": 15, "name": "shaft"}),
    ]
    if toe is not None:
        pairs.append((end, "base", toe, {"name": "toe"}))
    return il.Case(
        bodies={
            "ram": il.Mass(5000.0, velocity=sign * 4.5),
            "helmet": il.Mass(1000.0),
            "pile": il.Rod(length=LENGTH, area=0.16, material={"young": 40e9, "density": 2500.0}),
            "ground": il.Wall(),
            "base": il.Wall(),
        },
        contacts=[il.Contact(*((b, a) if mirrored else (a, b)), law, **more) for a, b, law, more in pairs],
        solve={
            "duration": 0.1,
            "model": {"kind": "finite_element", "elements": 320, "mass": "lumped"},
            "integrator": {"kind": "central_difference"},
            "step": {"courant": courant},
        },
    )


@pytest.fixture(scope="module")
def struck() -> Blow:
    return blow(driven())


def test_one_blow(struck: Blow) -> None:
    assert struck.set == pytest.approx(11.653e-3, rel=2e-4)
    assert struck.blows_per_metre == pytest.approx(85.815, rel=2e-4)
    assert struck.head.force.max() == pytest.approx(4009.85e3, rel=2e-3)
    assert struck.transferred_energy == pytest.approx(37_201.7, rel=2e-3)
    compression, tension = struck.peak_compression, struck.peak_tension
    assert compression.force == pytest.approx(4093.8e3, rel=2e-3)
    assert compression.stress == pytest.approx(25.59e6, rel=2e-3)
    assert 5.0 < compression.x < 5.5
    assert tension.force == pytest.approx(1111.4e3, rel=5e-3)
    assert tension.x == pytest.approx(11.5, abs=0.07)  # an element


def test_the_head_may_be_at_either_end(struck: Blow) -> None:
    other = blow(driven(mirrored=True))
    assert other.set == pytest.approx(struck.set, rel=1e-9)
    assert other.transferred_energy == pytest.approx(struck.transferred_energy, rel=1e-9)
    np.testing.assert_allclose(other.head.velocity, struck.head.velocity, atol=1e-9)
    assert other.peak_compression.force == pytest.approx(struck.peak_compression.force, rel=1e-9)


def test_a_bearing_graph() -> None:
    graph = bearing_graph(driven(), [0.9e6, 1.5e6, 2.5e6, 4.0e6])
    np.testing.assert_allclose(graph.blows_per_metre, [47.409, 85.815, 153.95, 470.28], rtol=5e-4)


def test_a_toe_that_never_yields_has_no_blow_count() -> None:
    stiff = {**TOE, "capacity": 1e8, "quake": 0.3}
    assert blow(driven(stiff)).blows_per_metre is None
    assert np.isnan(bearing_graph(driven(stiff), [1e9]).blows_per_metre).all()


def test_residual_forces_over_several_blows() -> None:
    driving = drive(driven(courant=0.5), 8)
    first, last = driving.blows[0], driving.blows[-1]
    assert first.head == pytest.approx(11.930e-3, rel=3e-4)
    assert first.toe_force == pytest.approx(56.04e3, rel=3e-3)
    assert last.head == pytest.approx(11.794e-3, rel=3e-4)
    assert last.toe == pytest.approx(11.794e-3, rel=3e-4)
    assert last.toe_force == pytest.approx(44.51e3, rel=3e-3)
    assert driving.set == last.head
    assert driving.repeats_from == 3
    assert driving.blows_per_metre == pytest.approx(1.0 / 11.794e-3, rel=3e-4)
    for each in driving.blows:  # at rest: the force in the pile is the soil above it
        soil = np.array([*each.soil.values()])
        assert abs(soil.sum()) < 1e-6 * np.abs(soil).sum()
        assert each.force[-1] == pytest.approx(each.toe_force)


def test_a_pile_without_toe_link_has_a_set_where_it_repeats() -> None:
    pile = driven(toe=None, shaft=1.5e6)
    assert blow(pile).set is None
    driving = drive(pile, 6)
    assert driving.blows[0].toe_force is None
    assert driving.set is not None
    assert driving.set > 1e-3
    assert drive(pile, 1).set is None  # one blow repeats nothing


def test_the_case_method_on_the_head_signals(struck: Blow) -> None:
    head = struck.head
    found = case_method(head.time, head.force, head.velocity, Z, LENGTH, SPEED, 0.4)
    assert found.total == pytest.approx(3130.1e3, rel=1e-3)
    assert found.static == pytest.approx(1174.3e3, rel=1e-3)
    assert found.largest_static == pytest.approx(1463.5e3, rel=1e-3)
    assert found.transferred_energy == pytest.approx(struck.transferred_energy)
    np.testing.assert_allclose(found.down + found.up, head.force, atol=1e-6)


@pytest.mark.parametrize("damping", [0.2, 0.6])
def test_the_case_method_is_exact_for_a_rigid_plastic_toe_without_shaft(damping: float) -> None:
    capacity = 1.2e6
    toe = {"kind": "smith", "rule": "viscous", "capacity": capacity, "quake": 1e-5, "damping": damping * Z / capacity}
    head = blow(driven({**toe, "tension": False}, shaft=1e-3)).head
    found = case_method(head.time, head.force, head.velocity, Z, LENGTH, SPEED, damping)
    assert found.static == pytest.approx(capacity, rel=1e-3)
    assert found.total > 1.1 * capacity


def signals(count: int = 50) -> dict[str, Any]:
    time = np.linspace(0.0, 0.05, count)
    force = 1e6 * np.sin(np.pi * time / 0.05)
    return {"time": time, "force": force, "velocity": force / Z, "impedance": Z, "length": 20.0, "wave_speed": 4000.0}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"force": np.zeros(49)}, "shapes"),
        ({"time": np.r_[0.0, np.linspace(0.0, 0.05, 49)]}, "does not rise from sample 0"),
        ({"velocity": np.r_[np.nan, np.zeros(49)]}, "velocity is not finite at sample 0"),
        ({"impedance": 0.0}, "impedance is 0"),
        ({"length": 80.0}, "before its echo"),
        ({"damping": -0.1}, "damping is -0.1"),
    ],
)
def test_the_case_method_refuses_signals_by_name(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ImpactlabError, match=said):
        case_method(**({**signals(), "damping": 0.4} | change))


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("contacts.1.between", ["ram", "helmet"], "0 contacts could be the one on the head"),
        ("bodies.pile.ends", {"right": {"dashpot": 1e5}}, "an end of the pile is held"),
        ("gravity", 9.81, "without weight"),
        ("contacts.2.law", {"kind": "elastic_plastic", "stiffness": 1e8, "yield_force": 1e5}, "holds the pile beside"),
    ],
)
def test_piles_that_cannot_be_driven_are_refused(path: str, value: Any, said: str) -> None:
    case = driven()
    if path == "contacts.1.between":
        case = case.with_("contacts.0.between", ["helmet", "base"])
    with pytest.raises(il.CaseError, match=said):
        drive(case.with_(path, value), 1)


def test_a_bearing_graph_needs_a_toe_and_capacities() -> None:
    with pytest.raises(il.CaseError, match="no soil under its toe"):
        bearing_graph(driven(toe=None), [1e6])
    with pytest.raises(il.CaseError, match="above 0"):
        bearing_graph(driven(), [0.0])
    with pytest.raises(il.CaseError, match="0 blows"):
        drive(driven(), 0)
