"""Another step length within a run: constants and influence coefficients, rewritten."""

from __future__ import annotations

from impactlab.integrators.columns import write_columns
from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import PART
from impactlab.simulate.stepping.arrays import StepArrays
from impactlab.simulate.stepping.influence import fill_influence


@PART
def retime(m: StepArrays, dt: float) -> None:
    """Prepare all steppers for another step length and fill the influence coefficients again."""
    if m.clock[0].timed == dt:
        return
    m.clock[0].timed = dt
    for number in range(len(m.bodies)):
        body = m.bodies[number]
        size = body.state_end - body.state_start
        if size == 0:
            continue
        parameters = m.parameters[body.parameter_start : body.parameter_end]
        jump = m.jump[body.jump_start : body.jump_end]
        start, length = body.response_start, body.n_ports * size
        force, impulse = m.responses[start : start + length], m.responses[start + length : start + 2 * length]
        call(body.retime, parameters, dt)
        if jump.size > 0 and body.columns == 0:
            loads = m.jump[body.jump_end : body.loads_end]
            write_columns(body.free, body.derive, parameters, body.load_at, body.n_dof, loads, jump, force, impulse)
    fill_influence(m)
