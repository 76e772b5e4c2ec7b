"""Notebook views of cases, runs and comparisons as HTML, and figures of signals and waves."""

from __future__ import annotations

import dataclasses
import html
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.history.arguments import END_ROUNDING
from impactlab.history.base import SERIOUS, AbstractHistory, ContactSpan
from impactlab.history.sampling import FRAMES, page_times
from impactlab.printing import counted
from impactlab.report import facts
from impactlab.report.figures import diagram, plots, signals
from impactlab.report.figures.drawn_part import drawn_part
from impactlab.report.figures.figure_files import inline, to_svg
from impactlab.report.figures.named_contacts import named_contacts
from impactlab.report.figures.row_diagram import is_row, row_of_forces
from impactlab.report.figures.style import PALETTE, Trace, traces
from impactlab.report.sketch import sketch
from impactlab.report.table import page_headings, page_rows
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_PERIODS, MAX_PANELS = 10, 6  # rows of the table of contacts; panels of the figure
MOST = 2  # bodies of a row for each elastic one, above which it is drawn by its contacts
MAX_NAMED = 40  # channels in a message
GROUPS = ("probe", "force", "displacement")  # of signals, those of the first shown first


def plot(history: AbstractHistory, *channels: str, start: float = 0.0, end: float | None = None) -> Figure:
    """Return signals of a run over time; see `impactlab.history.views.Views.plot`.

    Raises
    ------
    ImpactlabError
        If the run has no such channel, a channel no values, the run nothing to draw, or the times do not lie in it.
    """
    end = history.duration if end is None else end
    if not 0.0 <= start < end <= history.duration * (1.0 + END_ROUNDING):
        raise ImpactlabError(
            f"a figure from {start:.6g} s to {end:.6g} s of a run from 0 to {history.duration:.6g} s",
            remedy="Give start and end in s, in this order, within the run.",
        )
    view, trace = (start, min(end, history.duration)), Trace("run", history, PALETTE[0])
    if not channels:
        return signals_of([trace], drawn_part(whole(history)).scene, compared=False, view=view)
    for channel in channels:
        _check(history, channel, view)
    times = start + page_times(view[1] - start)
    panels = signals.panels_of(trace, list(dict.fromkeys(channels)), times)
    return plots.signals(panels, [trace], whole(history), compared=False, view=view)


def _check(history: AbstractHistory, channel: str, view: tuple[float, float]) -> None:
    """Raise `ImpactlabError` for a channel without values in a run.

    A run may not have it, or it may have no values, as the force of an impulse law.
    """
    if not isinstance(channel, str) and isinstance(channel, Iterable):
        raise ImpactlabError(
            "plot() takes names of channels, not a list of them",
            remedy="Write history.plot(*channels), with a star, or history.plot('A', 'B').",
        )
    quantity = str(channel).partition(":")[0]
    names = sorted(history.channels(), key=lambda name: not name.startswith(f"{quantity}:"))  # like ones first
    found = signals.sampled(history, channel, np.linspace(*view, 101)) if ":" in str(channel) else None
    if found is not None:
        return
    if channel in names:
        raise ImpactlabError(f"channel '{channel}' has no values in this run", remedy="Leave it out of the figure.")
    many = f", ... ({len(names)} in all: `history.channels()`)" if len(names) > MAX_NAMED else ""
    raise ImpactlabError(
        f"the run has no channel '{str(channel)[:80]}'; it has {', '.join(names[:MAX_NAMED])}{many}",
        remedy="A quantity at another place needs a probe in the case.",
        path="probes",
    )


def plot_comparison(rows: Mapping[str, AbstractHistory], references: Mapping[str, AbstractHistory]) -> Figure:
    """Return the signals of several methods over time, with references.

    The figure has a panel for each place.
    """
    if not rows:
        raise ImpactlabError("no method ended, so there is nothing to draw", remedy="Print the comparison for reasons.")
    shown = signals.shown(traces(rows, references))
    return signals_of(shown, drawn_part(shown[0].history.scene).scene, compared=True)


