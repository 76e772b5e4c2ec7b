"""Forces over time on ends, in the step loop.

Each acts as the force of a contact does, but is known before the step.
"""

from __future__ import annotations

from impactlab.numerics.compiling import PART
from impactlab.simulate.stepping.arrays import StepArrays
from impactlab.simulate.stepping.influence import row_times_state
from impactlab.types import Array

ON_GRID = 1e-6  # of a step, by which a sample may lie beside an instant


@PART
def force_at(times: Array, forces: Array, piece: int, t: float) -> float:
    """Return the force of samples at a time [N].

    The time is in the piece after sample ``piece``; -1 is before the first.
    """
    if piece < 0:
        return float(forces[0])
    if piece == times.size - 1:
        return float(forces[piece])
    share = (t - times[piece]) / (times[piece + 1] - times[piece])
    return float(forces[piece] + share * (forces[piece + 1] - forces[piece]))


@PART
def bends_there_alone(times: Array, piece: int, end: float, instant: float, dt: float) -> bool:
    """Return whether the only sample before ``end`` lies at an instant.

    The samples counted are those after ``piece``; times are in s.
    """
    first = piece + 1
    one = first < times.size and times[first] < end and not (first + 1 < times.size and times[first + 1] < end)
    return one and abs(times[first] - instant) <= ON_GRID * dt


@PART
def force_over(times: Array, forces: Array, piece: int, start: float, dt: float, point: float) -> float:
    """Return the force of a load in a step [N].

    It is the exact mean over the step, or over the same length about an instant. The instant is the start of the step
    (point 0) or its end (1), where some schemes take forces: a value there alone would miss pulses that begin and
    end between two of them. Where the only sample lies at the instant, it is the value there: so samples on the grid of
    the steps keep their impulse, and are not smoothed. ``piece`` is that of the start of the step; straight lines stand
    between samples.
    """
    low = start if point == 0.5 else start + (point - 0.5) * dt
    end, total = low + dt, 0.0
    while piece >= 0 and times[piece] > low:
        piece -= 1
    while piece < times.size - 1 and times[piece + 1] <= low:
        piece += 1
    if point != 0.5 and bends_there_alone(times, piece, end, start + point * dt, dt):
        return force_at(times, forces, piece, start + point * dt)
    begin = low
    while True:
        last = piece == times.size - 1 or times[piece + 1] >= end
        high = end if last else times[piece + 1]
        if last and low == begin:  # one line over the whole time
            return force_at(times, forces, piece, begin + 0.5 * dt)
        total += (high - low) * force_at(times, forces, piece, 0.5 * (low + high))
        if last:
            return total / dt
        low, piece = high, piece + 1


@PART
def apply_loads(m: StepArrays, time: float, dt: float) -> None:
    """Add the responses to loads to the state after the free step."""
    for number in range(len(m.loads)):
        load = m.loads[number]
        times = m.load_times[load.table_start : load.table_end]
        forces = m.load_forces[load.table_start : load.table_end]
        while load.piece >= 0 and times[load.piece] > time:
            load.piece -= 1
        while load.piece < times.size - 1 and times[load.piece + 1] <= time:
            load.piece += 1
        load.force = force_over(times, forces, load.piece, time, dt, load.point)
        body = m.bodies[load.body]
        start = body.response_start + load.place * (body.state_end - body.state_start)
        for part in range(3):
            for i in range(load.low[part], load.high[part]):
                m.state[body.state_start + i] += load.force * m.responses[start + i]


@PART
def read_loads(m: StepArrays) -> None:
    """Read the motion of the loaded ends at the start of a step."""
    first = len(m.row_start) - 1 - len(m.pushes) - 2 * len(m.loads)
    for number in range(len(m.loads)):
        m.loads[number].u = row_times_state(m, first + 2 * number)
        m.loads[number].v = row_times_state(m, first + 2 * number + 1)


@PART
def book_loads(m: StepArrays, dt: float) -> None:
    """Book impulse and work of the loads over an accepted step.

    A force at the start of a step works on the mean of the velocities around it, as in leapfrog; any other on the
    displacement in the step. One at the end of the step is the mean of this step and the last there.
    """
    first = len(m.row_start) - 1 - len(m.pushes) - 2 * len(m.loads)
    for number in range(len(m.loads)):
        load = m.loads[number]
        load.impulse += load.force * dt
        moved = row_times_state(m, first + 2 * number) - load.u
        if load.point == 0.0:
            moved = 0.5 * dt * (load.v + row_times_state(m, first + 2 * number + 1))
        felt = 0.5 * (load.before + load.force) if load.point == 1.0 else load.force
        load.work += felt * moved
        load.before = load.force
