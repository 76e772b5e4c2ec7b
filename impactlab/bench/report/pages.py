"""The pages of a bench: one over all scenes, and one for each case with its figures in every norm."""

from __future__ import annotations

import collections
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import impactlab
from impactlab.bench.report import energy, overview
from impactlab.bench.report.automatic import automatic_sheet
from impactlab.bench.report.looks import Looks, power
from impactlab.bench.report.precision import precision
from impactlab.bench.report.scene_sheets import Unfinished, families_sheet, front_sheet, slug, unfinished
from impactlab.bench.report.sheets import Sheet, latex, markdown, short
from impactlab.bench.report.special import special_grids, special_summary
from impactlab.bench.report.summary_sheets import certainty, excluded, ranking_sheet, winners
from impactlab.bench.report.views import BOTH, CLOCKS, GOALS, NORMS, TOLERANCES, SceneRows, error, methods_of
from impactlab.bench.report.words import certainty_words, findings
from impactlab.bench.schema import STATUSES, Row
from impactlab.report.figure_files import inline, save
from impactlab.report.page import rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDERS = ("figures", "tables", "cases")  # of a report
MIN_SCENES = 5  # below it a map and profiles over scenes show less than the tables
CLOCK_TABS = {"solve": "", "total": ", with set-up"}


class Plate(NamedTuple):
    """A figure of a page."""

    name: str
    tab: str  # on its chooser
    title: str
    caption: str
    svg: str


def plate(out: Path, name: str, title: str, caption: str, figure: Figure, tab: str = "") -> Plate:
    """Save a figure as SVG and PNG and return it for a page."""
    svg = inline(save(figure, out / "figures", name), f"{title}. {caption}")
    for number, (_, colour, _) in enumerate(overview.SHADES):  # a dark page turns the ramp round
        svg = svg.replace(colour, f"var(--shade{number})")
    return Plate(name, tab, title, caption, lean(svg, name))


def lean(svg: str, name: str) -> str:
    """Return SVG with coordinates to a hundredth of a point, and ids of its own among other figures of a page."""
    body = re.sub(r"(\d+\.\d\d)\d+", r"\1", svg)
    body = re.sub(r'( id="|url\(#|href="#)([\w.-]+)', lambda m: f"{m[1]}{name}-{m[2]}", body)
    return re.sub(r"\n\s*", "\n", body)


def write_sheet(out: Path, sheet: Sheet) -> Sheet:
    """Write a sheet as Markdown and LaTeX and return it."""
    (out / "tables" / f"{sheet.name}.md").write_text(markdown(sheet), encoding="utf-8")
    (out / "tables" / f"{sheet.name}.tex").write_text(latex(sheet), encoding="utf-8")
    return sheet


PRECISION = (
    "Each line is a method through its levels, coarse to fine; further left and lower is better. Methods that lead in "
    "time, steps or unknowns are named, the others grey; dashed lines stand on the special grid dt = h/c, crosses are "
    "methods of the case file. Rings are the front of the methods with steps; an arrow at the floor is a solution "
    "without steps whose error lies below the axis."
)
ENERGY = (
    "The largest rise and fall of the energy balance of each run, over the reference energy. A line that does not fall "
    "with the step is a fault of the method itself."
)
OSCILLATION = (
    "The total variation of the force beyond that of the reference, in peaks, and its error away from its jumps."
)


REFERENCES = {
    "st_venant": "the exact solution, hard contact",
    "kelvin_voigt": "the exact solution, springs as written",
    "converged": "a converged solution",
}
MAP = (
    "Rows are methods, columns scenes. The stronger the colour of a field, the nearer is the method to the fastest "
    "that meets the tolerance in displacement and impulse there, by time to solve; a dot is the fastest itself."
)
PROFILE = (
    "For each method, in what share of the scenes it meets the tolerance in displacement and impulse within a given "
    "multiple of the fastest method's time. High at the left: often the fastest; high at the right: reliable. Scenes "
    "that a method refuses or fails count as not met (performance profiles, Dolan and Moré 2002)."
)


