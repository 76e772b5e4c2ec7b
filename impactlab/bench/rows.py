"""One row: a case run once, with summary and status, or the error of a part."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from impactlab import api
from impactlab.bench.environment import environment
from impactlab.bench.references import References, described
from impactlab.casefile import Case
from impactlab.metrics.impact import momentum_error
from impactlab.printing import plain
from impactlab.report.summary import describe, summarise
from impactlab.scene.method import laws_of, modelled

VERSION = 2  # of the record; part of it, so that an older one is run again

LISTS = ("events", "contacts")  # of a summary; counted in full, the first of each kept
MAX_LISTED = 1000  # in a record: a run of 1e7 steps may have a million, which are 1e8 bytes


def row_of(case: Case, method: str, settings: Mapping[str, Any], references: References) -> dict[str, Any]:
    """Return the record of a method on a case, ready for JSON.

    Parameters
    ----------
    case : Case
        The case, its variant chosen.
    method, settings : str, mapping
        The name of the method, and its values by dotted path.
    references : References
        Gives the solution to measure against.

    Returns
    -------
    dict
        ``version``; ``summary``, as `run --json` prints it, with at most `MAX_LISTED` events and contacts, of a run
        that was refused or failed its error; ``counts`` of all events and contacts; ``asked``, the parts of
        the method; ``reference`` (name, uncertainty, how found); ``momentum_error``; ``environment``.
    """
    asked: dict[str, Any] | None = None
    try:
        solved = case.solved_by(method, settings)
        asked = _parts(solved)
        return _record(solved, references) | {"asked": asked}
    except Exception as error:  # noqa: BLE001 - a part may raise anything; it is kept in the row
        summary = api.failure(case.label, error)
        summary["error"] |= {"file": None, "line": None}  # the row is that of a content, whatever file holds it
        summary.get("reached", {}).pop("events", None)
        return lost(summary, asked)


def _record(case: Case, references: References) -> dict[str, Any]:
    """Run a case with its method chosen; return its record without the settings of the row."""
    with api.warnings_kept():
        history = api.run(case)
    physics = api.physics_of(case)
    reference = references.of(*physics)
    summary = summarise(case.label, history, reference)
    return {
        "version": VERSION,
        "summary": summary | {name: summary[name][:MAX_LISTED] for name in LISTS},
        "counts": {name: len(summary[name]) for name in LISTS},
        "reference": described(reference, references.lost(*physics)),
        # Of the run itself, whether or not there is a reference.
        "momentum_error": plain(momentum_error(history, history, history.scene)),
        "environment": environment(),
    }


def _parts(case: Case) -> dict[str, Any]:
    """Return models, laws, integrator and events of a method, as a summary has them."""
    scene, method = case.simulation()
    made = {
        "models": {body.name: describe(model) for body, model in modelled(scene, method)},
        "laws": [describe(law) for law in laws_of(scene, method)],
        "integrator": None if method.integrator is None else describe(method.integrator),
        "events": method.events,
    }
    return {name: plain(value) for name, value in made.items()}


def lost(summary: Mapping[str, Any], asked: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the record of a run without a result."""
    without = {"reference": None, "momentum_error": None, "environment": environment()}
    return {"version": VERSION, "summary": dict(summary), "asked": asked, **without}


def ended(case: str, status: str, text: str, limit: float) -> dict[str, Any]:
    """Return the record of a run whose process was killed (``hung``) or died (``crashed``)."""
    remedy = "Give a longer --time-limit." if status == "hung" else "Run the case alone to see more."
    error = {"kind": status, "file": None, "line": None, "path": None, "text": text, "remedy": remedy}
    return lost({"schema_version": 1, "case": case, "status": status, "error": error}) | {"limit": limit}
