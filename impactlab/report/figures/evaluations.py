"""Figures of evaluated runs and tests: piles, drills, Hopkinson bars, chains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from impactlab.prefixes import Unit, scaled
from impactlab.report.figures.style import INK, LABEL, MUTED, PALETTE, Margins, across, drawn, log_axis, panel_grid
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from impactlab import drilling, granular, hopkinson, piling

SIDE = Margins(left=0.82, across=0.82, down=0.75)  # inches, of panels with axes of their own
GAP_SHADE = 0.15  # opacity
MIN_NAMED = 0.08  # of the largest frequency: a narrower gap has no room for a line of text
LOG_RATIO = 10.0  # largest over smallest stiffness, from which the axis is logarithmic


def _panels(count: int, height: float = 2.4) -> tuple[Figure, list[Axes]]:
    return panel_grid(count, min(count, across(2)), height, SIDE)


Curves = Mapping[str, tuple[Array, str, str]]
"""Values, colour and dash of curves, by name."""


def _scale(curves: Curves, unit: str) -> Unit:
    return scaled(unit, max(float(np.nanmax(np.abs(values), initial=0.0)) for values, _, _ in curves.values()))


def _over_time(axis: Axes, time: Array, curves: Curves, quantity: str, size: Unit) -> None:
    """Draw named curves over time with one unit."""
    clock = scaled("s", float(time[-1]))
    axis.axhline(0.0, color=MUTED, linewidth=0.8)
    for name, (values, colour, dash) in curves.items():
        axis.plot(time / clock.size, values / size.size, color=colour, linestyle=dash, label=name)
    axis.set_xlim(float(time[0]) / clock.size, float(time[-1]) / clock.size)
    axis.set_xlabel(f"time  t  [{clock.label}]")
    axis.set_ylabel(f"{quantity}  [{size.label}]")
    if len(curves) > 1:
        _legend(axis)


def _legend(axis: Axes) -> None:
    """Name the curves inside the axes, where they leave most room."""
    axis.legend(fontsize=LABEL, frameon=False)


@drawn
def blow(found: piling.Blow) -> Figure:
    """Return force and impedance times velocity at the head of a pile over time."""
    figure, (axis,) = _panels(1, 2.8)
    product = found.head.impedance_velocity
    curves = {"force  F": (found.head.force, INK, "-"), "impedance × velocity  Zv": (product, PALETTE[1], "--")}
    _over_time(axis, found.head.time, curves, "F and Zv at the head", _scale(curves, "N"))
    return figure


@drawn
def bearing_graph(found: piling.BearingGraph) -> Figure:
    """Return the static capacity over the blow count; capacities at which the toe does not yield have no point."""
    figure, (axis,) = _panels(1, 2.8)
    size = scaled("N", float(found.capacity.max(initial=0.0)))
    order = np.argsort(found.capacity)
    axis.plot(found.blows_per_metre[order], found.capacity[order] / size.size, "o-", color=INK, markersize=3.5)
    axis.set_xlim(left=0.0)
    axis.set_ylim(bottom=0.0)
    axis.set_xlabel("blow count  [blows/m]")
    axis.set_ylabel(f"static capacity  [{size.label}]")
    return figure


@drawn
def driving(found: piling.Driving) -> Figure:
    """Return the permanent motion in each blow, and the residual forces that the last one leaves."""
    from matplotlib.ticker import MaxNLocator

    figure, (motion, residual) = _panels(2)
    numbers, last = np.arange(1, len(found.blows) + 1), found.blows[-1]
    rows = {"head": [each.head for each in found.blows], "toe": [each.toe for each in found.blows]}
    size = scaled("m", float(np.max(np.abs(list(rows.values())))))
    for (name, values), colour, dash in zip(rows.items(), (INK, PALETTE[1]), ("o-", "s--"), strict=True):
        motion.plot(numbers, np.array(values) / size.size, dash, color=colour, markersize=3.5, label=name)
    motion.xaxis.set_major_locator(MaxNLocator(integer=True))
    motion.set_xlabel("number of the blow")
    motion.set_ylabel(f"permanent motion in a blow  [{size.label}]")
    _legend(motion)
    force = scaled("N", float(np.abs(last.force).max(initial=0.0)))
    residual.stairs(last.force / force.size, last.x, orientation="horizontal", color=INK, baseline=None)
    residual.axvline(0.0, color=MUTED, linewidth=0.8)
    residual.set_ylim(float(last.x.max()), float(last.x.min()))
    residual.set_xlabel(f"force left in the pile  [{force.label}]")
    residual.set_ylabel("place in the pile  x  [m]")
    return figure


@drawn
def match(found: piling.Match) -> Figure:
    """Return the measured and the computed velocity of the head of a pile over time."""
    figure, (axis,) = _panels(1, 2.8)
    curves = {"measured": (found.measured, MUTED, "-"), "computed": (found.computed, PALETTE[1], "-")}
    _over_time(axis, found.time, curves, "velocity of the head", _scale(curves, "m/s"))
    return figure


@drawn
def drill_blow(found: drilling.Blow) -> Figure:
    """Return the force on the rock over the penetration, and the work on it over time."""
    loop = found.loop
    figure, (closed, work) = _panels(2)
    pressed = np.flatnonzero(loop.force != 0.0)
    inside = slice(max(0, int(pressed[0]) - 1), int(pressed[-1]) + 2) if pressed.size else slice(None)
    depth, force = scaled("m", found.deepest), scaled("N", found.peak_force)
    closed.plot(loop.penetration[inside] / depth.size, loop.force[inside] / force.size, color=INK)
    closed.set_xlabel(f"penetration  [{depth.label}]")
    closed.set_ylabel(f"force on the rock  [{force.label}]")
    done = {"work": (loop.work, INK, "-")}
    _over_time(work, loop.time, done, "work on the rock", _scale(done, "J"))
    return figure


@drawn
def efficiencies(found: drilling.Efficiencies) -> Figure:
    """Return the efficiency of a drill over the stiffness of the rock, of the run and of its first pass."""
    figure, (axis,) = _panels(1, 2.8)
    order, size = np.argsort(found.stiffness), scaled("N/m", float(found.stiffness.max(initial=0.0)))
    for name, values, colour, dash in (
        ("whole run", found.efficiency, INK, "o-"), ("first pass", found.first_pass, PALETTE[1], "s--")
    ):  # fmt: skip
        stiffness = found.stiffness[order] / size.size
        axis.plot(stiffness, 100.0 * values[order], dash, color=colour, markersize=3.5, label=name)
    if found.stiffness.size and found.stiffness.max() >= LOG_RATIO * found.stiffness.min():
        axis.set_xscale("log")
        log_axis(axis.xaxis)
    axis.set_ylim(bottom=0.0)
    axis.set_xlabel(f"stiffness of the rock  [{size.label}]")
    axis.set_ylabel("efficiency  [%]")
    _legend(axis)
    return figure


@drawn
def waves_of_test(test: hopkinson.Test) -> Figure:
    """Return the waves at the specimen of a Hopkinson test, and the forces on both of its faces, over time."""
    figure, (waves, forces) = _panels(2)
    rows: Sequence[tuple[str, Array]] = (
        ("incident", test.incident), ("reflected", test.reflected), ("transmitted", test.transmitted)
    )  # fmt: skip
    strains = {name: (row, PALETTE[number], "-") for number, (name, row) in enumerate(rows)}
    _over_time(waves, test.time, strains, "strain at the specimen", Unit(1e-6, "µm/m"))
    front, back = test.forces
    sides = {"front face": (front, INK, "-"), "back face": (back, PALETTE[1], "--")}
    _over_time(forces, test.time, sides, "force on the specimen", _scale(sides, "N"))
    return figure


@drawn
def bands(found: granular.Bands) -> Figure:
    """Return the frequencies of linear waves over the phase of a cell, with the band gaps shaded."""
    figure, (axis,) = _panels(1, 2.8)
    size = scaled("Hz", float(found.frequency.max()))
    axis.plot(found.phase / np.pi, found.frequency.T / size.size, color=INK)
    for low, high in found.gaps:
        axis.axhspan(low / size.size, high / size.size, color=PALETTE[0], alpha=GAP_SHADE, linewidth=0.0)
        if high - low > MIN_NAMED * found.frequency.max():
            text = f"no waves from {low / size.size:.3g} to {high / size.size:.3g} {size.label}"
            middle = 0.5 * (low + high) / size.size
            axis.text(0.5, middle, text, color=PALETTE[0], fontsize=LABEL, ha="center", va="center")
    axis.set_xlim(0.0, 1.0)
    axis.set_ylim(bottom=0.0)
    axis.set_xlabel("phase from cell to cell  q/π")
    axis.set_ylabel(f"frequency  [{size.label}]")
    return figure
