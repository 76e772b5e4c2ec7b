"""Runs as labelled data and as files: xarray, NetCDF, pandas, CSV; a file opened again is the same run."""

from __future__ import annotations

import csv
import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

import impactlab as il
from impactlab.casefile.document import parse_yaml
from impactlab.errors import CaseError, ImpactlabError
from impactlab.files import open_netcdf, read_netcdf, write_netcdf, write_tables
from impactlab.history import AbstractHistory, sampling
from impactlab.history.sampled import SampledHistory
from impactlab.history.sampling import file_times, frame_times, page_times
from impactlab.metrics.collisions import collisions
from impactlab.scene.method import Simulation
from tests.support import CASES, invoke


def ran(name: str, method: str = "base", **settings: Any) -> AbstractHistory:
    return il.run(il.load_case(CASES / f"{name}.yaml").method(method).with_settings(settings), frames=24)


@pytest.fixture(scope="module")
def struck() -> AbstractHistory:
    """Return the mass on the clamped rod, solved exactly."""
    return ran("axial_impact", "continuous")


def test_channels_have_the_dimensions_contact_and_time(struck: AbstractHistory) -> None:
    data = struck.to_xarray(points=501)
    force = data.contact_force.sel(contact="hammer|rod.left")
    assert force.dims == ("time",)
    assert np.array_equal(force, struck.evaluate(data.time, "force:hammer|rod.left"))
    assert (force.attrs["units"], data.time.attrs["units"], data.gap.attrs["units"]) == ("N", "s", "m")
    assert force.attrs["long_name"] == "contact force, positive in compression"
    stress = data.stress.sel(stress_at="rod@0.15")
    assert np.array_equal(stress, struck.evaluate(data.time, "stress:rod@0.15"))
    assert data.stress_at_x.sel(stress_at="rod@0.15") == 0.15
    unitless = [name for name in data.data_vars if "units" not in data[name].attrs and data[name].dtype == float]
    assert unitless == ["period_kicks"]


def test_fields_have_the_dimensions_body_place_and_frame(struck: AbstractHistory) -> None:
    data = struck.to_xarray()
    field = data.stress_field.sel(body="rod")
    times = np.union1d(frame_times(struck.duration), struck.scene.snapshots)
    assert np.array_equal(data.frame, times)
    for number in (0, 77, len(times) - 1):
        there = struck.field("rod", times[number], "stress")
        assert np.array_equal(field.isel(frame=number), there.values)
        assert np.array_equal(data.x.sel(body="rod"), there.x)
    assert data.x.attrs["units"] == "m"


def test_bodies_of_unlike_grids_stand_in_one_array() -> None:
    models = {"bar_1": {"kind": "finite_element", "elements": 10}, "bar_2": {"kind": "finite_element", "elements": 20}}
    bars = {
        name: il.Rod(length=1.0, area=1e-4, material="steel", velocity=v)
        for name, v in zip(models, (1.0, 0.0), strict=True)
    }
    case = il.Case(
        bodies=bars,
        contacts=[il.Contact("bar_1.right", "bar_2.left", {"kind": "penalty", "stiffness": 1e8})],
        solve={"duration": "100 us", "models": models},
    )
    history = il.run(case, frames=10)
    data = history.to_xarray()
    assert data.velocity_field.shape == (2, 21, 11)
    assert np.isnan(data.velocity_field.sel(body="bar_1")[11:]).all()
    kept = SampledHistory.of(history)
    for name in models:
        ours, there = kept.field(name, 5e-5, "strain"), history.field(name, 5e-5, "strain")
        assert np.array_equal(ours.x, there.x)
        assert ours.values == pytest.approx(there.values, rel=1e-12)
    with pytest.raises(
        ImpactlabError, match=r"velocity along 'bar_1' at 5\.2e-05 s was not kept; kept are displacement"
    ):
        kept.field("bar_1", 5.2e-5, "velocity")
    with pytest.raises(ImpactlabError, match=r"channel .strain:bar_1@0\.5. was not kept"):
        kept.evaluate(0.0, "strain:bar_1@0.5")


