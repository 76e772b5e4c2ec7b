"""Derivatives of results of a run by numbers of its case: tangents of exact runs, differences of stepped ones."""

from impactlab.derivatives.run import DEFAULT, jacobian, sensitivities
from impactlab.derivatives.table import Sensitivities, Sensitivity

__all__ = ["DEFAULT", "Sensitivities", "Sensitivity", "jacobian", "sensitivities"]
