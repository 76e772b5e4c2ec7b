"""Nodes coupled by springs, compiled separately: assembly and solution of their linear differential equations."""

from __future__ import annotations

import numpy as np
from numba import types

from impactlab.exact.arrays import MarchArrays
from impactlab.exact.kernel import ORDER
from impactlab.exact.linear import solved, table
from impactlab.numerics.addresses import address_for
from impactlab.numerics.compiling import ALLOCATING_PART, EXACT_INLINE
from impactlab.numerics.linear import solve_bordered
from impactlab.types import Array


@ALLOCATING_PART
def number_groups(m: MarchArrays, j: int) -> tuple[int, int]:
    """Number the groups that can move, those with mass first; return how many have mass and how many move."""
    junction = m.junctions[j]
    moving = 0
    heavy = 0
    for g in range(junction.first_node, junction.last_node):
        m.nodes[g].place = -1
    for light in range(2):
        for g in range(junction.first_node, junction.last_node):
            node = m.nodes[g]
            if node.group == g and node.group_mass < np.inf and (node.group_mass == 0.0) == (light == 1):
                node.place = moving
                moving += 1
        if light == 0:
            heavy = moving
    return heavy, moving


@ALLOCATING_PART
def gather(m: MarchArrays, j: int, damp: Array, stiff: Array, b: Array, first: Array) -> None:
    """Write damping, stiffness and loads of groups, and to first[0] velocities of those with mass."""
    junction = m.junctions[j]
    base = junction.first_node
    for i in range(base, junction.last_node):
        node = m.nodes[i]
        if node.place >= 0:
            damp[node.place, node.place] = node.drag
            for k in range(ORDER):
                b[node.place, k] = m.load[i - base, k]
    for i in range(base, junction.last_node):
        node = m.nodes[i]
        at = m.nodes[node.group].place
        if at >= 0:
            stiff[at, at] += node.spring
            if node.mass > 0.0:
                first[0, at] = node.v
    for c in range(junction.first_contact, junction.last_contact):
        contact = m.contacts[c]
        if contact.closed == 1 and contact.stiffness >= 0.0:
            left, right = m.nodes[contact.left], m.nodes[contact.right]
            force = contact.stiffness * (contact.gap + right.u - left.u) - contact.constant
            for side in range(2):
                here, there = m.nodes[left.group].place, m.nodes[right.group].place
                if side == 1:
                    here, there = there, here
                if here >= 0:
                    stiff[here, here] += contact.stiffness
                    damp[here, here] += contact.damping
                    b[here, 0] += force if side == 0 else -force
                    if there >= 0:
                        stiff[here, there] -= contact.stiffness
                        damp[here, there] -= contact.damping


@EXACT_INLINE
def combined(damp: Array, stiff: Array, heavy: int, moving: int, half: float) -> Array:
    """Return the velocities of groups as combinations of unknowns and loads.

    The loads are those of groups without mass.
    """
    light, n = moving - heavy, moving + heavy
    combine: Array = table(moving, n + light)
    for i in range(heavy):
        combine[i, i] = 1.0
    small = table(light, light + n + light)
    for i in range(light):
        for k in range(light):
            small[i, k] = damp[heavy + i, heavy + k]
        for k in range(heavy):
            small[i, light + k] = -damp[heavy + i, k]
        for k in range(moving):
            small[i, light + heavy + k] = -half * stiff[heavy + i, k]
        small[i, light + n + i] = 1.0
    solve_bordered(small, light, light + n + light, light, light)
    for i in range(light):
        for k in range(n + light):
            combine[heavy + i, k] = small[i, light + k]
    return combine


@ALLOCATING_PART
def add_row(a: Array, force: Array, at: int, factor: float, row: Array, n: int, heavy: int, b: Array) -> None:
    """Add a combination of unknowns and loads to row ``at`` of a and force."""
    for q in range(n):
        a[at, q] += factor * row[q]
    for q in range(n, len(row)):
        for k in range(ORDER):
            force[at, k] += factor * row[q] * b[heavy + q - n, k]


@ALLOCATING_PART
def write_equations(
    m: MarchArrays, j: int, half: float, damp: Array, stiff: Array, combine: Array, b: Array, a: Array, force: Array
) -> None:
    """Write the matrix and the load of the unknowns.

    Balances of groups with mass come first, then rates of displacements.
    """
    junction = m.junctions[j]
    moving, n = len(combine), len(a)
    heavy = n - moving
    for g in range(junction.first_node, junction.last_node):
        i = m.nodes[g].place
        if 0 <= i < heavy:
            scale = half / m.nodes[g].group_mass
            for k in range(moving):
                add_row(a, force, i, -scale * damp[i, k], combine[k], n, heavy, b)
                a[i, heavy + k] -= scale * half * stiff[i, k]
            for k in range(ORDER):
                force[i, k] += scale * b[i, k]
    for i in range(moving):
        add_row(a, force, heavy + i, 1.0, combine[i], n, heavy, b)


@ALLOCATING_PART
def write_motion(m: MarchArrays, j: int, half: float, combine: Array, y: Array, b: Array, rows: Array) -> None:
    """Write velocities and displacements of the groups into the rows of their nodes."""
    junction = m.junctions[j]
    nodes = junction.last_node - junction.first_node
    moving, n = len(combine), len(y)
    heavy = n - moving
    for g in range(junction.first_node, junction.last_node):
        i = m.nodes[g].place
        if i >= 0:
            for k in range(ORDER):
                total = 0.0
                for q in range(n):
                    total += combine[i, q] * y[q, k]
                for q in range(n, n + moving - heavy):
                    total += combine[i, q] * b[heavy + q - n, k]
                rows[g - junction.first_node, k] = total
                rows[nodes + g - junction.first_node, k] = half * y[heavy + i, k]


def coupled(m: MarchArrays, j: int, half: float) -> None:
    """Solve for the motion of groups of nodes tied by springs.

    Velocities and displacements obey m V' + D V + K U = load, U' = V. Unknowns are the velocities of the groups with
    mass and U/half of all that can move; velocities of groups without mass follow from them. U is returned as solved:
    integrating the velocity of a group on a stiff spring would multiply rounding by that stiffness. ``state.resolved``
    is 1 if the series converged.
    """
    state = m.state[0]
    heavy, moving = number_groups(m, j)
    n = moving + heavy
    damp, stiff, b = table(moving, moving), table(moving, moving), table(moving, ORDER)
    a, force, first, y = table(n, n), table(n, ORDER), table(1, n), table(n, ORDER)
    gather(m, j, damp, stiff, b, first)
    combine = combined(damp, stiff, heavy, moving, half)
    write_equations(m, j, half, damp, stiff, combine, b, a, force)
    state.resolved = 0
    spent = table(1, 1)
    resolved = solved(a, force, first, y, state.fastest, spent)
    state.work += spent[0, 0]
    if not resolved:
        return
    state.resolved = 1
    write_motion(m, j, half, combine, y, b, m.rows)


def address(m: MarchArrays) -> int:
    """Return the address of `coupled`, compiled when a scene first needs it."""
    return address_for(coupled, (m,), (types.int64, types.float64))
