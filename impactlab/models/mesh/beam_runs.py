"""The stiffness of a beam mesh as runs of equal elements, for the leapfrog of beams."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.scene.bodies import Beam
from impactlab.types import Array


class BeamElements(NamedTuple):
    """A stiffness in runs of equal beam elements.

    Each element stores a s^2/2 + b d^2/2. Here s = w2 - w1 - l (theta1 + theta2) shears the element and d = theta2 -
    theta1 bends it: a = 12 EI/h^3/(1 + Phi), l = h/2, b = EI/h. Other stiffness stands at single nodes: supports, and
    under tension springs at the rotations.

    Of a beam that turns no two elements are equal and the lever arms of their nodes differ: s = w2 - w1 - l1 theta1 -
    l2 theta2. Beside the elements it has -softening times the mass.
    """

    lead: int  # coordinates before the first whole node: 1 where the rotation of a pinned end stands alone
    nodes: int  # whole ones
    ends: Array  # (12,) stiffness of the first, then of the last whole node beyond the runs: w w, w theta, theta theta;
    #              then of a lone rotation beyond each: its own, its coupling to w and to theta of the whole node
    rest: Array  # (nodes,) springs at the rotations of the nodes between
    runs: Array  # (n_runs, 4) number of elements, a, l, b; none of a beam that turns
    each: Array  # (n_elements, 4) a, l1, l2, b of the elements of a beam that turns, else none
    softening: float  # 1/s2, of a beam that turns in the plane of its motion


def element_runs(beam: Beam, k: Array, turned: Array | None) -> BeamElements | None:
    """Return the stiffness of a beam between whole nodes.

    It is None with fewer than two of these.

    Parameters
    ----------
    beam : Beam
    k : (n_elements, 4, 4)
        Stiffness of each element, in the coordinates of `beam_elements`.
    turned : (n,), optional
        Stiffness of each coordinate under rotation, beside -softening times its mass; None of a beam at rest.
    """
    supports = beam.left, beam.right
    held = [end.kind in ("clamped", "pinned") for end in supports]
    first, last = int(held[0]), len(k) - int(held[1])
    nodes = last - first + 1
    if nodes < 2:
        return None
    a, near, far = -k[:, 2, 0], k[:, 2, 1] / k[:, 2, 0], k[:, 2, 3] / k[:, 2, 0]
    far = near if turned is None else far
    b = a * (near * far) - k[:, 3, 1]
    rest, ends, lead = np.zeros(nodes), np.zeros((4, 3)), int(beam.left.kind == "pinned")
    if beam.tension or turned is not None:  # springs at rotations
        rest[:-1] += (k[:, 1, 1] - a * near**2 - b)[first:last]
        rest[1:] += ((k[:, 1, 1] if turned is None else k[:, 3, 3]) - a * far**2 - b)[first:last]
    if turned is not None:
        rest += turned[lead + 1 : lead + 2 * nodes : 2]
        ends[2:, 0] = turned[[0, -1]]  # of lone rotations; those of whole nodes are set below
    ends[:2, 2] = rest[[0, -1]]
    rest[[0, -1]] = 0.0
    for side, end in enumerate(supports):
        beyond = k[-1 if side else 0]
        inner, outer = (slice(0, 2), slice(2, 4)) if side else (slice(2, 4), slice(0, 2))
        if end.kind == "spring":
            ends[side] += end.value, 0.0, end.rotational
        elif end.kind in ("clamped", "pinned"):
            block = beyond[inner, inner]
            ends[side] += block[0, 0], block[0, 1], block[1, 1]
        if end.kind == "pinned":
            ends[2 + side] = ends[2 + side, 0] + beyond[outer, outer][1, 1], *beyond[outer, inner][1]
        else:
            ends[2 + side] = 0.0
    if turned is not None:
        each = np.column_stack((a, near, far, b))[first:last]
        return BeamElements(lead, nodes, ends.ravel(), rest, np.zeros((0, 4)), each, beam.softening)
    runs = np.column_stack((a, near, b))[first:last]
    heads = np.concatenate(([0], np.flatnonzero(np.any(np.diff(runs, axis=0) != 0.0, axis=1)) + 1))
    counts = np.diff(np.append(heads, len(runs)))
    table = np.column_stack((counts, runs[heads]))
    return BeamElements(lead, nodes, ends.ravel(), rest, table, np.zeros((0, 4)), 0.0)
