"""Collisions: their sub-impacts found, dated and summed; what methods agree on, and what they do not."""

from __future__ import annotations

import dataclasses
import itertools
import math
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab import simulate
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.penalty import Penalty
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.metrics.body_motion import BodyMotion
from impactlab.metrics.collision_texts import sentence, sentences
from impactlab.metrics.collisions import agreements, collisions
from impactlab.metrics.third_bodies import Periods
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.printing import counted
from impactlab.refine.descriptions import contact_times
from impactlab.refine.descriptions.rods import modelled_as
from impactlab.report.console import summary_text
from impactlab.report.summary import summarise
from impactlab.scene import Mass, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.sweeps import quantities
from impactlab.testing.scenes import in_a_row
from tests.cases.support import case_of
from tests.solving import in_steps, mesh


def test_speeds_of_many_collisions_are_read_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bar with a spring at one end strikes a ball again and again: its momentum and energy are of the record."""
    ends = {"right": {"spring": 1e7}}
    bodies = {"ball": il.Mass(0.2, velocity=1.0)}
    bodies["bar"] = il.Rod(length=0.1, diameter=0.02, material="steel", ends=ends)
    bodies["wall"] = il.Wall()
    law = {"kind": "penalty", "stiffness": 1e9}
    contacts = [il.Contact("wall", "ball", law), il.Contact("ball", "bar.left", law, gap=1e-5)]
    solve = in_steps(5e-3, "midpoint", mesh(20), dt=1e-6)
    history = il.run(il.Case(bodies=bodies, contacts=contacts, solve=solve))
    together, read = collisions(history), []
    evaluate = type(history).evaluate

    def counting(self: Any, t: Any, channel: str) -> Any:
        read.append(channel)
        return evaluate(self, t, channel)

    monkeypatch.setattr(type(history), "evaluate", counting)
    assert collisions(history) == together
    at_once = len(read)
    monkeypatch.setattr(BodyMotion, "read_ahead", lambda *_, **__: None)
    assert collisions(history) == together
    assert len(read) - at_once > at_once


def test_impulses_of_periods_that_reach_into_a_time() -> None:
    """Periods that only meet it at an end do not reach into it."""
    draw = random.Random(3)
    for _ in range(300):
        edges = sorted(draw.sample(range(14), 2 * draw.randint(0, 5)))
        starts, ends = edges[::2], [*map(float, edges[1::2])]
        if ends and draw.random() < 0.3:
            ends[-1] = math.inf
        impulses = [draw.randint(1, 9) for _ in starts]
        periods = Periods(np.array(starts, float), np.array(ends), np.cumsum([0.0, *impulses]))
        start = draw.randint(-2, 26) / 2
        end = start + draw.choice([0.5, 1, 3])
        reached = (each for each, a, b in zip(impulses, starts, ends, strict=True) if a < end and b > start)
        assert periods.given_in(start, end) == sum(reached)


def test_a_body_between_two_others_has_no_restitution_while_both_press() -> None:
    """The helmet of a pile sets out from rest and is struck by the ram: its speeds say nothing of one collision."""
    case = case_of("smith_pile").with_("solve.model", {"kind": "finite_element", "elements": 40, "mass": "lumped"})
    history = il.run(case)
    found = collisions(history)
    struck, on_pile = found[0], found[1]
    assert (struck.striker, on_pile.striker) == ("ram", "helmet")
    assert struck.restitution is None
    assert sentence(dataclasses.asdict(struck)).endswith("no restitution: 'helmet' also touches 'pile' meanwhile")
    assert on_pile.restitution is None
    assert on_pile.no_restitution == "'helmet' also touches 'ram' meanwhile"


def hammer_rod_mass(model: dict[str, Any], gap: float) -> il.Case:
    law = {"kind": "wave_identification"}
    return il.Case(
        bodies={
            "hammer": il.Mass(1.0, velocity=1.0),
            "rod": il.Rod(length=0.3, area=9e-4, material="steel"),
            "end": il.Mass(0.2),
        },
        contacts=[il.Contact("hammer", "rod.left", law, gap=1e-4), il.Contact("rod.right", "end", law, gap=gap)],
        solve={"duration": {"round_trips": 4}, "model": model},
    )


@pytest.mark.parametrize("gap", [0.0, 1e-6])
def test_a_mass_has_no_restitution_from_a_rod_that_a_hammer_still_drives(gap: float) -> None:
    """The speed of the rod at the touch is that of an instant: short waves of a mesh touched early, and 136 was given.

    The exact run gave 2.5. The hammer has none, too: the rod gives what it gets to the mass meanwhile.
    """
    for model in ({"kind": "continuous"}, {"kind": "modal", "elements": 40, "modes": 20}):
        case = hammer_rod_mass(model, gap)
        first, second = collisions(il.run(case))[:2]
        assert (first.striker, second.striker) == ("hammer", "end")
        assert (first.restitution, second.restitution) == (None, None)
        assert first.no_restitution == "'rod' also touches 'end' meanwhile"
        assert second.no_restitution is not None


def test_a_mass_has_a_restitution_from_a_rod_that_moves_freely() -> None:
    """The hammer has left the rod before it meets the mass."""
    case = hammer_rod_mass({"kind": "continuous"}, 1e-4)
    found = collisions(il.run(case))
    assert found[0].end is not None
    assert found[0].end < found[1].start
    assert found[1].restitution is not None


def beads(records: int, drift: float = 0.0) -> il.Case:
    mass, law = 4.1102503884466466e-3, {"kind": "hertz", "stiffness": 7.692307692307692e9}
    solve = {"duration": "0.5 ms", "integrator": {"kind": "central_difference"}, "step": {"dt": "0.25 us"}}
    return il.Case(
        bodies={
            "striker": il.Mass(mass, velocity=1.0 + drift),
            "bead": il.Mass(mass, velocity=drift, repeat=10),
        },
        contacts=[il.Chain(["striker", "bead"], law)],
        solve={**solve, "records": records},
    )


@pytest.mark.parametrize("drift", [20.0, -20.0])
def test_a_speed_that_is_not_known_is_not_known_in_a_moving_frame_either(drift: float) -> None:
    """It changes by a third of the striker's speed between two records, and by little of a speed of 20 m/s."""
    at_rest, moving = (collisions(run) for run in (il.run(beads(100)), il.run(beads(100, drift))))
    assert at_rest[0].exit_speed is None
    for given, seen in zip(at_rest, moving, strict=True):
        assert (seen.bodies, seen.no_restitution) == (given.bodies, given.no_restitution)
        assert (seen.approach_speed is None, seen.exit_speed is None) == (
            given.approach_speed is None,
            given.exit_speed is None,
        )


