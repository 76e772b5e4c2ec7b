"""Tangents of groups of nodes that springs tie, compiled.

Their loads are written, and solved as those of the motion itself.
"""

from __future__ import annotations

import numpy as np
from numba import types

from impactlab.exact.arrays import MarchArrays
from impactlab.exact.kernel import ORDER
from impactlab.exact.linear import solved, table
from impactlab.exact.spring_systems import combined, gather, number_groups, write_equations, write_motion
from impactlab.exact.tangents.arrays import DAMPING, GAP, MASS, SPRING, STIFFNESS, TangentArrays
from impactlab.numerics.addresses import COMPILED, address_for
from impactlab.numerics.compiling import ALLOCATING_PART, EXACT_PART
from impactlab.types import Array


@EXACT_PART
def group_rate(m: MarchArrays, d: TangentArrays, q: int, j: int, g: int) -> float:
    """Return the derivative of the mass of a group [kg per unit of the parameter]."""
    total = 0.0
    for i in range(m.junctions[j].first_node, m.junctions[j].last_node):
        if m.nodes[i].group == g and m.nodes[i].mass < np.inf:
            total += d.of_nodes[q, i, MASS]
    return total


@ALLOCATING_PART
def add_change_of_stiffness(m: MarchArrays, d: TangentArrays, q: int, j: int, b: Array) -> None:
    """Add the effect of stiffer springs and dashpots, at ends and closed contacts, on groups' loads."""
    junction = m.junctions[j]
    base, nodes = junction.first_node, junction.nodes
    for i in range(base, junction.last_node):
        at = m.nodes[m.nodes[i].group].place
        if at >= 0 and d.of_nodes[q, i, SPRING] != 0.0:
            row = m.rows[nodes + m.nodes[i].group - base]
            for k in range(ORDER):
                b[at, k] -= d.of_nodes[q, i, SPRING] * (row[k] - (m.nodes[m.nodes[i].group].u if k == 0 else 0.0))
    for c in range(junction.first_contact, junction.last_contact):
        contact = m.contacts[c]
        if contact.closed == 1 and contact.stiffness >= 0.0:
            left, right = m.nodes[contact.left], m.nodes[contact.right]
            here, there = m.nodes[left.group].place, m.nodes[right.group].place
            stiffer, heavier = d.of_contacts[q, c, STIFFNESS], d.of_contacts[q, c, DAMPING]
            opening = d.of_contacts[q, c, GAP] + d.u[q, contact.right] - d.u[q, contact.left]
            for k in range(ORDER):
                added = stiffer * (m.rows[nodes + contact.right - base, k] - m.rows[nodes + contact.left - base, k])
                added += heavier * (m.rows[contact.right - base, k] - m.rows[contact.left - base, k])
                if k == 0:
                    added += stiffer * contact.gap + contact.stiffness * opening
                if here >= 0:
                    b[here, k] += added
                if there >= 0:
                    b[there, k] -= added


@ALLOCATING_PART
def add_change_of_mass(
    m: MarchArrays, d: TangentArrays, q: int, j: int, damp: Array, stiff: Array, plain: Array, b: Array
) -> None:
    """Add the effect of heavier masses on their groups' loads: -(m'/m) times their inertia."""
    junction = m.junctions[j]
    base, nodes = junction.first_node, junction.nodes
    for g in range(base, junction.last_node):
        i = m.nodes[g].place
        growth = group_rate(m, d, q, j, g) / m.nodes[g].group_mass if i >= 0 and m.nodes[g].group_mass > 0.0 else 0.0
        if growth != 0.0:
            for other in range(base, junction.last_node):
                at = m.nodes[other].place
                if at >= 0:
                    u, v = m.rows[nodes + other - base], m.rows[other - base]
                    for k in range(ORDER):
                        moved = u[k] - (m.nodes[other].u if k == 0 else 0.0)
                        b[i, k] += growth * (damp[i, at] * v[k] + stiff[i, at] * moved)
            for k in range(ORDER):
                b[i, k] -= growth * plain[i, k]


def on_springs(m: MarchArrays, d: TangentArrays, q: int, j: int, half: float) -> None:
    """Write tangents of velocities and displacements of groups that springs tie, as `spring_systems.coupled` does.

    m V'/half + D V + K U = load, with U from the start on: the tangents have the load
    load' - D' V - K' U - (m'/m) (load - D V - K U).
    """
    junction = m.junctions[j]
    base = junction.first_node
    heavy, moving = number_groups(m, j)
    count = moving + heavy
    damp, stiff, plain = table(moving, moving), table(moving, moving), table(moving, ORDER)
    b = table(moving, ORDER)
    a, force, first, y = table(count, count), table(count, ORDER), table(1, count), table(count, ORDER)
    for i in range(base, junction.last_node):  # m.load holds the tangents of the loads, d.loads the loads
        at = m.nodes[i].place
        if at >= 0:
            for k in range(ORDER):
                b[at, k] = m.load[i - base, k]
                m.load[i - base, k] = d.loads[i - base, k]
    gather(m, j, damp, stiff, plain, first)
    for i in range(base, junction.last_node):
        at = m.nodes[m.nodes[i].group].place
        if at >= 0 and m.nodes[i].mass > 0.0:
            first[0, at] = d.v[q, i]
    add_change_of_stiffness(m, d, q, j, b)
    add_change_of_mass(m, d, q, j, damp, stiff, plain, b)
    combine = combined(damp, stiff, heavy, moving, half)
    write_equations(m, j, half, damp, stiff, combine, b, a, force)
    solved(a, force, first, y, max(largest(first, count), largest(force, ORDER)), table(1, 1))
    write_motion(m, j, half, combine, y, b, d.rows[q])


@ALLOCATING_PART
def largest(a: Array, n: int) -> float:
    """Return the largest size of the first n columns."""
    found = 0.0
    for i in range(len(a)):
        for k in range(n):
            found = max(found, abs(a[i, k]))
    return found


def with_springs(m: MarchArrays, d: TangentArrays) -> TangentArrays:
    """Return the tangents with the address of `on_springs`.

    It is set where nodes are tied, and compiled when first needed.
    """
    if m.coupled == 0 and COMPILED:
        return d
    return d._replace(springs=address_for(on_springs, (m, d), (types.int64, types.int64, types.float64)))
