"""The error by the steps of a run in modes, against exact answers and against runs with much finer steps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz, HuntCrossley
from impactlab.integrators.exact_modal import ExactModal
from impactlab.models.modal import Modal
from impactlab.numerics.compiling import plain
from impactlab.refine.errors import error_equation, one_run, relative_errors
from impactlab.refine.errors.distances import difference
from impactlab.refine.errors.error_equation import contact_errors
from impactlab.refine.errors.modal_march import LIFT_OF_RAMP, PUSH_OF_RAMP, write_constants
from impactlab.refine.errors.raw_records import records_of
from impactlab.scene import Beam, BeamSegment, Contact, End, Mass, Point, Wall
from impactlab.scene.method import COUNTED, Simulation, StepRule
from impactlab.simulate.driver import run
from impactlab.testing.scenes import simulation, touching
from tests.reference.beam_scenes import ball_on, square_bar

FINER = 25  # times as many steps: their own error is some thousandth of that of the run
PINNED, CANTILEVER = (End("pinned"), End("pinned")), (End("clamped"), End("free"))


def errors_of(history):
    """Return the errors that the equation gives for a run, by contact."""
    records, laws = records_of(history), relative_errors.laws_in(Simulation(history.scene, history.method))
    return contact_errors(records.record, records.dt, laws, records.arrays)


def struck(law, ends, x, dt, duration=1e-3, stop=None):
    """Return a run of a ball on a beam in twenty modes; with ``stop``, a wall behind its right end at that gap [m]."""
    beam = Beam("beam", (square_bar(0.3),), *ends)
    made = ball_on(beam, x, law, duration, mass=0.05)
    if stop is not None:
        contacts = (*made.scene.contacts, touching(beam, Wall("wall"), stop))
        made = made.but(bodies={**made.scene.bodies, "wall": Wall("wall")}, contacts=contacts).but(law=law)
    return made.but(model=Modal(20), integrator=ExactModal(), step=StepRule(dt=dt))


def rms(values):
    return math.sqrt(np.mean(values**2))


@pytest.mark.parametrize("steps", [12, 25, 50, 200])
def test_a_mass_on_a_spring_has_the_error_of_its_exact_solution(steps):
    """x = v/w sin(w t), in contact for pi/w: force, displacement and impulse of the run are in error as predicted."""
    mass, stiffness, speed = 2.0, 5e5, 1.5
    w = math.sqrt(stiffness / mass)
    dt, duration = math.pi / w / (steps + 0.3), 0.97 * math.pi / w
    bodies = {"mass": Mass("mass", mass, speed), "wall": Wall("wall")}
    contact = Contact(Point("mass", 0.0, "mass"), Point("wall", 0.0, "wall"), 0.0)
    history = run(
        *simulation("spring", bodies, (contact,), duration, ExactModal(), StepRule(dt=dt), law=Penalty(stiffness))
    )
    record = records_of(history).record
    t = record[:, 0]
    means = speed / w * stiffness * np.diff(-np.cos(w * t)) / (w * dt)  # of the exact force over the steps
    [found] = errors_of(history)
    assert found.force == pytest.approx(rms(record[1:, 1] - means), rel=0.005 + 10.0 / steps**2)  # of the next order
    assert found.impulse == pytest.approx(np.sum(record[1:, 1] - means) * dt, abs=0.03 * found.total)
    at = np.linspace(0.0, t[-1], 100 * steps)
    off = np.interp(at, t, record[:, 3]) - speed / w * np.sin(w * at)
    assert found.left == pytest.approx(rms(off), rel=0.02 + 10.0 / steps**2)
    peak = speed / w * stiffness
    assert record[:, 1].max() - peak == pytest.approx(0.0, abs=found.near_peak + found.reading)


CASES = [
    (Hertz(1e9), PINNED, 0.15, 2e-5, None),
    (Hertz(1e9), CANTILEVER, 0.2, 1e-5, None),
    (Penalty(stiffness=1e5), CANTILEVER, 0.3, 2e-5, None),
    (HuntCrossley(1e9, restitution=0.6), PINNED, 0.12, 1e-5, None),
    (Penalty(stiffness=2e6), CANTILEVER, 0.2, 1.2e-5, 1e-4),
]


@pytest.mark.parametrize(("law", "ends", "x", "dt", "stop"), CASES, ids=["pinned", "free", "spring", "lossy", "stop"])
def test_beams_have_the_error_that_much_finer_steps_show(law, ends, x, dt, stop):
    asked = struck(law, ends, x, dt, duration=3e-3 if stop else 1e-3, stop=stop)
    history = run(*asked)
    record = records_of(history).record
    found = errors_of(history)
    finer = records_of(run(*asked.but(step=StepRule(dt=dt / FINER)))).record
    steps = min(len(record) - 1, (len(finer) - 1) // FINER)
    for number, each in enumerate(found):
        force, left, right = (column + error_equation.COLUMNS * number for column in (1, 3, 5))
        means = finer[1 : steps * FINER + 1, force].reshape(steps, FINER).mean(axis=1)
        assert each.force == pytest.approx(rms(record[1 : steps + 1, force] - means), rel=0.08)
        assert each.impulse == pytest.approx(np.sum(record[1 : steps + 1, force] - means) * dt, abs=0.08 * each.total)
        for column, error in ((left, each.left), (right, each.right)):
            off = np.interp(finer[:, 0], record[:, 0], record[:, column]) - finer[:, column]
            assert error == pytest.approx(rms(off[: steps * FINER]), rel=0.12, abs=1e-15)


@pytest.mark.parametrize("frequency", [-2e4, -30.0, 0.0, 30.0, 2.9e4, 3.1e4, 2e5])
def test_a_mode_under_a_force_that_rises_across_a_step(frequency):
    """Its response to s (t - h/2) over the step, by Duhamel's integral."""
    mass, dt = 0.3, 1e-5
    own = np.empty(7)
    plain(write_constants)(mass, frequency, dt, own, 0)

    def response(t):
        if frequency == 0.0:
            return t / mass
        return (math.sin if frequency > 0.0 else math.sinh)(frequency * t) / (mass * frequency)

    def rate(t):
        return (math.cos if frequency >= 0.0 else math.cosh)(frequency * t) / mass

    for row, kernel, size in ((LIFT_OF_RAMP, response, dt**3 / mass), (PUSH_OF_RAMP, rate, dt**2 / mass)):
        expected = quad(lambda t, of=kernel: of(dt - t) * (t - 0.5 * dt), 0.0, dt, epsabs=1e-13 * size)[0]
        assert own[row] == pytest.approx(expected, rel=1e-6, abs=1e-12 * size)


