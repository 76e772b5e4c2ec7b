"""Figures of the page of a run for laws that remember, piles and specimens."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot as plt

import impactlab as il
from impactlab.report import facts
from impactlab.report.figures import applications
from impactlab.report.figures.style import PALETTE, Trace
from tests.support import CASES


def traced(name: str, **changes: object) -> tuple[il.Case, Trace]:
    case = il.load_case(CASES / f"{name}.yaml").with_settings(changes)
    return case, Trace(name, il.run(case), PALETTE[0])


def names_of(trace: Trace) -> list[str]:
    return [figure.name for figure in applications.of_laws_with_memory(trace, trace.history.scene)]


def test_the_loop_on_rock_encloses_the_work_on_it() -> None:
    _, trace = traced("drill_rod")
    assert names_of(trace) == ["loops"]
    (loop,) = applications.loops(trace.history, trace.history.scene)
    assert loop.name == "rod.right|rock"
    # 0.7330685831 of 200 J, by the closed form of docs/drilling.md; corners between the 4001 instants cost some 1e-4.
    assert np.trapezoid(loop.force, loop.closing) == pytest.approx(146.614, rel=5e-4)


def test_faces_that_part_after_the_blow_do_not_squeeze_the_loop() -> None:
    """1 kg at 1 m/s on 1 kN/mm goes 1 mm deep, leaves at half its speed and is some 8 mm away after 20 ms."""
    history = il.run(
        il.Case(
            bodies={"ball": il.Mass("1 kg", velocity="1 m/s"), "wall": il.Wall()},
            contacts=[il.Contact("ball", "wall", {"kind": "bilinear", "stiffness": 1e6, "restitution": 0.5})],
            solve={"duration": "20 ms", "integrator": {"kind": "midpoint"}, "step": {"dt": "10 us"}},
        )
    )
    loops = applications.loops(history, history.scene)
    assert loops[0].closing.min() < -7e-3
    (axis,) = applications.force_loops(loops).axes
    assert axis.get_xlim() == pytest.approx((-0.05, 1.05), rel=0.01)


def test_the_style_for_figures_of_users_has_the_colours_of_ours() -> None:
    with plt.style.context("impactlab.house"):
        colours = plt.rcParams["axes.prop_cycle"].by_key()["color"]
        assert plt.rcParams["axes.spines.top"] is False
    assert tuple(colours) == PALETTE


def test_a_page_of_a_pile_has_its_head_and_its_loops() -> None:
    _, trace = traced("smith_pile", **{"solve.model": {"kind": "finite_element", "elements": 40, "mass": "lumped"}})
    assert names_of(trace) == ["pile_head", "loops"]
    found = {loop.name: loop for loop in applications.loops(trace.history, trace.history.scene)}
    assert list(found) == ["ram|helmet", "helmet|pile.left", "shaft", "toe"]
    link = next(each for each in trace.history.links if each.name == "toe")
    assert found["toe"].force.max() == pytest.approx(link.largest, rel=2e-3)
    # The loop of the toe closes with an empty spring: all of its area is lost.
    assert np.trapezoid(found["toe"].force, found["toe"].closing) == pytest.approx(link.loss, rel=5e-3)
    # The pieces of the shaft move differently: the sum of the forces over the mean of the closings is not their work.
    shaft, area = trace.history.links[0], np.trapezoid(found["shaft"].force, found["shaft"].closing)
    assert (shaft.name, shaft.pieces) == ("shaft", 15)
    assert 0.85 * shaft.loss < area < 0.97 * shaft.loss
    pile, all_loops = applications.of_laws_with_memory(trace, trace.history.scene)
    assert "Of shaft the sum of the forces of several contacts is shown" in all_loops.caption
    head = pile.draw()
    force = head.axes[0].lines[0].get_ydata()
    assert float(np.max(np.asarray(force))) == pytest.approx(4.0, rel=0.02)  # MN


def test_a_page_of_a_pile_under_a_measured_force_has_its_head() -> None:
    """Without hammer the force is the given one; the head is known from a probe of its velocity."""
    _, trace = traced("measured_head", **{"solve.model": {"kind": "finite_element", "elements": 40, "mass": "lumped"}})
    assert names_of(trace) == ["pile_head", "loops"]
    head = applications.of_laws_with_memory(trace, trace.history.scene)[0].draw()
    force, moved = (np.asarray(line.get_ydata()) for line in head.axes[0].lines[:2])
    assert float(np.max(force)) == pytest.approx(4.0098, rel=1e-3)  # MN, of the table
    assert float(np.max(moved)) == pytest.approx(1.6 * 2.51, rel=0.02)
    _, blind = traced("measured_head", probes=[])
    assert names_of(blind) == ["loops"], "no velocity of the head"


def test_a_page_of_a_specimen_has_the_curve_put_in_and_the_one_found() -> None:
    _, trace = traced("hopkinson_aluminium")
    figure = applications.of_laws_with_memory(trace, trace.history.scene)[0]
    assert figure.name == "specimen_2"
    assert "three waves" in figure.caption
    put_in, ran, found = figure.draw().axes[0].lines
    for line in (ran, found):
        strain, stress = (np.asarray(line.get_data()[k]) for k in (0, 1))
        loaded = (strain > 2.0) & (strain < 15.0) & (stress > 250.0)
        assert stress[loaded] == pytest.approx(300.0 + 500.0 * (strain[loaded] / 100.0 - 300.0 / 70e3), rel=1e-3)
    assert np.asarray(put_in.get_ydata())[:2] == pytest.approx([0.0, 300.0])


def test_a_specimen_without_gauges_has_no_curve_by_waves() -> None:
    _, trace = traced("hopkinson_aluminium", probes=[])
    figure = applications.of_laws_with_memory(trace, trace.history.scene)[0]
    assert "three waves" not in figure.caption
    assert len(figure.draw().axes[0].lines) == 2


def test_a_page_of_bars_alone_has_none_of_them() -> None:
    _, trace = traced("two_rods")
    assert names_of(trace) == []


def test_a_shaft_in_pieces_is_one_line_among_the_facts() -> None:
    history = traced("smith_pile", **{"solve.duration": 1e-3, "solve.model.elements": 40})[1].history
    words = dict(facts.scene_facts(history.scene, {link.name for link in history.links}))
    assert words["shaft"] == "15 pieces, pile.at(5.5) | ground to pile.at(19.5) | ground, joined from the start"
    assert words["toe"] == "pile.right | base, joined from the start"
    assert words["ram | helmet"] == "gap 0"


def test_a_case_in_a_notebook_and_the_page_of_a_fit_name_joined_contacts(tmp_path: Path) -> None:
    """Both gave a specimen between two bars "gap 0"."""
    case = il.load_case("hopkinson_aluminium")
    assert "joined from the start" in case._repr_html_()
    assert il.load_case("smith_pile")._repr_html_().count("joined from the start") == 2
    history, times = il.run(case), np.linspace(0.0, 5e-4, 60)
    signal = il.Signal("strain:transmission@0.75", times, history.evaluate(times, "strain:transmission@0.75"))
    il.fit(case, signal, {"bodies.striker.velocity": (6.0, 24.0)}).write(tmp_path)
    assert "joined from the start" in (tmp_path / "fit.html").read_text(encoding="utf-8")
