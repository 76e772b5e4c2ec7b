"""Figures, tables and pages: what they show is what the histories hold; a page needs nothing but itself."""

from __future__ import annotations

import csv
import dataclasses
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from impactlab import load_case
from impactlab.errors import CaseError
from impactlab.history import ContactSpan, Cost, EnergyBook, Event, Warned
from impactlab.history.sampling import FRAMES
from impactlab.prefixes import scaled
from impactlab.refine.references.reference_record import Reference
from impactlab.report.compare_report import write_comparison
from impactlab.report.comparison import comparison
from impactlab.report.facts import findings, scene_facts, si
from impactlab.report.figures import balance, diagram, differences, overview, plots
from impactlab.report.figures.figure_files import figure_files, inline, to_svg
from impactlab.report.figures.style import INK, PALETTE, Trace, curve, spread, traces
from impactlab.report.provenance import Provenance
from impactlab.report.run_report import write_run
from impactlab.report.sketch import sketch
from impactlab.report.summary import summarise
from impactlab.report.table import comma_separated, markdown, page_rows
from impactlab.scene import Contact, End, Rod, Wall
from impactlab.scene.bodies import SampledLoad
from impactlab.scene.method import Simulation
from impactlab.testing.scenes import UNIT, face, mass_on_rod, touching
from tests.cases.support import CASES
from tests.unit.synthetic import SyntheticHistory, SyntheticLaw

PAIR = "hammer|rod.left"
T = 2.0
DURATION = 3.0 * T


@dataclasses.dataclass(frozen=True)
class Model:
    """Stands for a model."""

    steps: ClassVar[bool] = True
    elements: int = 10


def scene(**changes: Any) -> Simulation:
    law: Any = SyntheticLaw()
    model: Any = Model()
    return mass_on_rod(model, law, segments=(UNIT,), mass_ratio=2.0, snapshots=(0.5, 1.5)).but(**changes)


def history(scale: float = 1.0, *, kicks: bool = False, dt: float | None = 0.01) -> SyntheticHistory:
    grid = np.linspace(0.0, DURATION, 50)
    hammer = 0.5 + 0.5 * np.exp(-grid)
    nothing = np.zeros(50)
    signals: dict[str, Any] = {
        "position:hammer": lambda t: scale * np.sin(t),
        "velocity:hammer": lambda t: scale * np.cos(t),
        "displacement:rod@0": lambda t: scale * np.sin(t) ** 2,
        f"gap:{PAIR}": lambda t: np.maximum(0.0, t - 2.0) * scale,
        f"force:{PAIR}": lambda t: np.full_like(t, np.nan) if kicks else np.where(t < 2.0, scale, 0.0),
        "momentum:rod": np.zeros_like,
        "energy:rod": np.zeros_like,
    }
    struck = tuple(Event(0.1 * i, PAIR, "impulse", 0.1) for i in range(20))
    return SyntheticHistory(
        DURATION,
        signals,
        events=struck if kicks else (Event(0.0, PAIR, "close"), Event(2.0, PAIR, "open")),
        contacts=(
            ContactSpan(PAIR, 0.0, 1.9, 2.0, None, 0.1, 20)
            if kicks
            else ContactSpan(PAIR, 0.0, 2.0, 2.0 * scale, scale),
        ),
        energy=EnergyBook(grid, {"hammer": hammer, "rod": 1.0 - hammer}, nothing, {"contact": nothing}, nothing),
        fields={
            f"{quantity}:rod": lambda x, t: scale * np.cos(x - t) for quantity in ("displacement", "velocity", "stress")
        },
        jumps={f"force:{PAIR}": (2.0,)},
        dt=dt,
        warnings=(Warned("chatter", "more than <100> kicks"),) if kicks else (),
        cost=Cost(0.1, 0.2, 600),
        simulation=scene(),
    )


EXACT = Reference("st_venant", history(dt=None))
ORIGIN = Provenance("A & B <here>", "Somebody 1999", date="2026-01-02 03:04 UTC")


def three() -> tuple[dict[str, Any], dict[str, SyntheticHistory]]:
    histories = {"good": history(1.01), "poor": history(1.3), "kicks": history(kicks=True)}
    rows = [(name, summarise("toy", h, EXACT)) for name, h in histories.items()]
    failed = {"schema_version": 1, "case": "toy", "status": "failed", "error": {"text": "lost | at sea"}}
    return comparison("toy", "st_venant", [*rows, ("lost", failed)]), histories


