"""Orders of the frequencies of beam elements, measured against analytic modes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from impactlab.bases.beams.modes import BeamModes
from impactlab.models.mesh.beams import BeamMesh
from impactlab.numerics.banded import full
from impactlab.scene import Beam, End
from tests.reference.beam_scenes import STEEL, sheared


def errors(segment, ends, elements, mass, mode):
    beam = Beam("beam", (segment,), *(End(end) for end in ends))
    exact = BeamModes(beam, mode).frequencies[-1]
    rigid = BeamModes(beam, mode).frequencies.size - mode
    found = []
    for n in elements:
        mesh = BeamMesh(beam, n, mass, 0.0)
        at = rigid + mode - 1
        squared = eigh(full(mesh.stiffness), full(mesh.mass), subset_by_index=(at, at), eigvals_only=True)
        found.append(math.sqrt(squared[0]) / exact - 1.0)
    return found


@pytest.mark.parametrize("ends", [("pinned", "pinned"), ("clamped", "free"), ("free", "free")])
def test_euler_bernoulli_frequencies_converge_with_the_fourth_power(ends):
    coarse, fine = errors(STEEL, ends, (12, 24), "consistent", 3)
    assert coarse > fine > 0.0  # Ritz: from above
    assert math.log2(coarse / fine) == pytest.approx(4.0, abs=0.15)


@pytest.mark.parametrize("ends", [("pinned", "pinned"), ("clamped", "free"), ("free", "free")])
def test_timoshenko_frequencies_converge_with_the_second_power_once_elements_are_shorter_than_high(ends):
    stocky = replace(sheared(STEEL), length=4.0 * STEEL.height)
    coarse, fine = errors(stocky, ends, (20, 40), "consistent", 3)
    assert coarse > fine > 0.0
    assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_a_slender_timoshenko_beam_starts_with_the_fourth_power():
    slender = replace(sheared(STEEL), length=400.0 * STEEL.height)
    coarse, fine = errors(slender, ("pinned", "pinned"), (6, 12), "consistent", 3)
    assert math.log2(coarse / fine) == pytest.approx(4.0, abs=0.3)


@pytest.mark.parametrize(
    "segment", [STEEL, replace(sheared(STEEL), length=4.0 * STEEL.height)], ids=["slender", "stocky"]
)
def test_lumped_masses_converge_with_the_second_power_at_least(segment):
    coarse, fine = np.abs(errors(segment, ("pinned", "pinned"), (20, 40), "lumped", 3))
    assert math.log2(coarse / fine) > 1.9
