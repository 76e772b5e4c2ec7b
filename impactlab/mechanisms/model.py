"""A mechanism in coordinates, with its readings as entries of its state, so that rows are constant."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, final

import numpy as np

from impactlab.errors import CaseError, PairingError
from impactlab.integrators.base import AbstractScheme
from impactlab.integrators.midpoint import Midpoint
from impactlab.mechanisms import steps
from impactlab.mechanisms.base import AbstractMechanism, Motion
from impactlab.mechanisms.equations import MechanismEquations
from impactlab.models.base import AbstractDiscreteModel, Operators
from impactlab.numerics.addresses import (
    COLUMNS,
    DERIVE,
    FREE,
    MEASURE,
    TERMS,
    call,
    entered,
    kernel_address,
    log_compiling,
)
from impactlab.numerics.ahead import Kernel
from impactlab.numerics.compiling import ENTRY
from impactlab.plugins import kind_of
from impactlab.scene.bodies import MechanismBody
from impactlab.stepper import Stepper
from impactlab.types import Array, Quantity

# Of (highest frequency dt)^2, (largest rate dt)^2 and (largest angular acceleration dt^2); the forms are derived in
# docs/mechanisms.md, the factors are four times what 2000 random chains on a stop needed at most.
GAIN, TURN_GAIN, STRIKE_GAIN = 5.0e-3, 20.0, 1.0
MAX_TURNED = 2.0  # of frequency times dt: a step of the midpoint rule changes a rate by twice its size at most
IMPULSE_GAIN, IMPULSE_TURN_GAIN = 1.0e-2, 5.0  # of frequency and rate times dt; measured: 1.1 in a yoke on a hard stop
RIGID = 1.0  # rad/s, a bound for links that do not deform: their rates change slowly
KERNELS = ((steps.derive, DERIVE), (steps.free, FREE), (steps.columns, COLUMNS))
OWN_READINGS: tuple[Quantity, ...] = ("displacement", "velocity", "moment")
INTERNAL: tuple[Quantity, ...] = ("bending_moment", "shear_force")


class LargestTurn(NamedTuple):
    """The fastest turning of a mechanism in a run."""

    rate: float  # rad/s
    acceleration: float  # rad/s2


AT_REST = LargestTurn(0.0, 0.0)


@ENTRY
def prepare_columns(
    derive: int, free: int, columns: int, parameters: Array, state: Array, after: Array, jump: Array, responses: Array
) -> None:
    """Write the readings at t = 0, and the columns of the step from ``state`` to ``after``."""
    call(derive, parameters, state)
    for i in range(state.size):
        after[i] = state[i]
    call(free, parameters, after)
    call(columns, parameters, after, jump, responses)


@final
class MechanismModel(AbstractDiscreteModel):
    """A mechanism in coordinates: its own, then its readings.

    Raises `CaseError` if the mechanism cannot be built, as where the slide of a chain is out of reach.
    """

    def __init__(self, mechanism: MechanismBody, part: AbstractMechanism) -> None:
        self.mechanism, self.part = mechanism, part
        self.packed: Motion = self.part.motion(mechanism.gravity)
        self.count = self.packed.position.size
        self.readings = len(self.part.readings)
        self._size = steps.state_size(self.count, self.readings, len(self.packed.drives))

    def operators(self) -> Operators:
        n_dof = self.count + self.readings
        still = np.zeros(self.readings)
        highest = max(RIGID, self.packed.frequency)
        return Operators(
            mass=np.ones((1, n_dof)),
            damping=np.zeros((1, n_dof)),
            stiffness=np.zeros((1, n_dof)),
            load=np.zeros(n_dof),
            displacement=np.concatenate((self.packed.position, still)),
            velocity=np.concatenate((self.packed.velocity, still)),
            highest_frequency=highest,
            rule_frequency=highest,
            diagonal_mass=False,
            modes=False,
        )

    def row(self, x: float, quantity: Quantity) -> Array:
        """Return the row of a reading, of an internal force at a gauge, or of the moment of a drive.

        x is the number of the reading, of the gauge or of the drive, whose row is over the whole state.
        """
        if quantity in INTERNAL:
            return np.concatenate((self.part.internal_row(int(x), quantity), np.zeros(self.readings)))
        if quantity not in OWN_READINGS:
            raise CaseError(f"a mechanism has no {quantity}", remedy="Name displacement or velocity.", path="probes")
        n_dof = self.count + self.readings
        row = np.zeros(n_dof if quantity != "moment" else self._size)
        row[self.count + int(x) if quantity != "moment" else 2 * n_dof + self.count + int(x)] = 1.0
        return row

    def momentum_row(self) -> Array:
        return np.zeros(self.count + self.readings)

    def grid(self) -> Array:
        return np.arange(float(self.readings))

    def check(self, integrator: AbstractScheme) -> None:
        """Raise `PairingError` where a scheme needs constant matrices."""
        if not isinstance(integrator, Midpoint):
            raise PairingError(
                f"integrator '{kind_of(integrator)}' needs constant matrices, and the mechanism "
                f"'{self.mechanism.name}' has none. Allowed: midpoint, adaptive",
                remedy="Give integrator midpoint, or adaptive where all laws give smooth forces.",
                path="solve.integrator",
            )

    def gains_energy(self, dt: float, impulses: bool, turned: LargestTurn = AT_REST) -> float:
        """Return the bound on the relative energy gain of its steps.

        It is over the reference energy of a motion. It is of second order in dt; where a law gives impulses, terms are
        taken with the rates before them: of first.
        """
        return midpoint_gain(self.packed, dt, impulses, turned)

    def own_equations(self) -> MechanismEquations:
        parameters = numbers_of(self.part, self.packed, np.zeros((0, 0)), 0.0)
        return MechanismEquations(self.mechanism.name, parameters, self.packed.position, self.packed.velocity)

    def stepper(self, ports: Array, dt: float, impulses: bool = True) -> Stepper:
        """Return the step of the midpoint rule; ``ports`` are rows of readings. See `stepper_of`."""
        return stepper_of(self.part, self.packed, ports, dt, impulses)


def numbers_of(part: AbstractMechanism, motion: Motion, ports: Array, dt: float) -> Array:
    """Return the numbers of a mechanism as `steps.middle_of` reads them; ``ports`` as in `stepper_of`."""
    n, r = motion.position.size, len(part.readings)
    drives = np.array(motion.drives, dtype=float).ravel()
    at_drives = steps.HEAD
    at_stiffness = at_drives + drives.size
    at_quarter = at_stiffness + n * n
    at_ports = at_quarter + n
    at_own = at_ports + len(ports)
    own = motion.parameters
    at_room = at_own + own.size
    head = np.zeros(steps.HEAD)
    head[steps.TERMS] = kernel_address(type(part).terms, TERMS)
    head[steps.COORDINATES], head[steps.READINGS], head[steps.DRIVES] = n, r, len(motion.drives)
    head[steps.STEP], head[steps.DRIVES_AT], head[steps.STIFFNESS_AT] = dt, at_drives, at_stiffness
    head[steps.IMPULSES] = 1.0
    head[steps.OWN_AT], head[steps.ROOM_AT], head[steps.PORTS_AT] = at_own, at_room, at_ports
    numbers = np.flatnonzero(ports)  # a port is the row of a reading
    places = np.array([float(np.argmax(row)) - n for row in ports])
    assert numbers.size == len(ports)  # noqa: S101
    room = np.zeros(3 * n * n + 4 * n + r * n + 2 * r + 1)
    return np.concatenate((head, drives, motion.stiffness.ravel(), np.zeros(n), places, own, room))


def kernels_of(part: AbstractMechanism) -> Iterator[Kernel]:
    """Yield the kernels of the steps of a mechanism, slowest to compile first."""
    yield Kernel(type(part).terms, TERMS)
    yield from (Kernel(*each) for each in KERNELS)
    yield Kernel(steps.measure, MEASURE)


def stepper_of(part: AbstractMechanism, motion: Motion, ports: Array, dt: float, impulses: bool = True) -> Stepper:
    """Return the step of the midpoint rule for a mechanism.

    ``ports`` (n_ports, n + r) are rows of readings. Where no law gives ``impulses`` their columns stay as they are at t
    = 0, which saves a factorisation in each step.
    """
    n, r, d = motion.position.size, len(part.readings), len(motion.drives)
    log_compiling(prepare_columns)
    parameters = numbers_of(part, motion, ports, dt)
    size = steps.state_size(n, r, d)
    state = np.zeros(size)
    state[:n], state[n + r : 2 * n + r] = motion.position, motion.velocity
    after = np.zeros_like(state)
    jump, responses = np.zeros(len(ports) * (n + r)), np.zeros(3 * len(ports) * size)
    entered(prepare_columns, *(kernel_address(*each) for each in KERNELS), parameters, state, after, jump, responses)
    begun = slice(2 * (n + r), 2 * (n + r) + n + d)
    state[begun] = after[begun]  # accelerations and moments at t = 0: without them the first step is of first order
    at_quarter, at_room = int(parameters[steps.STIFFNESS_AT]) + n * n, int(parameters[steps.ROOM_AT])
    heavy = parameters[at_room : at_room + n * n : n + 1]  # the diagonal of the mass matrix, at t = 0
    parameters[at_quarter : at_quarter + n] = 0.25 * np.diag(motion.stiffness) / heavy
    parameters[steps.IMPULSES] = float(impulses)
    force, impulse, projection = responses.reshape(3, len(ports), size)
    return Stepper(
        free=steps.free,
        measure=steps.measure,
        parameters=parameters,
        state=state,
        force_response=force,
        impulse_response=impulse,
        projection_response=projection,
        jump=jump.reshape(len(ports), n + r),
        face_rows=ports,
        derive=steps.derive,
        retime=steps.retime,
        columns=steps.columns,
    )


def midpoint_gain(motion: Motion, dt: float, impulses: bool, turned: LargestTurn = AT_REST) -> float:
    """Return the relative energy gain of the midpoint rule: see `gains_energy`."""
    highest, rate = motion.frequency, max(motion.rate, turned.rate)
    bound = GAIN * min(highest * dt, MAX_TURNED) ** 2 + TURN_GAIN * (rate * dt) ** 2
    bound += STRIKE_GAIN * turned.acceleration * dt**2
    return bound + ((IMPULSE_GAIN * max(highest, RIGID) + IMPULSE_TURN_GAIN * rate) * dt if impulses else 0.0)
