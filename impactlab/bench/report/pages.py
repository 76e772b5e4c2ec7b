"""The page of a bench: findings, live diagram, rankings and figures over all scenes, tables of each scene."""

from __future__ import annotations

import collections
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import impactlab
from impactlab.bench.report import energy, overview
from impactlab.bench.report.automatic import automatic_sheet
from impactlab.bench.report.findings import certainty_words, findings
from impactlab.bench.report.live import bench_data
from impactlab.bench.report.method_styles import MethodStyles, power
from impactlab.bench.report.precision import precision
from impactlab.bench.report.scene_sheets import (
    Unfinished,
    convergence_sheet,
    families_sheet,
    front_sheet,
    slug,
    unfinished,
)
from impactlab.bench.report.sheets import Sheet, latex, markdown, short
from impactlab.bench.report.special import special_grids, special_summary
from impactlab.bench.report.summary_sheets import certainty, excluded, ranking_sheet, winners
from impactlab.bench.report.views import BOTH, CLOCKS, GOALS, NORMS, TOLERANCES, SceneRows, error, methods_of
from impactlab.bench.schema import STATUSES, Row
from impactlab.printing import counted
from impactlab.report.figures.figure_files import PageFigure, on_page, save
from impactlab.report.page import rendered
from impactlab.report.provenance import now

FOLDERS = ("figures", "tables")  # of a report
MIN_SCENES = 5  # below it a map and profiles over scenes show less than the tables
CLOCK_TABS = {"solve": "", "total": ", with set-up"}


def drawing(figure: PageFigure, folder: Path, formats: Sequence[str]) -> str:
    """Write the files of a figure into a folder, and return its SVG with the shades of the page and ids of its own."""
    svg = figure.write(folder, formats)
    for number, (_, colour, _) in enumerate(overview.SHADES):  # a dark page turns the ramp round
        svg = svg.replace(colour, f"var(--shade{number})")
    return re.sub(r'( id="|url\(#|href="#)([\w.-]+)', lambda found: f"{found[1]}{figure.name}-{found[2]}", svg)


def write_sheet(out: Path, sheet: Sheet) -> Sheet:
    """Write a sheet with rows as Markdown and LaTeX and return it."""
    if not sheet.rows:
        return sheet
    (out / "tables" / f"{sheet.name}.md").write_text(markdown(sheet), encoding="utf-8")
    (out / "tables" / f"{sheet.name}.tex").write_text(latex(sheet), encoding="utf-8")
    return sheet


REFERENCES = {
    "st_venant": "the exact solution, hard contact",
    "kelvin_voigt": "the exact solution, springs as written",
    "branches": "the exact solution, with links and cushions as written",
    "converged": "a converged solution",
}
MAP = (
    "Rows are methods, columns scenes. The stronger the colour of a field, the nearer is the method to the fastest "
    "that meets the tolerance in displacement and impulse there, by time to solve; a dot is the fastest itself."
)
PROFILE = (
    "For each method, the share of the scenes in which it meets the tolerance in displacement and impulse within a "
    "given multiple of the fastest method's time. High at the left: often the fastest; high at the right: reliable. "
    "Scenes that a method refuses or fails count as not met (performance profiles, Dolan and Moré 2002)."
)


def draw_scene(out: Path, formats: Sequence[str], styles: MethodStyles, scene: SceneRows) -> str:
    """Draw a scene's figures; return the one shown without a script.

    It is returned by name. That one alone, as SVG, unless formats are given: then those in every norm, of energy and of
    forces, too.
    """
    measured = [norm for norm in NORMS if any(error(row, norm, scene) is not None for row in scene.all_rows)]
    drawn = {f"precision_{slug(scene.name)}_{norm.name}": partial(precision, scene, norm, styles) for norm in measured}
    first = next(iter(drawn), "")
    if formats:
        if any(row.steps and row.energy_gain is not None for row in scene.rows):
            drawn[f"energy_{slug(scene.name)}"] = partial(energy.energy, scene, styles)
        if any(row.steps and row.force_oscillation is not None for row in scene.rows):
            drawn[f"oscillation_{slug(scene.name)}"] = partial(energy.oscillation, scene, styles)
    for name, draw in drawn.items():
        if formats or name == first:
            save(draw(), out / "figures", name, [*dict.fromkeys([*formats, "svg"])] if name == first else formats)
    return first


