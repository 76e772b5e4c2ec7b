"""A mass strikes a rod: waves as polynomials times exponentials, delayed by the transit, in high precision.

Every velocity and displacement on an interval is a sum of P_i(y) exp(r_i y), y counted from its start; the exponents
are 0 and those of the mass on the rod's impedance, complex where a contact spring swings. Resonance only raises the
degree, so each equation of motion is integrated in closed form. Nothing is shared with the solver under test.

The contact transmits F = k x + d x' (x the overlap), or ties the faces where it is hard. It closes as x rises through
zero, opens as F falls to zero, and closes again before the faces have parted if F would rise through zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import zip_longest
from typing import Any

import numpy as np
from mpmath import mp, mpc, mpf

DIGITS = 50  # of the results
GUARD = 30  # further digits of the computation, lost to cancellation in long polynomials
WIDTH = mpf(10) ** -15  # of a parameter, relative: central differences are right to its square
SAMPLES = 1500  # of a function in which the first fall below zero is looked for
NEAR, ROUNDING = 1e-3, 1e-10  # of the largest value, absolute: lower samples are looked at in high precision
LEAD = mpf(10) ** -12  # of an interval: the place where the leading term of a function gives its sign
NEVER = mpf("inf")
OPEN, OVERLAPPED, CLOSED = "open", "overlapped", "closed"  # overlapped: without force


class Sum:
    """A sum over i of P_i(y) exp(rates[i] y); rates[0] is 0."""

    def __init__(self, rates: tuple[Any, ...], parts: list[list[Any]]) -> None:
        self.rates, self.parts = rates, parts

    def __call__(self, y: Any) -> Any:
        total = mpf(0)
        for rate, part in zip(self.rates, self.parts, strict=True):
            value = mpf(0)
            for a in reversed(part):
                value = value * y + a
            total += value * mp.exp(rate * y)
        return mp.re(total)

    def __add__(self, other: Sum) -> Sum:
        pairs = zip(self.parts, other.parts, strict=True)
        return Sum(self.rates, [[a + b for a, b in zip_longest(*pair, fillvalue=0)] for pair in pairs])

    def __rmul__(self, factor: Any) -> Sum:
        return Sum(self.rates, [[factor * a for a in part] for part in self.parts])

    def __sub__(self, other: Sum) -> Sum:
        return self + -1 * other

    def plus(self, constant: Any) -> Sum:
        return self + Sum(self.rates, [[constant], *([] for _ in self.rates[1:])])

    def shifted(self, h: Any) -> Sum:
        """Return the same function with y counted from h."""
        moved = []
        for rate, part in zip(self.rates, self.parts, strict=True):
            out = list(part)
            for i in range(len(out) - 1):
                for k in range(len(out) - 2, i - 1, -1):
                    out[k] += h * out[k + 1]
            moved.append([mp.exp(rate * h) * a for a in out])
        return Sum(self.rates, moved)

    def slope(self) -> Sum:
        """Return its derivative."""
        pairs = zip(self.rates, self.parts, strict=True)
        rises = [[rate * a for a in part] for rate, part in pairs]
        return Sum(self.rates, rises) + Sum(self.rates, [[k * a for k, a in enumerate(p)][1:] for p in self.parts])

    def response(self, number: int, start: Any) -> Sum:
        """Return w of w' = rates[number] w + this function, w(0) = start."""
        parts, first = [], mpf(0)
        for at, (rate, part) in enumerate(zip(self.rates, self.parts, strict=True)):
            if at == number:
                parts.append([mpf(0), *(a / (k + 1) for k, a in enumerate(part))])
                continue
            out = [mpf(0)] * (len(part) + 1)
            for k in range(len(part) - 1, -1, -1):
                out[k] = (part[k] - (k + 1) * out[k + 1]) / (rate - self.rates[number])
            parts.append(out[:-1])
            first += out[0]
        parts[number][0] = start - first
        return Sum(self.rates, parts)

    def sampled(self, y: np.ndarray) -> np.ndarray:
        """Return values in double precision."""
        pairs = [(complex(rate), [complex(a) for a in part]) for rate, part in zip(self.rates, self.parts, strict=True)]
        return sum(np.polyval(part[::-1], y) * np.exp(rate * y) for rate, part in pairs).real

    def first_fall(self, width: Any) -> Any:
        """Return the first place in [0, width] from which the function is below zero, or infinity."""
        if self(LEAD * width) < 0:
            return mpf(0)
        places = np.linspace(0.0, float(width), SAMPLES + 1)
        rough, places[0], slope = self.sampled(places), LEAD * width, self.slope()
        dips = np.flatnonzero((rough[1:-1] < rough[:-2]) & (rough[1:-1] <= rough[2:])) + 1
        dips = set(dips[rough[dips] < NEAR * np.max(np.abs(rough))])
        for i in sorted(dips | set(np.flatnonzero(rough[1:] < ROUNDING) + 1)):
            low, high = mpf(places[i - 1]), mpf(places[i])
            if i in dips and slope(low) < 0 < slope(mpf(places[i + 1])):
                high = slope.root(low, mpf(places[i + 1]))
            if self(high) < 0:
                return self.root(low, high)
        return NEVER

    def root(self, low: Any, high: Any) -> Any:
        return mp.findroot(self, (low, high), solver="anderson", tol=mpf(10) ** (20 - 2 * mp.dps))

    def turns(self, width: Any) -> list[Any]:
        """Return the values where the slope changes sign inside (0, width)."""
        slope, places = self.slope(), np.linspace(0.0, float(width), SAMPLES + 1)
        near = np.flatnonzero(np.diff(np.sign(slope.sampled(places[1:-1])))) + 1
        pairs = [(mpf(places[i]), mpf(places[i + 1])) for i in near]
        return [self(slope.root(*pair)) for pair in pairs if slope(pair[0]) * slope(pair[1]) < 0]


