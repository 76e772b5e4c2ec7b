"""Eigenvectors of meshes: low frequencies are not lost in the rounding of the highest."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import eigh

from impactlab.bases.eigenvectors import MeshBasis, full
from impactlab.scene import End, Rod, Segment

FREE, CLAMPED = End("free"), End("clamped")
STEEL = Segment(1.0, math.pi * 0.01**2, 2.1e11, 7850.0)
BRASS = Segment(0.6, 4.0e-4, 1.0e11, 8500.0)
MASSES = ("consistent", "lumped")


def basis(left, right, elements, mass, segments=(STEEL,)):
    return MeshBasis(Rod("rod", segments, left, right), elements, None, mass)


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
