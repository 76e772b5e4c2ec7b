"""Pile driving: one blow, the bearing graph, blow after blow, and the Case method on head signals."""

from impactlab.piling.bearing import BearingGraph, bearing_graph
from impactlab.piling.blow import Blow, Head, Peak, blow
from impactlab.piling.case_method import CaseMethod, case_method
from impactlab.piling.drive import Driven, Driving, drive

__all__ = [
    "BearingGraph",
    "Blow",
    "CaseMethod",
    "Driven",
    "Driving",
    "Head",
    "Peak",
    "bearing_graph",
    "blow",
    "case_method",
    "drive",
]
