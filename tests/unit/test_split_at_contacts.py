"""Segments cut at inner contacts: a scene without any stays as it is."""

from __future__ import annotations

from impactlab.contact.power_law import Hertz
from impactlab.scene import Rod, Segment
from impactlab.scene.facts import split_at_contacts
from impactlab.testing.scenes import FREE
from tests.reference.beam_scenes import ball_on

STEEL = Segment(length=0.3, area=1e-4, young=2.1e11, density=7850.0)


def struck_at(x):
    """Return a scene with a ball on a rod at x [m]."""
    return ball_on(Rod("rod", (STEEL,), FREE, FREE), x, Hertz(1e9), 1e-4, mass=0.1).scene


def test_a_scene_without_inner_contacts_is_the_same_object():
    scene = struck_at(0.0)
    assert split_at_contacts(scene) is scene


def test_a_rod_is_cut_at_an_inner_contact_and_the_order_of_bodies_stays():
    scene = struck_at(0.1)
    cut = split_at_contacts(scene)
    assert [segment.length for segment in cut.bodies["rod"].segments] == [0.1, 0.3 - 0.1]
    assert list(cut.bodies) == list(scene.bodies)
    assert cut.bodies["ball"] is scene.bodies["ball"]
