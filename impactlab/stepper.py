"""A step prepared for one body: the record in which schemes, bodies that step by themselves and the step loop meet."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from impactlab.types import Array

Kernel = Callable[..., None]
"""A function of float arrays that numba can compile; it returns nothing and writes into its arguments."""


class Losses(NamedTuple):
    """Weights of the loss of a dashpot in a step.

    The state of the scheme is u, v, a. The loss is c ((1 - gamma) v + gamma v_new + lag [z]) [u] - kappa c [v a], with
    u, v and a of a dashpot's length, [x] the step's change of x, (1 - am) z_new + am z = [v] and z = 0 at first; v is
    that after an impulse at the start of the step. kappa v C a is then a part of the energy that the scheme measures
    (`impactlab.integrators.alpha`).
    """

    gamma: float
    kappa: float = 0.0  # s2
    lag: float = 0.0
    am: float = 0.0


class Stepper(NamedTuple):
    """A prepared step with its response columns.

    The columns of a linear body are the same in every step. A body whose columns change with its state, such as a
    mechanism, gives ``columns``: the loop calls it after `free`, and `derive` after the correction.
    """

    free: Kernel  # these as in `impactlab.integrators.base.Step`
    measure: Kernel
    parameters: Array
    state: Array
    force_response: Array  # (n_ports, n_state) end-of-step state per force constant over the step
    impulse_response: Array  # (n_ports, n_state) end-of-step state per impulse at the start of the step
    projection_response: Array  # (n_ports, n_state) end-of-step state per projection
    jump: Array  # (n_ports, n_dof) velocities per impulse, at once
    face_rows: Array  # (n_ports, n_dof) rows of the contacts over the displacements, as given to `prepare`
    derive: Kernel | None = None
    retime: Kernel | None = None
    load: slice | None = None  # set where the columns of a linear body are derived again for a step that is cut
    columns: Kernel | None = None  # columns(parameters, state, jump, responses): rewrite them, flat
    losses: Losses | None = None
    whole_momentum: bool = False
