"""Sweeps: axes and points, quantities against single runs, faults as points, folders that are resumed."""

from __future__ import annotations

import json
import logging
import os
import pickle
import re
import shlex
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

import impactlab as il
from impactlab.contact.penalty import Penalty
from impactlab.metrics.collisions import collisions
from impactlab.plugins import LAWS, QUANTITIES, Entry, Registry, registry
from impactlab.sweeps import axes, axis_texts, chunks, counts, engines, points, run
from impactlab.sweeps.quantities import contact_loss, quantities_of, values
from tests.solving import in_steps
from tests.support import PAPER, invoke

MASS, GAP = "bodies.hammer.mass", "contacts.0.gap"


@pytest.fixture(scope="module")
def case() -> il.Case:
    return il.load_case(PAPER).method("continuous")


def test_a_grid_has_a_dimension_per_axis_and_the_values_of_single_runs(case):
    masses, gaps = np.geomspace(0.5, 5.0, 3), ["0 mm", "0.1 mm"]
    times = [2e-5, 4e-5]
    names = ["restitution", "contacts", "peak_force", "impulse", "first_opening", "time_in_contact", "final_velocity"]
    names += ["final_energy", "final_momentum", "energy_gain", "near_grazing"]
    found = il.sweep(case, {MASS: masses, GAP: gaps}, quantities=[*names, il.Sampled("force:hammer|rod.left", times)])
    assert found["restitution"].dims == (MASS, GAP, "pair")
    assert found[MASS].attrs["units"] == "kg"
    assert found[GAP].values.tolist() == [0.0, 1e-4]
    assert counts(found) == {"completed": 6}
    for mass in masses:
        history = il.run(case.with_settings([(MASS, float(mass)), (GAP, "0.1 mm")]))
        span, *_ = history.contacts
        point = found.sel({MASS: mass, GAP: 1e-4})
        assert point["contacts"].item() == len(history.contacts)
        assert point["first_opening"].item() == pytest.approx(span.end or np.nan, rel=0.0, nan_ok=True)
        assert point["impulse"].item() == sum(each.impulse for each in history.contacts)
        assert point["peak_force"].item() == max(each.peak_force for each in history.contacts)
        assert point["time_in_contact"].item() == sum(
            each.until(history.duration) - each.start for each in history.contacts
        )
        expected = collisions(history)[0].restitution  # None while still closed at the end of the run
        assert point["restitution"].item() == pytest.approx(
            np.nan if expected is None else expected, rel=0, nan_ok=True
        )
        assert point["final_momentum"].sel(body="hammer").item() == pytest.approx(
            mass * point["final_velocity"].values[0]
        )
        assert point["final_energy"].sum().item() == pytest.approx(0.5 * mass, rel=1e-12)
        assert point["energy_gain"].item() < 1e-12
        assert point["near_grazing"].item() == float("near_grazing" in [warned.code for warned in history.warnings])
        sampled = point["force:hammer|rod.left"]
        assert sampled.attrs["units"] == "N"
        assert sampled.values.tolist() == history.evaluate(times, "force:hammer|rod.left").tolist()


def test_listed_points_and_words(case, tmp_path):
    file = tmp_path / "points.csv"
    file.write_text("bodies.hammer.mass [g], contacts.0.law.kind\n500, wave_identification\n1000, penalty\n")
    found = il.sweep(case, points=axis_texts.read_points(file), quantities=["peak_force"])
    assert found["peak_force"].dims == ("point", "contact")
    assert found[MASS].values.tolist() == [0.5, 1.0]
    assert found["contacts.0.law.kind"].values.tolist() == ["wave_identification", "penalty"]
    expected = il.run(case.with_settings([(MASS, 1.0), ("contacts.0.law.kind", "penalty")])).contacts[0].peak_force
    assert found["peak_force"].values[1, 0] == expected


