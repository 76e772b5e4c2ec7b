"""Driving by several blows: each begins at the static rest after the one before, with its residual forces."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from impactlab import api
from impactlab.casefile import Case
from impactlab.casefile.case import simulation_of
from impactlab.errors import expect_whole
from impactlab.piling.blow import sets_of
from impactlab.piling.pile import Pile, soil_laws, struck_pile_of
from impactlab.piling.soil_at_rest import warn_if_moving
from impactlab.piling.static_rest import Rest, check_at_rest, rest_of
from impactlab.prefixes import prefixed
from impactlab.printing import counted
from impactlab.scene.bodies import Table
from impactlab.scene.method import Simulation
from impactlab.startup.lazy import above
from impactlab.types import Array

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

MAX_BLOWS = 10_000  # some minutes of runs
SAME_SET = 1e-3  # relative: two blows that move the head and the toe by the same


class Driven(NamedTuple):
    """One blow of several: permanent set, and residual forces, positive into the soil."""

    head: float  # m, permanent motion of the head
    toe: float  # m, permanent motion of the toe
    toe_force: float | None  # N, left at the toe; None of a pile without toe link
    x: Array  # (n,) m, places from the left end: ends of the pile, joints of its segments and its soil links
    force: Array  # (n - 1,) N in the pile between them, compression positive
    soil: dict[str, float]  # N, static resistances by name of the contact

    def __repr__(self) -> str:
        left = "" if self.toe_force is None else f", {prefixed(self.toe_force, 'N')} left at the toe"
        return f"<Driven: head {prefixed(self.head, 'm')}, toe {prefixed(self.toe, 'm')}{left}>"


@dataclass(frozen=True, repr=False)
class Driving:
    """A pile driven by several blows, with the residual forces between them."""

    blows: tuple[Driven, ...]

    def __repr__(self) -> str:
        count = len(self.blows)
        named = counted(count, "blow")
        if not count:
            return f"<Driving of {named}>"
        last, rate = self.blows[-1], self.blows_per_metre
        if rate is None:
            return (
                f"<Driving of {named}: the last moves head {prefixed(last.head, 'm')}, toe {prefixed(last.toe, 'm')}>"
            )
        return (
            f"<Driving of {named}: set {prefixed(self.set, 'm')} from blow {self.repeats_from} on, "
            f"{rate:.4g} blows per metre>"
        )

    def plot(self) -> Figure:
        """Return head and toe motion of each blow, and the residual forces of the last, as a figure."""
        made: Figure = above("report.figures.evaluations").driving(self)
        return made

    def to_pandas(self) -> pandas.DataFrame:
        """Return a row for each blow, by its number from 1: motion of head and toe [m], force left at the toe [N]."""
        import pandas

        rows = [(blow.head, blow.toe, math.nan if blow.toe_force is None else blow.toe_force) for blow in self.blows]
        index = pandas.RangeIndex(1, len(rows) + 1, name="blow")
        return pandas.DataFrame(rows, index, ["head [m]", "toe [m]", "force left at the toe [N]"])

    @property
    def set(self) -> float | None:
        """Permanent motion per blow [m], once head and toe repeat within 1e-3; None before."""
        number = self.repeats_from
        return None if number is None else self.blows[-1].head

    @property
    def repeats_from(self) -> int | None:
        """Number of the first blow, from 1, that moves like the last, or None.

        Head and toe both move alike.
        """
        last = self.blows[-1].head
        alike = [last > 0.0 and max(abs(e.head - last), abs(e.toe - last)) <= SAME_SET * last for e in self.blows]
        first = len(alike) - alike[::-1].index(False) if False in alike else 0
        return first + 1 if first < len(alike) - 1 else None

    @property
    def blows_per_metre(self) -> float | None:
        """1/set [1/m]; None while no set repeats."""
        return None if self.set is None else 1.0 / self.set


def drive(case: Case | Simulation, blows: int) -> Driving:
    """Return the permanent motion of a pile under several blows, with residual forces between them.

    After each blow pile and soil come to static rest with the sets reached. That rest is the initial displacement and
    the sets of the next blow, for which the hammer stands on the head as in the case. Places are counted from the head.

    Parameters
    ----------
    case : Case or Simulation
        One blow, long enough for the pile to come to rest; no gravity.
    blows : int
        How many.

    Raises
    ------
    CaseError
        If something other than links with the law `smith` holds the pile, or gravity acts; otherwise as `blow`.

    Warns
    -----
    DoubtfulResult
        As `blow`, for each blow.

    References
    ----------
    DaCostaDanzigerLopes2001.
    """
    expect_whole(blows, "blows", 1, MAX_BLOWS)
    run = simulation_of(case, "drive")
    pile = struck_pile_of(run, "driving by several blows")
    check_at_rest(run, pile)
    return Driving(tuple(_driven(run, pile, blows)))


def _driven(run: Simulation, pile: Pile, blows: int) -> Iterator[Driven]:
    head, toe = (0, -1) if pile.from_left else (-1, 0)
    displaced = pile.body.displacement
    ends = np.array([0.0, pile.body.length])
    before = np.zeros(2) if displaced is None else displaced(ends)
    for number in range(blows):
        history = api.run(run)
        warn_if_moving(history, run, pile, f"blow {number + 1}: ")
        end = float(history.evaluate([history.duration], f"displacement:{pile.body.name}@{pile.head_x:.6g}")[0])
        rest = rest_of(run, pile, sets_of(history), end)
        moved = pile.direction * (rest.displacement[[0, -1]] - before)
        force = None if pile.toe is None else rest.soil[pile.toe.name]
        yield Driven(float(moved[head]), float(moved[toe]), force, rest.x, rest.force, rest.soil)
        run, before = _next(run, pile, rest, float(rest.displacement[head]))


def _next(run: Simulation, pile: Pile, rest: Rest, head: float) -> tuple[Simulation, Array]:
    """Return the scene of the next blow and the motion of its ends, from the head."""
    u = rest.displacement - head
    body = dataclasses.replace(pile.body, displacement=Table(tuple(rest.x.tolist()), tuple(u.tolist())))
    laws, of_soil = dict(run.method.laws), soil_laws(run, pile)
    for contact in pile.soil:
        side = 1.0 if contact.left.body == pile.body.name else -1.0
        laws[contact.name] = dataclasses.replace(of_soil[contact.name], set=rest.sets[contact.name] - side * head)
    scene = dataclasses.replace(run.scene, bodies={**run.scene.bodies, pile.body.name: body})
    return Simulation(scene, dataclasses.replace(run.method, laws=laws)), u[[0, -1]]