def plot_xt(history: AbstractHistory) -> Figure:
    """Return the Lagrange diagram of a run; of a row of mostly rigid bodies the forces of its contacts.

    Raises
    ------
    ImpactlabError
        If the run keeps no fields of any body.
    """
    scene = whole(history)
    if is_row(scene) and MOST * len(scene.elastic) < len(scene.bodies):
        return row_of_forces(history, scene)
    if not scene.elastic:
        text = "all bodies are rigid: there are no waves inside them to draw"
        if any(body.changes for body in scene.bodies.values()):
            text = "links of a mechanism have no diagram of waves, as they turn"
        raise ImpactlabError(text, remedy="history.plot() draws forces and velocities over time.")
    if not diagram.has_waves(history, scene):
        raise ImpactlabError(
            f"{_kept(scene)}, so its waves cannot be drawn", remedy="Run it as il.run(case, frames=240)."
        )
    return diagram.lagrange(history, scene)


def _kept(scene: Scene) -> str:
    """Return how many fields a stepped run kept."""
    if not scene.field_times:
        return "no fields were kept of this run"
    return f"fields of this run were kept at {len(scene.field_times)} instants, not at the {FRAMES + 1} of the diagram"


def signals_of(
    shown: Sequence[Trace], scene: Scene, *, compared: bool, view: tuple[float, float] | None = None
) -> Figure:
    """Return a figure of the first few signals of histories.

    It is over the whole run or a view of it [s].

    Raises
    ------
    ImpactlabError
        If there is none.
    """
    drawn = {contact.shared_name for contact in scene.contacts}
    contacts = [each for each in named_contacts([trace.history for trace in shown]) if each.name in drawn]
    panels = signals.panels(shown, scene, compared=compared, contacts=contacts, view=view)
    chosen = [panel for group in GROUPS for panel in panels if panel.group == group][:MAX_PANELS]
    if not chosen:
        raise ImpactlabError("there is no signal to draw", remedy="Name probes in the case.", path="probes")
    return plots.signals(chosen, shown, scene, compared=compared, view=view)


def whole(history: AbstractHistory) -> Scene:
    """Return the scene of a run, as long as the run lasted."""
    return dataclasses.replace(history.scene, duration=history.duration)


def of_case(label: str, title: str, run: Simulation, methods: Sequence[str], hints: Sequence[str]) -> str:
    """Return a case as HTML: sketch, facts, methods, hints."""
    scene = run.scene
    rows = [
        *facts.scene_facts(scene, facts.joined_in(*run)),
        *([("methods", ", ".join(methods))] if len(methods) > 1 else []),
    ]
    drawn = sketch(drawn_part(scene).scene)
    return _block(_heading(title or label, label if title else ""), drawn, _facts(rows), *map(_warning, hints))


def of_history(history: AbstractHistory) -> str:
    """Return a run as HTML: sketch, method, figure, periods of contact, warnings."""
    case, scene, book = history.case, whole(history), history.energy
    name = case.label if case is not None else scene.name
    if case is not None and case.method_name != "base":
        name += f", method {case.method_name}"
    solved = f"{history.cost.steps} steps, solved in {facts.si(history.cost.solve_s, 's')}"
    rows = [
        ("duration", facts.si(history.duration, "s")),
        ("solution", solved if history.dt is not None else f"exact, in {facts.si(history.cost.solve_s, 's')}"),
        ("energy", f"gain {_percent(book.largest_gain)}, loss {_percent(book.largest_loss)}"),
    ]
    warned = sorted(history.warnings, key=lambda each: each.code not in SERIOUS)
    return _block(
        _heading(case.title if case is not None and case.title else name, name),
        *(_warning(f"{each.code}: {each.text}") for each in warned if each.code in SERIOUS),
        sketch(drawn_part(scene).scene),
        _facts(rows),
        _figure(lambda: plot(history), "Signals of the run"),
        _periods(history.contacts),
        *(_warning(f"{each.code}: {each.text}", doubt=False) for each in warned if each.code not in SERIOUS),
    )


