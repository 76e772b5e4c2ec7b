"""Springs that yield and remember: one element behind cushions, soils, plastic joints and specimens.

The element is an elastic spring in series with a slider. At the overlap d, with the set s of the slider, its force is
k (d - s), held between two yield forces by moving the slider; both may grow with the set. An element that opens never
pulls: where d < s its faces are apart, and the set stays. A dashpot may act beside the element while it is closed.
"""

from __future__ import annotations

import math

from impactlab.numerics.compiling import LAW_PART, UNPACK
from impactlab.types import Port, Reply

# Parameters of the port.
STIFFNESS = 0  # N/m, of the elastic spring
UPPER, UPPER_RISE = 1, 2  # N, N/m: yield force in compression, and its rise with the set
LOWER, LOWER_RISE = 3, 4  # N, N/m: the other yield force, negative where the element pulls
KEPT = 5  # N/m: the part of the rise that gives its energy back, of kinematic hardening
OPENS = 6  # 1 where the element never pulls
PLAY = 9  # m: without force for overlaps from -play to 0; then nothing yields
DAMPING, CAPACITY = 7, 8  # s/m, N: the dashpot gives damping times capacity times rate; capacity 0: times its own force
LENGTH, AREA = 10, 11  # m, m2: of a specimen; 0 of all else
FLOW, RATE = 12, 13  # kinds of its flow stress and of its dependence on the rate: see `flow_stress`
RATE_NUMBERS, FLOW_NUMBERS = 14, 16  # where their constants begin
LINEAR, TABLE, JOHNSON_COOK = 1.0, 2.0, 3.0
COWPER_SYMONDS = 1.0
# Memory.
SET, FORCE, SLID = 0, 1, 2  # m, N, m: of the element at the end of the last step; SLID is the way of the slider so far
# m/s, s: of a specimen, the mean rate of its slider in the last step, and the length of that step. Where the force acts
# at the start of a step the rate is that of its spring.
LAST_RATE, LAST_DT = 3, 4
NO_TOUCH = 0.5  # share of a step in which no faces meet: its force stands for half of two steps
FREE = 1e300  # N: a yield force that is never reached
MAX_TURNS = 200  # of the root finding; it needs some ten, bisection alone sixty
NARROW = 2.0**-52  # of a way that is sought
MAX_WIDENED = 1e6  # m, to stop at: no overlap of a run is as large


@UNPACK
def flow_stress(port: Port, strain: float, rate: float) -> float:
    """Return the flow stress [Pa] at a plastic strain and its rate [1/s]."""
    p, at = port.parameters, FLOW_NUMBERS
    if p[FLOW] == LINEAR:
        stress = p[at] + p[at + 1] * strain
    elif p[FLOW] == JOHNSON_COOK:
        stress = p[at]
        if p[at + 1] != 0.0:
            stress += p[at + 1] * strain ** p[at + 2]
        if rate > p[at + 4]:
            stress *= 1.0 + p[at + 3] * math.log(rate / p[at + 4])
    else:  # straight lines between the points of a table, level after its last one
        count = int(p[at])
        stress = p[at + 2 * count]
        for number in range(count - 1):
            x0, y0, x1, y1 = (
                p[at + 1 + 2 * number],
                p[at + 2 + 2 * number],
                p[at + 3 + 2 * number],
                p[at + 4 + 2 * number],
            )
            if x0 <= strain < x1:
                stress = y0 + (y1 - y0) * (strain - x0) / (x1 - x0)
    if p[RATE] == COWPER_SYMONDS and rate > 0.0:
        stress *= 1.0 + (rate / p[RATE_NUMBERS]) ** (1.0 / p[RATE_NUMBERS + 1])
    return stress


@UNPACK
def at_the_end(port: Port, mean: float, last: float) -> float:
    """Extrapolate a rate to the end of a step from its means in two steps.

    The means are those in this step and in the one before; the line through them is straight. With it the slider moves
    by the backward differentiation formula of second order, which damps stiff flow; in the first step only the mean is
    known.
    """
    if port.time == 0.0:
        return mean
    return mean + (mean - last) * port.dt / (port.dt + port.memory[LAST_DT])


@UNPACK
def stress_in_step(port: Port, sign: float, force: float, slid: float) -> float:
    """Return the flow stress [Pa] of a step in which the slider moves ``slid`` [m].

    ``force`` is the size of the force at its end [N]. The rate is that at the end of the step, as the force is. Where
    the force acts at the start of the step, the rate is that there, the mean of the velocities before and after it,
    less the elastic part: a rate of the slider in the steps before would feed the highest frequencies.
    """
    p = port.parameters
    if port.averaged == 0.0 and port.acting_gap_per_force == 0.0:
        elastic = (force - sign * port.memory[FORCE]) / (p[STIFFNESS] * port.dt)
        closing = -sign * (port.acting_rate + port.acting_rate_per_force * sign * force)
        rate = closing - at_the_end(port, elastic, sign * port.memory[LAST_RATE])
    else:
        rate = at_the_end(port, slid / port.dt, max(0.0, sign * port.memory[LAST_RATE]))
    return flow_stress(port, (port.memory[SLID] + slid) / p[LENGTH], max(0.0, rate) / p[LENGTH])


