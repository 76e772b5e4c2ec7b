"""Probes of internal forces beside a load: right by a mesh or all modes, warned of where modes lack the force."""

import numpy as np
import pytest

import impactlab as il
from impactlab.models.base import Face
from impactlab.models.mesh.beams import BeamMesh
from tests.solving import in_steps, mesh, run_case

FORCE, LENGTH = 1e4, 0.5


def held(model, integrator="newmark", places=(0.0, 0.25)):
    """Return a rod that a constant force on its free end presses until it rests: its force is the same everywhere."""
    material = {"young": 2e11, "density": 7800}
    rod = il.Rod(
        length=LENGTH,
        area=1e-4,
        material=material,
        ends={"left": {"force": FORCE}, "right": "clamped"},
        damping={"mass": 2e4},
    )
    solve = {"duration": 0.01, "model": model, "integrator": {"kind": integrator}, "step": {"dt": 1e-6}}
    probes = [{"body": "rod", "at": x, "quantity": "force"} for x in places]
    return il.run(il.Case(bodies={"rod": rod}, probes=probes, solve=solve))


def warned(history):
    return [each.text for each in history.warnings if each.code == "probe_near_load"]


def test_modes_of_a_free_end_lack_the_force_on_it_with_a_warning():
    """Each mode has no strain at the free end: the force there is read as 0 however many modes are kept."""
    history = held({"kind": "modal", "modes": 20})
    assert abs(history.recorded["force:rod@0"].values[-1]) < 1e-6 * FORCE
    assert warned(history) == [
        "force:rod@0: the modes kept miss 100 % of the static internal force that a load next to it causes there"
    ]


def test_a_probe_far_from_the_load_is_right_and_not_warned_of():
    """Behind a few wavelengths of the highest mode, L/20, the series has converged to some per cent."""
    history = held({"kind": "modal", "modes": 20}, places=(0.25,))
    assert history.recorded["force:rod@0.25"].values[-1] == pytest.approx(FORCE, rel=0.05)
    assert warned(history) == []


def test_a_mesh_is_right_at_the_loaded_end():
    history = held({"kind": "finite_element", "elements": 25}, "bathe")
    assert history.recorded["force:rod@0"].values[-1] == pytest.approx(FORCE, rel=1e-9)
    assert warned(history) == []


@pytest.mark.parametrize(
    ("model", "lacks"),
    [
        ({"kind": "modal", "elements": 40, "modes": 12}, True),
        ({"kind": "modal", "elements": 40, "modes": 12, "basis": {"kind": "craig_bampton"}}, False),
        ({"kind": "modal", "elements": 40, "modes": 40}, False),
        ({"kind": "finite_element", "elements": 40}, False),
        ({"kind": "finite_element", "elements": 40, "mass": "redistributed"}, True),
    ],
)
def test_the_face_of_a_contact_is_warned_of_where_its_force_is_left_out(model, lacks):
    """A mass on a soft spring presses the face slowly: the force in the rod there is that of the contact."""
    rod = il.Rod(length=LENGTH, area=1e-4, material={"young": 2e11, "density": 7800}, ends={"right": "clamped"})
    history = run_case(
        bodies={"hammer": il.Mass(2.0, velocity=1.0), "rod": rod},
        contacts=[il.Contact("hammer", "rod.left", {"kind": "penalty", "stiffness": 1e6})],
        probes=[{"body": "rod", "at": 0.0, "quantity": "force"}],
        solve={"duration": 4e-3, "model": model, "integrator": {"kind": "newmark"}, "step": {"dt": 1e-6}},
    )
    times = np.linspace(1e-3, 3.5e-3, 50)
    force = history.evaluate(times, "force:hammer|rod.left")
    inside = history.evaluate(times, "force:rod@0")
    assert (np.abs(inside - force).max() > 0.1 * force.max()) == lacks
    assert bool(warned(history)) == lacks


def moments(model, stiffness):
    """Return a mass on a spring that strikes a pinned beam of 1 m, with probes of the moment."""
    beam = il.Beam(
        length=1.0,
        section={"width": 0.02, "height": 0.02},
        material={"young": 2.1e11, "density": 7850},
        ends={"left": "pinned", "right": "pinned"},
    )
    return run_case(
        bodies={"m": il.Mass(0.1, velocity=1.0), "b": beam},
        contacts=[il.Contact("m", "b.at(0.3)", {"kind": "penalty", "stiffness": stiffness})],
        probes=[{"body": "b", "at": x, "quantity": "bending_moment"} for x in (0.3, 0.35, 0.5)],
        solve={"duration": 2e-3, "model": model, "integrator": {"kind": "newmark"}, "step": {"dt": 2e-6}},
    )


@pytest.mark.parametrize(
    ("modes", "wrong"), [(8, ("bending_moment:b@0.3", "bending_moment:b@0.5")), (20, ()), (100, ())]
)
def test_moments_that_lack_modes_beside_a_short_impact_are_warned_of(modes, wrong):
    """Of the static moment, 0.21 L per unit force, 8 modes lack 6 %; of that of a wave that sets out much more."""
    few, mesh = (moments(each, 1e5) for each in ({"kind": "modal", "modes": modes}, {"kind": "finite_element"}))
    t = np.linspace(0.0, 2e-3, 500)
    for x in (0.3, 0.35, 0.5):
        name = f"bending_moment:b@{x:g}"
        known = np.abs(mesh.evaluate(t, name)).max()
        assert (abs(np.abs(few.evaluate(t, name)).max() - known) > 0.08 * known) == (name in wrong)
    assert bool(warned(few)) == bool(wrong)
    assert not warned(mesh)
    if wrong:
        assert warned(few)[0].startswith("bending_moment:b@0.5: the modes kept miss up to")
        assert "and 1 more probe of 'b' misses some" in warned(few)[0]


