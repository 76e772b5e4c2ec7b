"""Bounds on the energy that filtered schemes add where forces act beside their accelerations."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from impactlab.simulate.checks import gain_of, gain_remedy, reference_energy
from impactlab.simulate.gain_bounds import gain_of_forces
from impactlab.simulate.stepped_run import ready, step_through
from tests.solving import in_steps
from tests.support import codes

ROUND_TRIP, ELEMENTS, AREA, LENGTH, FORCE = 0.6 / 5000.0, 3, 1e-4, 0.3, 1000.0


def pushed(rho_inf: float, end: str | dict[str, str], pulse: float, points: int = 4) -> il.Case:
    """Return a rod that a triangular pulse of force pushes, so many seconds long up and down."""
    force = {"t": [0.0, pulse, 2.0 * pulse, 1.0], "f": [0.0, FORCE, 0.0, 0.0]}
    material = {"young": 2e11, "density": 8000.0}  # waves at 5000 m/s
    rod = il.Rod(length=LENGTH, area=AREA, material=material, ends={"left": {"force": force}, "right": end})
    model = {"kind": "finite_element", "elements": ELEMENTS, "mass": "lumped"}
    scheme = {"kind": "nonsmooth_generalised_alpha", "rho_inf": rho_inf}
    return il.Case(bodies={"rod": rod}, solve=in_steps(3.0 * ROUND_TRIP, scheme, model, points_per_period=points))


@pytest.mark.parametrize("end", ["free", {"dashpot": "200 N s/m"}, {"spring": "7e7 N/m"}])
@pytest.mark.parametrize("rho_inf", [0.0, 0.3, 0.8])
def test_the_gain_of_a_force_stays_below_its_bound(rho_inf: float, end: str | dict[str, str]) -> None:
    """The bound is (m - f)/16 dt times the integral of F^2, over the mass of the end node."""
    for pulse in (0.02 * ROUND_TRIP, 0.1 * ROUND_TRIP):
        prepared = ready(*pushed(rho_inf, end, pulse).simulation())
        plan, assembly = prepared.plan, prepared.assembly()
        assert assembly is not None
        history, _ = step_through(plan, assembly, None, 0.0)
        bound = gain_of_forces(assembly, history)
        node = 8000.0 * AREA * LENGTH / ELEMENTS / 2.0
        square = 2.0 * pulse * FORCE**2 / 3.0
        assert bound == pytest.approx((1.0 - rho_inf) / (1.0 + rho_inf) / 16.0 * assembly.dt * square / node, rel=1e-9)
        assert gain_of(history) * reference_energy(history) < bound
        assert gain_remedy(assembly, history) == "Give a smaller step."  # there is no contact to soften


def test_a_rod_under_a_short_force_is_warned_of_not_refused() -> None:
    """A force of less than a step leaves energy in the filter of the accelerations, which returns it."""
    case = pushed(0.0, {"spring": "7e7 N/m"}, 0.05 * ROUND_TRIP)
    with pytest.warns(il.DoubtfulResult, match="energy grew"):
        history = il.run(case)
    assert 0.03 < gain_of(history) < 0.1
    assert "energy_gain" in codes(history)
    finer = il.run(pushed(0.0, {"spring": "7e7 N/m"}, 0.05 * ROUND_TRIP, points=16))
    assert gain_of(finer) < 0.2 * gain_of(history)
    assert np.all(np.isfinite(finer.energy.balance))


def two_rods(ratio: float, gamma: float, order: int, integrator: str) -> il.Case:
    """Return the impact of two rods under Nitsche's method; the first has ``ratio`` times the area."""
    material = {"young": 210e9, "density": 7800}
    model = {"kind": "finite_element", "elements": 4 if order > 1 else 40, "mass": "consistent", "order": order}
    return il.Case(
        bodies={
            "striker": il.Rod(length=1.0, area=1e-4 * ratio, material=material, velocity=1.0),
            "rod": il.Rod(length=1.0, area=1e-4, material=material),
        },
        contacts=[il.Contact("striker.right", "rod.left", {"kind": "nitsche", "gamma": gamma}, gap=1e-6)],
        solve={
            "duration": "0.6 ms",
            "model": model,
            "integrator": {"kind": integrator},
            "step": {"points_per_period": 20},
        },
    )


def energies(ratio: float, theta: str) -> tuple[float, float]:
    """Return largest gain and loss in the impact of two rods of 2-node bars."""
    book = il.run(two_rods(ratio, 0.25, 1, "newmark").with_("contacts.0.law.theta", theta)).energy
    return book.largest_gain, book.largest_loss


@pytest.mark.filterwarnings("ignore::impactlab.DoubtfulResult", "ignore::impactlab.RunWarning")
@pytest.mark.parametrize("theta", ["1", "0", "-1"])
@pytest.mark.parametrize("ratio", [0.01, 10.0, 100.0])
def test_nitsches_method_for_unequal_rods_is_that_for_equal_ones(theta: str, ratio: float) -> None:
    """The areas of rods that meet at a given speed scale their forces, and nothing else.

    With S as the plain mean the energy of rods of unequal area grew without bound.
    """
    assert energies(ratio, theta) == pytest.approx(energies(1.0, theta), rel=1e-6, abs=1e-9)


def test_a_run_whose_energy_falls_without_bound_is_failed() -> None:
    """Beyond its bound Nitsche's method stores a negative energy, here 1e79 times that of the rods."""
    with pytest.raises(il.ImpactlabError, match=r"energy fell by .* more than there was") as caught:
        il.run(two_rods(1.0, 0.9, 4, "bathe"))
    assert "gamma" in caught.value.remedy