def test_the_speeds_in_a_chain_do_not_follow_its_records() -> None:
    """The second bead still presses on the third as the striker leaves: with few records its speed is not known.

    Such a ratio of speeds is no restitution: it was given as 0.3912, or 0.52 where one in 32 steps was recorded.
    """
    known = [collisions(history)[0] for history in (il.run(beads(2000)), il.run(beads(100)))]
    assert known[0].exit_speed == pytest.approx(0.3912, abs=2e-4)
    assert known[0].restitution is None
    assert known[0].no_restitution == "'bead_1' also touches 'bead_2' meanwhile"
    assert known[0].energy_given == pytest.approx(0.5 * 4.11025e-3 * 0.32017**2, rel=1e-3)
    assert (known[1].exit_speed, known[1].restitution, known[1].energy_given) == (None, None, None)
    assert known[1].energy_lost == pytest.approx(known[0].energy_lost, rel=1e-9)


def test_beads_that_rest_side_by_side_do_not_approach() -> None:
    """They touch; from the third pair on, the left one moved at 1e-16 m/s and less when the force began."""
    history = il.run(beads(records=2000))
    first, second, *others = [each.approach_speed for each in collisions(history)]
    assert first == 1.0
    force = 7.692307692307692e9 * (1.0 * 0.25e-6) ** 1.5  # N, after the first step
    assert second == pytest.approx(0.5 * force * 0.25e-6 / 4.1102503884466466e-3, rel=1e-6)
    assert {*others} == {0.0}


def two_models(label: str) -> list[Simulation]:
    given = case_of(label).simulation()
    step = given.method.step
    fine = modelled_as(given, FiniteElement(60), Midpoint(), step)
    return [modelled_as(given, Modal(modes=40), ExactModal(), step), fine]


