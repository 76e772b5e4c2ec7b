"""Sensitivities where a front arrives at the very end of a run, and where the largest force is a constant one."""

from __future__ import annotations

import math

import pytest

import impactlab as il

pytestmark = pytest.mark.slow  # the march with tangents takes most of a minute to compile

HARD = {"kind": "wave_identification"}
YOUNG, MASS = "bodies.rod.material.young", "bodies.hammer.mass"
Z, T, M = 1.0e4, 2.0e-4, 1.0  # impedance, round trip and mass of the hammer, which strikes with 1 m/s


def struck(duration: float | dict[str, float], far_end: str = "clamped") -> il.Case:
    rod = {"kind": "rod", "length": 0.5, "area": 2.5e-4, "material": {"young": 2e11, "density": 8000.0}}
    rod["ends"] = {"right": far_end}
    bodies = {"hammer": {"kind": "mass", "mass": M, "velocity": 1.0}, "rod": rod}
    solve = {"duration": duration, "model": {"kind": "continuous"}}
    contacts = [{"between": ["hammer", "rod.left"], "law": HARD}]
    return il.Case.from_dict({"schema_version": 1, "bodies": bodies, "contacts": contacts, "solve": solve})


def test_a_front_at_the_end_of_the_run_leaves_both_one_sided_derivatives() -> None:
    """The force is Z exp(-Z t/M) until T, when the front comes back and adds 2 Z: all by hand."""
    found = il.sensitivities(struck(T), ["solve.duration", YOUNG], ["impulse", "final_velocity", "peak_force"])
    force = Z * math.exp(-Z * T / M)
    row = found.find("impulse", "solve.duration")
    assert row.found == "withheld"
    assert (row.below, row.above) == pytest.approx((force, force + 2.0 * Z), rel=1e-4)
    row = found.find("final_velocity", "solve.duration", "hammer")
    assert (row.below, row.above) == pytest.approx((-force / M, -(force + 2.0 * Z) / M), rel=1e-4)
    # A stiffer rod has the impedance Z sqrt(E/E0), and its front comes by T/(2 E0) per unit of E earlier.
    below = math.exp(-Z * T / M) * T / M * Z / (2.0 * 2e11) * M
    row = found.find("impulse", YOUNG)
    assert (row.below, row.above) == pytest.approx((below, below + 2.0 * Z * T / (2.0 * 2e11)), rel=1e-4)
    for parameter in ("solve.duration", YOUNG):  # the peak jumps from Z to (2 + exp(-2)) Z
        row = found.find("peak_force", parameter)
        assert math.isnan(row.derivative), parameter
        assert "may jump" in row.reason


def test_the_end_moves_the_impulse_though_a_front_arrives_with_it_elsewhere() -> None:
    """At half a round trip the front is at the far end, where it does not yet act on the hammer."""
    path = "solve.duration.round_trips"
    row = il.sensitivities(struck({"round_trips": 0.5}, "free"), [path], ["impulse"]).find("impulse", path)
    assert row.derivative == pytest.approx(Z * math.exp(-0.5 * Z * T / M) * T, rel=1e-7)


def test_waves_that_leave_and_arrive_at_the_end_move_no_momentum() -> None:
    """A free rod without contact keeps its momentum; jumps leave one end and arrive at the other as the run ends."""
    found = il.sensitivities(il.load_case("hammer_rod_wall"), ["solve.duration"], ["final_momentum"])
    row = found.find("final_momentum", "solve.duration", "rod")
    assert abs(row.derivative) < 1e-6


def test_a_front_that_moves_with_the_end_has_a_tangent() -> None:
    """At three round trips the end moves with the front, by both parameters."""
    found = il.sensitivities(struck({"round_trips": 3}), [MASS, YOUNG], ["impulse", "final_velocity"])
    assert {row.found for row in found} == {"tangent"}


def test_a_zero_derivative_beside_a_front_is_no_kink() -> None:
    """At 1.5 T the front is at the clamped end: the hammer's impulse does not know the length yet."""
    path = "bodies.rod.length"
    row = il.sensitivities(struck(1.5 * T), [path], ["impulse"]).find("impulse", path)
    assert row.found == "differences"
    assert abs(row.derivative) < 1e-6


def test_a_constant_largest_force_that_tilts_has_no_derivative() -> None:
    """A rod strikes a rod of the same impedance, which a dashpot Z holds: the force is Z/2 until the end at 1.5 L/c.

    In the weight g both fall, and the dashpot holds against g t: the wave -g t/2 goes back from it. From L/c on the
    force is Z/2 + Z g (t - L/c)/2, and largest at the end if g > 0, before L/c if g < 0.
    """
    rod = {"kind": "rod", "length": 0.5, "area": 2.5e-4, "material": {"young": 2e11, "density": 8000.0}}
    held = {**rod, "ends": {"right": {"dashpot": Z}}}
    solve = {"duration": 1.5e-4, "model": {"kind": "continuous"}}
    contacts = [{"between": ["one.right", "two.left"], "law": HARD}]
    bodies = {"one": {**rod, "velocity": 1.0}, "two": held}
    case = il.Case.from_dict({"schema_version": 1, "bodies": bodies, "contacts": contacts, "solve": solve})
    row = il.sensitivities(case, ["bodies.two.ends.right.dashpot"], ["peak_force"]).rows[0]
    assert row.derivative == pytest.approx(0.0, abs=1e-9)
    row = il.sensitivities(case, ["gravity"], ["peak_force"]).rows[0]
    assert row.found == "withheld"
    assert (row.below, row.above) == pytest.approx((0.0, 0.5 * Z * 0.5e-4), abs=1e-4)
