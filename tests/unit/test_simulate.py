"""Runs: refusals before the first step, the loop with events and several contacts, times outside of the run."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import CaseError, ImpactlabError, PairingError, StepError
from impactlab.exact.solve import solve
from impactlab.integrators.adaptive import Adaptive
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import End, Mass, Rod, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare, run
from impactlab.testing.scenes import CLAMPED, FREE, STEEL, in_a_row
from impactlab.testing.scenes import mass_on_rod as paper
from tests.solving import in_steps, mesh

TEN = StepRule(points_per_period=10)


LUMPED = FiniteElement(20, "lumped")


@pytest.mark.parametrize(
    ("scene", "kind", "path", "says"),
    [
        (
            paper(LUMPED, AdditionDeletion(), CentralDifference(), StepRule(courant=1.2)),
            CaseError, "solve.step", "beyond the stability limit 2.91159e-06 s of integrator 'central_difference'",
        ),
        (paper(Modal(10, 11), WaveIdentification(), Newmark()), CaseError, "solve.model.modes", "has 10 elastic modes"),
        (paper(Modal(), WaveIdentification(), Newmark()), CaseError, "solve.model", "needs 'modes' (analytic) or"),
        (paper(LUMPED, AdditionDeletion(), ExactModal()), PairingError, "solve.integrator", "needs a model with modes"),
        (
            paper(FiniteElement(20), AdditionDeletion(), CentralDifference()),
            PairingError, "solve.integrator", "needs a diagonal mass",
        ),
        (
            paper(Modal(10), AdditionDeletion(), Newmark(), events="located"),
            PairingError, "solve.events", "'newmark' cannot",
        ),
        (
            paper(Modal(10), WaveIdentification(), ExactModal(), events="located"),
            PairingError, "contacts.0.law", "needs a constant step",
        ),
        (paper(Modal(None, 10), Penalty(), Newmark(), StepRule(courant=0.5)), CaseError, "solve.step", "needs a mesh"),
        (
            paper(LUMPED, WaveIdentification(), CentralDifference(), StepRule(courant=0.9)),
            PairingError, "solve.step", "1.8 times as fast as by wave theory",
        ),
        (
            paper(Modal(10), WaveIdentification(), Newmark(), StepRule(dt=1e-4)),
            PairingError, "solve.step", "would lie 0.51558 m from the face",
        ),
        (
            paper(Continuous(), ImpulseMomentum(), Newmark()),
            PairingError, "contacts.0.law", "the mass that they would strike",
        ),
        (paper(LUMPED, AdditionDeletion(), Newmark(), StepRule(dt=1e-15)), CaseError, "solve.step", "too many"),
        (
            paper(LUMPED, Penalty(stiffness=1e13), CentralDifference(), StepRule(courant=0.9)),
            CaseError, "contacts.0.law", "too stiff for an explicit step",
        ),
    ],
)  # fmt: skip
def test_refused_before_the_first_step(scene: Simulation, kind: type[ImpactlabError], path: str, says: str) -> None:
    with pytest.raises(kind) as refused:
        prepare(*scene)
    assert says in refused.value.text
    assert refused.value.path == path
    assert refused.value.remedy


def test_the_step_for_a_stiff_contact_spring_is_stable() -> None:
    """The spring acts on a node that swings on its element, too, and touches inside a step add energy."""
    penalty = Penalty(stiffness=1e13)
    with pytest.raises(CaseError, match="too stiff for an explicit step") as refused:
        run(*paper(LUMPED, penalty, CentralDifference(), StepRule(courant=0.9)))
    step = float(refused.value.remedy.split("a step of ")[1].split()[0])
    history = run(*paper(LUMPED, penalty, CentralDifference(), StepRule(dt=step)))
    assert history.energy.largest_gain < 0.05


def test_the_stability_limit_itself_is_allowed() -> None:
    prepare(*paper(LUMPED, AdditionDeletion(), CentralDifference(), StepRule(courant=1.0)))


def test_a_run_that_gains_energy_ends_as_failed_with_the_history_so_far() -> None:
    """A spring far too stiff for an explicit step: the energy grows beyond what the parts declare."""
    scene = paper(LUMPED, Penalty(stiffness=2.4e10), CentralDifference(), StepRule(courant=0.999))
    with pytest.raises(StepError, match=r"energy grew|not a finite number") as failed:
        run(*scene)
    assert failed.value.history is not None
    assert failed.value.time > 0.0
    assert failed.value.remedy


@pytest.mark.parametrize("law", [AdditionDeletion(), Penalty(stiffness=2e9), ImpulseMomentum(1.0)])
def test_located_events_lie_on_the_gap(law: AbstractContactLaw) -> None:
    """Where a step is cut at a touch, the faces meet to rounding of their travel."""
    scene = paper(Modal(None, 10), law, ExactModal(), TEN, events="located", right=FREE, gap=1e-5, duration=1e-4)
    history = run(*scene)
    first = history.events[0]
    assert first.time == pytest.approx(1e-5, rel=1e-12)  # 1e-5 m at 1 m/s
    assert abs(float(history.evaluate(first.time, "gap:hammer|rod.left"))) < 1e-16


def test_located_penalty_opens_where_the_gap_opens() -> None:
    """Without damping the force ends where the penetration does; located, to the curvature of the gap within a step."""
    for points in (10, 20, 40):
        scene = paper(
            Modal(None, 10), Penalty(stiffness=2e9), ExactModal(), StepRule(points_per_period=points), events="located"
        )
        history = run(*scene)
        [opened] = [event.time for event in history.events if event.kind == "open"]
        assert history.dt is not None
        # The faces part at less than 2 m/s, so a step is a gap of 2 dt; undated it would be missed by up to that.
        assert abs(float(history.evaluate(opened, "gap:hammer|rod.left"))) < 1e-4 * 2.0 * history.dt


@pytest.mark.parametrize(
    ("model", "integrator", "law", "step"),
    [
        (FiniteElement(200, "lumped"), CentralDifference(), AdditionDeletion(), StepRule(courant=1.0)),
        (FiniteElement(200), Newmark(), Penalty(), TEN),
        (Modal(None, 60), ExactModal(), Penalty(stiffness=6e10), TEN),
    ],
)
def test_two_contacts_on_one_body_are_solved_together(
    model: AbstractRodModel, integrator: AbstractIntegrator, law: AbstractContactLaw, step: StepRule
) -> None:
    """A mass between two rods strikes both at once: by symmetry both forces are equal and the mass keeps still."""
    west, east = (Rod(name, (STEEL,), FREE, FREE, v) for name, v in (("west", 1.0), ("east", -1.0)))
    scene = in_a_row((west, Mass("block", 0.5), east), model, law, integrator, step, round_trips=0.8)
    history = run(*scene)
    times = np.linspace(0.0, scene.scene.duration, 300)
    first, second = (history.evaluate(times, f"force:{contact.name}") for contact in scene.scene.contacts)
    # The coupled answers agree to 1e-15 of the largest in a step; some thousand steps carry the rest on.
    np.testing.assert_allclose(first, second, rtol=0.0, atol=1e-9 * first.max())
    assert np.abs(history.evaluate(times, "position:block")).max() < 1e-12
    # Each half is a rod on a wall: Z v0 once the wave has formed.
    middle = times > 0.3 * scene.scene.round_trip
    assert np.median(first[middle]) == pytest.approx(STEEL.impedance, rel=0.03)


def test_a_mass_that_strikes_a_mass_on_a_rod_moves_both_at_once() -> None:
    """Coupled through the middle mass: hammer, block and rod against the exact answer of the spring pair."""
    rod = Rod("rod", (STEEL,), FREE, CLAMPED)
    bodies = Mass("hammer", 1.0, 1.0), Mass("block", 1.0), rod
    history = run(*in_a_row(bodies, FiniteElement(200), Penalty(stiffness=3e9), Newmark(), round_trips=1.0))
    total = sum(
        float(history.evaluate(0.4 * rod.round_trip, f"momentum:{name}")) for name in ("hammer", "block", "rod")
    )
    assert total == pytest.approx(1.0, rel=1e-6)  # before the wave reaches the clamp; momenta are read between samples
    assert history.energy.largest_gain < 1e-9
    spans = {span.contact for span in history.contacts}
    assert spans == {"hammer|block", "block|rod.left"}


def test_walls_at_both_ends_of_a_rod() -> None:
    """A rod that flies between two walls and meets one after the other: the speed is kept."""
    bodies = Wall("west"), Rod("rod", (STEEL,), FREE, FREE, velocity=1.0), Wall("east")
    parts = FiniteElement(100, "lumped"), AdditionDeletion(), CentralDifference(), StepRule(courant=1.0)
    scene = in_a_row(bodies, *parts, gaps=5e-5, duration=4.5e-4)
    history = run(*scene)
    exact = solve(*scene.but(integrator=None))
    for contact in scene.scene.contacts:
        ours, true = ([span for span in each.contacts if span.contact == contact.name] for each in (history, exact))
        # A lumped end node may let go for a step and touch again; the impulse and the instants are those of the whole.
        assert sum(span.impulse for span in ours) == pytest.approx(true[0].impulse, rel=0.01)
        assert ours[0].start == pytest.approx(true[0].start, rel=0.01)
        assert ours[-1].end == pytest.approx(true[0].end, rel=0.01)


def test_results_are_cut_at_the_duration() -> None:
    scene = paper(Modal(None, 10), Penalty(), Newmark())
    history = run(*scene)
    assert history.duration == scene.scene.duration
    assert history.dt is not None
    assert history.cost.steps == int(np.ceil(scene.scene.duration / history.dt - 1e-9))
    assert all(event.time <= scene.scene.duration for event in history.events)


def test_a_long_run_is_decimated_with_its_impulse_kept() -> None:
    scene = paper(Modal(None, 2), Penalty(), ExactModal()).but(step=StepRule(dt=1e-8))
    history = run(*scene)
    assert history.cost.steps > 20_000
    times = np.linspace(0.0, scene.scene.duration, 200_001)
    middle = 0.5 * (times[1:] + times[:-1])
    integral = float(history.evaluate(middle, "force:hammer|rod.left").sum() * (times[1] - times[0]))
    assert integral == pytest.approx(sum(span.impulse for span in history.contacts), rel=1e-4)


def test_a_run_keeps_the_requested_number_of_instants_and_all_events_to_the_bit() -> None:
    scene = paper(LUMPED, AdditionDeletion(), CentralDifference(), StepRule(courant=0.1))
    every, some = run(*scene), run(*scene.but(records=100))
    assert every.cost.steps == some.cost.steps > 1000
    assert len(some.jumps("force:hammer|rod.left")) <= 103  # and those at the start and of the last two steps
    assert (some.events, some.contacts) == (every.events, every.contacts)
    assert some.dt is not None
    stride = -(-some.cost.steps // 100)
    kept = stride * np.arange(some.cost.steps // stride) * some.dt
    for channel in ("gap:hammer|rod.left", "position:hammer"):
        np.testing.assert_array_equal(some.evaluate(kept, channel), every.evaluate(kept, channel))


@pytest.mark.parametrize("events", ["dated", "located"])
def test_values_at_the_end_do_not_depend_on_the_number_of_records(events: str) -> None:
    """The run ends within its last step, whose ends are kept: a line over many steps missed the speed of the face."""
    blocks = {
        "bodies": {
            "hammer": il.Mass(0.5, velocity=1.0),
            "rod": il.Rod(length=0.3, area=9e-4, material="steel", ends={"right": "clamped"}),
        },
        "contacts": [il.Contact("hammer", "rod.left", {"kind": "penalty", "stiffness": 1e9})],
        "probes": [il.Probe("rod", 0.0, "velocity"), il.Probe("rod", 0.15, "stress")],
        "solve": {
            "duration": "0.5003 ms",
            "model": {"kind": "finite_element", "elements": 50},
            "integrator": {"kind": "midpoint"},
            "step": {"points_per_period": 10},
            "events": events,
        },
    }
    case = il.Case(**blocks)
    every, few = il.run(case), il.run(case.with_("solve.records", 100))
    for channel in ("velocity:hammer", "position:hammer", "velocity:rod@0", "stress:rod@0.15", "gap:hammer|rod.left"):
        assert few.at_end(channel) == every.at_end(channel)


def test_a_snapshot_is_a_field_and_any_other_time_is_refused_with_those_kept() -> None:
    scene = paper(Modal(100, 100), WaveIdentification(), Newmark(), snapshots=(2e-5,))
    history = run(*scene)
    field = history.field("rod", 2e-5, "velocity")
    # The front stands at c t = 0.103 m; a consistent mass sends short waves up to 1.41 c, small ones.
    assert np.abs(field.values[field.x > 0.18]).max() < 0.01
    assert field.values[field.x < 0.08].min() > 0.5
    with pytest.raises(ImpactlabError, match="no snapshot at t = 3e-05 s; snapshots: 2e-05"):
        history.field("rod", 3e-5, "velocity")


def test_an_unrecorded_channel_is_refused_with_those_recorded() -> None:
    history = run(*paper(Modal(None, 5), Penalty(), Newmark()))
    with pytest.raises(ImpactlabError, match=r"'stress:rod@0.1' was not recorded.*force:hammer\|rod.left"):
        history.evaluate(0.0, "stress:rod@0.1")


def test_located_hard_contact_has_no_force_spikes() -> None:
    """An event that falls next to the end of a step once cut a step so short that its force was rounding, 1e9 Z v0."""
    history = run(*paper(Modal(None, 100), AdditionDeletion(), ExactModal(), events="located"))
    peaks = [span.peak_force / STEEL.impedance for span in history.contacts if span.peak_force is not None]
    assert max(peaks) < 2.5  # exact: 2.135; a constraint on truncated modes adds ripple
    assert history.energy.largest_gain < 1e-12
    assert not {"constraint_energy"} & {warned.code for warned in history.warnings}


@pytest.mark.parametrize("integrator", [Newmark(), CentralDifference()])
def test_the_energy_taken_by_a_dashpot_is_booked_in_full(integrator: AbstractIntegrator) -> None:
    """The balance closes with the dashpot's own power, in each scheme's own velocities."""
    rod = Rod("rod", (STEEL,), FREE, End("dashpot", 2e4), velocity=1.0)
    model, step = FiniteElement(50, "lumped"), StepRule(courant=0.8)
    scene = in_a_row((rod,), model, (), integrator, step)
    book = run(*scene).energy
    assert book.booked["ends"][-1] > 0.3 * book.total[0]
    assert max(book.largest_gain, book.largest_loss) < 1e-12


END = 1e-4  # s


def until_end(kind: str) -> Simulation:
    model = Continuous() if kind == "exact" else FiniteElement(4)
    integrator = {"exact": None, "stepped": Newmark(), "adaptive": Adaptive()}[kind]
    return paper(model, Penalty(1e8), integrator, StepRule(dt=1e-6), duration=END, snapshots=(5e-5,))


@pytest.mark.parametrize("kind", ["exact", "stepped", "adaptive"])
def test_values_outside_the_run_are_refused_and_not_those_of_its_end(kind: str) -> None:
    history = run(*until_end(kind))
    for channel in ("position:hammer", "force:hammer|rod.left", "momentum:rod"):
        for outside in (-1e-6, END + 1e-6, math.inf, math.nan):
            with pytest.raises(ImpactlabError, match=r"lies outside the run, 0 to 0\.0001 s") as refused:
                history.evaluate([5e-5, outside], channel)
            assert "longer duration" in refused.value.remedy
            assert refused.value.path == ""  # an argument of the call, and no key of the case
        with pytest.raises(ImpactlabError, match=r"t = 0\.000100000\d+ s lies outside the run, 0 to 0\.0001 s"):
            history.evaluate(END * (1.0 + 1e-7), channel)  # not "t = 0.0001 s lies outside, 0 to 0.0001 s"
        # The end of the run, as sums and products of its steps give it.
        ends = history.evaluate([END, math.nextafter(END, 1.0), END * (1.0 + 1e-12)], channel)
        assert np.all(ends == ends[0])
        assert history.evaluate(-1e-18, channel) == history.evaluate(0.0, channel)
    assert history.evaluate([], "position:hammer").shape == (0,)
    for outside in (-1e-6, 2.0 * END, math.nan):
        with pytest.raises(ImpactlabError, match="lies outside the run"):
            history.field("rod", outside, "displacement")


@pytest.mark.parametrize("kind", ["exact", "stepped", "adaptive"])
def test_a_misspelt_quantity_or_channel_names_the_closest(kind: str) -> None:
    history = run(*until_end(kind))
    with pytest.raises(ImpactlabError, match=r"Did you mean 'stress'\?") as refused:
        history.field("rod", 5e-5, "stres")
    assert refused.value.path == ""
    with pytest.raises(ImpactlabError, match=r"Did you mean 'position:hammer'\?") as refused:
        history.evaluate(5e-5, "positon:hammer")
    assert refused.value.path == ""


@pytest.mark.parametrize("law", [{"kind": "penalty", "stiffness": 1e8}, {"kind": "hertz", "stiffness": 1e10}])
@pytest.mark.parametrize("integrator", ["midpoint", "newmark", "central_difference"])
def test_an_overlap_by_a_displacement_at_the_start_holds_its_energy(law, integrator):
    """The left end of the rod is pushed 0.01 mm into the ball at rest, and both are let go."""
    pushed = {"x": [0.0, 0.1, 0.5], "u": [-1e-5, 0.0, 0.0]}
    material = {"young": 2e11, "density": 8000}
    case = il.Case(
        bodies={"ball": il.Mass(0.5), "rod": il.Rod(length=0.5, area=1e-4, material=material, displacement=pushed)},
        contacts=[il.Contact("ball", "rod.left", law, overlap="allowed")],
        solve=in_steps(4e-4, integrator, mesh(100, "lumped"), courant=0.5),
    )
    history = il.run(case)
    k, n = float(law["stiffness"]), 1.0 if law["kind"] == "penalty" else 1.5
    square, unresolved = 1e-5**2, 0.0
    if integrator == "central_difference":
        # Leapfrog keeps the energy of both ends of a step: here of the step before the first, whose velocities, half a
        # step before, are those under all forces at t = 0: of the contact, and of the first element, of 5 mm.
        dt, force, axial = 0.5 * 0.005 / math.sqrt(2e11 / 8000), k * 1e-5**n, 2e11 * 1e-4 / 0.005
        of_node = -0.5 * dt * (force + axial * 0.05 * 1e-5) / (8000 * 1e-4 * 0.0025)
        of_ball = 0.5 * dt * force / 0.5
        square = 1e-5 * (1e-5 + dt * (of_node - of_ball))
        # A face that parts or meets inside a step: up to the energy of the travel in one step, at each of five events.
        travel = dt * float(np.abs(history.evaluate(np.linspace(0.0, 4e-4, 801), "velocity:rod@0")).max())
        unresolved = 5.0 * k * travel ** (n + 1.0) / (n + 1.0) / float(history.energy.total[0])
    stored = k * square ** (0.5 * (n + 1.0)) / (n + 1.0)
    assert history.energy.stored[0] == pytest.approx(stored, rel=1e-9)
    assert history.energy.largest_gain < 1e-9 + unresolved
    assert history.evaluate([4e-4], "velocity:ball")[0] == pytest.approx(let_go(law), rel=0.03)  # 1 % by the mesh


def let_go(law: dict[str, Any]) -> float:
    """Return the final velocity of that ball [m/s] by leapfrog on four times as many elements, for itself."""
    count, area, young, density, mass = 400, 1e-4, 2e11, 8000.0, 0.5
    h = 0.5 / count
    exponent = 1.0 if law["kind"] == "penalty" else 1.5
    x, nodes = np.linspace(0.0, 0.5, count + 1), np.full(count + 1, density * area * h)
    nodes[[0, -1]] *= 0.5
    u, v = np.interp(x, [0.0, 0.1, 0.5], [-1e-5, 0.0, 0.0]), np.zeros(count + 1)
    ball, speed, steps = 0.0, 0.0, round(4e-4 / (0.25 * h / math.sqrt(young / density)))
    dt = 4e-4 / steps
    for step in range(steps):
        push = law["stiffness"] * max(0.0, ball - u[0]) ** exponent
        pull = young * area / h * np.diff(u)
        force = np.append(pull, 0.0) - np.append(0.0, pull)
        force[0] += push
        share = 0.5 if step == 0 else 1.0  # velocities belong to half steps
        v += share * dt * force / nodes
        speed -= share * dt * push / mass
        u += dt * v
        ball += dt * speed
    return speed