def test_a_column_of_plain_numbers_is_headed_by_the_unit_1(case, tmp_path):
    """So the draws of a fit are written."""
    file, stiffness = tmp_path / "points.csv", "contacts.0.law.stiffness.relative"
    file.write_text(f"{stiffness} [1]\n2.5\n")
    soft = case.with_("contacts.0.law", kind="penalty", stiffness={"relative": 1.0})
    found = il.sweep(soft, points=axis_texts.read_points(file), quantities=["peak_force"])
    assert found[stiffness].values.tolist() == [2.5]


KINDS = {"contacts.0.law.kind": ["penalty", "hertz"], "contacts.0.law.stiffness": [1e9, 1e12]}


def test_a_kind_with_the_keys_of_its_block_is_a_grid(case):
    """A law of another kind has no stiffness of its own: that of the other axis is checked with it."""
    found = il.sweep(case, KINDS, quantities=["peak_force"])["peak_force"].values[..., 0]
    for row, kind in zip(found, KINDS["contacts.0.law.kind"], strict=True):
        for peak, stiffness in zip(row, KINDS["contacts.0.law.stiffness"], strict=True):
            single = il.run(case.with_("contacts.0.law", kind=kind, stiffness=stiffness))
            assert peak == max(span.peak_force for span in single.contacts)
    other = il.sweep(case, dict(reversed(KINDS.items())), quantities=["peak_force"])["peak_force"].values[..., 0]
    assert other.T.tolist() == found.tolist()


def test_kinds_with_their_keys_are_listed_points(case):
    base = case.with_("contacts.0.law", kind="addition_deletion")  # without a stiffness
    found = il.sweep(base, points=KINDS, quantities=["peak_force"])
    assert found["contacts.0.law.stiffness"].attrs.get("units", "") == ""  # N/m of one, N/m^1.5 of the other
    assert (
        found["peak_force"].values[1, 0]
        == il.sweep(case, KINDS, quantities=["peak_force"])["peak_force"].values[1, 1, 0]
    )


def test_a_key_that_one_of_the_kinds_lacks_is_refused(case):
    with pytest.raises(il.CaseError, match="'stiffness' is not known"):
        il.sweep(case, {**KINDS, "contacts.0.law.kind": ["penalty", "addition_deletion"]}, quantities=["peak_force"])


def test_an_axis_of_methods():
    found = il.sweep(il.load_case(PAPER), {"method": ["base", "continuous"]}, quantities=["contacts"])
    assert found["method"].values.tolist() == ["base", "continuous"]
    assert found["contacts"].values.ravel().tolist()[1] == 2.0


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("bodies.hammer.mass=1, 2 kg", [1, "2 kg"]),
        ("bodies.hammer.mass=100 g:0.3 kg:3", [0.1, 0.2, 0.3]),
        ("bodies.hammer.mass=0.1:10:3log", [0.1, 1.0, 10.0]),
        ("contacts.0.law={kind: penalty, stiffness: 1e9},{kind: wave_identification}", None),
    ],
)
def test_axes_of_the_command_line(case, text, values):
    path, found = axis_texts.read_over(case, text)
    assert path == text.partition("=")[0]
    assert found == pytest.approx(values) if values and "kg" not in str(values) else len(found) == 2


def test_an_axis_of_a_key_that_the_case_turns_into_others_is_in_si():
    """The force of a hard contact begins with Z v, which goes with the square of the diameter of the rod."""
    rod = {"kind": "rod", "length": "0.3 m", "diameter": "20 mm", "material": "steel"}
    case = il.Case.from_dict(
        {"schema_version": 1, "bodies": {"hammer": {"kind": "mass", "mass": 0.7, "velocity": 1.0}, "rod": rod},
         "contacts": [{"between": ["hammer", "rod.left"], "law": {"kind": "addition_deletion"}}],
         "solve": {"duration": "0.1 ms", "model": {"kind": "continuous"}}}
    )  # fmt: skip
    path, given = axis_texts.read_over(case, "bodies.rod.diameter=10 mm:30 mm:3")
    assert given == pytest.approx([0.01, 0.02, 0.03])
    found = il.sweep(case, {path: ["10 mm", "20 mm", 0.03]}, quantities=["peak_force"])
    assert found[path].values == pytest.approx([0.01, 0.02, 0.03])
    assert found[path].attrs["units"] == "m"
    peaks = found["peak_force"].values.ravel()
    assert peaks / peaks[0] == pytest.approx([1.0, 4.0, 9.0])


