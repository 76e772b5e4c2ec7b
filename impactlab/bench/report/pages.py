"""The pages of a bench: one over all scenes, and one for each case with its figures in every norm."""

from __future__ import annotations

import collections
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from impactlab.bench.report import energy, overview
from impactlab.bench.report.automatic import automatic_sheet
from impactlab.bench.report.looks import Look, power
from impactlab.bench.report.precision import precision
from impactlab.bench.report.scene_sheets import Unfinished, families_sheet, front_sheet, slug, unfinished
from impactlab.bench.report.sheets import Sheet, latex, markdown, short
from impactlab.bench.report.special import special_grids, special_summary
from impactlab.bench.report.summary_sheets import certainty, excluded, ranking_sheet, winners
from impactlab.bench.report.views import BOTH, CLOCKS, GOALS, NORMS, TOLERANCES, Norm, SceneRows, error, methods_of
from impactlab.bench.report.words import certainty_words, findings
from impactlab.bench.schema import STATUSES, Row
from impactlab.report.page import rendered
from impactlab.report.style import inline, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CLOCK_TABS = {"solve": "", "total": ", with set-up"}


class Drawn(NamedTuple):
    """A figure as it stands on a page."""

    name: str
    tab: str  # on its chooser
    title: str
    caption: str
    svg: str


def drawn(folder: Path, name: str, tab: str, title: str, caption: str, figure: Figure) -> Drawn:
    """Save a figure as SVG and PNG and return it as it stands on a page."""
    return Drawn(name, tab, title, caption, lean(inline(save(figure, folder, name), f"{title}. {caption}"), name))


def lean(svg: str, name: str) -> str:
    """Return SVG with coordinates to a hundredth of a point, and ids of its own among other figures of a page."""
    body = re.sub(r"(\d+\.\d\d)\d+", r"\1", svg)
    body = re.sub(r'( id="|url\(#|href="#)([\w.-]+)', lambda m: f"{m[1]}{name}-{m[2]}", body)
    return re.sub(r"\n\s*", "\n", body)


def write_sheet(folder: Path, sheet: Sheet) -> Sheet:
    """Write a sheet as Markdown and LaTeX and return it."""
    (folder / f"{sheet.name}.md").write_text(markdown(sheet), encoding="utf-8")
    (folder / f"{sheet.name}.tex").write_text(latex(sheet), encoding="utf-8")
    return sheet


class Folders(NamedTuple):
    """Where figures, tables and pages of cases go."""

    out: Path

    @property
    def figures(self) -> Path:
        """Return the folder of figures."""
        return self.out / "figures"

    @property
    def tables(self) -> Path:
        """Return the folder of tables."""
        return self.out / "tables"

    @property
    def cases(self) -> Path:
        """Return the folder of the pages of cases."""
        return self.out / "cases"


PRECISION = (
    "Each line is a method through its levels, coarse to fine; further left and lower is better. Methods that lead in "
    "time, steps or unknowns are named, the others grey; dashed lines stand on the special grid dt = h/c, crosses are "
    "methods that the case brings along. Rings are the front of the methods with steps; an arrow at the floor is an "
    "answer without steps, its error below the axis."
)
ENERGY = (
    "The largest rise and fall of the energy balance of each run, over the reference energy. A line that does not fall "
    "with the step is a fault of the method itself."
)
OSCILLATION = (
    "How much more the force goes up and down than that of the reference, in peaks, and its error away from its jumps."
)


def write_case(folders: Folders, case: str, scenes: Sequence[SceneRows], look: Mapping[str, Look]) -> None:
    """Write the page of a case with its figures and tables, one section per scene."""
    shown = [_section(folders, scene, look) for scene in scenes]
    text = rendered("impactlab.bench.report", "case.html.j2", page={"case": case, "scenes": shown})
    (folders.cases / f"{case}.html").write_text(text, encoding="utf-8")


