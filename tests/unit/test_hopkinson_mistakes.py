"""Mistakes of a laboratory that signals of gauges show: polarity, triggers, exchanged gauges, offsets, late starts."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import pytest
from numpy import float64
from numpy.typing import NDArray

import impactlab as il
from impactlab import hopkinson
from impactlab.errors import DoubtfulResult, ImpactlabError, UnusualValue
from impactlab.history.instruments import Measured

Array = NDArray[float64]
DT = 1e-6
TIME = DT * np.arange(1200)
BAR = hopkinson.Bar(diameter=0.02, wave_speed=5000.0, density=8000.0, poisson=0.29, dispersion="none")


def pulse(start: float, size: float, length: float = 100e-6) -> Array:
    """Return a pulse with fronts of 20 us, shape (1200,)."""
    phase = np.clip(np.minimum(TIME - start, start + length - TIME) / 20e-6, 0.0, 1.0)
    return np.asarray(0.5 * size * (1.0 - np.cos(np.pi * phase)))


def gauges() -> tuple[Array, Array]:
    """Return both gauges, 0.75 m from a specimen that passes on two fifths of the wave."""
    return pulse(100e-6, 1e-3) - pulse(400e-6, 0.6e-3), pulse(400e-6, 0.4e-3)


def evaluated(incident: Array, transmission: Array) -> hopkinson.Test:
    return hopkinson.measured(incident, transmission, DT, BAR, (0.75, 0.75), far_ends=(2.0, 2.0))


def test_signals_as_they_should_be_are_usual() -> None:
    one, two = gauges()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for sign in (1.0, -1.0):
            test = evaluated(sign * one, sign * two)
            np.testing.assert_allclose(test.incident + test.reflected, test.transmitted, atol=1e-12)
        evaluated(one, np.zeros_like(two))  # nothing passes


def test_true_curves_of_compression_recorded_as_negative_are_warned_of() -> None:
    """A bar of 1 m compressed by 10 % has the true strain -ln 0.9; with the other sign it is ln 1.1 of one pulled."""
    ramp = np.linspace(0.0, 0.1, 5)
    curve = hopkinson.Curve(TIME[:5], ramp, 1e8 * ramp, 0.0 * ramp)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert curve.true.strain[-1] == pytest.approx(0.10536, abs=1e-5)
    with pytest.warns(UnusualValue, match=r"strain reaches -10 %.*compression positive"):
        assert hopkinson.Curve(TIME[:5], -ramp, -1e8 * ramp, 0.0 * ramp).true.strain[-1] == pytest.approx(-np.log(1.1))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda one, two: (one, -two), "transmitted wave and the incident wave have opposite signs"),
        (lambda one, two: (-one, two), "transmitted wave and the incident wave have opposite signs"),
        (lambda one, two: (one, np.roll(two, -30)), "half of its largest strain at 0.000381 s, .* at 0.000403 s"),
        (lambda one, two: (two - pulse(700e-6, 1e-4), one), "the order of the gauges"),
    ],
)
def test_polarity_trigger_and_order_are_named(change: Callable[[Array, Array], tuple[Array, Array]], said: str) -> None:
    with pytest.warns(UnusualValue, match=said):
        evaluated(*change(*gauges()))


def test_noise_that_is_taken_for_a_pulse_leads_to_the_threshold() -> None:
    one, two = gauges()
    noisy = one + 8e-5 * np.random.default_rng(1).standard_normal(one.size)
    with pytest.raises(ImpactlabError, match=r"give a threshold above 0\.05"):
        evaluated(noisy, two)
    waves = hopkinson.one_gauge(noisy, DT, BAR, 0.75, threshold=0.4)
    assert waves.to_right[300:330].mean() == pytest.approx(1e-3, rel=0.1)


def apart() -> tuple[Array, Array]:
    """Return gauges at 0.5 and 0.6 m of a bar that a pulse of 400 us runs along, to the right."""
    return pulse(200e-6, 1e-3, 400e-6), pulse(220e-6, 1e-3, 400e-6)


def test_an_offset_between_two_gauges_is_named_with_its_drift_and_taken_away() -> None:
    """5 um/m more in every 2 T = 40 us: 150 um/m in 1.2 ms."""
    one, two = apart()
    with pytest.warns(UnusualValue, match="differ by 5 um/m .* drift by 150 um/m"):
        drifted = hopkinson.two_gauges(one + 5e-6, two, DT, BAR, (0.5, 0.6), 0.5)
    assert np.abs(drifted.to_right - one).max() == pytest.approx(150e-6, rel=0.05)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        clean = hopkinson.two_gauges(one + 5e-6, two, DT, BAR, (0.5, 0.6), 0.5, zero=(0.0, 150e-6))
        hopkinson.two_gauges(one, two, DT, BAR, (0.5, 0.6), 0.5)
    np.testing.assert_allclose(clean.to_right, one, atol=1e-8)
    with pytest.raises(ImpactlabError, match="first gauge moves by"):
        hopkinson.two_gauges(one, two, DT, BAR, (0.5, 0.6), 0.5, zero=(0.0, 300e-6))


def test_two_gauges_on_a_bar_that_is_not_at_rest_at_the_first_sample_are_named() -> None:
    one, two = (row[300:] for row in apart())
    with pytest.warns(UnusualValue, match="begin the record before the first pulse"):
        hopkinson.two_gauges(one, two, DT, BAR, (0.5, 0.6), 0.5)


SPECIMEN = hopkinson.Specimen(length=0.005, diameter=0.01)


def shifted(distance: float = 0.75, late: int = 0) -> hopkinson.Curve:
    """Return the curve with a transmission record that begins late, and a wrong distance of the incident gauge."""
    one, two = gauges()
    test = hopkinson.measured(one, np.roll(two, late), DT, BAR, (distance, 0.75), far_ends=(2.0, 2.0))
    return hopkinson.evaluate(test, SPECIMEN)


@pytest.mark.parametrize("change", [{"late": 20}, {"late": 12}, {"distance": 0.70}])
def test_waves_that_do_not_belong_together_are_named(change: dict[str, float]) -> None:
    """The two faces of the specimen differ by the momentum of the specimen alone: 0.3 us of the incident force."""
    with pytest.warns(UnusualValue, match="the forces on the two faces of the specimen differ by an impulse"):
        shifted(**change)  # type: ignore[arg-type]


def test_waves_that_belong_together_are_usual() -> None:
    """A sample, or half a centimetre, is within what gauges and triggers are known to."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        shifted()
        shifted(late=1)
        shifted(distance=0.745)


