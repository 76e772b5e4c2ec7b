"""The space-time diagram of a row of bodies: the force of each contact over time, as colour.

A solitary wave is a straight line, a reflection a fold. Cells hold the largest force of the contacts and instants in
them, so that no narrow pulse falls between two of them.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.prefixes import scaled
from impactlab.report.figures.style import Margins, clock, drawn, grid, is_narrow
from impactlab.scene.problem import Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MIN_ROW = 6  # contacts; the forces of fewer are read better as curves
MAX_CELLS = 500  # along each axis: more are smaller than a dot of the printed figure
COLOURS = 256
SAMPLES = 4  # instants in a cell


def is_row(scene: Scene) -> bool:
    """Return whether the contacts of a scene, in their order, form one row of bodies."""
    contacts = scene.contacts
    return len(contacts) >= MIN_ROW and all(a.right.body == b.left.body for a, b in pairwise(contacts))


def row_cells(history: AbstractHistory, scene: Scene) -> tuple[Array, bool]:
    """Return the largest forces [N] in cells of instants and contacts, shape (times, contacts).

    In a chain whose static forces exceed their changes these are the changes, and the second value is true.
    """
    times = np.linspace(0.0, scene.duration, SAMPLES * MAX_CELLS, endpoint=False)
    forces = history.evaluate_each(times, [f"force:{contact.name}" for contact in scene.contacts])
    static = forces[:, :1]
    pressed = bool(np.all(static > 0.0) and np.max(np.abs(forces - static)) < np.min(static))
    forces = forces - static if pressed else forces
    together = math.ceil(len(forces) / MAX_CELLS)
    by_contact = np.array([_largest(forces[at : at + together], 0) for at in range(0, len(forces), together)])
    return _largest(by_contact.reshape(len(by_contact), MAX_CELLS, SAMPLES), 2).T, pressed


def _largest(forces: Array, axis: int) -> Array:
    """Return the force of the largest size along an axis, with its sign."""
    low, high = np.min(forces, axis=axis), np.max(forces, axis=axis)
    return np.asarray(np.where(-low > high, low, high))


@drawn
def row_of_forces(history: AbstractHistory, scene: Scene) -> Figure:
    """Return the space-time diagram of a row: contacts to the right by number, time upwards, force as colour."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap
    from matplotlib.ticker import MaxNLocator

    (cells, pressed), time = row_cells(history, scene), clock(scene)
    largest = float(np.max(np.abs(cells))) or 1.0
    force, pulls = scaled("N", largest), bool(cells.min() < 0.0)
    both = colormaps["RdBu_r"]  # red is compression, as in the Lagrange diagram; without tension its red half
    colours = both if pulls else ListedColormap(both(np.linspace(0.5, 1.0, COLOURS)))
    figure, ((axis,),) = grid(1, 1, 2.6 if is_narrow() else 3.6, Margins(right=1.05))
    image = axis.imshow(
        cells / force.size,
        origin="lower",
        aspect="auto",
        extent=(0.5, len(scene.contacts) + 0.5, 0.0, scene.duration / time.size),
        cmap=colours,
        vmin=-largest / force.size if pulls else 0.0,
        vmax=largest / force.size,
        interpolation="none",
    )
    inches = axis.get_position().width * figure.get_figwidth()
    bar = figure.colorbar(image, cax=axis.inset_axes((1.0 + 0.12 / inches, 0.0, 0.11 / inches, 1.0)))
    bar.set_label(f"{'change of contact force  F - F(0)' if pressed else 'contact force  F'}  [{force.label}]")
    axis.grid(visible=False)
    axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    axis.set_xlabel("number of the contact")
    axis.set_ylabel(f"time  t  [{time.label}]")
    return figure
