"""Writes docs/peers.md and its figure; nothing is measured here.

The results are those of `measure.py` and of the scans.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from benchmarks import tables
from benchmarks.peers.cases import CASES, NORMS
from benchmarks.peers.measure import OURS, PACKAGES, group_of, groups
from benchmarks.peers.scan import PEERS, load, read
from impactlab.report.figures.style import INK, MUTED, PALETTE, Margins, drawn, grid, label_lines, log_axis
from studies.pages import small_png

PAGE = """# Comparison with other programs

How long do other programs take to compute the same impact with the same error? Exudyn, MuJoCo and OpenSees are
general-purpose programs for multibody systems and structures, while impactlab is specialised in impacts of rods,
beams and mechanisms. The comparison covers only this one subject. All programs run on the same machine and core.
[Mechanisms: comparison with Exudyn](peers-mechanisms.md) has two arms that strike a stop.

Made by `python -m benchmarks.peers.compare --out docs/peers.md` with the `[peers]` extra; again from the measured
values with `--from docs/peers.json`. {machine};
{versions}.
{repeats} interleaved repeats, time of the processor in one thread: the least, and in brackets how far the middle one
lies above it. A run below 0.1 s follows an untimed one of the same program each time, so that none pays for caches that
another emptied. {noise}

## Aims

{verdicts}

Rods in a few Craig-Bampton coordinates or modes are computed beforehand and given to the programs as matrices, with
which they are faster than with any mesh. The eigenvalue problem is part of the set-up, which is not timed. A target
against Exudyn is met if it is met against the fastest way to use Exudyn.

## Time to reach an error

There are two cases. In *paper*, the impact of the 1999 paper, a mass as heavy as the rod makes two contacts in 0 to
3 T. In *two material*, a rod of steel and brass is struck by a mass of 0.8 kg; its elements have equal lengths, so no
step is exact on the whole mesh. A setting reaches an error if the following errors against the exact solution are all
below it:

- the displacement of the mass and of the face (relative, L2);
- the time of the first opening that lasts (in T);
- the velocity of the mass at the end (relative to its first one).

Each program is run at many settings, and the fastest that reaches the error is listed; errors that happen to cross
zero favour some settings. Set-up (meshes, modes, factors) is not timed. The other programs write no output while they
are timed; impactlab and the hand-written loops make their usual records.

{tables}

![Error against time](figures/peers.png)

The largest of the four errors against time, for all settings; lines connect the best ones. The error shown for the
exact solution is that of linear interpolation between the 6000 samples at which all solutions are compared.

## Same scheme, same mesh

The paper's case with the same number of steps. The contact of Exudyn is a spring, that of impactlab a Lagrange
multiplier. "mesh" gives the rod to Exudyn as one object with sparse matrices, "items" as point masses and springs.

{same}

## Against loops written by hand

Loops compiled by numba for one scheme, one law and this one impact, with per-element coefficients and the
same records (`benchmarks/step_loop.py`). Only the loops are compared; the part of a run that does not depend on
the number of steps takes another {fixed:.2f} ms.

{hand}

## How each was set, and why

The scans are `benchmarks/peers/scans/*.csv`, written by `python -m benchmarks.peers.scan`: every setting tried, its
time and its four errors.

