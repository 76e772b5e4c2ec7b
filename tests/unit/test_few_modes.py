"""Modes left out of a body under a stiff contact: warned of where the force is wrong by a share that matters."""

import re

import pytest

import impactlab as il
from tests.solving import in_steps, run_case


def struck(modes, speed=5.0, theory="euler_bernoulli", **model):
    """Return a run of a steel sphere against the middle of a pinned beam, with so many modes."""
    sphere = il.Mass(mass=0.033, velocity=speed)
    ends = {"left": "pinned", "right": "pinned"}
    section = {"width": 0.01, "height": 0.01}
    beam = il.Beam(length=0.15, section=section, material="steel", ends=ends, theory=theory)
    law = {"kind": "hertz", "stiffness": 1.6e10}
    return run_case(
        bodies={"sphere": sphere, "beam": beam},
        contacts=[il.Contact("sphere", "beam.at(0.075)", law=law)],
        solve=in_steps(2e-4, "exact_modal", {"kind": "modal", "modes": modes, **model}, dt=2e-8),
    )


def warned(history):
    return [each.text for each in history.warnings if each.code == "few_modes"]


def stated(text):
    return float(re.search(r"have (\S+) % of the compliance of the contact", text)[1]) / 100.0


PEAK = struck(200).contacts[0].peak_force


@pytest.mark.parametrize("modes", [1, 3, 4, 5])
def test_the_share_that_is_stated_bounds_the_error_of_the_peak(modes):
    (text,) = warned(found := struck(modes))
    error = abs(found.contacts[0].peak_force / PEAK - 1.0)
    assert 0.2 * stated(text) < error < stated(text)


def test_the_modes_that_are_named_are_enough():
    (text,) = warned(struck(4))
    enough = int(re.search(r"give about (\d+) modes", text)[1])
    fine = struck(enough)
    assert warned(fine) == []
    assert fine.contacts[0].peak_force == pytest.approx(PEAK, rel=3e-3)


def test_a_faster_sphere_needs_more_modes():
    """Its contact is stiffer at a deeper overlap."""
    assert warned(struck(6))
    assert warned(struck(6, speed=0.05)) == []


def test_a_static_shape_at_the_contact_stands_for_the_modes_left_out():
    plain, with_shape = (struck(4, elements=60, basis={"kind": kind}) for kind in ("eigenvectors", "craig_bampton"))
    assert warned(plain)
    assert warned(with_shape) == []


def test_of_a_beam_that_shears_no_number_of_modes_is_named():
    (text,) = warned(struck(5, theory="timoshenko"))
    assert "give many more modes than 5" in text


def on_rod(modes, law, **model):
    """Return a run of a mass against the end of a clamped rod."""
    rod = il.Rod(length=0.6, area=6e-4, material="steel", ends={"right": "clamped"})
    solve = {"duration": 4e-4, "model": {"kind": "modal", "modes": modes, **model}}
    solve["integrator"] = {"kind": "exact_modal"}
    bodies, contact = {"mass": il.Mass(0.5, velocity=1.0), "rod": rod}, il.Contact("mass", "rod.left", law=law)
    return il.run(il.Case(bodies=bodies, contacts=[contact], solve={**solve, "step": {"dt": 1e-7}}))


def test_of_a_rod_the_force_is_wrong_by_less_than_the_share_and_as_many_modes_as_named_do():
    """The exact solver knows a spring between a mass and a rod."""
    law = {"kind": "penalty", "stiffness": 2e9}
    exact = il.run(on_rod(5, law).case.with_("solve", {"duration": 4e-4, "model": {"kind": "continuous"}}))
    (text,) = warned(few := on_rod(40, law))
    wanted, found = exact.contacts[0].impulse, few.contacts[0].impulse
    assert 0.1 * stated(text) < abs(found / wanted - 1.0) < stated(text)
    fine = on_rod(int(re.search(r"give about (\d+) modes", text)[1]), law)
    assert warned(fine) == []
    assert fine.contacts[0].impulse == pytest.approx(wanted, rel=2e-3)


def test_a_spring_that_is_taken_from_a_mesh_stands_for_a_hard_contact_and_is_not_compared():
    assert warned(on_rod(40, {"kind": "penalty", "stiffness": {"relative": 0.8}}, elements=100)) == []


def test_of_a_contact_that_is_nearly_hard_no_number_of_modes_is_named():
    """The message had named 9e12 modes, and an error of 7e10 %."""
    rod = il.Rod(length=0.3, area=9e-4, material="steel", ends={"right": "clamped"})
    found = run_case(
        bodies={"hammer": il.Mass(2.133, velocity=1.0), "rod": rod},
        contacts=[il.Contact("hammer", "rod.left", law={"kind": "penalty", "stiffness": 1e20})],
        solve=in_steps(1e-4, "newmark", {"kind": "modal", "modes": 20}, dt=1e-7),
    )
    (text,) = warned(found)
    assert "give a law of hard contact" in text
    assert not re.search(r"give about \d+ modes|wrong by up to", text)
