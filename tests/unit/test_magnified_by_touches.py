"""The correction for several touches: by how much they magnify an error, as runs with the same modes show it."""

from __future__ import annotations

import dataclasses
import math

import pytest

from impactlab import simulate
from impactlab.contact.penalty import Penalty
from impactlab.refine.convergence import Level
from impactlab.refine.descriptions.beam_modes import BeamModesFamily
from impactlab.refine.errors.distances import difference
from impactlab.refine.errors.magnification import (
    MAX_UNMAGNIFIED,
    magnified_by_sensitive_touches,
    magnified_by_touches,
)
from impactlab.scene import Beam, End, Wall
from impactlab.scene.method import COUNTED, Tolerance
from impactlab.testing.scenes import touching
from tests.reference.beam_scenes import ball_on, square_bar

SEGMENT = square_bar(0.3)


def family(duration: float) -> BeamModesFamily:
    """Return the modes for a ball that meets the tip of a cantilever once or several times."""
    beam = Beam("beam", (SEGMENT,), End("clamped"), End("free"), tension=682.25)
    given = {"mass": 0.041982, "velocity": 0.066402, "gap": 4.1637e-4, "tolerance": Tolerance(1e-3)}
    return BeamModesFamily(ball_on(beam, 0.3, Penalty(stiffness=1690539.4), duration, **given))


@pytest.mark.parametrize(("duration", "touches"), [(0.0069, 1), (0.01572, 4)])
def test_errors_beyond_ten_times_the_predicted_one_are_magnified_after_two_touches(duration, touches) -> None:
    modes = family(duration)
    description = modes.description()
    fineness = description.whole(300)
    level = Level(fineness, simulate.run(*description.simulation(fineness)))
    assert len(level.history.contacts) == touches
    usual = MAX_UNMAGNIFIED * description.error(fineness)
    assert magnified_by_touches(description, level, 0.9 * usual) == 1.0
    assert magnified_by_touches(description, level, 3.0 * usual) == pytest.approx(3.0 if touches > 1 else 1.0)
    assert magnified_by_touches(description, level, math.inf) == 1.0


def test_as_many_more_modes_are_taken_as_the_error_is_magnified() -> None:
    """The error of modes left out, magnified, keeps the share of the tolerance that it had."""
    modes = family(0.01572)
    history = simulate.run(*modes.description().simulation(300))
    plain, magnified = (BeamModesFamily(modes.request, history, factor, 1) for factor in (1.0, 200.0))
    assert magnified.wanted(300) > 1.2 * plain.wanted(300)
    assert magnified.raised == 1
    assert 200.0 * magnified.unseen(300, history) <= 0.5e-3


@pytest.mark.parametrize(("duration", "sensitive"), [(4.088e-4, True), (4.4e-4, False), (4.0e-4, False)])
def test_a_touch_that_begins_as_the_run_ends_magnifies_the_error_of_modes_left_out(duration, sensitive) -> None:
    """The tip meets a wall at 4.087e-4 s: twenty modes are compared with four hundred under the same steps."""
    beam, law = Beam("beam", (SEGMENT,), End("clamped"), End("free")), Penalty(stiffness=2e6)
    made = ball_on(beam, 0.2, law, duration, mass=0.05, tolerance=Tolerance(1e-2))
    contacts = (*made.scene.contacts, touching(beam, Wall("wall"), 3e-6))
    made = made.but(bodies={**made.scene.bodies, "wall": Wall("wall")}, contacts=contacts).but(law=law)
    description = BeamModesFamily(made).description()
    coarse = description.simulation(1500)
    history = simulate.run(*coarse)
    finer = {"beam": dataclasses.replace(coarse.method.models["beam"], modes=400)}
    fine = simulate.run(coarse.scene, dataclasses.replace(coarse.method, models=finer))
    error = difference(history, fine, made.scene, made.method.laws, COUNTED)
    unseen = description.unseen(1500, history)
    factor = magnified_by_sensitive_touches(description, history, made, unseen)
    assert (factor > 100.0, factor == 1.0) == (sensitive, not sensitive)
    assert (error > 100.0 * unseen) == sensitive  # without a factor it were too small
    assert error <= unseen * factor
