"""A light mass on a clamped rod: its largest force follows a front, and decays while a mesh lets it rise."""

from __future__ import annotations

import math
from typing import Any

import pytest

import impactlab as il
from impactlab.history import AbstractHistory
from tests.solving import in_steps, mesh, struck_rod
from tests.support import codes

IMPEDANCE = 9e-4 * math.sqrt(2.1e11 * 7900.0)  # N s/m
ROUND_TRIP = 2.0 * 0.3 / math.sqrt(2.1e11 / 7900.0)  # s
SOFT: dict[str, Any] = {"kind": "penalty", "stiffness": {"relative": 1.0}}


def struck(decays: float, elements: int, end: Any = "clamped") -> AbstractHistory:
    """Return the run of a mass at 1 m/s whose force decays so many times in a round trip of the rod."""
    solve = in_steps(1.6 * ROUND_TRIP, "hht_alpha", mesh(elements), points_per_period=10)
    return il.run(struck_rod(SOFT, solve, mass=IMPEDANCE * ROUND_TRIP / decays, rod={"ends": {"right": end}}))


def largest(run: AbstractHistory) -> float:
    """Return the largest force of a run over that of the waves, (2 + exp(-Z T/m)) Z v right after a round trip T."""
    trip_over_decay = IMPEDANCE * ROUND_TRIP / run.scene.bodies["hammer"].moving_mass
    return max(span.peak_force or 0.0 for span in run.contacts) / ((2.0 + math.exp(-trip_over_decay)) * IMPEDANCE)


@pytest.mark.parametrize("decays", [2.5, 4.0])
def test_a_largest_force_that_follows_a_smoothed_front_is_named(decays: float) -> None:
    run = struck(decays, 20)
    [text] = [each.text for each in run.warnings if each.code == "peak_smoothed"]
    lost = float(text.split("decays by ")[1].split(" %")[0]) / 100.0
    assert 1.0 - largest(run) > 0.13
    assert 0.5 * lost < 1.0 - largest(run) < 2.0 * lost


@pytest.mark.parametrize(("decays", "elements"), [(0.5, 20), (1.2, 400)])
def test_a_force_that_decays_slowly_or_a_fine_mesh_is_not_named(decays: float, elements: int) -> None:
    run = struck(decays, elements)
    assert largest(run) == pytest.approx(1.0, abs=0.1)
    assert "peak_smoothed" not in codes(run)


@pytest.mark.parametrize("elements", [100, 400])
def test_a_force_behind_faces_that_parted_is_named(elements: int) -> None:
    # Ripples run ahead of the front on consistent masses and part the faces; the front then meets no force.
    run = struck(2.5, elements)
    assert any(0.9 < span.start / ROUND_TRIP < 1.1 for span in run.contacts)
    [text] = [each.text for each in run.warnings if each.code == "peak_smoothed"]
    lost = float(text.split("too small by about ")[1].split(" %")[0]) / 100.0
    assert 1.0 - largest(run) > 0.05
    assert 0.5 * lost < 1.0 - largest(run) < 2.0 * lost


def test_a_force_that_decays_while_a_front_passes_is_named() -> None:
    # Masses at both ends, 20 elements: the run's largest force is that of the first touch; by the waves that of the
    # short pulse which comes back from the other mass is twice as large.
    ends = {"m": il.Mass(0.3, velocity=1.0), "n": il.Mass(0.1)}
    rod = il.Rod(length=0.6, area=1e-4, material={"young": 2e11, "density": 8000.0})
    contacts = [("m", "rod.left"), ("rod.right", "n")]

    def run(law: str, **solve: Any) -> AbstractHistory:
        faces = [il.Contact(*pair, {"kind": law}) for pair in contacts]
        return il.run(il.Case(bodies={**ends, "rod": rod}, contacts=faces, solve={"duration": 7e-4, **solve}))

    coarse = run("addition_deletion", **in_steps(7e-4, "central_difference", mesh(20, "lumped"), courant=0.9))
    exact = run("addition_deletion", model={"kind": "continuous"})
    peaks = [max(span.peak_force or 0.0 for span in each.spans("m|rod.left")) for each in (coarse, exact)]
    assert peaks[0] < 0.8 * peaks[1]
    assert any(each.contact == "m|rod.left" and each.code == "peak_smoothed" for each in coarse.warnings)


def test_a_front_that_a_spring_rounds_is_not_named() -> None:
    assert "peak_smoothed" not in codes(struck(2.5, 20, {"spring": 6.3e9}))
