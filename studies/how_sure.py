"""Intervals of fits: their coverage, and the figure of profiles.

The coverage is how often each kind holds the true numbers.
"""

from __future__ import annotations

import math
import warnings
from collections import Counter

import numpy as np
from matplotlib.figure import Figure

import impactlab as il
from impactlab.fits.model import Means
from impactlab.types import Array
from studies.pages import CASES, Study, filled, table

FORCE = "force:hammer|rod.left"
STIFFNESS, DAMPING, MASS = "contacts.0.law.stiffness", "contacts.0.law.damping", "bodies.hammer.mass"
SAMPLES, NOISE = 200, 500.0  # of a signal; N
SEED_OF_FIGURE = 4
TRIALS, RESAMPLES = 100, 200
CORRELATED = 0.9  # from sample to sample, of coloured noise
TIMES = (np.arange(SAMPLES) + 0.5) * 3.4e-4 / SAMPLES


def case(damping: float) -> il.Case:
    """Return a hammer with a cushion on a rod."""
    law = {"kind": "penalty", "stiffness": 2e8, "damping": damping}
    return il.load_case(CASES / "axial_impact.yaml").method("continuous").with_("contacts.0.law", law)


def clean(of: il.Case) -> Array:
    """Return the force of a case as samples, without noise."""
    return Means(il.run(of), FORCE).over(il.Signal(FORCE, TIMES, 0.0 * TIMES).edges, 0.0)


def fitted(
    of: il.Case, force: Array, noise: str = "white", intervals: str = "profile", lowest: float = 200.0
) -> il.Fit:
    """Return the case fitted to a force."""
    bounds = {STIFFNESS: (5e7, 8e8), DAMPING: (lowest, 2e4), MASS: (0.5, 10.0)}
    signal = il.Signal(FORCE, TIMES, force)
    return il.fit(of, signal, bounds, noise=noise, intervals=intervals, resamples=RESAMPLES)


def draw() -> Figure:
    """Return the figure of the profiles: the cushion hardly damps."""
    of = case(150.0)
    noise = NOISE * np.random.default_rng(SEED_OF_FIGURE).standard_normal(SAMPLES)
    return fitted(of, clean(of) + noise, lowest=1.0).plot("profiles")


def coverage() -> str:
    """Return the table of the coverage of intervals.

    It is how often the intervals of three numbers hold, by kind and noise.
    """
    warnings.simplefilter("ignore")
    of, truth = case(2000.0), {STIFFNESS: 2e8, DAMPING: 2000.0, MASS: 2.133}
    exact, rows = clean(of), []
    for correlated in (0.0, CORRELATED):
        held: Counter[str] = Counter()
        for seed in range(TRIALS):
            noise = np.random.default_rng(seed).standard_normal(SAMPLES)
            for k in range(1, SAMPLES):
                noise[k] = correlated * noise[k - 1] + math.sqrt(1.0 - correlated**2) * noise[k]
            for assumed in ("white", "ar1"):
                kinds = "profile,bootstrap" if assumed == "white" else "jacobian"
                found = fitted(of, exact + NOISE * noise, assumed, kinds)
                for path, value in truth.items():
                    for kind, (lower, upper) in found[path].intervals.items():
                        held[f"{assumed} {kind}"] += lower <= value <= upper
                    held["white lower"] += assumed == "white" and found[path].lower <= value <= found[path].upper
        share = {name: f"{100.0 * count / (TRIALS * len(truth)):.0f} %" for name, count in held.items()}
        name = f"correlates by {correlated:g} from sample to sample" if correlated else "white"
        columns = ("white jacobian", "white lower", "white profile", "white bootstrap", "ar1 jacobian")
        rows.append([name, *(share[column] for column in columns)])
    head = ["noise", "plain", "widened where residuals correlate", "profile", "bootstrap", '`noise="ar1"`']
    return table(head, rows)


STUDY = Study({"fits.md": filled({"intervals": coverage})}, {"figures/fit_profiles.png": draw})
