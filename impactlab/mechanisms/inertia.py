"""Mass and forces of one link, compiled: in its frame from its integrals, then over the coordinates of the chain."""

from __future__ import annotations

import math

from impactlab.mechanisms.layout import (
    ACROSS,
    ACROSS2,
    ALONG2,
    AXIAL,
    END_MASS,
    FIRST,
    GRAVITY_X,
    GRAVITY_Y,
    INERTIA,
    MASS,
    MOMENT,
    ROWS,
    TH,
    TH1,
    TH2,
    TORQUE,
    X2,
    XI,
    Y2,
    Constants,
    Spot,
    Work,
    X,
    Y,
    add,
    add_outer,
    dot,
    times,
)
from impactlab.numerics.compiling import PART
from impactlab.types import Array


@PART
def contracted(tensor: Array, q: Array, out: Array) -> None:
    """Write the sum of the slices of a tensor times amplitudes, two slices at a time: each is read once."""
    n, pairs = out.size, q.size // 2
    for i in range(n):
        out[i] = 0.0
    for pair in range(pairs):
        at, one, two = 2 * pair * n, q[2 * pair], q[2 * pair + 1]
        first, second = tensor[at : at + n], tensor[at + n : at + 2 * n]
        for i in range(first.size):
            out[i] += first[i] * one + second[i] * two
    if 2 * pairs < q.size:
        add(out, q[2 * pairs], tensor[2 * pairs * n : (2 * pairs + 1) * n])


@PART
def contract(k: Constants, w: Work, p: Array, v: Array, na: int) -> None:
    """Write the products of the integrals with the shapes' amplitudes p and rates v, psi's before phi's."""
    a, a1, q, q1 = p[:na], v[:na], p[na:], v[na:]
    times(k.s0, q, w.y0)
    times(k.s1, q, w.y1)
    contracted(k.sa, q, w.z)
    contracted(k.sa, q1, w.zd)
    times(k.bb, q, w.bq)
    times(k.bb, q1, w.bd)
    times(k.ab, q, w.aq)
    times(k.ab, q1, w.ad)
    times(k.aa, a, w.ea)
    times(k.aa, a1, w.ed)


@PART
def stretching(k: Constants, w: Work, p: Array, v: Array, na: int, th1: float, th2: float) -> None:
    """Write the rows of the axial shapes: integrals, coupling with the angle, forces."""
    a, q, q1 = p[:na], p[na:], v[na:]
    nb = q.size
    for i in range(na):
        zq, zdd = dot(w.z[i * nb : (i + 1) * nb], q), dot(w.zd[i * nb : (i + 1) * nb], q1)
        w.i_e[i], w.i_n[i] = k.a0[i], 0.0
        w.mt[i] = -w.aq[i]
        inertia = -zdd - 2.0 * th1 * w.ad[i] - th1 * th1 * (k.a1[i] + w.ea[i] - 0.5 * zq) - th2 * w.aq[i]
        w.hf[i] = inertia + dot(k.ka[i * na : (i + 1) * na], a)


@PART
def bending(k: Constants, w: Work, p: Array, v: Array, na: int, th1: float, th2: float) -> None:
    """Write the rows of the bending shapes.

    Kinetic energy of third order in them is left out, as is the stiffness of the same order.
    """
    a, a1, q = p[:na], v[:na], p[na:]
    nb = q.size
    for i in range(nb):
        stretched, stretched1, thrown = 0.0, 0.0, 0.0
        for j in range(na):
            stretched += a[j] * k.ab[j * nb + i]
            stretched1 += a1[j] * k.ab[j * nb + i]
            thrown += a[j] * w.z[j * nb + i]
        coupling = k.b1[i] + stretched
        w.i_e[na + i], w.i_n[na + i] = -w.y0[i], k.b0[i]
        w.mt[na + i] = coupling
        inertia = 2.0 * th1 * stretched1 + th2 * coupling + th1 * th1 * (w.y1[i] + thrown - w.bq[i])
        w.hf[na + i] = inertia + dot(k.kb[i * nb : (i + 1) * nb], q)


@PART
def spun(k: Constants, w: Work, p: Array, v: Array, na: int) -> tuple[float, float]:
    """Return the integrals of xi^2 beyond that of x^2, and of xi xi'."""
    a, a1, q, q1 = p[:na], v[:na], p[na:], v[na:]
    nb = q.size
    square = 2.0 * dot(k.a1, a) + dot(w.ea, a) - dot(w.y1, q)
    change = dot(k.a1, a1) + dot(w.ed, a) - dot(w.y1, q1)
    for i in range(na):
        row = w.z[i * nb : (i + 1) * nb]
        zq = dot(row, q)
        square -= a[i] * zq
        change -= a[i] * dot(row, q1) + 0.5 * a1[i] * zq
    return square, change


@PART
def add_own_mass(mass: Array, n: int, first: int, k: Constants, w: Work, end: Spot, heavy: float, na: int) -> None:
    """Add the mass of the shapes among themselves, with that of a point of some mass at the end."""
    m, nb = end.along.size, end.along.size - na
    for i in range(m):
        row = mass[(first + i) * n + first : (first + i) * n + first + m]
        if i < na:
            add(row[:na], 1.0, k.aa[i * na : (i + 1) * na])
            add(row[na:], -1.0, w.z[i * nb : (i + 1) * nb])
        else:
            add(row[na:], 1.0, k.bb[(i - na) * nb : (i - na + 1) * nb])
            for j in range(na):
                row[j] -= w.z[j * nb + i - na]
        if heavy != 0.0:
            add(row, heavy * end.along[i], end.along)
            add(row, heavy * end.across[i], end.across)