@dataclass(frozen=True)
class Struck:
    """A mass strikes a rod at rest whose far end is clamped, free, or free before a hard wall; any consistent units."""

    mass: Any = "0.5"
    velocity: Any = 1
    gap: Any = 0  # between mass and rod
    stiffness: Any = None  # of the contact; None for a hard one
    damping: Any = 0
    length: Any = "0.5"
    area: Any = 1
    modulus: Any = 1
    density: Any = 1
    wall: Any = None  # gap between the rod and a wall behind it, infinite for a free end; None for a clamped one
    duration: Any = 3
    most: int = 1000  # closings of the contact: after so many the faces pass through each other

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name != "most" and value is not None:
                with mp.workdps(DIGITS + GUARD):
                    object.__setattr__(self, field.name, mpf(value))


@cache
def quantities(scene: Struck, digits: int = DIGITS) -> dict[str, Any]:
    """Return events, impulses and velocities of a scene by name.

    ``closing.0``, ``opening.0``, ``impulse.0``, ``peak_force.0`` ... of each period of contact of mass and rod, the
    same after ``wall.`` at a wall; ``impulse`` and ``peak_force`` of the whole run; ``first_opening``;
    ``final_velocity`` of the mass; ``nearest.0`` ..., the least gap in each flight after a contact. Events that do not
    take place are missing.
    """
    with mp.workdps(digits + GUARD):
        return march(scene)


class Book:
    """Periods of contact of one pair of faces."""

    def __init__(self, prefix: str) -> None:
        self.prefix, self.out, self.count = prefix, {}, 0

    def closes(self, now: Any) -> None:
        self.out |= {f"closing.{self.count}": now, f"impulse.{self.count}": mpf(0), f"peak_force.{self.count}": mpf(0)}
        self.count += 1

    def acts(self, force: Sum, width: Any) -> None:
        impulse, peak = f"impulse.{self.count - 1}", f"peak_force.{self.count - 1}"
        self.out[impulse] += force.response(0, mpf(0))(width)
        self.out[peak] = max(self.out[peak], force(0), force(width), *force.turns(width))

    def opens(self, now: Any) -> None:
        self.out[f"opening.{self.count - 1}"] = now

    def passes(self, gap: Sum, width: Any) -> None:
        if self.count and (turns := gap.turns(width)):
            name = f"nearest.{self.count - 1}"
            self.out[name] = min(self.out.get(name, NEVER), *turns)

    def whole(self) -> dict[str, Any]:
        of = {name: [self.out[f"{name}.{n}"] for n in range(self.count)] for name in ("impulse", "peak_force")}
        total = {"impulse": mp.fsum(of["impulse"]), "peak_force": max(of["peak_force"], default=mpf(0))}
        return {self.prefix + name: value for name, value in (self.out | total).items()}


def motion(scene: Struck, z: Any) -> tuple[tuple[Any, ...], Callable[..., tuple[Sum, Sum, Sum]]]:
    """Return the exponents, and the function that gives velocity, overlap and force from their start and the wave."""
    m = scene.mass
    if scene.stiffness is None:

        def tied(v: Any, x: Any, q: Sum) -> tuple[Sum, Sum, Sum]:
            velocity = (2 * z / m * q).response(1, v)
            return velocity, (0 * q).plus(x), z * (velocity - 2 * q)

        return (mpf(0), -z / m), tied
    k, d = scene.stiffness * z / (z + scene.damping), scene.damping * z / (z + scene.damping)
    a, b, c = -d / m, -k / m, 1 - d / z  # (v, x)' = [[a, b], [c, -k/z]] (v - 2 q, x)
    root = mp.sqrt(mpc((a + k / z) ** 2 + 4 * b * c))
    rates = (mpf(0), (a - k / z + root) / 2, (a - k / z - root) / 2)

    def sprung(v: Any, x: Any, q: Sum) -> tuple[Sum, Sum, Sum]:
        # along the left eigenvectors (c, rate - a)
        first, second = ((-2 * c * rates[n] * q).response(n, c * v + (rates[n] - a) * x) for n in (1, 2))
        overlap = 1 / root * (first - second)
        velocity = 1 / c * (first - (rates[1] - a) * overlap)
        return velocity, overlap, k * overlap + d * (velocity - 2 * q)

    return rates, sprung


