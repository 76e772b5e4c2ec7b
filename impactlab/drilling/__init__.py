"""Percussive drilling: one blow on rock, and the efficiency over the stiffness of the rock."""

from impactlab.drilling.blow import Blow, Loop, blow, blow_of
from impactlab.drilling.sweep import Efficiencies, sweep

__all__ = ["Blow", "Efficiencies", "Loop", "blow", "blow_of", "sweep"]
