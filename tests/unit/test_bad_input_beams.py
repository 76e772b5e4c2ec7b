"""Errors in beam cases, and their messages: place, value given, values allowed, fix."""

from __future__ import annotations

from pathlib import Path

import pytest

import impactlab as il
from impactlab.errors import CaseError
from impactlab.scene.bodies.beam import MAX_WAVE_NUMBER

CASE = """\
schema_version: 1
bodies:
  ball: {kind: mass, mass: 0.03, velocity: 0.1}
  below: {kind: wall}
  above: {kind: wall}
  beam:
    kind: beam
    theory: THEORY
    length: 0.3
    section: SECTION
    material: MATERIAL
    ends: {left: pinned, right: pinned}
    tension: TENSION
contacts:
  - {between: [ball, beam.at(PLACE)], law: LAW}
  - {between: [below, beam.at(0.1)], gap: LOWER, law: {kind: penalty, stiffness: 1.0e6}}
  - {between: [beam.at(0.1), above], gap: UPPER, overlap: allowed, law: {kind: penalty, stiffness: 1.0e6}}
solve:
  duration: 2.0e-4
  model: {kind: modal, elements: 40, modes: 20}
  integrator: {kind: exact_modal}
  step: {dt: 1.0e-6}
"""
GIVEN = {
    "THEORY": "euler_bernoulli",
    "SECTION": "{width: 0.01, height: 0.01}",
    "MATERIAL": "{young: 2.1e11, density: 7900, poisson: 0.3}",
    "TENSION": "0.0",
    "PLACE": "0.15",
    "LAW": "{kind: hertz, stiffness: 1.0e10}",
    "LOWER": "1.0e-3",
    "UPPER": "1.0e-3",
}


@pytest.fixture(autouse=True)
def _beside_the_case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def case_with(**changes: str) -> il.Case:
    text = CASE
    for word, value in {**GIVEN, **{key.upper(): value for key, value in changes.items()}}.items():
        text = text.replace(word, value)
    Path("beam.yaml").write_text(text, encoding="utf-8")
    return il.load_case("beam.yaml")


@pytest.mark.parametrize(
    ("changes", "line", "path", "words"),
    [
        ({"place": "0.31"}, 15, "contacts.0.between.1", ["0.31 m", "0 to 0.3 m"]),
        ({"section": "{width: 0.01}"}, 10, "bodies.beam.section", ["width given", "{diameter: m}", "one of the three"]),
        ({"section": "{area: 1.0e-4}"}, 10, "bodies.beam.section", ["area given", "{area: m2, inertia: m4}"]),
        ({"section": "{}"}, 10, "bodies.beam.section", ["nothing given"]),
        (
            {"theory": "timoshenko", "material": "{young: 2.1e11, density: 7900}"},
            11, "bodies.beam.material", ["no shear modulus", "either poisson or shear_modulus"],
        ),
        (
            {"theory": "timoshenko", "section": "{area: 1.0e-4, inertia: 1.0e-9}"},
            10, "bodies.beam.section", ["no shear_factor", "5/6 of a rectangle"],
        ),
        (
            {"upper": "-2.0e-3"},
            17, "contacts.2.gap", ["the gaps cross", "0.001 m to 'below'", "-0.002 m to 'above'", "leave -0.001 m"],
        ),
        ({"theory": "vlasov"}, 8, "bodies.beam.theory", ["vlasov", "euler_bernoulli", "timoshenko"]),
    ],
)  # fmt: skip
def test_a_bad_beam_is_refused_with_a_remedy(changes: dict[str, str], line: int, path: str, words: list[str]) -> None:
    with pytest.raises(CaseError) as caught:
        case_with(**changes)
    assert caught.value.line == line
    assert caught.value.path == path
    for word in words:
        assert word in str(caught.value), str(caught.value)


@pytest.mark.parametrize("key", ["width", "height", "diameter"])
def test_a_size_of_the_section_beside_it_is_refused_with_its_place(key: str) -> None:
    with pytest.raises(CaseError, match=f"'{key}' is not known here") as caught:
        case_with(theory=f"timoshenko\n    {key}: 0.01")
    assert f"It stands inside 'section': write section: {{{key}: ..., ...}}" in str(caught.value)