class Links(HTMLParser):
    """Collects the words, tags, ids and addresses of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.words: list[str] = []
        self.tags: list[str] = []
        self.addresses: list[str] = []
        self.ids: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.addresses += [value or "" for name, value in attrs if name in ("href", "src", "xlink:href")]
        self.ids += [value or "" for name, value in attrs if name == "id"]

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a comparison as a command writes it."""
    folder = tmp_path_factory.mktemp("written")
    document, histories = three()
    references = dict.fromkeys(histories, EXACT.history)
    write_comparison(folder, document, histories, scene().scene, references, provenance=ORIGIN)
    return folder


def test_a_comparison_writes_all_its_files(tmp_path: Path) -> None:
    document, histories = three()
    asked = figure_files("svg,png", None)
    references = dict.fromkeys(histories, EXACT.history)
    write_comparison(tmp_path, document, histories, scene().scene, references, provenance=ORIGIN, files=asked)
    assert json.loads((tmp_path / "comparison.json").read_text()) == document
    assert {path.name for path in tmp_path.iterdir()} == {
        "comparison.json",
        "table.md",
        "table.csv",
        "figures",
        "index.html",
    }
    names = {path.stem for path in (tmp_path / "figures").iterdir()}
    assert names == {
        "waves",
        "errors",
        "contacts",
        "force",
        "gap",
        "displacement",
        "difference",
        "energy",
        "stress_rod",
    }
    for name in names:
        assert (tmp_path / "figures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert "<svg" in (tmp_path / "figures" / f"{name}.svg").read_text()


def test_figures_that_the_page_shows_live_are_drawn_on_request(written: Path) -> None:
    assert {path.name for path in (written / "figures").iterdir()} == {
        f"{n}.svg" for n in ("waves", "errors", "contacts", "force", "stress_rod")
    }


def test_a_page_stands_alone_and_has_its_texts(written: Path) -> None:
    text = (written / "index.html").read_text()
    page = Links(text)
    assert "A &amp; B &lt;here&gt;" in text
    assert "Somebody 1999" in text
    assert "more than &lt;100&gt; kicks" in text
    assert "impactlab compare toy.yaml --methods good,poor,kicks,lost --out DIR" in text
    assert "failed: lost | at sea" in text
    assert page.tags.count("figure") == 5
    assert not {"iframe", "object"} & set(page.tags)
    outside = [a for a in page.addresses if not a.startswith(("#", "data:")) and not (written / a).exists()]
    assert outside == []
    assert not re.search(r"@import|url\((?!['\"]?#)", text)
    assert len(page.ids) == len(set(page.ids)) or _same_definitions(text)
    style, body = text.split("</style>")
    assert not [colour for colour in (INK, *PALETTE) if colour in body]  # figures take the colours of the page
    used = set(re.findall(r"var\((--\w+)\)", text))
    assert used <= set(re.findall(r"(--\w+):", style))


def _same_definitions(text: str) -> bool:
    """Return whether ids that occur again (hashes of clip paths and markers) stand for the same thing each time."""
    found: dict[str, set[str]] = {}
    for name, rest in re.findall(r'<(?:clipPath|path) id="([^"]+)"([^>]*>(?:\s*<rect[^>]*>)?)', text):
        found.setdefault(name, set()).add(" ".join(rest.split()))
    return all(len(meanings) == 1 for meanings in found.values())


def test_a_run_writes_all_its_files_and_every_channel(tmp_path: Path) -> None:
    run = history(1.1)
    summary = summarise("toy", run, EXACT)
    write_run(tmp_path, summary, run, EXACT)
    assert json.loads((tmp_path / "summary.json").read_text()) == summary
    with np.load(tmp_path / "history.npz") as saved:
        assert set(run.channels()) <= set(saved)
        assert np.array_equal(saved["position:hammer"], run.evaluate(saved["time"], "position:hammer"))
        assert saved["events/kind"].tolist() == ["close", "open"]
        assert saved["events/time"].tolist() == [0.0, 2.0]
        assert np.array_equal(saved["field/stress:rod@0.5"], 1.1 * np.cos(saved["field/x:rod"] - 0.5))
    assert "in contact from 0 to 2\N{NO-BREAK SPACE}s" in (tmp_path / "index.html").read_text()


def test_without_a_reference_a_report_shows_the_run_alone(tmp_path: Path) -> None:
    summary = summarise("toy", history(), None)
    write_run(tmp_path, summary, history(), None)
    page = (tmp_path / "index.html").read_text().split("</style>")[1].split("<script>")[0].lower()
    missing = "not measured: no exact solution"  # is said, and nothing else of an exact solution
    assert missing in page
    assert "exact" not in page.replace(missing, "")
    assert (tmp_path / "figures" / "waves.svg").exists()  # its own


def test_figures_for_a_column_of_a_journal(tmp_path: Path) -> None:
    run, files = history(1.1), figure_files("pdf,svg", "one")
    write_run(tmp_path, summarise("toy", run, None), run, None, files=files)
    written = {path.suffix for path in (tmp_path / "figures").iterdir()}
    assert written == {".pdf", ".svg"}
    for svg in (tmp_path / "figures").glob("*.svg"):
        width = re.search(r'width="([\d.]+)pt"', svg.read_text(encoding="utf-8"))
        assert width is not None
        assert float(width.group(1)) == pytest.approx(3.35 * 72)
    assert 'viewBox="0 0 619.2 ' in (tmp_path / "index.html").read_text(encoding="utf-8")  # the page keeps its own


@pytest.mark.parametrize(("formats", "width", "words"), [("gif", None, "'gif'"), ("png", "three", "'three'")])
def test_other_formats_and_widths_are_refused(formats: str, width: str | None, words: str) -> None:
    with pytest.raises(CaseError, match=words):
        figure_files(formats, width)


@pytest.mark.slow
def test_the_same_comparison_gives_the_same_bytes(written: Path, tmp_path: Path) -> None:
    document, histories = three()
    write_comparison(
        tmp_path, document, histories, scene().scene, dict.fromkeys(histories, EXACT.history), provenance=ORIGIN
    )
    for path in written.rglob("*.*"):
        assert path.read_bytes() == (tmp_path / path.relative_to(written)).read_bytes(), path.name


def test_the_force_figure_has_a_panel_per_method_and_the_exact_force_in_each() -> None:
    _, histories = three()
    shown = traces(histories, dict.fromkeys(histories, EXACT.history))
    figure = plots.force(shown, scene().scene, PAIR)
    panels = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title("left") for axes in panels] == ["good", "poor", "kicks"]
    assert panels[2].get_title("right") == "mean of 20 kicks"
    for axes in panels:
        dark = [line for line in axes.lines if line.get_color() == INK]
        assert len(dark) == 1
        assert np.max(dark[0].get_ydata()) == pytest.approx(1.0)
        assert np.max(dark[0].get_xdata()) == pytest.approx(DURATION)
    assert len({axes.get_ylim() for axes in panels}) == 1


