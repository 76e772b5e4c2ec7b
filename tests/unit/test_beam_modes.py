"""Analytic modes of beams, against transfer matrices, printed numbers, statics and a mesh."""

from __future__ import annotations

import math
from itertools import pairwise, product

import numpy as np
import pytest
from scipy.linalg import expm

from impactlab.bases.beams.modes import BeamModes
from impactlab.bases.reduced import ReducedMesh
from impactlab.bases.shapes import eigenvectors
from impactlab.errors import CaseError
from impactlab.models.base import Face
from impactlab.models.mesh.beams import BeamMesh
from impactlab.scene import Beam, BeamSegment, End

KINDS = ("clamped", "pinned", "free")
PAIRS = tuple(product(KINDS, KINDS))
UNIT = BeamSegment(1.0, 1.0, 1.0, 1.0, inertia=1.0)  # beta L = sqrt(w)
SLENDER = BeamSegment(1.3, 1e-4, 2.1e11, 7850.0, inertia=1e-8 / 12.0)
# Three times as long as high: from the fourth or fifth on its modes lie above the cut-off frequency.
STOCKY = BeamSegment(
    0.3, 1e-2, 2.1e11, 7850.0, inertia=1e-4 / 12.0, shear_stiffness=8e10 * 1e-2 * 5 / 6, rotary_inertia=7850.0e-4 / 12.0
)
SEGMENTS = {"euler_bernoulli": SLENDER, "timoshenko": STOCKY}
QUANTITIES = ("displacement", "rotation", "bending_moment", "shear_force")
ZEROS = {"clamped": (0, 1), "pinned": (0, 2), "free": (2, 3)}


def beam(segment, left, right, **given):
    return Beam("beam", (segment,), End(left), End(right), **given)


def determinants(segment, kinds, frequencies):
    """The characteristic determinant from the transfer matrix of w, theta, M and Q; units of the beam's length."""
    length, mass = segment.length, segment.mass
    stiffness = segment.bending_stiffness / length**3
    squared = frequencies**2 * mass / stiffness
    matrix = np.zeros((frequencies.size, 4, 4))
    matrix[:, 0, 1] = 1.0
    matrix[:, 0, 3] = segment.bending_stiffness / (segment.shear_stiffness * length**2)
    matrix[:, 1, 2] = 1.0
    matrix[:, 2, 1] = -squared * segment.rotary_inertia / (mass * length)
    matrix[:, 2, 3] = -1.0
    matrix[:, 3, 0] = -squared
    transfer = expm(matrix)
    loose = [i for i in range(4) if i not in ZEROS[kinds[0]]]
    return np.linalg.det(transfer[:, ZEROS[kinds[1]]][:, :, loose])


@pytest.mark.parametrize(
    ("kinds", "rigid", "numbers"),
    [
        (("clamped", "free"), 0, (1.8751040687, 4.6940911330, 7.8547574382)),
        (("free", "clamped"), 0, (1.8751040687, 4.6940911330, 7.8547574382)),
        (("free", "free"), 2, (4.7300407449,)),
        (("clamped", "clamped"), 0, (4.7300407449,)),
        (("clamped", "pinned"), 0, (3.9266023120,)),
        (("free", "pinned"), 1, (3.9266023120,)),
        (("pinned", "pinned"), 0, (math.pi, 2.0 * math.pi)),
    ],
)
def test_wave_numbers_of_textbooks(kinds, rigid, numbers):
    modes = BeamModes(beam(UNIT, *kinds), 5)
    assert modes.frequencies.size == 5 + rigid
    assert np.all(modes.frequencies[:rigid] == 0.0)
    # The numbers are rounded to ten decimals.
    assert np.sqrt(modes.frequencies[rigid : rigid + len(numbers)]) == pytest.approx(numbers, abs=0.51e-10)


