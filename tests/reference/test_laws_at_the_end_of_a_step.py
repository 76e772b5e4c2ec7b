"""Losses of laws under generalised-alpha, whose force acts at the end of a step, in closed form."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import impactlab as il
from impactlab.contact import hysteresis
from impactlab.contact.smith import Smith
from impactlab.history import AbstractHistory
from impactlab.numerics.compiling import plain
from impactlab.simulate.stepping.ports import fill_acting
from impactlab.types import Port, SideFacts
from tests.solving import run_case

STIFFNESS, SPEED = 1e6, 1.0  # N/m, m/s, with 1 kg: w = 1000/s, a contact lasts some 3 ms
LINKS = ("slack", "elastic_plastic", "smith")
ANYWHERE = SideFacts("mass", 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0)


def on_a_wall(law: dict[str, Any], dt: float, duration: float = 0.02) -> AbstractHistory:
    """Return 1 kg at 1 m/s that meets a wall."""
    gap = None if law["kind"] in LINKS else 1.3217e-4
    return run_case(
        bodies={"m": il.Mass(1.0, velocity=SPEED), "w": il.Wall()},
        contacts=[il.Contact("m", "w", law, gap=gap)],
        solve={"duration": duration, "integrator": {"kind": "generalised_alpha"}, "step": {"dt": dt}},
    )


def booked(history: AbstractHistory) -> float:
    """Return the loss booked for contacts over the initial energy."""
    return float(history.energy.booked["contact"][-1]) / (0.5 * SPEED**2)


@pytest.mark.parametrize(
    ("law", "lost"),
    [
        ({"kind": "slack", "stiffness": STIFFNESS}, 0.0),
        ({"kind": "slack", "stiffness": STIFFNESS, "slack": 2e-4}, 0.0),
        ({"kind": "bilinear", "stiffness": STIFFNESS, "restitution": 1.0}, 0.0),
        ({"kind": "bilinear", "stiffness": STIFFNESS, "restitution": 0.6}, 1.0 - 0.6**2),
        # It yields once; the elastic energy F^2/2k at the turning point swings between the two yield forces from then.
        ({"kind": "elastic_plastic", "stiffness": STIFFNESS, "yield_force": 300.0}, 1.0 - 300.0**2 / STIFFNESS),
        ({"kind": "smith", "capacity": 300.0, "quake": 3e-4, "tension": False}, 1.0 - 300.0**2 / STIFFNESS),
    ],
)
def test_losses_are_those_of_the_law(law: dict[str, Any], lost: float) -> None:
    """Laws without loss booked a fifth to a half of the energy as lost, and the run warned of the gain that made.

    Here w dt = 0.02, and the errors are of the order of its square.
    """
    history = on_a_wall(law, 2e-5)
    assert booked(history) == pytest.approx(lost, abs=0.02**2)
    assert history.energy.largest_gain < 0.02**2
    assert not [warning for warning in history.warnings if warning.code == "energy_gain"]


@pytest.mark.parametrize("zeta", [0.2, 0.6])
def test_a_dashpot_takes_the_energy_of_the_spring_at_the_release(zeta: float) -> None:
    """At the release the spring still held 5 % of the energy, for any step, and nothing booked it.

    The restitution is that of docs/theory/contact-laws.md. The touch within a step leaves a first-order error: the
    dashpot's energy of some step, 2 zeta w dt of that of the mass times 2.
    """
    restitution = np.exp(-2.0 * zeta * np.arccos(zeta) / np.sqrt(1.0 - zeta**2))
    law = {"kind": "penalty", "stiffness": STIFFNESS, "damping": 2.0 * zeta * np.sqrt(STIFFNESS)}
    for dt in (5e-6, 2.5e-6):
        history = on_a_wall(law, dt, 8e-3)
        step = 2.0 * 2.0 * zeta * np.sqrt(STIFFNESS) * dt
        assert booked(history) == pytest.approx(1.0 - restitution**2, abs=step)
        assert history.energy.largest_loss < step


@pytest.mark.parametrize(
    ("law", "hysteresis"), [("hunt_crossley", 1.5 * 0.5), ("lankarani_nikravesh", 0.75 * 0.75), ("flores", 1.6)]
)
def test_hysteresis_takes_the_loss_of_its_restitution(law: str, hysteresis: float) -> None:
    """The damping force at the end of a step times its travel was booked: 1 % too much, of the order of the step.

    The true restitution is the root of the equation in docs/theory/contact-laws.md, with b = a v0.
    """
    b = hysteresis

    def balance(e: float) -> float:
        return b - math.log1p(b) + b * e + math.log1p(-b * e)

    restitution = brentq(balance, 1e-6, min(1.0, (1.0 - 1e-9) / b))
    history = on_a_wall({"kind": law, "stiffness": 3e7, "restitution": 0.5}, 2e-5)
    assert booked(history) == pytest.approx(1.0 - restitution**2, abs=0.02**2)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 0.02**2


def test_smiths_dashpot_is_of_second_order() -> None:
    """Its size was that of the middle of the step, where the rest of the force is that of the end."""
    law = {"kind": "smith", "capacity": 1e9, "quake": 1e9 / STIFFNESS, "damping": 0.3}
    exact = solve_ivp(
        lambda _, y: [y[1], -STIFFNESS * y[0] - 0.3 * STIFFNESS * abs(y[0]) * y[1]],
        (0.0, 0.01), [0.0, SPEED], rtol=1e-11, atol=1e-15, max_step=1e-5,
    ).y[0, -1]  # fmt: skip
    errors = []
    for dt in (4e-5, 2e-5, 1e-5):
        history = on_a_wall(law, dt, 0.01)
        errors.append(abs(float(history.evaluate(0.01, "position:m")) - exact))
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]


def test_the_end_of_a_step_is_found_beside_any_dashpot() -> None:
    """A dashpot J |Rs| v fades as it unloads the soil: the overlap may lie beyond that under its first force."""
    random = np.random.default_rng(1)
    for _ in range(300):
        law = Smith(300.0, 3e-4, float(10.0 ** random.uniform(-2.0, 1.5)), tension=bool(random.integers(0, 2)))
        port, dt = Port(), float(10.0 ** random.uniform(-5.0, -2.0))
        begun = law.begin(ANYWHERE, ANYWHERE, dt)
        port.parameters[: len(begun.parameters)] = [*begun.parameters]
        port.dt, port.gap_per_force, port.rate_per_force = dt, 0.3 * dt * dt, 0.6 * dt
        port.gap, port.gap_rate = random.normal(0.0, 3e-4), random.normal(0.0, 3.0)
        port.free_gap, port.free_gap_rate = port.gap + dt * port.gap_rate, port.gap_rate
        plain(fill_acting)(port, 1.0)
        overlap = plain(hysteresis.end_of_step)(port)
        moved = port.gap_per_force * plain(hysteresis.total_at)(port, overlap)
        scale = abs(overlap) + abs(port.free_gap) + abs(moved)
        assert abs(overlap + port.free_gap + moved) <= 1e-12 * scale


@pytest.mark.parametrize("begun", [0.0, 3e-6, 1.37e-4])  # at once, in the first step, and later
@pytest.mark.parametrize("scheme", ["generalised_alpha", "central_difference"])
def test_the_dashpot_of_a_toe_acts_from_its_touch(scheme: str, begun: float) -> None:
    """Where the toe meets the soil the force jumps to J Ru v: the set was off by 3e-6 m at 2e-5 s and by half at 1e-5.

    On the elastic branch x'' = -w^2 x - c x' from the touch to the quake, then v' = -(Ru + c v), to rest at the set.
    """
    capacity, quake, damping = 300.0, 3e-4, 150.0
    omega, decay = math.sqrt(capacity / quake), 0.5 * damping
    swing = math.sqrt(omega**2 - decay**2)

    def elastic(t: float) -> float:
        return math.exp(-decay * t) * math.sin(swing * t) / swing * SPEED

    t = brentq(lambda t: elastic(t) - quake, 0.0, 1e-3, xtol=1e-18)
    speed = SPEED * math.exp(-decay * t) * math.cos(swing * t) - decay * elastic(t)
    end = speed / damping - capacity / damping**2 * math.log1p(damping * speed / capacity)
    law = {"kind": "smith", "capacity": capacity, "quake": quake, "damping": 0.5, "rule": "viscous", "tension": False}
    case = il.Case(
        bodies={"m": il.Mass(1.0, velocity=SPEED), "w": il.Wall()},
        contacts=[il.Contact("m", "w", {**law, "set": begun})],
        solve={"duration": 8e-3, "integrator": {"kind": scheme}, "step": {"dt": 1e-5}},
    )
    (link,) = il.run(case).links
    assert link.set == pytest.approx(begun + end, abs=5e-8)


def test_a_bond_books_the_loss_of_a_plastic_impact() -> None:
    """Masses of 1 kg at 2 m/s and at rest lose 1 J; their bond booked 1.94 J, as its force overshoots."""
    case = il.Case(
        bodies={"a": il.Mass(1.0, velocity=2.0), "b": il.Mass(1.0)},
        contacts=[il.Contact("a", "b", {"kind": "bonded"})],
        solve={"duration": 2e-3, "integrator": {"kind": "generalised_alpha"}, "step": {"dt": 1e-4}},
    )
    history = il.run(case)
    assert float(history.energy.booked["contact"][-1]) == pytest.approx(1.0, rel=1e-12)
    assert history.energy.largest_gain < 0.01  # of the filter, in the first steps
    np.testing.assert_allclose(history.evaluate([1e-3, 2e-3], "velocity:b"), 1.0, rtol=1e-12)
