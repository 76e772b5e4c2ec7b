"""Fits of parameters of a case to measured signals, with confidence intervals."""

from impactlab.fits.problem import Problem
from impactlab.fits.result import Fit, Fitted
from impactlab.fits.run import fit, fit_problem
from impactlab.fits.signals import Signal
from impactlab.fits.tables import read_signals, read_tables
from impactlab.fits.unknowns import read_bounds

__all__ = ["Fit", "Fitted", "Problem", "Signal", "fit", "fit_problem", "read_bounds", "read_signals", "read_tables"]
