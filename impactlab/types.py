"""The records in which parts meet.

`Port`, `Side` and `Reply` are C structures: the compiled loop, a compiled law and a law in plain Python see the same
memory under the same names. `parameters`, `memory` and `readings` are small arrays of fixed room.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from enum import Enum
from typing import Annotated, Literal, NamedTuple

from numpy import float64, int64
from numpy.typing import NDArray

from impactlab.options import Relative as Relative
from impactlab.options import option as option
from impactlab.structures import Numbers, record

Array = NDArray[float64]
Ints = NDArray[int64]
Progress = Callable[[float], None]
"""Called with the fraction of a run that is done, from 0 to 1."""
Quantity = Literal[
    "displacement", "velocity", "strain", "stress", "force", "rotation", "bending_moment", "shear_force", "moment"
]

QUANTITIES_OF_ROD: tuple[Quantity, ...] = ("displacement", "velocity", "strain", "stress", "force")
INTERNAL_FORCES: tuple[Quantity, ...] = ("stress", "force", "bending_moment", "shear_force")
QUANTITIES_OF_BEAM: tuple[Quantity, ...] = ("displacement", "velocity", "rotation", "bending_moment", "shear_force")

PARAMETERS = 64  # room for a law's constants
MEMORY = 8  # room for the memory of a law from step to step
READINGS = 8  # room for readings inside the bodies


class Level(Enum):
    """A compliance that a law needs and a scheme offers."""

    POSITION = "displacement per force"
    VELOCITY = "velocity per force"
    IMPULSE = "velocity per impulse"
    CLOSING = "velocity per impulse, unless F dt holds a closing jump"


@record
class Side(ctypes.Structure):
    """One body's face at a contact; a compliance is its displacement inwards per force."""

    displacement: float  # m, at the start of the step
    velocity: float  # m/s, at the start of the step
    free_displacement: float  # m, at the end of the step without contact force
    free_velocity: float  # m/s, the same
    displacement_per_force: float  # m/N, of a force constant over the step, at its end
    velocity_per_force: float  # m/(N s), the same
    velocity_per_impulse: float  # 1/kg, at once


@record
class Port(ctypes.Structure):
    """The input of a law in one step.

    Gap and rate are positive when open and opening. "free" is without the contact's own force; a compliance is the
    change per unit force, constant over the step. The scheme decides where in the step the force acts: a law F = f(gap,
    rate) takes the values there.
    """

    time: float  # s, start of the step
    dt: float  # s
    gap: float  # m, at the start of the step
    gap_rate: float  # m/s, at the start, before any impulse of this step
    free_gap: float  # m, at the end
    free_gap_rate: float  # m/s, at the end
    gap_per_force: float  # m/N, at the end
    rate_per_force: float  # m/(N s), at the end
    acting_gap: float  # m, free gap where the force acts
    acting_rate: float  # m/s, free gap rate there
    acting_gap_per_force: float  # m/N, compliance of the gap there; 0 in an explicit scheme
    acting_rate_per_force: float  # m/(N s), compliance of the rate there
    averaged: float  # 1 where the force is a mean over the step, 0 where it acts at one instant of it
    first_gap: float  # m, free gap where the force begins to act
    last_gap: float  # m, free gap where it ends to act
    travel_start: float  # m, gap from which a force of this step works
    free_travel: float  # m, change of the gap over which it works from there: work is force times travel
    travel_per_force: float  # m/N, change of that travel
    first_weight: float  # steps that the first force after a touch stands for; 1 where it is a mean, and later
    others_rate: float  # m/s, jump of the gap rate by impulses at other contacts
    rate_before_impulse: float  # m/s, gap rate that an impulse of this step changes, those of other contacts included
    gap_per_impulse: float  # m/(N s), gap at the end per impulse at the start
    rate_per_impulse: float  # 1/kg, jump of the gap rate per impulse
    jump_in_force: float  # 1 where F dt already holds a closing jump, else 0
    predicted_gap: float  # m, gap of the predictor that a projection moves; inf where it moves the end of the step
    gap_per_projection: float  # 1/kg, gap at the end per projection
    offset: float  # m, last reply
    pushed: float  # value of the row that the law may push along, at the start of the step
    free_pushed: float  # the same at the end
    pushed_per_force: float  # 1/N, at the end
    pushed_per_push: float  # the same per push over the step
    gap_per_push: float  # gap at the end per push over the step
    acting_pushed: float  # its free value where the force acts
    acting_pushed_per_force: float  # compliances there, as those at the end
    acting_pushed_per_push: float
    acting_gap_per_push: float
    in_contact: float  # 1 after a step with contact, else 0
    left: Side
    right: Side
    readings: Annotated[Numbers, READINGS]  # values at the start of the step, in the order of `Start.readings`
    memory: Annotated[Numbers, MEMORY]  # last reply; `begin` gives the first
    parameters: Annotated[Numbers, PARAMETERS]  # from `begin`


@record
class Reply(ctypes.Structure):
    """The reply of a law for one step: all fields zero before, memory the port's."""

    force: float  # N, constant over the step, positive in compression
    impulse: float  # N s, given at the start of the step
    projection: float  # kg m, moves positions by M^-1 times it, and no velocity
    push: float  # m where the pushed row is a force: over the step, along that row
    trial: float  # N, the signed force before clipping; its root dates the opening
    excess: float  # N, part of the force that gives impulse of the step before: no part of the largest force
    offset: float  # m, faces pressed in beyond their coordinates: the true gap is gap + offset
    stored: float  # J, held by the contact at the end of the step
    dissipated: float  # J, lost in this step by a formula of its own, never negative
    unresolved: float  # J, handed in this step to modes that the model leaves out, never negative
    in_contact: float  # 1 or 0, at the end of the step
    failed: float  # 1 stops the run
    memory: Annotated[Numbers, MEMORY]


