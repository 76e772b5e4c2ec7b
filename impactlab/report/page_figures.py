"""The figures of the page of a run or of a comparison, with their captions."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from impactlab.history.base import AbstractHistory
from impactlab.report.comparison import cell
from impactlab.report.figures import (
    applications,
    balance,
    diagram,
    differences,
    fields,
    mechanism,
    overview,
    plots,
    signals,
)
from impactlab.report.figures.figure_files import PageFigure
from impactlab.report.figures.named_contacts import NamedContact, law_of, named_contacts, with_figures
from impactlab.report.figures.row_diagram import is_row, row_of_forces
from impactlab.report.figures.signals import MEASURED, Panel
from impactlab.report.figures.style import Trace, exact_of
from impactlab.scene.problem import Scene

MAX_PRINTED = 3  # contacts and bodies that have figures of their own on a page without all of them


def of_run(trace: Trace, scene: Scene) -> list[PageFigure]:
    """Return the figures of one run."""
    kind = signals.named(trace.reference)
    dark = f" The thin line is the {kind} solution." if trace.reference is not None else ""
    shares = PageFigure(
        "energy",
        "Shares of the energy",
        "Stacked: bodies, contacts, losses by known formulas. The dashed line is the energy at "
        "the start and the work of loads and drives since then; below it energy was lost that no "
        "formula explains, above it energy was gained.",
        partial(balance.energy_shares, trace, scene),
    )
    along = fields_at_snapshots([trace], scene, f"at the snapshots.{dark if kind == 'exact' else ''}")
    over_time = histories_of([trace], scene, f"Positive in compression.{dark}", dark)
    words = "To scale, links drawn straight: at the start, where contacts begin, and at the end."
    moved = [
        PageFigure(
            f"mechanism_{chain.name}",
            f"Mechanism {chain.name}",
            words,
            partial(mechanism.positions, trace.history, scene, chain),
        )
        for chain in mechanism.chains(scene)
    ]
    own = [trace.history, *([trace.reference] if trace.reference is not None else [])]
    first = [*moved, *applications.of_laws_with_memory(trace, scene), *probes([trace], scene, compared=False)]
    return [*first, *waves(own, scene), *row_forces(trace.history), *over_time, shares, *along]


def of_comparison(comparison: Mapping[str, Any], shown: Sequence[Trace], scene: Scene) -> list[PageFigure]:
    """Return the figures of a comparison, those that show most first."""
    if not shown:
        return []
    compared = any(trace.reference is not None for trace in shown)
    reference = exact_of(shown)
    kind = signals.named(reference)
    dark = f" The thin line is the {kind} solution." if compared else ""
    known = [*([reference] if reference is not None else []), *(trace.history for trace in shown)]
    figures = [*probes(shown, scene, compared=True), *waves(known, scene)]
    if compared:
        words = (
            "Each dot is the error of one method in one norm, all on one logarithmic scale. Further left is better, "
            "bold is the best of a panel, a hollow dot lies below the scale. The ranking depends on the norm."
        )
        draw = partial(overview.errors, comparison["rows"], {trace.name: trace.colour for trace in shown})
        figures.append(PageFigure("errors", "Errors", words, draw))
    if not all(contact.linked for contact in named_contacts([trace.history for trace in shown])):
        words = (
            f"A bar is a period of contact, a tick an impulse. Dotted lines are the {kind} closings and openings: a "
            "bar cut in pieces is chatter, a missing bar a missed contact."
        )
        figures.append(PageFigure("contacts", "Periods of contact", words, partial(overview.contacts, shown, scene)))
    several = len(scene.contacts) > 1
    force = (
        f"One panel per method on common axes.{dark} Above a panel is its error away from the "
        f"jumps{', the largest over all contacts' if several else ''}."
    )
    figures += histories_of(shown, scene, force, dark, force_notes(comparison, several))
    words = (
        "Energy of bodies and contacts plus losses by known formulas minus work, relative to its "
        "first value: zero for a perfect run, above zero where energy was gained, below zero "
        "where energy was lost that no formula explains."
    )
    figures.append(
        PageFigure(
            "energy",
            "Energy balance",
            words,
            partial(balance.energy_balance, shown, scene),
            has_live_twin=True,
            is_printed=False,
        )
    )
    return figures + fields_at_snapshots(shown, scene, f"at the snapshots, one row per method.{dark}")


def probes(shown: Sequence[Trace], scene: Scene, *, compared: bool) -> list[PageFigure]:
    """Return the signals of the probes, as gauges would record them."""
    histories = signals.shown(shown)
    panels = [
        panel for panel in signals.panels(histories, scene, compared=compared, contacts=()) if panel.group == "probe"
    ]
    if not panels:
        return []
    words = "The recorded signals, stress and strain positive in compression."
    words += _on_instruments(panels)
    dark = " The dark line is the reference." if len(histories) > 1 else ""
    draw = partial(plots.signals, panels, histories, scene, compared=compared)
    is_printed = not (compared and scene.contacts)
    return [PageFigure("probes", "Probes", words + dark, draw, has_live_twin=True, is_printed=is_printed)]


def _on_instruments(panels: Sequence[Panel]) -> str:
    """Return a sentence on the measured signals among the panels; empty where there are none."""
    known = any(line.name == MEASURED for panel in panels for line in panel.lines)
    return " In the second colour: as the instrument of the probe measures it." if known else ""


def histories_of(
    shown: Sequence[Trace], scene: Scene, force: str, dark: str, notes: Mapping[str, str] | None = None
) -> list[PageFigure]:
    """Return the figures over time of forces, gaps, displacements and differences.

    Each contact has a force and a gap.

    Parameters
    ----------
    force : str
        Caption of the forces.
    dark : str
        Sentence on the dark line.
    notes : mapping, optional
        Name of a trace to the words above its panel of the force.
    """
    figures = []
    known = [trace.history for trace in shown]
    drawn, several = with_figures(known), len(named_contacts(known)) > 1
    for number, contact in enumerate(drawn):
        tail, of = (f"_{contact.number}", f", {contact.name}") if several else ("", "")
        words = f"The whole run, and the range near zero, which shows penetration and near touches.{dark}"
        traces = shown if notes is not None else [each._replace(name=law_of(each.history, contact)) for each in shown]
        draw = partial(plots.force, traces, scene, contact.name, notes)
        figures.append(
            PageFigure(
                f"force{tail}",
                f"Contact force{of}",
                _on_pieces(contact) + force,
                draw,
                has_live_twin=len(shown) == 1,
                is_printed=number < MAX_PRINTED,
            )
        )
        if not contact.linked:
            draw = partial(plots.gap, shown, scene, contact.name)
            figures.append(PageFigure(f"gap{tail}", f"Gap{of}", words, draw, has_live_twin=True, is_printed=False))
    if not scene.contacts:
        return figures
    histories, compared = signals.shown(shown), len(shown) > 1
    panels = [
        panel
        for panel in signals.panels(histories, scene, compared=compared, contacts=())
        if panel.group == "displacement"
    ]
    if panels:
        words = f"Displacement since the start of the masses and faces in contact.{dark}"
        if any(body.changes for body in scene.bodies.values()):
            words = f"Faces of a mechanism have their position in space, along the contact. {words}"
        draw = partial(plots.signals, panels, histories, scene, compared=compared)
        figures.append(PageFigure("displacement", "Displacement", words, draw, has_live_twin=True, is_printed=False))
    if differences.differences(shown):
        words = (
            "The largest difference of a displacement from the reference so far, in % of its largest "
            "value: a curve rises when its method becomes inaccurate. Of many masses and faces, those with the largest "
            "differences."
        )
        draw = partial(differences.difference, shown, scene)
        figures.append(PageFigure("difference", "Growth of the difference", words, draw, is_printed=not compared))
    return figures


def _on_pieces(contact: NamedContact) -> str:
    count = len(contact.members)
    return f"The sum of {count} pieces. " if count > 1 else ""


def fields_at_snapshots(shown: Sequence[Trace], scene: Scene, words: str) -> list[PageFigure]:
    """Return figures of the load along elastic bodies at the snapshots of a case."""
    figures = []
    for number, (name, body) in enumerate(scene.elastic.items() if scene.snapshots else ()):
        load = fields.load_of(body)
        title = f"{load.replace('_', ' ').capitalize()} in {name}"
        caption = f"Along the {body.kind} {words}"
        figures.append(
            PageFigure(
                f"{load}_{name}",
                title,
                caption,
                partial(fields.snapshots, shown, scene, name),
                is_printed=number < MAX_PRINTED,
            )
        )
    return figures


def waves(histories: Sequence[AbstractHistory], scene: Scene) -> list[PageFigure]:
    """Return the Lagrange diagram of the first history that keeps fields at all times."""
    known = next((history for history in histories if diagram.has_waves(history, scene)), None)
    if known is None:
        return []
    words = (
        "All bodies end to end, place to the right, time upwards: waves run along the slanted edges. Red is "
        "compression, blue tension (of beams up and down). A dot is a closing, a ring an opening of a contact."
    )
    return [PageFigure("waves", "The waves", words, partial(diagram.lagrange, known, scene), has_live_twin=True)]


def row_forces(history: AbstractHistory) -> list[PageFigure]:
    """Return the space-time diagram of a row of bodies, of all its contacts."""
    whole = dataclasses.replace(history.scene, duration=history.duration)
    if not is_row(whole):
        return []
    words = "Contacts to the right in their order, time upwards, force as colour: waves run along the slanted lines."
    return [PageFigure("row", "Forces along the row", words, partial(row_of_forces, history, whole))]


def force_notes(comparison: Mapping[str, Any], several: bool) -> dict[str, str]:
    """Return text above each method's panel: its error of the force away from jumps."""
    words, notes = "off jumps, worst contact" if several else "off jumps", {}
    for row in comparison["rows"]:
        error = (row["summary"].get("errors") or {}).get("force_away_from_jumps")
        notes[row["name"]] = "" if error is None else "exact" if error < 1e-9 else f"{cell(100 * error)} % {words}"
    return notes
