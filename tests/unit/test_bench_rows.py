"""A row holds what `run --json` says; whatever a run raises is a row; the table follows from the rows alone."""

from __future__ import annotations

import csv
import io
import json
import random
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from impactlab import api, load_case
from impactlab.bench import table
from impactlab.bench.cells import Cell, keys_of
from impactlab.bench.references import References
from impactlab.bench.rows import ended, row_of
from impactlab.bench.worker import repeats_of, summed, times_of
from impactlab.casefile import Case
from impactlab.errors import StepError
from impactlab.history import Cost
from impactlab.plugins import LAWS, Registry, registry
from tests.support import CASES

MODAL = {"solve.model": {"kind": "modal", "modes": 8}, "solve.integrator": {"kind": "exact_modal"}}


@pytest.fixture(scope="module")
def case() -> Case:
    return load_case(CASES / "axial_impact.yaml")


def timeless(summary: dict[str, Any]) -> dict[str, Any]:
    return {**summary, "cost": {key: value for key, value in summary["cost"].items() if not key.endswith("_s")}}


def test_a_row_carries_the_summary_of_a_run(case: Case) -> None:
    record = row_of(case, "few", MODAL, References())
    solved = case.solved_by("few", MODAL)
    summary, reference = api.summarised(solved, api.run(solved))
    assert reference is not None
    assert timeless(record["summary"]) == timeless(summary)
    assert record["reference"]["name"] == "st_venant"
    assert record["summary"]["cost"]["unknowns"] == 8 + 1  # modes of the rod, and the mass
    assert json.loads(json.dumps(record, allow_nan=False)) == record


def test_the_same_row_has_the_same_bits(case: Case, tmp_path: Path) -> None:
    one = row_of(case, "few", MODAL, References())
    shared = References(tmp_path)
    two = row_of(case, "few", MODAL, shared)
    again = row_of(case, "few", MODAL, References(tmp_path))  # against the reference that another worker stored
    assert len(list(tmp_path.glob("*.reference"))) == 1
    for other in (two, again):
        assert json.dumps(timeless(one["summary"])) == json.dumps(timeless(other["summary"]))


@pytest.mark.parametrize(
    ("settings", "status", "said"),
    [
        ({"solve.model": {"kind": "modal", "elements": 2, "modes": 99}}, "refused", "modes"),
        ({"contacts.0.law": {"kind": "penalti"}}, "refused", "'penalti' is not a contact law"),
        ({"solve.step": {"dt": 1e-15}}, "refused", "steps of 1e-15 s are too many"),
    ],
)
def test_a_refusal_is_a_row_with_reason_and_remedy(
    case: Case, settings: dict[str, Any], status: str, said: str
) -> None:
    record = row_of(case, "wrong", settings, References())
    assert record["summary"]["status"] == status
    assert said in record["summary"]["error"]["text"]
    cell = Cell("standard", case.name, "base", "wrong", 1, settings, keys_of(case, "wrong", settings)[0])
    (row,) = table.rows([cell], {cell.key: record}, {})
    assert said in row["reason"]
    assert "\n" not in row["reason"]


def test_a_run_that_fails_on_the_way_states_the_time_reached(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any) -> Any:
        raise StepError("energy grew by 3", time=1.5e-5, step=7, remedy="Give a smaller step.")

    monkeypatch.setattr(api, "run", fails)
    settings = {"solve.model": {"kind": "modal", "elements": 50, "modes": 8, "basis": "craig_bampton"}}
    record = row_of(case, "few", settings, References())
    cell = Cell("standard", case.name, "base", "few", 1, settings, "k")
    (row,) = table.rows([cell], {"k": record}, {})
    assert (row["status"], row["reached_time"], row["remedy"]) == ("failed", 1.5e-5, "Give a smaller step.")
    assert row["reason"].startswith("energy grew by 3 (t = 1.5e-05 s, step 7)")
    # The parts of the method stand there all the same.
    asked = [row[name] for name in ("model", "basis", "law", "elements", "modes")]
    assert asked == ["modal", "craig_bampton", "wave_identification", 50, 8]


