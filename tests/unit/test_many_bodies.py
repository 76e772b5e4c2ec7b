"""Runs of many bodies: what console, page and files show of them; set-up that shares the description of like beads."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.api import reference_of
from impactlab.casefile import build
from impactlab.casefile import case as case_module
from impactlab.errors import CaseError
from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.setup.build import junctions
from impactlab.history.frame import frames, groups
from impactlab.printing import counted
from impactlab.report.figures import differences
from impactlab.report.figures.drawn_part import MAX_DRAWN, drawn_part
from impactlab.report.figures.stage import layout
from impactlab.report.figures.style import Trace
from impactlab.simulate.plan import prepare
from tests.solving import in_steps, mesh
from tests.support import invoke

N = 250
TEXT = f"""
schema_version: 1
bodies:
  striker: {{kind: mass, mass: 4.0e-3, velocity: 1.0}}
  bead: {{repeat: {N}, kind: mass, mass: 4.0e-3}}
contacts:
  - chain: [striker, bead]
    law: {{kind: hertz, stiffness: 7.7e9}}
solve: {{duration: 5e-5, integrator: {{kind: central_difference}}, step: {{dt: 1e-6}}}}
"""


def chain() -> il.Case:
    bodies = {"striker": il.Mass(4e-3, velocity=1.0), "bead": il.Mass(4e-3, repeat=N)}
    contacts = [il.Chain(["striker", "bead"], {"kind": "hertz", "stiffness": 7.7e9})]
    solve = {"duration": 5e-5, "integrator": {"kind": "central_difference"}, "step": {"dt": 1e-6}}
    return il.Case(bodies=bodies, contacts=contacts, solve=solve)


def test_a_run_of_many_bodies_is_summed_up(tmp_path: Path) -> None:
    file = tmp_path / "many.yaml"
    file.write_text(TEXT, encoding="utf-8")
    result = invoke("run", str(file), "--out", str(tmp_path / "out"))
    assert result.exit_code == 0, result.output
    assert len(result.output.splitlines()) < 60
    assert f"... {N + 1 - 7} more bodies, position " in result.output
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert len(summary["final"]["bodies"]) == N + 1
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert f"{MAX_DRAWN} of {N} contacts" in page
    with np.load(tmp_path / "out" / "history.npz") as arrays:
        assert f"force:bead_{N - 1}|bead_{N}" in arrays


def test_faces_that_overlap_by_rounding_are_not_reported_as_never_met() -> None:
    """Ahead of the wave the overlap is the power 3/2 of itself from bead to bead: the smallest gap was -1e-13 m."""
    case = chain().with_("solve.duration", 4e-4)
    texts = [each.text for each in il.run(case).warnings if each.code == "no_contact"]
    assert "too little for a contact" in texts[0]
    assert "m at most" in texts[0]
    assert not any("smallest gap was -" in text for text in texts)
    assert "the faces touch at the start, but no force reached them" in texts[-1]


def test_a_step_longer_than_the_run_is_not_called_too_little_for_a_contact() -> None:
    """The striker ends 1 mm inside the first bead, without a force."""
    case = chain().with_settings({"solve.step": {"dt": 1e-3}, "solve.duration": 1e-3})
    text = next(each.text for each in il.run(case).warnings if each.code == "no_contact")
    assert text == (
        "striker|bead_1: the faces overlap by 0.001 m at the end of the run: they meet within its last step"
    )


def test_a_large_case_is_not_checked_in_silence(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Ten thousand beads took four seconds before the first word; a hundred thousand half a minute."""
    monkeypatch.setattr(case_module, "MIN_LOGGED", N)
    monkeypatch.setattr(case_module, "_said", [])
    chain(), chain()
    assert [each.getMessage() for each in caplog.records] == [
        f"checking {N + 1} bodies and their contacts: about a second for each 10000 ..."
    ]


def test_check_prints_a_few_of_many_contacts(tmp_path: Path) -> None:
    file = tmp_path / "many.yaml"
    file.write_text(TEXT, encoding="utf-8")
    result = invoke("check", str(file))
    assert f"... {N - 7} more (all of them: --json), bead_{N - 2}|bead_{N - 1}" in result.output
    assert max(map(len, result.output.splitlines())) < 200
    document = json.loads(invoke("check", str(file), "--json").output)
    assert len(document["resolved"]["derived"]["contacts"]) == N


def test_a_page_draws_contacts_spread_over_the_case() -> None:
    scene = chain().scene()
    part, words = drawn_part(scene)
    assert len(part.contacts) == MAX_DRAWN
    assert (part.contacts[0], part.contacts[-1]) == (scene.contacts[0], scene.contacts[-1])
    assert all(point.body in part.bodies for contact in part.contacts for point in (contact.left, contact.right))
    assert words
    assert drawn_part(part) == (part, "")


