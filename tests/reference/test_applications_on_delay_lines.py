"""Piles, specimens and drill strings on stepped delay lines, against two other programs and closed forms."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

import impactlab as il
from impactlab import piling
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.bilinear import Bilinear
from impactlab.contact.smith import Smith
from impactlab.drilling import blow as drill_blow
from impactlab.history import AbstractHistory
from impactlab.models.continuous import Continuous
from impactlab.scene import Contact, Mass, Point, Rod, Segment, Wall
from impactlab.scene.bodies import End
from impactlab.scene.method import StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import FREE, in_a_row, simulation
from tests.reference import test_specimen as specimen
from tests.reference.stepped_laws import asked

SET = 11.653e-3  # m


def pile(dt: float, pieces: int = 15, duration: float = 0.1) -> il.Case:
    case = il.load_case("smith_pile").with_("contacts.2.pieces", pieces)
    return case.with_("solve", {"duration": duration, "model": {"kind": "continuous"}, "step": {"dt": dt}})


def link(history: AbstractHistory, name: str) -> il.history.LinkResult:
    return next(each for each in history.links if each.name == name)


@pytest.fixture(scope="module")
def blow() -> piling.Blow:
    return piling.blow(pile(12.5e-6))


def test_one_blow(blow: piling.Blow) -> None:
    history = blow.history
    assert history.dt == 12.5e-6
    assert blow.set == pytest.approx(SET, rel=2e-4)
    assert blow.blows_per_metre == pytest.approx(85.815, rel=2e-4)
    assert blow.head.force.max() == pytest.approx(4009.85e3, rel=2e-3)
    assert blow.transferred_energy == pytest.approx(37_201.7, rel=2e-3)
    assert blow.peak_compression.force == pytest.approx(4093.8e3, rel=2e-3)
    assert blow.peak_compression.stress == pytest.approx(25.59e6, rel=2e-3)
    assert blow.peak_compression.x == pytest.approx(5.5, abs=1e-6)
    assert blow.peak_tension.force == pytest.approx(1111.4e3, rel=5e-3)
    assert blow.peak_tension.x == pytest.approx(11.5, abs=1e-6)
    t = np.linspace(0.0, 0.1, 40_001)
    assert history.evaluate(t, "displacement:pile@20").max() == pytest.approx(14.653e-3, rel=2e-4)
    # The waves in the delays are all of the energy: nothing but soil and cushions takes any.
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12
    assert {each.code for each in history.warnings} == {"integrator_unused"}


def test_its_step_solves_each_contact_alone(blow: piling.Blow) -> None:
    """Nodes a step or more apart; the helmet lies between two contacts."""
    history = il.run(pile(1e-4, duration=1e-3))
    coupled = [contact.coupled for contact in history.assembly.contacts]
    assert coupled[:2] == [2, 2]
    assert set(coupled[2:]) == {1}


def test_the_case_method_on_its_head_signals(blow: piling.Blow) -> None:
    head = blow.head
    found = piling.case_method(
        head.time, head.force, head.velocity, impedance=1.6e6, length=20.0, wave_speed=4000.0, damping=0.4
    )
    assert found.total == pytest.approx(3130.1e3, rel=1e-3)
    assert found.static == pytest.approx(1174.3e3, rel=1e-3)
    assert found.largest_static == pytest.approx(1463.5e3, rel=1e-3)


def test_the_bearing_graph() -> None:
    graph = piling.bearing_graph(pile(25e-6), [0.9e6, 1.5e6, 2.5e6, 4.0e6])
    np.testing.assert_allclose(graph.blows_per_metre, [47.409, 85.815, 153.95, 470.28], rtol=5e-4)


def test_blow_after_blow() -> None:
    """Each begins with the waves that the residual forces stand for: at rest they stay."""
    driving = piling.drive(pile(12.5e-6), 8)
    first, last = driving.blows[0], driving.blows[7]
    assert first.head == pytest.approx(11.930e-3, rel=3e-4)
    assert first.toe_force == pytest.approx(56.04e3, rel=3e-3)
    assert (last.head, last.toe) == (pytest.approx(11.794e-3, rel=3e-4), pytest.approx(11.794e-3, rel=3e-4))
    assert last.toe_force == pytest.approx(44.51e3, rel=3e-3)


@pytest.mark.slow
def test_shafts_of_more_pieces_tend_to_one_set() -> None:
    sets = [link(il.run(pile(5e-6, pieces)), "toe").set for pieces in (15, 30, 60, 150)]
    assert sets[3] == pytest.approx(11.6526e-3, rel=2e-5)
    steps = np.abs(np.diff(sets))
    assert steps[0] > steps[1] > steps[2]


def test_the_cost_of_a_step_is_that_of_its_links() -> None:
    """Memory and coefficients of a step grow with the links, the delays hold their waves: a count, not a time."""
    sizes = {}
    for pieces in (50, 100):
        assembly = il.run(pile(12.5e-6, pieces, duration=1e-4)).assembly
        memory, coupled = assembly.memory, sum(contact.coupled for contact in assembly.contacts)
        effects = len(memory.candidates), np.count_nonzero(memory.influence), np.count_nonzero(memory.responses)
        sizes[pieces] = np.array([memory.state.size, *effects, coupled, memory.record.shape[1]])
    assert np.all(sizes[100] <= 2.0 * sizes[50])


def test_a_bare_pile_tends_to_its_exact_solution() -> None:
    """Ram of 5 t at 3 m/s, hard contact; a toe of 1 MN that yields, springs back and holds: of the second order."""
    rod = Rod("pile", (Segment(20.0, 0.16, 40e9, 2500.0),), FREE, FREE)
    bodies = Mass("ram", 5000.0, 3.0), rod, Wall("base")
    laws = AdditionDeletion(), Smith(capacity=1e6, quake=3e-3, tension=False)
    found = []
    for n in (100, 200, 400, 800):
        step = StepRule(dt=5e-3 / n)
        case = in_a_row(bodies, Continuous(), [asked(law) for law in laws], None, step, duration=0.03)
        history = run(*case)
        force, t = "force:pile.right|base", np.arange(4.0e-3, 9e-3, 1e-7)
        yields = t[np.argmax(history.evaluate(t, force) >= 1e6 * (1.0 - 1e-9))]
        opens = next(event.time for event in history.events if event.kind == "open")
        ram = history.evaluate(history.duration, "velocity:ram")
        found.append([history.links[0].set, ram, yields, opens])
    exact = np.array([15.4547221651e-3, 0.122286611935, 5.58317464777e-3, 10e-3])
    errors = np.abs(np.array(found) / exact - 1.0)
    assert np.all(errors[-1] < [2e-6, 2e-6, 1e-3, 5e-4])
    np.testing.assert_allclose(errors[0, :2] / errors[-1, :2], 64.0, rtol=0.3)  # eight times finer
    np.testing.assert_allclose(errors[0, 3] / errors[-1, 3], 8.0, rtol=0.1)  # an instant within a step


@pytest.mark.parametrize(("dt", "bound"), [(1e-6, 2e-4), (0.25e-6, 2e-5)])
def test_a_specimen_that_yields_between_two_bars(dt: float, bound: float) -> None:
    rise = specimen.YOUNG * specimen.TANGENT / (specimen.YOUNG - specimen.TANGENT)
    table = {"strain": [0.0, 0.1, 1.0], "stress": [specimen.YIELD, specimen.YIELD + 0.1 * rise, specimen.YIELD + rise]}
    history = hopkinson(table, dt)
    arrival = 1.5 / specimen.C
    times = arrival + np.array([5e-6, 20e-6, 50e-6, 99e-6])
    exact = [specimen.exact(t - arrival) for t in times]
    np.testing.assert_allclose(history.evaluate(times, "force:specimen"), exact, rtol=bound)
    gap = history.evaluate(arrival + 100e-6, "gap:incident.right|transmitted.left")
    assert -gap == pytest.approx(0.781339604e-3, rel=bound)
    assert link(history, "specimen").set == pytest.approx(0.754483097e-3, rel=bound)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12
    # The gauge in the middle of the incident bar: 1200 microstrain, and the pulse lasts 100 us.
    strain = history.evaluate(0.75 / specimen.C + np.array([10e-6, 90e-6]), "strain:incident@0.75")
    np.testing.assert_allclose(strain, 1.2e-3, rtol=1e-9)


def test_the_rate_of_johnson_and_cook_settles() -> None:
    history = hopkinson(specimen.JOHNSON_COOK, 0.25e-6)
    t = 1.5 / specimen.C + np.array([60e-6, 90e-6])
    np.testing.assert_allclose(history.evaluate(t, "force:specimen") / specimen.SECTION, 344.0369e6, rtol=1e-6)
    gaps = history.evaluate(t, "gap:incident.right|transmitted.left")
    assert (gaps[0] - gaps[1]) / 30e-6 / specimen.LENGTH == pytest.approx(1539.91, rel=5e-6)


def hopkinson(flow: dict[str, object], dt: float) -> AbstractHistory:
    law = {
        "kind": "specimen",
        "length": specimen.LENGTH,
        "area": specimen.SECTION,
        "young": specimen.YOUNG,
        "flow": flow,
    }
    bar = {"area": specimen.AREA, "material": specimen.STEEL}
    case = il.Case(
        bodies={
            "striker": il.Rod(length=0.25, velocity=12.0, **bar),
            "incident": il.Rod(length=1.5, **bar),
            "transmitted": il.Rod(length=1.5, **bar),
        },
        contacts=[
            il.Contact("striker.right", "incident.left", {"kind": "energy_conserving"}),
            il.Contact("incident.right", "transmitted.left", law, name="specimen"),
        ],
        solve={"duration": 480e-6, "model": {"kind": "continuous"}, "step": {"dt": dt}},
        probes=[{"body": "incident", "at": 0.75, "quantity": "strain"}],
    )
    return il.run(case)


def test_a_drill_string_with_couplings_as_segments() -> None:
    """Hammer, three rods with thick couplings between them, rock; by delays and by a mesh with c dt = h."""
    rod, coupling = (1.0, 1e-3), (0.1, 2e-3)  # m, m2
    pieces = [rod, coupling, rod, coupling, rod]
    material = {"young": 2e11, "density": 8000.0}

    def case(model: dict[str, object], **step: object) -> il.Case:
        return il.Case(
            bodies={
                "hammer": il.Rod(length=0.5, area=1e-3, material=material, velocity=10.0),
                "string": il.Rod(segments=[{"length": x, "area": a, "material": material} for x, a in pieces]),
                "rock": il.Wall(),
            },
            contacts=[
                il.Contact("hammer.right", "string.left", {"kind": "energy_conserving"}),
                il.Contact(
                    "string.right",
                    "rock",
                    {"kind": "bilinear", "stiffness": 5e7, "unloading_stiffness": 5e8},
                    name="rock",
                ),
            ],
            solve={"duration": 4e-3, "model": model, **step},
        )

    found = [drill_blow(case({"kind": "continuous"}, step={"dt": dt})) for dt in (2e-6, 1e-6, 0.5e-6)]
    # 200 J go into the rock or stay in hammer and string.
    for each in found:
        assert each.work + each.left_in_hammer + each.left_in_rods == pytest.approx(200.0, rel=1e-5)
        assert max(each.history.energy.largest_gain, each.history.energy.largest_loss) < 1e-12
    np.testing.assert_allclose([each.work for each in found], found[2].work, rtol=1e-3)  # a contact opens by steps
    meshes = {
        name: {"kind": "finite_element", "elements": n, "mass": "lumped"}
        for name, n in (("hammer", 500), ("string", 3200))
    }
    other = drill_blow(
        case(meshes["string"], models=meshes, integrator={"kind": "central_difference"}, step={"dt": 0.2e-6}).with_(
            "contacts.0.law", {"kind": "addition_deletion"}
        )
    )
    assert found[2].work == pytest.approx(other.work, rel=2e-3)
    assert found[2].deepest == pytest.approx(other.deepest, rel=1e-3)


def test_a_clamp_of_no_stiffness_leaves_the_pile_as_it_was() -> None:
    """Inner links that hold nothing: the chain of delays is the uniform delay line, where its transit is whole."""
    rod = Rod("pile", (Segment(20.0, 0.16, 40e9, 2500.0),), FREE, End("mass", 300.0))
    ram, toe = Mass("ram", 5000.0, 3.0), Wall("base")
    cushion, soil = (
        Bilinear(stiffness=6e8, restitution=0.5),
        Smith(capacity=1e6, quake=3e-3, damping=0.3, tension=False),
    )
    plain = in_a_row((ram, rod, toe), Continuous(), (cushion, soil), None, StepRule(dt=2.5e-5), duration=0.03)
    ground = Point("ground", 0.0, "ground")
    places = [Contact(Point("pile", x, f"pile.at({x})"), ground, 0.0) for x in (4.0, 9.0, 13.0)]
    weak = dataclasses.replace(soil, capacity=1e-9)
    held = simulation(
        "held",
        {**plain.scene.bodies, "ground": Wall("ground")},
        [*plain.scene.contacts, *places],
        0.03,
        model=Continuous(),
        law=[cushion, soil, weak, weak, weak],
        step=StepRule(dt=2.5e-5),
    )
    one, other = run(*plain), run(*held)
    t = np.linspace(0.0, 0.03, 500)
    for channel in ("force:ram|pile.left", "force:pile.right|base", "displacement:pile@0", "displacement:pile@20"):
        values = one.evaluate(t, channel)
        np.testing.assert_allclose(other.evaluate(t, channel), values, atol=1e-9 * np.abs(values).max())
    for at, quantity in itertools.product((0.004, 0.02), ("stress", "displacement")):
        x = np.linspace(0.1, 19.9, 57)
        ours, theirs = (each.field("pile", at, quantity, x).values for each in (other, one))
        np.testing.assert_allclose(ours, theirs, atol=1e-8 * np.abs(theirs).max())


@pytest.mark.slow
def test_a_pile_with_all_its_links_tends_to_the_solution_from_event_to_event() -> None:
    """With `rule: viscous`, which has an exact answer: seventeen links and cushions, of the second order."""
    case = il.load_case("smith_pile").with_("solve", {"duration": 0.012, "model": {"kind": "continuous"}})
    for number in (2, 3):
        case = case.with_(f"contacts.{number}.law.rule", "viscous").with_(f"contacts.{number}.law.damping", 0.1)
    answer = il.run(case)
    assert answer.dt is None
    t, off = np.linspace(0.0, 0.012, 400), []
    for dt in (5e-5, 2.5e-5, 1.25e-5):
        history = il.run(case.with_("solve.step", {"dt": dt}))
        ends = [
            history.evaluate(t, f"displacement:pile@{x}") - answer.evaluate(t, f"displacement:pile@{x}")
            for x in (0, 20)
        ]
        sets = [abs(link(history, name).set - link(answer, name).set) for name in ("shaft", "toe")]
        off.append([*np.abs(ends).max(axis=1), *sets])
    scale = link(answer, "toe").set
    assert np.all(np.array(off[-1]) < 5e-5 * scale)
    rates = np.array(off[0]) / off[-1]
    assert np.all(rates[:2] > 8.0)