def _section(out: Path, scene: SceneRows, figure: str) -> dict[str, Any]:
    """Return a scene as it stands on the page; its rates of convergence stand in a file alone."""
    write_sheet(out, convergence_sheet(scene))
    return {
        "name": scene.name,
        "slug": slug(scene.name),
        "reference": _reference(scene),
        "figure": figure,
        "front": write_sheet(out, front_sheet(scene)),
        "families": write_sheet(out, families_sheet(scene)),
    }


def _reference(scene: SceneRows) -> str:
    if not scene.reference:
        return "no reference"
    uncertainty = f", uncertainty {short(scene.uncertainty)}" if scene.uncertainty else ""
    return f"against {REFERENCES.get(scene.reference, scene.reference)}{uncertainty}"


def write_index(
    out: Path,
    rows: Sequence[Row],
    scenes: Sequence[SceneRows],
    styles: MethodStyles,
    drawn: Sequence[str],
    formats: Sequence[str],
    command: str,
) -> None:
    """Write the page over all scenes with its tables and figures.

    Parameters
    ----------
    drawn : sequence of str
        Name of the figure of each scene (`draw_scene`).
    formats : sequence of str
        Formats of the figures as files, SVG if empty.
    command : str
        The command that repeats it, if known.
    """
    timed = any(row.solve_s is not None for row in rows)
    kinds = formats or ("svg",)
    maps, profiles = {}, {}  # by tab
    if len(scenes) >= MIN_SCENES:
        for t in TOLERANCES:
            draw = partial(overview.chart, scenes, BOTH, t)
            maps[f"tolerance {power(t)}"] = PageFigure(f"map_{t:g}", f"Map at {power(t)}", MAP, draw)
        for clock, tail in CLOCK_TABS.items():
            draw = partial(overview.profiles, scenes, BOTH, styles, clock)
            title = f"Performance profiles{tail}"
            profiles[f"time to solve{tail}"] = PageFigure(f"profiles_{clock}", title, PROFILE, draw)
    figures = [*maps.values(), *profiles.values()]
    entries, rules = on_page(figures, [drawing(each, out / "figures", kinds) for each in figures])
    page = {
        "counts": f"{counted(len(methods_of(scenes)), 'method')} on {counted(len(scenes), 'scene')}, {len(rows)} runs",
        "source": _source(rows),
        "version": impactlab.__version__,
        "date": now(),
        "command": command,
        "formats": ", ".join(kinds).upper(),
        "data": bench_data(scenes, styles),
        "timed": timed,
        "scenes": [_section(out, scene, figure) for scene, figure in zip(scenes, drawn, strict=True)],
        "findings": findings(scenes),
        "certainty_words": certainty_words(rows, scenes),
        "links": {scene.name: f"#{slug(scene.name)}" for scene in scenes},
        "winners": write_sheet(out, winners(scenes)),
        "certainty": write_sheet(out, certainty(scenes)),
        "rules": rules,
        "maps": dict(zip(maps, entries, strict=False)),
        "profiles": dict(zip(profiles, entries[len(maps) :], strict=True)),
        "rankings": [
            (f"{norm.title}{CLOCK_TABS[clock]}", write_sheet(out, ranking_sheet(scenes, norm, clock)))
            for clock in (CLOCKS if timed else ["solve"])
            for norm in GOALS
        ],
        "excluded": excluded(scenes, BOTH),
        "special": write_sheet(out, special_summary(scenes)),
        "special_all": write_sheet(out, special_grids(scenes)),
        "automatic": write_sheet(out, automatic_sheet(scenes)),
        "lost": _lost(scenes),
    }
    text = rendered("impactlab.bench.report", "index.html.j2", page=page)
    (out / "index.html").write_text(text, encoding="utf-8")


def _source(rows: Sequence[Row]) -> str:
    """Return code and versions that made the rows."""
    versions = [
        f"{name} {', '.join(values)}"
        for name in ("python", "numpy", "scipy", "numba")
        if (values := sorted({getattr(row, name) for row in rows} - {""}))
    ]
    codes = sorted({row.code for row in rows if row.code})
    return " · ".join([*(f"impactlab {code}" for code in codes[:3]), *versions])


def _lost(scenes: Sequence[SceneRows]) -> list[tuple[str, list[Unfinished], int]]:
    """Return the runs without a result by how they ended, the worst first."""
    found: dict[str, list[Unfinished]] = collections.defaultdict(list)
    for scene in scenes:
        for one in unfinished(scene):
            found[one.status].append(one)
    order = [status for status in reversed(STATUSES) if status in found]
    return [(status, found[status], sum(len(one.levels) for one in found[status])) for status in order]
