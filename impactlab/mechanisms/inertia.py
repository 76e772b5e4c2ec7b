"""Mass and forces of one link, in compiled code.

They are found in its frame from its integrals, then over the coordinates of the chain.
"""

from __future__ import annotations

from impactlab.mechanisms.layout import (
    ACROSS,
    ACROSS2,
    ALONG2,
    ANGLE,
    AXIAL,
    COS,
    END_MASS,
    FIRST,
    GRAVITY_X,
    GRAVITY_Y,
    INERTIA,
    MASS,
    MOMENT,
    ROWS,
    SIN,
    SLIDING,
    TH,
    TH1,
    TH2,
    TORQUE,
    X2,
    XI,
    Y2,
    Constants,
    PlaceNumbers,
    Work,
    X,
    Y,
    add,
    contracted,
    dot,
    times,
)
from impactlab.numerics.compiling import PART
from impactlab.numerics.windows import window
from impactlab.types import Array


@PART
def contract(k: Constants, w: Work, p: Array, v: Array, na: int, all_of_it: bool) -> None:
    """Write the products of the integrals with amplitudes p and rates v.

    They are those of the shapes, psi's before phi's. If not ``all_of_it``, S q at the end only.
    """
    a, a1, q, q1 = window(p, 0, na), window(v, 0, na), window(p, na, p.size - na), window(v, na, v.size - na)
    if not all_of_it:
        contracted(k.s, w.s.size, q, window(w.s, 0, q.size))
        return
    contracted(k.s, w.s.size, q, w.s)
    contracted(k.s, w.s.size, q1, w.sd)
    times(k.ab, q, w.aq)
    times(k.ab, q1, w.ad)
    times(k.aa, a, w.ea)
    times(k.aa, a1, w.ed)
    contracted(k.ab, q.size, a, w.stretched)
    contracted(k.ab, q.size, a1, w.stretched1)
    contracted(window(w.s, 3 * q.size, w.s.size - 3 * q.size), q.size, a, w.thrown)


@PART
def stretching(k: Constants, w: Work, p: Array, v: Array, na: int, th1: float, th2: float) -> None:
    """Write the rows of the axial shapes: integrals, coupling with the angle, forces."""
    a, q, q1 = window(p, 0, na), window(p, na, p.size - na), window(v, na, v.size - na)
    nb = q.size
    for i in range(na):
        row = (3 + i) * nb
        zq, zdd = dot(window(w.s, row, nb), q), dot(window(w.sd, row, nb), q1)
        w.i_e[i], w.i_n[i] = k.a0[i], 0.0
        w.mt[i] = -w.aq[i]
        inertia = -zdd - 2.0 * th1 * w.ad[i] - th1 * th1 * (k.a1[i] + w.ea[i] - 0.5 * zq) - th2 * w.aq[i]
        w.hf[i] = inertia + dot(window(k.ka, i * na, na), a)


@PART
def bending(k: Constants, w: Work, p: Array, na: int, th1: float, th2: float) -> None:
    """Write the rows of the bending shapes.

    Kinetic energy of third order in them is left out, as is the stiffness of the same order.
    """
    q = window(p, na, p.size - na)
    nb = q.size
    i_e, i_n, mt, hf, y0, y1 = (
        window(w.i_e, na, w.i_e.size - na),
        window(w.i_n, na, w.i_n.size - na),
        window(w.mt, na, w.mt.size - na),
        window(w.hf, na, w.hf.size - na),
        window(w.s, nb, nb),
        window(w.s, 2 * nb, nb),
    )
    for i in range(nb):
        i_e[i], i_n[i] = -y0[i], k.b0[i]
        mt[i] = k.b1[i] + w.stretched[i]
        inertia = 2.0 * th1 * w.stretched1[i] + th2 * mt[i] + th1 * th1 * (y1[i] + w.thrown[i] - k.bb[i] * q[i])
        hf[i] = inertia + k.kb[i] * q[i]


