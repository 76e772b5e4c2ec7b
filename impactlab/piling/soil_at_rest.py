"""Check that a run ends with the soil of a pile at rest, so that its sets are those of the blow."""

from __future__ import annotations

import numpy as np

from impactlab.contact.smith import Smith
from impactlab.errors import DoubtfulResult
from impactlab.history.base import AbstractHistory
from impactlab.measurement.inputs import warn
from impactlab.piling.pile import Pile, soil_laws
from impactlab.scene.method import Simulation
from impactlab.types import Array

POINTS = 4000  # instants of a run at which the sets are followed
SAME_SET = 0.01  # of a quake: a set that changes by less is final
SOIL_TOL = 1e-6  # of the static capacity: a link below it holds nothing


def warn_if_moving(history: AbstractHistory, run: Simulation, pile: Pile, blow: str = "") -> None:
    """Issue a `DoubtfulResult` if soil still moves at the end of a run.

    Its links yield, or go furthest, in the last round trip of a wave. ``blow`` names the blow among several, with a
    colon.
    """
    trip = pile.round_trip
    time = np.linspace(0.0, history.duration, POINTS + 1)
    last = time >= history.duration - trip
    moved = np.array([-history.evaluate(time, f"gap:{contact.name}") for contact in pile.soil])
    if not moved.size:
        return
    laws = list(soil_laws(run, pile).values())
    quake = np.array([law.quake for law in laws])
    sets = sets_over_time(moved, laws)
    capacity = np.array([law.capacity for law in laws])
    holds = capacity > SOIL_TOL * capacity.sum()
    yields = holds & (np.ptp(sets[:, last], axis=1) > SAME_SET * quake)
    pulls = np.array([law.tension for law in laws])
    way = moved - moved[:, :1]
    way = np.where(pulls[:, None], np.abs(way), way)
    furthest = holds & ~yields & (way[:, last].max(axis=1) >= way.max(axis=1))
    still = [("yielded", yields), ("reached their furthest place", furthest)]
    texts = [f"these {what}: {_named(pile, chosen)}" for what, chosen in still if chosen.any()]
    if texts:
        warn(
            f"{blow}the run ends at {history.duration:.6g} s, before the soil of {pile.named} is at rest, so the "
            f"set may still change. Of its links in the last {min(trip, history.duration):.3g} s, a round trip "
            f"of a wave through the pile, {'; '.join(texts)}. Give solve.duration a longer time, such as "
            f"{2.0 * history.duration:.3g} s.",
            DoubtfulResult,
        )


def sets_over_time(moved: Array, laws: list[Smith]) -> Array:
    """Return the sets of soil links [m] from the displacements there, shape (links, n) each."""
    quake = np.array([law.quake for law in laws])
    lower = np.where([law.tension for law in laws], quake, np.inf)  # without tension the hole stays
    found = np.empty_like(moved)
    now = np.array([law.set for law in laws])
    for number in range(moved.shape[1]):
        at = moved[:, number]
        now = np.clip(now, at - quake, at + lower)
        found[:, number] = now
    return found


def _named(pile: Pile, chosen: Array) -> str:
    """Return the names of some soil links; pieces of one name are counted."""
    names = [contact.shared_name for contact in pile.soil]
    own = [name for name, each in zip(names, chosen, strict=True) if each]
    texts = []
    for name in dict.fromkeys(own):
        all_of = names.count(name)
        texts.append(f"{name!r}" + (f" ({own.count(name)} of {all_of} pieces)" if all_of > 1 else ""))
    return ", ".join(texts)