{how}
"""


def write(results: dict[str, Any], out: Path, figure: bool = True) -> None:
    """Write the page and the figure beside it."""
    rows = results["to_an_error"]
    page = PAGE.format(
        machine=results["machine"],
        versions=", ".join(f"{name} {number or 'not installed'}" for name, number in results["versions"].items()),
        repeats=results["repeats"],
        noise=results["noise"],
        verdicts=verdicts(results),
        tables="\n\n".join(table(rows, name, tolerance) for name, tolerance in pairs(rows)),
        same=same(results),
        fixed=1e3 * results["fixed_s"],
        hand=hand(results["by_hand"]),
        how=how(),
    )
    out.write_text(page, encoding="utf-8")
    if figure:
        (out.parent / "figures").mkdir(exist_ok=True)
        drawn(draw)(out.parent / "figures" / "peers.png", rows)


def pairs(rows: list[dict[str, Any]]) -> list[tuple[str, float]]:
    """Return cases and tolerances in their order."""
    return list(dict.fromkeys((row["case"], row["tolerance"]) for row in rows))


def milliseconds(row: dict[str, Any]) -> str:
    """Return a time with its spread."""
    return f"{1e3 * row['solve_s']:.3g} ({1e3 * row['spread_s']:.2g})"


def told(setting: dict[str, Any]) -> str:
    """Return a setting in one line."""
    return ", ".join(
        str(value) if key in ("model", "scheme", "linear", "solver", "algorithm", "system") else f"{key} {value:g}"
        for key, value in setting.items()
    )


def table(rows: list[dict[str, Any]], case: str, tolerance: float) -> str:
    """Return one case and tolerance: programs, times, ratios to the exact description, errors, settings."""
    here = [row for row in rows if (row["case"], row["tolerance"]) == (case, tolerance)]
    base = next((row["solve_s"] for row in here if row["group"] == "impactlab, exact" and "solve_s" in row), math.nan)
    cells = []
    for row in here:
        if "reason" in row:
            cells.append((row["group"], *[""] * 6, row["reason"]))
            continue
        setting = told(row["setting"])
        if "chosen" in row:
            setting += f": {row['chosen']}, chosen in {1e3 * row['choosing_s']:.3g} ms"
        errors = (f"{row[norm]:.1e}" for norm in NORMS)
        cells.append((row["group"], milliseconds(row), f"{row['solve_s'] / base:.3g}", *errors, setting))
    heads = ("program", "ms", "to exact", "mass", "face", "opening", "exit", "setting")
    text = tables.table(heads, cells, text=("program", "setting"))
    return f"### {case.replace('_', ' ')}, {tolerance:g}\n\n{text}"


def verdict(met: bool) -> str:
    """Return met or missed."""
    return "**met**" if met else "**missed**"


def verdicts(results: dict[str, Any]) -> str:
    """Return the aims, the measured values, and whether they are met."""
    exact = results["exact_model"]
    error = exact["event_error"]
    aim = "exact model: all events of the paper's case to 1e-12 T"
    cells = [(aim, f"{error:.1e}", verdict(error <= 1e-12))]
    ratios = exact["ratios"]
    least = min(ratios.values(), default=math.nan)
    told_ratios = ", ".join(f"{name} {ratio:.3g}" for name, ratio in ratios.items()) or "no package program here"
    aim = "exact model: solved 30 times faster than the fastest package program reaches 5e-3"
    cells.append((aim, told_ratios, verdict(least >= 30.0)))
    for name, factor, text in (
        ("explicit", 25.0, "central difference, 400 elements: 25 times Exudyn's explicit"),
        ("implicit", 25.0, "Newmark, 1600 elements: 25 times Exudyn's generalised-alpha"),
    ):
        theirs = [row for row in results[name]["rows"] if row["peer"] == "exudyn"]
        found = ", ".join(f"{row['ratio']:.3g} ({way(row)})" for row in theirs) or "Exudyn is not installed"
        met = min((row["ratio"] for row in theirs), default=math.nan) >= factor
        cells.append((text, found, verdict(met)))
    for row in results["by_hand"]:
        text = f"{row['scheme']}, {row['elements']} elements: at most {row['aim']:g} times a loop by hand"
        cells.append((text, f"{row['ratio']:.2f}", verdict(row["ratio"] <= row["aim"])))
    return tables.table(("aim", "found", ""), cells, text=("aim", "found", ""))


def way(row: dict[str, Any]) -> str:
    """Return the label that distinguishes an Exudyn setting from its neighbours."""
    setting = row["setting"]
    if "spectral_radius" in setting:
        return f"spectral radius {setting['spectral_radius']:g}"
    return "mesh" if setting["model"] == "matrix" else str(setting["model"])


def same(results: dict[str, Any]) -> str:
    """Return the table of same schemes on same meshes."""
    cells = []
    for name in ("explicit", "implicit"):
        found = results[name]
        for row in found["rows"]:
            program = "impactlab" if row["peer"] == "impactlab" else "Exudyn"
            numbers = (milliseconds(row), f"{row['ratio']:.3g}", *(f"{row[norm]:.1e}" for norm in NORMS[:2]))
            cells.append((found["elements"], program, *numbers, told(row["setting"])))
    heads = ("elements", "program", "ms", "ratio", "mass", "face", "setting")
    return tables.table(heads, cells, text=("program", "setting"))


def hand(rows: list[dict[str, Any]]) -> str:
    """Return the table of loops by hand."""
    cells = []
    for row in rows:
        times = (f"{1e6 * row[name] / row['steps']:.3f}" for name in ("loop_s", "by_hand_s"))
        rest = (f"{row['ratio']:.2f}", f"{row['aim']:g}", f"{row['difference']:.1e}")
        cells.append((row["scheme"], row["elements"], *times, *rest))
    heads = ("scheme", "elements", "us per step", "by hand", "ratio", "aim", "largest difference of force")
    return tables.table(heads, cells, text=("scheme",))


def how() -> str:
    """Return the docstrings of the modules of the programs."""
    return "\n\n".join(f"### {load(name).NAME}\n\n{(load(name).__doc__ or '').strip()}" for name in PEERS)


def draw(path: Path, rows: list[dict[str, Any]]) -> None:
    """Draw the largest error against time per case, from the scans.

    The exact solution is drawn at its measured time.
    """
    figure, [panels] = grid(1, 2, 3.4, Margins(right=2.3, across=0.25), share=True)
    automatic = f"impactlab, {OURS['automatic']}"  # stands where what it chose stands
    shown = [(peer, group) for peer, group in groups() if group != automatic]
    packages = iter(PALETTE[1:2] + PALETTE[3:5] + PALETTE[6:])
    by_hand = iter((MUTED, "#a8b0ba", PALETTE[8]))
    ours = iter((INK, PALETTE[0], PALETTE[5], PALETTE[2]))
    colours = {group: next(ours if peer == "impactlab" else packages if peer in PACKAGES else by_hand)
               for peer, group in shown}  # fmt: skip
    for axis, case in zip(panels, CASES, strict=True):
        ends = []
        for peer, group in shown:
            line = front(peer, group, case)
            if not line:
                continue
            exact = [
                row["solve_s"] for row in rows if (row["case"], row["group"]) == (case, group) and "exact" in group
            ]
            if exact:
                line = [(1e3 * exact[0], line[0][1])]
            style = "-" if peer == "impactlab" else "--" if peer in PACKAGES else ":"
            marker, size = ("*", 9.0) if exact else ("o", 2.6)
            axis.loglog(*zip(*line, strict=True), style, marker=marker, markersize=size, color=colours[group], lw=1.3)
            ends.append((line[-1][1], group, colours[group]))
        axis.set_title(f"{case.replace('_', ' ')} case")
        axis.set_xlabel("time to solve  [ms]")
        axis.set_ylim(1e-7, 1.0)
        for limit in (5e-3, 1e-3):
            axis.axhline(limit, color=MUTED, linewidth=0.8, zorder=0.5)
        log_axis(axis.xaxis)
    panels[0].set_ylabel("largest of four errors")
    log_axis(panels[0].yaxis)
    label_lines(panels[1], ends)
    small_png(lambda: figure, path)


def front(peer: str, group: str, case: str) -> list[tuple[float, float]]:
    """Return times [ms] and largest errors on the Pareto front of a scan."""
    points = sorted(
        (1e3 * row["solve_s"], max(row[norm] for norm in NORMS))
        for row in read(peer)
        if row["case"] == case and group_of(peer, row["setting"]) == group
    )
    best: list[tuple[float, float]] = []
    for time, error in points:
        if math.isfinite(error) and (not best or error < best[-1][1]):
            best.append((time, max(error, 1e-7)))
    return best
