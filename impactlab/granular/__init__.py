"""Granular chains: contact stiffness of spheres, the solitary wave of a chain without precompression, waves of a run.

See `docs/granular-chains.md` for the equations and their derivation.
"""

from impactlab.granular.solitary_wave import LONG_WAVE_FACTOR, SolitaryWave, solitary_wave, wave_speed
from impactlab.granular.spheres import sphere_mass, sphere_stiffness
from impactlab.granular.waves import LeadingWave, leading_wave

__all__ = [
    "LONG_WAVE_FACTOR",
    "LeadingWave",
    "SolitaryWave",
    "leading_wave",
    "solitary_wave",
    "sphere_mass",
    "sphere_stiffness",
    "wave_speed",
]
