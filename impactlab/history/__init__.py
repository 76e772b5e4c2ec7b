"""What every run returns, and the noise floor below which touches are no events."""

from impactlab.history.base import (
    DRIFT_ROUNDING,
    END_ROUNDING,
    SERIOUS,
    AbstractHistory,
    Array,
    CarriedEnergy,
    ContactSpan,
    Cost,
    EnergyBook,
    Event,
    Field,
    Warned,
    within_run,
)

__all__ = [
    "AbstractHistory",
    "Array",
    "CarriedEnergy",
    "ContactSpan",
    "Cost",
    "DRIFT_ROUNDING",
    "END_ROUNDING",
    "EnergyBook",
    "Event",
    "Field",
    "SERIOUS",
    "Warned",
    "within_run",
]