def test_a_page_draws_probes_spread_over_the_case() -> None:
    """Beside a reference each probe is a panel: 500 took 36 s to draw."""
    bodies = {"bar": il.Rod(length=1.0, diameter=0.02, material="steel", velocity=1.0), "wall": il.Wall()}
    probes = [il.Probe("bar", 0.01 * i, "stress") for i in range(MAX_DRAWN + 20)]
    solve = {"duration": "0.1 ms", "model": {"kind": "continuous"}}
    scene = il.Case(bodies=bodies, contacts=[], probes=probes, solve=solve).scene()
    part, words = drawn_part(scene)
    assert len(part.probes) == MAX_DRAWN
    assert (part.probes[0], part.probes[-1]) == (scene.probes[0], scene.probes[-1])
    assert (part.bodies, part.contacts) == (scene.bodies, scene.contacts)
    assert f"{MAX_DRAWN} of {MAX_DRAWN + 20} probes" in words


def test_many_contacts_of_a_bar_are_read_and_drawn_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Warnings took 25 times as long as the solving, and the wave diagram 170 times: a call for each contact."""
    calls: list[str] = []
    evaluate = ContinuousHistory.evaluate

    def counting(self: ContinuousHistory, t: Any, channel: str) -> Any:
        calls.append(channel)
        return evaluate(self, t, channel)

    monkeypatch.setattr(ContinuousHistory, "evaluate", counting)
    bar = il.Rod(length=0.1, diameter=0.02, material="steel", velocity=1.0)
    bodies, hard = {"left": il.Wall(), "bar": bar, "right": il.Wall()}, {"kind": "addition_deletion"}
    contacts = [il.Contact("left", "bar.left", hard, gap=1e-5), il.Contact("bar.right", "right", hard, gap=1e-5)]
    run = il.run(il.Case(bodies=bodies, contacts=contacts, solve={"duration": 0.02, "model": {"kind": "continuous"}}))
    assert len(calls) < 0.2 * len(run.contacts)
    spans, (axis, *_) = run.contacts, run.plot_xt().axes
    drawn, closings, openings = (line.get_xydata() for line in axis.lines)
    assert len(spans) > 100
    assert np.isfinite(drawn[:, 0]).all()
    assert np.count_nonzero(np.isnan(drawn[:, 1])) == len(spans)  # each line ends there
    assert drawn[::3, 1].tolist() == pytest.approx([1e3 * span.start for span in spans])
    assert len(closings) + len(openings) == len(run.events)


def test_a_page_of_many_rods_draws_the_beginning_of_their_row(monkeypatch: pytest.MonkeyPatch) -> None:
    rod = {"length": "0.25 m", "area": "2 cm^2", "material": "steel"}
    bodies = {"first": il.Rod(**rod, velocity=1.0), "bar": il.Rod(**rod, repeat=MAX_DRAWN + 20)}
    row = [il.Chain(["first", "bar"], {"kind": "wave_identification"})]
    scene = il.Case(bodies=bodies, contacts=row, solve={"duration": "0.1 ms", "model": {"kind": "continuous"}}).scene()
    assert drawn_part(scene) == (scene, "")  # waves pass through all of them
    most = MAX_DRAWN + 10
    monkeypatch.setattr("impactlab.report.figures.drawn_part.MAX_RODS", most)
    part, words = drawn_part(scene)
    assert part.contacts == scene.contacts[:most]
    assert list(part.bodies) == ["first", *(f"bar_{i}" for i in range(1, most + 1))]
    assert f"{most} of {MAX_DRAWN + 20} contacts" in words
    places = layout(part)
    assert places[f"bar_{most}"].x == pytest.approx(0.25 * most)  # end to end, without lanes between them


def test_differences_of_many_faces_have_few_panels_and_a_scale_that_is_not_rounding() -> None:
    rod = {"length": "0.25 m", "area": "2 cm^2", "material": "steel"}
    bodies = {"first": il.Rod(**rod, velocity=1.0), "bar": il.Rod(**rod, repeat=9)}
    row = [il.Chain(["first", "bar"], {"kind": "addition_deletion"})]
    model = {"kind": "finite_element", "elements": 10, "mass": "lumped"}
    step = {"integrator": {"kind": "central_difference"}, "step": {"courant": 0.9}}
    history = il.run(il.Case(bodies=bodies, contacts=row, solve={"duration": "0.2 ms", "model": model, **step}))
    reference = reference_of(history.scene, history.method)
    assert reference is not None
    figure = differences.difference([Trace("mesh", history, "#000000", reference=reference.history)], history.scene)
    panels = [axis for axis in figure.axes if axis.get_visible()]
    assert len(panels) == differences.MAX_PANELS  # of 18 faces
    # Waves of the mesh run ahead of those of the continuum: faces that have not moved yet have no scale of their own.
    assert max(float(np.max(axis.lines[0].get_ydata())) for axis in panels) < 100.0  # type: ignore[arg-type]


def test_like_beads_share_their_description_and_others_do_not() -> None:
    plan = prepare(*chain().simulation())
    assert plan.steppers["bead_1"] is plan.steppers["bead_2"]
    assert plan.steppers["bead_1"] is not plan.steppers["striker"]  # it moves at the start
    assert plan.steppers["bead_1"] is not plan.steppers[f"bead_{N}"]  # it has one face
    assert plan.built["bead_1"].body.name == "bead_1"
    assert plan.built["bead_2"].body.name == "bead_2"


def test_motion_does_not_depend_on_data_that_beads_share() -> None:
    """Masses that differ in their last digit share nothing, and move the same to rounding."""
    one = il.run(chain())
    masses = {"each": [4e-3 * (1.0 + (i % 2) * 3e-16) for i in range(N)]}
    other = il.run(chain().with_("bodies.bead.mass", masses))
    names = [f"velocity:bead_{i}" for i in (1, 2, 3)]
    values = [[float(history.evaluate(5e-5, name)) for name in names] for history in (one, other)]
    np.testing.assert_allclose(values[0], values[1], rtol=1e-12)


def test_a_long_chain_is_one_group_found_once() -> None:
    scene = chain().scene()
    assert groups(scene) is groups(scene)
    [group] = groups(scene)
    assert set(group.bodies) == set(scene.bodies)
    assert frames(scene)["bead_7"] is group


def test_one_method_is_not_counted_as_methods() -> None:
    assert (counted(1, "method"), counted(9, "method")) == ("1 method", "9 methods")


def test_the_table_of_a_sweep_of_a_chain_is_cut_on_the_screen(tmp_path):
    """Every contact and body has columns of its own: of 30 beads the table was 93 columns wide."""
    path = tmp_path / "chain.yaml"
    case = il.Case(
        bodies={"striker": il.Mass(4e-3, velocity=1.0), "bead": il.Mass(4e-3, repeat=30)},
        contacts=[il.Chain(["striker", "bead"], {"kind": "hertz", "stiffness": 7.7e9})],
        solve={"duration": 1e-4, "integrator": {"kind": "central_difference"}, "step": {"dt": 1e-6}},
    )
    path.write_text(case.to_yaml(), encoding="utf-8")
    arguments = ["sweep", str(path), "--over", "contacts.0.law.stiffness=5e9,7e9"]
    whole = invoke(*arguments, "--quantities", "peak_force,final_velocity")
    assert whole.exit_code == 0
    assert " ... " in whole.stdout
    assert "status" in whole.stdout
    assert "64 columns; --quantities names fewer" in whole.stderr  # the axis, 30 forces, 31 velocities, status, reason
    few = invoke(*arguments, "--quantities", "energy_gain")
    assert " ... " not in few.stdout
    assert "columns" not in few.stderr


@pytest.mark.parametrize("count", [3, 30])
def test_gravity_of_a_case_is_found_as_often_for_many_rods_as_for_few(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Gravity walks over all bodies and contacts: once for each rod, 2000 rods took 23 s to check."""
    calls = []
    found = build.gravity_of
    monkeypatch.setattr(build, "gravity_of", lambda case: calls.append(1) or found(case))
    row_of_rods(count, elements=5).scene()
    assert len(calls) == 1


