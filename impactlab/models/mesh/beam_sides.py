"""Internal forces of a beam mesh at a place, from the elements beside it.

They lack a part under a force inside an element, which is given here as well.
"""

from __future__ import annotations

from impactlab.models.mesh.base import NODE_TOL, AbstractMesh
from impactlab.models.mesh.beam_elements import deflections, shear_ratio
from impactlab.types import Array, Quantity

Side = tuple[int, float, float]  # number of an element, place in it (0 to 1), share


def sides_of(mesh: AbstractMesh, nodes: Array, at: tuple[int, float, float], quantity: Quantity) -> list[Side]:
    """Return the elements, places in them and shares that give a quantity.

    ``at`` is element, place in it, and x [m]. A bending moment at a node inside a segment is the mean of both sides.
    The shear force of an element is constant, that of its middle up to the second order of its length. So elsewhere it
    lies on the line through the middles of two neighbours without a joint or a contact between them: at an end, a joint
    or a contact it is extrapolated.
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


def missing_inside(mesh: AbstractMesh, sides: list[Side], at: tuple[int, float], quantity: Quantity) -> float:
    """Return the static internal force that ``sides`` lack, per force inside an element.

    ``at`` is the struck element and the place in it. Its nodes move as they should, and it lacks the forces that it
    would have between held nodes. The first of ``sides`` is the element that holds the place that is read.
    """
    struck, face = at
    h = float(mesh.lengths[struck])
    shapes = deflections(face, h, shear_ratio(mesh.body.segments[mesh.of_segment[struck]], h))
    reaction, couple = float(shapes[0]), float(shapes[1])  # of the left node
    element, place, _ = sides[0]
    if quantity == "bending_moment":
        inside = [(s, share) for each, s, share in sides if each == struck]
        return sum(share * (couple - reaction * s * h + max(0.0, s - face) * h) for s, share in inside)
    before = element < struck or (element == struck and place < face - NODE_TOL)
    read = sum(share * (reaction - (each > struck)) for each, _, share in sides if each != struck)
    return reaction - (not before) - read


def _goes_on(mesh: AbstractMesh, nodes: Array, element: int) -> bool:
    """Return whether the shear force is continuous from the element before this one."""
    if not 0 < element < len(mesh.lengths):
        return False
    x = float(nodes[element])
    return mesh.is_shared(element, x, x)
