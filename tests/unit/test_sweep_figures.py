"""Figures of sweeps: contacts without values, many contacts, and axes of laws and other blocks."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import impactlab as il
from impactlab.report.figures.style import PALETTE
from impactlab.sweeps.plots import EDGES, HATCH
from impactlab.sweeps.value_names import MAX_LETTERS, words_of
from tests.support import CASES

HERTZ, SOFT = {"kind": "hertz", "stiffness": 1e9}, {"kind": "hertz", "stiffness": 1e8}
PENALTY = {"kind": "penalty", "stiffness": 1e7}
MASS, LAW = "bodies.ball.mass", "contacts.0.law"


@pytest.fixture(scope="module")
def pile():
    case = il.load_case(CASES / "smith_pile.yaml").with_("solve.model", {"kind": "finite_element", "elements": 40})
    return il.sweep(case, {"bodies.ram.mass": [4000.0, 5000.0, 6000.0]}, quantities=["peak_force", "impulse"])


@pytest.fixture(scope="module")
def ball():
    return il.Case.from_dict(
        {
            "bodies": {"ball": il.Mass(0.01, velocity=1.0), "wall": {"kind": "wall"}},
            "contacts": [{"between": ["ball", "wall"], "gap": "1 mm", "law": HERTZ}],
            "solve": {"duration": 3e-3, "integrator": {"kind": "central_difference"}, "step": {"dt": 1e-6}},
        }
    )


def test_contacts_without_values_are_left_out(pile):
    axes = il.plot_sweep(pile, "peak_force").axes[0]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["ram|helmet", "helmet|pile.left"]
    assert len(axes.lines) == 2
    assert axes.lines[1].get_ydata()[0] * 1e6 == pytest.approx(pile["peak_force"].values[0, 1])


def test_the_legend_of_many_contacts_stands_inside_the_figure_and_counts_the_others(pile):
    figure = il.plot_sweep(pile, "impulse")
    axes = figure.axes[0]
    texts = [text.get_text() for text in axes.get_legend().get_texts()]
    total = pile["impulse"].shape[1]
    assert total == 18
    assert len(texts) == len(PALETTE) + 1
    assert texts[-1] == f"... {total - len(PALETTE)} more"
    assert {"ram|helmet", "pile.right|base"} <= set(texts)
    curves = {line.get_label(): line for line in axes.lines}
    number = pile["contact"].values.tolist().index("pile.right|base")
    assert curves["pile.right|base"].get_ydata() * 1e3 == pytest.approx(pile["impulse"].values[:, number])
    assert sum(line.get_linewidth() < 1.0 for line in axes.lines) == total - len(PALETTE)
    FigureCanvasAgg(figure).draw()
    box = axes.get_legend().get_window_extent()
    assert box.y1 <= figure.bbox.y1
    assert box.y0 >= axes.get_window_extent().y1 - 1.0


def test_axes_whose_values_are_unsorted_or_repeated_are_drawn_in_order(ball, tmp_path):
    """The sweep keeps the order that is given; its figures and the marks of the page stand at the values."""
    masses, gaps = [0.03, 0.002, 0.01, 0.002], ["2 mm", "0 mm", "1 mm"]
    found = il.sweep(ball, {MASS: masses, "contacts.0.gap": gaps}, quantities=["impulse"], out=tmp_path)
    assert found[MASS].values.tolist() == masses
    line = il.plot_sweep(found.isel({"contacts.0.gap": 1}), "impulse").axes[0]
    assert np.all(np.diff(line.lines[0].get_xdata()) > 0.0)
    low, high = line.get_xlim()
    assert low < line.lines[0].get_xdata()[0] < line.lines[0].get_xdata()[-1] < high
    panel = il.plot_sweep(found, "impulse").axes[0]
    assert np.all(np.diff([*panel.get_xlim()]) > 0.0)
    assert np.all(np.diff([*panel.get_ylim()]) > 0.0)
    [mesh] = panel.collections
    expected = found["impulse"].values[np.ix_([1, 2, 0], [1, 2, 0])][:, :, 0]
    drawn = np.asarray(mesh.get_array()).reshape(3, 3).T
    assert drawn / drawn.max() == pytest.approx(expected / expected.max())
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    along = [json.loads(each) for each in re.findall(r'"along":(\[[^]]*\])', page)]
    assert [np.argsort(shares, kind="stable").tolist() for shares in along] == [[1, 3, 2, 0], [1, 2, 0]]
    assert all(0.0 < share < 1.0 for shares in along for share in shares)


def test_an_axis_with_one_value_twice_is_a_point(ball, tmp_path, recwarn):
    found = il.sweep(ball, {MASS: [0.01, 0.01]}, quantities=["impulse"], out=tmp_path)
    assert len(il.plot_sweep(found, "impulse").axes[0].lines[0].get_xdata()) == 1
    assert not [each for each in recwarn if "singular" in str(each.message) or "invalid value" in str(each.message)]


def test_a_sweep_without_any_value_is_still_drawn(pile):
    empty = pile.copy(deep=True)
    empty["peak_force"].values[:] = np.nan
    axes = il.plot_sweep(empty, "peak_force").axes[0]
    assert len(axes.lines) == 1
    assert [patch.get_hatch() for patch in axes.patches] == [HATCH]  # one over all points


def test_points_of_a_map_that_ended_without_a_value_are_hatched(ball):
    found = il.sweep(ball, {MASS: [0.01, 0.02, 0.03], "contacts.0.gap": [0.0, 1e-3]}, quantities=["peak_force"])
    (axes, _) = il.plot_sweep(found, "peak_force").axes
    assert not any(patch.get_hatch() for patch in axes.patches)
    found["peak_force"].values[1:, 0] = np.nan
    (axes, _) = il.plot_sweep(found, "peak_force").axes
    (patch,) = [patch for patch in axes.patches if patch.get_hatch()]
    assert patch.get_path().get_extents().bounds == pytest.approx((0.015, -0.5, 0.02, 1.0))  # kg, mm: two of six cells


def test_an_axis_of_laws_has_their_kinds_and_its_path(ball):
    found = il.sweep(ball, {LAW: [HERTZ, PENALTY]}, quantities=["peak_force"])
    figure = il.plot_sweep(found, "peak_force")
    axes = figure.axes[0]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["hertz", "penalty"]
    assert axes.get_xlabel() == LAW
    FigureCanvasAgg(figure).draw()
    assert axes.xaxis.label.get_window_extent().y0 >= 0.0


def test_long_words_below_a_line_stay_inside_the_figure():
    rod = il.Rod(length=1.0, diameter=0.02, material="steel", ends={"left": {"force": 0.0}})
    solve = {"model": {"kind": "finite_element", "elements": 4}, "integrator": {"kind": "newmark"}}
    case = il.Case(bodies={"rod": rod}, solve={"duration": 1e-5, "step": {"dt": 1e-6}, **solve})
    formulas = [f"1e5*sin(2*pi*{1000 + number}*t)*exp(-100*t)" for number in range(20)]
    found = il.sweep(case, {"bodies.rod.ends.left.force": formulas}, quantities=["final_velocity"])
    figure = il.plot_sweep(found, "final_velocity")
    FigureCanvasAgg(figure).draw()
    assert all(label.get_window_extent().x0 >= 0.0 for label in figure.axes[0].get_xticklabels())


def test_edges_between_nearly_all_points_are_left_out(ball):
    found = il.sweep(ball, {MASS: np.linspace(0.01, 0.02, 40)}, quantities=["peak_force", "contacts"])
    found["contacts"].values[:, 0] = np.arange(40)
    assert len(il.plot_sweep(found, "peak_force").axes[0].lines) == 1
    found["contacts"].values[:, 0] = np.arange(40) // 20
    assert len(il.plot_sweep(found, "peak_force").axes[0].lines) == 2


@pytest.mark.parametrize("turned", [False, True])
def test_maps_over_laws_show_parameters_of_equal_kinds_inside_the_figure(ball, turned):
    over = {LAW: [HERTZ, SOFT, PENALTY], MASS: [0.01, 0.02]}
    found = il.sweep(ball, dict(reversed(over.items())) if turned else over, quantities=["peak_force"])
    figure = il.plot_sweep(found, "peak_force")
    axes = figure.axes[0]
    ticks = axes.get_yticklabels() if turned else axes.get_xticklabels()
    assert [tick.get_text() for tick in ticks] == ["hertz\nstiffness 1e9", "hertz\nstiffness 1e8", "penalty"]
    FigureCanvasAgg(figure).draw()
    for text in (*ticks, axes.xaxis.label, axes.yaxis.label):
        box = text.get_window_extent()
        assert min(box.x0, box.y0) >= 0.0, text
    if turned:
        assert axes.yaxis.label.get_window_extent().x1 <= min(tick.get_window_extent().x0 for tick in ticks)
    else:
        assert axes.xaxis.label.get_window_extent().y1 <= min(tick.get_window_extent().y0 for tick in ticks)


def test_many_long_words_are_tilted_inside_the_figure():
    case = il.load_case(CASES / "axial_impact.yaml")
    names = ["continuous", "finite_element", "addition_deletion", "impulse_momentum", "penalty_fe", "penalty"]
    figure = il.plot_sweep(il.sweep(case, {"method": names}, quantities=["impulse"]), "impulse")
    axes = figure.axes[0]
    FigureCanvasAgg(figure).draw()
    assert all(tick.get_window_extent().y0 > axes.xaxis.label.get_window_extent().y1 for tick in axes.get_xticklabels())
    assert axes.xaxis.label.get_window_extent().y0 >= 0.0


def test_counts_that_are_all_alike_have_whole_ticks(ball):
    """The axis of one contact at every point had ticks such as 0.975."""
    found = il.sweep(ball, {MASS: [0.01, 0.02, 0.03]}, quantities=["contacts"])
    ticks = il.plot_sweep(found, "contacts").axes[0].get_yticks()
    assert np.all(found["contacts"] == 1.0)
    assert np.array_equal(ticks, np.round(ticks))


def test_words_of_values():
    blocks = [HERTZ, {**HERTZ, "exponent": 2.0}, PENALTY, {"kind": "mass", "left": {"kind": "free"}}]
    assert words_of([json.dumps(block) for block in blocks]) == ("hertz", "hertz\nexponent 2", "penalty", "mass")
    assert words_of([json.dumps(HERTZ)] * 2 + ["base"]) == ("hertz (1)", "hertz (2)", "base")
    assert words_of(["{not json", True]) == ("{not json", "True")
    nested = [json.dumps({"kind": "rod", "left": {"kind": end}}) for end in ("free", "fixed")]
    assert words_of(nested) == ("rod\nleft free", "rod\nleft fixed")
    assert (
        max(len(line) for word in words_of([json.dumps({"kind": "a" * 99}), "b" * 99]) for line in [word])
        == MAX_LETTERS
    )
    assert words_of([json.dumps([1, 2])]) == ("[1, 2]",)


def test_the_name_and_the_unit_of_a_quantity_stand_inside_the_figure(ball):
    """That of the largest forces is long: it was cut at both ends."""
    found = il.sweep(ball, {MASS: [0.01, 0.02]}, quantities=["largest_force", "contact_loss", "near_grazing"])
    for quantity in ("largest_force", "contact_loss", "near_grazing"):
        figure = il.plot_sweep(found, quantity)
        FigureCanvasAgg(figure).draw()
        label = figure.axes[0].yaxis.label.get_window_extent()
        assert figure.bbox.y0 < label.y0 < label.y1 < figure.bbox.y1, quantity
        assert figure.bbox.x0 < label.x0, quantity
    assert il.plot_sweep(found, "largest_force").axes[0].get_ylabel().endswith("[N]")


def test_lines_between_sequences_of_contacts_are_in_the_legend(ball):
    """The ball reaches the wall in the last three of the runs only."""
    found = il.sweep(ball, {"bodies.ball.velocity": [0.1, 0.2, 0.5, 1.0, 2.0]}, quantities=["contacts", "impulse"])
    assert found["contacts"].values.ravel().tolist() == [0, 0, 1, 1, 1]
    axes = il.plot_sweep(found, "impulse").axes[0]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["ball|wall", EDGES]
    within = found.isel({"bodies.ball.velocity": slice(2, None)})
    axes = il.plot_sweep(within, "impulse").axes[0]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["ball|wall"]
