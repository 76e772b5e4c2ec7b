"""The page of a run or a comparison: one HTML file that needs no other."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

from impactlab.jobs.files import write_whole
from impactlab.report import facts
from impactlab.report.figures import mechanism
from impactlab.report.figures.figure_files import FigureFiles, PageFigure, on_page
from impactlab.report.figures.loading import load_matplotlib
from impactlab.report.figures.named_contacts import words_on_figures
from impactlab.report.figures.signals import named
from impactlab.report.figures.style import COLUMNS, Trace, figure_width
from impactlab.report.page_data import page_data
from impactlab.report.provenance import Provenance, now
from impactlab.report.side_by_side import side_by_side
from impactlab.report.sketch import sketch
from impactlab.report.table import page_headings, page_rows
from impactlab.scene.problem import Scene


class Page(NamedTuple):
    """Words and figures of a page, besides those that a run and a comparison share."""

    command: str  # run or compare
    options: str  # of the plain command, where the one used is not known
    kicker: str  # the line above the title: the kind of page
    method: Sequence[tuple[str, str]]  # empty for a comparison
    findings: Sequence[str]
    table: Mapping[str, Any]  # a comparison; of one run with one row
    traces: Sequence[Trace]
    figures: Sequence[PageFigure]
    files: Sequence[tuple[str, str]]  # name, content
    others: Sequence[Callable[[], None]] = ()  # write files of the folder while the figures are drawn


def file_of(case: str, *, variant: bool = True) -> str:
    """Return the words that name a case, as ``a.yaml --variant b``, on the command line."""
    stem, _, name = case.partition("/")
    return f"{stem}.yaml --variant {name}" if name and variant else f"{stem}.yaml"


def write_page(
    out_dir: Path, page: Page, scene: Scene, provenance: Provenance, files: FigureFiles, left_out: str = ""
) -> None:
    """Write ``index.html``, the figures as files, ``case.yaml`` and ``citations.bib`` into a folder.

    ``left_out`` states the part of the scene that is drawn, where it is not all of it.
    """
    folder = out_dir / "figures"
    folder.mkdir()
    references = [named(trace.reference) for trace in page.traces if trace.reference is not None]
    shown = [each for each in page.figures if each.is_printed or files.every]
    if files.width:
        with figure_width(COLUMNS[files.width]):
            side_by_side([partial(each.write, folder, files.formats) for each in shown])
    formats = () if files.width else files.formats
    load_matplotlib()  # once, not in each process that draws
    calls: list[Callable[[], str | None]] = [*page.others]
    calls.append(partial(_live_data, page, scene))
    calls += [partial(each.write, folder, formats) for each in shown]
    data, *drawings = (text or "" for text in side_by_side(calls)[len(page.others) :])
    figures, rules = on_page(shown, drawings)
    format_names = ", ".join(files.formats).upper() + ("" if files.every else "; all, as PNG or PDF: --figures png,pdf")
    text = rendered(
        "impactlab.report",
        "page.html.j2",
        page=page,
        figures=figures,
        rules=rules,
        origin=provenance,
        date=provenance.date or now(),
        title=provenance.title or page.table["case"],
        kicker=page.kicker,
        sketch=sketch(scene),
        mechanism=any(body.changes for body in scene.bodies.values()),
        chained=bool(mechanism.chains(scene)),
        elastic=bool(scene.elastic),
        facts=_facts(page, scene, left_out),
        trip=facts.trip(scene) if page.command == "compare" and math.isfinite(scene.round_trip) else "",
        headings=page_headings(page.table),
        rows=page_rows(page.table),
        table_caption=facts.table_caption(references[0] if references else ""),
        warnings=[
            (row["name"], warned["code"], warned["text"])
            for row in page.table["rows"]
            for warned in row["summary"].get("warnings", ())
        ],
        commands=_commands(page, provenance),
        files=[*page.files, ("figures/", format_names), *_write_sources(out_dir, provenance)],
        data=data,
    )
    (out_dir / "index.html").write_text(text, encoding="utf-8")


def _live_data(page: Page, scene: Scene) -> str:
    """Return the data that the script of a page draws; empty for a page without histories."""
    return page_data(page.traces, scene, compared=page.command == "compare") if page.traces else ""


def _write_sources(folder: Path, provenance: Provenance) -> list[tuple[str, str]]:
    """Write the case and its sources into a folder; return the files' names and contents."""
    written = []
    for name, content, text in (
        ("case.yaml", "the case as it was run", provenance.case_yaml),
        ("citations.bib", "sources to cite", provenance.citations),
    ):
        if text:
            (folder / name).write_text(text.rstrip() + "\n", encoding="utf-8")
            written.append((name, content))
    return written


def _facts(page: Page, scene: Scene, left_out: str) -> list[tuple[str, str]]:
    """Return the facts of a scene, and the part that is drawn.

    The part is of the scene and of its forces.
    """
    others = "history.npz has all" if page.command == "run" else "a run of a method writes all into history.npz"
    forces = words_on_figures([trace.history for trace in page.traces], others)
    links = {link.name for trace in page.traces for link in trace.history.links}
    drawn = (("drawn", left_out), ("signals drawn", forces))
    return [*facts.scene_facts(scene, links), *((name, words) for name, words in drawn if words)]


def _commands(page: Page, provenance: Provenance) -> list[str]:
    """Return the commands that repeat the result and name its sources, each after a line of words."""
    case = page.table["case"]
    again = provenance.command or f"impactlab {page.command} {file_of(case)}{page.options} --out DIR"
    made = ["# as this page was made", again]
    if not provenance.case_yaml:
        return [*made, "# the sources to cite, as BibTeX", f"impactlab cite {file_of(case, variant=False)}"]
    return [
        *made,
        "# from case.yaml of this folder, the case as it was run",
        f"impactlab {page.command} case.yaml{page.options} --out DIR",
        "# its sources to cite, as BibTeX",
        "impactlab cite case.yaml",
    ]


def write_study(file: Path, package: str, scene: Scene, origin: Provenance, **values: Any) -> None:
    """Write the page of a study of one case, such as a sweep, from the template of its package.

    ``values`` are those that the template reads beside scene and origin.
    """
    values["commands"] = [origin.command] if origin.command else []
    text = rendered(package, "page.html.j2", origin=origin, sketch=sketch(scene), **values)
    write_whole(file, text)


def rendered(package: str, template: str, **values: Any) -> str:
    """Return a page from a template of a package, with includes from there or here."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined
    from markupsafe import Markup

    def text(name: str) -> str:
        places = (resources.files(each).joinpath(name) for each in (package, "impactlab.report"))
        return next(place for place in places if place.is_file()).read_text(encoding="utf-8")

    made = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, loader=FunctionLoader(text)
    )
    made.globals["verbatim"] = lambda name: Markup(text(name))  # noqa: S704 - a file of ours, not a template
    return made.get_template(template).render(**values)
