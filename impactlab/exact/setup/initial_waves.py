"""Initial waves of rods, as emitted by their ends, from displacement and velocity at t = 0."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from impactlab.errors import CaseError
from impactlab.exact.setup.network import Link, Log, NetworkLayout, with_room
from impactlab.scene.bodies import Profile, Table, WaveBody
from impactlab.scene.problem import Scene
from impactlab.types import Array

POINTS = 48  # Chebyshev points on a piece of a profile
MAX_TAIL = 1.0e-13  # of the largest displacement: last coefficients of a piece that is resolved
MAX_ROUNDING = 5.0e-16  # of the largest displacement: coefficients below are those of the rounding of a formula
MAX_PIECES = 200  # of a profile
MIN_ROOM = 64  # pieces per junction, events: doubled when full
MIN_POOL = 60_000

Piece = tuple[float, float, Array]
"""Start, end, and the Chebyshev coefficients of a function between them."""


class FirstPiece(NamedTuple):
    """A piece of all signals of a junction before t = 0."""

    start: float  # s
    stop: float  # s
    size: int  # coefficients of a signal
    values: list[float]  # those of all signals, one after the other


def coefficients(values: Array) -> Array:
    """Return the Chebyshev coefficients of a function from its values.

    Values are those at the n points cos(pi (i + 1/2)/n).
    """
    k = np.arange(len(values))
    turns = np.outer(k, 2 * k + 1) % (4 * len(values))  # whole turns left out: cosines of large angles are less exact
    result = 2.0 / len(values) * np.cos(0.5 * np.pi / len(values) * turns) @ values
    result[0] *= 0.5
    return np.asarray(result)


def points(n: int) -> Array:
    """Return the n Chebyshev points cos(pi (i + 1/2)/n)."""
    return np.asarray(np.cos(np.pi * (np.arange(n) + 0.5) / n))


def resolved(shape: Profile, a: float, b: float, scale: float) -> Array | None:
    """Return the Chebyshev coefficients of a profile on [a, b]; None if POINTS are too few."""
    x = np.clip(0.5 * (a + b) + 0.5 * (b - a) * points(POINTS), a, b)
    series = coefficients(np.asarray(shape(x), dtype=float))
    # The points do not reach the ends, where a kink could hide.
    misses = np.abs(chebyshev.chebval(np.array([-1.0, 1.0]), series) - np.asarray(shape(np.array([a, b])), dtype=float))
    if max(*np.abs(series[-6:]), 1e-3 * misses[0], 0.1 * misses[1]) > MAX_TAIL * scale:
        return None
    needed = np.flatnonzero(np.abs(series) > MAX_ROUNDING * scale)
    return series[: 1 + int(needed.max(initial=0))]


def profile_pieces(rod: WaveBody, shape: Profile, a: float, b: float) -> list[Piece]:
    """Return (start, end, coefficients) of the profile on [a, b] [m].

    Kinks are found by bisection. Raises `CaseError` where the profile jumps, is not finite, or is not smooth in pieces.
    """
    sample = np.asarray(shape(np.linspace(a, b, 257)), dtype=float)
    path = f"bodies.{rod.name}.displacement"
    if sample.shape != (257,) or not np.all(np.isfinite(sample)):
        raise CaseError(
            f"rod '{rod.name}': its displacement is not one finite number at every x",
            path=path,
            remedy="Give a profile that is finite on the whole rod.",
        )
    scale = float(np.max(np.abs(sample)))
    if scale == 0.0:
        return [(a, b, np.zeros(1))]
    pieces: list[Piece] = []
    start = a
    while start < b:
        held = resolved(shape, start, b, scale)
        good, bad = start if held is None else b, b
        while held is None or bad - good > 1e-13 * (b - a):
            middle = 0.5 * (good + bad)
            if middle <= start or middle <= good or middle >= bad:
                break
            trial = resolved(shape, start, middle, scale)
            good, bad, held = (good, middle, held) if trial is None else (middle, bad, trial)
        if held is None or len(pieces) >= MAX_PIECES or good - start < 1e-12 * (b - a):
            raise CaseError(
                f"rod '{rod.name}': its displacement jumps or is not smooth near x = {start:.6g} m",
                path=path,
                remedy="Give a continuous profile made of at most 200 smooth pieces.",
            )
        pieces.append((start, good, held))
        start = good if b - good > 1e-12 * (b - a) else b
    return pieces


def knots(shape: Profile, a: float, b: float) -> list[float]:
    """Return where a table bends between a and b [m].

    Bisection could miss a short piece.
    """
    if not isinstance(shape, Table):
        return []
    x, u = np.array(shape.x), np.array(shape.u)
    slopes = np.diff(u) / np.diff(x)
    bends = x[1:-1][np.diff(slopes) != 0.0]
    return [float(place) for place in bends if a + 1e-12 * (b - a) < place < b - 1e-12 * (b - a)]


def end_pieces(scene: Scene, layout: NetworkLayout) -> dict[int, list[Piece]]:
    """Return the waves emitted before t = 0 by ends of rods.

    They are those of each end of a rod with a profile, without gravity; times in s.
    """
    result: dict[int, list[Piece]] = {}
    for name, links in layout.links.items():
        rod = scene.bodies[name].waves
        if rod is None or rod.displacement is None:
            continue
        check_held(rod, rod.displacement)
        for link in links:
            edges = [link.x, *knots(rod.displacement, link.x, link.x + link.length), link.x + link.length]
            parts = [profile_pieces(rod, rod.displacement, a, b) for a, b in pairwise(edges)]
            pieces = [piece for part in parts for piece in part]
            result[link.left_end] = [emitted(rod, link, piece, +1.0) for piece in reversed(pieces)]
            result[link.right_end] = [emitted(rod, link, piece, -1.0) for piece in pieces]
    return result


def check_held(rod: WaveBody, shape: Profile) -> None:
    """Raise `CaseError` for a profile that would tear the rod from its clamped end."""
    scale = float(np.max(np.abs(shape(np.linspace(0.0, rod.length, 257)))))
    for end, x, name in ((rod.left, 0.0, "left"), (rod.right, rod.length, "right")):
        if end.kind == "clamped" and abs(float(shape(np.array([x]))[0])) > 1e-9 * scale:
            raise CaseError(
                f"rod '{rod.name}': its displacement is not zero at the clamped {name} end",
                path=f"bodies.{rod.name}.displacement",
                remedy="Give a profile that is zero where the rod is clamped.",
            )


def emitted(rod: WaveBody, link: Link, piece: Piece, direction: float) -> Piece:
    """Return the wave v0/2 -+ c u'/2 of a profile piece, earlier by its way from the end."""
    a, b, coefficients = piece
    c = link.segment.wave_speed
    slope = np.zeros(1)
    if len(coefficients) > 1:
        slope = np.asarray(chebyshev.chebder(coefficients), dtype=float) * (2.0 / (b - a))
    wave: Array = -direction * 0.5 * c * slope
    wave[0] += 0.5 * rod.velocity
    if direction > 0.0:  # time runs against x
        wave[1::2] *= -1.0
        return -(b - link.x) / c, -(a - link.x) / c, wave
    end = link.x + link.length
    return -(end - a) / c, -(end - b) / c, wave


