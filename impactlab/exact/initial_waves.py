"""The waves inside the rods at t = 0, written as what their ends would have emitted before."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.polynomial import chebyshev

from impactlab.errors import CaseError
from impactlab.exact.network import Layout, Link, Log, log_of
from impactlab.scene.bodies import Profile, Table, WaveBody
from impactlab.scene.problem import Scene
from impactlab.types import Array

POINTS = 48  # Chebyshev points on a piece of a profile
TAIL = 1.0e-13  # of the largest displacement: a profile piece is resolved
ROUNDING = 5.0e-16  # of the largest displacement: coefficients below are those of the rounding of a formula
MOST_PIECES = 200
ROOM_FIRST = 64  # records per junction, events: doubled when full
POOL_FIRST = 60_000


def resolved(shape: Profile, a: float, b: float, scale: float) -> Array | None:
    """Return the Chebyshev coefficients of a profile on [a, b], or None where POINTS of them do not hold it."""
    y = np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
    x = np.clip(0.5 * (a + b) + 0.5 * (b - a) * y, a, b)
    values = np.asarray(shape(x), dtype=float)
    k = np.arange(POINTS)
    turns = np.outer(k, 2 * k + 1) % (4 * POINTS)  # whole turns left out: the cosine of a large angle is less exact
    coefficients = 2.0 / POINTS * np.cos(0.5 * np.pi / POINTS * turns) @ values
    coefficients[0] *= 0.5
    if np.max(np.abs(coefficients[-6:])) > TAIL * scale:
        return None
    # the points do not reach the ends, where a kink could hide
    edges = np.asarray(shape(np.array([a, b])), dtype=float)
    misses = np.abs(chebyshev.chebval(np.array([-1.0, 1.0]), coefficients) - edges)
    if misses[0] > 1e3 * TAIL * scale or misses[1] > 10.0 * TAIL * scale:
        return None
    n = POINTS
    while n > 1 and abs(coefficients[n - 1]) <= ROUNDING * scale:
        n -= 1
    return np.asarray(coefficients[:n])


def profile_pieces(rod: WaveBody, shape: Profile, a: float, b: float) -> list[tuple[float, float, Array]]:
    """Return (start, end, coefficients) of the profile on [a, b] [m]; kinks are found by bisection.

    Raises `CaseError` where the profile jumps, is not finite, or is not smooth in pieces.
    """
    sample = np.asarray(shape(np.linspace(a, b, 257)), dtype=float)
    path = f"bodies.{rod.name}.displacement"
    if sample.shape != (257,) or not np.all(np.isfinite(sample)):
        raise CaseError(
            f"rod '{rod.name}': its displacement is not one finite number at every x",
            path=path,
            remedy="Mend the profile.",
        )
    scale = float(np.max(np.abs(sample)))
    if scale == 0.0:
        return [(a, b, np.zeros(1))]
    pieces: list[tuple[float, float, Array]] = []
    start = a
    while start < b:
        good, bad = start, b
        held = resolved(shape, start, b, scale)
        if held is not None:
            good = b
        while held is None or (good < b and bad - good > 1e-13 * (b - a)):
            middle = 0.5 * (good + bad)
            if middle <= start or middle <= good or middle >= bad:
                break
            trial = resolved(shape, start, middle, scale)
            if trial is None:
                bad = middle
            else:
                good, held = middle, trial
        if held is None or len(pieces) >= MOST_PIECES or good - start < 1e-12 * (b - a):
            raise CaseError(
                f"rod '{rod.name}': its displacement jumps or is not smooth near x = {start:.6g} m",
                path=path,
                remedy="Give a continuous profile made of at most 200 smooth pieces.",
            )
        pieces.append((start, good, held))
        start = good if b - good > 1e-12 * (b - a) else b
    return pieces


def knots(shape: Profile, a: float, b: float) -> list[float]:
    """Return where a table bends between a and b [m]: no search could miss what lies between two of its places."""
    if not isinstance(shape, Table):
        return []
    x, u = np.array(shape.x), np.array(shape.u)
    slopes = np.diff(u) / np.diff(x)
    bends = x[1:-1][np.diff(slopes) != 0.0]
    return [float(place) for place in bends if a + 1e-12 * (b - a) < place < b - 1e-12 * (b - a)]


Piece = tuple[float, float, Array]  # from, to [s], both at most 0, coefficients of the emitted wave


def end_pieces(scene: Scene, layout: Layout) -> dict[int, list[Piece]]:
    """Return what every end with a profile would have emitted before t = 0, without gravity, in order of time."""
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
    """Refuse a profile that moves a clamped end: the rod would be torn there at t = 0."""
    scale = float(np.max(np.abs(shape(np.linspace(0.0, rod.length, 257)))))
    for end, x, name in ((rod.left, 0.0, "left"), (rod.right, rod.length, "right")):
        if end.kind == "clamped" and abs(float(shape(np.array([x]))[0])) > 1e-9 * scale:
            raise CaseError(
                f"rod '{rod.name}': its displacement is not zero at the clamped {name} end",
                path=f"bodies.{rod.name}.displacement",
                remedy="Give a profile that is zero where the rod is clamped.",
            )


def emitted(rod: WaveBody, link: Link, piece: Piece, direction: float) -> Piece:
    """Return the emission that carries a profile piece: v0/2 -+ c u'/2, dated back by the way from the end."""
    a, b, coefficients = piece
    c = link.wave_speed
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


