"""docs/peers-mechanisms.md: two arms that strike a stop, in impactlab and Exudyn: work against precision.

    python -m benchmarks.peers.arms_compare --scan
    python -m benchmarks.peers.arms_compare --out docs/peers-mechanisms.md [--repeats 15]
    python -m benchmarks.peers.arms_compare --out docs/peers-mechanisms.md --from docs/peers-mechanisms.json

The first tries all settings and keeps them in ``scans/arms.csv``; the second times the best of them again, in turns,
and writes the page; the third writes the page from the measured values.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from benchmarks import tables
from benchmarks.peers import arms, exudyn_peer, impactlab_peer
from benchmarks.peers.arms import ARMS, FINEST, Arm, build, errors_of, settings
from benchmarks.peers.measure import interleaved
from benchmarks.peers.page import milliseconds, told, verdict
from benchmarks.peers.run import timed
from benchmarks.peers.scan import FOLDER
from impactlab.bench.environment import processor
from impactlab.report.figures.style import INK, MUTED, PALETTE, Margins, drawn, grid, label_lines, log_axis
from studies.pages import small_png

PROGRAMS = {"impactlab": "impactlab", "exudyn": "Exudyn"}
SCAN = FOLDER / "arms.csv"
TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4)
AIMED = 1e-3
CANDIDATES = 5  # of each program: the quickest of the scan may owe its place to noise
FINENESS = {"impactlab": ("modes", "axial_modes", "dt"), "exudyn": ("elements", "dt")}
GROUPS = ("impactlab", "Exudyn", "Exudyn, tolerance 1e-6")
PAGE = """# Mechanisms: comparison with Exudyn

Two arms strike a stop, in impactlab and in Exudyn, a general-purpose C++ program for flexible multibody systems. The
tables list the time to reach an error in the impulses of the first two sub-impacts, that is, in the larger of their two
relative errors. The cases are [two_link_arm](../cases/two_link_arm.yaml), up to {two} ms, and
[arm_on_stop](../cases/arm_on_stop.yaml), up to {one} ms. Impacts on rods: [comparison
with other programs](peers.md).

Made by `python -m benchmarks.peers.arms_compare --out docs/peers-mechanisms.md` with the `[peers]` extra; again from
what was measured with `--from docs/peers-mechanisms.json`. {machine}; {versions}.
{repeats} interleaved repeats on a shared machine: the least processor time of one thread, and in
brackets how far the median lies above it. Set-up (meshes, shapes, integrals, assembly) is not in the times. Exudyn
writes nothing while timed; impactlab records everything it always does.

{verdicts}

## Do they agree?

Both converge to the same impulses. The error of a setting is therefore measured against the finest run of its own
program.

{agreement}

## Time to reach an error

The fastest setting of each program. Errors of mesh and step may cancel: the fastest setting of Exudyn on the arm has 22
elements, while 24 at the same step have an error of {unlucky}; that of impactlab on the two-link arm neglects the axial
strain of the link, which costs 0.003 at short steps. Rows marked "kept" exclude this: the error also stays below 0.001
with more shapes or elements, with a shorter step, and with both.

{tables}

![Error against time](figures/peers-mechanisms.png)

All settings as points; lines connect the best. With too few shapes or elements the second sub-impact is wrong at any
step: errors stay near 1e-2.

## How each was set, and why

The scan is `benchmarks/peers/scans/arms.csv`, written with `--scan`: every setting tried, its time and its error.

- impactlab: the midpoint rule, its default record, Hertz contact. Scanned: bending and axial shapes, step.
- Exudyn: {cables}
- Exudyn's fast build, one thread, no files; generalised-alpha with fixed steps and modified Newton. Scanned: elements,
  step, spectral radius, tolerance of Newton's method, sparse and dense solver. Newton's method ends by the size of its
  last correction: with the residual, a relative tolerance of 1e-6 is not reached behind a joint, by rounding. The
  sparse solver is 1.2 to 2 times faster than the dense one, from 16 elements on. Tolerances of 1e-4 and 1e-3 save
  corrections; the tables have the best of all tolerances and, apart, the best at 1e-6.
- Explicit schemes of Exudyn were tried on the arm. They need steps of 1 µs for 24 elements, and the second impulse came
  out 10 % too large; they are not in the scan.
