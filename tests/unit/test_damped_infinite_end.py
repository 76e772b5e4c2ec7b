"""The infinite end of a damped rod is that of the undamped one, reflects some of a wave, and a run says so."""

import numpy as np
import pytest

import impactlab as il
from tests.support import codes

DURATION = 4e-4  # s; no wave comes back from the end of the long rod within it
STEEL = {"young": 2.1e11, "density": 7850}


def struck(length, elements, ends, material=STEEL, **damping):
    """Return the run of a mass that strikes a damped rod of a length [m]."""
    rod = il.Rod(length=length, area=3e-4, material=material, ends=ends, **({"damping": damping} if damping else {}))
    return il.run(
        il.Case(
            bodies={"mass": il.Mass(0.8, velocity=2.0), "rod": rod},
            contacts=[il.Contact("mass", "rod.left", {"kind": "penalty", "stiffness": 1e9})],
            solve={
                "duration": DURATION,
                "model": {"kind": "finite_element", "elements": elements},
                "integrator": {"kind": "newmark"},
                "step": {"dt": "0.5 us"},
            },
        )
    )


@pytest.mark.parametrize(
    ("damping", "warned"),
    [
        ({"mass": "3000 1/s"}, True),
        ({"stiffness": "2e-6 s"}, True),
        ({}, False),
        ({"mass": "50 1/s"}, False),
        ({"stiffness": "5e-9 s"}, False),
    ],
)
def test_where_it_reflects_more_than_a_hundredth_the_run_warns(damping, warned):
    """The mass on a rod six times as long moves otherwise by up to 4 % of its speed."""
    times = np.linspace(0.0, DURATION, 81)
    ended = struck(0.3, 30, {"right": "infinite"}, **damping)
    long = struck(1.8, 180, {}, **damping)
    apart = np.abs(ended.evaluate(times, "velocity:mass") - long.evaluate(times, "velocity:mass")).max()
    assert apart > 0.003 * 2.0 if warned else apart < 0.002 * 2.0
    assert codes(ended) == ({"damped_infinite_end"} if warned else set())
    assert "damped_infinite_end" not in codes(long)


def test_viscosity_counts_as_damping_by_stiffness():
    viscous = struck(0.3, 30, {"right": "infinite"}, material={**STEEL, "viscosity": 2e-6 * 2.1e11})
    damped = struck(0.3, 30, {"right": "infinite"}, stiffness="2e-6 s")
    texts = [[each.text for each in run.warnings if each.code == "damped_infinite_end"] for run in (viscous, damped)]
    assert texts[0] == texts[1] != []
