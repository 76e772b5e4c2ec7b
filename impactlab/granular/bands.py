"""Linear waves in a precompressed, periodic chain: its bands and band gaps, by Bloch's theorem.

Under a static force F each contact F = k d^1.5 is a spring of the stiffness dF/dd = 1.5 k^(2/3) F^(1/3) for small
motion. With the phase q from one cell to the next, the frequencies are those of a cell whose last spring leads to its
first bead with the factor exp(i q): one branch for each bead of the cell. Each branch rises or falls from q = 0 to pi,
so the edges of the bands are the frequencies there.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import ImpactlabError, expect_whole
from impactlab.granular.spheres import Size, positive
from impactlab.prefixes import prefixed_range
from impactlab.startup.lazy import above
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_POINTS = 100_000  # phases; a figure needs some hundred
MAX_BEADS = 500  # in a cell: a dense eigenvalue problem for each phase
SAME = 1e-9  # of the highest frequency: bands that touch have no gap between them


@dataclass(frozen=True, repr=False)
class Bands:
    """Frequencies of linear waves in a periodic chain over the phase from one cell to the next."""

    phase: Array  # (points,) rad, 0 to pi
    frequency: Array  # (beads of a cell, points) Hz, the lowest branch first

    def __repr__(self) -> str:
        pass_bands = ", ".join(prefixed_range(low, high, "Hz") for low, high in self.edges[:4])
        more = f", ... {len(self.edges) - 4} more" if len(self.edges) > 4 else ""
        return f"<Bands at {pass_bands}{more}>"

    @property
    def edges(self) -> list[tuple[float, float]]:
        """Lowest and highest frequency of each pass band [Hz]."""
        return [(float(row.min()), float(row.max())) for row in self.frequency]

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Lower and upper edge of each gap between two pass bands [Hz]; no wave above the last band passes either."""
        least = SAME * float(self.frequency.max())
        between = [(below[1], over[0]) for below, over in itertools.pairwise(self.edges)]
        return [(low, high) for low, high in between if high - low > least]

    def plot(self) -> Figure:
        """Return the dispersion curves as a figure, with the band gaps shaded."""
        made: Figure = above("report.figures.evaluations").bands(self)
        return made


def bands(masses: ArrayLike, stiffnesses: ArrayLike, force: Size, points: int = 201) -> Bands:
    """Return the linear waves of a chain of equal cells under a static force.

    Parameters
    ----------
    masses : array, shape (n,), or number
        Masses of the beads of one cell [kg].
    stiffnesses : array, shape (n,), or number
        k of F = k d^1.5 [N/m^1.5]: of the contact on the right of each bead, that of the last one leads to the next
        cell. One number is that of all contacts.
    force : float or str
        Static force in the chain [N], or a string with its unit.
    points : int
        Phases from 0 to pi.

    Raises
    ------
    ImpactlabError
        If a size is not above 0, or masses and stiffnesses differ in number.
    """
    expect_whole(points, "points", 2, MAX_POINTS)
    m, load = np.atleast_1d(positive("masses", masses, "kg")), float(positive("force", force, "N"))
    k = np.atleast_1d(positive("stiffnesses", stiffnesses, "N/m^1.5"))
    k = np.full(m.shape, k[0]) if k.size == 1 else k
    if m.ndim != 1 or k.shape != m.shape or m.size > MAX_BEADS:
        raise ImpactlabError(
            f"masses of shape {m.shape} and stiffnesses of shape {k.shape}",
            remedy=f"Give one stiffness for each bead of a cell, of the contact on its right; up to {MAX_BEADS} beads.",
        )
    springs = 1.5 * k ** (2.0 / 3.0) * load ** (1.0 / 3.0)
    phase, n = np.linspace(0.0, math.pi, points), m.size
    matrix = np.zeros((points, n, n), dtype=complex)
    for bead in range(n):
        other = (bead + 1) % n
        turn = np.exp(1j * phase) if other <= bead else np.ones(points)
        matrix[:, bead, bead] += springs[bead]
        matrix[:, other, other] += springs[bead]
        matrix[:, bead, other] -= springs[bead] * turn
        matrix[:, other, bead] -= springs[bead] * turn.conj()
    squared = np.linalg.eigvalsh(matrix / np.sqrt(m[:, None] * m[None, :]))
    squared[0, 0] = 0.0  # all beads move together
    return Bands(phase, np.sqrt(np.maximum(squared, 0.0)).T / (2.0 * math.pi))
