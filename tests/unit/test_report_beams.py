"""The page of a run on beams: its drawing, its facts, its collisions, its moments along the beam."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import impactlab as il
from impactlab.report import facts
from impactlab.report.beam_sketch import beam_sketch
from impactlab.report.figures import fields
from impactlab.report.run_report import write_run
from impactlab.report.sketch import sketch
from impactlab.report.summary import summarise
from tests.cases.support import case_of


def test_the_drawing_shows_supports_and_strikers() -> None:
    drawn = sketch(case_of("sphere_on_long_beam").scene())
    assert drawn.count('<circle cx="280.0"') == 1  # in the middle of 420 that begin at 70
    assert drawn.count('fill="none"') == 2  # two pins
    for word in ("sphere", "beam", "0.01 m/s"):
        assert f">{word}</text>" in drawn
    tube = sketch(case_of("tube_between_stops").scene())
    heights = {name: float(re.search(rf'y="([\d.]+)"[^>]*>{name}<', tube).group(1)) for name in ("above", "below")}  # type: ignore[union-attr]
    assert heights["above"] < 96.0 < heights["below"]  # y grows downwards


def test_a_scene_without_beams_has_its_own_drawing() -> None:
    assert beam_sketch(case_of("axial_impact").scene()) == ""
    assert "sketch" in sketch(case_of("axial_impact").scene())


def test_the_facts_name_theory_stiffness_and_supports() -> None:
    words = dict(facts.scene_facts(case_of("sphere_on_short_beam").scene()))
    assert words["beam"].startswith("Timoshenko beam, 100\N{NO-BREAK SPACE}mm long, EI = ")
    assert "kGA = " in words["beam"]
    assert words["beam"].endswith("left pinned, right pinned")
    words = dict(facts.scene_facts(case_of("tube_between_stops").scene()))
    assert "Euler-Bernoulli beam" in words["tube"]
    assert "1 kg/m" in words["tube"]
    assert words["above"] == "rigid wall"


def test_the_page_shows_collisions_and_moments(tmp_path: Path) -> None:
    case = case_of("sphere_on_long_beam").with_settings(
        [("snapshots", [2.0e-4, 1.0e-3]), ("solve.model", {"kind": "modal", "elements": 40, "modes": 20})]
    )
    scene, history = case.scene(), il.run(case)
    assert fields.load_of(scene.bodies["beam"]) == "bending_moment"
    write_run(tmp_path, summarise("long", history), history, None)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "Collision of sphere|beam: 3 sub-impacts" in page
    assert "Bending moment in beam" in page
    assert (tmp_path / "figures" / "bending_moment_beam.svg").stat().st_size > 5000
    arrays = np.load(tmp_path / "history.npz")
    moments = arrays["field/bending_moment:beam@0.0002"]
    # Pinned ends carry no moment; the middle under the blow carries the most.
    assert abs(moments[0]) < 0.05 * np.max(np.abs(moments))
    assert arrays["field/x:beam"][np.argmax(np.abs(moments))] == pytest.approx(0.1535, abs=0.03)