def summaries(label: str) -> list[tuple[str, dict[str, object]]]:
    from impactlab.report.summary import summarise

    named = zip(("modes", "elements"), two_models(label), strict=True)
    return [(name, summarise(label, il.run(given))) for name, given in named]


def test_the_three_blows_of_the_larger_sphere_are_one_collision() -> None:
    """Its numbers are those of the sub-impacts, and of the sphere before and after: nothing is lost to a scheme."""
    case = case_of("sphere_on_long_beam")
    scene, history = case.scene(), il.run(case)
    (one,) = collisions(history)
    assert one.sub_impacts == len(history.contacts) == 3
    assert one.start == 0.0
    assert one.end == history.contacts[-1].end
    assert one.impulse == sum(span.impulse for span in history.contacts)
    assert one.peak_force == max(span.peak_force for span in history.contacts)
    assert one.in_contact == pytest.approx(sum(span.end - span.start for span in history.contacts))
    mass, end = scene.bodies["sphere"].mass, history.evaluate([history.duration], "velocity:sphere")[0]
    assert one.striker == "sphere"
    assert one.approach_speed == 0.01
    assert one.exit_speed == pytest.approx(-end, rel=1e-9)
    assert one.restitution == pytest.approx(-end / 0.01, rel=1e-9)
    assert one.impulse == pytest.approx(mass * (0.01 - end), rel=1e-9)
    assert one.energy_lost == pytest.approx(0.5 * mass * (0.01**2 - end**2), rel=1e-9)
    # The beam gets it; its energy is read between records, 1e-3 of the little that it has at the end.
    assert one.energy_given == pytest.approx(one.energy_lost, rel=1e-3)
    assert 1e-6 < one.largest_gap < 1e-5
    assert "3 sub-impacts" in sentence(dataclasses.asdict(one))


@pytest.mark.parametrize(
    ("label", "count"), [("sphere_on_long_beam", 3), ("mass_on_cantilever_middle", 2), ("sphere_on_beam", 1)]
)
def test_two_models_agree_on_count_and_impulse(label: str, count: int) -> None:
    """Elements and modes share nothing but the physics."""
    (said,) = agreements(summaries(label))
    assert said["resolved"]
    assert set(said["counts"].values()) == {count}
    assert said["impulses_within"] < 1e-3
    assert f"{counted(count, 'sub-impact')} by all 2 methods" in said["text"]


def test_a_hard_hammer_on_a_cantilever_has_no_resolved_count() -> None:
    """Said by a comparison of two models, and by each run alone."""
    case = case_of("mass_on_cantilever_middle").with_("contacts.0.law", kind="addition_deletion")
    rows = []
    from impactlab.report.summary import summarise

    for modes in (20, 40):
        scene = modelled_as(
            case.simulation(), Modal(modes=modes), ExactModal(), StepRule(dt=1e-6), AdditionDeletion()
        ).but(events="located")
        history = il.run(scene)
        codes = {warned.code: warned.text for warned in history.warnings}
        assert "t^-1/2" in codes["singular_force"]
        assert "does not resolve their number" in codes["sub_impacts"]
        rows.append((f"modes {modes}", summarise("hard", history)))
    (said,) = agreements(rows)
    assert not said["resolved"]
    assert said["impulses_within"] is None
    counts = said["counts"]
    listed = f"{counts['modes 20']} by modes 20, {counts['modes 40']} by modes 40"
    assert said["text"].endswith(f"methods disagree on the number of sub-impacts: {listed}")


@pytest.mark.parametrize(("name", "face"), [("arm_on_stop", "arm.right"), ("slider_crank", "rod.right")])
def test_a_mechanism_has_no_one_speed_and_the_reason_names_that_of_its_face(name: str, face: str) -> None:
    case = il.load_case(name)
    history = il.run(case)
    for each in collisions(history):
        assert each.restitution is each.approach_speed is each.exit_speed is None
        assert each.no_restitution is not None
        assert each.no_restitution.endswith(f"the channel velocity:{face}")
    assert f"velocity:{face}" in history.channels()


