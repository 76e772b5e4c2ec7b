"""Probes of rigid masses have the values of the channels that every run has of its masses, whatever computes it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.api import summarised
from tests.solving import struck_rod

ROD: dict[str, Any] = {"length": 0.3, "area": 9.0e-4, "material": {"young": 2.1e11, "density": 7900}}
SOLVE: dict[str, dict[str, Any]] = {
    "modes": {"model": {"kind": "modal", "modes": 20}},
    "exact": {"model": {"kind": "continuous"}},
    "delay line": {"model": {"kind": "continuous"}, "step": {"dt": 1e-7}},
    "adaptive": {"model": {"kind": "finite_element", "elements": 10}, "integrator": {"kind": "adaptive"}},
    "tolerance": {"tolerance": 1e-2},
}


@pytest.mark.parametrize("name", SOLVE)
def test_a_probe_of_a_mass_is_its_position_or_velocity(name: str) -> None:
    """Exact runs listed such a channel and then refused it, so that the command left with 2 after the run."""
    law = {"kind": "hertz", "stiffness": 1e10} if name == "delay line" else {"kind": "penalty", "stiffness": 1e9}
    probes = [{"body": "hammer", "quantity": quantity} for quantity in ("displacement", "velocity")]
    case = struck_rod(law, {"duration": 1e-4, **SOLVE[name]}, probes=probes)
    history = il.run(case)
    t = np.linspace(0.0, history.duration, 101)
    for probed, own in (("displacement:hammer@0", "position:hammer"), ("velocity:hammer@0", "velocity:hammer")):
        assert probed in history.channels()
        assert history.evaluate(t, probed) == pytest.approx(history.evaluate(t, own), rel=1e-9, abs=1e-12)
        assert np.array_equal(history.jumps(probed), history.jumps(own))
    probes = summarised(case, history)[0]["probes"]
    assert probes["velocity:hammer@0"]["final"] == pytest.approx(history.at_end("velocity:hammer"))
    assert probes["displacement:hammer@0"]["max"] == pytest.approx(history.largest("position:hammer"), rel=1e-3)


@pytest.mark.parametrize("method", ["base", "continuous"])
def test_a_channel_that_is_no_text_is_refused(method: str) -> None:
    """TypeError: 'NoneType' object is not subscriptable."""
    history = il.run(il.load_case("axial_impact").method(method))
    with pytest.raises(il.ImpactlabError, match="hammer"):
        history.evaluate(1e-5, None)  # type: ignore[arg-type]
    for reader in (history.largest, history.jumps, history.turning_times, history.at_end):
        with pytest.raises(il.ImpactlabError, match="Did you mean 'position:hammer'"):
            reader("position:hamer")


@pytest.mark.parametrize("method", ["base", "continuous", "impulse_momentum"])
def test_a_contact_that_is_not_there_has_no_impulse(method: str) -> None:
    """Its impulse was 0, without a word."""
    history = il.run(il.load_case("axial_impact").method(method))
    for reader in (history.impulse_of, history.spans):
        with pytest.raises(il.ImpactlabError, match=r"^no contact 'hammer\|rod'\. Did you mean 'hammer\|rod\.left'\?"):
            reader("hammer|rod")
    assert history.impulse_of("hammer|rod.left") > 3.4


def test_a_field_of_no_rod_names_the_rods() -> None:
    """'no field 'stress' of 'hammer'. Did you mean 'stress'?'"""
    history = il.run(il.load_case("axial_impact").method("continuous"))
    for body in ("hammer", "rodd"):
        with pytest.raises(il.CaseError, match=rf"^no field of '{body}'\..*Rods and shafts: rod"):
            history.field(body, 1e-5, "stress")
    with pytest.raises(il.CaseError, match=r"^no field 'Stress' of 'rod'\. Did you mean 'stress'\?"):
        history.field("rod", 1e-5, "Stress")
