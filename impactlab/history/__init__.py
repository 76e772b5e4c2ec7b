"""The history of a run, and the noise floor below which touches are no events."""

from impactlab.history.arguments import within_run
from impactlab.history.base import AbstractHistory, ContactSpan, Cost, Event, Field, Warned
from impactlab.history.energy import CarriedEnergy, EnergyBook

__all__ = [
    "AbstractHistory",
    "CarriedEnergy",
    "ContactSpan",
    "Cost",
    "EnergyBook",
    "Event",
    "Field",
    "Warned",
    "within_run",
]