def test_rigid_bodies_part_for_good() -> None:
    """A mass that bounces on a spring under its weight collides again each time, with the restitution 1."""
    bodies = Wall("floor"), Mass("ball", 1.0, 0.0)
    scene = in_a_row(
        bodies, None, Penalty(1e6), ExactModal(), StepRule(dt=1e-5), gaps=0.05, duration=0.8, gravity=-9.81
    )
    found = collisions(il.run(scene))
    assert len(found) >= 3
    assert [each.sub_impacts for each in found] == [1] * len(found)
    assert all(each.restitution == pytest.approx(1.0, abs=1e-3) for each in found if each.end is not None)
    assert found[0].approach_speed == pytest.approx((2.0 * 9.81 * 0.05) ** 0.5, rel=1e-3)


def test_the_period_of_a_cantilever() -> None:
    """The first root of cos z cosh z = -1 is 1.8751040687; a rod clamped at one end has the period 4 L/c."""
    beam = case_of("mass_on_cantilever_tip").scene().bodies["beam"]
    piece = beam.segments[0]
    omega = 1.8751040687**2 / 0.3**2 * (piece.bending_stiffness / (piece.density * piece.area)) ** 0.5
    scene = case_of("mass_on_cantilever_tip").scene()
    assert scene.bodies["beam"].slowest_period == pytest.approx(2.0 * 3.141592653589793 / omega, rel=1e-9)
    assert scene.bodies["hammer"].slowest_period == 0.0
    assert case_of("axial_impact").scene().bodies["rod"].slowest_period == pytest.approx(2.0 * 116.373782e-6, rel=1e-6)


def test_the_summary_and_the_screen_show_collisions(capsys: pytest.CaptureFixture[str]) -> None:
    from impactlab.report.console import summary_text

    (_, summary), _ = summaries("sphere_on_beam")
    assert summary["collisions"][0]["sub_impacts"] == 1
    assert "collision sphere|beam: 1 sub-impact, 0 s to 0.000156" in summary_text(summary)


def test_channels_are_listed_once_however_many_bodies_collide(monkeypatch: pytest.MonkeyPatch) -> None:
    history = il.run(il.load_case(Path(__file__).parents[2] / "cases" / "granular" / "solitary_wave.yaml"))
    listed: list[int] = []
    names = history.channels()
    monkeypatch.setattr(type(history), "channels", lambda _: listed.append(1) or names)
    assert len(collisions(history)) == 100
    assert len(listed) == 1


def test_the_speed_at_which_bodies_meet_is_found_once_for_all_contacts(monkeypatch: pytest.MonkeyPatch) -> None:
    case = il.load_case(Path(__file__).parents[2] / "cases" / "granular" / "solitary_wave.yaml").simulation()
    found: list[float] = []
    speed = contact_times.meeting_speed(case.scene)
    assert speed == 1.0
    monkeypatch.setattr(contact_times, "meeting_speed", lambda _: found.append(speed) or speed)
    alone = min(contact_times.rise_time(*case, contact) for contact in case.scene.contacts)
    assert len(found) == 100
    assert contact_times.shortest_rise(*case) == alone
    assert len(found) == 101


def test_velocities_of_bodies_on_links_are_their_momentum_over_their_mass() -> None:
    ball, plate = il.Mass(1.0, velocity=2.0), il.Mass(3.0)
    blow = il.Contact("ball", "plate", {"kind": "hertz", "stiffness": 1e9})
    held = il.Contact("plate", "wall", {"kind": "elastic_plastic", "stiffness": 1e7, "yield_force": 200.0})
    case = il.Case(
        bodies={"ball": ball, "plate": plate, "wall": il.Wall()},
        contacts=[blow, held],
        solve={"duration": 2e-3, "integrator": {"kind": "midpoint"}, "step": {"dt": 1e-6}},
    )
    scene, history = case.scene(), il.run(case)
    momenta = quantities.final_momentum(scene, history)
    assert quantities.final_velocity(scene, history) == pytest.approx(
        {"ball": momenta["ball"] / 1.0, "plate": momenta["plate"] / 3.0}, rel=1e-12
    )
    # The blow lasts 0.63 ms: the bolt takes less than 200 N of it, 3 % of the momentum.
    assert quantities.restitution(scene, history)["ball|plate"] == pytest.approx(1.0, abs=0.01)


