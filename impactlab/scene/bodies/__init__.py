"""Bodies in SI units, as frozen records, a file for each kind: rods, beams, shafts, masses, walls."""

from impactlab.scene.bodies.base import Body, ElasticBody, WaveBody
from impactlab.scene.bodies.beam import Beam, BeamSegment, beams_among
from impactlab.scene.bodies.loads import AbstractLoad, FunctionLoad, SampledLoad
from impactlab.scene.bodies.mechanism import (
    Drive,
    Gauge,
    Link,
    Mark,
    Mechanism,
    MechanismBody,
    links_on_hubs,
    mechanism_of,
)
from impactlab.scene.bodies.pieces import End, Profile, Rayleigh, Segment, Table
from impactlab.scene.bodies.rigid import Mass, Wall
from impactlab.scene.bodies.rod import Rod
from impactlab.scene.bodies.rotation import Rotation
from impactlab.scene.bodies.shaft import Shaft, shaft_end, shaft_segment
from impactlab.scene.bodies.steady import SteadyState

__all__ = [
    "AbstractLoad",
    "Beam",
    "BeamSegment",
    "Body",
    "Drive",
    "ElasticBody",
    "End",
    "FunctionLoad",
    "Gauge",
    "Link",
    "Mark",
    "Mass",
    "Mechanism",
    "MechanismBody",
    "Profile",
    "Rayleigh",
    "Rod",
    "Rotation",
    "SampledLoad",
    "Segment",
    "Shaft",
    "SteadyState",
    "Table",
    "Wall",
    "WaveBody",
    "beams_among",
    "links_on_hubs",
    "mechanism_of",
    "shaft_end",
    "shaft_segment",
]
