"""Infinite ends: a dashpot of its impedance for a rod, a layer that absorbs for the mesh of a beam."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import impactlab as il
from impactlab.contact.power_law import Hertz
from impactlab.errors import PairingError
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.beams import BeamMesh
from impactlab.numerics.banded import full
from impactlab.scene import Beam, End
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare, run
from impactlab.testing.scenes import struck
from tests.reference.test_infinite_beam import EI, RHO_A, SEGMENT
from tests.reference.test_timoshenko_waves import beam as timoshenko

FREE, INFINITE = End("free"), End("infinite")
PILE = """
schema_version: 1
bodies:
  hammer: {{kind: mass, mass: 2.133, velocity: 1.0}}
  rod: {{kind: rod, length: 0.3, area: 9 cm^2, material: {{young: 210 GPa, density: 7900}}, ends: {{right: infinite}}}}
contacts: [{{between: [hammer, rod.left], law: {law}}}]
solve: {{duration: {{round_trips: 3}}, {solve}}}
"""
FINE = "model: {kind: finite_element, elements: 400, mass: lumped}, integrator: {kind: central_difference}, "


@pytest.mark.parametrize(
    ("law", "solve", "within"),
    [
        ("{kind: wave_identification}", "model: {kind: continuous}", 1e-12),
        # Lumped elements at h/c carry the wave exactly; the mass is of second order in 1/400 of the length.
        ("{kind: addition_deletion}", FINE + "step: {courant: 1.0}", 2e-4),
    ],
)
def test_nothing_comes_back_in_a_rod_that_goes_on(tmp_path: Path, law: str, solve: str, within: float) -> None:
    """A mass on a semi-infinite rod slows down as e^(-Z t/M); the energy it lost has left through the end, or is on
    its way: what passed it within the last L/c."""
    file = tmp_path / "pile.yaml"
    file.write_text(PILE.format(law=law, solve=solve), encoding="utf-8")
    case = il.load_case(file)
    history = il.run(case)
    trip = case.scene().round_trip
    t = np.linspace(0.01, 3.0, 50) * trip  # at once the impulse of the end node's mass acts
    assert_allclose(history.evaluate(t, "velocity:hammer"), np.exp(-2.0 * t / trip), atol=within)
    book = history.energy
    lost = 0.5 * 2.133 * (1.0 - math.exp(-4.0 * (3.0 - 0.5)))
    assert book.booked["ends"][-1] == pytest.approx(lost, rel=max(1e-2 * (within > 1e-6), 1e-9))


def sent_back(lumped: bool, waves: float, elements: int = 100) -> float:
    """Return the reflection of a wave of number ``waves``/l in an Euler-Bernoulli beam, l the length of its layer.

    The free tip of a mesh is shaken; of the deflections between 0.4 L and 0.9 L the parts e^(-ikx), e^(ikx), e^(-kx),
    e^(kx) are fitted.
    """
    mesh = BeamMesh(
        Beam("beam", (dataclasses.replace(SEGMENT, length=1.0),), FREE, INFINITE),
        elements, "lumped" if lumped else "consistent", 0.0,
    )  # fmt: skip
    k = waves / 2.0
    omega = k**2 * math.sqrt(EI / RHO_A)
    system = full(mesh.stiffness) + 1j * omega * full(mesh.damping) - omega**2 * full(mesh.mass)
    answer = np.linalg.solve(system, mesh.row(0.0, "displacement"))
    x = mesh.nodes[int(0.4 * elements) : int(0.9 * elements)]
    w = answer[::2][int(0.4 * elements) : int(0.9 * elements)]
    waves_of = np.array([np.exp(-1j * k * x), np.exp(1j * k * (x - 1.0)), np.exp(-k * x), np.exp(k * (x - 1.0))])
    parts = np.linalg.lstsq(waves_of.T, w, rcond=None)[0]
    return float(abs(parts[1] / parts[0]))


@pytest.mark.parametrize(
    ("lumped", "waves", "most"),
    [
        (False, 8.0, 3e-2),
        (False, 10.0, 1e-2),
        (False, 15.0, 3e-3),
        (False, 20.0, 1e-3),
        (False, 60.0, 1e-3),
        (True, 10.0, 6e-2),
        (True, 15.0, 1e-2),
        (True, 40.0, 1e-2),
    ],
)
def test_what_the_layer_of_a_mesh_sends_back(lumped: bool, waves: float, most: float) -> None:
    assert sent_back(lumped, waves) < most


def scene(body: Beam, integrator: Any, dt: float, duration: float) -> Simulation:
    law, middle = Hertz(stiffness=1.58e10), 0.5 * body.length
    return struck(body, None, law, integrator, StepRule(dt=dt), mass=0.0333, x=middle, duration=duration)


@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_a_mesh_with_layers_answers_like_the_infinite_beam(theory: str, mass: str) -> None:
    """The contact lasts 100 us; its waves, of 10 cm, would be back at the middle of 60 cm after 200 us."""
    model = FiniteElement(elements=240, mass=mass)  # type: ignore[arg-type]
    piece = (
        Beam("beam", (dataclasses.replace(SEGMENT, length=0.6),), INFINITE, INFINITE)
        if theory == "euler_bernoulli"
        else timoshenko(INFINITE, INFINITE, 0.6)
    )
    scheme, dt = (CentralDifference(), 2e-8) if mass == "lumped" else (Newmark(), 2e-7)
    mesh = run(*scene(piece, scheme, dt, 1e-3).but(model=model))
    endless = run(*scene(piece, None, 2e-7, 1e-3).but(model=Continuous()))
    t = np.linspace(0.0, 1e-3, 400)
    for channel in ("velocity:hammer", "velocity:beam@0.3"):
        one, other = mesh.evaluate(t, channel), endless.evaluate(t, channel)
        # 3e-3 of the largest: 1 % of the low end of the spectrum comes back, and mesh and steps err by 1e-3.
        assert np.max(np.abs(one - other)) < (1e-2 if mass == "lumped" else 5e-3) * np.max(np.abs(other)), channel
    assert max(mesh.energy.largest_gain, mesh.energy.largest_loss) < 1e-3
    # What the waves carried away is booked as damping.
    assert mesh.energy.booked["damping"][-1] > 0.0


def test_a_beam_that_moves_or_has_weight_has_no_layer() -> None:
    case = scene(Beam("beam", (SEGMENT,), INFINITE, INFINITE, velocity=1.0), Newmark(), 1e-6, 1e-5).but(
        model=FiniteElement()
    )
    with pytest.raises(PairingError, match="moves as a whole"):
        prepare(*case)
    still = {**case.scene.bodies, "beam": dataclasses.replace(case.scene.bodies["beam"], velocity=0.0)}
    with pytest.raises(PairingError, match="has weight"):
        prepare(*case.but(bodies=still, gravity=-9.81))
