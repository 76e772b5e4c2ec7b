"""Figures of laws that remember, and those used for piles and Hopkinson bars."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from impactlab import hopkinson
from impactlab.contact.smith import Smith
from impactlab.contact.specimen import Specimen
from impactlab.errors import ImpactlabError, RunWarning
from impactlab.history.base import AbstractHistory
from impactlab.history.sampling import page_times
from impactlab.prefixes import scaled
from impactlab.report.figures.figure_files import PageFigure
from impactlab.report.figures.style import (
    INK,
    MUTED,
    PALETTE,
    Margins,
    Trace,
    across,
    clock,
    drawn,
    grid,
    lower_margin,
    name_lines,
    panel_grid,
    room_beside,
    time_axis,
    upper_margin,
)
from impactlab.scene.problem import Scene
from impactlab.startup.lazy import lazy
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from impactlab.piling import measured
    from impactlab.piling.blow import Head
else:  # with fits and optimisers, which figures of other runs do not need
    measured = lazy("impactlab.piling.measured")

MAX_LOOPS = 6  # panels of a figure
EDGE = 0.05  # of the width of a loop, free on both sides of it


class Loop(NamedTuple):
    """Force over closing of one contact, or of all of one name.

    Several contacts have the sum of their forces over the mean of their closings.
    """

    name: str
    closing: Array  # (n,) m, zero at the start
    force: Array  # (n,) N
    pieces: int = 1  # contacts of the name


def of_laws_with_memory(trace: Trace, scene: Scene) -> list[PageFigure]:
    """Return figures of laws with memory: loops, the head of a pile, curves of specimens."""
    history, figures = trace.history, []
    laws = history.method.laws
    if any(isinstance(law, Smith) for law in laws.values()):
        with suppress(ImpactlabError):  # links that hold no pile, or several; a head that was not recorded
            found = measured.head_signals(history)
            words = (
                "Force and impedance times velocity are equal until the first wave returns from the "
                "soil; their difference before 2 L/c is the resistance along the shaft."
            )
            figures.append(PageFigure("pile_head", "Head of the pile", words, partial(pile_head, found, scene)))
    for number, contact in enumerate(scene.contacts, start=1):
        law = laws.get(contact.name)
        if isinstance(law, Specimen):
            words = (
                "Nominal stress over nominal strain: the specimen in the run, and the curve of its law "
                "under slow loading."
            )
            gauges = by_gauges(history, contact.left.body, contact.right.body, law)
            if gauges is not None:
                words += (
                    " By three waves, from the strain probes of the two bars, until a wave from the far end of a "
                    "bar reaches one of them."
                )
            draw = partial(stress_strain, history, contact.name, law, gauges)
            figures.append(PageFigure(f"specimen_{number}", f"Specimen, {contact.name}", words, draw))
    if found_loops := loops(history, scene):
        words = "The area inside a loop is the energy that the contact took. Compression is positive."
        if several := [loop.name for loop in found_loops if loop.pieces > 1]:
            words += (
                f" Of {' and '.join(several)} the sum of the forces of several contacts is shown over the mean of "
                "their closings: the area only approximates their energy, which the summary gives."
            )
        figures.append(PageFigure("loops", "Force over closing", words, partial(force_loops, found_loops)))
    return figures


def loops(history: AbstractHistory, scene: Scene) -> list[Loop]:
    """Return the loops of all contacts with permanent deformation.

    Pieces of one name are taken together. Specimens are left out: they have curves of stress over strain.
    """
    grouped: dict[str, list[str]] = {}
    for contact in scene.contacts:
        law = history.method.laws.get(contact.name)
        if law is not None and law.remembers and not isinstance(law, Specimen):
            grouped.setdefault(contact.shared_name, []).append(contact.name)
    times, found = page_times(scene.duration), []
    for name, contacts in list(grouped.items())[:MAX_LOOPS]:
        gaps = np.mean([history.evaluate(times, f"gap:{each}") for each in contacts], axis=0)
        force = np.sum([history.evaluate(times, f"force:{each}") for each in contacts], axis=0)
        found.append(Loop(name, gaps[0] - gaps, force, len(contacts)))
    return found


def _closed(loop: Loop) -> tuple[float, float]:
    """Return the closings between which a loop has a force [m].

    They have a margin: faces may part by far more than that.
    """
    held = loop.closing[loop.force != 0.0]
    least, most = (min(0.0, held.min()), max(0.0, held.max())) if len(held) else (0.0, 0.0)
    margin = EDGE * ((most - least) or float(np.abs(loop.closing).max()) or 1.0)
    return float(least - margin), float(most + margin)


@drawn
def force_loops(found: Sequence[Loop]) -> Figure:
    """Return the force over the closing of each contact, a panel each."""
    figure, axes = panel_grid(len(found), min(len(found), across(3)), 2.2, Margins(down=0.75))
    for axis, loop in zip(axes, found, strict=True):
        moved = scaled("m", float(np.abs(_closed(loop)).max()))
        force = scaled("N", float(np.abs(loop.force).max()))
        axis.axhline(0.0, color=MUTED, linewidth=0.8)
        axis.plot(loop.closing / moved.size, loop.force / force.size, color=PALETTE[0])
        axis.set_xlim(*(each / moved.size for each in _closed(loop)))
        axis.set_title(loop.name)
        axis.set_xlabel(f"closing  [{moved.label}]")
        axis.set_ylabel(f"force  F  [{force.label}]")
    return figure


@drawn
def pile_head(head: Head, scene: Scene) -> Figure:
    """Return force and impedance times velocity at the head of a pile over time."""
    curves = {"force": (head.force, INK, "-"), "Z v": (head.impedance_velocity, PALETTE[1], "--")}
    margins = Margins(right=room_beside(curves), top=upper_margin(curves), bottom=lower_margin(trips=True))
    figure, ((axis,),) = grid(1, 1, 2.6, margins)
    time, unit = clock(scene), scaled("N", float(np.abs(head.force).max()))
    for values, colour, dash in curves.values():
        axis.plot(head.time / time.size, values / unit.size, color=colour, linestyle=dash)
    axis.axhline(0.0, color=MUTED, linewidth=0.8)
    axis.set_ylabel(f"force  [{unit.label}]")
    time_axis(axis, scene, trips=True)
    name_lines(axis, [(name, colour, dash) for name, (_, colour, dash) in curves.items()])
    return figure


def by_gauges(history: AbstractHistory, incident: str, transmission: str, law: Specimen) -> hopkinson.Curve | None:
    """Return the curve of two bars' probes by three-wave analysis; None for other bars."""
    diameter = float(np.sqrt(4.0 * law.area / np.pi))
    with suppress(ImpactlabError), warnings.catch_warnings():
        warnings.simplefilter("ignore", RunWarning)  # the caption has the end of the curve
        test = hopkinson.of_history(history, incident, transmission)
        return hopkinson.evaluate(test, hopkinson.Specimen(law.length, diameter))
    return None


