"""Several runs of one case side by side, as the document of ``--json`` and as a table of plain text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from impactlab.metrics.collisions import agreement_texts, agreements
from impactlab.printing import counted
from impactlab.report.summary import SCHEMA_VERSION, has_numbers
from impactlab.startup.lazy import lazy

if TYPE_CHECKING:
    import pandas

    from impactlab.history import dataset
else:
    dataset = lazy("impactlab.history.dataset")


def comparison(
    case_name: str, reference_name: str | None, rows: Iterable[tuple[str, Mapping[str, Any]]]
) -> dict[str, Any]:
    """Return summaries of one case side by side, failed rows included, for JSON."""
    rows = list(rows)
    return {
        "schema_version": SCHEMA_VERSION,
        "case": case_name,
        "reference": reference_name,
        "collisions": agreements(rows),
        "rows": [{"name": name, "summary": dict(summary)} for name, summary in rows],
    }


def to_pandas(document: Mapping[str, Any]) -> pandas.DataFrame:
    """Return a comparison as a table with a row for each method, in SI; needs the extra ``data``.

    Columns: status, the relative errors of the summary, periods of contact, steps, dt [s], solve_s [s].
    """
    rows = {}
    for name, summary in ((row["name"], row["summary"]) for row in document["rows"]):
        errors = {key: value for key, value in (summary.get("errors") or {}).items() if key != "reference"}
        rows[name] = {"status": summary["status"], **errors}
        if "cost" in summary:
            dt, cost = summary["method"]["dt"], summary["cost"]
            rows[name] |= {"contacts": len(summary["contacts"]), "steps": cost["steps"], "dt": dt}
            rows[name]["solve_s"] = cost["solve_s"]
    made: pandas.DataFrame = dataset.needed("pandas").DataFrame.from_dict(rows, orient="index").rename_axis("method")
    return made


COLUMNS: Mapping[str, str] = {
    "method": "",
    "model": "",
    "law": "",
    "integrator": "",
    "dt": "T",
    "mass": "%",
    "face": "%",
    "impulse": "%",
    "first opening": "T",
    "contacts": "",
    "gain": "%",
    "loss": "%",
    "steps": "",
    "solve": "ms",
    "warnings": "",
}
"""The columns of the table of a comparison, with their units; see `units_of`."""
TEXT = ("method", "model", "law", "integrator", "warnings")  # columns of words


def units_of(comparison: Mapping[str, Any]) -> dict[str, str]:
    """Return the columns with their units.

    Times are in round trips T, in s of a scene without rods and beams.
    """
    in_trips = any(row["summary"].get("round_trip") for row in comparison["rows"])
    return {name: "s" if unit == "T" and not in_trips else unit for name, unit in COLUMNS.items()}


def solution_words(reference: str) -> str:
    """Return the reference of errors in words: converged, or exact under any of its names."""
    return "a converged solution" if reference == "converged" else "the exact solution"


def table_rows(comparison: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return one row per method, with keys as in `COLUMNS`.

    Values are text, number or None, in the units of `units_of`. A row that failed has ``failure`` and nothing else but
    its name.
    """
    return [_table_row(row["name"], row["summary"]) for row in comparison["rows"]]


def _table_row(name: str, summary: Mapping[str, Any]) -> dict[str, Any]:
    row: dict[str, Any] = dict.fromkeys(COLUMNS) | {"method": name}
    if not has_numbers(summary["status"]):
        fault = summary.get("error", {})
        place = f"{fault['path']}: " if fault.get("path") else ""
        reason = place + " ".join(str(fault.get("text", "")).split())
        return row | {"failure": f"{summary['status']}: {reason}".strip(": ")}
    used, errors = summary["method"], summary["errors"] or {}
    trip = float(summary.get("round_trip") or 1.0)
    openings = [event["time"] for event in summary["events"] if event["kind"] == "open"]
    kicks = [span["kicks"] for span in summary["contacts"] if span.get("kicks") is not None]
    return row | {
        "model": ", ".join(dict.fromkeys(model_label(model) for model in used["models"].values())),
        "law": ", ".join(dict.fromkeys(law["kind"] for law in used["laws"])),
        "integrator": used["integrator"]["kind"] if used["integrator"] else None,
        "dt": used["dt"] and used["dt"] / trip,
        "mass": _percent(errors.get("mass_displacement")),
        "face": _percent(errors.get("face_displacement")),
        "impulse": _percent(errors.get("impulse")),
        "first opening": openings[0] / trip if openings else None,
        "contacts": f"{sum(kicks)} kicks" if kicks else len(summary["contacts"]),
        "gain": _percent(summary["energy"]["largest_gain"]),
        "loss": _percent(summary["energy"]["largest_loss"]),
        "steps": summary["cost"]["steps"],
        "solve": 1e3 * summary["cost"]["solve_s"],
        "warnings": ", ".join(dict.fromkeys(warned["code"] for warned in summary["warnings"])),
    }


def model_label(model: Mapping[str, Any]) -> str:
    """Return a short label of a model: ``modal 100/40`` is 40 modes of 100 elements."""
    sizes = [str(model[key]) for key in ("elements", "modes") if model.get(key) is not None]
    return f"{model['kind']} {'/'.join(sizes)}".strip()


