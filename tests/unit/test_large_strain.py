"""Runs that leave linear theory say so, and those of real rods and beams do not."""

import json
import re

import numpy as np
import pytest

import impactlab as il
from impactlab.exact.results.history import ContinuousHistory
from impactlab.metrics.linear_theory import moves_of_beam, strain_of_beam, strain_of_rod
from tests.solving import in_steps, mesh
from tests.support import invoke

STEPPED = [
    {"length": 0.2, "diameter": 0.025, "material": "steel"},
    {"length": 0.3, "diameter": 0.015, "material": "steel"},
]


def struck(speed, **solve):
    """Return the run of a mass that strikes a stepped rod."""
    bodies = {"hammer": il.Mass(0.74, velocity=speed), "rod": il.Rod(segments=STEPPED, ends={"right": "clamped"})}
    contact = il.Contact("hammer", "rod.left", {"kind": "addition_deletion"})
    return il.run(il.Case(bodies=bodies, contacts=[contact], solve={"duration": "0.3 ms", **solve}))


MESH = {
    "model": {"kind": "finite_element", "elements": 50, "mass": "lumped"},
    "integrator": {"kind": "central_difference"},
    "step": {"courant": 0.9},
}


@pytest.mark.parametrize("solve", [{"tolerance": 1e-3}, MESH], ids=["exact", "stepped"])
def test_a_rod_struck_beyond_linear_theory_is_warned_of(solve):
    """At 3000 m/s the first front alone strains a steel rod by v/c = 58 %."""
    with pytest.warns(il.DoubtfulResult, match="large_strain: the strain of 'rod' reaches about"):
        fast = struck(3000.0, **solve)
    assert "large_strain" not in [each.code for each in struck(10.0, **solve).warnings]
    assert [each.code for each in fast.warnings].count("large_strain") == 1


def test_a_first_force_that_a_mesh_exaggerates_strains_no_rod():
    """Elements of unlike bars have unlike transit times: the end nodes are stopped by a far larger force."""
    bodies = {
        "striker": il.Rod(length=0.2, diameter=0.016, material="steel", velocity=10.0),
        "bar": il.Rod(length=1.0, diameter=0.016, material="steel"),
        "disc": il.Rod(length=0.005, diameter=0.016, material="steel", velocity=0.0),
    }
    faces = [("striker.right", "bar.left"), ("bar.right", "disc.left")]
    law = {"kind": "addition_deletion"}
    case = il.Case(bodies=bodies, contacts=[il.Contact(*pair, law) for pair in faces], solve={"duration": 8e-5, **MESH})
    codes = [each.code for each in il.run(case).warnings]
    assert "first_force" in codes
    assert "large_strain" not in codes


def test_the_strain_of_a_rod_is_estimated_within_a_factor_of_two():
    """The exact field is read everywhere; the first rod is stepped, the second plain and between rigid bodies."""
    history = struck(10.0, tolerance=1e-3)
    assert isinstance(history, ContinuousHistory)
    rod = history.scene.bodies["rod"]
    x, times = np.linspace(0.0, rod.length, 201), np.linspace(0.0, history.duration, 1501)
    largest = max(np.abs(history.field("rod", t, "strain", x).values).max() for t in times)
    estimated = strain_of_rod(history, rod, [(history.scene.contacts[0], 0.0)], {})
    assert largest / 2.0 < estimated < 2.0 * largest


@pytest.mark.parametrize(
    ("sizes", "x", "mass", "ends"),
    [
        ([(0.1, 0.1), (1.0, 0.01)], 0.0, 50.0, {"right": "clamped"}),
        ([(0.1, 0.1), (1.0, 0.01)], 0.0, 50.0, {}),
        ([(1.0, 0.01), (0.3, 0.1)], 1.1, 50.0, {"left": "clamped"}),
        ([(0.01, 0.1), (1.0, 0.01)], 0.0, 5.0, {}),
        ([(1.0, 0.01)], 0.5, 50.0, {"left": {"spring": 1e7}}),
    ],
    ids=["held", "free", "inside", "short", "spring"],
)
def test_the_strain_of_thin_segments_under_a_long_force_is_that_of_statics(sizes, x, mass, ends):
    """A front enters a segment of 1/100 of the impedance with 2 % of the force; reflections bring the rest."""
    segments = [{"length": length, "diameter": diameter, "material": "steel"} for length, diameter in sizes]
    case = il.Case(
        bodies={"ram": il.Mass(mass, velocity=20.0), "rod": il.Rod(segments=segments, ends=ends)},
        contacts=[il.Contact("ram", f"rod.at({x})" if x else "rod.left", {"kind": "penalty", "stiffness": 1e10})],
        solve=in_steps(0.01, "central_difference", mesh(200, mass="lumped"), courant=0.5),
    )
    history = il.run(case, frames=200)
    largest = max(np.abs(history.field("rod", t, "strain").values).max() for t in history.field_times("rod"))
    estimated = strain_of_rod(history, history.scene.bodies["rod"], [(history.scene.contacts[0], x)], {})
    assert largest / 2.0 < estimated < 2.0 * largest