def test_final_velocity_of_a_held_rod_is_its_momentum_over_its_mass() -> None:
    case = il.load_case("axial_impact").method("continuous")
    found = il.sweep(case, {"bodies.hammer.mass": [1.0, 2.133]}, quantities=["final_velocity", "final_momentum"])
    mass = case.scene().bodies["rod"].moving_mass
    velocity, momentum = (found[name].sel(body="rod").to_numpy() for name in ("final_velocity", "final_momentum"))
    assert abs(velocity).min() > 1e-3
    assert velocity * mass == pytest.approx(momentum, rel=1e-12)


def test_a_contact_that_is_closed_when_the_run_ends_is_marked_as_such():
    from impactlab.report.console import summary_text
    from impactlab.report.summary import summarise

    ball, step = Mass("ball", 1.0, 1.0), StepRule(dt=1e-2)
    history = simulate.run(*in_a_row([ball, Wall("wall")], None, Penalty(1.0), Midpoint(), step, duration=1.0))
    assert history.contacts[-1].end is None
    text = summary_text(summarise("short", history))
    assert "values so far" in next(line for line in text.splitlines() if line.startswith("  contact "))
    assert "0 s on, still in contact" in text


@pytest.mark.parametrize("duration", ["0.1 ms", "0.2 ms"])
def test_bodies_that_have_not_parted_have_no_restitution(duration: str) -> None:
    """A run of 0.1 ms ended inside the contact, and the ratio of the speeds then, -0.17, was given for it."""
    case = il.load_case("axial_impact").method("continuous").with_("solve.duration", duration)
    (one,) = collisions(il.run(case))
    points = il.sweep(case, {"bodies.hammer.mass": [2.133, 2.2]}, quantities=["restitution"])["restitution"].to_numpy()
    found = il.sensitivities(case, ["bodies.hammer.mass"], ["restitution"]).find("restitution", "bodies.hammer.mass")
    if duration == "0.1 ms":
        assert (one.end, one.restitution) == (None, None)
        assert np.isnan(points).all()
        assert found.found == "withheld"
    else:
        assert one.restitution == pytest.approx(0.687618939800652, rel=1e-9)
        assert points[0, 0] == pytest.approx(one.restitution, rel=1e-12)
        assert found.reason == ""


def hopkinson(duration: str) -> il.Case:
    steel, law = {"young": 2.1e11, "density": 7850}, {"kind": "wave_identification"}
    bars = {"striker": 0.2, "incident": 1.0, "specimen": 8e-3, "transmission": 1.0}
    bodies: dict[str, Any] = {
        name: il.Rod(length=length, area=201.06e-6, material=steel, velocity=10.0 * (name == "striker"))
        for name, length in bars.items()
    }
    bodies["specimen"] = il.Rod(length=8e-3, area=78.54e-6, material={"young": 7e10, "density": 2700})
    contacts = [il.Contact(f"{one}.right", f"{other}.left", law) for one, other in itertools.pairwise(bars)]
    return il.Case(bodies=bodies, contacts=contacts, solve={"duration": duration, "model": {"kind": "continuous"}})


def test_a_specimen_between_two_bars_has_no_restitution() -> None:
    """After 600 us the specimen is thrown out of the bars: the ratio of the speeds, 3.51, was given for the bar."""
    case = hopkinson("600 us")
    struck, *others = collisions(il.run(case))
    assert struck.restitution == pytest.approx(0.2)  # of the lengths: the striker stops, the bar goes on alone
    assert struck.no_restitution is None
    assert [each.restitution for each in others] == [None, None]
    assert others[0].no_restitution == "'specimen' also touches 'transmission' meanwhile"
    assert "no restitution: 'specimen' also" in sentence(dataclasses.asdict(others[0]))
    found = il.sweep(case, {"bodies.striker.velocity": [9.0, 10.0]}, quantities=["restitution"])["restitution"]
    assert found.to_numpy()[:, 0] == pytest.approx([0.2, 0.2])
    assert np.isnan(found.to_numpy()[:, 1:]).all()


