"""The efficiency of a percussive drill over the stiffness of the rock."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from impactlab.casefile import Case
from impactlab.casefile.case import simulation_of
from impactlab.contact.bilinear import Bilinear
from impactlab.drilling.blow import blow
from impactlab.drilling.drill import drill_of
from impactlab.errors import CaseError
from impactlab.measurement.inputs import in_si, listed
from impactlab.prefixes import prefixed, prefixed_range
from impactlab.scene.method import Simulation
from impactlab.startup.lazy import above
from impactlab.types import Array

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Efficiencies:
    """One blow on rocks of several stiffnesses, shape (n,) each."""

    stiffness: Array  # N/m, of loading
    efficiency: Array
    first_pass: Array  # efficiency before the wave from the bit has returned to it
    peak_force: Array  # N
    final: Array  # m, penetration that stays

    def __repr__(self) -> str:
        if not len(self.stiffness):
            return "<Efficiencies without stiffnesses>"
        best = int(np.argmax(self.efficiency))
        return (
            f"<Efficiencies of {len(self.stiffness)} stiffnesses, "
            f"{prefixed_range(self.stiffness.min(), self.stiffness.max(), 'N/m')}: the largest is "
            f"{self.efficiency[best]:.4g} at {prefixed(self.stiffness[best], 'N/m')}>"
        )

    def plot(self) -> Figure:
        """Return the efficiency over the stiffness of the rock as a figure."""
        made: Figure = above("report.figures.evaluations").efficiencies(self)
        return made

    def to_pandas(self) -> pandas.DataFrame:
        """Return efficiency, peak force [N] and final penetration [m] over the stiffness [N/m] as a table."""
        import pandas

        columns = {
            "efficiency [1]": self.efficiency,
            "first pass [1]": self.first_pass,
            "peak force [N]": self.peak_force,
            "final penetration [m]": self.final,
        }
        return pandas.DataFrame(columns, index=pandas.Index(self.stiffness, name="stiffness [N/m]"))


def sweep(case: Case | Simulation, stiffnesses: Iterable[float | str]) -> Efficiencies:
    """Return the efficiency of a drill over the loading stiffness of the rock.

    The ratio gamma of the stiffnesses of loading and unloading is kept.

    Parameters
    ----------
    case : Case or Simulation
        One blow on rock with the law `bilinear`.
    stiffnesses : iterable of float or str
        Of loading [N/m], or strings with a unit such as ``"50 MN/m"``.

    Raises
    ------
    CaseError
        If the rock has another law, or a stiffness is not above 0; otherwise as `blow`.
    ImpactlabError
        If a stiffness is no number, or has another unit.
    """
    run = simulation_of(case, "sweep")
    rock = drill_of(run.scene, run.method.laws).rock
    wanted = np.array([in_si("a stiffness", each, "N/m") for each in listed(stiffnesses)])
    law = run.method.laws[rock.name]
    if not isinstance(law, Bilinear):
        text = f"the rock {rock.name!r} has the law {type(law).__name__}, and the sweep varies that of bilinear"
        raise CaseError(text, remedy="Give the rock the law bilinear.", path="contacts")
    wrong = wanted[~(np.isfinite(wanted) & (wanted > 0.0))]
    if wrong.size:
        raise CaseError(f"a stiffness of {wrong[0]:g} N/m. Allowed: above 0", remedy="Give stiffnesses in N/m.")
    found = []
    for stiffness in wanted:
        ratio = law.unloading / law.stiffness
        rock_law = Bilinear(stiffness=float(stiffness), unloading_stiffness=float(stiffness * ratio))
        laws = {**run.method.laws, rock.name: rock_law}
        found.append(blow(Simulation(run.scene, dataclasses.replace(run.method, laws=laws))))
    return Efficiencies(
        stiffness=wanted,
        efficiency=np.array([each.efficiency for each in found]),
        first_pass=np.array([each.first_pass for each in found]),
        peak_force=np.array([each.peak_force for each in found]),
        final=np.array([each.final for each in found]),
    )
