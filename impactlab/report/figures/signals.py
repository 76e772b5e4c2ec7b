"""The time traces of a page on one grid: probes, forces, displacements, gaps and energy."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.history.base import AbstractHistory
from impactlab.history.sampling import page_times
from impactlab.history.units import UNITS as CHANNEL_UNITS
from impactlab.metrics.norms import face_channels, mass_channels
from impactlab.report.figures.drawn_part import energy_parts
from impactlab.report.figures.mechanism import chains
from impactlab.report.figures.named_contacts import NamedContact, force_of, gap_of, named_contacts
from impactlab.report.figures.style import INK, Trace, exact_of
from impactlab.scene.problem import Probe, Scene
from impactlab.types import Array

UNITS = {name: unit.replace(" ", "·") for name, unit in CHANNEL_UNITS.items()} | {"strain": "strain"}
MEASURED = "measured"  # name of the curve of an instrument
SHORT_PERIOD = 16.0  # samples: in a shorter pulse of force they may miss the peak by some per cent
ROUNDING = 1e-9  # %, below which a balance is drawn as the straight line it is


class Line(NamedTuple):
    """One curve of a panel."""

    name: str
    trace: int  # number of the history among those shown
    values: Array  # (HISTORY_POINTS,), NaN where there is none


class Panel(NamedTuple):
    """Curves that share one axis."""

    title: str
    group: str  # probe, force, displacement, gap, angle, drive or energy
    unit: str
    lines: list[Line]


def shown(traces: Sequence[Trace]) -> list[Trace]:
    """Return the histories on a page: the traces, then their reference in ink."""
    reference = exact_of(traces)
    if reference is None or (len(traces) == 1 and traces[0].history.dt is None):
        return list(traces)
    return [*traces, Trace(named(reference), reference, INK)]


def named(reference: AbstractHistory | None) -> str:
    """Return the name of a reference on a page."""
    return "exact" if reference is None or reference.dt is None else "converged"


def panels(
    histories: Sequence[Trace],
    scene: Scene,
    *,
    compared: bool,
    contacts: Sequence[NamedContact] | None = None,
    view: tuple[float, float] | None = None,
) -> list[Panel]:
    """Return the panels of a page with their curves.

    One run has a curve per place, a comparison a curve per method.

    Parameters
    ----------
    contacts : sequence of NamedContact, optional
        Contacts whose forces are shown, and gaps of those that are not linked; all of the scene if not given.
    view : pair of float, optional
        Times [s] between which the curves have their values; the whole run if not given.
    """
    start, end = view or (0.0, scene.duration)
    times = start + page_times(end - start)
    made = []
    for quantity in dict.fromkeys(probe.quantity for probe in scene.probes):
        probes = [probe for probe in scene.probes if probe.quantity == quantity]
        channels = [(probe.channel, place(probe, scene)) for probe in probes]
        seen = {} if compared else measured(histories[0].history, probes, times)
        made += _panels(histories, times, quantity, "probe", UNITS[quantity], channels, compared, seen)
    if contacts is None:
        contacts = named_contacts([trace.history for trace in histories])
    forces = [(f"force:{each.name}", in_words(each.name)) for each in contacts]
    probed = {probe.channel for probe in scene.probes}
    moving = [channel for channel in mass_channels(scene) + face_channels(scene) if channel not in probed]
    moved = [(channel, place_in_words(channel)) for channel in moving]
    gaps = [(f"gap:{each.name}", in_words(each.name)) for each in contacts if not each.linked]
    made += _panels(histories, times, "contact force", "force", "N", forces, compared)
    in_space = {f"position:{point.label}" for point in scene.faces if scene.bodies[point.body].changes}
    for title, kind in (("displacement", False), ("position", True)):  # of a face of a link it is a coordinate
        own = [each for each in moved if (each[0] in in_space) == kind]
        made += _panels(histories, times, title, "displacement", "m", own, compared)
    made += _panels(histories, times, "gap", "gap", "m", gaps, compared)
    links = [link.name for body in chains(scene) for link in body.links]
    for title, quantity in (("angle", "angle"), ("moment of the drive", "drive")):
        channels = [(f"{quantity}:{name}", name) for name in links]
        made += _panels(histories, times, title, quantity, UNITS[quantity], channels, compared)
    return [*made, _energy(histories, times, compared)]


def panels_of(history: Trace, channels: Sequence[str], times: Array) -> list[Panel]:
    """Return the panels of a run's channels at times (n,) [s], by quantity."""
    made = []
    quantities = [channel.partition(":")[0] for channel in channels]
    for quantity in dict.fromkeys(quantities):
        own = [channel for channel, other in zip(channels, quantities, strict=True) if other == quantity]
        named = [(channel, in_words(place_in_words(channel))) for channel in own]
        made += _panels([history], times, quantity, "chosen", UNITS.get(quantity, "1"), named, compared=False)
    return made