def estimated_strain(history, beam, x):
    """Return the estimate of the largest strain of a beam that is struck at x, if it is struck."""
    met = [(contact, x) for contact in history.scene.contacts]
    return strain_of_beam(history, beam, met, moves_of_beam(history, beam, met), {})


@pytest.mark.parametrize(("mass", "x"), [(0.05, 0.25), (2.0, 0.25), (0.05, 0.5), (5.0, 0.5)])
def test_the_strain_of_a_beam_is_estimated_within_a_factor_of_two(mass, x):
    """A clamped strip, 20 x 5 mm, is struck in its middle and at its tip by light and heavy bodies."""
    strip = il.Beam(
        length=0.5,
        section={"width": 0.02, "height": 0.005},
        material="steel",
        ends={"left": "clamped"},
        theory="timoshenko",
    )
    contact = il.Contact("body", "strip.right" if x == 0.5 else f"strip.at({x} m)", {"kind": "hertz", "stiffness": 1e9})
    case = il.Case(
        bodies={"body": il.Mass(mass, velocity=1.0), "strip": strip},
        contacts=[contact],
        solve=in_steps(0.05, "midpoint", mesh(40), dt="5 us"),
    )
    history = il.run(case, frames=400)
    beam = history.scene.bodies["strip"]
    moments = [np.abs(history.field("strip", t, "bending_moment").values).max() for t in history.field_times("strip")]
    largest = max(moments) * 0.0025 / beam.segments[0].bending_stiffness
    estimated = estimated_strain(history, beam, x)
    assert largest / 2.0 < estimated < 2.0 * largest


def probed(force=None, clamped=True, duration=0.05, struck_at=None, theory="timoshenko"):
    """Return the estimated strain of a strip, loaded at its right end or struck, over the largest at 21 probes."""
    ends = {"left": "clamped"} if clamped else {}
    strip = il.Beam(
        length=0.5,
        section={"width": 0.02, "height": 0.005},
        material="steel",
        ends=ends if force is None else {**ends, "right": {"force": force}},
        theory=theory,
    )
    bodies, contacts = {"strip": strip}, []
    if struck_at is not None:
        bodies["body"] = il.Mass(0.005, velocity=1.0)
        contacts = [il.Contact("body", f"strip.at({struck_at} m)", {"kind": "hertz", "stiffness": 1e9})]
    history = il.run(
        il.Case(
            bodies=bodies,
            contacts=contacts,
            probes=[il.Probe("strip", float(x), "strain") for x in np.linspace(0.0, 0.5, 21)],
            solve=in_steps(duration, "midpoint", mesh(40), dt="5 us"),
        )
    )
    times = np.linspace(0.0, duration, 20001)
    largest = max(np.abs(history.evaluate(times, f"strain:strip@{x:.6g}")).max() for x in np.linspace(0.0, 0.5, 21))
    return estimated_strain(history, history.scene.bodies["strip"], struck_at) / largest


PULSES = [{"t": [0.0, top, 2.0 * top], "f": [0.0, 1000.0, 0.0]} for top in (1e-5, 1e-4)]


@pytest.mark.parametrize("clamped", [True, False])
@pytest.mark.parametrize("force", [10.0, *PULSES])
def test_a_force_on_an_end_strains_a_beam_by_its_impulse_and_its_lever(force, clamped):
    """The lever of the whole length took short pulses for 13 to 67 times their strain, and free ones for rigid."""
    assert 0.5 < probed(force, clamped) < 2.0


def test_a_force_strains_no_more_than_the_waves_have_reached():
    assert 0.5 < probed(10.0, duration=5e-4) < 2.0


@pytest.mark.parametrize("duration", [0.002, 1.0])
@pytest.mark.parametrize("clamped", [True, False])
def test_an_impact_strains_a_beam_as_much_in_a_long_run(clamped, duration):
    """Means over a two-thousandth of a second missed three quarters of the speed."""
    assert 0.5 < probed(None, clamped, duration, struck_at=0.25) < 2.0


@pytest.mark.parametrize(("slope", "warned"), [(0.001, False), (0.05, True)])
def test_a_displacement_at_the_start_may_strain_a_body_beyond_linear_theory(slope, warned):
    rod = il.Rod(length=0.5, diameter=0.02, material="steel", displacement=f"{slope}*x", ends={"left": "clamped"})
    bow = 0.25 * slope / 0.0025  # of the curvature slope/(h/2)
    strip = il.Beam(
        length=0.5,
        section={"width": 0.02, "height": 0.005},
        material="steel",
        displacement=f"{2.0 * bow}*x**2",
        ends={"left": "clamped"},
    )
    for body in (rod, strip):
        solve = in_steps(1e-5, "newmark", mesh(20), dt="1 us")
        found = il.run(il.Case(bodies={"body": body}, solve=solve)).warnings
        assert ("large_strain" in [each.code for each in found]) == warned


