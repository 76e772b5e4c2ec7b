"""Estimates read the records of a run as its channels do, and its peak is the largest force of a fine grid."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.power_law import Hertz
from impactlab.integrators.base import AbstractScheme
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.midpoint import Midpoint
from impactlab.metrics.norms import midpoints
from impactlab.metrics.peaks import smooth_force
from impactlab.models.finite_element import FiniteElement
from impactlab.refine.errors.raw_records import Records, records_of, sizes_of
from impactlab.scene.method import StepRule
from impactlab.simulate import run
from impactlab.simulate.stepping.results.history import RecordedHistory
from impactlab.testing.scenes import mass_on_rod

NOTHING, SOME = np.zeros((0, 2)), np.array([[0.0, 2e-5], [6e-5, 9e-5]])
LAWS = [Hertz(1e11), AdditionDeletion()]
COMPLIANT_AND_HARD = pytest.mark.parametrize("law", LAWS, ids=["compliant", "hard"])


def struck(
    law: AbstractContactLaw,
    elements: int = 20,
    scheme: AbstractScheme = CentralDifference(),  # noqa: B008 - frozen
) -> tuple[RecordedHistory, Records]:
    """Return a run of some hundred steps of a mass on a rod, and its records."""
    mass = "lumped" if isinstance(scheme, CentralDifference) else "consistent"
    history = run(*mass_on_rod(FiniteElement(elements, mass), law, scheme, StepRule(courant=0.9)))
    found = records_of(history)
    assert isinstance(history, RecordedHistory)
    assert found is not None
    return history, found


@COMPLIANT_AND_HARD
@pytest.mark.parametrize("scheme", [CentralDifference(), Midpoint()], ids=["explicit", "implicit"])
def test_forces_are_those_of_the_history(law: AbstractContactLaw, scheme: AbstractScheme) -> None:
    """In every step, the first and the last among them, at their starts and inside: to rounding."""
    history, found = struck(law, scheme=scheme)
    contact = history.scene.contacts[0]
    ends = history.recorded[f"force:{contact.name}"].times
    t = np.unique(np.concatenate((ends, ends[:-1] + 0.3 * np.diff(ends), ends[:-1] + 0.9 * np.diff(ends))))
    t = t[t <= history.duration]
    force = found.force(0, law.hard)
    known = smooth_force(history, t, contact, law.hard)
    np.testing.assert_allclose([force.at(each) for each in t], known, rtol=0.0, atol=1e-11 * known.max())


@COMPLIANT_AND_HARD
@pytest.mark.parametrize("left_out", [NOTHING, SOME], ids=["whole", "parts"])
def test_no_force_of_a_fine_grid_exceeds_the_peak(law: AbstractContactLaw, left_out: np.ndarray) -> None:
    """Slopes keep a force between the means of its neighbours, so that the largest mean is the largest force."""
    history, found = struck(law)
    force, at = found.force(0, law.hard), found.peak_time(0, law.hard, left_out)
    grid = np.linspace(0.0, history.duration, 20001)
    for start, end in left_out:
        assert not start < at < end
        grid = grid[(grid <= start) | (grid >= end)]
    largest = smooth_force(history, grid, history.scene.contacts[0], law.hard).max()
    assert 0.0 < largest <= force.at(at) * (1.0 + 1e-12)


def test_norms_are_those_of_the_channels() -> None:
    """Of two runs with other steps, in the middles of equal cells: to rounding."""
    (history, fine), (coarser, coarse) = struck(LAWS[0], 31), struck(LAWS[0], 20)
    t = midpoints(history.duration, 400)
    names, drift = ["position:hammer", "displacement:rod@0"], 0.3 * t
    assert set(fine.columns) == set(names)
    moved = fine.displacements(names, t.size), coarse.displacements(names, t.size)
    for name, sizes in zip(names, sizes_of(*moved, np.array([drift, drift])), strict=True):
        own, other = (each.evaluate(t, name) for each in (history, coarser))
        known = [np.linalg.norm(each) for each in (own - other, other, own, own - drift)]
        np.testing.assert_allclose(sizes, known, rtol=1e-9, atol=1e-12 * known[2])
    mean = history.recorded["force:hammer|rod.left"]
    stairs = mean.values[np.minimum(np.searchsorted(mean.times, t, side="right"), mean.values.size - 1)]
    assert fine.force(0, False).size(400) == pytest.approx(np.linalg.norm(stairs), rel=1e-12)