@pytest.mark.parametrize("kinds", PAIRS)
def test_every_frequency_of_a_stocky_timoshenko_beam_is_found(kinds):
    modes = BeamModes(beam(STOCKY, *kinds), 16)
    found = modes.frequencies[modes.frequencies > 0.0]
    cut_off = math.sqrt(STOCKY.shear_stiffness / STOCKY.rotary_inertia)
    assert np.count_nonzero(found < cut_off) >= 3
    assert np.count_nonzero(found > cut_off) >= 10
    # Its own characteristic equation to 1e-8: the determinant changes its sign within 1e-9 of each frequency ...
    close = [determinants(STOCKY, kinds, found * (1.0 + sign * 1e-9)) for sign in (-1.0, 1.0)]
    assert np.all(close[0] * close[1] < 0.0)
    # ... and nowhere else, on a grid of twenty places between two (nothing is missed).
    for low, high in pairwise(np.concatenate(([0.02 * found[0]], found))):
        inside = determinants(STOCKY, kinds, np.linspace(low * (1.0 + 1e-9), high * (1.0 - 1e-9), 20))
        assert np.all(inside * inside[0] > 0.0)


@pytest.mark.parametrize("theory", SEGMENTS)
@pytest.mark.parametrize("kinds", PAIRS)
def test_shapes_hold_the_ends(kinds, theory):
    segment = SEGMENTS[theory]
    modes = BeamModes(beam(segment, *kinds), 300)
    places = segment.length * np.concatenate(([0.0], (np.arange(50) * 0.6180339887) % 1.0, [1.0]))
    for which, quantity in enumerate(QUANTITIES):
        sizes = np.abs([modes.row(float(place), quantity) for place in places])
        for end, kind in ((0, kinds[0]), (-1, kinds[1])):
            if which in ZEROS[kind]:
                # Rounding of B grows in the phase: 300 pi times eps, and some. A mode that mostly shears (or, at the
                # cut-off, does nothing else) deflects little: the largest of it and those below is what counts.
                assert np.all(sizes[end] <= 1e-11 * np.maximum.accumulate(sizes.max(axis=0)))


@pytest.mark.parametrize("theory", SEGMENTS)
@pytest.mark.parametrize("kinds", PAIRS)
def test_shapes_are_orthogonal_and_of_unit_mass(kinds, theory):
    segment = SEGMENTS[theory]
    modes = BeamModes(beam(segment, *kinds), 40)
    nodes, weights = np.polynomial.legendre.leggauss(150)  # exact to rounding for products of 40 half waves
    x, weight = 0.5 * segment.length * (1.0 + nodes), 0.5 * segment.length * weights
    w, theta = (np.array([modes.row(float(place), quantity) for place in x]) for quantity in QUANTITIES[:2])
    overlap = segment.density * segment.area * (w.T * weight) @ w + segment.rotary_inertia * (theta.T * weight) @ theta
    assert np.abs(overlap - np.eye(len(overlap))).max() < 1e-11
    momentum = segment.density * segment.area * weight @ w
    assert modes.project_uniform() == pytest.approx(momentum, abs=1e-11 * math.sqrt(segment.mass))


@pytest.mark.parametrize("theory", SEGMENTS)
@pytest.mark.parametrize("kinds", PAIRS)
def test_modes_sum_up_to_the_static_compliance(kinds, theory):
    segment = SEGMENTS[theory]
    modes = BeamModes(beam(segment, *kinds), 2000)
    elastic = modes.frequencies > 0.0
    x, face = 0.31 * segment.length, 0.64 * segment.length
    for quantity, tolerance in (("displacement", 1e-6), ("rotation", 1e-5), ("bending_moment", 1e-3)):
        of_modes = modes.row(x, quantity) * modes.row(face, "displacement")
        total = np.sum(of_modes[elastic] / modes.frequencies[elastic] ** 2)
        size = max(abs(modes.static(place * segment.length, quantity, face)) for place in (0.1, 0.31, 0.5, 0.64, 0.8))
        # Terms fall as n^-4 (with shear n^-2, half as many of each branch) in deflections, one power less a quantity;
        # away from the force they alternate, so that the rest is about the last term.
        assert abs(total - modes.static(x, quantity, face)) < tolerance * size