@pytest.mark.parametrize(
    ("over", "words"),
    [
        ({"bodies.hammer.mas": [1.0]}, "Did you mean 'mass'?"),
        ({MASS: []}, "this axis has no values"),
        ({MASS: [1.0, float("nan")]}, "nan is not a finite number"),
        ({MASS: [1.0, -1.0]}, "-1 kg is out of range"),
        ({MASS: ["1 m"]}, "bodies.hammer.mass"),
        ({"method": ["penalt"]}, "Did you mean 'penalty'?"),
        ({}, "a sweep without an axis"),
        (None, "a sweep takes axes or listed points"),
    ],
)
def test_wrong_axes_are_refused_before_the_first_run(case, over, words, monkeypatch):
    for module in (points, engines):
        monkeypatch.setattr(module, "row", lambda *_: pytest.fail("a run was started"))
    with pytest.raises(il.CaseError) as raised:
        il.sweep(case, over)
    assert words in str(raised.value)


def test_a_channel_named_as_a_quantity_is_refused_with_the_form_of_an_extreme(case):
    """'strain' was answered with the list of quantities alone."""
    with pytest.raises(il.CaseError, match=r'il.Sampled\("strain:BODY@X", times\)'):
        il.sweep(case, {MASS: [1.0]}, quantities="strain")


def test_a_run_that_is_refused_or_fails_is_a_point_without_values(case):
    found = il.sweep(case, {"contacts.0.law": [{"kind": "wave_identification"}, {"kind": "hertz", "stiffness": 1e9}],
                            "bodies.rod.ends.left": ["free", {"mass": 1.0}]}, quantities=["impulse"])  # fmt: skip
    status = found["status"].values
    assert chunks.STATUSES[status[0, 0]] == "completed"
    assert chunks.STATUSES[status[0, 1]] == "refused"
    assert "both faces have mass" in str(found["reason"].values[0, 1])
    assert np.isnan(found["impulse"].values[0, 1]).all()


HANGS = "FOLDER_OF_RUNS_THAT_HANG"  # an environment variable: each run that hangs writes a file there


@dataclass(frozen=True)
class Faulty(Penalty):  # type: ignore[misc]
    """A law that hangs or kills its process where its stiffness says so."""

    examples: ClassVar[tuple[dict[str, Any], ...]] = ({},)

    def begin(self, left, right, dt):
        if self.stiffness == 1.0:
            os.kill(os.getpid(), signal.SIGKILL)
        if self.stiffness == 2.0:
            if HANGS in os.environ:
                Path(os.environ[HANGS], str(time.time_ns())).touch()
            time.sleep(120.0)
        return super().begin(left, right, dt)


def faulty_case() -> il.Case:
    entries = (*registry().entries, Entry(LAWS.name, "faulty", f"{__name__}:Faulty", "tests"))
    text = {"schema_version": 1, **il.load_case(PAPER).method("penalty").document.data}
    text["contacts"] = [{"between": ["hammer", "rod.left"], "law": {"kind": "faulty", "stiffness": 1e9}}]
    text.pop("methods", None)
    made = PAPER.parent / "none.yaml"
    from impactlab.casefile.case import case_of
    from impactlab.casefile.document import Document

    return case_of("faulty", str(made), Document(text, {}), registry=Registry(entries))