def model_words(model: Mapping[str, Any]) -> str:
    """Return a model in words: ``modal, 40 modes of 100 elements, consistent mass``."""
    sizes = [f"{model[key]} {key}" for key in ("modes", "elements") if model.get(key) is not None]
    mass = f"{model['mass']} mass" if model.get("elements") and model.get("mass") else ""
    return ", ".join(filter(None, (model["kind"], " of ".join(sizes), mass)))


def in_round_trips(time: float | None, summary: Mapping[str, Any]) -> float | None:
    """Return a time [s] of a summary in round trips T; None without time or T."""
    return None if time is None or not summary.get("round_trip") else time / float(summary["round_trip"])


def _percent(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def cell(value: Any) -> str:
    """Return a table cell as text; a dash for None.

    Numbers have three significant digits (four places near one).
    """
    match value:
        case None | "":
            return "–"
        case str() | int():
            return str(value)
        case 0.0:
            return "0"
        case float() if abs(value) >= 1e4 or abs(value) < 1e-3:
            return f"{value:.1e}".replace("e-0", "e-").replace("e+0", "e+").replace(".0e", "e")
        case float():
            return f"{value:.{max(0, min(5, 2 - math.floor(math.log10(abs(value)))))}f}"
        case _:
            return str(value)


ROUNDING = 1e-6  # %, below which a table gives this bound
MIN_FIXED = 0.1  # T or s, of an opening that is written with four places


def headings(comparison: Mapping[str, Any]) -> list[str]:
    """Return the headings of the table, units behind them."""
    return [f"{name} [{unit}]" if unit else name for name, unit in units_of(comparison).items()]


def cells(row: Mapping[str, Any]) -> list[str]:
    """Return a row of `table_rows` as text.

    The opening has four digits, shares of rounding have none.
    """
    texts = {name: cell(row[name]) for name in COLUMNS}
    texts |= {
        name: f"<{cell(ROUNDING)}"
        for name, unit in COLUMNS.items()
        if unit == "%" and 0.0 < (row[name] or 0.0) < ROUNDING
    }
    if (opening := row["first opening"]) is not None:
        texts["first opening"] = f"{opening:.4f}" if opening >= MIN_FIXED else f"{opening:.4g}"
    return list(texts.values())


LEFT_OUT_FIRST = ("loss", "first opening", "dt", "steps", "integrator", "model", "gain", "law", "warnings", "face")
"""The columns that a table leaves out where the terminal is narrow, in this order."""


def table(comparison: Mapping[str, Any], width: int | None = None) -> str:
    """Return the comparison as aligned plain text, one line per method.

    Failed methods have their reason. A warning that all methods share is a matter of the case: it stands once, below.
    ``width`` is that of the terminal in characters; columns that do not fit are left out and named, except for
    warnings, which then stand below, too. None: all columns.
    """
    rows = table_rows(comparison)
    codes = [row["warnings"].split(", ") for row in rows if "failure" not in row]
    shared = [code for code in (codes[0] if len(codes) > 1 else []) if code and all(code in each for each in codes)]
    for row in rows:
        if "failure" not in row:
            row["warnings"] = ", ".join(code for code in row["warnings"].split(", ") if code not in shared)
    names, left_out, named = list(COLUMNS), [], headings(comparison)
    lines = _aligned(rows, names, named)
    for name in LEFT_OUT_FIRST:
        if width is None or max(map(len, lines)) <= width:
            break
        names.remove(name)
        left_out.append(name)
        lines = _aligned(rows, names, named)
    reference = comparison["reference"]
    against = f" against {solution_words(reference)}" if reference else ""
    title = f"{comparison['case']}: {counted(len(rows), 'method')}{against}"
    below = [] if reference else [f"errors {text}" for text in _no_errors(comparison)]
    below += agreement_texts(comparison.get("collisions", ()))
    below += [f"all methods: {code}" for code in shared]
    if "warnings" not in names:
        left_out.remove("warnings")
        below += [f"{row['method']}: {row['warnings']}" for row in rows if row["warnings"]]
    below += [f"left out because the terminal is narrow: {', '.join(left_out)}"] if left_out else []
    return "\n".join([title, "", *lines, *below])


def _no_errors(comparison: Mapping[str, Any]) -> list[str]:
    """Return why the methods have no errors, each reason once."""
    found = ((row["summary"].get("reference") or {}).get("text") for row in comparison["rows"])
    return list(dict.fromkeys(text for text in found if text))


def _aligned(rows: Sequence[Mapping[str, Any]], names: Sequence[str], headed: Sequence[str]) -> list[str]:
    """Return headings, a rule and rows as aligned lines.

    Rows are those of `table_rows`; ``headed`` are the headings of all columns.
    """
    places = [list(COLUMNS).index(name) for name in names]
    body = [[row["method"], row["failure"]] if "failure" in row else [cells(row)[i] for i in places] for row in rows]
    full = [[headed[i] for i in places], *(line for line in body if len(line) == len(names))]
    widths = [max(len(line[i]) for line in full) for i in range(len(names))]
    widths[0] = max([widths[0], *(len(line[0]) for line in body)])
    text = {i for i, name in enumerate(names) if name in TEXT}

    def aligned(line: Sequence[str]) -> str:
        padded = zip(line, widths, range(len(widths)), strict=False)  # a failed row has two cells only
        return "  ".join(c.ljust(w) if i in text else c.rjust(w) for c, w, i in padded).rstrip()

    return [aligned(full[0]), "  ".join("-" * width for width in widths), *map(aligned, body)]