@PART
def spun(k: Constants, w: Work, p: Array, v: Array, na: int) -> tuple[float, float]:
    """Return the integrals of xi^2 beyond that of x^2, and of xi xi'."""
    a, a1, q, q1 = window(p, 0, na), window(v, 0, na), window(p, na, p.size - na), window(v, na, v.size - na)
    nb = q.size
    y1 = window(w.s, 2 * nb, nb)
    square = 2.0 * dot(k.a1, a) + dot(w.ea, a) - dot(y1, q)
    change = dot(k.a1, a1) + dot(w.ed, a) - dot(y1, q1)
    for i in range(na):
        row = window(w.s, (3 + i) * nb, nb)
        zq = dot(row, q)
        square -= a[i] * zq
        change -= a[i] * dot(row, q1) + 0.5 * a1[i] * zq
    return square, change


@PART
def add_own_mass(
    mass: Array, n: int, first: int, k: Constants, w: Work, end: PlaceNumbers, heavy: float, na: int
) -> None:
    """Add the mass of the shapes among themselves, with a point of mass ``heavy`` [kg]."""
    m, nb = end.along.size, end.along.size - na
    for i in range(m):
        row = window(mass, (first + i) * n + first, m)
        if i < na:
            add(window(row, 0, na), 1.0, window(k.aa, i * na, na))
            add(window(row, na, row.size - na), -1.0, window(w.s, (3 + i) * nb, nb))
        else:
            row[i] += k.bb[i - na]
            for j in range(na):
                row[j] -= w.s[(3 + j) * nb + i - na]
        if heavy != 0.0:
            along, across = heavy * end.along[i], heavy * end.across[i]
            for j in range(m):
                row[j] += along * end.along[j] + across * end.across[j]


@PART
def add_outer(mass: Array, w: Work, turn: Array, led: int, reach: int) -> None:
    """Add a b^T + b a^T to the mass matrix.

    It is that of a link's origin along e and across it, and of its angle.

    The a lie in the first ``led`` coordinates, the b in the first ``reach``.
    """
    n = turn.size
    for i in range(led):
        row, e, across, angle = window(mass, i * n, reach), w.row_e[i], w.row_n[i], turn[i]
        for j in range(reach):
            row[j] += e * w.all_e[j] + across * w.all_n[j] + angle * w.all_t[j]
    for i in range(reach):
        row, e, across, angle = window(mass, i * n, led), w.all_e[i], w.all_n[i], w.all_t[i]
        for j in range(led):
            row[j] += e * w.row_e[j] + across * w.row_n[j] + angle * turn[j]


