"""The automatic choice: what it states holds, measured against the reference; what it says can be read."""

from __future__ import annotations

import dataclasses
import json
import math
import pickle

import numpy as np
import pytest

import impactlab as il
from impactlab import load_case, metrics
from impactlab.api import physics_of, solve
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz, HuntCrossley
from impactlab.contact.velocity_complementarity import VelocityComplementarity
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import CaseError, StepError
from impactlab.exact.cost import begin, predicted_s
from impactlab.exact.solve import solve as solve_exactly
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.refine import search, trial
from impactlab.refine.convergence import Level, Study, finest_error, observed_order
from impactlab.refine.descriptions import beam_families, rods, suitable
from impactlab.refine.descriptions.contact_times import rise_time
from impactlab.refine.descriptions.suitable import in_turn
from impactlab.refine.errors import level_errors
from impactlab.refine.errors.distances import counted, difference
from impactlab.refine.references import converged as converged_reference
from impactlab.refine.references import reference
from impactlab.report import summary
from impactlab.report.choice import _number, choice_lines, choose, ladder_text
from impactlab.scene import Beam, BeamSegment, Contact, End, Mass, Point, Probe, Rayleigh, Rod, Segment, Wall
from impactlab.scene.method import Method, Simulation, StepRule, Tolerance
from impactlab.simulate import run
from impactlab.testing.scenes import simulation
from tests.support import CASES

SEGMENT = Segment(0.3, 9e-4, 2.1e11, 7900.0)
TWO = (Segment(0.1, 9e-4, 2.1e11, 7900.0), Segment(0.2, 5e-4, 7e10, 2700.0))
NONE = Rayleigh()


def struck(
    law, tolerance=1e-3, trips=2.0, far="clamped", damping=NONE, segments=(SEGMENT,), mass=2.133, probes=()
) -> Simulation:
    rod = Rod("rod", segments, End("free"), End(far), damping=damping)
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), 0.0)
    bodies = {"hammer": Mass("hammer", mass, 1.0), "rod": rod}
    trip = rod.round_trip
    step = StepRule(points_per_period=10.0)
    return simulation(
        "s",
        bodies,
        (contact,),
        trips * trip,
        None,
        step,
        probes=probes,
        round_trip=trip,
        tolerance=Tolerance(tolerance),
        model=Continuous(),
        law=law,
    )


def measured(history, scene):
    """The largest relative error of displacements and impulse, and what the reference itself may be off."""
    judge = reference.find(*scene.but(tolerance=None), budget=0.4)
    found = [getattr(metrics, name)(history, judge.history, scene.scene) for name in converged_reference.CONVERGED_BY]
    return max(value for value in found if value is not None), judge.uncertainty


SCENES = {
    "hard": lambda: struck(AdditionDeletion()),
    "hard, wave identification": lambda: struck(WaveIdentification()),
    "hard, free": lambda: struck(AdditionDeletion(), far="free"),
    "spring": lambda: struck(Penalty(stiffness=1e9, damping=1e3)),
    "hertz": lambda: struck(Hertz(1e11)),
    "hertz, stiff": lambda: struck(Hertz(1e13)),
    "hertz on two materials": lambda: struck(Hertz(1e11), segments=TWO),
    "hysteretic": lambda: struck(HuntCrossley(1e11, restitution=0.5)),
    "hard, mass damped": lambda: struck(AdditionDeletion(), damping=Rayleigh(mass=2000.0)),
    "hard, stiffness damped": lambda: struck(AdditionDeletion(), damping=Rayleigh(stiffness=2e-6)),
    "spring, damped": lambda: struck(Penalty(stiffness=1e9), damping=Rayleigh(500.0, 1e-7)),
}


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("name", SCENES)
def test_the_error_lies_within_the_expected_one_and_the_tolerance(name, tolerance):
    scene = SCENES[name]().but(tolerance=Tolerance(tolerance))
    history = solve(*scene)
    error, known = measured(history, scene)
    assert history.choice.met
    assert known < 0.1 * tolerance
    assert error <= history.choice.expected_error + known
    assert error <= tolerance


