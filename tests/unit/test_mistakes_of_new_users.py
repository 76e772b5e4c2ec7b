"""Mistakes of a first use: units, names and directions that run but cannot be meant, and pages of their results."""

from __future__ import annotations

import re
import warnings
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab import drilling, hopkinson
from impactlab.errors import CaseError, PluginError
from impactlab.metrics.collisions import MAX_PAIRS, agreement_texts
from impactlab.report.figures.signals import panels
from impactlab.report.figures.style import Trace
from tests.support import CASES


def test_a_table_in_milliseconds_without_a_unit_has_a_hint(tmp_path) -> None:
    text = (CASES / "measured_head.yaml").read_text()
    table = (CASES / "measured_head.csv").read_text()
    (tmp_path / "case.yaml").write_text(text)
    (tmp_path / "measured_head.csv").write_text(table)
    assert il.load_case(tmp_path / "case.yaml").hints == ()
    (tmp_path / "measured_head.csv").write_text(re.sub(r" \[[^]]*\]", "", table, count=3))
    (hint,) = il.load_case(tmp_path / "case.yaml").hints
    assert "2001 samples up to 100 s" in hint
    assert "reaches 3 of them" in hint
    assert "time [ms]" in hint


def test_bodies_that_no_contact_names_have_a_hint() -> None:
    rod = il.Rod(length=0.3, diameter=0.02, material="steel")
    bodies: dict[str, il.Rod | il.Mass] = {"hammer": il.Mass(1.0, velocity=1.0), "rod": rod}
    solve = {"duration": 1e-4, "tolerance": 1e-3}
    touching = [il.Contact("hammer", "rod.left")]
    assert il.Case(bodies=bodies, contacts=touching, solve=solve).hints == ()
    assert il.Case(bodies={"rod": rod}, solve=solve).hints == ()
    (hint,) = il.Case(bodies=bodies, solve=solve).hints
    assert hint.startswith("no contact includes 'hammer', 'rod', so nothing strikes them")
    (hint,) = il.Case(bodies={**bodies, "wall": il.Wall()}, contacts=touching, solve=solve).hints
    assert hint.startswith("no contact includes 'wall', so nothing strikes it")


def test_a_rod_with_all_sizes_in_millimetres_has_a_hint() -> None:
    bodies = {"hammer": il.Mass(1.0, velocity=1.0), "rod": il.Rod(length=300, diameter=20, material="steel")}
    case = il.Case(
        bodies=bodies, contacts=[il.Contact("hammer", "rod.left")], solve={"duration": 1e-4, "tolerance": 1e-3}
    )
    (hint,) = case.hints
    assert hint.startswith("bodies.rod: the section is 314.2 m2")
    assert case.with_("bodies.rod.diameter", "20 mm").hints == ()


def test_a_quake_of_metres_has_one_hint_for_all_pieces() -> None:
    case = il.load_case("smith_pile")
    assert case.hints == ()
    (hint,) = case.with_("contacts.2.law", quake=2.5).hints
    assert hint.startswith("shaft: the quake is 2.5 m")


def test_soil_that_cannot_bear_its_pile_has_a_hint() -> None:
    """The capacities of `smith_pile` are 0.9 MN at the toe and 0.6 MN along the shaft."""
    case = il.load_case("smith_pile")
    weak = case.with_("contacts.3.law", capacity=900.0)
    assert weak.hints == ()  # the shaft still bears it
    (hint,) = weak.with_("contacts.2.law", capacity=600.0).hints
    assert "the soil bears 1500 N in all, less than the weight 7.848e+04 N of 'pile'" in hint
    assert hint.endswith("is a unit missing, as in '150 kN'?")


def test_sizes_of_a_specimen_without_their_units_have_hints() -> None:
    case = il.load_case("hopkinson_copper")
    assert case.hints == ()
    for key, value, said in (
        ("length", 5.0, "the specimen is 5 m long"),
        ("area", 78.5, "78.5 m2, is larger than that of its bars, 0.0003142 m2"),
        ("young", 120.0, "at a strain of 2.5e"),
        ("flow.A", 300.0, "yields at 300 Pa"),
    ):
        (hint,) = case.with_(f"contacts.1.law.{key}", value).hints
        assert hint.startswith("incident.right|transmission.left: ")
        assert said in hint


def test_a_gauge_in_microstrain_has_its_unit_or_a_hint() -> None:
    """A range of 2000 in strain, over 14 bits, has steps of 0.24: the gauge would read nothing."""
    case = il.load_case("hopkinson_aluminium").with_("probes.0", noise="2 um/m", range="2000 µstrain", bits=14)
    assert case.hints == ()
    instrument = case.scene().probes[0].instrument
    assert instrument is not None
    assert (instrument.noise, instrument.range) == (2e-6, 2e-3)
    for key, value in (("noise", 2.0), ("range", 2000.0)):
        (hint,) = case.with_(f"probes.0.{key}", value).hints
        assert f"probes.0.{key}: {value:g} m/m" in hint
    with pytest.raises(CaseError, match="'2 um' is not a strain"):
        case.with_("probes.0.noise", "2 um")


