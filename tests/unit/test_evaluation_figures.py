"""Figures of evaluated runs: what they show, with units, and nothing where there is nothing."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import impactlab as il
from impactlab import drilling, granular, hopkinson, piling
from impactlab.errors import CaseError, ImpactlabError
from impactlab.report.facts import scene_facts


def pile(**settings: object) -> il.Case:
    """Return the bundled pile on a coarse mesh, for half of its time."""
    coarse = {"solve.model.elements": 40, "solve.duration": 0.05}
    return il.load_case("smith_pile").with_settings({**coarse, **settings})


@pytest.mark.filterwarnings("ignore::impactlab.DoubtfulResult")
def test_a_blow_and_its_bearing_graph_are_read_with_units_and_drawn() -> None:
    blow = piling.blow(pile())
    assert re.fullmatch(
        r"<Blow: set 11\.\d+ mm, 8\d\.\d+ blows per metre, compression 2\d\.\d+ MPa, "
        r"tension [67]\.\d+ MPa, transferred 37\.\d+ kJ>",
        repr(blow),
    )
    assert re.fullmatch(r"<Peak of 2\d\.\d+ MPa, .* MN, at x = .* m of 'pile', .* ms>", repr(blow.peak_compression))
    axis = blow.plot().axes[0]
    force = next(line for line in axis.lines if line.get_label() == "force  F")
    assert axis.get_ylabel() == "F and Zv at the head  [MN]"
    assert float(np.max(force.get_ydata())) == pytest.approx(1e-6 * blow.head.force.max())
    graph = piling.bearing_graph(pile(), [2.5e6, 0.9e6])  # in any order: the curve is drawn by capacity
    (line,) = graph.plot().axes[0].lines
    assert list(line.get_ydata()) == pytest.approx([0.9, 2.5])
    assert line.get_xdata()[0] == pytest.approx(graph.blows_per_metre[1])


@pytest.mark.filterwarnings("ignore::impactlab.DoubtfulResult")
def test_a_driving_is_drawn_blow_by_blow_with_the_forces_that_stay() -> None:
    driving = piling.drive(pile(), 2)
    motion, residual = driving.plot().axes
    head = next(line for line in motion.lines if line.get_label() == "head")
    assert list(head.get_ydata()) == pytest.approx([1e3 * each.head for each in driving.blows])
    assert residual.get_ylim() == (20.0, 0.0)  # the toe is below
    assert residual.get_xlabel() == "force left in the pile  [kN]"


def test_a_drill_is_drawn_while_the_bit_presses() -> None:
    case = il.load_case("drill_rod").with_settings({"solve.duration": "3 ms"})
    blow = drilling.blow(case)
    assert re.fullmatch(
        r"<Blow: work .* J, efficiency 0\.\d+ \(first pass 0\.\d+\), penetration .* mm, peak .* kN>", repr(blow)
    )
    loop, work = blow.plot().axes
    (line,) = loop.lines
    assert float(np.max(line.get_xdata())) == pytest.approx(1e3 * blow.deepest)
    assert float(np.min(line.get_xdata())) > -1e-3  # mm: not the flight before the first touch
    assert work.get_ylabel() == "work on the rock  [J]"
    curve = drilling.sweep(case, [1e7, 1e9])
    axis = curve.plot().axes[0]
    assert axis.get_xscale() == "log"
    assert list(axis.lines[0].get_ydata()) == pytest.approx(100.0 * curve.efficiency)


def test_the_waves_of_a_test_are_drawn_in_micrometres_per_metre() -> None:
    bar = hopkinson.Bar(diameter="20 mm", wave_speed=5000.0, density=8000.0, dispersion="none")
    wave = np.zeros(50)
    wave[10:30] = 1e-3
    test = hopkinson.Test(1e-6, bar, wave, -0.4 * wave, 0.6 * wave)
    waves, forces = test.plot().axes
    assert waves.get_ylabel() == "strain at the specimen  [µm/m]"
    assert float(np.max(waves.lines[1].get_ydata())) == pytest.approx(1000.0)
    assert forces.get_ylabel() == "force on the specimen  [kN]"
    front, back = forces.lines[1:]
    assert list(front.get_ydata()) == pytest.approx(list(back.get_ydata()))  # 1 - 0.4 = 0.6: in equilibrium


def test_the_bands_of_a_chain_of_one_and_of_two_masses_are_those_in_closed_form() -> None:
    k, m, force = 7.7e9, 4.1e-3, 20.0
    spring = 1.5 * k ** (2.0 / 3.0) * force ** (1.0 / 3.0)
    one = granular.bands(m, k, "20 N")
    assert one.frequency[0] == pytest.approx(np.sqrt(4.0 * spring / m) * np.sin(0.5 * one.phase) / (2.0 * math.pi))
    assert one.gaps == []
    light = 0.25 * m
    two = granular.bands([m, light], k, force)
    # Of two masses with equal springs: acoustic up to sqrt(2 s/M), optical from sqrt(2 s/m) to sqrt(2 s (1/m + 1/M)).
    edges = [math.sqrt(2.0 * spring / each) / (2.0 * math.pi) for each in (m, light, m * light / (m + light))]
    assert two.gaps == [pytest.approx((edges[0], edges[1]))]
    assert two.edges[1][1] == pytest.approx(edges[2])
    doubled = granular.bands([m, m], [k, k], force)  # the same chain with a cell of two beads has no gap
    assert doubled.gaps == []
    assert doubled.edges[1][1] == pytest.approx(one.edges[0][1])
    # Springs that differ open a gap between equal masses, sqrt(2 s1/m) to sqrt(2 s2/m).
    (gap,) = granular.bands([m, m], [k, 8.0 * k], force).gaps
    assert gap == pytest.approx(tuple(math.sqrt(2.0 * each / m) / (2.0 * math.pi) for each in (spring, 4.0 * spring)))
    axes = two.plot().axes[0]
    assert len(axes.patches) == 1
    assert [text.get_text() for text in axes.texts] == [
        f"no waves from {1e-3 * edges[0]:.3g} to {1e-3 * edges[1]:.3g} kHz"
    ]


@pytest.mark.parametrize(
    ("masses", "stiffnesses", "force", "said"),
    [
        ([1.0, 2.0, 3.0], [1.0, 2.0], 1.0, r"masses of shape \(3,\) and stiffnesses of shape \(2,\)"),
        ([1.0, -2.0], 1.0, 1.0, r"masses\[1\] -2 is out of range"),
        (1.0, 1.0, 0.0, "force 0 is out of range"),
        (1.0, 1.0, "3 m", "force: "),
    ],
)
def test_cells_that_are_none_are_refused(masses: object, stiffnesses: object, force: object, said: str) -> None:
    with pytest.raises(ImpactlabError, match=said):
        granular.bands(masses, stiffnesses, force)  # type: ignore[arg-type]


def test_a_row_of_beads_is_drawn_in_place_and_time() -> None:
    case = il.Case(
        bodies={"striker": il.Mass("4.11 g", velocity=1.0), "bead": il.Mass("4.11 g", repeat=40)},
        contacts=[il.Chain(["striker", "bead"], {"kind": "hertz", "stiffness": 7.69e9})],
        solve={"duration": "0.7 ms", "integrator": {"kind": "central_difference"}, "step": {"dt": "0.5 us"}},
    )
    history = il.run(case)
    axis = history.plot_xt().axes[0]
    (image,) = axis.images
    cells = np.asarray(image.get_array())
    assert cells.shape == (500, 40)
    # The wave runs to the right: the largest force of contact 30 is later than that of contact 10, by 20 contacts.
    wave = granular.leading_wave(history)
    late = 0.7e-3 / 500 * float(np.argmax(cells[:, 29]) - np.argmax(cells[:, 9]))
    assert late == pytest.approx(wave.times[29] - wave.times[9], rel=0.02)
    assert axis.get_xlabel() == "number of the contact"
    assert float(cells.max()) == pytest.approx(wave.forces.max(), rel=0.02)


def test_of_a_pressed_chain_the_changes_of_force_are_drawn() -> None:
    overlap = (20.0 / 7.69e9) ** (2.0 / 3.0)  # m, of 20 N
    bodies = {
        "left": il.Wall(),
        "bead": il.Mass("4 g", velocity={"each": [0.01] + [0.0] * 7}, repeat=8),
        "right": il.Wall(),
    }
    law = {"kind": "hertz", "stiffness": 7.69e9}
    chain = il.Chain(["left", "bead", "right"], law, gap=-overlap, overlap="allowed")
    solve = {"duration": "0.1 ms", "integrator": {"kind": "central_difference"}, "step": {"dt": "0.5 us"}}
    figure = il.run(il.Case(bodies=bodies, contacts=[chain], solve=solve)).plot_xt()
    cells = np.asarray(figure.axes[0].images[0].get_array())
    # Each bead of mass m between springs k_t: the one at 0.01 m/s changes the forces beside it by 0.01 sqrt(k_t m)
    # at most, the left one downwards.
    impedance = math.sqrt(1.5 * 7.69e9 ** (2.0 / 3.0) * 20.0 ** (1.0 / 3.0) * 4e-3)
    assert -0.01 * impedance < cells.min() < -0.3 * 0.01 * impedance
    assert np.unravel_index(int(np.argmin(cells)), cells.shape)[1] == 0
    assert float(np.abs(cells[0, 4:]).max()) < 1e-9
    assert any("change of contact force" in axis.get_ylabel() for axis in (figure.axes[0], *figure.axes[0].child_axes))


def test_a_pulse_that_is_narrower_than_a_cell_is_not_lost() -> None:
    """A row of 600 contacts has cells of two contacts and four instants: each wave front is in one of them."""
    case = il.Case(
        bodies={"striker": il.Mass("4.11 g", velocity=1.0), "bead": il.Mass("4.11 g", repeat=600)},
        contacts=[il.Chain(["striker", "bead"], {"kind": "hertz", "stiffness": 7.69e9})],
        solve={
            "duration": "9 ms", "integrator": {"kind": "central_difference"}, "step": {"dt": "1 us"}, "records": 9000,
        },
    )  # fmt: skip
    history = il.run(case)
    cells = np.asarray(history.plot_xt().axes[0].images[0].get_array())
    assert cells.shape == (500, 301 - 1)
    assert float(cells.max(axis=0)[20:-20].min()) > 0.9 * float(np.median(cells.max(axis=0)))
    assert len(history.plot().axes[0].lines) == 40  # of the 600 forces


def test_a_bore_takes_its_circle_out_of_the_section() -> None:
    def area(**section: object) -> float:
        bodies = {"rod": il.Rod(length="1 m", material="steel", velocity=1.0, **section), "wall": il.Wall()}
        solve = {"duration": "0.1 ms", "tolerance": 1e-3}
        case = il.Case(bodies=bodies, contacts=[il.Contact("rod.right", "wall")], solve=solve)
        return float(case.scene().bodies["rod"].segments[0].area)  # type: ignore[attr-defined]

    assert area(diameter="40 mm", bore="30 mm") == pytest.approx(math.pi / 4.0 * (0.04**2 - 0.03**2), rel=1e-14)
    with pytest.raises(CaseError, match=r"a bore of 0\.04 m in a diameter of 0\.04 m leaves no section"):
        area(diameter="40 mm", bore="40 mm")
    with pytest.raises(CaseError, match="bore given, which does not make the section of a rod"):
        area(bore="40 mm")
    with pytest.raises(CaseError, match=r"'inner_diameter' is not known here\. Did you mean 'bore'"):
        area(diameter="40 mm", inner_diameter="30 mm")


def test_a_signal_is_resampled_at_equal_instants() -> None:
    times = np.array([0.0, 1.1, 1.9, 3.0, 4.0, 5.2]) * 1e-6
    signal = il.Signal("strain:bar@0.5", times, 2.0 * times)
    equal = signal.resampled("1 us")
    assert equal.time == pytest.approx(1e-6 * np.arange(6))
    assert equal.values == pytest.approx(2e-6 * np.arange(6))  # of a straight line exactly
    assert equal.interval == pytest.approx(1e-6)
    assert signal.resampled().interval == pytest.approx(signal.width)
    with pytest.raises(CaseError, match=r"the intervals between samples are not equal.*\n.*signal\.resampled"):
        _ = il.Signal("strain:bar@0.5", [0.0, 1.0, 2.0, 2.4, 4.0, 5.0], np.zeros(6)).interval
    with pytest.raises(CaseError, match=r"an interval of 0\.001 s in a record of 5\.2e-06 s"):
        signal.resampled(1e-3)
    with pytest.raises(ImpactlabError, match="interval is"):
        signal.resampled(0.0)


def test_numbered_masses_that_differ_are_one_line_of_a_page() -> None:
    case = il.Case(
        bodies={
            "striker": il.Mass("4 g", velocity=1.0),
            "bead": il.Mass("2e-3*(1 + i % 2)", repeat=9),
            "wall": il.Wall(),
        },
        contacts=[il.Chain(["striker", "bead", "wall"], {"kind": "hertz", "stiffness": 7.69e9})],
        solve={"duration": "0.2 ms", "integrator": {"kind": "central_difference"}, "step": {"dt": "0.5 us"}},
    )
    words = {name: text.replace("\xa0", " ") for name, text in scene_facts(case.scene())}
    assert words["striker"] == "rigid mass, 4 g, 1 m/s"
    assert words["bead_1 to bead_9"] == "rigid masses, 2 g to 4 g, at rest"
    assert words["wall"] == "rigid wall"


def test_a_chain_in_front_of_a_bar_is_drawn_by_its_contacts() -> None:
    case = il.Case(
        bodies={
            "striker": il.Mass("4 g", velocity=1.0),
            "bead": il.Mass("4 g", repeat=8),
            "bar": il.Rod(length="0.2 m", diameter="10 mm", material="steel"),
        },
        contacts=[il.Chain(["striker", "bead", "bar"], {"kind": "hertz", "stiffness": 7.69e9})],
        solve={
            "duration": "0.2 ms",
            "model": {"kind": "finite_element", "elements": 20, "mass": "lumped"},
            "integrator": {"kind": "central_difference"},
            "step": {"dt": "0.5 us"},
        },
    )
    history = il.run(case)
    assert history.plot_xt().axes[0].get_xlabel() == "number of the contact"