@pytest.mark.parametrize(("elements", "place"), [(40, 0.5), (41, 0.5), (20, 0.337), (20, 0.02)])
def test_shear_forces_beside_a_contact_on_a_beam_are_right_or_warned_of(elements, place):
    """A spring presses a pinned beam slowly: the shear force jumps there by the force of the contact.

    Within half an element of an end the contact has no node, so that explicit steps stay long.
    """
    beam = il.Beam(
        length=1.0,
        section={"width": 0.02, "height": 0.02},
        material={"young": 2.1e11, "density": 7850},
        ends={"left": "pinned", "right": "pinned"},
        damping={"mass": 50.0},
    )
    history = run_case(
        bodies={"m": il.Mass(1e5, velocity=1e-3), "b": beam},
        contacts=[il.Contact("m", f"b.at({place})", {"kind": "penalty", "stiffness": 1e5})],
        probes=[{"body": "b", "at": x, "quantity": "shear_force"} for x in (place, 0.015)],
        solve=in_steps(0.3, "newmark", mesh(elements), dt=1e-4),
    )
    force = history.evaluate(0.3, f"force:m|b.at({place})")
    there, beside = (history.evaluate(0.3, f"shear_force:b@{x:g}") for x in (place, 0.015))
    if has_node := place > 0.5 / elements:
        assert warned(history) == []
    else:
        assert warned(history)[0].startswith("shear_force:b@0.015: the elements without a node at a load miss 58 %")
    assert (there == pytest.approx(-place * force, abs=0.02 * force)) == has_node
    assert (beside == pytest.approx((1.0 - place) * force, rel=0.02)) == has_node


@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
def test_a_beam_mesh_and_the_part_it_misses_inside_an_element_are_the_whole_statics(theory):
    """A cantilever under a force at 0.337 L: shear force 1 and moment 0.337 - x up to it, nothing beyond."""
    beam = il.Beam(
        theory=theory,
        length=1.0,
        section={"width": 0.02, "height": 0.05},
        material={"young": 2.1e11, "density": 7850, "poisson": 0.3},
        ends={"left": "clamped"},
    )
    solve = {"duration": 1e-4, "model": {"kind": "finite_element"}, "step": {"dt": 1e-5}}
    body = il.run(il.Case(bodies={"b": beam}, solve={**solve, "integrator": {"kind": "newmark"}})).scene.bodies["b"]
    mesh = BeamMesh(body, 10, "consistent", 0.0, faces=(Face(0.337, 0, 1.0),))
    for x in (0.0, 0.2, 0.25, 0.3, 0.32, 0.337, 0.36, 0.4, 0.44, 0.7, 1.0):
        before = float(x < 0.337)
        assert mesh.static_compliance(x, "shear_force", 0.337) == pytest.approx(before, abs=1e-9)
        assert mesh.static_compliance(x, "bending_moment", 0.337) == pytest.approx(before * (0.337 - x), abs=1e-9)


@pytest.mark.parametrize("quantity", ["bending_moment", "shear_force"])
def test_a_free_end_without_internal_force_is_not_warned_of(quantity):
    """The true value there is 0: modes read rounding, and lack as much of it by rounding."""
    beam = il.Beam(
        length=1.0,
        section={"width": 0.02, "height": 0.02},
        material={"young": 2.1e11, "density": 7850},
        ends={"left": "clamped"},
    )
    history = run_case(
        bodies={"m": il.Mass(0.05, velocity=0.5), "b": beam},
        contacts=[il.Contact("m", "b.at(0.5)", {"kind": "hertz", "stiffness": 1e8})],
        probes=[{"body": "b", "at": 1.0, "quantity": quantity}],
        solve=in_steps(5e-3, "exact_modal", {"kind": "modal", "modes": 40}, dt=2e-6),
    )
    assert np.abs(history.recorded[f"{quantity}:b@1"].values).max() < 1e-9
    assert warned(history) == []


@pytest.mark.parametrize(("elements", "place", "wrong"), [(41, 0.5, False), (40, 0.5, False), (20, 0.02, True)])
def test_coordinates_that_change_with_the_contact_are_those_of_the_closed_contact(elements, place, wrong):
    """The static shapes of a mesh that is struck inside an element lack the jump of the shear force.

    That is so within half an element of an end, where a contact has no node.
    """
    beam = il.Beam(
        length=1.0,
        section={"width": 0.02, "height": 0.05},
        material={"young": 2.1e11, "density": 7850},
        ends={"left": "pinned", "right": "pinned"},
    )
    history = run_case(
        bodies={"m": il.Mass(50.0, velocity=0.1), "b": beam},
        contacts=[il.Contact("m", f"b.at({place})", {"kind": "penalty", "stiffness": 1e4})],
        probes=[{"body": "b", "at": place, "quantity": "shear_force"}],
        solve=in_steps(
            0.1, "newmark", {"kind": "modal", "elements": elements, "modes": 12, "basis": "striker_attached"}, dt=2e-5
        ),
    )
    times = np.linspace(0.04, 0.09, 50)
    force, shear = (history.evaluate(times, name) for name in (f"force:m|b.at({place})", f"shear_force:b@{place}"))
    assert (np.abs(shear + place * force).max() > 0.1 * force.max()) == wrong
    assert bool(warned(history)) == wrong