def test_whatever_a_part_raises_is_a_row(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    def breaks(*_: Any) -> Any:
        raise KeyError("a stranger's mistake")

    monkeypatch.setattr(registry().load(LAWS, "wave_identification"), "begin", breaks)
    record = row_of(case, "broken", {}, References())
    assert record["summary"]["status"] == "failed"
    assert record["summary"]["error"]["kind"] == "StepError"
    assert re.search("law 'wave_identification' .* raised KeyError: .*mistake", record["summary"]["error"]["text"])


CELLS = [Cell("standard", c, "base", m, n, {"a": n}, f"{c}{m}{n}") for c in "ab" for m in ("x", "y") for n in (1, 2)]


def records(case: Case) -> dict[str, Any]:
    done = row_of(case, "few", MODAL, References())
    lost = ended("a", "hung", "no answer after 3 s,\nas told", 3.0)
    return {cell.key: lost if cell.method == "y" else done for cell in CELLS}


def test_the_table_is_a_pure_function_of_the_rows(case: Case) -> None:
    known = records(case)
    times = {"ax1": {"repeats": 3, "setup_s": 0.1, "setup_spread_s": 0.0, "solve_s": 0.2, "solve_spread_s": 0.0}}
    text = table.as_csv(table.rows(CELLS, known, times))
    for seed in range(5):
        cells, keys = CELLS[:], list(known)
        random.Random(seed).shuffle(cells)
        random.Random(seed).shuffle(keys)
        assert table.as_csv(table.rows(cells, {key: known[key] for key in keys}, times)) == text
    read = list(csv.DictReader(io.StringIO(text)))
    assert [(row["case"], row["method"], row["level"]) for row in read] == sorted(
        (c.case, c.method, str(c.level)) for c in CELLS
    )
    first, hung = read[0], read[2]
    assert first["solve_s"] == "0.2"
    assert float(first["displacement"]) == known["ax1"]["summary"]["errors"]["face_displacement"]
    assert (hung["status"], hung["reason"], hung["mass_displacement"]) == ("hung", "no answer after 3 s, as told", "")
    assert hung["code"] == first["code"] != ""


def test_the_columns_stand_in_their_order_and_a_new_metric_joins() -> None:
    names = table.columns(("force", "zeta", "exit_velocity", "alpha", "momentum_error"))
    assert len(set(names)) == len(names)
    assert names[:7] == ("key", "suite", "case", "variant", "method", "level", "settings")
    assert names[names.index("events_extra") + 1 : names.index("displacement")] == ("exit_velocity", "alpha", "zeta")
    assert names[-5:] == ("code", "machine", "python", "numpy", "scipy", "numba")[-5:]


def test_a_number_of_numpy_is_a_number_in_the_table(case: Case) -> None:
    """A run that failed at an instant that numpy worked out left ``np.float64(0.25)``, and the table was unreadable."""
    known = records(case)
    known["ax1"]["summary"]["status"] = "failed"
    known["ax1"]["summary"]["reached"] = {"time": np.float64(0.25)}
    [row] = csv.DictReader(io.StringIO(table.as_csv(table.rows(CELLS[:1], known, {}))))
    assert row["reached_time"] == "0.25"


def test_the_document_has_the_summaries_under_the_names_of_the_cells(case: Case) -> None:
    document = table.document("standard", CELLS, records(case), {})
    assert document["schema_version"] == 1
    assert [row["summary"]["case"] for row in document["rows"]] == [row["case"] for row in document["rows"]]
    json.dumps(document, allow_nan=False)


def test_times_are_minima_and_their_spread_is_the_median_above_them() -> None:
    found = summed([Cost(setup_s=s, solve_s=10.0 * s) for s in (0.3, 0.1, 0.2)])
    assert found["setup_s"] == 0.1
    assert found["setup_spread_s"] == pytest.approx(0.1)
    assert found["solve_s"] == 1.0
    assert found["solve_spread_s"] == pytest.approx(1.0)


def test_long_runs_are_repeated_less() -> None:
    assert [repeats_of(spent, 9) for spent in (0.0, 0.007, 0.07, 0.7, 7.0)] == [9, 4, 3, 2, 1]


def test_a_timed_run_reports_each_part_and_leaves_the_collector_as_it_was(case: Case) -> None:
    import gc

    found = times_of(case.solved_by("few", MODAL), 3)
    assert gc.isenabled()
    assert found["repeats"] == 3
    assert all(np.isfinite(found[name]) and found[name] >= 0.0 for name in ("setup_s", "solve_s", "checks_s"))
    assert isinstance(registry(), Registry)
    assert "choosing_s" not in found


def test_choosing_is_timed_warm_and_not_taken_from_the_first_run(case: Case) -> None:
    automatic = {"solve.tolerance": 1e-2}
    found = times_of(case.solved_by("automatic", automatic), 3)
    record = row_of(case, "automatic", automatic, References())
    cell = Cell("s", "axial_impact", "base", "automatic", 1, automatic, keys_of(case, "automatic", automatic)[0])
    row = table.rows([cell], {cell.key: record}, {cell.key: found})[0]
    assert row["choosing_s"] == found["choosing_s"] >= 0.0
