"""The continuous Timoshenko beam: its first force, its waves, its ends, its energy; against closed forms and meshes."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.dispersive_identification import DispersiveIdentification
from impactlab.contact.power_law import Hertz
from impactlab.errors import ImpactlabError
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel, Face
from impactlab.models.continuous import Continuous
from impactlab.models.continuous.timoshenko import TimoshenkoWaves
from impactlab.models.continuous.timoshenko_grids import Grid, coupling
from impactlab.models.finite_element import FiniteElement
from impactlab.scene import Beam, BeamSegment, End, Point, Probe, Rod, Segment
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare, run
from impactlab.testing.scenes import struck

EXACT = Continuous()
FREE, INFINITE = End("free"), End("infinite")
YOUNG, RHO, AREA, INERTIA = 2.1e11, 7900.0, 1e-4, 1e-8 / 12.0
KGA = 5.0 / 6.0 * YOUNG / 2.6 * AREA
Z = math.sqrt(KGA * RHO * AREA)
SOFT = Hertz(stiffness=1e9)
QUANTITIES = ("displacement", "rotation", "bending_moment", "shear_force")
PROBES = tuple(Probe("beam", 0.1, quantity) for quantity in QUANTITIES)  # type: ignore[arg-type]


def beam(left: End = FREE, right: End = FREE, length: float = 0.3, **changes: Any) -> Beam:
    segment = BeamSegment(
        length, AREA, YOUNG, RHO, inertia=INERTIA, shear_stiffness=KGA, rotary_inertia=RHO * INERTIA, height=0.01
    )
    return Beam("beam", (segment,), left, right, theory="timoshenko", **changes)


def scene(
    body: Beam,
    dt: float,
    duration: float,
    x: float = 0.15,
    law: AbstractContactLaw = SOFT,
    mass: float = 0.05,
    model: AbstractRodModel = EXACT,
) -> Simulation:
    stepped = None if isinstance(model, Continuous) else Newmark()
    return struck(body, model, law, stepped, StepRule(dt=dt), mass=mass, x=x, duration=duration, probes=PROBES)


@pytest.mark.parametrize(("x", "ways"), [(0.15, 2.0), (0.11, 2.0), (0.0, 1.0), (0.3, 1.0)])
def test_the_first_force_of_a_hard_mass(x: float, ways: float) -> None:
    """2 sqrt(kGA rho A) v0 at an inner point, half of it at a tip; within the first step the mass slows by F dt/M."""
    history = run(*scene(beam(), 2e-8, 1e-6, x, DispersiveIdentification()))
    first = float(history.evaluate([0.0], f"force:{history.scene.contacts[0].name}")[0])
    assert first == pytest.approx(ways * Z, rel=1e-2)
    assert first == pytest.approx(ways * Z / (1.0 + ways * Z * history.dt / 0.05), rel=1e-12)


@pytest.mark.parametrize("held", [FREE, End("clamped")])
def test_a_constraint_on_positions_keeps_the_energy(held: End) -> None:
    """Faces that stay together take nothing; within the first step the mass slows by half of F dt/M on the mean."""
    history = run(*scene(beam(right=held), 1e-7, 2e-4, law=AdditionDeletion()))
    first = float(history.evaluate([0.0], "force:hammer|beam")[0])
    assert first == pytest.approx(2.0 * Z / (1.0 + Z * history.dt / 0.05), rel=1e-12)
    book = history.energy
    assert book.largest_gain < 1e-12
    assert book.largest_loss < 1e-12
    assert not history.warnings or all(warned.code == "near_grazing" for warned in history.warnings)


def test_a_rod_on_a_beam_meets_both_impedances() -> None:
    """F = v0/(1/Z_rod + 1/(2 Z)) from the first step on, until a wave comes back or rotation answers."""
    segment = Segment(0.3, 1e-4, YOUNG, RHO)
    rod = Rod("rod", (segment,), FREE, FREE, velocity=1.0)
    case = scene(beam(), 1e-8, 2e-7, law=AdditionDeletion())
    contact = dataclasses.replace(case.scene.contacts[0], left=Point("rod", 0.3, "rod.right"))
    for law in (AdditionDeletion(), DispersiveIdentification()):
        pair = case.but(bodies={"rod": rod, "beam": beam()}, contacts=(contact,), probes=(), round_trip=1e-4)
        history = run(*pair.but(model=EXACT, law=law))
        first = float(history.evaluate([0.0], "force:rod.right|beam")[0])
        assert first == pytest.approx(1.0 / (1.0 / segment.impedance + 0.5 / Z), rel=1e-12)


def test_the_wave_front_is_sharp_and_on_time() -> None:
    """The velocity jumps by v0 where c2 t has come to, and nothing is ahead of c1 t.

    Coupling is of lower order, so that a front keeps its height. In two cells on both sides the rest moves by 1 %.
    """
    probes = (Probe("beam", 0.155, "velocity"), Probe("beam", 0.155, "rotation"))
    case = scene(beam(), 2e-8, 1e-5, 0.15, DispersiveIdentification()).but(probes=probes)
    history = run(*case)
    front = 0.005 / math.sqrt(KGA / (RHO * AREA))
    before, after = history.evaluate([front - 2.0 * history.dt, front + 2.0 * history.dt], "velocity:beam@0.155")
    assert after - before == pytest.approx(1.0, abs=2e-2)
    t = np.linspace(0.0, 0.005 / math.sqrt(YOUNG / RHO) - 4.0 * history.dt, 50)
    turned = history.evaluate(np.linspace(0.0, 1e-5, 50), "rotation:beam@0.155")
    # The average between the grids reaches a few cells further, and falls by two decades in each.
    assert np.max(np.abs(history.evaluate(t, "rotation:beam@0.155"))) < 1e-9 * np.max(np.abs(turned))


def test_it_converges_to_a_fine_mesh_with_the_second_order() -> None:
    reference = run(*scene(beam(), 1e-7, 2e-4, model=FiniteElement(elements=1000)))
    t = np.linspace(0.0, 2e-4, 300)
    channels = ("velocity:hammer", "displacement:beam@0.15", "displacement:beam@0.1", "rotation:beam@0.1")
    errors, steps = [], []
    for dt in (8e-7, 4e-7, 2e-7):
        history = run(*scene(beam(), dt, 2e-4))
        exact = {name: reference.evaluate(t, name) for name in channels}
        errors.append([np.max(np.abs(history.evaluate(t, n) - e)) / np.max(np.abs(e)) for n, e in exact.items()])
        steps.append(history.dt)
        assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12
    slopes = np.log(np.array(errors[0]) / np.array(errors[-1])) / math.log(steps[0] / steps[-1])
    assert np.all(slopes > 1.7)
    assert np.max(errors[-1]) < 2e-4
    # The force of the finest: its peak, and moment and shear force to what a jump between two elements leaves open.
    assert history.contacts[0].peak_force == pytest.approx(reference.contacts[0].peak_force, rel=1e-4)
    for name, within in (("bending_moment:beam@0.1", 3e-3), ("shear_force:beam@0.1", 3e-2)):
        values = reference.evaluate(t, name)
        assert_allclose(history.evaluate(t, name), values, atol=within * float(np.max(np.abs(values))))


@pytest.mark.parametrize(
    ("left", "right"),
    [
        (End("clamped"), FREE),
        (End("pinned"), End("pinned")),
        (End("spring", 2e5, rotational=30.0), End("mass", 0.02)),
        (End("dashpot", 500.0), End("free", force=-200.0)),
    ],
)
def test_ends_are_those_of_a_mesh(left: End, right: End) -> None:
    """600 elements and steps of 1e-7 s of both err by less than 2e-4 here; force and dashpot act over 400 us."""
    reference = run(*scene(beam(left, right), 2e-7, 4e-4, model=FiniteElement(elements=600)))
    history = run(*scene(beam(left, right), 2e-7, 4e-4))
    t = np.linspace(0.0, 4e-4, 300)
    for name in ("velocity:hammer", "displacement:beam@0.15", "displacement:beam@0.1", "rotation:beam@0.1"):
        values = reference.evaluate(t, name)
        error = float(np.sqrt(np.mean((history.evaluate(t, name) - values) ** 2)))
        assert error < 1e-3 * float(np.max(np.abs(values))), name
    book = history.energy
    assert max(book.largest_gain, book.largest_loss) < 1e-9
    if left.kind == "dashpot":
        assert book.booked["ends"][-1] == pytest.approx(reference.energy.booked["ends"][-1], rel=1e-3)


def test_an_infinite_beam_is_one_that_nothing_comes_back_in() -> None:
    """A beam of 2 m, struck in its middle, answers alike for 2 m over c1 (388 us); its energy and momentum stay."""
    long = run(*scene(beam(length=2.0), 2e-7, 3.5e-4, 1.0).but(probes=()))
    endless = run(*scene(beam(INFINITE, INFINITE), 2e-7, 3.5e-4).but(probes=()))
    one_way = run(*scene(beam(FREE, INFINITE), 2e-7, 3.5e-4, 0.0).but(probes=()))
    tip = run(*scene(beam(length=1.0), 2e-7, 3.5e-4, 0.0).but(probes=()))
    t = np.linspace(0.0, 3.5e-4, 300)
    for one, other in ((endless, long), (one_way, tip)):
        # Steps that fit differ by less than a cell in 500: second order.
        assert_allclose(one.evaluate(t, "velocity:hammer"), other.evaluate(t, "velocity:hammer"), atol=2e-4)
        assert max(one.energy.largest_gain, one.energy.largest_loss) < 1e-12
        momentum = one.evaluate([3.5e-4], "momentum:beam")[0] + one.evaluate([3.5e-4], "momentum:hammer")[0]
        assert momentum == pytest.approx(0.05, rel=1e-12)


def test_phase_and_group_speed_are_those_of_the_dispersion_relation() -> None:
    """Spectra of a pulse at two places of an infinite beam: their phases differ by k (x2 - x1)."""
    places = (0.2, 0.25)
    probes = tuple(Probe("beam", x, "velocity") for x in places)
    case = scene(beam(INFINITE, INFINITE), 2e-7, 1.2e-3, 0.0, Hertz(stiffness=2e10), mass=1e-3)
    history = run(*case.but(probes=probes))
    n = 6000
    t = (np.arange(n) + 0.5) * history.duration / n
    # The slow end of the packet is still on its way: the window fades it out, alike for both except for its delay.
    window = np.where(t > 8e-4, 0.5 + 0.5 * np.cos(np.pi * (t - 8e-4) / 4e-4), 1.0)
    spectra = [np.fft.rfft(window * history.evaluate(t, f"velocity:beam@{x:.6g}")) for x in places]
    omega = 2.0 * math.pi * np.arange(spectra[0].size) / history.duration
    band = (omega > 1.0e5) & (omega < 3.0e5)
    phase = -np.unwrap(np.angle(spectra[1] / spectra[0]))[band]
    omega, exact = omega[band], wave_number(omega[band])
    turns = np.round((exact[0] * 0.05 - phase[0]) / (2.0 * math.pi))
    measured = (phase + 2.0 * math.pi * turns) / 0.05
    assert_allclose(omega / measured, omega / exact, rtol=1e-2)
    wide = slice(None, None, 10)
    group, known = (np.diff(omega[wide]) / np.diff(k[wide]) for k in (measured, exact))
    assert_allclose(group, known, rtol=1e-2)


def wave_number(omega: Any) -> Any:
    """The real root k of (kGA k2 - rho A w2)(EI k2 + kGA - rho I w2) = (kGA k)2, the flexural branch."""
    stiffness, turning, mass = YOUNG * INERTIA, RHO * INERTIA, RHO * AREA
    a = KGA * stiffness
    b = -mass * omega**2 * stiffness - KGA * turning * omega**2
    c = mass * omega**2 * (turning * omega**2 - KGA)
    return np.sqrt((-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a))


def test_responses_of_two_places_are_reciprocal() -> None:
    places = (0.0, 0.11)
    model = TimoshenkoWaves(
        beam(right=End("clamped")), 0.0, tuple(Face(x, n, math.nan) for n, x in enumerate(places)), (), 1e-4, False
    )
    dt = float(model.fitting(2e-7)[0])
    stepper = model.stepper(np.eye(2), dt)
    answers = []
    for pushed in (0, 1):
        state = stepper.state + stepper.force_response[pushed]
        moved = []
        for _ in range(400):
            stepper.free(stepper.parameters, state)
            moved.append(state[2 + 1 - pushed])
        answers.append(np.array(moved))
    assert_allclose(answers[0], answers[1], atol=1e-12 * float(np.max(np.abs(answers[0]))))
    assert np.max(np.abs(answers[0])) > 0.0


@pytest.mark.parametrize("ratio", [0.3, 0.5657, 1.0, 1.7])
def test_the_grids_give_and_take_alike(ratio: float) -> None:
    """Rows sum to 1 and carry straight lines over, away from the outermost cells; so do the columns, scaled."""
    of = Grid(0.0, 1.0 / 40, 40)
    count = round(40 / ratio)
    h = 1.0 / count
    to = Grid(0.0, h, count)
    couple = coupling(to, of)
    to, of = to.centres, of.centres
    dense = np.zeros((count, 40))
    for i, (first, row) in enumerate(zip(couple.first.astype(int), couple.rows, strict=True)):
        dense[i, first : first + row.size] += row
    back = h * 40 * dense.T
    assert_allclose(dense.sum(axis=1), 1.0, rtol=1e-12)
    assert_allclose(back.sum(axis=1), 1.0, rtol=1e-12)
    assert_allclose((dense @ of)[4:-4], to[4:-4], rtol=1e-12)
    assert_allclose((back @ to)[4:-4], of[4:-4], rtol=1e-12)


def test_the_step_fits_the_contact_and_both_grids() -> None:
    for x in (0.15, 0.1, 0.0873):
        plan = prepare(*scene(beam(End("clamped"), FREE), 3e-7, 1e-4, x))
        model = plan.built["beam"].model
        assert isinstance(model, TimoshenkoWaves)
        assert plan.dt is not None
        assert 0.79 * 3e-7 < plan.dt <= 3e-7
        assert model.misfit(plan.dt) < 5e-4  # half a cell of this step would be 1.4e-3


def test_unsupported_parts_are_refused() -> None:
    case = scene(beam(), 2e-7, 1e-5)
    for change, told in (
        ({"gravity": -9.81}, "does not support gravity"),
        ({"probes": (Probe("beam", 0.1, "torque"),)}, "has no torque"),
        ({"step": StepRule(dt=1e-5)}, "beyond the stability limit .* of model 'continuous' for body 'beam'"),
        ({"events": "located"}, "continuous beam 'beam' has one step length"),
    ):
        with pytest.raises(ImpactlabError, match=told) as caught:
            prepare(*case.but(**change))
        assert caught.value.remedy
    for change, told in (
        ({"tension": 5.0}, "does not support tension"),
        ({"segments": beam().segments * 2}, "second segment"),
    ):
        with pytest.raises(ImpactlabError, match=told):
            prepare(
                *scene(beam(**change) if "tension" in change else dataclasses.replace(beam(), **change), 1e-7, 1e-5)
            )
