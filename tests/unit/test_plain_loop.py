"""The plain loop takes the same steps as the compiled one: every law, every scheme, every kind of body."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.bilinear import Bilinear
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import LankaraniNikravesh
from impactlab.contact.smith import Smith
from impactlab.errors import CaseError, PairingError, StepError
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.models.continuous.model import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.plugins import INTEGRATORS, LAWS, registry
from impactlab.scene.bodies import End, Mass, Rod, Table, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.scene.problem import Contact, Point
from impactlab.simulate import prepare
from impactlab.simulate.stepping.arrays import SAMPLED
from impactlab.testing.plain_loop import PlainLoop
from impactlab.testing.scenes import CLAMPED, FREE, STEEL, in_a_row, mass_on_rod, simulation, touching
from impactlab.testing.trace import trace
from impactlab.testing.verdict import options_to_try
from impactlab.types import Array

OURS = registry().only("impactlab")
STEPS = 40
ALL = slice(None)
COURANT = StepRule(courant=0.45)
REORDERED = 1e-11  # of the largest value of a kind: sums of a few hundred terms in another order, over 40 steps


def laws(name: str) -> Iterator[AbstractContactLaw]:
    """Give a law with each of its examples, except those that put a gap to zero: its sign then is a rounding's."""
    kind = OURS.load(LAWS, name)
    yield from (kind(**options) for options in options_to_try(kind) if not options.get("projection"))


def schemes() -> list[AbstractIntegrator]:
    kinds = [OURS.load(INTEGRATORS, name) for name in OURS.names(INTEGRATORS)]
    return [kind() for kind in kinds if issubclass(kind, AbstractIntegrator)]


def struck(law: AbstractContactLaw, scheme: AbstractIntegrator, model: AbstractRodModel, end: End) -> Simulation:
    rule = StepRule(dt=2.0 * STEEL.length / STEEL.wave_speed / 41.0) if isinstance(model, Continuous) else COURANT
    return mass_on_rod(model, law, scheme, rule, right=end, mass_ratio=2.0 / STEEL.mass, gap=1.1e-7, round_trips=1.2)


def largest_difference(ours: Array, theirs: Array) -> float:
    size = np.abs(theirs).max(initial=0.0)
    return float(np.abs(ours - theirs).max(initial=0.0) / size) if size > 0.0 else float(np.abs(ours).max(initial=0.0))


def differences(scene: Simulation) -> dict[str, float]:
    """Return by how much the two loops differ in states, replies, events, losses and energies, over the largest."""
    traced, loop = trace(scene), PlainLoop(prepare(*scene))
    steps = min(STEPS, len(traced.forces))
    states, replies, energies = [loop.state.copy()], [], []
    for _ in range(steps):
        loop.step()
        states.append(loop.state.copy())
        replies.append([contact.given for contact in loop.contacts])
        energies.append([loop.energy(name) for name in loop.parts])
    found, n = {}, steps + 1
    for name, part in loop.parts.items():
        dofs = loop.plan.built[name].system.load.size
        for place in (slice(0, dofs), slice(dofs, 2 * dofs), slice(2 * dofs, None)):
            of_body = np.array(states)[:, part][:, place], traced.states[:n, part][:, place]
            found[f"{name} {place.start}"] = largest_difference(*of_body)
    given = np.array(replies)
    for number, values in enumerate((traced.forces, traced.impulses, traced.projections, traced.pushes)):
        found[f"reply {number}"] = largest_difference(given[:, :, number], values[:steps])
    sample = traced.history.assembly.memory.sample[:n]
    lost = np.array([loop.lost[name] for name in ("contact", "ends", "damping", "unresolved")])
    found["lost"] = float(np.abs(lost - sample[-1, 2:6]).max() / sample[0, SAMPLED::3].sum())
    theirs = sample[1:, SAMPLED::3] - sample[1:, SAMPLED + 1 :: 3]
    found["energy"] = largest_difference(np.array(energies), theirs)
    return found


def disagreements(law: AbstractContactLaw, model: AbstractRodModel, every: slice = ALL) -> tuple[int, list[str]]:
    """Return how many schemes, all or some, serve a law on a model, and those under which the two loops differ."""
    served, found = 0, []
    for scheme in schemes()[every]:
        scene = struck(law, scheme, model, CLAMPED)
        try:
            if prepare(*scene).dt is None:
                continue
            far = {name: value for name, value in differences(scene).items() if not value <= REORDERED}
        except (CaseError, PairingError, StepError):  # a pair that is refused, or that gains energy
            continue
        served += 1
        found += [f"{scheme}: {far}"] if far else []
    return served, found


@pytest.mark.parametrize("name", OURS.names(LAWS))
def test_every_law_takes_the_same_steps_with_every_scheme(name: str) -> None:
    """By its first example on a mesh; on modes, and by its other examples, with every second scheme.

    Other examples are other branches of the law, and modes other columns of the scheme: the same under every other.
    """
    served, (first, *others), mesh = 0, laws(name), FiniteElement(6, "lumped")
    turn = OURS.names(LAWS).index(name) % 2
    halves = slice(turn, None, 2), slice(1 - turn, None, 2)  # the second one where the first refuses the law
    examples = [(first, Modal(elements=6, modes=4), halves), *((law, mesh, halves) for law in others)]
    for law, model, tried in ((first, mesh, (ALL,)), *examples):
        number = 0
        for some in tried:
            if number == 0:
                number, found = disagreements(law, model, some)
                assert found == []
        served += number
    assert served > 3