def test_a_preload_that_buckles_is_refused() -> None:
    """Euler's load of a pinned beam is pi2 EI/L2 = 19.19 kN: just below it is a beam, just above none."""
    load = 3.141592653589793**2 * 2.1e11 * 0.01**4 / 12.0 / 0.3**2
    il.run(case_with(tension=f"{-0.99 * load}"))
    with pytest.raises(CaseError, match="buckles 'beam'") as caught:
        il.run(case_with(tension=f"{-1.01 * load}"))
    assert caught.value.path == "bodies.beam.tension"
    assert "smaller compression" in caught.value.remedy


def warned(case: il.Case) -> dict[str, str]:
    return {each.code: each.text for each in il.run(case).warnings}


def test_a_slender_beam_is_not_warned_of() -> None:
    assert not {"stocky_beam", "singular_force", "sub_impacts"} & set(warned(case_with()))


def test_a_stocky_beam_is_warned_of_with_its_numbers() -> None:
    text = warned(case_with(section="{width: 0.01, height: 0.05}"))["stocky_beam"]
    assert "6 times as long as high (slender from 10 on)" in text
    assert "use theory: timoshenko" in text
    given = case_with(section="{width: 0.01, height: 0.05}", theory="timoshenko")
    assert "stocky_beam" not in warned(given)


def test_without_a_height_the_slenderness_follows_from_area_and_inertia() -> None:
    """sqrt(12 I/A) is the height of a rectangle: 0.05 m here."""
    text = warned(case_with(section="{area: 5.0e-4, inertia: 1.0416666666666667e-7}"))["stocky_beam"]
    assert "6 times as long as high (slender from 10 on, the height taken as sqrt(12 I/A))" in text


def test_short_waves_make_a_slender_beam_stocky() -> None:
    """A light ball on a stiff contact leaves soon: r k = sqrt(pi r/(c t)) of the shortest contact."""
    case = case_with(law="{kind: penalty, stiffness: 1.0e9}").with_("bodies.ball.mass", 0.001)
    history = il.run(case)
    text = next(each.text for each in history.warnings if each.code == "stocky_beam")
    shortest = min(span.end - span.start for span in history.contacts if span.end is not None)
    segment = case.scene().bodies["beam"].segments[0]
    radius = 0.01 / 12.0**0.5
    expected = (3.141592653589793 * radius / (segment.wave_speed * shortest)) ** 0.5
    assert f"r k = {expected:.3g} (allowed: up to 0.15; " in text
    assert "times as long as high" not in text


def test_a_number_just_above_its_limit_is_not_shown_as_the_limit() -> None:
    beam = case_with().scene().bodies["beam"]
    segment = beam.segments[0]
    at_limit = 3.141592653589793 * segment.gyration / (segment.wave_speed * MAX_WAVE_NUMBER**2)
    (text,) = beam.theory_doubts("ball|beam", at_limit * (1.0 - 1e-4))
    assert "r k = 0.15001 (allowed: up to 0.15; " in text


def test_a_hard_contact_on_an_euler_bernoulli_beam_is_singular() -> None:
    text = warned(case_with(law="{kind: addition_deletion}").with_("solve.events", "located"))["singular_force"]
    assert "t^-1/2" in text
    assert "theory: timoshenko" in text
    timoshenko = case_with(law="{kind: addition_deletion}", theory="timoshenko").with_("solve.events", "located")
    assert "singular_force" not in warned(timoshenko)


def test_a_shape_that_turns_a_clamped_end_is_refused() -> None:
    """It would store energy without a bound in an ever finer mesh."""
    text = CASE.replace(
        "{left: pinned, right: pinned}", "{left: clamped}\n    displacement: 1.0e-3*(x/L)**2*(3 - x/L)/2"
    )
    for word, value in GIVEN.items():
        text = text.replace(word, value)
    Path("beam.yaml").write_text(text, encoding="utf-8")
    bent = il.load_case("beam.yaml")
    words = r"turns the clamped left end by 0\.00333; a clamped end of a beam does not turn"
    for shape in ("1.0e-3*x/L", {"x": [0.0, 0.3], "u": [0.0, 1.0e-3]}):
        with pytest.raises(CaseError, match=words):
            bent.with_("bodies.beam.displacement", shape)
    straight_between = {"x": [0.0, 0.1, 0.2, 0.3], "u": [0.0, 1.48e-4, 5.19e-4, 1.0e-3]}  # the same shape
    assert bent.with_("bodies.beam.displacement", straight_between).scene().bodies["beam"].length == 0.3