@PART
def add_link(
    P: Array, link: int, room: int, k: Constants, w: Work, end: Spot, p: Array, v: Array, mass: Array, force: Array
) -> float:
    """Add mass and forces of one link; return the work of its gravity and torque [J]."""
    na, m, first, n = int(P[link + AXIAL]), end.along.size, int(P[link + FIRST]), force.size
    own, own1 = p[first : first + m], v[first : first + m]
    th1, th2, heavy = P[room + TH1], P[room + TH2], P[link + END_MASS]
    contract(k, w, own, own1, na)
    stretching(k, w, own, own1, na, th1, th2)
    bending(k, w, own, own1, na, th1, th2)
    square, change = spun(k, w, own, own1, na)
    a, a1, q, q1 = own[:na], own1[:na], own[na:], own1[na:]
    v0, v01 = dot(k.b0, q), dot(k.b0, q1)
    x1 = P[link + MOMENT] + dot(k.a0, a) - 0.5 * dot(w.y0, q)
    x11 = dot(k.a0, a1) - dot(w.y0, q1)
    vv, vv1, xx = dot(w.bq, q), dot(w.bd, q), P[link + INERTIA] + square
    shorter2 = 0.0  # q'.S0 q'
    for i in range(q.size):
        shorter2 += q1[i] * dot(k.s0[i * q.size : (i + 1) * q.size], q1)
    # forces along e, across it and about the origin, of rates and of the acceleration of the angle
    f_e = -shorter2 - 2.0 * th1 * v01 - th1 * th1 * x1 - th2 * v0
    f_n = 2.0 * th1 * x11 - th1 * th1 * v0 + th2 * x1
    moment = 2.0 * th1 * (vv1 + change) + th2 * (vv + xx)
    # the mass at the end, at its exact place
    xi, d, e2, n2 = end.at[XI], end.at[ACROSS], end.at[ALONG2], end.at[ACROSS2]
    total = P[link + MASS] + heavy
    of_e, of_n, about = -v0 - heavy * d, x1 + heavy * xi, vv + xx + heavy * (xi * xi + d * d)
    f_e, f_n = f_e + heavy * e2, f_n + heavy * n2
    moment += heavy * (xi * n2 - d * e2)
    if heavy != 0.0:
        add(w.i_e, heavy, end.along)
        add(w.i_n, heavy, end.across)
        add(w.mt, heavy * xi, end.across)
        add(w.mt, -heavy * d, end.along)
        add(w.hf, heavy * e2, end.along)
        add(w.hf, heavy * n2, end.across)
    # the acceleration of the origin, gravity taken off
    c, s = math.cos(P[room + TH]), math.sin(P[room + TH])
    a_x, a_y = P[room + X2] - P[GRAVITY_X], P[room + Y2] - P[GRAVITY_Y]
    e0, n0 = c * a_x + s * a_y, c * a_y - s * a_x
    moment += of_e * e0 + of_n * n0
    f_e, f_n = f_e + total * e0, f_n + total * n0
    add(w.hf, e0, w.i_e)
    add(w.hf, n0, w.i_n)
    # over the coordinates of the chain
    rows = room + ROWS
    r_x, r_y, turn = P[rows : rows + n], P[rows + n : rows + 2 * n], P[rows + 2 * n : rows + 3 * n]
    for i in range(n):
        w.row_e[i], w.row_n[i] = c * r_x[i] + s * r_y[i], c * r_y[i] - s * r_x[i]
        w.all_e[i] = 0.5 * total * w.row_e[i] + of_e * turn[i]
        w.all_n[i] = 0.5 * total * w.row_n[i] + of_n * turn[i]
        force[i] -= w.row_e[i] * f_e + w.row_n[i] * f_n + turn[i] * moment
    add(w.all_e[first : first + m], 1.0, w.i_e)
    add(w.all_n[first : first + m], 1.0, w.i_n)
    add(force[first : first + m], -1.0, w.hf)
    add_outer(mass, w.row_e, w.all_e)
    add_outer(mass, w.row_n, w.all_n)
    for i in range(n):
        w.all_e[i] = 0.5 * about * turn[i]
    add(w.all_e[first : first + m], 1.0, w.mt)
    add_outer(mass, turn, w.all_e)
    add_own_mass(mass, n, first, k, w, end, heavy, na)
    g_x, g_y = P[GRAVITY_X], P[GRAVITY_Y]
    fallen = total * (g_x * P[room + X] + g_y * P[room + Y])
    fallen += (c * g_x + s * g_y) * of_n - (c * g_y - s * g_x) * of_e
    return float(fallen) + twist(P[link + TORQUE], k.root, P[room + TH], turn, q, first + na, force)


@PART
def twist(torque: float, slopes: Array, angle: float, turn: Array, q: Array, at: int, force: Array) -> float:
    """Add a torque on a section with some slopes; return torque times the angle of the section."""
    if torque == 0.0:
        return 0.0
    add(force, torque, turn)
    add(force[at : at + q.size], torque, slopes)
    return float(torque * (angle + dot(slopes, q)))