def test_bodies_too_large_together_are_refused_by_the_sum_of_all() -> None:
    with pytest.raises(CaseError) as refused:
        il.run(row_of_rods(200, elements=2000))
    assert refused.value.path == "solve.model.elements"
    assert refused.value.text.startswith(
        "200 bodies in coordinates, the largest with 2000 elements of 'rod_1', take about 250 MB. Allowed: "
    )


def test_nodes_joined_by_contacts_share_a_junction_numbered_by_its_first_node() -> None:
    """The numbers are those of relabelling every node at every contact."""
    rng = np.random.default_rng(4)
    for _ in range(100):
        count = int(rng.integers(1, 20))
        pairs = [(int(a), int(b)) for a, b in rng.integers(0, count, (int(rng.integers(0, 15)), 2))]
        label = list(range(count))
        for a, b in pairs:
            label = [label[a] if value == label[b] else value for value in label]
        known = {value: number for number, value in enumerate(dict.fromkeys(label))}
        assert junctions(count, pairs).tolist() == [known[value] for value in label]


def row_of_rods(count: int, elements: int) -> il.Case:
    """Return a row of steel rods struck by a mass, on meshes."""
    return il.Case(
        bodies={
            "striker": il.Mass(1.0, velocity=1.0),
            "rod": il.Rod(length=0.1, area=1e-4, material={"young": 2e11, "density": 7800.0}, repeat=count),
        },
        contacts=[il.Chain(["striker", "rod"], {"kind": "penalty", "stiffness": 1e8})],
        solve=in_steps(1e-4, "central_difference", mesh(elements, "lumped"), courant=0.9),
    )