def test_kicks_are_drawn_with_their_whole_impulse() -> None:
    figure = plots.force([Trace("kicks", history(kicks=True), PALETTE[0])], scene().scene, PAIR)
    values, edges, _ = figure.axes[0].patches[0].get_data()  # type: ignore[attr-defined]
    assert np.sum(values * np.diff(edges)) == pytest.approx(2.0)  # 20 kicks of 0.1 N s


def test_the_difference_figure_shows_how_far_a_method_has_strayed() -> None:
    figure = differences.difference([Trace("poor", history(1.3), PALETTE[0], reference=EXACT.history)], scene().scene)
    assert figure.axes[0].lines[0].get_ydata()[-1] == pytest.approx(30.0, rel=1e-3)  # type: ignore[index]


def test_contacts_are_drawn_where_they_are() -> None:
    figure = overview.contacts([Trace("good", history(), PALETTE[0], reference=EXACT.history)], scene().scene)
    axes = figure.axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["exact", "good"]
    assert axes.collections[1].get_paths()[0].get_extents().bounds[0::2] == pytest.approx((0.0, 2.0))
    assert [text.get_text() for text in axes.texts] == ["1 contact", "1 contact"]


def test_errors_are_written_beside_their_dots() -> None:
    document, histories = three()
    colours = {trace.name: trace.colour for trace in traces(histories)}
    figure = overview.errors(document["rows"], colours)
    mass = figure.axes[0]
    assert mass.get_title("left") == "mass displacement"
    assert [text.get_text() for text in mass.texts] == ["1", "30", "0"]
    assert [text.get_text() for text in figure.axes[3].texts][2] == "–"  # an impulse law has no force


def test_the_balance_is_drawn_in_per_cent_of_the_energy_in_play() -> None:
    run = history()
    run.energy = dataclasses.replace(run.energy, stored=np.linspace(0.0, 0.002, 50))
    figure = balance.energy_balance([Trace("gains", run, PALETTE[0])], scene().scene)
    assert figure.axes[0].lines[0].get_ydata()[-1] == pytest.approx(0.2)  # type: ignore[index]


