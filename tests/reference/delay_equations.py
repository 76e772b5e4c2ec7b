"""A second way to rods that masses, springs and Hertz contacts meet: delay differential equations, solved by steps.

What a rod sends back is what it was sent one delay earlier, so between two breaks the ends obey ordinary equations with
known forcing. scipy's DOP853 solves them; nothing is shared with the wave network but the wave equation itself.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import solve_ivp

State = np.ndarray
TIGHT = 1e-12  # relative tolerance; the absolute one is a thousandth of it, in units where all is of order one


class Past:
    """The solution so far: states, and the mode (a number that the equations choose) of every stretch."""

    def __init__(self) -> None:
        self.starts: list[float] = []
        self.solutions: list[Callable[[float], State]] = []
        self.modes: list[int] = []

    def stretch(self, t: float) -> int:
        """Return the stretch that holds t; at its start the one that begins there."""
        return max(0, bisect_right(self.starts, t + 1e-13) - 1)

    def __call__(self, t: float) -> State:
        return self.solutions[self.stretch(t)](t)

    def mode(self, t: float) -> int:
        return self.modes[self.stretch(t)]


def solve_by_steps(
    rate: Callable[[float, State, int, Past], Sequence[float]],
    start: Sequence[float],
    mode: int,
    falls: Callable[[float, State, int, Past], float],
    delays: Sequence[float],
    duration: float,
    most: int = 100,
) -> tuple[Past, list[float]]:
    """Return all of a run and the times at which ``falls`` went below zero, where the mode changes between 0 and 1.

    The run ends after ``most`` events. Every break (the start, each event) breaks again one delay later; stretches end
    there.
    """
    past, events, now, y = Past(), [], 0.0, np.array(start, float)
    breaks = {float(duration), *delays}
    while now < duration - 1e-12 and len(events) < most:
        stop = min(t for t in breaks if t > now + 1e-12)
        past.starts.append(now)
        past.modes.append(mode)
        past.solutions.append(lambda t, y=y: y)

        def event(t: float, state: State, mode: int = mode) -> float:
            return falls(t, state, mode, past)

        event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
        # Forcing is known up to the shortest delay; it is smooth inside a stretch, and never taken beyond its end.
        answer = solve_ivp(
            lambda t, state, mode=mode, stop=stop: rate(min(t, stop - 1e-12), state, mode, past),
            (now, stop), y, method="DOP853", rtol=TIGHT, atol=1e-3 * TIGHT, dense_output=True,
            events=event, max_step=0.25 * min(delays),
        )  # fmt: skip
        past.solutions[-1] = answer.sol
        found = answer.t_events[0]
        begun = falls(now + 1e-9, answer.sol(now + 1e-9), mode, past)
        if begun < 0.0:  # a break itself took the force away
            found = np.array([now])
        if len(found) and found[0] < stop - 1e-12:
            if found[0] <= now + 1e-9:
                for known in (past.starts, past.modes, past.solutions):
                    known.pop()  # type: ignore[attr-defined]
            now, y, mode = float(found[0]), answer.sol(float(found[0])), 1 - mode
            events.append(now)
        else:
            now, y = stop, answer.y[:, -1]
        breaks |= {now + delay for delay in delays}
    return past, events
