"""What an integrator is, and the stepper it prepares."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from impactlab.models.base import Operators
from impactlab.types import Array, Level

Kernel = Callable[..., None]
"""A function of float arrays that numba can compile; it returns nothing and writes into its arguments."""


@dataclass(frozen=True)
class Stepper:
    """One body's scheme, prepared: linear, so its answer to a force is a column that never changes.

    The state holds displacements, then velocities (n_dof each), then what the scheme keeps for itself.
    """

    free: Kernel  # free(parameters, state): a step without contact, in place
    measure: Kernel  # measure(parameters, state, out): energy [J] as the scheme conserves it, work of the load [J], and
    #                  momentum [N s] beyond that of the model's momentum row (0 as a rule)
    parameters: Array  # (n_parameters,)
    state: Array  # (n_state,) at t = 0
    force_response: Array  # (n_ports, n_state) end-of-step state per force constant over the step
    impulse_response: Array  # (n_ports, n_state) end-of-step state per impulse at the start of the step
    projection_response: Array  # (n_ports, n_state) end-of-step state per projection
    jump: Array  # (n_ports, n_dof) velocities per impulse, at once
    face_rows: Array  # (n_ports, n_dof) rows of the contacts over the displacements, as given to `prepare`
    derive: Kernel | None = (
        None  # derive(parameters, state): rewrite what the scheme derives from displacements and velocities
    )
    retime: Kernel | None = (
        None  # retime(parameters, dt, jump, force_response, impulse_response), flat; only with any_dt
    )


class AbstractScheme(ABC):
    """What a case may name as its integrator: one that steps (`AbstractIntegrator`) or adapts (`AbstractAdaptive`)."""

    citations: ClassVar[tuple[str, ...]] = ()
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)  # options that its contract suite tries, one by one

    @property
    @abstractmethod
    def gains_energy(self) -> float:
        """Declared bound on the energy that a contact may add under this scheme, over the initial energy."""


class AbstractIntegrator(AbstractScheme):
    """A time-stepping scheme. To write one, supply the class facts and two methods.

    1. ``serves``: which compliances it offers. 2. ``order`` on a smooth problem. 3. ``prepare``. 4. ``limit``.
    5. ``gains_energy``, which may depend on its options.
    """

    serves: ClassVar[frozenset[Level]]
    order: ClassVar[int]
    any_dt: ClassVar[bool] = False  # a step may be cut at an event
    load_point: ClassVar[float] = 0.5  # where in the step a force acts: 0 start, 1/2 middle, 1 end
    force_in_accelerations: ClassVar[bool] = False  # the accelerations carried on hold the contact force
    velocity_point: ClassVar[float] = 1.0  # where in the step the velocities at its end belong: 1/2 for leapfrog
    jump_in_force: ClassVar[bool] = False  # F dt already holds a closing jump
    projects_first: ClassVar[bool] = False  # a projection moves the predictor, not the end of the step
    needs_diagonal_mass: ClassVar[bool] = False
    needs_modes: ClassVar[bool] = False  # mass and stiffness must be diagonal
    hard_constraint_gains: ClassVar[bool] = False  # a hard position constraint makes it gain energy

    @abstractmethod
    def limit(self, system: Operators) -> float:
        """Return the largest stable step [s]; inf where every step is stable."""

    @abstractmethod
    def prepare(self, system: Operators, ports: Array, dt: float) -> Stepper:
        """Return the stepper of one body; ``ports`` (n_ports, n_dof) are the rows along which contacts push it.

        A projection p at a port moves the displacements by M^-1 row p at the end of the step, with all that the scheme
        derives from displacements, and leaves the velocities alone.
        """


class Problem(NamedTuple):
    """A first-order system y' = rates(t, y) from an instant on, as an adaptive scheme gets it."""

    rates: Callable[[float, Array], Array]
    jacobian: Callable[[float, Array], Array]  # (n, n), dense
    time: float  # s, where it begins
    until: float  # s, where it ends
    state: Array  # (n,) at the beginning
    scale: Array  # (n,) what is large in this scene, entry by entry: absolute tolerances are shares of it
    longest: float  # s, no step may be longer


class AbstractAdaptive(AbstractScheme):
    """A scheme that chooses its own steps. To write one, supply two methods and ``most_steps``.

    It sees a first-order system (`Problem`) and serves the laws that declare ``smooth``; `impactlab.simulate.adaptive`
    builds the system, cuts it at the events of contacts, and asks for a new solver after each.
    """

    most_steps: int  # after which a run ends as failed

    @abstractmethod
    def solver(self, problem: Problem) -> Any:
        """Return a `scipy.integrate.OdeSolver`: ``step()``, ``status``, ``t``, ``t_old``, ``y``, ``dense_output()``."""
