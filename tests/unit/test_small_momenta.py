"""A rod that is squeezed between two bodies: its final momentum follows the springs in place of hard contacts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.history import AbstractHistory
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.warnings.small_momenta import CHANGE_WARN, MIN_IMPULSES, later_openings
from tests.solving import run_case
from tests.support import codes

ROUND_TRIP = 2.0
HARD: dict[str, Any] = {"kind": "addition_deletion"}
SOFT: dict[str, Any] = {"kind": "penalty", "stiffness": {"relative": 1.0}}
SIDES = ("mass|rod.left", "rod.right|wall")


def run_of(duration: float, elements: int, law: dict[str, Any], courant: float, **bodies: Any) -> AbstractHistory:
    """Return the run of a rod of 1 kg between two bodies; exact without elements, by HHT-alpha with courant 0."""
    mesh = {"kind": "finite_element", "elements": elements, "mass": "lumped"}
    scheme, step = ("central_difference", {"courant": courant}) if courant else ("hht_alpha", {"points_per_period": 10})
    by_steps = {"model": mesh, "integrator": {"kind": scheme}, "step": step}
    material = {"young": 7.9e9, "density": 7900.0}  # waves of 1000 m/s
    rod = il.Rod(length=1000.0, area=1.0 / 7.9e6, material=material, velocity=bodies.pop("velocity", 0.0))
    gap, first = bodies.pop("gap", 0.0), next(iter(bodies))
    return run_case(
        bodies={"wall": il.Wall(), **bodies, "rod": rod},
        contacts=[
            il.Contact(first, "rod.left", law, gap=gap),
            il.Contact("rod.right", "wall", law, gap=gap),
        ],
        solve={"duration": duration * ROUND_TRIP, **(by_steps if elements else {"model": {"kind": "continuous"}})},
    )


def squeezed(mass: float, elements: int, law: dict[str, Any], courant: float = 0.9) -> AbstractHistory:
    """Return the run of such a rod between a mass of 1 m/s and a wall."""
    return run_of(1.1 * 0.5 * np.pi * mass**0.5 + 4.0, elements, law, courant, mass=il.Mass(mass, velocity=1.0))


@pytest.mark.parametrize(("mass", "elements"), [(100.0, 25), (100.0, 100), (400.0, 50)])
def test_momentum_left_over_from_large_impulses_is_wrong_under_springs_and_warned_of(
    mass: float, elements: int
) -> None:
    exact, hard, soft = squeezed(mass, 0, HARD), squeezed(mass, elements, HARD), squeezed(mass, elements, SOFT, 0.5)
    momenta = [each.at_end("momentum:rod") for each in (exact, hard, soft)]
    assert momenta[1] == pytest.approx(momenta[0], rel=0.03)  # of the mesh alone
    assert abs(momenta[2] - momenta[0]) > 0.1 * max(map(abs, momenta))
    assert "soft_contact" not in codes(hard)
    (warned,) = [each for each in soft.warnings if each.code == "soft_contact"]
    assert warned.text.startswith(f"rod: its final momentum, {momenta[2]:.3g} N s, is a small difference of impulses")
    impulses = [sum(each.impulse_of(side) for side in SIDES) for each in (exact, soft)]
    assert impulses[1] == pytest.approx(impulses[0], rel=2e-3)  # so no impulse shows it
    # The largest change of the momentum within the delay of the openings bounds its error.
    change = float(warned.text.split("by up to ")[1].split()[0])
    assert abs(momenta[2] - momenta[0]) <= change
    assert change > CHANGE_WARN * abs(momenta[2])
    # The half swing of the mass lasts pi sqrt(M C). It ends with a wave that arrives, one each half of a round trip.
    assert isinstance(soft, AbstractRecordedHistory)
    ends = [max(span.end or 0.0 for span in each.contacts) for each in (exact, soft)]
    assert ends[1] - ends[0] == pytest.approx(later_openings(soft, soft.scene.contacts), abs=0.25 * ROUND_TRIP)


def test_many_rebounds_add_up_to_large_impulses_and_leave_the_whole_momentum() -> None:
    soft = run_of(9.0, 100, SOFT, 0.5, other=il.Wall(), velocity=1.0, gap=0.5)
    assert sum(map(soft.impulse_of, soft.scene.contact_names)) > MIN_IMPULSES
    assert abs(soft.at_end("momentum:rod")) == pytest.approx(1.0, rel=0.06)  # fronts disperse
    assert "soft_contact" not in codes(soft)


def test_no_momentum_between_equal_bodies_is_right_and_not_warned_of() -> None:
    both = {"mass": il.Mass(100.0, velocity=1.0), "wall": il.Mass(100.0, velocity=-1.0)}
    soft = run_of(20.0, 40, SOFT, 0.0, **both)
    assert abs(soft.at_end("momentum:rod")) < 1e-3
    assert "soft_contact" not in codes(soft)


def test_stiffer_springs_are_right_and_not_warned_of() -> None:
    stiff = squeezed(25.0, 50, {"kind": "penalty", "stiffness": {"relative": 10.0}}, 0.2)
    assert stiff.at_end("momentum:rod") == pytest.approx(squeezed(25.0, 0, HARD).at_end("momentum:rod"), rel=0.1)
    assert "soft_contact" not in codes(stiff)
