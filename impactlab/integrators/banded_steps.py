"""Compiled steps of the implicit schemes, for mass, damping and stiffness of any bandwidth.

Parameters of all of them: a header, whose places are the constants below, then the arrays that `split` returns: load,
stiffness, mass, damping, momentum row, and data of the scheme: its factors, as `factorise` leaves them, and room to
work in. Stiffness and damping stand as springs to the ground (the sums of their rows) and bands below the
diagonal, so that forces come from differences of displacements: a body far from its start feels no rounding of its
travel.
"""

from __future__ import annotations

from impactlab.integrators.alpha_passes import correct, predict
from impactlab.numerics.banded_kernels import add_matrix, factorise, in_motion, in_springs, pull, solve
from impactlab.numerics.chain_forces import write_chain_forces
from impactlab.numerics.compiling import UNPACK
from impactlab.numerics.subnormals import flush_subnormals, restore_subnormals
from impactlab.numerics.three_bands import MIN_ROWS, write_three_band_forces
from impactlab.numerics.windows import window
from impactlab.types import Array

# Places in the header: size, bandwidths of stiffness, damping (-1: undamped), mass and factors, step, then the numbers
# of a scheme (up to six), four weights for `measure`, and a mark of the load.
N, STIFF, DAMPED, HEAVY, WIDE, DT = range(6)
AF, AM, BETA, GAMMA = range(6, 10)  # of the generalised-alpha family
THETA = PART = 6
WEIGHTS, LOADED = 12, 16
LOAD = HEADER = 17


@UNPACK
def sizes(parameters: Array) -> tuple[int, int, int, int, int]:
    """Return n, and the bandwidths of stiffness, damping (-1: undamped), mass and factors."""
    stiff, damped = int(parameters[STIFF]), int(parameters[DAMPED])
    return int(parameters[N]), stiff, damped, int(parameters[HEAVY]), int(parameters[WIDE])


