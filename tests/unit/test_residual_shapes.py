"""Static shapes at contacts that stand for the modes left out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from impactlab.bases.beams.modes import BeamModes
from impactlab.bases.craig_bampton import CraigBampton
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz
from impactlab.errors import CaseError, PairingError
from impactlab.integrators.exact_modal import ExactModal
from impactlab.metrics.norms import midpoints
from impactlab.models.base import Face
from impactlab.models.modal import Modal
from impactlab.scene import Beam, End, Rod, Segment
from impactlab.simulate import driver
from tests.reference.beam_scenes import ball_on, square_bar

PLAIN, SHEARED = square_bar(0.3), square_bar(0.3, shears=True)
ENDS = [("clamped", "free"), ("pinned", "pinned"), ("free", "free")]
FACES = (Face(0.18, 0, 1.0), Face(0.1, 1, 1.0))


def beam(theory, left, right):
    segment = PLAIN if theory == "euler_bernoulli" else SHEARED
    return Beam("beam", (segment,), End(left), End(right), theory=theory)


@pytest.mark.parametrize("elements", [None, 60])
@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
@pytest.mark.parametrize(("left", "right"), ENDS)
def test_modes_and_static_shapes_have_the_flexibility_of_the_whole_beam(theory, left, right, elements):
    body = Modal(elements, 12, residual=True).build_beam(beam(theory, left, right), 0.0, FACES)
    plain = Modal(elements, 12).build_beam(beam(theory, left, right), 0.0, FACES)
    assert body.operators().load.size == plain.operators().load.size + 2
    for x, quantity in ((0.18, "displacement"), (0.1, "displacement"), (0.22, "displacement"), (0.2, "bending_moment")):
        missing, left_out = (each.left_out(x, quantity, 0.1) for each in (body, plain))
        assert abs(missing) <= 1e-6 * abs(left_out)
    assert np.array_equal(body.momentum_row()[:-2], plain.momentum_row())


@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
@pytest.mark.parametrize(("left", "right"), ENDS)
@pytest.mark.parametrize("modes", [16, 40])
def test_they_vibrate_as_the_modes_left_out_do_together(theory, left, right, modes):
    """Shapes of unit mass with the flexibility sum 1/w^2, and sum 1/w^4 of what follows it."""
    given = beam(theory, left, right)
    found = Modal(modes=modes, residual=True).build_beam(given, 0.0, FACES[1:]).operators().stiffness[0, -1]
    further = BeamModes(given, 900)
    rigid = further.frequencies.size - 900
    squared = further.frequencies[rigid + modes :] ** 2
    rows = further.row(0.1, "displacement")[rigid + modes :] ** 2
    assert found == pytest.approx(np.sum(rows / squared) / np.sum(rows / squared**2), rel=0.3)


def struck(law, theory, right="free", x=0.3):
    scene = ball_on(beam(theory, "clamped", right), x, law, 4e-4, mass=0.05, dt=2.5e-7)
    return scene.but(integrator=ExactModal())


@pytest.mark.parametrize("law", [Hertz(1e9), Penalty(stiffness=1e7)], ids=["hertz", "spring"])
@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
@pytest.mark.parametrize("model", [{}, {"elements": 200}], ids=["closed form", "mesh"])
def test_a_run_with_few_modes_is_far_more_exact(law, theory, model):
    asked = struck(law, theory)
    many = driver.run(*asked.but(models={"beam": Modal(modes=300, residual=True, **model)}))
    t = midpoints(many.duration, 400)

    def error(residual):
        few = driver.run(*asked.but(models={"beam": Modal(modes=24, residual=residual, **model)}))
        force, exact = (run.evaluate(t, "force:ball|beam.at") for run in (few, many))
        return np.linalg.norm(force - exact) / np.linalg.norm(exact)

    assert error(True) <= 0.1 * error(False)


def test_energy_is_kept_and_nothing_is_warned_of():
    asked = struck(Hertz(1e9), "timoshenko").but(models={"beam": Modal(modes=12, residual=True)})
    assert driver.run(*asked).warnings == []


@pytest.mark.parametrize(
    "given", [{"basis": CraigBampton(), "elements": 20}, {"mass": "redistributed", "elements": 20}]
)
def test_bases_with_static_shapes_of_their_own_are_refused(given):
    with pytest.raises(CaseError, match="residual: true replaces eigenvectors that are left out") as refused:
        Modal(modes=10, residual=True, **given)
    assert refused.value.path == "residual"


def test_a_rod_has_them_too_and_messengers_of_single_modes_are_refused():
    rod = Rod("rod", (Segment(0.6, 6e-4, 2.1e11, 7850.0),), End("free"), End("clamped"))
    body = Modal(modes=10, residual=True).build(rod, 0.0, (Face(0.0, 0, 1.0),))
    assert abs(body.left_out(0.0, "displacement", 0.0)) <= 1e-9 * 0.6 / (2.1e11 * 6e-4)
    shown = math.sqrt(body.operators().stiffness[0, -1]) / (math.pi * 10.0 * rod.segments[0].wave_speed / 0.6)
    assert 1.5 < shown < 1.9
    with pytest.raises(PairingError, match="static shape for each contact"):
        body.arriving(0.0, 1e-5, "phase")


def test_a_frequency_without_static_shapes_is_refused() -> None:
    with pytest.raises(CaseError, match=r"residual_frequency is 100000 rad/s, and without residual: true"):
        Modal(modes=5, residual_frequency=1e5)
