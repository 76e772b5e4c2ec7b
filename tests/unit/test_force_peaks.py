"""Forces that error estimates read at peaks are those of the history, and a peak is the largest of a fine grid."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.power_law import Hertz
from impactlab.integrators.central_difference import CentralDifference
from impactlab.models.finite_element import FiniteElement
from impactlab.refine.force_peaks import force_at, peak_time
from impactlab.scene.method import StepRule
from impactlab.simulate import run
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.testing.scenes import mass_on_rod

NOTHING, SOME = np.zeros((0, 2)), np.array([[0.0, 2e-5], [6e-5, 9e-5]])
LAWS = [Hertz(1e11), AdditionDeletion()]


def struck(law: AbstractContactLaw) -> AbstractRecordedHistory:
    """Return a run of some hundred steps of a mass on a rod."""
    history = run(*mass_on_rod(FiniteElement(20, "lumped"), law, CentralDifference(), StepRule(courant=0.9)))
    assert isinstance(history, AbstractRecordedHistory)
    return history


def test_single_instants_read_the_force_of_the_history() -> None:
    """In every step, the first and the last among them, at both ends and inside: to rounding."""
    history = struck(LAWS[0])
    contact = history.scene.contacts[0]
    ends = history.recorded[f"force:{contact.name}"].times
    t = np.unique(np.concatenate((ends, ends[:-1] + 0.3 * np.diff(ends), ends[:-1] + 0.9 * np.diff(ends))))
    t = t[t <= history.duration]
    whole = history.evaluate(t, f"force:{contact.name}")
    single = np.concatenate([force_at(history, t[k : k + 2], contact, hard=False) for k in range(0, t.size, 2)])
    np.testing.assert_allclose(single, whole, rtol=0.0, atol=1e-12 * whole.max())


@pytest.mark.parametrize("law", LAWS, ids=["compliant", "hard"])
@pytest.mark.parametrize("left_out", [NOTHING, SOME], ids=["whole", "parts"])
def test_no_force_of_a_fine_grid_exceeds_the_peak(law: AbstractContactLaw, left_out: np.ndarray) -> None:
    """Slopes keep a force between the means of its neighbours, so that the largest mean is the largest force."""
    history = struck(law)
    contact = history.scene.contacts[0]
    at = peak_time(history, contact, left_out, law.hard)
    grid = np.linspace(0.0, history.duration, 20001)
    for start, end in left_out:
        assert not start < at < end
        grid = grid[(grid <= start) | (grid >= end)]
    peak = force_at(history, np.array([at]), contact, law.hard)[0]
    assert peak > 0.0
    # A hard force is a line between the middles of steps; a grid that misses them is lower.
    fine = np.concatenate([force_at(history, part, contact, law.hard) for part in np.array_split(grid, 20)])
    assert fine.max() <= peak * (1.0 + 1e-12)
