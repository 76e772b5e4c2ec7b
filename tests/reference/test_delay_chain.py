"""Chains of delays: rods of several segments, contacts at inner places, against the exact solver and closed forms."""

from __future__ import annotations

import dataclasses
import math
import pickle
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab import metrics
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.bonded import Bonded
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.nitsche import Nitsche
from impactlab.contact.slack import Slack
from impactlab.errors import CaseError, PairingError
from impactlab.exact.solve import solve
from impactlab.history import AbstractHistory
from impactlab.models.continuous import Continuous
from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.refine.references.reference import find
from impactlab.scene import Contact, End, Mass, Point, Probe, Rod, Segment, Wall
from impactlab.scene.bodies import Rayleigh, Table
from impactlab.scene.facts import delay_unit
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare, run
from impactlab.testing.scenes import CLAMPED, FREE, STEEL, face, in_a_row, simulation, struck
from tests.reference.stepped_laws import asked
from tests.reference.test_delay_line import SPRING, Asked

THICK = dataclasses.replace(STEEL, length=0.2, area=1.6e-3)
BRASS = Segment(0.1, 9e-4, 1.0e11, 8500.0)
STEPPED = (STEEL, THICK, BRASS)
LENGTH = 0.6  # m, of the stepped rod
ENDS = [CLAMPED, FREE, End("spring", 1e9), End("dashpot", 2e4), End("mass", 1.0), End("free", force=1e4)]


def errors(case: Simulation, answer: AbstractHistory) -> dict[str, Any]:
    return metrics.errors(run(*case), "exact", answer, case.scene)


def stepped_rod(far: End, dt: float, mirrored: bool = False) -> Simulation:
    pieces = STEPPED[::-1] if mirrored else STEPPED
    ends = (far, FREE) if mirrored else (FREE, far)
    bodies = Mass("hammer", STEEL.mass, -1.0 if mirrored else 1.0), Rod("rod", pieces, *ends)
    return in_a_row(bodies[::-1] if mirrored else bodies, Continuous(), Asked(), None, StepRule(dt=dt))


@pytest.mark.parametrize("far", ENDS, ids=lambda end: "force" if end.force else end.kind)
def test_a_rod_of_three_segments_converges_to_the_exact_solution(far: End) -> None:
    """Three transits without a common measure: places move to the grid, which is of the first order."""
    answer = solve(*stepped_rod(far, 1e-6).but(law=SPRING))
    found = [errors(stepped_rod(far, 4e-6 / 4.0**level), answer) for level in range(4)]
    for name in ("mass_displacement", "face_displacement"):
        assert found[-1][name] < found[0][name] / 30.0
        assert found[-1][name] < 2e-4


@pytest.mark.parametrize(
    "law", [(Asked(), SPRING), (asked(AdditionDeletion()), AdditionDeletion())], ids=["spring", "hard"]
)
@pytest.mark.parametrize("segments", [(STEEL,), (STEEL, THICK)], ids=["uniform", "stepped"])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_mass_that_strikes_inside(law: tuple[Any, Any], segments: tuple[Segment, ...], direction: float) -> None:
    """Under a hard contact up to its second touch, which magnifies the error of the first one's instants.

    It lets the faces overlap by the travel of a step, 3e-8 m at the finest: 0.3 % of the way of the mass, 1e-5 m.
    """
    body = Rod("rod", segments, FREE, CLAMPED)
    duration = 1.9e-4 if law[1].hard else 3.0 * body.round_trip

    def scene(dt: float) -> Simulation:
        hammer = Mass("hammer", 0.5 * STEEL.mass, direction)
        faces = [face(hammer), face(body, 0.2)]
        contact = Contact(*(faces if direction > 0.0 else faces[::-1]), 1e-6)
        bodies = {"hammer": hammer, "rod": body}
        return simulation("inside", bodies, (contact,), duration, model=Continuous(), law=law[0], step=StepRule(dt=dt))

    answer = solve(*scene(1e-6).but(law=law[1]))
    found = [errors(scene(2e-6 / 4.0**level), answer) for level in range(4)]
    for name in ("mass_displacement", "face_displacement", "impulse"):
        assert found[-1][name] < max(found[0][name] / 15.0, 1e-5)
        assert found[-1][name] < (4e-3 if law[1].hard and name != "impulse" else 2e-4)


