"""Measured bounds that no formula gives: bounds.md.

They are the largest gains of energy, and motion ahead of the wave. Energy is taken after every step. The scenes are
fixed, so that the numbers are reproducible.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np

from impactlab import simulate
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import CaseError, PairingError, StepError
from impactlab.integrators.adaptive import Adaptive
from impactlab.integrators.base import AbstractIntegrator, AbstractScheme
from impactlab.integrators.bathe import Bathe
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.contact_stabilised_newmark import ContactStabilisedNewmark
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.hht_alpha import HhtAlpha
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.integrators.newmark import Newmark
from impactlab.integrators.nonsmooth_generalised_alpha import NonsmoothGeneralisedAlpha
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.plugins import kind_of
from impactlab.scene import End, Rod, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.testing.invariants import precursor
from impactlab.testing.scenes import CLAMPED, FREE, STEEL, UNIT, in_a_row, mass_on_rod
from impactlab.testing.trace import run_in_cuts, trace
from impactlab.types import Relative
from studies.pages import Study, filled, table

TEN = StepRule(points_per_period=10.0)
ALPHAS = tuple(10.0 ** (-3.0 + 5.0 * i / 20.0) for i in range(21))


def struck(
    model: AbstractRodModel,
    law: AbstractContactLaw,
    integrator: AbstractScheme,
    step: StepRule,
    alpha: float = 1.0,
    far: str = "clamped",
    trips: float = 3.0,
    snapshots: tuple[float, ...] = (),
) -> Simulation:
    """Return the 1999 paper's rod struck by a mass.

    It is struck at its left end, with the far end clamped or free.
    """
    fields = {"right": End(far), "mass_ratio": 1.0 / alpha, "round_trips": trips, "snapshots": snapshots}  # type: ignore[arg-type]
    return mass_on_rod(model, law, integrator, step, **fields)


def periodic_bar(elements: int, courant: float, mass: str = "consistent") -> Simulation:
    """Return the periodically bouncing bar, over four periods.

    It starts from a uniform strain and bounces against a wall.
    """
    model = FiniteElement(elements, mass)  # type: ignore[arg-type]
    rod = Rod("rod", (UNIT,), FREE, CLAMPED, displacement=lambda x: (1.0 - x) / 2.0)
    step = StepRule(courant=courant)
    return in_a_row((Wall("wall"), rod), model, AdditionDeletion(), Newmark(), step, duration=12.0)


class Gain(NamedTuple):
    """Energy gain, rise and loss of a run, relative.

    They are the gain above the initial energy, the largest rise above an earlier value, and the largest loss, over the
    initial energy.
    """

    above: float
    rise: float
    loss: float


def gain_of(scene: Simulation) -> Gain | None:
    """Return the gains of a scene.

    None where the pair is refused, infinite where the run fails.
    """
    try:
        book = trace(scene).history.energy
    except (CaseError, PairingError):
        return None
    except StepError:
        return Gain(math.inf, math.inf, math.inf)
    rise = float(np.max(book.balance - np.minimum.accumulate(book.balance))) / book.scale
    return Gain(book.largest_gain, rise, book.largest_loss)


def worst(scenes: Iterable[Simulation]) -> Gain | None:
    """Return the largest of each gain over scenes; None where all are refused."""
    gains = [gain for gain in map(gain_of, scenes) if gain is not None]
    return Gain(*(max(column) for column in zip(*gains, strict=True))) if gains else None


def percent(value: float) -> str:
    """Return a ratio in per cent, tiny ones as rounding."""
    if not math.isfinite(value):
        return "fails"
    return "rounding" if abs(value) < 1e-11 else f"{100.0 * value:.3g} %"


def cells(gain: Gain | None) -> str:
    """Return the three cells of a table row."""
    return "refused | refused | refused" if gain is None else " | ".join(percent(value) for value in gain)


def over_alpha(
    models: Sequence[AbstractRodModel],
    law: AbstractContactLaw,
    integrator: AbstractScheme,
    step: StepRule,
    far: Sequence[str] = ("clamped", "free"),
) -> Gain | None:
    """Return the worst gains of some models over the mass ratio 1e-3 to 1e2."""
    grid = itertools.product(models, ALPHAS, far)
    return worst(struck(model, law, integrator, step, alpha, end) for model, alpha, end in grid)


def waves(points: float, end: str) -> Iterable[tuple[str, Gain | None]]:
    """Rows of wave identification under Newmark: n elements, d modes."""
    sizes = [(None, 1), (2, 2), (4, 2), (5, 5), (None, 5), (10, 10), (20, 20), (40, 40), (None, 10), (None, 40)]
    sizes += [(20, 10), (40, 20), (100, 10), (100, 40), (100, 70)]
    rule = StepRule(points_per_period=points)
    for n, d in sizes:
        name = f"{'analytic' if n is None else n} | {d} | {points:g} | {end}"
        yield name, over_alpha([Modal(n, d)], WaveIdentification(), Newmark(), rule, (end,))


def other_waves() -> Iterable[tuple[str, Gain | None]]:
    """Rows of wave identification on meshes and under other integrators."""
    for n in (2, 5, 10, 40):
        mesh, modes = FiniteElement(n, "lumped"), Modal(None, n)
        rows: list[tuple[str, AbstractRodModel, AbstractIntegrator, StepRule]] = [
            (f"consistent | {n} | newmark | 10 points", FiniteElement(n), Newmark(), TEN),
            (f"lumped | {n} | newmark | 10 points", mesh, Newmark(), TEN),
            (f"lumped | {n} | newmark | courant 0.5", mesh, Newmark(), StepRule(courant=0.5)),
        ]
        for c in (0.1, 0.3, 0.5):
            name = f"lumped | {n} | central_difference | courant {c:g}"
            rows.append((name, mesh, CentralDifference(), StepRule(courant=c)))
        for scheme in (CentralDifference(), ExactModal()):
            rows.append((f"analytic modes | {n} | {kind_of(scheme)} | 10 points", modes, scheme, TEN))
        for name, model, integrator, rule in rows:
            yield name, over_alpha([model], WaveIdentification(), integrator, rule)


def leapfrog() -> Iterable[tuple[str, Gain | None]]:
    """Rows of the other laws under central difference."""
    laws: list[tuple[str, AbstractContactLaw]] = [
        *((f"penalty, {k:g} EA/h", Penalty(Relative(k))) for k in (0.1, 0.5, 1.0, 2.0, 8.0)),
        ("penalty, 1 EA/h, damping 0.3 Z", Penalty(Relative(1.0), Relative(0.3))),
        ("addition_deletion", AdditionDeletion()),
        ("impulse_momentum, 0.5", ImpulseMomentum(0.5)),
    ]
    for (name, law), courant in itertools.product(laws, (0.25, 0.5, 0.9)):
        meshes = [FiniteElement(n, "lumped") for n in (5, 20)]
        yield f"{name} | {courant:g}", over_alpha(meshes, law, CentralDifference(), StepRule(courant=courant))


def damped_newmark() -> Iterable[tuple[str, Gain | None]]:
    """Rows of Newmark away from average acceleration."""
    for (beta, gamma), points in itertools.product(
        ((0.25, 0.5), (0.3025, 0.6), (0.49, 0.9), (0.9, 0.5), (0.9, 0.9)), (8.0, 20.0)
    ):
        rule = StepRule(points_per_period=points)
        for name, law in (("penalty, 1 EA/h", Penalty(Relative(1.0))), ("impulse_momentum, 0.5", ImpulseMomentum(0.5))):
            found = over_alpha([FiniteElement(n) for n in (3, 20)], law, Newmark(beta, gamma), rule)
            yield f"{beta:g} | {gamma:g} | {name} | {points:g}", found


SCHEMES: tuple[tuple[str, AbstractIntegrator], ...] = (
    ("midpoint", Midpoint()),
    ("moreau_jean, 0.5", MoreauJean()),
    ("moreau_jean, 0.7", MoreauJean(0.7)),
    ("moreau_jean, 1", MoreauJean(1.0)),
    ("contact_stabilised_newmark", ContactStabilisedNewmark()),
    ("bathe", Bathe()),
    ("hht_alpha, -0.1", HhtAlpha(-0.1)),
    ("hht_alpha, -1/3", HhtAlpha(-1.0 / 3.0)),
    ("nonsmooth_generalised_alpha, 0", NonsmoothGeneralisedAlpha(0.0)),
    ("nonsmooth_generalised_alpha, 0.8", NonsmoothGeneralisedAlpha(0.8)),
    ("nonsmooth_generalised_alpha, 1", NonsmoothGeneralisedAlpha(1.0)),
    ("generalised_alpha, 0", GeneralisedAlpha(0.0)),
    ("generalised_alpha, 0.8", GeneralisedAlpha(0.8)),
    ("generalised_alpha, 1", GeneralisedAlpha(1.0)),
)


def implicit(first: int, last: int) -> Iterable[tuple[str, Gain | None]]:
    """Rows of the other implicit schemes."""
    laws: tuple[tuple[str, AbstractContactLaw], ...] = (
        ("penalty, 1 EA/h", Penalty(Relative(1.0))),
        ("penalty, 1 EA/h, damping 0.3 Z", Penalty(Relative(1.0), Relative(0.3))),
        ("impulse_momentum, 0.5", ImpulseMomentum(0.5)),
        ("addition_deletion", AdditionDeletion()),
    )
    for (name, scheme), (law_name, law), points in itertools.product(SCHEMES[first:last], laws, (8.0, 20.0)):
        rule = StepRule(points_per_period=points)
        found = over_alpha([FiniteElement(n) for n in (3, 20)], law, scheme, rule)
        yield f"{name} | {law_name} | {points:g}", found


def adaptive(method: str) -> Iterable[tuple[str, Gain | None]]:
    """Yield rows of an adaptive solver: gains over its tolerance.

    They are the largest over laws, mass ratios and ends.
    """
    laws = (Penalty(Relative(1.0)), Penalty(Relative(1.0), Relative(0.3)), Hertz(1e13))
    model, rule = FiniteElement(5, "lumped"), StepRule(points_per_period=10.0)
    for tolerance in (1e-4, 1e-6, 1e-8):
        integrator, gains = Adaptive(method, tolerance), []  # type: ignore[arg-type]
        for law, alpha, far in itertools.product(laws, (1e-3, 1.0, 1e2), ("free", "clamped")):
            book = simulate.run(*struck(model, law, integrator, rule, alpha, far)).energy
            rise = float(np.max(book.balance - np.minimum.accumulate(book.balance))) / book.scale
            gains.append(Gain(book.largest_gain, rise, book.largest_loss))
        yield f"{method} | {tolerance:g}", Gain(*(max(column) / tolerance for column in zip(*gains, strict=True)))


def constraint() -> Iterable[tuple[str, Gain | None]]:
    """Rows of the hard position constraint under Newmark and exact_modal."""
    for elements, courant in itertools.product((25, 50, 100, 200), (0.25, 0.5, 1.0)):
        yield f"periodic bar, {elements} elements, courant {courant:g}", gain_of(periodic_bar(elements, courant))
    rule = StepRule(points_per_period=10.0)
    for model, name in (
        (FiniteElement(40), "40 elements"),
        (FiniteElement(100), "100 elements"),
        (Modal(100, 40), "100/40 modes"),
    ):
        yield f"the paper's case, {name}, newmark", gain_of(struck(model, AdditionDeletion(), Newmark(), rule))
    yield (
        "the paper's case, 40 analytic modes, exact_modal",
        gain_of(struck(Modal(None, 40), AdditionDeletion(), ExactModal(), rule)),
    )


def precursors() -> Iterable[str]:
    """Yield rows of the motion before the wave arrives.

    They have the largest velocity further than c t + margin, over v0.
    """
    trip = STEEL.length / STEEL.wave_speed
    times = tuple(trip * i / 20.0 for i in range(2, 18))
    settings: list[tuple[str, AbstractRodModel, AbstractIntegrator, StepRule]] = []
    twenty, explicit = StepRule(points_per_period=20.0), CentralDifference()
    for n in (20, 40, 100, 400):
        mesh = FiniteElement(n, "lumped")
        settings += [
            (f"consistent, {n} elements | newmark", FiniteElement(n), Newmark(), twenty),
            (f"lumped, {n} elements | newmark", mesh, Newmark(), twenty),
            (f"lumped, {n} elements, courant 1 | central_difference", mesh, explicit, StepRule(courant=1.0)),
            (f"lumped, {n} elements, courant 0.5 | central_difference", mesh, explicit, StepRule(courant=0.5)),
        ]
    for n, d in ((40, 40), (100, 40), (None, 20), (None, 40), (None, 100), (None, 400)):
        name = f"{n} elements, {d} modes | newmark" if n else f"{d} analytic modes | exact_modal"
        settings.append((name, Modal(n, d), Newmark() if n else ExactModal(), StepRule(points_per_period=10.0)))
    for name, model, integrator, rule in settings:
        scene = struck(model, Penalty(Relative(1.0)), integrator, rule, trips=0.5, snapshots=times)
        history = run_in_cuts(scene, lambda step: step + 10**6)
        margins = [precursor(history, "rod", 1.0, share * STEEL.length) for share in (0.0, 0.02, 0.05, 0.1, 0.2)]
        yield f"{name} | " + " | ".join(f"{margin:.1e}" for margin in margins)


def rows_of(job: tuple[Callable[..., Iterable[object]], tuple[object, ...]]) -> list[str]:
    """Return the rows of one table part, ready to print."""
    function, arguments = job
    rows = function(*arguments)
    if function is adaptive:
        return [f"{name} | {' | '.join(f'{value:.3g}' for value in gain)}" for name, gain in rows]  # type: ignore[misc]
    return [row if isinstance(row, str) else f"{row[0]} | {cells(row[1])}" for row in rows]  # type: ignore[index]


GAINS = "above start | largest rise | largest loss"
JOBS: dict[str, list[tuple[Callable[..., Iterable[object]], tuple[object, ...]]]] = {
    "waves": [(waves, (points, end)) for points in (10.0, 20.0, 40.0) for end in ("clamped", "free")],
    "other": [(other_waves, ())],
    "leapfrog": [(leapfrog, ())],
    "damped": [(damped_newmark, ())],
    "implicit": [(implicit, (first, first + 2)) for first in range(0, len(SCHEMES), 2)],
    "adaptive": [(adaptive, (method,)) for method in ("RK45", "DOP853", "LSODA", "BDF", "Radau")],
    "constraint": [(constraint, ())],
    "precursor": [(precursors, ())],
}
HEADS = {
    "waves": f"elements | modes | points | far end | {GAINS}",
    "other": f"mass or basis | n | integrator | step | {GAINS}",
    "leapfrog": f"law | courant | {GAINS}",
    "damped": f"beta | gamma | law | points | {GAINS}",
    "implicit": f"scheme | law | points | {GAINS}",
    "adaptive": f"method | tolerance | {GAINS}",
    "constraint": f"case | {GAINS}",
    "precursor": "model | integrator | ahead of c t | + 0.02 L | + 0.05 L | + 0.1 L | + 0.2 L",
}


def part(name: str) -> str:
    """Return a table of the page, its parts measured by two processes."""
    with ProcessPoolExecutor(2) as pool:
        return table(HEADS[name], [row for rows in pool.map(rows_of, JOBS[name]) for row in rows])


def command(arguments: Sequence[str]) -> int:
    """Print some tables."""
    parser = argparse.ArgumentParser(prog="python -m studies bounds", description="Measure and print some tables.")
    parser.add_argument("--only", nargs="+", choices=HEADS, required=True)
    print("\n\n".join(map(part, parser.parse_args(arguments).only)))
    return 0


STUDY = Study({"bounds.md": filled({name: partial(part, name) for name in HEADS})}, command=command)
