"""Fields of stepped runs at equal instants: asked in the case or by the caller, without effect on other numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import CaseError, ImpactlabError
from impactlab.history import AbstractHistory

MESH = {"kind": "finite_element", "elements": 40, "mass": "lumped"}
DESCRIBED: dict[str, dict[str, Any]] = {
    "leapfrog": {"model": MESH, "integrator": {"kind": "central_difference"}, "step": {"courant": 0.9}},
    "newmark": {"model": {"kind": "modal", "elements": 40, "modes": 20}},
    "adaptive": {"model": MESH, "integrator": {"kind": "adaptive"}},
    "delay_line": {"model": {"kind": "continuous"}, "step": {"dt": 1e-7}},
    "chosen": {"tolerance": 1e-2},
}


def struck(solve: dict[str, Any], **more: Any) -> il.Case:
    """Return a mass that strikes a steel rod with a free end, 70 us of it, under a Hertz spring."""
    return il.Case(
        bodies={
            "ball": il.Mass(mass=0.5, velocity=2.0),
            "rod": il.Rod(length="0.3 m", area="9 cm^2", material="steel"),
        },
        contacts=[il.Contact("ball", "rod.left", {"kind": "hertz", "stiffness": 1e11})],
        solve={"duration": "70 us", **solve},
        probes=[{"body": "rod", "at": 0.0, "quantity": "velocity"}],
        **more,
    )


def on_a_beam() -> il.Case:
    """Return a mass on the middle of a Timoshenko beam in its characteristics."""
    beam = il.Beam(length="0.5 m", section={"width": "20 mm", "height": "20 mm"}, material="steel", theory="timoshenko")
    return il.Case(
        bodies={"beam": beam, "ball": il.Mass(mass=0.1, velocity=-1.0)},
        contacts=[il.Contact("beam.at(0.25)", "ball", {"kind": "hertz", "stiffness": 1e9})],
        solve={"duration": "300 us", "model": {"kind": "continuous"}, "step": {"dt": 5e-7}},
    )


def numbers(history: AbstractHistory) -> dict[str, bytes]:
    """Return the bits of all channels, energies and events of a history."""
    t = np.linspace(0.0, history.duration, 501)
    found = {name: history.evaluate(t, name).tobytes() for name in history.channels()}
    book = history.energy
    found |= {name: each.tobytes() for name, each in {**book.bodies, **book.booked, "balance": book.balance}.items()}
    return found | {"events": repr((history.events, [*map(tuple, history.contacts)], history.warnings)).encode()}


@pytest.mark.parametrize("name", [*DESCRIBED, "timoshenko"])
def test_no_other_number_depends_on_frames(name: str) -> None:
    case = on_a_beam() if name == "timoshenko" else struck(DESCRIBED[name])
    assert numbers(il.run(case, frames=60)) == numbers(il.run(case))


@pytest.mark.parametrize("name", ["leapfrog", "newmark", "adaptive"])
def test_a_frame_is_interpolated_inside_its_step(name: str) -> None:
    history = il.run(struck(DESCRIBED[name], snapshots={"count": 70}))
    times = history.field_times("rod")
    assert times == pytest.approx(np.linspace(0.0, 70e-6, 71))
    seen = {quantity: [history.field("rod", t, quantity) for t in times] for quantity in ("displacement", "velocity")}
    for quantity, fields in seen.items():
        face = np.array([field.values[0] for field in fields])
        channel = history.evaluate(times, f"{quantity}:rod@0")
        # Leapfrog velocities belong to half steps: the last one of a step is extended to its end.
        close = 2e-2 if (name, quantity) == ("leapfrog", "velocity") else 1e-4 if name == "adaptive" else 1e-12
        assert face == pytest.approx(channel, abs=close * np.abs(channel).max())
    one = history.field("rod", times[30], "stress", [0.0, 0.1, 0.299])
    whole = history.field("rod", times[30], "stress")
    assert one.x.tolist() == [0.0, 0.1, 0.299]
    if name != "newmark":  # of a lumped mesh the stress is constant in an element
        assert one.values == pytest.approx(
            np.interp(one.x, whole.x, whole.values), abs=0.2 * np.abs(whole.values).max()
        )


def test_a_frame_of_a_body_that_changes_its_coordinates() -> None:
    """With the striker on its face while they touch, a rod has other modes: fields are read in those of the instant."""
    solve = {"model": {"kind": "modal", "elements": 40, "modes": 20, "basis": "striker_attached"}}
    case = struck(solve).with_("contacts.0.law", {"kind": "penalty", "stiffness": 1e9})
    history = il.run(case.with_("solve.duration", 4e-4), frames=80)
    span = history.contacts[0]
    times = history.field_times("rod")
    assert span.start < times[5] < span.end < times[-5]
    face = np.array([history.field("rod", t, "displacement").values[0] for t in times])
    there = history.evaluate(times, "displacement:rod@0")
    assert face == pytest.approx(there, abs=1e-12 * np.abs(there).max())


def test_equal_frames_of_a_case() -> None:
    case = struck(DESCRIBED["newmark"], snapshots={"every": "20 us"})
    assert case.scene().snapshots == ()
    assert case.scene().frames == pytest.approx((0.0, 2e-5, 4e-5, 6e-5))
    assert case.resolved()["snapshots"] == {"every": pytest.approx(2e-5)}
    history = il.run(case, frames=7)
    assert history.field_times("rod") == pytest.approx(np.arange(8) * 1e-5)
    with pytest.raises(
        ImpactlabError, match=r"no snapshot at t = 1\.5e-05 s; snapshots: 0, 1e-05.*\n.*'snapshots', or"
    ):
        history.field("rod", 1.5e-5, "stress")
    with pytest.raises(CaseError, match=r"has no strss\. Did you mean 'stress'\?"):  # before any snapshot is looked for
        history.field("rod", 1.5e-5, "strss")
    many = il.run(case, frames=30)
    with pytest.raises(ImpactlabError, match=r"Take the nearest, 1\.4e-05 s, add the time"):
        many.field("rod", 1.42e-5, "stress")
    with pytest.raises(ImpactlabError, match=r"0\.31 m lies outside 'rod', 0 to 0\.3 m"):
        history.field("rod", 2e-5, "stress", 0.31)


@pytest.mark.parametrize(
    ("snapshots", "text"),
    [
        ({"every": "1 us", "count": 3}, "snapshots: every and count are given together"),
        ({}, "snapshots: the block is empty"),
        ({"every": "1 ms"}, "snapshots.every: every 0.001 s gives 0.07 snapshots in 7e-05 s. Allowed: 1 to 10000"),
        ({"count": 10_001}, "snapshots.count: 10001 is out of range"),
        ({"evry": "1 us"}, "Did you mean 'every'?"),
        ([1e-5, -1.0], "snapshots.1: -1 s is out of range"),
        ([1e-5, 1.0], "snapshots.1: 1 s lies after the end of the run"),
        ("2 us", "snapshots: "),
    ],
)
def test_wrong_snapshots_are_named(snapshots: Any, text: str) -> None:
    with pytest.raises(CaseError) as caught:
        struck(DESCRIBED["newmark"], snapshots=snapshots)
    assert text in str(caught.value)


def test_of_too_many_frames_as_many_are_kept_as_memory_allows(monkeypatch: pytest.MonkeyPatch) -> None:
    # A tenth for frames of 82 numbers, twice each for displacements and twice for velocities of leapfrog.
    monkeypatch.setenv("IMPACTLAB_MEMORY", "2.4e6")
    case = struck(DESCRIBED["leapfrog"]).with_("solve.records", 100)
    times = il.run(case, frames=240).field_times("rod")
    assert times is not None
    assert times.size == 81
    assert times == pytest.approx(np.arange(81) * 3 * 70e-6 / 240)


@pytest.mark.parametrize("frames", [-1, 2.5, True])
def test_an_invalid_number_of_frames_is_refused(frames: Any) -> None:
    with pytest.raises(ImpactlabError, match=r"frames is .*Allowed: whole numbers from 0\nGive frames=240"):
        il.run(struck(DESCRIBED["newmark"]), frames=frames)
    assert len(il.run(struck(DESCRIBED["newmark"]), frames=np.int64(3)).field_times("rod")) == 4  # type: ignore[arg-type]
