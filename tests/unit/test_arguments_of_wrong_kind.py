"""Arguments of a wrong kind are refused with an error of ours, which states the argument and a remedy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab import drilling, hopkinson, piling
from impactlab.measurement.dispersion import band_limit

MASS = "bodies.hammer.mass"


@pytest.fixture(scope="module")
def case() -> il.Case:
    return il.load_case("axial_impact").with_("solve.model", kind="continuous").with_("solve.duration", 1e-4)


@pytest.fixture(scope="module")
def pile() -> il.Case:
    return il.load_case("smith_pile")


@pytest.fixture(scope="module", params=["exact", "stepped", "delay line"])
def history(request: pytest.FixtureRequest, case: il.Case) -> Any:
    if request.param == "stepped":
        case = case.with_("solve.model", kind="modal", elements=10, modes=10)
    if request.param == "delay line":
        case = case.with_("contacts.0.law", kind="hertz", stiffness=1e9).with_("solve.step", dt=1e-6)
    return il.run(case)


def refused(call: Callable[[], object], *words: str) -> None:
    with pytest.raises(il.ImpactlabError) as caught:
        call()
    assert caught.value.remedy
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("given", [None, 3, (), (1,), [1, 2], {1}, object(), b"x", "x"])
def test_calls_that_take_a_case(given: Any) -> None:
    for call in (il.run, il.compare, drilling.blow, piling.blow):
        refused(lambda call=call: call(given))  # type: ignore[misc]


@pytest.mark.parametrize("given", [None, 3, (), [1], {1}, np.zeros(2), "x", il.load_case("axial_impact")])
def test_calls_that_take_a_history(given: Any) -> None:
    refused(lambda: drilling.blow_of(given), "il.run(case)")
    refused(lambda: hopkinson.sampled(given, "velocity:hammer", 1e6), "il.run(case)")
    refused(lambda: hopkinson.bar_of(given, "rod"), "il.run(case)")
    refused(lambda: band_limit(given))


@pytest.mark.parametrize("given", [None, 3, True, [1.0], [["a"]], [None], np.zeros((3, 3)), {1: 2}])
def test_names_that_are_no_texts(given: Any, case: il.Case) -> None:
    if given is not None:
        refused(lambda: il.compare(case, methods=given), "methods")
    refused(lambda: il.sweep(case, {MASS: [1, 2]}, quantities=given), "quantities")
    refused(lambda: il.sensitivities(case, given), "parameters")


@pytest.mark.parametrize("given", [3, 1.5, True, None, (1, 2), b"x"])
def test_a_path_of_the_case_that_is_no_text(given: Any, case: il.Case) -> None:
    refused(lambda: il.sweep(case, {given: [1, 2]}), "bodies.hammer.mass")


@pytest.mark.parametrize("given", [None, 1j, object(), len])
def test_values_of_an_axis_that_are_no_values(given: Any, case: il.Case) -> None:
    refused(lambda: il.sweep(case, {MASS: given}), MASS)


@pytest.mark.parametrize("given", [None, 3, [1], (), {1}, b"x", "a" * 3000, "\ud800.yaml"])
def test_paths_that_cannot_be(given: Any, case: il.Case) -> None:
    for call in (il.load_case, il.open_sweep, il.open_netcdf, il.run(case).to_netcdf):
        refused(lambda call=call: call(given))  # type: ignore[misc]


@pytest.mark.parametrize("given", [None, 3, [1], ["rod"], {1}, np.zeros(2)])
def test_channels_bodies_and_quantities(given: Any, history: Any) -> None:
    refused(lambda: history.evaluate(1e-5, given))
    refused(lambda: history.field(given, 1e-5, "stress"))
    refused(lambda: history.field("rod", 1e-5, given))
    refused(lambda: history.waves(given, 0.1))
    refused(lambda: history.impulse_of(given))
    refused(lambda: history.plot(given))


def test_a_field_at_several_times(history: Any) -> None:
    """Times instead of a time: numpy's error about shapes, or about scalars, before."""
    for times in ([1e-5, 2e-5], []):
        refused(lambda times=times: history.field("rod", times, "stress"), f"{len(times)} times")  # type: ignore[misc]


@pytest.mark.parametrize("given", ["1 mm", None, [0.1]])
def test_a_place_that_is_no_number(given: Any, history: Any) -> None:
    refused(lambda: history.waves("rod", given), "m")


def test_times_of_derivatives(case: il.Case) -> None:
    refused(lambda: il.run(case).jacobian("velocity:hammer", "1 us", [MASS]), "times")


