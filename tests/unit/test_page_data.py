"""The data of a page: packed arrays, the scene end to end, and histories that are asked only at agreed instants."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

import impactlab
import impactlab.api as il
from impactlab.casefile import load_case
from impactlab.errors import ImpactlabError
from impactlab.history import Field
from impactlab.history.sampling import frame_times, page_times
from impactlab.report import page_figures
from impactlab.report.compare_report import write_comparison
from impactlab.report.comparison import comparison
from impactlab.report.figures.figure_files import compact
from impactlab.report.figures.signals import panels, sampled, shown
from impactlab.report.figures.stage import frames, layout
from impactlab.report.figures.style import traces
from impactlab.report.page_data import MAX_DATA, NAN_CODE, Packer, page_data
from impactlab.report.provenance import Provenance, now, of_case
from impactlab.report.summary import summarise
from impactlab.scene import Contact, Mass, Probe, Rod
from impactlab.testing.scenes import UNIT, face
from impactlab.types import Array
from tests.cases.support import case_of
from tests.unit.synthetic import SyntheticHistory
from tests.unit.test_report import EXACT, PAIR, history, scene, three


def unpacked(text: str, place: Any) -> Array:
    """Return an array as page.js reads it."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8).astype(np.int64)
    first, size, low, step = place
    steps = planes[first : first + size] + 256 * planes[planes.size // 2 :][first : first + size]
    codes = np.cumsum(steps) & 0xFFFF
    return np.where(codes == NAN_CODE, np.nan, low + codes * step)


@pytest.mark.parametrize("levels", [65535, 255])
def test_arrays_come_back_to_half_a_level(levels: int) -> None:
    packer = Packer()
    waves = np.sin(np.linspace(0.0, 20.0, 500)).reshape(5, 100) * 3e7
    gaps = np.array([1.0, np.nan, -2.0, np.nan])
    still = np.full(7, 4.25)
    places = [packer.add(values, levels) for values in (waves, gaps, still)]
    text = packer.text()
    assert np.allclose(unpacked(text, places[0]), waves.ravel(), rtol=0.0, atol=0.51 * 6e7 / (levels - 1))
    assert np.array_equal(np.isnan(unpacked(text, places[1])), np.isnan(gaps))
    assert np.array_equal(unpacked(text, places[2]), still)


class Listening(SyntheticHistory):  # type: ignore[misc]
    """Keeps the instants at which it was asked."""

    asked: list[Array]
    fields_asked: list[float]

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        self.asked.append(np.asarray(t, float))
        return super().evaluate(t, channel)

    def field(self, body: str, t: float, quantity: str, x: ArrayLike | None = None) -> Field:
        self.fields_asked.append(t)
        return super().field(body, t, quantity, x)


def test_a_page_evaluates_histories_at_agreed_instants_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So a history that was kept as samples gives the same page, its figures drawn in this process among it.

    Only the part of the time that a figure of a force shows is found from instants of its own.
    """
    monkeypatch.setattr("impactlab.report.figures.named_contacts._loaded", lambda *_: None)
    monkeypatch.setattr("impactlab.report.page.side_by_side", lambda calls: [call() for call in calls])
    document, histories = three()
    for each in histories.values():
        each.__class__ = Listening
        each.asked, each.fields_asked = [], []  # type: ignore[attr-defined]
    write_comparison(tmp_path, document, histories, scene().scene, dict.fromkeys(histories, EXACT[1]))
    agreed = [page_times(EXACT[1].duration), frame_times(EXACT[1].duration)]
    kept = {*agreed[1].tolist(), *scene().scene.snapshots}
    for each in histories.values():
        assert each.asked  # type: ignore[attr-defined]
        assert all(any(np.array_equal(t, times) for times in agreed) for t in each.asked)  # type: ignore[attr-defined]
        assert set(each.fields_asked) <= kept  # type: ignore[attr-defined]


def test_the_data_are_those_of_the_histories() -> None:
    shown_histories = traces({"good": history(1.01)}, {"good": EXACT[1]})
    data = json.loads(page_data(shown_histories, scene().scene, compared=True))
    assert [method["name"] for method in data["methods"]] == ["good", "exact"]
    [force] = [panel for panel in data["panels"] if panel["group"] == "force"]
    values = unpacked(data["arrays"], force["lines"][0]["values"])
    assert np.allclose(values, history(1.01).evaluate(page_times(6.0), f"force:{PAIR}"), atol=1e-4)
    rows, places, place = data["films"][1]["bodies"]["rod"]["load"]
    image = unpacked(data["arrays"], place).reshape(rows, places)
    assert np.allclose(image, np.cos(np.linspace(0.0, 1.0, places) - np.linspace(0.0, 6.0, rows)[:, None]), atol=5e-3)
    assert data["films"][1]["events"] == [[0, 0.0, "close"], [0, 2.0, "open"]]


def test_many_histories_stay_within_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    noise = np.random.default_rng(1).standard_normal(5000)
    many = {f"m{i}": history(1.0 + 0.1 * i) for i in range(20)}
    for each in many.values():
        each._fields["stress:rod"] = lambda x, t: noise[: x.size] * np.sin(t)
    assert len(page_data(traces(many, {}), scene().scene, compared=True)) <= MAX_DATA
    monkeypatch.setattr("impactlab.report.page_data.MAX_DATA", 5_000)
    data = json.loads(page_data(traces(many, {}), scene().scene, compared=True))
    line = data["panels"][0]["lines"][0]["values"]
    assert line[1] == data["points"] < page_times(1.0).size  # fewer instants, the last among them
    values = unpacked(data["arrays"], line)
    assert values[-1] == pytest.approx(float(many["m0"].evaluate(6.0, f"force:{PAIR}")), abs=0.01)


def test_of_many_contacts_and_bodies_the_first_have_figures_by_default() -> None:
    case = case_of("chain_of_bars").with_settings([("snapshots", [1e-4])])
    figures = page_figures.of_run(traces({"run": il.run(case)}, {})[0], case.scene())
    assert [figure.name for figure in figures if figure.name.startswith("stress") and not figure.is_printed] == [
        "stress_fourth"
    ]
    assert all(figure.is_printed for figure in figures if figure.name.startswith("force"))  # of three contacts


def test_bodies_stand_end_to_end_in_the_order_of_their_contacts() -> None:
    spots = layout(case_of("hopkinson_chain").scene())
    assert [round(spots[name].x, 12) for name in ("striker", "incident", "transmission")] == [0.0, 0.2, 1.2]
    assert [spots[name].gap for name in ("striker", "incident", "transmission")] == [0.0, 1e-3, 1e-3]
    spots = layout(case_of("ram_cushion_pile").scene())
    assert [spots[name].icons for name in ("ram", "cap", "pile")] == [0, 1, 2]


def test_a_striker_of_a_beam_stands_above_or_below_it() -> None:
    spots = layout(case_of("tube_between_stops").scene())
    assert {name: spot.side for name, spot in spots.items() if spot.beside} == {"above": 1, "below": -1}
    spots = layout(case_of("rod_on_beam").scene())
    assert (spots["rod"].beside, spots["rod"].at) == ("beam", 0.15)
    assert spots["rod"].x > 0.3  # its own place in the diagram, beyond the beam


def test_bodies_that_never_meet_stand_apart() -> None:
    bodies = {name: Rod(name, (UNIT,), *UNHELD) for name in ("a", "b")}
    spots = layout(scene(bodies=bodies, contacts=()).scene)
    assert spots["b"].x > 1.0 + 1e-3


UNHELD = (dataclasses.replace(scene().scene.bodies["rod"].left, kind="free"),) * 2  # type: ignore[attr-defined]


def test_a_body_without_fields_moves_with_its_faces_and_shows_no_load() -> None:
    run = history()
    run._fields.clear()

    def none(*_: Any) -> Field:
        raise ImpactlabError("no snapshot")

    run.field = none  # type: ignore[method-assign]
    rod = frames(run, scene().scene)["rod"]
    assert rod["load"] is None
    assert rod["u"] is not None
    assert np.allclose(rod["u"][:, 0], run.evaluate(frame_times(6.0), "displacement:rod@0"))
    assert np.all(rod["u"][:, -1] == 0.0)  # its far end is clamped


def test_probes_come_first_and_a_run_shows_its_places_in_one_panel() -> None:
    probed = scene(probes=(Probe("rod", 0.0, "displacement"), Probe("rod", 1.0, "displacement"))).scene
    run = history()
    run._signals["displacement:rod@1"] = np.zeros_like
    first, *others = panels(shown(traces({"run": run})), probed, compared=False)
    assert first.group == "probe"
    assert [line.name for line in first.lines] == ["rod at 0 mm", "rod at 1 m"]
    assert [panel.group for panel in others] == ["force", "displacement", "gap", "energy"]


def test_a_page_names_the_whole_case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert now() == "1970-01-02 00:00 UTC"
    case = case_of("axial_impact").with_settings([("bodies.hammer.mass", 1.5)])
    origin = of_case(case, "impactlab run axial_impact.yaml --set bodies.hammer.mass=1.5 --out DIR")
    summary = summarise("toy", history(), EXACT)
    table = comparison("toy", "st_venant", [("run", summary)])
    write_comparison(tmp_path, table, {"run": history()}, scene().scene, {"run": EXACT[1]}, provenance=origin)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "--set bodies.hammer.mass=1.5" in page
    assert "1970-01-02 00:00 UTC" in page
    again = load_case(tmp_path / "case.yaml")
    assert isinstance(again.scene().bodies["hammer"], Mass)
    assert again.scene().bodies["hammer"].moving_mass == 1.5
    assert dataclasses.replace(again.scene(), name="axial_impact") == case.scene()
    assert "Escalona" in (tmp_path / "citations.bib").read_text(encoding="utf-8")
    assert Provenance().version in page


def test_paths_keep_their_shape_in_fewer_steps() -> None:
    x = np.linspace(0.0, 100.0, 400)
    y = 50.0 + 30.0 * np.sin(x / 9.0) + np.where((x > 60.0) & (x < 60.3), 40.0, 0.0)
    path = "M " + " \nL ".join(f"{a:.6f} {b:.6f}" for a, b in zip(x, y, strict=True))
    short = compact(f'<svg><path d="{path} \n"/></svg>').split('"')[1]
    start, steps = short[1:].split("l")
    numbers = [np.array(re.findall(r"-?\d*\.?\d+", text), float).reshape(-1, 2) for text in (start, steps)]
    points = np.cumsum(np.concatenate(numbers), axis=0)
    assert len(short) < 0.3 * len(path)
    # A quarter of a point across, on slopes of 3.3:
    assert (
        np.max(np.abs(np.interp(x, points[:, 0], points[:, 1]) - y)[(x < 59.5) | (x > 61.0)]) < 1.0
    )  # a quarter of a point across, on slopes of 3.3
    assert points[:, 1].max() == pytest.approx(y.max(), abs=0.3)


def test_a_contact_inside_a_rod_has_its_place() -> None:
    bodies = scene().scene.bodies
    inner = Contact(face(bodies["hammer"]), face(bodies["rod"], 0.5), 0.0)
    spots = layout(scene(contacts=(inner,)).scene)
    assert spots["hammer"].x - spots["rod"].x == 0.5


def test_a_short_contact_has_its_peak_on_a_page_of_a_long_run() -> None:
    """Contacts of 1.3 ms in a run of 1.5 s were drawn with three quarters of their peaks, and less."""
    law = {"kind": "flores", "stiffness": 1e8, "restitution": 0.7}
    solve = {"duration": "1.5 s", "integrator": {"kind": "midpoint"}, "step": {"dt": "10 us"}}
    case = impactlab.Case(
        bodies={"ball": impactlab.Mass("0.5 kg"), "floor": impactlab.Wall()},
        contacts=[impactlab.Contact("ball", "floor", law, gap="0.5 m")],
        gravity=9.81,
        solve=solve,
    )
    history = il.run(case)
    times = page_times(history.duration)
    force = sampled(history, "force:ball|floor", times)
    assert force is not None
    assert len(history.contacts) > 4
    for span in history.contacts:
        near = (times > span.start - times[1]) & (times < span.until(history.duration) + times[1])
        assert force[near].max() == pytest.approx(span.peak_force, rel=1e-12)
