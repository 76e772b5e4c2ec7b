"""Rods that strike beams, under a tolerance: their steps divide the transit of the rod."""

from __future__ import annotations

import math

import pytest

import impactlab as il
from impactlab.metrics.peaks import peak_force
from impactlab.refine.descriptions.beam_modes import BeamModesFamily
from impactlab.scene.method import Simulation


@pytest.mark.parametrize("tolerance", [1e-1, 1e-2])
def test_runs_of_unequal_fineness_have_unequal_steps(tolerance: float) -> None:
    """A rod takes at most one step in a transit, here short beside the contact: two like runs would show no error."""
    steel = {"young": 1e11, "density": 4000.0}
    beam = il.Beam(length=1.6, section={"width": 0.04, "height": 0.04}, material=steel, ends={"right": {"mass": 80.0}})
    case = il.Case(
        bodies={"rod": il.Rod(length=1.0, area=1e-5, material=steel, velocity=0.4), "beam": beam},
        contacts=[il.Contact("rod.right", "beam.right", {"kind": "penalty", "stiffness": 1.5e5})],
        solve={"duration": 0.06, "tolerance": tolerance},
    )
    history, fine = il.run(case), il.run(case.with_("solve.tolerance", 1e-4))
    assert history.choice is not None
    assert history.choice.expected_error is not None
    error = peak_force(history, fine, history.scene)
    assert error is not None
    assert error <= history.choice.expected_error + 1e-4
    description = BeamModesFamily(Simulation(*case.simulation())).description()
    transit = 1.0 / math.sqrt(1e11 / 4000.0)
    for steps in (description.whole(43), description.whole(300)):
        step = description.simulation(steps).method.step.dt
        assert step is not None
        assert transit / step == pytest.approx(round(transit / step), rel=1e-12)
