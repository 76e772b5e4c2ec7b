"""The norms, on histories made of functions whose distances are known by hand."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np
import pytest

from impactlab import metrics
from impactlab.history import ContactSpan, Cost, Event
from impactlab.metrics.force_graphs import COLUMNS, GRAPH_POINTS
from impactlab.scene import Rod
from impactlab.scene.method import Simulation
from impactlab.testing.scenes import FREE, UNIT, mass_on_rod, touching
from impactlab.types import Array
from tests.unit.synthetic import SyntheticHistory, SyntheticLaw

PAIR = "hammer|rod.left"
MASS, FACE, FORCE = "position:hammer", "displacement:rod@0", f"force:{PAIR}"
T = 2.0  # round trip of a rod of length 1 m and wave speed 1 m/s
DURATION = 3.0 * T


@dataclasses.dataclass(frozen=True)
class Hard(SyntheticLaw):
    """Stands for a law of hard faces."""

    hard: ClassVar[bool] = True


class Link(Hard):
    """Stands for a law of a link, which pulls as well."""

    two_sided: ClassVar[bool] = True


class Kicks(Hard):
    """Stands for a law that answers by impulses."""

    answers_force: ClassVar[bool] = False


def scene(law: Any = Hard()) -> Simulation:
    return mass_on_rod(None, law, segments=(UNIT,))


def pulse(t: Array, start: float = 0.0, end: float = 2.0, height: float = 1.0) -> Array:
    return np.where((t >= start) & (t < end), height, 0.0)


def history(
    shift: float = 0.0,
    scale: float = 1.0,
    events: tuple[Event, ...] = (),
    contacts: tuple[ContactSpan, ...] = (),
    steps: int = 0,
    law: Any = Hard(),
) -> SyntheticHistory:
    return SyntheticHistory(
        DURATION,
        {
            MASS: lambda t: scale * np.sin(t),
            FACE: lambda t: scale * t,
            FORCE: lambda t: pulse(t, 0.0, 2.0 + shift, scale),
        },
        events=events,
        contacts=contacts,
        jumps={FORCE: (0.0, 2.0 + shift)},
        cost=Cost(steps=steps),
        simulation=scene(law),
    )


def test_a_history_is_at_no_distance_from_itself() -> None:
    same = history(events=(Event(0.0, PAIR, "close"),), contacts=(ContactSpan(PAIR, 0.0, 2.0, 2.0, 1.0),))
    found = metrics.errors(same, "itself", same, scene().scene)
    assert list(found)[:11] == [
        "reference",
        "mass_displacement",
        "face_displacement",
        "force",
        "force_away_from_jumps",
        "force_graph",
        "impulse",
        "peak_force",
        "event_times",
        "events_missed",
        "events_extra",
    ]
    assert list(found)[11:] == ["exit_velocity", "opening_time", "force_oscillation", "momentum_error"]
    assert found.pop("reference") == "itself"
    # Nothing is known of momenta, nothing opens; all else is at no distance.
    assert {name for name, value in found.items() if value is None} == {
        "exit_velocity",
        "opening_time",
        "momentum_error",
    }
    assert {value for value in found.values() if value is not None} == {0.0}


def test_displacements_off_by_a_factor_are_wrong_by_that_factor() -> None:
    assert metrics.mass_displacement(history(scale=1.1), history(), scene().scene) == pytest.approx(0.1, rel=1e-12)
    assert metrics.face_displacement(history(scale=0.8), history(), scene().scene) == pytest.approx(0.2, rel=1e-12)


def test_the_worst_face_counts() -> None:
    left, right = (Rod(name, (UNIT,), FREE, FREE) for name in ("first", "second"))
    both = scene().but(bodies={"first": left, "second": right}, contacts=(touching(left, right),))
    moved = {"displacement:first@1": np.cos, "displacement:second@0": np.cos}
    exact = SyntheticHistory(DURATION, moved, simulation=both)
    off = SyntheticHistory(
        DURATION,
        {"displacement:first@1": lambda t: 1.01 * np.cos(t), "displacement:second@0": lambda t: 1.3 * np.cos(t)},
        simulation=both,
    )
    assert metrics.face_displacement(off, exact, both.scene) == pytest.approx(0.3)
    assert metrics.mass_displacement(off, exact, both.scene) is None  # no rigid mass in any contact


def test_a_shifted_jump_costs_much_in_the_norm_little_in_the_graph_and_nothing_away_from_it() -> None:
    late, exact = history(shift=0.04), history()
    # over [2, 2.04] the forces differ by 1; the exact pulse has the norm sqrt(2); one cell is 0.001 s
    assert metrics.force(late, exact, scene().scene) == pytest.approx(np.sqrt(0.04 / 2.0), rel=0.02)
    assert metrics.force_away_from_jumps(late, exact, scene().scene) == 0.0  # 0.04 s is within 0.05 T = 0.1 s
    assert metrics.force_graph(late, exact, scene().scene) == pytest.approx(0.04 / T, abs=0.0015)


def test_the_tail_of_a_decay_away_from_the_jumps_is_no_force_to_compare_with() -> None:
    def decayed(rest: float) -> SyntheticHistory:
        force = {FORCE: lambda t: np.where(np.asarray(t) < 0.05, 1.0, rest)}
        return SyntheticHistory(DURATION, force, jumps={FORCE: (0.0, 0.05)}, simulation=scene())

    assert metrics.force_away_from_jumps(history(), decayed(1e-11), scene().scene) is None
    beside = metrics.force_away_from_jumps(history(), decayed(1e-6), scene().scene)
    assert beside is not None
    assert beside > 1e5


def test_the_graph_distance_sees_height_as_well_as_time() -> None:
    assert metrics.force_graph(history(scale=1.2), history(), scene().scene) == pytest.approx(0.2, abs=0.0015)
    assert metrics.force_graph(history(), history(scale=2.0), scene().scene) == pytest.approx(0.5, abs=0.0015)


def test_a_force_that_rises_in_one_step_is_near_one_that_jumps_at_the_start() -> None:
    dt = 0.004  # s: 0.002 T
    rising = SyntheticHistory(DURATION, {FORCE: lambda t: np.where(t < dt, 0.5, pulse(t))})
    assert metrics.force_graph(rising, history(), scene().scene) == pytest.approx(dt / T, abs=0.0015)


def test_the_graph_distance_sees_a_spike_of_one_step() -> None:
    steps = 20_000
    dt = DURATION / steps
    spike = SyntheticHistory(
        DURATION, {FORCE: lambda t: pulse(t) + pulse(t, 4.0, 4.0 + dt, 0.7)}, cost=Cost(steps=steps)
    )
    assert metrics.force_graph(spike, history(), scene().scene) == pytest.approx(0.7, abs=0.0015)


def test_a_wild_chatter_keeps_the_graph_distance_right_and_small_in_memory() -> None:
    chatter = SyntheticHistory(
        DURATION, {FORCE: lambda t: 40.0 * (np.floor(t / DURATION * 5000) % 2)}, cost=Cost(steps=5000)
    )
    points = metrics.graph(chatter, FORCE, DURATION, (T, 1.0))
    assert len(points) < 1.1 * GRAPH_POINTS
    assert metrics.force_graph(chatter, history(), scene().scene) == pytest.approx(39.0, rel=0.01)


def test_the_graph_of_a_smooth_force_lies_on_it() -> None:
    points = metrics.graph(SyntheticHistory(DURATION, {FORCE: np.cos}), FORCE, DURATION, (T, 1.0))
    assert np.max(np.abs(np.cos(points[:, 0] * T) - points[:, 1])) < 2 * DURATION / COLUMNS


def test_a_force_that_a_method_cannot_give_is_none() -> None:
    no_force = SyntheticHistory(DURATION, {FORCE: lambda t: np.full_like(t, np.nan)})
    for metric in (metrics.force, metrics.force_away_from_jumps, metrics.force_graph):
        assert metric(no_force, history(), scene().scene) is None


def test_a_norm_whose_reference_is_zero_is_none() -> None:
    nothing = history(scale=0.0)
    for metric in (
        metrics.mass_displacement,
        metrics.face_displacement,
        metrics.force,
        metrics.force_away_from_jumps,
        metrics.force_graph,
        metrics.impulse,
        metrics.event_times,
    ):
        assert metric(history(), nothing, scene().scene) is None


def test_the_impulse_of_a_link_that_pushes_and_pulls_is_compared_with_both() -> None:
    # The force is 1 N for 2 s of 6 s; its impulse would be 0.001 N s with a pull after it, and an error of 0.004 N s
    # beside that sum 400 %.
    one, other = (history(contacts=(ContactSpan(PAIR, 0.0, None, given, 1.0),), law=Link()) for given in (0.005, 0.001))
    assert metrics.impulse(one, other, scene().scene) == pytest.approx(0.004 / 2.0, rel=1e-3)


def test_the_impulse_is_the_total_of_a_pair() -> None:
    exact = history(contacts=(ContactSpan(PAIR, 0.0, 1.0, 3.0, 1.0), ContactSpan(PAIR, 2.0, 3.0, 1.0, 1.0)))
    once = history(contacts=(ContactSpan(PAIR, 0.0, 1.0, 3.0, 1.0), ContactSpan("other", 0.0, 1.0, 9.0, 1.0)))
    assert metrics.impulse(once, exact, scene().scene) == pytest.approx(0.25)
    assert metrics.impulse(exact, once, scene().scene) == pytest.approx(1.0 / 3.0)


def close(time: float, contact: str = PAIR) -> Event:
    return Event(time, contact, "close")


def opens(time: float, contact: str = PAIR) -> Event:
    return Event(time, contact, "open")


def test_events_meet_the_nearest_unused_one_of_their_kind() -> None:
    found = metrics.match_events(
        [opens(1.0), close(1.0), opens(1.1)], [opens(1.05), close(1.02), opens(1.06), opens(3.0)], 0.2
    )
    assert found.pairs == ((opens(1.0), opens(1.05)), (close(1.0), close(1.02)), (opens(1.1), opens(1.06)))
    assert found.missed == ()
    assert found.extra == (opens(3.0),)


def test_events_too_far_or_of_another_contact_do_not_meet() -> None:
    found = metrics.match_events([opens(1.0)], [opens(1.3), opens(1.0, "other")], 0.2)
    assert (found.pairs, len(found.missed), len(found.extra)) == ((), 1, 2)


def test_event_errors_are_in_round_trips_and_the_largest_counts() -> None:
    exact = history(events=(close(0.0), opens(2.0), close(4.0), opens(4.1)))
    found = history(events=(close(0.0), opens(1.2), close(1.3), opens(2.06)))
    judged = metrics.errors(found, "exact", exact, scene().scene)
    assert judged["event_times"] == pytest.approx(0.03)
    assert (judged["events_missed"], judged["events_extra"]) == (2, 2)


def test_kicks_are_neither_missed_nor_extra() -> None:
    exact = history(events=(close(0.0), opens(2.0)))
    kicked = history(events=tuple(Event(0.1 * i, PAIR, "impulse", 0.5) for i in range(20)), law=Kicks())
    judged = metrics.errors(kicked, "exact", exact, scene(Kicks()).scene)
    assert (judged["event_times"], judged["events_missed"], judged["events_extra"]) == (None, None, None)
    kicked.method = scene().method
    judged = metrics.errors(kicked, "exact", exact, scene().scene)  # under a law with a force a kick is a closing jump
    assert (judged["event_times"], judged["events_missed"], judged["events_extra"]) == (None, 2, 0)


def test_without_a_rod_metrics_in_round_trips_are_none() -> None:
    rigid = scene().but(round_trip=float("nan"))
    judged = metrics.errors(history(scale=1.1), "exact", history(), rigid.scene)
    assert judged["force"] == pytest.approx(0.1)
    assert [judged[name] for name in ("force_away_from_jumps", "force_graph", "event_times", "events_missed")] == [
        None
    ] * 4


def test_a_metric_of_ones_own_joins_the_block() -> None:
    judged = metrics.errors(
        history(), "exact", history(), scene().scene, {"force": metrics.force, "steps": lambda h, r, s: 7}
    )
    assert judged["steps"] == 7
    assert judged["force"] == 0.0


def test_a_force_that_jumps_in_the_middle_of_a_cell_counts_half_of_each_side() -> None:
    """Steps are often such a share of the duration; rounding then must not decide between two errors."""
    end = float(metrics.midpoints(DURATION)[2000])
    exact = history()
    errors = [
        metrics.force(history(shift=end * (1.0 + share) - 2.0), exact, scene().scene) for share in (-4e-16, 0.0, 4e-16)
    ]
    assert errors[0] == pytest.approx(errors[1], rel=1e-12)
    assert errors[2] == pytest.approx(errors[1], rel=1e-12)
    assert errors[1] == pytest.approx(np.sqrt((end - 2.0) / 2.0), rel=1e-9)  # of the excess over the pulse
