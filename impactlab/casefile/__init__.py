"""The case file room: reads, checks and builds cases. The only room that knows pydantic and YAML."""

from impactlab.casefile.blocks_in_python import Beam, Chain, Contact, Joint, Link, Mass, Mechanism, Rod, Shaft, Wall
from impactlab.casefile.case import Case, load_case

__all__ = [
    "Beam",
    "Case",
    "Chain",
    "Contact",
    "Joint",
    "Link",
    "Mass",
    "Mechanism",
    "Rod",
    "Shaft",
    "Wall",
    "load_case",
]