def _section(folders: Folders, scene: SceneRows, look: Mapping[str, Look]) -> dict[str, Any]:
    name, lost = slug(scene.name), unfinished(scene)
    measured = [norm for norm in NORMS if any(error(row, norm, scene) is not None for row in scene.all_rows)]
    figures = []
    if any(row.steps and row.energy_gain is not None for row in scene.rows):
        figures.append(
            drawn(folders.figures, f"energy_{name}", "", "Energy gained and lost", ENERGY, energy.energy(scene, look))
        )
    if any(row.steps and row.force_oscillation is not None for row in scene.rows):
        figure = energy.oscillation(scene, look)
        figures.append(drawn(folders.figures, f"oscillation_{name}", "", "Forces that swing", OSCILLATION, figure))
    return {
        "name": scene.name,
        "slug": name,
        "reference": _reference(scene),
        "precision": [_plate(folders, scene, norm, look) for norm in measured],
        "front": write_sheet(folders.tables, front_sheet(scene)),
        "families": write_sheet(folders.tables, families_sheet(scene)),
        "figures": figures,
        "lost": lost,
        "lost_count": sum(len(one.levels) for one in lost),
    }


def _plate(folders: Folders, scene: SceneRows, norm: Norm, look: Mapping[str, Look]) -> Drawn:
    name = f"precision_{slug(scene.name)}_{norm.name}"
    title = f"Work and precision, {norm.title}"
    return drawn(folders.figures, name, norm.title, title, PRECISION, precision(scene, norm, look))


def _reference(scene: SceneRows) -> str:
    if not scene.reference:
        return "no reference"
    sure = f", sure to {short(scene.uncertainty)}" if scene.uncertainty else ""
    return f"against {REFERENCES.get(scene.reference, scene.reference)}{sure}"


REFERENCES = {
    "st_venant": "the exact answer, hard contact",
    "kelvin_voigt": "the exact answer, springs as written",
    "converged": "a converged answer",
}
MAP = (
    "Rows are methods, columns scenes. The darker a field, the nearer is the method to the fastest that meets the "
    "tolerance in displacement and impulse there, by time to solve; a white dot is the fastest itself."
)
PROFILE = (
    "For each method, in what share of the scenes it meets the tolerance in displacement and impulse within a given "
    "multiple of the fastest method's time. High at the left: often the fastest; high at the right: reliable. Scenes "
    "that a method refuses or fails count as not met (performance profiles, Dolan and Moré 2002)."
)


def write_index(folders: Folders, rows: Sequence[Row], scenes: Sequence[SceneRows], look: Mapping[str, Look]) -> None:
    """Write the page over all scenes with its figures and tables."""
    figures, tables = folders.figures, folders.tables
    maps = [
        drawn(
            figures, f"map_{t:g}", f"tolerance {power(t)}", f"Map at {power(t)}", MAP, overview.chart(scenes, BOTH, t)
        )
        for t in TOLERANCES
    ]
    profiles = [
        drawn(figures, f"profiles_{clock}", f"time to solve{tail}", f"Performance profiles{tail}", PROFILE, figure)
        for clock, tail in CLOCK_TABS.items()
        for figure in [overview.profiles(scenes, BOTH, look, clock)]
    ]
    rankings = [
        (f"{norm.title}{CLOCK_TABS[clock]}", write_sheet(tables, ranking_sheet(scenes, norm, clock)))
        for clock in CLOCKS
        for norm in GOALS
    ]
    page = {
        "counts": f"{len(methods_of(scenes))} methods on {len(scenes)} scenes, {len(rows)} runs",
        "source": _source(rows),
        "findings": findings(scenes),
        "certainty_words": certainty_words(rows, scenes),
        "links": {scene.name: f"cases/{scene.case}.html#{slug(scene.name)}" for scene in scenes},
        "winners": write_sheet(tables, winners(scenes)),
        "certainty": write_sheet(tables, certainty(scenes)),
        "maps": maps,
        "profiles": profiles,
        "rankings": rankings,
        "excluded": excluded(scenes, BOTH),
        "special": write_sheet(tables, special_summary(scenes)),
        "special_all": write_sheet(tables, special_grids(scenes)),
        "automatic": write_sheet(tables, automatic_sheet(scenes)),
        "lost": _lost(scenes),
        "commands": ("impactlab bench --out DIR", "impactlab bench --from DIR/table.csv --out DIR"),
        "files": (("table.csv", "all rows, all digits"), ("tables/", "Markdown, LaTeX"), ("figures/", "SVG, PNG")),
    }
    text = rendered("impactlab.bench.report", "index.html.j2", page=page)
    (folders.out / "index.html").write_text(text, encoding="utf-8")


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
