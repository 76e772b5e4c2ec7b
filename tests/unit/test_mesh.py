"""Meshes of bars: elements of any order, damping, contact nodes without mass."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

from impactlab.contact.power_law import Hertz
from impactlab.errors import CaseError
from impactlab.integrators.central_difference import CentralDifference
from impactlab.models.base import Face
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.bar_elements import elements_per_segment, laid_out, polynomials, reference
from impactlab.models.mesh.bars import Mesh
from impactlab.models.modal import Modal
from impactlab.numerics.banded import full, multiply
from impactlab.scene import End, Rayleigh, Rod, Segment
from impactlab.scene.bodies import SampledLoad
from impactlab.scene.method import StepRule
from impactlab.simulate.plan import prepare
from impactlab.testing.scenes import mass_on_rod

FREE, CLAMPED = End("free"), End("clamped")
STEEL = Segment(0.3, 9.0e-4, 2.1e11, 7900.0)
BRASS = Segment(0.2, 4.0e-4, 1.0e11, 8500.0)
LEFT, RIGHT = Face(0.0, 0, 1.0), Face(0.3, 1, math.inf)


def rod(left=FREE, right=CLAMPED, segments=(STEEL,), **more):
    return Rod("rod", segments, left, right, **more)


def frequencies(mesh):
    return np.sqrt(np.abs(eigh(full(mesh.stiffness), full(mesh.mass), eigvals_only=True)))


@pytest.mark.parametrize("order", range(1, 13))
def test_the_nodes_integrate_polynomials_and_the_slopes_are_theirs(order):
    element, power = reference(order), np.arange(2 * order)
    exact = (1.0 - (-1.0) ** (power + 1)) / (power + 1)
    assert element.weights @ element.nodes[:, None] ** power == pytest.approx(exact, abs=1e-13)
    for degree in range(order + 1):
        slope = degree * element.nodes ** max(degree - 1, 0)
        # Entries of the matrix of slopes grow as order^2: 1e2 roundings of up to 40.
        assert element.slopes @ element.nodes**degree == pytest.approx(slope, abs=1e-12)
    assert np.array_equal(np.array([polynomials(order, x) for x in element.nodes]), np.eye(order + 1))
    # The exact mass and the lumped one hold the same line mass, 1 over the length 2.
    assert element.consistent.sum() == pytest.approx(2.0, rel=1e-13)
    assert np.trace(element.lumped) == pytest.approx(2.0, rel=1e-13)


@pytest.mark.parametrize("elements", [2, 3, 17])
@pytest.mark.parametrize("left", [FREE, CLAMPED, End("dashpot", 1e3)])
@pytest.mark.parametrize("right", [FREE, CLAMPED, End("mass", 0.1), End("spring", 1e8)])
def test_the_highest_frequency_of_a_lumped_mesh_is_exact(left, right, elements):
    mesh = Mesh(rod(left, right), elements, "lumped", 0.0)
    assert mesh.operators().highest_frequency == pytest.approx(frequencies(mesh)[-1], rel=1e-13)


def test_a_row_that_was_read_is_kept_and_cannot_be_written():
    mesh = Mesh(rod(), 8, "lumped", 0.0)
    row = mesh.row(0.05, "displacement")
    assert mesh.row(0.05, "displacement") is row
    assert mesh.row(0.05, "strain") is not row
    with pytest.raises(ValueError, match="read-only"):
        row[0] = 2.0


def test_order_1_is_the_two_node_bar():
    element = reference(1)
    assert element.stiffness == pytest.approx(np.array([[0.5, -0.5], [-0.5, 0.5]]))
    assert element.consistent == pytest.approx(np.array([[2.0, 1.0], [1.0, 2.0]]) / 3.0)
    assert np.array_equal(element.lumped, np.eye(2))


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_eigenvalues_of_a_clamped_rod_converge_with_twice_the_order(order, mass):
    count = {1: 16, 2: 8, 3: 4, 4: 3}[order]
    # The third mode, so that the errors of fine meshes of order 4 stay above rounding.
    exact = (2.5 * np.pi * STEEL.wave_speed / STEEL.length) ** 2
    coarse, fine = (
        abs(frequencies(Mesh(rod(), n, mass, 0.0, order))[2] ** 2 / exact - 1.0) for n in (count, 2 * count)
    )
    # k h is about 0.5 to 2.6 on these meshes: the next term of the error is a few per cent of the first.
    assert math.log2(coarse / fine) == pytest.approx(2 * order, abs=0.35)


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
@pytest.mark.parametrize("order", [2, 5, 12])
@pytest.mark.parametrize("left", [FREE, End("spring", 5e9), End("mass", 0.5)])
def test_the_highest_frequency_is_a_close_bound(left, order, mass):
    mesh = Mesh(rod(left, segments=(STEEL, BRASS)), 12, mass, 0.0, order)
    highest, found = mesh.operators().highest_frequency, frequencies(mesh)[-1]
    # Below the bound by what the neighbours of the stiffest element hold back.
    assert found <= highest * (1.0 + 1e-9)
    assert found > 0.9 * highest


@pytest.mark.parametrize("order", [1, 2, 7])
@pytest.mark.parametrize("ends", [(FREE, CLAMPED), (FREE, FREE), (End("spring", 1e9), FREE)])
def test_static_compliances_of_spectral_elements_are_those_of_the_continuous_rod(ends, order):
    struck = Mesh(rod(*ends), 8, "consistent", 0.0, order)
    stiffness, length = STEEL.young * STEEL.area, STEEL.length
    for x in (0.0, 0.11, 0.3):
        found = struck.static_compliance(x, "displacement", 0.0)
        if ends[1].kind == "clamped":
            exact = (length - x) / stiffness
        elif ends[0].kind == "spring":
            exact = 1e-9
        else:  # inertia relief: quadratic, so exact between nodes of elements of order 2 and above
            exact = (x**2 / (2.0 * length) - x + length / 3.0) / stiffness
            if order == 1:
                assert found == pytest.approx(exact, abs=length / stiffness / 8.0**2)
                continue
        assert found == pytest.approx(exact, rel=1e-10, abs=1e-12 * length / stiffness)


def test_courant_counts_the_smallest_distance_between_nodes():
    model = FiniteElement(10, "lumped", 4)
    nodes = Mesh(rod(), 10, "lumped", 0.0, 4).nodes
    assert model.element_length(rod()) == pytest.approx(np.diff(nodes).min(), rel=1e-12)


def test_courant_counts_each_element_at_its_own_wave_speed():
    """Elements of equal transit: the shortest belongs to the slower material, whose wave is not the fastest."""
    fast, slow = Segment(0.4, 9.0e-4, 2.1e11, 2100.0), Segment(0.05, 9.0e-4, 1.0e9, 1000.0)  # 10000 m/s, 1000 m/s
    body = rod(segments=(fast, slow))
    transit = (0.4 / 1e4 + 0.05 / 1e3) / 90
    for model in (FiniteElement(90, "lumped"), Modal(elements=90)):
        assert model.shortest_transit(body) == pytest.approx(transit, rel=1e-12)
    struck = mass_on_rod(
        FiniteElement(90, "lumped"), Hertz(1e9), CentralDifference(), StepRule(courant=0.9), segments=(fast, slow)
    )
    assert prepare(*struck).dt == pytest.approx(0.9 * transit, rel=1e-3)  # a whole number of steps


@pytest.mark.parametrize("order", [1, 3])
def test_a_courant_number_that_is_stable_on_one_material_is_so_on_several(order):
    random = np.random.default_rng(5)

    def limit(segments):  # of dt times the highest frequency, at courant 1
        body = rod(FREE, FREE, segments)
        highest = frequencies(Mesh(body, 12, "lumped", 0.0, order)).max()
        return highest * FiniteElement(12, "lumped", order).shortest_transit(body)

    def piece():
        length, area = float(random.uniform(0.05, 0.5)), 10.0 ** random.uniform(-5.0, -3.0)
        return Segment(length, area, 10.0 ** random.uniform(9.0, 11.5), 10.0 ** random.uniform(2.5, 4.3))

    for _ in range(20):
        assert limit((piece(), piece(), piece())) <= limit((STEEL,)) * (1.0 + 1e-9)


# Damping


@pytest.mark.parametrize("order", [1, 3])
@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_rayleigh_damping_is_the_sum_of_the_matrices(mass, order):
    ends = (End("spring", 1e8), End("mass", 0.4))
    mesh = Mesh(rod(*ends, damping=Rayleigh(30.0, 2e-6)), 6, mass, 0.0, order)
    assert full(mesh.damping) == pytest.approx(30.0 * full(mesh.mass) + 2e-6 * full(mesh.stiffness), rel=1e-13)


@pytest.mark.parametrize(("order", "mass"), [(1, "consistent"), (3, "lumped"), (1, "redistributed")])
@pytest.mark.parametrize("left", [FREE, End("spring", 1e8)])
@pytest.mark.parametrize("right", [FREE, CLAMPED, End("spring", 1e7), End("dashpot", 1e3), End("mass", 0.4)])
def test_springs_and_dashpots_to_the_ground_are_the_sums_of_rows(order, mass, left, right):
    segments = (STEEL, Segment(0.2, 4.0e-4, 1.0e11, 8500.0, viscosity=5e4))
    body = rod(left, right, segments, damping=Rayleigh(30.0, 2e-6))
    system = Mesh(body, 10, mass, 0.0, order, (LEFT,) if mass == "redistributed" else ()).operators()
    ones = np.ones(system.load.size)
    # A few roundings of the numbers that are added up.
    springs, dashpots = multiply(system.stiffness, ones), multiply(system.damping, ones) - system.end_dashpots
    assert np.all(np.abs(springs - system.ground_springs) <= 1e-15 * system.stiffness[0])
    assert np.all(np.abs(dashpots - system.ground_dashpots) <= 1e-15 * system.damping[0])
    held = {"clamped": 1, "spring": 1}
    assert np.count_nonzero(system.ground_springs) <= order * sum(held.get(end.kind, 0) for end in (left, right))


def test_viscosity_of_one_segment_damps_that_segment_alone():
    soft = Segment(0.2, 4.0e-4, 1.0e11, 8500.0, viscosity=5e4)
    mesh = Mesh(rod(segments=(STEEL, soft)), 10, "consistent", 0.0)
    damping = full(mesh.damping)
    border = int(np.searchsorted(mesh.nodes, STEEL.length - 1e-9))
    assert not np.any(damping[:border])
    # A uniform strain rate e in the segment loses viscosity e^2 per volume; its right end is clamped.
    velocity = np.clip(mesh.nodes[:-1] - STEEL.length, 0.0, None)
    held = velocity.copy()
    held -= 0.2 * (mesh.nodes[:-1] >= STEEL.length - 1e-9)  # u = x - L beyond the border, 0 at the clamp
    held[:border] = -0.2
    assert held @ damping @ held == pytest.approx(5e4 * 4.0e-4 * 0.2, rel=1e-12)


def test_a_rod_with_dashpots_only_has_diagonal_damping():
    mesh = Mesh(rod(FREE, End("dashpot", 12.0)), 6, "consistent", 0.0)
    assert mesh.damping.shape[0] == 1
    assert mesh.damping[0, -1] == 12.0
    assert not np.any(mesh.damping[0, :-1])


# Contact nodes without mass


def test_a_struck_end_without_mass_follows_its_neighbour_and_its_force():
    mesh = Mesh(rod(), 10, "redistributed", 0.0, 1, (LEFT,))
    h, stiffness = 0.03, STEEL.young * STEEL.area
    system = mesh.operators()
    assert system.massless == ((0.0, pytest.approx(h / stiffness, rel=1e-12)),)
    assert system.mass.shape == (1, 9)
    row = mesh.row(0.0, "displacement")
    assert row[0] == 1.0
    assert not np.any(row[1:])
    whole = Mesh(rod(), 10, "lumped", 0.0)
    # The node's mass went to its neighbour.
    assert system.mass[0, 0] == pytest.approx(whole.mass[0, 0] + whole.mass[0, 1], rel=1e-14)
    assert mesh.momentum_row().sum() == pytest.approx(whole.momentum_row().sum(), rel=1e-14)
    # Static answers are those of the mesh with all its nodes: the matrix was condensed, not cut.
    for x in (0.0, 0.01, 0.03, 0.2):
        for quantity in ("displacement", "stress"):
            kept, whole_answer = (m.static_compliance(x, quantity, 0.0) for m in (mesh, whole))
            assert kept == pytest.approx(whole_answer, rel=1e-12), (x, quantity)


def test_an_inner_contact_and_both_ends_lose_their_mass_and_keep_the_statics():
    faces = (LEFT, Face(0.15, 2, 1.0), RIGHT)
    mesh = Mesh(rod(End("spring", 1e9), FREE), 10, "redistributed", 0.0, 1, faces)
    whole = Mesh(rod(End("spring", 1e9), FREE), 10, "lumped", 0.0)
    assert mesh.mass.shape == (1, 8)
    assert mesh.mass.sum() == pytest.approx(STEEL.mass, rel=1e-14)
    assert np.all(mesh.stiffness[0] > 0.0)
    for face in (0.0, 0.15, 0.3):
        for x in (0.0, 0.1, 0.15, 0.27, 0.3):
            found = mesh.static_compliance(x, "displacement", face)
            assert found == pytest.approx(whole.static_compliance(x, "displacement", face), rel=1e-12)
    flexibility = dict(mesh.operators().massless)
    assert flexibility[0.0] == pytest.approx(1.0 / (1e9 + STEEL.young * STEEL.area / 0.03))
    assert flexibility[0.15] == pytest.approx(0.5 * 0.03 / (STEEL.young * STEEL.area))


@pytest.mark.parametrize("elements", [4, 40])
def test_the_first_frequency_with_a_massless_face_is_that_of_the_chain(elements):
    # A chain of n - 1 springs with 3/2 of a node's mass on its end: u_j = cos(a (j - 1) + b) with tan b = 2 tan(a/2),
    # zero at the clamp, and w = (2c/h) sin(a/2).
    a = brentq(lambda a: a * (elements - 1) + math.atan(2.0 * math.tan(0.5 * a)) - 0.5 * np.pi, 1e-3, 2.0)
    found = frequencies(Mesh(rod(), elements, "redistributed", 0.0, 1, (LEFT,)))[0]
    assert found == pytest.approx(2.0 * STEEL.wave_speed / STEEL.length * elements * math.sin(0.5 * a), rel=1e-10)


@pytest.mark.parametrize(
    ("left", "elements", "faces", "text"),
    [
        (FREE, 10, (Face(0.145, 0, 1.0),), "lies inside an element"),
        (End("mass", 0.2), 10, (LEFT,), "carries a mass"),
        (End("dashpot", 2.0), 10, (LEFT,), "carries a dashpot"),
        (End("free", force=1e4), 10, (LEFT,), "carries a force"),  # its tip would be F h/(EA) off, a tenth in statics
        (End("spring", 1e9, load=SampledLoad((0.0, 1.0), (0.0, 1e4))), 10, (LEFT,), "carries a force"),
        (FREE, 1, (LEFT,), "needs a node with mass"),
        (FREE, 2, (LEFT, Face(0.15, 1, 1.0)), "needs a node with mass"),
    ],
)
def test_faces_that_cannot_lose_their_mass_are_refused(left, elements, faces, text):
    with pytest.raises(CaseError, match=text) as refusal:
        FiniteElement(elements, "redistributed").build(rod(left), 0.0, faces)
    assert refusal.value.remedy
    assert refusal.value.path.startswith("solve.model.")


def test_redistributed_mass_is_one_of_order_1():
    with pytest.raises(CaseError, match="Allowed: order 1"):
        FiniteElement(10, "redistributed", 2)


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
@pytest.mark.parametrize("order", [1, 3])
@pytest.mark.parametrize("damping", [Rayleigh(), Rayleigh(3.0, 1e-6)])
@pytest.mark.parametrize("ends", [(FREE, CLAMPED), (End("spring", 1e7), End("mass", 0.2)), (End("dashpot", 1e3), FREE)])
def test_a_uniform_rod_is_to_the_last_bit_that_of_two_equal_pieces(mass, order, damping, ends):
    half = Segment(0.25, 9.0e-4, 2.1e11, 7900.0)  # halves of 0.5 m are exact
    whole = Mesh(rod(*ends, (Segment(0.5, 9.0e-4, 2.1e11, 7900.0),), damping=damping), 8, mass, 0.0, order)
    pieces = Mesh(rod(*ends, (half, half), damping=damping), 8, mass, 0.0, order)
    for name in ("mass", "damping", "stiffness"):
        assert getattr(whole, name).tobytes() == getattr(pieces, name).tobytes()
    assert whole.momentum_row().tobytes() == pieces.momentum_row().tobytes()
    for quantity in ("displacement", "strain", "force"):
        assert whole.row(0.21, quantity).tobytes() == pieces.row(0.21, quantity).tobytes()


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("ends", [(FREE, FREE), (CLAMPED, FREE), (FREE, CLAMPED)])
def test_the_row_of_an_end_is_that_of_a_place_within_rounding_of_it(order, ends):
    mesh = Mesh(rod(*ends), 7, "lumped", 0.0, order)
    for x, near in ((0.0, 1e-14), (0.3, 0.3 - 1e-14)):
        assert np.array_equal(mesh.row(x, "displacement"), mesh.row(near, "displacement"))
        assert mesh.row(x, "velocity") is mesh.row(x, "displacement")


def test_one_segment_has_all_elements():
    assert elements_per_segment((STEEL,), 17) == (17,)
    assert elements_per_segment((STEEL, STEEL), 17) == (9, 8)
    placed = laid_out((STEEL, BRASS), 12)
    assert placed.borders[0] == 0.0
    assert placed.borders[-1] == 0.5
    assert np.diff(placed.borders) == pytest.approx(placed.lengths, rel=1e-12)
    assert placed.shortest == placed.lengths.min()


def test_a_mesh_gives_the_constants_of_every_element():
    two = (Segment(0.1, 9e-4, 2.1e11, 7900.0), Segment(0.2, 5e-4, 7e10, 2700.0))
    for segments in (two[:1], two):
        mesh = Mesh(Rod("rod", segments, End("free"), End("clamped")), 6, "lumped", 0.0)
        of = [segments[number] for number in mesh.of_segment]
        assert mesh.young.tolist() == [each.young for each in of]
        assert mesh.area.tolist() == [each.area for each in of]
        assert mesh.density.tolist() == [each.density for each in of]
        assert len(mesh.area) == len(mesh.lengths) == 6
