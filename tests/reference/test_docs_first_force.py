"""The page on the first force: what it concludes from its table and its runs."""

from __future__ import annotations

import re

import numpy as np
import pytest

from studies.beams import first_force as script
from studies.pages import DOCS

PAGE = (DOCS / "beams-first-force.md").read_text(encoding="utf-8")


def printed() -> dict[int, list[float]]:
    """Return the numbers of the table, by the number of modes."""
    lines = re.findall(r"^\| (\d+) \| (.*) \|$", PAGE, re.MULTILINE)
    return {int(modes): [float(cell.split()[0]) for cell in rest.split(" | ")] for modes, rest in lines}


@pytest.mark.slow
def test_the_words_are_true() -> None:
    table = printed()
    forces = np.array([table[modes][1] for modes in script.COUNTS])
    assert np.all(np.diff(forces) > 0.0)
    assert 1.0 < forces[-1] < 1.06  # levels off a few percent above
    plain = np.array([table[modes][4] for modes in script.COUNTS])
    assert plain[1:] / plain[:-1] == pytest.approx(2.0, rel=0.05)  # doubles with the number of modes
    times = np.geomspace(1e-5, script.LAST, 20)
    assert script.waves(times) == pytest.approx(script.endless(times), rel=0.06)
    assert script.waves(np.array([4e-9, 8e-9]))[0] == pytest.approx(1.0, rel=1e-3)
