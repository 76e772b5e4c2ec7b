"""Results of links: sets, extreme forces, losses, sums by name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from impactlab.exact.results.branch_energies import BranchContact
from impactlab.exact.results.signals import Signal, Signals, sizes_of
from impactlab.history.base import LinkResult
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from impactlab.types import Array, Ints

POINTS, PER_COEFFICIENT = 9, 4  # in a piece at least, and for each of its coefficients, where extremes are sought first
MAX_MAXIMA = 16  # of these, between whose neighbours the largest is sought further
REFINED, REFINEMENTS = 65, 3  # places in grids in each other: to 1e-12 of a smooth sum
ROUNDING = 1e-12  # of the extreme forces of a link
MAX_PIECES = 20_000  # of a sum, whose extremes are sought in all of them; of more every second, third ...


def named(scene: Scene) -> dict[str, list[str]]:
    """Return the contacts of each name given to several, as to pieces of a shaft."""
    found: dict[str, list[str]] = {}
    for contact in scene.contacts:
        if contact.group:
            found.setdefault(contact.group, []).append(contact.name)
    return found


def total(forces: Sequence[Signal], t: Array) -> Array:
    """Return the sum of forces at times [N], shape of t."""
    return np.asarray(sum((force(t) for force in forces), np.zeros_like(t)))


def extremes(forces: Sequence[Signal], begin: float, until: float) -> tuple[float, float]:
    """Return the largest and the smallest sum of forces [N] between two times [s]."""
    breaks = np.unique(np.concatenate([[begin, until], *(force.stop for force in forces)]))
    breaks = breaks[(breaks >= begin) & (breaks <= until)]
    if len(breaks) > MAX_PIECES:
        breaks = np.append(breaks[: -1 : len(breaks) // MAX_PIECES + 1], breaks[-1])
    if len(breaks) < 2:
        value = float(total(forces, np.array([until]))[0])
        return value, value
    slack = 2.0 * forces[0].tolerance  # a value at a break is that after it
    width = np.maximum(np.diff(breaks) - slack, 0.0)
    middle = 0.5 * (breaks[1:] + breaks[:-1])
    sizes = np.max([sizes_of(force.table)[force.pieces(middle)] for force in forces], axis=0)
    points = np.maximum(POINTS, PER_COEFFICIENT * sizes)  # a long piece may hold ten periods of an oscillation
    last = np.cumsum(points) - 1
    piece = np.repeat(np.arange(len(points)), points)
    places = np.arange(last[-1] + 1) - (last - points + 1)[piece]
    t = breaks[:-1][piece] + width[piece] * (0.5 - 0.5 * np.cos(np.pi * places / (points[piece] - 1)))
    values = total(forces, t)
    every = np.arange(t.size)
    before, after = np.where(places > 0, every - 1, every), np.where(places < points[piece] - 1, every + 1, every)
    return _refined(forces, t, values, before, after, 1.0), -_refined(forces, t, -values, before, after, -1.0)


def _refined(forces: Sequence[Signal], t: Array, values: Array, before: Ints, after: Ints, sign: float) -> float:
    """Return the largest value, refined between neighbours of the largest maxima.

    Maxima are those in pieces. ``before`` and ``after`` are the numbers of the neighbours in the same piece; an end of
    it is its own.
    """
    most = float(values.max())
    tops = np.flatnonzero((values >= values[before]) & (values >= values[after]))
    tops = tops[np.argsort(-values[tops], kind="stable")[:MAX_MAXIMA]]
    low, high, rows = t[before[tops]], t[after[tops]], np.arange(tops.size)
    for _ in range(REFINEMENTS if tops.size else 0):
        fine = np.linspace(low, high, REFINED, axis=1)
        found = sign * total(forces, fine.ravel()).reshape(fine.shape)
        most = max(most, float(found.max()))
        best = np.clip(np.argmax(found, axis=1), 1, REFINED - 2)
        low, high = fine[rows, best - 1], fine[rows, best + 1]
    return most


def link_results(
    scene: Scene, method: Method, signals: Signals, numbers: dict[str, int], begin: float, until: float
) -> Iterator[LinkResult]:
    """Yield the results of each link between two times [s].

    Links of one name give one result. ``numbers`` are those of the contacts in the network, by name. Sets are those at
    the later time.
    """
    ends = np.array([begin, until])
    links = [contact for contact in scene.contacts if method.laws[contact.name].two_sided]
    names = [contact.shared_name for contact in links]
    for name in dict.fromkeys(names):
        own = [contact.name for contact, other in zip(links, names, strict=True) if other == name]
        sets: list[float | None] = []
        loss = 0.0
        for contact in own:
            law = method.laws[contact]
            branches = law.branches()
            if branches is None or branches.rigid:
                sets.append(None)
                continue
            states = BranchContact(signals, numbers[contact])
            sets.append(law.set_of((float(states.sets(ends)[1]), 0.0, 0.0)))
            loss += float(np.diff(states.lost(ends))[0])
        largest, smallest = extremes([signals.force(numbers[contact]) for contact in own], begin, until)
        rounding = ROUNDING * max(abs(largest), abs(smallest))
        largest, smallest = (0.0 if abs(force) <= rounding else force for force in (largest, smallest))
        known = [each for each in sets if each is not None]
        most = max(known, default=None, key=abs)
        yield LinkResult(name, len(own), most, largest, smallest, loss, tuple(sets))


def followed(earlier: tuple[LinkResult, ...], later: tuple[LinkResult, ...]) -> tuple[LinkResult, ...]:
    """Return the results of two periods, one after the other, as one."""
    if not earlier:
        return later
    return tuple(
        new._replace(
            largest=max(old.largest, new.largest), smallest=min(old.smallest, new.smallest), loss=old.loss + new.loss
        )
        for old, new in zip(earlier, later, strict=True)
    )
