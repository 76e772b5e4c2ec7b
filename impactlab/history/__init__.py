"""The history of a run, and the noise floor below which touches are no events."""

from impactlab.history.arguments import within_run
from impactlab.history.base import (
    AbstractHistory,
    CarriedEnergy,
    ContactSpan,
    Cost,
    EnergyBook,
    Event,
    Field,
    Warned,
)

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