def test_a_time_between_samples_in_another_unit_is_warned_of_and_no_more() -> None:
    """One second between samples, in place of one microsecond: the first rise is less than a sample long."""
    one, two = gauges()
    with pytest.warns(UnusualValue, match=r"of 0\.001 ms give 1e-06"), pytest.warns(DoubtfulResult):
        hopkinson.measured(one, two, 1e-3, BAR, (0.75, 0.75), far_ends=(2.0, 2.0))
    with pytest.warns(UnusualValue, match="time between samples is 1 s, longer than 10 us"):
        test = hopkinson.measured(one, two, 1.0, BAR, (0.75, 0.75), far_ends=(2.0, 2.0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusualValue)
        hopkinson.evaluate(test, hopkinson.Specimen(5e-3, 8e-3))


def test_distances_in_millimetres_and_exchanged_arguments_of_a_bar_are_warned_of() -> None:
    one, two = gauges()
    with pytest.warns(UnusualValue, match="of 750 mm give 0.75"), pytest.raises(ImpactlabError, match="record ends"):
        hopkinson.measured(one, two, DT, BAR, (750, 750))
    with pytest.warns(UnusualValue, match=r"The order is Bar\(diameter, wave_speed, density\)"):
        hopkinson.Bar(0.016, 7850.0, 5172.0)


def test_signals_are_taken_for_their_values() -> None:
    """As `il.read_signals` returns them, and as a history measures them."""
    one, two = gauges()
    signals = il.Signal("strain:a@0.75", TIME, one), Measured(TIME, two, 0)
    test = hopkinson.measured(signals[0], signals[1], DT, BAR, (0.75, 0.75), far_ends=(2.0, 2.0))  # type: ignore[arg-type]
    assert np.array_equal(test.transmitted, evaluated(one, two).transmitted)


def test_a_run_without_the_bars_names_its_rods() -> None:
    history = il.run(il.load_case("axial_impact").method("continuous"))
    with pytest.raises(ImpactlabError, match="there is no body 'incident' in this run") as refused:
        hopkinson.of_history(history)
    assert "Name one of the rods: rod." in str(refused.value)
    with pytest.raises(ImpactlabError, match="a History is needed"):
        hopkinson.of_history("axial_impact")  # type: ignore[arg-type]
