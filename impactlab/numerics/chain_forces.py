"""Forces of a chain of springs at given displacements.

They are computed along the runs of equal rows of its factors. Forces come from differences of displacements, so that a
body far from its start feels no rounding of its travel: no sum is reordered here.
"""

from __future__ import annotations

from impactlab.numerics.compiling import IN_ORDER
from impactlab.numerics.windows import window
from impactlab.types import Array


@IN_ORDER
def write_equal_forces(count: int, spring: float, u: Array, force: Array) -> None:
    """Write the forces on a run of equal nodes [N].

    ``u`` (count + 2,) holds the neighbours as well.
    """
    for i in range(count):
        force[i] = spring * ((u[i] - u[i + 1]) + (u[i + 2] - u[i + 1]))


@IN_ORDER
def write_unequal_forces(count: int, ground: Array, bands: Array, u: Array, force: Array) -> None:
    """Write the forces on nodes that differ [N].

    ``u`` (count + 2,) and ``bands`` (count + 1,) begin one node before.
    """
    for i in range(count):
        here = u[i + 1]
        force[i] = -ground[i] * here - (bands[i] * (u[i] - here) + bands[i + 1] * (u[i + 2] - here))


@IN_ORDER
def write_chain_forces(springs: Array, runs: Array, u: Array, force: Array) -> None:
    """Write the forces of springs on all nodes [N].

    Springs are flat: to the ground, then between neighbours, less than zero. There are at least two nodes; the runs are
    those of `impactlab.numerics.chain_solve.write_runs` with these springs.
    """
    n = u.size
    ground, bands = window(springs, 0, n), window(springs, n, n)
    force[0] = -ground[0] * u[0] - bands[0] * (u[1] - u[0])
    done = 1
    for run in range(int(runs[0])):
        end = done + int(abs(runs[1 + run])) - (1 if run == 0 else 0)
        count = min(end, n - 1) - done
        beside, into = window(u, done - 1, count + 2), window(force, done, count)
        if runs[1 + run] > 0.0:
            write_equal_forces(count, -bands[done], beside, into)
        else:
            write_unequal_forces(count, window(ground, done, count), window(bands, done - 1, count + 1), beside, into)
        done = end
    force[n - 1] = -ground[n - 1] * u[n - 1] - bands[n - 2] * (u[n - 2] - u[n - 1])
