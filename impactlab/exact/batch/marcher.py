"""A memory, which grows as needed, in which scenes of one pattern march one after another."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from impactlab.exact import march, spring_systems
from impactlab.exact.batch.pattern import Pattern, misfit, numbers_of, pattern_of
from impactlab.exact.batch.points import (
    OF_BODY,
    OF_CONTACT,
    OF_PAIR,
    OF_WHOLE,
    STOPPED,
    WRITTEN,
    Numbers,
    march_points,
    result_arrays,
)
from impactlab.exact.batch.writing import SPRING
from impactlab.exact.setup.build import build
from impactlab.exact.setup.network import Log, with_room
from impactlab.numerics.addresses import entered
from impactlab.scene.method import Simulation
from impactlab.types import Array, Ints

MAX_POOL = 20_000_000  # coefficients of a march, 160 MB; longer ones are runs of their own


class Built(NamedTuple):
    """A scene as its pattern and vector, and its network."""

    pattern: Pattern
    vector: Array
    log: Log


def built(run: Simulation, counted: str, round_trips: float | None) -> Built | None:
    """Return a scene as pattern and vector.

    None where its numbers do not fit into a vector. ``counted`` is the rod whose round trip counts, ``round_trips`` the
    duration where it is given so.
    """
    if misfit(run.scene):
        return None
    layout, log = build(*run)
    pattern = pattern_of(run.scene, layout, log, counted, round_trips is not None)
    return Built(pattern, numbers_of(run.scene, layout, log, round_trips), log)


def prepared(log: Log, pattern: Pattern) -> Log:
    """Return the log ready for marches of all scenes of its pattern."""
    log = march.prepared(log)
    if np.any(np.asarray(pattern.nodes)["support"] == SPRING):  # also where this scene has one of 0 N/m
        log = log._replace(memory=log.memory._replace(coupled=spring_systems.address(log.memory)))
    return log


def parts_of(q: Pattern) -> tuple[tuple[tuple[str, ...], int], ...]:
    """Return the result names by part, with the number of parts.

    Parts are contacts, pairs, moving bodies and the whole.
    """
    moving = int(np.asarray(q.whole)["moving"][0])
    return (OF_CONTACT, len(q.contacts)), (OF_PAIR, len(q.pairs)), (OF_BODY, moving), (OF_WHOLE, 1)


class Marcher:
    """Marches points of a batch in a memory of its own; one for each thread."""

    def __init__(self, run: Simulation, pattern: Pattern, numbers: Numbers) -> None:
        self.log, self.pattern, self.numbers = prepared(build(*run)[1], pattern), pattern, numbers
        self.room = result_arrays(self.log.memory, pattern, numbers)

    @property
    def columns(self) -> int:
        """Number of results of a point."""
        return sum(len(names) * count for names, count in parts_of(self.pattern))

    def results(self, points: Ints, wanted: int) -> tuple[Array, Ints]:
        """Return the results of points, and their states.

        Results have the shape (points, columns); a state is whether a result stands, or why it does not.
        """
        out = np.full((len(points), self.columns), np.nan)
        states = np.zeros(len(points), np.int64)
        done = 0
        while True:
            arguments: Any = (self.log.memory, self.pattern, self.numbers, self.room, points, done, wanted, out, states)
            done = int(entered(march_points, *arguments))
            if done == len(points):
                return out, states
            if 2 * len(self.log.pool) > MAX_POOL:
                states[done] = STOPPED
                done += 1
            else:
                self.grow()

    def grow(self) -> None:
        """Double the memory; the results of a march are lost."""
        log = self.log
        self.log = with_room(log, 2 * log.pieces.shape[1], 2 * len(log.pool), 2 * len(log.events))
        self.room = result_arrays(self.log.memory, self.pattern, self.numbers)

    def network(self, point: int) -> Log:
        """Return the network of a point as it is before its march."""
        self.results(np.array([point]), WRITTEN)
        return self.log


def same_network(made: Log, wanted: Log) -> bool:
    """Return whether two networks before their march have the same bits."""
    for a, b in ((made.nodes, wanted.nodes), (made.ends, wanted.ends), (made.contacts, wanted.contacts)):
        if not all(np.array_equal(a[name], b[name]) for name in COLUMNS if name in (a.dtype.names or ())):
            return False
    if any(made.state[name] != wanted.state[name] for name in STATE):
        return False
    records = wanted.junctions["records"]
    if not np.array_equal(made.junctions["records"], records):
        return False
    pieces = (np.array_equal(made.pieces[j, :n], wanted.pieces[j, :n]) for j, n in enumerate(records.tolist()))
    used = int(wanted.state["pool_used"])
    return all(pieces) and bool(np.array_equal(made.pool[:used], wanted.pool[:used]))


COLUMNS = (
    "mass", "spring", "dashpot", "end_force", "u", "v", "impedance", "transit", "carried", "left", "right", "face",
    "stiffness", "damping", "gap", "closed",
)  # fmt: skip
STATE = ("gravity", "duration", "tolerance", "fastest", "farthest", "pool_used")
