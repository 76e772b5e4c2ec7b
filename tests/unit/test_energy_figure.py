"""Energy of a run as a figure: the line that the areas are compared with."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from impactlab.report.figures.balance import energy_shares
from impactlab.report.figures.style import Trace


def test_the_line_of_the_energy_follows_the_work_of_loads():
    """A mass falls onto a spring: what its weight gives is no gain."""
    case = il.Case(
        bodies={"ball": il.Mass(1.0), "floor": il.Wall()},
        contacts=[il.Contact("ball", "floor", {"kind": "penalty", "stiffness": 1e5}, gap=0.01)],
        solve={"duration": 0.06, "integrator": {"kind": "midpoint"}, "step": {"dt": 1e-5}},
        gravity=9.81,
    )
    history = il.run(case)
    axes = energy_shares(Trace("run", history, "black"), case.scene()).axes[0]
    dashed = axes.lines[-1].get_ydata()
    top = axes.lines[-2].get_ydata()
    assert np.ptp(dashed) > 0.0
    assert dashed == pytest.approx(top, abs=1e-3 * float(np.max(top)))
    assert axes.get_ylim()[1] > np.max(dashed)