@pytest.mark.parametrize("theory", SEGMENTS)
@pytest.mark.parametrize("kinds", PAIRS)
def test_static_compliances_are_those_of_elements(kinds, theory):
    segment = SEGMENTS[theory]
    body = beam(segment, *kinds)
    modes = BeamModes(body, 3)
    for face in (0.0, 0.25, 0.6, 1.0):
        contacts = (Face(face * segment.length, 0, 1.0),)
        mesh, finer = (BeamMesh(body, n, "consistent", 0.0, faces=contacts) for n in (80, 160))
        held = mesh.is_held
        for quantity in QUANTITIES[:2] if not held else QUANTITIES:
            places = (0.0, 0.125, 0.25, 0.6, 0.7, 1.0)
            exact = [modes.static(x * segment.length, quantity, face * segment.length) for x in places]
            other = [mesh.static_compliance(x * segment.length, quantity, face * segment.length) for x in places]
            if not held:  # the inertia that relieves a free beam is that of the elements, of second order
                fine = [finer.static_compliance(x * segment.length, quantity, face * segment.length) for x in places]
                other = [(4.0 * b - a) / 3.0 for a, b in zip(other, fine, strict=True)]
            if quantity == "shear_force":  # the mesh gives what is right of a contact, and left of the last node
                exact, other = exact[1:4:2], other[1:4:2]
            # Exact at nodes of a held beam up to rounding, which grows as the fourth power of the elements; what the
            # extrapolation leaves is of fourth order.
            size = max(abs(modes.static(x * segment.length, quantity, 0.6 * segment.length)) for x in places)
            assert other == pytest.approx(exact, abs=(1e-8 if held else 1e-6) * size)


@pytest.mark.parametrize("theory", SEGMENTS)
@pytest.mark.parametrize("kinds", PAIRS)
def test_rows_are_those_of_a_fine_mesh(kinds, theory):
    segment = SEGMENTS[theory]
    body = beam(segment, *kinds)
    mesh = BeamMesh(body, 300, "consistent", 0.0)
    modes = BeamModes(body, 6)
    rigid = mesh.rigid.shape[1]
    reduced = ReducedMesh(mesh, eigenvectors(mesh, 6 + rigid), uncoupled=True)
    # FE frequencies converge with the fourth power of the mesh, with shear and elements short against the height with
    # the second: at six half waves on 300 elements (6 pi/300)^2/12 is 3e-4.
    assert reduced.frequencies == pytest.approx(modes.frequencies, rel=1e-3)
    x = 0.3 * segment.length
    for quantity in QUANTITIES[:2]:
        # Products with the deflection at one face are free of signs.
        exact = (modes.row(x, quantity) * modes.row(0.64 * segment.length, "displacement"))[rigid:]
        other = (reduced.row(x, quantity) * reduced.row(0.64 * segment.length, "displacement"))[rigid:]
        assert other == pytest.approx(exact, abs=2e-3 * np.abs(exact).max())


def test_a_deflection_is_projected():
    body = beam(SLENDER, "clamped", "free")
    modes = BeamModes(body, 8)
    for number in (0, 5):
        found = modes.project(
            lambda x, number=number: np.array([modes.row(float(place), "displacement")[number] for place in x])
        )
        assert found == pytest.approx(np.eye(8)[number], abs=1e-10)


@pytest.mark.parametrize(
    "given",
    [
        beam(SLENDER, "clamped", "spring"),
        beam(SLENDER, "pinned", "pinned", tension=1.0),
        Beam("beam", (SLENDER, SLENDER), End("free"), End("free")),
    ],
)
def test_other_beams_are_sent_to_a_mesh(given):
    with pytest.raises(CaseError, match="need a uniform beam without tension") as error:
        BeamModes(given, 5)
    assert "elements" in str(error.value)