def with_first_pieces(scene: Scene, layout: NetworkLayout, log: Log) -> Log:
    """Return the log with pieces for the waves that are inside rods at t = 0."""
    pieces, state, ends = end_pieces(scene, layout), log.state, log.ends
    gravity, tolerance, transit = float(state["gravity"]), float(state["tolerance"]), ends["transit"].tolist()
    speed = [0.0] * len(ends)
    for name, links in layout.links.items():
        for link in links:
            speed[link.left_end] = speed[link.right_end] = scene.bodies[name].velocity
    sums = [float(np.sum(np.abs(wave))) for row in pieces.values() for *_, wave in row]
    tables: list[list[FirstPiece]] = []
    ranges = (log.junctions[name].tolist() for name in ("first_end", "last_end", "nodes", "rows"))
    for first, last, nodes, rows in zip(*ranges, strict=True):
        own = range(first, last)
        breaks = {-max((transit[e] for e in own), default=tolerance), 0.0}
        breaks |= {t for e in own for start, stop, _ in pieces.get(e, ()) for t in (start, stop)}
        times: list[float] = []
        for t in sorted(breaks):
            if not times or t - times[-1] > tolerance:
                times.append(t)
        times[-1] = 0.0
        carried = [0.0] * len(own)
        row: list[FirstPiece] = []
        for t1, t0 in pairwise(reversed(times)):
            waves, integrals = [], []
            for i, e in enumerate(own):
                wave = [0.5 * speed[e], 0.0]
                for a, b, given in pieces.get(e, ()):
                    if a - tolerance <= t0 and t1 <= b + tolerance:
                        wave = moved(given, a, b, t0, t1).tolist()
                wave[0] += 0.25 * gravity * (t0 + t1)
                wave[1] += 0.25 * gravity * (t1 - t0)
                integral, carried[i] = integrated(wave, 0.5 * (t1 - t0), carried[i])
                waves.append(wave)
                integrals.append(integral)
            size = max(map(len, integrals), default=1)
            values = [0.0] * (2 * nodes * size)
            for series in (*waves, *integrals):
                values += [*series, *[0.0] * (size - len(series))]
            values += [0.0] * (rows * size - len(values))
            row.append(FirstPiece(t0, t1, size, values))
        tables.append(row[::-1])
    of_constant = log.nodes["end_force"][ends["node"]] / ends["impedance"]
    of_loads = [
        load.largest(scene.duration) / rod.segment_at(x).impedance
        for name in layout.links
        if (rod := scene.bodies[name].waves) is not None
        for x, load in rod.loads
    ]
    speeds = (*of_loads, *log.nodes["v"].tolist(), *speed, *sums, gravity * 2.0 * max(transit), *of_constant.tolist())
    fastest = max(map(abs, speeds))
    reach = max(fastest * 2.0 * min(transit), 1e-2 * max(map(abs, log.nodes["u"].tolist())))
    state["fastest"], state["farthest"] = fastest, reach
    return filled(log, tables)


