"""Event location within a step: changes of a contact's state.

A contact closes, opens, lets go or presses again.
"""

from __future__ import annotations

import numpy as np

from studies.audit.collocation import INNER, OPEN, POINTS, PRESSED, SLACK, at, gained
from studies.audit.network import HARD
from studies.audit.tables import STAGES

LOOKS = 24


@INNER
def margin(net, mode, gap, trial, c, small_gap, small_force):  # type: ignore[no-untyped-def]
    """Return a number that is negative where the state of a contact no longer holds."""
    if mode[c] == OPEN:
        return gap / small_gap + 1.0
    if net.law[c] == HARD:
        return trial / small_force + 1.0
    if mode[c] == SLACK:
        return min(1.0 - trial / small_force, 1.0 - gap / small_gap)
    return min(trial / small_force + 1.0, 1.0 - gap / small_gap)


@INNER
def margin_at(net, stage, mode, c, theta, step, u0, small_gap, small_force):  # type: ignore[no-untyped-def]
    """Return the margin of a contact at a share theta of the step."""
    a, b = net.left[c], net.right[c]
    gap = net.gap[c] + u0[b] - u0[a] + step * gained(stage.v[:, b] - stage.v[:, a], theta)
    return margin(net, mode, gap, at(stage.trial[:, c], theta), c, small_gap, small_force)


@INNER
def first_change(net, stage, mode, step, u0, small_gap, small_force):  # type: ignore[no-untyped-def]
    """Return the first contact to change its state within a step.

    Return the share of the step, too; the contact is -1 where none changes.
    """
    found, where = -1, 2.0
    for c in range(net.left.size):
        bad = margin_at(net, stage, mode, c, 1.0, step, u0, small_gap, small_force) < 0.0
        for s in range(STAGES):
            held = margin(net, mode, stage.gap[s, c], stage.trial[s, c], c, small_gap, small_force)
            bad = bad or held < 0.0
        if not bad:
            continue
        low, high = 0.0, 0.0
        for look in range(LOOKS + 1):
            high = look / LOOKS
            if margin_at(net, stage, mode, c, high, step, u0, small_gap, small_force) < 0.0:
                break
            low = high
        if high > 0.0:
            for _ in range(60):
                middle = 0.5 * (low + high)
                if margin_at(net, stage, mode, c, middle, step, u0, small_gap, small_force) < 0.0:
                    high = middle
                else:
                    low = middle
        if high < where:
            found, where = c, high
    return found, where


@INNER
def change(net, stage, mode, approach, floors, c, theta, step, u0, small_gap):  # type: ignore[no-untyped-def]
    """Change the state of a contact to its next one.

    ``theta`` is the share of the step at which it changes.
    """
    a, b = net.left[c], net.right[c]
    gap = net.gap[c] + u0[b] - u0[a] + step * gained(stage.v[:, b] - stage.v[:, a], theta)
    if mode[c] == OPEN:
        mode[c] = PRESSED
        approach[c] = max(floors[c], at(stage.rate[:, c], theta))
        return 1
    if net.law[c] == HARD or gap > 0.5 * small_gap:
        mode[c] = OPEN
    elif mode[c] == PRESSED:
        mode[c] = SLACK
    else:
        mode[c] = PRESSED
    return 0


@INNER
def roughness(net, stage, top):  # type: ignore[no-untyped-def]
    """Return the largest leading Legendre coefficient of the velocities: the error of a step's polynomials."""
    worst = 0.0
    for i in range(net.kind.size):
        value = 0.0
        for s in range(STAGES):
            value += top[s] * stage.v[s, i]
        worst = max(worst, abs(value))
    return worst


@INNER
def ends_of(stage, c):  # type: ignore[no-untyped-def]
    """Return first, last and largest force of a contact in a step.

    The first two are those directly at the start and the end of the step.
    """
    first, last = at(stage.force[:, c], 0.0), at(stage.force[:, c], 1.0)
    most = max(first, last)
    for s in range(STAGES):
        most = max(most, stage.force[s, c])
    return first, last, most


__all__ = ["POINTS", "change", "ends_of", "first_change", "np", "roughness"]