def first_records(scene: Scene, layout: Layout, pieces: dict[int, list[Piece]], u: Array, v: Array) -> Log:
    """Return the log at t = 0, with the records that stand for the waves already inside the rods."""
    net = layout.network
    g = net.gravity
    total = len(net.node_of) - 1
    speed = [0.0] * len(net.transit)
    node_of, end_of, contact_of = net.node_of.tolist(), net.end_of.tolist(), net.contact_of.tolist()
    transit = net.transit.tolist()
    for name, links in layout.links.items():
        rod = scene.bodies[name]
        for link in links:
            speed[link.left_end] = speed[link.right_end] = rod.velocity
    fastest = max(map(abs, [*v.tolist(), *speed]))
    records: list[list[tuple[float, float, Array]]] = []
    for j in range(total):
        ends = range(end_of[j], end_of[j + 1])
        nodes = node_of[j + 1] - node_of[j]
        height = 2 * nodes + 2 * len(ends) + contact_of[j + 1] - contact_of[j]
        longest = max((transit[e] for e in ends), default=net.tolerance)
        breaks = {-longest, 0.0}
        for e in ends:
            for a, b, wave in pieces.get(e, []):
                breaks |= {a, b}
                fastest = max(fastest, float(np.sum(np.abs(wave))))
        times: list[float] = []
        for t in sorted(breaks):
            if not times or t - times[-1] > net.tolerance:
                times.append(t)
        times[-1] = 0.0
        carried = [0.0] * len(ends)
        row: list[tuple[float, float, Array]] = []
        for t0, t1 in zip(times[-2::-1], times[:0:-1], strict=True):
            waves = []
            for i, e in enumerate(ends):
                wave = np.array([0.5 * speed[e], 0.0])
                for a, b, given in pieces.get(e, []):
                    if a - net.tolerance <= t0 and t1 <= b + net.tolerance:
                        wave = moved(given, a, b, t0, t1)
                wave[0] += 0.25 * g * (t0 + t1)
                wave[1] += 0.25 * g * (t1 - t0)
                integral, carried[i] = integrated(wave, 0.5 * (t1 - t0), carried[i])
                waves.append((wave, integral))
            n = max((len(integral) for _, integral in waves), default=1)
            table = np.zeros((height, n))
            for i, (wave, integral) in enumerate(waves):
                table[2 * nodes + i, : len(wave)] = wave
                table[2 * nodes + len(ends) + i, : len(integral)] = integral
            row.append((t0, t1, table))
        records.append(row[::-1])
    fastest = max(fastest, abs(g) * 2.0 * max(transit), float(np.max(np.abs(net.push[net.end_node]) / net.impedance)))
    return filled(layout, records, u, v, fastest)


def integrated(wave: Array, half: float, last: float) -> tuple[Array, float]:
    """Return the integral of a series that ends at ``last``, and its first value; half is half the length in time."""
    c = [2.0 * float(wave[0]), *wave[1:].tolist(), 0.0, 0.0]
    whole = [half * (c[k - 1] - c[k + 1]) / (2.0 * k) for k in range(1, len(wave) + 1)]
    constant = last - sum(whole)
    return np.array([constant, *whole]), constant - sum(whole[::2]) + sum(whole[1::2])


def moved(wave: Array, a: float, b: float, t0: float, t1: float) -> Array:
    """Return the series given on [a, b] as one on [t0, t1]."""
    n = max(len(wave), 2)
    y = np.cos(np.pi * (np.arange(n) + 0.5) / n)
    t = 0.5 * (t0 + t1) + 0.5 * (t1 - t0) * y
    values = chebyshev.chebval((2.0 * t - a - b) / (b - a), wave)
    k = np.arange(n)
    result = np.asarray(2.0 / n * np.cos(np.outer(k, np.pi * (k + 0.5) / n)) @ values)
    result[0] *= 0.5
    return result


def filled(layout: Layout, records: list[list[tuple[float, float, Array]]], u: Array, v: Array, fastest: float) -> Log:
    """Return a log that holds the given records."""
    net = layout.network
    room = max(ROOM_FIRST, 2 * max(len(row) for row in records))
    used = sum(table.size for row in records for _, _, table in row)
    log = log_of(net, u, v, room, used + POOL_FIRST, ROOM_FIRST)
    reach = max(fastest * 2.0 * min(net.transit.tolist()), 1e-2 * max(map(abs, u.tolist())))
    log.scale[:] = fastest, reach
    at = 0
    for j, row in enumerate(records):
        for r, (t0, t1, table) in enumerate(row):
            log.start[j, r], log.stop[j, r] = t0, t1
            log.size[j, r], log.offset[j, r] = table.shape[1], at
            log.pool[at : at + table.size] = table.ravel()
            at += table.size
        log.records[j] = len(row)
    log.tally[0] = at
    return log
