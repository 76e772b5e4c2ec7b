"""Compiled steps of the implicit schemes, for mass, damping and stiffness of any bandwidth.

Parameters of all of them: a header, whose places are the constants below, then the arrays that `split` returns: load,
stiffness, mass, damping, momentum row, and what the scheme needs: its factors (`impactlab.numerics.banded.factorised`)
and room to work in. Stiffness and damping stand as springs to the ground (the sums of their rows) and bands below the
diagonal, so that forces come from differences of displacements: a body far from its start feels no rounding of its
travel.
"""

from __future__ import annotations

from impactlab.numerics.compiling import HELPER, UNPACK
from impactlab.types import Array

# Places in the header: size, bandwidths of stiffness, damping (-1: undamped), mass and factors, step, then the numbers
# of a scheme (up to six), and four weights for `measure`.
N, STIFF, DAMPED, HEAVY, WIDE, DT = range(6)
AF, AM, BETA, GAMMA = range(6, 10)  # of the generalised-alpha family
THETA = PART = 6
WEIGHTS = 12
LOAD = HEADER = 16


@HELPER
def pull(n: int, bandwidth: int, springs: Array, u: Array, force: Array) -> None:
    """Take the forces of springs (ground, then bands; flat) at displacements u off ``force``."""
    if bandwidth == 1 and n > 1:
        ground, band = springs[:n], springs[n : 2 * n]
        force[0] -= ground[0] * u[0] + band[0] * (u[1] - u[0])
        for i in range(1, n - 1):
            force[i] -= ground[i] * u[i] + band[i] * (u[i + 1] - u[i]) + band[i - 1] * (u[i - 1] - u[i])
        force[n - 1] -= ground[n - 1] * u[n - 1] + band[n - 2] * (u[n - 2] - u[n - 1])
        return
    for i in range(n):
        force[i] -= springs[i] * u[i]
    for offset in range(1, bandwidth + 1):
        band = springs[offset * n : (offset + 1) * n]
        for i in range(n - offset):
            force[i] -= band[i] * (u[i + offset] - u[i])
        for i in range(offset, n):
            force[i] -= band[i - offset] * (u[i - offset] - u[i])


@HELPER
def solve_three(n: int, pivot: Array, lower: Array, x: Array) -> None:
    """Solve a factorised system of three bands in place, as beams have: values are handed on in registers."""
    one, two, three = lower[:n], lower[n : 2 * n], lower[2 * n : 3 * n]
    far, middling = x[0], x[1] - one[0] * x[0]
    near = x[2] - one[1] * middling - two[0] * far
    x[1], x[2] = middling, near
    for i in range(n - 3):
        rest = x[i + 3] - three[i] * far - two[i + 1] * middling - one[i + 2] * near
        far, middling, near = middling, near, rest
        x[i + 3] = rest
    far, middling, near = 0.0, 0.0, 0.0
    for i in range(n - 1, -1, -1):
        rest = x[i] * pivot[i] - three[i] * far - two[i] * middling - one[i] * near
        far, middling, near = middling, near, rest
        x[i] = rest


@HELPER
def solve(n: int, bandwidth: int, pivot: Array, lower: Array, x: Array) -> None:
    """Solve a factorised system in place; ``pivot`` holds 1/D, ``lower`` the bands of the other factor, flat.

    A tridiagonal system is eliminated from both ends to its middle row: two chains that run side by side take half the
    time of one, and each value is handed on in a register.
    """
    if bandwidth == 1 and n > 1:
        middle, last = n // 2, n - 1
        down, up = x[0], x[last]
        for i in range(1, last - middle):
            down = x[i] - lower[i - 1] * down
            up = x[last - i] - lower[last - i] * up
            x[i], x[last - i] = down, up
        if 2 * middle == n and middle > 1:
            x[middle - 1] -= lower[middle - 2] * x[middle - 2]
        down = x[middle] - lower[middle - 1] * x[middle - 1]
        if middle < last:
            down -= lower[middle] * x[middle + 1]
        down *= pivot[middle]
        up = x[middle] = down
        for i in range(1, n - middle):
            above, below = middle - i, middle + i
            down = x[above] * pivot[above] - lower[above] * down
            up = x[below] * pivot[below] - lower[below - 1] * up
            x[above], x[below] = down, up
        if 2 * middle == n:
            x[0] = x[0] * pivot[0] - lower[0] * x[1]
        return
    if bandwidth == 3 and n > 3:
        solve_three(n, pivot, lower, x)
        return
    for i in range(n):
        rest = x[i]
        for offset in range(1, min(bandwidth, i) + 1):
            rest -= lower[(offset - 1) * n + i - offset] * x[i - offset]
        x[i] = rest
    for i in range(n):
        x[i] *= pivot[i]
    for i in range(n - 1, -1, -1):
        rest = x[i]
        for offset in range(1, min(bandwidth, n - 1 - i) + 1):
            rest -= lower[(offset - 1) * n + i] * x[i + offset]
        x[i] = rest


