"""Forces that follow the speed of the overlap: a front that arrives in a closed contact makes them jump."""

import numpy as np
import pytest

import impactlab as il
from impactlab.metrics.peaks import near_jumps

TRANSIT = 0.4 / 5000.0  # s
LAW = {"kind": "flores", "stiffness": 1e10, "exponent": 1.5, "restitution": 0.6}


def pushed(law, **solve):
    """Return a rod that moves on a dashpot, which starts a front at t = 0, and meets a long rod."""
    material = {"young": 1.96e11, "density": 7840.0}  # 5000 m/s
    rod = {"area": 3e-4, "material": material}
    return il.Case(
        bodies={
            "left": il.Rod(length=0.4, velocity=3.0, ends={"left": {"dashpot": 4000.0}}, **rod),
            "right": il.Rod(length=1.0, ends={"right": "infinite"}, **rod),
        },
        contacts=[il.Contact("left.right", "right.left", law)],
        solve={"duration": 3.0 * TRANSIT, **solve},
    )


def in_steps(law):
    return il.run(pushed(law, model={"kind": "continuous"}, integrator={"kind": "newmark"}, step={"dt": TRANSIT / 400}))


@pytest.mark.parametrize(("law", "jumps"), [(LAW, True), ({"kind": "hertz", "stiffness": 1e10}, False)])
def test_a_front_makes_a_force_jump_that_follows_the_speed_of_the_overlap(law, jumps):
    history = in_steps(law)
    found = near_jumps(history, history.scene, history.method.laws, history.scene.contacts[0])
    assert any(start < TRANSIT < end for start, end in found) == jumps
    before, after = history.evaluate(TRANSIT * np.array([0.99, 1.01]), "force:left.right|right.left")
    assert (abs(after - before) > 0.1 * before) == jumps


def test_a_tolerance_is_kept_where_a_front_makes_such_a_force_jump():
    """The largest force, beside the jump, was compared, and no method kept a tolerance of 1e-3."""
    steel, aluminium = {"young": 2.1e11, "density": 7850.0}, {"young": 7e10, "density": 2700.0}
    flores = {"kind": "flores", "stiffness": 9.896e9, "exponent": 1.5, "restitution": 0.7}
    stiff = {"kind": "lankarani_nikravesh", "stiffness": 2.079e13, "exponent": 2.0, "restitution": 0.4284}

    def solved(**solve):
        moving = il.Rod(
            length=0.5903, area=3.237e-4, material=aluminium, velocity=3.188, ends={"left": {"dashpot": 3270.0}}
        )
        bodies = {
            "moving": moving,
            "middle": il.Rod(length=0.1924, area=1.071e-4, material=steel),
            "long": il.Rod(length=0.5246, area=3.14e-4, material=steel, ends={"right": "infinite"}),
        }
        contacts = [
            il.Contact("moving.right", "middle.left", flores, gap=7.222e-6),
            il.Contact("middle.right", "long.left", stiff, gap=8.518e-6),
        ]
        return il.run(il.Case(bodies=bodies, contacts=contacts, solve={"duration": 3.475e-4, **solve}))

    found = solved(tolerance=1e-3)
    fine = solved(model={"kind": "continuous"}, integrator={"kind": "newmark"}, step={"dt": "20 ns"})
    assert found.choice.met
    for contact, finer in zip(found.contacts, fine.contacts, strict=True):
        assert contact.impulse == pytest.approx(finer.impulse, rel=1e-3)