def of_comparison(
    document: Mapping[str, Any],
    rows: Mapping[str, AbstractHistory],
    references: Mapping[str, AbstractHistory],
    title: str = "",
) -> str:
    """Return a comparison as HTML: table, figure, warnings."""
    headings = page_headings(document)
    lines = []
    for row in page_rows(document):
        if "failure" in row:
            lines.append(
                f'<tr><th>{_text(row["name"])}</th><td colspan="{len(headings) - 1}">{_text(row["failure"])}</td></tr>'
            )
            continue
        texts = (f"<b>{_text(cell.text)}</b>" if cell.best else _text(cell.text) for cell in row["cells"])
        cells = (f'<td class="n">{text}</td>' for text in texts)
        lines.append(f"<tr><th>{_text(row['name'])}</th>{''.join(cells)}</tr>")
    top = "".join(
        f'<th class="{"n" if number else ""}">{_text(name)}{f" [{_text(unit)}]" if unit else ""}</th>'
        for name, unit, number in headings
    )
    serious = [
        f"{name}: {each.code}: {each.text}" for name, h in rows.items() for each in h.warnings if each.code in SERIOUS
    ]
    return _block(
        _heading(title or str(document["case"]), f"{counted(len(document['rows']), 'method')} compared"),
        *map(_warning, serious),
        f'<div class="wide"><table><tr>{top}</tr>{"".join(lines)}</table></div>',
        _figure(lambda: plot_comparison(rows, references), "Signals of the methods"),
    )


def _percent(share: float) -> str:
    return f"{round(100.0 * share, 9):.2g} %"


def _block(*parts: str) -> str:
    rules = (files("impactlab.report") / "notebook.css").read_text(encoding="utf-8")
    colours = " ".join(f"--c{number}: {colour};" for number, colour in enumerate(PALETTE))
    return f'<div class="impactlab"><style>{rules}.impactlab {{ {colours} }}</style>{"".join(parts)}</div>'


def _heading(title: str, under: str) -> str:
    return f"<h4>{_text(title)}</h4>" + (f"<p>{_text(under)}</p>" if under and under != title else "")


def _facts(rows: Iterable[tuple[str, str]]) -> str:
    return (
        "<table>"
        + "".join(f"<tr><th>{_text(name)}</th><td>{_text(words)}</td></tr>" for name, words in rows)
        + "</table>"
    )


def _periods(spans: Sequence[ContactSpan]) -> str:
    if not spans:
        return "<p>No contact.</p>"
    lines = "".join(
        f"<tr><th>{_text(span.contact.replace('|', ' | '))}</th>"
        + "".join(f'<td class="n">{_text(words)}</td>' for words in _words(span))
        + "</tr>"
        for span in spans[:MAX_PERIODS]
    )
    names = ("contact", "from", "to", "impulse", "largest force")
    top = "".join(f'<th class="{"n" if number else ""}">{name}</th>' for number, name in enumerate(names))
    more = f"<p>and {len(spans) - MAX_PERIODS} more periods of contact</p>" if len(spans) > MAX_PERIODS else ""
    return f"<table><tr>{top}</tr>{lines}</table>{more}"


def _words(span: ContactSpan) -> tuple[str, ...]:
    end = "the end" if span.end is None else facts.si(span.end, "s")
    peak = "" if span.peak_force is None else facts.si(span.peak_force, "N")
    return facts.si(span.start, "s"), end, facts.si(span.impulse, "N·s"), peak


def _figure(draw: Callable[[], Figure], label: str) -> str:
    """Return a figure as SVG; nothing where there is nothing to draw."""
    try:
        return inline(to_svg(draw()), label)
    except ImpactlabError:
        return ""


def _warning(text: str, doubt: bool = True) -> str:
    return f'<p class="{"doubt" if doubt else ""}">Warning: {_text(text)}</p>'


def _text(words: Any) -> str:
    return html.escape(str(words))
