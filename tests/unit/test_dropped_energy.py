"""A basis that follows the contact drops energy at each change; where that is much of it, the run says so."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from tests.solving import in_steps, struck_rod

EXIT = -0.698875581996163  # m/s, of the striker: the exact solution


def struck(basis: str, law: str, integrator: str) -> il.Case:
    """Return the paper's impact, 20 coordinates of a mesh of 60 elements."""
    model = {"kind": "modal", "elements": 60, "modes": 20, "basis": basis}
    return struck_rod({"kind": law}, in_steps({"round_trips": 3}, integrator, model, points_per_period=10))


def test_kicks_that_change_coordinates_hundreds_of_times_are_a_serious_warning() -> None:
    """A kick leaves no contact: it takes the coordinates there and back, and each way drops energy."""
    with pytest.warns(il.DoubtfulResult, match=r"'rod': \d+ changes of coordinates, .* lost \d+ % of the reference"):
        history = il.run(struck("striker_attached", "impulse_momentum", "central_difference"))
    lost = history.energy.booked["unresolved"][-1] / history.energy.total[0]
    assert history.dropped[0] == pytest.approx(history.energy.booked["unresolved"][-1], rel=1e-12)
    assert history.dropped[1] > 2 * 100
    assert lost > 0.3
    speed = float(history.evaluate(history.duration, "velocity:hammer"))
    assert abs(speed - EXIT) > 0.1  # the warning is right: so much is missing


@pytest.mark.parametrize(
    ("basis", "law", "integrator"),
    [
        ("striker_attached", "velocity_complementarity", "newmark"),
        ("eigenvectors", "impulse_momentum", "central_difference"),
    ],
)
def test_a_contact_that_stays_closed_or_a_basis_that_stays_drops_little(basis: str, law: str, integrator: str) -> None:
    history = il.run(struck(basis, law, integrator))
    assert "coordinates_change" not in {each.code for each in history.warnings}
    assert history.dropped[0] < 0.02 * history.energy.total[0]
    assert np.abs(history.evaluate(history.duration, "velocity:hammer") - EXIT) < 0.03
