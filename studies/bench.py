"""The pages of the bench from stored tables: nothing is run.

They are benchmarks.md and its siblings for beams and mechanisms. After ``impactlab bench --out DIR`` store its table
with ``python -m studies bench --store rods DIR/table.csv``, then write the page with ``python -m studies bench``.
"""

from __future__ import annotations

import argparse
import gzip
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

import pandas

from impactlab.bench.report import energy, overview
from impactlab.bench.report.automatic import automatic_sheet
from impactlab.bench.report.findings import certainty_words, findings
from impactlab.bench.report.method_styles import MethodStyle, styles_of
from impactlab.bench.report.precision import precision
from impactlab.bench.report.read import read_table
from impactlab.bench.report.scene_sheets import unfinished
from impactlab.bench.report.sheets import Sheet, markdown
from impactlab.bench.report.special import special_summary
from impactlab.bench.report.summary_sheets import certainty, ranking_sheet, winners
from impactlab.bench.report.views import BOTH, NORMS, SceneRows, gathered
from impactlab.bench.schema import FIELDS, Row
from studies.pages import DOCS, Study, filled, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CLOSE_UP = ("axial_impact", "two_material_rod")  # the scenes that are shown closely: a uniform rod, and one that is not


def stored(path: Path) -> bytes:
    """Return a table as it is stored, in reproducible bytes.

    It has no keys, and numbers of six digits; the same rows give the same bytes.
    """
    cells = pandas.read_csv(path, dtype=str, keep_default_na=False).drop(columns="key", errors="ignore")
    for name in cells:
        if FIELDS.get(name, float) not in (str, int | None):
            cells[name] = [f"{float(text):.6g}" if text else "" for text in cells[name]]
    return gzip.compress(cells.to_csv(index=False, lineterminator="\n").encode("utf-8"), 9, mtime=0)


class Bench:
    """The stored table, gathered once."""

    def __init__(self, path: Path) -> None:
        self.rows: Sequence[Row] = read_table(path)
        self.scenes: Sequence[SceneRows] = gathered(self.rows)
        self.styles: Mapping[str, MethodStyle] = styles_of(self.scenes)

    def scene(self, name: str) -> SceneRows:
        """Return a scene by its name."""
        return next(scene for scene in self.scenes if scene.name == name)


def listed(sentences: Sequence[str]) -> str:
    """Return sentences as a list."""
    return "\n".join(f"- {sentence}" for sentence in sentences)


def tabled(sheet: Sheet) -> str:
    """Return a sheet as it stands on the page.

    It is a sentence where the sheet has no rows.
    """
    return markdown(sheet).strip() if sheet.rows else "Not in this table."


def refusals(bench: Bench) -> str:
    """Return the reasons for runs without a result, with their methods.

    Reasons that differ by names and numbers alone stand together; # stands for a number, ... for a name.
    """
    found: dict[tuple[str, str], tuple[set[str], list[int], str]] = {}
    for scene in bench.scenes:
        for each in unfinished(scene):
            reason = re.sub(
                r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w)", "#", re.sub(r"'[^']*'", "'...'", each.reason)
            )
            methods, counts, _ = found.setdefault((each.status, reason), (set(), [], each.remedy))
            methods.add(each.method)
            counts.append(len(each.levels))
    rows = [
        (status, str(sum(counts)), reason, remedy, ", ".join(f"`{name}`" for name in sorted(methods)))
        for (status, reason), (methods, counts, remedy) in sorted(found.items(), key=lambda item: -sum(item[1][1]))
    ]
    return table(("status", "runs", "reason", "remedy of one of them", "methods"), rows)


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
    "bench_profiles": lambda bench: overview.profiles(bench.scenes, BOTH, bench.styles),
    "bench_uniform": lambda bench: precision(bench.scene(CLOSE_UP[0]), NORMS[0], bench.styles),
    "bench_two_materials": lambda bench: precision(bench.scene(CLOSE_UP[1]), NORMS[0], bench.styles),
    "bench_energy": lambda bench: energy.energy(bench.scene(CLOSE_UP[0]), bench.styles),
    "bench_force": lambda bench: energy.oscillation(bench.scene(CLOSE_UP[0]), bench.styles),
}


BEAM_PARTS = tuple(name for name in PARTS if name != "special")  # no step is special where waves disperse
BEAM_FIGURES: dict[str, Callable[[Bench], Figure]] = {
    "bench_beams_map": lambda bench: overview.chart(bench.scenes, BOTH, 1e-3),
    "bench_beams_slender": lambda bench: precision(bench.scene("sphere_on_beam"), NORMS[0], bench.styles),
    "bench_beams_sheared": lambda bench: precision(bench.scene("sphere_on_short_beam"), NORMS[0], bench.styles),
    "bench_beams_cantilever": lambda bench: precision(bench.scene("mass_on_cantilever_tip"), NORMS[0], bench.styles),
}


MECHANISM_PARTS = {**{name: PARTS[name] for name in BEAM_PARTS if name != "automatic"}, "refusals": refusals}
MECHANISM_FIGURES: dict[str, Callable[[Bench], Figure]] = {
    "bench_two_link_arm": lambda bench: precision(bench.scene("two_link_arm"), NORMS[0], bench.styles),
    "bench_slider_crank": lambda bench: precision(bench.scene("slider_crank"), NORMS[0], bench.styles),
}


FILES = {"rods": "table.csv.gz", "beams": "beams.csv.gz", "mechanisms": "mechanisms.csv.gz"}
TABLES = {name: DOCS / "bench" / file for name, file in FILES.items()}


@cache
def bench(name: str) -> Bench:
    """Return a stored table."""
    return Bench(TABLES[name])


def command(arguments: Sequence[str]) -> int:
    """Store the table of a bench."""
    parser = argparse.ArgumentParser(prog="python -m studies bench", description="Store the table of a bench.")
    parser.add_argument(
        "--store", nargs=2, required=True, metavar=("NAME", "TABLE"), help="rods, beams or mechanisms; a table.csv"
    )
    name, table = parser.parse_args(arguments).store
    TABLES[name].write_bytes(stored(Path(table)))
    return 0


STUDY = Study(
    {
        "benchmarks.md": filled(
            {name: partial(lambda part: part(bench("rods")), part) for name, part in PARTS.items()}
        ),
        "benchmarks-beams.md": filled(
            {name: partial(lambda part: part(bench("beams")), PARTS[name]) for name in BEAM_PARTS}
        ),
        "benchmarks-mechanisms.md": filled(
            {name: partial(lambda part: part(bench("mechanisms")), part) for name, part in MECHANISM_PARTS.items()}
        ),
    },
    {
        **{f"figures/{name}.png": partial(lambda draw: draw(bench("rods")), draw) for name, draw in FIGURES.items()},
        **{
            f"figures/{name}.png": partial(lambda draw: draw(bench("beams")), draw)
            for name, draw in BEAM_FIGURES.items()
        },
        **{
            f"figures/{name}.png": partial(lambda draw: draw(bench("mechanisms")), draw)
            for name, draw in MECHANISM_FIGURES.items()
        },
    },
    command=command,
)
