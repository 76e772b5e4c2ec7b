"""Measured errors of single runs against their estimates.

``python -m studies.error_equation [--count 400] [--seed 1]``

Random beams and rigid bodies of the audit (`studies.audit`) are run at three fineness, and again with the same modes
and much finer steps. The error by the steps that a run states (`impactlab.refine.errors.one_run`) is compared with the
distance of the two. Prints the table of docs/theory/error-estimates.md; writes no page.
"""

from __future__ import annotations

import argparse
import contextlib
import math
from collections.abc import Iterator

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.refine.descriptions.suitable import in_turn
from impactlab.refine.errors.distances import counted, distances
from impactlab.refine.errors.level_errors import resolves_contacts
from impactlab.refine.errors.one_run import error_alone
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate.driver import run
from studies.audit.families import draw
from studies.audit.measure import case_for, quiet

FINENESS = {"beam": (60, 110, 262), "rigid": (262, 700, 2000)}  # steps in the shortest time of the scene; in all
FINER = 12.7  # times as many steps: no step of one run ends with one of the other
MAX_STEPS = 6000  # of the coarser run
ONCE, AGAIN = "one touch", "several touches"


def rows_of(kind: str, seed: int, number: int) -> Iterator[tuple[str, float, float]]:
    """Yield touch, stated error and true error of a scene by fineness.

    The stated error is inf where there is none.
    """
    case = case_for(draw(kind, seed, number).doc)
    request = Simulation(*case.simulation())
    description = next((each for each in in_turn(request)[0] if math.isfinite(each.alone)), None)
    if description is None:
        return
    for fineness in FINENESS[kind]:
        if fineness < description.resolves or description.work(fineness)[0] > MAX_STEPS:
            continue
        made = Simulation(*description.simulation(fineness))
        history = run(*made, with_warnings=False)
        if not history.contacts or not resolves_contacts(history, made):
            continue
        stated = error_alone(history, request)
        finer = run(*made.but(step=StepRule(dt=history.dt / FINER)), with_warnings=False)
        apart = [each.pairs[0, 1] for each in distances((history, finer), *counted(request))]
        yield f"{kind}, " + (ONCE if len(history.contacts) == 1 else AGAIN), stated, max(apart)


def line(name: str, rows: list[tuple[str, float, float]]) -> str:
    """Return a line of the table."""
    found = np.array([true / stated for _, stated, true in rows if math.isfinite(stated)])
    numbers = [*np.quantile(found, (0.5, 0.99)), found.max()]
    return f"| {name} | {len(rows)} | {len(found)} | " + " | ".join(f"{each:.2f}" for each in numbers) + " |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    quiet()
    rows = []
    for kind in FINENESS:
        for number in range(given.count):
            with contextlib.suppress(ImpactlabError):  # a case that is refused
                rows += rows_of(kind, given.seed, number)
    print("| scenes | runs | that state an error | true/stated, median | 99 % | largest |")
    print("|---|---:|---:|---:|---:|---:|")
    for name in dict.fromkeys(row[0] for row in rows):
        print(line(name, [row for row in rows if row[0] == name]))


if __name__ == "__main__":
    main()