@pytest.mark.slow
@pytest.mark.parametrize("model", [FiniteElement(6), FiniteElement(6, "redistributed"), Continuous()], ids=str)
def test_every_kind_of_rod_takes_the_same_steps(model: AbstractRodModel) -> None:
    """By each law with its first example: the others are other branches of it, on any rod the same."""
    served = 0
    for name in OURS.names(LAWS):
        number, found = disagreements(next(laws(name)), model)
        assert found == []
        served += number
    assert served > 10


@pytest.mark.parametrize(
    "law", [Penalty(1e8, 1e5), Bilinear(1e8, 0.5), LankaraniNikravesh(1e12, restitution=0.3)], ids=str
)
def test_contacts_that_overlap_at_the_start_agree(law: AbstractContactLaw) -> None:
    for scheme in (Newmark(), CentralDifference()):
        scene, method = struck(law, scheme, FiniteElement(6, "lumped"), CLAMPED)
        contact = replace(scene.contacts[0], gap=-2e-6, overlap_allowed=True)
        found = differences(Simulation(replace(scene, contacts=(contact,)), method))
        assert {name: value for name, value in found.items() if not value <= REORDERED} == {}


def test_a_chain_of_delays_takes_the_same_steps() -> None:
    """A rod of two segments, struck at an end and held by soil inside and at its far end, where a mass rides."""
    thick = replace(STEEL, length=0.2, area=1.5e-3)
    rod = Rod("rod", (STEEL, thick), FREE, End("mass", 0.4), displacement=Table((0.0, 0.5), (0.0, 1e-6)))
    bodies = {"hammer": Mass("hammer", 1.0, 1.0), "rod": rod, "wall": Wall("wall")}
    soil, wall = Smith(capacity=2e4, quake=1e-6, damping=0.2), Point("wall", 0.0, "wall")
    contacts = [touching(bodies["hammer"], rod, 1.1e-7)]
    contacts += [Contact(Point("rod", x, f"rod.at({x})"), wall, 0.0) for x in (0.1, 0.31, 0.5)]
    laws = [Penalty(stiffness=1e9), soil, soil, soil]
    step = StepRule(dt=6.1e-7)
    scene = simulation("chain", bodies, contacts, 4e-5, model=Continuous(), law=laws, step=step)
    assert isinstance(prepare(*scene).built["rod"].model, DelayChain)
    assert max(differences(scene).values()) < REORDERED


@pytest.mark.parametrize("scheme", [CentralDifference(), Newmark(), Newmark(1.0 / 12.0), Newmark(0.3, 0.6)], ids=str)
def test_losses_of_dashpots_and_events_are_those_of_the_compiled_loop(scheme: AbstractIntegrator) -> None:
    scene = struck(Penalty(damping=2e3), scheme, FiniteElement(6, "lumped"), End("dashpot", 2e4))
    assert max(differences(scene).values()) < REORDERED
    loop, history = PlainLoop(prepare(*scene)), trace(scene).history
    for _ in range(loop.plan.steps):
        loop.step()
    assert loop.lost["ends"] > 1e-3
    assert [kind for _, _, kind in loop.events] == [event.kind for event in history.events]
    assert [time for time, _, _ in loop.events] == pytest.approx([event.time for event in history.events], rel=1e-9)


def test_contacts_that_depend_on_each_other_agree() -> None:
    model, law = FiniteElement(5, "lumped"), Penalty(damping=1e3)
    rods = [Rod(name, (STEEL,), FREE, FREE) for name in ("a", "b")]
    scene = in_a_row((Mass("hammer", 2.0, 1.0), *rods), model, law, Newmark(), StepRule(courant=2.0), duration=1e-4)
    assert max(differences(scene).values()) < REORDERED


def test_hooks_see_the_ports_and_may_rewrite_columns_and_state() -> None:
    scene, seen = struck(Penalty(), Midpoint(), FiniteElement(6), CLAMPED), []

    def before(loop: PlainLoop) -> None:
        seen.append(loop.contacts[0].port.free_gap)
        loop.contacts[0].columns[:] *= 2.0  # twice the compliance

    def after(loop: PlainLoop) -> None:
        seen.append(loop.contacts[0].reply.force)
        loop.state[loop.parts["rod"]] = 0.0

    hooked, plain = PlainLoop(prepare(*scene), before, after), PlainLoop(prepare(*scene))
    hooked.step()
    plain.step()
    assert hooked.contacts[0].port.gap_per_force == pytest.approx(2.0 * plain.contacts[0].port.gap_per_force)
    assert seen == [plain.contacts[0].port.free_gap, hooked.contacts[0].reply.force]
    assert not hooked.state[hooked.parts["rod"]].any()


def test_steps_that_are_cut_at_events_are_refused() -> None:
    scene, method = struck(Penalty(), Midpoint(), FiniteElement(6), CLAMPED)
    with pytest.raises(CaseError, match="whole steps"):
        PlainLoop(prepare(scene, replace(method, events="located")))