def arriving(emitted: list[tuple[Any, Any, Sum]], since: Any, still: Sum) -> tuple[Sum, Any]:
    """Return the wave that arrives and how long it lasts; ``since`` is the time of its emission."""
    rounding = mpf(10) ** (10 - mp.dps)  # instants nearer than this are one, waves below it none
    if since < -rounding:
        return still, -since
    start, stop, wave = next(piece for piece in reversed(emitted) if piece[0] <= since + rounding)
    none = all(abs(a) < rounding for part in wave.parts for a in part)
    return still if none else wave.shifted(since - start), stop - since


def march(scene: Struck) -> dict[str, Any]:
    z = scene.area * mp.sqrt(scene.modulus * scene.density)
    transit = scene.length * mp.sqrt(scene.density / scene.modulus)
    rates, closed = motion(scene, z)
    still, to_right, to_left = Sum(rates, [[] for _ in rates]), [], []
    face, wall = Book(""), Book("wall.")
    now, v, x, room = mpf(0), scene.velocity, -scene.gap, scene.wall
    state, held, behind = OPEN, room is None, room not in (None, NEVER)
    while (left := scene.duration - now) > mpf(10) ** (10 - mp.dps):
        (q, first), (p, second) = (arriving(sent, now - transit, still) for sent in (to_left, to_right))
        width = min(left, first, second)
        velocity, overlap, force = closed(v, x, q)
        free = (still.plus(v) - 2 * q).response(0, x)
        falls = [force] if state == CLOSED else [free] if state == OVERLAPPED else [-1 * free]
        if state == OVERLAPPED:
            falls.append(-1 * (scene.stiffness * free + scene.damping * free.slope()))
        ends = [NEVER if state == OPEN and face.count >= scene.most else fall.first_fall(width) for fall in falls]
        wall_end = NEVER
        if behind:
            moved = (2 * p).response(0, mpf(0))
            unloaded = held and p is still  # faces in contact without force count as open
            wall_end = mpf(0) if unloaded else (2 * z * p if held else (-1 * moved).plus(room)).first_fall(width)
        y = min(width, wall_end, *ends)
        if y > 0:
            if state == CLOSED:
                face.acts(force, y)
            else:
                face.passes(-1 * free, y)
            if behind and held:
                wall.acts(2 * z * p, y)
            elif behind:
                room -= moved(y)
            to_right.append((now, now + y, q + 1 / z * force if state == CLOSED else q))
            to_left.append((now, now + y, -1 * p if held else p))
            v, x = (velocity(y), overlap(y)) if state == CLOSED else (v, free(y))
            now += y
        if y == ends[0] and state == CLOSED:
            face.opens(now)
            state = OVERLAPPED if scene.stiffness is not None and x > 0 else OPEN
        elif y == ends[0] and state == OVERLAPPED:
            state = OPEN
        elif y in ends:
            face.closes(now)
            state = CLOSED
        if y == wall_end:
            (wall.opens if held else wall.closes)(now)
            held, room = not held, mpf(0)
    found = face.whole() | (wall.whole() if behind else {})
    first = {"first_opening": found["opening.0"]} if "opening.0" in found else {}
    return {"final_velocity": v, **first, **found}


def derivative(quantity: str, parameter: str, scene: Struck, side: int = 0) -> Any:
    """Return d(quantity)/d(parameter) by central differences, or from one side, 1 or -1, in second order."""
    with mp.workdps(DIGITS + GUARD):
        at = getattr(scene, parameter)
        h = WIDTH * (abs(at) or 1)
        value = {n: quantities(replace(scene, **{parameter: at + n * h}))[quantity] for n in RUNS[side]}
        return sum(weight * value[n] for n, weight in RUNS[side].items()) / h


RUNS = {0: {-1: -0.5, 1: 0.5}, 1: {0: -1.5, 1: 2, 2: -0.5}, -1: {0: 1.5, -1: -2, -2: 0.5}}  # weights by place


def log_derivative(quantity: str, parameter: str, scene: Struck) -> Any:
    """Return d ln(quantity)/d ln(parameter)."""
    with mp.workdps(DIGITS + GUARD):
        return derivative(quantity, parameter, scene) * getattr(scene, parameter) / quantities(scene)[quantity]


def log_derivatives(parameter: str, scene: Struck) -> dict[str, Any]:
    """Return d ln(quantity)/d ln(parameter) of all quantities, by central differences."""
    with mp.workdps(DIGITS + GUARD):
        at, here = getattr(scene, parameter), quantities(scene)
        h = WIDTH * abs(at)
        low, high = (quantities(replace(scene, **{parameter: at + n * h})) for n in (-1, 1))
        known = [name for name, value in here.items() if value != 0 and name in low and name in high]
        return {name: (high[name] - low[name]) / (2 * h) * at / here[name] for name in known}
