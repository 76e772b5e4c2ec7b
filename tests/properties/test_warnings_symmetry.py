"""A mirror image, another order of bodies and another size of a scene have the same warnings, with the same numbers."""

from __future__ import annotations

import json
import random
import re
from pathlib import Path
from typing import Any

import pytest

import impactlab as il

STEEL = {"young": 2.1e11, "density": 7900.0}
METHODS = [
    {"model": {"kind": "finite_element", "elements": 10, "mass": "lumped"},
     "integrator": {"kind": "central_difference"}, "step": {"courant": 0.8}},
    {"model": {"kind": "finite_element", "elements": 10},
     "integrator": {"kind": "newmark"}, "step": {"points_per_period": 20}},
    {"model": {"kind": "modal", "modes": 20},
     "integrator": {"kind": "moreau_jean"}, "step": {"points_per_period": 20}},
    {"model": {"kind": "continuous"}},
]  # fmt: skip
SAME = 0.02  # of a number in a text: these have two or three digits
SIZES = (1.0 / 1024.0, 1024.0)  # lengths and times of a scene: all its ratios stay the same
SEEDS = [*range(12), 34, 42, 86, 126, 163, 188]  # `near_grazing` and `drift` were in round trips of the first rod
Scene = tuple[list[dict[str, Any]], list[dict[str, Any]], list[float], dict[str, Any], float]


def scene_of(seed: int) -> Scene:
    """Return bodies in a row, the laws and gaps between them, a method and a duration [s]."""
    rng = random.Random(seed)
    bodies: list[dict[str, Any]] = []
    for _ in range(rng.randint(2, 4)):
        velocity = round(rng.uniform(-2.0, 2.0), 2)
        if rng.random() < 0.3:
            bodies.append({"kind": "mass", "mass": round(rng.uniform(0.1, 5.0), 3), "velocity": velocity})
        else:
            length, area = round(rng.uniform(0.1, 1.0), 3), 1e-4 * rng.randint(1, 9)
            rod = {"kind": "rod", "length": length, "area": area, "material": STEEL, "velocity": velocity}
            bodies.append(rod | {"ends": {"left": "free", "right": "free"}})
    if all(body["kind"] == "mass" for body in bodies):
        bodies[-1] = {"kind": "rod", "length": 0.3, "area": 1e-4, "material": STEEL, "velocity": 0.0}
    bodies[0]["velocity"] = abs(bodies[0]["velocity"]) + 0.5
    if rng.random() < 0.3:
        bodies.append({"kind": "wall"})
    method = rng.choice(METHODS)
    hard = {"kind": "wave_identification"} if method is METHODS[-1] else {"kind": "velocity_complementarity"}
    laws = [rng.choice([{"kind": "penalty", "stiffness": 10 ** rng.uniform(7.0, 9.0)}, hard]) for _ in bodies[1:]]
    gaps = [rng.choice([0.0, 0.0, 1e-5]) for _ in laws]
    return bodies, laws, gaps, method, rng.choice([4e-4, 1e-3, 2e-3])


def case_of(scene: Scene, mirrored: bool = False, order: list[int] | None = None, size: float = 1.0) -> dict[str, Any]:
    """Return the document of a scene: seen in a mirror, its bodies listed in another order, or of another size."""
    bodies, laws, gaps, method, duration = scene
    blocks: dict[str, Any] = {}
    for number in order or range(len(bodies)):
        block = blocks[f"b{number}"] = dict(bodies[number])
        powers = {"length": 1, "area": 2, "mass": 3, "velocity": 0}
        for key in powers.keys() & block.keys():
            block[key] *= (-1.0 if mirrored and key == "velocity" else 1.0) * size ** powers[key]
    contacts = []
    for number, (law, gap) in enumerate(zip(laws, gaps, strict=True)):
        sides = [(number, "right"), (number + 1, "left")]
        if mirrored:
            sides = [(number + 1, "right"), (number, "left")]
        between = [f"b{i}.{end}" if bodies[i]["kind"] == "rod" else f"b{i}" for i, end in sides]
        law = law | ({"stiffness": law["stiffness"] * size} if "stiffness" in law else {})
        contacts.append({"between": between, "gap": gap * size, "law": law})
    if order or mirrored:
        contacts.reverse()
    solve = {"duration": duration * size, **method}
    return {"schema_version": 1, "title": "row", "bodies": blocks, "contacts": contacts, "solve": solve}


def warnings_of(document: dict[str, Any], folder: Path) -> list[tuple[str, list[float]]]:
    """Return code and numbers of each warning, in an order that knows no names."""
    path = folder / "case.json"
    path.write_text(json.dumps(document))
    found = []
    for code, text, _ in il.run(il.load_case(path)).warnings:
        plain = re.sub(r"b\d(\.left|\.right|@[\d.e-]+)?", "", text)
        found.append((code, [float(each) for each in re.findall(r"\d+\.?\d*(?:e[-+]?\d+)?", plain)]))
    return sorted(found)


@pytest.mark.filterwarnings("ignore::impactlab.errors.DoubtfulResult")
@pytest.mark.parametrize("seed", SEEDS)
def test_warnings_depend_neither_on_sides_nor_order_nor_size(seed: int, tmp_path: Path) -> None:
    scene = scene_of(seed)
    given = warnings_of(case_of(scene), tmp_path)
    order = list(reversed(range(len(scene[0]))))
    for other in (case_of(scene, mirrored=True), case_of(scene, order=order), case_of(scene, True, order)):
        found = warnings_of(other, tmp_path)
        assert [code for code, _ in found] == [code for code, _ in given]
        for (_, numbers), (_, wanted) in zip(found, given, strict=True):
            assert numbers == pytest.approx(wanted, rel=SAME)
    for size in SIZES:
        found = warnings_of(case_of(scene, size=size), tmp_path)
        assert [code for code, _ in found] == [code for code, _ in given]