SideName = Literal["left", "right"]
SIDES: tuple[SideName, SideName] = ("left", "right")


class Reading(NamedTuple):
    """A quantity that a law reads inside a body, at the start of each step."""

    side: SideName
    distance: float  # m from the contact face, into the body
    quantity: Quantity
    left_out: bool = False  # True: with the quasi-static part of the modes that a truncated basis leaves out


class Arriving(NamedTuple):
    """The velocity of a face by the waves that reach it after a delay [m/s].

    A messenger for each mode of a body.

    See `impactlab.models.messengers`.
    """

    side: SideName
    delay: float  # s
    speed: Literal["phase", "group"] = "phase"
    most: float = math.inf  # largest error allowed, over the free motion of the modes
    compliance: float = math.nan  # m/s/N, velocity of the face per force that the law takes; NaN: that of the step


class SideFacts(NamedTuple):
    """Facts of one side before the run; NaN where one does not exist."""

    kind: str  # mass | wall | rod | beam | mechanism; rod of a shaft, too, which has its equation
    impedance: float  # Z at the contact, N s/m: of rods and Timoshenko beams; of both directions at an inner point
    wave_speed: float  # c at the contact, m/s: of axial waves, on a Timoshenko beam of the shear front
    area: float  # m2
    element_stiffness: float  # EA/h, of a beam 12 EI/h3, N/m; of the mesh, or of L/modes where there is none
    room: float  # m a reading may be away from the face: the first segment's length; NaN on a beam
    mass: float  # kg, of the whole body with the masses at its ends; inf for a wall
    gravity: float  # m/s2, along +x
    velocity_per_force: float = math.nan  # m/(N s), of the face in the scheme's own step; NaN where nothing steps
    left_out: float = 0.0  # m/N, static compliance of the face in the modes that the model leaves out
    flexibility: float = 0.0  # m/N, of a massless face
    end: str = "free"  # kind of the struck end: one of `impactlab.scene.End`, or force; inner at an inner point
    in_waves: bool = (
        False  # True: the body steps by its waves, as a delay line, so that it is free by those that arrive
    )
    body: str = ""  # its name, for messages


class Start(NamedTuple):
    """Constants, first memory and readings of a law, from `begin`."""

    parameters: tuple[float, ...] = ()
    memory: tuple[float, ...] = ()
    readings: tuple[Reading | Arriving, ...] = ()
    pushed: tuple[tuple[Reading, float], ...] = ()  # weighted readings along whose row the law pushes, beside its force


class Noted(NamedTuple):
    """A count in the memory of a law, reported as a warning unless zero."""

    slot: int  # of the memory
    code: str  # of the warning
    text: str  # of the warning, with ``{count}``


class PowerForce(NamedTuple):
    """The force K d^n of an overlap d, with nothing remembered and nothing lost."""

    stiffness: float  # K, N/m^n
    exponent: float  # n
    coarse: float = math.inf  # tangent stiffness times compliance of the faces, above which a step counts as coarse
    most: float = math.inf  # the same, above which the law fails
    counted: Noted | None = None  # the count of coarse steps


class Restitution(NamedTuple):
    """Restitution of a law between rigid bodies, as given and as computed."""

    nominal: float
    true: float


class Until(NamedTuple):
    """End of a branch: a quantity that passes a value, and the branch that follows.

    ``of`` is the approach of the faces a (the gap with its sign turned) [m], its rate v [m/s], the static force
    f0 + k a of the branch [N], or the force f0 + k a + d v, that of the branch also where it does not act. Of the
    static force a line may be given: the value is then ``value + slope a``.

    The memory of the law may move a value: with ``remembered`` 1 the set [m] is added to that of an approach, and the
    largest static force at an end of a branch so far [N] to that of a static force; with -1 it is taken from it.

    The static force of the next branch begins at the value that was passed, or where it is if another quantity ended
    the branch: f0 follows, and with it sets and deepest points.
    """

    of: Literal["static", "force", "approach", "rate"]
    rises: bool  # passes the value from below; else from above
    next: int  # number of the branch that follows
    value: float = 0.0  # N, m or m/s
    slope: float = 0.0  # N/m
    remembered: float = 0.0


class Branch(NamedTuple):
    """A branch of a law: force = f0 + k a + d v.

    The force is positive in compression. The first end to be met ends it.
    """

    name: str  # as histories report it
    stiffness: float  # N/m; inf of faces that move as one
    damping: float = 0.0  # N s/m
    ends: tuple[Until, ...] = ()
    acts: bool = True  # False: the faces feel no force

    @property
    def rigid(self) -> bool:
        """Whether the faces move as one."""
        return math.isinf(self.stiffness)


class Branches(NamedTuple):
    """A law that is linear between changes of branch.

    The elastic part gives back f^2/(2 k) and, with kinematic hardening, H s^2/2; all else is loss. The set
    s = a - f/k is that of its slider, which an elastic branch holds.
    """

    branches: tuple[Branch, ...]
    elastic: float  # N/m, k of the elastic part; branches of this stiffness hold the set
    first: int = 0  # branch at t = 0
    set: float = 0.0  # m, at t = 0
    largest: float = 0.0  # N, static force remembered at t = 0
    kept: float = 0.0  # N/m, H of kinematic hardening, which gives its energy back

    @property
    def rigid(self) -> bool:
        """Whether the faces move as one."""
        return math.isinf(self.elastic)