@PART
def along_link(
    P: Array, link: int, room: int, k: Constants, w: Work, p: Array, v: Array, na: int
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return integrals over a link, and the inertial forces of its rates and of the acceleration of its angle.

    The integrals are those of mass times the place across e, along it, and its square about the origin [kg m, kg m,
    kg m2]; the forces are those along e, across it and about the origin [N, N, N m]. The mass at the end is not in
    them.
    """
    th1, th2 = P[room + TH1], P[room + TH2]
    square, change = spun(k, w, p, v, na)
    a, a1, q, q1 = window(p, 0, na), window(v, 0, na), window(p, na, p.size - na), window(v, na, v.size - na)
    nb = q.size
    v0, v01 = dot(k.b0, q), dot(k.b0, q1)
    x1 = P[link + MOMENT] + dot(k.a0, a) - 0.5 * dot(window(w.s, nb, nb), q)
    x11 = dot(k.a0, a1) - dot(window(w.s, nb, nb), q1)
    vv, vv1, xx = 0.0, 0.0, P[link + INERTIA] + square
    for i in range(nb):
        vv += k.bb[i] * q[i] * q[i]
        vv1 += k.bb[i] * q1[i] * q[i]
    shorter2 = dot(window(w.sd, nb, nb), q1)  # q'.S0 q'
    f_e = -shorter2 - 2.0 * th1 * v01 - th1 * th1 * x1 - th2 * v0
    f_n = 2.0 * th1 * x11 - th1 * th1 * v0 + th2 * x1
    moment = 2.0 * th1 * (vv1 + change) + th2 * (vv + xx)
    return (v0, x1, vv + xx), (f_e, f_n, moment)


@PART
def add_link(
    P: Array,
    link: int,
    room: int,
    k: Constants,
    w: Work,
    end: PlaceNumbers,
    p: Array,
    v: Array,
    mass: Array,
    force: Array,
) -> float:
    """Add mass and forces of one link; return the work of its gravity and torque [J]."""
    na, m, first, n = int(P[link + AXIAL]), end.along.size, int(P[link + FIRST]), force.size
    own, own1, heavy = window(p, first, m), window(v, first, m), P[link + END_MASS]
    stretching(k, w, own, own1, na, P[room + TH1], P[room + TH2])
    bending(k, w, own, na, P[room + TH1], P[room + TH2])
    (across, reach, about), (f_e, f_n, moment) = along_link(P, link, room, k, w, own, own1, na)
    # the mass at the end, at its exact place
    xi, d, e2, n2 = end.at[XI], end.at[ACROSS], end.at[ALONG2], end.at[ACROSS2]
    total = P[link + MASS] + heavy
    of_e, of_n, about = -across - heavy * d, reach + heavy * xi, about + heavy * (xi * xi + d * d)
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
    c, s = P[room + COS], P[room + SIN]
    a_x, a_y = P[room + X2] - P[GRAVITY_X], P[room + Y2] - P[GRAVITY_Y]
    e0, n0 = c * a_x + s * a_y, c * a_y - s * a_x
    moment += of_e * e0 + of_n * n0
    f_e, f_n = f_e + total * e0, f_n + total * n0
    add(w.hf, e0, w.i_e)
    add(w.hf, n0, w.i_n)
    # over the coordinates of the chain
    rows = room + ROWS
    r_x, r_y, turn = window(P, rows, n), window(P, rows + n, n), window(P, rows + 2 * n, n)
    for i in range(n):
        w.row_e[i], w.row_n[i] = c * r_x[i] + s * r_y[i], c * r_y[i] - s * r_x[i]
        w.all_e[i] = 0.5 * total * w.row_e[i] + of_e * turn[i]
        w.all_n[i] = 0.5 * total * w.row_n[i] + of_n * turn[i]
        w.all_t[i] = 0.5 * about * turn[i]
        force[i] -= w.row_e[i] * f_e + w.row_n[i] * f_n + turn[i] * moment
    add(window(w.all_e, first, m), 1.0, w.i_e)
    add(window(w.all_n, first, m), 1.0, w.i_n)
    add(window(force, first, m), -1.0, w.hf)
    add(window(w.all_t, first, m), 1.0, w.mt)
    led = first + m if P[link + ANGLE] == SLIDING else first  # the angle of a link on a slide depends on its shapes
    add_outer(mass, w, turn, led, first + m)
    add_own_mass(mass, n, first, k, w, end, heavy, na)
    g_x, g_y = P[GRAVITY_X], P[GRAVITY_Y]
    fallen = total * (g_x * P[room + X] + g_y * P[room + Y])
    fallen += (c * g_x + s * g_y) * of_n - (c * g_y - s * g_x) * of_e
    bent = window(own, na, m - na)
    return float(fallen) + twist(P[link + TORQUE], k.root, P[room + TH], turn, bent, first + na, force)


@PART
def twist(torque: float, slopes: Array, angle: float, turn: Array, q: Array, at: int, force: Array) -> float:
    """Add a torque on a section of given slopes; return torque times its angle [J]."""
    if torque == 0.0:
        return 0.0
    add(force, torque, turn)
    add(window(force, at, q.size), torque, slopes)
    return float(torque * (angle + dot(slopes, q)))
