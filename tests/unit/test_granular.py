"""Granular chains: spheres by Hertz, the solitary wave as a fixed point and its tail, waves read from a run."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import impactlab as il
from impactlab.errors import CaseError, ImpactlabError, UnusualValue
from impactlab.granular import (
    LONG_WAVE_FACTOR,
    LeadingWave,
    leading_wave,
    solitary_wave,
    sphere_mass,
    sphere_stiffness,
    wave_speed,
)

DECORATED = Path(__file__).parents[2] / "cases" / "granular" / "decorated_chain.yaml"
SOLVE = {"integrator": {"kind": "central_difference"}, "step": {"dt": 2e-7}}


def test_spheres() -> None:
    assert sphere_mass(5e-3, 7850.0) == pytest.approx(4.1102503884e-3)
    equal = sphere_stiffness(210e9, 0.3, 5e-3, 5e-3)
    assert equal == pytest.approx(210e9 * math.sqrt(2.0 * 5e-3) / (3.0 * 0.91), rel=1e-14)
    assert sphere_stiffness(210e9, 0.3, 5e-3) == pytest.approx(math.sqrt(2.0) * equal, rel=1e-14)
    # The compliances of two materials add up; that of a rigid one is nothing.
    assert sphere_stiffness(210e9, 0.3, 5e-3, 5e-3, others=(1e40, 0.3)) == pytest.approx(2.0 * equal, rel=1e-14)
    with pytest.raises(ImpactlabError, match="radius -1 is out of range"):
        sphere_mass(-1.0, 7850.0)
    with pytest.raises(ImpactlabError, match=r"poisson 0\.6 is out of range"):
        sphere_stiffness(210e9, 0.6, 5e-3)


def test_a_case_gives_spheres_in_place_of_a_stiffness() -> None:
    """The closed form of two equal spheres; a rigid plane doubles K of a plane of the same material."""
    body = il.Mass(sphere_mass("5 mm", "steel"), velocity=1.0)
    equal: dict[str, Any] = {"radius": "5 mm", "other_radius": "5 mm", "material": "steel"}

    def stiffness(given: dict[str, Any]) -> float:
        law = {"kind": "hertz", "stiffness": given}
        solve = {"duration": 1e-4, "tolerance": 1e-4}
        case = il.Case(bodies={"a": body, "b": il.Mass(1.0)}, contacts=[il.Contact("a", "b", law)], solve=solve)
        return float(case.simulation().method.laws["a|b"].stiffness)

    assert stiffness(equal) == pytest.approx(210e9 * math.sqrt(2.0 * 5e-3) / (3.0 * 0.91), rel=1e-14)
    plane = {"radius": 5e-3, "young": 210e9, "poisson": 0.3}
    assert stiffness(plane) == pytest.approx(math.sqrt(2.0) * stiffness(equal), rel=1e-14)
    assert stiffness(plane | {"other_young": 1e20}) == pytest.approx(2.0 * stiffness(plane), rel=1e-8)
    for wrong, said in (
        ({"radius": "5 mm"}, "Add material (steel, "),
        ({**equal, "material": "stell"}, "Did you mean 'steel'?"),
        ({**equal, "young": 1e9}, "material is given beside young or poisson"),
        ({**equal, "other": 1.0}, "the key 'other' is not known here"),
        ({**equal, "radius": "5 kg"}, "stiffness.radius: '5 kg' has a unit of another dimension"),
    ):
        with pytest.raises(CaseError, match=re.escape(said)):
            stiffness(wrong)


def test_spheres_need_the_power_of_hertz() -> None:
    law = {"kind": "hertz", "stiffness": {"radius": "5 mm", "material": "steel"}, "exponent": 2.0}
    with pytest.raises(CaseError, match=re.escape("the exponent is 2")):
        il.Case(
            bodies={"a": il.Mass(1.0, velocity=1.0), "b": il.Mass(1.0)},
            contacts=[il.Contact("a", "b", law)],
            solve={"duration": 1e-4, "tolerance": 1e-4},
        )


def test_the_radius_of_a_sphere_is_an_axis_of_sweeps_with_its_unit() -> None:
    """The peak force of two masses grows as K^(2/5), so as the radius on a plane to the power 1/5."""
    law = {"kind": "hertz", "stiffness": {"radius": "5 mm", "material": "steel"}}
    case = il.Case(
        bodies={"a": il.Mass(1.0, velocity=1.0), "b": il.Mass(1.0)},
        contacts=[il.Contact("a", "b", law)],
        solve={"duration": "1 ms", "tolerance": 1e-4},
    )
    found = il.sweep(case, {"contacts.0.law.stiffness.radius": ["5 mm", "10 mm"]}, quantities=["peak_force"])
    small, large = found["peak_force"].values.ravel()
    assert large / small == pytest.approx(2.0**0.2, rel=3e-4)  # both within the tolerance of 1e-4
    assert found["contacts.0.law.stiffness.radius"].attrs["units"] == "m"


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: sphere_mass(7850, 0.005), "the radius of the sphere is 7850 m"),
        (lambda: sphere_mass("5 mm", 7.85), "the density of the sphere is 7.85 kg/m3"),
        (lambda: sphere_mass([5e-3, 5.0], 7850), "the radius of the sphere is 5 m"),
        (lambda: sphere_stiffness(210, 0.3, 5e-3), "Young's modulus of the sphere is 210 Pa"),
    ],
)
def test_exchanged_arguments_and_missing_units_of_spheres_are_warned_of_once(call, said) -> None:
    with pytest.warns(UnusualValue, match=re.escape(said)) as seen:
        call()
    assert len(seen) == 1
    assert "The order is sphere_" in str(seen[0].message)


def test_the_factor_of_the_discrete_chain_and_of_the_long_wave() -> None:
    wave = solitary_wave()
    assert wave.factor == pytest.approx(0.9055, abs=5e-5)  # as published
    assert wave.factor == pytest.approx(solitary_wave(points=1024).factor, rel=1e-14)
    assert wave.residual < 1e-14
    assert pytest.approx(0.8944, abs=5e-5) == LONG_WAVE_FACTOR
    assert wave_speed(7.7e9, 4.1e-3, 213.0) == pytest.approx(
        wave.factor * math.sqrt(7.7e9 ** (2 / 3) * 213.0 ** (1 / 3) / 4.1e-3), rel=1e-14
    )


def test_the_speed_takes_units_and_refuses_values_that_are_not_above_zero() -> None:
    assert wave_speed("7.7 GN/m^1.5", "4.1 g", "0.213 kN") == pytest.approx(wave_speed(7.7e9, 4.1e-3, 213.0))
    for values in ((-7.7e9, 4.1e-3, 213.0), (7.7e9, 0.0, 213.0), (7.7e9, 4.1e-3, math.nan)):
        with pytest.raises(ImpactlabError, match=r"^(stiffness|mass|force) is .* must be positive"):
            wave_speed(*values)
    with pytest.raises(ImpactlabError, match="exponent 1 is out of range"):
        wave_speed(7.7e9, 4.1e-3, 213.0, 1.0)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: solitary_wave("1.5"), "exponent: "),  # type: ignore[arg-type]
        (lambda: solitary_wave(1.5, 1001), "1001 points are an odd number"),
        (lambda: solitary_wave(1.5, 10), "Give a whole number from 64"),
        (lambda: sphere_stiffness(2e11, None, 5e-3), "poisson is "),  # type: ignore[call-overload]
        (lambda: sphere_stiffness(2e11, 0.3, 5e-3, others=2e11), "others: "),  # type: ignore[call-overload]
        (lambda: sphere_stiffness(2e11, 0.3, [5e-3] * 3, [5e-3] * 2), r"sizes of shapes (3,), (2,) are given"),
    ],
)
def test_values_of_another_kind_are_refused(call: Callable[[], object], text: str) -> None:
    with pytest.raises(ImpactlabError) as caught:
        call()
    assert text in str(caught.value)


def test_the_wave_obeys_its_equation_in_plain_sums() -> None:
    """The convolution with the tent once more, by the trapezoidal rule, Euler-Maclaurin terms for its kinks."""
    wave = solitary_wave()
    h, per_bead = wave.s[1] - wave.s[0], 256
    offsets = np.arange(-per_bead, per_bead + 1)
    tent = h * (1.0 - np.abs(offsets) / per_bead)
    force = np.maximum(wave.overlap, 0.0) ** 1.5
    again = np.convolve(force, tent, mode="same")

    def difference(f: np.ndarray, by: int) -> np.ndarray:
        return np.roll(f, by) - 2.0 * f + np.roll(f, -by)

    # A kink of the tent jumps by 1, -2, 1 in its slope; the third derivative of the product there by three times f''.
    again += h**2 / 12.0 * difference(force - h**2 / 20.0 * (difference(force, 1) / h**2), per_bead)
    assert again == pytest.approx(wave.overlap, abs=1e-12)


def test_the_tail_falls_doubly_exponentially() -> None:
    """Ahead by one bead the overlap is the power 3/2 of that before, times a slowly varying factor."""
    wave = solitary_wave()
    at = [float(np.interp(s, wave.s, wave.overlap)) for s in (1.5, 2.5, 3.0, 3.5)]
    logs = np.log(at)
    assert logs[1] / logs[0] > 1.5
    assert at[3] < 1e-5
    assert logs[3] < 1.4 * logs[1]


def test_the_linear_limit_has_no_solitary_wave() -> None:
    for exponent in (1.0, 6.0):
        with pytest.raises(ImpactlabError, match=r"is out of range\. Allowed: 1\.1 to 5"):
            solitary_wave(exponent)
    with pytest.raises(ImpactlabError, match="exponent is nan; it must be finite"):
        solitary_wave(math.nan)
    assert solitary_wave(3.0).factor < solitary_wave(1.5).factor


def test_a_wave_is_read_between_the_records() -> None:
    mass, stiffness = 4e-3, 7.7e9
    chain = {
        "bodies": {"striker": il.Mass(mass, velocity=1.0), "bead": il.Mass(mass, repeat=24)},
        "contacts": [il.Chain(["striker", "bead"], {"kind": "hertz", "stiffness": stiffness})],
    }

    def history_of(**solve: float) -> il.history.AbstractHistory:
        return il.run(il.Case.from_dict({**chain, "solve": {**SOLVE, **solve}}))

    history = history_of(duration=4e-4)
    wave = leading_wave(history, [contact.name for contact in history.scene.contacts][:-4])
    assert wave.speed(10, -1) == pytest.approx(wave_speed(stiffness, mass, float(wave.forces[15])), rel=1e-4)
    for over in (0, len(wave.contacts)):
        with pytest.raises(ImpactlabError, match=f"over is {over}. Allowed: a whole number from 1 to 19\n"):
            wave.factors(stiffness, mass, over)
    # Records 8 us apart, two for each contact passed: the peaks lie between them, on the cubics.
    coarse = leading_wave(history_of(duration=8e-4, records=100), wave.contacts)
    assert coarse.times[2:] == pytest.approx(wave.times[2:], abs=1.5e-7)
    assert coarse.forces == pytest.approx(wave.forces, rel=1e-3)
    with pytest.raises(ImpactlabError, match=r"records are 100 µs apart\nGive so many solve.records"):
        leading_wave(history_of(duration=1e-2, records=100), wave.contacts)
    with pytest.raises(ImpactlabError, match="has no largest value within the run"):
        leading_wave(history, until=1e-5)
    with pytest.raises(ImpactlabError, match=r"there is no contact 'a\|b'"):
        leading_wave(history, ["a|b"])


@pytest.mark.parametrize("records", [20000, 200])
def test_the_wave_passes_a_contact_when_its_force_is_largest(records: int) -> None:
    # Two equal beads of the reduced mass m/2 are in contact for 2.9432751843 d/v, d^(5/2) = 5 (m/2) v^2/(4 k), and the
    # force is largest in the middle of that time. A record is the mean force since the one before: its middle counts.
    mass, stiffness, speed = 4e-3, 7.7e9, 1.0
    deepest = (5.0 * 0.5 * mass * speed**2 / (4.0 * stiffness)) ** 0.4
    lasts = 2.9432751843 * deepest / speed
    pair = {
        "bodies": {"striker": il.Mass(mass, velocity=speed), "bead": il.Mass(mass)},
        "contacts": [il.Contact("striker", "bead", {"kind": "hertz", "stiffness": stiffness})],
        "solve": {
            "integrator": {"kind": "midpoint"},
            "step": {"dt": lasts / 2000},
            "duration": 1.5 * lasts,
            "records": records,
        },
    }
    wave = leading_wave(il.run(il.Case.from_dict(pair)))
    interval = 1.5 * lasts / min(records, 3000)
    assert wave.times[0] == pytest.approx(0.5 * lasts, abs=0.05 * interval)


masses = st.lists(st.floats(1e-3, 1e-2), min_size=3, max_size=12)


@settings(max_examples=25, deadline=None)
@given(masses=masses, speed=st.floats(0.05, 5.0), exponent=st.floats(1.2, 3.0), gap=st.floats(0.0, 1e-6))
def test_random_chains_keep_energy_and_momentum_and_mirror(
    masses: list[float], speed: float, exponent: float, gap: float
) -> None:
    n = len(masses)
    stiffness = 1e9 * 1e-5 ** (1.5 - exponent)  # so that overlaps of 10 um give like forces
    law = {"kind": "hertz", "stiffness": stiffness, "exponent": exponent}
    solve = {"duration": 3e-4, "integrator": {"kind": "newmark"}, "step": {"dt": 1e-6}}

    def run(order: list[float], velocities: list[float]) -> np.ndarray:
        beads = il.Mass({"each": order}, velocity={"each": velocities}, repeat=n)  # type: ignore[arg-type]
        case = il.Case(bodies={"bead": beads}, contacts=[il.Chain(["bead"], law, gap=gap)], solve=solve)
        history = il.run(case)
        ends = [history.evaluate([0.0, history.duration], f"momentum:bead_{i}") for i in range(1, n + 1)]
        before, after = np.sum(ends, axis=0)
        assert after == pytest.approx(before, rel=1e-12, abs=1e-15 * n)
        assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-9
        return np.array([end[1] for end in ends])

    struck = [speed, *([0.0] * (n - 1))]
    mirrored = run(masses[::-1], [-each for each in struck[::-1]])
    assert -mirrored[::-1] == pytest.approx(run(masses, struck), abs=1e-9 * masses[0] * speed)


def test_sizes_of_spheres_are_numbers_texts_with_units_or_arrays() -> None:
    radii = 5e-3 * 0.95 ** np.arange(201)
    assert sphere_mass("5 mm", "7.85 g/cm^3") == pytest.approx(sphere_mass(5e-3, 7850.0), rel=1e-14)
    masses = sphere_mass(radii, 7850)
    assert masses.shape == (201,)
    assert masses[[0, 7]] == pytest.approx([sphere_mass(radii[0], 7850.0), sphere_mass(radii[7], 7850.0)], rel=1e-14)
    assert isinstance(sphere_mass(5e-3, 7850), float)
    row = sphere_stiffness("210 GPa", 0.3, radii[:-1], radii[1:])
    assert row.shape == (200,)
    assert row[3] == pytest.approx(sphere_stiffness(210e9, 0.3, radii[3], radii[4]), rel=1e-14)
    assert isinstance(sphere_stiffness("210 GPa", 0.3, "5 mm"), float)


@pytest.mark.parametrize(
    ("radius", "text"),
    [
        ("5 V", "radius: '5 V'"),
        ("five", "radius: 'five' is not a number with a unit"),
        (None, "radius"),
        ([1e-3] * 200 + ["x"], "radius: a list of 201 is neither a number nor an array of numbers"),
        ({"a": 1.0}, "radius: dict is neither a number nor an array of numbers"),
        (math.nan, "radius nan is out of range"),
        ([[1e-3, 2e-3], [3e-3, -4e-3]], "radius[1, 1] -0.004 is out of range. Allowed: above 0"),
    ],
)
def test_sizes_of_spheres_that_are_no_sizes_are_refused_shortly(radius: object, text: str) -> None:
    with pytest.raises(ImpactlabError) as caught:
        sphere_mass(radius, density=7850)  # type: ignore[call-overload]
    assert text in str(caught.value)
    assert len(str(caught.value)) < 250


def struck(taper: float, end: str) -> il.history.AbstractHistory:
    """Twenty beads whose radii shrink by a factor, the first one at 1 m/s, against a wall or a rod."""
    masses = sphere_mass(5e-3 * taper ** np.arange(20), 7850.0)
    law = {"kind": "hertz", "stiffness": 5e9}
    wall = {"kind": "wall"}
    rod = {"kind": "rod", "length": 0.5, "area": 1e-4, "material": {"young": 2.1e11, "density": 7850}}
    case = {
        "bodies": {
            "bead": il.Mass({"each": masses}, velocity={"each": [1.0] + [0.0] * 19}, repeat=20),
            "end": rod if end == "rod" else wall,
        },
        "contacts": [
            il.Chain(["bead"], law),
            {"between": ["bead_20", "end.left" if end == "rod" else "end"], "law": law},
        ],
        "solve": {"duration": 4e-3, "integrator": {"kind": "central_difference"}, "step": {"dt": 2e-7}},
    }
    if end == "rod":
        case["solve"]["model"] = {"kind": "finite_element", "elements": 50, "mass": "lumped"}
    return il.run(il.Case.from_dict(case))


@pytest.mark.parametrize("end", ["wall", "rod"])
def test_the_wave_that_comes_back_is_not_the_leading_one_though_it_is_larger(end: str) -> None:
    history = struck(0.93, end)
    names = [contact.name for contact in history.scene.contacts]
    wave = leading_wave(history)
    assert np.all(np.diff(wave.times) > 0.0)
    assert np.all(np.diff(wave.forces[:-1]) < 0.0)  # each bead passes less force to a lighter one
    returned = [history.largest(f"force:{name}") for name in names]
    assert returned[11] > 1.3 * wave.forces[11]  # the trap
    before = leading_wave(history, names[:-3], until=float(wave.times[-3]))
    assert before.times == pytest.approx(wave.times[:-3], rel=1e-12)
    assert before.forces == pytest.approx(wave.forces[:-3], rel=1e-2)
    assert wave.speed(2, 12) == pytest.approx(10.0 / (wave.times[12] - wave.times[2]))
    assert 8e4 < wave.speed(2, 12) < 2e5


def test_contacts_out_of_the_order_of_the_wave_are_refused() -> None:
    history = struck(1.0, "wall")
    names = [contact.name for contact in history.scene.contacts]
    with pytest.raises(
        ImpactlabError, match=r"does not pass the contacts one after the other: it is at 'bead_9"
    ) as caught:
        leading_wave(history, names[8:2:-1])
    assert "`until`" in str(caught.value)
    with pytest.raises(ImpactlabError, match="one after the other"):
        leading_wave(history, [*names[:5], names[4]])


def test_the_leading_wave_of_a_decorated_chain_passes_each_contact_once() -> None:
    history = il.run(il.load_case(DECORATED))
    wave = leading_wave(history, [contact.name for contact in history.scene.contacts][:-6])
    assert np.all(np.diff(wave.times) > 0.0)
    assert np.ptp(wave.forces[10:-1:2]) < 0.2 * wave.forces[10]


@pytest.mark.parametrize(
    ("first", "last", "text"),
    [
        (0, 3, "no contact of number 3. Allowed: whole numbers from -3 to 2"),
        (-4, 1, "no contact of number -4"),
        (0.5, 2, "no contact of number 0.5"),
        (1, -2, "both are number 1"),
    ],
)
def test_the_speed_between_contacts_that_are_not_there_is_refused(first: int, last: int, text: str) -> None:
    """They ended in IndexError, TypeError and ZeroDivisionError."""
    wave = LeadingWave(("a|b", "b|c", "c|d"), np.array([1.0, 2.0, 4.0]), np.ones(3))
    assert wave.speed() == wave.speed(0, -1) == wave.speed(-1, 0) == pytest.approx(2 / 3)
    with pytest.raises(ImpactlabError, match=re.escape(text)):
        wave.speed(first, last)