def test_errors_outside_the_equation_take_other_runs():
    """A second touch under a law that depends on the speed of the approach, and an error that is not small."""
    twice = struck(HuntCrossley(1e11, restitution=0.9), PINNED, 0.1, 1e-6)
    history = run(*twice)
    assert len(history.contacts) > 1
    assert math.isinf(one_run.error_alone(history, twice))
    coarse = struck(Hertz(1e11), PINNED, 0.1, 1e-5)
    history = run(*coarse)
    assert max(max(each.in_touch, each.missed) for each in errors_of(history)) > one_run.MAX_SIZE
    assert math.isinf(one_run.error_alone(history, coarse))


@pytest.mark.parametrize(("dt", "settings"), [(1e-6, {"records": 200}), (1e-5, {"events": "located"})])
def test_a_run_without_a_record_of_every_whole_step_states_no_error(dt, settings):
    asked = struck(Hertz(1e9), PINNED, 0.15, dt)
    history = run(*asked.but(**settings))
    assert not records_of(history).of_every_step
    assert math.isinf(one_run.error_alone(history, asked))


@pytest.mark.parametrize("finer", [0.9, 1.0, 1.1, 1.3])
def test_a_second_touch_under_hysteresis_depends_on_the_vibrations_in_its_approach(finer):
    """A static shape turns by 2.7 rad in a step, so that the speed at the touch is not the mean one of its step.

    With other steps it is in error by another share of the vibration, and displacements by up to five times as much.
    """
    segment = BeamSegment(0.15765, 3.2e-4, 7e10, 2700.0, inertia=1.0243e-8)
    beam = Beam("beam", (segment,), End("free"), End("clamped"))
    law = HuntCrossley(6.7e8, restitution=0.42836)
    made = ball_on(beam, 0.078825, law, 1.4e-3, mass=0.20246, velocity=1.16809)
    model = Modal(35, residual=True, residual_frequency=7.3713e5)
    made = made.but(model=model, integrator=ExactModal(), step=StepRule(dt=3.594e-6 / finer))
    history, fine = run(*made), run(*made.but(step=StepRule(dt=3.594e-6 / finer / FINER)))
    assert len(history.contacts) == 2
    true = difference(history, fine, made.scene, made.method.laws, COUNTED)
    assert true <= one_run.error_alone(history, made) <= 3.0 * true
