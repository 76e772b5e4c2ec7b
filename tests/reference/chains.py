"""Cases of one mechanism, and the equations of motion of a chain at any state: shared by tests of mechanisms."""

from __future__ import annotations

from typing import Any

import numpy as np

import impactlab as il
from impactlab.mechanisms.chain import Chain as LinkedChain
from impactlab.mechanisms.chain import packed
from impactlab.mechanisms.model import MechanismModel
from impactlab.mechanisms.terms import terms
from impactlab.numerics.addresses import TERMS, entered, kernel_address
from impactlab.scene.bodies import Mechanism
from impactlab.testing.contracts.mechanisms import taken
from tests.solving import in_steps

ALUMINIUM = {"young": 7.0e10, "density": 2700.0}


def document(bodies: dict[str, Any], links: list[dict[str, Any]], duration: float, dt: float, **more: Any) -> il.Case:
    """Return a case of one mechanism."""
    end, modes = more.pop("end", "free"), more.pop("modes", 20)
    return il.Case.from_dict(
        {
            "schema_version": 1,
            "bodies": bodies,
            "mechanisms": {"chain": {"links": links, "end": end}},
            "solve": in_steps(duration, "midpoint", {"kind": "modal", "elements": 160, "modes": modes}, dt=dt),
            **more,
        }
    )


def flat(length: float, width: float, height: float, material: dict[str, float]) -> dict[str, Any]:
    return {"kind": "beam", "length": length, "section": {"width": width, "height": height}, "material": material}


class Chain:
    """Mass matrix and force of the mechanism of a case at any state."""

    def __init__(self, case: il.Case) -> None:
        simulation = case.simulation()
        mechanism = simulation.scene.bodies["chain"]
        assert isinstance(mechanism, Mechanism)
        part = LinkedChain(mechanism, simulation.method.models)
        self.model = MechanismModel(mechanism, part)
        self.angles = [each for each in packed(mechanism, part.flexible).angles if each >= 0]
        self.n, self.readings = self.model.count, self.model.readings

    def at(self, p: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        n, r = self.n, self.readings
        mass, force, rows = np.zeros(n * n), np.zeros(n), np.zeros(n * r)
        address, out = kernel_address(terms, TERMS), (mass, force, rows, np.zeros(r + 1), np.zeros(r))
        entered(taken, address, self.model.packed.parameters, 0.0, p, v, *out)
        return mass.reshape(n, n), force

    def angular_momentum(self, p: np.ndarray, v: np.ndarray) -> float:
        """Return the angular momentum about the ground hinge [N m s]: the chain turns as one where all angles do."""
        return float((self.at(p, v)[0] @ v)[self.angles].sum())