def write_case(out: Path, case: str, scenes: Sequence[SceneRows], look: Looks) -> None:
    """Write the page of a case with its figures and tables, one section per scene."""
    shown = []
    for scene in scenes:
        lost = unfinished(scene)
        section = {
            "name": scene.name,
            "slug": slug(scene.name),
            "reference": _reference(scene),
            "precision": _precision_plates(out, scene, look),
            "front": write_sheet(out, front_sheet(scene)),
            "families": write_sheet(out, families_sheet(scene)),
            "figures": _step_plates(out, scene, look),
            "lost": lost,
            "lost_count": sum(len(one.levels) for one in lost),
        }
        shown.append(section)
    text = rendered("impactlab.bench.report", "case.html.j2", page={"case": case, "scenes": shown})
    (out / "cases" / f"{case}.html").write_text(text, encoding="utf-8")


def _precision_plates(out: Path, scene: SceneRows, look: Looks) -> list[Plate]:
    """Draw the work-precision figures in the norms in which any run has an error."""
    plates = []
    for norm in NORMS:
        if any(error(row, norm, scene) is not None for row in scene.all_rows):
            name, title = f"precision_{slug(scene.name)}_{norm.name}", f"Work and precision, {norm.title}"
            plates.append(plate(out, name, title, PRECISION, precision(scene, norm, look), norm.title))
    return plates


def _step_plates(out: Path, scene: SceneRows, look: Looks) -> list[Plate]:
    """Draw the figures of energy and force against steps, as far as the table has such numbers."""
    plates = []
    if any(row.steps and row.energy_gain is not None for row in scene.rows):
        figure = energy.energy(scene, look)
        plates.append(plate(out, f"energy_{slug(scene.name)}", "Energy gained and lost", ENERGY, figure))
    if any(row.steps and row.force_oscillation is not None for row in scene.rows):
        figure = energy.oscillation(scene, look)
        plates.append(plate(out, f"oscillation_{slug(scene.name)}", "Oscillation of the force", OSCILLATION, figure))
    return plates


def _reference(scene: SceneRows) -> str:
    if not scene.reference:
        return "no reference"
    uncertainty = f", uncertainty {short(scene.uncertainty)}" if scene.uncertainty else ""
    return f"against {REFERENCES.get(scene.reference, scene.reference)}{uncertainty}"


def write_index(out: Path, rows: Sequence[Row], scenes: Sequence[SceneRows], look: Looks) -> None:
    """Write the page over all scenes with its figures and tables."""
    maps, profiles = [], []
    many = len(scenes) >= MIN_SCENES
    for t in TOLERANCES if many else ():
        figure = overview.chart(scenes, BOTH, t)
        maps.append(plate(out, f"map_{t:g}", f"Map at {power(t)}", MAP, figure, f"tolerance {power(t)}"))
    for clock, tail in CLOCK_TABS.items() if many else ():
        figure, title = overview.profiles(scenes, BOTH, look, clock), f"Performance profiles{tail}"
        profiles.append(plate(out, f"profiles_{clock}", title, PROFILE, figure, f"time to solve{tail}"))
    page = {
        "counts": f"{counted(len(methods_of(scenes)), 'method')} on {counted(len(scenes), 'scene')}, {len(rows)} runs",
        "source": _source(rows),
        "version": impactlab.__version__,
        "findings": findings(scenes),
        "certainty_words": certainty_words(rows, scenes),
        "links": {scene.name: f"cases/{scene.case}.html#{slug(scene.name)}" for scene in scenes},
        "winners": write_sheet(out, winners(scenes)),
        "certainty": write_sheet(out, certainty(scenes)),
        "maps": maps,
        "profiles": profiles,
        "rankings": [
            (f"{norm.title}{CLOCK_TABS[clock]}", write_sheet(out, ranking_sheet(scenes, norm, clock)))
            for clock in CLOCKS
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


def counted(number: int, noun: str) -> str:
    """Return a number with its noun: ``1 scene``, ``2 scenes``."""
    return f"{number} {noun}{'s' if number != 1 else ''}"


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
