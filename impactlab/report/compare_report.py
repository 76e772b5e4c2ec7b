"""The output folder of a comparison: table, figures, page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from impactlab.history.base import AbstractHistory
from impactlab.printing import counted
from impactlab.report import facts, page_figures
from impactlab.report.figures.drawn_part import drawn_part
from impactlab.report.figures.figure_files import FigureFiles
from impactlab.report.figures.style import traces
from impactlab.report.page import Page, write_page
from impactlab.report.provenance import Provenance
from impactlab.report.table import comma_separated, markdown
from impactlab.scene.problem import Scene


def write_comparison(
    out_dir: Path,
    comparison: Mapping[str, Any],
    histories: Mapping[str, AbstractHistory],
    scene: Scene,
    references: Mapping[str, AbstractHistory],
    provenance: Provenance = Provenance(),  # noqa: B008 - a record of texts
    files: FigureFiles = FigureFiles(),  # noqa: B008 - a record
) -> None:
    """Write comparison.json, table.md, table.csv, the figures and index.html into an empty folder.

    Parameters
    ----------
    out_dir : Path
        An existing folder; the caller makes it appear under its name only when all is written.
    comparison : mapping
        The comparison (`impactlab.report.comparison.comparison`); rows that failed are shown as such.
    histories : mapping
        Histories of the methods that ended, by name.
    scene : Scene
        Bodies, contacts, duration and snapshots, the same for all methods.
    references : mapping
        The references of their errors, by name of the method.
    provenance : Provenance
        Title, source, command and case of the comparison.
    files : FigureFiles
        Formats and width of the figures as files.
    """
    out_dir = Path(out_dir)
    (out_dir / "comparison.json").write_text(json.dumps(comparison, indent=2) + "\n", encoding="utf-8")
    (out_dir / "table.md").write_text(markdown(comparison), encoding="utf-8")
    (out_dir / "table.csv").write_text(comma_separated(comparison), encoding="utf-8")
    names = ",".join(row["name"] for row in comparison["rows"])
    shown, (part, left_out) = traces(histories, references), drawn_part(scene)
    page = Page(
        command="compare",
        options=f" --methods {names}",
        kicker=f"impactlab · {counted(len(comparison['rows']), 'method')} compared",
        method=[],
        findings=facts.findings(comparison),
        table=comparison,
        traces=shown,
        figures=page_figures.of_comparison(comparison, shown, part),
        files=[
            ("table.csv", "the table, all digits"),
            ("table.md", "the table as text"),
            ("comparison.json", "every summary"),
        ],
    )
    write_page(out_dir, page, part, provenance, files, left_out)
