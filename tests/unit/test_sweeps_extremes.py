"""The largest and the least value of a channel as quantities of a sweep, against the waves of a mass on a free rod.

A mass M with the velocity v on a rod of impedance Z sends the strain (v/c) exp(-t Z/M). At the place x of a gauge
the compression is largest as its front arrives; tension is largest as the front comes back from the free end, when
exp(-2 (L - x) Z/(c M)) - 1 of it is left.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import impactlab as il
from tests.support import invoke

pytestmark = pytest.mark.usefixtures("_no_figures")

YOUNG, DENSITY, AREA, LENGTH, AT, MASS = 2.1e11, 7900.0, 1e-4, 1.0, 0.3, 0.5
SPEED = math.sqrt(YOUNG / DENSITY)
VELOCITY = "bodies.hammer.velocity"
CONTINUOUS = {"model": {"kind": "continuous"}}
MESH = {
    "model": {"kind": "finite_element", "elements": 400, "mass": "lumped"},
    "integrator": {"kind": "central_difference"},
    "step": {"courant": 1.0},
}
LOSS_IN_A_CELL = 2.0 * LENGTH / 400 * DENSITY * AREA / MASS  # of the force, while the wave passes an element and back


def case(solve: dict[str, object] = CONTINUOUS) -> il.Case:
    material = {"young": YOUNG, "density": DENSITY}
    return il.Case(
        bodies={"hammer": il.Mass(MASS, velocity=1.0), "rod": il.Rod(length=LENGTH, area=AREA, material=material)},
        contacts=[il.Contact("hammer", "rod.left", {"kind": "addition_deletion"})],
        solve={"duration": 1.8 * LENGTH / SPEED, **solve},
        probes=[{"body": "rod", "at": AT, "quantity": each} for each in ("strain", "stress")],
    )


def tension(at: float) -> float:
    """Return the least strain at a place, over v/c."""
    return math.exp(-2.0 * (LENGTH - at) * DENSITY * AREA / MASS) - 1.0


@pytest.mark.parametrize("duration", [1.8, 1.8033])
def test_the_extremes_of_a_force_are_found_where_the_last_step_reaches_beyond_the_end(duration: float) -> None:
    """Every point of such a sweep failed: "the time lies outside the run"."""
    soft = {"contacts.0.law": {"kind": "hertz", "stiffness": 1e9}, "solve.step": {"courant": 0.9}}
    struck = case(MESH).with_settings({**soft, "solve.duration": duration * LENGTH / SPEED})
    force = "force:hammer|rod.left"
    found = il.sweep(struck, {VELOCITY: [1.0]}, quantities=[f"max({force})", f"min({force})", "peak_force"])
    assert found["reason"].values.tolist() == [""]
    assert found[f"max({force})"].item() == pytest.approx(found["peak_force"].item(), rel=1e-12)
    assert found[f"min({force})"].item() == 0.0


@pytest.mark.parametrize(("solve", "tolerance"), [(CONTINUOUS, 1e-9), (MESH, LOSS_IN_A_CELL)])
def test_the_extremes_at_a_gauge_are_those_of_the_waves(solve: dict[str, object], tolerance: float) -> None:
    velocities = [1.0, 3.0]
    exact = {
        f"{of}({channel}:rod@{AT})": share * scale
        for of, share in (("max", 1.0), ("min", tension(AT)))
        for channel, scale in (("strain", 1.0 / SPEED), ("stress", YOUNG / SPEED))
    }
    found = il.sweep(case(solve), {VELOCITY: velocities}, quantities=list(exact))
    for name, value in exact.items():
        np.testing.assert_allclose(found[name].values, value * np.array(velocities), rtol=tolerance)
        assert found[name].attrs["units"] == ("1" if "strain" in name else "Pa")


def test_a_continuous_rod_needs_no_probe() -> None:
    found = il.sweep(case(), {VELOCITY: [2.0]}, quantities="min(strain:rod@0.55)")["min(strain:rod@0.55)"]
    assert found.item() == pytest.approx(2.0 * tension(0.55) / SPEED, rel=1e-9)


def test_the_end_of_a_rod_has_its_channel_for_any_length() -> None:
    """The name has six digits: "x = 12.3457 m lies outside the body 'rod'. Allowed: 0 to 12.3457 m"."""
    name, hard = "max(velocity:rod@12.3457)", {"law": {"kind": "addition_deletion"}}
    contacts = [{"between": ["hammer", "rod.left"], **hard}, {"between": ["rod.right", "wall"], "gap": "1 m", **hard}]
    walled = case().with_("bodies.wall", {"kind": "wall"}).with_("contacts", contacts)
    struck = walled.with_settings({"bodies.rod.length": 12.3456789, "solve.duration": 1.5 * 12.3456789 / SPEED})
    found = il.sweep(struck, {VELOCITY: [2.0]}, quantities=name)[name]
    assert found.item() == pytest.approx(4.0, rel=1e-9)  # a free end moves with twice the velocity of the wave


def test_a_mesh_has_the_channels_of_its_probes_alone() -> None:
    with pytest.raises(il.CaseError, match=r"no run has the channel 'strain:rod@0.55'"):
        il.sweep(case(MESH), {VELOCITY: [2.0]}, quantities="max(strain:rod@0.55)")


def test_a_delay_line_has_the_channels_of_its_probes_alone() -> None:
    """Its points all failed, without a word in Python: a continuous rod in steps keeps what is probed."""
    cushion = {"kind": "hertz", "stiffness": 1e9}
    stepped = case().with_settings({"contacts.0.law": cushion, "solve.step": {"dt": 1e-6}})
    with pytest.raises(il.CaseError, match=r"no run has the channel 'strain:rod@0.55'"):
        il.sweep(stepped, {VELOCITY: [2.0]}, quantities="max(strain:rod@0.55)")


def test_a_sweep_without_any_values_warns_with_the_first_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise il.ImpactlabError("the roof fell in", remedy="")

    monkeypatch.setattr("impactlab.sweeps.points.api.run", fail)
    with pytest.warns(il.DoubtfulResult, match="no point of the sweep has values. The first: the roof fell in"):
        il.sweep(case(MESH), {VELOCITY: [2.0, 3.0]}, quantities="impulse")


def test_a_word_that_is_no_channel_is_refused() -> None:
    with pytest.raises(il.CaseError, match=r"'speed:rod@0.3' is not a channel"):
        il.sweep(case(), {VELOCITY: [2.0]}, quantities="max(speed:rod@0.3)")


def test_the_command_line_takes_extremes(tmp_path: Path) -> None:
    file, out = tmp_path / "mass.yaml", tmp_path / "out"
    file.write_text(case().to_yaml(), encoding="utf-8")
    name = f"max(strain:rod@{AT})"
    given = ["sweep", str(file), "--over", f"{VELOCITY}=1,2", "--quantities", f"contacts,{name}", "--out", str(out)]
    result = invoke(*given)
    assert result.exit_code == 0, result.output
    with (out / "table.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row[name]) for row in rows] == pytest.approx([1.0 / SPEED, 2.0 / SPEED], rel=1e-9)


STEPPED_ROD = {**CONTINUOUS, "step": {"dt": LENGTH / SPEED / 400}}


@pytest.mark.parametrize("solve", [CONTINUOUS, MESH, STEPPED_ROD])
def test_an_extreme_without_a_place_is_that_along_the_rod(solve: dict[str, object]) -> None:
    """Compression is largest at each front; tension where the returning front is at the end of the run, x = 0.2 L."""
    names = ["max(strain:rod)", "min(strain:rod)"]
    found = il.sweep(case(solve), {VELOCITY: [1.0, 2.0]}, quantities=names)
    assert found["reason"].values.tolist() == ["", ""]
    most, least = (found[name].values * SPEED / np.array([1.0, 2.0]) for name in names)
    apart = 2.0 * DENSITY * AREA / MASS * LENGTH * (1 / 200 + 1 / 400)  # decay between frames and between places
    assert most == pytest.approx([1.0, 1.0], abs=apart)
    assert least == pytest.approx([tension(0.2 * LENGTH)] * 2, abs=apart)


def test_sensitivities_refuse_an_extreme_along_a_rod() -> None:
    with pytest.raises(il.CaseError, match=r"over all places of a rod .*\n.*il.Sampled\(\"stress:rod@X\", times\)"):
        il.sensitivities(case(), [VELOCITY], quantities=["max(stress:rod)"])


@pytest.mark.parametrize("solve", [CONTINUOUS, MESH])
def test_sensitivities_withhold_the_derivative_of_an_extreme(solve: dict[str, object]) -> None:
    found = il.sensitivities(case(solve), [VELOCITY], quantities=[f"max(strain:rod@{AT})", "peak_force"])
    extreme, peak = found.rows
    assert extreme.value == pytest.approx(1.0 / SPEED, rel=LOSS_IN_A_CELL)
    assert math.isnan(extreme.derivative)
    assert "il.Sampled" in extreme.reason
    assert peak.derivative == pytest.approx(DENSITY * SPEED * AREA, rel=LOSS_IN_A_CELL)


def test_uncertainties_of_an_extreme_are_printed_without_a_linear_estimate() -> None:
    """The stress is proportional to the velocity: their standard deviations have the same share of the means."""
    name = f"max(stress:rod@{AT})"
    found = il.uncertainty(case(), {VELOCITY: "normal(1 m/s, 5 %)"}, quantities=[name], samples=512)
    (spread,) = found.spreads
    assert spread.mean.value == pytest.approx(YOUNG / SPEED, rel=1e-2)
    assert spread.deviation.value / spread.mean.value == pytest.approx(0.05, rel=0.1)
    assert name in str(found).partition("No linear estimate")[0]
    assert [text.startswith(f"No linear estimate of {name}") for text in found.warnings] == [True]


def test_an_extreme_along_a_rod_does_not_hide_the_linear_estimates_of_other_quantities() -> None:
    names = ["max(stress:rod)", "peak_force"]
    found = il.uncertainty(case(), {VELOCITY: "normal(1 m/s, 5 %)"}, quantities=names, samples=64)
    along, peak = found.spreads
    assert math.isnan(along.linear_mean)
    assert along.mean.value == pytest.approx(YOUNG / SPEED, rel=1e-2)
    assert peak.linear_mean == pytest.approx(DENSITY * SPEED * AREA, rel=1e-9)
