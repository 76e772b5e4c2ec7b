"""A damped rod let go from its first mode: u = exp(-z t) (cos w' t + (z/w') sin w' t) cos k x, whatever the mesh."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab import simulate
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.newmark import Newmark
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import End, Probe, Rayleigh, Rod, Segment
from impactlab.scene.method import StepRule
from impactlab.testing.scenes import simulation

PIECE = Segment(0.3, 9e-4, 2.1e11, 7900.0)
NUMBER = 0.5 * np.pi / PIECE.length
TURN = NUMBER * PIECE.wave_speed
STEPS = 400
DAMPINGS = {
    "none": (0.0, Rayleigh()),
    "viscosity": (2e5, Rayleigh()),
    "rayleigh of mass": (0.0, Rayleigh(500.0, 0.0)),
    "rayleigh of stiffness": (0.0, Rayleigh(0.0, 1e-6)),
    "all": (1e5, Rayleigh(300.0, 5e-7)),
}
# Meshes whose first frequency is right to 1e-6: of order 2 n, so that little space is needed.
MODELS = {
    "spectral, lumped": FiniteElement(6, "lumped", 4),
    "spectral, consistent": FiniteElement(8, "consistent", 3),
    "analytic modes": Modal(None, 5),
    "modes of a spectral mesh": Modal(6, 5, order=4),
    "bars": FiniteElement(400, "consistent"),
}


def swing(model, integrator, damping):
    """The rod over one of its periods, and the exact displacement of its free end."""
    viscosity, rayleigh = DAMPINGS[damping]
    piece = dataclasses.replace(PIECE, viscosity=viscosity)
    rod = Rod(
        "rod", (piece,), End("free"), End("clamped"), displacement=lambda x: 1e-6 * np.cos(NUMBER * x), damping=rayleigh
    )
    dt = 2.0 * np.pi / TURN / STEPS
    probe = Probe("rod", 0.0, "displacement")
    scene = simulation("swing", {"rod": rod}, (), STEPS * dt, integrator, StepRule(dt=dt), probes=(probe,), model=model)
    t = dt * np.arange(STEPS + 1)
    decay = 0.5 * (rayleigh.mass + (rayleigh.stiffness + viscosity / piece.young) * TURN**2)
    turn = np.sqrt(TURN**2 - decay**2)
    exact = np.exp(-decay * t) * (np.cos(turn * t) + decay / turn * np.sin(turn * t))
    history = simulate.run(*scene)
    return history, history.evaluate(t, probe.channel) / 1e-6, exact


@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS.keys())
def test_it_decays_by_the_closed_form(model, damping):
    history, found, exact = swing(model, Newmark(), damping)
    # Average acceleration turns too slowly by (w dt)^2/12 = 2.06e-5 of the angle, 2 pi after one period: 1.3e-4.
    assert np.max(np.abs(found - exact)) < 1.35e-4
    book = history.energy
    assert max(book.largest_gain, book.largest_loss) < 1e-12
    lost = float(book.booked["damping"][-1])
    if damping == "none":
        assert lost == 0.0
    else:
        # After one period the rod stands almost still, its energy that of its shape; the scheme's angle as above.
        strained = 0.25 * PIECE.young * PIECE.area * NUMBER**2 * PIECE.length * 1e-12
        assert lost == pytest.approx(strained * (1.0 - exact[-1] ** 2), rel=2e-4)


def test_spectral_elements_step_explicitly():
    _, found, exact = swing(FiniteElement(6, "lumped", 4), CentralDifference(), "none")
    # Leapfrog turns too fast by (w dt)^2/24.
    assert np.max(np.abs(found - exact)) < 6.6e-5


def loaded_slowly(body: dict[str, Any], read: list[str], solve: dict[str, Any]) -> il.Case:
    """A viscous body under a constant force, whose material gives way far more slowly than its waves travel."""
    probes = [{"body": "b", "at": place, "quantity": each} for each in read for place in (0.1, 0.25)]
    blocks = {"schema_version": 1, "bodies": {"b": body}, "probes": probes, "snapshots": [0.002]}
    return il.Case.from_dict({**blocks, "solve": {"duration": 5e-3, **solve}})


MESH = {"model": {"kind": "finite_element", "elements": 40}, "integrator": {"kind": "newmark"}, "step": {"dt": 2e-6}}
SOLVES = {
    "mesh": MESH,
    "modes": MESH | {"model": {"kind": "modal", "elements": 40, "modes": 40}},
    "adaptive": {
        "model": {"kind": "finite_element", "elements": 8},
        "integrator": {"kind": "adaptive", "method": "Radau"},  # implicit, as all is viscous
        "step": {"dt": 1e-4},
    },
}


@pytest.mark.parametrize("solve", list(SOLVES))
def test_internal_forces_hold_the_viscous_stress(solve: str) -> None:
    """Along a rod under a force F they are F, of which E eps is the share 1 - exp(-t E/eta)."""
    young, viscosity, area, force = 3e9, 3e6, 1e-4, 1000.0
    material = {"young": young, "density": 1200, "viscosity": viscosity}
    ends = {"left": {"force": force}, "right": "clamped"}
    rod = {"kind": "rod", "length": 0.5, "area": area, "material": material, "ends": ends}
    history = il.run(loaded_slowly(rod, ["force", "stress", "strain"], SOLVES[solve]))
    for t in (1e-3, 2e-3, 5e-3):
        elastic = force * (1.0 - math.exp(-t * young / viscosity))
        for place in ("0.1", "0.25"):
            given = [float(history.evaluate(t, f"{each}:b@{place}")) for each in ("force", "stress", "strain")]
            assert given[0] == pytest.approx(force, rel=0.03)
            assert given[1] * area == pytest.approx(given[0], rel=1e-12)
            assert given[2] * young * area == pytest.approx(elastic, rel=0.03)
    fields = [history.field("b", 0.002, each, [0.1, 0.25]).values for each in ("force", "stress", "strain")]
    for place, number in (("0.1", 0), ("0.25", 1)):
        assert fields[0][number] == pytest.approx(float(history.evaluate(0.002, f"force:b@{place}")), rel=1e-3)
    np.testing.assert_allclose(fields[1] * area, fields[0], rtol=1e-12)
    np.testing.assert_allclose(fields[2] * young * area, force * (1.0 - math.exp(-2.0)), rtol=0.03)


def test_torque_and_bending_moment_hold_the_viscous_stress() -> None:
    shaft = {
        "kind": "shaft",
        "length": 0.5,
        "section": {"diameter": 0.02},
        "ends": {"left": {"torque": 10.0}, "right": "clamped"},
    }
    shaft["material"] = {"shear_modulus": 1e9, "density": 1200, "viscosity": 1e6}
    twisted = il.run(loaded_slowly(shaft, ["torque"], MESH))
    assert [float(twisted.evaluate(t, "torque:b@0.25")) for t in (2e-3, 5e-3)] == pytest.approx([10.0, 10.0], rel=0.05)
    beam = {"kind": "beam", "length": 0.5, "section": {"width": 0.02, "height": 0.02}}
    beam |= {"material": {"young": 3e9, "density": 1200, "viscosity": 1e9}, "ends": {"left": "clamped"}}
    beam["ends"]["right"] = {"force": 10.0}
    solve = MESH | {"duration": 0.5, "step": {"dt": 1e-4}}
    bent = il.run(loaded_slowly(beam, ["bending_moment", "shear_force"], solve))
    share = 1.0 - math.exp(-0.5 * 3.0)  # of the elastic part
    for place, arm in (("0.1", 0.4), ("0.25", 0.25)):
        moment, shear = (float(bent.evaluate(0.5, f"{each}:b@{place}")) for each in ("bending_moment", "shear_force"))
        assert abs(moment) == pytest.approx(10.0 * arm, rel=0.02)
        assert abs(moment) * share < 0.8 * 10.0 * arm
        assert abs(shear) == pytest.approx(10.0, rel=0.03)


@pytest.mark.parametrize(
    ("kind", "solve"), [("shaft", next(iter(SOLVES))), *((kind, solve) for kind in ("rod", "beam") for solve in SOLVES)]
)
def test_damping_in_proportion_to_the_stiffness_is_a_viscosity_also_in_internal_forces(kind: str, solve: str) -> None:
    """Rayleigh's b K is the matrix of a viscosity b E: both descriptions have one motion, and one force inside."""
    factor, force = 1e-4, 10.0
    material = {"density": 1200.0} | ({"shear_modulus": 3e9} if kind == "shaft" else {"young": 3e9})
    loads = {"rod": {"force": force}, "shaft": {"torque": force}, "beam": {"force": force}}
    sections: dict[str, Any] = {"rod": {"area": 1e-4}, "shaft": {"section": {"diameter": 0.02}}}
    body = {"kind": kind, "length": 0.5, "ends": {"left": "clamped", "right": loads[kind]}}
    body |= sections.get(kind, {"section": {"width": 0.02, "height": 0.02}})
    viscous = body | {"material": material | {"viscosity": factor * 3e9}}
    rayleigh = body | {"material": material, "damping": {"stiffness": factor}}
    read = {"rod": ["force", "stress", "strain"], "shaft": ["torque"], "beam": ["bending_moment", "shear_force"]}[kind]
    one, other = (il.run(loaded_slowly(each, read, SOLVES[solve])) for each in (viscous, rayleigh))
    t = np.linspace(0.0, one.duration, 101)
    for quantity in read:
        channel = f"{quantity}:b@0.25"
        expected = one.evaluate(t, channel)
        np.testing.assert_allclose(other.evaluate(t, channel), expected, atol=1e-6 * np.abs(expected).max())
        fields = [each.field("b", 0.002, quantity, [0.1, 0.25]).values for each in (one, other)]
        np.testing.assert_allclose(fields[1], fields[0], rtol=1e-6)
