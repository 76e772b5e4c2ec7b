"""Figures of contacts on a page: links that pull, pieces of one name, many contacts, short contacts in long runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import impactlab as il
from impactlab.history.base import AbstractHistory
from impactlab.report import page_figures
from impactlab.report.figures import overview, plots, signals
from impactlab.report.figures.named_contacts import MAX_FIGURES, view_of, with_figures, words_on_figures
from impactlab.report.figures.style import LABEL, MAX_LABELS, PALETTE, Trace, labelled, traces
from tests.solving import in_steps
from tests.support import invoke

PILE = Path(__file__).parents[2] / "cases" / "smith_pile.yaml"
COARSE = {"kind": "finite_element", "elements": 40, "mass": "lumped"}
BOUNCE = {
    "bodies": {"ball": il.Mass(0.01, velocity=1.0), "wall": {"kind": "wall"}},
    "contacts": [{"between": ["ball", "wall"], "gap": "1 mm", "law": {"kind": "hertz", "stiffness": 1e9}}],
    "solve": {"duration": 3e-3, "integrator": {"kind": "central_difference"}, "step": {"dt": 1e-6}},
}
IMPULSE = {"kind": "impulse_momentum", "restitution": 0.8}


@pytest.fixture(scope="module")
def pile() -> AbstractHistory:
    return il.run(il.load_case(PILE).with_("solve.model", COARSE))


@pytest.fixture(scope="module")
def chain() -> AbstractHistory:
    return il.run(chain_of(30))


def chain_of(beads: int) -> il.Case:
    return il.Case(
        bodies={"striker": il.Mass(4e-3, velocity=1.0), "bead": il.Mass(4e-3, repeat=beads)},
        contacts=[il.Chain(["striker", "bead"], {"kind": "hertz", "stiffness": 7.7e9})],
        solve=in_steps(5e-4, "central_difference", dt=2e-7),
    )


def of_run(history: AbstractHistory) -> list[page_figures.PageFigure]:
    return page_figures.of_run(Trace("laws", history, PALETTE[0]), history.scene)


def test_a_force_that_pulls_is_drawn_to_its_least_value(pile: AbstractHistory) -> None:
    figure = plots.force([Trace("smith", pile, PALETTE[0])], pile.scene, "shaft")
    axes = figure.axes[0]
    drawn = np.asarray(axes.lines[0].get_ydata())
    link = next(each for each in pile.links if each.name == "shaft")
    assert link.smallest < -1e5
    assert drawn.min() == pytest.approx(link.smallest / 1e3, rel=1e-3)  # kN
    assert axes.get_ylim()[0] < drawn.min()
    assert axes.get_ylim()[1] > drawn.max()
    toe = plots.force([Trace("smith", pile, PALETTE[0])], pile.scene, "toe").axes[0]
    low, high = toe.get_ylim()
    assert low == pytest.approx(-0.04 * high)  # it never pulls


def test_a_method_that_is_cut_below_is_labelled_with_its_lowest_value(pile: AbstractHistory) -> None:
    strong = _scaled(pile, 3.0)
    shown = [Trace("strong", strong, PALETTE[0], reference=pile)]
    axes = plots.force(shown, pile.scene, "shaft").axes[0]
    texts = [text.get_text() for text in axes.texts]
    assert any(text.startswith("down to \N{MINUS SIGN}") for text in texts), texts
    assert any(text.startswith("spikes up to") for text in texts), texts


def _scaled(history: AbstractHistory, factor: float) -> AbstractHistory:
    """Return a history whose forces are larger."""

    class Scaled(type(history)):  # type: ignore[misc]
        def __init__(self) -> None:
            self.__dict__.update(history.__dict__)

        def evaluate(self, t, channel):  # type: ignore[no-untyped-def]
            return history.evaluate(t, channel) * (factor if channel.startswith("force:") else 1.0)

    return Scaled()


def test_pieces_of_one_name_share_a_figure_and_links_have_no_gap(pile: AbstractHistory) -> None:
    made = of_run(pile)
    assert [figure.title for figure in made if figure.name.startswith("force_")] == [
        "Contact force, ram|helmet",
        "Contact force, helmet|pile.left",
        "Contact force, shaft",
        "Contact force, toe",
    ]
    assert [figure.name for figure in made if figure.name.startswith("gap")] == ["gap_1", "gap_2"]
    shaft = next(figure for figure in made if figure.title.endswith("shaft"))
    assert shaft.caption.startswith("The sum of 15 pieces.")
    axes = shaft.draw().axes[0]
    assert (axes.get_title("left"), axes.get_title("right")) == ("shaft", "smith")


def test_a_run_read_from_a_file_has_the_same_figures(pile: AbstractHistory, tmp_path: Path) -> None:
    pile.to_netcdf(tmp_path / "pile.nc")
    again = il.open_netcdf(tmp_path / "pile.nc")
    assert [figure.name for figure in of_run(again)] == [figure.name for figure in of_run(pile)]
    assert [contact.linked for contact in with_figures([again])] == [False, False, True, True]


def test_a_name_of_a_contact_serves_in_an_exact_run() -> None:
    history = il.run(il.load_case("axial_impact").with_("contacts.0.name", "head").method("continuous"))
    (force, gap) = (figure.draw() for figure in of_run(history) if figure.name in ("force", "gap"))
    assert force.axes[0].get_title("left") == gap.axes[0].get_title("left") == "head"
    assert np.max(force.axes[0].lines[0].get_ydata()) == pytest.approx(78.28, rel=1e-3)  # kN


def test_the_live_page_shows_the_contacts_that_have_figures(pile: AbstractHistory) -> None:
    panels = signals.panels([Trace("laws", pile, PALETTE[0])], pile.scene, compared=False)
    (forces,) = (panel for panel in panels if panel.group == "force")
    assert [line.name for line in forces.lines] == ["ram | helmet", "helmet | pile.left", "shaft", "toe"]
    (gaps,) = (panel for panel in panels if panel.group == "gap")
    assert [line.name for line in gaps.lines] == ["ram | helmet", "helmet | pile.left"]


def test_of_many_contacts_the_first_the_last_and_the_largest_have_figures(chain: AbstractHistory) -> None:
    chosen = with_figures([chain])
    numbers = [each.number for each in chosen]
    assert len(numbers) == MAX_FIGURES
    assert numbers == sorted(set(numbers))
    assert (numbers[0], numbers[-1]) == (1, 30)
    assert max(np.diff(numbers)) <= 5  # forces that are alike: spread over the row
    assert words_on_figures([chain], "history.npz has all").startswith("12 of 30: the first, the last and those")
    assert sum(figure.name.startswith("force_") for figure in of_run(chain)) == MAX_FIGURES
    heavy = il.run(chain_of(30).with_("bodies.bead.mass", {"each": [4e-3 if i < 20 else 4e-2 for i in range(30)]}))
    forces = {
        number: float(heavy.largest(f"force:{each.name}")) for number, each in enumerate(heavy.scene.contacts, start=1)
    }
    largest = max(list(forces)[1:-1], key=forces.__getitem__)
    assert largest in [each.number for each in with_figures([heavy])]


def test_a_few_contacts_all_have_figures(pile: AbstractHistory) -> None:
    assert len(with_figures([pile])) == 4
    assert words_on_figures([pile], "") == ""


def test_a_page_of_many_contacts_names_the_file_of_the_others(tmp_path: Path) -> None:
    file = tmp_path / "chain.yaml"
    file.write_text(chain_of(20).to_yaml(), encoding="utf-8")
    done = invoke("run", str(file), "--out", str(tmp_path / "out"))
    assert done.exit_code == 0, done.output
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "12 of 20: the first, the last and those of the largest force between; history.npz has all" in page


def test_a_short_contact_in_a_long_run_is_drawn_large() -> None:
    history = il.run(il.Case.from_dict(BOUNCE))
    (span,) = history.contacts
    assert span.end is not None
    length = span.end - span.start
    axes = plots.force([Trace("hertz", history, PALETTE[0])], history.scene, "ball|wall").axes[0]
    low, high = (1e-3 * each for each in axes.get_xlim())
    assert low == pytest.approx(span.start - 0.5 * length, abs=0.03 * length)
    assert high == pytest.approx(span.end + 0.5 * length, abs=0.03 * length)
    assert axes.get_xlabel() == "time  t  [ms]  (run: 3 ms)"
    assert np.max(axes.lines[0].get_ydata()) == pytest.approx(span.peak_force, rel=1e-3)
    inside = (np.asarray(axes.lines[0].get_xdata()) > 1e3 * span.start) & (
        np.asarray(axes.lines[0].get_xdata()) < 1e3 * span.end
    )
    assert inside.sum() > 100  # a curve, not a needle


def test_methods_that_are_compared_share_the_view_and_many_contacts_are_shown_whole(pile: AbstractHistory) -> None:
    case = il.Case.from_dict(BOUNCE)
    histories = {"hertz": il.run(case), "kicks": il.run(case.with_("contacts.0.law", IMPULSE))}
    figure = plots.force(traces(histories, {"kicks": histories["hertz"]}), histories["hertz"].scene, "ball|wall")
    assert len({axes.get_xlim() for axes in figure.axes}) == 1
    assert figure.axes[1].get_title("right") == "one kick of 18 mN s"
    values, edges, _ = figure.axes[1].patches[0].get_data()  # type: ignore[attr-defined]
    assert np.sum(values * np.diff(edges)) == pytest.approx(0.018 / 1e-3, rel=1e-3)  # N ms
    assert view_of([pile], "helmet|pile.left", 0.1) == (0.0, 0.1)
    assert view_of([pile], "shaft", 0.1) == (0.0, 0.1)


def test_a_contact_that_never_closes_is_drawn_over_the_whole_run() -> None:
    history = il.run(il.Case.from_dict(BOUNCE).with_("contacts.0.gap", "10 mm"))
    axes = plots.force([Trace("hertz", history, PALETTE[0])], history.scene, "ball|wall").axes[0]
    assert axes.get_xlim() == (0.0, 3.0)
    assert axes.get_xlabel() == "time  t  [ms]"


def test_the_slow_front_of_a_wave_is_no_contact_that_fills_the_run(chain: AbstractHistory) -> None:
    start, end = view_of([chain], chain.scene.contacts[-1].name, chain.duration)
    assert end - start < 0.25 * chain.duration
    assert start > 0.6 * chain.duration


def test_a_converged_reference_is_not_called_exact(pile: AbstractHistory) -> None:
    shown = [Trace("base", pile, PALETTE[0], reference=pile)]
    figure = overview.contacts(shown, pile.scene)
    assert [axes.get_title("left") for axes in figure.axes] == ["ram | helmet", "helmet | pile.left"]  # no links
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["converged", "base"]
    document = {"rows": [{"name": "base", "summary": {"errors": None}}]}
    captions = " ".join(figure.caption for figure in page_figures.of_comparison(document, shown, pile.scene))
    assert "converged closings and openings" in captions
    assert "exact" not in captions


def test_a_comparison_names_the_contact_of_its_forces(pile: AbstractHistory) -> None:
    shown = traces({"one": pile, "two": pile})
    assert plots.force(shown, pile.scene, "shaft").texts[0].get_text() == "shaft"


def test_of_many_curves_those_furthest_apart_have_names(pile: AbstractHistory) -> None:
    figure = next(figure for figure in of_run(pile) if figure.name == "displacement")
    figure = figure.draw()
    axes = figure.axes[0]
    names = [text.get_text() for text in axes.texts]
    assert len(names) == MAX_LABELS
    assert {"ram", "helmet", "pile at 0 mm"} <= set(names)
    assert len(axes.lines) > MAX_LABELS
    thin = [line for line in axes.lines if line.get_linewidth() < 1.0]
    assert len(thin) == len(axes.lines) - MAX_LABELS
    heights = sorted(text.xyann[1] for text in axes.texts)  # type: ignore[attr-defined]
    assert 0.0 <= heights[0] <= heights[-1] <= 1.0  # of the axes
    inches = figure.get_figheight() * axes.get_position().height
    assert min(np.diff(heights)) * inches * 72.0 >= 1.2 * LABEL


def test_labelled_curves() -> None:
    assert labelled([np.zeros(3)] * 4, 4) == [0, 1, 2, 3]
    curves = [np.full(3, value) for value in (0.0, 0.1, 5.0, 0.2, 10.0, 9.9)]
    assert labelled(curves, 3) == [0, 2, 4]
    assert labelled([np.zeros(2)] * 20, 5) == [0, 1, 2, 3, 4]  # curves that are one have each a name once


def test_the_figure_of_gaps_names_its_contact() -> None:
    history = il.run(il.Case.from_dict(BOUNCE))
    figure = plots.gap([Trace("hertz", history, PALETTE[0])], history.scene, "ball|wall")
    assert [axes.get_title("left") for axes in figure.axes] == ["ball | wall", "near zero"]
