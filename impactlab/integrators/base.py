"""Base classes of schemes, and their steps for one body, from which steppers are prepared."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from impactlab.errors import PairingError
from impactlab.models.base import Operators
from impactlab.numerics.banded import solve_each
from impactlab.plugins import kind_of
from impactlab.startup.lazy import lazy
from impactlab.stepper import Kernel as Kernel
from impactlab.stepper import Losses as Losses
from impactlab.stepper import Stepper as Stepper
from impactlab.types import Array

if TYPE_CHECKING:
    from impactlab.integrators import columns
    from impactlab.numerics import addresses
else:  # they load numba, which reading a case does not need
    addresses, columns = lazy("impactlab.numerics.addresses"), lazy("impactlab.integrators.columns")


class Step(NamedTuple):
    """A scheme for one body and one step length, as its author writes it.

    The state holds displacements, then velocities (n_dof each), then other state of the scheme. The parameters
    are defined by the kernels that read them; among them, at ``load``, is the constant load of the body: n_dof numbers,
    or a mark before them, 1 where there is a load and else 0, so that a kernel may skip it.
    """

    free: Kernel  # free(parameters, state): a step without contact, in place
    measure: Kernel  # measure(parameters, state, out): energy [J] as the scheme conserves it, work of the load [J], and
    #                  momentum [N s]: all of it with `whole_momentum`, else that beyond the model's momentum row
    parameters: Array  # (n_parameters,)
    load: slice  # of the parameters
    state: Array  # (n_state,) at t = 0; entries that `derive` writes may be zero
    derive: Kernel | None = None  # derive(parameters, state): rewrite the state that follows from the first two
    retime: Kernel | None = None  # retime(parameters, dt): prepare for another step length; with any_dt only
    force: Callable[[Array], Array] | None = None  # state after a step per force, (n_ports, n_state), from velocity per
    #                                  impulse (n_ports, n_dof); None: that of a step from rest with the force as a load
    losses: Losses | None = None  # None: dashpots lose c [length]^2/dt
    whole_momentum: bool = False  # whether `measure` gives all of the momentum; the model's row is not used then


def fault_of_step(step: Step, n_dof: int) -> str:
    """Return a text that names an array too short in a step, or "".

    Compiled code reads state and load without looking at their ends.
    """
    if step.state.size < 2 * n_dof:
        return f"a state of {step.state.size} entries. Allowed: at least {2 * n_dof}, two for each coordinate"
    load, most = step.load, step.parameters.size
    if load.start < 0 or load.stop - load.start < n_dof or load.stop > most:
        text = f"its load at the parameters {load.start} to {load.stop}"
        return f"{text}. Allowed: at least {n_dof} of its {most} parameters, one for each coordinate"
    return ""


def loads_of(load: slice, ports: Array) -> Array:
    """Return the loads of unit forces on each port, then of none, flat.

    This is the layout of `Step`.
    """
    count, n_dof = ports.shape
    loads = np.zeros((count + 1, load.stop - load.start))
    marks = loads.shape[1] - n_dof
    loads[:count, :marks], loads[:count, marks:] = 1.0, ports
    return loads.ravel()


def without_load(step: Step, kernel: Kernel, states: Array) -> Array:
    """Return states after `free` or `derive`, (n_states, n_state), of the body without its load."""
    load, after = step.parameters[step.load].copy(), np.array(states)
    step.parameters[step.load] = 0.0
    addresses.entered(columns.apply_to_each, addresses.kernel_address(kernel, addresses.FREE), step.parameters, after)
    step.parameters[step.load] = load
    return after


def stays(ports: Array) -> Stepper:
    """Return the stepper of a body without coordinates, such as a wall; the loop does not call it."""
    nothing = np.zeros((len(ports), 0))
    return Stepper(_no_step, _no_energy, np.zeros(0), np.zeros(0), nothing, nothing, nothing, nothing, ports)


def _no_step(parameters: Array, state: Array) -> None: ...


def _no_energy(parameters: Array, state: Array, out: Array) -> None: ...


class AbstractScheme(ABC):
    """An integrator of a case: with fixed steps (`AbstractIntegrator`) or adaptive ones (`AbstractAdaptive`)."""

    citations: ClassVar[tuple[str, ...]] = ()
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)  # options that its contract suite tries, one by one

    @property
    @abstractmethod
    def gains_energy(self) -> float:
        """Declared bound on the energy from contacts under this scheme, over the initial energy."""


class AbstractIntegrator(AbstractScheme):
    """A scheme with fixed steps.

    To write one, supply `step`, ``gains_energy`` and the class facts that differ.
    """

    order: ClassVar[int]  # on a smooth problem
    any_dt: ClassVar[bool] = False  # a step may be cut at an event
    load_point: ClassVar[float] = 0.5  # where in the step a force acts: 0 start, 1/2 middle, 1 end
    velocity_point: ClassVar[float] = 1.0  # where in the step the velocities at its end belong: 1/2 for leapfrog
    momentum_point: ClassVar[float | None] = None  # the same of the momentum that is measured; None: velocity_point
    jump_in_force: ClassVar[bool] = False  # F dt includes a closing jump; else hard position constraints gain energy
    projects_first: ClassVar[bool] = False  # a projection moves the predictor, not the end of the step
    kicks_then_drifts: ClassVar[bool] = False  # a free mass steps by v += dt F/m, F at the start, then u += dt v
    needs_diagonal_mass: ClassVar[bool] = False
    needs_modes: ClassVar[bool] = False  # mass and stiffness must be diagonal

    @property
    def momentum_early(self) -> float:
        """Return the time from the measured momentum to the step's end, in steps.

        The impulses of the step's forces belong to the same instant.
        """
        return 1.0 - (self.velocity_point if self.momentum_point is None else self.momentum_point)

    @property
    def force_gain(self) -> float:
        """Share of dt^2 F r M^-1 r F that a force F of a step on the row r may add to the energy."""
        return 0.0

    @property
    def start_gain(self) -> float:
        """Share of dt^2 a M a, with the accelerations a at t = 0, that the scheme may add to the energy."""
        return 0.0

    def limit(self, system: Operators) -> float:
        """Return the largest stable step [s]; inf, as here, where every step is stable."""
        return math.inf

    @abstractmethod
    def step(self, system: Operators, dt: float) -> Step:
        """Return the scheme for one body and a step of dt [s].

        Raise `PairingError` where it does not support the body.
        """

    def prepare(self, system: Operators, ports: Array, dt: float, at_start: Array | None = None) -> Stepper:
        """Return the stepper of one body.

        ``ports`` (n_ports, n_dof) are the rows along which contacts push it.

        A projection p at a port moves the displacements by M^-1 row p at the end of the step, with all that the scheme
        derives from displacements, and leaves the velocities alone. ``at_start`` (n_dof,) are loads over time at t = 0
        [N]: the state of a scheme whose forces act at an instant, not over the step, starts under them.
        """
        if not addresses.in_trial():
            return self._prepared(system, ports, dt, at_start)
        with addresses.interpreted(system.load.size):
            return self._prepared(system, ports, dt, at_start)

    def _prepared(self, system: Operators, ports: Array, dt: float, at_start: Array | None) -> Stepper:
        n_dof = system.load.size
        if n_dof == 0:
            return stays(ports)
        if at_start is None or not np.count_nonzero(at_start) or self.load_point == 0.5:
            step, loaded = self.step(system, dt), np.zeros(0)
        else:
            step = self.step(system._replace(load=system.load + at_start), dt)
            marks = np.full(step.load.stop - step.load.start - n_dof, float(np.any(system.load)))
            loaded = np.concatenate((marks, system.load))
        if fault := fault_of_step(step, n_dof):
            text = f"the `step` of integrator '{kind_of(self)}' returned {fault}"
            remedy = "This is a fault of the integrator, not of the case: fix its `step`."
            raise PairingError(text, remedy=remedy, path="solve.integrator")
        free = addresses.kernel_address(step.free, addresses.FREE)
        derive = addresses.kernel_address(step.derive, addresses.DERIVE)
        state, jump = np.array(step.state), solve_each(system.mass, ports)
        if derive:
            addresses.entered(columns.apply_to_each, derive, step.parameters, state[None, :])
        if loaded.size:
            step.parameters[step.load] = loaded
        shape = len(ports), state.size
        force, impulse = np.zeros(shape if step.force is None else (0, 0)), np.zeros(shape)
        if impulse.size:
            at, loads = step.load.start, loads_of(step.load, ports)
            flat = loads, jump.ravel(), force.ravel(), impulse.ravel()
            addresses.entered(columns.write_columns, free, derive, step.parameters, at, n_dof, *flat)
        force = force if step.force is None else step.force(jump)
        if self.projects_first:  # a velocity p/dt that is given at the start and taken away at the end
            projection = impulse / dt
            projection[:, n_dof : 2 * n_dof] -= jump / dt
        else:
            projection = np.zeros(shape)
            projection[:, :n_dof] = jump
            projection = projection if step.derive is None else without_load(step, step.derive, projection)
        return Stepper(
            free=step.free,
            measure=step.measure,
            parameters=step.parameters,
            state=state,
            force_response=force,
            impulse_response=impulse,
            projection_response=projection,
            jump=jump,
            face_rows=ports,
            derive=step.derive,
            retime=step.retime if self.any_dt else None,
            load=step.load if self.any_dt else None,
            losses=step.losses,
            whole_momentum=step.whole_momentum,
        )


class Problem(NamedTuple):
    """A first-order system y' = rates(t, y) from an instant, for adaptive schemes."""

    rates: Callable[[float, Array], Array]
    jacobian: Callable[[float, Array], Array]  # (n, n), dense
    time: float  # s, where it begins
    until: float  # s, where it ends
    state: Array  # (n,) at the beginning
    scale: Array  # (n,) scales of the entries of the state: absolute tolerances are shares of them
    longest: float  # s, no step may be longer


class AbstractAdaptive(AbstractScheme):
    """A scheme that chooses its own steps. To write one, supply two methods and ``most_steps``.

    It sees a first-order system (`Problem`) and supports the laws that declare ``smooth``.
    `impactlab.simulate.adaptive` builds the system, cuts it at the events of contacts, and calls for a new solver after
    each.
    """

    most_steps: int  # after which a run ends as failed

    def load(self) -> None:
        """Import the code of the solver; called in the set-up, so that solving does not include it."""

    @abstractmethod
    def solver(self, problem: Problem) -> Any:
        """Return a `scipy.integrate.OdeSolver`: ``step()``, ``status``, ``t``, ``t_old``, ``y``, ``dense_output()``."""
