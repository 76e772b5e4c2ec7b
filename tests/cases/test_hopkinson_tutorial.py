"""The tutorial docs/tutorials/hopkinson_bar.py: from bars to gauge signals, labelled data and waves in 25 lines."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

from impactlab.casefile.values.materials import MATERIALS

SCRIPT = (Path(__file__).parents[2] / "docs" / "tutorials" / "hopkinson_bar.py").read_text(encoding="utf-8")
STEEL = MATERIALS["steel"]
C = math.sqrt(STEEL.young / STEEL.density)


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    mpl.use("Agg")
    found: dict[str, Any] = {}
    exec(compile(SCRIPT, "hopkinson_bar.py", "exec"), found)
    return found


def test_the_path_of_a_student_takes_25_lines_at_most() -> None:
    first = "from itertools" + SCRIPT.partition("\nfrom itertools")[2].partition("# %%")[0]
    lines = [line for line in first.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    assert all(word in first for word in ("to_xarray", "waves(", "plot"))
    assert len(lines) <= 25


def test_gauges_and_waves_are_those_of_theory(names: dict[str, Any]) -> None:
    """A striker of the bar's own section sends v/(2 c) for as long as a wave takes to pass it twice."""
    incident = names["data"]["strain"].sel(strain_at="incident@0.5")
    passing = incident.sel(time=(0.5 + 0.2) / C, method="nearest")
    assert float(passing) == pytest.approx(10.0 / (2.0 * C), rel=1e-12)
    waves = names["waves"]
    overlap = (waves.time > (0.96 + 0.09) / C) & (waves.time < (0.96 + 0.38) / C)
    assert waves.to_right[overlap] == pytest.approx(10.0 / (2.0 * C), rel=1e-12)
    assert np.all(waves.to_left[overlap] < 0.0)


def test_the_modulus_from_the_gauges_is_that_of_the_specimen_within_two_percent(names: dict[str, Any]) -> None:
    assert names["slope"] == pytest.approx(MATERIALS["aluminium"].young, rel=0.02)
