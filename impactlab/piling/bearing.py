"""The bearing graph: blows per metre over the static capacity of the soil."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from impactlab.casefile import Case
from impactlab.casefile.case import simulation_of
from impactlab.errors import CaseError
from impactlab.measurement.inputs import in_si, listed
from impactlab.piling.blow import blow_on
from impactlab.piling.pile import Pile, soil_laws, struck_pile_of
from impactlab.prefixes import prefixed, prefixed_range
from impactlab.scene.method import Simulation
from impactlab.startup.lazy import above
from impactlab.types import Array

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class BearingGraph:
    """Set, blow count, driving stresses and energy over static capacity, shape (n,) each."""

    capacity: Array  # N, of all soil links together
    set: Array  # m in one blow; 0 where the toe does not yield
    blows_per_metre: Array  # 1/m; NaN where the toe does not yield
    peak_compression: Array  # Pa, the largest along the pile in the blow
    peak_tension: Array  # Pa
    transferred_energy: Array  # J

    def __repr__(self) -> str:
        if not len(self.capacity):
            return "<BearingGraph without capacities>"
        if len(self.capacity) == 1:
            return f"<BearingGraph of 1 capacity, {prefixed(self.capacity[0], 'N')}: set {prefixed(self.set[0], 'm')}>"
        return (
            f"<BearingGraph of {len(self.capacity)} capacities, "
            f"{prefixed_range(self.capacity.min(), self.capacity.max(), 'N')}: sets "
            f"{prefixed_range(self.set.min(), self.set.max(), 'm')}>"
        )

    def to_pandas(self) -> pandas.DataFrame:
        """Return all columns over capacity [N] as a table; ``.to_latex()`` prints it for a report."""
        import pandas

        columns = {
            "set [m]": self.set,
            "blows per metre [1/m]": self.blows_per_metre,
            "compression [Pa]": self.peak_compression,
            "tension [Pa]": self.peak_tension,
            "transferred energy [J]": self.transferred_energy,
        }
        return pandas.DataFrame(columns, index=pandas.Index(self.capacity, name="capacity [N]"))

    def plot(self) -> Figure:
        """Return the static capacity over the blow count as a figure."""
        made: Figure = above("report.figures.evaluations").bearing_graph(self)
        return made


def static_capacity(run: Simulation, pile: Pile) -> float:
    """Return the static capacity [N] of all soil links on a pile."""
    return sum(law.capacity for law in soil_laws(run, pile).values())


def bearing_graph(case: Case | Simulation, capacities: Iterable[float | str]) -> BearingGraph:
    """Return blow count, driving stresses and energy for several static capacities of the soil.

    The capacities of all links with the law `smith` are scaled alike; quakes and damping factors are kept.

    Parameters
    ----------
    case : Case or Simulation
        One blow on a pile with a toe link.
    capacities : iterable of float or str
        Static capacities of shaft and toe together [N], or strings with a unit such as ``"1.5 MN"``.

    Raises
    ------
    CaseError
        If the pile has no toe link, or a capacity is not above 0; otherwise as `blow`.
    ImpactlabError
        If a capacity is no number, or has another unit.

    Warns
    -----
    DoubtfulResult
        As `blow`, for each capacity.
    """
    run = simulation_of(case, "bearing_graph")
    pile = struck_pile_of(run, "a bearing graph")
    wanted = np.array([in_si("a capacity", each, "N") for each in listed(capacities)])
    if pile.toe is None:
        raise CaseError(
            f"the pile {pile.named} has no soil under its toe, so no set that a blow count could follow from",
            remedy="Add a contact with the law smith at its toe, or take `drive`.",
            path="contacts",
        )
    wrong = wanted[~(np.isfinite(wanted) & (wanted > 0.0))]
    if wrong.size:
        raise CaseError(f"a capacity of {wrong[0]:g} N. Allowed: above 0", remedy="Give it in N.")
    given = static_capacity(run, pile)
    blows = []
    for capacity in wanted:
        scaled = with_capacity(run, pile, capacity / given)
        blows.append(blow_on(scaled, scaled, pile, f"capacity {prefixed(capacity, 'N')}: "))
    sets = np.array([each.set or 0.0 for each in blows])
    with np.errstate(divide="ignore"):
        rates = np.where(sets > 0.0, 1.0 / sets, np.nan)
    stresses = [(each.peak_compression.stress, each.peak_tension.stress) for each in blows]
    compression, tension = np.array(stresses).reshape(-1, 2).T
    energy = np.array([each.transferred_energy for each in blows])
    return BearingGraph(wanted, sets, rates, compression, tension, energy)


def with_capacity(run: Simulation, pile: Pile, factor: float) -> Simulation:
    """Return a scene whose soil links have their capacities times a factor."""
    laws = soil_laws(run, pile).items()
    scaled = {name: dataclasses.replace(law, capacity=law.capacity * factor) for name, law in laws}
    return Simulation(run.scene, dataclasses.replace(run.method, laws={**run.method.laws, **scaled}))
