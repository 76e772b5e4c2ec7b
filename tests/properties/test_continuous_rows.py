"""Rows of rods, masses, cushions and walls on the continuous model: momentum, energy, mirror, units."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from impactlab.exact.solve import solve
from impactlab.history import AbstractHistory
from impactlab.scene import Rod, Wall
from impactlab.scene.method import Simulation
from impactlab.testing.rows import momentum_scale, rows
from impactlab.testing.strategies import mirrored

pytestmark = pytest.mark.slow
quick = settings(max_examples=40, deadline=None, print_blob=True)


def momentum(history: AbstractHistory, scene: Simulation, t: np.ndarray) -> np.ndarray:
    """Return the momentum of all bodies, shape of t."""
    names = [name for name, body in scene.scene.bodies.items() if not isinstance(body, Wall)]
    return np.sum([history.evaluate(t, f"momentum:{name}") for name in names], axis=0)


@quick
@given(rows())
def test_energy_of_a_row_is_kept_or_booked(scene: Simulation) -> None:
    history = solve(*scene)
    book = history.energy
    # some hundred pieces, each rounded at the energy in play
    stake = max(1.0, *(float(np.max(np.abs(energy))) for energy in (*book.bodies.values(), book.work)))
    assert max(book.largest_gain, book.largest_loss) * book.scale < 1e-11 * stake
    for loss in book.booked.values():
        assert np.min(np.diff(loss)) >= -1e-12 * stake
    for span in history.contacts:
        assert span.impulse >= 0.0


@quick
@given(rows(held=False))
def test_a_row_that_nothing_holds_keeps_its_momentum(scene: Simulation) -> None:
    t = np.linspace(0.0, scene.scene.duration, 13)
    whole = momentum(solve(*scene), scene, t)
    weight = scene.scene.gravity * sum(body.mass for body in scene.scene.bodies.values() if not isinstance(body, Wall))
    assert whole == pytest.approx(whole[0] + weight * t, abs=1e-11 * momentum_scale(scene.scene))


@quick
@given(rows(), st.floats(0.01, 0.99))
def test_mirrored_row_mirrored_motion(scene: Simulation, share: float) -> None:
    one, other = solve(*scene), solve(*mirrored(scene))
    for name, body in scene.scene.bodies.items():
        if isinstance(body, Rod):
            x = share * body.length
            t = np.linspace(0.0, 6.0, 25) + 0.0123
            seen = one.evaluate(t, f"displacement:{name}@{x!r}")
            there = other.evaluate(t, f"displacement:{name}@{body.length - x!r}")
            # a force that grazes zero may end a contact in one and not in the other; little follows from that
            assert seen == pytest.approx(-there, abs=1e-8)
