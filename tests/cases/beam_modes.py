"""Beams by hand: closed modes, a few of them moving, the rest as a static spring; one ordinary differential equation.

It shares nothing with the package: modes from their characteristic equations, masses by quadrature, time by scipy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

Array = NDArray[np.float64]
Law = tuple[float, float]  # K and n of F = K d^n


@dataclass(frozen=True)
class Modes:
    """Mass-normalised modes of a beam: frequencies (n,) [rad/s], rows (n_places, n), and their integrals (n,)."""

    frequencies: Array
    rows: Array
    integrals: Array  # of rho A phi dx: what a weight of 1 m/s2, or a uniform velocity, means to each mode


def pinned(z: Array, s: Array) -> Array:
    """Return sin(n pi s) for z = n pi."""
    return np.sin(np.outer(s, z))


def cantilever(z: Array, s: Array) -> Array:
    """Return cosh - cos - sigma (sinh - sin), the growing exponential written so that it does not cancel."""
    sigma = (np.cosh(z) + np.cos(z)) / (np.sinh(z) + np.sin(z))
    grows = 0.5 * (np.sin(z) - np.cos(z) - np.exp(-z)) / (np.sinh(z) + np.sin(z))  # (1 - sigma)/2
    at = np.outer(s, z)
    return grows * np.exp(at) + 0.5 * (1.0 + sigma) * np.exp(-at) - np.cos(at) + sigma * np.sin(at)


def free_free(z: Array, s: Array) -> Array:
    """Return cosh + cos - sigma (sinh + sin)."""
    sigma = (np.cosh(z) - np.cos(z)) / (np.sinh(z) - np.sin(z))
    grows = 0.5 * (np.cos(z) - np.exp(-z) - np.sin(z)) / (np.sinh(z) - np.sin(z))
    at = np.outer(s, z)
    return grows * np.exp(at) + 0.5 * (1.0 + sigma) * np.exp(-at) + np.cos(at) - sigma * np.sin(at)


def pinned_free(z: Array, s: Array) -> Array:
    """Return sin(z s) + sin(z)/sinh(z) sinh(z s)."""
    at = np.outer(s, z)
    return np.sin(at) + np.sin(z) * np.exp(at - z) * (1.0 - np.exp(-2.0 * at)) / (1.0 - np.exp(-2.0 * z))


def roots(kind: str, count: int) -> Array:
    """Return the first roots of the characteristic equation, rigid motions left out."""
    n = np.arange(1, count + 1)
    if kind == "pinned":
        return n * np.pi
    equation, first = {
        "cantilever": (lambda z: np.cos(z) + 1.0 / np.cosh(z), n - 0.5),
        "free_free": (lambda z: np.cos(z) - 1.0 / np.cosh(z), n + 0.5),
        "pinned_free": (lambda z: np.sin(z) - np.tanh(z) * np.cos(z), n + 0.25),
    }[kind]
    return np.array([brentq(equation, (m - 0.3) * np.pi, (m + 0.3) * np.pi, xtol=1e-14) for m in first])


SHAPES = {"pinned": pinned, "cantilever": cantilever, "free_free": free_free, "pinned_free": pinned_free}
RIGID: dict[str, tuple[Callable[[Array], Array], ...]] = {
    "free_free": (lambda s: np.ones_like(s), lambda s: s - 0.5),
    "pinned_free": (lambda s: s,),
}


def modes(kind: str, mass: float, bending: float, length: float, places: Sequence[float], count: int) -> Modes:
    """Return the modes of a uniform beam of a mass [kg] and a stiffness EI [N m2], struck at places [m]."""
    z = roots(kind, count)
    # Gauss points in each of as many equal parts as modes: half a wave, at most, lies in one.
    x, weights = np.polynomial.legendre.leggauss(12)
    s = ((np.arange(count)[:, None] + 0.5 * (x + 1.0)) / count).ravel()
    weights = np.tile(0.5 * weights / count, count)
    at = np.asarray(places) / length
    shape, rows = SHAPES[kind](z, s), SHAPES[kind](z, at)
    for number, rigid in enumerate(RIGID.get(kind, ())):
        shape, rows = np.insert(shape, number, rigid(s), axis=1), np.insert(rows, number, rigid(at), axis=1)
    size = np.sqrt(mass * weights @ shape**2)
    omega = z**2 * np.sqrt(bending / (mass * length**3))
    return Modes(
        np.concatenate((np.zeros(shape.shape[1] - count), omega)), rows / size, mass * (weights @ shape) / size
    )


def timoshenko_pinned(
    mass: float, bending: float, shear: float, rotary: float, length: float, place: float, count: int
) -> Modes:
    """Return the modes of a pinned beam that shears, w = W sin(kx), theta = T cos(kx): two to each k."""
    k = np.arange(1, count + 1) * np.pi / length
    line = mass / length
    stiffness = np.array([[shear * k**2, -shear * k], [-shear * k, bending * k**2 + shear]]).transpose(2, 0, 1)
    scale = np.array([line, rotary]) ** -0.5
    squares, shapes = np.linalg.eigh(stiffness * np.outer(scale, scale))
    w = shapes[:, 0, :] * scale[0] * np.sqrt(2.0 / length)
    rows, integrals = w * np.sin(k * place)[:, None], line * w * ((1.0 - np.cos(k * length)) / k)[:, None]
    omega = np.sqrt(squares).ravel()
    order = np.argsort(omega)
    return Modes(omega[order], rows.ravel()[order][None, :], integrals.ravel()[order])


def struck(beam: Modes, least: float = 1e-9) -> Modes:
    """Return the modes that a force at the places moves at all."""
    kept = np.max(np.abs(beam.rows), axis=0) > least * np.max(np.abs(beam.rows))
    return Modes(beam.frequencies[kept], beam.rows[:, kept], beam.integrals[kept])


@dataclass(frozen=True)
class Impact:
    """Touches and final speed of an impact."""

    spans: tuple[tuple[float, float, float, float], ...]  # start [s], end [s], impulse [N s], peak force [N]
    peaks: tuple[float, ...]  # s, when each force is largest
    velocity: float  # m/s, of the striker at the end


@njit(cache=True)
def force_of_one(  # type: ignore[no-untyped-def]
    state, push, gap, compliance, stiffness, exponent, force
):
    """Fill the forces where at most one face is pressed, also with its force; return whether that is so."""
    faces, moving = push.shape
    number, free = -1, 0.0
    for k in range(faces):
        depth = state[2 * moving] - gap[k]
        for n in range(moving):
            depth -= push[k, n] * state[n]
        if depth > 0.0:
            if number >= 0:
                return False
            number, free = k, depth
    if number < 0:
        return True
    pressed, give = 0.0, compliance[number, number]
    for _ in range(30):  # Newton
        depth = max(free - give * pressed, 0.0)
        miss = pressed - stiffness * depth**exponent
        if abs(miss) <= 1e-12 * stiffness * free**exponent:
            break
        slope = exponent * stiffness * depth ** (exponent - 1.0) if depth > 0.0 else 0.0
        pressed -= miss / (1.0 + slope * give)
    for k in range(faces):
        depth = state[2 * moving] - gap[k] - compliance[number, k] * pressed
        for n in range(moving):
            depth -= push[k, n] * state[n]
        if k != number and depth > 0.0:
            return False
    force[number] = pressed
    return True


@njit(cache=True)
def accelerations(  # type: ignore[no-untyped-def]
    state, force, push, load, w2, mass, found
):
    """Fill the rates of a state: of modes under forces at the faces, and of the striker."""
    faces, moving = push.shape
    for n in range(moving):
        found[n] = state[moving + n]
        found[moving + n] = load[n] - w2[n] * state[n]
        for k in range(faces):
            found[moving + n] += force[k] * push[k, n]
    found[2 * moving], found[2 * moving + 1] = state[2 * moving + 1], 0.0
    for k in range(faces):
        found[2 * moving + 1] -= force[k] / mass


def impact(
    beam: Modes,
    moving: int,
    law: Law,
    duration: float,
    striker: tuple[float, float] | None = None,
    gaps: Sequence[float] = (0.0,),
    upward: Sequence[float] = (1.0,),
    gravity: float = 0.0,
    velocity: float = 0.0,
    samples: int = 20_001,
) -> Impact:
    """Return the contacts of a beam with a striker (mass, velocity), or with walls, each at its own row of the modes.

    ``upward`` is 1 where the other face lies below (it pushes the beam up), -1 where it lies above. The modes beyond
    ``moving`` answer statically: the depth of a contact is that of the moving ones less C F, C their compliance.
    """
    w2 = beam.frequencies[:moving] ** 2
    push = np.asarray(upward)[:, None] * beam.rows[:, :moving]
    rest = np.asarray(upward)[:, None] * beam.rows[:, moving:] / beam.frequencies[moving:]
    compliance = rest @ rest.T
    mass, speed = striker if striker is not None else (np.inf, 0.0)
    start, gap = np.zeros(2 * moving + 2), np.asarray(gaps)
    start[moving : 2 * moving] = velocity * beam.integrals[:moving]
    start[-1] = speed
    load = gravity * beam.integrals[:moving]

    stiffness, exponent = law

    def forces(state: Array) -> Array:
        force = np.zeros_like(gap)
        if force_of_one(state, push, gap, compliance, stiffness, exponent, force):
            return force
        free = state[-2] - push @ state[:moving] - gap
        for _ in range(30):  # Newton
            depth = np.maximum(free - compliance @ force, 0.0)
            miss = force - stiffness * depth**exponent
            if np.max(np.abs(miss)) <= 1e-12 * stiffness * free.max() ** exponent:
                break
            slope = exponent * stiffness * depth ** (exponent - 1.0) * (depth > 0.0)
            force = force - np.linalg.solve(np.eye(len(force)) + slope[:, None] * compliance, miss)
        return force

    def rates(_t: float, state: Array) -> Array:
        found = np.empty_like(state)
        accelerations(state, forces(state), push, load, w2, mass, found)
        return found

    # A step resolves the fastest mode; then errors of 1e-9 of each oscillation stay below those of the modes left out.
    solved = solve_ivp(rates, (0.0, duration), start, "DOP853", rtol=1e-9, atol=1e-14, dense_output=True)
    t = np.linspace(0.0, duration, samples)
    force = np.array([forces(state) for state in np.ascontiguousarray(solved.sol(t).T)]).T

    def depth(time: float, number: int) -> float:
        state = solved.sol(time)
        return float(state[-2] - push[number] @ state[:moving] - gap[number])

    spans, peaks = [], []
    for number, values in enumerate(force):
        pressed = np.concatenate(([0], (values > 0.0).astype(int), [0]))
        for first, last in zip(np.flatnonzero(np.diff(pressed) > 0), np.flatnonzero(np.diff(pressed) < 0), strict=True):
            begin = brentq(depth, t[first - 1], t[first], (number,), xtol=1e-13) if first > 1 else 0.0
            end = brentq(depth, t[last - 1], t[last], (number,), xtol=1e-13) if last < samples else np.nan
            piece = values[first:last]
            i = first + int(np.argmax(piece))
            a, b, c = values[i - 1], values[i], values[min(i + 1, samples - 1)]
            peaks.append(float(t[i] + 0.5 * (t[1] - t[0]) * (a - c) / (a - 2.0 * b + c)))
            impulse = float(np.trapezoid(piece, t[first:last]))
            spans.append((float(begin), float(end), impulse, float(b - 0.125 * (a - c) ** 2 / (a - 2.0 * b + c))))
    order = np.argsort([span[0] for span in spans])
    return Impact(tuple(spans[k] for k in order), tuple(peaks[k] for k in order), float(solved.y[-1, -1]))
