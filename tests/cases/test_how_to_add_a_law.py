"""The page docs/how-to-add-a-law.md runs as it stands: its law, its registration, its case."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import impactlab as il
from impactlab.plugins import Registry
from tests.cases.pages import Page

PAGE = Page("how-to-add-a-law")


@pytest.fixture
def registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Registry:
    return PAGE.registry(tmp_path, monkeypatch)


def test_the_law_fits_in_forty_lines() -> None:
    assert PAGE.lines() <= 40


@pytest.mark.parametrize("integrator", ["newmark", "exact_modal"])
def test_its_case_meets_the_contact_of_a_cubic_spring(registry: Registry, tmp_path: Path, integrator: str) -> None:
    case = il.load_case(tmp_path / "page.yaml", registry=registry).with_("solve.integrator", kind=integrator)
    history = il.run(case)
    deepest = (2.0 / 1e12) ** 0.25
    [contact] = history.contacts
    assert contact.end is not None
    # 6600 steps in the contact: the midpoint rule's (dt/duration)^2 is far below; what is seen is the dating by a line.
    assert contact.end - contact.start == pytest.approx(2.6220575543 * deepest, rel=1e-5)
    assert contact.peak_force == pytest.approx(1e12 * deepest**3, rel=1e-5)
    assert contact.impulse == pytest.approx(2.0, rel=1e-6)
    assert float(history.evaluate(history.duration, "velocity:ball")) == pytest.approx(-1.0, rel=1e-6)


def test_it_runs_on_a_continuous_rod_unchanged(registry: Registry, tmp_path: Path) -> None:
    text = PAGE.block("yaml").replace(
        "stop: {kind: wall}", "stop: {kind: rod, length: 1.0, area: 1.0e-4, material: {young: 2.0e11, density: 8000}}"
    )
    text = text.replace("[ball, stop]", "[ball, stop.left]").replace("duration: 0.02", "duration: 1.0e-3")
    text = text.replace("integrator: {kind: newmark}", "model: {kind: continuous}")
    (tmp_path / "rod.yaml").write_text(text, encoding="utf-8")
    history = il.run(il.load_case(tmp_path / "rod.yaml", registry=registry))
    rod = float(history.evaluate(history.duration, "momentum:stop"))
    ball = float(history.evaluate(history.duration, "momentum:ball"))
    given = sum(contact.impulse for contact in history.contacts)
    # The free rod's momentum is read from the waves of whole and parts of steps in it, good to a step's share.
    assert rod == pytest.approx(given, rel=1e-4)
    assert ball == pytest.approx(1.0 - given, abs=1e-12)
    times = np.linspace(0.0, 3e-4, 500)
    assert float(history.evaluate(times, "force:ball|stop.left").min()) >= 0.0
