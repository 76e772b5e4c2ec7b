"""The cost of exact runs: memory that does not follow their events, and the time that is predicted of them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from impactlab import load_case, run
from impactlab.contact.penalty import Penalty
from impactlab.errors import CaseError, StepError
from impactlab.exact import cost
from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.results.thinned import ThinnedHistory
from impactlab.exact.solve import solve
from impactlab.scene import Probe, Wall
from tests.reference.exact_scenes import CLAMPED, FREE, HARD, point, rod, scene, struck
from tests.reference.trains import random_train


def bouncing():
    """A rod that falls on a wall again and again, from a spring above."""
    body, floor = rod(velocity=0.0), Wall("floor")
    pairs = [(point(body, "right"), point(floor), 3.0, HARD)]
    probes = [Probe("rod", 0.3, "displacement"), Probe("rod", 0.0, "stress")]
    return scene([body, floor], pairs, 300.0, gravity=1e-2, probes=probes)


def ringing():
    """A clamped rod that a mass strikes and leaves."""
    return struck(1.0, 3000.0, probes=[Probe("rod", 0.0, "displacement"), Probe("rod", 0.5, "velocity")])


def sprung():
    """A mass between a rod and a damped spring on a wall."""
    law = Penalty(stiffness=0.3, damping=0.05)
    bar, wall = rod(right=CLAMPED), Wall("wall")
    hammer = struck(1.0, 1.0).scene.bodies["hammer"]
    pairs = [(point(wall), point(hammer), 0.5, law), (point(hammer), point(bar, "left"), 0.0, HARD)]
    return scene([wall, hammer, bar], pairs, 100.0)


@pytest.mark.parametrize("make", [bouncing, ringing, sprung])
def test_a_run_beyond_its_memory_is_the_whole_run_at_its_instants(make, monkeypatch):
    case = make()
    case = case.but(records=500, snapshots=(0.1003 * case.scene.duration, 0.8006 * case.scene.duration))
    whole = solve(*case)
    assert isinstance(whole, ContinuousHistory)
    monkeypatch.setenv("IMPACTLAB_MEMORY", "5e6")
    thin = solve(*case)
    assert isinstance(thin, ThinnedHistory)
    t = np.linspace(0.0, case.scene.duration, 501)
    for channel in whole.channels():
        if channel.startswith("force:") and "|" in channel:
            continue
        exact = whole.evaluate(t, channel)
        assert thin.evaluate(t, channel) == pytest.approx(exact, abs=1e-9 * max(1.0, np.max(np.abs(exact)))), channel
    assert [event[1:] for event in thin.events] == [event[1:] for event in whole.events]
    assert [event.time for event in thin.events] == pytest.approx([event.time for event in whole.events], rel=1e-12)
    assert len(thin.contacts) == len(whole.contacts) > 1
    for one, other in zip(thin.contacts, whole.contacts, strict=True):
        assert one.impulse == pytest.approx(other.impulse, rel=1e-9, abs=1e-12)
        assert one.peak_force == pytest.approx(other.peak_force, rel=1e-9)
    for contact in case.scene.contacts:  # forces are means: their sum is the impulse
        middle = 0.5 * (t[1:] + t[:-1])
        pushed = float(np.sum(thin.evaluate(middle, f"force:{contact.name}")) * (t[1] - t[0]))
        spans = sum(span.impulse for span in thin.contacts if span.contact == contact.name)
        assert pushed == pytest.approx(spans, rel=1e-9, abs=1e-12)
    assert np.max(np.abs(thin.energy.balance)) < 1e-10 * thin.energy.scale
    lost = [float(history.energy.booked["contact"][-1]) for history in (thin, whole)]
    assert lost[0] == pytest.approx(lost[1], rel=1e-9)
    for time in case.scene.snapshots:
        for quantity in case.scene.bodies["rod"].quantities:
            there = whole.field("rod", time, quantity)
            assert thin.field("rod", time, quantity).values == pytest.approx(there.values, abs=1e-9), quantity
    with pytest.raises(CaseError, match="is not kept: the run was too long"):
        thin.field("rod", 0.5 * case.scene.duration, "stress")


def test_the_steep_force_of_a_spring_beyond_memory_is_that_of_the_whole_run(monkeypatch):
    case = sprung().but(records=2000)
    name = f"force:{case.scene.contacts[0].name}"
    whole = solve(*case)
    monkeypatch.setenv("IMPACTLAB_MEMORY", "5e6")
    thin = solve(*case)
    assert isinstance(thin, ThinnedHistory)
    cell = case.scene.duration / case.scene.records
    t = np.linspace(0.0, case.scene.duration, 10_007)
    beside = np.append(whole.jumps(name), [event.time for event in whole.events])
    t = t[np.min(np.abs(t[:, None] - beside[None, :]), axis=1) > 2.0 * cell]
    exact = whole.evaluate(t, name)
    steepest = np.max(np.abs(np.diff(exact) / np.diff(t)))
    assert np.max(np.abs(thin.evaluate(t, name) - exact)) < 0.1 * steepest * cell  # as means alone: 0.5


def test_the_remedy_for_too_many_fronts_works(monkeypatch):
    # three transits without a common measure: fronts grow with the cube of the time
    bars = rod("rod", 1.0, right=FREE)
    first = bars.segments[0]
    lengths = (1.0, 2.0**0.5 / 3.0, 3.0**0.5 / 5.0, 5.0**0.5 / 7.0)
    skew = tuple(dataclasses.replace(first, length=length, area=1.0 + k) for k, length in enumerate(lengths))
    bars = dataclasses.replace(bars, segments=skew)
    hammer = struck(1.0, 1.0).scene.bodies["hammer"]
    case = scene([hammer, bars], [(point(hammer), point(bars, "left"), 0.0, HARD)], 1e4)
    monkeypatch.setenv("IMPACTLAB_MEMORY", "2e7")
    with pytest.raises(StepError) as stopped:
        solve(*case)
    text = str(stopped.value)
    assert "fronts" in text
    assert "2 MB" in text
    reached = float(text.split("duration of at most ")[1].split(" s")[0])
    assert solve(*case.but(duration=reached)).duration == reached


FOUR_MATERIALS = """
schema_version: 1
bodies:
  hammer: {kind: mass, mass: 2.0, velocity: 1.0}
  rod:
    kind: rod
    segments:
      - {length: 0.5000, area: 4.0e-4, material: {young: 2.1e11, density: 7850}}
      - {length: 0.2357, area: 5.0e-4, material: {young: 7.0e10, density: 2700}}
      - {length: 0.1732, area: 6.0e-4, material: {young: 1.1e11, density: 8900}}
      - {length: 0.1597, area: 7.0e-4, material: {young: 3.0e9, density: 1200}}
