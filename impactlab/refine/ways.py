"""Descriptions of rods and rigid bodies that converge to the exact solution, each refined by one number."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Literal, NamedTuple

from impactlab.refine.contact_times import rise_time
from impactlab.refine.described import without_places
from impactlab.refine.descriptions import (
    as_adaptive_bodies,
    as_delay_line,
    as_implicit_mesh,
    as_lumped_mesh,
    as_rigid_bodies,
    is_special,
)
from impactlab.scene.facts import is_a_delay_line, is_coupled, rods_of, shortest_transit, split_at_contacts
from impactlab.scene.method import Simulation, force_jumps, laws_of

COARSEST = 50  # elements, or steps in the shortest transit
TIGHTER = 4.0  # the tolerance of adaptive steps falls as fineness to minus this
STIFF = 20.0  # times the expected number of adaptive steps: a damping that needs more of them is none for such steps


class Way(NamedTuple):
    """A description that can be refined: its words, the scene at a fineness, and the seconds that this will take."""

    words: str
    run: Callable[[int], Simulation]
    seconds: Callable[[int], float]
    order: float = 2.0  # of displacements and impulses in the fineness, at most


def rod_ways(asked: Simulation) -> Iterator[Way]:
    """Give the descriptions that may serve a scene of rods and rigid bodies, the best first."""
    scene = split_at_contacts(asked.scene)
    asked = Simulation(scene, asked.method)
    rods = rods_of(scene)
    if not rods:
        yield from _rigid(asked)
        return
    hard = any(law.hard for law in laws_of(*asked))
    if not hard and is_a_delay_line(scene):
        yield _delay_line(asked, len(rods))
    if hard and not any(is_coupled(rod) for rod in rods):
        yield _explicit(asked, len(rods))
    yield _implicit(asked, len(rods), "consistent")
    yield _implicit(asked, len(rods), "lumped")


def _delay_line(asked: Simulation, rods: int) -> Way:
    scene = asked.scene
    shortest, bare = shortest_transit(scene), Simulation(without_places(scene), asked.method)
    return Way(
        "stepped delay line, steps in the shortest transit:",
        lambda n: as_delay_line(bare, n),
        lambda n: 3e-7 * (1 + rods) * n * scene.duration / shortest,
    )


def _explicit(asked: Simulation, rods: int) -> Way:
    # On a rod of one wave speed, and wherever pieces share their elements by travel time without a remainder, waves go
    # one element in a step: no dispersion.
    scene = asked.scene
    shortest = shortest_transit(scene)
    return Way(
        "lumped mesh at courant 1, elements:",
        lambda n: as_lumped_mesh(asked, n, 1.0),
        lambda n: 6e-9 * rods * n * n * scene.duration / shortest,
        order=2.0 if is_special(scene) else 1.0,  # a front that disperses
    )


def _implicit(asked: Simulation, rods: int, mass: Literal["consistent", "lumped"]) -> Way:
    scene = asked.scene
    shortest = shortest_transit(scene)
    return Way(
        f"{mass} mesh at courant 1/2, elements:",
        lambda n: as_implicit_mesh(asked, n, mass),
        lambda n: 16e-9 * rods * n * n * scene.duration / shortest,
        order=1.0 if force_jumps(*asked) else 2.0,
    )


def _rigid(asked: Simulation) -> Iterator[Way]:
    scene, method = asked
    rises = scene.duration / min(
        (rise_time(scene, method, contact) for contact in scene.contacts), default=scene.duration
    )
    yield Way("rigid bodies, steps:", lambda n: as_rigid_bodies(asked, 20 * n), lambda n: 3e-7 * 20 * n)

    def steps(n: int) -> float:
        return max(10.0, rises) * math.sqrt(n / COARSEST)

    yield Way(
        "adaptive steps between located events, level:",
        lambda n: as_adaptive_bodies(asked, 1e-4 * (COARSEST / n) ** TIGHTER, round(STIFF * steps(n))),
        lambda n: 1e-3 * steps(n),
        order=TIGHTER,
    )
