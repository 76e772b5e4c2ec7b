"""Rows of rods, masses, cushions and walls on the continuous model: momentum, energy, mirror, units."""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import StepError
from impactlab.exact import solve as exact
from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.results.thinned import ThinnedHistory
from impactlab.history import AbstractHistory
from impactlab.history.arrivals import first_arrivals
from impactlab.models.continuous import Continuous
from impactlab.scene import Body, Contact, End, Mass, Point, Rod, Scene, Segment, Wall
from impactlab.scene.method import Simulation
from impactlab.testing.scenes import simulation
from impactlab.testing.strategies import log_uniform, mirrored

pytestmark = pytest.mark.slow
quick = settings(max_examples=15, deadline=None, print_blob=True)


def pieces() -> st.SearchStrategy[Segment]:
    """Return uniform pieces of like size, of any ratio of travel times: E and rho about 1."""
    return st.builds(
        Segment,
        length=log_uniform(0.3, 3.0),
        area=log_uniform(0.2, 5.0),
        young=log_uniform(0.2, 5.0),
        density=log_uniform(0.2, 5.0),
    )


@st.composite
def rows(draw: st.DrawFn, most: int = 5, held: bool = True, gravity: bool = True) -> Simulation:
    """Return bodies in a row, each with a contact to the next: rods of one to three pieces, masses, walls at the ends.

    Neighbours that are both masses meet through a spring, the others through a spring or hard. With ``held`` the row
    may end at walls, and the outer ends of its rods may be clamped or viscous.
    """
    kinds = draw(st.lists(st.sampled_from(["rod", "mass"]), min_size=1, max_size=most).filter(lambda k: "rod" in k))
    bodies: list[Body] = []
    for number, kind in enumerate(kinds):
        velocity = draw(st.sampled_from([0.0, 0.0, 1.0, -1.0, 0.37]))
        if kind == "mass":
            bodies.append(Mass(f"m{number}", draw(log_uniform(0.1, 10.0)), velocity))
        else:
            parts = tuple(draw(st.lists(pieces(), min_size=1, max_size=3)))
            bodies.append(Rod(f"r{number}", parts, End("free"), End("free"), velocity))
    if held:
        bodies = [_ended(draw, bodies[0], "left"), *bodies[1:]]
        bodies = [*bodies[:-1], _ended(draw, bodies[-1], "right")]
        if _bare(bodies[0], "left") and draw(st.booleans()):
            bodies.insert(0, Wall("left"))
        if _bare(bodies[-1], "right") and draw(st.booleans()):
            bodies.append(Wall("right"))
    contacts, laws = [], []
    for left, right in pairwise(bodies):
        soft = (left.elastic is None and right.elastic is None) or draw(st.booleans())
        law: AbstractContactLaw = WaveIdentification()
        if soft:
            law = Penalty(stiffness=draw(log_uniform(0.3, 30.0)), damping=draw(st.sampled_from([0.0, 0.0, 0.4])))
        gap = draw(st.sampled_from([0.0, 0.1, 1.0 / 3.0]))
        contacts.append(Contact(_face(left, "right"), _face(right, "left"), gap))
        laws.append(law)
    g = draw(st.sampled_from([0.0, 0.05, -0.05])) if gravity else 0.0
    named = {body.name: body for body in bodies}
    return simulation("row", named, contacts, 12.0, model=Continuous(), law=laws, gravity=g)


def _ended(draw: st.DrawFn, body: Body, side: str) -> Body:
    """Return a body whose outer end may be held, if it is a rod."""
    if body.waves is None:
        return body
    kind = draw(st.sampled_from(["free", "clamped", "dashpot"]))
    end = {"free": End("free"), "clamped": End("clamped"), "dashpot": End("dashpot", draw(log_uniform(0.1, 10.0)))}[
        kind
    ]
    # a clamped end does not move with its rod
    velocity = 0.0 if kind == "clamped" else body.velocity
    held: dict[str, Any] = {side: end, "velocity": velocity}
    return dataclasses.replace(body, **held)