@LAW_PART
def left_over(port: Port, sign: float, force: float, slid: float) -> float:
    """Return the excess of the elastic force over the yield force, as a length [m].

    It is the excess after the slider has moved, divided by the stiffness.
    """
    left = force - port.parameters[STIFFNESS] * slid
    return (left - port.parameters[AREA] * stress_in_step(port, sign, left, slid)) / port.parameters[STIFFNESS]


@LAW_PART
def slid_in_step(port: Port, trial: float) -> float:
    """Solve for the displacement of a specimen's slider in this step [m].

    ``trial`` is its elastic trial force [N]. It solves |trial| - k y = A Y. As the flow stress Y never falls with y,
    that at y = 0 gives an upper bound of the way, and that at the upper bound a lower one.

    References
    ----------
    Chandrupatla1997 (inverse quadratic interpolation where it is safe, else bisection).
    """
    sign, force = 1.0 if trial > 0.0 else -1.0, abs(trial)
    last = left_over(port, sign, force, 0.0)  # the bound of the way without a rise of the flow stress
    if last <= 0.0:
        return 0.0
    near, near_value = last, left_over(port, sign, force, last)
    far = max(0.0, near + near_value)
    far_value = left_over(port, sign, force, far) if far > 0.0 else last
    if far_value <= 0.0 or near_value >= 0.0:  # the flow stress is level between the bounds, except for rounding
        return far
    share = 0.5
    for _ in range(MAX_TURNS):
        way = near + share * (far - near)
        value = left_over(port, sign, force, way)
        if (value > 0.0) == (near_value > 0.0):
            old, old_value = near, near_value
        else:
            old, old_value, far, far_value = far, far_value, near, near_value
        near, near_value = way, value
        least = NARROW * max(near, far)
        if value == 0.0 or abs(far - near) <= 2.0 * least:
            break
        share = 0.5
        place, part = (near - far) / (old - far), (near_value - far_value) / (old_value - far_value)
        if part * part < place and (1.0 - part) * (1.0 - part) < 1.0 - place:
            share = near_value / (far_value - near_value) * old_value / (far_value - old_value)
            beyond = near_value / (old_value - near_value) * far_value / (old_value - far_value)
            share += (old - near) / (far - near) * beyond
        closest = least / abs(far - near)
        share = min(max(share, closest), 1.0 - closest)
    return far if abs(far_value) < abs(near_value) else near


@LAW_PART
def element(port: Port, at: float, overlap: float) -> tuple[float, float]:
    """Return force [N] and set [m] at an overlap, from the set before."""
    p = port.parameters
    if p[PLAY] > 0.0:
        return p[STIFFNESS] * (max(0.0, overlap) + min(0.0, overlap + p[PLAY])), at
    force = p[STIFFNESS] * (overlap - at)
    if p[OPENS] != 0.0 and force <= 0.0:
        return 0.0, at
    if p[FLOW] != 0.0:
        moved = slid_in_step(port, force)
        return (force - p[STIFFNESS] * moved, at + moved) if force > 0.0 else (force + p[STIFFNESS] * moved, at - moved)
    upper, lower = p[UPPER] + p[UPPER_RISE] * at, p[LOWER] + p[LOWER_RISE] * at
    if force > upper:
        moved = (force - upper) / (p[STIFFNESS] + p[UPPER_RISE])
        return force - p[STIFFNESS] * moved, at + moved
    if force < lower and p[OPENS] == 0.0:
        moved = (force - lower) / (p[STIFFNESS] + p[LOWER_RISE])
        return force - p[STIFFNESS] * moved, at + moved
    return force, at


@UNPACK
def energy(port: Port, force: float, at: float) -> float:
    """Return the energy that the element gives back [J]."""
    return 0.5 * force * force / port.parameters[STIFFNESS] + 0.5 * port.parameters[KEPT] * at * at


@UNPACK
def loss_of_slider(port: Port, first: float, force: float, after: float) -> float:
    """Return the energy dissipated by the slider as its set changes between two forces [J]."""
    at, kept = port.memory[SET], 0.5 * port.parameters[KEPT]
    return max(0.0, 0.5 * (first + force) * (after - at) - kept * (after * after - at * at))