@UNPACK
def split(parameters: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Return load, springs, masses, dashpots, momentum row and the rest of the parameters, all flat."""
    n, stiff, damped, heavy, _ = sizes(parameters)
    springs = LOAD + n
    masses = springs + (stiff + 1) * n
    dashpots = masses + (heavy + 1) * n
    momentum = dashpots + (damped + 1) * n
    rest = momentum + n
    return (
        window(parameters, LOAD, n),
        window(parameters, springs, masses - springs),
        window(parameters, masses, dashpots - masses),
        window(parameters, dashpots, momentum - dashpots),
        window(parameters, momentum, n),
        window(parameters, rest, parameters.size - rest),
    )


@UNPACK
def free_forces(parameters: Array, factors: Array, u: Array, v: Array, force: Array) -> None:
    """Write load - C v - K u."""
    n, stiff, damped, _, wide = sizes(parameters)
    load, springs, _, dashpots, _, _ = split(parameters)
    loaded = parameters[LOADED] != 0.0
    if stiff == 1 and wide == 1 and n > 1:
        write_chain_forces(springs, window(factors, 2 * n, n), u, force)
    elif stiff == 3 and n >= MIN_ROWS:
        write_three_band_forces(n, springs, u, force)
    else:
        for i in range(n):
            force[i] = 0.0
        pull(n, stiff, springs, u, force)
    if loaded:
        for i in range(n):
            force[i] += load[i]
    if damped >= 0:
        pull(n, damped, dashpots, v, force)


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write energy [J], work of the load [J], and momentum still to come [N s].

    The work is that so far, up to a constant. The energy is v M v/2 + u K u/2 + weights[0] a M a/2 + min(weights[0], 0)
    v C a + weights[1] y K y/2; the momentum row (weights[2] a + weights[3] w): see `impactlab.integrators.alpha`.
    """
    n, stiff, damped, heavy, _ = sizes(parameters)
    weights = window(parameters, WEIGHTS, LOADED - WEIGHTS)
    load, springs, masses, dashpots, row, _ = split(parameters)
    u, v, a = window(state, 0, n), window(state, n, n), window(state, 2 * n, n)
    energy = in_springs(n, stiff, springs, u, u) + in_motion(n, heavy, masses, v)
    if weights[0] != 0.0:
        energy += weights[0] * in_motion(n, heavy, masses, a)
        if weights[0] < 0.0 and damped >= 0:
            energy += 2.0 * weights[0] * in_springs(n, damped, dashpots, v, a)
    if weights[1] != 0.0:
        y = window(state, 4 * n, n)
        energy += weights[1] * in_springs(n, stiff, springs, y, y)
    work = 0.0
    for i in range(n):
        work += load[i] * u[i]
    out[0], out[1] = energy, work
    if weights[2] != 0.0 or weights[3] != 0.0:
        w, momentum = window(state, 3 * n, n), 0.0
        for i in range(n):
            momentum += row[i] * (weights[2] * a[i] + weights[3] * w[i])
        out[2] += momentum


def alpha_free(parameters: Array, state: Array) -> None:
    """Step of the generalised-alpha family in two accelerations, w and a.

    w is that of the equation of motion, a that of the scheme. (1 - am) a_new + am a = (1 - af) w_new + af w, M w = load
    - C v - K u at the same instant, and Newmark's formulas with a. The state is u, v, a, and unless am = af = 0 also w
    and y, where (1 - am) y_new + am y = u_new - u.
    """
    before = flush_subnormals()
    n, _, _, _, wide = sizes(parameters)
    dt, af, am, beta, gamma = parameters[DT], parameters[AF], parameters[AM], parameters[BETA], parameters[GAMMA]
    _, _, _, _, _, factors = split(parameters)
    u, v, a = window(state, 0, n), window(state, n, n), window(state, 2 * n, n)
    old_u, old_v, new_u, new_v = dt * dt * (0.5 - beta), dt * (1.0 - gamma), dt * dt * beta, dt * gamma
    if af == 0.0 and am == 0.0:
        for i in range(n):
            u[i] += dt * v[i] + old_u * a[i]
            v[i] += old_v * a[i]
        free_forces(parameters, factors, u, v, a)
        solve(n, wide, factors, a)
        for i in range(n):
            u[i] += new_u * a[i]
            v[i] += new_v * a[i]
        restore_subnormals(before)
        return
    w, y = window(state, 3 * n, n), window(state, 4 * n, n)
    share, of_w, of_a = (1.0 - af) / (1.0 - am), af / (1.0 - am), am / (1.0 - am)
    predict((of_w, of_a, dt, old_u, new_u, old_v, new_v, -am), u, v, a, w, y)
    free_forces(parameters, factors, u, v, w)
    solve(n, wide, factors, w)
    correct((share * new_u, share * new_v, share, 1.0 / (1.0 - am)), u, v, a, w, y)
    restore_subnormals(before)


def alpha_derive(parameters: Array, state: Array) -> None:
    """Rewrite the accelerations a and w from the equation of motion.

    M a = load - C v - K u. The factors of M follow those of the step.
    """
    n, _, _, heavy, wide = sizes(parameters)
    _, _, _, _, _, factors = split(parameters)
    size = (wide + 2) * n
    a = window(state, 2 * n, n)
    free_forces(parameters, factors, window(state, 0, n), window(state, n, n), a)
    solve(n, heavy, window(factors, size, factors.size - size), a)
    if state.size > 3 * n:
        for i in range(n):
            state[3 * n + i] = a[i]


def theta_free(parameters: Array, state: Array) -> None:
    """Take a step of the theta method.

    M (v_new - v) = dt (load - C v_theta - K u_theta), u_new = u + dt v_theta.

    v_theta = theta v_new + (1 - theta) v and u_theta likewise.
    """
    before = flush_subnormals()
    n, _, _, _, wide = sizes(parameters)
    dt, theta = parameters[DT], parameters[THETA]
    _, _, _, _, _, factors = split(parameters)
    gained = window(factors, (wide + 2) * n, n)
    u, v = window(state, 0, n), window(state, n, n)
    ahead, rest, whole = theta * dt, (1.0 - theta) * dt, theta * dt * dt
    for i in range(n):
        u[i] += ahead * v[i]
    free_forces(parameters, factors, u, v, gained)
    solve(n, wide, factors, gained)
    for i in range(n):
        u[i] += rest * v[i] + whole * gained[i]
        v[i] += dt * gained[i]
    restore_subnormals(before)


def theta_retime(parameters: Array, dt: float) -> None:
    """Factorise M + theta dt C + (theta dt)^2 K for another step length."""
    n, stiff, damped, heavy, wide = sizes(parameters)
    theta = parameters[THETA]
    parameters[DT] = dt
    _, springs, masses, dashpots, _, factors = split(parameters)
    pivot, lower = window(factors, 0, n), window(factors, n, wide * n)
    window(factors, 0, (wide + 1) * n)[:] = 0.0
    add_matrix(n, 1.0, heavy, masses, False, pivot, lower)
    add_matrix(n, theta * theta * dt * dt, stiff, springs, True, pivot, lower)
    if damped >= 0:
        add_matrix(n, theta * dt, damped, dashpots, True, pivot, lower)
    factorise(n, wide, factors, window(springs, 0, 2 * n if stiff == 1 else 0))


def bathe_free(parameters: Array, state: Array) -> None:
    """Step of the composite scheme: trapezoidal rule, then three-point backward formula."""
    before = flush_subnormals()
    n, _, _, _, wide = sizes(parameters)
    dt, part = parameters[DT], parameters[PART]
    _, _, _, _, _, factors = split(parameters)
    size = (wide + 2) * n
    later_factors, room = window(factors, size, size), window(factors, 2 * size, 2 * n)
    gained, old_u = window(room, 0, n), window(room, n, n)
    u, v = window(state, 0, n), window(state, n, n)
    first = part * dt
    half = 0.5 * first
    for i in range(n):
        old_u[i] = u[i]
        u[i] += half * v[i]
    free_forces(parameters, factors, u, v, gained)
    solve(n, wide, factors, gained)
    # v_dot_new = (v_new - v) lag - (v - v_old) lag carry, in the differences from the state at the first part's end.
    lag = (1.0 - part) / (2.0 - part) * dt
    carry = (1.0 - part) ** 2 / (part * (2.0 - part))
    for i in range(n):
        moved = first * v[i] + half * first * gained[i]
        swung = first * gained[i]
        u[i] = old_u[i] + moved + carry * moved
        v[i] += swung + carry * swung
        u[i] += lag * v[i]
    free_forces(parameters, later_factors, u, v, gained)
    solve(n, wide, later_factors, gained)
    for i in range(n):
        u[i] += lag * lag * gained[i]
        v[i] += lag * gained[i]
    restore_subnormals(before)
