"""Layout of the numbers of a chain, constants and the work of one link, as compiled views."""

from __future__ import annotations

from typing import NamedTuple

from impactlab.numerics.compiling import PART, UNPACK
from impactlab.numerics.windows import window
from impactlab.types import Array

# Numbers before the links, of a link, and of a reading.
LINKS, COORDINATES, READINGS, GRAVITY_X, GRAVITY_Y, LINKS_AT, READINGS_AT, ROOM_AT, CHAIN = range(9)
NEXT, AXIAL, BENDING, FIRST, ANGLE, ANGLE_AT, LENGTH, END_MASS, TORQUE, SLIDE, SIDE, TURN = range(12)
MASS, MOMENT, INERTIA, LINK = range(12, 16)
KIND, OF_LINK, TO_X, TO_Y, PLACE, READING = range(6)
FACE, TURNED, SHORTENED = range(3)  # kinds of readings: the place of a face, the angle of a link, its shortening
OWN, FIXED, SLIDING = range(3)  # the angle of a link: a coordinate; that of the end before it; given by the slide
X, Y, X2, Y2, TH, TH1, TH2, COS, SIN, ROWS = range(10)  # of a link in the room: its origin, its angle; then its rows
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
    s: Array
    end: Array  # psi and phi at the end
    root: Array  # slopes at the root
    slopes: Array  # at the end


class PlaceNumbers(NamedTuple):
    """A place of a link: numbers in its frame, and rows over the shapes.

    The rows are along e and across it.
    """

    at: Array  # (6,) xi, deflection, their rates, and their accelerations at constant rates
    along: Array  # (m,)
    across: Array  # (m,)


class Work(NamedTuple):
    """Products of a link at one state: views of the room after its end."""

    s: Array  # ((3 + na) nb,) S q: at the end, then integrals of S q, x S q and psi S q
    sd: Array  # the same with q'
    stretched: Array  # (nb,) integral of phi psi.a
    stretched1: Array  # the same with a'
    thrown: Array  # (nb,) integral of psi.a S q
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
    all_t: Array  # (n,)


@UNPACK
def constants(P: Array, link: int) -> Constants:
    """Return the integrals of the link that begins at a number."""
    na, nb = int(P[link + AXIAL]), int(P[link + BENDING])
    aa = na * na
    a = link + LINK
    b = a + 2 * na + 2 * aa
    c = b + 4 * nb
    s = c + na * nb
    e = s + (3 + na) * nb * nb
    return Constants(
        window(P, a, na), window(P, a + na, na), window(P, a + 2 * na, aa), window(P, a + 2 * na + aa, aa),
        window(P, b, nb), window(P, b + nb, nb), window(P, b + 2 * nb, nb), window(P, b + 3 * nb, nb),
        window(P, c, na * nb), window(P, s, (3 + na) * nb * nb),
        window(P, e, na + nb), window(P, e + na + nb, nb), window(P, e + na + 2 * nb, nb),
    )  # fmt: skip


@UNPACK
def spot(P: Array, at: int, m: int) -> PlaceNumbers:
    """Return a place that is written from a number on."""
    return PlaceNumbers(window(P, at, SPOT), window(P, at + SPOT, m), window(P, at + SPOT + m, m))


@UNPACK
def work_of(P: Array, at: int, na: int, nb: int, n: int) -> Work:
    """Return the work of a link from a number on."""
    m, rows = na + nb, (3 + na) * nb
    b = at + 2 * rows
    a = b + 3 * nb
    i = a + 4 * na
    r = i + 4 * m
    return Work(
        window(P, at, rows), window(P, at + rows, rows),
        window(P, b, nb), window(P, b + nb, nb), window(P, b + 2 * nb, nb),
        window(P, a, na), window(P, a + na, na), window(P, a + 2 * na, na), window(P, a + 3 * na, na),
        window(P, i, m), window(P, i + m, m), window(P, i + 2 * m, m), window(P, i + 3 * m, m),
        window(P, r, n), window(P, r + n, n), window(P, r + 2 * n, n), window(P, r + 3 * n, n),
        window(P, r + 4 * n, n),
    )  # fmt: skip


@UNPACK
def size_of(n: int) -> int:
    """Return the size of a link's room: origin, angle, rows and end."""
    return ROWS + SPOT + 5 * n


def room_of(na: int, nb: int, n: int) -> int:
    """Return the size of the shared room: the work of one link, or a place."""
    m = na + nb
    return max(2 * (3 + na) * nb + 3 * nb + 4 * na + 4 * m + 5 * n, SPOT + 2 * m)


@PART
def times(matrix: Array, x: Array, out: Array) -> None:
    """Write the product of a flat matrix and a vector."""
    n = x.size
    for i in range(out.size):
        row = window(matrix, i * n, n)
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
def contracted(tensor: Array, stride: int, x: Array, out: Array) -> None:
    """Write the sum of the slices of a tensor times amplitudes.

    Slices are ``stride`` numbers apart, and each is read once. Two slices at a time: sums over long rows fill the
    vector registers, products of short rows do not.
    """
    n, pairs = out.size, x.size // 2
    for i in range(n):
        out[i] = 0.0
    for pair in range(pairs):
        at, one, two = 2 * pair * stride, x[2 * pair], x[2 * pair + 1]
        first, second = window(tensor, at, n), window(tensor, at + stride, n)
        for i in range(n):
            out[i] += first[i] * one + second[i] * two
    if 2 * pairs < x.size:
        add(out, x[2 * pairs], window(tensor, 2 * pairs * stride, n))
