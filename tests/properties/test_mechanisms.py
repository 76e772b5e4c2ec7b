"""Mechanisms: mirrored, under several laws, events dated or located; counts of sub-impacts, order of the step."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.history import AbstractHistory
from tests.solving import run_case
from tests.support import ROOT

ARM, CRANK = (il.load_case(ROOT / "cases" / f"{name}.yaml") for name in ("arm_on_stop", "slider_crank"))
ROBOT, PRESS = "mechanisms.robot.links.0", "mechanisms.press.links.0"
MIRRORED = {  # across the x axis
    "arm": (ARM, {f"{ROBOT}.torque": -0.5, f"{ROBOT}.rate": -0.1, "contacts.0.along": [0.0, -1.0]}),
    "crank": (CRANK, {f"{PRESS}.angle": 1.9, f"{PRESS}.drive.rate": -30.0}),
}
LAWS: tuple[dict[str, Any], ...] = (
    {"kind": "penalty", "stiffness": 1.0e7},
    {"kind": "hunt_crossley", "stiffness": 3.0e9, "restitution": 0.7},
    {"kind": "flores", "stiffness": 3.0e9, "restitution": 0.7},
    {"kind": "lankarani_nikravesh", "stiffness": 3.0e9, "restitution": 0.7},
    {"kind": "velocity_complementarity"},
    {"kind": "impulse_momentum", "restitution": 0.5},
    {"kind": "energy_conserving"},
    {"kind": "addition_deletion"},
)
PARTS = ("kind", "restitution")


def under(case: il.Case, law: dict[str, Any], events: str = "dated") -> AbstractHistory:
    return il.run(case.with_settings({"contacts.0.law": law, "solve.events": events}))


def total(history: AbstractHistory) -> float:
    """Return the impulse of all contacts [N s]."""
    return sum(span.impulse for span in history.contacts)


@pytest.mark.parametrize("name", MIRRORED)
def test_a_mirrored_mechanism_gives_the_mirrored_solution(name: str) -> None:
    case, changes = MIRRORED[name]
    one, other = il.run(case), il.run(case.with_settings(changes))
    assert len(one.contacts) == len(other.contacts) > 0
    for a, b in zip(one.contacts, other.contacts, strict=True):
        assert (b.start, b.end, b.impulse) == pytest.approx((a.start, a.end, a.impulse), rel=1e-7)
    t = np.linspace(0.0, one.duration, 50)
    for channel in one.channels():
        if channel.startswith(("angle:", "rate:", "drive:")):
            expected = -one.evaluate(t, channel)
            assert other.evaluate(t, channel) == pytest.approx(expected, abs=1e-7 * np.abs(expected).max()), channel


@pytest.mark.parametrize("case", [ARM, CRANK], ids=["arm", "crank"])
@pytest.mark.parametrize("law", LAWS[:4], ids=lambda law: law["kind"])
def test_located_and_dated_events_agree_to_their_order(case: il.Case, law: dict[str, Any]) -> None:
    """The first impulse of a force that begins at zero: they differ by a term of second order in dt."""
    for dt in (8.0e-6, 4.0e-6, 2.0e-6):
        dated, located = (under(case.with_("solve.step.dt", dt), law, events) for events in ("dated", "located"))
        impulse = located.contacts[0].impulse
        assert dated.contacts[0].impulse == pytest.approx(impulse, rel=6.4e-5 * (dt / 8.0e-6) ** 2)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: "-".join(str(law[key]) for key in PARTS if key in law))
@pytest.mark.parametrize("case", [ARM, CRANK], ids=["arm", "crank"])
def test_a_law_keeps_the_energy_of_a_mechanism(case: il.Case, law: dict[str, Any]) -> None:
    """Energy closes with work and losses that the law books; located events, as a dated hard constraint gains some."""
    history = under(case, law, "located")
    assert len(history.contacts) > 0
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-4
    if law["kind"] not in ("penalty", "energy_conserving"):
        assert float(history.energy.booked["contact"][-1]) > 0.0


def test_hard_laws_agree_on_the_impulse_of_a_slider() -> None:
    """Constraint on positions, on velocities and of impulses: one hard blow."""
    found = [total(under(CRANK, law, "located")) for law in ({"kind": LAWS[4]["kind"]}, {"kind": LAWS[7]["kind"]})]
    assert found[0] == pytest.approx(found[1], rel=1e-4)
    assert total(under(CRANK, {"kind": "impulse_momentum"}, "located")) == pytest.approx(found[0], rel=3e-3)


def test_the_count_of_sub_impacts_does_not_depend_on_modes_and_step() -> None:
    runs = [
        il.run(ARM.with_settings({"solve.model.modes": modes, "solve.step.dt": dt}))
        for modes in (20, 26, 36)
        for dt in (1.0e-6, 2.0e-6)
    ]
    assert {len(history.contacts) for history in runs} == {3}
    spread = [np.ptp([history.contacts[number].impulse for history in runs]) for number in range(3)]
    assert spread[0] < spread[1] < spread[2]  # each differs more than the one before it


def test_a_sequence_of_three_contacts_is_warned_of() -> None:
    codes = [[warned.code for warned in il.run(case).warnings] for case in (ARM, CRANK)]
    assert [("sensitive_sequence" in found) for found in codes] == [True, False]
    early = il.run(ARM.with_("solve.duration", 1.5e-2))
    assert "sensitive_sequence" not in [warned.code for warned in early.warnings]


def test_the_table_of_the_docs_is_measured() -> None:
    """Energy, impulse and displacement of the block at three steps: of second order, energy of a higher one."""
    page = (ROOT / "docs" / "mechanisms.md").read_text(encoding="utf-8")
    lines = re.findall(r"^\| (\d) µs \| (\S+) \| (\S+) \| (\S+) \|$", page, flags=re.MULTILINE)
    finest = il.run(CRANK.with_("solve.step.dt", 2.5e-7))

    def measured(dt: float) -> tuple[float, float, float]:
        history = il.run(CRANK.with_("solve.step.dt", dt))
        way = [float(each.evaluate(each.duration, "position:block")) for each in (history, finest)]
        energy = max(history.energy.largest_gain, history.energy.largest_loss)
        return energy, abs(total(history) / total(finest) - 1.0), abs(way[0] / way[1] - 1.0)

    found = [measured(float(line[0]) * 1e-6) for line in lines]
    assert len(found) == 3
    for line, values in zip(lines, found, strict=True):
        assert [f"{value:.1e}" for value in values] == list(line[1:])
    for coarse, fine in pairwise(found):
        assert np.array(coarse[1:]) / np.array(fine[1:]) == pytest.approx(np.full(2, 4.0), rel=0.05)
        assert coarse[0] / fine[0] > 5.0


@pytest.mark.parametrize(("step", "far"), [({"points_per_period": 10}, True), ({"dt": 1e-4}, False)])
def test_a_link_that_turns_far_in_a_step_may_pass_a_wall_with_a_warning(step: dict[str, float], far: bool) -> None:
    """A bar of 0.5 kg and 0.3 m at 10 rad/s meets a wall after 3.3 ms and gives it 2 I w/L = 1 N s, by 1/cos of 1/30.

    Rigid links have no period: ten points of the one assumed are steps of 0.63 s.
    """
    history = run_case(
        bodies={"bar": il.Link(length=0.3, mass=0.5), "wall": il.Wall()},
        mechanisms={"arm": il.Mechanism([il.Joint("bar", rate=10.0)])},
        contacts=[il.Contact("bar.right", "wall", {"kind": "hertz", "stiffness": 1e8}, along="y", gap=0.01)],
        solve={"duration": 0.01, "integrator": {"kind": "midpoint"}, "step": step},
    )
    assert ("coarse_turning" in [each.code for each in history.warnings]) == far
    if not far:
        assert history.contacts[0].impulse == pytest.approx(1.0, rel=2e-3)