@pytest.mark.slow
def test_a_run_that_hangs_or_crashes_is_one_point(monkeypatch):
    monkeypatch.setattr(engines, "POINT_LIMIT_S", 20.0)  # the first run of a process loads and compiles
    monkeypatch.setattr(points, "tree_hash", lambda _: "tests")
    monkeypatch.setattr(run, "size_of_chunk", lambda *_: 2)
    found = il.sweep(
        faulty_case(), {"contacts.0.law.stiffness": [1e9, 1.0, 2.0, 2e9]}, quantities=["contacts"], workers=2
    )
    assert [chunks.STATUSES[each] for each in found["status"].values] == ["completed", "crashed", "hung", "completed"]
    assert np.isnan(found["contacts"].values.ravel()).tolist() == [False, True, True, False]


@pytest.mark.slow
def test_a_first_run_that_crashes_does_not_end_the_sweep(monkeypatch):
    monkeypatch.setattr(points, "tree_hash", lambda _: "tests")
    found = il.sweep(faulty_case(), {"contacts.0.law.stiffness": [1.0, 1e9]}, quantities=["contacts"], workers=1)
    assert [chunks.STATUSES[each] for each in found["status"].values] == ["crashed", "completed"]


def test_figures_show_each_label_and_refuse_other_axes(case):
    found = il.sweep(
        case, {MASS: np.geomspace(1.0, 4.0, 3), GAP: [0.0, 1e-4, 2e-4]}, quantities=["contacts", "impulse"]
    )
    line = il.plot_sweep(found.isel({GAP: 0}), "impulse").axes[0]
    unit = 1e-3 if "mN" in line.get_ylabel() else 1.0
    assert line.lines[0].get_ydata() * unit == pytest.approx(found["impulse"].values[:, 0, 0])
    assert line.get_xscale() == "log"
    panel, bar = il.plot_sweep(found, "contacts").axes
    assert panel.get_title() == "hammer|rod.left" or panel.get_title(loc="left") == "hammer|rod.left"
    numbers = np.array([float(tick.get_text()) for tick in bar.get_yticklabels()])
    colours = panel.collections[0].get_array().astype(int)
    assert numbers[colours].tolist() == found["contacts"].values[..., 0].T.tolist()
    with pytest.raises(il.CaseError, match="Did you mean 'impulse'"):
        il.plot_sweep(found, "impuls")


def test_figures_of_several_axes_and_of_listed_points_have_a_panel_for_each_number(case):
    """In a grid the line of an axis is the mean over all others; listed points have dots only."""
    masses, gaps, speeds = [2.0, 1.0], [0.0, 1e-4], [1.0, 2.0, 3.0]
    speed = "bodies.hammer.velocity"
    found = il.sweep(case, {MASS: masses, GAP: gaps, speed: speeds}, quantities=["impulse"])
    values = found["impulse"].values[..., 0]
    panels = il.plot_sweep(found, "impulse").axes[:3]
    unit = 1e-3 if "mN" in panels[0].get_ylabel() else 1.0
    for number, axis in enumerate((masses, gaps, speeds)):
        dots, means = panels[number].lines
        expected = values.mean(axis=tuple({0, 1, 2} - {number}))
        assert means.get_ydata() * unit == pytest.approx(expected[np.argsort(axis)])
        assert np.sort(dots.get_ydata() * unit) == pytest.approx(np.sort(values.ravel()))
    dots = panels[0].lines[0]
    assert dots.get_ydata()[dots.get_xdata() == 2.0] * unit == pytest.approx(values[0].ravel())
    listed = il.sweep(case, points={MASS: [2.0, 1.0], GAP: [0.0, 1e-4]}, quantities=["impulse"])
    one, other = il.plot_sweep(listed, "impulse").axes
    assert [len(axes.lines) for axes in (one, other)] == [1, 1]
    assert one.lines[0].get_xdata().tolist() == [2.0, 1.0]


