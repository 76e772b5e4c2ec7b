"""Contacts that do not close in a run, though their gap is as small as the error of the displacements."""

from __future__ import annotations

import pytest

from impactlab import simulate
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz
from impactlab.integrators.central_difference import CentralDifference
from impactlab.refine.descriptions.beam_modes import BeamModesFamily
from impactlab.refine.errors.near_misses import may_close
from impactlab.scene import Beam, End, Mass, Wall
from impactlab.scene.method import StepRule, Tolerance
from impactlab.testing.scenes import in_a_row, touching
from tests.reference.beam_scenes import ball_on, square_bar


@pytest.mark.parametrize(("error", "named"), [(0.1, "beam.right|wall"), (1e-6, "")])
def test_a_gap_within_the_error_of_the_displacements_may_close(error, named) -> None:
    """The tip of a cantilever meets a wall at 4.087e-4 s, and the run ends 0.7 us before."""
    beam, law = Beam("beam", (square_bar(0.3),), End("clamped"), End("free")), Penalty(stiffness=2e6)
    made = ball_on(beam, 0.2, law, 4.08e-4, mass=0.05, tolerance=Tolerance(1e-2))
    contacts = (*made.scene.contacts, touching(beam, Wall("wall"), 3e-6))
    made = made.but(bodies={**made.scene.bodies, "wall": Wall("wall")}, contacts=contacts).but(law=law)
    history = simulate.run(*BeamModesFamily(made).description().simulation(300))
    assert not history.spans("beam.right|wall")
    assert may_close(history, made, error) == named


def test_faces_that_rest_beside_each_other_are_no_near_miss() -> None:
    """The last beads of a row, which touch from the start, have not felt the wave yet."""
    beads = [Mass(f"m{i}", 1e-3, 0.5 if i == 0 else 0.0) for i in range(12)]
    made = in_a_row(beads, None, Hertz(5e9), CentralDifference(), StepRule(dt=1e-7), duration=5e-5)
    history = simulate.run(*made)
    assert any(not history.spans(contact.name) for contact in history.scene.contacts)
    assert may_close(history, made, 1e-2) == ""