@pytest.mark.parametrize("seed", range(12))
def test_random_scenes_keep_their_tolerance(seed):
    rng = np.random.default_rng(seed)
    law = [
        Hertz(10.0 ** rng.uniform(9, 13)),
        HuntCrossley(10.0 ** rng.uniform(10, 12), restitution=rng.uniform(0.2, 1)),
        Penalty(stiffness=10.0 ** rng.uniform(8, 10)),
    ][seed % 3]
    damping = Rayleigh(rng.uniform(0, 1000), 10.0 ** rng.uniform(-7, -5)) if seed % 2 else NONE
    scene = struck(
        law,
        tolerance=10.0 ** rng.uniform(-3.5, -1.5),
        trips=rng.uniform(0.8, 2.5),
        far=["clamped", "free"][seed % 2],
        damping=damping,
        segments=(dataclasses.replace(SEGMENT, length=rng.uniform(0.05, 1.0)),),
        mass=10.0 ** rng.uniform(-1, 1),
    )
    history = solve(*scene)
    error, known = measured(history, scene)
    assert history.choice.met
    assert error <= scene.method.tolerance.error + known


@pytest.mark.parametrize("mass", [0.5, 0.53, 2.133, 4.0])
def test_a_mesh_states_an_error_that_it_keeps(mass):
    """An opening falls between steps: two resolutions may agree better than either with the exact answer."""
    for tolerance in (1e-2, 1e-3, 1e-4):
        scene = struck(AdditionDeletion(), tolerance, mass=mass, trips=3.0)
        exact, *stepped = in_turn(scene)[0]
        mesh = next(family for family in stepped if family.name.startswith("lumped mesh"))
        _, level = search.Search(scene).best([Study(mesh, mesh.start_for(tolerance))])
        assert level.error <= tolerance
        assert difference(level.history, solve(*exact.simulation(0)), *counted(scene)) <= level.error


def test_a_step_load_sends_fronts_as_a_hard_touch_does():
    """Without them a mesh would be taken for one of order 2."""
    bar = Rod("rod", (SEGMENT,), End("free", force=1e4), End("clamped"))
    trip = bar.round_trip
    scene = simulation(
        "s", {"rod": bar}, (), 3 * trip, None, StepRule(points_per_period=10.0), round_trip=trip, model=Continuous()
    )
    loaded = scene.but(tolerance=Tolerance(1e-2))
    judge = solve(*next(iter(in_turn(loaded)[0])).simulation(0))
    for mesh in [*in_turn(loaded)[0]][1:]:
        _, level = search.Search(loaded).best([Study(mesh, mesh.start_for(1e-2))])
        assert difference(level.history, judge, *counted(loaded)) <= level.error


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
def test_a_peak_where_a_step_load_arrives_counts(tolerance: float) -> None:
    """A mass on a spring k at a rod that is pulled at its far end: the force rises until the front is there, at L/c.

    Until then F'' + k/Z F' + k/M F = 0, F'(0) = k v0. The force of a spring has a kink there and no jump.
    """
    k, Z, M, pull = 4e7, 4000.0, 0.4, 1000.0
    sigma = 0.5 * k / Z
    omega = math.sqrt(k / M - sigma**2)
    t = 1e-4  # L/c
    force = k / omega * math.exp(-sigma * t) * math.sin(omega * t)
    slope = k * math.exp(-sigma * t) * (math.cos(omega * t) - sigma / omega * math.sin(omega * t))
    assert 0.0 < slope < k * 2.0 * pull / Z  # it rises before the front, and falls behind it
    rod = il.Rod(length=0.5, area=1e-4, material={"young": 2e11, "density": 8000.0}, ends={"right": {"force": pull}})
    case = il.Case(
        bodies={"hammer": il.Mass(M, velocity=1.0), "rod": rod},
        contacts=[il.Contact("hammer", "rod.left", {"kind": "hertz", "exponent": 1.0, "stiffness": k})],
        solve={"duration": 1.9e-4, "tolerance": tolerance},
    )
    history = il.run(case)
    (span,) = history.contacts
    assert span.peak_force == pytest.approx(force, rel=history.choice.expected_error)
    assert history.choice.expected_error <= tolerance