def test_edges_stand_between_sequences_of_contacts_and_failed_points_are_hatched(case):
    found = il.sweep(case, {MASS: [1.0, 2.0, 3.0], GAP: [0.0, 1e-4, 2e-4]}, quantities=["contacts"])
    counted = found["contacts"].values[..., 0]
    counted[:] = [[1, 1, 1], [1, 2, 2], [1, 2, np.nan]]
    found["status"].values[2, 2] = chunks.STATUSES.index("failed")
    panel = il.plot_sweep(found, "contacts").axes[0]
    edges, hatched = panel.patches
    ends = edges.get_path().vertices.reshape(-1, 4)
    gap = 1e6 if "\N{MICRO SIGN}m" in panel.get_ylabel() else 1e3
    lines = [[1.5, 0.5e-4 * gap, 1.5, 2.5e-4 * gap], [1.5, 0.5e-4 * gap, 3.5, 0.5e-4 * gap]]
    assert np.sort(ends, axis=0) == pytest.approx(np.sort(lines, axis=0))
    assert hatched.get_hatch()
    corners = hatched.get_path().vertices
    assert (corners.min(axis=0), corners.max(axis=0)) == (
        pytest.approx([2.5, 1.5e-4 * gap]),
        pytest.approx([3.5, 2.5e-4 * gap]),
    )


PAGE = (PAPER.parents[1] / "docs" / "sweeps.md").read_text(encoding="utf-8")


def test_the_page_runs_as_printed(monkeypatch, capsys):
    monkeypatch.chdir(PAPER.parents[1])
    [code, at_gauge, *_], [command, *_] = (
        re.findall(rf"```{kind}\n(.*?)```", PAGE, flags=re.DOTALL) for kind in ("python", "sh")
    )
    names: dict[str, Any] = {}
    exec(code, names)
    assert capsys.readouterr().out.strip() == str(names["found"]["contacts"].values[:, 0, 0])
    exec(at_gauge, names)
    # In the middle of the rod the second wave from the mass, (1 + exp(-2)) v0/c at its front, meets the first one
    # on its way back from the clamp, of which exp(-1) is left; the mass weighs as much as the rod.
    strains = np.sqrt(2 * 9.81 * names["height"]) / np.sqrt(2.1e11 / 7900)
    shares = 1.0 + np.exp(-1.0) + np.exp(-2.0)
    np.testing.assert_allclose(names["largest"], strains * shares, rtol=1e-9)
    result = invoke(*shlex.split(command)[1:])
    assert (result.exit_code, "hammer|rod.left" in result.stdout) == (0, True)
    assert set(registry().names(QUANTITIES)) == set(re.findall(r"`(\w+)`", PAGE.partition("## Quantities")[2])) & set(
        registry().names(QUANTITIES)
    )


SWEEP = """
import sys, numpy as np, impactlab as il
from impactlab.sweeps import run
run.size_of_chunk = lambda *_: 5
case = il.load_case(sys.argv[1]).method("continuous")
il.sweep(case, {"bodies.hammer.mass": np.geomspace(0.2, 20.0, 200)}, quantities=["restitution"], out=sys.argv[2])
"""


