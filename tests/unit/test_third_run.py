"""The third run of a description: where the order shows, and the coarser run of two may be enough."""

from __future__ import annotations

from impactlab.contact.power_law import Hertz
from impactlab.refine.convergence import Study
from impactlab.refine.descriptions.beam_families import families
from impactlab.refine.errors.level_errors import estimate_errors
from impactlab.scene import Beam, End
from impactlab.scene.method import Tolerance
from tests.reference.beam_scenes import ball_on, square_bar

SEGMENT = square_bar(0.06, shears=True)


def test_a_third_run_lies_between_two_where_the_coarser_one_is_about_as_fine_as_needed():
    """A run at 67 elements beside one at 69 showed no order, and one at 180 was taken, five times as long as the best.

    Peak forces of a stiff contact on a beam that shears state four times their error by two runs.
    """
    beam = Beam("beam", (SEGMENT,), End("pinned"), End("pinned"), theory="timoshenko")
    asked = ball_on(beam, 0.03, Hertz(1e11), 1e-4, mass=0.05, tolerance=Tolerance(1e-3))
    (meshes,) = (each for each in families(asked) if each.name == "lumped mesh, central difference")
    study = Study(meshes, 180)
    for fineness in (69, 180):
        study.run(fineness)
    estimate_errors(study, asked)
    coarse, fine = (level.error for level in study.levels)
    assert fine <= 1e-3 < coarse
    assert study.next == 111
    study.run(study.next)
    estimate_errors(study, asked)
    assert study.levels[0].error <= 1e-3
    assert study.closed
