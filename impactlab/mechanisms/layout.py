"""Where the numbers of a chain stand, compiled: constants of a link, and the work of one link at a time, as views."""

from __future__ import annotations

from typing import NamedTuple

from impactlab.numerics.compiling import PART
from impactlab.types import Array

# Numbers before the links, of a link, and of a reading.
LINKS, COORDINATES, READINGS, GRAVITY_X, GRAVITY_Y, LINKS_AT, READINGS_AT, ROOM_AT, CHAIN = range(9)
NEXT, AXIAL, BENDING, FIRST, ANGLE, ANGLE_AT, LENGTH, END_MASS, TORQUE, SLIDE, SIDE, TURN = range(12)
MASS, MOMENT, INERTIA, LINK = range(12, 16)
KIND, OF_LINK, TO_X, TO_Y, PLACE, READING = range(6)
OWN, FIXED, SLIDING = range(3)  # the angle of a link: a coordinate; that of the end before it; given by the slide
X, Y, X2, Y2, TH, TH1, TH2, ROWS = range(8)  # of a link in the room: its origin, accelerations, angle; then its rows
XI, ACROSS, XI1, ACROSS1, ALONG2, ACROSS2, SPOT = range(7)  # of a place in the frame of its link


class Constants(NamedTuple):
    """Integrals of a link, views of its numbers in the order of `Integrals`."""

    a0: Array
    a1: Array
    aa: Array
    ka: Array
    b0: Array
    b1: Array
    bb: Array
    kb: Array
    ab: Array
    s0: Array
    s1: Array
    sa: Array
    end: Array  # psi and phi at the end
    root: Array  # slopes at the root
    slopes: Array  # at the end
    s_end: Array


class Spot(NamedTuple):
    """A place of a link: six numbers in its frame, and rows along e and across it over the shapes."""

    at: Array  # (6,) xi, deflection, their rates, and their accelerations at constant rates
    along: Array  # (m,)
    across: Array  # (m,)


class Work(NamedTuple):
    """Products of a link at one state: views of the room after its end."""

    y0: Array  # S0 q
    y1: Array  # S1 q
    z: Array  # (na, nb) integral of psi S q
    zd: Array  # the same with q'
    bq: Array  # integral of phi phi.q
    bd: Array
    aq: Array  # integral of psi phi.q
    ad: Array
    ea: Array  # integral of psi psi.a
    ed: Array
    i_e: Array  # (m,) integrals of the rows along e
    i_n: Array  # (m,) and across it
    mt: Array  # (m,) coupling of the angle and the shapes
    hf: Array  # (m,) forces of the shapes
    row_e: Array  # (n,) of the origin, along e
    row_n: Array  # (n,)
    all_e: Array  # (n,)
    all_n: Array  # (n,)


@PART
def constants(P: Array, link: int) -> Constants:
    """Return the integrals of the link that begins at a number."""
    na, nb = int(P[link + AXIAL]), int(P[link + BENDING])
    aa, bb, ab = na * na, nb * nb, na * nb
    a = link + LINK
    b = a + 2 * na + 2 * aa
    c = b + 2 * nb + 2 * bb
    s = c + ab
    t = s + 2 * bb
    e = t + na * bb
    return Constants(
        P[a : a + na], P[a + na : a + 2 * na], P[a + 2 * na : a + 2 * na + aa], P[a + 2 * na + aa : b],
        P[b : b + nb], P[b + nb : b + 2 * nb], P[b + 2 * nb : b + 2 * nb + bb], P[b + 2 * nb + bb : c],
        P[c:s], P[s : s + bb], P[s + bb : t], P[t:e],
        P[e : e + na + nb], P[e + na + nb : e + na + 2 * nb], P[e + na + 2 * nb : e + na + 3 * nb],
        P[e + na + 3 * nb : e + na + 3 * nb + bb],
    )  # fmt: skip


@PART
def spot(P: Array, at: int, m: int) -> Spot:
    """Return a place that is written from a number on."""
    return Spot(P[at : at + SPOT], P[at + SPOT : at + SPOT + m], P[at + SPOT + m : at + SPOT + 2 * m])


@PART
def work_of(P: Array, at: int, na: int, nb: int, n: int) -> Work:
    """Return the work of a link from a number on."""
    m, ab = na + nb, na * nb
    z = at + 2 * nb
    b = z + 2 * ab
    a = b + 2 * nb
    i = a + 4 * na
    r = i + 4 * m
    return Work(
        P[at : at + nb], P[at + nb : z], P[z : z + ab], P[z + ab : b], P[b : b + nb], P[b + nb : a],
        P[a : a + na], P[a + na : a + 2 * na], P[a + 2 * na : a + 3 * na], P[a + 3 * na : i],
        P[i : i + m], P[i + m : i + 2 * m], P[i + 2 * m : i + 3 * m], P[i + 3 * m : r],
        P[r : r + n], P[r + n : r + 2 * n], P[r + 2 * n : r + 3 * n], P[r + 3 * n : r + 4 * n],
    )  # fmt: skip


def room_of(na: int, nb: int, n: int) -> int:
    """Return the numbers that a link takes in the room: its end, then its work."""
    m = na + nb
    return SPOT + 2 * m + max(4 * nb + 2 * na * nb + 4 * na + 4 * m + 4 * n, m + nb * nb)


@PART
def times(matrix: Array, x: Array, out: Array) -> None:
    """Write the product of a flat matrix and a vector."""
    n = x.size
    for i in range(out.size):
        row = matrix[i * n : (i + 1) * n]
        total = 0.0
        for j in range(row.size):
            total += row[j] * x[j]
        out[i] = total


@PART
def dot(a: Array, b: Array) -> float:
    """Return the product of two vectors."""
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total


@PART
def add(out: Array, factor: float, a: Array) -> None:
    """Add a factor times a vector."""
    for i in range(out.size):
        out[i] += factor * a[i]


@PART
def add_outer(mass: Array, a: Array, b: Array) -> None:
    """Add a b^T + b a^T to the mass matrix."""
    n = a.size
    for i in range(n):
        if a[i] != 0.0:
            add(mass[i * n : (i + 1) * n], a[i], b)
        if b[i] != 0.0:
            add(mass[i * n : (i + 1) * n], b[i], a)
