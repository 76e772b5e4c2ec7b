"""Results of the links of a solved network: sets, extreme forces, loss; sums of forces of one name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from impactlab.exact.branch_energies import BranchContact
from impactlab.exact.signals import Signal, Signals
from impactlab.history.base import LinkResult
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from impactlab.types import Array

POINTS = 9  # in a piece, at which extremes of a sum are sought first
REFINED = 65  # between the neighbours of the best of them, three times: to 1e-12 of a smooth sum
ROUNDING = 1e-12  # of the extreme forces of a link
MAX_PIECES = 20_000  # of a sum, whose extremes are sought in all of them; of more every second, third ...


def named(scene: Scene) -> dict[str, list[str]]:
    """Return the contacts of each name given to several, such as the pieces of a shaft."""
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
    breaks = breaks[:: len(breaks) // MAX_PIECES + 1]
    if len(breaks) < 2:
        value = float(total(forces, np.array([until]))[0])
        return value, value
    slack = 2.0 * forces[0].tolerance  # a value at a break is that after it
    width = np.maximum(np.diff(breaks) - slack, 0.0)
    shares = 0.5 - 0.5 * np.cos(np.pi * np.arange(POINTS) / (POINTS - 1))
    t = (breaks[:-1, None] + width[:, None] * shares).ravel()
    values = total(forces, t)
    return _refined(forces, t, values, 1.0), -_refined(forces, t, -values, -1.0)


def _refined(forces: Sequence[Signal], t: Array, values: Array, sign: float) -> float:
    """Return the largest value near the best of those at times, which rise piece by piece."""
    best = int(np.argmax(values))
    inside = best % POINTS not in (0, POINTS - 1)
    low, high = (t[best - 1], t[best + 1]) if inside else (t[best], t[best])
    most = float(values[best])
    while inside and high - low > forces[0].tolerance:
        fine = np.linspace(low, high, REFINED)
        found = sign * total(forces, fine)
        place = min(max(int(np.argmax(found)), 1), REFINED - 2)
        if high - low < 1e-7 * t[-1] or float(found[place]) <= most:
            return max(most, float(found.max()))
        most, low, high = float(found[place]), fine[place - 1], fine[place + 1]
    return most


def link_results(
    scene: Scene, method: Method, signals: Signals, numbers: dict[str, int], begin: float, until: float
) -> Iterator[LinkResult]:
    """Yield the results of each link, or of all of one name, between two times [s].

    ``numbers`` are those of the contacts in the network, by name. Sets are those at the later time.
    """
    ends = np.array([begin, until])
    links = [contact for contact in scene.contacts if method.laws[contact.name].two_sided]
    names = [contact.group or contact.name for contact in links]
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
        yield LinkResult(name, len(own), max(known, default=None), largest, smallest, loss, tuple(sets))


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
