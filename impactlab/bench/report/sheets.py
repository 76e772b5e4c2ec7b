"""A table of a report: headings, cells of text, marks; in Markdown and LaTeX."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Sequence
from typing import NamedTuple

from impactlab.report.comparison import cell

DASH = "–"
SPECIAL = "†"  # behind the name of a method on a special grid


class Heading(NamedTuple):
    """The head of a column."""

    name: str
    unit: str = ""
    numeric: bool = True
    group: str = ""  # common to neighbouring columns


def headings(*columns: str, text: Collection[str] = ()) -> tuple[Heading, ...]:
    """Return headings from texts such as ``group: name [unit]``.

    Group and unit are optional; columns named in ``text`` hold words.
    """
    found = []
    for column in columns:
        group, _, rest = column.rpartition(": ")
        name, _, unit = rest.partition(" [")
        found.append(Heading(name, unit.rstrip("]"), name not in text, group))
    return tuple(found)


class Sheet(NamedTuple):
    """A table of a report."""

    name: str  # of its files
    title: str
    note: str  # the meaning of its columns
    headings: tuple[Heading, ...]
    rows: tuple[tuple[str, ...], ...]
    marked: frozenset[tuple[int, int]] = frozenset()  # (row, column) of the best values
    wrong: frozenset[int] = frozenset()  # rows that miss their tolerance

    @property
    def grouped(self) -> list[tuple[str, int]]:
        """Return the groups of columns in order, with their column counts; empty without any."""
        runs = itertools.groupby(enumerate(self.headings), key=lambda each: each[1].group or each[0])
        groups = [(str(group) if isinstance(group, str) else "", len(list(run))) for group, run in runs]
        return groups if any(group for group, _ in groups) else []


def milliseconds(seconds: float | None) -> str:
    """Return a time in ms, three digits."""
    return cell(None if seconds is None else 1e3 * seconds)


def short(value: float | None) -> str:
    """Return an error or a ratio with two digits: ``0.012``, ``1.2e-4``, ``35``."""
    if value is None:
        return DASH
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 1e4:
        text = f"{float(f'{value:.2g}'):g}"
        return text if "e" not in text else f"{value:.0f}"
    return re.sub(r"(\.0)?e([-+])0?", lambda m: "e-" if m[2] == "-" else "e", f"{value:.1e}")


def percent(share: float | None) -> str:
    """Return a share in per cent; 0 below rounding."""
    return DASH if share is None else "0" if share < 1e-9 else short(100.0 * share)


def markdown(sheet: Sheet) -> str:
    """Return a sheet in Markdown, the best in bold.

    A group of columns is named at its first.
    """
    groups = ["", *(h.group for h in sheet.headings)]
    heads = [
        f"{h.group + ': ' if h.group and h.group != before else ''}{h.name}{f' [{h.unit}]' if h.unit else ''}"
        for h, before in zip(sheet.headings, groups, strict=False)
    ]
    lines = [heads, ["---:" if h.numeric else "---" for h in sheet.headings]]
    lines += [
        [f"**{text}**" if (i, j) in sheet.marked else text for j, text in enumerate(row)]
        for i, row in enumerate(sheet.rows)
    ]
    cells = [[" ".join(text.split()).replace("|", "\\|") for text in line] for line in lines]
    body = "".join(f"| {' | '.join(line)} |\n" for line in cells)
    return f"{body}\n{sheet.note}\n" if sheet.note else body


LATEX = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"\textquotedbl{}",
    DASH: "--",
    "—": "---",
    SPECIAL: r"\textdagger{}",
    "×": r"$\times$",
    "·": r"$\cdot$",
    "≤": r"$\leq$",
    "µ": r"$\mu$",
    "…": r"\dots{}",
    "’": "'",
    "\N{NO-BREAK SPACE}": "~",
    "\N{MINUS SIGN}": "$-$",
}
RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
POWER = re.compile("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")
FLOAT = re.compile(r"(-?\d+(?:\.\d+)?)e(-?\d+)")


def escaped(text: str) -> str:
    """Return text escaped for LaTeX.

    Characters outside ASCII have their commands, others become a question mark.
    """
    if found := FLOAT.fullmatch(text):
        return rf"${found[1]}\cdot 10^{{{found[2]}}}$"
    if found := POWER.search(text):
        power = f"$^{{{found.group().translate(RAISED)}}}$"
        return escaped(text[: found.start()]) + power + escaped(text[found.end() :])
    return "".join(LATEX.get(sign, sign if sign.isascii() or sign.isalpha() else "?") for sign in text)


def latex(sheet: Sheet) -> str:
    """Return a sheet as a LaTeX table for booktabs, the best in bold."""
    columns = "".join("r" if h.numeric else "l" for h in sheet.headings)
    lines = [
        "% needs \\usepackage{booktabs}",
        r"\begin{table}",
        r"\centering\footnotesize",
        rf"\caption{{{escaped(sheet.title)}. {escaped(sheet.note)}}}",
        rf"\label{{tab:{re.sub(r'[^A-Za-z0-9]+', '-', sheet.name).strip('-')}}}",
        rf"\begin{{tabular}}{{{columns}}}",
        r"\toprule",
    ]
    if sheet.grouped:
        lines.append(_line([rf"\multicolumn{{{n}}}{{c}}{{{escaped(group)}}}" for group, n in sheet.grouped]))
    lines.append(_line([escaped(h.name + (f" [{h.unit}]" if h.unit else "")) for h in sheet.headings]))
    lines.append(r"\midrule")
    for i, row in enumerate(sheet.rows):
        cells = [escaped(" ".join(text.split())) for text in row]
        lines.append(_line([rf"\textbf{{{text}}}" if (i, j) in sheet.marked else text for j, text in enumerate(cells)]))
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", r"\end{table}", ""])


def _line(cells: Sequence[str]) -> str:
    # A row that begins with [ would be taken for an option of \\ before it.
    return " & ".join(f"{{}}{text}" if text.startswith("[") else text for text in cells) + r" \\"
