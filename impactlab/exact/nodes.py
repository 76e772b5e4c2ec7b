"""Motion of the nodes of a junction over one interval, compiled.

It solves groups held by contacts, velocities, and all rows of a record.
"""

from __future__ import annotations

import numpy as np

from impactlab.exact.arrays import MarchArrays
from impactlab.exact.kernel import (
    CHOP_TOL,
    HALF_ORDER,
    LOW_ORDER,
    MAX_LOAD_HALF,
    MAX_LOAD_LOW,
    MAX_RATE_HALF,
    MAX_RATE_LOW,
    ORDER,
    ROOM,
    TAIL_TOL,
    chopped,
    integrate,
    relax,
    without_layer,
)
from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import EXACT_PART
from impactlab.types import Array

MIN_RELAXATIONS = 100.0  # relaxation times in half an interval, from which a layer at its start is short
LAYER_TOL = 2.0e-14  # of the largest velocity: a smaller layer is rounding


@EXACT_PART
def group_nodes(m: MarchArrays, j: int, longest: int) -> bool:
    """Join the nodes that hard contacts hold together.

    Their masses and loads are added up. Return whether springs act.
    """
    state, junction = m.state[0], m.junctions[j]
    base = junction.first_node
    tied = False
    for i in range(base, junction.last_node):
        node = m.nodes[i]
        node.group, node.group_mass, node.drag = i, 0.0, 0.0
        load = m.load[i - base]
        for k in range(ROOM):
            load[k] = 0.0
    for c in range(junction.first_contact, junction.last_contact):
        contact = m.contacts[c]
        if contact.closed == 1:
            if contact.stiffness >= 0.0:
                tied = True
            else:
                old, new = m.nodes[contact.right].group, m.nodes[contact.left].group
                for i in range(base, junction.last_node):
                    if m.nodes[i].group == old:
                        m.nodes[i].group = new
    for i in range(base, junction.last_node):
        node = m.nodes[i]
        group = m.nodes[node.group]
        group.group_mass += node.mass
        group.drag += node.dashpot
        m.load[node.group - base, 0] += node.end_force - node.spring * node.u
        m.load[node.group - base, 1] += node.end_force_rise
        if node.mass < np.inf:
            m.load[node.group - base, 0] += node.mass * state.gravity
            tied = tied or node.spring > 0.0
    for e in range(junction.first_end, junction.last_end):
        end = m.ends[e]
        g = m.nodes[end.node].group
        m.nodes[g].drag += end.impedance
        load, wave = m.load[g - base], m.waves[e - junction.first_end]
        for k in range(longest):
            load[k] += 2.0 * end.impedance * wave[k]
    return tied


@EXACT_PART
def tail(a: Array, n: int) -> float:
    """Return the size of the last three of n coefficients."""
    return float(abs(a[n - 1]) + abs(a[n - 2]) + abs(a[n - 3]))


@EXACT_PART
def solve_group(m: MarchArrays, j: int, i: int, half: float, longest: int) -> int:
    """Write the velocity of node i's massive group; return its coefficients, 0 if unresolved."""
    state, node = m.state[0], m.nodes[i]
    group, base = m.nodes[node.group], m.junctions[j].first_node
    load, out = m.load[node.group - base], m.rows[node.group - base]
    for k in range(longest):
        load[k] *= half / group.group_mass
    rate = half * group.drag / group.group_mass
    if rate == 0.0 and longest < ORDER:  # a free mass: the integral of the load, a polynomial
        relax(0.0, load, node.v, longest + 1, out, m.stack)
        state.work += 16 * longest
        return longest + 1
    if rate >= MIN_RELAXATIONS and rate * MIN_RELAXATIONS >= longest * longest:
        state.work += 4 * longest
        if without_layer(rate, load, node.v, longest, LAYER_TOL * state.fastest, out):
            return longest
    order = ORDER
    if longest <= MAX_LOAD_LOW and rate <= MAX_RATE_LOW:
        order = LOW_ORDER
    elif longest <= MAX_LOAD_HALF and rate <= MAX_RATE_HALF:
        order = HALF_ORDER
    relax(rate, load, node.v, order, out, m.stack)
    state.work += 16 * order
    if order < ORDER and tail(out, order) > CHOP_TOL * state.fastest:
        order = ORDER
        state.work += 16 * order
        relax(rate, load, node.v, order, out, m.stack)
    return 0 if tail(out, order) > TAIL_TOL * state.fastest else order


