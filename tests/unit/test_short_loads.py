"""A pulse of an end force that is shorter than a step is warned of."""

import numpy as np
import pytest

import impactlab as il
from impactlab.scene.bodies.loads import SampledLoad
from impactlab.simulate.warnings.ends import shortest_pulse


def codes(force, step, model=None):
    rod = il.Rod(length=0.3, area=9e-4, material="steel", ends={"left": {"force": force}, "right": "clamped"})
    case = il.Case(
        bodies={"rod": rod, "mass": il.Mass(1.0)},
        contacts=[il.Contact("mass", "rod.left", {"kind": "hertz", "stiffness": 1e9}, gap=1e-3)],
        solve={"duration": 1e-4, "model": model or {"kind": "modal", "modes": 20}, "step": {"dt": step}},
    )
    return [warned.code for warned in il.run(case).warnings]


@pytest.mark.filterwarnings("ignore::impactlab.DoubtfulResult")
@pytest.mark.parametrize(("step", "warned"), [(1e-6, True), (1e-8, False)])
def test_a_pulse_shorter_than_a_step_is_warned_of(step, warned):
    pulse = {"t": [0.0, 2e-5, 2.005e-5, 2.01e-5], "f": [0.0, 0.0, 1e4, 0.0]}
    assert ("short_load" in codes(pulse, step)) is warned
    assert ("short_load" in codes(pulse, step, {"kind": "continuous"})) is warned  # it steps under this law


@pytest.mark.filterwarnings("ignore::impactlab.DoubtfulResult")
@pytest.mark.parametrize("force", [1e4, {"t": [0.0, 1e-4], "f": [0.0, 1e4]}, "1e4*sin(3.1e4*t)", "1e4*exp(-t/1e-5)"])
def test_a_force_that_lasts_is_not(force):
    assert "short_load" not in codes(force, 1e-6)


def test_pulses_last_their_impulse_over_their_largest_force():
    assert shortest_pulse(SampledLoad((0.0, 1.0, 2.0), (0.0, 3.0, 0.0)), 5.0) == pytest.approx(1.0)
    assert shortest_pulse(SampledLoad((1.0, 1.1, 1.2, 3.0, 3.5, 4.0), (0.0, 3.0, 0.0, 0.0, -3.0, 0.0)), 5.0) == (
        pytest.approx(0.1)
    )
    # The ripple of a measured force is no pulse, and no force has none.
    times = np.linspace(0.0, 1.0, 2001)
    ripple = 1e-3 * np.sin(3e3 * times)
    found = shortest_pulse(
        SampledLoad(tuple(times.tolist()), tuple((np.maximum(times - 0.5, 0.0) + ripple).tolist())), 1.0
    )
    assert found > 0.1
    assert shortest_pulse(SampledLoad((0.0, 1.0), (0.0, 0.0)), 1.0) == np.inf
