"""The page, the animation and the summary of a mechanism."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import impactlab as il
from impactlab.history import AbstractHistory
from impactlab.report.console import summary_text
from impactlab.report.facts import scene_facts
from impactlab.report.figures import animation, mechanism
from impactlab.report.figures.signals import panels
from impactlab.report.figures.style import INK, Trace
from impactlab.report.page_data import page_data
from impactlab.report.summary import summarise

CASE = il.load_case(Path(__file__).parents[2] / "cases" / "slider_crank.yaml").with_("solve.step.dt", 8.0e-6)


@pytest.fixture(scope="module")
def history() -> AbstractHistory:
    return il.run(CASE)


def test_joints_follow_from_the_angles(history: AbstractHistory) -> None:
    (chain,) = mechanism.chains(history.scene)
    times = np.array([0.0, history.duration])
    places = mechanism.joints(history, chain, times)
    assert places.shape == (2, 3, 2)
    crank = -1.9 + 30.0 * times
    assert places[:, 1] == pytest.approx(0.1 * np.column_stack((np.cos(crank), np.sin(crank))), abs=1e-9)
    assert places[:, 2, 1] == pytest.approx(0.0, abs=1e-4)  # on its slide; the chord of a bent rod is a little shorter
    end = history.evaluate(times, "position:rod.right")
    assert places[:, 2, 0] == pytest.approx(end, abs=1e-4)


def test_the_data_of_a_page_hold_the_chain_and_the_bodies_that_it_meets(history: AbstractHistory) -> None:
    scene = history.scene
    data = json.loads(page_data([Trace("", history, INK)], scene, compared=False))
    assert data["mechanism"]
    assert data["chains"] == [{"name": "press", "slide": 0.0}]
    (met,) = data["met"]
    assert (met["link"], met["share"], met["along"], met["name"], met["sign"]) == (1, 1.0, [1.0, 0.0], "block", 1)
    film = data["films"][0]
    frames, numbers, _ = film["chains"]["press"]
    assert numbers == 6
    assert film["gaps"][0][0] == frames > 100


def test_an_animation_moves_the_chain_to_scale(history: AbstractHistory) -> None:
    figure, step, count = animation.film(history)
    stage = figure.axes[0]
    (line,) = [each for each in stage.lines if each.get_gid() == animation.MOVING]
    step(0)
    assert line.get_xydata()[1] == pytest.approx([0.1 * math.cos(-1.9), 0.1 * math.sin(-1.9)], abs=1e-9)
    step(count - 1)
    last = -1.9 + 30.0 * history.duration
    assert line.get_xydata()[1] == pytest.approx([0.1 * math.cos(last), 0.1 * math.sin(last)], abs=1e-9)
    assert stage.get_aspect() == 1.0


def test_an_animation_shows_the_block_beside_the_face_that_meets_it(history: AbstractHistory) -> None:
    figure, step, count = animation.film(history)
    (block,) = figure.axes[0].collections
    step(count - 1)
    end = history.evaluate(history.duration, "position:rod.right")
    gap = history.evaluate(history.duration, "gap:rod.right|block")
    assert block.get_offsets()[0] == pytest.approx([end + gap, 0.0], abs=1e-4)  # the chord of a bent rod is shorter


def test_an_animation_shows_the_whole_force_of_a_joint_that_also_pulls(history: AbstractHistory) -> None:
    joint = {"kind": "slack", "stiffness": 5e7, "slack": 1e-4}
    pulled = il.run(history.case.with_settings({"contacts.0.law": joint, "contacts.0.gap": 0.0}))
    figure, step, count = animation.film(pulled)
    step(count - 1)
    (line,) = [each for each in figure.axes[1].lines if each.get_gid() == animation.MOVING]
    low, high = figure.axes[1].get_ylim()
    (link,) = pulled.links
    assert link.smallest < -100.0
    # Ten instants a frame: the largest of them is a little below that of all steps.
    assert low < line.get_ydata().min() < 0.9e-3 * link.smallest
    assert high > line.get_ydata().max() > 0.9e-3 * link.largest


def test_a_joint_without_loss_takes_nothing(history: AbstractHistory) -> None:
    """It took "4.57035e-14 J", the rounding of its energy; a cushion in its place takes what it books."""
    joint = {"kind": "slack", "stiffness": 5e7, "slack": 1e-4}
    pulled = il.run(history.case.with_settings({"contacts.0.law": joint, "contacts.0.gap": 0.0}))
    summary = summarise("slider_crank", pulled, None)
    assert [each["loss"] for each in summary["links"]] == [0.0]
    assert "takes 0 J" in summary_text(summary)
    yields = {"kind": "elastic_plastic", "stiffness": 5e7, "yield_force": 50.0}
    taken = il.run(history.case.with_settings({"contacts.0.law": yields, "contacts.0.gap": 0.0}))
    (link,) = summarise("slider_crank", taken, None)["links"]
    assert link["loss"] == taken.links[0].loss > 1e-3


def test_the_summary_states_the_measure_of_errors(history: AbstractHistory) -> None:
    text = summary_text(summarise("slider_crank", history, None))
    assert "not measured: no exact solution, and no reference that converges within 7 s" in text


def test_the_facts_name_links_drives_and_slide() -> None:
    words = dict(scene_facts(CASE.scene()))["press"].replace("\xa0", " ")
    assert "crank (rigid, 100 mm, 0.2 kg, driven at 30 rad/s)" in words
    assert "its end on a slide at y = 0 m" in words
    spinning = il.load_case(Path(__file__).parents[2] / "cases" / "spinning_up_beam.yaml")
    assert "driven at 6 rad/s within 15 s" in dict(scene_facts(spinning.scene()))["rotor"].replace("\xa0", " ")


def test_a_face_of_a_link_has_a_position_and_the_mass_it_meets_a_displacement(history: AbstractHistory) -> None:
    """The face begins at 0.1 cos(-1.9) + sqrt(0.3^2 - (0.1 sin 1.9)^2) on its slide, the block at 0."""
    titles = {
        panel.title: panel.lines[0].values[0]
        for panel in panels([Trace("run", history, INK)], history.scene, compared=False)
    }
    assert titles["Position, rod.right"] == pytest.approx(
        0.1 * math.cos(1.9) + math.sqrt(0.09 - (0.1 * math.sin(1.9)) ** 2), abs=1e-6
    )
    assert titles["Displacement, block"] == 0.0


def test_the_diagram_of_waves_of_a_mechanism_is_refused_as_its_links_turn(history: AbstractHistory) -> None:
    with pytest.raises(il.ImpactlabError, match="links of a mechanism have no diagram of waves"):
        history.plot_xt()


def test_play_between_the_end_and_its_slider_is_the_law_slack() -> None:
    """The slider has the impulse of the joint alone, and stays within the play and what the joint yields elastically.

    A force of the record is the mean over a step, in which the gap moves by its rate times the step.
    """
    slack, stiffness = 2e-4, 1e8
    joint = {"between": ["rod.right", "block"], "along": "x"}
    law = {"kind": "slack", "stiffness": stiffness, "slack": slack}
    case = CASE.with_settings({"contacts": [joint | {"law": law}], "solve.duration": "30 ms", "solve.step.dt": "4 us"})
    history = il.run(case)
    t = np.linspace(0.0, history.duration, 3001)
    force, gap = history.evaluate(t, "force:rod.right|block"), history.evaluate(t, "gap:rod.right|block")
    assert force.max() > 0.0 > force.min()  # it presses and pulls
    in_a_step = np.abs(np.gradient(gap, t)).max() * history.dt
    assert gap.max() == pytest.approx(slack - force.min() / stiffness, abs=in_a_step)
    assert gap.min() == pytest.approx(-force.max() / stiffness, abs=in_a_step)
    mass = case.scene().bodies["block"].moving_mass
    assert history.impulse_of("rod.right|block") == pytest.approx(mass * history.at_end("velocity:block"), rel=1e-6)
