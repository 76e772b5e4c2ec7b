"""Located events: steps cut at contact events by false position with bisection.

This loop is compiled only when needed.
"""

from __future__ import annotations

from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import ENTRY, INLINE, PART, called
from impactlab.simulate.stepping import contact_solve, event_times, loop
from impactlab.simulate.stepping.arrays import CHANGE_PHASES, StepArrays
from impactlab.simulate.stepping.contact_solve import effect_of
from impactlab.simulate.stepping.event_times import OPEN, TOUCH_TOL, add_event
from impactlab.simulate.stepping.loop import DONE, EVENTS_FULL, LAW_FAILED, NOT_FINITE, RECORDS_FULL, write_record
from impactlab.simulate.stepping.retiming import retime
from impactlab.simulate.stepping.samples import sample_energies

# Quantity that crosses zero downwards inside a step: the gap, the trial force, or the negative gap (faces that part).
NOTHING, GAP, TRIAL, PARTING = 0, 1, 2, 3
NONE, FAILED = -1, -2  # in place of the number of a contact
MERGE_TOL = 1e-6  # of a step: an event closer to its start or end is moved there, as shorter steps are rounding
MAX_CUTS = 100  # events located inside one nominal step before the rest of it is taken whole

# A call copies all of `StepArrays`; here, where each piece is used several times, it is called all the same.
begin_step = called(loop.begin_step)
free_step = called(loop.free_step)
solve_contacts = called(contact_solve.solve_contacts)
correct = called(loop.correct)
write_events = called(event_times.write_events)
book_step = called(loop.book_step)


@PART
def attempt(m: StepArrays, time: float, dt: float) -> None:
    """Take the saved step again with some length, up to the contact forces."""
    for i in range(m.state.size):
        m.state[i] = m.backup[i]
    retime(m, dt)
    free_step(m, time, dt)
    solve_contacts(m, time, dt)


@PART
def gap_at_end(m: StepArrays, number: int) -> float:
    """Return a contact's gap at the end of an attempted step."""
    left, right = 2 * number, 2 * number + 1
    gap = m.contacts[number].initial_gap + m.faces[right].free_u - m.faces[left].free_u + m.replies[number].offset
    contact = m.contacts[number]
    for pair in range(contact.first_pair, contact.first_pair + contact.coupled):
        theirs = m.contacts[m.coupled[pair]]
        gap += effect_of(m, pair, 1, 0, theirs) - effect_of(m, pair, 0, 0, theirs)
    return float(gap)


@INLINE
def root(m: StepArrays, time: float, dt: float, watched: int, quantity: int, at_dt: float) -> float:
    """Return the step length at which the watched value crosses zero [s].

    It is at most ``dt``, found by false position with bisection.
    """
    low, high, at_low, at_high = 0.0, dt, 0.0, at_dt
    sign = -1.0 if quantity == PARTING else 1.0
    for turn in range(80):
        middle = 0.5 * (low + high)
        if at_low > 0.0 and turn % 3 != 2:
            margin = 1e-3 * (high - low)
            middle = low + (high - low) * at_low / (at_low - at_high)
            middle = min(max(middle, low + margin), high - margin)
        attempt(m, time, middle)
        value = float(m.replies[watched].trial) if quantity == TRIAL else sign * gap_at_end(m, watched)
        if value > 0.0:
            low, at_low = middle, value
        else:
            high, at_high = middle, value
        if high - low <= 1e-13 * dt:
            break
    # The mean force of a step reaches zero at twice the time at which the force does.
    return (0.25 if quantity == TRIAL else 0.5) * (low + high)


@INLINE
def event_in_step(m: StepArrays, time: float, h: float, number: int) -> tuple[int, float]:
    """Return the quantity of a contact that crosses zero in a step of length h.

    It is NOTHING if there is none; its value at h is returned beside it.
    """
    attempt(m, time, h)
    at_end = gap_at_end(m, number)
    port, reply = m.ports[number], m.replies[number]
    if port.in_contact > 0.0 and reply.in_contact == 0.0:
        if reply.trial < 0.0:
            return TRIAL, float(reply.trial)
        if at_end > 0.0:
            return PARTING, -at_end
    if port.in_contact == 0.0 and port.gap + port.offset > 0.0 and at_end < 0.0:
        return GAP, at_end
    return NOTHING, 0.0


