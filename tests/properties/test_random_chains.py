"""Random chains on a stop: mirrored, turned, in other units; their energy within its declared bound."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from impactlab.errors import StepError
from impactlab.history import AbstractHistory
from impactlab.testing.strategies import log_uniform
from tests.properties.chains import Document, chains, in_other_units, mirrored, run, turned

SAME = 1e-6  # of times, forces and rates
ACROSS = 0.9  # sine of an angle


def moved(document: Document) -> AbstractHistory:
    """Return the history of a chain; leave out those whose last link comes to stand across its slide."""
    try:
        history = run(document)
    except StepError as error:
        assume(error.history is not None)
        assume(not across(document, error.history))
        raise
    assume(not across(document, history))
    return history


def across(document: Document, history: AbstractHistory) -> bool:
    """Return whether the last link comes to stand nearly across its slide."""
    chain = document["mechanisms"]["chain"]
    angle = history.evaluate(np.linspace(0.0, history.duration, 200), f"angle:{chain['links'][-1]['body']}")
    return chain["end"] != "free" and not bool(np.all(np.abs(np.sin(angle)) < ACROSS))


def strikes(history: AbstractHistory, time: float = 1.0, force: float = 1.0) -> np.ndarray:
    """Return start, end, impulse and peak of each contact, in units of time and force."""
    spans = [(each.start, each.end or history.duration, each.impulse, each.peak_force) for each in history.contacts]
    return np.array(spans, float).reshape(-1, 4) / (time, time, time * force, force)


def rates(history: AbstractHistory) -> np.ndarray:
    """Return the rates of all links at 20 times [rad/s], rows of links."""
    t = np.linspace(0.0, history.duration, 20)
    return np.array([history.evaluate(t, name) for name in history.channels() if name.startswith("rate:")])


def assert_same(one: AbstractHistory, other: AbstractHistory, factor: float = 1.0, **units: Any) -> None:
    """Compare the contacts of two runs, and the rates, those of the other times a factor."""
    first, second = strikes(one), strikes(other, **units)
    assert first.shape == second.shape
    size = np.max(np.abs(first), axis=0, initial=0.0)
    size[:2] = one.duration
    assert np.all(np.abs(first - second) <= SAME * size)
    expected = rates(one)
    assert factor * rates(other) == pytest.approx(expected, abs=SAME * np.max(np.abs(expected)))


@settings(max_examples=15)
@given(chains())
def test_a_mirrored_chain_moves_as_the_image(document: Document) -> None:
    assert_same(moved(document), moved(mirrored(document)), -1.0)


@settings(max_examples=15)
@given(chains(slides=False), st.floats(-math.pi, math.pi))
def test_no_direction_of_the_plane_is_special(document: Document, angle: float) -> None:
    assert_same(moved(document), moved(turned(document, angle)))


@settings(max_examples=15)
@given(chains(), log_uniform(0.01, 100.0), log_uniform(0.01, 100.0), log_uniform(0.01, 100.0))
def test_results_scale_with_units(document: Document, mass: float, length: float, time: float) -> None:
    other = moved(in_other_units(document, mass, length, time))
    assert_same(moved(document), other, time, time=time, force=mass * length / time**2)


@settings(max_examples=25)
@given(chains())
def test_energy_stays_within_the_declared_bound(document: Document) -> None:
    """A run that gains more ends as failed; the step resolves what bends."""
    document["solve"]["step"]["dt"] /= 4.0
    history = moved(document)
    assert np.all(np.isfinite(history.energy.balance))
