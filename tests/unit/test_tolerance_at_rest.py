"""A tolerance where nothing that counts is anything but zero: the run keeps it."""

import pytest

import impactlab as il

HERTZ = {"kind": "hertz", "stiffness": 1e10}


@pytest.mark.parametrize("body", [il.Mass(1.0), il.Rod(length=0.1, area=1e-3, material="steel")], ids=["mass", "rod"])
def test_bodies_at_rest_that_never_meet_keep_a_tolerance(body):
    end = ".left" if body["kind"] == "rod" else ""
    case = il.Case(
        bodies={"hammer": il.Mass(1.0), "struck": body},
        contacts=[il.Contact("hammer", f"struck{end}", law=HERTZ, gap=1e-6)],
        solve={"duration": 1e-4, "tolerance": 1e-4},
    )
    found = il.run(case)
    assert found.choice.met
    assert found.choice.expected_error == 0.0
    assert found.cost.steps < 1000  # it had refined to 327,680 steps


def test_without_contact_a_tolerance_on_impulses_is_kept():
    case = il.Case(
        bodies={"ball": il.Mass(1.0, velocity=-1.0), "wall": il.Wall()},
        contacts=[il.Contact("ball", "wall", law=HERTZ, gap=1e-3)],
        solve={"duration": 1e-3, "tolerance": 1e-3, "tolerance_on": ["impulses"]},
    )
    found = il.run(case)
    assert found.choice.met
    assert found.evaluate(1e-3, "position:ball") == pytest.approx(-1e-3)


def test_a_near_miss_under_a_tolerance_on_impulses_is_not_taken_for_none():
    """The gap closes within the error of coarse runs: more resolution is needed before no contact is stated."""
    rod = il.Rod(length=0.2, area=1e-4, material="steel", ends={"left": {"force": "2e3*sin(3e4*t)"}})
    solve = {"duration": 2e-4, "tolerance": 1e-2, "tolerance_on": ["impulses"]}

    def case(gap: float) -> il.Case:
        contacts = [il.Contact("rod.right", "wall", law=HERTZ, gap=gap)]
        return il.Case(bodies={"rod": rod, "wall": il.Wall()}, contacts=contacts, solve=solve)

    free = il.run(case(1.0))
    t = [n * 2e-6 for n in range(101)]
    farthest = float(max(free.evaluate(t, "displacement:rod@0.2")))
    assert not il.run(case(1.05 * farthest)).contacts
    assert il.run(case(0.95 * farthest)).contacts