def integrated(wave: Sequence[float], half: float, last: float) -> tuple[list[float], float]:
    """Return the integral of a series, and its first value.

    It ends at ``last``; half is half the length in time.
    """
    c = [2.0 * wave[0], *wave[1:], 0.0, 0.0]
    whole = [half * (c[k - 1] - c[k + 1]) / (2.0 * k) for k in range(1, len(wave) + 1)]
    constant = last - sum(whole)
    return [constant, *whole], constant - sum(whole[::2]) + sum(whole[1::2])


def moved(wave: Array, a: float, b: float, t0: float, t1: float) -> Array:
    """Return the series given on [a, b] as one on [t0, t1]."""
    t = 0.5 * (t0 + t1) + 0.5 * (t1 - t0) * points(max(len(wave), 2))
    return coefficients(np.asarray(chebyshev.chebval((2.0 * t - a - b) / (b - a), wave), dtype=float))


def filled(log: Log, tables: list[list[FirstPiece]]) -> Log:
    """Return the log with pieces of each junction, and room for more."""
    used = sum(len(piece.values) for row in tables for piece in row)
    log = with_room(log, max(MIN_ROOM, 2 * max(map(len, tables))), used + MIN_POOL, MIN_ROOM)
    at = 0
    for j, row in enumerate(tables):
        for number, (t0, t1, size, values) in enumerate(row):
            log.pieces[j, number] = t0, t1, size, at
            log.pool[at : at + len(values)] = values
            at += len(values)
    log.junctions["records"] = [*map(len, tables)]
    log.state["pool_used"] = at
    return log
