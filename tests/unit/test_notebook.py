"""How cases, runs and comparisons show themselves, and the figures and films that they give."""

from __future__ import annotations

import itertools
import shutil
import subprocess
import sys
import warnings
from html.parser import HTMLParser
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import impactlab as il
from impactlab.errors import ImpactlabError
from impactlab.history.base import ContactSpan
from impactlab.report.figures import animation, film_files
from tests.support import CASES, invoke


class Outline(HTMLParser):
    """The texts of a piece of HTML, and whether its tags close."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


@pytest.fixture(scope="module")
def case() -> il.Case:
    return il.load_case(CASES / "axial_impact.yaml")


def words_of(shown: str) -> str:
    outline = Outline(shown)
    assert outline.open == []
    assert "http" not in shown.replace("http://www.w3.org/", "")
    return " ".join(outline.words)


def test_a_case_shows_its_bodies(case: il.Case) -> None:
    text = words_of(case._repr_html_())
    assert "Axial impact of a rigid mass" in text
    assert "rigid mass, 2.133" in text
    assert "impulse_momentum" in text
    assert repr(case) == "<Case 'axial_impact': hammer (mass), rod (rod); 1 contact, 0.000349121 s>"


def test_a_run_shows_figure_contacts_and_warnings(case: il.Case) -> None:
    shown = il.run(case.method("continuous"))._repr_html_()
    text = words_of(shown)
    assert "method continuous" in text
    assert "78.28" in text.replace("\N{NO-BREAK SPACE}", " ")  # kN, the largest force
    assert "near_grazing" in text
    assert shown.count("<svg") == 2  # the sketch and the signals


def test_a_doubtful_run_shows_its_warning_first(case: il.Case) -> None:
    history = il.run(case)
    history.warnings.append(il.run(case).warnings[0]._replace(code="energy_gain", text="energy <grew>"))
    text = words_of(history._repr_html_())
    assert text.index("energy_gain: energy <grew>") < text.index("duration")


def test_a_period_of_contact_is_printed_shortly() -> None:
    ended = ContactSpan("a|b", 0.0, 1.7794689117595018e-4, 1.248823594983464, 27237.79534827643)
    assert repr(ended) == "ContactSpan('a|b', start=0 s, end=177.9 µs, impulse=1.249 N s, peak_force=27.24 kN)"
    open_yet = ContactSpan("a|b", 1e-6, None, 2.0, None, 1.0, 3)
    assert repr(open_yet) == "ContactSpan('a|b', start=1 µs, end=None, impulse=2 N s, peak_force=None, kicks=3)"


def test_a_comparison_shows_its_table(case: il.Case) -> None:
    made = il.compare(case, ["continuous", "modal_10", "penalty"])
    text = words_of(made._repr_html_())
    assert all(name in text for name in ("modal_10", "penalty", "first opening"))
    assert repr(made).splitlines()[0] == "<Comparison of 'axial_impact', errors against the exact solution"
    assert len(repr(made).splitlines()) == 4
    assert len(made.plot().axes) >= 6
    table = made.to_pandas()
    assert list(table.index) == ["continuous", "modal_10", "penalty"]
    assert table["impulse"]["continuous"] == 0.0 < table["impulse"]["modal_10"] < 0.01
    assert table["steps"]["modal_10"] * table["dt"]["modal_10"] == pytest.approx(made.histories["modal_10"].duration)


def test_a_comparison_of_rods_shows_the_error_of_their_faces() -> None:
    """Without a mass no error was shown."""
    made = il.compare(il.load_case("two_rods"), ["base"])
    error = made.rows[0].summary["errors"]["face_displacement"]
    assert repr(made).splitlines()[1] == f"  base: completed, error {error:.3g}>"


def test_figures_of_a_run() -> None:
    case = il.load_case(CASES / "hopkinson_chain.yaml")
    history = il.run(case, frames=240)
    signals = history.plot()
    assert [axes.get_title("left") for axes in signals.axes] == ["Stress", "Contact force", "Displacement"]
    assert [text.get_text() for text in signals.axes[0].get_legend().get_texts()] == [
        "incident at 500 mm",
        "transmission at 500 mm",
    ]
    diagram = history.plot_xt().axes[0]
    assert diagram.get_xlabel() == "place  x  [m]"
    assert len(diagram.images) == 3
    with pytest.raises(ImpactlabError, match=r"no fields were kept.*\n.*frames=240"):
        il.run(case).plot_xt()
    few = il.run(il.load_case(CASES / "axial_impact.yaml").with_("snapshots", ["10 us", "20 us"]))
    with pytest.raises(ImpactlabError, match=r"kept at 2 instants, not at the 241 of the diagram.*\n.*frames=240"):
        few.plot_xt()
    assert repr(few.field("rod", 1e-5, "stress")).startswith("<Field at 101 places, x = 0 to 0.3 m: ")
    with pytest.raises(ImpactlabError, match=r"names of channels, not a list of them\n.*plot\(\*channels\)"):
        history.plot(["stress:incident@0.5"])  # type: ignore[arg-type]
    alone = il.Case(bodies={"ball": il.Mass(mass=1.0, velocity=1.0)}, solve={"duration": 1.0, "step": {"dt": 0.1}})
    with pytest.raises(ImpactlabError, match="no signal to draw"):
        il.run(alone).plot()
    with pytest.raises(ImpactlabError, match="all bodies are rigid"):
        il.run(alone).plot_xt()
    assert "No contact" in words_of(il.run(alone)._repr_html_())


@pytest.fixture(scope="module")
def row() -> il.history.AbstractHistory:
    """Twenty beads, struck at one end."""
    chain = {
        "bodies": {"striker": il.Mass(4e-3, velocity=1.0), "bead": il.Mass(4e-3, repeat=20)},
        "contacts": [il.Chain(["striker", "bead"], {"kind": "hertz", "stiffness": 7.7e9})],
        "solve": {"duration": 4e-4, "integrator": {"kind": "central_difference"}, "step": {"dt": 2e-7}},
    }
    return il.run(il.Case.from_dict(chain))


def test_a_legend_of_many_curves_has_few_names(row: il.history.AbstractHistory) -> None:
    for axes, total in zip(row.plot().axes, (20, 21), strict=True):
        legend = axes.get_legend()
        assert legend is not None
        names = [text.get_text() for text in legend.get_texts()]
        assert len(names) == 7
        assert names[-1] == f"... {total - 6} more"
        assert len(axes.lines) == total


def test_channels_and_times_of_a_figure_are_chosen(row: il.history.AbstractHistory) -> None:
    figure = row.plot("force:bead_3|bead_4", "force:bead_5|bead_6", "position:bead_4", start=5e-5, end=1.5e-4)
    first, second = figure.axes
    assert (first.get_title("left"), second.get_title("left")) == ("Force", "bead_4")
    legend = first.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["bead_3 | bead_4", "bead_5 | bead_6"]
    assert first.get_xlim() == pytest.approx((50.0, 150.0))  # us
    times = np.linspace(5e-5, 1.5e-4, 200)
    largest = np.max(row.evaluate(times, "force:bead_3|bead_4"))
    assert np.max(first.lines[0].get_ydata()) == pytest.approx(largest, rel=1e-3)
    assert np.min(first.lines[0].get_xdata()) == pytest.approx(50.0)
    assert row.plot(end=1e-4).axes[0].get_xlim() == pytest.approx((0.0, 100.0))


def test_any_place_of_an_exact_rod_is_drawn_and_the_force_of_an_impulse_law_is_refused(case: il.Case) -> None:
    figure = il.run(case.method("continuous")).plot("stress:rod@0.123")
    assert [axes.get_title("left") for axes in figure.axes] == ["rod at 123 mm"]
    kicks = il.run(case.method("impulse_momentum"))
    with pytest.raises(ImpactlabError, match=r"'force:hammer\|rod\.left' has no values in this run"):
        kicks.plot("force:hammer|rod.left")


@pytest.mark.parametrize(
    ("channels", "times", "text"),
    [
        (
            ("force:bead_3|bead_5",),
            {},
            r"no channel 'force:bead_3\|bead_5'; it has force:striker\|bead_1, force:bead_1",
        ),
        (("force",), {}, "no channel 'force'"),
        ((), {"start": 3e-4, "end": 1e-4}, r"from 0\.0003 s to 0\.0001 s of a run from 0 to 0\.0004 s"),
        (("position:bead_1",), {"end": 1.0}, "from 0 s to 1 s of a run"),
        ((), {"start": -1.0}, "from -1 s"),
    ],
)
def test_channels_and_times_that_a_run_does_not_have_are_refused(
    row: il.history.AbstractHistory, channels: tuple[str, ...], times: dict[str, float], text: str
) -> None:
    with pytest.raises(ImpactlabError, match=text):
        row.plot(*channels, **times)


FILMED = [("axial_impact", "continuous"), ("rod_on_beam", "base"), ("several_masses", "base"), ("rod_on_wall", "base")]


@pytest.mark.parametrize(("name", "method"), FILMED)
def test_a_film_moves(name: str, method: str) -> None:
    history = il.run(il.load_case(CASES / f"{name}.yaml").method(method), frames=240)
    figure, step, count = animation.film(history)
    assert count == 241
    pictures = []
    for number in (0, 60, 240):
        step(number)
        stage = figure.axes[0].collections  # cells of the fields, and the outlines of masses, without values
        cells = [each.get_array() for each in stage if each.get_array() is not None]
        pictures.append(tuple(tuple(np.round(each, 9)) for each in cells))
    if history.scene.elastic:
        assert len(set(pictures)) > 1


@pytest.mark.parametrize(("name", "number"), [("axial_impact", 100), ("rod_on_wall", 40)])
def test_faces_in_contact_touch_in_a_film(name: str, number: int) -> None:
    history = il.run(il.load_case(CASES / f"{name}.yaml").method("continuous"), frames=240)
    span, t = history.contacts[0], number / 240 * history.duration
    assert span.start < t < span.until(history.duration)
    figure, step, _ = animation.film(history)
    stage = figure.axes[0]

    def sides() -> tuple[np.ndarray, np.ndarray]:
        """Return the places of the corners of the rigid body and of the rod."""
        masses = [each.get_paths()[0] for each in stage.collections if each.get_array() is None]
        (rigid,) = masses or [each.get_path().transformed(each.get_patch_transform()) for each in stage.patches]
        return rigid.vertices[:, 0], stage.get_lines()[0].get_xdata()

    step(number)
    rigid, rod = sides()
    faces = (rigid.max(), rod.min()) if name == "axial_impact" else (rod.max(), rigid.min())
    assert faces[0] == pytest.approx(faces[1], abs=1e-6 * np.ptp(rod))
    low, high = stage.get_xlim()
    for each in (0, 240):  # and nothing leaves the picture
        step(each)
        places = np.concatenate(sides())
        assert low < places.min()
        assert places.max() < high


def test_the_masses_of_a_film_move_with_their_positions() -> None:
    bodies = {"striker": il.Mass(4e-3, velocity=1.0), "bead": il.Mass(4e-3, repeat=3)}
    row = il.Chain(["striker", "bead"], {"kind": "hertz", "stiffness": 7e9}, gap=1e-5)
    solve = {"duration": "0.1 ms", "integrator": {"kind": "central_difference"}, "step": {"dt": "0.2 us"}}
    history = il.run(il.Case(bodies=bodies, contacts=[row], solve=solve), frames=240)
    figure, step, _ = animation.film(history)
    (masses,) = figure.axes[0].collections

    def lefts(number: int) -> np.ndarray:
        step(number)
        return np.array([path.vertices[:, 0].min() for path in masses.get_paths()])

    moved = lefts(240) - lefts(0)
    travelled = [
        history.at_end(f"position:{name}") - history.evaluate(0.0, f"position:{name}") for name in history.scene.bodies
    ]
    assert moved / moved[0] == pytest.approx(np.array(travelled) / travelled[0], abs=1e-6)


def test_names_in_a_film_of_many_bodies_do_not_overlap() -> None:
    bodies = {"striker": il.Mass(4e-3, velocity=1.0), "bead": il.Mass(4e-3, repeat=30), "wall": il.Wall()}
    row = il.Chain(["striker", "bead", "wall"], {"kind": "hertz", "stiffness": 7e9})
    solve = {"duration": "0.1 ms", "integrator": {"kind": "central_difference"}, "step": {"dt": "0.2 us"}}
    figure, _, _ = animation.film(il.run(il.Case(bodies=bodies, contacts=[row], solve=solve), frames=240))
    figure.canvas.draw()
    names = [text.get_window_extent() for text in figure.axes[0].texts]
    assert len(names) > 10
    assert not any(one.overlaps(other) for one, other in itertools.combinations(names, 2))


def test_only_moving_artists_change_between_frames() -> None:
    """Pictures are drawn over one still picture: they must be those of the whole figure."""
    history = il.run(il.load_case(CASES / "rod_on_wall.yaml"), frames=240)
    figure, step, _ = animation.film(history)
    quick = film_files.pictures(figure, step, [0, 90, 200])
    for number, picture in zip((0, 90, 200), quick, strict=True):
        step(number)
        with BytesIO() as file:
            figure.savefig(file, format="png", dpi=animation.DPI)
            whole = np.asarray(Image.open(file).convert("RGB"), float)
        assert picture.shape[:2] == whole.shape[:2]
        assert np.mean(np.abs(picture[:, :, :3] - whole)) < 1.0  # of 255: lines over which others lie


def test_an_mp4_is_written_or_refused_without_ffmpeg(tmp_path: Path, case: il.Case) -> None:
    history = il.run(case.method("continuous"))
    if shutil.which("ffmpeg") is None:
        with pytest.raises(ImpactlabError, match="needs the program ffmpeg"):
            history.animate(tmp_path / "waves.mp4")
        return
    history.animate(tmp_path / "waves.mp4", seconds=0.5)
    assert b"ftyp" in (tmp_path / "waves.mp4").read_bytes()[:16]


def test_a_notebook_gets_an_animation(case: il.Case) -> None:
    made = il.run(case.method("continuous")).animate(seconds=2.0)
    assert made is not None
    made._draw_was_started = True  # so that matplotlib does not warn that nobody looked at it
    assert len(list(made.new_frame_seq())) == 241


def test_a_run_without_fields_is_filmed_with_its_forces(case: il.Case) -> None:
    figure, step, _ = animation.film(il.run(case.with_("snapshots", [])))
    step(200)
    assert figure.axes[1].get_ylabel().startswith("contact force")
    assert figure.axes[1].get_lines()[0].get_xdata()[-1] == pytest.approx(200 / 240 * figure.axes[1].get_xlim()[1])


def test_the_command_writes_a_film(tmp_path: Path) -> None:
    out = tmp_path / "waves.gif"
    given = ["animate", str(CASES / "axial_impact.yaml"), "--method", "continuous", "-o", str(out), "--seconds", "0.5"]
    done = invoke(*given)
    assert done.exit_code == 0, done.output
    with Image.open(out) as film:
        assert film.n_frames == 8
        assert film.size == (792, 506)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("waves.avi", "is not a valid file name for an animation"),
        ("none/waves.gif", "there is no folder"),
        ("waves.mp4", "needs the program ffmpeg"),
    ],
)
def test_films_that_cannot_be_written_are_refused_before_the_run(
    tmp_path: Path, name: str, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(film_files.shutil, "which", lambda program: None)
    done = invoke("animate", str(CASES / "axial_impact.yaml"), "-o", str(tmp_path / name))
    assert done.exit_code == 2
    assert text in done.output


def test_warnings_have_classes(case: il.Case) -> None:
    slow = case.with_("bodies.rod.material.young", 210).with_settings({"solve.step": {"points_per_period": 10}})
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        il.run(slow.method("continuous"))
    kinds = [each.category for each in seen]
    assert il.UnusualValue in kinds
    assert il.RunNote in kinds
    assert all(issubclass(kind, il.RunWarning) for kind in kinds)
    text = next(str(each.message) for each in seen if each.category is il.UnusualValue)
    assert text.startswith("bodies.rod.material: the wave speed is 0.163 m/s, and that of solids lies between 300 and")
    assert slow.hints == (text,)
    assert case.hints == ()


@pytest.mark.parametrize("command", ["run", "check"])
def test_commands_print_notes_on_likely_mistakes(tmp_path: Path, command: str) -> None:
    given = [
        command,
        str(CASES / "axial_impact.yaml"),
        "--method",
        "continuous",
        "--set",
        "bodies.rod.material.young=210",
    ]
    done = invoke(*given)
    assert done.exit_code == 0
    assert "axial_impact.yaml: bodies.rod.material: the wave speed is 0.163 m/s" in done.stderr


def test_notes_are_quiet_by_default(case: il.Case) -> None:
    code = (
        "import warnings, impactlab as il\n"
        f"case = il.load_case({str(CASES / 'axial_impact.yaml')!r})\n"
        "il.run(case)\n"
        "warnings.simplefilter('always', il.RunNote)\n"
        "print('asked', flush=True)\n"
        "il.run(case)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.count("RunNote: near_grazing") == 1


def test_a_long_row_is_not_drawn_body_by_body() -> None:
    bodies = {"striker": il.Mass(4e-3, velocity=1.0), "bead": il.Mass(4e-3, repeat=300)}
    law = {"kind": "hertz", "stiffness": 7e9}
    solve = {"duration": 1e-5, "integrator": {"kind": "central_difference"}, "step": {"dt": 2e-7}}
    case = il.Case(bodies=bodies, contacts=[il.Chain(["striker", "bead"], law)], solve=solve)
    for shown in (case._repr_html_(), il.run(case)._repr_html_()):
        assert shown.count('class="mass"') < 50
    assert "bead_1 to bead_300 each rigid mass" in words_of(case._repr_html_())