def test_times_are_printed_without_powers_of_ten():
    assert [_number(value) for value in (690.4, 3212.0, 27.3, 0.0123, None)] == ["690", "3212", "27", "0.012", "-"]


def test_an_exact_scene_is_solved_exactly_and_without_a_trial():
    for tolerance in (0.1, 1e-3, 1e-8):
        choice = solve(*struck(AdditionDeletion(), tolerance)).choice
        assert choice.chosen == "continuous, from event to event"
        assert choice.met
        assert [rung.verdict for rung in choice.ladder] == ["chosen", "not run", "not run"]


def test_a_power_law_on_uniform_rods_is_a_delay_line():
    choice = solve(*struck(Hertz(1e12), 1e-3)).choice
    assert choice.chosen.startswith("stepped delay line")
    refused = [rung for rung in choice.ladder if rung.verdict == "refused"]
    assert "constant springs" in refused[0].reason


def test_a_description_is_not_chosen_for_probes_that_it_cannot_record():
    probes = (Probe("rod", 0.15, "stress"),)
    history = solve(*struck(Hertz(1e12), 1e-3, probes=probes))
    assert "mesh" in history.choice.chosen
    assert np.all(np.isfinite(history.evaluate(np.array([1e-5, 2e-5]), "stress:rod@0.15")))


def test_rigid_bodies_alone_are_stepped():
    contact = Contact(Point("ball", 0.0, "ball"), Point("wall", 0.0, "wall"), 0.0)
    bodies = {"ball": Mass("ball", 2.0, 1.0), "wall": Wall("wall")}
    scene = simulation(
        "s", bodies, (contact,), 0.01, None, StepRule(dt=1e-6), tolerance=Tolerance(1e-4), law=Hertz(1e9)
    )
    history = solve(*scene)
    assert history.choice.met
    # It leaves as it came.
    assert float(history.evaluate(np.array([0.01]), "velocity:ball")[0]) == pytest.approx(-1.0, abs=1e-4)


def test_the_same_scene_gives_the_same_choice_and_the_same_bits():
    scene = struck(Hertz(1e12), 1e-3)
    one, other = solve(*scene), solve(*scene)
    timeless = [
        [(rung.candidate, rung.estimated_error, rung.verdict, rung.reason) for rung in history.choice.ladder]
        for history in (one, other)
    ]
    assert timeless[0] == timeless[1]
    assert one.choice.expected_error == other.choice.expected_error
    t = np.linspace(0.0, scene.scene.duration, 500)
    assert np.array_equal(one.evaluate(t, "displacement:rod@0"), other.evaluate(t, "displacement:rod@0"))


def test_a_choice_is_the_run_of_its_scene():
    history = solve(*struck(Hertz(1e12), 1e-3))
    again = solve(history.scene, history.choice.method)
    t = np.linspace(0.0, again.duration, 300)
    assert np.array_equal(history.evaluate(t, "position:hammer"), again.evaluate(t, "position:hammer"))
    assert again.choice is None


def test_a_choice_survives_pickle_and_json():
    scene = struck(Hertz(1e12), 1e-3)
    history = solve(*scene)
    choice = pickle.loads(pickle.dumps(history.choice))
    assert choice == history.choice
    said = summary.summarise("x", history)["choice"]
    assert json.loads(json.dumps(said, allow_nan=False)) == said
    assert set(said) == {
        "tolerance",
        "met",
        "chosen",
        "expected_error",
        "measured_error",
        "estimate",
        "ladder",
        "choosing_s",
    }
    assert said["chosen"]["models"]["rod"]["kind"] == "continuous"
    assert said["chosen"]["laws"] == [{"kind": "hertz", "stiffness": 1e12, "exponent": 1.5}]
    assert {"candidate", "predicted_error", "estimated_error", "solve_s", "verdict", "reason"} <= set(said["ladder"][0])


