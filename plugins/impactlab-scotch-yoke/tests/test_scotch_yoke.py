"""The Scotch yoke: contract of mechanisms, closed forms of its motion and impacts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from impactlab_scotch_yoke.mechanism import ScotchYoke
from scipy.integrate import solve_ivp

import impactlab as il
from impactlab import plugins
from impactlab.casefile.path_units import unit_of
from impactlab.errors import ImpactlabError
from impactlab.testing.contracts import MechanismContract

J, R, M = 0.5, 0.1, 4.0  # kg m2, m, kg
YOKE = {"kind": "scotch_yoke", "flywheel": J, "radius": R, "slider": M}


class TestHeavyFlywheel(MechanismContract):
    part = ScotchYoke(J, R, M, rate=20.0)


class TestHeavySlider(MechanismContract):
    part = ScotchYoke(0.02, 0.2, 3.0, angle=2.0, torque=5.0)


def test_it_is_registered() -> None:
    assert plugins.registry().load(plugins.MECHANISMS, "scotch_yoke") is ScotchYoke


def inertia(angle: Any) -> Any:
    """Return J + m r^2 sin^2(angle) [kg m2]."""
    return J + M * R**2 * np.sin(angle) ** 2


def case(duration: float, dt: float, *, between: tuple[str, str], gap: float, law: Any, **more: Any) -> il.Case:
    """Return a case of a yoke, a wall and a block of 1.5 kg."""
    yoke = YOKE | {key: more.pop(key) for key in ("angle", "rate", "torque") if key in more}
    document = {
        "schema_version": 1,
        "bodies": {"stop": {"kind": "wall"}, "block": {"kind": "mass", "mass": 1.5}},
        "mechanisms": {"press": yoke},
        "contacts": [{"between": list(between), "gap": gap, "law": law}],
        "solve": {"duration": duration, "integrator": {"kind": "midpoint"}, "step": {"dt": dt}},
    }
    return il.Case.from_dict(document | more)


def free(duration: float, dt: float, **more: Any) -> il.Case:
    """Return a case whose wall is out of reach."""
    hertz = {"kind": "hertz", "stiffness": 1e9}
    return case(duration, dt, between=("press.slider", "stop"), gap=1.0, law=hertz, **more)


def test_the_rate_over_the_turn_follows_from_the_energy_at_second_order() -> None:
    errors = []
    for dt in (2e-4, 1e-4):
        history = il.run(free(0.4, dt, angle=0.3, rate=20.0))
        times = np.arange(0.0, 0.4, 1e-3)
        angle, rate = (history.evaluate(times, f"{name}:press.flywheel") for name in ("angle", "rate"))
        assert angle[-1] > 2.0 * math.pi
        errors.append(float(np.max(np.abs(rate / (20.0 * np.sqrt(inertia(0.3) / inertia(angle))) - 1.0))))
    assert errors[1] < 1e-7
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def adaptively(given: il.Case, tolerance: float) -> il.Case:
    """Return a case solved by adaptive steps, no longest one given."""
    scheme = {"kind": "adaptive", "relative_tolerance": tolerance}
    return given.with_settings({"solve.integrator": scheme, "solve.step": {"points_per_period": 10}})


def test_adaptive_steps_keep_the_closed_form_of_the_rate() -> None:
    history = il.run(adaptively(free(0.4, 1e-4, angle=0.3, rate=20.0), 1e-11))
    times = np.linspace(0.0, 0.4, 20001)  # the recorded instants
    angle, rate = (history.evaluate(times, f"{name}:press.flywheel") for name in ("angle", "rate"))
    assert float(np.max(np.abs(rate / (20.0 * np.sqrt(inertia(0.3) / inertia(angle))) - 1.0))) < 1e-9


def test_torque_and_gravity_do_the_work_that_the_energy_grows_by() -> None:
    history = il.run(free(0.3, 1e-4, angle=0.4, rate=5.0, torque=8.0, gravity=-9.81))
    angle, rate = (float(history.evaluate(0.3, f"{name}:press.flywheel")) for name in ("angle", "rate"))
    grown = 0.5 * inertia(angle) * rate**2 - 0.5 * inertia(0.4) * 5.0**2
    assert grown == pytest.approx(8.0 * (angle - 0.4) - M * 9.81 * R * (math.cos(angle) - math.cos(0.4)), rel=1e-6)


def test_its_options_have_their_units_in_sweeps() -> None:
    given, registry = free(1e-3, 1e-5), plugins.registry()
    units = [unit_of(given.checked, f"mechanisms.press.{key}", registry) for key in ("flywheel", "radius", "rate")]
    assert units == ["kg m2", "m", "rad/s"]


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_on_a_hard_stop_it_turns_back_with_the_restitution(restitution: float) -> None:
    """Impulse and rate after a hard stop follow from the restitution.

    The impulse is (1 + e) J(angle) rate/(r |sin angle|), after it the rate is -e times as large: one coordinate, one
    reading.
    """
    law = {"kind": "impulse_momentum", "restitution": restitution}
    start, at = -2.0, -math.pi / 3.0
    gap = R * (math.cos(at) - math.cos(start))
    history = il.run(case(0.07, 2e-6, between=("press.slider", "stop"), gap=gap, law=law, angle=start, rate=20.0))
    struck = 20.0 * math.sqrt(inertia(start) / inertia(at))
    [first, *_] = history.contacts
    impulse = (1.0 + restitution) * inertia(at) * struck / (R * abs(math.sin(at)))
    assert first.first_impulse == pytest.approx(impulse, rel=1e-4)
    assert first.start < 0.07
    if restitution > 0.0:
        angle, rate = (float(history.evaluate(0.07, f"{name}:press.flywheel")) for name in ("angle", "rate"))
        assert rate == pytest.approx(-restitution * struck * math.sqrt(inertia(at) / inertia(angle)), rel=1e-4)


def press(stiffness: float, dt: float, duration: float = 0.06) -> il.Case:
    hertz = {"kind": "hertz", "stiffness": stiffness}
    return case(
        duration, dt, between=("press.slider", "block"), gap=0.1, law=hertz, angle=-2.0 * math.pi / 3, rate=20.0
    )


def test_a_block_is_struck_as_by_the_effective_mass_of_the_slider() -> None:
    """A short impact is that of the mass J(angle)/(r sin angle)^2.

    It is compared with Hertz's closed form, and is the closer the harder it is.
    """
    at = -math.pi / 3.0
    speed = -R * math.sin(at) * 20.0  # the inertia is that at the start
    slider = inertia(at) / (R * math.sin(at)) ** 2
    reduced = slider * 1.5 / (slider + 1.5)
    errors = []
    for stiffness, dt in ((1e9, 1e-6), (3.2e10, 2.5e-7)):  # four times as short
        [span] = il.run(press(stiffness, dt, 0.054)).contacts
        depth = (1.25 * reduced * speed**2 / stiffness) ** 0.4
        assert span.peak_force == pytest.approx(stiffness * depth**1.5, rel=2e-2)
        assert span.end - span.start == pytest.approx(2.9432 * depth / speed, rel=2e-2)
        errors.append(span.impulse / (2.0 * reduced * speed) - 1.0)
    assert abs(errors[1]) < 5e-3
    assert abs(errors[1]) < 0.5 * abs(errors[0])


def test_a_block_is_struck_as_two_equations_give() -> None:
    stiffness, start = 1e9, -2.0 * math.pi / 3.0
    face = 0.1 + R * math.cos(start)

    def force(angle: float, moved: float) -> float:
        return float(stiffness * max(0.0, R * math.cos(angle) - face - moved) ** 1.5)

    def rates(_t: float, y: Any) -> list[float]:
        angle, rate, moved, speed, _ = y
        push = force(angle, moved)
        turning = push * R * math.sin(angle) - M * R**2 * math.sin(angle) * math.cos(angle) * rate**2
        return [rate, turning / inertia(angle), speed, push / 1.5, push]

    exact = solve_ivp(
        rates, (0.0, 0.06), [start, 20.0, 0.0, 0.0, 0.0], method="DOP853", rtol=1e-11, atol=1e-13, max_step=1e-5
    )
    angle, rate, moved, speed, impulse = exact.y[:, -1]
    for given, within in ((press(stiffness, 1e-6), 1e-6), (adaptively(press(stiffness, 1e-6), 1e-11), 1e-9)):
        history = il.run(given)
        assert [span.impulse for span in history.contacts] == pytest.approx([impulse], rel=within)
        for channel, value in (
            ("angle:press.flywheel", angle),
            ("rate:press.flywheel", rate),
            ("position:block", moved),
            ("velocity:block", speed),
            ("position:press.slider", R * math.cos(angle)),
        ):
            assert float(history.evaluate(0.06, channel)) == pytest.approx(value, rel=within)


@pytest.mark.parametrize(
    ("edit", "text"),
    [
        ({"mechanisms.press": {"kind": "scotch_yok"}}, "Did you mean 'scotch_yoke'"),
        ({"mechanisms.press.flywheel": -1.0}, "out of range"),
        ({"mechanisms.press.slider": "4 m"}, "kg"),
        ({"contacts.0.between": ["press.slide", "stop"]}, "has no face 'slide'. Did you mean 'slider'"),
        ({"contacts.0.between": ["press.flywheel", "stop"]}, "has no face 'flywheel'"),
        ({"contacts.0.between": ["press", "stop"]}, "its face must be named"),
        ({"contacts.0.along": "x"}, "no link meets here"),
        ({"solve.integrator": {"kind": "newmark"}}, "Allowed: midpoint, adaptive"),
    ],
)
def test_a_wrong_case_is_refused(edit: dict[str, Any], text: str) -> None:
    with pytest.raises(ImpactlabError) as refused:
        il.run(free(1e-3, 1e-5).with_settings(edit))
    assert text in str(refused.value)
