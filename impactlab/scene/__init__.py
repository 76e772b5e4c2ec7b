"""What a case describes: bodies, contacts, loads, and the questions asked of them."""

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
    Segment,
    Shaft,
    Table,
    Wall,
    WaveBody,
)
from impactlab.scene.problem import COUNTED, RECORDS, Contact, Counted, Point, Probe, Scene, StepRule

__all__ = [
    "Beam",
    "BeamSegment",
    "Body",
    "COUNTED",
    "Contact",
    "Counted",
    "ElasticBody",
    "End",
    "Mass",
    "Point",
    "Probe",
    "Profile",
    "RECORDS",
    "Rayleigh",
    "Rod",
    "Scene",
    "Segment",
    "Shaft",
    "StepRule",
    "Table",
    "Wall",
    "WaveBody",
]
