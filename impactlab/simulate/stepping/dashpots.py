"""Losses in dashpots: damping inside bodies, and dashpots at their ends.

Dashpots side by side form a group, whose values lie side by side, too, so that they are booked in vector registers.
"""

from __future__ import annotations

from impactlab.numerics.compiling import INLINE, PART
from impactlab.numerics.subnormals import flush_subnormals, restore_subnormals
from impactlab.numerics.windows import window
from impactlab.simulate.stepping.arrays import CHANGE, DAMPING, LENGTH, PRODUCT, RATE, DamperRecord, StepArrays
from impactlab.types import Array


@PART
def write_lengths(lengths: Array, near: Array, far: Array) -> None:
    """Write the lengths of dashpots [m] from the displacements of their ends.

    ``far`` is empty where the other ends are the ground.
    """
    if far.size == 0:
        for i in range(lengths.size):
            lengths[i] = near[i]
        return
    for i in range(lengths.size):
        lengths[i] = near[i] - far[i]


@PART
def loss_times_step(
    damping: Array, lengths: Array, changes: Array, near: Array, far: Array, share_before: float
) -> float:
    """Return the loss in dashpots over a step, times its length [J s].

    The changes of their lengths are written. They act on the change of this step, or with ``share_before`` = 1/2 on the
    mean of it and of the one before.
    """
    total, share = 0.0, 1.0 - share_before
    if far.size == 0:
        for i in range(lengths.size):
            moved = near[i] - lengths[i]
            felt = share * moved + share_before * changes[i]
            total += damping[i] * felt * felt
            changes[i] = moved
        return total
    for i in range(lengths.size):
        moved = near[i] - far[i] - lengths[i]
        felt = share * moved + share_before * changes[i]
        total += damping[i] * felt * felt
        changes[i] = moved
    return total


@INLINE
def near_ends(m: StepArrays, group: DamperRecord) -> Array:
    """Return the displacements of the first ends of a group."""
    return window(m.state, group.index, group.count)


@INLINE
def far_ends(m: StepArrays, group: DamperRecord) -> Array:
    """Return the displacements of the other ends of a group [m].

    The array is empty where these are the ground.
    """
    return window(m.state, max(group.other, 0), group.count if group.other >= 0 else 0)


@INLINE
def rate_in(m: StepArrays, group: DamperRecord, number: int, derivative: int) -> float:
    """Return a time derivative of the length of a dashpot of a group.

    It is the velocity for ``derivative`` 1, the acceleration for 2.
    """
    shift = derivative * group.rates + number
    near = float(m.state[group.index + shift])
    return near - float(m.state[group.other + shift]) if group.other >= 0 else near


@PART
def write_rates(m: StepArrays, group: DamperRecord) -> None:
    """Write the rates of the lengths at the start of a step.

    Their products with the accelerations are written, too.
    """
    for i in range(group.count):
        rate = rate_in(m, group, i, 1)
        m.dashpots[RATE, group.first + i] = rate
        m.dashpots[PRODUCT, group.first + i] = rate * rate_in(m, group, i, 2)


@PART
def add_kicks(m: StepArrays, group: DamperRecord) -> None:
    """Add the effect of impulses at the step's start to the lengths' rates."""
    for number in range(len(m.faces)):
        face = m.faces[number]
        given = face.sign * m.contacts[number // 2].impulse
        body = m.bodies[face.body]
        if given == 0.0 or face.moves == 0 or not body.state_start <= group.index < body.state_end:
            continue
        start = body.jump_start + face.place * body.n_dof - body.state_start
        for i in range(group.count):
            jump = float(m.jump[start + group.index + i])
            if group.other >= 0:
                jump -= float(m.jump[start + group.other + i])
            m.dashpots[RATE, group.first + i] += given * jump


@PART
def loss_by_rates(m: StepArrays, group: DamperRecord, near: Array, far: Array) -> float:
    """Return the loss in dashpots over a step by their rates [J]; see `impactlab.integrators.base.Losses`."""
    total = 0.0
    for i in range(group.count):
        at = group.first + i
        moved = near[i] - (far[i] if far.size > 0 else 0.0) - m.dashpots[LENGTH, at]
        rate = rate_in(m, group, i, 1)
        felt = (1.0 - group.gamma) * m.dashpots[RATE, at] + group.gamma * rate
        before = m.dashpots[CHANGE, at]
        now = (rate - m.dashpots[RATE, at] - group.am * before) / (1.0 - group.am)
        felt += group.lag * (now - before)
        m.dashpots[CHANGE, at] = now
        kept = group.kappa * (rate * rate_in(m, group, i, 2) - m.dashpots[PRODUCT, at])
        total += m.dashpots[DAMPING, at] * (felt * moved - kept)
    return total


@PART
def read_lengths(m: StepArrays) -> None:
    """Read the lengths of all dashpots at the start of a step."""
    for number in range(len(m.dampers)):
        group = m.dampers[number]
        lengths = window(m.dashpots[LENGTH], group.first, group.count)
        write_lengths(lengths, near_ends(m, group), far_ends(m, group))
        if group.rates > 0:
            write_rates(m, group)


@PART
def book_dashpots(m: StepArrays, dt: float) -> None:
    """Book the losses in all dashpots over a step."""
    clock = m.clock[0]
    before = flush_subnormals()  # squares of the small motions of modes that fade away
    for number in range(len(m.dampers)):
        group = m.dampers[number]
        damping = window(m.dashpots[DAMPING], group.first, group.count)
        lengths = window(m.dashpots[LENGTH], group.first, group.count)
        changes = window(m.dashpots[CHANGE], group.first, group.count)
        share = 0.5 if group.straddles != 0 else 0.0
        near, far = near_ends(m, group), far_ends(m, group)
        if group.rates > 0:
            add_kicks(m, group)
            lost = loss_by_rates(m, group, near, far)
        else:
            lost = loss_times_step(damping, lengths, changes, near, far, share) / dt
        if group.inside != 0:
            clock.lost_inside += lost
        else:
            clock.lost_ends += lost
    restore_subnormals(before)
