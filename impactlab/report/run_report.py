"""The output folder of one run: summary, history, figures, page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.metrics.collisions import sentence
from impactlab.refine.reference import Reference
from impactlab.report import balance, facts, fields, plots
from impactlab.report.page import Page, Plate, file_of, write_page
from impactlab.report.sketch import sketch
from impactlab.report.style import PALETTE, Trace
from impactlab.report.summary import cell, comparison
from impactlab.report.table import page_headings, page_rows
from impactlab.scene.problem import Scene

FEW = 5  # periods of contact that are told one by one
HISTORY_POINTS = 4001  # instants at which history.npz holds every channel


def write_run(
    out_dir: Path,
    summary: Mapping[str, Any],
    history: AbstractHistory,
    scene: Scene,
    reference: Reference | None,
    title: str = "",
    source: str = "",
    command: str = "",
) -> None:
    """Write summary.json, history.npz, figures/*.svg and *.png, and index.html into an empty folder.

    Parameters
    ----------
    out_dir : Path
        An existing folder; the caller makes it appear under its name only when all is written.
    summary : mapping
        Summary of the run (`impactlab.report.summary.summarise`).
    reference : Reference or None
        The answer the errors were measured against.
    title, source : str
        What the case says of itself.
    command : str
        The command line that made the run; that of the plain case if not given.
    """
    out_dir = Path(out_dir)
    (out_dir / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    np.savez_compressed(out_dir / "history.npz", **history_arrays(history, scene))
    name = _label(summary)
    trace = Trace(name, history, PALETTE[0], reference=reference[1] if reference else None)
    table = comparison(str(summary["case"]), reference[0] if reference else None, [(name, summary)])
    page = Page(
        kicker="impactlab · one run",
        title=title or str(summary["case"]),
        case=str(summary["case"]),
        source=source,
        sketch=sketch(scene),
        facts=facts.scene_facts(scene),
        method=facts.method_facts(summary),
        findings=findings(summary),
        headings=page_headings(),
        rows=page_rows(table),
        table_caption=facts.table_caption(reference is not None),
        figures=plates(trace, scene),
        warnings=[(name, warned["code"], warned["text"]) for warned in summary["warnings"]],
        commands=[
            command or f"impactlab run {file_of(summary['case'])} --out DIR",
            f"impactlab cite {file_of(summary['case'], variant=False)}",
        ],
        files=[
            ("summary.json", "the numbers"),
            ("history.npz", "every channel, for numpy.load"),
            ("figures/", "SVG, PNG"),
        ],
    )
    write_page(out_dir, page)


def _label(summary: Mapping[str, Any]) -> str:
    laws = dict.fromkeys(law["kind"] for law in summary["method"]["laws"])
    return ", ".join(laws) or "no contact"


def history_arrays(history: AbstractHistory, scene: Scene) -> dict[str, Any]:
    """Return the arrays of history.npz by name.

    ``time`` (n,) and each channel (n,) under its name; ``events/...`` (m,); ``energy/...`` at ``energy/time``;
    ``field/quantity:body@t`` with its places ``field/x:body``, at the snapshots.
    """
    time = np.linspace(0.0, history.duration, HISTORY_POINTS)
    book = history.energy
    arrays: dict[str, Any] = {"time": time}
    arrays |= {channel: history.evaluate(time, channel) for channel in history.channels()}
    arrays |= {
        "events/time": np.array([event.time for event in history.events], dtype=float),
        "events/contact": np.array([event.contact for event in history.events], dtype=str),
        "events/kind": np.array([event.kind for event in history.events], dtype=str),
        "events/impulse": np.array([np.nan if e.impulse is None else e.impulse for e in history.events], dtype=float),
        "energy/time": book.time,
        "energy/total": book.total,
        "energy/balance": book.balance,
    }
    for body, described in fields.elastic(scene).items():
        for instant in scene.snapshots:
            for quantity in ("displacement", "velocity", fields.load_of(described)):
                field = history.field(body, instant, quantity)
                arrays[f"field/x:{body}"] = field.x
                arrays[f"field/{quantity}:{body}@{instant:.6g}"] = field.values
    return arrays


def findings(summary: Mapping[str, Any]) -> list[str]:
    """Return what the numbers of one run say, one sentence each."""
    sentences = []
    spans = summary["contacts"]
    if len(spans) > FEW:
        sentences.append(f"{len(spans)} periods of contact; the first {FEW} are:")
    for span in spans[:FEW]:
        end = "the end of the run" if span["end"] is None else facts.when(span["end"], summary)
        peak = "" if span["peak_force"] is None else f", largest force {facts.si(span['peak_force'], 'N')}"
        kicks = f" in {span['kicks']} kicks" if span.get("kicks") is not None else ""
        sentences.append(
            f"{span['contact'].replace('|', ' and ')}: in contact from {facts.when(span['start'], summary)} to {end}, "
            f"impulse {facts.si(span['impulse'], 'N·s')}{kicks}{peak}."
        )
    sentences += [f"Collision of {sentence(each)}." for each in summary["collisions"][:FEW]]
    errors = summary["errors"]
    if errors and errors["mass_displacement"] is not None:
        off = cell(100 * errors["mass_displacement"])
        sentences.append(f"Against {errors['reference']} the displacement of the mass is off by {off} %.")
    return sentences


def plates(trace: Trace, scene: Scene) -> list[Plate]:
    """Return the figures of one run with their captions."""
    answer = "exact" if trace.reference is None or trace.reference.dt is None else "converged"
    dark = f" The thin line is the {answer} answer." if trace.reference is not None else ""
    shown = wave_plates(trace.reference, scene)
    for number, contact in enumerate(scene.contacts):
        tail = f"_{number + 1}" if len(scene.contacts) > 1 else ""
        of = f", {contact.name}" if tail else ""
        shown += [
            Plate(
                f"force{tail}",
                f"Contact force{of}",
                f"Positive in compression.{dark}",
                plots.force([trace], scene, contact.name),
            ),
            Plate(
                f"gap{tail}",
                f"Gap{of}",
                f"Left the whole run, right the same near zero, where penetration and near touches show.{dark}",
                plots.gap([trace], scene, contact.name),
            ),
        ]
    if scene.contacts:
        words = "Displacement since the start of what meets in contact."
        judged = (
            f" Below, how far the run has strayed from the {answer} answer so far."
            if trace.reference is not None
            else ""
        )
        shown.append(Plate("displacement", "Displacement", words + dark + judged, plots.displacement([trace], scene)))
    shown.append(
        Plate(
            "energy",
            "Where the energy is",
            "Stacked: bodies, contacts, booked losses. The dashed line is what was there at the start; a gap below it "
            "is lost without a booking, a rise above it is gained.",
            balance.energy_shares(trace, scene),
        )
    )
    known = dark if answer == "exact" else ""
    for body, described in fields.elastic(scene).items() if scene.snapshots else ():
        load = fields.load_of(described)
        shown.append(
            Plate(
                f"{load}_{body}",
                f"{load.replace('_', ' ').capitalize()} in {body}",
                f"Along the {described.kind} at the snapshots.{known}",
                fields.snapshots([trace], scene, body),
            )
        )
    return shown


def wave_plates(reference: AbstractHistory | None, scene: Scene) -> list[Plate]:
    """Return the waves of the exact answer in every rod, where there is an exact answer."""
    if reference is None or reference.dt is not None:
        return []
    words = (
        "The exact stress over the whole rod (upwards) and the whole run (to the right): red is compression, blue "
        "tension. Waves run along the slanted edges."
    )
    return [
        Plate(f"waves_{body}", f"The waves in {body}", words, fields.waves(reference, scene, body))
        for body in fields.rods(scene)
    ]
