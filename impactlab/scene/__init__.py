"""The physics of a case: bodies, contacts, loads, probes.

Its numerical method is in `impactlab.scene.method`.
"""

from impactlab.scene.bodies import (
    Beam,
    BeamSegment,
    Body,
    ElasticBody,
    End,
    Mass,
    Profile,
    Rayleigh,
    Rod,
    Rotation,
    Segment,
    Shaft,
    Table,
    Wall,
    WaveBody,
)
from impactlab.scene.problem import RECORDS, Contact, Point, Probe, Scene

__all__ = [
    "Beam",
    "BeamSegment",
    "Body",
    "Contact",
    "ElasticBody",
    "End",
    "Mass",
    "Point",
    "Probe",
    "Profile",
    "RECORDS",
    "Rayleigh",
    "Rod",
    "Rotation",
    "Scene",
    "Segment",
    "Shaft",
    "Table",
    "Wall",
    "WaveBody",
]
