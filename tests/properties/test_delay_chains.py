"""Random rods of several segments with contacts at inner places, as chains of delays and from event to event."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.penalty import Penalty
from impactlab.exact.solve import solve
from impactlab.models.base import Face
from impactlab.models.continuous import Continuous
from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.scene import Contact, End, Mass, Rod, Segment, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import face, simulation
from tests.reference.stepped_laws import asked

UNIT = 1.0  # s, transits are whole multiples of it
FINE = 48  # steps in it


class Struck(NamedTuple):
    """A rod of segments, each of a whole transit, struck by a mass at one node and held by a spring at another."""

    transits: list[int]
    impedances: list[float]
    at: int  # transits from the left end to the struck place
    held: int  # and to the spring
    mass: float
    stiffness: float
    damping: float
    ends: tuple[End, End]
    direction: float
    hard: bool
    gravity: float


@st.composite
def struck(draw: Any) -> Struck:
    count = draw(st.integers(1, 3))
    transits = draw(st.lists(st.integers(2, 5), min_size=count, max_size=count))
    number = st.floats(0.4, 2.5)
    impedances = draw(st.lists(number, min_size=count, max_size=count))
    at = draw(st.integers(0, sum(transits)))
    held = draw(st.integers(0, sum(transits)).filter(lambda place: place != at))
    kinds = [End("free"), End("spring", draw(number)), End("dashpot", draw(number)), End("mass", draw(number))]
    hard = draw(st.booleans())
    ends = [draw(st.sampled_from(kinds)), draw(st.sampled_from(kinds))]
    for end, place in enumerate((0, sum(transits))):
        if hard and at == place:  # two masses that meet have no one answer
            ends[end] = End("free")
    # At an end the partner stands beyond it, inside on either side.
    direction = 1.0 if at == 0 else -1.0 if at == sum(transits) else draw(st.sampled_from([1.0, -1.0]))
    return Struck(
        transits, impedances, at, held, draw(st.floats(0.5, 8.0)), draw(number), draw(st.floats(0.0, 1.0)),
        (ends[0], ends[1]), direction, hard, draw(st.sampled_from([0.0, 0.0, 0.02, -0.02])),
    )  # fmt: skip


def scene(given: Struck, step: float, stepped: bool, mirrored: bool = False) -> Simulation:
    # Wave speed 1 and density Z: lengths are transits.
    pieces = [Segment(float(t), 1.0, z, z) for t, z in zip(given.transits, given.impedances, strict=True)]
    length = sum(given.transits)
    at, held = (length - given.at, length - given.held) if mirrored else (given.at, given.held)
    ends = given.ends[::-1] if mirrored else given.ends
    direction = -given.direction if mirrored else given.direction
    body = Rod("rod", tuple(pieces[::-1] if mirrored else pieces), *ends)
    hammer, ground = Mass("hammer", given.mass, direction), Wall("ground")
    # On the grid, but not at the instant at which fronts set out.
    first, second = (face(hammer), face(body, float(at))), (face(body, float(held)), face(ground))
    # A spring that presses where the rod goes the way of the hammer.
    first, second = (first, second) if direction > 0.0 else (first[::-1], second[::-1])
    laws = [AdditionDeletion() if given.hard else Penalty(4.0, 0.5), Penalty(given.stiffness, given.damping)]
    if stepped:
        laws = [asked(each) for each in laws]
    contacts = [Contact(*first, 0.3), Contact(*second, 0.0)]
    bodies = {"hammer": hammer, "rod": body, "ground": ground}
    duration = 3.0 * length
    gravity = -given.gravity if mirrored else given.gravity
    rule = StepRule(dt=step)
    return simulation("struck", bodies, contacts, duration, model=Continuous(), law=laws, step=rule, gravity=gravity)


@settings(max_examples=20, deadline=None)
@given(struck())
def test_they_agree_with_the_exact_solver(given: Struck) -> None:
    """Up to the second touch, under a hard contact to its opening: faces that just miss each other may graze."""
    answer = solve(*scene(given, UNIT, stepped=False))
    name = answer.scene.contacts[0].name
    changes = [event.time for event in answer.events if event.contact == name]
    known = 1 if given.hard else 2  # close, open, close
    t = np.linspace(0.0, changes[known] if len(changes) > known else answer.duration, 200)
    coarse, fine = (run(*scene(given, UNIT / n, stepped=True)) for n in (FINE / 8, FINE))
    worst = []
    for history in (coarse, fine):
        assert history.energy.largest_gain < 1e-11
        off = [
            np.abs(history.evaluate(t, channel) - answer.evaluate(t, channel)).max()
            for channel in (f"displacement:rod@{given.at}", f"displacement:rod@{given.held}", "position:hammer")
        ]
        worst.append(max(off))
    # The speed of the hammer is 1: an instant is wrong by a step at most, a front is spread over one at each node.
    assert worst[1] < 1.5 * UNIT / FINE
    assert worst[1] < max(0.5 * worst[0], 0.02 * UNIT / FINE)


@settings(max_examples=20, deadline=None)
@given(struck())
def test_the_mirrored_scene_has_the_mirrored_solution(given: Struck) -> None:
    one, other = (run(*scene(given, UNIT / 5, stepped=True, mirrored=seen)) for seen in (False, True))
    length, t = sum(given.transits), np.linspace(0.0, one.duration, 50)
    for x, twin in ((given.at, length - given.at), (given.held, length - given.held)):
        ours, theirs = one.evaluate(t, f"displacement:rod@{x}"), other.evaluate(t, f"displacement:rod@{twin}")
        assert -theirs == pytest.approx(ours, abs=1e-11)


@settings(max_examples=20, deadline=None)
@given(struck(), st.floats(0.11, 0.19))
def test_momentum_given_is_momentum_taken(given: Struck, step: float) -> None:
    """At any step, whatever places move: by the forces of the contacts, with ends that hold nothing."""
    free = tuple(end if end.kind in ("free", "mass") else End("free") for end in given.ends)
    history = run(*scene(given._replace(ends=free), step, stepped=True))
    scale = given.mass
    changes = {}
    for body in ("rod", "hammer"):
        momentum = history.recorded[f"momentum:{body}"].values
        changes[body] = momentum[-1] - momentum[0]
    first, second = (record.total for record in history.assembly.contacts)  # up to the end of the last step
    rod = history.scene.bodies["rod"]
    fallen = given.gravity * history.assembly.clock.time
    assert changes["hammer"] == pytest.approx(given.mass * fallen - given.direction * first, abs=1e-11 * scale)
    pushed = given.direction * (first - second)
    assert changes["rod"] == pytest.approx(rod.moving_mass * fallen + pushed, abs=1e-11 * scale)
    assert history.energy.largest_gain < 1e-11
    if isinstance(history.built["rod"].model, DelayChain):
        assert history.energy.largest_loss < 1e-11


@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.05, 2.0), st.floats(0.3, 3.0)), min_size=1, max_size=4),
    st.lists(st.floats(0.01, 0.99), max_size=5),
    st.floats(0.05, 1.0),
)
def test_places_move_by_half_a_cell_at_most_and_the_mirrored_rod_has_the_mirrored_grid(
    pieces: list[tuple[float, float]], places: list[float], share: float
) -> None:
    """Wave speeds of the segments differ; the step is any up to the longest, not one that fits."""
    segments = tuple(Segment(length, 1.0, speed**2, 1.0) for length, speed in pieces)
    chains = []
    for mirrored in (False, True):
        body = Rod("rod", segments[::-1] if mirrored else segments, End("free"), End("free"))
        struck = [(1.0 - x if mirrored else x) * body.length for x in places]
        chains.append(DelayChain(body, 0.0, tuple(Face(x, 0, 1.0) for x in struck)))
    one = chains[0]
    dt = share * one.longest_step
    cells, twins = ([piece.cells for piece in chain.pieces(dt)] for chain in chains)
    ends = np.cumsum([0, *cells])
    times = np.interp(one.places, np.cumsum([0.0, *(s.length for s in segments)]), transits(segments))
    moved = (ends - 0.5 * ends[-1]) * dt - (times - 0.5 * times[-1])
    assert np.abs(moved).max() <= 0.5 * dt * (1.0 + 1e-6)
    assert one.misfit(dt) >= np.abs(moved).max() / times[-1] * (1.0 - 1e-6) - 1e-12
    assert min(cells) >= 1
    if np.abs(times - 0.5 * times[-1]).min() > 1e-6 * dt:  # a place in the middle has two nearest cells, or one
        assert twins[::-1] == cells


def transits(segments: tuple[Segment, ...]) -> list[float]:
    return [0.0, *np.cumsum([each.length / each.wave_speed for each in segments]).tolist()]