def test_a_tolerance_that_was_not_met_is_warned_of(monkeypatch):
    """Where no cost explains it, the best found is the answer, with the error that it must be expected to have."""
    scene = struck(AdditionDeletion(), 1e-6, damping=Rayleigh(stiffness=1e-6))
    monkeypatch.setattr(level_errors, "MAX_LEVELS", 2)
    monkeypatch.setattr(level_errors, "MAX_GROWTH", 1.0)
    monkeypatch.setattr(
        "impactlab.refine.descriptions.description.Description.start_for", lambda _description, _error: 20
    )
    history = solve(*scene)
    assert not history.choice.met
    assert [warned.code for warned in history.warnings].count("tolerance_not_met") == 1
    error, _ = measured(history, scene)
    assert scene.method.tolerance.error < error <= history.choice.expected_error
    said = "\n".join(choice_lines(summary.summarise("x", history)["choice"]))
    assert "expected error" in said
    assert "does not converge" in " ".join(rung.reason for rung in history.choice.ladder)


def test_the_ladder_is_measured_and_falls():
    scene = struck(Hertz(1e11)).but(tolerance=None)
    document = choose("x", scene.but(tolerance=Tolerance(1e-4)), scene)
    assert document["choice"]["met"]
    assert document["measured_error"] <= document["choice"]["expected_error"] <= 1e-4
    by_choice = {each["candidate"] for each in document["choice"]["ladder"] if each["estimated_error"] is not None}
    by_family = {}
    for rung in document["ladder"]:
        if rung["measured_error"] is not None:
            by_family.setdefault(rung["candidate"].rsplit(",", 1)[0], []).append(rung)
    assert len(by_family) == 3
    for rungs in by_family.values():
        errors = [rung["measured_error"] for rung in rungs]
        assert errors == sorted(errors, reverse=True)
        for rung in rungs:
            assert rung["measured_error"] <= rung["estimated_error"]
            # Three runs show the order, and the expected error holds a safety of 2. The choice may have made two.
            if rung["candidate"] not in by_choice:
                assert rung["estimated_error"] <= 10.0 * rung["measured_error"]
            assert rung["predicted_error"] / 30.0 < rung["measured_error"] < 30.0 * rung["predicted_error"]
    text = ladder_text(document)
    assert "measured against a converged solution" in text
    assert all(rung["candidate"] in text for rung in document["ladder"])


