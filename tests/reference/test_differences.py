"""Derivatives of stepped runs by differences: against the reference in high precision, and where they are withheld."""

from __future__ import annotations

import dataclasses
import math

import pytest

import impactlab as il
from impactlab.derivatives.differences import differences
from impactlab.sweeps.quantities import quantities_of
from tests.reference.waves_mp import Struck, derivative, log_derivative
from tests.solving import in_steps, mesh
from tests.support import PAPER

STRUCK = Struck(stiffness=20, gap="0.05", duration=2)
MASS, GAP = "bodies.hammer.mass", "contacts.0.gap"
COARSE = {"kind": "finite_element", "elements": 100, "mass": "lumped"}
QUANTITIES = ("final_velocity", "first_opening", "impulse", "peak_force")


def stepped(law=None, gap=0.05, **solve):
    """The struck rod of the reference in elements; E = rho = A = v0 = 1."""
    rod = il.Rod(length=0.5, area=1.0, material={"young": 1.0, "density": 1.0}, ends={"right": "clamped"})
    return il.Case(
        name="stepped",
        bodies={"hammer": il.Mass(mass=0.5, velocity=1.0), "rod": rod},
        contacts=[il.Contact("hammer", "rod.left", law or {"kind": "penalty", "stiffness": 20.0}, gap=gap)],
        solve=in_steps({"round_trips": 2}, "central_difference", mesh(400, "lumped"), courant=0.9) | solve,
    )


def found(case, path, names):
    """The first difference of each quantity: of the contact or the hammer."""
    wanted = quantities_of(case.scene(), names, case.registry)
    return {each.name: row[0] for each, row in zip(wanted, differences(case, path, wanted), strict=True)}


def test_derivatives_by_the_mass_lie_within_stated_errors_below_3_percent():
    for name, each in found(stepped(), MASS, QUANTITIES).items():
        scale = 0.5 / each.value
        assert abs(each.derivative * scale - float(log_derivative(name, "mass", STRUCK))) <= each.error * abs(scale)
        assert each.error <= 0.03 * abs(each.derivative)
        assert each.reason == ""


@pytest.mark.parametrize("path", ["bodies.rod.length", "bodies.rod.material.young"])
def test_the_end_of_a_run_in_round_trips_moves_with_the_rod(path):
    name = {"young": "modulus"}.get(path.rpartition(".")[2], path.rpartition(".")[2])
    # in contact, the velocity of the mass changes with the end of the run, T = 2 L sqrt(rho/E)
    case = stepped(duration={"round_trips": 1.5}, model={"kind": "finite_element", "elements": 100, "mass": "lumped"})
    moving = found(case, path, ["final_velocity"])["final_velocity"]
    fixed = found(case.with_("solve.duration", 1.5), path, ["final_velocity"])["final_velocity"]
    at_end = dataclasses.replace(STRUCK, duration="1.5")
    by_time = (
        float(derivative("final_velocity", "duration", at_end)) * 1.5 * {"length": 2.0, "modulus": -0.5}.get(name, 0.0)
    )
    expected = float(derivative("final_velocity", name, at_end))
    assert fixed.derivative == pytest.approx(expected, abs=3.0 * fixed.error)
    assert moving.derivative == pytest.approx(expected + by_time, abs=3.0 * moving.error)


@pytest.mark.parametrize("gap", [0.0395, 0.04, 0.041])
def test_a_gap_of_a_few_steps_is_varied_by_as_many_steps_as_it_allows(gap):
    """Half of the gap is 4.4 steps, less than the five of an event: the opening is later by the gap all the same."""
    each = found(stepped(gap=gap, model=COARSE), GAP, ["first_opening"])["first_opening"]
    assert each.derivative == pytest.approx(1.0, abs=0.02)
    assert each.reach >= 0.5 * gap


@pytest.mark.parametrize("method", ["base", "finite_element", "penalty_fe"])
def test_the_opening_moves_with_the_gap_as_the_mass_takes_to_cross_it(method):
    # differences over less than a step would give anything, as the opening jumps by a step
    case = il.load_case(PAPER).with_(GAP, 6e-6).method(method)
    each = found(case, GAP, ["first_opening"])["first_opening"]
    assert each.derivative == pytest.approx(1.0, abs=3.0 * each.error)
    assert each.error < 0.1


