"""The table of a bench: one line per cell.

It is a pure function of cells, rows and times; all figures and pages are made from it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from impactlab.bench.cells import Cell
from impactlab.bench.places import Place
from impactlab.bench.schema import BASE, columns
from impactlab.report.summary import has_numbers

TIMES = ("repeats", "setup_s", "setup_spread_s", "solve_s", "solve_spread_s")
COST = ("steps", "unknowns", "rhs_evaluations", "factorisations")


Records = Mapping[str, Mapping[str, Any]]  # by key of the row
Places = Mapping[tuple[str, str, str, int], Place]  # by case, variant, method and level


def _recorded(cells: Iterable[Cell], records: Records) -> list[Cell]:
    """Return the cells with a record in the order of the table."""
    order = sorted(cells, key=lambda cell: (cell.suite, cell.case, cell.variant, cell.method, cell.level))
    return [cell for cell in order if cell.key in records]


def rows(cells: Iterable[Cell], records: Records, times: Records) -> list[dict[str, Any]]:
    """Return the rows of the table, sorted, of the cells with a record.

    Parameters
    ----------
    cells : iterable of Cell
        The rows of the table.
    records, times : mapping
        By key, the record of each run and its times.
    """
    return [_row(cell, records[cell.key], times.get(cell.key, {})) for cell in _recorded(cells, records)]


def as_csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return rows as CSV: every bit of a number, nothing for None."""
    import pandas

    names = columns({name for row in rows for name in row["metrics"]})
    cells = [{**row, **row["metrics"]} for row in rows]
    # As objects, so that whole numbers stay whole beside empty cells.
    frame = pandas.DataFrame([[row.get(name) for name in names] for row in cells], columns=names, dtype=object)
    return str(frame.to_csv(index=False, lineterminator="\n"))


def document(
    suite: str, cells: Iterable[Cell], records: Records, times: Records, places: Places | None = None
) -> dict[str, Any]:
    """Return the document of ``bench --json``: each row with the summary that ``run --json`` prints.

    ``places`` are those of the faults of rows without a result.
    """
    listed = []
    for cell in _recorded(cells, records):
        label = cell.case if cell.variant == BASE else f"{cell.case}/{cell.variant}"
        summary = {**records[cell.key]["summary"], "case": label}
        if summary.get("error") and places and (place := places.get(cell.row_id)):
            summary["error"] = summary["error"] | place._asdict()
        listed.append({**cell._asdict(), "times": times.get(cell.key), "summary": summary})
    return {"schema_version": 1, "suite": suite, "rows": listed}


def references(cells: Iterable[Cell], records: Records) -> dict[str, Any]:
    """Return the reference of each scene (case/variant): its name, its uncertainty, how it was found."""
    found: dict[str, Any] = {}
    for cell in cells:
        if (reference := records[cell.key]["reference"]) is not None:
            found.setdefault(f"{cell.case}/{cell.variant}", reference)
    return found


def _row(cell: Cell, record: Mapping[str, Any], times: Mapping[str, Any]) -> dict[str, Any]:
    summary = record["summary"]
    row: dict[str, Any] = {**cell._asdict(), "settings": json.dumps(cell.settings, ensure_ascii=False)}
    row |= {"status": summary["status"], "metrics": {}, **record["environment"]}
    row |= _method(record["asked"]) if record["asked"] else {}
    if not has_numbers(summary["status"]):
        error = summary.get("error") or {}
        row |= {"reason": _line(error.get("text")), "remedy": _line(error.get("remedy"))}
        return row | {"reached_time": (summary.get("reached") or {}).get("time")}
    reference = record["reference"]
    errors = dict(summary["errors"] or {})
    for name in ("reference", "reference_uncertainty"):
        errors.pop(name, None)
    row |= _method(summary["method"]) | {name: summary["cost"].get(name) for name in COST}
    row |= {"dt": summary["method"]["dt"], "reached_time": summary["final"]["time"]}
    row |= {"reference": reference["name"], "reference_uncertainty": reference["uncertainty"]}
    row |= {"metrics": errors | {"momentum_error": record["momentum_error"]}}
    known = [errors[name] for name in ("mass_displacement", "face_displacement") if errors.get(name) is not None]
    energy = summary["energy"]
    row |= {
        "displacement": max(known, default=None),
        "energy_initial": energy["initial"],
        "energy_gain": energy["largest_gain"],
        "energy_loss": energy["largest_loss"],
        "energy_final_error": energy["final_error"],
        "warnings": ";".join(sorted({warned["code"] for warned in summary["warnings"]})),
        "contacts": record["counts"]["contacts"],
        "events_found": record["counts"]["events"],
        **{name: times[name] for name in (*TIMES, "machine") if name in times},
    }
    choice = summary.get("choice") or {}
    row |= {"tolerance_asked": choice.get("tolerance"), "expected_error": choice.get("expected_error")}
    row |= {"choosing_s": times.get("choosing_s", choice.get("choosing_s"))}
    trip = summary["round_trip"]
    return row | {"round_trips": summary["final"]["time"] / trip if trip else None}


def _method(method: Mapping[str, Any]) -> dict[str, Any]:
    """Return the columns of the method of a run; several bodies joined by +."""
    models = list(method["models"].values())
    bases = [model["basis"]["kind"] for model in models if model.get("basis") is not None]
    sizes = {
        name: max((int(model[name]) for model in models if model.get(name) is not None), default=None)
        for name in ("elements", "modes")
    }
    return {
        "model": _joined(model["kind"] for model in models) or "rigid",
        "basis": _joined(bases),
        "law": _joined(law["kind"] for law in method["laws"]),
        "integrator": method["integrator"]["kind"] if method["integrator"] else None,
        **({"events": method["events"]} if "events" in method else {}),
        **sizes,
    }


def _joined(kinds: Iterable[str]) -> str | None:
    return "+".join(dict.fromkeys(kinds)) or None


def _line(text: str | None) -> str | None:
    return " ".join(text.split()) if text else None
