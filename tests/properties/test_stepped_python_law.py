"""Compiled law, called-back law and a run in plain Python give the same values; errors of a law reach the caller."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, final

import numpy as np
import pytest

from impactlab import simulate
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import StepError
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene.method import Simulation, StepRule
from impactlab.testing.scenes import mass_on_rod
from impactlab.testing.trace import trace
from impactlab.types import Level, Port, Relative, Reply, SideFacts, Start


def called_back(law: AbstractContactLaw) -> AbstractContactLaw:
    """Return the same law, never compiled."""
    kind: Any = type(law)
    options = {field.name: getattr(law, field.name) for field in fields(kind) if field.init}
    plain: Any = type(kind.__name__, (kind,), {"compiled": False, "__module__": kind.__module__})
    return plain(**options)  # type: ignore[no-any-return]


@final
@dataclass(frozen=True)
class Broken(AbstractContactLaw):
    """Raises at a touch after a while."""

    needs = frozenset({Level.POSITION})
    compiled = False

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(parameters=(40.5 * dt,))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        if port.time > port.parameters[0]:
            raise ValueError("the table ends here")
        reply.force = 1.0
        reply.in_contact = 1.0


SETTINGS: dict[str, tuple[AbstractRodModel, AbstractIntegrator, StepRule]] = {
    "mesh": (FiniteElement(20), Newmark(), StepRule(points_per_period=10.0)),
    "leapfrog": (FiniteElement(20, "lumped"), CentralDifference(), StepRule(courant=0.4)),
    "modes": (Modal(20, 10), ExactModal(), StepRule(points_per_period=10.0)),
}
LAWS = {"penalty": Penalty(Relative(1.0), Relative(0.1)), "wave": WaveIdentification()}


def scene(setting: str, law: AbstractContactLaw) -> Simulation:
    model, integrator, step = SETTINGS[setting]
    return mass_on_rod(model, law, integrator, step, round_trips=1.2)


def values(setting: str, law: AbstractContactLaw) -> np.ndarray[Any, Any]:
    traced = trace(scene(setting, law))
    return np.column_stack((traced.forces, traced.velocities("hammer")[1:], traced.displacements("rod")[1:, :3]))


def agree(one: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> bool:
    # 1e-12 of the largest value of each quantity: some hundred steps that round otherwise.
    return bool(np.all(np.abs(one - other) <= 1e-12 * np.abs(one).max(axis=0)))


@pytest.mark.parametrize("setting", list(SETTINGS))
@pytest.mark.parametrize("law", list(LAWS))
def test_compiled_law_and_callback_law_give_the_same_values(setting: str, law: str) -> None:
    assert agree(values(setting, LAWS[law]), values(setting, called_back(LAWS[law])))


def all_values() -> dict[str, np.ndarray[Any, Any]]:
    return {f"{setting} {law}": values(setting, LAWS[law]) for setting in SETTINGS for law in LAWS}


def test_compiled_run_and_plain_run_give_the_same_values(tmp_path: Path) -> None:
    kept = tmp_path / "plain.npz"
    code = (
        "import importlib.util, sys, numpy\n"
        f"spec = importlib.util.spec_from_file_location('plain_run', {str(Path(__file__))!r})\n"
        "module = importlib.util.module_from_spec(spec); sys.modules['plain_run'] = module\n"
        "spec.loader.exec_module(module)\n"
        f"numpy.savez({str(kept)!r}, **module.all_values())\n"
    )
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment, timeout=300)
    with np.load(kept) as plain:
        for name, compiled in all_values().items():
            assert agree(compiled, plain[name]), name


def test_exception_in_a_law_reaches_the_caller_with_the_history_so_far() -> None:
    with pytest.raises(StepError, match="ValueError: the table ends here") as caught:
        simulate.run(*scene("mesh", Broken()))
    error = caught.value
    assert isinstance(error.__cause__, ValueError)
    assert error.step == 41
    assert error.history is not None
    assert error.history.dt is not None
    assert error.time == pytest.approx(41 * error.history.dt)
    assert error.history.evaluate(20 * error.history.dt, "force:hammer|rod.left") == pytest.approx(1.0)
