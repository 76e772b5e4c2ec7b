"""Hard contact by many methods on the paper's case: reduced bases, energies, and what each must keep."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import impactlab as il
from impactlab import metrics
from impactlab.bases.craig_bampton import CraigBampton
from impactlab.bases.eigenvectors import Eigenvectors
from impactlab.bases.macneal import Macneal
from impactlab.bases.striker_attached import StrikerAttached
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.augmented_lagrangian import AugmentedLagrangian
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.energy_conserving import EnergyConserving
from impactlab.contact.impedance_residual import ImpedanceResidual
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.nitsche import Nitsche
from impactlab.contact.paoli_schatzman import PaoliSchatzman
from impactlab.contact.penalty import Penalty
from impactlab.contact.velocity_complementarity import VelocityComplementarity
from impactlab.contact.wave_initialised import WaveInitialised
from impactlab.errors import PairingError
from impactlab.exact.solve import solve
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.contact_stabilised_newmark import ContactStabilisedNewmark
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import Mass, Rod, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import CLAMPED, FREE, STEEL, UNIT, in_a_row, mass_on_rod
from tests.support import PAPER


def paper(
    law: AbstractContactLaw,
    model: AbstractRodModel,
    integrator: AbstractIntegrator,
    points: float = 10.0,
    located: bool = False,
    courant: float | None = None,
) -> Simulation:
    step = StepRule(courant=courant) if courant else StepRule(points_per_period=points)
    return mass_on_rod(model, law, integrator, step, events="located" if located else "dated")


@cache
def exact() -> AbstractHistory:
    return solve(*paper(AdditionDeletion(), Modal(None, 1), Newmark()))


def errors(scene: Simulation, history: AbstractHistory) -> dict[str, float]:
    found = metrics.errors(history, "st_venant", exact(), scene.scene)
    return {name: value for name, value in found.items() if isinstance(value, float | int)}


def second_contact(scene: Simulation, history: AbstractHistory) -> bool:
    """Return whether a contact overlaps the exact second one, 2.1246 to 2.1628 round trips."""
    spans = [
        (s.start / scene.scene.round_trip, (s.end or history.duration) / scene.scene.round_trip)
        for s in history.contacts
    ]
    return any(start < 2.1628 and end > 2.1246 for start, end in spans)


# PHYSICS of reduced bases with steps cut at events: force, face and mass errors; told to two digits, so within a fifth.
ROWS = [
    ("free modes", AdditionDeletion(), Modal(None, 10), (0.283, 6.5e-2, 1.9e-2)),
    ("craig_bampton", AdditionDeletion(), Modal(400, 10, basis=CraigBampton()), (0.209, 5.7e-3, 8.6e-4)),
    ("impedance_residual", ImpedanceResidual(), Modal(None, 10), (0.198, 7.6e-3, 1.9e-3)),
    ("impedance_residual 40", ImpedanceResidual(), Modal(None, 40), (0.099, 1.1e-3, 3.6e-4)),
]


@pytest.mark.parametrize(("name", "law", "model", "row"), ROWS, ids=[row[0] for row in ROWS])
def test_located_rows_of_reduced_bases(name, law, model, row):
    scene = paper(law, model, ExactModal(), points=100.0, located=True)
    history = run(*scene)
    found = errors(scene, history)
    for key, told in zip(("force", "face_displacement", "mass_displacement"), row, strict=True):
        assert found[key] == pytest.approx(told, rel=0.2), key
    assert second_contact(scene, history)
    assert history.energy.largest_gain < 1e-11


def test_impedance_residual_starts_with_the_force_of_the_wave_and_books_its_losses():
    scene = paper(ImpedanceResidual(), Modal(None, 10), ExactModal(), points=1000.0, located=True)
    history = run(*scene)
    first = float(history.evaluate(0.5 * history.dt, f"force:{scene.scene.contacts[0].name}"))
    # F falls by lam_t dt = 2 alpha dt/T and by the modes' own start: a thousandth of their shortest period each.
    assert first == pytest.approx(STEEL.impedance, rel=0.01)
    unresolved = history.energy.booked["unresolved"][-1]
    # 94.7 % of the energy stays resolved.
    assert 1.0 - unresolved / history.energy.scale == pytest.approx(0.947, abs=0.005)


def test_the_attached_striker_s_eigenvectors_keep_the_books():
    found = {}
    for modes in (10, 40):
        scene = paper(
            AdditionDeletion(), Modal(400, modes, basis=StrikerAttached()), ExactModal(), points=100.0, located=True
        )
        history = run(*scene)
        assert history.energy.largest_gain < 1e-11
        assert history.energy.largest_loss < 1e-7
        assert history.energy.booked["unresolved"][-1] > 0.0
        assert second_contact(scene, history)
        found[modes] = errors(scene, history)
    # Both displacements are better than with free-end eigenvectors of the same number, and converge.
    assert found[10]["mass_displacement"] < 1.9e-2 / 5
    assert found[10]["face_displacement"] < 6.5e-2 / 5
    assert found[40]["face_displacement"] < found[10]["face_displacement"] / 2


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_contact_stabilised_newmark_loses_the_booked_energy(mass):
    losses = []
    for elements in (20, 80):
        scene = paper(AdditionDeletion(), FiniteElement(elements, mass), ContactStabilisedNewmark())
        history = run(*scene)
        # Its energy is what the derivation of its losses says, step by step.
        assert history.energy.largest_gain < 1e-12
        assert history.energy.largest_loss < 1e-12
        assert np.all(np.diff(history.energy.total) < 1e-12 * history.energy.scale)
        losses.append(history.energy.booked["contact"][-1] / history.energy.scale)
        assert second_contact(scene, history)
    assert losses[1] < losses[0] / 2


MASSLESS = [
    ("finite element", FiniteElement(100, "redistributed"), Newmark(), {}),
    ("macneal", Modal(400, 10, basis=Macneal()), ExactModal(), {"points": 50.0}),
]


@pytest.mark.parametrize(("name", "model", "integrator", "options"), MASSLESS, ids=[row[0] for row in MASSLESS])
def test_hard_contact_on_a_massless_face_needs_no_impulse_and_keeps_the_energy(name, model, integrator, options):
    scene = paper(AdditionDeletion(), model, integrator, **options)
    history = run(*scene)
    assert not [event for event in history.events if event.kind == "impulse"]
    assert history.energy.largest_gain < 1e-12
    assert history.energy.largest_loss < 1e-12
    # While closed the true faces stand together: the massless one is pressed in by what the gap of the others lacks.
    times = np.linspace(0.0, history.duration, 2001)
    gap = history.evaluate(times, f"gap:{scene.scene.contacts[0].name}")
    travel = float(np.max(np.abs(history.evaluate(times, "position:hammer"))))
    assert float(gap.min()) > -1e-9 * travel


def test_laws_without_a_force_on_massless_faces_are_refused():
    with pytest.raises(PairingError, match="massless"):
        run(*paper(VelocityComplementarity(), FiniteElement(20, "redistributed"), Newmark()))


def test_hard_contact_on_a_massless_face_is_the_spring_of_its_flexibility():
    """The condensed face of a chain has the compliance h/EA: the constraint is that spring, as a rigid penalty is."""
    scene = paper(AdditionDeletion(), FiniteElement(50, "redistributed"), Newmark(), points=20.0)
    history = run(*scene)
    times = np.linspace(0.0, history.duration, 500)
    stiff = run(*paper(Penalty(stiffness=1e25), FiniteElement(50, "redistributed"), Newmark(), points=20.0))
    one, other = (each.evaluate(times, "position:hammer") for each in (history, stiff))
    assert np.max(np.abs(one - other)) < 1e-9 * np.max(np.abs(one))


@pytest.mark.parametrize("theta", ["1", "0", "-1"])
def test_nitsche_converges_whatever_its_theta(theta):
    found = []
    for elements in (25, 100):
        scene = paper(Nitsche(theta), FiniteElement(elements), Newmark())
        found.append(errors(scene, run(*scene))["face_displacement"])
    # Linear elements and a force that jumps: the face's error falls about as the mesh, to the power 3/4 at least.
    assert found[1] < found[0] / 4**0.75
    assert found[1] < 0.01


def test_symmetric_nitsche_keeps_energy_better_with_smaller_steps():
    gains = []
    for points in (10.0, 40.0):
        history = run(*paper(Nitsche(), FiniteElement(50), Newmark(), points=points))
        gains.append(history.energy.largest_gain + history.energy.largest_loss)
    # Its energy is exact except for touches and releases inside a step.
    assert gains[0] < 1e-3
    assert gains[1] < gains[0] / 4


def test_nitsche_refuses_a_basis_without_stress_at_the_face():
    with pytest.raises(PairingError, match="zero in all coordinates") as caught:
        run(*paper(Nitsche(), Modal(None, 20), Newmark()))
    assert "craig_bampton" in caught.value.remedy


def test_energy_conserving_contact_does():
    for model in (FiniteElement(50), Modal(50, 20)):
        history = run(*paper(EnergyConserving(), model, Newmark()))
        assert history.energy.largest_gain < 1e-12
        assert history.energy.largest_loss < 1e-12
        assert history.energy.booked["contact"][-1] == 0.0


def test_augmentations_turn_the_penalty_into_the_constraint():
    """The rest of the overlap falls by 1 + stiffness times compliance with each augmentation."""
    scenes = [
        paper(law, FiniteElement(40, "lumped"), CentralDifference(), courant=0.5)
        for law in (AdditionDeletion(), AugmentedLagrangian(augmentations=3), AugmentedLagrangian(augmentations=200))
    ]
    times = np.linspace(0.0, 3.0 * scenes[0].scene.round_trip, 400)
    constraint, few, often = (run(*scene).evaluate(times, "position:hammer") for scene in scenes)
    size = float(np.max(np.abs(constraint)))
    assert np.max(np.abs(often - constraint)) < 1e-9 * size
    assert np.max(np.abs(few - constraint)) > 1e-5 * size


def test_paoli_schatzman_without_restitution_is_the_constraint_under_central_difference():
    scenes = [
        paper(law, FiniteElement(40, "lumped"), CentralDifference(), courant=0.5)
        for law in (AdditionDeletion(), PaoliSchatzman())
    ]
    times = np.linspace(0.0, 3.0 * scenes[0].scene.round_trip, 400)
    one, other = (run(*scene).evaluate(times, "position:hammer") for scene in scenes)
    assert np.max(np.abs(one - other)) < 1e-12 * np.max(np.abs(one))


@pytest.mark.parametrize("law", [VelocityComplementarity, PaoliSchatzman])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_a_ball_returns_with_its_restitution(law, restitution):
    """A rigid mass on a wall: the rate after is -e times the rate before, whatever the step."""
    bodies = Wall("wall"), Mass("ball", 2.0, -1.0)
    scene = in_a_row(bodies, None, law(restitution), CentralDifference(), StepRule(dt=0.013), gaps=1.0, duration=1.7)
    history = run(*scene)
    assert float(history.evaluate(1.7, "velocity:ball")) == pytest.approx(restitution, abs=1e-12)
    lost = history.energy.booked["contact"][-1]
    assert lost == pytest.approx(1.0 - restitution**2, abs=1e-12)


def test_projection_takes_the_overlap_away():
    overlap = {}
    for projection in (False, True):
        law, step = VelocityComplementarity(0.0, projection), StepRule(courant=0.5)
        # Half a step of travel at 1 m/s: the faces overlap by the other half when the touch is noticed.
        scene = mass_on_rod(FiniteElement(40, "lumped"), law, CentralDifference(), step, gap=3.6e-7)
        history = run(*scene)
        times = np.linspace(0.0, 1.5 * scene.scene.round_trip, 5000)
        gap = history.evaluate(times, f"gap:{scene.scene.contacts[0].name}")
        overlap[projection] = float(np.mean(np.maximum(0.0, -gap)))
    # Without it the overlap of the step of the touch stays; with it only that step itself overlaps.
    assert overlap[False] > 1e-9
    assert overlap[True] < 0.05 * overlap[False]


def test_wave_initialised_begins_with_the_wave_s_pressure():
    scene = paper(WaveInitialised(), FiniteElement(100, "lumped"), CentralDifference(), courant=0.5)
    history = run(*scene)
    first = float(history.evaluate(0.0, f"force:{scene.scene.contacts[0].name}"))
    # Leapfrog's F dt holds the closing jump too: of the end node, half an element, and the mass, as heavy as the rod.
    node = STEEL.mass / 200.0
    jump = 1.0 / (1.0 / node + 1.0 / STEEL.mass) / history.dt
    assert first == pytest.approx(STEEL.impedance + jump, rel=1e-12)
    assert errors(scene, history)["mass_displacement"] < 2e-3


def test_the_kicks_of_impulse_momentum_add_up_to_the_impact():
    """Forty analytic modes, ten points per period, e = 1: the total is that of the waves, 1.698876 M v0, within 2 %."""
    scene = paper(ImpulseMomentum(1.0), Modal(None, 40), ExactModal())
    history = run(*scene)
    (span,) = history.contacts
    assert span.impulse / STEEL.mass == pytest.approx(1.698876, rel=0.02)
    assert span.first_impulse / STEEL.mass == pytest.approx(2.0 / (1.0 + 80.0), rel=1e-12)


def test_a_basis_that_leaves_nothing_out_has_no_residual():
    with pytest.raises(PairingError, match="left out"):
        run(*paper(ImpedanceResidual(), Modal(20, None, basis=Eigenvectors()), ExactModal()))


def test_nitsche_refuses_modes_without_a_force_at_the_face():
    with pytest.raises(PairingError, match="have only 40 %"):
        run(*paper(Nitsche(), Modal(100, 40), Newmark()))
    # Craig-Bampton modes hold the static answer to a force at the face.
    scene = paper(Nitsche(), Modal(100, 40, basis=CraigBampton()), Newmark())
    assert errors(scene, run(*scene))["face_displacement"] < 0.01


def test_augmentations_give_back_no_more_than_they_took():
    """The overlap that ten augmentations leave is pressed out in later steps, with what stopping the faces took."""
    bodies = Wall("wall"), Rod("bar", (UNIT,), FREE, CLAMPED, displacement=lambda x: (1.0 - x) / 2.0)
    history = run(*in_a_row(bodies, FiniteElement(40), AugmentedLagrangian(), MoreauJean(), StepRule(courant=1.0)))
    assert history.energy.largest_gain < 1e-12
    assert history.energy.largest_loss < 1e-12
    assert history.energy.booked["contact"][-1] > 0.0
    assert history.energy.stored[-1] == 0.0


def test_energy_that_a_scheme_damps_away_is_warned_of():
    """Theta 1 is first order: at ten points per period it damps what vibrates; at theta 1/2 nothing is lost unseen."""
    codes = {}
    for theta in (0.5, 1.0):
        scene = paper(VelocityComplementarity(), FiniteElement(20), MoreauJean(theta))
        codes[theta] = {warning.code for warning in run(*scene).warnings}
    assert "energy_loss" in codes[1.0]
    assert "energy_loss" not in codes[0.5]


MESH = {"kind": "modal", "elements": 40, "order": 8}  # 320 coordinates, frequencies of the modes kept exact to 1e-9


def summary_of(**model):
    case = il.load_case(PAPER).with_("contacts.0.law", kind="addition_deletion")
    case = case.with_("solve.model", {**MESH, **model}).with_("solve.integrator", kind="exact_modal")
    case = case.with_("solve.events", "located").with_("solve.step", points_per_period=200)
    return il.compare(case, methods=["base"]).rows[0].summary


# Errors of the force, the face and the mass found by an independent program with exact event times.
KNOWN = {10: (0.209, 5.7e-3, 8.6e-4), 40: (0.102, 6.9e-4, 2.0e-5)}


@pytest.mark.parametrize("modes", KNOWN)
def test_craig_bampton_reaches_the_accuracy_of_its_coordinates(modes):
    summary = summary_of(basis="craig_bampton", modes=modes)
    errors = summary["errors"]
    found = [errors[key] for key in ("force", "face_displacement", "mass_displacement")]
    # Two digits were kept of the numbers: a force held over 1/200 of the shortest period changes them by less than 6 %.
    assert found == pytest.approx(KNOWN[modes], rel=0.06)
    # The second contact, at 2.1246 to 2.1628 T, is there.
    trip = summary["round_trip"]
    assert any(abs(contact["start"] / trip - 2.1246) < 5e-3 for contact in summary["contacts"])
    assert errors["events_missed"] == 0
    assert summary["energy"]["largest_gain"] < 1e-11


def test_few_coordinates_that_keep_the_contact_do_better_than_as_many_eigenvectors():
    kept, free = (summary_of(basis=basis, modes=10)["errors"] for basis in ("craig_bampton", "eigenvectors"))
    assert kept["face_displacement"] < 0.2 * free["face_displacement"]
    assert kept["mass_displacement"] < 0.2 * free["mass_displacement"]
