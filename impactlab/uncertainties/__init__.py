"""Uncertain numbers of a case: distributions in, percentiles, probabilities and Sobol indices out."""

from impactlab.uncertainties.distributions import read_vary
from impactlab.uncertainties.records import Estimate, Index, Share, Spread
from impactlab.uncertainties.result import Uncertainty
from impactlab.uncertainties.run import DEFAULT, uncertainty

__all__ = ["DEFAULT", "Estimate", "Index", "Share", "Spread", "Uncertainty", "read_vary", "uncertainty"]
