"""Elements of a beam mesh that give an internal force at a place: their means, or a line through their middles."""

from __future__ import annotations

from impactlab.models.mesh.base import AbstractMesh
from impactlab.types import Array, Quantity

Side = tuple[int, float, float]  # number of an element, place in it (0 to 1), share


def sides_of(mesh: AbstractMesh, nodes: Array, at: tuple[int, float, float], quantity: Quantity) -> list[Side]:
    """Return the elements, places in them and shares that give a quantity; ``at`` is element, place in it, and x [m].

    A bending moment at a node inside a segment is the mean of both sides. The shear force of an element is constant,
    that of its middle up to the second order of its length. So elsewhere it lies on the line through the middles of
    two neighbours without a joint or a contact between them: at an end, a joint or a contact it is extrapolated.
    """
    element, place, x = at
    if quantity == "bending_moment" and mesh.is_shared(element, x, float(nodes[element])):
        return [(element, place, 0.5), (element - 1, 1.0, 0.5)]
    if quantity == "shear_force":
        nearer = element + 1 if place > 0.5 else element - 1
        for other in (nearer, 2 * element - nearer):
            if _goes_on(mesh, nodes, max(element, other)):
                middle, beside = (float(nodes[each] + 0.5 * mesh.lengths[each]) for each in (element, other))
                share = (x - middle) / (beside - middle)
                return [(element, place, 1.0 - share), (other, 0.5, share)]
    return [(element, place, 1.0)]


def _goes_on(mesh: AbstractMesh, nodes: Array, element: int) -> bool:
    """Return whether the shear force goes on without a jump from the element before this one."""
    if not 0 < element < len(mesh.lengths):
        return False
    x = float(nodes[element])
    return mesh.is_shared(element, x, x)