RUNS = [
    ("axial_impact", "continuous"),
    ("axial_impact", "impulse_momentum"),  # no force: NaN
    ("sphere_on_beam", "base"),
    ("hopkinson_aluminium", "base"),  # a link that yields
    ("step_loaded_rod", "central_difference"),  # its energies at the end are those of no instant of the book
]


def test_a_file_that_cannot_be_written_is_an_error_of_ours(tmp_path: Path, struck: AbstractHistory) -> None:
    with pytest.raises(ImpactlabError, match=r"there is no folder '.*no' to write in"):
        struck.to_netcdf(tmp_path / "no" / "run.nc")
    with pytest.raises(ImpactlabError, match="cannot be written"):
        struck.to_netcdf(tmp_path)


@pytest.mark.parametrize(("name", "method"), RUNS, ids=lambda each: each)
def test_a_file_opened_again_is_the_same_run(tmp_path: Path, name: str, method: str) -> None:
    history = ran(name, method)
    history.to_netcdf(tmp_path / "run.nc")
    kept, again = SampledHistory.of(history), il.open_netcdf(tmp_path / "run.nc")
    assert again.channels() == history.channels()
    t = page_times(history.duration)
    for channel in history.channels():
        assert np.array_equal(again.evaluate(t, channel), history.evaluate(t, channel), equal_nan=True)
    for body, fields in kept.fields.items():
        assert np.array_equal(again.fields[body].times, fields.times)
        assert np.array_equal(again.fields[body].x, fields.x)
        assert again.fields[body].values.keys() == fields.values.keys()
        for quantity, values in fields.values.items():
            assert np.array_equal(again.fields[body].values[quantity], values)
    assert (again.events, again.contacts) == (history.events, history.contacts)
    assert (again.warnings, again.cost, again.dt) == (history.warnings, history.cost, history.dt)
    assert (again.links, again.changes) == (history.links, history.changes)
    assert (again.load_impulses, again.energy_ends()) == (history.load_impulses, history.energy_ends())
    for contact in history.scene.contacts:
        assert again.impulse_of(contact.name) == history.impulse_of(contact.name)
    for each in ("balance", "total", "work"):
        assert np.array_equal(getattr(again.energy, each), getattr(history.energy, each))
    assert again.energy.scale == history.energy.scale
    assert (again.scene.bodies, again.scene.contacts, again.method) == (
        history.scene.bodies,
        history.scene.contacts,
        history.method,
    )
    assert again.case.to_yaml() == history.case.to_yaml()
    assert (again.case.label, again.case.method_name) == (history.case.label, history.case.method_name)
    if name == "hopkinson_aluminium":
        again.to_netcdf(tmp_path / "again.nc")
        assert il.open_netcdf(tmp_path / "again.nc").to_xarray().identical(again.to_xarray())


def test_summary_texts_and_reference_are_kept(tmp_path: Path) -> None:
    from impactlab import api

    case = il.load_case(CASES / "axial_impact.yaml")
    summary, reference = api.summarised(case, history := il.run(case))
    write_netcdf(tmp_path / "run.nc", history, summary, reference, {"command": "impactlab run x"})
    kept = read_netcdf(tmp_path / "run.nc")
    assert kept.summary == json.loads(json.dumps(summary))
    assert kept.texts == {"command": "impactlab run x"}
    assert kept.reference[:1] + kept.reference[2:] == reference[:1] + reference[2:]
    t = page_times(history.duration)
    channel = "force:hammer|rod.left"
    assert np.array_equal(kept.reference.history.evaluate(t, channel), reference.history.evaluate(t, channel))


