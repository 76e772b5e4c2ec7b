"""A chosen run against the next coarser one, where its tolerance does not bound: probes, and forces beside a jump."""

import math

import numpy as np
import pytest

import impactlab as il
from impactlab.history.base import AbstractHistory
from impactlab.metrics.norms import midpoints, relative_l2

STEEL = {"young": 210e9, "density": 7850.0}
AREA, SPEED = 5.8e-4, 0.787
BEAM = {"theory": "timoshenko", "length": 0.5, "section": {"width": 0.02, "height": 0.02}, "material": "steel"}
SHEAR, MOMENT = "shear_force:beam@0.5", "bending_moment:beam@0"


def warned(history: AbstractHistory, code: str) -> list[str]:
    return [each.text for each in history.warnings if each.code == code]


def struck_beam(right: dict[str, float], **solve: object) -> il.Case:
    probes = [
        {"body": "beam", "at": 0.5, "quantity": "shear_force"},
        {"body": "beam", "at": 0.0, "quantity": "bending_moment"},
    ]
    return il.Case(
        bodies={"ball": il.Mass(0.1, velocity=1.0), "beam": il.Beam(**BEAM, ends={"left": "clamped", "right": right})},
        contacts=[il.Contact("ball", "beam.at(0.2)", law={"kind": "hertz", "stiffness": 1e9})],
        probes=probes,
        solve={"duration": 0.002, **solve},
    )


def test_a_shear_force_that_is_far_off_within_a_tolerance_is_warned_of():
    found = il.run(struck_beam({"dashpot": 300.0}, tolerance=1e-2))
    texts = warned(found, "probe_not_converged")
    assert len(texts) == 1
    assert SHEAR in texts[0]
    assert MOMENT not in texts[0]
    fine = {"model": {"kind": "finite_element", "elements": 480}, "step": {"dt": 2e-7}}
    exact, t = il.run(struck_beam({"dashpot": 300.0}, **fine)), midpoints(0.002, 2000)
    error = {name: relative_l2(found.evaluate(t, name), exact.evaluate(t, name)) for name in (SHEAR, MOMENT)}
    assert error[SHEAR] > 3e-2  # three times the tolerance, which the contact keeps
    assert error[MOMENT] < 1e-2
    force = found.recorded["force:ball|beam.at(0.2)"].values, exact.recorded["force:ball|beam.at(0.2)"].values
    assert np.max(force[0]) == pytest.approx(np.max(force[1]), rel=1e-2)


def test_probes_that_have_converged_are_not_warned_of():
    found = il.run(struck_beam({"mass": 0.5}, tolerance=1e-3))
    assert not warned(found, "probe_not_converged")


def struck_rod(law: dict[str, float | str] | None, **solve: object) -> il.Case:
    return il.Case(
        bodies={
            "hammer": il.Mass(0.0445, velocity=SPEED),
            "rod": il.Rod(length=0.4141, area=AREA, material=STEEL, damping={"mass": 957.0}),
        },
        contacts=[{"between": ["hammer", "rod.left"], "gap": 2e-7, **({"law": law} if law else {})}],
        solve={"duration": 6e-4, **solve},
    )


def test_a_largest_force_at_the_front_of_a_hard_impact_is_warned_of():
    found = il.run(struck_rod(None, tolerance=1e-2))
    assert found.choice.met
    first = math.sqrt(STEEL["young"] * STEEL["density"]) * AREA * SPEED  # N: impedance times speed, before any damping
    assert found.contacts[0].peak_force < 0.8 * first  # far beyond the tolerance of 1e-2
    assert [text for text in warned(found, "peak_not_converged") if "hammer|rod.left" in text]


def test_a_smaller_tolerance_brings_it_closer():
    first = math.sqrt(STEEL["young"] * STEEL["density"]) * AREA * SPEED
    peaks = [il.run(struck_rod(None, tolerance=error)).contacts[0].peak_force for error in (1e-2, 3e-4)]
    assert abs(peaks[1] - first) < 0.25 * abs(peaks[0] - first)


def test_a_smooth_largest_force_is_not_warned_of():
    hertz = {"kind": "hertz", "stiffness": 3e9}
    found, fine = (il.run(struck_rod(hertz, tolerance=error)) for error in (1e-2, 1e-4))
    assert found.contacts[0].peak_force == pytest.approx(fine.contacts[0].peak_force, rel=1.01e-2)
    assert not warned(found, "peak_not_converged")


def test_no_word_where_peak_forces_do_not_count():
    found = il.run(struck_rod(None, tolerance=1e-2, tolerance_on=["displacements", "impulses"]))
    assert not warned(found, "peak_not_converged")