@pytest.mark.parametrize("force", [1.0, 2.0e4])
def test_an_end_force_that_gives_much_of_the_impulse_leaves_no_restitution(force: float) -> None:
    rod = il.Rod(length=0.3, area=9e-4, material="steel", ends={"right": {"force": force}})
    case = il.Case(
        bodies={"hammer": il.Mass(1.0, velocity=1.0), "rod": rod},
        contacts=[il.Contact("hammer", "rod.left", {"kind": "wave_identification"})],
        solve={"duration": {"round_trips": 3}, "model": {"kind": "continuous"}},
    )
    (one, *_) = collisions(il.run(case))
    if force == 1.0:
        assert one.restitution is not None
    else:
        assert one.no_restitution == "an end force acts on 'rod' meanwhile"
    points = il.sweep(case, {"bodies.hammer.velocity": [1.0, 1.001]}, quantities=["restitution"])["restitution"]
    assert np.isnan(points.to_numpy()).all() == (one.restitution is None)


def test_bodies_that_still_approach_after_the_last_contact_have_no_restitution() -> None:
    """-0.11 was given for it."""
    case = case_of("rod_on_beam")
    (one, *_) = collisions(il.run(case))
    assert one.exit_speed < 0.0
    assert one.restitution is None
    assert one.no_restitution == "their mean speeds still approach each other after the last contact"


def test_impulses_agree_within_a_share_in_per_cent() -> None:
    """It read: within 0.1."""

    def summary(impulse: float) -> dict[str, Any]:
        one = {"bodies": "a|b", "sub_impacts": 1, "impulse": impulse}
        return {"status": "completed", "contacts": [], "collisions": [one]}

    (said,) = agreements([("fine", summary(1.0)), ("coarse", summary(1.1))])
    assert said["text"].endswith("impulses differ by at most 10 %")
    assert said["impulses_within"] == pytest.approx(0.1)


JOINED: dict[str, Any] = {
    "bodies": {
        "one": il.Mass(0.3, velocity=1.0),
        "two": il.Mass(0.2, velocity=1.0),
        "rod": il.Rod(length=0.2, area=1e-4, material="steel", ends={"right": "clamped"}),
        "wall": il.Wall(),
    },
    "contacts": [
        il.Contact("one", "two", {"kind": "slack", "stiffness": 1e8}),
        il.Contact("two", "rod.left", {"kind": "penalty", "stiffness": 1e8}, gap=1e-4),
        il.Contact("wall", "one", {"kind": "penalty", "stiffness": 1e8}, gap=1e-4),
    ],
}


def test_speeds_of_joined_bodies_are_exact_late_in_a_run() -> None:
    """The impulse of a joint that swings thousands of times is its integral, not a sum at 4000 instants."""
    case = il.Case(**JOINED, solve={"duration": "15 ms", "model": {"kind": "continuous"}})
    history, masses = il.run(case), {"one": 0.3, "two": 0.2}
    found = collisions(history)
    assert found[-1].start > 0.01
    for each in found:
        momentum = history.evaluate(np.nextafter(each.start, -1.0), f"momentum:{each.striker}")
        assert each.approach_speed == pytest.approx(abs(float(momentum)) / masses[each.striker], rel=1e-9)


@pytest.mark.parametrize("integrator", ["newmark", "midpoint"])
def test_the_impulse_of_a_joint_up_to_a_time_is_the_change_of_momentum(integrator: str) -> None:
    solve = {"model": {"kind": "finite_element", "elements": 10}, "integrator": {"kind": integrator}}
    history = il.run(il.Case(**JOINED, solve=solve | {"duration": "2 ms", "step": {"dt": "1 us"}}))
    for time in (5e-4, 1.2e-3, 1.8e-3):
        given = [history.impulse_until(contact.name, time) for contact in history.scene.contacts]
        first, second = (float(history.evaluate(time, f"velocity:{name}")) - 1.0 for name in ("one", "two"))
        assert given[2] - given[0] == pytest.approx(0.3 * first, abs=1e-12)
        assert given[0] - given[1] == pytest.approx(0.2 * second, abs=1e-12)


def test_collisions_that_are_not_whole_lack_energies_and_gaps_alone() -> None:
    history = il.run(il.load_case("axial_impact"))
    whole = collisions(history)
    assert whole[0].largest_gap is not None
    without = [dataclasses.replace(each, energy_lost=None, energy_given=None, largest_gap=None) for each in whole]
    assert without == [*collisions(history, whole=False)]


