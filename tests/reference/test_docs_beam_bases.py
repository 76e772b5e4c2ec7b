"""The page of bases on beams: its claims, each by the closed form or the order that it rests on, and its tables."""

from __future__ import annotations

import math

import numpy as np
import pytest

from studies.beams import bases as script


def test_mode_shapes_miss_the_static_answer_by_the_cube_of_their_number() -> None:
    # What N modes leave out of the flexibility of a beam is a sum of 1/k^4 from N on.
    for scene in (script.PINNED, script.TIP):
        order = math.log(script.error(scene, "eigenvectors", 12) / script.error(scene, "eigenvectors", 40), 40.0 / 12.0)
        assert order == pytest.approx(3.0, abs=0.2), scene.name


@pytest.mark.parametrize("basis", ["ritz", "craig_bampton", "striker_attached"])
def test_bases_that_know_the_contact_beat_mode_shapes(basis: str) -> None:
    for scene in script.SCENES:
        for count in (8, 12, 20):
            assert script.error(scene, basis, count) < 0.5 * script.error(scene, "eigenvectors", count), scene.name


def test_the_neighbourhood_of_a_contact_moves_first() -> None:
    # Early on the motion of a mesh lies within some wave lengths, which grow as the root of time, of the contact.
    assert script.early("mesh", 0)[1] < 0.05
    assert script.early("mesh", 0)[0] < 5e-3
    assert script.early("substructured", 40)[0] < 0.5 * script.early("craig_bampton", 40)[0]
    assert script.early("substructured", 40)[0] < 0.2 * script.early("eigenvectors", 40)[0]
    # Coarse pieces stay coarse: more modes of the struck one change nothing later.
    floor = [script.error(script.PINNED, "substructured", count) for count in (20, 40)]
    assert floor[0] == pytest.approx(floor[1], rel=0.05)


@pytest.mark.parametrize("modes", [5, 40, 160])
def test_the_first_kick_follows_its_closed_form(modes: int) -> None:
    # phi_i(L/2)^2 = 2/m for odd i: J = (1 + e) v0/(1/M + 2 n/m), n the odd ones, M = m.
    expected = 2.0 * script.KICKED.mass / (1.0 + 2.0 * math.ceil(modes / 2.0))
    assert script.kick(modes).impulse == pytest.approx(expected, rel=1e-12)
    assert script.first_kick_of_a_run(modes) == pytest.approx(expected, rel=1e-12)


def test_the_velocities_after_a_kick_are_a_peak_that_narrows() -> None:
    # Sum of sin(i pi x/L) sin(i pi/2) over odd i: sin(2 n z)/(2 n sin z), z = pi (x/L - 1/2), n the odd ones.
    for modes in (20, 80):
        each, n = script.kick(modes), modes // 2
        z = np.pi * (each.x / script.KICKED.length - 0.5)
        middle = np.abs(z) < 1e-9
        kernel = np.where(middle, 1.0, np.sin(2 * n * z) / (2 * n * np.sin(np.where(middle, 1.0, z))))
        assert np.allclose(each.velocity / each.velocity.max(), kernel, atol=1e-9)
    widths = [script.kick(modes).width for modes in (20, 40, 80)]
    assert widths[0] / widths[1] == pytest.approx(2.0, abs=0.1)
    assert widths[1] / widths[2] == pytest.approx(2.0, abs=0.1)
    # With few modes all of the beam moves at once.
    assert script.kick(5).reach > 0.9
