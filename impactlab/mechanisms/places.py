"""Places of a link, in compiled code.

They are found in the frame of the link, over the coordinates of the chain, and on a slide.
"""

from __future__ import annotations

import math

from impactlab.mechanisms.layout import (
    ACROSS,
    ACROSS1,
    ACROSS2,
    ALONG2,
    AXIAL,
    BENDING,
    COS,
    FIRST,
    ROWS,
    SIDE,
    SIN,
    SLIDE,
    TH,
    TH1,
    TH2,
    X2,
    XI,
    XI1,
    Y2,
    PlaceNumbers,
    X,
    Y,
    add,
    dot,
)
from impactlab.numerics.compiling import PART
from impactlab.numerics.windows import window
from impactlab.types import Array


@PART
def write_place(
    P: Array, link: int, shapes: Array, sq: Array, sd: Array, x: float, p: Array, v: Array, room: int, to: PlaceNumbers
) -> None:
    """Write a place at x [m] along a link.

    psi and phi there are ``shapes``, S q is ``sq``. S q' is ``sd``; where it is empty, accelerations are not needed.
    """
    na, nb, first = int(P[link + AXIAL]), int(P[link + BENDING]), int(P[link + FIRST])
    a, a1, q, q1 = window(p, first, na), window(v, first, na), window(p, first + na, nb), window(v, first + na, nb)
    psi, phi = window(shapes, 0, na), window(shapes, na, nb)
    shorter2 = dot(sd, q1)
    xi, xi1 = x + dot(psi, a) - 0.5 * dot(sq, q), dot(psi, a1) - dot(sq, q1)
    d, d1 = dot(phi, q), dot(phi, q1)
    for k in range(na):
        to.along[k], to.across[k] = psi[k], 0.0
    for i in range(nb):
        to.along[na + i], to.across[na + i] = -sq[i], phi[i]
    th1, th2 = P[room + TH1], P[room + TH2]
    to.at[XI], to.at[ACROSS], to.at[XI1], to.at[ACROSS1] = xi, d, xi1, d1
    to.at[ALONG2] = -shorter2 - 2.0 * th1 * d1 - th1 * th1 * xi - th2 * d
    to.at[ACROSS2] = 2.0 * th1 * xi1 - th1 * th1 * d + th2 * xi


@PART
def write_row(P: Array, link: int, room: int, place: PlaceNumbers, to_x: float, to_y: float, out: Array) -> None:
    """Write the row of a place along a direction, over the coordinates of the chain."""
    n, m, first = out.size, place.along.size, int(P[link + FIRST])
    c, s = P[room + COS], P[room + SIN]
    along, across = to_x * c + to_y * s, to_y * c - to_x * s
    turn = across * place.at[XI] - along * place.at[ACROSS]
    rows = room + ROWS
    for i in range(n):
        out[i] = 0.0
    add(out, to_x, window(P, rows, n))
    add(out, to_y, window(P, rows + n, n))
    add(out, turn, window(P, rows + 2 * n, n))
    add(window(out, first, m), along, place.along)
    add(window(out, first, m), across, place.across)


@PART
def slide(P: Array, link: int, room: int, n: int, end: PlaceNumbers, v: Array) -> None:
    """Write the angle of the last link that leaves its end on the slide.

    Its row and its acceleration are written as well. The end is that with no rate and no acceleration of the link; it
    is written again after this.
    """
    m, first = end.along.size, int(P[link + FIRST])
    xi, d, xi1, d1 = end.at[XI], end.at[ACROSS], end.at[XI1], end.at[ACROSS1]
    tilt = math.asin((P[link + SLIDE] - P[room + Y]) / math.sqrt(xi * xi + d * d))  # NaN out of reach
    angle = (tilt if P[link + SIDE] > 0.0 else math.pi - tilt) - math.atan2(d, xi)
    c, s = math.cos(angle), math.sin(angle)
    lever = xi * c - d * s
    rows = room + ROWS
    turn = window(P, rows + 2 * n, n)
    add(turn, -1.0 / lever, window(P, rows + n, n))
    add(window(turn, first, m), -s / lever, end.along)
    add(window(turn, first, m), -c / lever, end.across)
    rate = dot(turn, v)
    along = end.at[ALONG2] - 2.0 * rate * d1 - rate * rate * xi
    across = end.at[ACROSS2] + 2.0 * rate * xi1 - rate * rate * d
    P[room + TH], P[room + TH1], P[room + COS], P[room + SIN] = angle, rate, c, s
    P[room + TH2] = -(P[room + Y2] + along * s + across * c) / lever


@PART
def follow(P: Array, before: int, old: int, room: int, n: int, end: PlaceNumbers) -> None:
    """Give a link its origin: the end of the link before it."""
    c, s = P[old + COS], P[old + SIN]
    P[room + X] = P[old + X] + c * end.at[XI] - s * end.at[ACROSS]
    P[room + Y] = P[old + Y] + s * end.at[XI] + c * end.at[ACROSS]
    P[room + X2] = P[old + X2] + c * end.at[ALONG2] - s * end.at[ACROSS2]
    P[room + Y2] = P[old + Y2] + s * end.at[ALONG2] + c * end.at[ACROSS2]
    rows = room + ROWS
    write_row(P, before, old, end, 1.0, 0.0, window(P, rows, n))
    write_row(P, before, old, end, 0.0, 1.0, window(P, rows + n, n))
