"""One blow of a hammer on a pile: set, stresses and transferred energy."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid

from impactlab import api
from impactlab.casefile import Case
from impactlab.casefile.case import simulation_of
from impactlab.history.base import AbstractHistory
from impactlab.history.field_extremes import AtPlace, field_extremes, frames_needed
from impactlab.piling.pile import Pile, pile_of, soil_laws
from impactlab.piling.soil_at_rest import warn_if_moving
from impactlab.prefixes import prefixed, prefixed_range
from impactlab.scene.bodies import WaveBody
from impactlab.scene.method import Simulation
from impactlab.startup.lazy import above
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 20_000  # instants of the head signals of a run without steps


class Peak(NamedTuple):
    """The largest stress along a pile over a blow, positive in compression and in tension."""

    force: float  # N
    stress: float  # Pa
    x: float  # m from the left end of its rod
    time: float  # s
    rod: str = ""  # name of the rod, of those of a pile of several sections

    def __repr__(self) -> str:
        return (
            f"<Peak of {prefixed(self.stress, 'Pa')}, {prefixed(self.force, 'N')}, at x = {prefixed(self.x, 'm')} of "
            f"{self.rod!r}, {prefixed(self.time, 's')}>"
        )


class Head(NamedTuple):
    """Signals at the head of a pile, shape (n,) each."""

    time: Array  # s
    force: Array  # N, compression positive
    velocity: Array  # m/s, positive into the soil
    impedance: float  # N s/m

    def __repr__(self) -> str:
        return (
            f"<Head of {len(self.time)} samples, {prefixed_range(self.time[0], self.time[-1], 's')}: largest force "
            f"{prefixed(self.force.max(), 'N')}, velocity {prefixed(self.velocity.max(), 'm/s')}, "
            f"impedance {prefixed(self.impedance, 'N s/m')}>"
        )

    @property
    def impedance_velocity(self) -> Array:
        """Impedance times velocity [N], shape (n,)."""
        return self.impedance * self.velocity


@dataclass(frozen=True, repr=False)
class Blow:
    """Effect of one blow on a pile."""

    set: float | None  # m, plastic displacement of the toe link in the blow; None without one
    peak_compression: Peak
    peak_tension: Peak
    transferred_energy: float  # J, the largest work of the head force up to any time
    head: Head
    history: AbstractHistory = field(compare=False)

    def __repr__(self) -> str:
        rate = "" if self.blows_per_metre is None else f", {self.blows_per_metre:.4g} blows per metre"
        return (
            f"<Blow: set {prefixed(self.set, 'm')}{rate}, compression {prefixed(self.peak_compression.stress, 'Pa')}, "
            f"tension {prefixed(self.peak_tension.stress, 'Pa')}, transferred {prefixed(self.transferred_energy, 'J')}>"
        )

    @property
    def blows_per_metre(self) -> float | None:
        """1/set [1/m]; None where the toe never yields, or the pile has none."""
        return 1.0 / self.set if self.set else None

    def plot(self) -> Figure:
        """Return force and impedance times velocity at the head over time as a figure."""
        made: Figure = above("report.figures.evaluations").blow(self)
        return made


def blow(case: Case | Simulation) -> Blow:
    """Return the effect of one blow on a pile: set, stresses, energy, head signals.

    The pile is the rod that links with the law `smith` hold, or several such rods joined end to end; its head is the
    end that a ram or a helmet meets, or that a force over time drives, its toe the link at the other end. Stresses are
    those of fields along the pile, 200 in the time of a wave through it.

    Parameters
    ----------
    case : Case or Simulation
        One blow, long enough for the pile to come to rest: with its hammer, or under the measured force, as
        ``match(...).driven``, with a probe of the velocity of the head.

    Raises
    ------
    CaseError
        If one pile and its head cannot be found in the case.
    CaseError, PairingError, PluginError, StepError
        As `impactlab.run`.

    Warns
    -----
    DoubtfulResult
        If soil yields, or goes furthest, in the last round trip of a wave through the pile: the set may still change.
    """
    run = simulation_of(case, "blow")
    return blow_on(case, run, pile_of(run))


def blow_on(case: Case | Simulation, run: Simulation, pile: Pile, at: str = "") -> Blow:
    """Return the effect of one blow on a pile, as `blow`; ``at`` begins its warnings."""
    history = api.run(case, frames=frames_needed(run.scene.duration, 0.5 * pile.round_trip))
    warn_if_moving(history, run, pile, at)
    found = head_of(history, pile)
    compression, tension = largest_stresses(history, pile)
    return Blow(set_in(history, run, pile), compression, tension, transferred_energy(found), found, history)


def set_in(history: AbstractHistory, run: Simulation, pile: Pile) -> float | None:
    """Return the plastic displacement of the toe link [m]; None for a pile without one."""
    if pile.toe is None:
        return None
    return sets_of(history)[pile.toe.name] - soil_laws(run, pile)[pile.toe.name].set


def sets_of(history: AbstractHistory) -> dict[str, float]:
    """Return the sets of the soil links at the run's end [m], by contact."""
    found: dict[str, float] = {}
    for link in history.links:
        names = [each.name for each in history.scene.contacts if each.shared_name == link.name]
        found |= {name: value for name, value in zip(names, link.sets, strict=True) if value is not None}
    return found


def head_of(history: AbstractHistory, pile: Pile) -> Head:
    """Return force and velocity at the head of a pile over a run."""
    steps = POINTS if history.dt is None else round(history.duration / history.dt)
    time = np.linspace(0.0, history.duration, steps + 1)
    if pile.head is not None:
        force = history.evaluate(time, f"force:{pile.head.name}")
    else:
        force = pile.direction * next(load.at(time) for x, load in pile.body.loads if x == pile.head_x)
    velocity = pile.direction * history.evaluate(time, f"velocity:{pile.body.name}@{pile.head_x:.6g}")
    return Head(time, force, velocity, pile.impedance)


def transferred_energy(head: Head) -> float:
    """Return the largest work [J] of the head force up to any time."""
    work = cumulative_trapezoid(head.force * head.velocity, head.time, initial=0.0)
    return float(work.max())


def largest_stresses(history: AbstractHistory, pile: Pile) -> tuple[Peak, Peak]:
    """Return the largest compression and tension of a pile over a run, from its fields."""
    found = [(body, field_extremes(history, body, "stress")) for body in pile.sections]
    compression = [_peak(history, body, most, 1.0) for body, (_, most) in found]
    tension = [_peak(history, body, least, -1.0) for body, (least, _) in found]
    return max(compression, key=lambda peak: peak.stress), max(tension, key=lambda peak: peak.stress)


def _peak(history: AbstractHistory, body: WaveBody, stress: AtPlace, sign: float) -> Peak:
    force = history.field(body.name, stress.time, "force", [stress.x]).values[0]
    return Peak(max(0.0, sign * float(force)), max(0.0, sign * stress.value), stress.x, stress.time, body.name)