def test_on_the_grid_it_is_of_the_second_order() -> None:
    """Segments of whole steps and a joint that begins without force: no front, no opening, no place that moves."""
    whole = tuple(dataclasses.replace(each, length=2e-5 * each.wave_speed) for each in STEPPED)
    hammer = Mass("hammer", STEEL.mass, 1.0)

    def scene(dt: float) -> Simulation:
        bodies = hammer, Rod("rod", whole, FREE, FREE)
        return in_a_row(bodies, Continuous(), asked(Slack(stiffness=2e8)), None, StepRule(dt=dt), duration=3.6e-4)

    finest, t = run(*scene(2e-5 / 640)), np.array([0.6e-4, 1.8e-4, 3.6e-4])
    ends = [run(*scene(2e-5 / n)).evaluate(t, "position:hammer") for n in (10, 20, 40)]
    off = [np.abs(each - finest.evaluate(t, "position:hammer")).max() for each in ends]
    np.testing.assert_allclose(np.array(off[:-1]) / off[1:], 4.0, rtol=0.05)


def test_a_specimen_between_bars_rings_up_to_rounding() -> None:
    """After its nth step the transmitted force is 1 - r^(2n) of the incident one, r = (Z - Zs)/(Z + Zs)."""
    bar = Segment(1.5, math.pi * 1e-4, 8000.0 * 5000.0**2, 8000.0)
    specimen = Segment(5e-3, math.pi * 25e-6, 2700.0 * 5000.0**2, 2700.0)
    striker = dataclasses.replace(bar, length=0.25)
    incident = 0.5 * bar.impedance * 12.0
    r = (bar.impedance - specimen.impedance) / (bar.impedance + specimen.impedance)
    one = Rod("bars", (bar, specimen, bar), FREE, FREE)
    bodies = Rod("striker", (striker,), FREE, FREE, velocity=12.0), one
    case = in_a_row(bodies, Continuous(), asked(AdditionDeletion()), None, StepRule(dt=2.5e-7), duration=4.6e-4)
    case = case.but(probes=(Probe("bars", 1.505, "force"), Probe("bars", 1.6, "force")))
    arrival, transit = 1.5 / 5000.0, 1e-6
    n = np.array([1, 2, 5, 20, 45])
    middles = arrival + transit + 2e-6 * (n - 1) + 1.125e-6  # of a step of the loop, well inside the nth level
    history = run(*case)
    found = history.evaluate(middles, "force:bars@1.505") / incident
    np.testing.assert_allclose(found, 1.0 - r ** (2 * n), atol=1e-12)
    np.testing.assert_allclose(found[:3], [0.287021734, 0.491661993, 0.815761048], atol=1e-9)
    later = history.evaluate(middles + 0.095 / 5000.0, "force:bars@1.6") / incident
    np.testing.assert_allclose(later, found, atol=1e-12)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-13


def test_the_same_as_three_bodies_that_are_bonded() -> None:
    bar = Segment(1.5, math.pi * 1e-4, 8000.0 * 5000.0**2, 8000.0)
    specimen = Segment(5e-3, math.pi * 25e-6, 2700.0 * 5000.0**2, 2700.0)
    striker = dataclasses.replace(bar, length=0.25)
    rods = [Rod(name, (one,), FREE, FREE) for name, one in (("i", bar), ("s", specimen), ("t", bar))]
    bodies = Rod("striker", (striker,), FREE, FREE, velocity=12.0), *rods
    laws = asked(AdditionDeletion()), asked(Bonded()), asked(Bonded())
    case = in_a_row(bodies, Continuous(), laws, None, StepRule(dt=2.5e-7), duration=4.6e-4)
    r = (bar.impedance - specimen.impedance) / (bar.impedance + specimen.impedance)
    n = np.arange(1, 46)
    history = run(*case)
    found = history.evaluate(1.5 / 5000.0 + 1e-6 + 2e-6 * (n - 1) + 1.125e-6, "force:s.right|t.left")
    np.testing.assert_allclose(found / (0.5 * bar.impedance * 12.0), 1.0 - r ** (2 * n), atol=1e-12)