@EXACT_PART
def solve_nodes(m: MarchArrays, j: int, half: float, longest: int) -> int:
    """Write the velocities of junction j's nodes; return their number of coefficients, 0 if unresolved."""
    state, junction = m.state[0], m.junctions[j]
    base = junction.first_node
    tied = group_nodes(m, j, longest)
    used = longest
    for i in range(base, junction.last_node):
        node = m.nodes[i]
        mass = m.nodes[node.group].group_mass
        node.bare = 1 if mass == 0.0 or mass == np.inf else 0
        node.place = -1
        velocity, displacement = m.rows[i - base], m.rows[i - base + junction.nodes]
        for k in range(ROOM):
            velocity[k] = displacement[k] = 0.0
    if tied:
        call(m.coupled, m, j, half)
        if state.resolved == 0:
            return 0
        used = ORDER
    else:
        for i in range(base, junction.last_node):
            node = m.nodes[i]
            group = m.nodes[node.group]
            if group.group_mass == 0.0 and i == node.group:
                velocity, load = m.rows[i - base], m.load[i - base]
                for k in range(longest):
                    velocity[k] = load[k] / group.drag
            elif group.group_mass < np.inf and node.mass > 0.0:
                order = solve_group(m, j, i, half, longest)
                if order == 0:
                    return 0
                used = max(used, order)
    n = 1
    for i in range(base, junction.last_node):
        out, source = m.rows[i - base], m.rows[m.nodes[i].group - base]
        for k in range(used):
            out[k] = source[k]
        n = max(n, chopped(out, used, CHOP_TOL * state.fastest))
    return n


@EXACT_PART
def balance(m: MarchArrays, j: int, c: int, n: int, force: Array) -> None:
    """Write the force of a hard contact, by balance of its face.

    On the massless face act rods, spring, dashpot and other contacts.
    """
    junction = m.junctions[j]
    base, first_end = junction.first_node, junction.first_end
    nodes, ends = junction.nodes, junction.ends
    contact = m.contacts[c]
    side = 1.0 if contact.face == contact.right else -1.0
    face, at = m.nodes[contact.face], contact.face - base
    displacement, velocity = m.rows[nodes + at], m.rows[at]
    for k in range(n + 1):
        force[k] = side * (face.spring * displacement[k] + face.dashpot * velocity[k])
    force[0] -= side * face.end_force
    force[1] -= side * face.end_force_rise
    for e in range(ends):
        end = m.ends[first_end + e]
        if end.node == contact.face:
            z = side * end.impedance
            away, wave = m.rows[2 * nodes + e], m.waves[e]
            for k in range(n):
                force[k] += z * (away[k] - wave[k])
    for other in range(junction.first_contact, c):  # the forces of the others of this face were found before
        there = m.contacts[other]
        if there.left == contact.face or there.right == contact.face:
            sign = side if there.left == contact.face else -side
            row = m.rows[2 * (nodes + ends) + other - junction.first_contact]
            for k in range(n + 1):
                force[k] += sign * row[k]


@EXACT_PART
def fill_rows(m: MarchArrays, j: int, half: float, longest: int, n: int) -> int:
    """Write the rows of a record beside its nodes' velocities; return the number of coefficients."""
    junction = m.junctions[j]
    base, first_end = junction.first_node, junction.first_end
    nodes, ends = junction.nodes, junction.ends
    n = max(n, longest)
    for i in range(nodes):
        node = m.nodes[base + i]
        m.rows[i, n] = 0.0
        if m.nodes[node.group].place < 0:
            integrate(m.rows[i], n, half, node.u, m.rows[nodes + i])
        elif node.group != base + i:
            own, shared = m.rows[nodes + i], m.rows[nodes + node.group - base]
            for k in range(n + 1):
                own[k] = shared[k]
    for i in range(nodes):
        node = m.nodes[base + i]
        if m.nodes[node.group].place >= 0:  # groups tied by springs: solved with the velocities
            m.rows[nodes + i, 0] += node.u
    for e in range(ends):
        end = m.ends[first_end + e]
        row, v, wave = m.rows[2 * nodes + e], m.rows[end.node - base], m.waves[e]
        for k in range(n):
            row[k] = v[k] - wave[k]
        row[n] = 0.0
        integrate(row, n, half, end.carried, m.rows[2 * nodes + ends + e])
    for c in range(junction.first_contact, junction.last_contact):
        contact = m.contacts[c]
        force = m.rows[2 * (nodes + ends) + c - junction.first_contact]
        for k in range(n + 1):
            force[k] = 0.0
        if contact.closed == 1:
            a, b = contact.left - base, contact.right - base
            if contact.stiffness >= 0.0:
                u, w, v, speed = m.rows[nodes + a], m.rows[nodes + b], m.rows[a], m.rows[b]
                for k in range(n + 1):
                    force[k] = contact.stiffness * (u[k] - w[k])
                    force[k] += contact.damping * (v[k] - speed[k])
                force[0] += contact.constant - contact.stiffness * contact.gap
            else:
                balance(m, j, c, n, force)
    return n + 1
