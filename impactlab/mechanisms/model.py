"""A mechanism in coordinates: readings are entries of its state, so that rows of contacts and probes are constant."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import final

import numpy as np

from impactlab.errors import CaseError, PairingError
from impactlab.integrators.base import AbstractScheme, Stepper
from impactlab.integrators.midpoint import Midpoint
from impactlab.mechanisms import steps, terms
from impactlab.mechanisms.packing import Packed, packed
from impactlab.mechanisms.shapes import FlexibleLink, flexible_link
from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Operators
from impactlab.models.modal import Modal
from impactlab.numerics.addresses import COLUMNS, DERIVE, FREE, TERMS, call, entered, kernel_address
from impactlab.numerics.compiling import ENTRY
from impactlab.plugins import kind_of
from impactlab.scene.bodies import Link, Mechanism
from impactlab.types import Array, Quantity

GAIN, TURN_GAIN, IMPULSE_GAIN = 1.0e-4, 20.0, 1.0e-2  # of the highest frequency, rate and frequency times dt;
# measured: 1e-6 to 1e-5 in arms and cranks, 2 in swinging bars
RIGID = 1.0  # rad/s, a bound for links that do not deform: their rates change slowly
KERNELS = ((steps.derive, DERIVE), (steps.free, FREE), (steps.columns, COLUMNS))
OWN_READINGS: tuple[Quantity, ...] = ("displacement", "velocity", "moment")


@ENTRY
def prepare_columns(
    derive: int, free: int, columns: int, parameters: Array, state: Array, after: Array, jump: Array, responses: Array
) -> None:
    """Write the readings at t = 0 into the state, and the columns of a step from there to ``after``."""
    call(derive, parameters, state)
    for i in range(state.size):
        after[i] = state[i]
    call(free, parameters, after)
    call(columns, parameters, after, jump, responses)


@final
class MechanismModel(AbstractDiscreteModel):
    """A mechanism with its links in shapes. Its coordinates are those of the chain, then its readings.

    Readings are the marks of the mechanism in their order, then the angle of each link.

    Parameters
    ----------
    mechanism : Mechanism
    models : mapping
        Descriptions of flexible links by name: modal with elements.

    Raises
    ------
    CaseError
        If the description of a link is not modal, or the slide is out of reach.
    """

    def __init__(self, mechanism: Mechanism, models: Mapping[str, AbstractRodModel]) -> None:
        self.mechanism = mechanism
        self.flexible = [shapes_of(link, models) for link in mechanism.links]
        self.packed: Packed = packed(mechanism, self.flexible)
        self.count = self.packed.position.size
        self.readings = len(mechanism.marks) + len(mechanism.links)
        self.drives = len(mechanism.driven)

    def operators(self) -> Operators:
        n_dof = self.count + self.readings
        still = np.zeros(self.readings)
        highest = max([RIGID, *(each.frequency for each in self.flexible if each is not None)])
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
        """Return the row of a reading; of the moment of a drive, x its number, over the whole state."""
        if quantity not in OWN_READINGS:
            raise CaseError(f"a mechanism has no {quantity}", remedy="Name displacement or velocity.", path="probes")
        n_dof = self.count + self.readings
        row = np.zeros(n_dof if quantity != "moment" else 2 * n_dof + self.count + self.drives + 2)
        row[self.count + int(x) if quantity != "moment" else 2 * n_dof + self.count + int(x)] = 1.0
        return row

    def momentum_row(self) -> Array:
        return np.zeros(self.count + self.readings)

    def grid(self) -> Array:
        return np.arange(float(len(self.mechanism.marks)))

    def check(self, integrator: AbstractScheme) -> None:
        """Raise `PairingError` where a scheme counts on constant matrices."""
        if not isinstance(integrator, Midpoint):
            raise PairingError(
                f"integrator '{kind_of(integrator)}' counts on constant matrices, and the mechanism "
                f"'{self.mechanism.name}' has none. Allowed: midpoint",
                remedy="Give integrator midpoint.",
                path="solve.integrator",
            )

    def gains_energy(self, dt: float, impulses: bool) -> float:
        """Return the bound on the energy that its steps may add, over the reference energy: of second order in dt.

        Where a law gives impulses, terms are taken with the rates before them: the bound is of first order.
        """
        highest = max([0.0, *(each.frequency for each in self.flexible if each is not None)])
        links, gravity = self.mechanism.links, math.hypot(*self.mechanism.gravity)
        rates = [abs(link.rate) + abs(link.drive.rate if link.drive is not None else 0.0) for link in links]
        swing = math.sqrt(gravity / min(link.length for link in links))
        bound = GAIN * (highest * dt) ** 2 + TURN_GAIN * ((max(rates) + swing) * dt) ** 2
        return bound + (IMPULSE_GAIN * max(highest, RIGID) * dt if impulses else 0.0)

    def stepper(self, ports: Array, dt: float) -> Stepper:
        """Return the step of the midpoint rule; ``ports`` are rows of readings."""
        n, r = self.count, self.readings
        drives = self._drives()
        at_drives = steps.HEAD
        at_stiffness = at_drives + drives.size
        at_ports = at_stiffness + n * n
        at_own = at_ports + len(ports)
        own = self.packed.parameters
        at_room = at_own + own.size
        head = np.zeros(steps.HEAD)
        head[steps.TERMS] = kernel_address(terms.terms, TERMS)
        head[steps.COORDINATES], head[steps.READINGS], head[steps.DRIVES] = n, r, self.drives
        head[steps.STEP], head[steps.DRIVES_AT], head[steps.STIFFNESS_AT] = dt, at_drives, at_stiffness
        head[steps.OWN_AT], head[steps.ROOM_AT], head[steps.PORTS_AT] = at_own, at_room, at_ports
        numbers = np.flatnonzero(ports)  # a port is the row of a reading
        places = np.array([float(np.argmax(row)) - n for row in ports])
        assert numbers.size == len(ports)  # noqa: S101
        room = np.zeros(3 * n * n + 4 * n + r * n + 2 * r + 1)
        parameters = np.concatenate((head, drives, self.packed.stiffness.ravel(), places, own, room))
        size = 2 * (n + r) + n + self.drives + 2
        state = np.zeros(size)
        state[:n], state[n + r : 2 * n + r] = self.packed.position, self.packed.velocity
        jump, responses = np.zeros(len(ports) * (n + r)), np.zeros(3 * len(ports) * size)
        entered(
            prepare_columns,
            *(kernel_address(*each) for each in KERNELS),
            parameters,
            state,
            0.0 * state,
            jump,
            responses,
        )
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

    def _drives(self) -> Array:
        found = []
        for number in self.mechanism.driven:
            drive = self.mechanism.links[number].drive
            if drive is not None:
                found.append([self.packed.angles[number], drive.rate, drive.within])
        return np.array(found, dtype=float).ravel()


def shapes_of(link: Link, models: Mapping[str, AbstractRodModel]) -> FlexibleLink | None:
    """Return a link in shapes, None of a rigid one; raise `CaseError` where its description has no mesh and modes."""
    if link.beam is None:
        return None
    model = models.get(link.name)
    if not isinstance(model, Modal) or model.elements is None:
        raise CaseError(
            f"link '{link.name}' needs modes of a mesh",
            remedy="Give {kind: modal, elements: 160, modes: 20}, for example.",
            path=f"solve.models.{link.name}",
        )
    for name, given, served in (
        ("basis", kind_of(model.basis), "eigenvectors"),
        ("mass", model.mass, "consistent"),
        ("order", model.order, 1),
    ):
        if given != served:
            raise CaseError(
                f"link '{link.name}' bends in eigenvectors of a consistent mesh, and {name} {given} is asked for",
                remedy=f"Remove {name}.",
                path=f"solve.models.{link.name}.{name}",
            )
    return flexible_link(link, model.elements, model.modes or model.elements)