@HELPER
def factorise(n: int, bandwidth: int, pivot: Array, lower: Array) -> None:
    """Replace a diagonal and the bands below it by 1/D and the other factor, as `solve` wants them."""
    if bandwidth == 1 and n > 1:
        middle = n // 2
        for i in range(middle):
            pivot[i] = 1.0 / pivot[i]
            scaled = lower[i] * pivot[i]
            pivot[i + 1] -= lower[i] * scaled
            lower[i] = scaled
        for i in range(n - 1, middle, -1):
            pivot[i] = 1.0 / pivot[i]
            scaled = lower[i - 1] * pivot[i]
            pivot[i - 1] -= lower[i - 1] * scaled
            lower[i - 1] = scaled
        pivot[middle] = 1.0 / pivot[middle]
        return
    for i in range(n):
        for offset in range(min(bandwidth, i), 0, -1):  # column by column of row i
            j = i - offset
            entry = lower[(offset - 1) * n + j]
            for other in range(offset + 1, min(bandwidth, i) + 1):
                k = i - other
                # L_ik D_k stands in row i until the row is done.
                entry -= lower[(other - 1) * n + k] * lower[(other - offset - 1) * n + k]
            lower[(offset - 1) * n + j] = entry
        left = pivot[i]
        for offset in range(1, min(bandwidth, i) + 1):
            at = (offset - 1) * n + i - offset
            scaled = lower[at] * pivot[i - offset]
            left -= lower[at] * scaled
            lower[at] = scaled
        pivot[i] = 1.0 / left


@HELPER
def add_matrix(
    n: int, factor: float, bandwidth: int, matrix: Array, as_springs: bool, diagonal: Array, lower: Array
) -> None:
    """Add a factor times a matrix (flat bands, or springs) to a diagonal and the bands below it."""
    for i in range(n):
        diagonal[i] += factor * matrix[i]
    for offset in range(1, bandwidth + 1):
        band, into = matrix[offset * n : (offset + 1) * n], lower[(offset - 1) * n : offset * n]
        for i in range(n - offset):
            into[i] += factor * band[i]
            if as_springs:
                diagonal[i] -= factor * band[i]
                diagonal[i + offset] -= factor * band[i]


@HELPER
def in_springs(n: int, bandwidth: int, springs: Array, x: Array, y: Array) -> float:
    """Return x K y/2 of springs; with displacements u for both, their energy."""
    energy = 0.0
    for i in range(n):
        energy += 0.5 * springs[i] * x[i] * y[i]
    for offset in range(1, bandwidth + 1):
        band = springs[offset * n : (offset + 1) * n]
        for i in range(n - offset):
            energy -= 0.5 * band[i] * (x[i + offset] - x[i]) * (y[i + offset] - y[i])
    return energy


@HELPER
def in_motion(n: int, bandwidth: int, masses: Array, v: Array) -> float:
    """Return v M v/2."""
    energy = 0.0
    for i in range(n):
        energy += 0.5 * masses[i] * v[i] * v[i]
    for offset in range(1, bandwidth + 1):
        band = masses[offset * n : (offset + 1) * n]
        for i in range(n - offset):
            energy += band[i] * v[i] * v[i + offset]
    return energy


@UNPACK
def sizes(parameters: Array) -> tuple[int, int, int, int, int]:
    """Return n, and the bandwidths of stiffness, damping (-1: undamped), mass and factors."""
    stiff, damped = int(parameters[STIFF]), int(parameters[DAMPED])
    return int(parameters[N]), stiff, damped, int(parameters[HEAVY]), int(parameters[WIDE])