def test_files_that_hold_no_run_are_named(tmp_path: Path, struck: AbstractHistory) -> None:
    with pytest.raises(ImpactlabError, match="there is no file"):
        open_netcdf(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text("no data")
    with pytest.raises(ImpactlabError, match="is not a NetCDF file"):
        open_netcdf(tmp_path / "text.nc")
    given = struck.to_xarray().attrs  # the case and its format stand beside the numbers
    others = {name: value for name, value in given.items() if name != "impactlab_format"}
    xarray.Dataset(attrs=others).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    with pytest.raises(ImpactlabError, match="holds no run in format 1"):
        open_netcdf(tmp_path / "other.nc")
    scene = il.run(Simulation(struck.scene, struck.method))
    scene.to_netcdf(tmp_path / "scene.nc")
    with pytest.raises(ImpactlabError, match="a scene without a case"):
        open_netcdf(tmp_path / "scene.nc")
    wrong = given | {"summary": "{}", "texts": "{}", "case": given["case"].replace("2.133", "-2.133")}
    xarray.Dataset(attrs=wrong).to_netcdf(tmp_path / "wrong.nc", engine="h5netcdf")
    with pytest.raises(CaseError, match=r"bodies\.hammer\.mass"):
        open_netcdf(tmp_path / "wrong.nc")


@pytest.mark.parametrize("missing", ["xarray", "h5netcdf"])
def test_without_the_extra_the_command_that_installs_it_is_named(
    tmp_path: Path, struck: AbstractHistory, missing: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, missing, None)
    made = struck.to_xarray if missing == "xarray" else lambda: struck.to_netcdf(tmp_path / "run.nc")
    with pytest.raises(il.ExtraError, match=rf"need {missing}.*\npip install 'impactlab\[data\]'") as caught:
        made()
    assert isinstance(caught.value, ImportError)


def test_a_file_is_the_dataset_of_its_history_and_needs_no_xarray(
    tmp_path: Path, struck: AbstractHistory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Dimensions, coordinates, values, units and attributes, also of records of which there are none."""
    quiet = il.run(il.Case(bodies={"ball": il.Mass(1.0, velocity=1.0)}, solve={"duration": 1.0, "step": {"dt": 0.1}}))
    for history in (struck, quiet):
        with monkeypatch.context() as without:
            without.setitem(sys.modules, "xarray", None)
            history.to_netcdf(tmp_path / "run.nc")
        with xarray.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as kept:
            whole = dict(history.to_xarray(points=kept.time.size).attrs)
            assert {name: kept.attrs[name] for name in whole} == whole
            assert kept.drop_attrs(deep=False).identical(
                history.to_xarray(points=kept.time.size).drop_attrs(deep=False)
            )


@pytest.mark.parametrize("points", [["force:hammer|rod.left"], 1, 2.5, None])
def test_the_number_of_instants_is_a_whole_number(struck: AbstractHistory, points: Any) -> None:
    for made in (struck.to_pandas, struck.to_xarray):
        with pytest.raises(CaseError, match=r"points: .* is not allowed\nGive a whole number from 2 to"):
            made(points)


def test_tables(tmp_path: Path, struck: AbstractHistory) -> None:
    table = struck.to_pandas(points=101)
    assert table.index.name == "time"
    assert table.attrs["units"]["stress:rod@0.15"] == "Pa"
    assert np.array_equal(table["position:hammer"], struck.evaluate(table.index, "position:hammer"))
    spans = struck.contacts_table
    assert spans.impulse.sum() == pytest.approx(sum(span.impulse for span in struck.contacts))
    assert spans.attrs["units"]["peak_force"] == "N"
    write_tables(tmp_path, struck)
    with (tmp_path / "contacts.csv").open() as file:
        headings, *rows = csv.reader(file)
    assert headings[:4] == ["contact", "start [s]", "end [s]", "impulse [N s]"]
    assert [float(row[3]) for row in rows] == [span.impulse for span in struck.contacts]
    with (tmp_path / "probes.csv").open() as file:
        headings, *rows = csv.reader(file)
    assert headings[0] == "time [s]"
    column = headings.index("stress:rod@0.15 [Pa]")
    t = page_times(struck.duration)
    assert [float(row[column]) for row in rows] == struck.evaluate(t, "stress:rod@0.15").tolist()


def test_files_of_a_long_chain_hold_fewer_instants_and_no_table_of_its_forces(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A chain of 300 beads has 300 forces, and more channels than a small file has room for."""
    written = (CASES.parent / "impactlab" / "casefile" / "starters" / "chain.yaml").read_text(encoding="utf-8")
    (tmp_path / "chain.yaml").write_text(re.sub(r"repeat: \d+", "repeat: 300", written), encoding="utf-8")
    history = il.run(il.load_case(tmp_path / "chain.yaml"))
    write_tables(tmp_path, history)
    with (tmp_path / "probes.csv").open() as file:
        headings = next(csv.reader(file))
    assert headings == ["time [s]", "velocity:bead_25@0 [m/s]"]
    monkeypatch.setattr(sampling, "MAX_NUMBERS", 150 * len(history.channels()))
    history.to_netcdf(tmp_path / "chain.nc")
    kept = open_netcdf(tmp_path / "chain.nc")
    assert xarray.open_dataset(tmp_path / "chain.nc").sizes["time"] == 150
    t = sampling.page_times(history.duration, 150)
    assert np.array_equal(kept.evaluate(t, "position:bead_3"), history.evaluate(t, "position:bead_3"))


def test_a_file_of_few_channels_has_all_instants_and_one_of_many_has_enough() -> None:
    assert file_times(1.0, 10).size == page_times(1.0).size
    assert file_times(1.0, 40_000).size == 250
    assert file_times(1.0, 10**7).size == 101


def test_the_fields_of_many_rods_have_fewer_places_in_a_file_and_the_same_values_there(
    struck: AbstractHistory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, kept = tmp_path / "whole.nc", tmp_path / "kept.nc"
    struck.to_netcdf(whole)
    quantities = 3  # displacement, velocity and stress of one rod
    monkeypatch.setattr(sampling, "MAX_FIELDS", 21 * quantities * (sampling.FRAMES + 1))
    struck.to_netcdf(kept)
    assert xarray.open_dataset(whole).sizes["place"] == 401
    assert xarray.open_dataset(kept).sizes["place"] == 21
    found = open_netcdf(kept).field("rod", struck.duration, "stress")
    assert np.array_equal(found.x, np.linspace(0.0, 0.3, 21))
    assert np.array_equal(found.values, struck.field("rod", struck.duration, "stress", found.x).values)
    assert sampling.places_in_file(10**9, 401) == sampling.MIN_PLACES


def test_the_text_of_a_history_describes_it(struck: AbstractHistory) -> None:
    text = repr(struck)
    assert text.startswith("<ContinuousHistory of 'axial_impact', method 'continuous': 0.000349121 s, ")
    assert "periods of contact: 2" in text
    assert "near_grazing" in text


def files_of(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    "case",
    [
        ["axial_impact", "--method", "impulse_momentum"],
        pytest.param(["hopkinson_chain"], marks=pytest.mark.slow),
    ],
)
def test_a_file_opened_again_gives_the_same_page(tmp_path: Path, case: list[str]) -> None:
    command = ["run", str(CASES / f"{case[0]}.yaml"), *case[1:], "--out", str(tmp_path / "run")]
    for arguments in (command, ["report", str(tmp_path / "run" / "history.nc"), "--out", str(tmp_path / "again")]):
        done = invoke(*arguments)
        assert done.exit_code == 0, done.output
    one, other = files_of(tmp_path / "run"), files_of(tmp_path / "again")
    assert one.keys() == other.keys()
    assert {"index.html", "history.nc", "contacts.csv", "probes.csv", "summary.json"} <= one.keys()
    # Compressed files hold the time of writing; history.npz has more instants than the file.
    differing = [name for name in one if one[name] != other[name]]
    assert [name for name in differing if name not in ("history.nc", "history.npz")] == []


def test_a_file_without_texts_gives_a_page(tmp_path: Path, struck: AbstractHistory) -> None:
    struck.to_netcdf(tmp_path / "run.nc")
    done = invoke("report", str(tmp_path / "run.nc"), "--out", str(tmp_path / "page"))
    assert done.exit_code == 0, done.output
    assert "Axial impact of a rigid mass" in (tmp_path / "page" / "index.html").read_text(encoding="utf-8")
    missing = invoke("report", str(tmp_path / "none.nc"), "--out", str(tmp_path / "page"))
    assert missing.exit_code == 2
    assert "there is no file" in missing.output


def test_a_file_gives_no_energies_of_collisions_that_its_run_does_not_give(tmp_path: Path) -> None:
    # Energies of a stepped run are lines between fewer instants than a file has: a shorter collision lies on one line.
    history = il.run(il.load_case("slider_crank"))
    history.to_netcdf(tmp_path / "run.nc")
    again = il.open_netcdf(tmp_path / "run.nc")
    [one], [other] = (collisions(each) for each in (history, again))
    assert (one.energy_lost, other.energy_lost) == (None, None)
    assert other.energy_given == pytest.approx(one.energy_given, rel=1e-6)


ROD = {"length": 0.3, "diameter": 0.02, "ends": {"right": "clamped"}}
BEAM = il.Beam(length=0.3, section={"width": 0.01, "height": 0.01}, material="steel", ends={"left": "clamped"})


@pytest.mark.parametrize(
    ("body", "face", "duration", "time"),
    [
        (il.Rod(**ROD, material="steel", damping={"stiffness": "1e-6 s"}), "left", 1.5e-4, 0.75e-4),
        (il.Rod(**ROD, material={"young": 2.1e11, "density": 7850, "viscosity": 2e5}), "left", 1.5e-4, 0.75e-4),
        (BEAM, "right", 2e-3, 1e-3),
    ],
    ids=["damped rod", "viscous rod", "beam"],
)
def test_fields_of_stress_and_strain_of_a_file_are_those_of_the_run(tmp_path, body, face, duration, time):
    """Damping by stiffness adds to the stress, as viscosity does: the strain does not follow from it."""
    history = il.run(
        il.Case(
            bodies={"hammer": il.Mass(0.2, velocity=1.0), "body": body},
            contacts=[il.Contact("hammer", f"body.{face}", {"kind": "penalty", "stiffness": 1e8})],
            solve={
                "duration": duration,
                "model": {"kind": "finite_element", "elements": 30},
                "integrator": {"kind": "newmark"},
                "step": {"dt": duration / 300},
            },
        ),
        frames=4,
    )
    history.to_netcdf(tmp_path / "run.nc")
    again = il.open_netcdf(tmp_path / "run.nc")
    for quantity in ("strain", "stress") if body is BEAM else ("strain", "stress", "force"):
        found, wanted = (each.field("body", time, quantity).values for each in (again, history))
        assert found == pytest.approx(wanted, rel=1e-12, abs=1e-12 * np.abs(wanted).max()), quantity


def test_the_summary_of_a_run_in_python_is_that_of_the_command(tmp_path: Path, struck: AbstractHistory) -> None:
    summary = struck.summary()
    assert summary["contacts"][0]["impulse"] == struck.contacts[0].impulse
    assert json.loads(json.dumps(summary)) == summary
    struck.to_netcdf(tmp_path / "run.nc")
    saved = il.open_netcdf(tmp_path / "run.nc")
    assert saved.summary()["contacts"] == summary["contacts"]
    with pytest.raises(ImpactlabError, match=r"no errors.*\n.*summary\(reference=True\)"):
        saved.summary(reference=True)


def test_the_summary_has_the_errors_of_a_comparison() -> None:
    case = il.load_case(CASES / "axial_impact.yaml")
    (row,) = il.compare(case, ["base"]).rows
    assert il.run(case).summary()["errors"] == row.summary["errors"]
    assert row.summary["errors"]["reference"] == "st_venant"


def test_a_table_longer_than_a_case_file_may_hold_is_read_back(tmp_path: Path) -> None:
    """A force over time of 12,600 points is 25,200 values; a case file has at most 25,000."""
    time = np.linspace(0.0, 1e-3, 12_600)
    pushed = {"force": {"t": time.tolist(), "f": (1e3 * np.sin(1e4 * time)).tolist()}}
    rod = il.Rod(length=1.0, area=1e-4, material={"young": 2.1e11, "density": 7850.0}, ends={"left": pushed})
    solve = {
        "duration": 1e-5,
        "model": {"kind": "finite_element", "elements": 4},
        "integrator": {"kind": "newmark"},
        "step": {"courant": 1.0},
    }
    case = il.Case(bodies={"rod": rod}, contacts=[], solve=solve)
    il.run(case).to_netcdf(tmp_path / "long.nc")
    assert open_netcdf(tmp_path / "long.nc").case.document.data == case.document.data
    with pytest.raises(CaseError, match="more than 25000 values"):
        parse_yaml(case.to_yaml())
