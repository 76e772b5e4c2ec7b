"""Nothing moves before the wave arrives, except for the precursor of discrete models (bounds in docs/bounds.md)."""

from __future__ import annotations

import pytest

from impactlab.contact.penalty import Penalty
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import Segment
from impactlab.scene.method import StepRule
from impactlab.testing.invariants import precursor
from impactlab.testing.scenes import STEEL, mass_on_rod
from impactlab.testing.trace import run_in_cuts
from impactlab.types import Relative

POINTS = StepRule(points_per_period=20.0)


def ahead(
    model: AbstractRodModel, integrator: AbstractIntegrator, step: StepRule, margin: float, piece: Segment
) -> float:
    transit = piece.length / piece.wave_speed
    snapshots = tuple(transit * i / 20.0 for i in range(2, 18))
    trips = {"round_trips": 0.5, "velocity": 2.0, "snapshots": snapshots}
    scene = mass_on_rod(model, Penalty(Relative(1.0)), integrator, step, segments=(piece,), **trips)
    return precursor(run_in_cuts(scene, lambda reached: reached + 10**6), "rod", 2.0, margin * piece.length)


RUBBER = Segment(2.0, 1e-2, 1e8, 1200.0)


@pytest.mark.parametrize("piece", [STEEL, RUBBER])
@pytest.mark.parametrize(
    ("model", "integrator", "step", "margin", "bound"),
    [
        # One element a step: a wave cannot be faster than the mesh hands it on.
        (FiniteElement(100, "lumped"), CentralDifference(), StepRule(courant=1.0), 0.0, 0.0),
        # Lumped meshes are slower than the rod: their precursor dies out, the faster the finer the mesh.
        (FiniteElement(100, "lumped"), CentralDifference(), StepRule(courant=0.5), 0.1, 1e-4),
        (FiniteElement(400, "lumped"), CentralDifference(), StepRule(courant=0.5), 0.05, 1e-6),
        (FiniteElement(100, "lumped"), Newmark(), POINTS, 0.1, 2e-4),
        (FiniteElement(400, "lumped"), Newmark(), POINTS, 0.05, 1e-5),
        # Consistent meshes are faster than the rod: their short waves run ahead.
        (FiniteElement(100), Newmark(), POINTS, 0.05, 0.25),
        # Truncated modes ripple everywhere, as one over their number.
        (Modal(None, 40), ExactModal(), StepRule(points_per_period=10.0), 0.1, 0.02),
        (Modal(None, 400), ExactModal(), StepRule(points_per_period=10.0), 0.1, 0.004),
    ],
)
def test_precursor_is_below_its_bound(
    model: AbstractRodModel, integrator: AbstractIntegrator, step: StepRule, margin: float, bound: float, piece: Segment
) -> None:
    assert ahead(model, integrator, step, margin, piece) <= bound
