"""Derivatives of results by numbers of a case: tangents or differences.

Exact runs have tangents, stepped runs differences; so have exact runs at points where tangents do not exist.
"""

from impactlab.derivatives.run import DEFAULT, jacobian, sensitivities
from impactlab.derivatives.table import Sensitivities, Sensitivity

__all__ = ["DEFAULT", "Sensitivities", "Sensitivity", "jacobian", "sensitivities"]
