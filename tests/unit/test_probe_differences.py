"""Probes of a chosen run against the next coarser one: a tolerance bounds contacts, not internal forces."""

import numpy as np
import pytest

import impactlab as il
from impactlab.metrics.norms import midpoints, relative_l2

BEAM = {"theory": "timoshenko", "length": 0.5, "section": {"width": 0.02, "height": 0.02}, "material": "steel"}
SHEAR, MOMENT = "shear_force:beam@0.5", "bending_moment:beam@0"


def struck(right: dict[str, float], **solve: object) -> il.Case:
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
    found = il.run(struck({"dashpot": 300.0}, tolerance=1e-2))
    texts = [warned.text for warned in found.warnings if warned.code == "probe_not_converged"]
    assert len(texts) == 1
    assert SHEAR in texts[0]
    assert MOMENT not in texts[0]
    fine = {"model": {"kind": "finite_element", "elements": 480}, "step": {"dt": 2e-7}}
    exact, t = il.run(struck({"dashpot": 300.0}, **fine)), midpoints(0.002, 2000)
    error = {name: relative_l2(found.evaluate(t, name), exact.evaluate(t, name)) for name in (SHEAR, MOMENT)}
    assert error[SHEAR] > 3e-2  # three times the tolerance, which the contact keeps
    assert error[MOMENT] < 1e-2
    force = found.recorded["force:ball|beam.at(0.2)"].values, exact.recorded["force:ball|beam.at(0.2)"].values
    assert np.max(force[0]) == pytest.approx(np.max(force[1]), rel=1e-2)


def test_probes_that_have_converged_are_not_warned_of():
    found = il.run(struck({"mass": 0.5}, tolerance=1e-3))
    assert not [warned for warned in found.warnings if warned.code == "probe_not_converged"]
