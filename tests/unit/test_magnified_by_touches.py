"""The correction for several touches: by how much they magnify an error, as runs with the same modes show it."""

from __future__ import annotations

import math

import pytest

from impactlab import simulate
from impactlab.contact.penalty import Penalty
from impactlab.refine.convergence import Level
from impactlab.refine.descriptions.beam_modes import BeamModesFamily
from impactlab.refine.errors.level_errors import MAX_UNMAGNIFIED, magnified_by_touches
from impactlab.scene import Beam, End
from impactlab.scene.method import Tolerance
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
