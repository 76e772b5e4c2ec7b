"""Granular chains: contact stiffness, the solitary wave, waves of a run.

Beads are spheres; the solitary wave is that of a chain without precompression, the bands are those of one with it.

    from impactlab import granular

    stiffness = granular.sphere_stiffness(200e9, 0.3, 5e-3, 5e-3)
    granular.wave_speed(stiffness, granular.sphere_mass(5e-3, 7850.0), force=100.0)  # beads/s

sphere_mass       mass of a sphere
sphere_stiffness  k of F = k d^1.5 between two spheres, or a sphere and a plane, by Hertz
solitary_wave     the solitary wave of a discrete chain with F = k d^n: a SolitaryWave
SolitaryWave      overlap and force over time, the factor C of its speed
wave_speed        speed of the solitary wave in beads per second
LONG_WAVE_FACTOR  C of the long-wave equation, sqrt(0.8), to compare with
bands             frequencies of linear waves in a precompressed, periodic chain: a Bands
Bands             edges of its pass bands, gaps between them
leading_wave      largest force of each contact of a run, and when it acted: a LeadingWave
LeadingWave       times and forces along the contacts, speed, the factor C along the chain

See `docs/granular-chains.md` for the equations and their derivation.
"""

from impactlab.granular.bands import Bands, bands
from impactlab.granular.solitary_wave import LONG_WAVE_FACTOR, SolitaryWave, solitary_wave, wave_speed
from impactlab.granular.spheres import sphere_mass, sphere_stiffness
from impactlab.granular.waves import LeadingWave, leading_wave
from impactlab.startup.lazy import public_names

__all__ = [
    "LONG_WAVE_FACTOR",
    "Bands",
    "LeadingWave",
    "SolitaryWave",
    "bands",
    "leading_wave",
    "solitary_wave",
    "sphere_mass",
    "sphere_stiffness",
    "wave_speed",
]

__dir__ = public_names(__all__)