@pytest.mark.parametrize("given", [None, 3, object()])
def test_rows_of_bodies(given: Any) -> None:
    refused(lambda: il.Case(bodies={"a": il.Mass(1.0)}, contacts=[il.Chain(given)], solve={"duration": 1.0}))
    refused(lambda: il.Case(bodies={}, mechanisms={"m": il.Mechanism(given)}, solve={"duration": 1.0}))


def test_rate_of_samples(case: il.Case) -> None:
    history = il.run(case)
    for rate in (None, "x", [1e6], 0.0, float("nan"), "1 mm"):
        refused(lambda rate=rate: hopkinson.sampled(history, "velocity:hammer", rate), "rate")  # type: ignore[misc]
    dt, values = hopkinson.sampled(history, "velocity:hammer", "1 MHz")
    assert dt == 1e-6
    assert values.shape == (101,)


@pytest.mark.parametrize("given", [0, True, 1.5, "2", None, 10**40])
def test_numbers_of_blows(given: Any, pile: il.Case) -> None:
    """10**40 blows ran on and on."""
    refused(lambda: piling.drive(pile, given), "blows")


@pytest.mark.parametrize("given", [3, [1], [None], {1: 2}, np.zeros((2, 2))])
def test_free_numbers_of_a_pile(given: Any, pile: il.Case) -> None:
    time = np.linspace(0.0, 0.02, 400)
    force = 1e6 * np.exp(-(((time - 4e-3) / 1e-3) ** 2))
    refused(lambda: piling.match(pile, time, force, force / 4e5, given), "toe.capacity")
    refused(lambda: piling.match(pile, time, force, force / 4e5, "toe.capacity", noise=np.zeros(2)), "noise")  # type: ignore[arg-type]


def test_generators_serve_as_rows() -> None:
    case = il.Case(
        bodies={name: il.Mass(1.0, velocity=1.0 if name == "a" else 0.0) for name in "abc"},
        contacts=[il.Chain((name for name in "abc"), {"kind": "hertz", "stiffness": 1e9})],  # type: ignore[arg-type]
        solve={"duration": 1e-4, "integrator": {"kind": "central_difference"}, "step": {"dt": 1e-6}},
    )
    assert [contact.name for contact in case.scene().contacts] == ["a|b", "b|c"]


def test_paths_serve_as_texts_and_paths(tmp_path: Path, case: il.Case) -> None:
    il.run(case).to_netcdf(tmp_path / "run.nc")
    assert il.open_netcdf(str(tmp_path / "run.nc")).duration == il.open_netcdf(tmp_path / "run.nc").duration


STIFFNESS = "contacts.0.law.stiffness"
TIMES = np.linspace(0.0, 1e-4, 20)


def ball() -> il.Case:
    return il.Case(
        bodies={"ball": il.Mass(1.0, velocity=1.0), "wall": il.Wall()},
        contacts=[il.Contact("ball", "wall", {"kind": "penalty", "stiffness": 1e7})],
        solve={"duration": 1e-3, "integrator": {"kind": "central_difference"}, "step": {"dt": 1e-6}},
    )


@pytest.mark.parametrize("given", [3, "x", [(STIFFNESS, 1)], {STIFFNESS: None}, {STIFFNESS: 3}, {3: (1, 2)}])
def test_parameters_of_a_fit(given: Any) -> None:
    refused(lambda: il.fit(ball(), il.Signal("force:ball|wall", TIMES, TIMES), parameters=given))


@pytest.mark.parametrize("given", [3, "x", [3], np.zeros(3), {"a": 1}, il.load_case("axial_impact")])
def test_signals_of_a_fit(given: Any) -> None:
    refused(lambda: il.fit(ball(), given, parameters={STIFFNESS: (1e6, 1e8)}), "il.Signal")


@pytest.mark.parametrize("given", [None, 3, "x", {"a": 1}, [3], [(1, 2, 3)], [(1, 2)], [ball()]])
def test_experiments_of_a_fit(given: Any) -> None:
    refused(lambda: il.fit(given, parameters={STIFFNESS: (1e6, 1e8)}))


@pytest.mark.parametrize("given", [None, 3, "x", {}, TIMES + 1j, [TIMES]])
def test_samples_of_a_signal(given: Any) -> None:
    """Imaginary parts were dropped."""
    refused(lambda: il.Signal("force:ball|wall", TIMES, given), "force:ball|wall")
    refused(lambda: il.Signal("force:ball|wall", given, TIMES), "force:ball|wall")