@pytest.mark.slow
def test_a_killed_sweep_goes_on_and_gives_the_same_bits(tmp_path, case, monkeypatch):
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    monkeypatch.setattr(run, "size_of_chunk", lambda *_: 5)
    grid = {MASS: np.geomspace(0.2, 20.0, 200)}
    il.sweep(case, grid, quantities=["restitution"], out=whole)
    process = subprocess.Popen([sys.executable, "-c", SWEEP, str(PAPER), str(killed)])
    while not list(killed.glob("chunks/*.npz")) and process.poll() is None:
        time.sleep(0.01)
    process.kill()
    process.wait()
    unfinished = il.open_sweep(killed)
    assert 0 < counts(unfinished)["completed"] < 200
    first = min((killed / "chunks").glob("*.npz"))
    written = first.stat().st_mtime_ns
    il.sweep(case, grid, quantities=["restitution"], out=killed)
    assert first.stat().st_mtime_ns == written  # finished chunks are not computed again
    known = il.open_sweep(whole)["restitution"]
    assert 0 < np.isnan(known).sum() < 100  # heavy masses have not parted at the end of the run
    assert np.array_equal(il.open_sweep(killed)["restitution"], known, equal_nan=True)
    assert (killed / "table.csv").read_bytes() == (whole / "table.csv").read_bytes()
    with pytest.raises(il.CaseError, match="different: axes"):
        il.sweep(case, {MASS: [1.0]}, quantities=["restitution"], out=killed)


def test_a_sweep_without_a_folder_prints_its_rows_as_json():
    arguments = ["--over", f"{MASS}=1,2", "--quantities", "impulse,first_opening", "--json"]
    short = ["--set", "solve.duration.round_trips=1"]  # the contact does not open
    result = invoke("sweep", str(PAPER), "--method", "continuous", *arguments, *short)
    first, second = json.loads(result.stdout)["rows"]
    assert first[f"{MASS} [kg]"] == 1.0
    assert first["impulse of hammer|rod.left [N s]"] == pytest.approx(1.0 - np.exp(-2.0 * 2.133), rel=1e-9)
    assert second["status"] == "completed"
    assert second["first_opening of hammer|rod.left [s]"] is None


def test_workers_give_the_bits_of_one_process_and_the_command_the_same_file(case, tmp_path, monkeypatch):
    monkeypatch.setattr(run, "size_of_chunk", lambda *_: 3)
    masses = np.linspace(1.0, 2.0, 7)
    alone = il.sweep(case, {MASS: masses}, quantities=["impulse"])
    assert alone.equals(il.sweep(case, {MASS: masses}, quantities=["impulse"], workers=2))
    arguments = ["--over", f"{MASS}=1:2:7", "--quantities", "impulse", "--out", str(tmp_path / "s"), "--json"]
    result = invoke("sweep", str(PAPER), "--method", "continuous", *arguments)
    assert json.loads(result.stdout) == {"schema_version": 1, "points": 7, "status": {"completed": 7}}
    kept = il.open_sweep(tmp_path / "s")
    assert alone.equals(kept)
    assert f"--over {MASS}=1:2:7 --quantities impulse --method continuous" in kept.attrs["command"]


def test_a_sweep_of_a_pile_gives_forces_and_sets_by_the_names_of_its_soil():
    case = il.load_case("smith_pile").with_("solve.model", {"kind": "finite_element", "elements": 40, "mass": "lumped"})
    wanted = ["largest_force", "smallest_force", "permanent_set"]
    found = il.sweep(case, {"bodies.ram.velocity": [3.0, 4.5]}, quantities=wanted)
    history = il.run(case.with_("bodies.ram.velocity", 3.0))
    links = {link.name: link for link in history.links}
    assert {"shaft", "toe"} <= set(links)
    for name, link in links.items():
        point = found.isel({"bodies.ram.velocity": 0}).sel(link=name)
        assert point["largest_force"] == pytest.approx(link.largest)
        assert point["smallest_force"] == pytest.approx(link.smallest)
        assert (point["permanent_set"] == pytest.approx(link.set)) if link.set is not None else True
    toe = found["permanent_set"].sel(link="toe").to_numpy().ravel()
    assert toe[1] > toe[0] > 0.0


