"""Writes tables and figures of the bench's pages from stored tables: ``python -m studies.bench [--out DIR] [--check]``.

Nothing is run: bench/table.csv.gz (rods: benchmarks.md) and bench/beams.csv.gz (benchmarks-beams.md) hold every row of
one bench each. After `impactlab bench --out DIR` put its table there by ``python -m studies.bench --page rods --store
DIR/table.csv``, which also writes page and figures. Each part stands between two comments in the page; the text around
it is kept. ``--check`` writes nothing and fails where a page is not what its table gives.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import io
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from impactlab.bench.report import energy, overview
from impactlab.bench.report.automatic import automatic_sheet
from impactlab.bench.report.looks import Look, looks
from impactlab.bench.report.precision import precision
from impactlab.bench.report.read import FIELDS, Row, read_table
from impactlab.bench.report.sheets import Sheet, markdown
from impactlab.bench.report.special import special_summary
from impactlab.bench.report.summary_sheets import certainty, ranking_sheet, winners
from impactlab.bench.report.views import BOTH, NORMS, SceneRows, gathered
from impactlab.bench.report.words import certainty_words, findings
from impactlab.report.style import drawn
from studies.pages import DOCS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = 64  # of a PNG: enough for lines and letters, a third of the bytes
CLOSE_UP = ("axial_impact", "two_material_rod")  # the scenes that are shown closely: a uniform rod, and one that is not


def stored(path: Path) -> bytes:
    """Return a table as it is stored: without keys, numbers of six digits; the same rows give the same bytes."""
    raw = path.read_bytes()
    reader = csv.DictReader(io.StringIO((gzip.decompress(raw) if path.suffix == ".gz" else raw).decode("utf-8")))
    names = [name for name in reader.fieldnames or () if name != "key"]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([_rounded(row[name], FIELDS.get(name, float)) for name in names] for row in reader)
    return gzip.compress(out.getvalue().encode("utf-8"), 9, mtime=0)


def _rounded(text: str, kind: object) -> str:
    """Return a cell; of a number that is none of a whole kind, six digits."""
    if kind in (str, int | None):
        return text
    try:
        return f"{float(text):.6g}"
    except ValueError:
        return text


class Bench:
    """The stored table, gathered once."""

    def __init__(self, path: Path) -> None:
        self.rows: Sequence[Row] = read_table(path)
        self.scenes: Sequence[SceneRows] = gathered(self.rows)
        self.look: Mapping[str, Look] = looks(self.scenes)

    def scene(self, name: str) -> SceneRows:
        """Return a scene by its name."""
        return next(scene for scene in self.scenes if scene.name == name)


def listed(sentences: Sequence[str]) -> str:
    """Return sentences as a list."""
    return "\n".join(f"- {sentence}" for sentence in sentences)


def tabled(sheet: Sheet) -> str:
    """Return a sheet as it stands on the page; one without rows says so."""
    return markdown(sheet).strip() if sheet.rows else "Not in this table."


PARTS: dict[str, Callable[[Bench], str]] = {
    "findings": lambda bench: listed(findings(bench.scenes)),
    "certainty": lambda bench: listed(certainty_words(bench.rows, bench.scenes)),
    "winners": lambda bench: tabled(winners(bench.scenes)),
    "ranking": lambda bench: tabled(ranking_sheet(bench.scenes, BOTH)),
    "special": lambda bench: tabled(special_summary(bench.scenes)),
    "automatic": lambda bench: tabled(automatic_sheet(bench.scenes)),
    "scenes": lambda bench: tabled(certainty(bench.scenes)),
}
FIGURES: dict[str, Callable[[Bench], Figure]] = {
    "bench_map": lambda bench: overview.chart(bench.scenes, BOTH, 1e-3),
    "bench_profiles": lambda bench: overview.profiles(bench.scenes, BOTH, bench.look),
    "bench_uniform": lambda bench: precision(bench.scene(CLOSE_UP[0]), NORMS[0], bench.look),
    "bench_two_materials": lambda bench: precision(bench.scene(CLOSE_UP[1]), NORMS[0], bench.look),
    "bench_energy": lambda bench: energy.energy(bench.scene(CLOSE_UP[0]), bench.look),
    "bench_force": lambda bench: energy.oscillation(bench.scene(CLOSE_UP[0]), bench.look),
}


BEAM_PARTS = tuple(name for name in PARTS if name != "special")  # no step is special where waves disperse
BEAM_FIGURES: dict[str, Callable[[Bench], Figure]] = {
    "bench_beams_map": lambda bench: overview.chart(bench.scenes, BOTH, 1e-3),
    "bench_beams_slender": lambda bench: precision(bench.scene("sphere_on_beam"), NORMS[0], bench.look),
    "bench_beams_sheared": lambda bench: precision(bench.scene("sphere_on_short_beam"), NORMS[0], bench.look),
    "bench_beams_cantilever": lambda bench: precision(bench.scene("mass_on_cantilever_tip"), NORMS[0], bench.look),
}


class Page(NamedTuple):
    """A page, the table that it is made from, and its figures."""

    name: str
    table: Path
    parts: Sequence[str]
    figures: Mapping[str, Callable[[Bench], Figure]]

    @property
    def path(self) -> Path:
        """Where it stands."""
        return DOCS / self.name


PAGES = {
    "rods": Page("benchmarks.md", DOCS / "bench" / "table.csv.gz", tuple(PARTS), FIGURES),
    "beams": Page("benchmarks-beams.md", DOCS / "bench" / "beams.csv.gz", BEAM_PARTS, BEAM_FIGURES),
}


def filled(text: str, bench: Bench, parts: Sequence[str]) -> str:
    """Return the text of a page with its parts written anew."""
    for name in parts:
        pattern = re.compile(rf"(<!-- table: {name} -->\n).*?(\n<!-- end of table -->)", re.DOTALL)
        if not pattern.search(text):
            raise SystemExit(f"the page has no place for '{name}'")
        part = PARTS[name](bench)
        text = pattern.sub(lambda match, part=part: f"{match[1]}{part}{match[2]}", text)  # type: ignore[misc]
    return text


@drawn
def write_figures(folder: Path, bench: Bench, figures: Mapping[str, Callable[[Bench], Figure]]) -> None:
    """Write the figures as PNG files of few colours."""
    from PIL import Image

    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in figures.items():
        buffer = io.BytesIO()
        draw(bench).savefig(buffer, format="png", dpi=140, metadata={"Software": None})
        Image.open(buffer).convert("RGB").quantize(COLOURS).save(folder / f"{name}.png", optimize=True)


def main() -> int:
    """Write pages and figures, or check the pages."""
    parser = argparse.ArgumentParser(description="Write the pages of the bench and their figures from stored tables.")
    parser.add_argument("--out", type=Path, default=DOCS, help="folder of what is written")
    parser.add_argument("--page", choices=sorted(PAGES), help="one page alone; all if not given")
    parser.add_argument("--store", type=Path, metavar="TABLE", help="store this table of a bench first, for --page")
    parser.add_argument("--check", action="store_true", help="write nothing; fail where a page has changed")
    options = parser.parse_args()
    if options.store is not None:
        if options.page is None:
            parser.error("--store needs --page: which table is it?")
        PAGES[options.page].table.write_bytes(stored(options.store))
    changed = 0
    for name, page in PAGES.items():
        if options.page not in (None, name):
            continue
        bench, old = Bench(page.table), page.path.read_text(encoding="utf-8")
        new = filled(old, bench, page.parts)
        if options.check:
            print(f"{page.name} unchanged" if old == new else f"{page.name} changed: run studies.bench")
            changed += old != new
            continue
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / page.name).write_text(new, encoding="utf-8")
        write_figures(options.out / "figures", bench, page.figures)
        print(f"{len(page.figures)} figures: {options.out / page.name}")
    return 1 if changed else 0


if __name__ == "__main__":
    sys.exit(main())
