"""Measures the automatic choice.

``python benchmarks/choice.py [CASE ...] [--beams] [--random COUNT] [--out PAGE] [--kept ROWS]``

For every case and variant and the tolerances 1e-2, 1e-3 and 1e-4, and for the beams of `beam_scenes` from 1e-1 on: the
description chosen, the error it was expected to have and the one it has, how long it solved, the best of all other
descriptions that keeps the tolerance, and how long the choosing took. Errors are the largest of those that a tolerance
bounds (`impactlab.refine.references.stated_error`), by the metrics of a summary. The best is sought, by the measured
error, among a fixed list of methods and all descriptions of the choice itself, each at sizes that grow by the square
root of two. Times are least ones of repeats on one core. Every repeat of a choice begins without modes and bodies of an
earlier one.

A run may keep a tolerance by luck, as its error passes through zero on the way from one sign to the other. So a second
best is given beside it: the fastest run all whose finer runs of the same method keep the tolerance, too.

``--random COUNT`` also draws so many scenes of each family of the audit (`studies.audit`). Constants of the choice were
fitted to the cases and beams above, not to these, so that they show how well it works on scenes of users.

``--kept FILE`` writes the rows of each scene to a file as they come, one a line; the scenes that are in it are not
measured again, so that a measurement that was stopped goes on where it was.

``--out PAGE`` writes the page, `automatic-choice.head.md` with the results in place of its comments, and the rows as
``bench/automatic-choice.csv`` beside it.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import platform
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import beam_scenes
import numpy as np
import tables

import impactlab as il
from impactlab import api, simulate
from impactlab.api import physics_of
from impactlab.bases import shapes
from impactlab.bases.beams import modes
from impactlab.bases.craig_bampton import CraigBampton
from impactlab.bench.environment import processor
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
from impactlab.metrics import norms
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.refine.descriptions import suitable
from impactlab.refine.descriptions.rods import modelled_as
from impactlab.refine.references.reference import find
from impactlab.refine.references.reference_record import Reference
from impactlab.refine.references.stated_error import METRICS
from impactlab.scene.facts import beams_of, shortest_transit
from impactlab.scene.method import COUNTED, Counted, Simulation, StepRule, Tolerance
from impactlab.simulate import stepped_run

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # of the studies
from studies.audit.families import draw
from studies.audit.measure import case_for

HERE = Path(__file__).resolve().parent
CASES, HEAD = HERE.parent / "cases", "automatic-choice.head.md"
ROWS = "bench/automatic-choice.csv"  # beside the page
TOLERANCES, BEAM_TOLERANCES = (1e-2, 1e-3, 1e-4), (1e-1, 1e-2, 1e-3, 1e-4)
SIZES = tuple(round(10 * 2.0 ** (0.5 * k)) for k in range(13))
MAX_COST, OFTEN, MAX_CHOOSING = 2.0, 0.95, 10.0  # targets in this share of rows
WORST_COST, WORST_CHOOSING_S, SHORT_S = 5.0, 0.02, 1e-3  # targets in all; the second where the solving is that short
REPEATS = 5
FINALISTS = 5  # of the other runs, the fastest by one run of each, that are timed by repeats
LONGEST = 0.25  # s: longer runs of other methods are not repeated, and finer ones not tried
ROUNDING = 1e-9  # of an error: below, one is as good as the other
RANDOM = {
    "rigid": "rigid bodies, compliant contacts", "beam": "beams", "power_law": "rods, power laws",
    "dashpot": "rods, dashpots", "damped": "damped rods",
}  # fmt: skip
"""Families of random scenes that are stepped, and what they are."""
SEED = 31

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
    beams: bool = False
    fault: str = ""
    steady: Run | None = None  # the best whose finer runs keep the tolerance, too

    @classmethod
    def read(cls, line: str) -> Row:
        """Return the row that `written` wrote."""
        given = json.loads(line)
        runs = {name: None if given[name] is None else Run(*given[name]) for name in ("best", "steady")}
        return cls(**(given | runs))

    @property
    def written(self) -> str:
        """The row as one line of JSON."""
        return json.dumps(self._asdict())

    @property
    def steady_cost(self) -> float:
        """Time of solving over that of the best whose finer runs keep the tolerance, too."""
        return 1.0 if self.steady is None else self.solve_s / self.steady.solve_s

    @property
    def faults(self) -> list[str]:
        """Which of the targets are missed."""
        if self.fault:
            return [self.fault]
        found = []
        if self.measured > self.tolerance + self.known and self.met:
            found.append("beyond the tolerance")
        if self.known > 0.1 * self.tolerance:
            found.append("reference not accurate enough")
        if not self.met:
            found.append("not met, as stated")
        if self.cost > MAX_COST:
            found.append(f"{self.cost:.1f} times the best")
        if self.choosing > MAX_CHOOSING:
            found.append(f"choosing {self.choosing:.0f} times the solving")
        return found

    @property
    def cost(self) -> float:
        """Time of solving over that of the best other one."""
        return 1.0 if self.best is None else self.solve_s / self.best.solve_s

    @property
    def choosing(self) -> float:
        """Time of choosing over that of solving."""
        return self.choosing_s / self.solve_s


class Asked(NamedTuple):
    """A scene and the tolerances that it is asked to keep."""

    label: str
    scene: Simulation
    on: tuple[Counted, ...] = COUNTED
    tolerances: tuple[float, ...] = TOLERANCES


def scenes(files: list[Path]) -> Iterator[Asked]:
    """Yield every case and variant as written, without probes and snapshots.

    All methods then record the same.
    """
    for file in files:
        case = il.load_case(file)
        for name in case.variant_names:
            variant = case.variant(name)
            physics = physics_of(variant).but(probes=(), snapshots=(), tolerance=None)
            yield Asked(variant.label, physics)


def beams() -> Iterator[Asked]:
    """Give the scenes with beams of all supports and contacts."""
    for label, scene, on in beam_scenes.scenes():
        yield Asked(label, scene, on, BEAM_TOLERANCES)


def drawn(count: int) -> Iterator[Asked]:
    """Give random scenes of each family."""
    for family in RANDOM if count else ():
        for number in range(count):
            case = case_for(draw(family, SEED, number).doc)
            scene = Simulation(*case.simulation()).but(probes=(), snapshots=(), tolerance=None)
            yield Asked(f"random {family} {number}", scene)


def error_of(history: AbstractHistory, reference: Reference, asked: Asked) -> float:
    """Return the largest of the errors that a tolerance is on."""
    installed = norms.installed()
    names = [name for counted in asked.on for name in METRICS[counted]]
    found = [installed[name](history, reference.history, asked.scene.scene) for name in names]
    return max((float(value) for value in found if value is not None), default=0.0)


def known_to(reference: Reference, asked: Asked) -> float:
    """Return the uncertainty of the errors that a tolerance is on."""
    names = [name for counted in asked.on for name in METRICS[counted]]
    return max(reference.uncertainties.get(name, reference.uncertainty) for name in names)


def least(scene: Simulation, first: AbstractHistory) -> float:
    """Return the least time of solving a scene again and again [s]."""
    times = [first.cost.solve_s]
    for _ in range(REPEATS if first.cost.solve_s < LONGEST else 0):
        times.append(simulate.run(*scene).cost.solve_s)
    return min(times)


def in_turn(scenes: list[Simulation], longest: float) -> list[float]:
    """Return the least times of solving some scenes in turn [s].

    Each is solved in every turn, as the clock of a machine changes. Each follows an untimed run of its own, so that
    none pays for caches that another emptied.
    """
    least_times = [math.inf] * len(scenes)
    for _ in range(REPEATS if longest < LONGEST else 1):
        for number, each in enumerate(scenes):
            if longest < LONGEST:
                simulate.run(*each)
            least_times[number] = min(least_times[number], simulate.run(*each).cost.solve_s)
    return least_times


class Rival(NamedTuple):
    """One size of one other method, timed by one run.

    The scene is kept to time it again.
    """

    run: Run
    scene: Simulation


def others(asked: Asked, reference: Reference, dearest: float) -> list[Rival]:
    """Return the other methods at all sizes that solve within ``dearest`` [s].

    Failed ones are left out.
    """
    scene, rivals = asked.scene, list[Rival]()
    linked = any(law.two_sided for law in scene.method.laws.values())  # its code is compiled for every run
    sizes_of = SIZES[::4] if linked else SIZES
    makes = [(name, make, SIZES[:1] if name == "exact" else sizes_of) for name, make in OTHERS.items()]
    for description in suitable.in_turn(scene)[0]:
        if description.unit:
            sizes = tuple(description.whole(max(2, round(description.min_fineness * size / 20))) for size in SIZES)
            makes.append((description.name, lambda _scene, n, make=description.simulation: make(n), sizes))
    for name, make, sizes in makes:
        for size in sizes:
            try:
                simulate.run(*make(scene, size))  # what is compiled is compiled
                described_scene = make(scene, size)
                history = simulate.run(*described_scene)
            except (ImpactlabError, ArithmeticError):
                continue
            if name == "delay line" and history.dt is None:
                break  # solved from event to event
            run = Run(name, size, error_of(history, reference, asked), history.cost.solve_s)
            rivals.append(Rival(run, described_scene))
            if run.solve_s > dearest:
                break
    return rivals


def fastest(rivals: list[Rival], timed: dict[Run, float]) -> Run | None:
    """Return the fastest of some runs, by repeats of a few.

    They are those that are fast in one run each. ``timed`` has the least times that are known.
    """
    found = []
    for run, scene in sorted(rivals, key=lambda rival: rival.run.solve_s)[:FINALISTS]:
        if run not in timed:
            timed[run] = min(run.solve_s, least(scene, simulate.run(*scene)))
        found.append(run._replace(solve_s=timed[run]))
    return min(found, key=lambda run: run.solve_s, default=None)


def chosen_anew(asked: Simulation) -> AbstractHistory:
    """Return the run that is chosen without modes and bodies of earlier choices."""
    modes._kept.clear()
    shapes._kept.clear()
    stepped_run.Prepared.bodies = None
    return api.solve(*asked)


def rows_of(asked: Asked) -> Iterator[Row]:
    """Give one row per tolerance."""
    label, scene = asked.label, asked.scene
    reference = find(*scene)
    if reference is None:
        return
    bends = bool(beams_of(scene.scene))
    chosen: dict[float, tuple[AbstractHistory, Simulation, float, float]] = {}
    for tolerance in asked.tolerances:
        wanted = scene.but(tolerance=Tolerance(tolerance, asked.on))
        try:
            runs = [chosen_anew(wanted), chosen_anew(wanted)]
            runs += [chosen_anew(wanted) for _ in range(REPEATS if runs[1].cost.solve_s < LONGEST else 0)]
        except ImpactlabError as error:
            yield Row(
                label, tolerance, "none", False, 0.0, 0.0, 0.0, 0.0, 0.0, None, bends, f"refused: {error.text}"
            )  # fmt: skip
            continue
        choosing = min(run.choice.choosing_s for run in runs if run.choice is not None)
        assert runs[-1].choice is not None
        again = Simulation(runs[-1].scene, runs[-1].choice.method)  # as the others are measured
        chosen[tolerance] = runs[-1], again, least(again, simulate.run(*again)), choosing
    if not chosen:
        return
    rivals = others(asked, reference, max(1e-3, *(2.0 * solve for _, _, solve, _ in chosen.values())))
    timed: dict[Run, float] = {}
    scenes = {(rival.run.method, rival.run.size): rival.scene for rival in rivals}
    for tolerance, (history, again, longest, choosing) in chosen.items():
        choice = history.choice
        assert choice is not None
        keeping = [rival for rival in rivals if rival.run.error <= tolerance]
        bests = fastest(keeping, timed), fastest(steady(rivals, tolerance), timed)
        found = [each for each in bests if each is not None]
        solve, *times = in_turn([again, *(scenes[each.method, each.size] for each in found)], longest)
        best, lasting = (None if each is None else each._replace(solve_s=times.pop(0)) for each in bests)
        yield Row(
            label, tolerance, choice.chosen, choice.met, choice.expected_error,
            error_of(history, reference, asked), known_to(reference, asked), solve, choosing,
            best, bends, steady=lasting,
        )  # fmt: skip


def steady(rivals: list[Rival], tolerance: float) -> list[Rival]:
    """Return the runs that keep a tolerance, as do all finer ones.

    The finer ones are of the same method.
    """
    failed: dict[str, int] = {}
    for run, _ in rivals:
        if run.error > tolerance:
            failed[run.method] = max(run.size, failed.get(run.method, 0))
    return [rival for rival in rivals if rival.run.size > failed.get(rival.run.method, 0)]


HEADS = (
    "case", "tolerance", "chosen", "expected", "measured", "solve [ms]", "best other", "its [ms]", "choosing [ms]",
    "targets missed",
)  # fmt: skip


def cells_of(rows: list[Row]) -> Iterator[tuple[str, ...]]:
    """Give the cells of each row, by `HEADS`."""
    for row in rows:
        best = ("-", "-") if row.best is None else (_name(row.best), f"{1e3 * row.best.solve_s:.3g}")
        measured = "0" if row.measured < ROUNDING else f"{row.measured:.1e}"
        errors = (row.chosen, f"{row.expected:.1e}", measured, f"{1e3 * row.solve_s:.3g}")
        faults = "; ".join(row.faults) or "none"
        yield row.label, f"{row.tolerance:g}", *errors, *best, f"{1e3 * row.choosing_s:.3g}", faults


def write_rows(rows: list[Row], file: Path) -> None:
    """Write the rows as CSV."""
    with file.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows([HEADS, *cells_of(rows)])


def _name(run: Run) -> str:
    return run.method if run.method == "exact" else f"{run.method}, {run.size}"


def sentence(rows: list[Row]) -> str:
    """Return how many rows keep their tolerance."""
    served = [row for row in rows if not row.fault]
    stated = sum(row.measured <= row.expected + row.known + ROUNDING for row in served)
    return (
        f"Of {len(rows)} rows {len(rows) - len(served)} were refused. In {sum(row.met for row in served)} rows the "
        f"choice states that the tolerance is met. The measured error is within the tolerance in {_keeping(served)} of "
        f"these, and within the stated error in {stated}."
    )


def _keeping(served: list[Row]) -> int:
    return sum(row.measured <= row.tolerance + row.known for row in served if row.met)


def parts_of(rows: list[Row]) -> dict[str, list[Row]]:
    """Return the rows that were not refused by kind."""
    served = [row for row in rows if not row.fault]
    tried = [row for row in served if row.expected > ROUNDING]
    found = {
        "all": served,
        "exact solutions": [row for row in served if row.expected <= ROUNDING],
        "rods, stepped": [row for row in tried if not row.beams],
        "beams": [row for row in tried if row.beams],
    }
    return {name: part for name, part in found.items() if part}


def targets(rows: list[Row]) -> str:
    """Return the targets and their results as a Markdown table.

    Each target is met or not.
    """
    parts = parts_of(rows)
    served = parts["all"]
    held = sum(row.met for row in served)
    compared = {name: [row for row in part if row.known <= row.tolerance] for name, part in parts.items()}
    cheap = {name: [row.cost <= MAX_COST for row in part] for name, part in compared.items()}
    quick = [row.choosing <= MAX_CHOOSING for row in served]
    late, worst = sum(map(_is_late, served)), max(row.cost for row in compared["all"])
    left = len(served) - len(compared["all"])
    shares = "; ".join(f"{name}: {_share(cheap[name])}" for name in parts if name in ("rods, stepped", "beams"))
    lines = [
        ("The tolerance is met in every row", f"{_keeping(served)} of {held} rows", _keeping(served) == held),
        (
            f"Solving takes at most {MAX_COST:g} times as long as the best other run in {100.0 * OFTEN:g} % of rows, "
            "on rods and on beams",
            f"{_share(cheap['all'])} of rows ({shares}), without {left} rows whose reference uncertainty exceeds the "
            "tolerance",
            all(sum(each) >= OFTEN * len(each) for each in cheap.values()),
        ),
        (f"... and at most {WORST_COST:g} times in every row", f"largest: {worst:.1f} times", worst <= WORST_COST),
        (
            f"Choosing takes at most {MAX_CHOOSING:g} times as long as solving in {100.0 * OFTEN:g} % of rows",
            f"{_share(quick)} of rows",
            sum(quick) >= OFTEN * len(quick),
        ),
        (
            f"... and at most {1e3 * WORST_CHOOSING_S:g} ms where solving takes less than {1e3 * SHORT_S:g} ms",
            f"rows that take longer: {late}",
            late == 0,
        ),
    ]
    cells = [(target, result, "yes" if met else "**no**") for target, result, met in lines]
    return tables.table(("target", "result", "met"), cells, text=("target", "result", "met"))


def _is_late(row: Row) -> bool:
    return row.choosing_s > WORST_CHOOSING_S and row.solve_s < SHORT_S


def families_of(rows: list[Row]) -> dict[str, list[Row]]:
    """Return the rows of random scenes that were not refused, by family.

    Rows whose best run is not known, as their reference is less certain than the tolerance, are left out.
    """
    found = {
        words: [row for row in rows if row.label.split()[1] == family and not row.fault and row.known <= row.tolerance]
        for family, words in RANDOM.items()
    }
    return {words: part for words, part in found.items() if part}


def summary(parts: Mapping[str, list[Row]]) -> str:
    """Return cost and choosing by kind of row, as two Markdown tables.

    They are shares and quantiles.
    """
    solving, choosing = [], []
    for name, part in parts.items():
        solving.append((
            name, len(part), _share([row.cost <= MAX_COST for row in part]), f"{max(row.cost for row in part):.1f}",
            _share([row.steady_cost <= MAX_COST for row in part]), f"{max(row.steady_cost for row in part):.1f}",
        ))  # fmt: skip
        choosing.append((
            name, _share([row.choosing <= MAX_CHOOSING for row in part]),
            *(f"{np.percentile([row.choosing for row in part], share):.2g}" for share in (50, 90, 95, 100)),
            sum(map(_is_late, part)),
        ))  # fmt: skip
    heads = (
        ("rows", "number", "solving at most 2 x best", "largest ratio", "at most 2 x steady best", "largest ratio"),
        (
            "rows", "choosing at most 10 x solving", "median ratio", "90 %", "95 %", "largest",
            "above 20 ms, solving below 1 ms",
        ),
    )  # fmt: skip
    return "\n\n".join(tables.table(*each, text=("rows",)) for each in zip(heads, (solving, choosing), strict=True))


def _share(kept_by: list[bool]) -> str:
    return f"{100.0 * sum(kept_by) / len(kept_by):.1f} %"


def main() -> int:
    """Measure, print, and write the page where asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("cases", nargs="*", type=Path, help="case files; all in cases/ if none is given")
    parser.add_argument("--out", type=Path, help="page to write")
    parser.add_argument("--beams", action="store_true", help="the scenes with beams, beside cases that are given")
    parser.add_argument("--random", type=int, default=0, metavar="COUNT", help="random scenes of each family, too")
    parser.add_argument("--kept", type=Path, help="file of rows: goes on where an earlier measurement was stopped")
    given = parser.parse_args()
    rows: list[Row] = []
    known = given.kept.read_text(encoding="utf-8").splitlines() if given.kept and given.kept.exists() else []
    kept_rows = [Row.read(line) for line in known]
    cases = [] if given.beams and not given.cases else scenes(given.cases or sorted(CASES.glob("*.yaml")))
    for asked in [*cases, *([] if given.cases and not given.beams else beams()), *drawn(given.random)]:
        found = [row for row in kept_rows if row.label == asked.label] or list(rows_of(asked))
        if given.kept and not any(row.label == asked.label for row in kept_rows):
            with given.kept.open("a", encoding="utf-8") as stream:
                stream.writelines(row.written + "\n" for row in found)
        for row in found:
            rows.append(row)
            said = f"{row.solve_s:.2e} {row.chosen} | {row.best}; {'; '.join(row.faults) or 'ok'}"
            print(f"{asked.label:32} {row.tolerance:g} {said}", file=sys.stderr, flush=True)
    where = f"Least times of {REPEATS + 2} runs on one core of {processor()}; Python {platform.python_version()}."
    random = [row for row in rows if row.label.startswith("random ")]
    fitted = [row for row in rows if not row.label.startswith("random ")]
    results = {
        "sentence": sentence(fitted), "targets": targets(fitted), "summary": summary(parts_of(fitted)),
        "random": f"{sentence(random)}\n\n{summary(families_of(random))}" if random else "Not measured.",
        "machine": where,
    }  # fmt: skip
    print("\n\n".join(results.values()))
    if given.out is not None:
        given.out.write_text(tables.page(HEAD, results), encoding="utf-8")
        write_rows(rows, given.out.parent / ROWS)
    return 1 if any(row.measured > row.tolerance + row.known and row.met for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
