"""The step of the generalised-alpha family, which its schemes share.

With am, af, gamma = 1/2 + af - am, beta = (1 + af - am)^2/4 the scheme never gains energy in free undamped motion: with
b = (af - am)^2/4, f = 1/2 - af, m = 1/2 - am, and y from (1 - am) y_new + am y = u_new - u, y = 0 at first, the energy

    v M v/2 + u K u/2 + b dt^2 a M a/2 + f (m - f) y K y/2

changes in a step by -(m - f) (b dt^2 [a] M [a] + f m [y] K [y]), where [x] is the step's change of x. (Multiply the
changes of v and u by their means; M (a - w) = (m - f) K y turns the rest into differences.) With damping,
M (a - w) = (m - f) (K y + C z), where z follows from v as y does from u, and the dashpots take
[u] C ((v + v_new)/2 + f (m - f) [z]). It may fall below zero in a step that is long beside the decay of a mode, whose
velocity the scheme then overshoots. In a damped body a contact force F beside the accelerations shifts them at once, by
-M^-1 C M^-1 F dt: that adds to the term with a M a, and the bodies or their dampers gain it in the next steps. It
matters where modes decay within a step.

A force F on the row r beside the accelerations adds F r [u] - b dt^2 F r [a]: beside its work, at most what completes
the square of (m - f) b dt^2 [a] M [a], which is (m - f) dt^2 F r M^-1 r F/16 as b = (m - f)^2/4. With dashpots both
hold, too. So over a run the bodies gain no more than the sum of this over all steps, and b dt^2 a M a/2 at t = 0: the
scheme keeps this energy in a and returns it as forces end. A constant load is part of w, and adds to a at t = 0 alone.

With the contact in the accelerations the momentum that a force has still to give is M (dt (1 - am - gamma) a +
dt af w): together with M v it changes in a step by dt M w, for a w that holds the force.
"""

from __future__ import annotations

import numpy as np

from impactlab.integrators.banded_steps import LOAD, LOADED, alpha_derive, alpha_free, measure
from impactlab.integrators.base import Step, without_load
from impactlab.integrators.flat_matrices import chain_springs, combined, factors, packed
from impactlab.models.base import Operators
from impactlab.numerics.banded import trimmed
from impactlab.stepper import Losses
from impactlab.types import Array


def alpha_step(
    system: Operators,
    dt: float,
    filters: tuple[float, float],
    newmark: tuple[float, float],
    in_accelerations: bool = False,
) -> Step:
    """Return the step of a scheme with weights (af, am) and (beta, gamma).

    Without ``in_accelerations`` the force of a step acts beside the accelerations, constant over the step: it adds its
    exact impulse and the displacement F dt^2/2. With it, the force is that of the equation of motion at the step's end.
    An impulse or a projection shifts a and w by its change of the equation of motion at once.
    """
    (af, am), (beta, gamma) = filters, newmark
    filtered = af != 0.0 or am != 0.0
    of_y = (0.5 - af) * (af - am) if filtered else 0.0
    still_to_come = (dt * (1.0 - am - gamma), dt * af) if in_accelerations else (0.0, 0.0)
    share, n_dof = (1.0 - af) / (1.0 - am), system.load.size
    matrix = combined(system, gamma * share * dt, beta * share * dt**2)
    arrays = factors(matrix, chain_springs(system)), factors(trimmed(system.mass))
    weights = ((beta - 0.5 * gamma) * dt**2, of_y, *still_to_come)
    step = Step(
        free=alpha_free,
        measure=measure,
        parameters=packed(system, dt, (af, am, beta, gamma), *arrays, weights=weights),
        load=slice(LOADED, LOAD + system.load.size),
        state=np.concatenate((system.displacement, system.velocity, np.zeros((3 if filtered else 1) * n_dof))),
        derive=alpha_derive,
        losses=Losses(0.5, lag=of_y, am=am) if of_y else newmark_losses(dt, newmark),
    )

    def beside(jump: Array) -> Array:
        columns = mid_step(step, dt, jump)
        if filtered:  # y counts from where the face stood, not from where the path of the impulse began
            columns[:, 4 * n_dof :] -= 0.5 * dt**2 / (1.0 - am) * jump
        return columns

    return step if in_accelerations else step._replace(force=beside)


def force_gain(af: float, am: float) -> float:
    """Return the share of dt^2 F r M^-1 r F that a force beside the accelerations may add to the energy in a step."""
    return (af - am) / 16.0


def start_gain(af: float, am: float) -> float:
    """Return the share of dt^2 a M a, with the accelerations at t = 0, that the scheme may return as energy."""
    return (af - am) ** 2 / 8.0


def newmark_losses(dt: float, newmark: tuple[float, float]) -> Losses | None:
    """Return the losses of dashpots in Newmark's scheme, None for average acceleration.

    ``newmark`` are the weights (beta, gamma). With kappa = (beta - gamma/2) dt^2 a step moves by [u] = dt (v + v_new)/2
    + kappa [a]. Free motion then changes v M v/2 + u K u/2 + kappa a M a/2 by -((1 - gamma) v + gamma v_new) C [u],
    less (gamma - 1/2) ([u] K [u] + kappa [a] M [a]). For kappa < 0 this sum may fall below zero near the limit. With
    kappa v C a beside it, it is an energy of a damped body: for gamma = 1/2 it is positive up to the limit, and always
    falls. Where kappa > 0 the loss of a step may be negative, as strong damping may then feed the energy of the scheme
    for a while.
    """
    beta, gamma = newmark
    if newmark == (0.25, 0.5):
        return None
    return Losses(gamma, min((beta - 0.5 * gamma) * dt**2, 0.0))


def mid_step(step: Step, dt: float, jump: Array) -> Array:
    """Return the columns of forces beside the accelerations, as impulses at mid-step.

    The displacement by such an impulse lies, traced back to the start of the step, half a step behind.
    """
    n_dof = jump.shape[1]
    begun = np.zeros((len(jump), step.state.size))
    begun[:, :n_dof], begun[:, n_dof : 2 * n_dof] = -0.5 * dt**2 * jump, dt * jump
    return without_load(step, step.free, begun)
