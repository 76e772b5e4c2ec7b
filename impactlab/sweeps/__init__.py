"""Sweeps: one case at many points, as one labelled result that survives interruptions."""

from impactlab.sweeps.plots import plot_sweep
from impactlab.sweeps.quantities import DEFAULT, quantity
from impactlab.sweeps.result import counts, first_reason, open_sweep, rows
from impactlab.sweeps.run import sweep
from impactlab.sweeps.sampled import Sampled

__all__ = ["DEFAULT", "Sampled", "counts", "first_reason", "open_sweep", "plot_sweep", "quantity", "rows", "sweep"]
