"""The page of a run or a comparison: one HTML file that needs nothing else, on the screen or on paper."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from impactlab.report.style import inline, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Plate(NamedTuple):
    """A figure as it stands on the page."""

    name: str  # of its files
    title: str
    caption: str  # how to read it
    figure: Figure


class Page(NamedTuple):
    """All that a page says, besides its figures."""

    kicker: str  # the line above the title: the kind of page
    title: str
    case: str
    source: str
    sketch: str  # SVG
    facts: Sequence[tuple[str, str]]
    method: Sequence[tuple[str, str]]  # empty for a comparison
    findings: Sequence[str]
    headings: Sequence[tuple[str, str, bool]]  # name, unit, numeric
    rows: Sequence[dict[str, Any]]
    table_caption: str
    figures: Sequence[Plate]
    warnings: Sequence[tuple[str, str, str]]  # whose, code, text
    commands: Sequence[str]
    files: Sequence[tuple[str, str]]  # name, content


def file_of(case: str, *, variant: bool = True) -> str:
    """Return the words that name a case on the command line: ``a.yaml``, or ``a.yaml --variant b`` of ``a/b``."""
    stem, _, name = case.partition("/")
    return f"{stem}.yaml --variant {name}" if name and variant else f"{stem}.yaml"


def write_page(out_dir: Path, page: Page) -> None:
    """Write the figures (``figures/*.svg``, ``*.png``) and ``index.html`` into an existing folder."""
    folder = out_dir / "figures"
    folder.mkdir()
    plates = [
        {"plate": plate, "svg": inline(save(plate.figure, folder, plate.name), f"{plate.title}. {plate.caption}")}
        for plate in page.figures
    ]
    text = rendered("impactlab.report", "page.html.j2", page=page, plates=plates)
    (out_dir / "index.html").write_text(text, encoding="utf-8")


def rendered(package: str, template: str, **values: Any) -> str:
    """Return a page from a template of a package; its includes stand in that package or in this one."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    def text(name: str) -> str:
        places = (resources.files(each).joinpath(name) for each in (package, "impactlab.report"))
        return next(place for place in places if place.is_file()).read_text(encoding="utf-8")

    made = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        loader=FunctionLoader(text),
    )
    return made.get_template(template).render(**values)
