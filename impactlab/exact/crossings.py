"""Event detection of a junction, compiled: first downward zero crossings of forces or gaps in an interval."""

from __future__ import annotations

from impactlab.exact.arrays import CLOSE, OPEN, MarchArrays
from impactlab.exact.kernel import MAX_DEPTH, ZERO_TOL, first_crossing, restrict
from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import EXACT_INLINE, EXACT_PART
from impactlab.types import Array

ROUNDING = 1.0e-14  # of displacements and velocities: how far rounding may have moved them
# Least force of a touch, over the force below which a closed contact counts as unloaded (ZERO_TOL of the largest that
# the rods could give): 1e-11 of it in all. Above 1, so that rounding cannot close at once a contact that it opened.
MIN_TOUCH = 10.0


@EXACT_PART
def least_force(m: MarchArrays, j: int, c: int, n: int) -> float:
    """Return the force [N], above a stiff spring's rounding, below which contact c is unloaded."""
    state, junction, contact = m.state[0], m.junctions[j], m.contacts[c]
    none = ZERO_TOL * state.fastest * contact.impedance
    if contact.stiffness >= 0.0:
        base, nodes = junction.first_node, junction.nodes
        reach = abs(contact.gap)
        for k in range(n):
            reach += abs(m.rows[nodes + contact.left - base, k]) + abs(m.rows[nodes + contact.right - base, k])
        none += ROUNDING * (contact.stiffness * reach + contact.damping * state.fastest)
    return float(none)


@EXACT_PART
def increase_if_rigid(m: MarchArrays, c: int) -> float:
    """Return the relative increase of the force of contact c if both faces were rigid."""
    contact = m.contacts[c]
    more = 0.0
    for side in (contact.left, contact.right):
        group = m.nodes[m.nodes[side].group]
        if group.group_mass == 0.0:
            more += contact.damping / group.drag
    return float(more)


@EXACT_PART
def stays_unloaded(m: MarchArrays, j: int, c: int, n: int, place: float) -> bool:
    """Return whether faces approach too slowly for a force after they meet.

    They meet at a place in [-1, 1]. The force of a touch is the speed of approach times the impedance of the faces; a
    face with mass is rigid.
    """
    state, junction, contact = m.state[0], m.junctions[j], m.contacts[c]
    base = junction.first_node
    compliance = 0.0
    for side in (contact.left, contact.right):
        group = m.nodes[m.nodes[side].group]
        if group.group_mass == 0.0:
            compliance += 1.0 / group.drag
    slow = MIN_TOUCH * ZERO_TOL * state.fastest * contact.impedance * compliance
    a, b = contact.left - base, contact.right - base
    trial, rate, v, w = m.stack[MAX_DEPTH], m.stack[0], m.rows[a], m.rows[b]
    for k in range(n):
        trial[k] = v[k] - w[k]
    size = restrict(trial, n, place, 1.0, rate)
    approach = rate[0]
    for k in range(1, size):
        approach += abs(rate[k])
    return bool(approach <= slow)


@EXACT_PART
def first_crossing_of(m: MarchArrays, base: int, c: int, n: int, floor: float) -> float:
    """Return the first downward zero of a contact's trial row.

    It is in [-1, 1], or 2 for never. Hard faces with a gap within rounding may part at the start and meet later. Closed
    at the start, they would pull at once, and open and close infinitely often.
    """
    contact, trial = m.contacts[c], m.stack[MAX_DEPTH]
    place = first_crossing(trial, n, floor, m.stack)
    if place > -1.0 or contact.closed == 1 or contact.stiffness >= 0.0:
        return float(place)
    left, right = m.rows[contact.left - base], m.rows[contact.right - base]
    speed = 0.0
    for k in range(n):
        speed += right[k] - left[k] if k % 2 == 0 else left[k] - right[k]
    return float(first_crossing(trial, n, 0.0, m.stack) if speed > ZERO_TOL * m.state[0].fastest else place)


@EXACT_PART
def meets_again(m: MarchArrays, c: int, n: int, place: float, half: float, no_force: float) -> float:
    """Return where hard faces that part at a place are pressed again, or 2 if they part by more than rounding.

    The force that the closed contact would pull with, times the compliance of both faces, is the speed of parting. A
    gap below the rounding of displacements has no length that could be dated: opened, the faces would meet at the
    instant at which they part, and open and close infinitely often. ``half`` is half the length of the interval [s].
    """
    contact, trial, part = m.contacts[c], m.stack[MAX_DEPTH], m.stack[MAX_DEPTH - 1]
    compliance = 0.0
    for side in (contact.left, contact.right):
        group = m.nodes[m.nodes[side].group]
        if group.group_mass > 0.0 or group.drag <= 0.0:
            return 2.0
        compliance += 1.0 / group.drag
    size = restrict(trial, n, place, 1.0, part)
    for k in range(size):
        part[k] = -part[k]
    pressed = first_crossing(part, size, no_force, m.stack)
    if not -1.0 < pressed < 1.0:
        return 2.0
    pressed = place + 0.5 * (1.0 - place) * (pressed + 1.0)
    size = restrict(trial, n, place, pressed, part)
    pull = 0.0
    for k in range(size):
        pull += abs(part[k])
    gap = compliance * pull * half * (pressed - place)
    return float(pressed if gap <= ZERO_TOL * m.state[0].farthest else 2.0)


