"""Derivatives of what a run gives by numbers of its case: tangents of exact runs, differences of stepped ones."""

from impactlab.sensitivities.run import jacobian, sensitivities
from impactlab.sensitivities.table import Sensitivities, Sensitivity

__all__ = ["Sensitivities", "Sensitivity", "jacobian", "sensitivities"]