def test_gravity_along_x_and_angles_in_degrees_of_a_mechanism_have_hints() -> None:
    case = il.load_case("two_link_arm")
    assert case.hints == case.with_("gravity", [0.0, -9.81]).hints == case.with_("gravity", [9.81, 0.0]).hints == ()
    (hint,) = case.with_("gravity", -9.81).hints
    assert hint.startswith("gravity: -9.81 m/s2 acts along x on 'robot'; is it meant downwards, [0, -9.81]?")
    (hint,) = case.with_("mechanisms.robot.links.0.angle", -5.0).hints
    assert hint == (
        "mechanisms.robot.links.0.angle: -5 rad is more than half a turn; is a unit missing, as in '-5 deg'?"
    )
    assert case.with_("mechanisms.robot.links.0.angle", "180 deg").hints == ()


def test_remedies_in_python_name_no_command() -> None:
    with pytest.raises(CaseError) as caught:
        il.Case(bodies={"ball": il.Mass(-1.0)}, solve={"duration": 1e-3})
    assert str(caught.value) == "bodies.ball.mass: -1 kg is out of range. Allowed: a number in kg above 0"
    with pytest.raises(CaseError, match="`impactlab check FILE` lists all faults"):
        il.load_case("two_rods").with_("solve.duration", -1.0)


def test_a_probe_that_no_case_has_and_an_invalid_signal_are_refused_with_the_right_form() -> None:
    case = il.load_case("axial_impact").method("continuous").with_("probes", [])
    with pytest.raises(CaseError, match="it has none\nGive the case a probe"):
        il.run(case).measured("strain:rod@0.1")
    with pytest.raises(CaseError, match=r"'1' is given where a signal is needed\nGive il\.Signal"):
        il.fit(case, ["1"], {"bodies.hammer.mass": (1.0, 3.0)})  # type: ignore[list-item]


def test_a_block_that_is_null_is_refused_and_to_be_left_out() -> None:
    with pytest.raises(CaseError, match=r"solve\.model: null is given where a block is needed.*leave the key out"):
        il.load_case("two_rods").with_("solve", model=None)


def test_a_contact_without_a_law_is_refused_with_the_laws_of_hard_contact() -> None:
    rod = il.Rod(length=0.3, diameter=0.02, material="steel")
    bodies: dict[str, il.Rod | il.Mass] = {"hammer": il.Mass(1.0, velocity=1.0), "rod": rod}
    solve = {"duration": 1e-4, "model": {"kind": "continuous"}}
    touching = [il.Contact("hammer", "rod.left")]
    with pytest.raises(CaseError, match=r"addition_deletion.*wave_identification.*tolerance"):
        il.Case(bodies=bodies, contacts=touching, solve=solve)
    for law, steps in (("addition_deletion", {}), ("wave_identification", {"step": {"dt": 1e-6}})):
        named = [il.Contact("hammer", "rod.left", {"kind": law})]
        assert il.run(il.Case(bodies=bodies, contacts=named, solve=solve | steps)).contacts


def test_an_integrator_in_place_of_a_law_is_named_as_one() -> None:
    with pytest.raises((CaseError, PluginError), match="it is an integrator"):
        il.load_case("axial_impact").with_("contacts.0.law", kind="moreau_jean")


def test_a_bundled_case_with_its_ending_is_found_in_the_remedy(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CaseError) as error:
        il.load_case("drill_rod.yaml")
    assert "'drill_rod', without its ending" in str(error.value)


def test_a_hammer_that_moves_away_is_named_and_not_the_duration_alone() -> None:
    away = il.load_case("drill_rod").with_settings({"bodies.hammer.velocity": "-10 m/s"})
    with pytest.warns(il.DoubtfulResult, match="'hammer', meets no body"):
        assert drilling.blow(away).work == 0.0


@pytest.mark.parametrize("mistake", [{"density": 8.0}, {"wave_speed": 5.0}])
def test_a_bar_in_other_units_is_unusual(mistake) -> None:
    with pytest.warns(il.UnusualValue, match="those of solids lie between"):
        hopkinson.Bar(**({"diameter": "20 mm", "wave_speed": 5000.0, "density": 8000.0} | mistake))


@pytest.mark.parametrize(("wave_speed", "density"), [(5000.0, 7850.0), (1700.0, 1190.0), (1400.0, 1140.0)])
def test_bars_of_steel_and_polymers_are_usual(wave_speed, density) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hopkinson.Bar(diameter="20 mm", wave_speed=wave_speed, density=density)


