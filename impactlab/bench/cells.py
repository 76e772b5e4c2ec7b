"""The cells of a bench: method, scene, settings and key of each row."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from impactlab import api
from impactlab.bench.grid import Family, of_suite, own_families, read_grid
from impactlab.bench.keys import reference_key, refused_key, row_key
from impactlab.bench.schema import BASE
from impactlab.casefile import Case, load_case, starter
from impactlab.casefile.case import case_of
from impactlab.casefile.document import Document
from impactlab.casefile.text.words import listed
from impactlab.errors import CaseError, ImpactlabError

SUITES = "standard", "hard"  # each with a grid of its own


class Cell(NamedTuple):
    """One row of the table, before it is run."""

    suite: str
    case: str
    variant: str
    method: str
    level: int  # from 1, coarse to fine
    settings: dict[str, Any]  # dotted path -> value: under ``methods`` of the case they make the same run
    key: str

    @property
    def row_id(self) -> tuple[str, str, str, int]:
        """Case, variant, method and level: one row of a table has them."""
        return self.case, self.variant, self.method, self.level


class Job(NamedTuple):
    """The work of one cell, with the scene as it was read for its key."""

    key: str
    name: str  # of the case
    file: str
    document: Document
    variant: str
    method: str
    settings: dict[str, Any]
    reference: str | None = None  # key of the reference of its errors; None where the case refuses the method


def case_files(cases: Sequence[Path], suite: str) -> list[Path]:
    """Return the files of the cases given, or those of a suite.

    A suite is in the current folder. Where that has no such folder, it is that of the cases that come with impactlab.

    Raises
    ------
    CaseError
        If there is none, or two of one name; if there is no such suite.
    """
    folder = Path("cases") if suite == "standard" else Path("cases") / suite
    if cases and suite not in SUITES and not folder.is_dir():
        raise CaseError(f"there is no suite '{suite}'", remedy=f"Allowed: {', '.join(SUITES)}.", path="--suite")
    files = list(cases) or sorted(folder.glob("*.yaml"))
    if not files and not folder.is_dir():
        inside = "" if suite == "standard" else suite
        files = [file for name, file in starter.cases().items() if name.rpartition("/")[0] == inside]
    if not files:
        raise CaseError(
            f"there are no cases in '{folder}'", remedy="Give case files, or go to the folder that holds 'cases'."
        )
    names = [file.stem for file in files]
    for name in names:
        if names.count(name) > 1:
            raise CaseError(f"two cases are called '{name}'", remedy="Rename one, or run two benches.")
    return files


def cells(
    files: Sequence[Path], suite: str, families: Sequence[Family], methods: Sequence[str] | None = None
) -> tuple[list[Cell], dict[str, Job]]:
    """Return the cells of some case files, and their jobs by key.

    A job makes the row of its key.

    Parameters
    ----------
    files : sequence of Path
        Case files.
    suite : str
        Name of the suite, a column of the table.
    families : sequence of Family
        The grid.
    methods : sequence of str, optional
        Which methods of the cases join the grid: ``own``, ``own.NAME``; all if not given.

    Raises
    ------
    CaseError, PluginError
        If a case cannot be read; a method that the case refuses is a cell, too.
    """
    found: list[Cell] = []
    jobs: dict[str, Job] = {}
    for file in files:
        written = load_case(file)
        for variant in written.variant_names:
            full = written.variant(variant)
            case = bare(full)
            own = [f for f in own_families(full) if methods is None or "own" in methods or f.name in methods]
            for family in (*families, *own):
                seen: set[str] = set()
                for level, values in enumerate(family.levels if family.serves(*case.simulation()) else (), start=1):
                    settings = family.values(*case.simulation(), values)
                    key, reference = keys_of(case, family.name, settings)
                    if key in seen:
                        continue  # a level that changes nothing here
                    seen.add(key)
                    found.append(Cell(suite, written.name, variant, family.name, level, settings, key))
                    job = Job(key, written.name, str(file), case.document, variant, family.name, settings, reference)
                    jobs.setdefault(key, job)
    return found, jobs


def laws_left_out(found: Sequence[Cell], families: Sequence[Family], suite: str) -> list[str]:
    """Return a sentence for each family whose law replaces none.

    The family is that of an own grid, and the laws of the scene are physical.
    """
    common = read_grid(of_suite(suite))
    texts = []
    for family in families:
        if family.law is None or family in common:
            continue
        own = [cell for cell in found if cell.method == family.name]
        left = [cell for cell in own if not any(path.startswith("contacts.") for path in cell.settings)]
        scenes = dict.fromkeys(cell.case if cell.variant == BASE else f"{cell.case}/{cell.variant}" for cell in left)
        if scenes:
            texts.append(
                f"{family.name}: its law replaces hard contact alone, and {listed(list(scenes))} "
                f"{'has' if len(scenes) == 1 else 'have'} physical laws, which are kept. To replace these, give the "
                f"family settings: {{contacts.0.law: {{kind: {family.law.get('kind')}, ...}}}}."
            )
    return texts


def bare(case: Case) -> Case:
    """Return the scene of a case without its methods and variants."""
    data = {key: value for key, value in case.document.data.items() if key not in ("methods", "variants")}
    return case_of(case.name, case.file, Document(data, {}), registry=case.registry)


def keys_of(case: Case, method: str, settings: dict[str, Any]) -> tuple[str, str | None]:
    """Return the keys of a method on a case and of its reference, None of the latter if refused."""
    try:
        solved = case.solved_by(method, settings)
        return row_key(solved), reference_key(*api.physics_of(solved))
    except ImpactlabError:
        return refused_key(case, settings), None
