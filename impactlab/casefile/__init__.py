"""The case file: reads, checks and builds cases. pydantic and YAML are used here alone."""

from impactlab.casefile.blocks_in_python import Beam, Chain, Contact, Joint, Link, Mass, Mechanism, Rod, Shaft, Wall
from impactlab.casefile.case import Case, load_case
from impactlab.casefile.probe_in_python import Probe
from impactlab.wrong_calls import names_parameters

__all__ = [
    "Beam",
    "Case",
    "Chain",
    "Contact",
    "Joint",
    "Link",
    "Mass",
    "Mechanism",
    "Probe",
    "Rod",
    "Shaft",
    "Wall",
    "load_case",
]

names_parameters(Case)
