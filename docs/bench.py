"""Writes tables and figures of benchmarks.md from the stored table: ``python docs/bench.py [--out DIR] [--check]``.

Nothing is run: bench/table.csv.gz holds every row of one bench. After `impactlab bench --out DIR` put its table there
by ``python docs/bench.py --store DIR/table.csv``, which also writes page and figures. Each part stands between two
comments in the page; the text around it is kept. ``--check`` writes nothing and fails where the page is not what the
table gives.
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
from typing import TYPE_CHECKING

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

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HERE = Path(__file__).resolve().parent
PAGE = HERE / "benchmarks.md"
TABLE = HERE / "bench" / "table.csv.gz"
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


def filled(page: str, bench: Bench) -> str:
    """Return the page with all its parts written anew."""
    for name, part in PARTS.items():
        pattern = re.compile(rf"(<!-- table: {name} -->\n).*?(\n<!-- end of table -->)", re.DOTALL)
        if not pattern.search(page):
            raise SystemExit(f"{PAGE.name} has no place for '{name}'")
        text = part(bench)
        page = pattern.sub(lambda match, text=text: f"{match[1]}{text}{match[2]}", page)  # type: ignore[misc]
    return page


@drawn
def write_figures(folder: Path, bench: Bench) -> None:
    """Write the figures as PNG files of few colours."""
    from PIL import Image

    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in FIGURES.items():
        buffer = io.BytesIO()
        draw(bench).savefig(buffer, format="png", dpi=140, metadata={"Software": None})
        Image.open(buffer).convert("RGB").quantize(COLOURS).save(folder / f"{name}.png", optimize=True)


def main() -> int:
    """Write page and figures, or check the page."""
    parser = argparse.ArgumentParser(description="Write benchmarks.md and its figures from the stored table.")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of what is written")
    parser.add_argument("--table", type=Path, default=TABLE, help="the table, CSV, plain or compressed")
    parser.add_argument("--store", type=Path, metavar="TABLE", help="store this table first, for --table")
    parser.add_argument("--check", action="store_true", help="write nothing; fail where the page has changed")
    options = parser.parse_args()
    if options.store is not None:
        options.table.parent.mkdir(parents=True, exist_ok=True)
        options.table.write_bytes(stored(options.store))
    bench, old = Bench(options.table), PAGE.read_text(encoding="utf-8")
    new = filled(old, bench)
    if options.check:
        print("page unchanged" if old == new else "page changed: run docs/bench.py")
        return 0 if old == new else 1
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / PAGE.name).write_text(new, encoding="utf-8")
    write_figures(options.out / "figures", bench)
    print(f"{len(PARTS)} tables, {len(FIGURES)} figures: {options.out / PAGE.name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
