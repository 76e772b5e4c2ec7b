"""The output folder of one run: summary, history, figures, page."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.history.instruments import instrumented, measured_file
from impactlab.history.sampling import MAX_FORCES, file_times
from impactlab.metrics.collision_texts import sentences as collision_sentences
from impactlab.refine.references.reference_record import CONVERGED, Reference
from impactlab.report import facts, page_figures
from impactlab.report.comparison import cell, comparison
from impactlab.report.figures import fields
from impactlab.report.figures.drawn_part import drawn_part
from impactlab.report.figures.figure_files import FigureFiles
from impactlab.report.figures.signals import UNITS, in_words, place, place_in_words
from impactlab.report.figures.style import PALETTE, Trace
from impactlab.report.npz import write_npz
from impactlab.report.page import Page, write_page
from impactlab.report.provenance import Provenance
from impactlab.scene.problem import Scene

MAX_SENTENCES = 5  # of the periods of contact and of the collisions
MIN_BESIDE = 1000  # channels, from which on history.npz is written while the figures are drawn
NPZ_POINTS = 4001  # instants at which history.npz holds every channel; fewer of thousands of channels


def write_run(
    out_dir: Path,
    summary: Mapping[str, Any],
    history: AbstractHistory,
    reference: Reference | None,
    provenance: Provenance = Provenance(),  # noqa: B008 - a record of texts
    files: FigureFiles = FigureFiles(),  # noqa: B008 - a record
    data: Callable[[], None] | None = None,
) -> None:
    """Write summary.json, history.npz, the figures and index.html into an empty folder.

    With a provenance that holds them also case.yaml and citations.bib.

    Parameters
    ----------
    out_dir : Path
        An existing folder; the caller makes it appear under its name only when all is written.
    summary : mapping
        Summary of the run (`impactlab.report.summary.summarise`).
    reference : Reference or None
        The reference of the errors.
    provenance : Provenance
        Title, source, command and case of the run.
    files : FigureFiles
        Formats and width of the figures as files.
    data : callable, optional
        Writes ``history.nc`` into the folder, at the same time as the figures are drawn.
    """
    out_dir = Path(out_dir)
    (out_dir / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    arrays = partial(_write_arrays, out_dir / "history.npz", history)
    scene, is_large = history.scene, len(history.channels()) >= MIN_BESIDE
    if not is_large:
        arrays()
    name, (part, left_out) = _label(summary), drawn_part(scene)
    trace = Trace(name, history, PALETTE[0], reference=reference.history if reference else None)
    page = Page(
        command="run",
        options="",
        kicker="impactlab · one run",
        method=facts.method_facts(summary, facts.units_of(history), [each.name for each in scene.contacts]),
        findings=findings(summary),
        table=comparison(str(summary["case"]), reference.name if reference else None, [(name, summary)]),
        traces=[trace],
        figures=page_figures.of_run(trace, part),
        files=[
            ("summary.json", "the numbers"),
            ("history.npz", "every channel, for numpy.load"),
            *_data(out_dir, scene, data),
        ],
        others=[*([] if data is None else [data]), *([arrays] if is_large else [])],
    )
    write_page(out_dir, page, part, provenance, files, left_out)


def _data(folder: Path, scene: Scene, data: Callable[[], None] | None) -> list[tuple[str, str]]:
    """Return the files of data in the folder with their contents.

    ``history.nc`` is among them if it is to come.
    """
    known = [
        ("history.nc", "channels, fields and case, for xarray and the command impactlab report"),
        ("contacts.csv", "the periods of contact"),
        ("probes.csv", f"probes{' and contact forces' if len(scene.contacts) <= MAX_FORCES else ''} over time"),
    ]
    known += [
        (measured_file(number), f"{probe.quantity}, {place(probe, scene)}, as its instrument measures it")
        for number, probe in instrumented(scene)
    ]
    return [
        (name, words)
        for name, words in known
        if (folder / name).exists() or (name == "history.nc" and data is not None)
    ]


def _label(summary: Mapping[str, Any]) -> str:
    laws = dict.fromkeys(law["kind"] for law in summary["method"]["laws"])
    return ", ".join(laws) or "no contact"


def _write_arrays(path: Path, history: AbstractHistory) -> None:
    write_npz(path, history_arrays(history))


def history_arrays(history: AbstractHistory) -> dict[str, Any]:
    """Return the arrays of history.npz by name.

    ``time`` (n,) and each channel (n,) under its name; ``events/...`` (m,); ``energy/...`` at ``energy/time``;
    ``field/quantity:body@t`` with its places ``field/x:body``, at the snapshots.
    """
    channels, book = history.channels(), history.energy
    time = file_times(history.duration, len(channels), NPZ_POINTS)
    arrays: dict[str, Any] = {"time": time}
    arrays |= dict(zip(channels, history.evaluate_each(time, channels), strict=True))
    arrays |= {
        "events/time": np.array([event.time for event in history.events], dtype=float),
        "events/contact": np.array([event.contact for event in history.events], dtype=str),
        "events/kind": np.array([event.kind for event in history.events], dtype=str),
        "events/impulse": np.array([np.nan if e.impulse is None else e.impulse for e in history.events], dtype=float),
        "energy/time": book.time,
        "energy/total": book.total,
        "energy/balance": book.balance,
    }
    for body, described in history.scene.elastic.items():
        for instant in history.scene.snapshots:
            for quantity in ("displacement", "velocity", fields.load_of(described)):
                field = history.field(body, instant, quantity)
                arrays[f"field/x:{body}"] = field.x
                arrays[f"field/{quantity}:{body}@{instant:.6g}"] = field.values
    return arrays


def findings(summary: Mapping[str, Any]) -> list[str]:
    """Return the main results of one run in sentences."""
    sentences = []
    spans = summary["contacts"]
    if len(spans) > MAX_SENTENCES:
        sentences.append(f"{len(spans)} periods of contact; the first {MAX_SENTENCES} are:")
    for span in spans[:MAX_SENTENCES]:
        end = "the end of the run" if span["end"] is None else facts.instant(span["end"])
        peak = "" if span["peak_force"] is None else f", largest force {facts.si(span['peak_force'], 'N')}"
        kicks = f" in {span['kicks']} kicks" if span.get("kicks") is not None else ""
        sentences.append(
            f"{span['contact'].replace('|', ' and ')}: in contact from {facts.instant(span['start'])} to {end}, "
            f"impulse {facts.si(span['impulse'], 'N·s')}{kicks}{peak}."
        )
    for link in summary.get("links", ()):
        several = f" in {link['pieces']} pieces" if link["pieces"] > 1 else ""
        moved = "" if link["set"] is None else f"set {facts.si(link['set'], 'm')}, "
        forces = f"force from {facts.si_range(link['smallest'], link['largest'], 'N')}"
        sentences.append(
            f"{link['name'].replace('|', ' and ')}{several}: {moved}{forces}, {facts.si(link['loss'], 'J')} taken."
        )
    together, met = collision_sentences(summary["collisions"], facts.si)
    if together:
        sentences.append(f"{together}.")
    sentences += [f"Collision of {each}." for each in met[:MAX_SENTENCES]]
    for channel, ranges in list(summary["probes"].items())[:MAX_SENTENCES]:
        quantity = channel.partition(":")[0]
        span = facts.si_range(ranges["min"], ranges["max"], UNITS.get(quantity, "1"))
        name = quantity.replace("_", " ").capitalize()
        sentences.append(f"{name} of {in_words(place_in_words(channel))}: from {span}.")
    errors = summary["errors"]
    if errors and errors["mass_displacement"]:  # an exact run does not differ from itself
        off = cell(100 * errors["mass_displacement"])
        kind = "converged" if errors["reference"] == CONVERGED else "exact"
        sentences.append(f"The displacement of the mass differs from that of the {kind} solution by {off} %.")
    elif errors is None:
        sentences.append(f"Errors: {summary['reference']['text']}.")
    return sentences
