"""Shafts: elastic bodies in torsion, reduced to the lever arm r of their contacts.

G J theta'' = rho I_p theta_tt. A face at the arm r moves by u = r theta, and a contact force F there gives the torque
F r. Put into the first equation, u solves that of a rod with E = G, E A = G J/r2 and rho A = rho I_p/r2: the wave speed
sqrt(G J/(rho I_p)) is the same, and the impedance is that of torsion, sqrt(G J rho I_p), over r2. So a shaft is kept as
this rod, which every model serves, and read in its own quantities: twist u/r, twist rate v/r, torque N r.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from numpy import float64
from numpy.typing import NDArray

from impactlab.scene.bodies.base import End, Profile, Segment, WaveBody
from impactlab.types import Quantity


@final
@dataclass(frozen=True)
class Shaft(WaveBody):
    """A straight elastic shaft, in the sizes of the rod at its lever arm; `shaft_segment` and `shaft_end` reduce them.

    Velocity and displacement are those at the arm; momentum is angular momentum over the arm. Gravity does not turn it.
    """

    lever_arm: float = 1.0  # m

    falls = False

    @property
    def kind(self) -> str:
        return "shaft"

    @property
    def quantities(self) -> Mapping[str, tuple[Quantity, float]]:
        arm = self.lever_arm
        own: dict[str, tuple[Quantity, float]] = {
            "twist": ("displacement", 1.0 / arm),
            "twist_rate": ("velocity", 1.0 / arm),
            "torque": ("force", arm),
        }
        return own | {"displacement": ("displacement", 1.0), "velocity": ("velocity", 1.0)}


@dataclass(frozen=True)
class AtArm:
    """The displacement [m] at a lever arm [m] of a twist [rad] along a shaft."""

    twist: Profile
    lever_arm: float

    def __call__(self, x: NDArray[float64]) -> NDArray[float64]:
        return self.lever_arm * self.twist(x)


def shaft_segment(
    length: float,
    shear_modulus: float,
    density: float,
    torsion_constant: float,
    polar_moment: float,
    lever_arm: float,
    viscosity: float = 0.0,
) -> Segment:
    """Return a uniform piece of a shaft as that of the rod at the lever arm.

    Parameters
    ----------
    length : float
        m
    shear_modulus : float
        G [Pa].
    density : float
        rho [kg/m3].
    torsion_constant : float
        J [m4]: St. Venant's, which of a circle is its polar moment.
    polar_moment : float
        I_p [m4], the polar second moment of area.
    lever_arm : float
        r [m].
    viscosity : float
        Pa s: shear stress = G shear strain + viscosity times its rate.
    """
    area, line_mass = torsion_constant / lever_arm**2, density * (polar_moment / torsion_constant)
    return Segment(length, area, shear_modulus, line_mass, viscosity)


def shaft_end(end: End, lever_arm: float) -> End:
    """Return an end in N m/rad, N m s/rad, kg m2 and N m as that of the rod at the lever arm [m]."""
    return End(end.kind, end.value / lever_arm**2, end.force / lever_arm)
