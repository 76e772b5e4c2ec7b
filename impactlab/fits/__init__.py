"""Parameters of a case from measured signals, with how sure they are."""

from impactlab.fits.problem import read_bounds
from impactlab.fits.result import Fit, Fitted
from impactlab.fits.run import fit
from impactlab.fits.signals import Signal, read_signals

__all__ = ["Fit", "Fitted", "Signal", "fit", "read_bounds", "read_signals"]
