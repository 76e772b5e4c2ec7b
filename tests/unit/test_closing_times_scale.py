"""Shares of displacements in the motion of faces: the same at any scale, without overflow."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab.simulate.warnings.closing_times import _shares


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e200])
def test_the_share_of_a_face_is_the_same_at_any_scale(scale: float) -> None:
    faces = {"left": scale * np.array([3.0, -4.0]), "right": scale * np.array([1.0, 1.0]), "still": np.zeros(2)}
    shares = {name: share for share, name in _shares(faces, 0.5 * scale)}
    assert shares == pytest.approx({"left": 0.5 / np.sqrt(12.5), "right": 0.5}, rel=1e-14)