contacts: [{between: [hammer, rod.left], law: {kind: wave_identification}}]
"""


@pytest.mark.slow
def test_a_tolerance_is_met_where_the_exact_solver_runs_out_of_memory(tmp_path, monkeypatch):
    case = tmp_path / "four.yaml"
    case.write_text(FOUR_MATERIALS + "solve: {duration: 1.5e-2, model: {kind: continuous}}\n")
    monkeypatch.setenv("IMPACTLAB_MEMORY", "1e8")
    with pytest.raises(StepError, match=r"solve\.tolerance") as stopped:
        run(load_case(case))
    monkeypatch.delenv("IMPACTLAB_MEMORY")
    case.write_text(FOUR_MATERIALS + "solve: {duration: 1.5e-2, tolerance: 1.0e-2}\n")
    chosen = run(load_case(case))
    assert chosen.duration == 1.5e-2
    assert chosen.choice.met
    reached = stopped.value.history
    t = np.linspace(0.0, 0.99 * reached.duration, 200)
    truth, answer = (history.evaluate(t, "position:hammer") for history in (reached, chosen))
    assert np.max(np.abs(answer - truth)) <= 1e-2 * np.max(np.abs(truth))


def whole(scene):
    """The cost counted over all of a run."""
    return cost.spent(solve(*scene).log)


@pytest.mark.parametrize("seed", range(12))
def test_fronts_that_die_out_are_not_counted(seed):
    scene = random_train(np.random.default_rng(500 + seed)).scene()
    assert 1.0 / 3.0 < cost.predicted_s(*scene) / whole(scene) < 3.0


@pytest.mark.parametrize("trips", [3, 300, 10_000])
@pytest.mark.parametrize("alpha", [0.01, 1.0, 10.0])
def test_a_mass_on_a_rod(alpha, trips):
    scene = struck(alpha, 2.0 * trips, CLAMPED)
    assert 1.0 / 3.0 < cost.predicted_s(*scene) / whole(scene) < 3.0
