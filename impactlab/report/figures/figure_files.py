"""Figures as files, and as SVG that stands inside a page in its colours."""

from __future__ import annotations

import io
import itertools
import math
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from impactlab.errors import CaseError
from impactlab.report.figures.style import COLUMNS, GRID, INK, MUTED, PALETTE, PAPER, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure


FORMATS = ("svg", "png", "pdf")
PAGE_DOTS, PAPER_DOTS = 160, 400  # per inch, of PNG


class FigureFiles(NamedTuple):
    """How figures are written into a folder."""

    formats: tuple[str, ...] = ("svg",)  # of `FORMATS`
    width: str = ""  # "one" or "two" columns of a journal; empty: as on the page
    every: bool = False  # True: also those that a page shows live alone


def figure_files(formats: str | None, width: str | None, folder: Path | None = Path()) -> FigureFiles:
    """Return how figures are written, from the words of a command.

    Words are such as ``svg,pdf`` and ``one``; all figures are written if one is given.

    Raises
    ------
    CaseError
        If a format or a width is not known, or figures are requested and there is no ``folder`` for them.
    """
    if folder is None and (formats or width):
        option = "--figures" if formats else "--width"
        raise CaseError(f"{option} without --out: there is no folder for figures", remedy="Add --out DIR.", path=option)
    names = tuple(dict.fromkeys(name.strip() for name in (formats or "svg,png").split(",")))
    for option, given, known in (("--figures", names, FORMATS), ("--width", (width,) if width else (), (*COLUMNS,))):
        wrong = [name for name in given if name not in known]
        if wrong:
            raise CaseError(
                f"{option} has no value {wrong[0][:40]!r}", remedy=f"Allowed: {', '.join(known)}.", path=option
            )
    return FigureFiles(names, width or "", every=True) if formats or width else FigureFiles()


class PageFigure(NamedTuple):
    """A figure as it stands on a page."""

    name: str  # of its files
    title: str
    caption: str  # how to read it
    draw: Callable[[], Figure]
    has_live_twin: bool = False  # True: hidden on the screen where the script draws the same
    is_printed: bool = True  # False: drawn where all figures are requested; the page shows it live alone

    def write(self, folder: Path, formats: Sequence[str] = ("svg", "png")) -> str:
        """Write the files of the figure into a folder, and return it as SVG for the page."""
        return inline(save(self.draw(), folder, self.name, formats), f"{self.title}. {self.caption}".strip())


def on_page(figures: Sequence[PageFigure], drawings: Sequence[str]) -> tuple[list[dict[str, Any]], str]:
    """Return figures, with their SVG, as a template takes them, and the style rules of all."""
    classed, rules = with_classes(drawings)
    return [{**each._asdict(), "svg": svg} for each, svg in zip(figures, classed, strict=True)], rules


def write_figures(folder: Path, figures: Iterable[PageFigure]) -> tuple[list[dict[str, Any]], str]:
    """Write figures into ``figures`` of the folder of a page; return them as `on_page` does."""
    (folder / "figures").mkdir(exist_ok=True)
    figures = list(figures)
    return on_page(figures, [each.write(folder / "figures") for each in figures])