@INLINE
def first_event(m: StepArrays, time: float, h: float, searched: bool) -> tuple[float, int, bool]:
    """Return time [s], contact and kind of the first event in a step.

    The contact may be NONE or FAILED; the kind is True for an opening. ``h`` is the length of the step.
    """
    earliest, which, opens = h, NONE, False
    for number in range(len(m.contacts)):
        quantity, at_h = event_in_step(m, time, h, number)
        if m.replies[number].failed != 0.0:
            return 0.0, FAILED, False
        if searched and quantity != NOTHING:
            tau = root(m, time, h, number, quantity, at_h)
            if tau < earliest or which == NONE:
                earliest, which, opens = tau, number, quantity != GAP
    return earliest, which, opens


@PART
def located_step(m: StepArrays, dt: float, whole: float, step_end: float) -> bool:
    """Take one step, cut at every event inside it; False where a law failed.

    Its length is ``whole``.
    """
    clock = m.clock[0]
    cuts = 0
    while True:
        time = clock.time
        h = whole if cuts == 0 else step_end - time
        begin_step(m, step_end)
        for i in range(m.state.size):
            m.backup[i] = m.state[i]
        earliest, which, opens = first_event(m, time, h, cuts < MAX_CUTS)
        if which == FAILED:
            return False
        if h - earliest <= MERGE_TOL * dt:
            earliest = h
        attempt(m, time, earliest)
        cuts += 1
        if earliest <= MERGE_TOL * dt and earliest < h:  # at its start: take it again in the other state
            for i in range(m.state.size):
                m.state[i] = m.backup[i]
            earliest = 0.0
        else:
            if which != NONE:
                m.replies[which].in_contact = 1.0 if opens else 0.0  # until the cut: a touch by a rounding is no event,
                contact = m.contacts[which]
                given = contact.force * earliest + contact.impulse
                if not opens and (contact.total == 0.0 or given <= TOUCH_TOL * contact.total):  # and has no force
                    contact.force, contact.impulse = 0.0, 0.0
            correct(m)
            write_events(m, time, earliest)
            book_step(m, earliest, step_end if earliest == h else time + earliest)
        if which == NONE:
            return True
        if opens:
            add_event(m, m.clock[0].time, which, OPEN, 0.0)
            m.ports[which].in_contact = 0.0
        else:
            # The gap of a touch is zero except for rounding, which is taken out.
            left, right = m.faces[2 * which], m.faces[2 * which + 1]
            m.contacts[which].touching = 1.0
            m.contacts[which].initial_gap = left.u - right.u - m.ports[which].offset
        if len(m.phases) > 0:
            call(m.pieces[CHANGE_PHASES], m)
        if clock.time >= step_end:
            return True
        if earliest > 0.0:
            write_record(m, dt)


@ENTRY
def advance_located(m: StepArrays, dt: float, last_step: int, stride: int, sample_stride: int) -> int:
    """Take steps cut at their events, otherwise as `advance_dated`."""
    clock = m.clock[0]
    while clock.step < last_step:
        if clock.n_records + MAX_CUTS + 2 >= m.record.shape[0] or clock.n_samples + 2 >= m.sample.shape[0]:
            return RECORDS_FULL
        if clock.n_events + 3 * (MAX_CUTS + 2) * len(m.contacts) >= len(m.events):
            return EVENTS_FULL
        end, whole = (clock.step + 1) * dt, dt
        if end - clock.ends > MERGE_TOL * dt and clock.ends - clock.time > MERGE_TOL * dt:  # it ends with the run
            end, whole = clock.ends, clock.ends - clock.time
        if not located_step(m, dt, whole, end):
            return LAW_FAILED
        clock.step += 1
        at_end = clock.step >= clock.steps - 2  # both ends of the last two steps
        if clock.step % stride == 0 or at_end:
            write_record(m, dt)
        if (clock.step % sample_stride == 0 or at_end) and not sample_energies(m, dt):
            return NOT_FINITE
    return DONE