def test_a_parameter_that_is_zero_is_shifted_by_its_scale():
    each = found(stepped(), "gravity", ["final_velocity"])["final_velocity"]
    exact = stepped(model={"kind": "continuous"})
    ends = [float(il.run(exact.with_("gravity", g)).evaluate(2.0, "velocity:hammer")) for g in (-1e-4, 1e-4)]
    assert each.derivative == pytest.approx((ends[1] - ends[0]) / 2e-4, abs=3.0 * each.error)
    assert each.error < 1e-3


def test_a_step_at_the_limit_is_shortened_where_a_shifted_run_is_beyond_it():
    case = stepped(model=COARSE, step={"courant": 0.98})
    each = found(case, "bodies.rod.length", ["first_opening"])["first_opening"]
    assert each.derivative == pytest.approx(float(derivative("first_opening", "length", STRUCK)), abs=3.0 * each.error)
    with pytest.raises(il.CaseError, match="stability limit"):
        il.run(
            case.with_settings(
                [("bodies.rod.length", 0.488), ("solve.step", {"dt": 0.98 * 0.5 / 100}), ("solve.duration", 2.0)]
            )
        )


def test_a_step_at_the_limit_has_coarser_meshes_for_its_error():
    """Of 200/1.618 elements the nearest whole number, 124, is too large for a step 1.618 times as long."""
    model = {"kind": "finite_element", "elements": 200, "mass": "lumped"}
    hard = stepped({"kind": "addition_deletion"}, gap=0.0, model=model, step={"courant": 1.0})
    each = found(hard, MASS, ["first_opening"])["first_opening"]
    assert each.reason == ""
    assert each.derivative * 0.5 / each.value == pytest.approx(0.392155560966, rel=1e-3)


def test_counts_and_switches_have_no_derivative():
    given = found(stepped(), MASS, ["contacts", "near_grazing", "impulse"])
    assert math.isnan(given["contacts"].derivative)
    assert given["contacts"].reason == "a number of periods of contact has no derivative"
    assert "on or off" in given["near_grazing"].reason
    assert given["contacts"].value == 1.0
    assert given["impulse"].reason == ""


CHATTERING = stepped({"kind": "penalty", "stiffness": {"relative": 1.0}}, model=COARSE, integrator={"kind": "newmark"})


@pytest.mark.parametrize(
    ("case", "path", "name", "reason"),
    [
        # at a ratio of masses of 1.0105; from 1.0107 on there is no second contact
        (
            il.load_case(PAPER).method("continuous").with_(MASS, 2.133 / 1.0105),
            MASS,
            "impulse",
            "contacts changes within",
        ),
        (stepped(gap=0.0), "contacts.0.law.damping", "impulse", "a run with another value is not possible"),
        (CHATTERING, GAP, "first_opening", "mostly from"),
        (stepped(duration={"round_trips": 1}), MASS, "first_opening", "does not give this quantity"),
    ],
)
def test_derivatives_are_withheld_with_a_reason(case, path, name, reason):
    each = found(case, path, [name])[name]
    assert math.isnan(each.derivative)
    assert reason in each.reason


def test_the_table_of_a_stepped_case_shows_differences_with_their_errors():
    case = stepped(model=COARSE)
    rows = il.sensitivities(case, [MASS, "contacts.0.law.damping"], ["impulse", "contacts"])
    by_mass, count = rows.find("impulse", MASS), rows.find("contacts", MASS)
    expected = found(case, MASS, ["impulse"])["impulse"]
    assert by_mass.found == "differences"
    assert (by_mass.derivative, by_mass.error) == pytest.approx((expected.derivative, expected.error), rel=1e-6)
    assert by_mass.lower < 0.99 * by_mass.parameter_value < 1.01 * by_mass.parameter_value < by_mass.upper
    assert (count.found, count.reason) == ("withheld", "a number of periods of contact has no derivative")
    assert "not possible" in rows.find("impulse", "contacts.0.law.damping").reason
