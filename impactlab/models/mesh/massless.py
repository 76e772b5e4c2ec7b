"""Static condensation of nodes without mass out of a row of 2-node bars."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from impactlab.errors import CaseError
from impactlab.numerics.banded import multiply
from impactlab.scene.bodies import WaveBody
from impactlab.types import Array, Ints


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
        """Return a row over all nodes as a row over those that remain.

        Shape (n_kept,). The part of the force is left out.
        """
        folded = row.copy()
        folded[self._left] += self._share_left * row[self.at]
        folded[self._right] += self._share_right * row[self.at]
        return folded[self.kept]

    def unfolded(self, displacement: Array) -> Array:
        """Return the displacements (n, ...) of all nodes, unloaded, from those that remain."""
        nodal = np.zeros((self.kept.size + self.at.size, *displacement.shape[1:]))
        nodal[self.kept] = displacement
        left, right = nodal[self._left].T * self._share_left, nodal[self._right].T * self._share_right
        nodal[self.at] = (left + right).T
        return nodal

    def sums(self, sums: Array, matrix: Array, springs: Array) -> Array:
        """Return the row sums of T^t A T from those of A, shape (n_kept,).

        ``matrix`` is A, in bands (2, n); ``springs`` are the row sums of K.
        """
        # Neighbours that move by 1 leave a node that a spring holds behind by its share.
        behind = np.zeros(sums.size)
        behind[self.at] = springs[self.at] * self.flexibility
        return self.folded(sums - multiply(matrix, behind) if np.any(behind) else sums)

    def condensed(self, matrix: Array) -> Array:
        """Return T^t A T, shape (2, n_kept), of a matrix A (2, n).

        T holds the shares; static condensation where A is K.
        """
        if len(matrix) == 1:  # couples nothing: of a rod without damping zero
            return matrix[:, self.kept]
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


def struck_nodes(rod: WaveBody, faces: Sequence[tuple[float, Array]]) -> Ints:
    """Return the numbers of the contacts' nodes among those not clamped.

    Raise `CaseError` where they must keep their mass. Each face is a place x [m] and the row of its displacement over
    these nodes, shape (n_nodes,).
    """
    struck, name = [], rod.name
    for x, row in faces:
        if np.count_nonzero(row) != 1:
            raise CaseError(
                f"mass 'redistributed' needs a node at every contact, and x = {x:.6g} m of '{name}' "
                "lies inside an element",
                remedy="Give a number of elements that puts a node there, or mass: lumped.",
                path="solve.model.mass",
            )
        struck.append(int(np.argmax(row)))
        # A spring is condensed with the node; a force that is no contact's would lack its F h/(EA).
        carried = {0.0: rod.left, rod.length: rod.right}[x].carries if x in (0.0, rod.length) else "inner"
        if carried in ("mass", "dashpot", "force"):
            raise CaseError(
                "mass 'redistributed' moves the mass of a struck face to the neighbouring nodes, and "
                f"that of '{name}' at x = {x:.6g} m carries a {carried}",
                remedy="Give mass: lumped or consistent.",
                path="solve.model.mass",
            )
    at = np.unique(np.array(struck, np.int64))
    if np.any(np.diff(at) == 1) or any(at.size >= row.size for _, row in faces):
        raise CaseError(
            f"mass 'redistributed' needs a node with mass between two contacts of '{name}'",
            remedy="Give more elements.",
            path="solve.model.elements",
        )
    return at


def redistribute(mass: Array, at: Ints) -> None:
    """Move the mass of nodes to their neighbours, in place.

    ``mass`` (2, n) is diagonal. KhenousLabordeRenard2008; HagerHueeberWohlmuth2008. Deviation: the sources also keep
    the centre of mass and the moment of inertia; here only the sum is kept.
    """
    last = mass.shape[1] - 1
    for node in at:
        neighbours = [other for other in (node - 1, node + 1) if 0 <= other <= last]
        mass[0, neighbours] += mass[0, node] / len(neighbours)
        mass[0, node] = 0.0