@LAW_PART
def dashpot(port: Port, first: float, last: float) -> float:
    """Return the damping [N s/m] beside an element with two forces in a step.

    It is zero where the element is open. The mean of both sizes, not the size of their mean: the force of a step then
    rises with the overlap at its end, also where the element's force changes its sign.
    """
    p = port.parameters
    if p[OPENS] != 0.0 and first <= 0.0 and last <= 0.0:
        return 0.0
    return p[DAMPING] * (p[CAPACITY] if p[CAPACITY] > 0.0 else 0.5 * (abs(first) + abs(last)))


@UNPACK
def meeting(port: Port) -> bool:
    """Return whether faces that may be apart meet at the start of the step.

    A dashpot of its own acts from then on.
    """
    return port.parameters[OPENS] != 0.0 and -port.gap == port.memory[SET] and port.gap_rate < 0.0


@LAW_PART
def share_of_touch(port: Port) -> float:
    """Return the share of a step that follows a touch within it.

    It is for a dashpot that acts at once, on faces that were apart at the start of the step. The step is that before
    the instant at which the force acts. A force that jumps stands for this part of it and half of the next one; at the
    start of a run, for half of the next one, which the first state holds.
    """
    p = port.parameters
    if p[OPENS] == 0.0 or p[CAPACITY] == 0.0 or port.in_contact != 0.0:
        return NO_TOUCH
    if port.acting_gap_per_force == 0.0:
        last, first = -port.gap, -port.gap + port.gap_rate * port.memory[LAST_DT]
    else:
        last, first = -port.free_gap, -port.gap
    met_before = first > port.memory[SET] or (port.time == 0.0 and -port.gap >= port.memory[SET])
    if last < port.memory[SET] or met_before or first >= last:
        return NO_TOUCH
    return (last - port.memory[SET]) / (last - first)


@LAW_PART
def total_at(port: Port, overlap: float) -> float:
    """Return the force of the step [N] if it ends at an overlap.

    The mean of the element's force over the step is its work over the travel: it is linear in the overlap while the
    element is closed, so its work from d0 to d1 is the mean of its two forces times the travel while closed.
    """
    opens, at = port.parameters[OPENS] != 0.0, port.memory[SET]
    force, after = element(port, at, overlap)
    if port.averaged != 0.0:
        before = -port.gap
        moved = overlap - before
        first = port.parameters[STIFFNESS] * (before - at)
        if port.parameters[PLAY] > 0.0:
            first, _ = element(port, at, before)
            mean = 0.5 * (first + force)
            pressed, pulled = min(before, overlap) >= 0.0, max(before, overlap) <= -port.parameters[PLAY]
            if not pressed and not pulled and moved != 0.0:  # the play takes part of the travel
                mean *= (force - first) / (port.parameters[STIFFNESS] * moved)
        elif opens and first <= 0.0:  # the faces meet within the step
            mean = 0.5 * force * (overlap - at) / moved if force > 0.0 else 0.0
        elif opens and force <= 0.0:  # they part within it
            mean = 0.5 * first * (at - before) / moved
        else:
            mean = 0.5 * (first + force)
            slid = mean * (after - at)
            if slid < 0.0 and port.parameters[FLOW] != 0.0:
                mean -= slid / moved  # it flows back after a faster flow, and no energy comes of that
        first = max(0.0, first) if opens else first
        total = mean + dashpot(port, first, force) * moved / port.dt
    else:  # the force acts at the end of the step
        moved = overlap + port.free_gap
        rate = -port.acting_rate + port.acting_rate_per_force / port.gap_per_force * moved
        total = force + (0.5 + share_of_touch(port)) * dashpot(port, force, force) * rate
    return max(0.0, total) if opens else total


@UNPACK
def end_of_step(port: Port) -> float:
    """Solve for the overlap at the end of an implicit step [m].

    There the motion of the faces agrees with the force of the element. Regula falsi in the form of Illinois; the
    overlap lies between that without force and that under its force. The force of the step rises with the overlap,
    except that of a dashpot J |Rs| v at the end of a step: then the overlap may lie a little beyond.
    """
    compliance, free = port.gap_per_force, -port.free_gap
    high, at_high = free, compliance * total_at(port, free)
    low = high - at_high
    at_low = low - free + compliance * total_at(port, low)
    widened = at_low
    while at_low * at_high > 0.0 and abs(widened) < MAX_WIDENED:  # a dashpot that fades as it unloads the element
        widened *= 2.0
        low -= widened
        at_low = low - free + compliance * total_at(port, low)
    if at_high == 0.0 or at_low == 0.0:
        return high if at_high == 0.0 else low
    for turn in range(MAX_TURNS):
        middle = 0.5 * (low + high)
        if turn % 8 != 7 and at_high != at_low:
            chord = (low * at_high - high * at_low) / (at_high - at_low)
            if min(low, high) < chord < max(low, high):
                middle = chord
        value = middle - free + compliance * total_at(port, middle)
        if value == 0.0 or not min(low, high) < middle < max(low, high):
            return middle
        if (value > 0.0) == (at_high > 0.0):
            high, at_high = middle, value
            at_low *= 0.5
        else:
            low, at_low = middle, value
            at_high *= 0.5
    return 0.5 * (low + high)


