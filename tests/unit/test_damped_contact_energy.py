"""A hard contact on a damped rod: what dampers and contact take is booked to the last digit, and nothing is gained."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.contact_stabilised_newmark import ContactStabilisedNewmark
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.models.finite_element import FiniteElement
from impactlab.scene import Rayleigh
from impactlab.scene.method import StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import UNIT, mass_on_rod

ROUNDING = 1e-12  # of the energy: 1e3 steps of 1e2 sums, each right to 1e-16


def struck(integrator: AbstractIntegrator, courant: float, viscous: float = 0.02) -> AbstractHistory:
    """Run a mass against the free end of a clamped bar of Kelvin and Voigt, on 50 elements."""
    fields = {"segments": (UNIT,), "damping": Rayleigh(stiffness=viscous), "mass_ratio": 0.8}
    return run(*mass_on_rod(FiniteElement(50), AdditionDeletion(), integrator, StepRule(courant=courant), **fields))


@pytest.mark.parametrize("theta", [0.51, 0.75, 1.0])
@pytest.mark.parametrize("courant", [0.5, 5.0])
def test_a_contact_takes_its_force_times_the_way_of_its_faces(theta: float, courant: float) -> None:
    """A theta method loses (theta - 1/2) ([v] M [v] + [u] K [u]) beside; by mean velocities 0.2 % were booked twice."""
    book = struck(MoreauJean(theta=theta), courant).energy
    assert book.largest_gain < ROUNDING
    # What nothing books, the scheme's own loss, never comes back.
    assert np.max(np.diff(book.balance)) < ROUNDING * book.scale


@pytest.mark.parametrize("courant", [0.5, 5.0])
def test_dampers_feel_the_projection_of_a_predictor(courant: float) -> None:
    """They booked [u] C [u]/dt and had acted by the mean velocity alone: 5 to 27 % of energy came from nowhere."""
    history = struck(ContactStabilisedNewmark(), courant)
    assert history.energy.largest_gain < ROUNDING
    assert history.energy.largest_loss < ROUNDING
    assert history.energy.booked["damping"][-1] > 0.1 * history.energy.scale
