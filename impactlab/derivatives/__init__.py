"""Derivatives of results by numbers of a case: tangents or differences.

Tangents are those of exact runs, differences those of stepped ones.
"""

from impactlab.derivatives.run import DEFAULT, jacobian, sensitivities
from impactlab.derivatives.table import Sensitivities, Sensitivity

__all__ = ["DEFAULT", "Sensitivities", "Sensitivity", "jacobian", "sensitivities"]
