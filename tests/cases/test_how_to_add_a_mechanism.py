"""The page docs/how-to-add-a-mechanism.md runs as it stands: its contract, and its hammer on the anvil."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import impactlab as il
from impactlab.plugins import Registry
from tests.cases.pages import Page

PAGE = Page("how-to-add-a-mechanism")


@pytest.fixture
def registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Registry:
    return PAGE.registry(tmp_path, monkeypatch)


@pytest.mark.usefixtures("registry")
def test_its_part_is_short_and_keeps_its_contract(monkeypatch: pytest.MonkeyPatch) -> None:
    assert PAGE.lines() <= 60
    PAGE.check_contract(monkeypatch)


def test_the_hammer_strikes_with_the_energy_of_weight_and_spring(registry: Registry, tmp_path: Path) -> None:
    """An elastic impact on a wall turns the rate around: impulse 2 m a rate/cos(angle), as the lever has one angle."""
    arm, head, spring, start = 0.6, 3.0, 40.0, 0.9
    history = il.run(il.load_case(tmp_path / "page.yaml", registry=registry))
    at = math.asin(math.sin(start) - 0.46 / arm)
    energy = head * 9.81 * 0.46 + 0.5 * spring * (start**2 - at**2)
    rate = math.sqrt(2.0 * energy / (head * arm**2))
    [span] = history.contacts
    # The angle moves by 1e-3 rad within the contact, and the weight acts for 0.6 ms: 1e-3 of the impulse together.
    assert span.impulse == pytest.approx(2.0 * head * arm * rate / math.cos(at), rel=2e-3)
    assert abs(history.energy.final_error) < 1e-6
