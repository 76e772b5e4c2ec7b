"""Samples of energies and momenta at some steps.

The code is compiled once and called by every loop.
"""

from __future__ import annotations

from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import INLINE, PART
from impactlab.numerics.windows import window
from impactlab.simulate.stepping.arrays import SAMPLE_ROWS, SAMPLED, StepArrays
from impactlab.types import Array


@PART
def sum_of_momenta(row: Array, velocity: Array, even: float) -> float:
    """Return the momentum of a body: its row times its velocities [kg m/s].

    If ``even`` is not 0, all entries except the outer two have this value.
    """
    total, last = 0.0, row.size - 1
    if even == 0.0:
        for i in range(row.size):
            total += row[i] * velocity[i]
        return total
    for i in range(1, last):
        total += velocity[i]
    return float(even * total + row[0] * velocity[0] + row[last] * velocity[last])


@PART
def sample_bodies(m: StepArrays, in_beads: float) -> bool:
    """Sample energies and momenta; return False if one is not finite.

    ``in_beads`` is the energy stored between beads [J].
    """
    clock = m.clock[0]
    row, stored, finite = clock.n_samples, in_beads, True
    for each in range(len(m.called)):
        number = m.called[each]
        body = m.bodies[number]
        parameters = window(m.parameters, body.parameter_start, body.parameter_end - body.parameter_start)
        m.scratch[2] = 0.0
        call(body.measure, parameters, window(m.state, body.state_start, body.state_end - body.state_start), m.scratch)
        momentum = m.scratch[2]
        if body.has_row != 0:
            first, n = body.state_start + body.n_dof, body.n_dof
            momentum += sum_of_momenta(window(m.momentum, first, n), window(m.state, first, n), body.even)
        m.sample[row, SAMPLED + 3 * number] = m.scratch[0]
        m.sample[row, SAMPLED + 1 + 3 * number] = m.scratch[1]
        m.sample[row, SAMPLED + 2 + 3 * number] = momentum
        total = m.scratch[0] + momentum
        finite = finite and total - total == 0.0
    for number in range(len(m.loads)):
        m.sample[row, SAMPLED + 1 + 3 * m.loads[number].body] += m.loads[number].work
    for number in range(len(m.contacts)):
        stored += m.replies[number].stored
    m.sample[row, 0], m.sample[row, 1] = clock.time, stored
    m.sample[row, 2], m.sample[row, 3] = clock.lost_contact, clock.lost_ends
    m.sample[row, 4], m.sample[row, 5] = clock.lost_inside, clock.lost_unresolved
    clock.n_samples = row + 1
    return finite


@INLINE
def sample_energies(m: StepArrays, dt: float) -> bool:
    """Sample energies and momenta of all bodies; return False if one is not finite."""
    stored, finite = 0.0, True
    if len(m.bead_rows) > 0:
        call(m.pieces[SAMPLE_ROWS], m, dt)
        stored, finite = m.scratch[0], m.scratch[1] != 0.0
    return sample_bodies(m, stored) and finite
