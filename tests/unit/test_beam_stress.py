"""Bending stress and strain at the upper surface of a beam, positive in compression: M h/(2 I) and M h/(2 E I)."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il

LENGTH, WIDTH, HEIGHT, YOUNG, FORCE = 0.1, 0.015, 0.004, 2.1e11, 20.0
INERTIA = WIDTH * HEIGHT**3 / 12.0
MATERIAL = {"young": YOUNG, "density": 7850, "poisson": 0.3}
RECTANGLE = {"width": WIDTH, "height": HEIGHT}
MESH = {
    "model": {"kind": "finite_element", "elements": 20},
    "integrator": {"kind": "newmark"},
    "step": {"dt": "1 us"},
}
MODES = {"model": {"kind": "modal", "modes": 10}, "integrator": {"kind": "exact_modal"}, "step": {"dt": "1 us"}}
CHARACTERISTICS = {"model": {"kind": "continuous"}, "step": {"dt": "0.2 us"}}


def struck(beam: il.Beam, solve: dict, quantities: tuple[str, ...] = ("stress", "bending_moment")) -> il.Case:
    probes = [il.Probe("beam", 0.0, quantity) for quantity in quantities]
    law = {"kind": "penalty", "stiffness": 1e6}
    contacts = [il.Contact("mass", "beam.right", law)]
    bodies = {"mass": il.Mass(0.05, velocity=0.5), "beam": beam}
    return il.Case(bodies=bodies, contacts=contacts, probes=probes, solve={"duration": "0.5 ms", **solve})


def beam(**keys) -> il.Beam:
    usual = {"length": LENGTH, "section": RECTANGLE, "material": MATERIAL, "ends": {"left": "clamped"}}
    return il.Beam(**{**usual, **keys})


def test_a_cantilever_at_rest_under_a_force_has_the_stress_of_the_textbook():
    """A force at the tip, upwards: the beam sags, and its upper surface is compressed by F (L - x) h/(2 I)."""
    shape = f"{FORCE / (6.0 * YOUNG * INERTIA)!r}*x**2*({3.0 * LENGTH!r} - x)"
    bent = beam(displacement=shape, ends={"left": "clamped", "right": {"force": FORCE}})
    case = il.Case(
        bodies={"beam": bent},
        probes=[il.Probe("beam", x, "stress") for x in (0.0, 0.06)],
        solve={"duration": "1 ms", **MESH},
    )
    history = il.run(case)
    for x in (0.0, 0.06):
        expected = FORCE * (LENGTH - x) * HEIGHT / (2.0 * INERTIA)
        # elements are exact under point loads; the beam stays at rest to rounding, of stiff against slow motion
        stress = history.evaluate(np.linspace(0.0, 1e-3, 7), f"stress:beam@{x:g}")
        assert stress == pytest.approx(np.full(7, expected), rel=1e-6)


@pytest.mark.parametrize(
    ("theory", "solve"), [("euler_bernoulli", MODES), ("timoshenko", MESH), ("timoshenko", CHARACTERISTICS)]
)
def test_every_model_records_it(theory, solve):
    history = il.run(struck(beam(theory=theory), solve))
    t = np.linspace(0.0, 5e-4, 200)
    stress, moment = (history.evaluate(t, f"{quantity}:beam@0") for quantity in ("stress", "bending_moment"))
    assert np.max(np.abs(stress)) > 1e7
    assert stress == pytest.approx(moment * HEIGHT / (2.0 * INERTIA), rel=1e-12)


def test_a_circle_and_any_section_of_known_height():
    own = {"area": WIDTH * HEIGHT, "inertia": INERTIA}
    found = {}
    for name, section in {
        "given": {**own, "height": HEIGHT},
        "rectangle": RECTANGLE,
        "circle": {"diameter": 5e-3},
    }.items():
        history = il.run(struck(beam(section=section), MODES))
        t = np.linspace(0.0, 5e-4, 50)
        found[name] = history.evaluate(t, "stress:beam@0"), history.evaluate(t, "bending_moment:beam@0")
    assert found["given"][0] == pytest.approx(found["rectangle"][0], rel=1e-9)
    stress, moment = found["circle"]
    assert stress == pytest.approx(32.0 * moment / (np.pi * 5e-3**3), rel=1e-12)


def test_it_serves_sweeps_and_is_saved(tmp_path):
    pytest.importorskip("xarray")
    case = struck(beam(), MODES)
    found = il.sweep(case, {"bodies.mass.velocity": [0.5, 1.0]}, quantities=["max(stress:beam@0)"])
    one, two = found["max(stress:beam@0)"].values
    assert two == pytest.approx(2.0 * one, rel=1e-9)  # a linear contact that opens once or not at all
    history = il.run(case)
    history.to_netcdf(tmp_path / "run.nc")
    t = np.linspace(0.0, 5e-4, 50)
    again = il.open_netcdf(tmp_path / "run.nc").evaluate(t, "stress:beam@0")
    assert again == pytest.approx(history.evaluate(t, "stress:beam@0"), abs=1e-3 * one)
    assert history.to_xarray()["stress"].attrs["units"] == "Pa"


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"section": {"area": 6e-5, "inertia": 8e-11}}, "The height of its section is not known: give it beside area"),
        (
            {
                "length": None,
                "section": None,
                "material": None,
                "segments": [
                    {"length": 0.05, "section": RECTANGLE, "material": MATERIAL},
                    {"length": 0.05, "section": {"width": WIDTH, "height": 2.0 * HEIGHT}, "material": MATERIAL},
                ],
            },
            "Its segments have several sections: probe bending_moment",
        ),
    ],
)
def test_where_it_is_not_known_the_message_has_the_reason(keys, says):
    with pytest.raises(il.CaseError, match=rf"probes\.0\.quantity: the beam 'beam' has no stress to record\n{says}"):
        struck(beam(**keys), MODES)


def test_segments_of_one_section_have_it():
    pieces = [{"length": 0.05, "section": RECTANGLE, "material": MATERIAL}] * 2
    halves = beam(length=None, section=None, material=None, segments=pieces)
    t = np.linspace(0.0, 5e-4, 50)
    found, whole = (il.run(struck(each, MESH)).evaluate(t, "stress:beam@0") for each in (halves, beam()))
    assert found == pytest.approx(whole, rel=1e-9, abs=1.0)


@pytest.mark.parametrize(
    ("theory", "solve"), [("euler_bernoulli", MODES), ("timoshenko", MESH), ("timoshenko", CHARACTERISTICS)]
)
def test_the_strain_is_the_stress_over_the_modulus(theory, solve, tmp_path):
    pytest.importorskip("xarray")
    case = struck(beam(theory=theory), solve, ("strain", "stress"))
    history, t = il.run(case), np.linspace(0.0, 5e-4, 200)
    strain, stress = (history.evaluate(t, f"{quantity}:beam@0") for quantity in ("strain", "stress"))
    assert np.max(np.abs(strain)) > 5e-5
    assert strain == pytest.approx(stress / YOUNG, rel=1e-12)
    found = il.sweep(case, {"bodies.mass.velocity": [0.5]}, quantities=["max(strain:beam@0)"])
    assert found["max(strain:beam@0)"].values[0] == pytest.approx(np.max(strain), rel=0.02)  # of 200 instants
    history.to_netcdf(tmp_path / "run.nc")
    again = il.open_netcdf(tmp_path / "run.nc").evaluate(t, "strain:beam@0")
    assert again == pytest.approx(strain, abs=1e-3 * np.max(strain))


def test_the_strain_of_a_cantilever_under_its_tip_force_is_that_of_the_textbook():
    shape = f"{FORCE / (6.0 * YOUNG * INERTIA)!r}*x**2*({3.0 * LENGTH!r} - x)"
    bent = beam(displacement=shape, ends={"left": "clamped", "right": {"force": FORCE}})
    probes = [il.Probe("beam", 0.06, "strain")]
    history = il.run(il.Case(bodies={"beam": bent}, probes=probes, solve={"duration": "1 ms", **MESH}))
    expected = FORCE * (LENGTH - 0.06) * HEIGHT / (2.0 * YOUNG * INERTIA)
    assert history.evaluate([0.0, 1e-3], "strain:beam@0.06") == pytest.approx([expected] * 2, rel=1e-6)


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"material": {**MATERIAL, "viscosity": 1e4}}, "Its stress has a viscous part"),
        ({"damping": {"stiffness": "1e-6 s"}}, "Its stress has a viscous part"),
        ({"section": {"area": 6e-5, "inertia": 8e-11}}, "The height of its section is not known"),
    ],
)
def test_where_the_strain_is_not_known_the_message_has_the_reason(keys, says):
    with pytest.raises(il.CaseError, match=rf"the beam 'beam' has no strain to record\n{says}"):
        struck(beam(**keys), MODES, ("strain",))


def test_a_long_gauge_measures_rods_alone():
    probes = [il.Probe("beam", 0.05, "strain", length=0.01)]
    with pytest.raises(il.CaseError, match="measures strain, not that of a beam"):
        il.Case(bodies={"beam": beam(velocity=1.0)}, probes=probes, solve={"duration": "0.1 ms", **MODES})
