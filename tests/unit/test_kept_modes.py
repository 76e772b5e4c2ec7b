"""Modes of beams kept between runs: how often they are found, and that no bit depends on it."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from impactlab import load_case
from impactlab.api import physics_of, solve
from impactlab.bases import shapes
from impactlab.bases.beams import modes as kept
from impactlab.bases.beams.waves import BeamNumbers
from impactlab.models.mesh.beams import BeamMesh
from impactlab.refine.descriptions.suitable import in_turn
from impactlab.scene import Beam, BeamSegment, End
from impactlab.scene.method import Tolerance
from impactlab.scene.recent import Recent
from tests.support import CASES

SEGMENT = BeamSegment(length=1.0, area=3e-4, inertia=8e-9, young=2.1e11, density=7850.0)


@pytest.fixture(autouse=True)
def nothing_kept(monkeypatch):
    monkeypatch.setattr(kept, "_kept", Recent(kept.MAX_KEPT))
    monkeypatch.setattr(shapes, "_kept", Recent(shapes.MAX_KEPT))


@pytest.mark.parametrize("kinds", list(itertools.product(("free", "pinned", "clamped"), repeat=2)))
@pytest.mark.parametrize("numbers", [BeamNumbers(0.0, 0.0), BeamNumbers(1e-3, 3e-3)])
def test_the_first_of_many_modes_are_those_found_alone(kinds, numbers, monkeypatch):
    alone = [kept.elastic_modes(numbers, kinds, count) for count in (1, 7, 19, 64)]
    kept._kept.clear()
    kept.elastic_modes(numbers, kinds, 150)
    monkeypatch.setattr(kept, "found", None)  # nothing is found again
    for one in alone:
        again = kept.elastic_modes(numbers, kinds, one.squared.size)
        assert np.array_equal(one.squared, again.squared)
        assert np.array_equal(one.shares, again.shares)
        assert all(np.array_equal(*pair) for pair in zip(one.carried.squares, again.carried.squares, strict=True))
        assert all(np.array_equal(*pair) for pair in zip(one.carried.turning, again.carried.turning, strict=True))


def test_modes_in_closed_form_are_found_once_in_a_choice(monkeypatch):
    counts = []
    found = kept.found
    monkeypatch.setattr(kept, "found", lambda *given: counts.append(given[2]) or found(*given))
    asked = physics_of(load_case(CASES / "sphere_on_beam.yaml")).but(tolerance=Tolerance(1e-2))
    first = solve(*asked)
    assert first.choice.chosen.startswith("modes")
    assert len(counts) == 1
    solve(*asked)
    assert len(counts) == 1


def test_eigenvectors_of_a_mesh_are_found_once(monkeypatch):
    counts = []
    lowest = shapes.lowest
    monkeypatch.setattr(shapes, "lowest", lambda *given: counts.append(given[2]) or lowest(*given))
    mesh = BeamMesh(Beam("beam", (SEGMENT,), End("clamped"), End("free")), 20, "consistent", 0.0)
    one = shapes.eigenvectors(mesh, 8)
    one[:] = 0.0  # a caller's own copy
    assert np.any(shapes.eigenvectors(mesh, 8))
    assert counts == [8]
    longer = BeamMesh(Beam("beam", (SEGMENT,), End("clamped"), End("pinned")), 20, "consistent", 0.0)
    shapes.eigenvectors(longer, 8)
    shapes.eigenvectors(mesh, 9)
    assert counts == [8, 8, 9]


@pytest.mark.parametrize("tolerance", [1e-1, 1e-3])
def test_the_same_beam_gives_the_same_choice_whatever_is_kept(tolerance):
    """Modes of an earlier and finer choice change no bit."""
    asked = physics_of(load_case(CASES / "sphere_on_beam.yaml")).but(tolerance=Tolerance(tolerance))
    first = solve(*asked)
    solve(*asked.but(tolerance=Tolerance(1e-4)))
    again = solve(*asked)
    assert first.choice.chosen == again.choice.chosen
    assert first.choice.expected_error == again.choice.expected_error
    t = np.linspace(0.0, first.duration, 300)
    assert np.array_equal(first.evaluate(t, "position:sphere"), again.evaluate(t, "position:sphere"))


@pytest.mark.parametrize("name", ["sphere_on_short_beam", "mass_on_cantilever_tip", "falling_cantilever"])
def test_as_many_modes_in_two_runs_state_the_error_of_the_others(name):
    """Two runs with as many modes agree on those that both leave out: the flexibility of these is stated instead."""
    asked = physics_of(load_case(CASES / f"{name}.yaml")).but(tolerance=Tolerance(1e-4))
    modal = next(each for each in in_turn(asked)[0] if each.name.startswith("modes"))
    levels = [modal.min_fineness]
    while levels[-1] < min(modal.max_fineness, 100_000):
        levels.append(min(2 * levels[-1], modal.max_fineness))
    counts = [modal.work(n)[1] for n in levels]
    for fineness, coarse, fine in zip(levels[1:], counts, counts[1:], strict=False):
        assert fine > coarse or modal.unseen(fineness) > 0.0
    # Static shapes that stand for modes left out need steps that resolve them: longer ones state a large error.
    assert counts[-1] > counts[-2] or modal.unseen(levels[-1]) <= 0.5 * asked.method.tolerance.error
    assert (modal.unseen(levels[0]) > 0.0) == (counts[0] == counts[-1])
