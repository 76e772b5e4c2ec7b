"""A damped rod let go from its first mode: u = exp(-z t) (cos w' t + (z/w') sin w' t) cos k x, whatever the mesh."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

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
        "rod",
        (piece,),
        End("free"),
        End("clamped"),
        displacement=lambda x: 1e-6 * np.cos(NUMBER * x),
        damping=rayleigh,
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
def test_it_decays_as_the_closed_form_says(model, damping):
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
