"""The warning of rods and masses that are not in static equilibrium at t = 0, and the start that it proposes."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.casefile.values import formula
from impactlab.history.base import AbstractHistory
from impactlab.simulate.warnings import weights

G, DENSITY, YOUNG, LENGTH, WEIGHT = 9.81, 7850.0, 2.1e11, 10.0, 50.0
AREA = np.pi * 0.01**2
STIFFNESS = 1e8  # N/m
HARD = {"kind": "addition_deletion"}
SPRING = {"kind": "penalty", "stiffness": STIFFNESS}
MESH = {"model": {"kind": "finite_element", "elements": 50}, "step": {"courant": 0.5}}
EXACT = {"model": {"kind": "continuous"}}


def struck(solve: dict[str, Any] = EXACT, law: dict[str, Any] = SPRING, **changes: Any) -> AbstractHistory:
    """A hammer strikes a weight that rests on a clamped rod, downwards."""
    given = {"gravity": G, "velocity": 0.5, "gap": 0.0, "displacement": None, "duration": 2e-3, **changes}
    rod = {"kind": "rod", "length": LENGTH, "diameter": 0.02, "ends": {"left": "free", "right": "clamped"}}
    rod["material"] = {"young": YOUNG, "density": DENSITY}
    if given["displacement"] is not None:
        rod["displacement"] = given["displacement"]
    bodies = {
        "hammer": {"kind": "mass", "mass": 1.0, "velocity": given["velocity"]},
        "weight": {"kind": "mass", "mass": WEIGHT},
        "rod": rod,
    }
    contacts = [
        {"between": ["hammer", "weight"], "gap": 1e-4, "law": {"kind": "penalty", "stiffness": 1e7}},
        {"between": ["weight", "rod.left"], "gap": given["gap"], "overlap": "allowed", "law": law},
    ]
    scene = {"schema_version": 1, "bodies": bodies, "contacts": contacts, "gravity": given["gravity"]}
    return il.run(il.Case.from_dict({**scene, "solve": {"duration": given["duration"], **solve}}))


def texts(history: AbstractHistory) -> list[str]:
    return [warned.text for warned in history.warnings if warned.code == "weight_at_start"]


@pytest.mark.parametrize("solve", [EXACT, MESH], ids=["exact", "mesh"])
@pytest.mark.parametrize("law", [HARD, SPRING], ids=["hard", "spring"])
def test_the_start_that_is_proposed_is_in_equilibrium(solve: dict[str, Any], law: dict[str, Any]) -> None:
    (text,) = texts(struck(solve, law))
    shape, gap = re.search(r"displacement of 'rod': (\S.*?); gap of weight\|rod.left: (\S+)$", text).groups()  # type: ignore[union-attr]
    # Under its own weight a rod shortens by rho g L2/(2 E), under one on its end by m g L/(E A).
    sag = DENSITY * G * LENGTH**2 / (2.0 * YOUNG) + WEIGHT * G * LENGTH / (YOUNG * AREA)
    spring = WEIGHT * G / STIFFNESS if law is SPRING else 0.0
    assert float(gap) == pytest.approx(-sag - spring, rel=1e-6)
    at_rest = struck(EXACT, law, displacement=shape, gap=float(gap), duration=1e-4)
    before = np.linspace(0.0, 1e-4, 50)  # the hammer arrives after 0.2 ms
    top = at_rest.evaluate(before, "displacement:rod@0")
    assert top[0] == pytest.approx(sag, rel=1e-6)
    assert np.ptp(top) < 1e-8 * sag
    assert at_rest.evaluate(before[1:], "force:weight|rod.left") == pytest.approx(WEIGHT * G, rel=1e-6)
    assert not texts(struck(EXACT, law, displacement=shape, gap=float(gap)))


def test_the_swing_is_that_of_the_run() -> None:
    # In 2 ms the weight falls by 0.5 g t2 at most, far less than twice its distance from the equilibrium.
    (text,) = texts(struck())
    assert float(re.search(r"by up to (\S+) m within", text)[1]) == pytest.approx(0.5 * G * 4e-6, rel=2e-3)  # type: ignore[index]


@pytest.mark.parametrize("changes", [{"velocity": 50.0}, {"gravity": 0.0}, {"velocity": 0.0}, {"gap": 1e-2}])
def test_no_warning_without_a_reason(changes: dict[str, Any]) -> None:
    """A hard blow, no weight, nothing but the weight; and a weight that rests on nothing falls."""
    found = texts(struck(**changes))
    assert not [text for text in found if text.startswith("'weight'")]
    assert "gap" in changes or not found


@pytest.mark.parametrize("kind", ["hertz", "hunt_crossley"])
def test_a_law_that_stiffens_rests_at_the_overlap_of_the_force_on_it(kind: str) -> None:
    """K d^1.5 = m g; the run from the start that is proposed stays at rest until the hammer arrives."""
    law: dict[str, Any] = {"kind": kind, "stiffness": 1e10} | ({"restitution": 0.8} if kind == "hunt_crossley" else {})
    (text,) = texts(struck(MESH, law))
    shape, gap = re.search(r"displacement of 'rod': (\S.*?); gap of weight\|rod.left: (\S+)$", text).groups()  # type: ignore[union-attr]
    sag = DENSITY * G * LENGTH**2 / (2.0 * YOUNG) + WEIGHT * G * LENGTH / (YOUNG * AREA)
    overlap = (WEIGHT * G / law["stiffness"]) ** (2.0 / 3.0)
    assert float(gap) == pytest.approx(-sag - overlap, rel=1e-6)
    at_rest = struck(MESH, law, displacement=shape, gap=float(gap), duration=1e-4)
    before = np.linspace(0.0, 1e-4, 50)
    assert np.ptp(at_rest.evaluate(before, "displacement:rod@0")) < 1e-5 * sag
    assert at_rest.evaluate(before, "force:weight|rod.left") == pytest.approx(WEIGHT * G, rel=1e-4)
    assert not texts(struck(MESH, law, displacement=shape, gap=float(gap)))


def test_contacts_that_stiffen_carry_the_weight_above_them() -> None:
    """A weight on a light mass on the ground: each overlap is that of the force on it, not of the weight of all."""
    bodies = {
        "hammer": il.Mass(1.0, velocity=0.5),
        "weight": il.Mass(WEIGHT),
        "soft": il.Mass(1e-3),
        "ground": il.Wall(),
        "rod": il.Rod(length=0.1, diameter=0.02, material="steel", velocity=0.1),
    }
    hertz, harder = {"kind": "hertz", "stiffness": 1e9}, {"kind": "hertz", "stiffness": 1e11}
    contacts = [
        il.Contact("hammer", "weight", {"kind": "penalty", "stiffness": 1e7}, gap=1e-4),
        il.Contact("weight", "soft", hertz),
        il.Contact("soft", "ground", harder),
        il.Contact("rod.right", "hammer", {"kind": "penalty", "stiffness": 1e7}, gap=1.0),
    ]
    solve = {**MESH, "duration": 2e-3}
    (text,) = texts(il.run(il.Case(bodies=bodies, contacts=contacts, gravity=G, solve=solve)))
    upper, lower = (
        float(re.search(rf"gap of {name}: (\S+?)(;|$)", text)[1])  # type: ignore[index]
        for name in (r"weight\|soft", r"soft\|ground")
    )
    assert -upper == pytest.approx((WEIGHT * G / 1e9) ** (2.0 / 3.0), rel=1e-8)
    assert -lower == pytest.approx(((WEIGHT + 1e-3) * G / 1e11) ** (2.0 / 3.0), rel=1e-8)


def test_a_free_body_falls_without_a_warning() -> None:
    bodies = {"hammer": il.Mass(1.0, velocity=1.0), "rod": il.Rod(length=1.0, diameter=0.02, material="steel")}
    law = {"kind": "addition_deletion"}
    case = il.Case(
        bodies=bodies,
        contacts=[il.Contact("hammer", "rod.left", law)],
        gravity=G,
        solve={"duration": 0.01, "model": {"kind": "continuous"}},
    )
    assert not texts(il.run(case))


@pytest.mark.parametrize("solve", [EXACT, MESH], ids=["exact", "mesh"])
def test_a_rod_of_several_pieces_and_a_collar_on_it_start_in_equilibrium(solve: dict[str, Any]) -> None:
    """Strain and curvature jump at the joints, and the strain where a collar rests on the rod."""
    lengths, areas, youngs, densities = (4.0, 3.0, 3.0), (4e-4, 2e-4, 5e-4), (YOUNG, 7e10, YOUNG), (7850.0, 2700.0, 9e3)
    segments = [
        {"length": length, "area": area, "material": {"young": young, "density": density}}
        for length, area, young, density in zip(lengths, areas, youngs, densities, strict=True)
    ]
    collar, at = 20.0, 5.5

    def made(shape: str | None, gap: float, low: float) -> il.Case:
        rod = il.Rod(segments=segments, ends={"left": "free", "right": "clamped"}, displacement=shape)
        bodies = {
            "hammer": il.Mass(1.0, velocity=0.5),
            "weight": il.Mass(WEIGHT),
            "collar": il.Mass(collar),
            "rod": rod,
        }
        contacts = [
            il.Contact("hammer", "weight", {"kind": "penalty", "stiffness": 1e7}, gap=1e-4),
            il.Contact("weight", "rod.left", SPRING, gap=gap, overlap="allowed"),
            il.Contact("collar", f"rod.at({at} m)", SPRING, gap=low, overlap="allowed"),
        ]
        given = {**solve, "duration": 2e-3 if shape is None else 1e-4}
        if solve is MESH:
            given["model"] = {"kind": "finite_element", "elements": 100}
        return il.Case(bodies=bodies, contacts=contacts, gravity=G, solve=given)

    (text,) = texts(il.run(made(None, 0.0, 0.0)))
    pattern = r"displacement of 'rod': (\S.*?); gap of weight\|rod.left: (\S+); gap of collar\|\S+: (\S+)$"
    shape, gap, low = re.search(pattern, text).groups()  # type: ignore[union-attr]
    sag, load, above = 0.0, WEIGHT * G, 0.0  # each piece is shortened by what stands on it and half of its own weight
    for length, area, young, density in zip(lengths, areas, youngs, densities, strict=True):
        own = density * area * length * G
        on_it = collar * G * (above + length - at) if above < at < above + length else 0.0
        sag += ((load + 0.5 * own) * length + on_it) / (young * area)
        load, above = load + own + (collar * G if above < at < above + length else 0.0), above + length
    assert float(gap) == pytest.approx(-sag - WEIGHT * G / STIFFNESS, rel=1e-6)
    at_rest = il.run(made(shape, float(gap), float(low)))
    before = np.linspace(0.0, 1e-4, 50)
    assert np.ptp(at_rest.evaluate(before, "displacement:rod@0")) < 1e-6 * sag
    for name, weight in (("weight|rod.left", WEIGHT), (f"collar|rod.at({at} m)", collar)):
        names = [each.name for each in at_rest.scene.contacts if each.name.startswith(name.partition("|")[0] + "|")]
        assert at_rest.evaluate(before[1:], f"force:{names[0]}") == pytest.approx(weight * G, rel=1e-5)


def test_seven_collars_on_a_uniform_rod_start_in_equilibrium() -> None:
    """The formula was too long: each collar had a term of the curvature, which does not jump there."""
    places, collar = [1.25 * number for number in range(1, 8)], 20.0

    def made(shape: str | None = None, gaps: tuple[float, ...] = (0.0,) * 7) -> il.Case:
        rod = il.Rod(length=LENGTH, area=AREA, material={"young": YOUNG, "density": DENSITY}, displacement=shape,
                     ends={"left": "free", "right": "clamped"})  # fmt: skip
        collars = {f"collar{number}": il.Mass(collar) for number in range(7)}
        contacts = [il.Contact("hammer", "collar0", SPRING, gap=1e-4)]
        for number, (place, gap) in enumerate(zip(places, gaps, strict=True)):
            face = f"rod.at({place} m)"
            contacts.append(il.Contact(f"collar{number}", face, SPRING, gap=gap, overlap="allowed"))
        bodies = {"hammer": il.Mass(1.0, velocity=0.5), "rod": rod, **collars}
        solve = {**EXACT, "duration": 2e-3 if shape is None else 1e-4}
        return il.Case(bodies=bodies, contacts=contacts, gravity=G, solve=solve)

    assert (weights.MAX_LENGTH, weights.MAX_NODES) == (formula.MAX_LENGTH, formula.MAX_NODES)
    (text,) = texts(il.run(made()))
    shape = re.search(r"displacement of 'rod': (\S.*?);", text)[1]  # type: ignore[index]
    at_rest = il.run(made(shape, tuple(map(float, re.findall(r"gap of collar\S+: (\S+?)(?:;|$)", text)))))
    # Each collar compresses what lies below it, and the rod itself as much as half of its weight.
    sag = DENSITY * G * LENGTH**2 / (2.0 * YOUNG) + sum(collar * G * (LENGTH - x) / (YOUNG * AREA) for x in places)
    top = at_rest.evaluate(np.linspace(0.0, 1e-4, 50), "displacement:rod@0")
    assert top[0] == pytest.approx(sag, rel=1e-8)
    assert np.ptp(top) < 1e-6 * sag
    forces = [float(at_rest.evaluate(1e-4, f"force:{each.name}")) for each in at_rest.scene.contacts[1:]]
    assert forces == pytest.approx([collar * G] * 7, rel=1e-5)


@pytest.mark.parametrize("pieces", [1, 2])
def test_a_clamped_end_takes_the_shape_that_is_proposed(pieces: int) -> None:
    """The case refuses a shape that is not zero there: the digits of the formula must be enough for any numbers."""
    random = np.random.default_rng(pieces)
    for _ in range(12):
        segments = [
            {
                "length": random.uniform(0.1, 3.0),
                "area": 10.0 ** random.uniform(-5, -2),
                "material": {"young": 10.0 ** random.uniform(9, 11), "density": random.uniform(1e3, 8e3)},
            }
            for _ in range(pieces)
        ]
        ends = {"left": {"mass": random.uniform(0.1, 9.0)}, "right": "clamped"}
        case = il.Case(
            bodies={"rod": il.Rod(segments=segments, ends=ends)}, gravity=G, solve={**MESH, "duration": 1e-3}
        )
        found = weights.StaticRest(*case.simulation())
        shape = re.search(r"displacement of 'rod': (.*)$", found.start())[1]  # type: ignore[index]
        start = case.with_("bodies.rod.displacement", shape).scene().elastic["rod"].waves.displacement  # type: ignore[union-attr]
        assert start(np.zeros(1))[0] == pytest.approx(found.sags[found.nodes["rod", 0.0]], rel=1e-9)  # type: ignore[misc]
