"""Pile driving: blows, bearing graph, Case method and signal matching.

The Case method and signal matching use signals at the head.

    from impactlab import load_case, piling

    blow = piling.blow(load_case("smith_pile"))
    blow.set, blow.blows_per_metre, blow.peak_compression.stress

blow           one blow of a hammer: a Blow
Blow           set, blows per metre, largest stresses (Peak), energy in the pile, signals at the head (Head)
bearing_graph  blow count over the static capacity of the soil: a BearingGraph
BearingGraph   capacities, sets and blows per metre
drive          blow after blow, with residual forces between them: a Driving
Driving        the blows (Driven), and the set once it repeats
Driven         one blow of several: motion of head and toe, residual forces
case_method    resistance from force and velocity at the head, by the Case method: a CaseMethod
CaseMethod     total and static resistance, waves down and up, transferred energy
match          soil of a case fitted to measured head signals: a Match
Match          capacity and parameters with their intervals, measured and computed velocity
Head           time, force and velocity at the head
Peak           the largest stress along the pile, its place and its time
"""

from impactlab.piling.bearing import BearingGraph, bearing_graph
from impactlab.piling.blow import Blow, Head, Peak, blow
from impactlab.piling.case_method import CaseMethod, case_method
from impactlab.piling.drive import Driven, Driving, drive
from impactlab.piling.match import Match, match
from impactlab.startup.lazy import public_names

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

__dir__ = public_names(__all__)
