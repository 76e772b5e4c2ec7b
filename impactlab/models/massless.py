"""Nodes without mass, condensed out of a row of 2-node bars: each lies where its neighbours and its force put it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from impactlab.types import Array

Ints = NDArray[np.int64]


class MasslessNodes:
    """Nodes that carry no mass, no two of them neighbours, and the coordinates that remain.

    A massless node b between its neighbours l and r is at u_b = s_l u_l + s_r u_r + F/K_bb under a force F, with the
    shares s = -K_bl/K_bb: at the free end of a row of bars u_b = u_r + F h/(EA).

    Parameters
    ----------
    at : (n_massless,) int
        Their numbers.
    stiffness : (2, n)
        Of all nodes, lower banded.

    Attributes
    ----------
    flexibility : (n_massless,)
        1/K_bb [m/N].
    """

    def __init__(self, at: Ints, stiffness: Array) -> None:
        n_nodes = stiffness.shape[1]
        self.at = np.asarray(at, np.int64)
        self.kept = np.delete(np.arange(n_nodes), self.at)
        own, below = stiffness[0, self.at], stiffness[1]
        self.flexibility: Array = 1.0 / own
        # A neighbour beyond an end has share 0 and any number.
        self._left, self._right = np.maximum(self.at - 1, 0), np.minimum(self.at + 1, n_nodes - 1)
        self._share_left = np.where(self.at > 0, -below[self._left] / own, 0.0)
        self._share_right = np.where(self.at < n_nodes - 1, -below[self.at] / own, 0.0)

    def folded(self, row: Array) -> Array:
        """Return a row over all nodes as a row over those that remain, without the part of the force, (n_kept,)."""
        folded = row.copy()
        folded[self._left] += self._share_left * row[self.at]
        folded[self._right] += self._share_right * row[self.at]
        return folded[self.kept]

    def unfolded(self, displacement: Array) -> Array:
        """Return the displacements (n, ...) of all nodes from those that remain, under no force on the others."""
        nodal = np.zeros((self.kept.size + self.at.size, *displacement.shape[1:]))
        nodal[self.kept] = displacement
        left, right = nodal[self._left].T * self._share_left, nodal[self._right].T * self._share_right
        nodal[self.at] = (left + right).T
        return nodal

    def condensed(self, matrix: Array) -> Array:
        """Return T^t A T, shape (2, n_kept), of a matrix A (2, n), T the shares: static condensation where A is K."""
        result = matrix.copy()
        own, low, high = matrix[0, self.at], matrix[1, self._left] * (self.at > 0), matrix[1, self.at]
        s_left, s_right = self._share_left, self._share_right
        result[0, self._left] += s_left * (2.0 * low + s_left * own)
        result[0, self._right] += s_right * (2.0 * high + s_right * own)
        # The node to the left is now coupled to the one on the right.
        inner = (self.at > 0) & (self.at < matrix.shape[1] - 1)
        result[1, self._left] = np.where(inner, s_left * high + s_right * low + s_left * s_right * own, 0.0)
        result = result[:, self.kept]
        result[1, -1] = 0.0
        return result
