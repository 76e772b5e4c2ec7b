"""Meshes have a node at every contact: static compliances there are exact, as are internal forces at nodes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import impactlab as il
from impactlab.models.base import Face
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.bars import Mesh
from impactlab.models.mesh.beams import BeamMesh
from impactlab.models.mesh.contact_nodes import with_nodes_at
from impactlab.models.modal import Modal
from impactlab.scene.bodies import Beam, BeamSegment, End, Rod, Segment
from tests.solving import in_steps

LENGTH, PLACE = 0.6, 0.21
STEEL = Segment(LENGTH, 6.0e-4, 2.1e11, 7850.0)
PIECE = BeamSegment(
    LENGTH, 6.0e-4, 2.1e11, 7850.0, inertia=4.5e-8, shear_stiffness=4.0e7, rotary_inertia=3.5e-4, height=0.03
)
CLAMPED, FREE, PINNED = End("clamped"), End("free"), End("pinned")
ROD = Rod("body", (STEEL,), CLAMPED, FREE)
BEAM = Beam("body", (PIECE,), PINNED, PINNED, theory="timoshenko")
SLENDER = Beam("body", (dataclasses.replace(PIECE, shear_stiffness=np.inf, rotary_inertia=0.0),), PINNED, PINNED)
STRUCK = (Face(PLACE, 0, 1.0),)
MODELS = (FiniteElement(elements=7), FiniteElement(elements=7, mass="lumped"), FiniteElement(elements=3, order=4))


def compliance(mesh, x):
    """Return the displacement at x [m] under a static unit force there [m/N]."""
    row = mesh.row(x, "displacement")
    return float(row @ mesh.static(row))


@pytest.mark.parametrize("model", MODELS)
def test_a_rod_struck_inside_an_element_yields_as_in_statics(model):
    exact = PLACE / (STEEL.young * STEEL.area)
    assert compliance(model.build(ROD, 0.0, STRUCK), PLACE) == pytest.approx(exact, rel=1e-11)


@pytest.mark.parametrize("model", MODELS[:2])
def test_a_beam_that_shears_struck_inside_an_element_yields_as_in_statics(model):
    rest = LENGTH - PLACE
    bending = (PLACE * rest) ** 2 / (3.0 * PIECE.bending_stiffness * LENGTH)
    exact = bending + PLACE * rest / (PIECE.shear_stiffness * LENGTH)
    assert compliance(model.build_beam(BEAM, 0.0, STRUCK), PLACE) == pytest.approx(exact, rel=1e-9)


def test_all_modes_of_a_mesh_yield_at_a_contact_as_in_statics():
    model = Modal(elements=7).build(ROD, 0.0, STRUCK)
    system, row = model.operators(), model.row(PLACE, "displacement")
    exact = PLACE / (STEEL.young * STEEL.area)
    assert float(np.sum(row**2 / system.stiffness[0])) == pytest.approx(exact, rel=1e-9)


def test_elements_are_shared_out_and_their_number_is_kept():
    mesh = FiniteElement(elements=7).build_beam(BEAM, 0.0, STRUCK)
    left, right = np.full(2, PLACE / 2), np.full(5, (LENGTH - PLACE) / 5)
    np.testing.assert_allclose(mesh.lengths, np.concatenate((left, right)), rtol=1e-12)


@pytest.mark.parametrize("x", [0.0, 0.3, LENGTH, 0.3 + 0.09 * 0.06])
def test_a_contact_on_a_node_or_close_to_an_inner_border_leaves_the_others(x):
    halves = (dataclasses.replace(STEEL, length=0.3), dataclasses.replace(STEEL, length=0.3, area=5.0e-4))
    rod = Rod("body", halves, CLAMPED, FREE)
    assert with_nodes_at(rod, (Face(x, 0, 1.0),), 10) is rod


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
@pytest.mark.parametrize("place", [0.05, 0.21, 0.3333, 0.5, 0.551])
def test_internal_forces_beside_a_contact_on_a_beam_that_does_not_shear_are_those_of_statics(place, mass):
    """Of the pinned beam under a unit force: the shear force jumps by it, the moment has its kink there."""
    mesh = FiniteElement(elements=7, mass=mass).build_beam(SLENDER, 0.0, (Face(place, 0, 1.0),))
    shape = mesh.static(mesh.row(place, "displacement"))
    share = 1.0 - place / LENGTH
    for x in (place - 0.01, place, place + 0.01):
        shear, moment = share - (x >= place), share * x - max(0.0, x - place)
        assert abs(mesh.row(x, "shear_force") @ shape) == pytest.approx(abs(shear), rel=1e-8)
        assert abs(mesh.row(x, "bending_moment") @ shape) == pytest.approx(abs(moment), rel=1e-8)
    assert len(mesh.lengths) == 7


def test_elements_of_a_beam_that_does_not_shear_are_between_half_and_twice_as_long_as_alike():
    """Explicit steps follow from the square of the shortest element."""
    for place in np.linspace(0.0, LENGTH, 301)[1:-1].tolist():
        lengths = FiniteElement(elements=7).build_beam(SLENDER, 0.0, (Face(place, 0, 1.0),)).lengths
        assert len(lengths) == 7
        assert lengths.min() > 0.5 * LENGTH / 7
        assert lengths.max() < 1.5 * LENGTH / 7


@pytest.mark.parametrize(
    ("elements", "places"),
    [
        (6, (0.2, 0.5)),  # on nodes
        (7, (0.4 * LENGTH / 7,)),  # within half an element of an end
        (1, (PLACE,)),  # more pieces than elements
        (12, tuple(0.03 * k for k in range(1, 11))),  # the rest of the beam would be left with two elements
    ],
)
def test_a_beam_that_does_not_shear_keeps_its_elements(elements, places):
    assert with_nodes_at(SLENDER, tuple(Face(x, 0, 1.0) for x in places), elements) is SLENDER


@pytest.mark.parametrize(("model", "body"), [(FiniteElement(elements=6), ROD), (Modal(elements=6), ROD)])
def test_a_contact_on_a_node_keeps_a_uniform_mesh(model, body):
    assert model.meshed(body, (Face(0.3, 0, 1.0),)) is body


@pytest.mark.parametrize("kind", ["finite_element", "modal"])
def test_courant_counts_the_shortest_element_beside_a_contact(kind):
    case = il.Case(
        bodies={
            "rod": il.Rod(length=LENGTH, area=6.0e-4, material="steel", ends={"left": "clamped"}),
            "hammer": il.Mass(0.1, velocity=1.0),
        },
        contacts=[il.Contact("hammer", "rod.at(0.21)", {"kind": "penalty", "stiffness": 1e7})],
        solve=in_steps("0.1 ms", "central_difference", {"kind": kind, "elements": 7, "mass": "lumped"}, courant=0.99),
    )
    speed = case.scene().bodies["rod"].elastic.segments[0].wave_speed
    history = il.run(case)  # with the length of all elements alike the step would be beyond stability
    assert history.dt is not None
    assert history.dt <= 0.99 * (LENGTH - PLACE) / 5 / speed * (1.0 + 1e-12)


@pytest.mark.parametrize(("order", "place"), [(1, 0.2), (1, 0.5), (2, 0.2), (2, 0.33)])
def test_a_rod_under_its_weight_has_its_stress_at_nodes_and_inside_curved_elements(order, place):
    mesh = Mesh(ROD, 6, "consistent", 9.81, order)
    shape = mesh.static(mesh.operators().load)
    pull = -STEEL.density * 9.81 * (LENGTH - place)  # the weight below hangs on it
    assert mesh.row(place, "stress") @ shape == pytest.approx(pull, rel=1e-11)


def test_a_beam_under_its_weight_has_its_shear_force_at_the_nodes():
    beam = Beam("body", (PIECE,), PINNED, PINNED, theory="timoshenko")
    mesh = BeamMesh(beam, 6, "consistent", -9.81)
    shape = mesh.static(mesh.operators().load)
    outer = [float(mesh.row(x, "shear_force") @ shape) for x in (0.1, 0.5)]
    inner = float(mesh.row(0.2, "shear_force") @ shape)
    weight = PIECE.density * PIECE.area * 9.81
    assert abs(outer[0]) == pytest.approx(weight * 0.2, rel=1e-9)
    assert abs(inner) == pytest.approx(weight * 0.1, rel=1e-9)
    assert outer[0] == pytest.approx(-outer[1], rel=1e-9)


def test_at_a_contact_the_stress_is_that_on_its_right():
    mesh = Mesh(ROD, 6, "consistent", 0.0, faces=(Face(0.3, 0, 1.0),))
    shape = mesh.static(mesh.row(0.3, "displacement"))
    assert mesh.row(0.3, "stress") @ shape == pytest.approx(0.0, abs=1e-6)
    assert mesh.row(0.2, "stress") @ shape == pytest.approx(-1.0 / STEEL.area, rel=1e-11)
