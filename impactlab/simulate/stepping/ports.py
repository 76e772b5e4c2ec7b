"""Gap, rate and travel of a port where the force of a step acts, or of a port at one instant.

In a step they follow from the load point of the scheme.
"""

from __future__ import annotations

import math

from impactlab.numerics.compiling import INLINE
from impactlab.types import Port

LATE_TOUCH = 1.001  # steps: faces that have overlapped for no longer have touched since the start of the step before


@INLINE
def fill_acting(port: Port, load_point: float) -> None:
    """Fill the fields of a port where the force acts.

    They follow from those at both ends of the step. ``load_point`` is where in the step the force acts: 0 at its start,
    1 at its end, else in the mean over the step.
    """
    gap, free_gap, dt = port.gap, port.free_gap, port.dt
    port.first_weight = 1.0
    port.averaged = 0.0
    port.rate_before_impulse = port.gap_rate + port.others_rate
    if load_point == 0.0:
        # The velocities at the two ends of the step are those in the middle of this step and of the step before. They
        # straddle the force, which works over half of each, and an impulse, which changes the later one.
        port.acting_gap = port.first_gap = port.last_gap = gap
        port.acting_gap_per_force = 0.0
        port.acting_rate = 0.5 * (port.gap_rate + port.free_gap_rate)
        port.acting_rate_per_force = 0.5 * port.rate_per_force
        port.travel_start, port.free_travel = gap - 0.5 * dt * port.gap_rate, dt * port.acting_rate
        port.travel_per_force = dt * port.acting_rate_per_force
        port.rate_before_impulse = port.free_gap_rate
        if port.in_contact == 0.0 and gap < 0.0 and LATE_TOUCH * port.gap_rate * dt <= gap:
            # The time since the touch, a step at most, and half a step.
            port.first_weight = 0.5 + min(1.0, gap / (port.gap_rate * dt))
        return
    port.travel_start, port.free_travel, port.travel_per_force = gap, free_gap - gap, port.gap_per_force
    if load_point == 1.0:
        port.acting_gap = port.first_gap = port.last_gap = free_gap
        port.acting_gap_per_force = port.gap_per_force
        port.acting_rate, port.acting_rate_per_force = port.free_gap_rate, port.rate_per_force
        if port.in_contact == 0.0 and gap >= 0.0 and free_gap < 0.0:
            # The time since the touch and half a step more.
            port.first_weight = 0.5 + free_gap / (free_gap - gap)
        return
    port.averaged = 1.0
    port.first_gap, port.last_gap = gap, free_gap
    port.acting_gap, port.acting_gap_per_force = 0.5 * (gap + free_gap), 0.5 * port.gap_per_force
    port.acting_rate, port.acting_rate_per_force = port.free_travel / dt, port.gap_per_force / dt


@INLINE
def fill_acting_push(port: Port, load_point: float) -> None:
    """Fill the fields of a port that a law pushes by, where the force acts."""
    port.acting_pushed = (1.0 - load_point) * port.pushed + load_point * port.free_pushed
    port.acting_pushed_per_force = load_point * port.pushed_per_force
    port.acting_pushed_per_push = load_point * port.pushed_per_push
    port.acting_gap_per_push = load_point * port.gap_per_push


def fill_instant(port: Port, gap: float, rate: float) -> None:
    """Fill a port for a law that is evaluated at one instant, outside of compiled code.

    All of its gaps [m] and rates [m/s] are those of the instant; compliances are left at zero.
    """
    port.first_weight = 1.0
    port.gap = port.free_gap = port.acting_gap = port.first_gap = port.last_gap = port.travel_start = gap
    port.gap_rate = port.free_gap_rate = port.acting_rate = rate


@INLINE
def predicted_gap(port: Port, others: float, projects_first: bool) -> float:
    """Return the gap that a projection corrects [m].

    It is that of the predictor; infinite in a scheme without one.
    """
    return port.gap + port.dt * port.gap_rate + others if projects_first else math.inf
