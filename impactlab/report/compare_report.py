"""The output folder of a comparison: table, figures, page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from impactlab.history.base import AbstractHistory
from impactlab.refine.reference import Reference
from impactlab.report import balance, facts, fields, overview, plots
from impactlab.report.page import Page, Plate, file_of, write_page
from impactlab.report.run_report import wave_plates
from impactlab.report.sketch import sketch
from impactlab.report.style import Trace, exact_of, traces
from impactlab.report.summary import cell
from impactlab.report.table import comma_separated, markdown, page_headings, page_rows
from impactlab.scene.problem import Scene


def write_comparison(
    out_dir: Path,
    comparison: Mapping[str, Any],
    histories: Mapping[str, AbstractHistory],
    scene: Scene,
    reference: Reference | None,
    title: str = "",
    source: str = "",
    references: Mapping[str, AbstractHistory] | None = None,
    command: str = "",
) -> None:
    """Write comparison.json, table.md, table.csv, figures/*.svg and *.png, and index.html into an empty folder.

    Parameters
    ----------
    out_dir : Path
        An existing folder; the caller makes it appear under its name only when all is written.
    comparison : mapping
        The comparison (`impactlab.report.summary.comparison`); rows that failed are shown as such.
    histories : mapping
        Histories of the methods that ended, by name.
    scene : Scene
        Bodies, contacts, duration and snapshots, the same for all methods.
    reference : Reference or None
        The answer the errors were measured against.
    title, source : str
        What the case says of itself.
    references : mapping, optional
        Where methods are judged by answers of their own: name of the method to that history.
    """
    out_dir = Path(out_dir)
    (out_dir / "comparison.json").write_text(json.dumps(comparison, indent=2) + "\n", encoding="utf-8")
    (out_dir / "table.md").write_text(markdown(comparison), encoding="utf-8")
    (out_dir / "table.csv").write_text(comma_separated(comparison), encoding="utf-8")
    if references is None:
        references = dict.fromkeys(histories, reference[1]) if reference else {}
    case = str(comparison["case"])
    names = ",".join(row["name"] for row in comparison["rows"])
    page = Page(
        kicker=f"impactlab · {len(comparison['rows'])} methods compared",
        title=title or case,
        case=case,
        source=source,
        sketch=sketch(scene),
        facts=facts.scene_facts(scene),
        method=[],
        findings=facts.findings(comparison),
        headings=page_headings(),
        rows=page_rows(comparison),
        table_caption=facts.table_caption(reference is not None),
        figures=plates(comparison, traces(histories, references), scene),
        warnings=[
            (row["name"], warned["code"], warned["text"])
            for row in comparison["rows"]
            for warned in row["summary"].get("warnings", ())
        ],
        commands=[
            command or f"impactlab compare {file_of(case)} --methods {names} --out DIR",
            f"impactlab cite {file_of(case, variant=False)}",
        ],
        files=[
            ("table.csv", "the table, all digits"),
            ("table.md", "the table as text"),
            ("comparison.json", "every summary"),
            ("figures/", "SVG, PNG"),
        ],
    )
    write_page(out_dir, page)


def plates(comparison: Mapping[str, Any], shown: Sequence[Trace], scene: Scene) -> list[Plate]:
    """Return the figures of a comparison with their captions, what tells most first."""
    if not shown:
        return []
    summaries = {row["name"]: row["summary"] for row in comparison["rows"]}
    judged = any(trace.reference is not None for trace in shown)
    dark = " The thin line is the exact answer." if judged else ""
    figures = wave_plates(exact_of(shown), scene)
    if judged:
        figures.append(
            Plate(
                "errors",
                "How far off",
                "Each dot is the error of one method in one norm, all on one logarithmic scale. Further left is "
                "better, bold is the best of a panel, a hollow dot lies below the scale. Who wins depends on the norm.",
                overview.errors(comparison["rows"], {trace.name: trace.colour for trace in shown}),
            )
        )
    if scene.contacts:
        figures.append(
            Plate(
                "contacts",
                "Who is in contact when",
                "A bar is a period of contact, a tick a kick. Dotted lines are the exact touches and openings: a bar "
                "cut in pieces is chatter, a missing bar a missed contact.",
                overview.contacts(shown, scene),
            )
        )
    for number, contact in enumerate(scene.contacts):
        tail = f"_{number + 1}" if len(scene.contacts) > 1 else ""
        of = f", {contact.name}" if tail else ""
        figures.append(
            Plate(
                f"force{tail}",
                f"Contact force{of}",
                f"One panel per method on common axes.{dark} Above a panel stands its error away from the exact jumps"
                f"{', the largest over all contacts' if tail else ''}.",
                plots.force(shown, scene, contact.name, force_notes(summaries, several=bool(tail))),
            )
        )
        figures.append(
            Plate(
                f"gap{tail}",
                f"Gap{of}",
                f"Left the whole run, right the same near zero, where penetration and near touches show.{dark}",
                plots.gap(shown, scene, contact.name),
            )
        )
    if scene.contacts:
        below = (
            " Below, the largest difference from it so far: the curves rise where a method goes wrong."
            if judged
            else ""
        )
        words = f"Displacement since the start of what meets in contact.{dark}{below}"
        figures.append(Plate("displacement", "Displacement", words, plots.displacement(shown, scene)))
    figures.append(
        Plate(
            "energy",
            "Energy balance",
            "Energy of bodies and contacts plus booked losses less work, beside its first value: zero for a perfect "
            "run, above zero is gained from nothing, below is lost without a booking.",
            balance.energy_balance(shown, scene),
        )
    )
    for body, described in fields.elastic(scene).items() if scene.snapshots else ():
        load = fields.load_of(described)
        words = f"Along the {described.kind} at the snapshots, one row per method.{dark}"
        title = f"{load.replace('_', ' ').capitalize()} in {body}"
        figures.append(Plate(f"{load}_{body}", title, words, fields.snapshots(shown, scene, body)))
    return figures


def force_notes(summaries: Mapping[str, Mapping[str, Any]], several: bool = False) -> dict[str, str]:
    """Return what is written above the panel of each method: its error of the force away from jumps."""
    words, notes = "off jumps, worst contact" if several else "off jumps", {}
    for name, summary in summaries.items():
        error = (summary.get("errors") or {}).get("force_away_from_jumps")
        notes[name] = "" if error is None else "exact" if error < 1e-9 else f"{cell(100 * error)} % {words}"
    return notes
