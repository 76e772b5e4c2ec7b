"""Errors by modes that a run leaves out, beside a run with many more of them."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab import api
from impactlab.bases.beams.modes import BeamModes
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.metrics.norms import midpoints
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.refine.errors import left_out
from impactlab.refine.errors.distances import counted, difference
from impactlab.scene import Beam, BeamSegment, End, Mass
from impactlab.scene.method import Simulation, StepRule, Tolerance
from impactlab.simulate import driver
from tests.reference.beam_scenes import ball_on, square_bar

SEGMENT = BeamSegment(
    length=0.5, area=7.7e-4, young=1.1e11, density=4430.0, inertia=6.1e-8, shear_stiffness=2.7e7, rotary_inertia=2.7e-4
)


def pressed(x: float, stiffness: float) -> Simulation:
    """Return a ball on a stiff clamped beam under a soft contact."""
    beam = Beam("beam", (SEGMENT,), End("clamped"), End("clamped"), theory="timoshenko")
    scene = ball_on(beam, x, Penalty(stiffness=stiffness), 1e-3, mass=0.1, velocity=0.1, dt=5e-7)
    return scene.but(integrator=ExactModal())


@pytest.mark.parametrize("x", [0.41, 0.25, 0.1])
@pytest.mark.parametrize("modes", [40, 80, 160])
def test_the_flexibility_left_out_bounds_the_error_of_a_displacement(x, modes):
    """A soft contact feels nothing of it, and the displacement of the beam does."""
    asked = pressed(x, 4e6)
    few, many = (driver.run(*asked.but(models={"beam": Modal(modes=count)})) for count in (modes, 12 * modes))
    places = list(left_out.left_out(asked))
    shares = left_out.beside_displacements(places, asked.scene, few)
    stated = left_out.total(shares, modes)
    t = midpoints(few.duration, 400)
    values = [run.evaluate(t, f"displacement:beam@{x}") for run in (few, many)]
    error = np.linalg.norm(values[0] - values[1]) / np.linalg.norm(values[1])
    assert error <= 1.5 * stated
    assert stated <= 6.0 * error
    assert left_out.total(left_out.beside_contacts(places), modes) < error  # less than what happens
    assert sum(share.power == 1.0 for share in shares) == 1
    only_sheared = max(shares, key=lambda share: share.at(modes))
    assert only_sheared.modes_for(only_sheared.at(modes)) == pytest.approx(modes)


@pytest.mark.parametrize(("right", "x"), [("free", 0.5), ("free", 0.3), ("pinned", 0.25)])
def test_the_flexibility_left_out_is_at_least_that_of_the_further_modes(right, x):
    """At a free end all modes have twice the amplitude of their waves inside; half of it was stated there."""
    segment = BeamSegment(length=0.5, area=7.7e-4, young=1.1e11, density=4430.0, inertia=6.1e-8)
    beam = Beam("beam", (segment,), End("clamped"), End(right))
    asked = pressed(x, 4e6).but(bodies={**pressed(x, 4e6).scene.bodies, "beam": beam})
    [bending] = left_out.left_out(asked)
    modes = BeamModes(beam, 400)
    each = (modes.row(x, "displacement") / modes.frequencies) ** 2
    for count in (20, 40):
        stated = bending.factor / count**bending.power
        assert 0.95 * np.sum(each[count:]) <= stated <= 2.5 * np.sum(each[count:])


def test_a_body_that_no_force_meets_leaves_nothing_out():
    asked = pressed(0.25, 4e6)
    away = asked.but(bodies={**asked.scene.bodies, "ball": Mass("ball", 0.1, -0.1)}, models={"beam": Modal(modes=20)})
    assert left_out.beside_displacements(list(left_out.left_out(away)), away.scene, driver.run(*away)) == []


@pytest.mark.parametrize("modes", [18, 40])
@pytest.mark.parametrize(("right", "x"), [("clamped", 0.25), ("free", 0.5)])
def test_of_modes_whose_static_shapes_a_run_has_their_vibrations_are_missing(right, x, modes):
    beam = Beam("beam", (SEGMENT,), End("clamped"), End(right), theory="timoshenko")
    asked = pressed(x, 2e7).but(bodies={**pressed(x, 2e7).scene.bodies, "beam": beam}, step=StepRule(dt=2e-7))
    fastest, channel = 1e6, f"force:{asked.scene.contacts[0].name}"
    shapes = Modal(modes=modes, residual=True, residual_frequency=fastest)
    many, few, plain = (
        driver.run(*asked.but(models={"beam": model}))
        for model in (Modal(modes=400, residual=True), shapes, Modal(modes=modes))
    )
    t = midpoints(many.duration, 400)
    exact, found, without = (run.evaluate(t, channel) for run in (many, few, plain))
    error, of_plain = (np.linalg.norm(each - exact) / np.linalg.norm(exact) for each in (found, without))
    stated = left_out.total(left_out.beside_contacts(list(left_out.left_out(asked, fastest))), modes, 2e-7)
    assert error <= 2.5 * stated
    assert stated <= 0.3 * left_out.total(left_out.beside_contacts(list(left_out.left_out(asked))), modes)
    assert error <= 0.3 * of_plain


def test_steps_that_do_not_resolve_static_shapes_have_no_use_of_them():
    [bending, shear] = left_out.beside_contacts(list(left_out.left_out(pressed(0.25, 4e6), 1e6)))
    for share in (bending, shear):
        assert share.at(30, 1e-6) < 0.3 * share.factor / 30**share.power
        assert share.at(30, 1e-5) == pytest.approx(2.0 * share.factor / 30**share.power)
        modes = share.modes_for(1e-5, 1e-6)
        assert share.at(modes, 1e-6) <= 1e-5 < share.at(0.9 * modes, 1e-6)


def test_a_choice_takes_few_modes_and_static_shapes_in_place_of_many():
    """At a free end of a beam that shears 1377 modes were counted as needed, and a mesh took 16 times as long."""
    segment = square_bar(0.1, shears=True)
    beam = Beam("beam", (segment,), End("clamped"), End("free"), theory="timoshenko")
    asked = ball_on(beam, 0.1, Hertz(1e9), 5e-4, mass=0.05)
    history, mesh = (
        api.solve(*asked.but(tolerance=Tolerance(1e-4))),
        driver.run(
            *asked.but(
                models={"beam": FiniteElement(600, "lumped")},
                integrator=CentralDifference(),
                step=StepRule(points_per_period=3.4),
            )
        ),
    )
    assert history.choice is not None
    assert history.choice.chosen.startswith("modes under exact steps")
    model = history.choice.method.models["beam"]
    assert model.residual
    assert model.modes < 200
    assert difference(history, mesh, *counted(asked)) < 1e-4
