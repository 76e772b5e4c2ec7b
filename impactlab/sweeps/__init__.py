"""Sweeps: one case at many points, as one labelled result that survives interruptions."""

from impactlab.sweeps.plots import plot_sweep
from impactlab.sweeps.quantities import DEFAULT, Sampled, quantity
from impactlab.sweeps.result import counts, open_sweep
from impactlab.sweeps.run import sweep

__all__ = ["DEFAULT", "Sampled", "counts", "open_sweep", "plot_sweep", "quantity", "sweep"]