def test_the_loss_of_a_contact_is_that_of_newtons_rule():
    """Two masses that part with e times their approach: mu v2 (1 - e2)/2; a dashpot: the energy that is gone."""
    masses = {"a": il.Mass(1.0, velocity=2.0), "b": il.Mass(3.0)}
    law = {"kind": "impulse_momentum", "restitution": 0.5}
    steps = {"duration": 1e-3, "integrator": {"kind": "newmark"}, "step": {"dt": 1e-5}}
    struck = il.Case(bodies=masses, contacts=[il.Contact("a", "b", law)], solve=steps)
    for restitution in (0.0, 0.5, 1.0):
        history = il.run(struck.with_("contacts.0.law.restitution", restitution))
        lost = contact_loss(history.scene, history)
        assert lost == pytest.approx(0.5 * 0.75 * 2.0**2 * (1.0 - restitution**2), abs=1e-12)
    rod = il.Rod(length=0.3, diameter=0.02, material="steel", ends={"right": "clamped"})
    damped = il.Contact("a", "rod.left", {"kind": "penalty", "stiffness": 2e8, "damping": 2e3})
    exact = {"duration": 3e-4, "model": {"kind": "continuous"}}
    history = il.run(il.Case(bodies={"a": il.Mass(1.0, velocity=2.0), "rod": rod}, contacts=[damped], solve=exact))
    ends = history.energy_ends()
    assert contact_loss(history.scene, history) == pytest.approx(ends.initial - ends.final, rel=1e-12)
    assert 0.0 < ends.final < 0.95 * ends.initial


def test_a_named_contact_has_its_largest_force_by_its_name(case):
    contacts = case.document.data["contacts"]
    named = case.with_("contacts", [{**contacts[0], "name": "cushion"}, *contacts[1:]])
    found = il.sweep(named, {MASS: [1.0, 2.0]}, quantities=["largest_force", "peak_force"])
    assert found["link"].values[0] == "cushion"
    assert found["largest_force"].values[:, 0].tolist() == found["peak_force"].values[:, 0].tolist()
    assert np.all(found["largest_force"].values[:, 0] > 0.0)


def test_several_contacts_of_one_name_have_the_largest_force_of_their_sum():
    balls = {f"ball_{k}": {"kind": "mass", "mass": 1e-3, "velocity": 1.0} for k in (1, 2)}
    blow = {"gap": 0.0, "law": {"kind": "hertz", "stiffness": 5e9}}
    twice = il.Case.from_dict(
        {
            "schema_version": 1,
            "bodies": {**balls, "wall_1": {"kind": "wall"}, "wall_2": {"kind": "wall"}},
            "contacts": [{**blow, "between": [f"ball_{k}", f"wall_{k}"], "name": "stop"} for k in (1, 2)],
            "solve": in_steps("0.1 ms", "central_difference", dt="0.2 us"),
        }
    )
    found = il.sweep(twice, {"bodies.ball_1.mass": [1e-3]}, quantities=["largest_force", "peak_force"])
    assert found["link"].values.tolist() == ["stop"]
    assert found["largest_force"].item() == pytest.approx(2.0 * found["peak_force"].values[0, 0], rel=1e-3)


def test_a_case_without_a_contact_has_no_value_of_contacts(tmp_path):
    case = il.load_case("step_loaded_rod")
    over = {"solve.duration": [1e-4, 2e-4]}
    found = il.sweep(case, over, out=tmp_path / "s")
    assert counts(found) == {"completed": 2}
    assert found["peak_force"].shape == (2, 0)
    assert np.all(np.isfinite(found["final_velocity"].values))
    assert il.open_sweep(tmp_path / "s").identical(found)
    header = (tmp_path / "s" / "table.csv").read_text().splitlines()[0]
    assert header == "solve.duration [s],final_velocity of rod [m/s],energy_gain,near_grazing,status,reason"
    with pytest.raises(il.CaseError, match="peak_force has no values: the case has no contact"):
        il.plot_sweep(found, "peak_force")