def test_the_diagram_of_waves_has_place_to_the_right_and_time_upwards() -> None:
    axes = diagram.lagrange(EXACT.history, scene().scene).axes[0]
    image = axes.images[0].get_array()
    assert image is not None
    assert axes.images[0].get_extent() == [0.0, 1.0, 0.0, DURATION]
    places, times = np.linspace(0.0, 1.0, image.shape[1]), np.linspace(0.0, DURATION, image.shape[0])
    assert image.shape[0] == 2 * FRAMES + 1  # of an exact run twice the frames
    assert np.allclose(image, np.cos(places - times[:, None]), atol=1e-4)
    assert [float(line.get_ydata()[0]) for line in axes.lines[1:]] == [0.0, 2.0]  # type: ignore[index]


def test_a_curve_keeps_every_spike_and_both_sides_of_a_jump() -> None:
    spiky = SyntheticHistory(
        DURATION,
        {"f": lambda t: np.where((t > 4.0) & (t < 4.001), 7.0, np.where(t < 1.0, t, 0.0))},
        jumps={"f": (1.0,)},
        cost=Cost(steps=12_000),
    )
    t, values = curve(spiky, "f", DURATION, columns=100)
    assert t.size <= 400
    assert np.all(np.diff(t) > 0)
    assert values.max() == 7.0
    assert values[t < 2.0].max() == pytest.approx(1.0, abs=1e-9)


def test_labels_are_moved_apart_and_no_further() -> None:
    assert spread([0.1, 0.5, 0.9], 0.1) == [0.1, 0.5, 0.9]
    assert spread([0.5, 0.5], 0.1) == pytest.approx([0.45, 0.55])
    placed = spread([0.0, 0.01, 0.02, 0.12], 0.1)
    assert np.all(np.diff(placed) >= 0.1 - 1e-12)
    assert np.mean(placed) == pytest.approx(np.mean([0.0, 0.01, 0.02, 0.12]))


@pytest.mark.parametrize(
    ("value", "text"), [(78276.0, "78.28 kN"), (1.5e-5, "15 µm"), (0.999999, "1 m"), (0.0, "0 m"), (2.133, "2.133 kg")]
)
def test_numbers_take_the_prefix_that_makes_them_short(value: float, text: str) -> None:
    assert si(value, text.split()[1][-1] if "kg" not in text else "kg").replace("\N{NO-BREAK SPACE}", " ") == text
    assert scaled("N", 2.0e6) == (1e6, "MN")


def test_an_inlined_figure_takes_the_colours_of_the_page() -> None:
    svg = inline(to_svg(plots.gap([Trace("good", history(), PALETTE[0])], scene().scene, PAIR)), 'a "b" & c')
    assert svg.startswith('<svg role="img" aria-label="a &quot;b&quot; &amp; c"')
    assert INK not in svg
    assert "var(--ink)" in svg
    assert "var(--c0)" in svg
    assert PALETTE[0] not in svg
    assert "<metadata" not in svg
    assert 'height="' not in svg.split(">")[0]


def test_tables_hold_all_methods_and_their_failures() -> None:
    document, _ = three()
    lines = markdown(document).splitlines()
    assert len(lines) == 6
    assert len({line.replace("\\|", "").count("|") for line in lines}) == 1
    assert "lost \\| at sea" in lines[-1]
    rows = list(csv.DictReader(comma_separated(document).splitlines()))
    assert [row["method"] for row in rows] == ["good", "poor", "kicks", "lost"]
    assert float(rows[1]["mass [%]"]) == pytest.approx(30.0)
    assert rows[3]["failure"] == "failed: lost | at sea"
    assert rows[3]["mass [%]"] == ""


def test_the_best_value_of_a_column_is_marked_once() -> None:
    document, _ = three()
    rows = page_rows(document)
    marked = [[cell.text for cell in row["cells"] if cell.best] for row in rows[:3]]
    assert marked == [[], [], ["0", "0", "0"]]  # the kicks move as the exact answer does
    assert rows[3]["failure"] == "failed: lost | at sea"
    assert rows[2]["warnings"] == "chatter"
    still = {**document["rows"][2]["summary"], "method": {**document["rows"][2]["summary"]["method"], "dt": None}}
    rows = page_rows({**document, "rows": [*document["rows"][:2], {"name": "exact", "summary": still}]})
    marked = [[cell.text for cell in row["cells"] if cell.best] for row in rows]
    assert marked == [["1.00", "1.00", "1.00"], [], []]  # what needs no step does not compete


def test_findings_name_the_best_the_worst_and_the_lost() -> None:
    document, _ = three()
    said = findings(document)
    assert said[0].startswith("Of the stepped methods, kicks comes closest in the displacement of the mass")
    assert "poor is furthest off (30.0 %)" in said[0]
    assert "Every touch and opening, and no other, is found by good and poor." in said
    assert said[-1] == "No result: lost; the table gives the reasons."


