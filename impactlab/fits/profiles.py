"""Profile likelihood: least loss over other unknowns while one is moved outward.

Source: Bates and Watts, Nonlinear Regression Analysis and Its Applications (1988), section 6.1: the signed root of the
rise of the loss over the variance is Student's t where a model is linear.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from impactlab.fits.identifiable import MIN_SINGULAR, lengths
from impactlab.fits.loss import AT_BOUND, MAX_LOSS, Loss, Point
from impactlab.types import Array

STEPS = 4.0  # from the solution to the end of an interval
MAX_POINTS, MAX_ROUNDS = 40, 8  # on one side; to find where the limit is passed
GROWTH, MAX_SHARE = 2.0, 1.0 / 6.0  # of one step over the one before; of a step over the distance of the bounds
LIMIT_TOL = 1.0e-3  # of the limit: an end of an interval is found as well as that
BETTER_FALL = 0.02  # fall of the loss, over the variance, from which the solution was not the best


class Profile(NamedTuple):
    """The least loss along one unknown."""

    x: Array  # (points,), increasing; scaled
    rise: Array  # (points,), of the loss over the variance of the residuals; 0 at the solution
    lower: float  # where the rise passes the limit; minus infinity where it does not up to the bound
    upper: float
    better: Array | None = None  # unknowns (n,) with a loss below that of the solution


class ProfileSteps(NamedTuple):
    """Data of the steps along a profile."""

    loss: Loss
    number: int  # of the unknown
    base: Point  # the solution
    spread: float  # standard deviation of the residuals
    limit: float  # of the signed root of the rise
    is_seen: bool  # False: stops, open, where another unknown reaches a bound
    slope: Array  # (n,): change of the other unknowns over that of this one, from the derivatives at the solution

    def root(self, point: Point) -> float:
        """Return the square root of the rise of the loss over the variance."""
        return math.sqrt(max(0.0, point.loss - self.base.loss)) / self.spread

    def held(self, points: list[Point], place: float) -> Point:
        """Return the least loss with the unknown at a place.

        It starts from the better of two places: on the line through the last two points, and on the one along which the
        loss does not change where the derivatives are right, so that no direction is missed that signals do not
        determine.
        """
        last, before = points[-1].x, points[-2].x if len(points) > 1 else points[-1].x
        moved = last[self.number] - before[self.number]
        lines = [self.base.x + self.slope * (place - self.base.x[self.number])]
        if moved:
            lines.append(last + (last - before) * ((place - last[self.number]) / moved))
        starts = []
        for x in lines:
            x[self.number] = place
            starts.append(self.loss.at(np.clip(x, self.loss.low, self.loss.high)))
        return self.loss.least(min(starts, key=lambda start: start.loss).x, self.number)


def profile(
    loss: Loss, number: int, solution: Array, spread: float, limit: float, deviation: float, *, is_seen: bool = True
) -> Profile:
    """Return the profile of one unknown around a solution.

    Parameters
    ----------
    number : int
        The unknown.
    spread : float
        Standard deviation of the residuals.
    limit : float
        Root of the rise at the ends of the interval: the quantile of Student's t.
    deviation : float
        Standard deviation of the unknown from the derivatives, for the first step.
    is_seen : bool
        False where the signals do not determine the unknown: bounds of others that it runs into are no information.
    """
    walk = ProfileSteps(
        loss, number, loss.at(solution), spread, limit, is_seen, _slope(loss.jacobian(solution), number)
    )
    sides = [_side(walk, sign, deviation) for sign in (-1.0, 1.0)]
    points = [*reversed(sides[0][0][1:]), *sides[1][0]]
    least = min(points, key=lambda point: point.loss)
    better = least.x if least.loss < walk.base.loss - BETTER_FALL * spread**2 else None
    x, kept = np.unique([point.x[number] for point in points], return_index=True)
    rise = (np.array([point.loss for point in points])[kept] - walk.base.loss) / spread**2
    return Profile(x, rise, sides[0][1], sides[1][1], better)


def _slope(jacobian: Array, number: int) -> Array:
    """Return the changes (n,) of unknowns per change of one that least change the residuals."""
    norms = lengths(jacobian)
    others = np.delete(jacobian / norms, number, axis=1)
    found = np.linalg.lstsq(others, -jacobian[:, number], rcond=MIN_SINGULAR)[0] / np.delete(norms, number)
    return np.insert(found, number, 1.0)


def _side(walk: ProfileSteps, sign: float, deviation: float) -> tuple[list[Point], float]:
    """Return the points outward on one side, and the place of the limit.

    The place is infinite if the limit is not passed.
    """
    number, loss = walk.number, walk.loss
    bound = float((loss.high if sign > 0.0 else loss.low)[number])
    largest = MAX_SHARE * float(loss.widths[number])
    step = min(deviation * walk.limit / STEPS, largest)
    points = [walk.base]
    for _ in range(MAX_POINTS):
        place = float(points[-1].x[number]) + sign * step
        ends = sign * (place - bound) >= 0.0
        point = walk.held(points, bound if ends else place)
        stops = not walk.is_seen and _meets_a_bound(walk, point)
        if point.loss > MAX_LOSS * max(walk.base.loss, walk.spread**2) or (stops and walk.root(point) > walk.limit):
            break  # the case, or the bound of another unknown, allows no more
        grown = walk.root(point) - walk.root(points[-1])
        if walk.root(point) > walk.limit:
            passed = _passed(walk, points, point)
            return sorted([*points, *passed], key=lambda each: sign * each.x[number]), float(passed[-1].x[number])
        points.append(point)
        if ends or stops:
            break
        step = min(step * min(max(walk.limit / STEPS / max(grown, 1e-12), 0.5), GROWTH), largest)
    return points, sign * math.inf


def _passed(walk: ProfileSteps, points: list[Point], outside: Point) -> list[Point]:
    """Return points around the passed limit, closest last, by secants inside a bracket."""
    inside, found = points[-1], [outside]
    for _ in range(MAX_ROUNDS):
        low, high = walk.root(inside), walk.root(outside)
        share = 0.5 if high > STEPS * walk.limit else min(max((walk.limit - low) / (high - low), 0.05), 0.95)
        place = inside.x[walk.number] + share * (outside.x[walk.number] - inside.x[walk.number])
        found.append(walk.held([outside, inside], float(place)))
        root = walk.root(found[-1])
        if abs(root - walk.limit) <= LIMIT_TOL * walk.limit:
            break
        inside, outside = (found[-1], outside) if root < walk.limit else (inside, found[-1])
    return found


def _meets_a_bound(walk: ProfileSteps, point: Point) -> bool:
    """Return whether another unknown is at a bound, or will be.

    It will be if it is beyond on the line of the derivatives.
    """
    line = walk.base.x + walk.slope * (point.x[walk.number] - walk.base.x[walk.number])
    x = np.stack([point.x, line])
    near = np.min(np.minimum(x - walk.loss.low, walk.loss.high - x), axis=0) < AT_BOUND * walk.loss.widths
    near[walk.number] = False
    return bool(np.any(near))