@drawn
def to_svg(figure: Figure) -> str:
    """Return a figure as SVG text; the same figure gives the same bytes."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


@drawn
def save(figure: Figure, folder: Path, name: str, formats: Sequence[str] = ("svg", "png")) -> str:
    """Write a figure as ``name.svg``, ``.png`` or ``.pdf`` by format; return the SVG."""
    svg = to_svg(figure)
    if "svg" in formats:
        (folder / f"{name}.svg").write_text(svg, encoding="utf-8")
    if "png" in formats:
        dots = PAGE_DOTS if figure.get_figwidth() > max(COLUMNS.values()) else PAPER_DOTS
        figure.savefig(folder / f"{name}.png", dpi=dots, metadata={"Software": None}, pil_kwargs={"compress_level": 3})
    if "pdf" in formats:
        figure.savefig(folder / f"{name}.pdf", metadata={"CreationDate": None})
    return svg


THEMED = {INK: "ink", MUTED: "muted", GRID: "line", PAPER: "paper"} | {c: f"c{i}" for i, c in enumerate(PALETTE)}
"""Colours that a page sets itself, lighter on a dark page, by the names of its variables."""


def inline(svg: str, label: str) -> str:
    """Return SVG text fit to stand inside a page.

    It is themed by the variables of the page, sized by its column, and has no clashing ids.

    Parameters
    ----------
    label : str
        Description of the figure for screen readers.
    """
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>|<style[^>]*>.*?</style>", "", body, flags=re.DOTALL)
    body = re.sub(
        r'(<svg[^>]*?) width="[^"]*" height="[^"]*"|(<svg[^>]*?) height="[^"]*" width="[^"]*"', r"\1\2", body, count=1
    )
    used = set(re.findall(r"#([\w.-]+)", body))
    body = re.sub(r' id="([\w.-]+)"', lambda m: m.group(0) if m.group(1) in used else "", body)
    for colour, variable in THEMED.items():
        body = body.replace(colour, f"var(--{variable})")
    body = body.replace("font-family: 'DejaVu Sans'", "font-family: inherit").replace("'DejaVu Sans'", "inherit")
    text = label.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
    return compact(body.replace("<svg", f'<svg role="img" aria-label="{text}"', 1))


NUMBER = re.compile(r"-?\d+\.\d{2,}")


def compact(svg: str) -> str:
    """Return SVG text with short coordinates, and without needless groups.

    Coordinates have a tenth of a point, paths are in steps.
    """
    svg = re.sub(r' d="([^"]*)"', lambda path: f' d="{_steps(path.group(1))}"', svg)
    svg = re.sub(r' (?:points|x|y|width|height|transform|viewBox)="[^"]*"', lambda match: _short(match.group()), svg)
    svg = re.sub(r">\s+<", "><", svg).replace("xlink:href", "href")
    svg = re.sub(r' transform="rotate\(-0 [^"]*"| xmlns:xlink="[^"]*"| version="[^"]*"|<g/>|<defs></defs>', "", svg)
    svg = re.sub(r"\b([mp])([0-9a-f]{5})[0-9a-f]{5}\b", r"\1\2", svg)
    before = ""
    while before != svg:
        before, svg = svg, re.sub(r"<g>(<(\w+)[^<>]*(?:/>|>[^<>]*</\2>))?</g>", r"\1", svg)
    return svg


def _short(text: str) -> str:
    return NUMBER.sub(lambda number: f"{float(number.group()):.1f}".removesuffix(".0"), text)


MAX_STRAY = 2.5  # tenths of a point, by which a curve may stray from its points
MAX_RUN = 24  # points that one straight line may stand for


def _steps(path: str) -> str:
    """Return a path of straight lines as steps in tenths of a point.

    Another path is rounded.
    """
    if not re.fullmatch(r"[ML\d\s.z-]*", path):
        return " ".join(_short(path).split())
    text = ""
    for line, closed in re.findall(r"M([^Mz]*)(z?)", path):
        points = [(round(10 * float(x)), round(10 * float(y))) for x, y in re.findall(r"(-?[\d.]+) (-?[\d.]+)", line)]
        kept = _straightened(points)
        text += f"M{_tenths(kept[0][0])}{_tenths(kept[0][1], apart=True)}"
        text += "l" if len(kept) > 1 else ""
        for (x, y), (to_x, to_y) in itertools.pairwise(kept):
            text += _tenths(to_x - x, apart=text[-1].isdigit()) + _tenths(to_y - y, apart=True)
        text += closed
    return text


def _straightened(points: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return the points of a path without those on straight lines.

    Those within `MAX_STRAY` of the line between the points kept are left out.
    """
    kept, last, at = points[:1], 0, 2
    while at < len(points):
        (x, y), (to_x, to_y) = points[last], points[at]
        long = max(1.0, math.hypot(to_x - x, to_y - y))
        off = max(abs((to_x - x) * (q - y) - (to_y - y) * (p - x)) / long for p, q in points[last + 1 : at])
        back = any((p - x) * (to_x - p) + (q - y) * (to_y - q) < 0 for p, q in points[last + 1 : at])
        if off > MAX_STRAY or back or at - last > MAX_RUN:
            last = at - 1
            kept.append(points[last])
        at += 1
    return [*kept, points[-1]] if len(points) > 1 else kept


def _tenths(number: int, *, apart: bool = False) -> str:
    """Return a number of tenths as text.

    A space stands before it where it must be apart from one before.
    """
    text = f"{number / 10:g}"
    text = text.replace("0.", ".", 1) if abs(number) < 10 else text
    return text if text.startswith("-") or not apart else f" {text}"


def with_classes(figures: Sequence[str]) -> tuple[list[str], str]:
    """Return inlined figures with classes in place of style attributes, and their rules."""
    names: dict[str, str] = {}

    def named(match: re.Match[str]) -> str:
        return f' class="{names.setdefault(match.group(1), f"s{len(names)}")}"'

    changed = [re.sub(r' style="([^"]*)"', named, svg) for svg in figures]
    return changed, "\n".join(f".{name}{{{rule}}}" for rule, name in names.items())