def _bare(body: Body, side: str) -> bool:
    return body.waves is not None and getattr(body, side).kind == "free"


def _face(body: Body, side: str) -> Point:
    if body.elastic is None:
        return Point(body.name, 0.0, body.name)
    return Point(body.name, 0.0 if side == "left" else body.length, f"{body.name}.{side}")


def momentum_scale(scene: Scene) -> float:
    """Return the momentum that a row may hold [N s]: masses times the largest velocity that is met."""
    masses = sum(body.moving_mass for body in scene.bodies.values() if body.moves)
    return masses * (1.0 + abs(scene.gravity) * scene.duration) * math.sqrt(2.0)


def momentum(history: AbstractHistory, scene: Simulation, t: np.ndarray) -> np.ndarray:
    """Return the momentum of all bodies, shape of t."""
    names = [name for name, body in scene.scene.bodies.items() if not isinstance(body, Wall)]
    return np.sum([history.evaluate(t, f"momentum:{name}") for name in names], axis=0)


def solved(scene: Simulation) -> AbstractHistory:
    """Return the history of a row; rows that the solver refuses for the memory of their fronts are left out.

    Every front is split at each step and each contact: a few rows of stepped rods pass any bound of memory.
    """
    try:
        return exact.solve(*scene)
    except StepError as error:
        assume("the wave fronts within one round trip" not in str(error))
        raise


@quick
@given(rows())
def test_energy_of_a_row_is_kept_or_booked(scene: Simulation) -> None:
    history = solved(scene)
    book = history.energy
    # some hundred pieces, each rounded at the reference energy
    stake = max(1.0, *(float(np.max(np.abs(energy))) for energy in (*book.bodies.values(), book.work)))
    assert max(book.largest_gain, book.largest_loss) * book.scale < 1e-11 * stake
    for loss in book.booked.values():
        assert np.min(np.diff(loss)) >= -1e-12 * stake
    for span in history.contacts:
        assert span.impulse >= 0.0


@quick
@given(rows())
def test_no_contact_closes_before_its_first_arrival(scene: Simulation) -> None:
    """Stepped runs leave out touches before it: it may not be later than the exact closing."""
    history = solved(scene)
    assume(isinstance(history, ContinuousHistory))  # which keeps the events before those by rounding are left out
    arrivals = first_arrivals(*scene)
    for event in history.dated:
        assert event.time >= arrivals[event.contact] * (1.0 - 1e-9)


@quick
@given(rows(held=False))
def test_a_row_that_nothing_holds_keeps_its_momentum(scene: Simulation) -> None:
    t = np.linspace(0.0, scene.scene.duration, 13)
    whole = momentum(solved(scene), scene, t)
    weight = scene.scene.gravity * sum(body.mass for body in scene.scene.bodies.values() if not isinstance(body, Wall))
    assert whole == pytest.approx(whole[0] + weight * t, abs=1e-11 * momentum_scale(scene.scene))


@quick
@given(rows(), st.floats(0.01, 0.99))
def test_mirrored_row_mirrored_motion(scene: Simulation, share: float) -> None:
    one, other = solved(scene), solved(mirrored(scene))
    assume(not isinstance(one, ThinnedHistory) and not isinstance(other, ThinnedHistory))  # no displacements inside
    for name, body in scene.scene.bodies.items():
        if isinstance(body, Rod):
            x = share * body.length
            t = np.linspace(0.0, 6.0, 25) + 0.0123
            seen = one.evaluate(t, f"displacement:{name}@{x!r}")
            there = other.evaluate(t, f"displacement:{name}@{body.length - x!r}")
            # a force that grazes zero may end a contact in one and not in the other; little follows from that
            assert seen == pytest.approx(-there, abs=1e-8)