def elastic(stiffness: float, play: float = 0.0) -> tuple[float, ...]:
    """Return the parameters of an element that never yields."""
    return stiffness, FREE, 0.0, -FREE, 0.0, 0.0, 0.0, 0.0, 0.0, play


def cushion(stiffness: float, unloading: float) -> tuple[float, ...]:
    """Return the parameters of a spring that unloads along a steeper line and never pulls.

    On the loading line the set is the overlap times 1 - k/k_u, so the yield force rises with it by k/(1 - k/k_u).
    """
    if unloading == stiffness:
        return stiffness, FREE, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
    return unloading, 0.0, stiffness / (1.0 - stiffness / unloading), 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0


def respond(port: Port, reply: Reply) -> None:
    """Write force, energies and set of the element after one step."""
    p, at = port.parameters, port.memory[SET]
    opens = p[OPENS] != 0.0
    if port.averaged == 0.0 and port.acting_gap_per_force == 0.0:
        # The force acts at the start of the step, where the overlap is known; only the dashpot feels the step itself.
        overlap = -port.gap
        force, reply.memory[SET] = element(port, at, overlap)
        reply.memory[FORCE] = force
        reply.memory[LAST_RATE] = (force - port.memory[FORCE]) / (p[STIFFNESS] * port.dt)
        damping = p[DAMPING] * p[CAPACITY] if meeting(port) else dashpot(port, force, force)
        total = (force - damping * port.acting_rate) / (1.0 + damping * port.acting_rate_per_force)
        total = force + (0.5 + share_of_touch(port)) * (total - force)
        total = max(0.0, total) if opens else total
        # In leapfrog a force works over half of the step before it and half of the one after it. So the element is
        # given the mean of two forces times the travel between them, and half a step more: the last product.
        ahead = force + p[STIFFNESS] * (-port.free_gap - port.gap_per_force * total - overlap)
        if p[PLAY] > 0.0:
            ahead, _ = element(port, at, -port.free_gap - port.gap_per_force * total)
        ahead = max(0.0, ahead) if opens else ahead
        reply.stored = 0.5 * force * ahead / p[STIFFNESS] + 0.5 * p[KEPT] * reply.memory[SET] ** 2
        slid = loss_of_slider(port, port.memory[FORCE], force, reply.memory[SET])
        rate = port.acting_rate + port.acting_rate_per_force * total
        reply.dissipated = slid + max(0.0, (force - total) * rate * port.dt)
    else:
        overlap = end_of_step(port)
        total = total_at(port, overlap)
        first = p[STIFFNESS] * (-port.gap - at)
        if p[PLAY] > 0.0:
            first, _ = element(port, at, -port.gap)
        first = max(0.0, first) if opens else first
        force, reply.memory[SET] = element(port, at, overlap)
        reply.memory[FORCE] = force
        reply.memory[LAST_RATE] = (reply.memory[SET] - at) / port.dt
        reply.stored = energy(port, force, reply.memory[SET])
        if port.averaged != 0.0:
            travel = -(port.free_travel + port.travel_per_force * total)
            reply.dissipated = max(0.0, total * travel + energy(port, first, at) - reply.stored)
        else:  # the force at the end of a step times its travel is not the work that the element takes in it
            rate = -(port.acting_rate + port.acting_rate_per_force * total)
            meets = port.time == 0.0 and meeting(port)
            before = (p[DAMPING] * p[CAPACITY] if meets else dashpot(port, first, first)) * -port.gap_rate
            before = max(-first, before) if opens else before
            share = share_of_touch(port)
            power = max(0.0, -before * port.gap_rate) + max(0.0, (total - force) * rate) * 2.0 * share / (0.5 + share)
            reply.dissipated = loss_of_slider(port, first, force, reply.memory[SET]) + 0.5 * power * port.dt
    reply.memory[LAST_DT] = port.dt
    reply.memory[SLID] = port.memory[SLID] + abs(reply.memory[SET] - at)
    reply.force = total
    reply.trial = total if not opens else total if force > 0.0 else p[STIFFNESS] * (overlap - at)
    reply.in_contact = 0.0 if opens and force <= 0.0 and total <= 0.0 else 1.0
