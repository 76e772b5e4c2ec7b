"""Pile driving: one blow, the bearing graph, blow after blow, the Case method and signal matching on head signals."""

from impactlab.piling.bearing import BearingGraph, bearing_graph
from impactlab.piling.blow import Blow, Head, Peak, blow
from impactlab.piling.case_method import CaseMethod, case_method
from impactlab.piling.drive import Driven, Driving, drive
from impactlab.piling.match import Match, match

__all__ = [
    "BearingGraph",
    "Blow",
    "CaseMethod",
    "Driven",
    "Driving",
    "Head",
    "Match",
    "Peak",
    "bearing_graph",
    "blow",
    "case_method",
    "drive",
    "match",
]