def test_predictions_fall_with_fineness_and_costs_rise():
    for name in SCENES:
        families, _ = in_turn(SCENES[name]())
        for family in families:
            if not family.unit:
                continue
            fine = [family.min_fineness * 2**k for k in range(8)]
            errors, costs = [family.error(n) for n in fine], [family.seconds(n) for n in fine]
            assert errors == sorted(errors, reverse=True)
            assert costs == sorted(costs)
            n = family.fineness_for(1e-3, family.safety)
            assert family.safety * family.error(n) <= 1e-3
            assert n == family.min_fineness or family.safety * family.error(n - max(2, n // 8)) > 1e-3


def three(errors):
    """The distances of three levels whose errors are all to one side."""
    return {(i, j): errors[i] - errors[j] for i, j in ((0, 1), (0, 2), (1, 2))}


def test_an_extrapolated_error_is_that_of_a_power():
    fineness = (10.0, 25.0, 40.0)
    errors = [3.0 * n**-1.7 for n in fineness]
    pairs = three(errors)
    assert observed_order(pairs[0, 2] / pairs[1, 2], 4.0, 1.6) == pytest.approx(1.7, rel=1e-6)
    found = finest_error(pairs, fineness, 2.0)
    assert found.order == pytest.approx(1.7, rel=1e-6)
    assert found.error == pytest.approx(errors[2], rel=1e-6)


def test_an_order_that_has_not_shown_is_not_trusted():
    """Two resolutions agree by luck; the third shows that they do."""
    pairs = {(0, 1): 1e-2, (0, 2): 1e-2, (1, 2): 1e-6}
    assert finest_error(pairs, (10.0, 16.0, 26.0), 2.0).error > 1e-3
    growing = {(0, 1): 1e-3, (0, 2): 5e-3, (1, 2): 4e-3}
    assert finest_error(growing, (10.0, 16.0, 26.0), 2.0).error > 4e-3
    assert finest_error(growing | {(1, 2): math.inf}, (10.0, 16.0, 26.0), 2.0).error == math.inf


def test_a_small_safety_needs_an_order_that_shows_in_all_runs() -> None:
    fineness = (10.0, 16.0, 26.0)
    errors = [n**-2.0 for n in fineness]
    clean = finest_error(three(errors), fineness, 2.0)
    assert clean.shown
    assert clean.error == pytest.approx(errors[2])
    assert clean.with_safety(3.0) == pytest.approx(1.6 * errors[2])
    slow = [1.0 / n for n in fineness]
    doubtful = finest_error(three(slow), fineness, 2.0)
    assert not doubtful.shown
    assert doubtful.with_safety(3.0) == pytest.approx(3.0 * slow[2])


def test_the_predicted_cost_of_the_exact_solver_follows_its_wave_fronts():
    """Twice the time is twice the fronts of one piece; of two pieces, irrational transits make many more than whole."""
    one = predicted_s(*struck(AdditionDeletion(), trips=1e4))
    assert predicted_s(*struck(AdditionDeletion(), trips=2e4)) == pytest.approx(2.0 * one, rel=0.1)
    whole = (SEGMENT, dataclasses.replace(SEGMENT, length=0.6, area=2e-3))
    skew = (SEGMENT, dataclasses.replace(SEGMENT, length=0.3 * 2.0**0.5, area=2e-3))
    costs = [predicted_s(*struck(AdditionDeletion(), trips=30.0, segments=each)) for each in (whole, skew)]
    assert costs[0] < 0.5 * costs[1]


def test_rise_times_are_those_of_the_contact():
    impedance = SEGMENT.impedance
    spring = struck(Penalty(stiffness=1e12))
    assert rise_time(*spring, spring.scene.contacts[0]) == pytest.approx(impedance / 1e12, rel=1e-12)
    soft = struck(Penalty(stiffness=1e3))
    assert rise_time(*soft, soft.scene.contacts[0]) == pytest.approx(soft.scene.duration, rel=1e-12)
    hard = struck(AdditionDeletion(), mass=0.1)
    assert rise_time(*hard, hard.scene.contacts[0]) == pytest.approx(0.1 / impedance, rel=1e-12)


def test_two_runs_with_the_special_step_do_not_stand_for_each_other():
    """Both runs here are of a mass two per cent heavier: their difference is small, and both are wrong."""
    damped = struck(AdditionDeletion(), 1e-2, damping=Rayleigh(mass=500.0))
    heavier = struck(AdditionDeletion(), 1e-2, damping=Rayleigh(mass=500.0), mass=1.02 * 2.133)
    expected = []
    for scene in (damped, heavier):
        mesh, lucky = (next(f for f in in_turn(s)[0] if f.name.endswith("courant 1")) for s in (damped, scene))
        found = Study(mesh, 800, [Level(n, solve(*lucky.simulation(n))) for n in (300, 490, 800)])
        level_errors.estimate_errors(found, scene)
        expected.append(found.levels[-1].error)
    judged = damped.scene, damped.method.laws, ("displacements", "impulses")
    apart = difference(solve(*lucky.simulation(800)), solve(*mesh.simulation(800)), *judged)
    assert expected[0] < 1e-3
    assert expected[1] >= 0.9 * apart > 3e-3


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
def test_beams_are_chosen_for(theory, tolerance):
    """The run keeps its tolerance against a converged answer, which two independent descriptions find."""
    scene = ball_on_beam(Hertz(1e8), theory)
    judge = reference.find(*scene)
    assert "; checked by " in judge.found
    assert judge.uncertainty < 1e-5
    history = solve(*scene.but(tolerance=Tolerance(tolerance)))
    assert history.choice.met
    assert difference(history, judge.history, *counted(scene)) <= tolerance


def test_a_hard_contact_on_a_beam_that_does_not_shear_is_not_chosen_for():
    """Its contacts multiply with the fineness: no answer converges."""
    scene = ball_on_beam(AdditionDeletion(), "euler_bernoulli")
    assert reference.find(*scene) is None
    with pytest.raises(CaseError, match="ever more often"):
        solve(*scene.but(tolerance=Tolerance(1e-3)))


def ball_on_beam(law, theory) -> Simulation:
    shear = {"shear_stiffness": 2e7, "rotary_inertia": 6.28e-5} if theory == "timoshenko" else {}
    segment = BeamSegment(length=1.0, area=3e-4, inertia=8e-9, young=2.1e11, density=7850.0, **shear)
    ends = End("clamped"), End("clamped")
    beam = Beam("beam", (segment,), *ends, theory=theory)
    contact = Contact(Point("ball", 0.0, "ball"), Point("beam", 0.5, "beam"), 0.0)
    bodies = {"ball": Mass("ball", 0.1, 1.0), "beam": beam}
    return simulation(
        "s", bodies, (contact,), 1e-3, None, StepRule(points_per_period=10.0), model=FiniteElement(20), law=law
    )


def test_rods_whose_transits_are_no_multiples_keep_the_stated_error():
    """A wave that arrives between two steps is less exact: 25 steps of the shorter rod are twice as wrong as 24."""
    case = load_case(CASES / "rounded_ends.yaml").variant("tip")
    scene = physics_of(case).but(probes=(), snapshots=(), tolerance=Tolerance(1e-4))
    history = solve(*scene)
    error, known = measured(history, scene)
    assert history.choice.chosen.startswith("stepped delay line")
    assert error <= history.choice.expected_error + known


def test_an_exact_choice_marches_once(monkeypatch):
    """The march whose cost is counted is the run itself, and nothing else is described before it ends."""
    marches, described = [], []
    begin, stepped = rods.begin, suitable._stepped
    monkeypatch.setattr(rods, "begin", lambda *asked: marches.append(asked) or begin(*asked))
    monkeypatch.setattr(suitable, "_stepped", lambda asked: described.append(asked) or stepped(asked))
    monkeypatch.setattr("impactlab.exact.solve.build", None)
    scene = struck(AdditionDeletion())
    choice = solve(*scene).choice
    assert (len(marches), len(described)) == (1, 0)
    assert [rung.verdict for rung in choice.ladder] == ["chosen", "not run", "not run"]
    assert len(described) == 1
    assert choice.ladder == tuple(choice.ladder) == pickle.loads(pickle.dumps(choice)).ladder


def test_a_long_march_goes_on_from_its_first_intervals():
    """The same events and the same bits as of a march without a pause."""
    scene = struck(AdditionDeletion(), trips=1e4)
    exact = next(iter(in_turn(scene)[0]))
    begun = exact.begun
    assert begun.log.reached < scene.scene.duration
    whole = solve(*exact.simulation(0))
    gone_on = Study(exact, 0).run(0).history
    assert gone_on.events == whole.events
    t = np.linspace(0.0, scene.scene.duration, 999)
    assert np.array_equal(gone_on.evaluate(t, "displacement:rod@0"), whole.evaluate(t, "displacement:rod@0"))


def test_a_short_run_is_chosen_without_describing_others(monkeypatch):
    """No other description could solve in less than half of its time; the ladder describes them when it is read."""
    described = []
    families = beam_families.families
    monkeypatch.setattr(
        beam_families, "families", lambda asked: (described.append(each.name) or each for each in families(asked))
    )
    scene = ball_on_beam(Hertz(1e8), "euler_bernoulli").but(tolerance=Tolerance(1e-2))
    choice = solve(*scene).choice
    assert choice.met
    assert described == ["modes under exact steps"]
    verdicts = [rung.verdict for rung in choice.ladder]
    assert (verdicts.count("chosen"), verdicts.count("not run")) == (1, 1)
    assert len(described) == 2


def test_a_run_that_breaks_a_balance_is_not_chosen(monkeypatch):
    """Trials are not checked; the one that is about to be chosen is, and its study begins again, finer."""
    checks, check_run = [], trial.check_run

    def failing_once(status, assembly, history):
        checks.append(history.dt)
        if len(checks) == 1:
            raise StepError("energy grew", remedy="Give a smaller step.", time=0.0, step=0, history=history)
        check_run(status, assembly, history)

    monkeypatch.setattr(trial, "check_run", failing_once)
    history = solve(*struck(Hertz(1e11), tolerance=1e-2))
    assert history.choice.met
    assert len(checks) == 2
    assert history.dt == checks[1] < checks[0]


def test_a_run_that_gains_energy_states_an_error_of_a_tenth_of_it(monkeypatch):
    """The tolerance is not kept by it, and finer runs follow until one gains less."""
    gains = []

    def gain_of(history):
        gains.append(0.5 if not gains else 0.0)
        return gains[-1]

    monkeypatch.setattr(level_errors, "gain_of", gain_of)
    history = solve(*struck(Hertz(1e11), tolerance=1e-2))
    assert history.choice.met
    assert gains == [0.5, 0.0]
    reasons = [rung.reason for rung in history.choice.ladder if rung.verdict == "trial"]
    assert "gains 0.5 of the reference energy" in reasons


def test_a_march_that_has_gone_on_once_is_not_gone_on_with_again():
    # The choice tried a failed exact run again with the arrays of its first march, and wrote beyond them.
    scene, method = struck(AdditionDeletion())
    begun = begin(scene, method)
    first, second = (solve_exactly(scene, method, begun=begun) for _ in range(2))
    assert begun.used
    assert [event.time for event in second.events] == [event.time for event in first.events]
    assert second.log is not first.log


def test_an_exact_run_that_fails_is_not_tried_again(monkeypatch):
    tried = []

    def failing(*_, **__):
        tried.append(True)
        raise StepError("the wave fronts take too much", time=0.0, step=0, remedy="Give a shorter duration.")

    monkeypatch.setattr(trial, "run", failing)
    asked = struck(AdditionDeletion())
    exact, _ = suitable.exact_for(asked)
    study = Study(exact, 0)
    assert search.Search(asked).best([study]) is None
    assert len(tried) == 1
    assert study.closed.startswith("failed: the wave fronts take too much")


@pytest.mark.parametrize("retardation", [1e-9, 1e-8])
def test_a_damped_rod_between_hard_contacts_keeps_its_tolerance_and_gains_no_energy(retardation: float) -> None:
    """The midpoint rule gave it energy at every touch of the wall: all runs failed, or one was met that gained 0.2."""
    segment = Segment(0.3, 3.1416e-4, 2.1e11, 7850.0)
    rod = Rod("rod", (segment,), End("free"), End("free"), damping=Rayleigh(stiffness=retardation))
    struck_end = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), 0.0)
    stop = Contact(Point("rod", 0.3, "rod.right"), Point("wall", 0.0, "wall"), 5e-5)
    bodies = {"hammer": Mass("hammer", 0.74, 1.0), "rod": rod, "wall": Wall("wall")}

    def asked(tolerance: float) -> Simulation:
        return simulation(
            "s", bodies, (struck_end, stop), 4e-4, None, StepRule(points_per_period=10.0),
            round_trip=rod.round_trip, tolerance=Tolerance(tolerance), model=Continuous(), law=AdditionDeletion(),
        )  # fmt: skip

    coarse, fine = (solve(*asked(tolerance)) for tolerance in (3e-2, 2e-3))
    for history in (coarse, fine):
        assert history.choice.met
        assert history.energy.largest_gain < 1e-9
    speeds = [float(each.evaluate(4e-4, "velocity:hammer")) for each in (coarse, fine)]
    assert speeds[0] == pytest.approx(speeds[1], abs=3e-2)
    # Another law under another scheme, which share nothing with those chosen but the mesh.
    scene, method = asked(2e-3)
    laws = dict.fromkeys(method.laws, VelocityComplementarity())
    steps = Method(laws, {"rod": FiniteElement(1600)}, MoreauJean(), StepRule(courant=0.5))
    assert speeds[1] == pytest.approx(float(run(scene, steps).evaluate(4e-4, "velocity:hammer")), abs=2e-3)
