"""Bases of the modal model, and damping in its coordinates."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import eigh

from impactlab.bases.craig_bampton import CraigBampton
from impactlab.bases.eigenvectors import Eigenvectors
from impactlab.bases.macneal import Macneal
from impactlab.bases.reduced import ReducedMesh
from impactlab.bases.ritz import Ritz
from impactlab.bases.striker_attached import StrikerAttached
from impactlab.bases.substructured import Substructured
from impactlab.errors import CaseError, PairingError
from impactlab.models.base import Face
from impactlab.models.mesh.bars import Mesh
from impactlab.models.modal import Modal
from impactlab.numerics.banded import full
from impactlab.scene import End, Rayleigh, Rod, Segment

FREE, CLAMPED = End("free"), End("clamped")
STEEL = Segment(1.0, math.pi * 0.01**2, 2.1e11, 7850.0)
BRASS = Segment(0.6, 4.0e-4, 1.0e11, 8500.0)
HIT = (Face(0.0, 0, 1.5),)  # by a mass, at the left end
MASSES = ("consistent", "lumped")


def basis(left, right, elements, mass, segments=(STEEL,)):
    mesh = Mesh(Rod("rod", segments, left, right), elements, mass, 0.0)
    modes = mesh.mass.shape[1] - (not mesh.is_held)
    span = Eigenvectors().span(mesh, modes, ())
    return ReducedMesh(mesh, span.shapes, span.uncoupled)


@pytest.mark.parametrize("mass", MASSES)
@pytest.mark.parametrize("elements", [10, 400])
@pytest.mark.parametrize("stiffness", [1.0, 1e-3])
def test_a_rod_on_a_soft_spring_swings_as_a_rigid_mass(stiffness, elements, mass):
    rigid = STEEL.density * STEEL.area * STEEL.length
    for ends in ((End("spring", stiffness), FREE), (FREE, End("spring", stiffness))):
        frequencies = basis(*ends, elements, mass).frequencies
        assert frequencies[0] ** 2 == pytest.approx(stiffness / rigid, rel=1e-6)
        assert np.all(np.diff(frequencies) > 0.0)
    both = basis(End("spring", stiffness), End("spring", 2.0 * stiffness), elements, mass).frequencies
    assert both[0] ** 2 == pytest.approx(3.0 * stiffness / rigid, rel=1e-6)


@pytest.mark.parametrize("mass", MASSES)
def test_a_spring_softer_than_any_rounding_gives_a_number(mass):
    frequencies = basis(End("spring", 1e-12), FREE, 400, mass).frequencies
    assert np.all(np.isfinite(frequencies))


@pytest.mark.parametrize("mass", MASSES)
@pytest.mark.parametrize("left", [FREE, CLAMPED, End("spring", 1e8), End("mass", 0.5)])
@pytest.mark.parametrize("right", [FREE, CLAMPED, End("spring", 1e9)])
def test_frequencies_are_those_of_the_matrices(left, right, mass):
    found = basis(left, right, 12, mass, (STEEL, BRASS))
    operators = found.mesh.operators()
    squared = eigh(full(operators.stiffness), full(operators.mass), eigvals_only=True)
    assert found.frequencies**2 == pytest.approx(squared, rel=1e-11, abs=1e-13 * squared[-1])
    assert (found.frequencies[0] == 0.0) == (not found.mesh.is_held)


@pytest.mark.parametrize("mass", MASSES)
def test_a_free_rod_has_one_rigid_mode(mass):
    frequencies = basis(FREE, FREE, 400, mass).frequencies
    assert frequencies[0] == 0.0
    c = math.sqrt(STEEL.young / STEEL.density)
    assert frequencies[1] == pytest.approx(math.pi * c, rel=2e-5)


# Bases other than eigenvectors


def struck(left=FREE, right=CLAMPED, elements=60, mass="consistent", order=1, segments=(STEEL,)):
    return Mesh(Rod("rod", segments, left, right), elements, mass, 0.0, order)


def reduced(part, mesh, modes, faces=HIT):
    span = part.span(mesh, modes, faces)
    return ReducedMesh(mesh, span.shapes, span.uncoupled)


@pytest.mark.parametrize("order", [1, 5])
def test_craig_bampton_of_a_uniform_rod_has_the_frequencies_of_its_closed_form(order):
    # Unit line mass and stiffness on 0 to 1: the constraint mode 1 - x has mass 1/3 and stiffness 1, couples to the
    # fixed-fixed mode sqrt(2) sin(k x), k = n pi, by sqrt(2)/k in the mass, and in the stiffness not at all.
    modes = 6
    numbers = np.pi * np.arange(1, modes)
    mass, stiffness = np.eye(modes), np.diag(np.concatenate(([1.0], numbers**2)))
    mass[0, 0], mass[0, 1:], mass[1:, 0] = 1.0 / 3.0, np.sqrt(2.0) / numbers, np.sqrt(2.0) / numbers
    exact = np.sqrt(eigh(stiffness, mass, eigvals_only=True)) * STEEL.wave_speed / STEEL.length
    mesh = struck(elements=400 if order == 1 else 20, order=order)
    found = reduced(CraigBampton(), mesh, modes).frequencies
    # (k h)^2/24 of the highest fixed-fixed mode, 5 pi: 6.4e-5 for 400 elements.
    assert found == pytest.approx(exact, rel=1e-4 if order == 1 else 1e-8)


def test_craig_bampton_of_a_free_rod_struck_at_both_ends_keeps_both_faces():
    mesh = struck(FREE, FREE)
    faces = (Face(0.0, 0, 1.0), Face(STEEL.length, 1, 1.0))
    shapes = CraigBampton().span(mesh, 5, faces).shapes
    assert shapes.shape[1] == 6
    assert shapes[[0, -1], :2] == pytest.approx(np.eye(2))
    assert shapes[:, :2].sum(axis=1) == pytest.approx(1.0)  # the rigid motion
    assert not np.any(shapes[[0, -1], 2:])


def test_without_a_contact_craig_bampton_are_the_eigenvectors():
    mesh = struck()
    found = reduced(CraigBampton(), mesh, 5, ()).frequencies
    assert found == pytest.approx(reduced(Eigenvectors(), mesh, 5, ()).frequencies, rel=1e-12)


def test_only_the_struck_piece_of_a_substructured_rod_is_fine():
    mesh = struck(elements=40)
    shapes = Substructured(pieces=4, others=1).span(mesh, 14, HIT).shapes
    # Nodes 0, 10, 20, 30 are kept; 3 coarse pieces with one mode each leave 14 - 4 - 3 = 7 for the first.
    inside = [np.count_nonzero(np.any(shapes[a:b, 4:] != 0.0, axis=0)) for a, b in ((1, 10), (11, 20), (21, 30))]
    assert inside == [7, 1, 1]
    runs = ((1, 10), (11, 20), (21, 30), (31, 40))
    assert all(sum(np.any(column[a:b]) for a, b in runs) == 1 for column in shapes.T[4:])


def test_pieces_of_a_substructured_rod_are_cut_at_borders_of_elements():
    mesh = struck(elements=6, order=4)
    found = reduced(Substructured(pieces=3, others=2), mesh, 24)
    whole = eigh(full(mesh.stiffness), full(mesh.mass), eigvals_only=True)
    assert found.frequencies**2 == pytest.approx(whole, rel=1e-9)


@pytest.mark.parametrize("right", [CLAMPED, FREE])
def test_the_first_ritz_vector_is_the_static_displacement(right):
    mesh = struck(right=right)
    static = mesh.static(mesh.row(0.0, "displacement"))
    shapes = Ritz().span(mesh, 3, HIT).shapes
    first = shapes[:, 0 if right is CLAMPED else 1]
    assert first * (static[0] / first[0]) == pytest.approx(static, rel=1e-10, abs=1e-12 * static[0])
    body = Modal(60, 3, basis=Ritz()).build(Rod("rod", (STEEL,), FREE, right), 0.0, HIT)
    assert body.left_out(0.0, "displacement", 0.0) == pytest.approx(0.0, abs=1e-11 * static[0])


def test_forty_ritz_vectors_stay_orthogonal():
    mesh = struck(elements=400)
    shapes = Ritz().span(mesh, 40, HIT).shapes
    assert shapes.T @ full(mesh.mass) @ shapes == pytest.approx(np.eye(40), abs=1e-12)


def test_macneal_gives_the_flexibility_left_out_to_a_massless_face():
    rod = Rod("rod", (STEEL,), FREE, CLAMPED)
    system = Modal(200, 10, basis=Macneal()).build(rod, 0.0, HIT).operators()
    # Of the continuous rod: L/(EA) (1 - sum 2/k^2 over ten modes, k = (n - 1/2) pi); the mesh adds its (k h)^2/12.
    kept = 2.0 / ((np.arange(1, 11) - 0.5) * np.pi) ** 2
    ((x, flexibility),) = system.massless
    assert x == 0.0
    assert flexibility == pytest.approx(STEEL.length / (STEEL.young * STEEL.area) * (1.0 - kept.sum()), rel=2e-3)
    assert Modal(20, None, basis=Macneal()).build(rod, 0.0, HIT).operators().massless == ()


def test_modal_coordinates_over_a_massless_face_report_its_flexibility():
    rod = Rod("rod", (STEEL,), FREE, CLAMPED)
    model = Modal(40, None, "redistributed").build(rod, 0.0, HIT)
    ((_, flexibility),) = model.operators().massless
    assert flexibility == pytest.approx(STEEL.length / 40 / (STEEL.young * STEEL.area), rel=1e-9)


@pytest.mark.parametrize("right", [CLAMPED, FREE])
def test_the_striker_attached_changes_coordinates_and_drops_no_negative_energy(right):
    rod = Rod("rod", (STEEL,), FREE, right)
    body = Modal(60, 8, basis=StrikerAttached()).build(rod, 0.0, (Face(0.0, 3, 1.5),))
    system = body.operators()
    phases = system.phases
    assert phases is not None
    assert phases.contact == 3
    closed = phases.closed.operators()
    assert closed.load.size == system.load.size
    random = np.random.default_rng(7)
    for maps, before, after in ((phases.closing, system, closed), (phases.opening, closed, system)):
        rigid = before.stiffness[0] == 0.0
        for _ in range(20):
            u, v = random.normal(size=(2, system.load.size))
            new_u, new_v = maps[0] @ u, maps[1] @ v
            assert new_v @ new_v <= (v @ v) * (1.0 + 1e-12)
            assert after.stiffness[0] @ new_u**2 <= before.stiffness[0] @ u**2 * (1.0 + 1e-10)
        # Momentum and place of the whole are kept.
        assert maps[1][rigid][:, rigid] == pytest.approx(np.eye(int(rigid.sum())), abs=1e-12)
    if right is FREE:
        moving = Modal(60, 8, basis=StrikerAttached()).build(
            Rod("rod", (STEEL,), FREE, FREE, velocity=2.0), 0.0, (Face(0.0, 3, 1.5),)
        )
        v = moving.operators().velocity
        assert phases.closed.momentum_row() @ (phases.closing[1] @ v) == pytest.approx(2.0 * STEEL.mass, rel=1e-12)


def test_attached_shapes_have_the_frequencies_of_rod_and_striker():
    striker, mesh = 1.5, struck(elements=400)
    _, shapes = StrikerAttached().span(mesh, 8, (Face(0.0, 0, striker),)).closed
    row = mesh.row(0.0, "displacement")
    mass = shapes.T @ (full(mesh.mass) + striker * np.outer(row, row)) @ shapes
    stiffness = shapes.T @ full(mesh.stiffness) @ shapes
    found = np.sqrt(eigh(stiffness, mass, eigvals_only=True))[0] * STEEL.length / STEEL.wave_speed
    # k tan k = rho A L/M for the clamped rod with the mass M on its free end; (k h)^2/24 of the mesh is 1e-6.
    ratio = STEEL.mass / striker
    assert found * math.tan(found) == pytest.approx(ratio, rel=1e-5)


@pytest.mark.parametrize(
    ("part", "faces", "modes", "text"),
    [
        (CraigBampton(), (Face(0.0, 0, 1.0), Face(0.5, 1, 1.0)), 1, "needs 2 modes or more"),
        (Substructured(pieces=100), HIT, 10, "100 pieces of a mesh of 60 elements"),
        (Substructured(pieces=4, others=3), HIT, 12, "needs 13 modes or more"),
        (Ritz(), (), 10, "this rod has none"),
        (StrikerAttached(), (), 10, "this rod has none"),
        (StrikerAttached(), (Face(0.0, 0, 1.0), Face(1.0, 1, 1.0)), 10, "this rod has 2"),
        (StrikerAttached(), (Face(0.0, 0, math.inf),), 10, "meets a wall"),
        (StrikerAttached(), (Face(0.0, 0, math.nan),), 10, "meets a rod"),
    ],
)
def test_bodies_that_a_basis_cannot_serve_are_refused_by_name(part, faces, modes, text):
    rod = Rod("rod", (STEEL,), FREE, CLAMPED)
    with pytest.raises(CaseError, match=text) as refusal:
        Modal(60, modes, basis=part).build(rod, 0.0, faces)
    assert refusal.value.remedy
    assert refusal.value.path.startswith("solve.model.")


def test_a_basis_of_a_mesh_needs_one():
    with pytest.raises(CaseError, match="only free-end eigenvectors are known without a mesh"):
        Modal(None, 10, basis=CraigBampton()).build(Rod("rod", (STEEL,), FREE, CLAMPED), 0.0, HIT)


def test_a_mesh_too_large_for_its_modes_is_refused():
    with pytest.raises(CaseError, match="elements times order up to 2000"):
        Modal(2000, 10, order=2).build(Rod("rod", (STEEL,), FREE, CLAMPED), 0.0, HIT)


# Damping of modes


@pytest.mark.parametrize("elements", [None, 50])
def test_proportional_damping_leaves_modes_uncoupled(elements):
    viscous = Segment(1.0, 3e-4, 2.1e11, 7850.0, viscosity=2.1e5)
    rod = Rod("rod", (viscous,), FREE, CLAMPED, damping=Rayleigh(40.0, 3e-7))
    system = Modal(elements, 6).build(rod, 0.0, HIT).operators()
    assert system.damping == pytest.approx(40.0 + (3e-7 + 1e-6) * system.stiffness, rel=1e-12)
    if elements:
        mesh = Mesh(rod, elements, "consistent", 0.0)
        found = reduced(Eigenvectors(), mesh, 6)
        projected = found.shapes.T @ full(mesh.damping) @ found.shapes
        # Rounding of the projection: of the largest entries of C.
        assert projected == pytest.approx(np.diag(system.damping[0]), abs=1e-9 * system.damping[0, -1])


@pytest.mark.parametrize(
    ("segments", "right", "text"),
    [
        ((Segment(1.0, 3e-4, 2.1e11, 7850.0, viscosity=2.1e5), BRASS), CLAMPED, "couples the modes"),
        ((Segment(1.0, 3e-4, 2.1e11, 7850.0, viscosity=2.1e5),), End("spring", 1e8), "couples the modes"),
        ((STEEL,), End("dashpot", 10.0), "does not support the dashpot"),
    ],
)
def test_damping_that_couples_modes_is_refused_by_name(segments, right, text):
    with pytest.raises(PairingError, match=text) as refusal:
        Modal(50, 6).build(Rod("rod", segments, FREE, right), 0.0, HIT)
    assert "finite_element" in refusal.value.remedy
