"""Percussive drilling: one blow on rock, and the efficiency over the stiffness of the rock.

    from impactlab import drilling, load_case

    blow = drilling.blow(load_case("drill_rod"))
    blow.efficiency, blow.final, blow.loop.force

blow          one blow on the rock: a Blow
blow_of       the same of a run that is already there
Blow          work on the rock, efficiency, largest force, penetration, energy that is left, the loop on the rock (Loop)
Loop          force on the rock and work over the penetration
sweep         efficiency over the stiffness of the rock: Efficiencies
Efficiencies  stiffness, efficiency, largest force and penetration
"""

from impactlab.drilling.blow import Blow, Loop, blow, blow_of
from impactlab.drilling.sweep import Efficiencies, sweep
from impactlab.startup.lazy import public_names

__all__ = ["Blow", "Efficiencies", "Loop", "blow", "blow_of", "sweep"]

__dir__ = public_names(__all__)
