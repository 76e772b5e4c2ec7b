"""Event times of an accepted step by linear interpolation.

Contact states and memories are carried to the next step.
"""

from __future__ import annotations

from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import INLINE, PART
from impactlab.numerics.lanes import lanes_at, put_lanes
from impactlab.simulate.stepping.arrays import CHANGE_PHASES, ContactRecord, StepArrays
from impactlab.types import Port, Reply

CLOSE, OPEN, IMPULSE = 0, 1, 2  # kinds of events
TOUCH_TOL = 1e-9  # of the impulse so far: a smaller impulse of a single step is the rounding of an opening


@PART
def add_event(m: StepArrays, time: float, number: int, kind: int, impulse: float) -> None:
    """Write one event; times of one contact never decrease."""
    contact, event = m.contacts[number], m.events[m.clock[0].n_events]
    contact.last_event = max(time, contact.last_event)
    event.time, event.contact, event.kind, event.impulse = contact.last_event, number, kind, impulse
    event.span_impulse, event.span_peak = contact.span_impulse, contact.span_peak
    m.clock[0].n_events += 1


@PART
def close_time(contact: ContactRecord, port: Port, reply: Reply, time: float, dt: float) -> float:
    """Return the time of a closing [s].

    It is the root of the gap, or of the trial force if the faces already overlapped.
    """
    gap, free_gap = port.gap + port.offset, port.free_gap + reply.offset
    if gap > 0.0 and free_gap < 0.0:
        return float(time + dt * gap / (gap - free_gap))
    if gap < 0.0 and contact.old_gap >= 0.0:
        return float(max(0.0, time - dt * gap / (gap - contact.old_gap)))
    if gap < 0.0 and contact.old_trial < 0.0 and reply.trial > 0.0:
        share = contact.trial_point - reply.trial / (reply.trial - contact.old_trial)
        return float(max(0.0, time + dt * share))
    return time


@PART
def open_time(contact: ContactRecord, port: Port, reply: Reply, time: float, dt: float) -> float:
    """Return the time of an opening [s].

    It is the root of the trial force, or of the gap under a law without a signed trial.
    """
    gap, free_gap = port.gap + port.offset, port.free_gap + reply.offset
    if contact.old_trial > 0.0 and reply.trial < 0.0:
        return float(time + dt * (contact.trial_point + reply.trial / (contact.old_trial - reply.trial)))
    if gap > 0.0 and contact.old_gap < 0.0:
        return float(time - dt * gap / (gap - contact.old_gap))
    if gap < 0.0 and free_gap > 0.0:
        return float(time - dt * gap / (free_gap - gap))
    return time


@INLINE
def write_events(m: StepArrays, time: float, dt: float) -> None:
    """Write the events of an accepted step; carry contact states to the next.

    Memories of the laws are carried, too. Roots are linear between the instants of a value; where events are located,
    steps begin at them.
    """
    lost = 0.0
    for number in range(len(m.contacts)):
        contact, port, reply = m.contacts[number], m.ports[number], m.replies[number]
        if contact.skipped != 0:
            continue
        was_closed, is_closed = port.in_contact > 0.0, reply.in_contact > 0.0
        if contact.dates != 0:
            # Faces may meet and part within one step, which then holds the whole contact.
            given = contact.force * dt + contact.impulse
            touched = was_closed or is_closed or given > TOUCH_TOL * contact.total
            if touched and not was_closed:
                contact.span_impulse, contact.span_peak = 0.0, 0.0
                add_event(m, close_time(contact, port, reply, time, dt), number, CLOSE, 0.0)
            contact.span_impulse += given
            contact.span_peak = max(contact.span_peak, contact.force - reply.excess)
            if touched and not is_closed:
                add_event(m, open_time(contact, port, reply, time, dt), number, OPEN, 0.0)
        if contact.impulse != 0.0:
            add_event(m, time, number, IMPULSE, contact.impulse)
        contact.old_gap, contact.old_trial, contact.touching = port.gap + port.offset, reply.trial, 0.0
        contact.sum_force += contact.force * dt
        contact.total += contact.force * dt + contact.impulse
        port.in_contact, port.offset = reply.in_contact, reply.offset
        put_lanes(port.memory, 0, lanes_at(reply.memory, 0))
        lost += reply.dissipated
        if reply.dissipated != 0.0:
            contact.lost += reply.dissipated
        m.clock[0].lost_unresolved += reply.unresolved
        if contact.joined != 0:
            contact.largest = max(contact.largest, contact.force)
            contact.smallest = min(contact.smallest, contact.force)
        contact.negative += min(reply.dissipated, 0.0) + min(reply.unresolved, 0.0)
    if not lost < 0.0:  # a gain of all together is no loss: it shows in the balance, as does a loss that is NaN
        m.clock[0].lost_contact += lost
    if len(m.phases) > 0:
        call(m.pieces[CHANGE_PHASES], m)
