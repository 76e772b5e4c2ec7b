"""Runs random cases with a tolerance beside independent programs: ``python -m studies audit``.

Options: ``--count N`` cases of each family, ``--seed S``, ``--families a,b`` (also ``scan`` and ``scan_rods``, which
have no seed), ``--first N``, the number of the first one, ``--jobs J``, ``--out FILE`` (one row of CSV a run),
``--refs`` for converged references in place of runs, ``--cost-only`` to leave the truth out (to measure another
version of the package on the same cases). Without a run: ``--show FAMILY NUMBER`` prints one case as JSON; ``--page
FILE`` fills the tables of docs/audit.md from the rows of ``--out``, with ``--refs`` those of the references;
``--before FILE`` adds the cost of another version, and ``--keep FILE`` writes the cells that the tables need.
"""

from __future__ import annotations

import argparse
import csv
import json
import multiprocessing
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from studies.audit import references, scenes, summary
from studies.audit.families import FAMILIES, FIXED, draw
from studies.audit.measure import COLUMNS, measured, quiet, timed
from studies.pages import Study


def cases(families: list[str], seed: int, count: int, first: int = 0) -> Iterator[scenes.Drawn]:
    """Give the cases of all families, in turns."""
    for name in families:
        if name in FIXED:
            yield from FIXED[name]()
    for number in range(first, first + count):
        for name in families:
            if name not in FIXED:
                yield draw(name, seed, number)


def written(row: dict[str, Any]) -> dict[str, Any]:
    """Return a row with as many digits as are read."""
    return {name: f"{value:.4g}" if isinstance(value, float) else value for name, value in row.items()}


def run(options: argparse.Namespace, families: list[str]) -> list[dict[str, Any]]:
    """Run all cases and write their rows as they come."""
    rows = []
    work, columns = (references.claimed, references.COLUMNS) if options.refs else (measured, COLUMNS)
    work = timed if options.cost_only else work
    with Path(options.out).open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, columns)
        writer.writeheader()
        drawn = cases(families, options.seed, options.count, options.first)
        with multiprocessing.get_context("spawn").Pool(options.jobs, maxtasksperchild=500) as pool:
            for row in pool.imap(work, drawn, chunksize=3):
                rows.append(written(row))
                writer.writerow(rows[-1])
                stream.flush()
    return rows


def fill(options: argparse.Namespace) -> None:
    """Fill the tables of the page from rows of before."""
    page, rows = Path(options.page), summary.load(Path(options.out))
    if options.refs:
        summary.fill(page, "references", references.table(rows))
        return
    summary.fill(page, "tolerances", summary.table(rows))
    said = [f"- {line}" for line in summary.worst(rows)] or ["No run is beyond its tolerance."]
    summary.fill(page, "beyond", "\n".join(said))
    if options.keep:
        summary.keep(rows, Path(options.keep))
    if options.before:
        summary.fill(page, "cost", summary.cost(rows, summary.load(Path(options.before))))


def command(arguments: Sequence[str]) -> int:
    """Run the cases, or fill the page from rows of before."""
    parser = argparse.ArgumentParser(prog="python -m studies audit", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", default="audit.csv")
    parser.add_argument("--refs", action="store_true")
    parser.add_argument("--cost-only", action="store_true")
    parser.add_argument("--show", nargs=2, metavar=("FAMILY", "NUMBER"))
    parser.add_argument("--page")
    parser.add_argument("--before")
    parser.add_argument("--keep")
    options = parser.parse_args(arguments)
    quiet()
    if options.show:
        family, place = options.show[0], int(options.show[1])
        drawn = list(FIXED[family]())[place] if family in FIXED else draw(family, options.seed, place)
        print(json.dumps(drawn.doc, indent=1))
        return 0
    if options.page:
        fill(options)
        return 0
    rows = run(options, options.families.split(","))
    if options.before:
        print(summary.cost(rows, summary.load(Path(options.before))))
    told = references if options.refs else summary
    print(told.table(rows))
    print("\n".join(told.worst(rows)))
    return 0


STUDY = Study({}, command=command)
