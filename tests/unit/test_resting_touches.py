"""Faces that touch at rest under a law that divides by their speed: no tolerance can be kept without a least speed."""

import pytest

import impactlab as il
from impactlab.refine.errors.distances import difference

STEEL = {"young": 2.1e11, "density": 7850.0}


def rods(gap=0.0, between=None, **solve):
    """Return a mass that strikes a rod, behind which another one stands."""
    law = {"kind": "lankarani_nikravesh", "stiffness": 5e10, "restitution": 0.8}
    return il.Case(
        bodies={
            "hammer": il.Mass(2.0, velocity=2.0),
            "one": il.Rod(length=0.3, area=1e-4, material=STEEL),
            "two": il.Rod(length=0.2, area=4e-4, material=STEEL),
        },
        contacts=[il.Contact("hammer", "one.left", law), il.Contact("one.right", "two.left", between or law, gap=gap)],
        solve={"duration": 1.2e-4, **solve},
    )


def test_faces_that_touch_at_rest_are_refused_under_a_tolerance():
    with pytest.raises(il.CaseError, match=r"one.right\|two.left: the faces touch at rest, .* 1e-06 m/s") as refused:
        il.run(rods(tolerance=1e-2))
    assert refused.value.path == "contacts.1.law"
    assert "slowest_approach of 0.1 m/s" in refused.value.remedy
    with pytest.raises(il.CaseError) as refused:
        il.run(rods(tolerance=1e-2).with_("bodies.hammer.velocity", 2.46))
    assert "slowest_approach of 0.13 m/s" in refused.value.remedy, "a twentieth, 0.123 m/s, rounded up"


@pytest.mark.parametrize(
    "changed",
    [
        {"gap": 1e-5},
        {"between": {"kind": "hertz", "stiffness": 5e10}},
        {"between": {"kind": "flores", "stiffness": 5e10, "restitution": 1.0}},
        {"between": {"kind": "flores", "stiffness": 5e10, "restitution": 0.8, "slowest_approach": 0.1}},
    ],
    ids=["gap", "elastic", "restitution 1", "least speed"],
)
def test_the_remedy_of_the_message_keeps_the_tolerance(changed):
    history = il.run(rods(**changed, tolerance=1e-2))
    mesh = {"kind": "finite_element", "elements": 1000, "mass": "lumped"}
    fine = il.run(rods(**changed, model=mesh, integrator={"kind": "central_difference"}, step={"courant": 0.9}))
    error = difference(history, fine, history.scene, fine.method.laws, ("displacements", "impulses", "peak_forces"))
    assert history.choice.met
    assert error < history.choice.expected_error + 1e-3  # the error of the fine run itself


def test_a_run_with_a_step_of_its_own_is_not_refused():
    mesh = {"kind": "finite_element", "elements": 50, "mass": "lumped"}
    history = il.run(rods(model=mesh, integrator={"kind": "central_difference"}, step={"courant": 0.9}))
    assert len(history.contacts) == 2
