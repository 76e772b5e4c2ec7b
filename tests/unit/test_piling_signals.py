"""Head signals of a pile as recorders write them: noise, wrong units and offsets, and stresses beside a step."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import UnusualValue
from impactlab.piling import blow, case_method, match
from tests.solving import in_steps, mesh

Z, PEAK = 1.6e6, 4e6  # N s/m, N
TIME = np.arange(2001) * 2.5e-5  # s, five round trips


def recorded(**change: Any) -> dict[str, Any]:
    """Return half a sine of 12 ms from 2 ms on, and no wave that comes back: F = Z v, with its peak at 8 ms."""
    force = PEAK * np.where(abs(TIME - 8e-3) <= 6e-3, np.cos(np.pi * (TIME - 8e-3) / 12e-3), 0.0)
    given = {"time": TIME, "force": force, "velocity": force / Z, "impedance": Z, "length": 20.0, "wave_speed": 4000.0}
    return {**given, "damping": 0.4} | {key: value(given[key]) for key, value in change.items()}


@pytest.mark.parametrize("seed", range(5))
def test_a_peak_of_noise_is_not_the_first_peak(seed: int) -> None:
    """2 % noise: without waves up RTL is the largest force, and RSP is RTL (1 - J)."""
    noise = np.random.default_rng(seed)
    found = case_method(
        **recorded(
            force=lambda row: row + 0.02 * PEAK * noise.standard_normal(row.size),
            velocity=lambda row: row + 0.02 * PEAK / Z * noise.standard_normal(row.size),
        )
    )
    assert found.peak_time == pytest.approx(8e-3, abs=1e-3)
    assert found.total == pytest.approx(PEAK, rel=0.1)
    assert found.static == pytest.approx(0.6 * PEAK, rel=0.2)


def test_the_first_of_two_peaks_is_taken() -> None:
    found = case_method(
        **recorded(force=lambda row: row + 1.2 * np.roll(row, 600), velocity=lambda row: row + 1.2 * np.roll(row, 600))
    )
    assert found.peak_time == pytest.approx(8e-3, abs=1e-9)


def test_force_and_velocity_are_proportional_without_waves_up() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert case_method(**recorded()).proportionality == pytest.approx(1.0)
        assert case_method(**recorded(force=lambda row: 0.5 * row)).proportionality == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"time": lambda t: 1e3 * t}, r"0.025 s apart over 50 s, and 2 L/c of the pile is 0.01 s"),
        ({"force": lambda f: 1e-3 * f}, "force is 4 kN and impedance times velocity 4 MN"),
        ({"velocity": lambda v: 1e3 * v}, "force is 4 MN and impedance times velocity 4 GN"),
        ({"impedance": lambda z: 1e-3 * z}, "check the units of force"),
        ({"velocity": lambda v: v + 0.2}, "velocity begins with 200 mm/s, 7.4 %"),
    ],
)
def test_units_and_offsets_that_do_not_fit_are_named(change: dict[str, Any], said: str) -> None:
    with pytest.warns(UnusualValue, match=said):
        case_method(**recorded(**change))


def on_two_sections(mirrored: bool) -> il.Case:
    """Return a pile whose upper 8 m are narrower than its lower 12 m, driven along +x or, mirrored, along -x."""
    soil = {"kind": "smith", "capacity": 5e5, "quake": 3e-3, "damping": 0.5, "tension": False}
    concrete = {"young": 40e9, "density": 2500.0}
    parts = [{"length": 8.0, "area": 0.09, "material": concrete}, {"length": 12.0, "area": 0.16, "material": concrete}]
    head, toe = ("pile.right", "pile.left") if mirrored else ("pile.left", "pile.right")
    pairs: list[tuple[str, str, dict[str, Any]]] = [
        ("ram", head, {"kind": "bilinear", "stiffness": 6e8, "restitution": 0.5}),
        (toe, "base", soil),
    ]
    return il.Case(
        bodies={
            "ram": il.Mass(5000.0, velocity=-4.5 if mirrored else 4.5),
            "pile": il.Rod(segments=parts[::-1] if mirrored else parts),
            "base": il.Wall(),
        },
        contacts=[il.Contact(*((b, a) if mirrored else (a, b)), law) for a, b, law in pairs],
        solve=in_steps(0.02, "central_difference", mesh(40, "lumped"), courant=0.5),
    )


@pytest.mark.filterwarnings("ignore::impactlab.errors.DoubtfulResult")
def test_the_largest_stress_beside_a_step_of_the_section_is_found_from_either_side() -> None:
    """Where the section widens the reflected wave adds to the arriving one: the peak is just above the step."""
    one, other = (blow(on_two_sections(mirrored)) for mirrored in (False, True))
    for name in ("peak_compression", "peak_tension"):
        here, there = getattr(one, name), getattr(other, name)
        assert there.stress == pytest.approx(here.stress, rel=1e-9)
        assert 20.0 - there.x == pytest.approx(here.x, abs=1e-4)
    assert one.peak_compression.x == pytest.approx(8.0, abs=1e-4)


def test_a_match_names_signals_whose_units_do_not_fit() -> None:
    given = recorded(velocity=lambda v: 1e3 * v)
    case = il.load_case("measured_head").with_("solve.model.elements", 10)
    with pytest.warns(UnusualValue, match="force is 4 MN and impedance times velocity 4 GN"):
        match(case, given["time"], given["force"], given["velocity"], ["toe.capacity"])


def test_a_capacity_that_no_signal_determines_has_no_narrow_interval() -> None:
    """A force in kN leaves the pile at rest: the interval of the capacity had no width."""
    given = recorded(force=lambda f: 1e-3 * f)
    case = il.load_case("measured_head").with_("solve.model.elements", 10)
    with pytest.warns(UnusualValue):
        found = match(case, given["time"], given["force"], given["velocity"], ["toe.capacity"])
    assert (found.capacity.lower, found.capacity.upper) == (0.0, np.inf)


def test_a_match_names_the_reason_why_its_case_cannot_be_run() -> None:
    """It ended with "zip() argument 2 is shorter than argument 1"."""
    case = il.load_case("measured_head").with_(
        "solve", in_steps(0.02, "central_difference", mesh(10, "consistent"), courant=0.5)
    )
    given = recorded()
    with pytest.raises(il.PairingError, match="'central_difference' needs a diagonal mass"):
        match(case, given["time"], given["force"], given["velocity"], ["toe.capacity"])


def test_a_match_refuses_times_in_milliseconds() -> None:
    """It warned of them, and went on with runs of a thousand times the length, for minutes."""
    given = recorded(time=lambda t: 1e3 * t)
    with pytest.raises(il.CaseError, match=r"the signals last 50 s, 5e\+03 round trips 2 L/c of the pile"):
        match(il.load_case("measured_head"), given["time"], given["force"], given["velocity"], ["toe.capacity"])
