"""Beams that deflect across their axis, by the theory of Euler and Bernoulli or of Timoshenko."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, final

import numpy as np

from impactlab.scene.bodies.base import Body, ElasticBody, plain
from impactlab.scene.bodies.pieces import Segment
from impactlab.scene.bodies.rotation import Rotation
from impactlab.scene.bodies.steady import SteadyBeam, SteadyState
from impactlab.types import QUANTITIES_OF_BEAM, Quantity, SideFacts

CANTILEVER = 2.0 * math.pi / 1.8751040687119611**2  # period of a cantilever over L2 sqrt(rho A/EI)
MIN_SLENDERNESS = 10.0  # length over height, from which on shear hardly matters to the slowest motion
MAX_WAVE_NUMBER = 0.15  # over 1/(radius of gyration): there waves run 4 to 5 % too fast without shear and rotation


@dataclass(frozen=True)
class BeamSegment(Segment):
    """A uniform piece of a beam."""

    inertia: float = math.nan  # m4, second moment I of the area about the neutral axis
    shear_stiffness: float = math.inf  # N, k G A; inf where shear gives no deformation
    rotary_inertia: float = 0.0  # kg m, rho I; 0 where rotation costs no kinetic energy
    height: float = 0.0  # m, of the cross section; 0 where it is not known

    @property
    def front_speed(self) -> float:
        return max(self.wave_speed, self.shear_speed)

    @property
    def bending_stiffness(self) -> float:
        return self.young * self.inertia

    @property
    def gyration(self) -> float:
        """Radius of gyration sqrt(I/A) of the cross section [m]."""
        return math.sqrt(self.inertia / self.area)

    @property
    def shear_speed(self) -> float:
        """Speed [m/s] of the shear front, sqrt(k G/rho); inf without shear."""
        return math.sqrt(self.shear_stiffness / (self.density * self.area))

    @property
    def shear_impedance(self) -> float:
        """Impedance [N s/m] in one direction, sqrt(k G A rho A); inf without shear."""
        return math.sqrt(self.shear_stiffness * self.density * self.area)


@final
@dataclass(frozen=True)
class Beam(ElasticBody):
    """A straight elastic beam that deflects across its axis; T is that of axial waves."""

    segments: tuple[BeamSegment, ...]
    theory: Literal["euler_bernoulli", "timoshenko"] = "euler_bernoulli"
    tension: float = 0.0  # N, axial preload, positive in tension

    kind = "beam"
    bends = True
    coordinates_per_node = 2

    @property
    def quantities(self) -> Mapping[str, tuple[Quantity, float]]:
        own = plain(*QUANTITIES_OF_BEAM)
        factors = {0.5 * each.height / each.inertia for each in self.segments}
        if len(factors) == 1 and (factor := factors.pop()) > 0.0:  # one section, of known height
            own["stress"] = ("bending_moment", factor)
            moduli = {each.young for each in self.segments}
            viscous = self.damping.stiffness > 0.0 or any(each.viscosity > 0.0 for each in self.segments)
            if len(moduli) == 1 and not viscous:  # so that it follows from the moment
                own["strain"] = ("bending_moment", factor / moduli.pop())
        return own

    @property
    def slowest_period(self) -> float:
        softest = max(math.sqrt(each.density * each.area / each.bending_stiffness) for each in self.segments)
        return CANTILEVER * self.length**2 * softest

    @property
    def static_compliance(self) -> float:
        return math.nan

    @property
    def is_held_along(self) -> bool:
        return any(end.kind in ("clamped", "pinned") for _, end in self.ends)

    @property
    def steady(self) -> SteadyState | None:
        return None if self.rotation is None else self.steady_beam(self.rotation).state()

    def steady_beam(self, rotation: Rotation) -> SteadyBeam:
        """Return the tension of the beam as it turns; its preload is not in it."""
        return SteadyBeam(self.segments, self.left, self.right, rotation.rate, rotation.axis_at)

    def steady_place(self, x: float) -> float:
        return 0.0

    @property
    def has_fronts(self) -> bool:
        return not self.is_damped and self.theory == "timoshenko"

    @property
    def stiffness(self) -> float:
        return self.segments[0].bending_stiffness / self.length**3

    @property
    def unbounded_first_force(self) -> bool:
        """Whether it does not shear: a hard contact then starts as t^-1/2."""
        return self.theory == "euler_bernoulli"

    def own_ratios(self) -> tuple[tuple[str, float, str], ...]:
        whole, piece = self.length, self.segments[0]
        return (
            ("the tension over EI/L2", abs(self.tension) * whole**2 / piece.bending_stiffness, "tension"),
            ("L2 A/I", whole**2 * piece.area / piece.inertia, "section"),
        )

    def mesh_rounding(self, element_length: float) -> float:
        """Return the energy that rounding may give its mesh, over that of its slow bending.

        Its stiffness holds 12 EI/h3 where the beam as a whole bends with EI/L3: sums of products lose (L/h)3 of their
        last digits. Fifty roundings were enough for twenty thousand steps on 800 elements. The layer beyond an infinite
        end bends with the beam, and its elements are hardly longer over the first two lengths of the beam.
        """
        layers = sum(end.kind == "infinite" for _, end in self.ends)
        return 50.0 * float(np.finfo(float).eps) * ((1 + 2 * layers) * self.length / element_length) ** 3

    def theory_doubts(self, contact: str, duration: float) -> tuple[str, ...]:
        """Return why Euler-Bernoulli theory may not hold: a short beam, or short waves."""
        if self.theory != "euler_bernoulli":
            return ()
        segment = max(self.segments, key=lambda each: each.gyration)
        radius = segment.gyration
        height = segment.height if segment.height > 0.0 else math.sqrt(12.0) * radius  # of a rectangle with this I/A
        slender = self.length / height
        wave = math.sqrt(math.pi / duration / (segment.wave_speed * radius))  # of half a period in contact: w = c r k2
        doubts = []
        if slender < MIN_SLENDERNESS:
            given = "" if segment.height > 0.0 else ", the height taken as sqrt(12 I/A)"
            doubts.append(f"it is {slender:.3g} times as long as high (slender from {MIN_SLENDERNESS:g} on{given})")
        if radius * wave > MAX_WAVE_NUMBER:
            shown = (f"{radius * wave:.{digits}g}" for digits in range(3, 18))
            above = next(text for text in shown if float(text) > MAX_WAVE_NUMBER)  # fewer digits may show the limit
            doubts.append(
                f"{contact} lasts {duration:.3g} s and excites waves with r k = {above} "
                f"(allowed: up to {MAX_WAVE_NUMBER:g}; r = {radius:.3g} m)"
            )
        return tuple(doubts)

    def side_facts(self, x: float, element_length: float) -> SideFacts:
        """Return the facts of a place, with an impedance where the beam shears."""
        end = self.carries(x)
        segment: Any = self.segment_at(x)
        before: Any = self.segment_before(x)
        sheared = math.isfinite(segment.shear_stiffness)
        impedance = segment.shear_impedance + (before.shear_impedance if end in ("inner", "infinite") else 0.0)
        return SideFacts(
            kind="beam",
            impedance=impedance if sheared else math.nan,
            wave_speed=segment.shear_speed if sheared else math.nan,
            area=segment.area,
            element_stiffness=12.0 * segment.bending_stiffness / element_length**3,
            room=math.nan,
            mass=self.moving_mass,
            gravity=0.0,
            end=end,
            body=self.name,
        )


def beams_among(bodies: Iterable[Body]) -> list[Beam]:
    """Return the beams among some bodies."""
    return [body for body in bodies if isinstance(body, Beam)]
