"""What a case describes, in SI and in plain frozen records: the only thing a run is built from.

Conventions: x runs from a body's left end to its right end; displacements and velocities are positive to the
right; gaps are positive when open; contact forces, stresses and strains are positive in compression. Of a beam the
displacement is the deflection, positive up; for its contacts "left" reads below and "right" above.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, final

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from impactlab.contact.base import AbstractContactLaw
from impactlab.integrators.base import AbstractScheme
from impactlab.models.base import AbstractRodModel
from impactlab.types import Quantity

Profile = Callable[[NDArray[float64]], NDArray[float64]]
"""A quantity as a function of x [m], shape (n,) to shape (n,)."""

RECORDS = 20_000  # instants that a run keeps unless the case says otherwise
Counted = Literal["displacements", "impulses", "peak_forces"]
COUNTED: tuple[Counted, ...] = ("displacements", "impulses", "peak_forces")
"""Quantities whose largest relative error counts against a tolerance."""


@dataclass(frozen=True)
class Table:
    """A quantity given at places x [m], rising; straight lines between them."""

    x: tuple[float, ...]
    u: tuple[float, ...]

    def __call__(self, x: NDArray[float64]) -> NDArray[float64]:
        return np.asarray(np.interp(x, self.x, self.u), dtype=float)


@dataclass(frozen=True)
class Segment:
    """A uniform piece of a rod or a beam."""

    length: float  # m
    area: float  # m2
    young: float  # Pa
    density: float  # kg/m3
    viscosity: float = 0.0  # Pa s: stress = E strain + viscosity times strain rate (Kelvin and Voigt)

    @property
    def wave_speed(self) -> float:
        """Speed of axial waves sqrt(E/rho) [m/s]."""
        return float((self.young / self.density) ** 0.5)

    @property
    def impedance(self) -> float:
        """Impedance rho c A [N s/m]."""
        return self.density * self.wave_speed * self.area

    @property
    def mass(self) -> float:
        """Mass rho A L [kg]."""
        return self.density * self.area * self.length


@dataclass(frozen=True)
class BeamSegment(Segment):
    """A uniform piece of a beam."""

    inertia: float = math.nan  # m4, second moment I of the area about the neutral axis
    shear_stiffness: float = math.inf  # N, k G A; inf where shear gives no deformation
    rotary_inertia: float = 0.0  # kg m, rho I; 0 where rotation costs no kinetic energy
    height: float = math.nan  # m, of the cross section, where it is known

    @property
    def bending_stiffness(self) -> float:
        """Bending stiffness E I [N m2]."""
        return self.young * self.inertia

    @property
    def shear_speed(self) -> float:
        """Speed of the shear front sqrt(k G A/(rho A)) [m/s]; inf for a beam that does not shear."""
        return math.sqrt(self.shear_stiffness / (self.density * self.area))

    @property
    def shear_impedance(self) -> float:
        """Impedance sqrt(k G A rho A) [N s/m] of a cross section in one direction; inf where nothing shears."""
        return math.sqrt(self.shear_stiffness * self.density * self.area)


@dataclass(frozen=True)
class End:
    """What holds an end of a rod or a beam: nothing, a clamp, a grounded spring or dashpot, or a mass riding on it.

    A beam may be pinned (no deflection, free rotation), its spring may resist rotation too, and it may go on for ever.
    A force may act on an end that is not clamped or pinned.
    """

    kind: Literal["free", "clamped", "spring", "dashpot", "mass", "pinned", "infinite"]
    value: float = 0.0  # N/m, N s/m or kg
    force: float = 0.0  # N, along +x (of a beam along +u), constant from t = 0 on
    rotational: float = 0.0  # N m/rad, of a spring against rotation at the end of a beam

    @property
    def carries(self) -> str:
        """What contact laws are told of this end: its kind, or `force` where a force acts on it."""
        return "force" if self.force != 0.0 else self.kind


@dataclass(frozen=True)
class Rayleigh:
    """Damping of a whole rod by its own matrices: C = mass M + stiffness K."""

    mass: float = 0.0  # 1/s
    stiffness: float = 0.0  # s


@dataclass(frozen=True)
class ElasticBody(ABC):
    """A straight body of one or more uniform segments along x, which moves along its axis or across it."""

    name: str
    segments: tuple[Segment, ...]
    left: End
    right: End
    velocity: float = 0.0  # m/s, uniform at t = 0
    displacement: Profile | None = None  # m, at t = 0
    model: AbstractRodModel | None = None  # None only while a case is being read
    damping: Rayleigh = Rayleigh()

    @property
    @abstractmethod
    def kind(self) -> str:
        """What a case calls such a body: ``rod`` or ``beam``."""

    @property
    def length(self) -> float:
        """Whole length [m]."""
        return sum(segment.length for segment in self.segments)

    @property
    def mass(self) -> float:
        """Mass of the segments, without end masses [kg]."""
        return sum(segment.mass for segment in self.segments)

    @property
    def end_force(self) -> float:
        """Sum of the forces on both ends [N], along +x, of a beam along +u."""
        return self.left.force + self.right.force

    @property
    def is_damped(self) -> bool:
        """Whether the body itself loses energy; dashpots at its ends do not count."""
        return self.damping != Rayleigh() or any(segment.viscosity > 0.0 for segment in self.segments)

    @property
    def is_held(self) -> bool:
        """Whether anything but contacts and loads can change its momentum."""
        return any(end.kind not in ("free", "mass") for end in (self.left, self.right))

    @property
    def round_trip(self) -> float:
        """Time of a wave to the far end and back, 2 L/c summed over the segments [s], with c = sqrt(E/rho)."""
        return sum(2.0 * segment.length / segment.wave_speed for segment in self.segments)


@final
@dataclass(frozen=True)
class Rod(ElasticBody):
    """A straight elastic rod: it moves along its axis."""

    @property
    def kind(self) -> str:
        return "rod"


@final
@dataclass(frozen=True)
class Beam(ElasticBody):
    """A straight elastic beam: it deflects across its axis; its round trip is that of an axial wave."""

    segments: tuple[BeamSegment, ...]
    theory: Literal["euler_bernoulli", "timoshenko"] = "euler_bernoulli"
    tension: float = 0.0  # N, axial preload, positive in tension

    @property
    def kind(self) -> str:
        return "beam"


@dataclass(frozen=True)
class Mass:
    """A rigid body."""

    name: str
    mass: float  # kg
    velocity: float = 0.0  # m/s at t = 0


@dataclass(frozen=True)
class Wall:
    """A rigid body that never moves."""

    name: str


Body = Rod | Beam | Mass | Wall


@dataclass(frozen=True)
class Point:
    """A place on a body. ``label`` is how the case names it: ``hammer``, ``rod.left``, ``rod.at(0.15)``."""

    body: str
    x: float  # m from the left end; 0 for masses and walls
    label: str


@dataclass(frozen=True)
class Contact:
    """Two faces that may meet: ``left`` lies on the left of ``right``; gap = gap0 + u_right - u_left."""

    left: Point
    right: Point
    gap: float  # m, at t = 0
    law: AbstractContactLaw
    overlap_allowed: bool = False

    @cached_property
    def name(self) -> str:
        """Name used in channels and events: ``hammer|rod.left``."""
        return f"{self.left.label}|{self.right.label}"


@dataclass(frozen=True)
class Probe:
    """A quantity at a place that is recorded over the whole run."""

    body: str
    x: float  # m
    quantity: Quantity

    @property
    def channel(self) -> str:
        """Name of its channel: ``displacement:rod@0.15``."""
        return f"{self.quantity}:{self.body}@{self.x:.6g}"


@dataclass(frozen=True)
class StepRule:
    """How the step is chosen: exactly one of the three is given."""

    points_per_period: float | None = None  # steps in the shortest period of the method
    dt: float | None = None  # s
    courant: float | None = None  # c dt/h


@dataclass(frozen=True)
class Scene:
    """Everything a run needs. Built by the case file room or by hand."""

    name: str
    bodies: Mapping[str, Body]
    contacts: tuple[Contact, ...]
    duration: float  # s
    integrator: AbstractScheme | None
    step: StepRule
    events: Literal["dated", "located"] = "dated"
    gravity: float = 0.0  # m/s2, along +x
    probes: tuple[Probe, ...] = ()
    snapshots: tuple[float, ...] = ()  # s
    round_trip: float = float("nan")  # s, of the body named in round_trips_of; NaN without a rod or beam
    records: int = RECORDS  # instants kept: a run of more steps keeps every second, third ... one
    metrics: tuple[str, ...] = ()  # names of metrics of plugins to be measured beside impactlab's own
    tolerance: float | None = None  # relative error allowed; models and step are then to be chosen
    tolerance_on: tuple[Counted, ...] = COUNTED  # the quantities whose errors the tolerance bounds

    @property
    def force_jumps(self) -> bool:
        """Whether a contact force may jump, by its law or as a front arrives."""
        return self.fronts_at_start or any(contact.law.force_jumps for contact in self.contacts)

    @property
    def fronts_at_start(self) -> bool:
        """Whether waves with a front set out at t = 0: from an end force, or from an end that holds a moving body."""
        moving = [body for body in self.bodies.values() if isinstance(body, ElasticBody) and body.velocity != 0.0]
        held = any(end.kind in ("clamped", "dashpot") for body in moving for end in (body.left, body.right))
        return held or bool(self.loaded_ends)

    @cached_property
    def in_order(self) -> dict[str, Body]:
        """Bodies by their first contact, then by name: an order that does not depend on how the case is written.

        Sums over several bodies follow it, so that their bits do not change with the order of keys.
        """
        touching = [point.body for contact in self.contacts for point in (contact.left, contact.right)]
        return {name: self.bodies[name] for name in dict.fromkeys((*touching, *sorted(self.bodies)))}

    @property
    def loaded_ends(self) -> tuple[Probe, ...]:
        """Displacements of the ends of rods and beams on which forces act: recorded like those of faces in contact."""
        rods = [body for body in self.bodies.values() if isinstance(body, ElasticBody)]
        ends = [(rod, end, x) for rod in rods for end, x in ((rod.left, 0.0), (rod.right, rod.length))]
        return tuple(Probe(rod.name, x, "displacement") for rod, end, x in ends if end.force != 0.0)