@drawn
def stress_strain(history: AbstractHistory, contact: str, law: Specimen, gauges: hopkinson.Curve | None) -> Figure:
    """Return the stress of a specimen over its strain as a figure.

    It shows the law, the run, and the curve by the gauges on both bars.
    """
    times = page_times(history.duration)
    gap, force = history.evaluate(times, f"gap:{contact}"), history.evaluate(times, f"force:{contact}")
    strain, stress = (gap[0] - gap) / law.length, force / law.area
    curves = {
        "law, slow": (*law.loading_curve(float(strain.max())), MUTED, "-", 4.0),
        "specimen": (strain, stress, INK, "-", 1.4),
    }
    if gauges is not None:
        curves["by three waves"] = (gauges.strain, gauges.stress, PALETTE[1], "--", 1.4)
    return _over_strain(curves)


@drawn
def stress_strain_curves(
    curve: hopkinson.Curve,
    others: Mapping[str, hopkinson.Curve],
    band: tuple[ArrayLike, ArrayLike, ArrayLike] | None,
) -> Figure:
    """Return the stress of curves over their strain as a figure.

    The first has no name where it is alone; a band may stand behind them. The band is strain, lower and upper stress
    [Pa], shape (n,) each.
    """
    curves = {"curve": (curve.strain, curve.stress, INK, "-", 1.4)}
    for number, (name, other) in enumerate(others.items()):
        curves[name] = (other.strain, other.stress, PALETTE[number % len(PALETTE)], "-", 1.4)
    figure = _over_strain(curves, named=bool(others))
    if band is not None:
        strain, lower, upper = (np.asarray(row, float) for row in band)
        (axis,) = figure.axes
        axis.fill_between(100.0 * strain, 1e-6 * lower, 1e-6 * upper, color=MUTED, alpha=0.25, linewidth=0.0)
    return figure


def _over_strain(curves: Mapping[str, tuple[Array, Array, str, str, float]], named: bool = True) -> Figure:
    """Return a figure of stress [MPa] over strain [%] of named curves.

    Each curve has strain, stress [Pa], colour, dash and width.
    """
    margins = Margins(right=room_beside(curves), top=upper_margin(curves)) if named else Margins()
    figure, ((axis,),) = grid(1, 1, 2.8, margins)
    for x, y, colour, dash, width in curves.values():
        axis.plot(100.0 * x, 1e-6 * y, color=colour, linestyle=dash, linewidth=width)
    axis.set_xlabel("strain  [%]")
    axis.set_ylabel("stress  [MPa]")
    if named:
        name_lines(axis, [(name, colour, dash) for name, (_, _, colour, dash, _) in curves.items()])
    return figure
