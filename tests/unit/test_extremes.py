"""Extremes of channels: of contacts that are short beside the run, of thinned records, of links."""

from __future__ import annotations

import math
from typing import Any

import pytest

import impactlab as il
from impactlab.history.extremes import extremes
from tests.solving import in_steps

STIFFNESS = 1e9


def struck_rod(law: dict[str, Any], **solve: Any) -> il.Case:
    return il.Case(
        bodies={"hammer": il.Mass(0.2, velocity=1.0), "rod": il.Rod(length=0.3, area=9e-4, material="steel")},
        contacts=[il.Contact("hammer", "rod.left", law, gap=0.0 if law["kind"] == "slack" else 3.3e-4)],
        solve=solve,
    )


@pytest.mark.parametrize("duration", [1e-3, 1.0])
def test_a_contact_far_shorter_than_the_run_keeps_its_extremes(duration: float) -> None:
    # The contact lasts 45 us. Force and overlap of a spring are proportional; 257 instants of a half sine miss its top
    # by (pi/512)^2/2 = 2e-5 at most.
    history = il.run(
        struck_rod({"kind": "penalty", "stiffness": STIFFNESS}, duration=duration, model={"kind": "continuous"})
    )
    (span,) = history.contacts
    assert span.peak_force is not None
    assert history.largest("force:hammer|rod.left") == span.peak_force
    assert extremes(history, "force:hammer|rod.left")[0] == 0.0
    assert extremes(history, "gap:hammer|rod.left")[0] == pytest.approx(-span.peak_force / STIFFNESS, rel=4e-5)
    assert extremes(history, "velocity:hammer")[1] == 1.0


def test_a_sweep_over_exact_runs_finds_the_peak_of_a_short_contact() -> None:
    case = struck_rod({"kind": "penalty", "stiffness": STIFFNESS}, duration=1.0, model={"kind": "continuous"})
    wanted = ["peak_force", "max(force:hammer|rod.left)"]
    found = il.sweep(case, {"bodies.hammer.velocity": [1.0, 2.0]}, quantities=wanted)
    peaks = found["peak_force"].values.ravel()
    assert found[wanted[1]].values.ravel() == pytest.approx(peaks, rel=1e-12)
    assert peaks[1] == pytest.approx(2.0 * peaks[0], rel=1e-9)  # linear


@pytest.mark.parametrize("integrator", ["midpoint", "central_difference", "adaptive"])
def test_extremes_of_a_stepped_force_include_its_peak_between_records_and_no_time_after_the_run(
    integrator: str,
) -> None:
    step = 1e-6
    case = il.Case(
        bodies={"ball": il.Mass(0.2, velocity=1.0), "wall": il.Wall()},
        contacts=[il.Contact("ball", "wall", {"kind": "hertz", "stiffness": 1e10}, gap=3.3e-4)],
        solve={**in_steps(1000.3217 * step, integrator, dt=step), "records": 100},  # the last step ends after the run
    )
    history = il.run(case)
    (span,) = history.contacts
    assert span.peak_force is not None
    # K d^(3/2) with d = (5 m v^2/(4 K))^(2/5), within an error of the step of (dt/T)^2
    exact = 1e10 * (5.0 * 0.2 / (4.0 * 1e10)) ** 0.6
    assert span.peak_force == pytest.approx(exact, rel=1e-3)
    assert history.largest("force:ball|wall") == pytest.approx(span.peak_force, rel=1e-4)
    assert extremes(history, "force:ball|wall")[1] == history.largest("force:ball|wall")


def test_extremes_of_the_force_of_a_link_are_those_of_its_result() -> None:
    history = il.run(struck_rod({"kind": "slack", "stiffness": STIFFNESS}, duration=0.1, model={"kind": "continuous"}))
    (link,) = history.links
    least, largest = extremes(history, "force:hammer|rod.left")
    assert (least, largest) == pytest.approx((link.smallest, link.largest), rel=1e-12)
    assert math.isclose(history.largest("force:hammer|rod.left"), link.largest)


def test_an_adaptive_force_never_pulls_where_its_law_does_not() -> None:
    """Between its steps the impulse is an interpolant, which may fall by its tolerance beside a contact."""
    case = il.Case(
        bodies={"ball": il.Mass(0.2, velocity=1.0), "wall": il.Wall()},
        contacts=[il.Contact("ball", "wall", {"kind": "hertz", "stiffness": 1e10}, gap=3.3e-4)],
        solve=in_steps(1e-3, "adaptive", dt=1e-3),
    )
    assert extremes(il.run(case), "force:ball|wall")[0] == 0.0