@pytest.mark.parametrize(("rate", "warned"), [(1000.0, False), (4000.0, True)])
@pytest.mark.parametrize("bends", [False, True])
def test_a_rotation_may_strain_a_body_beyond_linear_theory(rate, warned, bends):
    """At its root a uniform bar has the strain (Omega L/c)^2/2 in its steady state: 7.5 % at 4000 rad/s."""
    common = {"length": 0.5, "material": "steel", "ends": {"left": "clamped"}}
    turns = {"rate": rate, "axis_at": 0.0, **({"plane": "flap"} if bends else {})}
    section = {"width": 0.02, "height": 0.01}
    body = il.Beam(**common, section=section, rotation=turns) if bends else il.Rod(**common, area=2e-4, rotation=turns)
    case = il.Case(
        bodies={"body": body, "mass": il.Mass(0.2, velocity=-0.1, rotation={})},
        contacts=[il.Contact("body.right", "mass", {"kind": "penalty", "stiffness": 1e8})],
        solve=in_steps(1e-5, "newmark", mesh(20), dt="1 us"),
    )
    assert ("large_strain" in [each.code for each in il.run(case).warnings]) == warned


@pytest.mark.parametrize("x", [0.1, 0.5])
@pytest.mark.parametrize("left", ["clamped", "pinned", {"spring": 1e8}], ids=["clamped", "pinned", "spring"])
@pytest.mark.parametrize("right", ["clamped", "pinned", {"spring": 1e8}], ids=["clamped", "pinned", "spring"])
def test_the_strain_under_a_slow_heavy_blow_is_that_of_statics(left, right, x):
    """Near a clamp the clamp bends most: by 3 L/(a2 b) per deflection, ten times that between pinned ends."""
    strip = il.Beam(
        length=1.0,
        section={"width": 0.02, "height": 0.01},
        material="steel",
        ends={"left": left, "right": right},
    )
    case = il.Case(
        bodies={"body": il.Mass(200.0, velocity=0.5), "strip": strip},
        contacts=[il.Contact("body", f"strip.at({x} m)", {"kind": "penalty", "stiffness": 1e8})],
        solve=in_steps(0.15, "midpoint", mesh(40), dt="10 us"),
    )
    history = il.run(case, frames=400)
    beam = history.scene.bodies["strip"]
    moments = [np.abs(history.field("strip", t, "bending_moment").values).max() for t in history.field_times("strip")]
    largest = max(moments) * 0.005 / beam.segments[0].bending_stiffness
    estimated = estimated_strain(history, beam, x)
    assert largest / 2.0 < estimated < 2.0 * largest


def strip_under_a_ball(speed):
    """Return the run of a ball that strikes the tip of a slender cantilever, EI = 0.35 N m2, 1 m long."""
    strip = il.Beam(length=1.0, section={"width": 0.02, "height": 0.001}, material="steel", ends={"left": "clamped"})
    case = il.Case(
        bodies={"ball": il.Mass(0.5, velocity=speed), "strip": strip},
        contacts=[il.Contact("ball", "strip.right", {"kind": "penalty", "stiffness": 1e5})],
        solve=in_steps(1.0, "midpoint", mesh(40), dt="50 us"),
    )
    return il.run(case)


def test_a_beam_that_bends_far_is_warned_of_at_small_strains():
    """A tip that moves by a length strains the strip by 0.2 %, and its slope of 1 is no small angle."""
    far, near = strip_under_a_ball(1.5), strip_under_a_ball(0.1)
    texts = [each.text for each in far.warnings if each.code == "large_bending"]
    moved = np.abs(far.evaluate(np.linspace(0.0, far.duration, 2001), "displacement:strip@1")).max()
    assert moved > 0.5
    assert len(texts) == 1
    share = float(re.search(r"changes by about ([\d.]+) %", texts[0])[1])
    assert share == pytest.approx(60.0 * moved**2, rel=0.05)  # 3/5 (deflection)^2/L of a cantilever
    assert {"large_bending", "large_strain"}.isdisjoint(each.code for each in near.warnings)
    assert "large_strain" not in [each.code for each in far.warnings]


def test_materials_of_unit_constants_have_no_limit():
    """Benchmarks with E = rho = 1 strain by as much as their authors chose."""
    for name in ("bouncing_bar", "periodic_bar", "hopkinson_ring_up"):
        done = invoke("run", f"cases/{name}.yaml", "--json")
        assert "large_strain" not in [each["code"] for each in json.loads(done.stdout)["warnings"]]