def _panels(
    histories: Sequence[Trace],
    times: Array,
    title: str,
    group: str,
    unit: str,
    channels: Iterable[tuple[str, str]],
    compared: bool,
    seen: Mapping[int, Array] = {},
) -> list[Panel]:
    title = title.replace("_", " ").capitalize()
    panels = []
    for at, (channel, words) in enumerate(channels):
        lines = [
            Line(trace.name if compared or trace.colour == INK else words, number, values)
            for number, trace in enumerate(histories)
            if (values := sampled(trace.history, channel, times)) is not None
        ]
        if at in seen:
            lines.insert(1, Line(MEASURED, 0, seen[at]))
        if lines:
            panels.append(Panel(f"{title}, {words}", group, unit, lines))
    if compared or len(panels) < 2 or any(len(panel.lines) > 1 for panel in panels):
        return panels
    return [Panel(title, group, unit, [panel.lines[0] for panel in panels])]


def measured(history: AbstractHistory, probes: Sequence[Probe], times: Array) -> dict[int, Array]:
    """Return the nearest samples of probes with instruments, by probe number.

    A history read from a file has no others than those of its own instants.
    """
    found = {}
    for number, probe in enumerate(probes):
        if probe.instrument is not None:
            with suppress(ImpactlabError):
                signal = history.measured(probe)
                middles = 0.5 * (signal.time[1:] + signal.time[:-1])
                found[number] = signal.values[np.searchsorted(middles, times)]
    return found


def sampled(history: AbstractHistory, channel: str, times: Array) -> Array | None:
    """Return a channel at some times; None without the channel or its values."""
    quantity, _, name = str(channel).partition(":")
    try:
        if quantity == "gap":
            values = gap_of(history, name, times)
        elif quantity == "force" and "@" not in name:
            values = with_short_peaks(history, name, times, force_of(history, name, times))
        else:
            values = history.evaluate(times, channel)
    except ImpactlabError:  # not recorded
        return None
    return values if np.any(np.isfinite(values)) else None


def with_short_peaks(history: AbstractHistory, contact: str, times: Array, force: Array) -> Array:
    """Return the force of a contact with peaks of short periods [N].

    Times (n,) are equally spaced, and may miss such peaks.
    """
    cell = float(times[1] - times[0])
    short = [span for span in history.spans_of([contact]) if span.until(np.inf) - span.start < SHORT_PERIOD * cell]
    made = force.copy() if short else force
    for span in short:
        first, last = (round((at - float(times[0])) / cell) for at in (span.start, span.until(history.duration)))
        if span.peak_force is not None and first >= 0 and last < times.size:
            largest = first + int(np.argmax(force[first : last + 1]))
            made[largest] = max(float(made[largest]), span.peak_force)
    return made


def _energy(histories: Sequence[Trace], times: Array, compared: bool) -> Panel:
    if compared:
        lines = []
        for number, trace in enumerate(histories):
            book = trace.history.energy
            share = 100.0 * book.balance / book.scale
            share[np.abs(share) < ROUNDING] = 0.0
            lines.append(Line(trace.name, number, np.interp(times, book.time, share)))
        return Panel("Energy balance, share of the reference energy", "energy", "%", lines)
    book = histories[0].history.energy
    parts = energy_parts(book)
    parts["bodies and contacts"] = book.total
    lines = [Line(name, 0, np.interp(times, book.time, values)) for name, values in parts.items()]
    return Panel("Energy", "energy", "J", lines)


def place(probe: Probe, scene: Scene) -> str:
    """Return the place of a probe in words: ``rod at 150 mm``."""
    body = scene.bodies.get(probe.body)  # None of a link
    return f"{probe.body} at {millimetres(probe.x)}" if body is None or body.length else probe.body


def in_words(contact: str) -> str:
    """Return the name of a contact in words: ``hammer | rod.left``."""
    return contact.replace("|", " | ")


def place_in_words(channel: str) -> str:
    """Return the place of a channel in words."""
    body, _, x = channel.partition(":")[2].partition("@")
    return f"{body} at {millimetres(float(x))}" if x else body


def millimetres(x: float) -> str:
    """Return a place along a body [m] as text."""
    return f"{1e3 * x:.6g} mm" if x < 1.0 else f"{x:.6g} m"