@EXACT_PART
def parting(m: MarchArrays, c: int, n: int, place: float, half: float, no_force: float) -> float:
    """Return where hard faces part by more than rounding, from a place on at which their force ends; 2 for never."""
    trial, part = m.stack[MAX_DEPTH], m.stack[MAX_DEPTH - 1]
    while place <= 1.0:
        pressed = meets_again(m, c, n, place, half, no_force)
        if pressed > 1.0:
            return float(place)
        size = restrict(trial, n, pressed, 1.0, part)
        after = first_crossing(part, size, no_force, m.stack)
        place = pressed + 0.5 * (1.0 - pressed) * (after + 1.0) if after <= 1.0 else 2.0
    return float(place)


@EXACT_INLINE
def is_unloaded(m: MarchArrays, c: int, force: Array, n: int, no_force: float) -> bool:
    """Return whether hard faces without mass touch without a force, and so count as open."""
    contact = m.contacts[c]
    if contact.closed == 0 or contact.stiffness >= 0.0 or m.nodes[contact.left].bare == 0:
        return False
    total = 0.0
    for k in range(n):
        total += abs(force[k])
    return bool(total <= no_force)


@EXACT_INLINE
def next_change_of_contact(m: MarchArrays, j: int, n: int, half: float) -> float:
    """Return the place in [-1, 1] of the first change of a contact, in an interval of 2 ``half`` [s].

    It is a closing, an opening, or the end of a spring's overlap; 2 for none.
    """
    state, junction = m.state[0], m.junctions[j]
    base = junction.first_node
    nodes = junction.nodes
    first_force = 2 * (nodes + junction.ends)
    place = 2.0
    no_gap = ZERO_TOL * state.farthest
    trial = m.stack[MAX_DEPTH]
    for c in range(junction.first_contact, junction.last_contact):
        contact = m.contacts[c]
        if contact.branch >= 0:
            continue
        a, b = contact.left - base, contact.right - base
        u, w = m.rows[nodes + a], m.rows[nodes + b]
        no_force = least_force(m, j, c, n)
        force = m.rows[first_force + c - junction.first_contact]
        if is_unloaded(m, c, force, n, no_force):
            state.contact, state.kind = c, OPEN
            return -1.0
        gap = contact.gap + m.nodes[contact.right].u - m.nodes[contact.left].u
        # Crossing of the force; or of the gap; or, for an unloaded spring that is still overlapped, of both the spring
        # force (it takes load again) and the gap (it opens).
        behind = contact.closed == 0 and gap < -no_gap and contact.stiffness >= 0.0
        for way in range(2 if behind else 1):
            floor = no_gap
            if contact.closed == 1:
                floor = no_force
                for k in range(n):
                    trial[k] = force[k]
            else:
                sign = -1.0 if behind else 1.0
                for k in range(n):
                    trial[k] = sign * (w[k] - u[k])
                trial[0] += sign * contact.gap
                if contact.stiffness < 0.0 and gap < 0.0:
                    floor -= gap  # faces in contact may overlap by rounding
            if way == 1:
                floor = no_force * (1.0 + increase_if_rigid(m, c))
                for k in range(n):
                    pull = contact.damping * (m.rows[b, k] - m.rows[a, k])
                    trial[k] = pull - contact.stiffness * trial[k]
            x = first_crossing_of(m, base, c, n, floor)
            if x <= 1.0 and contact.closed == 1 and contact.stiffness < 0.0:
                x = parting(m, c, n, x, half, floor)
            if x <= 1.0 and contact.closed == 0 and contact.stiffness < 0.0 and stays_unloaded(m, j, c, n, x):
                continue
            if x < place:
                place = x
                state.contact = -1 if behind and way == 0 else c
                state.kind = CLOSE if contact.closed == 0 and not (behind and way == 0) else OPEN
    return place


@EXACT_PART
def next_event(m: MarchArrays, j: int, n: int, half: float) -> float:
    """Return the place in [-1, 1] of the first event, 2 for none; keep contact and kind.

    The interval has a length of 2 ``half`` [s].
    """
    place = next_change_of_contact(m, j, n, half)
    if m.junctions[j].branched == 1:
        m.state[0].place = place
        call(m.changes, m, j, n)
        place = m.state[0].place
    return float(place)
