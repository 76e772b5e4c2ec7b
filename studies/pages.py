"""Pages of docs/ that a study writes, and their comparison.

A study writes text between two comments of a page, tables and figures.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from impactlab.report.figures.figure_files import save
from impactlab.report.figures.style import drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[1]
DOCS, CASES = ROOT / "docs", ROOT / "cases"
COLOURS, DPI = 64, 140  # of a PNG: enough for lines and letters, a third of the bytes
UNITS = 2.0  # of the last printed digit, by which numbers of another machine may differ
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
Text = Callable[[str], str]  # the new text of a page from its old one


class Study(NamedTuple):
    """The pages and figures that one program writes."""

    texts: Mapping[str, Text]  # by path below docs/
    figures: Mapping[str, Callable[[], Figure]] = {}  # by path below docs/; without a suffix as PNG and as SVG
    comparable: Callable[[str], str] = str  # a page without times and other values that no second run repeats
    command: Callable[[Sequence[str]], int] | None = None  # further options of the study


def filled(parts: Mapping[str, Callable[[], str]]) -> Text:
    """Return the function that replaces the named parts of a page.

    Each is between two comments; the rest is kept. A part begins after ``<!-- table: NAME -->`` and ends before ``<!--
    end of table -->``.
    """

    def fill(page: str) -> str:
        for name, part in parts.items():
            pattern = re.compile(rf"(?<=<!-- table: {name} -->\n).*?(?=\n<!-- end of table -->)", re.DOTALL)
            if not pattern.search(page):
                raise SystemExit(f"the page has no place for '{name}'")
            text = part()
            page = pattern.sub(lambda _, text=text: text, page)  # type: ignore[misc]
        return page

    return fill


def table(head: str | Sequence[str], rows: Sequence[str | Sequence[str]]) -> str:
    """Return a table in Markdown.

    A line is its cells, or their text with bars between them.
    """
    first, *lines = (line if isinstance(line, str) else " | ".join(line) for line in (head, *rows))
    rule = "|".join(["---"] * (first.count("|") + 1))
    return "\n".join([f"| {first} |", f"|{rule}|", *(f"| {line} |" for line in lines)])


def percent(share: float | str | None, unit: str = " %") -> str:
    """Return a share as percent with two digits, ``-`` without one."""
    if share is None or isinstance(share, str):
        return "-"
    return "0" if share < 1e-9 else f"{float(f'{100.0 * share:.2g}'):g}{unit}"


def write(study: Study, out: Path) -> list[Path]:
    """Write the pages and figures of a study into a folder and return their paths."""
    made = []
    for name, text in study.texts.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text((DOCS / name).read_text(encoding="utf-8")), encoding="utf-8")
        made.append(out / name)
    for name, draw in study.figures.items():
        target = out / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.suffix:
            small_png(draw, target)
        else:
            save(drawn(draw)(), target.parent, target.name)
        made.append(target)
    return made


@drawn
def small_png(draw: Callable[[], Figure], target: Path) -> None:
    """Write a figure as a PNG of few colours."""
    from PIL import Image

    buffer = io.BytesIO()
    draw().savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    Image.open(buffer).convert("RGB").quantize(COLOURS).save(target, optimize=True)


def changes(study: Study) -> Iterator[str]:
    """Yield the lines in which the pages of a study differ from docs/.

    Its figures are drawn and not kept.
    """
    for name, text in study.texts.items():
        page = (DOCS / name).read_text(encoding="utf-8")
        old, new = (study.comparable(each).splitlines() for each in (page, text(page)))
        if len(old) != len(new):
            yield f"{name}: {len(old)} lines, now {len(new)}"
            continue
        yield from (f"{name}:\n- {a}\n+ {b}" for a, b in zip(old, new, strict=True) if not same_to_printed_digits(a, b))
    for draw in study.figures.values():
        drawn(draw)()


def same_to_printed_digits(one: str, other: str) -> bool:
    """Return whether two texts agree, each number to two units of its last printed digit."""
    if one == other:
        return True
    if NUMBER.split(one) != NUMBER.split(other):
        return False
    for a, b in zip(NUMBER.findall(one), NUMBER.findall(other), strict=True):
        mantissa, _, power = a.partition("e")
        unit = 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
        if abs(float(a) - float(b)) > UNITS * unit:
            return False
    return True
