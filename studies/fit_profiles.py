"""Figure of the page on fits: profiles of three numbers, one of which the signal only bounds from above."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

import impactlab as il
from studies.pages import CASES, Study

FORCE = "force:hammer|rod.left"
STIFFNESS, DAMPING, MASS = "contacts.0.law.stiffness", "contacts.0.law.damping", "bodies.hammer.mass"
SAMPLES, NOISE, SEED = 200, 500.0, 4  # N


def fitted() -> il.Fit:
    """Return a hammer with a cushion, fitted to its force with noise: the cushion hardly damps."""
    case = il.load_case(CASES / "axial_impact.yaml").method("continuous")
    case = case.with_("contacts.0.law", {"kind": "penalty", "stiffness": 2e8, "damping": 150.0})
    times = (np.arange(SAMPLES) + 0.5) * 3.4e-4 / SAMPLES
    noise = NOISE * np.random.default_rng(SEED).standard_normal(SAMPLES)
    signal = il.Signal(FORCE, times, il.run(case).evaluate(times, FORCE) + noise)
    bounds = {STIFFNESS: (5e7, 8e8), DAMPING: (1.0, 1e4), MASS: (0.5, 10.0)}
    return il.fit(case, signal, bounds, intervals="profile")


def draw() -> Figure:
    """Return the figure of the profiles."""
    return fitted().plot("profiles")


STUDY = Study({}, {"figures/fit_profiles.png": draw})
