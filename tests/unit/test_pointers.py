"""Functions as addresses: compiled, called back, and their cache on disk."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
from impactlab.contact.penalty import Penalty
from impactlab.integrators.newmark import Newmark
from impactlab.models.modal import Modal
from impactlab.scene import Contact, End, Mass, Point, Rod, Scene, Segment, StepRule
from impactlab.simulate import run
rod = Rod("rod", (Segment(1.0, 1.0, 1.0, 1.0),), End("free"), End("clamped"), model=Modal(None, 3))
contact = Contact(Point("m", 0.0, "m"), Point("rod", 0.0, "rod.left"), 0.0, Penalty())
scene = Scene("x", {"m": Mass("m", 1.0, 1.0), "rod": rod}, (contact,), 1.0, Newmark(), StepRule(points_per_period=10))
print(run(scene).contacts[0].impulse.hex())
"""


@pytest.mark.slow
def test_a_truncated_cache_is_dropped_and_compiled_again(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    first = subprocess.run([sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, check=True)
    cached = list(tmp_path.rglob("*.nbc"))
    assert len(cached) > 4
    for path in cached:
        path.write_bytes(path.read_bytes()[:40])
    again = subprocess.run([sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, check=False)
    assert again.returncode == 0, again.stderr[-2000:]
    assert again.stdout == first.stdout
