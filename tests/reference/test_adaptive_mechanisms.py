"""Adaptive steps as the reference of mechanisms: closed forms, the midpoint rule's way to them, and references."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab import api
from impactlab.refine.references.reference_record import FULL_BUDGET_S, physics_key
from impactlab.report.summary import summarise
from tests.reference.chains import document
from tests.reference.test_mechanisms import BARS, TURNED, arm, double_pendulum, slider_crank
from tests.support import CASES

TIGHT = 1e-10


def adaptively(case: il.Case, tolerance: float = TIGHT, **options: Any) -> il.Case:
    """Return a case solved by adaptive steps, no longest one given."""
    scheme = {"kind": "adaptive", "relative_tolerance": tolerance, **options}
    return case.with_settings({"solve.integrator": scheme, "solve.step": {"points_per_period": 10}})


@pytest.mark.parametrize("method", ["DOP853", "Radau", "LSODA"])
def test_two_rigid_links_swing_as_in_the_textbook(method: str) -> None:
    history = il.run(adaptively(document(BARS, TURNED, 1.0, 1e-3, gravity=[0.0, -9.81]), method=method))
    found = [float(history.evaluate(1.0, f"angle:{name}")) for name in BARS]
    assert found == pytest.approx(double_pendulum(1.0), abs=1e-7)
    assert history.energy.largest_gain < 1e-7
    assert history.energy.largest_loss < 1e-7


def test_a_slider_stands_where_crank_and_rod_put_it_and_its_drive_does_the_work() -> None:
    """Rigid links: the closed form of the slider; the moment of the drive over its turn is the energy gained."""
    bodies = {"crank": BARS["one"] | {"length": 0.1}, "rod": BARS["two"] | {"length": 0.3}}
    links = [{"body": "crank", "angle": -1.9, "drive": {"rate": 30.0}}, {"body": "rod", "end_mass": 0.5}]
    law = {"kind": "hertz", "stiffness": 1e9}
    contacts = [{"between": ["rod.right", "stop"], "along": "x", "gap": 1.0, "law": law}]
    bodies["stop"] = {"kind": "wall"}
    history = il.run(adaptively(document(bodies, links, 0.1, 1e-4, end={"slide": 0.02}, contacts=contacts), 1e-11))
    t = np.linspace(0.0, 0.1, 20001)  # the recorded instants
    crank = -1.9 + 30.0 * t
    place = 0.1 * np.cos(crank) + np.sqrt(0.3**2 - (0.02 - 0.1 * np.sin(crank)) ** 2)
    assert float(np.abs(history.evaluate(t, "position:rod.right") - place).max()) < 1e-12
    moment = history.evaluate(t, "drive:crank")
    work = 30.0 * float(np.sum(0.5 * (moment[1:] + moment[:-1])) * (t[1] - t[0]))
    assert history.energy.work[-1] == pytest.approx(work, rel=1e-7)
    energy = history.energy.bodies["chain"]
    assert energy[-1] - energy[0] == pytest.approx(work, abs=1e-7 * float(energy.max()))


def spans(case: il.Case) -> list[float]:
    """Return ends, impulses and largest forces of all contacts, one after the other."""
    return [
        value for span in il.run(case).contacts for value in (span.end or 0.0, span.impulse, span.peak_force or 0.0)
    ]


def test_the_midpoint_rule_tends_to_it_at_second_order_on_a_slider_crank() -> None:
    exact = il.run(adaptively(slider_crank(1e-6), 1e-8))  # known to 1e-9, a ten-thousandth of the errors of the steps
    errors = []
    for dt in (4e-6, 2e-6):
        history = il.run(slider_crank(dt))
        channels = ("velocity:block", "angle:rod", "drive:crank")
        found = [abs(float(history.evaluate(9e-3, name) - exact.evaluate(9e-3, name))) for name in channels[:2]]
        errors.append([*found, abs(history.contacts[0].impulse - exact.contacts[0].impulse)])
    assert np.array(errors[0]) / np.array(errors[1]) == pytest.approx([4.0] * 3, rel=0.1)
    assert exact.contacts[0].impulse == pytest.approx(1.03820, rel=1e-5)
    t = np.linspace(0.0, 9e-3, 301)
    moment = exact.evaluate(t, "drive:crank")
    assert float(np.abs(history.evaluate(t, "drive:crank") - moment).max()) < 0.01 * float(np.abs(moment).max())


def test_the_midpoint_rule_tends_to_it_at_second_order_in_the_first_sub_impact_of_an_arm() -> None:
    exact = np.array(spans(adaptively(arm(26, 1e-6, 5e-4))))
    errors = [np.abs(np.array(spans(arm(26, dt, 5e-4))) / exact - 1.0) for dt in (2e-6, 1e-6)]
    assert errors[0][1] / errors[1][1] == pytest.approx(4.0, rel=0.1)
    assert exact[[0, 1, 2]] == pytest.approx([0.3562e-3, 0.022734, 118.51], rel=1e-4)
    assert float(errors[1].max()) < 2e-5


def test_the_second_contact_of_two_links_is_settled() -> None:
    """Its times within 1 ns in the tolerance; shapes move them by 0.2 us from 20 to 36, and by 10 ns beyond."""
    case = il.load_case(CASES / "two_link_arm.yaml")
    found = {}
    for modes, axial, tolerance in ((20, 6, 1e-8), (20, 6, 1e-11), (36, 12, 1e-8)):
        shapes = {"solve.model": {"kind": "modal", "elements": 160, "modes": modes}}
        settings = shapes | {"mechanisms.robot.links.1.axial_modes": axial}
        _, second = il.run(adaptively(case.with_settings(settings), tolerance)).contacts
        found[modes, axial, tolerance] = second.start, second.end
    assert found[20, 6, 1e-8] == pytest.approx(found[20, 6, 1e-11], abs=1e-9)
    assert found[20, 6, 1e-11] == pytest.approx((9.663606e-3, 10.017736e-3), abs=1e-9)
    assert found[36, 12, 1e-8] == pytest.approx((9.663763e-3, 10.017896e-3), abs=1e-9)


def test_a_run_by_the_midpoint_rule_is_measured_against_it_on_request() -> None:
    case = il.load_case(CASES / "two_link_arm.yaml")
    scene, method = case.simulation()
    unasked, judge = api.summarised(case, il.run(case))
    assert judge is unasked["errors"] is None  # it costs more than ten times the run
    assert unasked["reference"]["status"] == "not_computed"
    reference = api.reference_of(scene, method, FULL_BUDGET_S)
    assert reference is not None
    assert reference.name == "converged"
    assert reference.found.startswith("adaptive steps between located events")
    assert reference.uncertainty < 1e-5
    runs = [il.run(case.with_settings({"solve.step": {"dt": dt}})) for dt in (4e-6, 2e-6)]
    errors = [summarise("arm", history, reference)["errors"] for history in runs]
    for metric in ("impulse", "mass_displacement"):
        assert errors[0][metric] / errors[1][metric] == pytest.approx(4.0, rel=0.2)
    assert errors[0]["impulse"] < 1e-3


def test_shapes_of_links_belong_to_a_reference_and_steps_do_not() -> None:
    case = il.load_case(CASES / "two_link_arm.yaml")
    own = physics_key(*case.simulation())
    assert physics_key(*case.with_settings({"solve.step": {"dt": 1e-6}}).simulation()) == own
    assert physics_key(*case.method("few_modes").simulation()) != own


def test_a_law_of_impulses_on_a_mechanism_has_no_reference() -> None:
    law = {"contacts.0.law": {"kind": "velocity_complementarity"}}
    assert api.reference_of(*il.load_case(CASES / "two_link_arm.yaml").with_settings(law).simulation()) is None


def test_a_bar_at_rest_on_a_stop_is_pressed_on_it_by_its_weight_and_not_lifted() -> None:
    """Faces that touch at rest close where the acceleration, with the torque, points into the stop."""
    bodies = {"bar": {"kind": "link", "length": 1.0, "mass": 0.6}, "stop": {"kind": "wall"}}
    law = {"kind": "penalty", "stiffness": 1e5}
    contacts = [{"between": ["bar.right", "stop"], "along": "y", "law": law}]
    for torque, touches in ((1.0, 1), (-1.0, 0)):
        links = [{"body": "bar", "torque": torque}]
        history = il.run(adaptively(document(bodies, links, 1e-3, 1e-5, contacts=contacts)))
        assert sum(span.start == 0.0 for span in history.contacts) == touches
    # with an effective mass of 0.2 kg at the tip and 1 N on it the spring swings about 10 um
    history = il.run(adaptively(document(bodies, [{"body": "bar", "torque": 1.0}], 1e-2, 1e-5, contacts=contacts)))
    swing = math.sqrt(1e5 / 0.2)
    t = np.linspace(0.0, 8e-3, 50)
    assert history.evaluate(t, "position:bar.right") == pytest.approx(1e-5 * (1.0 - np.cos(swing * t)), abs=2e-9)


def test_trial_steps_far_too_long_are_shortened() -> None:
    """One of them ended in a ZeroDivisionError: its stages are so far away that the mass matrix loses all digits."""
    beam = {"kind": "beam", "length": 0.1, "section": {"width": 0.006, "height": 0.006}, "material": "steel"}
    bodies = {"arm": beam, "stop": {"kind": "mass", "mass": 0.1}}
    law = {"kind": "penalty", "stiffness": 1e5}
    contacts = [{"between": ["stop", "arm.right"], "along": "y", "law": law}]
    case = document(bodies, [{"body": "arm", "rate": -1.0, "end_mass": 0.1}], 0.01, 1e-5, contacts=contacts)
    history = il.run(adaptively(case.with_("solve.model", {"kind": "modal", "elements": 20, "modes": 3}), 1e-8))
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-6
    assert history.evaluate(0.01, "velocity:stop") == pytest.approx(
        -history.impulse_of("stop|arm.right") / 0.1, rel=1e-9
    )


def test_the_beam_that_spins_up_converges_to_adaptive_steps_with_order_two() -> None:
    """The benchmark past its largest lag: the midpoint rule, extrapolated from two steps, meets scipy's Radau.

    Times are ends of steps, as the motion is a line between them.
    """
    t = np.arange(1, 41) * 0.2
    coarse = {"solve.duration": 8.0, "solve.model": {"kind": "modal", "elements": 40, "modes": 3}}
    case = il.load_case(CASES / "spinning_up_beam.yaml").with_settings(coarse)

    def tip(run: il.Case) -> np.ndarray[Any, Any]:
        history = il.run(run)
        return np.array([history.evaluate(t, f"position:beam.right along {along}") for along in "xy"])

    exact = tip(adaptively(case, 1e-7, method="Radau"))
    steps = [tip(case.with_settings({"solve.step": {"dt": dt}})) for dt in (0.02, 0.01, 0.005)]
    errors = [float(np.abs(each - exact).max()) for each in steps]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.02)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.02)
    assert errors[2] < 2e-5  # m
    extrapolated = (4.0 * steps[2] - steps[1]) / 3.0
    assert float(np.abs(extrapolated - exact).max()) < 1e-6  # m: Radau's tolerance on a motion of 10 m
