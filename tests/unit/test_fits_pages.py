"""The Python of the pages about fits runs, and finds the numbers that it says."""

from __future__ import annotations

import importlib.util
import re
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.support import ROOT


def blocks(page: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", (ROOT / "docs" / page).read_text(encoding="utf-8"), re.DOTALL)


class Study:
    """Stands in for a study of Optuna: uniform trials of the same calls."""

    def __init__(self) -> None:
        self.best_params: dict[str, float] = {}
        self._best, self._random = np.inf, np.random.default_rng(0)

    def optimize(self, objective: Any, n_trials: int) -> None:
        for _ in range(10 * n_trials):
            drawn: dict[str, float] = {}

            def suggest(name: str, low: float, high: float, kept: dict[str, float] = drawn) -> float:
                return kept.setdefault(name, float(self._random.uniform(low, high)))

            if (loss := objective(SimpleNamespace(suggest_float=suggest))) < self._best:
                self._best, self.best_params = loss, drawn


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    """The names of the first block of the page about other programs."""
    found: dict[str, Any] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        exec(blocks("fits-other-programs.md")[0], found)
    return found


def test_emcee_samples_the_residuals(names):
    exec(blocks("fits-other-programs.md")[1], names)
    low, middle, high = np.percentile(names["samples"], [2.5, 50.0, 97.5], axis=0)
    assert middle == pytest.approx([2e8, 2.133], rel=0.02)
    assert np.all(low < [2e8, 2.133])
    assert np.all(high > [2e8, 2.133])


def test_lmfit_minimises_the_residuals(names):
    exec(blocks("fits-other-programs.md")[2], names)
    assert names["fitted"] == pytest.approx([2e8, 2.133], rel=0.01)
    assert names["result"].redchi == pytest.approx(1.0, abs=0.3)


def test_optuna_searches_the_residuals(names, monkeypatch):
    if importlib.util.find_spec("optuna") is None:
        sampler = SimpleNamespace(TPESampler=lambda seed: None)
        monkeypatch.setitem(
            sys.modules, "optuna", SimpleNamespace(create_study=lambda sampler: Study(), samplers=sampler)
        )
    exec(blocks("fits-other-programs.md")[3], names)
    assert names["best"] == pytest.approx([2e8, 2.133], rel=0.2)


@pytest.mark.parametrize(
    ("block", "truth"),
    [
        (1, {"contacts.0.law.stiffness": 2e8, "contacts.0.law.damping": 2000.0, "bodies.hammer.mass": 2.133}),
        (2, {"bodies.hammer.mass": 2.133, "bodies.rod.material.young": 2.1e11}),
        (3, {"contacts.0.law.stiffness": 2e8, "bodies.rod.ends.right.dashpot": 1.5e4}),
        (4, {"bodies.bar.material.young": 2e11, "bodies.bar.ends.right.dashpot": 4e3}),
    ],
)
def test_worked_examples_find_the_true_numbers(block, truth):
    code, names = blocks("fits-examples.md"), dict[str, Any]()
    exec(code[0], names)
    exec(code[block], names)
    for path, value in truth.items():
        assert names["found"][path].lower < value < names["found"][path].upper
