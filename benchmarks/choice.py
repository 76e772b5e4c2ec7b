"""Measures the automatic choice: ``python benchmarks/choice.py [CASE ...] [--out docs/automatic-choice.md]``.

For every case and variant and for the tolerances 1e-2, 1e-3 and 1e-4: what was chosen, the error it was expected to
have and the one it has, how long it solved, the best of a fixed list of other methods that keeps the tolerance, and how
long the choosing took. Errors are the largest of mass displacement, face displacement and impulse, as in a summary.
Times are least ones of interleaved repeats on one core.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import tables

import impactlab as il
from impactlab import api, metrics, simulate
from impactlab.api import physics_of
from impactlab.bases.craig_bampton import CraigBampton
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.velocity_complementarity import VelocityComplementarity
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import ImpactlabError
from impactlab.history import AbstractHistory
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.refine.descriptions import modelled_as
from impactlab.refine.reference import CONVERGED_BY, Reference, find
from impactlab.scene import Scene
from impactlab.scene.facts import shortest_transit
from impactlab.scene.method import Simulation, StepRule, Tolerance

HERE = Path(__file__).resolve().parent
CASES, HEAD = HERE.parent / "cases", HERE / "automatic-choice.head.md"
TOLERANCES = (1e-2, 1e-3, 1e-4)
SIZES = (10, 20, 40, 80, 160, 320, 640)
REPEATS = 5
LONGEST = 0.25  # s: longer runs of other methods are not repeated, and finer ones not tried
ROUNDING = 1e-9  # of an error: below, one is as good as the other

Make = Callable[[Simulation, int], Simulation]


def _rule(points: float) -> StepRule:
    return StepRule(points_per_period=points)


OTHERS: Mapping[str, Make] = {
    "exact": lambda s, _n: modelled_as(s, Continuous(), None, _rule(10.0), AdditionDeletion()),
    "delay line": lambda s, n: modelled_as(s, Continuous(), None, StepRule(dt=shortest_transit(s.scene) / n)),
    "lumped, central difference, courant 1": lambda s, n: modelled_as(
        s, FiniteElement(n, "lumped"), CentralDifference(), StepRule(courant=1.0), AdditionDeletion()
    ),
    "lumped, central difference, courant 0.9": lambda s, n: modelled_as(
        s, FiniteElement(n, "lumped"), CentralDifference(), StepRule(courant=0.9), AdditionDeletion()
    ),
    "lumped, central difference, complementarity": lambda s, n: modelled_as(
        s, FiniteElement(n, "lumped"), CentralDifference(), StepRule(courant=0.9), VelocityComplementarity()
    ),
    "spectral 4, central difference": lambda s, n: modelled_as(
        s, FiniteElement(max(2, n // 4), "lumped", 4), CentralDifference(), StepRule(courant=0.8), AdditionDeletion()
    ),
    "consistent, midpoint": lambda s, n: modelled_as(
        s, FiniteElement(n), Midpoint(), StepRule(courant=0.5), AdditionDeletion()
    ),
    "lumped, Moreau-Jean": lambda s, n: modelled_as(
        s, FiniteElement(n, "lumped"), MoreauJean(), StepRule(courant=1.0), VelocityComplementarity()
    ),
    "modes, Newmark, wave identification": lambda s, n: modelled_as(
        s, Modal(elements=2 * n, modes=n), Newmark(), _rule(20.0), WaveIdentification()
    ),
    "Craig-Bampton, located": lambda s, n: modelled_as(
        s, Modal(elements=40, order=8, modes=n, basis=CraigBampton()), ExactModal(), _rule(10.0), AdditionDeletion(),
        events="located",
    ),
}  # fmt: skip
"""The other methods; each takes every size in turn."""


class Run(NamedTuple):
    """One size of one other method."""

    method: str
    size: int
    error: float
    solve_s: float


class Row(NamedTuple):
    """One case at one tolerance."""

    label: str
    tolerance: float
    chosen: str
    met: bool
    expected: float
    measured: float
    known: float
    solve_s: float
    choosing_s: float
    best: Run | None
    fault: str = ""

    @property
    def faults(self) -> list[str]:
        """Which of the promises are broken."""
        if self.fault:
            return [self.fault]
        found = []
        if self.measured > self.tolerance + self.known and self.met:
            found.append("beyond the tolerance")
        if self.known > 0.1 * self.tolerance:
            found.append("reference too vague to tell")
        if not self.met:
            found.append("not met, and said so")
        if self.best is not None and self.solve_s > 2.0 * self.best.solve_s:
            found.append(f"{self.solve_s / self.best.solve_s:.1f} times the best")
        if self.choosing_s > 10.0 * self.solve_s:
            found.append(f"choosing {self.choosing_s / self.solve_s:.0f} times the solving")
        return found


def scenes(files: list[Path]) -> Iterator[tuple[str, Simulation]]:
    """Give every case and variant as written, without probes and snapshots: all methods then record the same."""
    for file in files:
        case = il.load_case(file)
        for name in case.variant_names:
            variant = case.variant(name)
            physics = physics_of(variant).but(probes=(), snapshots=(), tolerance=None)
            yield variant.label, physics


def error_of(history: AbstractHistory, reference: Reference, scene: Scene) -> float:
    """Return the largest of the errors that a tolerance is meant for."""
    found = [getattr(metrics, name)(history, reference.history, scene) for name in CONVERGED_BY]
    return max((value for value in found if value is not None), default=0.0)


def least(scene: Simulation, first: AbstractHistory) -> float:
    """Return the least time of solving a scene again and again [s]."""
    times = [first.cost.solve_s]
    for _ in range(REPEATS if first.cost.solve_s < LONGEST else 0):
        times.append(simulate.run(*scene).cost.solve_s)
    return min(times)


def others(scene: Simulation, reference: Reference, dearest: float) -> list[Run]:
    """Return the other methods at all sizes that solve within ``dearest`` [s]; refused and failed ones are left out."""
    runs = []
    for name, make in OTHERS.items():
        for size in SIZES[:1] if name == "exact" else SIZES:
            try:
                simulate.run(*make(scene, size))  # what is compiled is compiled
                described_scene = make(scene, size)
                history = simulate.run(*described_scene)
            except (ImpactlabError, ArithmeticError):
                continue
            if name == "delay line" and history.dt is None:
                break  # solved from event to event
            runs.append(Run(name, size, error_of(history, reference, scene.scene), least(described_scene, history)))
            if runs[-1].solve_s > dearest:
                break
    return runs


def rows_of(label: str, scene: Simulation) -> Iterator[Row]:
    """Give one row per tolerance."""
    reference = find(*scene)
    if reference is None:
        return
    chosen: dict[float, tuple[AbstractHistory, float, float]] = {}
    for tolerance in TOLERANCES:
        asked = scene.but(tolerance=Tolerance(tolerance))
        try:
            runs = [api.solve(*asked)]
            runs += [api.solve(*asked) for _ in range(REPEATS if runs[0].cost.solve_s < LONGEST else 0)]
        except ImpactlabError as error:
            yield Row(label, tolerance, "none", False, 0.0, 0.0, 0.0, 0.0, 0.0, None, f"refused: {error.text}")
            continue
        choosing = min(run.choice.choosing_s for run in runs if run.choice is not None)
        chosen[tolerance] = runs[-1], min(run.cost.solve_s for run in runs), choosing
    if not chosen:
        return
    rivals = others(scene, reference, max(1e-3, *(2.0 * solve for _, solve, _ in chosen.values())))
    for tolerance, (history, solve, choosing) in chosen.items():
        choice = history.choice
        assert choice is not None
        keeping = [run for run in rivals if run.error <= tolerance]
        yield Row(
            label, tolerance, choice.chosen, choice.met, choice.expected_error,
            error_of(history, reference, scene.scene), reference.uncertainty, solve, choosing,
            min(keeping, key=lambda run: run.solve_s, default=None),
        )  # fmt: skip


def table(rows: list[Row]) -> str:
    """Return the rows as a Markdown table."""
    cells = []
    for row in rows:
        best = ("-", "-") if row.best is None else (_name(row.best), f"{1e3 * row.best.solve_s:.3g}")
        measured = "0" if row.measured < ROUNDING else f"{row.measured:.1e}"
        errors = (row.chosen, f"{row.expected:.1e}", measured, f"{1e3 * row.solve_s:.3g}")
        faults = "; ".join(row.faults) or "ok"
        cells.append((row.label, f"{row.tolerance:g}", *errors, *best, f"{1e3 * row.choosing_s:.3g}", faults))
    heads = ("case", "tolerance", "chosen", "expected", "measured", "solve [ms]", "best other", "its [ms]")
    return tables.table((*heads, "choosing [ms]", ""), cells, text=("case", "chosen", "best other", ""))


def _name(run: Run) -> str:
    return run.method if run.method == "exact" else f"{run.method}, {run.size}"


def verdict(rows: list[Row]) -> str:
    """Return how many rows keep each promise."""
    kept = sum(row.measured <= row.tolerance + row.known for row in rows if row.met)
    near = sum(row.best is None or row.solve_s <= 2.0 * row.best.solve_s for row in rows if not row.fault)
    quick = sum(row.choosing_s <= 10.0 * row.solve_s for row in rows if not row.fault)
    met, count = sum(row.met for row in rows), len(rows)
    stated = sum(row.measured <= row.expected + row.known + ROUNDING for row in rows if not row.fault)
    return (
        f"{count} rows: {met} said to keep their tolerance; {kept} of these do; {stated} of all do with the error that "
        f"they state; {near} solve within twice the time of the best other method that keeps it; in {quick} the "
        "choosing takes less than ten times the solving; "
        f"{sum(bool(row.fault) for row in rows)} refused."
    )


def main() -> int:
    """Measure, print, and write the page where asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("cases", nargs="*", type=Path, help="case files; all in cases/ if none is given")
    parser.add_argument("--out", type=Path, help="page to write")
    given = parser.parse_args()
    rows: list[Row] = []
    for label, scene in scenes(given.cases or sorted(CASES.glob("*.yaml"))):
        for row in rows_of(label, scene):
            rows.append(row)
            print(f"{label:32} {row.tolerance:g} {'; '.join(row.faults) or 'ok'}", file=sys.stderr, flush=True)
    where = f"Least times of {REPEATS + 1} runs on one core; Python {platform.python_version()}."
    page = f"{verdict(rows)} {where}\n\n{table(rows)}\n"
    print(page)
    if given.out is not None:
        given.out.write_text(HEAD.read_text(encoding="utf-8") + page, encoding="utf-8")
    return 1 if any(row.measured > row.tolerance + row.known and row.met for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