@UNPACK
def split(parameters: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Return load, springs, masses, dashpots, momentum row and the rest of the parameters, all flat."""
    n, stiff, damped, heavy, _ = sizes(parameters)
    arrays = parameters[LOAD:]
    masses = (stiff + 2) * n
    dashpots = masses + (heavy + 1) * n
    momentum = dashpots + (damped + 1) * n
    return (
        arrays[:n],
        arrays[n:masses],
        arrays[masses:dashpots],
        arrays[dashpots:momentum],
        arrays[momentum : momentum + n],
        arrays[momentum + n :],
    )


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write energy [J], work of the load so far, up to a constant [J], and momentum still to come [N s].

    The energy is v M v/2 + u K u/2 + weights[0] a M a/2 + weights[1] y K y/2; the momentum row (weights[2] a +
    weights[3] w): see `impactlab.integrators.alpha`.
    """
    n, stiff, _, heavy, _ = sizes(parameters)
    weights = parameters[WEIGHTS:LOAD]
    load, springs, masses, _, row, _ = split(parameters)
    energy = in_springs(n, stiff, springs, state[:n], state[:n]) + in_motion(n, heavy, masses, state[n : 2 * n])
    if weights[0] != 0.0:
        energy += weights[0] * in_motion(n, heavy, masses, state[2 * n : 3 * n])
    if weights[1] != 0.0:
        y = state[4 * n : 5 * n]
        energy += weights[1] * in_springs(n, stiff, springs, y, y)
    work = 0.0
    for i in range(n):
        work += load[i] * state[i]
    out[0], out[1] = energy, work
    if weights[2] != 0.0 or weights[3] != 0.0:
        a, w = state[2 * n : 3 * n], state[3 * n : 4 * n]
        for i in range(n):
            out[2] += row[i] * (weights[2] * a[i] + weights[3] * w[i])


def alpha_free(parameters: Array, state: Array) -> None:
    """Step of the generalised-alpha family in the accelerations w of the equation of motion and a of the scheme.

    (1 - am) a_new + am a = (1 - af) w_new + af w, M w = load - C v - K u at the same instant, and Newmark's formulas
    with a. The state is u, v, a, and unless am = af = 0 also w and y, where (1 - am) y_new + am y = u_new - u.
    """
    n, stiff, damped, _, wide = sizes(parameters)
    dt, af, am, beta, gamma = parameters[DT], parameters[AF], parameters[AM], parameters[BETA], parameters[GAMMA]
    load, springs, _, dashpots, _, factors = split(parameters)
    pivot, lower = factors[:n], factors[n : (wide + 1) * n]
    u, v, a = state[:n], state[n : 2 * n], state[2 * n : 3 * n]
    old_u, old_v, new_u, new_v = dt * dt * (0.5 - beta), dt * (1.0 - gamma), dt * dt * beta, dt * gamma
    if af == 0.0 and am == 0.0:
        for i in range(n):
            u[i] += dt * v[i] + old_u * a[i]
            v[i] += old_v * a[i]
            a[i] = load[i]
        pull(n, stiff, springs, u, a)
        if damped >= 0:
            pull(n, damped, dashpots, v, a)
        solve(n, wide, pivot, lower, a)
        for i in range(n):
            u[i] += new_u * a[i]
            v[i] += new_v * a[i]
        return
    w, y = state[3 * n : 4 * n], state[4 * n : 5 * n]
    share, of_w, of_a = (1.0 - af) / (1.0 - am), af / (1.0 - am), am / (1.0 - am)
    for i in range(n):
        y[i] = -am * y[i] - u[i]
        kept = of_w * w[i] - of_a * a[i]
        u[i] += dt * v[i] + old_u * a[i] + new_u * kept
        v[i] += old_v * a[i] + new_v * kept
        a[i] = kept
        w[i] = load[i]
    pull(n, stiff, springs, u, w)
    if damped >= 0:
        pull(n, damped, dashpots, v, w)
    solve(n, wide, pivot, lower, w)
    new_u, new_v, of_y = share * new_u, share * new_v, 1.0 / (1.0 - am)
    for i in range(n):
        u[i] += new_u * w[i]
        v[i] += new_v * w[i]
        a[i] += share * w[i]
        y[i] = of_y * (y[i] + u[i])


def alpha_derive(parameters: Array, state: Array) -> None:
    """Rewrite the accelerations a and w, M a = load - C v - K u; the factors of M follow those of the step."""
    n, stiff, damped, heavy, wide = sizes(parameters)
    load, springs, _, dashpots, _, factors = split(parameters)
    mass = factors[(wide + 1) * n :]
    a = state[2 * n : 3 * n]
    for i in range(n):
        a[i] = load[i]
    pull(n, stiff, springs, state[:n], a)
    if damped >= 0:
        pull(n, damped, dashpots, state[n : 2 * n], a)
    solve(n, heavy, mass[:n], mass[n : (heavy + 1) * n], a)
    if state.size > 3 * n:
        for i in range(n):
            state[3 * n + i] = a[i]


def theta_free(parameters: Array, state: Array) -> None:
    """Step of the theta method: M (v_new - v) = dt (load - C v_theta - K u_theta), u_new = u + dt v_theta.

    v_theta = theta v_new + (1 - theta) v and u_theta likewise.
    """
    n, stiff, damped, _, wide = sizes(parameters)
    dt, theta = parameters[DT], parameters[THETA]
    load, springs, _, dashpots, _, factors = split(parameters)
    pivot, lower, gained = factors[:n], factors[n : (wide + 1) * n], factors[(wide + 1) * n : (wide + 2) * n]
    u, v = state[:n], state[n : 2 * n]
    ahead, rest, whole = theta * dt, (1.0 - theta) * dt, theta * dt * dt
    for i in range(n):
        u[i] += ahead * v[i]
        gained[i] = load[i]
    pull(n, stiff, springs, u, gained)
    if damped >= 0:
        pull(n, damped, dashpots, v, gained)
    solve(n, wide, pivot, lower, gained)
    for i in range(n):
        u[i] += rest * v[i] + whole * gained[i]
        v[i] += dt * gained[i]


def theta_retime(parameters: Array, dt: float) -> None:
    """Factorise M + theta dt C + (theta dt)^2 K for another step length."""
    n, stiff, damped, heavy, wide = sizes(parameters)
    theta = parameters[THETA]
    parameters[DT] = dt
    _, springs, masses, dashpots, _, factors = split(parameters)
    pivot, lower = factors[:n], factors[n : (wide + 1) * n]
    factors[: (wide + 1) * n] = 0.0
    add_matrix(n, 1.0, heavy, masses, False, pivot, lower)
    add_matrix(n, theta * theta * dt * dt, stiff, springs, True, pivot, lower)
    if damped >= 0:
        add_matrix(n, theta * dt, damped, dashpots, True, pivot, lower)
    factorise(n, wide, pivot, lower)


def bathe_free(parameters: Array, state: Array) -> None:
    """Step of the composite scheme: the trapezoidal rule over a first part, then the three-point backward formula."""
    n, stiff, damped, _, wide = sizes(parameters)
    dt, part = parameters[DT], parameters[PART]
    load, springs, _, dashpots, _, factors = split(parameters)
    size = (wide + 1) * n
    pivot, lower, next_pivot, next_lower = factors[:n], factors[n:size], factors[size : size + n], factors[size + n :]
    room = factors[2 * size :]
    gained, old_u = room[:n], room[n : 2 * n]
    u, v = state[:n], state[n : 2 * n]
    first = part * dt
    half = 0.5 * first
    for i in range(n):
        old_u[i] = u[i]
        u[i] += half * v[i]
        gained[i] = load[i]
    pull(n, stiff, springs, u, gained)
    if damped >= 0:
        pull(n, damped, dashpots, v, gained)
    solve(n, wide, pivot, lower, gained)
    # v_dot_new = (v_new - v) lag - (v - v_old) lag carry, in the differences from the state at the first part's end.
    lag = (1.0 - part) / (2.0 - part) * dt
    carry = (1.0 - part) ** 2 / (part * (2.0 - part))
    for i in range(n):
        moved = first * v[i] + half * first * gained[i]
        swung = first * gained[i]
        u[i] = old_u[i] + moved + carry * moved
        v[i] += swung + carry * swung
        u[i] += lag * v[i]
        gained[i] = load[i]
    pull(n, stiff, springs, u, gained)
    if damped >= 0:
        pull(n, damped, dashpots, v, gained)
    solve(n, wide, next_pivot, next_lower, gained)
    for i in range(n):
        u[i] += lag * lag * gained[i]
        v[i] += lag * gained[i]