"""


def scan() -> None:
    """Try every setting of both programs on both arms, and keep times and errors."""
    with SCAN.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("case", "program", "setting", "solve_s", "error", "status"))
        for arm in ARMS.values():
            for program in PROGRAMS:
                true = finest(program, arm)
                for setting in settings(program, arm):
                    writer.writerow((arm.name, program, json.dumps(setting), *tried(program, arm, setting, true)))
                file.flush()


def finest(program: str, arm: Arm) -> list[float]:
    """Return the impulses of the finest run of a program [N s]."""
    run = build(program, arm, FINEST[program], record=True)
    run.solve()
    return run.outcome()[:2]


def tried(program: str, arm: Arm, setting: dict[str, Any], true: list[float]) -> tuple[str, str, str]:
    """Return time [s], error and status of a setting."""
    try:
        run = build(program, arm, setting, record=True)
        run.solve()
        error = errors_of(run.outcome(), true)
        return f"{timed(build(program, arm, setting, record=False))[0]:.4g}", f"{error:.4g}", "completed"
    except Exception as fault:  # noqa: BLE001 - a program may fail in any way; the reason is kept
        return "", "", f"{type(fault).__name__}: {fault}".splitlines()[0][:120]


def read() -> list[dict[str, Any]]:
    """Return the rows of the scan that completed."""
    with SCAN.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["status"] == "completed"]
    return [
        row | {"setting": json.loads(row["setting"]), "solve_s": float(row["solve_s"]), "error": float(row["error"])}
        for row in rows
    ]


def group_of(row: dict[str, Any]) -> str:
    """Return the line of a table that a setting belongs to."""
    tight = row["program"] == "exudyn" and row["setting"]["tolerance"] <= 1e-6
    return PROGRAMS[row["program"]] + (", tolerance 1e-6" if tight else "")


def stays(rows: list[dict[str, Any]], row: dict[str, Any], tolerance: float) -> bool:
    """Return whether finer shapes or meshes and shorter steps keep a tolerance.

    The next ones are compared, one by one and all together. Options with one value in the scan stay as they are.
    """
    names, given = FINENESS[row["program"]], row["setting"]
    shared = {name: value for name, value in given.items() if name not in names}
    errors = {
        tuple(each["setting"][name] for name in names): each["error"]
        for each in rows
        if each["program"] == row["program"] and shared.items() <= each["setting"].items()
    }
    finer = []
    for at, name in enumerate(names):
        values = sorted({key[at] for key in errors}, reverse=name == "dt")
        here = values.index(given[name])
        if here == len(values) - 1 and here > 0:
            return False
        finer.append(values[here : here + 2])
    return all(errors.get(key, math.inf) <= tolerance for key in product(*finer))


def measured(repeats: int) -> dict[str, Any]:
    """Return everything that the page shows.

    The best settings of the scan are timed again, in turns.
    """
    jobs: dict[tuple[str, str], dict[str, Any]] = {}
    chosen: list[tuple[str, float, bool, str, list[tuple[str, str]]]] = []
    wanted = [*((tolerance, False) for tolerance in TOLERANCES), (AIMED, True)]
    for name in ARMS:
        here = [row for row in read() if row["case"] == name]
        for (tolerance, kept), group in product(wanted, GROUPS):
            rows = [row for row in here if row["error"] <= tolerance and group_of(row).startswith(group)]
            rows = [row for row in rows if not kept or stays(here, row, tolerance)]
            best = sorted(rows, key=lambda row: float(row["solve_s"]))[:CANDIDATES]
            keys = [(name, json.dumps(row["setting"])) for row in best]
            jobs |= dict(zip(keys, best, strict=True))
            chosen.append((name, tolerance, kept, group, keys))
    times: dict[tuple[str, str], dict[str, Any]] = {}
    for name in ARMS:
        here = [key for key in jobs if key[0] == name]
        builds = [partial(build, jobs[key]["program"], ARMS[name], jobs[key]["setting"], record=False) for key in here]
        times |= dict(zip(here, interleaved(builds, repeats), strict=True))
    rows = []
    for name, tolerance, kept, group, keys in chosen:
        if keys:
            least = min(keys, key=lambda key: times[key]["solve_s"])
            found = {"setting": jobs[least]["setting"], "error": jobs[least]["error"], **times[least]}
            rows.append({"case": name, "tolerance": tolerance, "kept": kept, "group": group, **found})
    return {
        "machine": f"{processor()}, {os.cpu_count()} cores",
        "versions": {"impactlab": impactlab_peer.version(), "Exudyn": exudyn_peer.version()},
        "repeats": repeats,
        "impulses": {name: {program: finest(program, arm) for program in PROGRAMS} for name, arm in ARMS.items()},
        "rows": rows,
    }


def spent(results: dict[str, Any], name: str, tolerance: float, kept: bool, group: str) -> float:
    """Return the time of a group to a tolerance [s].

    It is NaN where no setting of the scan reaches it.
    """
    wanted = {"case": name, "tolerance": tolerance, "kept": kept, "group": group}
    found = (row["solve_s"] for row in results["rows"] if wanted.items() <= row.items())
    return float(next(found, math.nan))


def verdicts(results: dict[str, Any]) -> str:
    """Return the aims and whether they are met.

    They are to reach the error and to keep it, by any Exudyn and by a tight one.
    """
    cells = []
    for arm, kept, group in product(ARMS.values(), (False, True), GROUPS[1:]):
        ratio = spent(results, arm.name, AIMED, kept, group) / spent(results, arm.name, AIMED, kept, GROUPS[0])
        aim = f"{arm.name}: {AIMED:g} {'kept' if kept else 'reached'} {arm.aim:g} times faster than by {group}"
        none = math.isnan(ratio)
        cells.append((aim, "" if none else f"{ratio:.3g}", "its scan has none" if none else verdict(ratio >= arm.aim)))
    return tables.table(("aim", "found", ""), cells, text=("aim", ""))


def unlucky(results: dict[str, Any]) -> float:
    """Return the error of Exudyn with the next more elements than its best.

    The arm is ``arm_on_stop``.
    """
    wanted = {"case": "arm_on_stop", "tolerance": AIMED, "kept": False, "group": "Exudyn"}
    best = next(row["setting"] for row in results["rows"] if wanted.items() <= row.items())
    next_one = best | {"elements": best["elements"] + 2}
    return float(next(row["error"] for row in read() if row["case"] == "arm_on_stop" and row["setting"] == next_one))


def agreement(results: dict[str, Any]) -> str:
    """Return the impulses of the finest runs."""
    cells = []
    for name, found in results["impulses"].items():
        for number, pair in enumerate(zip(found["impactlab"], found["exudyn"], strict=True), start=1):
            ours, theirs = pair
            cells.append((name, number, f"{ours:.7f}", f"{theirs:.7f}", f"{abs(theirs / ours - 1.0):.1e}"))
    heads = ("case", "sub-impact", "impactlab [N s]", "Exudyn [N s]", "difference")
    text = tables.table(heads, cells, text=("case",))
    return f"{text}\n\nimpactlab with {told(dict(FINEST['impactlab']))}; Exudyn with {told(dict(FINEST['exudyn']))}."


def table(results: dict[str, Any], name: str) -> str:
    """Return the table of an arm."""
    cells = []
    for row in results["rows"]:
        if row["case"] == name:
            ratio = row["solve_s"] / spent(results, name, row["tolerance"], row["kept"], "impactlab")
            numbers = (milliseconds(row), f"{ratio:.3g}", f"{row['error']:.1e}")
            reached = f"{row['tolerance']:g}" + (", kept" if row["kept"] else "")
            cells.append((reached, row["group"], *numbers, told(row["setting"])))
    heads = ("reached", "program", "ms", "ratio", "error", "setting")
    return f"### {name}\n\n{tables.table(heads, cells, text=('program', 'setting'))}"


def draw(path: Path) -> None:
    """Draw error against time: all settings of the scan, the best of each program joined."""
    figure, [panels] = grid(1, 2, 3.2, Margins(right=0.8, across=0.3), share=True)
    rows = read()
    for axis, name in zip(panels, ARMS, strict=True):
        ends = []
        for program, colour in zip(PROGRAMS, PALETTE, strict=False):
            points = sorted(
                (1e3 * row["solve_s"], row["error"])
                for row in rows
                if (row["case"], row["program"]) == (name, program) and math.isfinite(row["error"])
            )
            best: list[tuple[float, float]] = []
            for point in points:
                if not best or point[1] < best[-1][1]:
                    best.append(point)
            axis.loglog(*zip(*points, strict=True), "o", markersize=1.6, color=colour, alpha=0.35, markeredgewidth=0)
            axis.loglog(*zip(*best, strict=True), "o-", markersize=2.8, color=colour, lw=1.4)
            ends.append((best[-1][1], PROGRAMS[program], colour))
        axis.axhline(AIMED, color=MUTED, linewidth=0.8, zorder=0.5)
        axis.set_title(name.replace("_", " "), color=INK)
        axis.set_xlabel("time to solve  [ms]")
        axis.set_ylim(1e-6, 1.0)
        log_axis(axis.xaxis)
    panels[0].set_ylabel("larger of two errors")
    log_axis(panels[0].yaxis)
    label_lines(panels[1], ends)
    small_png(lambda: figure, path)


def write(results: dict[str, Any], out: Path, figure: bool = True) -> None:
    """Write the page and its figure."""
    page = PAGE.format(
        two=f"{1e3 * ARMS['two_link_arm'].duration:g}",
        one=f"{1e3 * ARMS['arm_on_stop'].duration:g}",
        machine=results["machine"],
        unlucky=f"{unlucky(results):.1g}",
        versions=", ".join(f"{name} {number}" for name, number in results["versions"].items()),
        repeats=results["repeats"],
        verdicts=verdicts(results),
        agreement=agreement(results),
        tables="\n\n".join(table(results, name) for name in ARMS),
        cables=" ".join((arms.exudyn.__doc__ or "").split("\n\n", 1)[1].split()),
    )
    out.write_text(page, encoding="utf-8")
    if figure:
        drawn(draw)(out.parent / "figures" / "peers-mechanisms.png")


def main() -> None:
    """Scan, or measure or read and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--scan", action="store_true", help="try all settings, and nothing else")
    parser.add_argument("--out", type=Path, default=Path("docs/peers-mechanisms.md"))
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--from", dest="source", type=Path, help="JSON of an earlier run: nothing is measured")
    given = parser.parse_args()
    with threadpool_limits(limits=1):
        if given.scan:
            scan()
            return
        results = json.loads(given.source.read_text("utf-8")) if given.source else measured(given.repeats)
    if given.source is None:
        given.out.with_suffix(".json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    write(results, given.out)


if __name__ == "__main__":
    main()
