"""A reduced suite of hard cases: each scene by some of eight methods, in turn; no verdict may be a violation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from impactlab.bench import table
from impactlab.bench.cells import cells
from impactlab.bench.grid import chosen, of_suite, read_grid
from impactlab.bench.references import References
from impactlab.bench.report.read import read_table
from impactlab.bench.report.verdicts import faults
from impactlab.bench.rows import row_of
from impactlab.casefile import load_case

FOLDER = Path(__file__).resolve().parents[2] / "cases" / "hard"
FILES = sorted(FOLDER.glob("*.yaml"))
METHODS = [
    "exact",
    "wave_identification",
    "central_difference",
    "moreau_jean_1",
    "energy_conserving",
    "penalty_newmark",
    "craig_bampton",
    "impulse_momentum_0.5",
]

# Ten to thirty seconds each. The stored table has them (`python -m studies hard --check`); the variant on a wall stays.
LONG = {
    ("nearly_rigid", variant, "impulse_momentum_0.5")
    for variant in ("base", "massless_pad", "massless_rod", "one_massless_rod")
}

# The base for longer, which takes minutes; the stored table has it.
LONGER = {("contact_periods", "thousand")}

# In place of the durations in the files, which take minutes: 250 round trips of a fast rod, 100 contacts, the rise of a
# force that a smaller ratio has to its end. The stored table has the whole runs.
SHORTER: dict[tuple[str, str], Any] = {
    ("nearly_rigid", "base"): 3e-6,
    ("nearly_rigid", "massless_pad"): 1e-7,
    ("nearly_rigid", "rigid_rod_on_wall"): 1.2e-5,
    ("nearly_rigid", "massless_rod"): 1e-6,
    ("nearly_rigid", "one_massless_rod"): 1e-6,
    ("contact_periods", "between_walls"): 400.0,
    ("mass_ratios", "ratio_1e6"): {"round_trips": 450},
}


def is_run(file: Path, variants: list[str], variant: str, method: str) -> bool:
    """Return whether a scene is run by a method: scenes of a file in turn by a quarter of them; one alone by all."""
    if (file.stem, variant, method) in LONG or (file.stem, variant) in LONGER:
        return False
    turns = min(4, len(variants))
    return variants.index(variant) % turns == METHODS.index(method) % turns


def test_every_hard_case_states_its_purpose_its_expectation_and_its_exact_numbers() -> None:
    for file in FILES:
        head = file.read_text(encoding="utf-8").split("schema_version")[0]
        for words in ("Why it exists:", "What must happen:", "What is exact"):
            assert words in head, f"{file.name} has no '{words}'"


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=[file.stem for file in FILES])
def test_no_method_hangs_crashes_or_is_silently_wrong(file: Path, tmp_path: Path) -> None:
    families = chosen(read_grid(of_suite("hard")), METHODS)
    found, jobs = cells([file], "hard", families, METHODS)
    written, references = load_case(file), References()
    cases = {variant: written.variant(variant) for variant in written.variant_names}
    cases |= {
        v: case.with_("solve.duration", SHORTER[file.stem, v]) for v, case in cases.items() if (file.stem, v) in SHORTER
    }
    records = {
        key: row_of(cases[job.variant], job.method, job.settings, references)
        for key, job in jobs.items()
        if is_run(file, list(cases), job.variant, job.method)
    }
    stored = tmp_path / "table.csv"
    stored.write_text(table.as_csv(table.rows(found, records, {})), encoding="utf-8")
    assert not [(row.scene, row.method, fault) for row, fault in faults(read_table(stored))]