def test_the_scene_is_described_and_drawn() -> None:
    told = dict(scene_facts(scene().scene))
    assert "rigid mass" in told["hammer"]
    assert told["rod"].endswith("left free, right clamped")
    assert told["duration"].endswith("= 3 T")
    drawing = sketch(scene().scene)
    assert drawing.count('class="rod"') == 1
    assert drawing.count('class="mass"') == 1
    assert ">1 m/s<" in drawing
    bodies = scene().scene.bodies
    inner = Contact(face(bodies["hammer"]), face(bodies["rod"], 0.5), 0.0)
    assert sketch(scene(contacts=(inner,)).scene) == ""  # no line of bodies end to end


def test_forces_on_ends_are_drawn() -> None:
    """An arrow outside the rod, towards it or away from it as the force points."""
    for right, left in ((2.5e3, 0.0), (-2.5e3, 0.0), (0.0, 2.5e3)):
        rod = Rod("rod", (UNIT,), End("free", force=left), End("mass", 3.0, right))
        drawn = sketch(scene(bodies={"rod": rod}, contacts=()).scene)
        assert drawn.count('class="head"') == 1
        assert "2500 N" in drawn


def test_a_force_over_time_has_no_size_in_the_drawing() -> None:
    """It points as its largest value does: the arrow of the pulse -5 kN on the left end leads away from the rod."""
    tips = []
    for peak in (5.0e3, -5.0e3):
        load = SampledLoad((0.0, 1.0, 2.0), (0.1 * -peak, peak, 0.0))
        rod = Rod("rod", (UNIT,), End("free", load=load), End("free"))
        drawn = sketch(scene(bodies={"rod": rod}, contacts=()).scene)
        assert ">F(t)<" in drawn
        assert " N<" not in drawn
        tips.append(float(re.findall(r'<path d="M([\d.]+) [\d.]+l', drawn)[0]))
    assert tips[0] > tips[1]


def test_facts_of_ends_have_all_their_numbers() -> None:
    """A spring against rotation is stated beside the one against deflection, an infinite end by its name."""
    ends = End("spring", 1.0e3, rotational=100.0), End("dashpot", 5.0, unbounded=True)
    rod = Rod("rod", (UNIT,), *ends)
    words = dict(scene_facts(scene(bodies={"rod": rod}, contacts=()).scene))["rod"].replace("\N{NO-BREAK SPACE}", " ")
    assert words.endswith("left spring 1 kN/m and 100 N·m/rad, right infinite (dashpot 5 N·s/m)")


def test_every_way_to_hold_an_end_is_drawn() -> None:
    for end, mark in (
        ("spring", "polyline"),
        ("dashpot", "polyline"),
        ("mass", 'class="mass"'),
        ("clamped", 'class="thin"'),
    ):
        rod = Rod("rod", (UNIT,), End("free"), End(end, 3.0))  # type: ignore[arg-type]
        wall = Wall("wall")
        held = sketch(scene(bodies={"wall": wall, "rod": rod}, contacts=(touching(wall, rod, 0.1),)).scene)
        assert mark in held


def test_many_bodies_and_contacts_that_are_alike_are_listed_once():
    """A row of beads is two lines of a page; a bead that differs has a line of its own."""
    scene = load_case(CASES / "granular" / "solitary_wave.yaml").scene()
    found = {name: words.replace("\N{NO-BREAK SPACE}", " ") for name, words in scene_facts(scene)}
    assert found["striker"].endswith("1 m/s")
    assert found["bead_1 to bead_100"] == "each rigid mass, 4.11 g, at rest"
    assert found["striker | bead_1 to bead_99 | bead_100"] == "each gap 0"
    other = {**scene.bodies, "bead_50": dataclasses.replace(scene.bodies["bead_50"], mass=1.0)}
    heavier = dict(scene_facts(dataclasses.replace(scene, bodies=other)))
    assert heavier["bead_50"] == "rigid mass, 1\N{NO-BREAK SPACE}kg, at rest"
    assert {"bead_1 to bead_49", "bead_51 to bead_100"} <= set(heavier)


@pytest.mark.parametrize(("name", "said"), [("two_rods", "194 µs, in 'target'"), ("axial_impact", "116.4 µs")])
def test_the_unit_of_time_names_its_body_where_there_are_several(name: str, said: str) -> None:
    told = dict(scene_facts(load_case(name).scene()))
    assert told["T, round trip of a wave"].replace("\N{NO-BREAK SPACE}", " ") == said