def row_of_beads(count: int) -> il.Case:
    bodies = {"striker": il.Mass(1e-3, velocity=0.5), "bead": il.Mass(1e-3, repeat=count), "wall": il.Wall()}
    chain = il.Chain(["striker", "bead", "wall"], {"kind": "hertz", "stiffness": 5e9}, gap=0.0)
    return il.Case(bodies=bodies, contacts=[chain], solve=in_steps("0.2 ms", "central_difference", dt="0.5 us"))


@pytest.mark.parametrize("form", ["over", "points"])
def test_a_sweep_over_the_number_of_bodies_keeps_the_names_of_all_points(form):
    counted = {"bodies.bead.repeat": [2, 4]}
    found = il.sweep(row_of_beads(3), **{form: counted}, quantities=["impulse", "final_velocity", "contacts"])
    assert counts(found) == {"completed": 2}
    assert found["body"].values.tolist() == ["striker", "bead_1", "bead_2", "bead_3", "bead_4"]
    names = found["contact"].values.tolist()
    for row, number in zip(found["impulse"].values, (2, 4), strict=True):
        history = il.run(row_of_beads(number))
        own = [contact.name for contact in history.scene.contacts]
        there = dict(zip(names, row.tolist(), strict=True))
        assert [there[name] for name in own] == [history.impulse_of(name) for name in own]
        assert all(np.isnan(there[name]) for name in names if name not in own)


def test_a_run_with_a_contact_that_a_sweep_does_not_have_is_refused_by_its_name():
    wanted = quantities_of(row_of_beads(2).scene(), ["impulse"], registry())
    longer = row_of_beads(4)
    with pytest.raises(il.CaseError, match=r"no place for impulse of 'bead_2\|bead_3'"):
        values(il.run(longer), wanted, registry())


def test_a_contact_whose_name_holds_a_place_is_the_same_at_all_points():
    case = il.load_case("beam_on_three_stops")
    places = [["first", f"beam.at({x})"] for x in (0.2, 0.25)]
    first, other = (case.with_("contacts.0.between", place) for place in places)
    wanted = quantities_of(first.scene(), ["impulse"], registry())
    history = il.run(other)
    [row] = values(history, wanted, registry())
    assert row == [history.impulse_of(contact.name) for contact in history.scene.contacts]


def test_a_sweep_that_is_no_batch_names_the_segments_that_are_one_piece(caplog):
    segments = [{"length": length, "area": 1e-3, "material": "steel"} for length in (0.2, 0.3)]
    striking = il.Case(
        bodies={"ball": il.Mass(1.0, velocity=1.0), "rod": il.Rod(segments=segments)},
        contacts=[il.Contact("ball", "rod.left", {"kind": "addition_deletion"})],
        solve={"duration": 1e-5, "model": {"kind": "continuous"}},
    )
    with caplog.at_level(logging.INFO):
        il.sweep(striking, {"bodies.ball.mass": np.linspace(1.0, 2.0, 250)}, quantities=["contacts"])
    assert "neighbouring segments of 'rod' have the same section and material" in caplog.text


def test_the_cases_that_the_check_of_one_axis_builds_are_those_that_run(case):
    grid = axes.grid(case, {MASS: ["1 kg", 2.0]})
    for number, value in enumerate(["1 kg", 2.0]):
        assert grid.case(case, number) is grid.axes[0].case(case, value)
    assert grid.case(case, 1).scene().bodies["hammer"].rigid_mass == 2.0
    other = case.with_("bodies.hammer.velocity", 3.0)  # they are of their case alone
    assert grid.case(other, 1).scene().bodies["hammer"].velocity == 3.0
    sent = pickle.loads(pickle.dumps(grid))  # to a worker, which builds its own
    assert sent == grid
    assert sent.axes[0].checked is None
    both = axes.grid(case, {MASS: [1.0, 2.0], GAP: ["0 mm", "0.1 mm"]})
    assert both.case(case, 3).scene().contacts[0].gap == 1e-4
    many = axes.grid(case, {MASS: np.linspace(1.0, 2.0, 1500)})
    assert many.axes[0].checked is None
