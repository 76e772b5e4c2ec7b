"""Rows of a bench without a result name file and line of the fault, as a run of the same method does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import impactlab as il
from impactlab.bench import table
from impactlab.bench.cells import cells
from impactlab.bench.places import Place, places_of
from impactlab.bench.references import References
from impactlab.bench.rows import row_of as record_of
from impactlab.bench.run import Bench
from impactlab.errors import ImpactlabError

TEXT = """schema_version: 1
bodies:
  hammer: {kind: mass, mass: 2.133, velocity: 1.0}
  rod: {kind: rod, length: 0.3, area: 9.0e-4, material: steel, ends: {right: clamped}}
contacts:
  - between: [hammer, rod.left]
    law: {kind: penalty, stiffness: 1.0e9}
solve:
  duration: {round_trips: 1}
  model: {kind: modal, elements: 10}
  integrator: {kind: newmark}
  step: {dt: 1.0e-6}
methods:
  long: {solve.integrator: {kind: central_difference}, solve.step: {dt: 1.0}}
  many:
    solve.step: {dt: 1.0e-7}
    solve.model: {kind: modal, elements: 10, modes: 200}
"""


def made(folder: Path) -> tuple[Path, Bench]:
    file = folder / "faults.yaml"
    file.write_text(TEXT)
    found, jobs = cells([file], "standard", [])
    case = il.load_case(file)
    records: dict[str, dict[str, Any]] = {}
    for key, job in jobs.items():
        records[key] = record_of(case, job.method, job.settings, References())
    return file, Bench("standard", found, records, {}, len(jobs), places_of([file], found, records))


@pytest.mark.parametrize(("method", "line"), [("long", 14), ("many", 17)])
def test_a_row_names_the_line_that_a_run_names(tmp_path: Path, method: str, line: int) -> None:
    file, bench = made(tmp_path)
    with pytest.raises(ImpactlabError) as caught:
        il.run(il.load_case(file).method(method))
    assert (caught.value.file, caught.value.line) == (str(file), line)
    errors = {row["method"]: row["summary"].get("error") for row in bench.document["rows"]}
    assert (errors[f"own.{method}"]["file"], errors[f"own.{method}"]["line"]) == (str(file), line)
    assert errors["own.base"] is None
    assert bench.first_reason.startswith(f"{file}:14: method own.long: solve.step: a step of 1 s")


def test_a_value_of_the_grid_has_a_file_and_no_line(tmp_path: Path) -> None:
    file, bench = made(tmp_path)
    cell = next(each for each in bench.cells if each.method == "own.many")._replace(method="grid_family")
    assert places_of([file], [cell], bench.records) == {cell.row_id: Place(str(file), None)}


def test_the_document_without_places_is_as_before(tmp_path: Path) -> None:
    _, bench = made(tmp_path)
    rows = table.document("standard", bench.cells, bench.records, {})["rows"]
    assert all((row["summary"].get("error") or {"file": None})["file"] is None for row in rows)