def test_many_pairs_that_agree_are_one_line() -> None:
    pairs = [{"resolved": True, "impulses_within": 1e-5 * i, "text": f"pair {i}"} for i in range(20)]
    pairs += [{"resolved": False, "impulses_within": None, "text": "a|b: methods disagree"}]
    texts = agreement_texts(pairs)
    assert len(texts) == MAX_PAIRS + 2
    assert texts[-2].startswith(f"{20 - MAX_PAIRS} more pairs of bodies: methods agree")
    assert "within 0.019 %" in texts[-2]
    assert texts[-1] == "a|b: methods disagree"


def test_signals_of_a_mechanism_are_its_angles_and_the_moment_of_its_drive() -> None:
    case = il.load_case("slider_crank").with_settings({"solve.duration": "0.2 ms"})
    shown = panels([Trace("base", il.run(case), "blue")], case.scene(), compared=False)
    found = {panel.title: (panel.unit, [line.name for line in panel.lines]) for panel in shown}
    assert found["Angle"] == ("rad", ["crank", "rod"])
    assert found["Moment of the drive, crank"] == ("N·m", ["crank"])
    assert all(np.all(np.isfinite(line.values)) for panel in shown for line in panel.lines)


def test_a_misspelt_key_is_not_reported_as_missing_as_well() -> None:
    with pytest.raises(CaseError) as caught:
        il.Case(bodies={"hammer": {"kind": "mass", "mas": 1.0}}, solve={"duration": 1.0}).resolved()
    assert "Did you mean 'mass'?" in str(caught.value)
    assert "missing" not in str(caught.value)


def test_a_match_is_shown_with_units_and_without_arrays() -> None:
    from impactlab.fits.result import Fitted
    from impactlab.piling.match import Match

    capacity = Fitted("capacity", 1.5e6, 1.4e6, 1.6e6, "N")
    damping = Fitted("toe.damping", 0.5, 0.4, 0.6, "s/m")
    velocity = np.array([0.0, 2.0])
    match = Match(capacity, (damping,), None, None, velocity, velocity, velocity, None)
    assert repr(match) == (
        "<Match of 2 samples, mismatch 0 %: capacity 1.5 MN (1.4 to 1.6 MN), toe.damping 0.5 s/m (0.4 to 0.6)>"
    )


STRUCK = {
    "bodies": {"hammer": il.Mass(1.0, velocity=1.0), "rod": il.Rod(length=0.3, diameter=0.02, material="steel")},
    "contacts": [il.Contact("hammer", "rod.left")],
    "solve": {"duration": 1e-4, "tolerance": 1e-3},
}


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"contacts": [("hammer", "rod.left")]}, "contacts.0: a list of 2 is given where a block.*\nWrite {between: "),
        ({"contacts": [il.Contact(il.Mass(1.0), "rod.left")]}, "between.0: {kind: .*the name of a face.*\nName a face"),  # type: ignore[arg-type]
        ({"probes": ["stress:rod@0.1"]}, "probes.0: .*\nWrite {body: ..., at: ..., quantity"),
        (
            {"probes": [il.Probe("rod", 0.1, "deflection")]},
            "'deflection' is not allowed here. Did you mean 'displacement'",
        ),
        ({"snapshots": 100}, "snapshots: 100 is not allowed here\nGive a list of times"),
        ({"bodies": {"rod": il.Rod(length=[0.3, 0.4])}}, "bodies.rod.length: a list of 2 .*\nGive one value; a sweep"),  # type: ignore[arg-type]
        (
            {"bodies": {"rod": il.Rod(ends={"left": {"force": abs}})}},
            "rod.ends.left.force: a value of type .*\nWrite a for",
        ),
    ],
)
def test_slips_in_the_keys_of_a_case_are_told_what_to_write(keys: dict[str, Any], said: str) -> None:
    with pytest.raises(CaseError, match=said):
        il.Case(**{**STRUCK, **keys})


def test_slips_in_reading_a_run_are_told_what_to_write() -> None:
    case = il.Case(**STRUCK)
    history, force = il.run(case), "force:hammer|rod.left"
    for slip, said in (
        (lambda: history.evaluate(force, 1e-5), "not a time .*\nGive numbers in s, such as 1e-5, in this order"),
        (lambda: history.evaluate(1e-5, [force, force]), "not the name of one channel\n.*evaluate_each"),
        (lambda: history.evaluate_each(1e-5, force), "is one channel, and evaluate_each takes a list"),
        (lambda: history.field("rod", [1e-5, 2e-5], "stress"), "2 times are given.*\nfields_at"),
        (lambda: il.plot_sweep(history, "peak_force"), "takes the result of a sweep, not ContinuousHistory"),
        (lambda: case.with_("mass", 2.0), "'mass' is not known here. It is a key of a body: write bodies.hammer.mass"),
        (lambda: case.with_settings(None), "not paths with values"),
    ):
        with pytest.raises(il.ImpactlabError, match=said):
            slip()
    assert history.evaluate_each(1e-5, [force]).shape == (1, 1)