BENT = Table((0.0, 0.25, 0.6), (0.0, 2e-6, -1e-6))


@pytest.mark.parametrize("far", [FREE, End("spring", 1e9), End("mass", 1.0)], ids=lambda end: end.kind)
def test_fields_and_probes_at_every_place(far: End) -> None:
    """With waves on their way at t = 0; a probe reads the same as a field."""
    places = (0.0, 0.1, 0.35, 0.55)
    probes = tuple(Probe("rod", x, each) for x in places for each in ("stress", "strain", "velocity", "displacement"))
    found = []
    for dt in (1e-6, 1.25e-7):
        case = stepped_rod(far, dt).but(probes=probes, duration=2.5e-4)
        bodies = dict(case.scene.bodies)
        bodies["rod"] = dataclasses.replace(bodies["rod"], displacement=BENT, velocity=0.3)
        case = case.but(bodies=bodies)
        history, answer = run(*case), solve(*case.but(law=SPRING))
        assert history.field_times("rod") is None
        assert history.dt is not None
        t = history.dt * np.arange(5, history.cost.steps, max(1, history.cost.steps // 41))
        worst = {}
        for quantity in ("displacement", "velocity", "stress", "force"):
            x = history.field("rod", 0.0, quantity).x
            pairs = [(history.field("rod", at, quantity), answer.field("rod", at, quantity, x)) for at in t]
            size = max(np.abs(there.values).max() for _, there in pairs)
            worst[quantity] = np.mean([np.abs(ours.values - there.values) for ours, there in pairs]) / size
            for place in places if quantity != "force" else ():
                along = [history.field("rod", at, quantity, place).values[0] for at in t]
                probed = history.evaluate(t, f"{quantity}:rod@{place:g}")
                assert along == pytest.approx(probed, abs=1e-10 * size)
        found.append(worst)
        waves = history.waves("rod", 0.35, "stress", t=t)
        np.testing.assert_allclose(waves.total, history.evaluate(t, "stress:rod@0.35"), atol=1e-6)
    for quantity, error in found[1].items():
        assert error < 0.3 * found[0][quantity] < 3e-2


def test_both_sides_of_a_contact_are_places_of_a_field() -> None:
    body = Rod("rod", (STEEL,), FREE, FREE)
    case = struck(body, Continuous(), Asked(), mass=1.0, x=0.15, step=StepRule(dt=2e-7))
    history = run(*case)
    found = history.field("rod", 1e-5, "force")
    jump = found.values[found.x > 0.15][0] - found.values[found.x < 0.15][-1]
    assert jump == pytest.approx(history.evaluate(1e-5, "force:hammer|rod"), rel=1e-3)
    assert jump > 0.0


def test_energy_and_momentum_close_to_rounding() -> None:
    case = stepped_rod(FREE, 3.3e-7)
    history = run(*case)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12
    momentum = history.recorded["momentum:rod"].values + history.recorded["momentum:hammer"].values
    np.testing.assert_allclose(momentum, momentum[0], rtol=1e-12)


@pytest.mark.parametrize("dt", [1e-6, 3.7e-7])
def test_the_mirrored_rod_has_the_mirrored_solution(dt: float) -> None:
    one, other = run(*stepped_rod(FREE, dt)), run(*stepped_rod(FREE, dt, mirrored=True))
    assert one.dt == other.dt
    t = np.linspace(0.0, one.duration, 300)
    for name, twin in (("displacement:rod@0", "displacement:rod@0.6"), ("displacement:hammer", "displacement:hammer")):
        if name in one.channels():
            np.testing.assert_allclose(-other.evaluate(t, twin), one.evaluate(t, name), atol=1e-15)
    ours, theirs = (each.field("rod", 0.4 * one.duration, "stress") for each in (one, other))
    size = np.abs(ours.values).max()
    np.testing.assert_allclose(theirs.values[::-1], ours.values, atol=1e-9 * size)


def test_contacts_at_different_places_are_independent_within_a_step() -> None:
    body = Rod("rod", (STEEL, THICK), FREE, FREE)
    walls = {name: Wall(name) for name in "abcd"}
    links = [
        Contact(Point("rod", x, f"rod.at({x})"), Point(name, 0.0, name), 0.0)
        for name, x in zip("abcd", (0.0, 0.1, 0.3, 0.1), strict=True)
    ]
    law = Slack(stiffness=1e7, slack=0.0)
    case = simulation("links", {"rod": body, **walls}, links, 1e-4, model=Continuous(), law=law, step=StepRule(dt=1e-6))
    bodies = {"rod": dataclasses.replace(body, velocity=1.0), **walls}
    history = run(*case.but(bodies=bodies))
    coupled, contacts = history.assembly.memory.coupled, history.assembly.contacts
    found = [coupled[each.first_pair : each.first_pair + each.coupled].tolist() for each in contacts]
    assert found == [[0], [1, 3], [2], [1, 3]]
    # Two links on one node share it: the same as one of twice the stiffness.
    assert history.evaluate(5e-5, "force:rod.at(0.1)|b") == history.evaluate(5e-5, "force:rod.at(0.1)|d")


def test_places_move_by_half_a_cell_at_most_with_a_warning() -> None:
    body = Rod("rod", (STEEL, THICK), FREE, FREE)
    coarse = struck(body, Continuous(), Asked(), mass=1.0, x=0.131, step=StepRule(dt=1.7e-5))
    plan = prepare(*coarse)
    chain = plan.built["rod"].model
    assert isinstance(chain, DelayChain)
    assert plan.dt is not None
    assert 0.8 * 1.7e-5 <= plan.dt <= 1.7e-5
    cells, exact = chain._on_grid(plan.dt)
    assert np.abs(cells - exact).max() <= 0.5
    moved = np.abs(cells - exact).max() * plan.dt / chain.transit
    [warned] = [each for each in plan.warnings if each.code == "misfit"]
    assert f"{100.0 * max(moved, chain.misfit(plan.dt)):.2g} % of the length" in warned.text
    fine = prepare(*coarse.but(step=StepRule(dt=1e-7)))
    assert "misfit" not in {each.code for each in fine.warnings}


def test_places_that_differ_by_rounding_are_one_node() -> None:
    body, wall = Rod("rod", (STEEL, THICK), FREE, FREE), Wall("wall")
    places = (0.1, 0.1 + 1e-13, 0.3 - 1e-13)  # the last one on the boundary of the segments
    points = [Point("rod", x, f"rod.at({number})") for number, x in enumerate(places)]
    contacts = [Contact(point, Point("wall", 0.0, "wall"), 0.0) for point in points]
    law, step = asked(Slack(stiffness=1e7)), StepRule(dt=1e-6)
    case = simulation("near", {"rod": body, "wall": wall}, contacts, 1e-4, model=Continuous(), law=law, step=step)
    chain = prepare(*case).built["rod"].model
    assert isinstance(chain, DelayChain)
    np.testing.assert_allclose(chain.places, [0.0, 0.1, 0.3, 0.5], atol=1e-12)


def test_without_a_step_the_shortest_delay_has_one_at_least() -> None:
    body = Rod("rod", (STEEL, dataclasses.replace(THICK, length=2e-4)), FREE, FREE)
    case = struck(body, Continuous(), asked(SPRING), mass=1.0)
    plan = prepare(*case)
    chain = plan.built["rod"].model
    assert isinstance(chain, DelayChain)
    assert plan.dt is not None
    assert plan.dt <= 2e-4 / STEEL.wave_speed * (1.0 + 1e-9)
    assert chain.pieces(plan.dt)[1].cells == 1


def test_a_copy_keeps_its_fields() -> None:
    history = run(*stepped_rod(FREE, 1e-6))
    copy = pickle.loads(pickle.dumps(history))
    ours, theirs = (each.field("rod", 1e-4, "stress") for each in (history, copy))
    np.testing.assert_array_equal(ours.x, theirs.x)
    np.testing.assert_array_equal(ours.values, theirs.values)
    assert np.abs(ours.values).max() > 0.0


def test_a_step_that_fits_is_taken_as_it_is() -> None:
    body = Rod("rod", (STEEL,), FREE, FREE)
    transit = 0.5 * body.round_trip
    case = struck(body, Continuous(), Asked(), mass=1.0, x=0.15, step=StepRule(dt=transit / 100))
    assert prepare(*case).dt == transit / 100
    assert prepare(*case.but(step=StepRule(dt=transit / 99))).dt == pytest.approx(transit / 100, rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "law", "step", "text"),
    [
        ({"damping": Rayleigh(mass=1.0)}, Asked(), 1e-6, "'rod' is damped"),
        ({}, Asked(), 1e-4, r"longer than a wave takes from 0.3 m to 0.5 m of 'rod', 3.87913e-05 s"),
        ({}, ImpulseMomentum(), 1e-6, "the mass that they would strike"),
    ],
)
def test_the_rest_is_refused(changes: Any, law: Any, step: float, text: str) -> None:
    body = Rod("rod", (STEEL, THICK), FREE, FREE, **changes)
    with pytest.raises((CaseError, PairingError), match=text) as found:
        prepare(*struck(body, Continuous(), law, mass=1.0, step=StepRule(dt=step)))
    assert found.value.remedy
    assert found.value.path


def test_laws_that_read_inside_a_rod_are_refused() -> None:
    """Beside a law that is stepped; alone they have an exact answer."""
    body = Rod("rod", (STEEL, THICK), FREE, FREE)
    bodies = Mass("hammer", 1.0, 1.0), body, Wall("wall")
    case = in_a_row(bodies, Continuous(), (Nitsche(), Asked()), None, StepRule(dt=1e-6))
    with pytest.raises(CaseError, match=r"'rod' has no force at .* m within a step") as found:
        run(*case)
    assert "reads nothing inside" in found.value.remedy


@pytest.mark.parametrize("segments", [(STEEL,), STEPPED], ids=["uniform", "stepped"])
@pytest.mark.parametrize("end", [FREE, End("mass", 0.7)], ids=lambda end: end.kind)
def test_a_rod_falls_on_a_spring(segments: tuple[Segment, ...], end: End) -> None:
    """Under a gravity that counts beside its waves, with every quantity inside; its work and impulse are booked."""
    body, wall = Rod("rod", segments, FREE, end, velocity=1.0), Wall("wall")
    contact = Contact(face(body, 0.2), face(wall), 1e-6)
    probes = tuple(Probe("rod", 0.11, quantity) for quantity in ("velocity", "displacement", "force"))
    found = []
    for dt in (1e-6, 6e-8):
        fields = {"model": Continuous(), "law": asked(SPRING), "step": StepRule(dt=dt)}
        bodies = {"rod": body, "wall": wall}
        case = simulation("fall", bodies, (contact,), 5e-4, gravity=9.81e3, probes=probes, **fields)
        history, answer = run(*case), solve(*case.but(law=SPRING))
        assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-11
        t, off = np.linspace(0.0, 5e-4, 300), []
        for channel in (probe.channel for probe in probes):
            exact = answer.evaluate(t, channel)
            rms = np.sqrt(np.mean((history.evaluate(t, channel) - exact) ** 2))
            off.append(rms / np.abs(exact).max())
        found.append([*off, abs(history.contacts[0].impulse / answer.contacts[0].impulse - 1.0)])
    # A front that is spread over one of 8300 steps is off by 1/sqrt(8300) of its height in the mean square.
    assert np.all(np.array(found[1]) < [0.011, 2e-5, 0.011, 5e-6])
    assert np.all(np.array(found[1]) < 0.5 * np.array(found[0]))


def test_free_fall_is_exact() -> None:
    whole = tuple(dataclasses.replace(each, length=2e-5 * each.wave_speed) for each in STEPPED)
    body = Rod("rod", whole, End("mass", 0.4), FREE)
    law, step = asked(SPRING), StepRule(dt=1e-6)
    case = struck(body, Continuous(), law, mass=1.0, velocity=0.0, gap=1.0, gravity=9.81, step=step)
    history = run(*case.but(probes=(Probe("rod", 0.25, "displacement"), Probe("rod", 0.2, "force")), duration=1e-3))
    t = 1e-6 * np.arange(0, 900, 100)  # records
    found = history.evaluate(t, "displacement:rod@0.25")
    np.testing.assert_allclose(found, 0.5 * 9.81 * t**2, rtol=1e-6, atol=1e-12)
    assert np.abs(history.evaluate(t, "force:rod@0.2")).max() < 1e-9 * 9.81 * body.moving_mass


def test_a_shaft_of_two_segments_struck_inside() -> None:
    """Twist, rate and torque at every place, in the units of torsion."""
    steel = {"shear_modulus": 8e10, "density": 7850}
    probes = [
        {"body": "shaft", "at": at, "quantity": quantity}
        for at in (0.1, 0.35)
        for quantity in ("twist", "twist_rate", "torque")
    ]
    case = il.Case(
        bodies={
            "hammer": il.Mass(0.016, velocity=1.0),
            "shaft": il.Shaft(
                segments=[
                    {"length": 0.3, "section": {"diameter": 0.04}, "material": steel},
                    {"length": 0.2, "section": {"diameter": 0.05}, "material": steel},
                ],
                ends={"right": "clamped"},
            ),
        },
        contacts=[il.Contact("hammer", "shaft.at(0.2)", {"kind": "penalty", "stiffness": 2e6}, lever_arm=0.25)],
        solve={"duration": 9e-4, "model": {"kind": "continuous"}, "step": {"dt": 1e-6}},
        probes=probes,
    ).simulation()
    answer = run(*case)
    [(name, law)] = case.method.laws.items()
    history = run(*case.but(laws={name: asked(law)}))
    assert answer.dt is None
    assert isinstance(history.built["shaft"].model, DelayChain)
    t = np.linspace(0.0, 9e-4, 400)
    for channel in (f"{each['quantity']}:shaft@{each['at']}" for each in probes):
        exact = answer.evaluate(t, channel)
        rms = np.sqrt(np.mean((history.evaluate(t, channel) - exact) ** 2))
        assert rms < 1e-3 * np.abs(exact).max()


def test_a_ball_on_a_stepped_rod_has_the_numbers_of_its_case() -> None:
    """Hertz's contact, with a second wave back from the step in the area: of the second order."""
    solve = {"duration": "120 us", "model": {"kind": "continuous"}, "step": {"dt": 1.2e-7}}
    [found] = il.run(il.load_case("ball_on_stepped_rod").with_("solve", solve)).contacts
    assert found.impulse == pytest.approx(0.1185887, rel=1e-5)
    assert found.peak_force == pytest.approx(3530.41, rel=1e-5)
    assert found.end == pytest.approx(61.9333e-6, rel=2e-5)


def test_a_converged_reference_is_a_delay_line_where_all_places_fit_one_grid() -> None:
    found = find(*il.load_case("ball_on_stepped_rod").simulation())
    assert found is not None
    assert found.found.startswith("stepped delay line of segments")
    assert found.uncertainty < 1e-6
    assert found.history.contacts[0].peak_force == pytest.approx(3530.41, rel=2e-6)


def test_the_common_unit_of_delays() -> None:
    """Transits of 30, 45 and 75 us hold 15 us; those of three metals nothing."""
    whole = [dataclasses.replace(STEEL, length=n * 1e-6 * STEEL.wave_speed) for n in (30, 45, 75)]
    rods = [Rod("a", tuple(whole[:2]), FREE, FREE), Rod("b", (whole[2],), FREE, FREE)]
    assert delay_unit(in_a_row(rods, law=Asked()).scene) == pytest.approx(15e-6, rel=1e-12)
    assert delay_unit(in_a_row([Rod("a", STEPPED, FREE, FREE), rods[1]], law=Asked()).scene) is None
    damped = dataclasses.replace(rods[0], damping=Rayleigh(mass=1.0))
    assert delay_unit(in_a_row([damped, rods[1]], law=Asked()).scene) is None
