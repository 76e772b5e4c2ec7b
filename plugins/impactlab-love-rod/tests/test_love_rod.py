"""Love's rod keeps the contract of models, has the frequencies of its theory, and its short waves lag."""

from __future__ import annotations

import math

import numpy as np
import pytest
from impactlab_love_rod.model import LoveRod
from scipy.linalg import eigh

from impactlab import plugins, simulate
from impactlab.banded import full
from impactlab.errors import PairingError
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.scene import End, Probe, Rayleigh, Rod, Scene, Segment, StepRule
from impactlab.testing.contracts import RodModelContract

PIECE = Segment(0.3, 9e-4, 2.1e11, 7900.0)


class TestLoveRod(RodModelContract):
    part = LoveRod(60)
    complete = True


class TestWithoutLateralInertia(RodModelContract):
    part = LoveRod(60, 0.0)
    complete = True


def rod(model: AbstractRodModel, right: str = "clamped", **more: object) -> Rod:
    return Rod("rod", (PIECE,), End("free"), End(right), model=model, **more)  # type: ignore[arg-type]


def frequencies(model: AbstractRodModel, right: str = "clamped") -> np.ndarray:
    system = model.build(rod(model, right), 0.0).operators()
    return np.sqrt(np.abs(eigh(full(system.stiffness), full(system.mass), eigvals_only=True)))


def test_it_is_registered() -> None:
    assert plugins.registry().load(plugins.MODELS, "love_rod") is LoveRod


@pytest.mark.parametrize("mode", [1, 3, 6])
def test_frequencies_of_a_clamped_rod_are_love_s_with_order_two(mode: int) -> None:
    number = (mode - 0.5) * np.pi / PIECE.length
    exact = PIECE.wave_speed * number / math.sqrt(1.0 + 0.09 * PIECE.area / (2.0 * np.pi) * number**2)
    errors = [frequencies(LoveRod(n))[mode - 1] / exact - 1.0 for n in (40, 80)]
    # The next term of the error, (k h)^2 of the first, is below a hundredth at sixth mode and 40 elements.
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.02)
    # A mesh of bars makes wave numbers (k h)^2/24 too large in frequency; lateral inertia weakens that.
    assert 0.0 < errors[1] <= (number * PIECE.length / 80) ** 2 / 24.0


def test_without_poisson_s_ratio_it_is_the_finite_element_rod() -> None:
    assert np.allclose(frequencies(LoveRod(30, 0.0)), frequencies(FiniteElement(30)), rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("poisson", [0.1, 0.3, 0.49])
def test_its_bound_of_the_highest_frequency_is_one_and_close(poisson: float) -> None:
    for right, end in (("free", End("free")), ("spring", End("spring", 1e11)), ("mass", End("mass", 1.0))):
        system = LoveRod(25, poisson).build(Rod("rod", (PIECE,), End("free"), end), 0.0).operators()
        highest = math.sqrt(eigh(full(system.stiffness), full(system.mass), eigvals_only=True)[-1])
        assert highest <= system.highest_frequency * (1.0 + 1e-12)
        if right == "free":
            assert highest > 0.99 * system.highest_frequency


def test_short_waves_lag() -> None:
    # Let go from its fifth mode, a rod swings with Love's frequency: after ten turns of the bar it is behind by
    # 10 (1 - w/w_bar) of a turn.
    number = 4.5 * np.pi / PIECE.length
    model = LoveRod(300)
    turn = float(model.exact_frequencies(rod(model), 5)[4])
    duration = 10.0 * 2.0 * np.pi / (number * PIECE.wave_speed)
    dt = duration / 4000
    shaped = rod(model, displacement=lambda x: 1e-6 * np.cos(number * x))
    history = simulate.run(
        Scene(
            "swing",
            {"rod": shaped},
            (),
            duration,
            Newmark(),
            StepRule(dt=dt),
            probes=(Probe("rod", 0.0, "displacement"),),
        )
    )
    times = dt * np.arange(4001)
    seen = history.evaluate(times, "displacement:rod@0") / 1e-6
    # Phase errors over the run: of the mesh w t (k h)^2/24 = 63 x 9e-5, of the step w t (w dt)^2/12 = 63 x 2e-5.
    assert np.max(np.abs(seen - np.cos(turn * times))) < 0.008
    lag = 10.0 * (1.0 - turn / (number * PIECE.wave_speed))
    assert lag > 0.1, "the case shows dispersion"
    assert np.max(np.abs(seen - np.cos(number * PIECE.wave_speed * times))) > 0.5


def test_it_keeps_energy_under_newmark() -> None:
    moving = rod(LoveRod(50), right="free", velocity=0.3, displacement=lambda x: 1e-6 * np.cos(9.0 * x))
    history = simulate.run(Scene("free", {"rod": moving}, (), 1e-3, Newmark(), StepRule(points_per_period=10.0)))
    # Rounding of some thousand steps.
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-10


def test_a_scheme_for_diagonal_masses_is_refused() -> None:
    scene = Scene("refused", {"rod": rod(LoveRod(20))}, (), 1e-4, CentralDifference(), StepRule(courant=0.5))
    with pytest.raises(PairingError, match="needs a diagonal mass"):
        simulate.run(scene)


def test_rayleigh_s_mass_damping_is_that_of_the_whole_mass() -> None:
    system = LoveRod(10).build(rod(LoveRod(10), damping=Rayleigh(mass=3.0)), 0.0).operators()
    assert np.allclose(full(system.damping), 3.0 * full(system.mass), rtol=1e-14, atol=0.0)