def struck_rod(ends: dict[str, Any], duration: float) -> il.Case:
    return il.Case(
        bodies={
            "hammer": il.Mass(0.05, velocity=1.0),
            "rod": il.Rod(length=0.5, area=4e-4, material="steel", ends=ends),
        },
        contacts=[il.Contact("hammer", "rod.left", {"kind": "penalty", "stiffness": 1e9}, gap=3.3e-5)],
        solve=in_steps(duration, "newmark", mesh(100), courant=0.5),
    )


@pytest.mark.parametrize("duration", [1e-3, 1e-2])
def test_the_energy_given_to_a_rod_does_not_depend_on_the_length_of_the_run(duration: float) -> None:
    """The energy of the rod is recorded at some 250 instants, none of them in a contact of 23 us."""
    history = il.run(struck_rod({}, duration))
    (found,) = collisions(history)
    assert found.energy_given == pytest.approx(found.energy_lost, rel=1e-9)


def test_the_energy_given_to_a_rod_is_not_known_where_a_dashpot_takes_it_meanwhile() -> None:
    history = il.run(struck_rod({"right": {"dashpot": 1e4}}, 1e-2))
    first = collisions(history)[0]
    assert first.energy_given is None
    assert first.energy_lost is not None


def test_the_speed_of_a_rod_that_a_wall_turns_round_between_two_records_is_not_known() -> None:
    """A ball meets the rod while the rod strikes a wall, within one of some 250 records of its momentum."""
    spring = {"kind": "penalty", "stiffness": 1e8}
    case = il.Case(
        bodies={
            "wall": il.Wall(),
            "rod": il.Rod(length=0.5, area=4e-4, material="steel", velocity=-1.0),
            "ball": il.Mass(0.02, velocity=-3.0),
        },
        contacts=[il.Contact("wall", "rod.left", spring), il.Contact("rod.right", "ball", spring, gap=2e-4)],
        solve=in_steps(0.1, "newmark", mesh(20), courant=0.5),
    )
    found = next(each for each in collisions(il.run(case)) if each.bodies == "rod|ball")
    assert (found.approach_speed, found.restitution) == (None, None)


@pytest.mark.parametrize("stiffness", [3.0e7, 7.7e8, 1.0e9])
def test_a_ball_that_loses_nothing_gains_no_rounding(stiffness: float) -> None:
    """Under a spring that conserves energy the ball leaves as fast as it came, up to the rounding of the steps."""
    contact = il.Contact("ball", "wall", {"kind": "hertz", "stiffness": stiffness}, gap=1e-4)
    solve = {"duration": "5 ms", "integrator": {"kind": "newmark"}, "step": {"dt": "1 us"}}
    bodies = {"ball": il.Mass(1.0, velocity=1.0), "wall": il.Wall()}
    history = il.run(il.Case(bodies=bodies, contacts=[contact], solve=solve))
    (found,) = collisions(history)
    assert found.restitution == pytest.approx(1.0, rel=1e-11)
    assert found.energy_lost == 0.0


def test_many_collisions_without_a_restitution_are_counted_in_one_sentence() -> None:
    """Beads of a chain touch both neighbours at once; those still pressed at the end have lines of their own."""
    case = il.Case(
        bodies={"striker": il.Mass("4.11 g", velocity=1.0), "bead": il.Mass("4.11 g", repeat=20)},
        contacts=[il.Chain(["striker", "bead"], {"kind": "hertz", "stiffness": 7.69e9})],
        solve={"duration": "0.25 ms", "integrator": {"kind": "central_difference"}, "step": {"dt": "0.5 us"}},
    )
    history = il.run(case)
    met = [dataclasses.asdict(each) for each in collisions(history)]
    over = [each for each in met if each["end"] is not None]
    together, others = sentences(met)
    assert 4 <= len(over) < len(met)
    assert together.startswith(f"{len(over)} collisions without a restitution, 0 s to ")
    assert f"to {max(each['impulse'] for each in over):.6g} N s; of the first, striker|bead_1, as 'bead_1'" in together
    assert others == [sentence(each) for each in met if each["end"] is None]
    assert sentences(over[:3]) == ("", [sentence(each) for each in over[:3]])
    text = summary_text(summarise("chain", history))
    assert text.count("without a restitution") == 1
    assert text.count("no restitution") == 0
