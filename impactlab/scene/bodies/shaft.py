"""Shafts: elastic bodies in torsion, reduced to the lever arm r of their contacts.

G J theta'' = rho I_p theta_tt. A face at the arm r moves by u = r theta, and a contact force F there gives the torque
F r. Put into the first equation, u solves that of a rod with E = G, E A = G J/r2 and rho A = rho I_p/r2: the wave speed
sqrt(G J/(rho I_p)) is the same, and the impedance is that of torsion, sqrt(G J rho I_p), over r2. So a shaft is kept as
this rod, which every model supports, and read in its own quantities: twist u/r, twist rate v/r, torque N r.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from impactlab.scene.bodies.base import WaveBody, plain
from impactlab.scene.bodies.pieces import End, Segment
from impactlab.types import Quantity


@final
@dataclass(frozen=True)
class Shaft(WaveBody):
    """A straight elastic shaft, in the sizes of an equivalent rod.

    The rod is at its lever arm; `shaft_segment` and `shaft_end` give its sizes. Velocity and displacement are those at
    the arm; momentum is angular momentum over the arm. Gravity does not turn it.
    """

    lever_arm: float = 1.0  # m

    kind = "shaft"
    falls = False

    @property
    def quantities(self) -> Mapping[str, tuple[Quantity, float]]:
        own: dict[str, tuple[Quantity, float]] = {"twist": ("displacement", 1.0 / self.lever_arm)}
        own |= {"twist_rate": ("velocity", 1.0 / self.lever_arm), "torque": ("force", self.lever_arm)}
        return own | plain("displacement", "velocity")


def shaft_segment(
    length: float,  # m
    shear_modulus: float,  # Pa, G
    density: float,  # kg/m3, rho
    torsion_constant: float,  # m4, J: St. Venant's, which of a circle is its polar moment
    polar_moment: float,  # m4, I_p, of area
    lever_arm: float,  # m, r
    viscosity: float = 0.0,  # Pa s: shear stress = G shear strain + viscosity times its rate
) -> Segment:
    """Return a uniform piece of a shaft as one of the rod at its arm."""
    area, line_mass = torsion_constant / lever_arm**2, density * (polar_moment / torsion_constant)
    return Segment(length, area, shear_modulus, line_mass, viscosity)


def shaft_end(end: End, lever_arm: float) -> End:
    """Return an end of a shaft as one of the rod at its arm [m].

    It is given in N m/rad, N m s/rad, kg m2 and N m.
    """
    load = None if end.load is None else end.load.scaled(1.0 / lever_arm)
    return End(end.kind, end.value / lever_arm**2, end.force / lever_arm, load=load)
