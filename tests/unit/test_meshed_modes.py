"""Meshes behind modes without a closed form: fine enough for the vibrations of a long run."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from impactlab import api
from impactlab.contact.penalty import Penalty
from impactlab.integrators.exact_modal import ExactModal
from impactlab.metrics.norms import midpoints
from impactlab.models.base import Face
from impactlab.models.modal import Modal
from impactlab.refine.descriptions import meshed_modes
from impactlab.scene import Beam, BeamSegment, End
from impactlab.scene.method import Simulation, StepRule, Tolerance
from impactlab.simulate import driver
from tests.reference.beam_scenes import ball_on

SEGMENT = BeamSegment(0.142, 1.03e-4, 1.52e10, 1150.0, inertia=8.85e-10)
SHEARED = dataclasses.replace(SEGMENT, shear_stiffness=5e5, rotary_inertia=1150.0 * 8.85e-10)
STIFFNESS, MASS = 4e5, 7.35e-5
RISE, DURATION = math.sqrt(MASS / STIFFNESS), 5.5e-3
FACE = "displacement:beam@0.136"


def struck(segment: BeamSegment, tolerance: float) -> Simulation:
    """Return a light ball that strikes a beam beside its support, which then vibrates for a long time."""
    theory = "euler_bernoulli" if segment is SEGMENT else "timoshenko"
    beam = Beam("beam", (segment,), End("spring", 2e6), End("pinned"), theory=theory)
    given = {"mass": MASS, "velocity": 0.15, "tolerance": Tolerance(tolerance)}
    return ball_on(beam, 0.136, Penalty(STIFFNESS), DURATION, **given)


def moved(asked: Simulation, elements: int) -> np.ndarray:
    """Return the displacement of the face by 28 modes of a mesh."""
    model = Modal(elements, 28)
    run = driver.run(*asked.but(models={"beam": model}, integrator=ExactModal(), tolerance=None))
    return run.evaluate(midpoints(DURATION, 2000), FACE)


def apart(found: np.ndarray, exact: np.ndarray) -> float:
    return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))


@pytest.mark.parametrize("segment", [SEGMENT, SHEARED], ids=["bends", "shears"])
@pytest.mark.parametrize("elements", [42, 84])
def test_the_error_that_is_stated_bounds_that_of_the_mesh(segment: BeamSegment, elements: int) -> None:
    asked = struck(segment, 1e-3)
    beam = asked.scene.bodies["beam"]
    assert isinstance(beam, Beam)
    error = apart(moved(asked, elements), moved(asked, 400))
    stated = meshed_modes.error_of(beam, elements, RISE, DURATION)
    assert error <= 1.2 * stated
    assert stated <= 8.0 * error
    enough = meshed_modes.elements_for(beam, stated, RISE, DURATION)
    assert enough == pytest.approx(elements, abs=1)


def test_a_choice_keeps_its_tolerance_over_a_long_run() -> None:
    """One and a half elements a mode had an error of 3.8e-3 where 8.2e-4 was stated within 1e-3."""
    asked, t = struck(SEGMENT, 1e-3), midpoints(DURATION, 2000)
    history = api.solve(*asked)
    assert history.choice is not None
    assert history.choice.met
    model = Modal(400, 60)
    fine = driver.run(
        *asked.but(models={"beam": model}, integrator=ExactModal(), step=StepRule(dt=1e-7), tolerance=None)
    )
    assert apart(history.evaluate(t, FACE), fine.evaluate(t, FACE)) <= history.choice.expected_error


@pytest.mark.parametrize("elements", [100, 400])
def test_the_lowest_modes_of_a_fine_mesh_do_not_hold_each_other(elements) -> None:
    """Of a beam whose support is soft two frequencies are far below the others: 8 and 80 Hz here, beside 160 MHz.

    Rounding of the highest one squared mixes the two by 6e-4 with 400 elements.
    """
    segment = BeamSegment(0.5675, 4.445e-4, 7e10, 2700.0, inertia=9.03e-9)
    beam = Beam("beam", (segment,), End("free"), End("spring", 49110.0, rotational=219.0))
    faces = (Face(0.3525, 0, 1.0), Face(0.5675, 1, 1.0))
    found = []
    for count in (40, elements):
        model = Modal(count, 20).build_beam(beam, 0.0, faces)
        mass = model.operators().mass[0]
        found.append([model.row(face.x, "displacement")[:3] / np.sqrt(mass[:3]) for face in faces])
    assert np.abs(found[1]) == pytest.approx(np.abs(found[0]), rel=1e-6)
