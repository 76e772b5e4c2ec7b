"""Chains of links keep the contract of equations of motion."""

from __future__ import annotations

from typing import Any

import impactlab as il
from impactlab.mechanisms.chain import Chain
from impactlab.scene.bodies import Mechanism
from impactlab.testing.contracts import EquationsContract

STEEL = {"young": 2.1e11, "density": 7850.0}
BAR = {"kind": "link", "length": 0.5, "mass": 0.7}
RULER = {"kind": "beam", "length": 0.3, "section": {"width": 0.01, "height": 0.004}, "material": STEEL}
STOPS = {"east": {"kind": "wall"}, "north": {"kind": "wall"}}


def chain(bodies: dict[str, Any], links: list[dict[str, Any]], end: Any = "free") -> Chain:
    """Return a chain whose last end and middle of the first link are read."""
    last, first = links[-1]["body"], links[0]["body"]
    law = {"kind": "hertz", "stiffness": 1e9}
    contacts = [
        {"between": [f"{last}.right", "east"], "along": "x", "gap": 9.0, "law": law},
        {"between": [f"{first}.at({0.37 * bodies[first]['length']})", "north"], "along": [0.6, 0.8], "gap": 9.0,
         "law": law},
    ]  # fmt: skip
    case = il.Case.from_dict(
        {
            "schema_version": 1,
            "bodies": {**bodies, **STOPS},
            "mechanisms": {"chain": {"links": links, "end": end}},
            "contacts": contacts,
            "solve": {"duration": 1e-3, "model": {"kind": "modal", "elements": 20, "modes": 4}, "step": {"dt": 1e-5}},
        }
    )
    simulation = case.simulation()
    mechanism = simulation.scene.bodies["chain"]
    assert isinstance(mechanism, Mechanism)
    return Chain(mechanism, simulation.method.models)


class TestRigidLinks(EquationsContract):
    part = chain(
        {"one": BAR, "two": BAR | {"length": 0.8}},
        [{"body": "one", "angle": 0.3, "rate": 2.0}, {"body": "two", "angle": -0.4, "torque": 0.3, "end_mass": 0.2}],
    )


class TestRigidLinksOnASlide(EquationsContract):
    part = chain(
        {"crank": BAR | {"length": 0.1}, "rod": BAR},
        [{"body": "crank", "angle": 1.0, "rate": 9.0}, {"body": "rod", "end_mass": 0.4}],
        {"slide": 0.02},
    )


class TestADrivenCrankAndItsFlexibleRod(EquationsContract):
    part = chain(
        {"crank": BAR | {"length": 0.1}, "rod": RULER},
        [{"body": "crank", "drive": {"rate": 30.0}}, {"body": "rod", "axial_modes": 2, "end_mass": 0.5}],
        {"slide": 0.0},
    )
    duration, steps = 2e-3, 500


class TestAFlexibleArm(EquationsContract):
    part = chain({"arm": RULER}, [{"body": "arm", "torque": 0.5, "rate": 1.0, "end_mass": 0.1, "axial_modes": 1}])
    duration, steps = 2e-3, 500


class TestABeamOnAHubAndALinkClampedToIt(EquationsContract):
    part = chain(
        {"beam": RULER, "tip": RULER | {"length": 0.2}, "bar": BAR},
        [
            {"body": "beam", "joint": "clamped", "drive": {"rate": 6.0, "within": 0.01}, "axial_modes": 1},
            {"body": "tip", "joint": "clamped", "angle": 0.7},
            {"body": "bar", "angle": 0.2, "end_mass": 0.1},
        ],
    )
    duration, steps = 0.01, 1000
